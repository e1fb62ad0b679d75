/* motion/plan/topp/topp_straight.c - see topp_straight.h. */
#include "motion/plan/topp/topp_straight.h"

#include <math.h>
#include <string.h>

#include "motion/plan/topp/topp_chain.h"
#include "motion/plan/topp/topp_poly.h"

/* Of the length: what counts as none. */
#define STRAIGHT_ROUNDING 1e-9

/* Parts of a piece in search of a place where it turns back. */
#define STRAIGHT_PARTS 4096

/* --- does not turn back ------------------------------------------------------ */

/* The polynomial about x instead of 0, over a part of the width. */
static void straight_part(unsigned degree, const double c[], double x,
                          double width, double part[])
{
    double by = 1;

    memcpy(part, c, (degree + 1) * sizeof *part);
    topp_poly_shift(degree, part, x);
    for (unsigned n = 0; n <= degree; n++, by *= width)
        part[n] *= by;
}

/* At least `least` over 0 .. 1, by the Bernstein coefficients of more and more
 * parts; no where that is not seen. */
static bool straight_is_rising(unsigned degree, const double c[], double least)
{
    for (unsigned parts = 1; parts <= STRAIGHT_PARTS; parts *= 4) {
        double lowest = INFINITY;
        for (unsigned k = 0; k < parts; k++) {
            double part[PLAN_TOPP_DEGREE_MAX] = { 0 };
            double b[PLAN_TOPP_DEGREE_MAX];
            straight_part(degree, c, (double)k / parts, 1. / parts, part);
            topp_poly_bernstein(degree, part, b);
            if (b[0] < least || b[degree] < least)
                return false;
            for (unsigned i = 0; i <= degree; i++)
                lowest = fmin(lowest, b[i]);
        }
        if (lowest >= least)
            return true;
    }
    return false;
}

/* The distance along the line rises all along a piece. */
static bool straight_goes_on(const struct plan_topp_path *path, uint32_t piece,
                             const struct topp_straight *straight)
{
    const double h = path->border[piece + 1] - path->border[piece];
    double slope[PLAN_TOPP_DEGREE_MAX] = { 0 };

    for (unsigned k = 0; k < path->axes; k++) {
        const double *coef =
            path->coef + ((size_t)piece * path->axes + k) * (path->degree + 1);
        double by = h * straight->along[k];
        for (unsigned n = 1; n <= path->degree; n++, by *= h)
            slope[n - 1] += n * coef[n] * by;
    }
    return straight_is_rising(path->degree - 1, slope,
                              -STRAIGHT_ROUNDING * straight->length);
}

/* --- stays on it ------------------------------------------------------------- */

/* Every power of s is along the line. */
static bool straight_is_on(const struct plan_topp_path *path, uint32_t piece,
                           const struct topp_straight *straight)
{
    const size_t size = path->degree + 1;
    const double *coef = path->coef + (size_t)piece * path->axes * size;
    double by = path->border[piece + 1] - path->border[piece];
    const double h = by;

    for (unsigned n = 1; n <= path->degree; n++, by *= h) {
        double along = 0;
        for (unsigned k = 0; k < path->axes; k++)
            along += coef[k * size + n] * straight->along[k];
        for (unsigned k = 0; k < path->axes; k++)
            if (!(fabs(coef[k * size + n] - along * straight->along[k]) * by <=
                  STRAIGHT_ROUNDING * straight->length))
                return false;
    }
    return true;
}

bool topp_straight_of(const struct plan_topp_path *path, uint32_t first,
                      uint32_t last, struct topp_straight *straight)
{
    double sum = 0;

    *straight = (struct topp_straight){ 0 };
    for (unsigned k = 0; k < path->axes; k++) {
        double from[4], to[4];
        topp_chain_powers(path, first, k, 0, from);
        topp_chain_powers(path, last, k,
                          path->border[last + 1] - path->border[last], to);
        straight->start[k] = from[0];
        straight->along[k] = to[0] - from[0];
        sum += straight->along[k] * straight->along[k];
    }
    straight->length = sqrt(sum);
    if (!(straight->length > 0))
        return false;
    for (unsigned k = 0; k < path->axes; k++)
        straight->along[k] /= straight->length;
    for (uint32_t i = first; i <= last; i++)
        if (!straight_is_on(path, i, straight) ||
            !straight_goes_on(path, i, straight))
            return false;
    return true;
}

void topp_straight_limit(const struct topp_straight *straight, unsigned axes,
                         const struct plan_topp_limit limit[],
                         const double jerk[], struct topp_line_limit *line)
{
    *line = (struct topp_line_limit){ INFINITY, INFINITY, INFINITY, INFINITY };
    for (unsigned k = 0; k < axes; k++) {
        const double d = straight->along[k];
        if (d == 0)
            continue;
        line->vel =
            fmin(line->vel, (d > 0 ? limit[k].vel_max : limit[k].vel_min) / d);
        line->acc =
            fmin(line->acc, (d > 0 ? limit[k].acc_max : limit[k].acc_min) / d);
        line->dec =
            fmin(line->dec, (d > 0 ? limit[k].acc_min : limit[k].acc_max) / -d);
        line->jerk = fmin(line->jerk, jerk[k] / fabs(d));
    }
}
