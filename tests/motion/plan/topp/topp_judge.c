/* tests/motion/plan/topp/topp_judge.c - see topp_judge.h. */
#include "tests/motion/plan/topp/topp_judge.h"

#include <math.h>

/* What steps of a law may be over what jerk allows, and what rounding is. */
#define STEP_REL 1e-3
#define ROUNDING 1e-12

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

/* --- laws with limits of jerk ------------------------------------------------- */

struct law_judge {
    const struct plan_topp_request *request;
    const double *jerk;
    const struct plan_topp_law *law;
};

static double law_excess(const struct law_judge *self, unsigned axis,
                         const struct plan_topp_axis_state *at)
{
    const struct plan_topp_limit *limit = &self->request->limit[axis];

    return fmax(fabs(at->jerk) / self->jerk[axis] - 1,
                fmax(excess(at->vel, limit->vel_min, limit->vel_max),
                     excess(at->acc, limit->acc_min, limit->acc_max)));
}

static double beyond(double value, double rounding, double most)
{
    return fmax(fabs(value) - rounding, 0) / most;
}

/* From one time to the next, dt later, each value changes as its derivatives
 * say and at most as the largest jerk allows: in shares of that, over what
 * rounding makes of differences. */
static double law_step(const struct law_judge *self, unsigned axis, double dt,
                       const struct plan_topp_axis_state *a,
                       const struct plan_topp_axis_state *b)
{
    const struct plan_topp_limit *limit = &self->request->limit[axis];
    const double acc = b->acc - a->acc;
    const double vel = b->vel - a->vel - dt * a->acc;
    const double pos = b->pos - a->pos - dt * (a->vel + dt * a->acc / 2);
    const double by = self->jerk[axis] * dt;

    return fmax(
        beyond(acc, ROUNDING * limit->acc_max, by),
        fmax(beyond(vel, ROUNDING * limit->vel_max, by * dt / 2),
             beyond(pos, ROUNDING * (1 + fabs(a->pos)), by * dt * dt / 6)));
}

/* Where the path begins or ends, as fast as the request says, and with no
 * acceleration or that of a constant s'. */
static bool law_is_at_end(const struct law_judge *self, bool is_end)
{
    const struct plan_topp_path *path = &self->request->path;
    const uint32_t piece = is_end ? path->pieces - 1 : 0;
    const double x = is_end ? path->border[piece + 1] - path->border[piece] : 0;
    const double speed =
        is_end ? self->request->end_speed : self->request->start_speed;
    struct plan_topp_axis_state at[PLAN_TOPP_AXES_MAX];

    plan_topp_law_at(self->law, is_end ? self->law->duration : 0, at);
    for (unsigned k = 0; k < path->axes; k++) {
        const struct plan_topp_limit *limit = &self->request->limit[k];
        const double *coef =
            path->coef + ((size_t)piece * path->axes + k) * (path->degree + 1);
        double p = 0, v = 0, a = 0;
        for (unsigned n = path->degree + 1; n-- > 0;) {
            a = a * x + 2 * v;
            v = v * x + p;
            p = p * x + coef[n];
        }
        if (!(fabs(at[k].pos - p) <= 1e-9 * (1 + fabs(p))) ||
            !(fabs(at[k].vel - v * speed) <= 1e-6 * limit->vel_max) ||
            !(fmin(fabs(at[k].acc), fabs(at[k].acc - a * speed * speed)) <=
              1e-6 * limit->acc_max))
            return false;
    }
    return true;
}

double topp_judge_law(const struct plan_topp_request *request,
                      const double jerk[], const struct plan_topp_law *law,
                      unsigned points)
{
    const struct law_judge self = { request, jerk, law };
    const double dt = law->duration / points;
    struct plan_topp_axis_state at[2][PLAN_TOPP_AXES_MAX];
    double worst = 0;

    if (!law_is_at_end(&self, false) || !law_is_at_end(&self, true))
        return INFINITY;
    if (law->duration == 0) /* all axes stand */
        return 0;
    for (unsigned i = 0; i <= points; i++) {
        plan_topp_law_at(law, dt * i, at[i % 2]);
        for (unsigned k = 0; k < request->path.axes; k++) {
            const double over = law_excess(&self, k, &at[i % 2][k]);
            if (!(over < INFINITY) ||
                (i > 0 && !(law_step(&self, k, dt, &at[1 - i % 2][k],
                                     &at[i % 2][k]) <= 1 + STEP_REL)))
                return INFINITY;
            worst = fmax(worst, over);
        }
    }
    return worst;
}
