/* tests/motion/path/rotspline_at.h - a spline through rotations at a time: the
 * rotation of its span, and the angular velocity and acceleration by what its keys
 * hold, in long double.
 *
 *     r = d u + (3c - 2d - e) u^2 + (d + e - 2c) u^3      r' = dr/du / T
 *     w = r' - (1 - cos a) / a^2 r x r' + (a - sin a) / a^3 r x (r x r')
 *
 * with c the chord, d = T rate, e = T end_rate, a = |r|; w' by differences of w,
 * which goes on as it is beyond the span. */
#ifndef TESTS_MOTION_PATH_ROTSPLINE_AT_H
#define TESTS_MOTION_PATH_ROTSPLINE_AT_H

#include <math.h>

#include "motion/core/fixed.h"
#include "motion/path/rotspline.h"

struct rotspline_vec {
    long double x[3];
};

static inline struct rotspline_vec rotspline_cross(struct rotspline_vec a,
                                                   struct rotspline_vec b)
{
    return (struct rotspline_vec){ {
        a.x[1] * b.x[2] - a.x[2] * b.x[1],
        a.x[2] * b.x[0] - a.x[0] * b.x[2],
        a.x[0] * b.x[1] - a.x[1] * b.x[0],
    } };
}

static inline long double rotspline_scalar(struct motion_real a)
{
    return ldexpl((long double)a.m, a.e);
}

static inline struct rotspline_vec
rotspline_rate(const struct motion_rotkey *key, long double u)
{
    const long double dur_s = rotspline_scalar(key->dur_s);
    struct rotspline_vec r, dr, once, twice;
    long double angle = 0;

    for (int i = 0; i < 3; i++) {
        const long double c = rotspline_scalar(key->chord.x[i]),
                          d = dur_s * rotspline_scalar(key->rate.x[i]),
                          e = dur_s * rotspline_scalar(key->end_rate.x[i]);
        r.x[i] = u * (d + u * (3 * c - 2 * d - e + u * (d + e - 2 * c)));
        dr.x[i] =
            (d + u * (2 * (3 * c - 2 * d - e) + u * 3 * (d + e - 2 * c))) /
            dur_s;
        angle += r.x[i] * r.x[i];
    }
    angle = sqrtl(angle);
    /* series where what is left of 1 - cos and a - sin is rounding */
    const bool is_small = angle < 1e-3L;
    const long double square = angle * angle,
                      one = is_small ? 0.5L - square / 24
                                     : (1 - cosl(angle)) / square,
                      two = is_small ? (1 - square / 20) / 6
                                     : (angle - sinl(angle)) / square / angle;
    once = rotspline_cross(r, dr);
    twice = rotspline_cross(r, once);
    for (int i = 0; i < 3; i++)
        dr.x[i] += two * twice.x[i] - one * once.x[i];
    return dr;
}

static inline struct motion_real rotspline_real(long double a)
{
    int exponent;
    const long double mantissa = frexpl(a, &exponent);

    return motion_real_make((int64_t)ldexpl(mantissa, 62), exponent - 62);
}

/* Before the first and after the last key the key itself, at rest. */
static inline void rotspline_at(const struct motion_rotspline *spline,
                                int64_t t_ns_q12, struct motion_quat *q,
                                struct motion_vec *rate, struct motion_vec *acc)
{
    const struct motion_rotkey *key = spline->key;
    const struct motion_rotkey *const last = &key[spline->count - 1];
    const long double h = 1e-4L;
    int64_t u_q62 = 0;

    *rate = *acc = motion_vec_zero();
    *q = t_ns_q12 <= key->t_ns_q12 ? key->q : last->q;
    if (t_ns_q12 < key->t_ns_q12 || t_ns_q12 > last->t_ns_q12 || key == last)
        return;
    while (key + 1 < last && t_ns_q12 >= key[1].t_ns_q12)
        key++;
    const int64_t dur = key[1].t_ns_q12 - key[0].t_ns_q12;
    const long double u =
        (long double)(t_ns_q12 - key->t_ns_q12) / (long double)dur;
    (void)motion_fixed_muldiv(t_ns_q12 - key->t_ns_q12, (int64_t)1 << 62, dur,
                              &u_q62);
    *q = motion_rotspline_within(key, u_q62);
    const struct rotspline_vec at = rotspline_rate(key, u),
                               a = rotspline_rate(key, u - 2 * h),
                               b = rotspline_rate(key, u - h),
                               c = rotspline_rate(key, u + h),
                               d = rotspline_rate(key, u + 2 * h);
    for (int i = 0; i < 3; i++) {
        rate->x[i] = rotspline_real(at.x[i]);
        acc->x[i] = rotspline_real((a.x[i] - d.x[i] + 8 * (c.x[i] - b.x[i])) /
                                   (12 * h * rotspline_scalar(key->dur_s)));
    }
}

#endif
