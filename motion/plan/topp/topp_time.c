/* motion/plan/topp/topp_time.c - see topp_time.h and topp.h. */
#include "motion/plan/topp/topp_time.h"

#include <math.h>

#include "motion/double/double_interval.h"
#include "motion/double/double_math.h"
#include "motion/plan/topp/topp.h"

/* atanh(sqrt z) / sqrt z for z >= 0, atan(sqrt -z) / sqrt -z below. */
static double topp_arc(double z)
{
    if (fabs(z) < 1e-3)
        return 1 + z * (1. / 3 + z * (1. / 5 + z * (1. / 7 + z * (1. / 9))));
    const double r = sqrt(fabs(z));
    return (z > 0 ? double_atanh(r) : double_atan(r)) / r;
}

/* 2 h atanh(sqrt(a) / w) / sqrt(a), a = x0 - 2 x1 + x2 and
 * w = sqrt(x0) + sqrt(x2). */
double topp_time(const double x[3], double h)
{
    const double w = sqrt(x[0]) + sqrt(x[2]);

    if (w == 0) /* from rest to rest */
        return h * DOUBLE_PI / sqrt(2 * x[1]);
    return 2 * h / w * topp_arc((x[0] - 2 * x[1] + x[2]) / (w * w));
}

double plan_topp_duration(const struct plan_topp *topp)
{
    return topp->t[topp->intervals];
}

/* Where on the interval the time `t` from its start is: with
 * A = x''/2 by s, s' = r cosh(k t) + b sinh(k t) / k, and so on. */
static void topp_inside(const double x[3], double h, double t,
                        struct plan_topp_state *state)
{
    const double curve = (x[0] - 2 * x[1] + x[2]) / (h * h); /* k^2 */
    const double r = sqrt(x[0]), b = (x[1] - x[0]) / h;
    const double z = curve * t * t;
    double s, c1; /* sinh(k t) / (k t), (cosh(k t) - 1) / (k t)^2 */

    double_sinch(z, &s, &c1);
    state->s = r * t * s + b * t * t * c1;
    state->vel = r * (1 + z * c1) + b * t * s;
    state->acc = b + curve * state->s;
    state->jerk = curve * state->vel;
}

void plan_topp_at(const struct plan_topp *topp, double t_s,
                  struct plan_topp_state *state)
{
    if (!(t_s > 0))
        t_s = 0;
    if (t_s > plan_topp_duration(topp))
        t_s = plan_topp_duration(topp);
    const uint32_t low =
        double_interval_find(topp->t, sizeof *topp->t, topp->intervals, t_s);
    topp_inside(topp->x[low], topp->s[low + 1] - topp->s[low],
                t_s - topp->t[low], state);
    state->s += topp->s[low];
}
