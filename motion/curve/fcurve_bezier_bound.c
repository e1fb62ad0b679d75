/* motion/curve/fcurve_bezier_bound.c - how far the quintic that meets p, v, a of
 * a bezier span at two times is from it between them.  See fcurve_internal.h.
 *
 * Of a bezier span the distance to its quintic is known in closed form, so
 * nothing is measured.  Over a segment, with v = -1 .. 1 for its part of u and
 * s = -1 .. 1 for its part of time,
 *     s = v - (1 - v^2) g,            g = a + b v
 *     y = line(s) + (1 - v^2) (c + d v)
 * as both are cubics of v.  The quintic that meets y, y', y'' at both ends is
 * line(s) + (1 - s^2) C(s), with C the cubic that meets
 *     G = (c + d v) / P,   P = (1 - s^2) / (1 - v^2) = 1 + 2 v g - (1 - v^2) g^2
 * and dG/ds at both ends, where ds/dv = P.  What it misses,
 *     e = (1 - v^2) (c + d v - P C(s)) = (1 - v^2)^3 r(v),
 * is a polynomial, and r one of degree 9: |e| <= sum |r_k|.  Of its derivatives,
 *     |e'|  <= 1.72 |r| + |r'|          at v^2 = 1/5
 *     |e''| <= 6 |r| + 3.44 |r'| + |r''|
 *     ds/dv >= 1 - 2 |a| - 3 |b|        d2s/dv2 <= 2 |a| + 6 |b|
 *
 * In 2^-58, a and b as they are, c and d so that the larger one is 1/8 .. 1/4;
 * with |a| + |b| <= 1/8 all that is computed stays below 4.  Plan-time. */
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/fcurve_internal.h"

#define BEZIER_BITS   58
#define BEZIER_ONE    ((int64_t)1 << BEZIER_BITS)
#define BEZIER_DEGREE 9 /* of r */

/* Of one coefficient of r: 60 roundings of 2^-58, at most 15 of which each
 * division by 1 - v^2 twice adds up. */
#define BEZIER_ROUNDING 1000

/* c and d are multiples of 2^exponent. */
struct bezier_shape {
    struct motion_real half, per; /* its part of the span / 2; 1 / that */
    int64_t a, b, c, d;
    int32_t exponent;
};

/* Of e by v, of which the second derivative counts what s'' adds to it; in
 * multiples of 2^exponent. */
struct bezier_miss {
    int64_t pos, vel, acc;
};

static int64_t bezier_mul(int64_t a, int64_t b)
{
    return motion_real_mulhi(a * 8, b * 8);
}

/* 1 / (1 + z), |z| <= 1/4: Newton's method from 1 - z, which is off by z^2. */
static int64_t bezier_inverse(int64_t z)
{
    int64_t inverse = BEZIER_ONE - z;

    for (int i = 0; i < 4; i++)
        inverse = bezier_mul(inverse,
                             2 * BEZIER_ONE - inverse - bezier_mul(z, inverse));
    return inverse;
}

/* A cubic from u = middle - half to middle + half, by v. */
static struct fcurve_cubic bezier_part(const struct fcurve_cubic *of,
                                       struct motion_real middle,
                                       struct motion_real half)
{
    const struct motion_real square = motion_real_sqr(half);
    const struct motion_real c3u = motion_real_mul(of->c3, middle);
    const struct motion_real third =
        motion_real_add(c3u, motion_real_twice(c3u));
    const struct motion_real slope =
        motion_real_add(motion_real_twice(of->c2), third);

    return (struct fcurve_cubic){
        motion_real_mul(motion_real_add(of->c1, motion_real_mul(slope, middle)),
                        half),
        motion_real_mul(motion_real_add(of->c2, third), square),
        motion_real_mul(of->c3, motion_real_mul(square, half)),
    };
}

/* False where it is bent too much, or stands still. */
static bool bezier_shape(const struct fcurve_bezier *of,
                         struct motion_real middle, struct motion_real half,
                         struct bezier_shape *shape)
{
    const struct fcurve_cubic x = bezier_part(&of->x, middle, half);
    const struct fcurve_cubic y = bezier_part(&of->y, middle, half);
    const struct motion_real rise = motion_real_add(y.c1, y.c3);

    shape->half = motion_real_add(x.c1, x.c3);
    if (shape->half.m <= 0)
        return false;
    shape->per = motion_real_div(fcurve_whole(1), shape->half);
    const struct motion_real a = motion_real_mul(x.c2, shape->per),
                             b = motion_real_mul(x.c3, shape->per);
    if (motion_real_cmp(motion_real_add(motion_real_abs(a), motion_real_abs(b)),
                        motion_real_scale(fcurve_whole(1), -3)) > 0)
        return false;
    const struct motion_real c = motion_real_sub(motion_real_mul(rise, a),
                                                 y.c2),
                             d = motion_real_sub(motion_real_mul(rise, b),
                                                 y.c3);
    shape->exponent = (c.e > d.e ? c.e : d.e) + 64 - BEZIER_BITS;
    return motion_real_round(a, BEZIER_BITS, &shape->a) == MOTION_OK &&
           motion_real_round(b, BEZIER_BITS, &shape->b) == MOTION_OK &&
           motion_real_round(c, -shape->exponent, &shape->c) == MOTION_OK &&
           motion_real_round(d, -shape->exponent, &shape->d) == MOTION_OK;
}

/* G and dG/ds at v = +-1. */
static void bezier_end(const struct bezier_shape *shape, int v, int64_t *value,
                       int64_t *slope)
{
    const int64_t g = shape->a + v * shape->b;
    const int64_t inverse = bezier_inverse(2 * (v * g));
    const int64_t p_slope = 2 * (g + v * shape->b + v * bezier_mul(g, g));

    *value = bezier_mul(shape->c + v * shape->d, inverse);
    *slope = bezier_mul(shape->d - bezier_mul(*value, p_slope),
                        bezier_mul(inverse, inverse));
}

/* The cubic by s with values and slopes at s = +-1. */
static void bezier_cubic(const struct bezier_shape *shape, int64_t c[4])
{
    int64_t value[2], slope[2];

    bezier_end(shape, -1, &value[0], &slope[0]);
    bezier_end(shape, 1, &value[1], &slope[1]);
    const int64_t odd = (value[1] - value[0]) / 2;
    c[2] = (slope[1] - slope[0]) / 4;
    c[0] = (value[1] + value[0]) / 2 - c[2];
    c[3] = ((slope[1] + slope[0]) / 2 - odd) / 2;
    c[1] = odd - c[3];
}

/* C(s) by v: Horner's scheme with s = -a + v - b v + a v^2 + b v^3. */
static void bezier_compose(const struct bezier_shape *shape, const int64_t c[4],
                           int64_t p[BEZIER_DEGREE + 1])
{
    p[0] = c[3];
    for (int i = 1; i <= BEZIER_DEGREE; i++)
        p[i] = 0;
    for (int k = 2, n = 0; k >= 0; k--, n += 3) {
        for (int i = n; i >= 0; i--) {
            const int64_t pa = bezier_mul(p[i], shape->a),
                          pb = bezier_mul(p[i], shape->b);
            p[i + 1] += p[i] - pb;
            p[i + 2] += pa;
            p[i + 3] += pb;
            p[i] = -pa;
        }
        p[0] += c[k];
    }
}

/* p g, of which what is above r's degree is not needed. */
static void bezier_times_g(const struct bezier_shape *shape, const int64_t p[],
                           int64_t product[BEZIER_DEGREE + 1])
{
    product[0] = bezier_mul(p[0], shape->a);
    for (int i = 1; i <= BEZIER_DEGREE; i++)
        product[i] =
            bezier_mul(p[i], shape->a) + bezier_mul(p[i - 1], shape->b);
}

/* r: its lowest coefficients follow from the lowest ones of c + d v - P C(s),
 * divided by 1 - v^2 twice. */
static void bezier_remainder(const struct bezier_shape *shape,
                             int64_t r[BEZIER_DEGREE + 1])
{
    int64_t c[4], p[BEZIER_DEGREE + 1], pg[BEZIER_DEGREE + 1],
        pgg[BEZIER_DEGREE + 1];

    bezier_cubic(shape, c);
    bezier_compose(shape, c, p);
    bezier_times_g(shape, p, pg);
    bezier_times_g(shape, pg, pgg);
    for (int k = 0; k <= BEZIER_DEGREE; k++) {
        r[k] = pgg[k] - p[k] + (k == 0 ? shape->c : k == 1 ? shape->d : 0);
        if (k >= 1)
            r[k] -= 2 * pg[k - 1];
        if (k >= 2)
            r[k] += 2 * r[k - 2] - pgg[k - 2];
        if (k >= 4)
            r[k] -= r[k - 4];
    }
}

static struct bezier_miss bezier_miss(const struct bezier_shape *shape)
{
    const int64_t a = shape->a < 0 ? -shape->a : shape->a,
                  b = shape->b < 0 ? -shape->b : shape->b;
    /* 1 / (1 - z) <= 1 + 2 z */
    const int64_t faster = BEZIER_ONE + 2 * (2 * a + 3 * b);
    int64_t r[BEZIER_DEGREE + 1], sum[3] = { 0 };

    bezier_remainder(shape, r);
    for (int k = 0; k <= BEZIER_DEGREE; k++) {
        const int64_t size = (r[k] < 0 ? -r[k] : r[k]) + BEZIER_ROUNDING;
        sum[0] += size;
        sum[1] += k * size;
        sum[2] += k * ((k - 1) * size);
    }
    const int64_t slope = bezier_mul(2 * sum[0] - sum[0] / 4 + sum[1], faster);
    return (
        struct bezier_miss){ sum[0], slope,
                             bezier_mul(6 * sum[0] + 4 * sum[1] + sum[2] +
                                            bezier_mul(slope, 2 * a + 6 * b),
                                        bezier_mul(faster, faster)) };
}

bool fcurve_bezier_bound(const struct fcurve_bezier *of,
                         struct motion_real middle, struct motion_real half,
                         struct motion_real per_s,
                         struct fcurve_bezier_bound *bound)
{
    struct bezier_shape shape;
    const bool is_known = bezier_shape(of, middle, half, &shape);

    bound->half = shape.half;
    if (!is_known)
        return false;
    const struct bezier_miss miss = bezier_miss(&shape);
    const struct motion_real rate = motion_real_mul(shape.per, per_s);
    bound->miss = (struct motion_bake_bound){
        motion_real_make(miss.pos, shape.exponent),
        motion_real_mul(motion_real_make(miss.vel, shape.exponent), rate),
        motion_real_mul(motion_real_make(miss.acc, shape.exponent),
                        motion_real_sqr(rate)),
    };
    return true;
}
