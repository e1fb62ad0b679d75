/* tests/motion/topp_judge.c - see topp_judge.h. */
#include "tests/motion/topp_judge.h"

#include <math.h>

static double excess(double value, double min, double max)
{
    return value > 0 ? value / max - 1 : value / min - 1;
}

double topp_judge_excess(const struct plan_topp_request *request,
                         const struct plan_topp *topp, unsigned points)
{
    const struct plan_topp_path *path = &request->path;
    const double duration = plan_topp_duration(topp);
    double worst = 0;
    uint32_t piece = 0;

    for (unsigned i = 0; i <= points; i++) {
        struct plan_topp_state state;
        plan_topp_at(topp, duration * i / points, &state);
        while (piece + 1 < path->pieces && state.s >= path->border[piece + 1])
            piece++;
        const double x = state.s - path->border[piece];
        for (unsigned k = 0; k < path->axes; k++) {
            const struct plan_topp_limit *limit = &request->limit[k];
            const double *coef = path->coef + ((size_t)piece * path->axes + k) *
                                                  (path->degree + 1);
            double d1 = 0, d2 = 0;
            for (unsigned n = path->degree; n >= 1; n--) {
                d2 = d2 * x + d1;
                d1 = d1 * x + n * coef[n];
            }
            const double v = d1 * state.vel;
            const double a = d1 * state.acc + d2 * state.vel * state.vel;
            worst = fmax(worst, excess(v, limit->vel_min, limit->vel_max));
            worst = fmax(worst, excess(a, limit->acc_min, limit->acc_max));
        }
    }
    return worst;
}
