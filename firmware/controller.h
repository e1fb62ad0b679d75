/* firmware/controller.h - axes, states, faults: the portable controller.
 *
 *            enable            start             end of move
 *     OFF ----------> READY ----------> MOVING ----------------> READY
 *      ^                ^  ^              |  ^
 *      |                |  |         hold |  | resume
 *      |                |  |              v  |
 *      |                |  +-- stop -- HOLDING        (rate 0, torque on)
 *      |                |       from MOVING: STOPPING until rate is 0, then READY
 *      |                |
 *      +---- off -------+     any state -- fault --> FAULT (latched)
 *      +---- reset (cause gone, at rest) ------------'
 *
 * One call of controller_step per tick does everything: looks at drives and
 * inputs, moves the clock warp on, samples every track at the same path time,
 * passes each set point through the last gate and hands it to its drive.  It
 * knows motion and the hal interfaces, no concrete driver, no file, no clock:
 * time is an argument.  No heap, no lock.
 *
 * Hold, resume and override are ramps of the clock that reads the move: the
 * shortest ramp that keeps every axis within its limits is searched at the tick
 * of the request, at most CONTROLLER_RAMP_TRIES lengths; when none fits at this
 * point of the move (an axis is already braking at its limit) the search is
 * repeated every tick until one does.  A stop for a fault does the same within
 * the stop limits and falls back on the drives' own quick stop.
 *
 * Faults latch (shared rules: docs/FAULTS.md).  A fault on one axis stops the
 * group; nothing starts again without reset, enable and start. */
#ifndef FIRMWARE_CONTROLLER_H
#define FIRMWARE_CONTROLLER_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/drive.h"
#include "hal/gpio.h"
#include "motion/clock_warp.h"
#include "motion/track.h"

#define CONTROLLER_AXES_MAX   16
#define CONTROLLER_RAMP_TRIES 24

enum controller_state {
    CONTROLLER_OFF,
    CONTROLLER_READY,
    CONTROLLER_MOVING,
    CONTROLLER_HOLDING,
    CONTROLLER_STOPPING,
    CONTROLLER_FAULT,
};
const char *controller_state_text(enum controller_state state);

/* X(name, sentence) */
#define CONTROLLER_FAULT_LIST(X)                                               \
    X(CONTROLLER_FAULT_NONE, "no fault")                                       \
    X(CONTROLLER_FAULT_DRIVE, "the drive reports a fault")                     \
    X(CONTROLLER_FAULT_OFFLINE, "the drive is not on the bus any more")        \
    X(CONTROLLER_FAULT_STATE, "the drive left operation by itself")            \
    X(CONTROLLER_FAULT_STALE, "position feedback is too old")                  \
    X(CONTROLLER_FAULT_FOLLOWING, "the axis does not follow its set points")   \
    X(CONTROLLER_FAULT_GATE, "a set point was outside the axis's limits")      \
    X(CONTROLLER_FAULT_ESTOP, "the e-stop input is active")                    \
    X(CONTROLLER_FAULT_LIMIT_SWITCH, "a limit switch is active")               \
    X(CONTROLLER_FAULT_ENABLE, "the drive did not enable in time")             \
    X(CONTROLLER_FAULT_OVERRUN, "ticks were lost")                             \
    X(CONTROLLER_FAULT_BUS, "the bus is down")

enum controller_fault {
#define CONTROLLER_FAULT_ENUM(name, text) name,
    CONTROLLER_FAULT_LIST(CONTROLLER_FAULT_ENUM)
#undef CONTROLLER_FAULT_ENUM
};
const char *controller_fault_text(enum controller_fault fault);

/* What happened first, with the values that tripped it. */
struct controller_fault_record {
    enum controller_fault fault;
    int axis; /* -1: none in particular */
    int64_t t_ns;
    int64_t value, limit; /* in the format of the quantity; ns for ages */
    uint16_t drive_code;
};

struct controller_axis_config {
    int64_t pos_min_q32, pos_max_q32;
    struct motion_clock_limit limit; /* of the move */
    struct motion_clock_limit stop;  /* for stopping after a fault, >= limit */
    int64_t following_floor_q32;     /* fault above max(floor, k * |v|) */
    int64_t following_k_ns;          /* k as a time: k * |v| is v times this */
};

struct controller_config {
    int64_t period_ns;           /* tick */
    int64_t feedback_max_age_ns; /* stale above; 0: 3 periods */
    int64_t enable_timeout_ns;   /* 0: 5 s */
    unsigned axis_count;
    struct controller_axis_config axis[CONTROLLER_AXES_MAX];
};

/* What one axis was told and did at the last tick. */
struct controller_axis {
    struct hal_drive *drive;
    const struct motion_track *track; /* NULL: stands where it is */
    struct motion_cursor cursor;
    struct hal_drive_target target;
    struct hal_drive_feedback feedback;
    int64_t following_q32;   /* effective demand minus actual */
    int64_t sent_pos_q32[4]; /* set points, newest first */
    int64_t sent_ns[4];
    int64_t sent_vel_q32; /* slope of the last two */
    unsigned sent_count;
};

struct controller {
    struct controller_config config;
    enum controller_state state;
    struct controller_fault_record fault;
    struct controller_axis axis[CONTROLLER_AXES_MAX];
    struct hal_gpio *estop; /* NULL: none */
    struct motion_clock_warp warp;
    struct motion_clock_rate rate; /* at the last tick */
    int64_t move_end_ns_q12;
    int64_t override_q30; /* what the operator asked for */
    int64_t wanted_q30;   /* rate the clock should go to: 0 or override */
    int64_t state_since_ns, step_ns;
    bool moving_to_stop; /* STOPPING ends in FAULT or READY */
    uint64_t ticks, overruns;
};

int controller_init(struct controller *controller,
                    const struct controller_config *config,
                    struct hal_drive *const drive[], struct hal_gpio *estop);

/* Commands.  MOTION_OK, or MOTION_E_STATE when not possible in this state;
 * nothing has changed then. */
int controller_enable(struct controller *controller); /* OFF -> READY, later */
int controller_off(struct controller *controller);    /* READY -> OFF */
/* READY -> MOVING.  One track per axis (NULL: stands still).  The tracks must
 * outlive the move.  MOTION_E_LIMIT when an axis is not where its track starts
 * (*axis says which, when not NULL). */
int controller_start(struct controller *controller,
                     const struct motion_track *const track[], int *axis);
int controller_hold(struct controller *controller);
int controller_resume(struct controller *controller);
int controller_stop(struct controller *controller);
/* 0..200 %, as Q30; takes effect by a ramp, also while moving. */
int controller_override(struct controller *controller, int64_t rate_q30);
/* FAULT -> OFF, when every cause is gone. */
int controller_reset(struct controller *controller);

/* The tick.  `now_ns` grows; a gap of more than a period and a half counts as
 * an overrun.  `bus_ok` false: the fieldbus reported that it is gone. */
void controller_step(struct controller *controller, int64_t now_ns,
                     bool bus_ok);

/* Share of the move that has been played, 0 .. 2^30, and time left at the
 * present override, in ns. */
int64_t controller_progress_q30(const struct controller *controller);
int64_t controller_time_left_ns(const struct controller *controller);

#endif
