/* motion/plan/topp_straight.c - see topp_straight.h. */
#include "motion/plan/topp_straight.h"

#include <math.h>

#include "motion/plan/topp_chain.h"

/* Of the length: what counts as none. */
#define STRAIGHT_ROUNDING 1e-9

/* Halvings of an interval in search of a place where it turns back. */
#define STRAIGHT_HALVINGS 12

/* --- does not turn back ------------------------------------------------------ */

/* Coefficients of powers over 0 .. 1 to those of Bernstein polynomials:
 * b_i = sum over k <= i of binomial(i, k) / binomial(n, k) c_k. */
static void straight_bernstein(unsigned degree, const double c[], double b[])
{
    for (unsigned i = 0; i <= degree; i++) {
        double by = 1;
        b[i] = 0;
        for (unsigned k = 0; k <= i; k++) {
            b[i] += by * c[k];
            by *= (double)(i - k) / (degree - k);
        }
    }
}

static bool straight_is_rising(unsigned degree, const double b[], double least,
                               int halvings)
{
    double left[PLAN_TOPP_DEGREE_MAX], right[PLAN_TOPP_DEGREE_MAX];
    double lowest = b[0];

    for (unsigned i = 1; i <= degree; i++)
        lowest = fmin(lowest, b[i]);
    if (lowest >= least)
        return true;
    if (b[0] < least || b[degree] < least || halvings == 0)
        return b[0] >= least && b[degree] >= least;
    for (unsigned i = 0; i <= degree; i++)
        right[i] = b[i];
    for (unsigned i = 0; i <= degree; i++) { /* de Casteljau at 1/2 */
        left[i] = right[0];
        for (unsigned k = 0; k + i < degree; k++)
            right[k] = (right[k] + right[k + 1]) / 2;
    }
    return straight_is_rising(degree, left, least, halvings - 1) &&
           straight_is_rising(degree, right, least, halvings - 1);
}

/* The distance along the line rises all along a piece. */
static bool straight_goes_on(const struct plan_topp_path *path, uint32_t piece,
                             const struct topp_straight *straight)
{
    const double h = path->border[piece + 1] - path->border[piece];
    double slope[PLAN_TOPP_DEGREE_MAX] = { 0 }, b[PLAN_TOPP_DEGREE_MAX];

    for (unsigned k = 0; k < path->axes; k++) {
        const double *coef =
            path->coef + ((size_t)piece * path->axes + k) * (path->degree + 1);
        double by = h * straight->along[k];
        for (unsigned n = 1; n <= path->degree; n++, by *= h)
            slope[n - 1] += n * coef[n] * by;
    }
    straight_bernstein(path->degree - 1, slope, b);
    return straight_is_rising(path->degree - 1, b,
                              -STRAIGHT_ROUNDING * straight->length,
                              STRAIGHT_HALVINGS);
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
