/* motion/otg/otg.h - the fastest move from any state of motion to any other.
 *
 * Given where an axis is, how fast it moves and accelerates, and where it is
 * to be, at which velocity and acceleration: the motion that gets there in the
 * least time (or in a given time) under limits on velocity, acceleration and
 * jerk.  Integers only, the same bits on every machine, no tolerance in any
 * unit: a problem is measured in its own scale before it is solved.
 *
 *   motion_otg_make     the plan: phases of constant jerk in exact integers
 *   motion_otg_check    integrates a plan again and judges it, independently
 *   motion_otg_append   the plan as segments of a track
 *
 * A returned plan has passed the check.  Its duration exceeds the optimum by at
 * most 2^-21 of it or 2 ns, the larger: the search runs with limits tightened
 * by 2^-25, and that margin takes up the rounding to whole ticks.  (A plain
 * change of speed is made without; next to it the root of a tick is lost, 2^-20
 * of a second's move.)  Where the optimum is possible in no whole number of
 * ticks (a displacement that a given speed covers in part of one), it is the
 * next duration that is.  Where that exceeds by 2^-10 and two ticks what one
 * phase of constant jerk, or one change between two velocities, takes, the plan
 * is this in the next whole tick; it ends beside its goal by a residual of two
 * ticks' travel and two steps of the public formats at most.  There is none
 * with a goal at rest or a given duration.
 *
 * Method and equations: docs/OTG.md.  Compare: Berscheid & Kroeger, "Jerk-
 * limited real-time trajectory generation with arbitrary target states" (RSS
 * 2021), whose results it reproduces. */
#ifndef MOTION_OTG_OTG_H
#define MOTION_OTG_OTG_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/track.h"

MOTION_C_BEGIN

/* vel_min < 0 < vel_max and acc_min < 0 < acc_max; jerk > 0 limits both signs.
 * jerk 0: jerk not limited (acceleration steps).  Both acc 0 and jerk 0:
 * acceleration not limited (velocity steps).  jerk_down, when not 0, is the
 * jerk of everything after the highest speed; needs jerk. */
struct motion_otg_limit {
    int64_t vel_max_q32, vel_min_q32;
    int64_t acc_max_q32, acc_min_q32;
    int64_t jerk_q32, jerk_down_q32;
};

enum motion_otg_mode {
    MOTION_OTG_POSITION,
    MOTION_OTG_VELOCITY, /* goal.pos and the velocity limits are not used;
                            jerk_down is the jerk when |vel| gets less, after
                            its highest value */
};

/* Fields, for errors to name. */
#define MOTION_OTG_FIELD_LIST(X)                                               \
    X(MOTION_OTG_FIELD_NONE, "nothing")                                        \
    X(MOTION_OTG_FIELD_VEL_MAX, "vel_max")                                     \
    X(MOTION_OTG_FIELD_VEL_MIN, "vel_min")                                     \
    X(MOTION_OTG_FIELD_ACC_MAX, "acc_max")                                     \
    X(MOTION_OTG_FIELD_ACC_MIN, "acc_min")                                     \
    X(MOTION_OTG_FIELD_JERK, "jerk")                                           \
    X(MOTION_OTG_FIELD_JERK_DOWN, "jerk_down")                                 \
    X(MOTION_OTG_FIELD_START_VEL, "start velocity")                            \
    X(MOTION_OTG_FIELD_START_ACC, "start acceleration")                        \
    X(MOTION_OTG_FIELD_GOAL_POS, "goal position")                              \
    X(MOTION_OTG_FIELD_GOAL_VEL, "goal velocity")                              \
    X(MOTION_OTG_FIELD_GOAL_ACC, "goal acceleration")                          \
    X(MOTION_OTG_FIELD_DURATION, "duration")

enum motion_otg_field {
#define MOTION_OTG_FIELD_ENUM(name, text) name,
    MOTION_OTG_FIELD_LIST(MOTION_OTG_FIELD_ENUM)
#undef MOTION_OTG_FIELD_ENUM
};

/* "vel_max" ...; never NULL. */
const char *motion_otg_field_text(enum motion_otg_field field);

struct motion_otg_move {
    struct motion_state start, goal; /* jerk not used */
    struct motion_otg_limit limit;
    enum motion_otg_mode mode;
    int64_t dur_ns_q12; /* given duration; 0: the shortest, which is what a
                           velocity goal takes */
};

#define MOTION_OTG_PHASES 24

/* In each phase the acceleration runs straight to `acc`, so jerk is
 * constant. */
struct motion_otg_phase {
    int64_t dur_ns_q12; /* > 0 */
    int64_t acc;        /* at its end, in 2^-acc_bits unit/s2; |acc| <= 2^61 */
};

/* A plan in exact integers.  With times n in 2^-12 ns, A as in the phases, V in
 * 2^-(22 + acc_bits) / 5^9 unit/s, P in 2^-(43 + acc_bits) / (3 5^18) unit, a
 * phase of n to A' leads exactly to
 *
 *     V' = V + (A + A') n         P' = P + 3 V n + (2 A + A') n^2
 *
 * and every start, goal and limit in the public formats is a whole number too.
 * The accelerations at the corners in `trim` (bit i: end of phase i) meet the
 * goal to their last unit, 2^-60 of the largest: what integrating leaves there
 * is less than one such unit makes (docs/OTG.md, 5), and is no part of the
 * motion: it ends at the goal. */
struct motion_otg_plan {
    int64_t dur_ns_q12;
    int64_t start_pos_q32, start_vel_q32;
    int64_t goal_pos_q32, goal_vel_q32;
    int64_t residual_pos_q32, residual_vel_q32; /* the move's goal less that of
                                                   the plan; 0 in general */
    int64_t start_acc;
    int32_t acc_bits;
    int32_t count;
    int32_t brake, turn; /* jerk limits the phases before `brake`, jerk_down
                            those from `turn` on, the lower those between */
    uint32_t trim[2];    /* the corners of each move together */
    struct motion_otg_phase phase[MOTION_OTG_PHASES];
};

/* Make the plan of `move`.  Returns MOTION_OK, or with *field the culprit:
 * MOTION_E_ARG for a limit that is zero, of the wrong sign or missing,
 * MOTION_E_LIMIT for a goal that no motion within the limits can end in or a
 * duration that cannot be met (the next one for which a plan was made is in
 * plan->dur_ns_q12), MOTION_E_RANGE when the move, or the next duration, would
 * take over 2^60 ticks (3.2 days) or leave the formats.  With an error *plan
 * has no phases.  `field` may be NULL.  A start outside the limits is first
 * brought inside: full jerk until the acceleration is inside, then full
 * deceleration until ramping it to zero ends at the limit of velocity, so that
 * a lower limit does not turn the motion round. */
int motion_otg_make(const struct motion_otg_move *move,
                    struct motion_otg_plan *plan, enum motion_otg_field *field);

/* Integrate `plan` in exact integers: does it start as `move` says and end
 * there to the last unit (or with the residual it names, and less than a step
 * of the public formats), and keep the limits (with that unit added)?
 * MOTION_OK, or MOTION_E_LIMIT with the field that is broken. */
int motion_otg_check(const struct motion_otg_move *move,
                     const struct motion_otg_plan *plan,
                     enum motion_otg_field *field);

/* Append one segment per phase to a track that ends where the plan starts.
 * Errors as motion_track_append_poly; the track is then as before. */
int motion_otg_append(const struct motion_otg_plan *plan,
                      struct motion_track *track);

MOTION_C_END

#endif
