/* motion/plan/keys/simplify.h - many keys of an axis to few, within a tolerance.
 *
 * Of positions at times, such as an axis that was pushed by hand has left: the
 * curve of the axis through those that are kept is nowhere further than the
 * tolerance from any of them.  Keys are added where it is furthest off, in each
 * span at once, until it is close enough; then those are left out again without
 * which it still is.  Nor does it leave a range that all of them keep: keys at which
 * it turns stand (stand.h).  Off-line: uses the heap. */
#ifndef MOTION_PLAN_KEYS_SIMPLIFY_H
#define MOTION_PLAN_KEYS_SIMPLIFY_H

#include "motion/plan/move.h"

/* `tolerance_q32` >= 0; of the limits only those of position count, NULL: none.
 * axis->key is the same array with fewer in it; the first
 * and the last stay.  MOTION_E_ARG: a curve that does not go through its keys;
 * else errors of plan_axis_track, and nothing has changed. */
int plan_simplify(struct plan_axis *axis, int64_t tolerance_q32,
                  const struct plan_limit *limit, struct plan_error *error);

#endif
