/* sim/physics/hybrid.c - see hybrid.h. */
#include "sim/physics/hybrid.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "motion/core/err.h"

#define LOCATE_ITERATIONS 100
#define LOCATE_PART       1e-12 /* of a substep */

void sim_hybrid_init(struct sim_hybrid *hybrid,
                     const struct sim_hybrid_ops *ops, void *plant, int count,
                     double *work, double substep_max_s)
{
    *hybrid =
        (struct sim_hybrid){ .ops = ops,
                             .plant = plant,
                             .substep_max_s = substep_max_s,
                             .trial = work + SIM_GAUSS_WORK((ptrdiff_t)count) };
    sim_gauss_init(&hybrid->gauss, count, ops->rate, plant, work);
}

/* The smallest guard, and which one it is. */
static double sim_hybrid_guard(struct sim_hybrid *hybrid, double t_s,
                               const double *y, int *which)
{
    double guard[SIM_HYBRID_GUARDS];
    const int count = hybrid->ops->guards(hybrid->plant, t_s, y, guard);
    double smallest = 1;

    *which = -1;
    for (int i = 0; i < count; i++) {
        if (guard[i] < smallest) {
            smallest = guard[i];
            *which = i;
        }
    }
    return smallest;
}

static bool sim_hybrid_try(struct sim_hybrid *hybrid, double t_s, double step_s,
                           const double *y)
{
    memcpy(hybrid->trial, y, (size_t)hybrid->gauss.count * sizeof *y);
    return sim_gauss_step(&hybrid->gauss, t_s, step_s, hybrid->trial);
}

/* Shorten *step_s so that the first event is at its end, just beyond; the
 * trial is then there.  Bisection, and the secant where it is inside. */
static bool sim_hybrid_locate(struct sim_hybrid *hybrid, double t_s,
                              double *step_s, double guard_end,
                              double guard_begin, const double *y)
{
    const double tolerance_s = *step_s * LOCATE_PART;
    double low = 0, high = *step_s, at_low = guard_begin, at_high = guard_end;
    int which;

    for (int i = 0; i < LOCATE_ITERATIONS && high - low > tolerance_s; i++) {
        double middle = 0.5 * (low + high);

        if (i % 2 == 0 && at_low > at_high) {
            const double secant =
                low + (high - low) * at_low / (at_low - at_high);
            /* A little beyond, so that the bracket closes from both sides. */
            const double beyond = secant + 0.25 * tolerance_s;
            if (beyond > low && beyond < high)
                middle = beyond;
        }
        if (!sim_hybrid_try(hybrid, t_s, middle, y))
            return false;
        const double guard =
            sim_hybrid_guard(hybrid, t_s + middle, hybrid->trial, &which);
        if (guard < 0) {
            high = middle;
            at_high = guard;
        } else {
            low = middle;
            at_low = guard;
        }
    }
    *step_s = high;
    return sim_hybrid_try(hybrid, t_s, high, y);
}

/* Events that are due at once. */
static bool sim_hybrid_events(struct sim_hybrid *hybrid, double t_s, double *y,
                              int *events, double *guard)
{
    int which;

    while ((*guard = sim_hybrid_guard(hybrid, t_s, y, &which)) < 0) {
        if (++*events > SIM_HYBRID_EVENTS)
            return false;
        hybrid->ops->event(hybrid->plant, t_s, y, which);
        sim_gauss_restart(&hybrid->gauss);
    }
    return true;
}

int sim_hybrid_step(struct sim_hybrid *hybrid, double step_s, double *y)
{
    const double substeps = ceil(step_s / hybrid->substep_max_s - 1e-9);
    const double substep_s = step_s / (substeps > 1 ? substeps : 1);
    double t_s = 0, guard = 0;
    int events = 0, which;

    while (t_s < step_s) {
        const double left_s = step_s - t_s;
        /* What is left by rounding belongs to the last substep. */
        double this_s = left_s < substep_s * (1 + 1e-9) ? left_s : substep_s;

        if (!sim_hybrid_events(hybrid, t_s, y, &events, &guard))
            return MOTION_E_RANGE;
        if (!sim_hybrid_try(hybrid, t_s, this_s, y))
            return MOTION_E_RANGE;
        const double end =
            sim_hybrid_guard(hybrid, t_s + this_s, hybrid->trial, &which);
        if (end < 0 && !sim_hybrid_locate(hybrid, t_s, &this_s, end, guard, y))
            return MOTION_E_RANGE;
        memcpy(y, hybrid->trial, (size_t)hybrid->gauss.count * sizeof *y);
        t_s = this_s == left_s ? step_s : t_s + this_s;
    }
    return sim_hybrid_events(hybrid, step_s, y, &events, &guard)
               ? MOTION_OK
               : MOTION_E_RANGE;
}
