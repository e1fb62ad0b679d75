/* firmware/control/controller.h - axes, states, faults: the portable
 * controller.
 *
 *            enable            start             end of move
 *     OFF ----------> READY ----------> MOVING ----------------> READY
 *      ^               | ^               |   ^
 *      |               | |          hold |   | resume
 *      |<---- off -----' |      cue      v   |
 *      |                 |----------> HOLDING     slows to rate 0, torque on
 *      |                 |               |
 *      |                 '-- at rest -- STOPPING <-- stop -- MOVING, HOLDING
 *      |                                 |
 *      |                                 | a fault caused the stop
 *      '------ reset ------- FAULT <-----'
 *
 * One call of controller_step per tick does everything: looks at drives and
 * inputs (watch.c), moves the clock of the move on
 * (ramp_step.c), samples every track at the same path time, passes each
 * set point through the last gate (gate.c) and hands it to its
 * drive.  It includes motion and the hal interfaces, no concrete driver, no file,
 * no clock: time is an argument.  No heap, no lock.
 *
 * Hold, resume, stop and override are ramps of the clock that reads the move:
 * the path stays the same to the bit, also in reverse (path.c), which is turned
 * to at rest alone.  They are found step by step, as steep as keeps every axis
 * within its limits, some of it per tick (ramp_step.h); where nothing fits (an axis
 * is already braking at its limit) the search goes on until something does.  Rest is
 * due within a time that is computed at the request: in good time before it the
 * search goes over to the stop limits.  A stop for a fault uses the stop
 * limits, starts at once and falls back on the drives' own quick stop.
 *
 * A stop cannot fail: it is accepted in every state and every tick, also the
 * one in which a motion was started, and watched until the axes are at rest.
 * The time that takes has a bound (rest_by_ns) at which the drives' quick stop
 * takes over.
 *
 * An axis with torque is supervised from the first tick on that its drive
 * reports torque: while others still enable it is held where it stood then.
 *
 * An axis whose drive goes by its own profile has the same track, as a
 * prediction, and gets the ends of its motions as goals instead of set points
 * (goal.h).
 *
 * Faults latch; all but those that only ask to hold end without torque.  A
 * fault on one axis stops the group; nothing starts again
 * without reset, enable and start. */
#ifndef FIRMWARE_CONTROL_CONTROLLER_H
#define FIRMWARE_CONTROL_CONTROLLER_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/couple.h"
#include "firmware/control/estop.h"
#include "firmware/control/gantry.h"
#include "firmware/control/goal.h"
#include "firmware/control/ramp_limit.h"
#include "firmware/control/ramp_scheduled.h"
#include "hal/drive.h"
#include "hal/fieldbus.h"
#include "hal/gpio.h"
#include "motion/core/clock_warp.h"
#include "motion/core/track.h"

MOTION_C_BEGIN

#define CONTROLLER_AXES_MAX 64
#define CONTROLLER_HISTORY  4 /* set points kept to judge following */

enum controller_state {
    CONTROLLER_OFF,
    CONTROLLER_READY,
    CONTROLLER_MOVING,
    CONTROLLER_HOLDING,
    CONTROLLER_STOPPING,
    CONTROLLER_FAULT,
};
const char *controller_state_text(enum controller_state state);

/* How the group reacts; a stronger one is never softened by a later fault.
 *   HOLD   along the path within the stop limits, then torque stays on and the
 *          axes stand, until reset or off
 *   STOP   along the path within the stop limits, then torque off
 *   QUICK  the drives' own quick stop at once, then torque off
 *   OFF    torque off at once */
enum controller_reaction {
    CONTROLLER_REACT_NONE,
    CONTROLLER_REACT_HOLD,
    CONTROLLER_REACT_STOP,
    CONTROLLER_REACT_QUICK,
    CONTROLLER_REACT_OFF,
};

/* X(name, reaction, sentence) */
#define CONTROLLER_FAULT_LIST(X)                                               \
    X(CONTROLLER_FAULT_NONE, CONTROLLER_REACT_NONE, "no fault")                \
    X(CONTROLLER_FAULT_DRIVE, CONTROLLER_REACT_STOP,                           \
      "the drive reports a fault")                                             \
    X(CONTROLLER_FAULT_OFFLINE, CONTROLLER_REACT_STOP,                         \
      "the drive is not on the bus any more")                                  \
    X(CONTROLLER_FAULT_STATE, CONTROLLER_REACT_STOP,                           \
      "the drive left operation by itself")                                    \
    X(CONTROLLER_FAULT_STALE, CONTROLLER_REACT_STOP,                           \
      "position feedback is too old")                                          \
    X(CONTROLLER_FAULT_FOLLOWING, CONTROLLER_REACT_STOP,                       \
      "the axis does not follow its set points")                               \
    X(CONTROLLER_FAULT_GATE, CONTROLLER_REACT_QUICK,                           \
      "a set point was outside the axis's limits")                             \
    X(CONTROLLER_FAULT_ESTOP, CONTROLLER_REACT_STOP,                           \
      "the e-stop input is active")                                            \
    X(CONTROLLER_FAULT_LIMIT_SWITCH, CONTROLLER_REACT_STOP,                    \
      "a limit switch is active")                                              \
    X(CONTROLLER_FAULT_ENABLE, CONTROLLER_REACT_STOP,                          \
      "the drive did not enable in time")                                      \
    X(CONTROLLER_FAULT_OVERRUN, CONTROLLER_REACT_STOP, "ticks were lost")      \
    X(CONTROLLER_FAULT_MASTER, CONTROLLER_REACT_STOP,                          \
      "another master speaks on the bus")                                      \
    X(CONTROLLER_FAULT_BUS_FULL, CONTROLLER_REACT_STOP,                        \
      "the bus takes no more frames")                                          \
    X(CONTROLLER_FAULT_BUS_PASSIVE, CONTROLLER_REACT_HOLD,                     \
      "the bus has too many errors (error-passive)")                           \
    X(CONTROLLER_FAULT_BUS, CONTROLLER_REACT_OFF, "the bus is down")           \
    X(CONTROLLER_FAULT_REST, CONTROLLER_REACT_QUICK,                           \
      "the axes were not at rest in time")                                     \
    X(CONTROLLER_FAULT_TRACK, CONTROLLER_REACT_STOP,                           \
      "the move was not read in time")                                         \
    X(CONTROLLER_FAULT_ARRIVAL, CONTROLLER_REACT_STOP,                         \
      "the axis was not where it was sent in time")                            \
    X(CONTROLLER_FAULT_ESTOP_CHANNELS, CONTROLLER_REACT_STOP,                  \
      "the two channels of the e-stop disagree")                               \
    X(CONTROLLER_FAULT_RUNAWAY, CONTROLLER_REACT_OFF, "the axis runs away")    \
    X(CONTROLLER_FAULT_GUARDIAN, CONTROLLER_REACT_STOP,                        \
      "the guardian was lost")                                                 \
    X(CONTROLLER_FAULT_COUNTER, CONTROLLER_REACT_QUICK,                        \
      "a set point beyond the end of the drive's counter")                     \
    X(CONTROLLER_FAULT_RACKING, CONTROLLER_REACT_STOP,                         \
      "the rails of the gantry rack its bridge")                               \
    X(CONTROLLER_FAULT_INPUT, CONTROLLER_REACT_STOP,                           \
      "an input of an e-stop or a limit switch cannot be read")

enum controller_fault {
#define CONTROLLER_FAULT_ENUM(name, reaction, text) name,
    CONTROLLER_FAULT_LIST(CONTROLLER_FAULT_ENUM)
#undef CONTROLLER_FAULT_ENUM
};
const char *controller_fault_text(enum controller_fault fault);

/* What happened first, with the values that tripped it. */
struct controller_fault_record {
    enum controller_fault fault;
    int axis; /* -1: none in particular */
    int64_t t_ns;
    int64_t value, limit; /* Q32.32 units, ns for ages, ticks for overruns */
    uint16_t drive_code;
    char reason[64]; /* the drive's own words, "" where there are none */
    bool is_whole; /* code and reason are what they remain: a drive may be asked
                        for them first, CONTROLLER_REASON_NS at most */
    struct hal_fieldbus_worst bus; /* in that tick */
};
#define CONTROLLER_REASON_NS INT64_C(1000000000)

struct controller_axis_config {
    /* its range; a set point may be MOTION_TRACK_POS_ROUNDING beyond.  Not the
     * last values of int64 */
    int64_t pos_min_q32, pos_max_q32;
    struct motion_clock_limit limit; /* of the move */
    struct motion_clock_limit stop;  /* for stopping after a fault, >= limit */
    int64_t following_floor_q32;     /* fault above max(floor, |v| * k) */
    int64_t following_k_ns;
    /* feed-forward: permille of the rated torque per unit/s2; 0: none */
    int64_t torque_q32;
    int64_t feedback_max_age_ns; /* of this axis; 0: the controller's */
    /* its drive goes to goals by its own profile, and may be so much late */
    bool by_goals;
    int64_t late_ns;
    bool needs_homing; /* its position means nothing before it was homed */
};

struct controller_config {
    int64_t period_ns;           /* tick, 62500 .. 20000000 */
    int64_t feedback_max_age_ns; /* stale above; 0: 4 periods */
    int64_t enable_timeout_ns;   /* without a step of any drive; 0: 5 s */
    int64_t stop_timeout_ns;     /* quick stop to rest; 0: 5 s */
    unsigned axis_count;         /* 1 .. CONTROLLER_AXES_MAX */
    const struct controller_axis_config *axis; /* of each; stays the caller's */
    /* What the search for a change of rate may take in a tick, in 100 instructions
     * of a Cortex-M4; 0: 103 less 10 per axis, or 7 per axis where that is more. */
    int effort;
};

/* Lines that are read every tick; NULL: there is none.  One that cannot be read
 * counts as active. */
struct controller_switches {
    struct hal_gpio *limit_negative, *limit_positive;
    struct hal_gpio *home; /* looked at while homing */
};
struct controller_inputs {
    struct hal_gpio *estop[2]; /* channels; see estop.h */
    int64_t discrepancy_ns;    /* between them, > 0; one alone: 0 */
    const struct controller_switches *axis; /* of each; NULL: no switches */
};

/* What one axis was told and did at the last tick.  Positions are the axis's:
 * those of the drive plus the offset that homing found. */
struct controller_axis {
    struct hal_drive *drive;
    struct controller_switches switches;
    int64_t offset_q32;
    /* Its position is known; else it moves by jogs alone, and its range does
     * not count. */
    bool homed : 1;
    /* Looks for a switch: homing judges its limit switches, and its range does
     * not count. */
    bool seeking : 1;
    /* The drive is in a mode of its own: the axis gets no set points; a fault is
     * a quick stop of the drives. */
    bool by_profile : 1;
    /* by_goals: its drive, at stands_q32, and is to stay there. */
    bool stands : 1;
    bool is_faster : 1; /* than at its last answer */
    unsigned away : 2;  /* ticks in a row that it has run away for */
    uint8_t sent_count; /* of sent_q32 */
    const struct motion_track *track; /* NULL: stands where it is */
    struct motion_cursor cursor;
    struct controller_cam *cam; /* follows another axis; NULL: none */
    /* of the other rail of its gantry, which takes it along; NULL: none */
    const struct motion_track *along;
    struct controller_leg leg; /* by_goals */
    int64_t stands_q32;
    int64_t vel_peak_q32; /* of the track at rate 1 */
    struct hal_drive_target target;
    struct hal_drive_feedback feedback;
    int64_t following_q32;   /* demand in force minus actual */
    int64_t following_k_q62; /* following_k_ns in seconds */
    /* the largest and the smallest place where its motions began since its
     * range counts: an axis that stands outside may not go further out */
    int64_t highest_q32, lowest_q32;
    int64_t sent_q32[CONTROLLER_HISTORY]; /* set points, newest first */
    int64_t sent_ns[CONTROLLER_HISTORY];
    /* limits of the gate per tick, from config, and what rounding may add */
    int64_t gate_vel_q32, gate_acc_q32;
    int32_t rounding_q32;
    uint32_t sent_far; /* 4 bits of each set point, newest first: see gate.c */
    struct controller_share share;
};

/* A change of rate in steps; see ramp_step.h.  Rates per tick, Q56. */
enum controller_step_stage { STEP_NONE, STEP_SPAN, STEP_AXIS, STEP_READY };
struct controller_step_state {
    int64_t rate_q56, accel_q56, path_ns_q12; /* path: the clock's */
};
/* At the peaks of the tracks: J, and in ticks, Q4, 1 / A by p'' and, per rate, by
 * p''', and the root of 1 / J. */
struct controller_step_rest {
    int64_t jerk_q56;
    int32_t accel_q4, cross_q4, root_q4;
};
/* A change of rate that begins in a tick to come; see ramp_scheduled.h. */
enum controller_scheduled_state {
    CONTROLLER_SCHEDULED_NONE,
    CONTROLLER_SCHEDULED_FIRST,  /* of its ramps is judged, */
    CONTROLLER_SCHEDULED_SECOND, /* the second */
    CONTROLLER_SCHEDULED_FITS,   /* it waits for its tick */
    CONTROLLER_SCHEDULED_BEGUN,  /* in force until its end */
};
struct controller_scheduled {
    enum controller_scheduled_state state;
    struct controller_ramp ramp;
    struct motion_clock_unit unit; /* of ramp.tick_ns */
    int64_t begin_ns, second_ns;   /* of either ramp, on clock_ns */
    int64_t peak_q56;              /* of r', per ramp.tick_ns */
    int32_t change, flat;          /* in ticks of the controller, */
    int64_t slope_q56;             /* and r'' on the way to the peak */
    struct controller_step_state peak;
};
struct controller_step {
    /* of the tracks */
    struct controller_step_rest rest[2]; /* by the limits, the stop limits */
    struct controller_scales scales;
    struct motion_clock_unit unit;
    int64_t tick_q56, tick_ns_q12; /* s */
    int64_t least_q56, most_q56;   /* of r'' */
    /* of the target */
    bool stop;
    bool
        is_asked; /* for it just now: what is left is of the tick that follows */
    int spent;    /* in this tick, of config.effort */
    int64_t target_q30;
    int64_t reach_q56, back_q56; /* r'' to the target and back to r' = 0, */
    int64_t room_q56, cap_q56;   /* r', as far as is known */
    int64_t level_q56[2];        /* r'' that brings a rise to r' = 0, by both */
    unsigned early; /* successive candidates that were done sooner */
    int32_t lead;   /* ticks from when a candidate is made to its begin */
    /* the candidate */
    enum controller_step_stage stage;
    bool is_finish, is_early,
        is_rise, /* r' > 0 that may be brought to 0 sooner */
        is_fall; /* r' > 0 that is, for n[0] ticks steeper than has been judged */
    unsigned tries;
    int64_t begin_ns, s_ns_q12;
    struct controller_step_state from;
    int32_t left; /* ticks that what is under way levels in */
    int32_t wait; /* of a fall, as many as a next one takes to be judged */
    int32_t n[2]; /* ticks of both pieces, */
    int64_t slope_q56[2], peak_q56; /* r'' in them, and r' in between */
    int64_t rise_accel_q56;         /* the largest r' of a rise */
    int64_t fall_q56[2];   /* r'' that may do so, within the limits and the */
    int32_t fall_ticks[2]; /* stop limits, and for how many ticks at most */
    int64_t rise_q56[2];   /* of what is in force, these r''; 0: none */
    /* how far it is judged */
    struct controller_step_state at;
    unsigned piece;
    int32_t tick, cut; /* of the piece; of a span, at most */
    int32_t jerk, back_q10;
    int64_t accel_q40, gain_q40;
    uint8_t shift;
    /* the span */
    struct controller_span span;
    struct controller_step_state to; /* after it, h ticks */
    int32_t h;
    bool is_new;   /* a candidate's first */
    unsigned axis; /* that is judged, and how far: */
    int64_t along_ns_q12;
    struct motion_range range[3];
    struct controller_verdict verdict;
    struct controller_scheduled scheduled;
};

struct controller {
    struct controller_config config;
    enum controller_state state;
    struct controller_fault_record fault; /* latched; NONE when there is none */
    struct hal_fieldbus_worst bus;        /* in this tick */
    enum controller_reaction reaction;
    struct controller_axis *axis; /* of each; the caller's */
    struct controller_estop estop;
    struct motion_clock_warp warp;
    struct motion_clock_rate rate; /* of the path, at the last tick; negative in
                                      reverse, where the warp's is positive */
    bool is_reversed;              /* played from its end to its start */
    int64_t move_end_ns_q12;
    int64_t reserve_ns_q12;   /* path time that a stop may need */
    int64_t override_q30;     /* what the operator asked for */
    int64_t override_max_q30; /* what the move's limits allow */
    int64_t wanted_q30;       /* where the clock should go to */
    struct controller_step step;
    int64_t rest_by_ns; /* HOLDING, STOPPING: on clock_ns, when the axes are at
                           rest at the latest, else it is a fault; 0: they
                           are, or the drives brake */
    unsigned stops;     /* times that controller_stop was called */
    struct controller_jog *jog; /* what is played, at rate 1; NULL: a move */
    /* NULL: no axis was ever coupled */
    const struct controller_couplings *couplings;
    const struct controller_gantries *gantries; /* NULL: there is none */
    struct controller_gantry *gantry;
    unsigned gantry_count;
    bool is_brake; /* what is played is itself a stop */
    bool homing;   /* homing moves the axes: nobody else starts a motion */
    bool is_held;  /* not resumed yet, also where a leg of homing has ended */
    bool enabling, resetting;
    bool is_asked;    /* enabling: the drives were asked, all without torque */
    int64_t since_ns; /* entry into the state, or the request */
    uint32_t steps;   /* of all drives, and when they were so many first */
    int64_t step_ns;
    int64_t now_ns;
    /* The clock that the warp runs on: one period per tick, whatever was lost,
     * so that no set point is further from the one before than a period. */
    int64_t clock_ns;
    uint64_t ticks, ticks_lost; /* nominal ticks, lost ones included */
    unsigned lost_score;        /* leaky: +10 per lost tick, -1 per good one */
};

/* `axis`, one per axis, is the caller's and filled in here; it and config->axis
 * must outlive the controller.  MOTION_E_ARG for a period, an axis count or a
 * limit out of range.  `inputs` may be NULL. */
int controller_init(struct controller *controller,
                    const struct controller_config *config,
                    struct controller_axis axis[],
                    struct hal_drive *const drive[],
                    const struct controller_inputs *inputs);

/* Commands.  MOTION_OK, or MOTION_E_STATE when not possible in this state;
 * nothing has changed then.  They take effect at the next tick. */
/* OFF, READY follows.  Drives that still have torque, being switched off, lose
 * it first: what comes then is known to begin where the axis is. */
int controller_enable(struct controller *controller);
/* READY -> OFF; also ends the torque that a fault has left on (HOLD). */
int controller_off(struct controller *controller);
/* What an axis is to reach while it has a track, in the order of time; before
 * the start, in READY, and for one start.  The goals (controller_goals_of) must
 * outlive the move.  MOTION_E_STATE; MOTION_E_ARG for an axis that gets set
 * points. */
int controller_set_goals(struct controller *controller, unsigned index,
                         const struct controller_goal goal[], unsigned count);
/* READY -> MOVING.  One track per axis (NULL: stands still).  The tracks must
 * outlive the move.  A window (track.h) must be moved on between ticks; where
 * it does not reach as far as a stop may need, that is a fault.  MOTION_E_ARG
 * when an axis that goes to goals has a track and no goals, MOTION_E_UNHOMED
 * when an axis with a track has not been homed, MOTION_E_AWAY when one does not
 * stand where its track starts (*axis says which, when not NULL),
 * MOTION_E_LIMIT when a track is beyond the limits at 100 % (*axis is -1). */
int controller_start(struct controller *controller,
                     const struct motion_track *const track[], int *axis);
/* READY -> HOLDING at path time at_ns_q12, where the axes have to stand: resume
 * goes on from there.  As controller_start; MOTION_E_ARG also for a time outside
 * the tracks, and of a window for one that is not 0. */
int controller_cue(struct controller *controller,
                   const struct motion_track *const track[], int64_t at_ns_q12,
                   int *axis);
/* Homing that is held begins no other leg before it is resumed. */
int controller_hold(struct controller *controller);
int controller_resume(struct controller *controller);
/* Which way along its path a move that is held and stands goes on: to its start,
 * or to its end.  Set points of the same path time are the same to the bit, and
 * the move is over where it arrives.  MOTION_E_STATE; MOTION_E_ARG where a track
 * is a window, or of an axis that goes to goals; MOTION_E_LIMIT where one came in
 * from outside the range of its axis. */
int controller_reverse(struct controller *controller, bool is_reversed);
/* To rest, then READY: a move along its path within the limits, a jog by the
 * axis's stop limits.  Cannot fail: in READY and FAULT there is nothing more to
 * stop, an enabling under way ends in OFF, and homing that runs is over
 * (homing.h). */
void controller_stop(struct controller *controller);
/* 0 .. 200 %; by a ramp, also while moving; kept for the next move.  A jog has
 * a speed of its own and is left alone.  MOTION_E_ARG outside, MOTION_E_LIMIT
 * above override_max_q30 of the move that is running. */
int controller_override(struct controller *controller, int64_t rate_q30);
/* How far ahead windows of the tracks must reach, in path time, so that the
 * group can stop along the path when played at this rate. */
int64_t controller_reserve_ns_q12(const struct controller *controller,
                                  const struct motion_track *const track[],
                                  int64_t rate_q30);
/* FAULT -> OFF once every drive has let go of its fault.  MOTION_E_STATE while
 * the e-stop is active, or has a channel that was not shown to work. */
int controller_reset(struct controller *controller);

/* The place that the axis called from_q32 is to_q32 from now on, and the axis
 * is homed.  In READY or OFF, else MOTION_E_STATE; MOTION_E_RANGE, also where an
 * end of its range would be beyond the end of the drive's counter (*reach).  Set
 * points go on from where it is. */
int controller_set_position(struct controller *controller, unsigned index,
                            int64_t from_q32, int64_t to_q32,
                            struct hal_drive_reach *reach);

/* A fault of all axes that something beside the controller has found; its reaction
 * begins at once.  Between ticks, after the first. */
void controller_trip(struct controller *controller,
                     enum controller_fault fault);

/* Have the drives been waited for since `since_ns`, a tick's time: to be there,
 * enabled or off?  One that goes on is waited for; a step of any of them counts,
 * up to 12 times enable_timeout_ns in all. */
bool controller_waited_for_drives(struct controller *controller,
                                  int64_t since_ns);

/* The tick, at nominal time `now_ns` (a multiple of the period after the last
 * one: more than one period means that ticks were lost).  `bus`: the worst that
 * a fieldbus said at its begin. */
void controller_step(struct controller *controller, int64_t now_ns,
                     struct hal_fieldbus_worst bus);

/* Path time and rate `ahead_ns` after the last tick, 0 .. 10 s, if nothing else
 * is asked for until then; where no move's clock runs (ready, a quick stop)
 * those of the last tick.  May be beyond the end of the move.  On the tick. */
void controller_ahead(const struct controller *controller, int64_t ahead_ns,
                      struct motion_clock_rate *then);

MOTION_C_END

#endif
