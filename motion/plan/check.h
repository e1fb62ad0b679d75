/* motion/plan/check.h - does a track keep an axis inside its limits?
 *
 * Judges by the closed-form extremes of every segment (motion_track.h), not by
 * sampling, and by the steps at the borders: a step in velocity is infinite
 * acceleration, a step in acceleration infinite jerk. */
#ifndef MOTION_PLAN_CHECK_H
#define MOTION_PLAN_CHECK_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/plan/move.h"
#include "motion/plan/plan_bound.h"

MOTION_C_BEGIN

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

/* All violations, in the order of time.  Consecutive segments over the same
 * limit are one entry with the worst value; every step is an entry, with its
 * size (always positive), at its border, the steps from rest at 0 and to rest
 * at the end included.  A step counts only above what rounding to the
 * segments' own integers can leave and, where set points have a period, the
 * digits of keys and a hundredth of what the limits let happen in one period
 * (both derived in check.c).  Limits of
 * velocity, acceleration and jerk are judged to the last bit; position may be 2
 * units of 2^-32 beyond, which is what sampling rounds: a key on the limit is
 * inside.  An empty track is judged by where it stands.
 * Writes at most `capacity`, those that begin first, and returns how many there are
 * in all (0: fits).  Pure; no heap. */
uint32_t plan_check_track(const struct motion_track *track,
                          const struct plan_limit *limit,
                          struct plan_violation *violation, uint32_t capacity);

/* What is judged of a segment, whatever the limits are.  Of the quantities in
 * `exact`, a bit each, the extremes are known; of the others a range that holds
 * them, which the check makes exact where that could be beyond a limit. */
struct plan_facts {
    struct motion_extreme extreme[MOTION_JERK + 1];
    /* By motion_quantity, at the start and at the end, as plan_bound; and as
     * motion_segment_state, once the check asked for it. */
    double value[2][MOTION_JERK + 1], margin[MOTION_JERK + 1];
    int64_t vel_q32[2], acc_q32[2];
    int64_t rounding[MOTION_JERK + 1]; /* motion_segment_rounding, but of pos */
    uint8_t exact;
    bool has_state[2];
};
void plan_facts_of(const struct motion_segment *segment,
                   struct plan_facts *facts);
/* And of all quantities the extremes. */
void plan_facts_exact(const struct motion_segment *segment,
                      struct plan_facts *facts);

/* The same for a track whose segments come one after the other: `next` gives
 * them from the first on, and NULL after the last.  Of `track` only the end is
 * looked at. */
struct plan_check_source {
    const struct motion_segment *(*next)(void *context);
    void *context;
    /* Of the segment that came last, where they are there; NULL: they are
     * computed. */
    struct plan_facts *(*facts)(void *context);
    /* With them, where its verdict stands: true where it and the border before it
     * are known to keep these limits, so that they are not judged again.  It is
     * written for those that are. */
    bool *(*is_inside)(void *context);
};
uint32_t plan_check_source(const struct motion_track *track,
                           const struct plan_check_source *source,
                           const struct plan_limit *limit,
                           struct plan_violation *violation, uint32_t capacity);

MOTION_C_END

#endif
