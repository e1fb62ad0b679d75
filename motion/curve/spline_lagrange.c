/* motion/curve/spline_lagrange.c - one polynomial through all keys; see
 * spline.h.
 *
 * Newton's divided differences, expanded anew at every span, so that no power
 * of a time far away is ever taken. */
#include "motion/core/err.h"
#include "motion/curve/bake_poly.h"
#include "motion/curve/spline_internal.h"

struct lagrange {
    const struct motion_key *key;
    uint32_t count;
    struct motion_real d[MOTION_SPLINE_LAGRANGE_KEYS];
    struct motion_bake_poly_tolerance tolerance;
};

/* key[a] to key[b], seconds, signed. */
static struct motion_real lagrange_time(const struct lagrange *l, uint32_t a,
                                        uint32_t b)
{
    const struct motion_key pair[2] = { l->key[a < b ? a : b],
                                        l->key[a < b ? b : a] };
    const struct motion_real size =
        a == b ? motion_real_zero() : spline_span(pair);

    return a < b ? size : motion_real_neg(size);
}

static struct motion_real lagrange_of(struct motion_real size, int64_t per)
{
    return motion_real_div(size, motion_real_int(per));
}

/* Mean values: somewhere the velocity is the largest chord's, and p''/2 the
 * largest second divided difference. */
static void lagrange_measure(struct lagrange *l, const struct motion_real *d,
                             uint32_t n)
{
    struct motion_real most = motion_real_zero();

    for (uint32_t i = n; i < l->count; i++)
        most = motion_real_max(most, motion_real_abs(d[i]));
    if (n == 0)
        l->tolerance.pos = motion_real_add(lagrange_of(most, 10000000000),
                                           motion_real_make(1, -33));
    if (n == 1)
        l->tolerance.vel = lagrange_of(most, 100000000);
    if (n == 2)
        l->tolerance.acc = lagrange_of(most, 5000000);
}

static void lagrange_differences(struct lagrange *l)
{
    struct motion_real *d = l->d;

    for (uint32_t i = 0; i < l->count; i++)
        d[i] = spline_displacement(l->key[0].pos_q32, l->key[i].pos_q32);
    lagrange_measure(l, d, 0);
    for (uint32_t n = 1; n < l->count; n++) {
        for (uint32_t i = l->count - 1; i >= n; i--)
            d[i] = motion_real_div(motion_real_sub(d[i], d[i - 1]),
                                   lagrange_time(l, i - n, i));
        lagrange_measure(l, d, n);
    }
}

/* poly <- poly * (shift + h u) + d */
static void lagrange_multiply(struct motion_bake_poly *poly,
                              struct motion_real shift, struct motion_real h,
                              struct motion_real d)
{
    poly->degree++;
    poly->c[poly->degree] = motion_real_zero();
    for (int k = poly->degree; k >= 1; k--)
        poly->c[k] = motion_real_add(motion_real_mul(poly->c[k], shift),
                                     motion_real_mul(poly->c[k - 1], h));
    poly->c[0] = motion_real_add(motion_real_mul(poly->c[0], shift), d);
}

static struct motion_bake_poly lagrange_span_poly(const struct lagrange *l,
                                                  uint32_t i)
{
    const struct motion_real h = lagrange_time(l, i, i + 1);
    struct motion_bake_poly poly = { .base_q32 = l->key[0].pos_q32 };

    poly.c[0] = l->d[l->count - 1];
    for (uint32_t n = l->count - 1; n-- > 0;)
        lagrange_multiply(&poly, lagrange_time(l, n, i), h, l->d[n]);
    return poly;
}

struct lagrange_bake {
    const struct lagrange *lagrange;
    struct motion_real *bound;
};

static int lagrange_span(struct motion_track *track,
                         const struct motion_key *key, const void *with)
{
    const struct lagrange_bake *bake = with;
    const struct lagrange *l = bake->lagrange;
    const struct motion_bake_poly poly =
        lagrange_span_poly(l, (uint32_t)(key - l->key));
    struct spline_poly exact = { .degree = poly.degree };

    if (poly.degree > SPLINE_DEGREE)
        return motion_bake_poly_append(track, key[1].t_ns_q12 - key[0].t_ns_q12,
                                       &poly, &key[1].pos_q32, &l->tolerance,
                                       bake->bound);
    for (int k = 1; k <= poly.degree; k++)
        exact.c[k] = poly.c[k];
    return spline_emit(track, key[1].t_ns_q12 - key[0].t_ns_q12, &exact,
                       key[1].pos_q32, 0);
}

int motion_spline_append_lagrange(struct motion_track *track,
                                  const struct motion_key *key, uint32_t count,
                                  struct motion_real *bound, uint32_t *failed)
{
    struct lagrange l = {
        .key = key,
        .count = count,
        .tolerance = { motion_real_zero(), motion_real_zero(),
                       motion_real_zero() },
    };
    const struct lagrange_bake bake = { &l, bound };
    int rc = spline_order(key, count);

    if (failed)
        *failed = 0;
    if (bound)
        *bound = motion_real_make(1, -32);
    if (rc != MOTION_OK)
        return rc;
    if (count > MOTION_SPLINE_LAGRANGE_KEYS)
        return MOTION_E_FULL;
    lagrange_differences(&l);
    return spline_each(track, key, count, lagrange_span, &bake, failed);
}

int motion_spline_lagrange_velocities(const struct motion_key *key,
                                      uint32_t count, struct motion_real *first,
                                      struct motion_real *last)
{
    struct lagrange l = { .key = key, .count = count };
    struct motion_bake_poly poly;
    const int rc = spline_order(key, count);

    if (rc != MOTION_OK)
        return rc;
    if (count > MOTION_SPLINE_LAGRANGE_KEYS)
        return MOTION_E_FULL;
    if (count < 2)
        return MOTION_E_EMPTY;
    lagrange_differences(&l);
    poly = lagrange_span_poly(&l, 0);
    *first = motion_real_div(poly.c[1], lagrange_time(&l, 0, 1));
    poly = lagrange_span_poly(&l, count - 2);
    *last = motion_real_zero();
    for (int k = 1; k <= poly.degree; k++)
        *last = motion_real_add(*last, curve_times(poly.c[k], k));
    *last = motion_real_div(*last, lagrange_time(&l, count - 2, count - 1));
    return MOTION_OK;
}
