/* firmware/linux/player/player.h - runs a planned job on a machine, tick by
 * tick.
 *
 *   ENABLE -> HOME -> APPROACH -> MOVE -> SETTLE -> STOP -> end
 *      |        |        |         |        |       ^
 *      '--------'--------'---------'--------'-------'   fault, or the operator
 *
 *   ENABLE    drives start up and get torque                  (ready)
 *   HOME      axes of the move whose position is not known find it out
 *   APPROACH  every axis that is not where the move begins goes there, at a
 *             quarter of its limits; then a short rest
 *   MOVE      the tracks, as often as they are to be played; what goes to
 *             another place of the move in between is recorded as APPROACH
 *   SETTLE    the axes come to rest; the end errors are measured
 *   STOP      torque off, until every drive says so
 *
 * The last of it, and what a fault or the operator makes of it, is the way out of
 * every machine (firmware/linux/machine/shutdown.h): the phase stays what it was
 * while the group comes to rest along its path, is SETTLE while it stands, or the
 * drives brake, and STOP while torque goes.
 *
 * The loop counts the figures of the report and puts a row into a recorder.
 * What rows are for besides (CSV, trace, progress) is done in player_observe:
 * by another thread when the clock is real, between ticks when it is virtual.
 * So is reading ahead in a compiled move. */
#ifndef FIRMWARE_LINUX_PLAYER_PLAYER_H
#define FIRMWARE_LINUX_PLAYER_PLAYER_H

#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "firmware/host/job/job.h"
#include "firmware/host/recording/telemetry.h"
#include "firmware/host/recording/trace.h"
#include "firmware/linux/machine/machine.h"
#include "firmware/linux/machine/machine_fault.h"
#include "firmware/linux/machine/shutdown.h"
#include "firmware/linux/player/arrivals.h"
#include "firmware/linux/player/can_log.h"
#include "firmware/linux/player/loads.h"
#include "firmware/linux/player/progress.h"
#include "firmware/linux/player/recorder.h"
#include "firmware/linux/player/report.h"
#include "firmware/linux/player/run_follow.h"
#include "firmware/linux/player/run_keys.h"
#include "firmware/linux/player/run_record.h"
#include "firmware/linux/player/run_start.h"
#include "firmware/linux/player/shots.h"

/* What is done with the rows; NULL where nothing is. */
struct player_observer {
    struct telemetry *telemetry;
    struct run_record *record;
    struct can_log *can_log;
    struct trace *trace;
    struct report *report;
    struct shots *shots;
    struct arrivals *arrivals;
    struct progress *progress;
    struct run_keys *keys; /* and what the operator presses */
};

struct player_config {
    bool realtime;
    int64_t override_q30;    /* 1 % .. 200 % */
    int64_t from_ns_q12;     /* of the move's time: begins there */
    int64_t times;           /* to be played; 0: once, -1: until a stop */
    bool is_ping_pong;       /* every second time in reverse */
    int64_t hold_at_ns;      /* of the move's time; -1: never */
    int64_t resume_after_ns; /* standing */
    int64_t start_wall_ns;   /* of the wall clock; 0: when the axes are ready */
    struct hal_gpio *start_line; /* or at an edge of it; NULL: none */
    struct loads *loads;         /* of a simulated rig; NULL: none */
    struct run_follow *follow; /* a clock that it keeps to, and starts by; NULL:
                                  none.  The observer has keys then */
    struct machine_fault *faults; /* what happens to simulated drives; NULL:
                                     nothing */
    int64_t observe_ns; /* on the clock, from one time that rows are written
                                to the next; 0: 20 ms */
};

struct player {
    struct machine *machine;
    const struct job *job;
    struct player_config config;
    struct player_observer observer;
    struct recorder recorder;
    struct run_start start;

    int64_t start_ns, now_ns; /* nominal */
    int64_t phase_ns;         /* since when */
    int64_t move_ns;          /* clock time when the move was started */
    int64_t standing_ns;      /* since when a hold stands; -1: it does not */
    enum telemetry_phase phase;
    enum report_end end;
    bool ended, approaching, is_arming, held;
    bool stopped; /* the operator has asked for a stop by a key */
    struct shutdown shutdown;
    int64_t late_ns;

    /* one per axis or bus of the rig */
    struct memory_pool memory;
    int64_t *busy_ns;         /* at the start of the move */
    struct telemetry_row row; /* being filled in */
};

/* A player that is all zero, or that was made before and is given back. */
void player_init(struct player *player, struct machine *machine,
                 const struct job *job, const struct player_config *config,
                 const struct player_observer *observer);

void player_free(struct player *player);

/* Until the end.  `interrupts` counts the operator's interrupts: one stops
 * along the path, two stop at once; read at every tick.  0, or -1 when no
 * thread could be started.  The report is filled in. */
int player_run(struct player *player, const volatile sig_atomic_t *interrupts);

#endif
