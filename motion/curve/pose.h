/* motion/curve/pose.h - poses, blends and layers: sums of weighted tracks.
 *
 * A pose is one position per axis.  A blend shape is a base pose and weights
 * that move:
 *     p(t) = base + sum w_i(t) (pose_i - base)
 * and for each axis pose_i - base is a number, so p is a sum of tracks times
 * numbers, a polynomial wherever the weights are: no sampling, no fitting.
 * Layers that are added to a move are the same sum with the factor one.  A
 * cross-fade is from + w (to - from), a product of polynomials, and may need
 * more than the fifth degree; then it is baked (bake.h).
 *
 * Tracks need not have common borders nor end together: the sum has a border
 * wherever one of them has, and a track that has ended stays where it is. */
#ifndef MOTION_CURVE_POSE_H
#define MOTION_CURVE_POSE_H

#include <stdint.h>

#include "motion/core/track.h"
#include "motion/number/real.h"

#define MOTION_POSE_TERMS 32

/* factor * track.  For a weight, the track's unit is 1 and the factor is the
 * pose's distance from the base, in the axis's unit. */
struct motion_pose_term {
    const struct motion_track *track;
    int64_t factor_q32;
};

/* offset + sum of the terms, 0 .. MOTION_POSE_TERMS of them, into `sum`, whose
 * segments and capacity the caller gave (motion_track_init); at most as many
 * segments as all terms together.  What the sum had is dropped.
 *   where all borders are common and all factors are one: the coefficients are
 *   added, nothing but the sum's own format rounds (track.h);
 *   else a piece of a segment is expanded about its own start with 72 fraction
 *   bits: within 2^-38 unit and 2^-62 of the segment's coefficients.
 * Position is continuous to the bit; at a border it is rounded down from the
 * sum with all its fraction bits.
 * MOTION_E_ARG for too many terms, MOTION_E_FULL, MOTION_E_RANGE as
 * motion_track_append_*, also for coefficients beyond 2^30 units; the sum is
 * empty then.  Plan-time. */
int motion_pose_sum(struct motion_track *sum, int64_t offset_q32,
                    const struct motion_pose_term term[], uint32_t terms);

/* a + b: a layer on a move. */
int motion_pose_add(struct motion_track *sum, const struct motion_track *a,
                    const struct motion_track *b);

/* from + weight (to - from); the weight's unit is 1.  Where the degrees of
 * weight and moves together are at most five, within 2^-38 unit; else baked to
 * `tolerance_q32` (> 0; 2^-30 unit is the least that can be reached), with as
 * many segments as that needs.  *bound, when not NULL, is what is promised for
 * the whole.  MOTION_E_TOLERANCE when that cannot be met; others as
 * motion_pose_sum. */
int motion_pose_fade(struct motion_track *fade, const struct motion_track *from,
                     const struct motion_track *to,
                     const struct motion_track *weight, int64_t tolerance_q32,
                     struct motion_real *bound);

#endif
