/* motion/otg_replan.h - another goal, or other limits, while moving.
 *
 * There is an answer at every tick, and it says which of three it is: the best
 * motion to the new goal; the plan that was running, to be run on; or a stop. */
#ifndef MOTION_OTG_REPLAN_H
#define MOTION_OTG_REPLAN_H

#include "motion/otg.h"

enum motion_otg_outcome {
    MOTION_OTG_NEW,  /* *next starts now */
    MOTION_OTG_KEPT, /* *next is not written: go on with the old plan */
    MOTION_OTG_STOP, /* *next starts now and only stops */
};

/* State of a plan at `t`, 0 .. dur; before and after, at its ends.  Position
 * to the nearest 2^-32, velocity and acceleration to the nearest unit of their
 * formats or 2^-50.  Plan-time (on the tick a track is sampled). */
void motion_otg_state_at(const struct motion_otg_plan *plan, int64_t t_ns_q12,
                         struct motion_state *state);

/* From the state of `old` at `t` to move->goal under move->limit; move->start
 * is filled in.  The old plan is kept when it leads to the same goal, under
 * `old_move`'s limits, no later than the new one would, or when there is no
 * motion to the new goal.  When nothing is left of the old plan and there is
 * none to the new goal: the stop.  Returns the outcome or, where there is no
 * stop either, the error of motion_otg_make; `field` (may be NULL) says why it
 * is not NEW. */
int motion_otg_replan(const struct motion_otg_move *old_move,
                      const struct motion_otg_plan *old, int64_t t_ns_q12,
                      struct motion_otg_move *move,
                      struct motion_otg_plan *next,
                      enum motion_otg_field *field);

/* Rest in the least time, from any state.  Positive limits as in otg.h.  From
 * a motion in one direction that is the least distance too: both brake as hard
 * as the limits allow.  Along a path of several axes use the clock
 * (clock_warp.h). */
int motion_otg_stop(const struct motion_state *start,
                    const struct motion_otg_limit *limit,
                    struct motion_otg_plan *plan);

#endif
