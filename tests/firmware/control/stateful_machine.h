/* tests/firmware/control/stateful_machine.h - what the bench of stateful.h moves:
 * drives with axes and switches, boards, the e-stop, an output. */
#ifndef TESTS_FIRMWARE_CONTROL_STATEFUL_MACHINE_H
#define TESTS_FIRMWARE_CONTROL_STATEFUL_MACHINE_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/drive.h"
#include "hal/gpio.h"

#define STATEFUL_AXES   6
#define STATEFUL_GIVEN  8
#define STATEFUL_BOARDS 3
#define STATEFUL_TOLD                                                          \
    256 /* set points that a board's drive keeps; a power of 2 */

/* --- a drive and what it moves --------------------------------------------- */

enum stateful_switch {
    STATEFUL_NEGATIVE,
    STATEFUL_POSITIVE,
    STATEFUL_HOME,
    STATEFUL_SWITCHES
};

/* Active from low to high, places of the drive's own coordinates. */
struct stateful_zone {
    bool there, by_drive; /* an input of the drive, no line */
    int64_t low_q32, high_q32;
};

enum stateful_order {
    STATEFUL_NO_ORDER,
    STATEFUL_ORDER_GO,
    STATEFUL_ORDER_HALT
};

#define STATEFUL_SAID_TICKS 4 /* until what a drive has done is known */

/* Goes to positions by itself. */
struct stateful_profile {
    /* what it is like */
    bool there, halts;
    int delay_ticks;  /* until a go or a halt takes effect */
    int arrive_ticks; /* until it says that it is there */
    int busy_ticks;   /* after a go, until it takes the next */
    double share;     /* of the speed asked for */
    int64_t short_q32;
    bool is_bad; /* it will be late, or not there */
    /* what it does */
    bool on, halting, arrived, seen_arrived;
    int still;   /* ticks since it was last on its way */
    double part; /* of 2^-32 unit that it has gone beyond its position */
    enum stateful_order pending;
    struct hal_drive_go go, next;
    int wait, busy, arrive;
    bool taken; /* a go, in this tick */
};

struct stateful_board;

struct stateful_axis {
    struct hal_drive drive;
    struct stateful_profile profile;
    struct stateful_board *board; /* which samples its track; NULL: none does */
    /* what it is like */
    int64_t period_ns;
    int enable_ticks, off_ticks, reset_ticks;
    int64_t droop_q32;
    double brake; /* unit/s2: quick stop, coasting */
    double scale; /* of its unit: 1 where it does some 50 per s */
    struct stateful_zone zone[STATEFUL_SWITCHES];
    bool has_stops; /* it comes no further, and then reports all its torque */
    int64_t stop_q32[2];
    /* what it does */
    enum hal_drive_state state;
    enum hal_drive_request request;
    int wait;        /* ticks until the request is done */
    bool ill, away;  /* a fault that stays; not on the bus */
    int stale_ticks; /* feedback stands still */
    double runaway;  /* unit/s2, whatever it is told; 0: it follows */
    double lag_s;    /* something holds it back: comes after so long; 0: none */
    int64_t slip_q32;
    int64_t now_ns;
    int64_t pos_q32, sag_q32; /* of the axis; what the load takes of it */
    double vel;
    int pressed; /* against a stop: -1, 1; 0: none */
    struct {
        int64_t pos_q32, t_ns;
    } given[STATEFUL_GIVEN]; /* newest first; in force two periods later */
    unsigned given_count;
    int64_t hold_q32; /* in force before the first of them */
    struct {
        int64_t pos_q32, vel_q32, t_ns;
        int64_t demand_q32; /* in force then; not reported */
    } seen;                 /* what the last SYNC latched */
    /* homing of its own */
    bool homes, home_fails;
    int home_ticks, mode_ticks;
    double home_vel;
    enum hal_drive_mode mode, next_mode;
    enum hal_drive_homing homing;
    int64_t home_q32; /* the place becomes this one */
    /* what it was told in this tick, with torque on */
    bool told, is_first;
    int64_t told_q32;
    bool may_enable, enabled_unasked; /* only while a command runs */
    /* torque was to go off in this tick, in this state and mode */
    bool is_cut;
    enum hal_drive_state cut_state;
    enum hal_drive_mode cut_mode;
    double cut_vel;
    /* of a board: where its own set point is, whether that has been heard since it
     * was enabled, and the last of ours */
    bool is_known;
    const struct motion_track *track;
    int64_t own_q32;
    int64_t told_ns[STATEFUL_TOLD], told_then_q32[STATEFUL_TOLD];
    unsigned told_count; /* ever */
};

struct stateful_line {
    struct hal_gpio gpio;
    const struct stateful_axis *axis; /* NULL: a channel of the e-stop */
    enum stateful_switch which;
    bool active;
};

void stateful_axis_init(struct stateful_axis *axis);
void stateful_axis_request(struct hal_drive *drive,
                           enum hal_drive_request request);
/* What was asked for is done, once its time has come. */
void stateful_axis_walk(struct stateful_axis *axis);
/* One period passes. */
void stateful_axis_advance(struct stateful_axis *axis);
/* SYNC: latch what feedback will say. */
void stateful_axis_sync(struct stateful_axis *axis);
bool stateful_axis_switch(const struct stateful_axis *axis,
                          enum stateful_switch which);
bool stateful_profile_is_on(const struct stateful_profile *profile);
/* On its way, as far as anybody can know: a bad one may never be there. */
bool stateful_profile_is_open(const struct stateful_profile *profile);
void stateful_profile_end(struct stateful_profile *profile);
int stateful_profile_go(struct stateful_axis *axis,
                        const struct hal_drive_go *go);
int stateful_profile_halt(struct stateful_axis *axis);
void stateful_profile_advance(struct stateful_axis *axis, double dt);
/* With torque, and following set points. */
bool stateful_axis_follows(const struct stateful_axis *axis);
int64_t stateful_axis_demand_q32(const struct stateful_axis *axis);
bool stateful_axis_has_torque(const struct stateful_axis *axis);
extern const struct hal_gpio_ops stateful_line_ops;

/* --- a board ------------------------------------------------------------------ */

/* What it is told next; one thing at a time. */
enum stateful_order_of_board {
    STATEFUL_BOARD_NOTHING,
    STATEFUL_BOARD_LOAD,
    STATEFUL_BOARD_START,
    STATEFUL_BOARD_RAMP,
    STATEFUL_BOARD_STOP,
};

enum stateful_board_does {
    STATEFUL_BOARD_STANDS,
    STATEFUL_BOARD_WAITS,
    STATEFUL_BOARD_PLAYS,
    STATEFUL_BOARD_RESTS, /* comes to rest after a stop */
};

/* Its clock reads the path in ticks of its own. */
struct stateful_board_clock {
    double s, rate, accel;      /* s: in ticks too */
    double from;                /* the rate where the ramp began */
    int64_t steps;              /* since it was in step with ours */
    struct hal_drive_ramp ramp; /* the last one */
    bool ramp_waits, ramp_on;
    int64_t ramp_step;
};

struct stateful_board {
    /* what it is like */
    int64_t period_ns;
    unsigned count;
    struct stateful_axis *axis[STATEFUL_AXES];
    int turn_ticks; /* from a question to its answer */
    int lag_ticks;  /* its ticks come so much after ours, 0 or 1 */
    int watch_ticks;
    double rest_s; /* from full rate to rest */
    bool has_ramps;
    /* mishaps */
    int late_ticks;  /* no answer for so long */
    bool is_deaf;    /* does not stop, nor take torque off before it stands */
    int heard_ticks; /* it has not been so for as many */
    /* what we know of it */
    int64_t now_ns;
    enum hal_drive_track state;
    bool stops;
    int turn;
    int stood; /* looks since it stands */
    int64_t start_ns;
    int64_t rate_q30;
    bool is_told; /* it has said that it will: start, or change its rate */
    enum stateful_order_of_board order;
    int wait;
    /* what it does */
    enum stateful_board_does does;
    struct stateful_board_clock clock;
    double end_s;
    int unheard; /* ticks since it was asked last */
    /* to be judged */
    bool was_refused; /* told too late: a reason for what comes then */
};

void stateful_board_init(struct stateful_board *board);
/* One period passes. */
void stateful_board_advance(struct stateful_board *board);
bool stateful_board_moves(const struct stateful_board *board);
/* By our clock, or about to. */
bool stateful_board_plays(const struct stateful_board *board);
/* It is told to stop, and then asked until it stands; in no time for a quick
 * one. */
void stateful_board_stop(struct stateful_board *board);
void stateful_board_fault(struct stateful_board *board);
extern const struct hal_drive_ops stateful_board_ops;

/* --- the e-stop -------------------------------------------------------------- */

#define STATEFUL_CHANNELS 2

/* A button with contacts that need not work. */
struct stateful_estop {
    unsigned channels;
    int64_t discrepancy_ns;
    struct stateful_line line[STATEFUL_CHANNELS];
    int press_ticks[STATEFUL_CHANNELS], release_ticks[STATEFUL_CHANNELS];
};

#endif
