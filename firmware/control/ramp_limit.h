/* firmware/control/ramp_limit.h - does a span of a ramp keep the limits of an axis?
 *
 * With A and J the limits of the axis and V the largest f', G = V / A and K = A / J,
 * a track is told (motion/core/track_enclose.h) as
 *
 *     g1 = f' / V    g2 = f'' / A    g3 = f''' / J    in -1 .. 1
 *
 * so that, with Gm and Km the largest of all axes, what is common to them is computed
 * once per span of time, and
 *
 *     p'' / A  = g2 r^2 + G/Gm g1 (Gm r')
 *     p''' / J = g3 r^3 + K/Km (g2 (3 Km r r') + G/Gm g1 (Gm Km r''))
 *
 * lie where interval arithmetic puts them over a span and all of the path that it
 * goes through (Moore, Interval Analysis (1966)): a product of two intervals is from
 * the least to the largest of the products of their ends,
 * which holds at every time of it, between ticks too.  No rate above
 * override_max_q30 is played, at which the tracks are within their limits, so a
 * track at its limit fits, and what fits passes the gate, whose differences are
 * means of p' and p''. */
#ifndef FIRMWARE_CONTROL_RAMP_LIMIT_H
#define FIRMWARE_CONTROL_RAMP_LIMIT_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/track_enclose.h"

#define RAMP_LIMIT_ONE ((int32_t)1 << 22) /* a limit, of products */

/* Of one axis, when its track is loaded. */
struct controller_share {
    struct motion_track_unit unit; /* V, A, J */
    int32_t vel_q31;               /* G / Gm */
    int32_t share_q31;             /* K / Km; 0: no limit of jerk, */
    int32_t vel_share_q31;         /* and the product of both */
    int32_t stop_acc, stop_jerk;   /* of stopping, in the limits, Q22 */
    struct motion_cursor cursor;   /* of the span that is judged */
};

/* Value times this is m / 2^e of it, rounded up. */
struct controller_scale {
    uint32_t m;
    uint8_t e;
};

/* Of all axes: 1/tick and 1/tick^2, Q56, to Q24 of G r' and G K r''; 3 K / G. */
struct controller_scales {
    struct controller_scale accel, jerk;
    int32_t cross_q12;
};

/* A span of a ramp, from low to high, Q24; of r' and r'' `shift` bits less where
 * these are large. */
struct controller_part {
    int32_t low, high;
};
struct controller_span {
    struct controller_part r2, r3, accel, cross;
    /* r'', and others that may come instead, within the limits and the stop limits;
     * 0: none */
    int32_t jerk, fall[2];
    uint8_t shift; /* 0, 5, 10 or 15 */
    bool stop;     /* within the stop limits */
    bool is_first; /* of a candidate's first piece: r' counts */
    int64_t from_ns_q12, to_ns_q12; /* of the path */
};

/* Are the limits kept, and how much larger could r' be, or r'' where r' stays, Q10?
 * At most 16. */
#define CONTROLLER_FACTOR_MOST (16 << 10)
struct controller_verdict {
    bool acc, jerk, fall; /* kept */
    bool more;            /* of r'' would help */
    int32_t acc_q10, jerk_q10;
    int32_t fall_q10[2]; /* the least so far */
};

/* ramp_load.c: when tracks are loaded.  Divides. */
struct controller;
void controller_limit_load(struct controller *controller);
/* One axis, whose track is in these ranges. */
void controller_limit_judge(const struct controller_share *share,
                            const struct controller_span *span,
                            const struct motion_range g[3],
                            struct controller_verdict *verdict);

#endif
