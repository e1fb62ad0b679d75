/* motion/plan/check.h - does a track keep an axis inside its limits?
 *
 * Judges by the closed-form extremes of every segment (motion_track.h), not by
 * sampling, and by the steps at the borders: a step in velocity is infinite
 * acceleration, a step in acceleration infinite jerk. */
#ifndef MOTION_PLAN_CHECK_H
#define MOTION_PLAN_CHECK_H

#include <stdint.h>

#include "motion/plan/move.h"

enum plan_violation_kind {
    PLAN_POS_LOW,
    PLAN_POS_HIGH,
    PLAN_VEL,
    PLAN_ACC,
    PLAN_JERK,
    PLAN_VEL_STEP, /* value: the step, unit/s; limit 0 */
    PLAN_ACC_STEP, /* value: the step, unit/s2; only where jerk is limited */
};

struct plan_violation {
    enum plan_violation_kind kind;
    int64_t t_ns_q12; /* where the worst of this stretch is */
    int64_t value;    /* in the format of the quantity */
    int64_t limit;
};

/* Steps below this are the rounding of the track's own format: the planner's
 * quantum, computed from the segments at the border (see check.c). */

/* All violations, in the order of time; consecutive segments over the same
 * limit are one entry with the worst value.  Writes at most `room` and returns
 * how many there are in all (0: fits). */
uint32_t plan_check_track(const struct motion_track *track,
                          const struct plan_limit *limit,
                          struct plan_violation *violation, uint32_t room);

#endif
