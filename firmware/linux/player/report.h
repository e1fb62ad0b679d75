/* firmware/linux/player/report.h - how a run went, in numbers.
 *
 * Fed on every tick; keeps the worst of each.  Demand is what was sent:
 * velocity, acceleration and jerk with the override and the ramps of hold and
 * stop in them. */
#ifndef FIRMWARE_LINUX_PLAYER_REPORT_H
#define FIRMWARE_LINUX_PLAYER_REPORT_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "firmware/control/controller.h"
#include "firmware/host/job/job.h"
#include "firmware/host/recording/telemetry.h"
#include "firmware/linux/machine/machine.h"
#include "firmware/linux/player/report_warning.h"

struct arrivals;
struct loads;
struct machine_fault;
struct shots;

/* Of one axis of the move. */
struct report_axis {
    int64_t peak[4]; /* |v|, |a|, |j| at 1..3, in their formats */
    int64_t following_q32;
    int64_t end_q32; /* actual position at the end */
    int64_t still_q32;
    int64_t still_ns; /* since then it is near there, by its following floor */
    int64_t dur_ns;   /* from the start until the axis was at its end */
    bool arrived;
    bool moves; /* by the last row */
    struct hal_drive_events events;
    struct report_warnings warnings;
};

struct report_bus {
    double load; /* share of the wire's time during the move */
    uint32_t warnings;
    int64_t warned_ns;            /* the first, from the start of the run */
    struct hal_modbus_stats line; /* Modbus, at the end; all zero */
};

enum report_end {
    REPORT_DONE,
    REPORT_FAULT,
    REPORT_STOPPED, /* by the operator, along the path */
    REPORT_QUICK_STOPPED,
};

struct report {
    struct memory_pool memory; /* of the arrays */
    const struct job *job;
    enum report_end end;
    struct report_axis *axis; /* of each axis of the move */
    bool started;             /* the move has */
    int64_t start_ns, played_ns;
    int64_t path_ns_q12;       /* how far the move was played */
    uint32_t set_points_crc32; /* of every tick's positions, in the move */
    int64_t times;             /* to its end */
    bool is_repeated;          /* was to be played more than once */
    struct report_bus *bus;    /* of each bus */
    struct controller_fault_record fault;
    int64_t fault_ns,
        fault_stop_ns; /* of the run: when it was seen, and all set
                                        points stood after it; 0: not yet */
    bool monitored;    /* the fault is a limit that the rig has for its drive */
    char fault_text[256]; /* the drive's own words, or homing's */
    bool torque_left;     /* a drive did not say at the end that it is off: */
    char (*torque)[MACHINE_TORQUE_MAX]; /* of each axis of the rig: "", or why,
                                           in words */
    uint64_t ticks, ticks_lost, rows_dropped, frames_dropped;
    /* rows that could not be written, of each file */
    uint64_t telemetry_lost, record_lost;
    bool realtime;
    char followed[128];            /* how well a clock was followed, or "" */
    const struct shots *shots;     /* NULL: none */
    const struct frame_step *step; /* of a shoot that waits; NULL: none */
    const struct loads *loads;     /* of a simulated rig; NULL: none */
    const struct machine_fault *faults; /* of a fault script; NULL: none */
    const struct arrivals *arrivals;
    int64_t late_ns; /* worst wake-up after its time */
    const char *telemetry_path, *record_path, *can_log_path,
        *plot_path; /* NULL: none */
};

/* A report that is all zero, or that was made before and is given back. */
void report_init(struct report *report, const struct job *job);
void report_free(struct report *report);
void report_take(struct report *report, const struct telemetry_row *row);
/* Where axis i of the move should be at the end, less where it is: the sign of a
 * following error. */
int64_t report_end_error(const struct report *report, unsigned i);
/* Return when all axes stood after the fault, by what their drives say, to within the
 * floor of their following error; 0: not by the end of the run, or it is not
 * known, as a drive is lost. */
int64_t report_stopped_ns(const struct report *report);
/* "done", "stopped by a fault" ... */
const char *report_end_text(enum report_end end);
/* "pan: the axis does not follow ...: REASON"; "" when there is none. */
#define REPORT_FAULT_MAX 480
void report_fault_text(const struct report *report,
                       char text[REPORT_FAULT_MAX]);
void report_print(const struct report *report, FILE *file);
void report_json(const struct report *report, FILE *file);

#endif
