/* motion/plan/keys/stand.h - keys at which an axis turns at the end of its range.
 *
 * A curve finds the velocity at a key from the keys beside it: where an axis leaves the
 * end of its range, or turns there, that takes it beyond, between keys that are all
 * inside.  An axis that turns stands for a moment. */
#ifndef MOTION_PLAN_KEYS_STAND_H
#define MOTION_PLAN_KEYS_STAND_H

#include "motion/plan/move.h"

/* Around every place where the track leaves the limits of position: a key that is inside
 * and nearer to that end than those beside it stands; where it does, the other key of the
 * span is passed at twice the mean speed to it; where both are so, without acceleration.
 * Only keys that give none of their own, and whose curves take one.  How many were
 * given one; 0: nothing is to be done, or nothing can. */
uint32_t plan_stand(struct plan_axis *axis, const struct motion_track *track,
                    const struct plan_limit *limit);

/* Does the track leave the limits of position?  Where it first does is in
 * *at_ns_q12. */
bool plan_stand_leaves(const struct motion_track *track,
                       const struct plan_limit *limit, int64_t *at_ns_q12);

#endif
