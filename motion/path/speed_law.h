/* motion/path/speed_law.h - distance over time, put together from parts.
 *
 * A speed law is a track of one axis: distance in the path's unit (or anything
 * else) over time.  Parts are appended one after the other and must match in
 * speed where they join.
 *
 *   whole     rest to rest over `length`
 *     CUBIC       -2u^3 + 3u^2; steps in acceleration at both ends
 *     QUINTIC     6u^5 - 15u^4 + 10u^3, minimum jerk; no steps
 *     SINE        k1, k2 as in ease.h; steps in acceleration at both ends
 *     PARABOLIC   k1, k2; steps in acceleration at all corners
 *     SCURVE      k1, k2; no steps
 *   ramps     from one speed to another
 *     RAMP_LINE   constant acceleration; none when the speeds are equal
 *     RAMP_SINE   quarter sine: acceleration is largest at the slower end and
 *                 zero at the faster
 *     RAMP_CUBIC  speed over -2u^3 + 3u^2: acceleration zero at both ends
 *     RAMP_JERK   two halves of constant jerk
 *   points    given by the user
 *     ACC_POINTS  acceleration in straight lines between points; two points at
 *                 one time are a step
 *     VEL_POINTS  speed in straight lines between points (parabolic)
 *   DRAWN     any track, as it is
 *
 * What is not a polynomial (sine) is baked; the others are exact to rounding.
 * Source: R. Parent, Computer Animation (3rd ed.), 3.3; Flash & Hogan, The
 * coordination of arm movements, J. Neurosci. 5 (1985).  Plan-time. */
#ifndef MOTION_PATH_SPEED_LAW_H
#define MOTION_PATH_SPEED_LAW_H

#include <stdint.h>

#include "motion/core/track.h"
#include "motion/curve/bake.h"
#include "motion/number/real.h"

enum motion_speed_kind {
    MOTION_SPEED_CUBIC,
    MOTION_SPEED_QUINTIC,
    MOTION_SPEED_SINE,
    MOTION_SPEED_PARABOLIC,
    MOTION_SPEED_SCURVE,
    MOTION_SPEED_RAMP_LINE,
    MOTION_SPEED_RAMP_SINE,
    MOTION_SPEED_RAMP_CUBIC,
    MOTION_SPEED_RAMP_JERK,
    MOTION_SPEED_ACC_POINTS,
    MOTION_SPEED_VEL_POINTS,
    MOTION_SPEED_DRAWN,
};

/* Time from the start of the part; unit/s2 or unit/s. */
struct motion_speed_point {
    int64_t t_ns_q12;
    struct motion_real value;
};

struct motion_speed_part {
    enum motion_speed_kind kind;
    int64_t dur_ns_q12;      /* whole and ramps */
    int64_t length_q32;      /* whole; points: 0, or all values and `from` are
                                scaled by one number so that this is covered */
    int64_t k1_q32, k2_q32;  /* SINE, PARABOLIC, SCURVE */
    struct motion_real from; /* speed, unit/s: ramps and ACC_POINTS */
    struct motion_real to;   /* ramps */
    const struct motion_speed_point *point; /* first at 0, not going back */
    uint32_t points;
    const struct motion_track *drawn;
};

/* Append parts to a law.  Where two join their speeds may differ by 2^-20 of
 * the larger.  What the track already holds is joined like a part; an empty
 * track may start with any speed.  MOTION_E_ARG for a bad part,
 * MOTION_E_DISCONTINUITY when speeds do not match, MOTION_E_ORDER for points whose times or distances
 * go back or a drawn track that does, MOTION_E_EMPTY for points or a drawn
 * track without anything, MOTION_E_FULL, MOTION_E_RANGE as
 * motion_track_append_*; the track is unchanged then, and report->bad is the
 * part.  `report` may be NULL. */
struct motion_speed_report {
    uint32_t bad;             /* on an error only */
    struct motion_real error; /* how far the law is at most from what its parts
                                 say: only sines are not exact */
};
int motion_speed_append(struct motion_track *law,
                        const struct motion_speed_part *part, uint32_t parts,
                        struct motion_speed_report *report);

/* MOTION_E_ORDER when a law goes back somewhere by more than rounding; found
 * from the extremes of its segments. */
int motion_speed_check(const struct motion_track *law);

#endif
