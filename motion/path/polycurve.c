/* motion/path/polycurve.c - see polycurve.h. */
#include "motion/path/polycurve.h"

#include <stddef.h>

#include "motion/core/err.h"
#include "motion/curve/interval.h"

static uint32_t polycurve_find(const struct motion_polycurve *poly, int64_t u)
{
    return motion_interval_find(poly->border, sizeof *poly->border,
                                poly->pieces, u);
}

/* The difference of two int64 can be 2^64 - 1. */
static struct motion_real polycurve_width(int64_t from, int64_t to)
{
    return motion_real_from_u64((uint64_t)to - (uint64_t)from, 0);
}

/* Horner's scheme for the value and its derivatives / k!: each one takes the
 * one below before that is multiplied on. */
static int polycurve_at(const void *context, int64_t u, int order,
                        struct motion_curve_point *point)
{
    const struct motion_polycurve *const poly = context;
    const uint32_t piece = polycurve_find(poly, u);
    const int64_t *const border = &poly->border[piece];
    const struct motion_vec *const coef =
        &poly->coef[(size_t)piece * (poly->degree + 1)];
    struct motion_vec d[4];

    if (u < border[0] || u > border[1])
        return MOTION_E_ARG;
    const struct motion_real w = motion_real_div(
        polycurve_width(border[0], u), polycurve_width(border[0], border[1]));
    for (int i = 0; i < 4; i++)
        d[i] = motion_vec_zero();
    for (uint32_t k = poly->degree + 1; k-- > 0;) {
        for (int i = order; i > 0; i--)
            d[i] = motion_vec_add(motion_vec_scale(d[i], w), d[i - 1]);
        d[0] = motion_vec_add(motion_vec_scale(d[0], w), coef[k]);
    }
    *point = (struct motion_curve_point){
        .pos = d[0],
        .d1 = d[1],
        .d2 = motion_vec_shift(d[2], 1),
        .d3 = motion_vec_scale(d[3], motion_real_int(6)),
    };
    return MOTION_OK;
}

int motion_polycurve_init(struct motion_curve *curve,
                          const struct motion_polycurve *poly)
{
    if (poly->pieces == 0)
        return MOTION_E_EMPTY;
    for (uint32_t i = 0; i < poly->pieces; i++) {
        if (poly->border[i + 1] <= poly->border[i])
            return MOTION_E_ORDER;
    }
    *curve = (struct motion_curve){ polycurve_at, poly, poly->border[0],
                                    poly->border[poly->pieces] };
    return MOTION_OK;
}
