/* motion/curve/ease.h - ease in, constant speed, ease out: rest to rest.
 *
 *   speed  |    ________
 *          |   /        \          three phases; the law shapes the two ramps
 *          |__/          \__
 *             k1        k2
 *
 *   parabolic  constant acceleration; steps in acceleration at all four corners
 *   sine       speed is a quarter sine; steps in acceleration at both ends
 *   s-curve    acceleration rises and falls at constant jerk; no steps
 *
 * Parabolic and sine need infinite jerk where acceleration steps: a machine
 * with a jerk limit needs the s-curve.  The normaliser of the sine law is
 * f = 2 k1/pi + (k2 - k1) + 2 (1 - k2)/pi.
 * Source: R. Parent, Computer Animation (3rd ed.), 3.3; Biagiotti & Melchiorri,
 * Trajectory Planning (2008), 3.4 (double S). */
#ifndef MOTION_CURVE_EASE_H
#define MOTION_CURVE_EASE_H

#include <stdint.h>

#include "motion/core/track.h"

MOTION_C_BEGIN

enum motion_ease_law {
    MOTION_EASE_PARABOLIC,
    MOTION_EASE_SINE,
    MOTION_EASE_SCURVE,
};

/* Most segments that one ease appends: the sine law is baked, 13 quintics per
 * ramp at most and one line between; the others take five at most, a limited
 * ease seven. */
#define MOTION_EASE_SEGMENTS 27

/* Ease from the track's end to `to_q32` within `dur`.  k1 is the fraction of
 * the duration where the ease-in ends, k2 where the ease-out begins, as Q0.32
 * in int64: 0 <= k1 <= k2 <= 2^32.  k1 = 0 or k2 = 1 leaves that ramp out
 * (and the speed then steps).  Both times are rounded to 2^-12 ns; a phase that
 * is shorter than half of that is left out.  The s-curve's ramps are two
 * constant-jerk halves.
 *
 * The sine law is baked.  Its distance from the true curve is at most 2^-32 +
 * 1e-10 of the move in position, 1.3e-8 of the largest velocity and 5e-7 of the
 * largest acceleration (derived in ease_sine.c); what sampling rounds comes on
 * top.
 *
 * A move of no distance is a dwell.  Errors as motion_track_append_*,
 * MOTION_E_ARG for a law that does not exist or k1 and k2 out of order, and
 * MOTION_E_RANGE for a phase that covers more than 2^30 units; the track is
 * unchanged then.  Plan-time. */
int motion_ease_append(struct motion_track *track, enum motion_ease_law law,
                       int64_t to_q32, int64_t dur_ns_q12, int64_t k1_q32,
                       int64_t k2_q32);

/* The same with the times of the three phases, none negative and at least one
 * positive: k1 and k2 as exact as times are. */
int motion_ease_append_phases(struct motion_track *track,
                              enum motion_ease_law law, int64_t to_q32,
                              int64_t in_ns_q12, int64_t middle_ns_q12,
                              int64_t out_ns_q12);

/* Limits of one axis, all > 0; jerk 0 means not limited. */
struct motion_ease_limit {
    int64_t vel_q32, acc_q32, jerk_q32;
};

/* Shortest jerk-limited ease (at most seven constant-jerk segments; three when
 * jerk is not limited) from the track's end, at rest, to `to_q32` at rest.
 * Phase times are rounded up, and further until the extremes of the segments,
 * in their own integers, are inside the limits: no limit is broken by
 * rounding.  The duration is within 1 ns of the shortest, or a few us where
 * phases are shorter than that and the formats resolve their jerk coarsely.
 * A move of no distance appends nothing.
 * Returns MOTION_OK and appends, MOTION_E_ARG for a limit that is not positive,
 * MOTION_E_LIMIT when the formats are too coarse to keep the limits,
 * MOTION_E_FULL, or MOTION_E_RANGE when the move would take over 3 days; the
 * track is unchanged then.  Plan-time. */
int motion_ease_append_limited(struct motion_track *track, int64_t to_q32,
                               const struct motion_ease_limit *limit);

MOTION_C_END

#endif
