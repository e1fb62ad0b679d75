/* motion/otg/replan.h - another goal, or other limits, while moving.
 *
 * There is an answer at every tick, and it says which of three it is: the best
 * motion to the new goal; the plan that was running, to be run on; or a
 * stop. */
#ifndef MOTION_OTG_REPLAN_H
#define MOTION_OTG_REPLAN_H

#include "motion/otg/otg.h"

MOTION_C_BEGIN

enum motion_otg_outcome {
    MOTION_OTG_NEW,  /* *next starts now */
    MOTION_OTG_KEPT, /* *next is not written: go on with the old plan */
    MOTION_OTG_STOP, /* *next starts now and only stops */
};

/* A request and its plan, counted in 2^-fine_bits unit from an origin, so
 * that the start may be any state of another plan, not only one that the public
 * formats hold: there
 *
 *     position = origin + pos 2^-(32 + fine_bits)     velocity = vel 2^-(32 + fine_bits)
 *     acceleration = acc 2^-(32 + fine_bits)          jerk the same
 *
 * and in these units it is a move and a plan of otg.h like any other.  0 bits,
 * from 0: the public formats. */
struct motion_otg_trajectory {
    struct motion_otg_move move;
    struct motion_otg_plan plan;
    int64_t origin_q32;
    int32_t fine_bits; /* 0 .. 32 */
};

/* motion_otg_make as the first trajectory, from a given state. */
int motion_otg_begin(const struct motion_otg_move *move,
                     struct motion_otg_trajectory *trajectory,
                     enum motion_otg_field *field);

/* State of a plan at `t`, 0 .. dur; before and after, at its ends.  Position
 * to the nearest 2^-32, velocity and acceleration to the nearest unit of their
 * formats or 2^-50.  Plan-time (on the tick a track is sampled). */
void motion_otg_state_at(const struct motion_otg_plan *plan, int64_t t_ns_q12,
                         struct motion_state *state);
/* The same of a trajectory, in the public formats. */
void motion_otg_trajectory_state(const struct motion_otg_trajectory *trajectory,
                                 int64_t t_ns_q12, struct motion_state *state);

/* The trajectory as a track of its own, made in `segment`, of which there are
 * MOTION_OTG_PHASES at most.  It starts where the trajectory does to 2^-64
 * unit.  Errors as motion_otg_append. */
int motion_otg_track(const struct motion_otg_trajectory *trajectory,
                     struct motion_segment *segment, uint32_t capacity,
                     struct motion_track *track);

/* From where `old` is at `t` to wish->goal under wish->limit, in
 * wish->dur_ns_q12 from then on (0: the least time); wish->start is not used.
 * The state is the plan's own, to half a step of the finest formats that hold
 * the request: 60 bits of its largest number, at most 2^-64 unit, 2^-64 unit/s
 * and 2^-64 unit/s2.  So a new goal in every tick, however short, costs nothing
 * but the change of goal.
 *
 * The old plan is kept when there is no motion to the new goal, or when it
 * leads to the same one, under the same limits, and would arrive no later than
 * the new one by more than what a plan may be too long (otg.h), nor earlier
 * than requested.  When nothing is left of the old plan and there is no motion
 * to the new goal: the stop.  Returns the outcome or, where there is no stop
 * either, the error of motion_otg_make; `field` (may be NULL) says why it is
 * not NEW.  `next` is not `old`. */
int motion_otg_replan(const struct motion_otg_trajectory *old, int64_t t_ns_q12,
                      const struct motion_otg_move *wish,
                      struct motion_otg_trajectory *next,
                      enum motion_otg_field *field);

/* Rest in the least time, from any state.  Positive limits as in otg.h.  From
 * a motion in one direction that is the least distance too: both brake as hard
 * as the limits allow.  Along a path of several axes use the clock
 * (clock_warp.h). */
int motion_otg_stop(const struct motion_state *start,
                    const struct motion_otg_limit *limit,
                    struct motion_otg_plan *plan);

/* The same from where `old` is at `t`: MOTION_OTG_STOP, or MOTION_OTG_KEPT
 * where `old` is that stop already; else the error of motion_otg_make. */
int motion_otg_stop_from(const struct motion_otg_trajectory *old,
                         int64_t t_ns_q12, const struct motion_otg_limit *limit,
                         struct motion_otg_trajectory *next);

MOTION_C_END

#endif
