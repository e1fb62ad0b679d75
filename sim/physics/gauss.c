/* sim/physics/gauss.c - see gauss.h. */
#include "sim/physics/gauss.h"

#include <float.h>
#include <math.h>
#include <stddef.h>

#define SQRT3 1.7320508075688772
/* c1, c2; a11 = a22 = 1/4, a12 = 1/4 - sqrt(3)/6, a21 = 1/4 + sqrt(3)/6 */
#define NODE_1 (0.5 - SQRT3 / 6)
#define NODE_2 (0.5 + SQRT3 / 6)
#define A12    (0.25 - SQRT3 / 6)
#define A21    (0.25 + SQRT3 / 6)
/* Of the largest rate.  Accelerations are larger than speeds; what is left of a
 * speed must be below its rounding too, or it adds up over 1e6 steps: with
 * DBL_EPSILON a spring gained 4e-7 of its energy, with this nothing. */
#define FLOOR (DBL_EPSILON / 1024)
#define STALL 1e9 /* of FLOOR: 2e-10 of the rates, or of the values */

void sim_gauss_init(struct sim_gauss *gauss, int count, sim_gauss_rate *rate,
                    void *plant, double *work)
{
    *gauss = (struct sim_gauss){ .count = count,
                                 .rate = rate,
                                 .plant = plant,
                                 .work = work,
                                 .floor = FLOOR };
}

void sim_gauss_restart(struct sim_gauss *gauss)
{
    gauss->last_s = 0;
}

/* Stages from those of the last step (its line, continued) or from the rate at
 * the start. */
static void sim_gauss_predict(struct sim_gauss *gauss, double t_s,
                              double step_s, const double *y)
{
    const int n = gauss->count;
    double *const k1 = gauss->work, *const k2 = k1 + n;

    if (gauss->last_s == step_s) {
        for (int i = 0; i < n; i++) {
            const double rise = (k2[i] - k1[i]) * SQRT3;
            k1[i] += rise;
            k2[i] += rise;
        }
        return;
    }
    gauss->rate(gauss->plant, t_s, y, k1);
    for (int i = 0; i < n; i++)
        k2[i] = k1[i];
}

/* One iteration; the largest change of a step, as a part of the largest step
 * and value. */
static double sim_gauss_iterate(struct sim_gauss *gauss, double t_s,
                                double step_s, const double *y)
{
    const int n = gauss->count;
    double *const k1 = gauss->work, *const k2 = k1 + n, *const y1 = k2 + n,
                  *const y2 = y1 + n, *const next = y2 + n;
    double change = 0;

    for (int i = 0; i < n; i++)
        y1[i] = y[i] + step_s * (0.25 * k1[i] + A12 * k2[i]);
    gauss->rate(gauss->plant, t_s + NODE_1 * step_s, y1, next);
    for (int i = 0; i < n; i++) {
        const double difference = fabs(next[i] - k1[i]);
        change = difference > change ? difference : change;
        k1[i] = next[i];
    }
    /* The second stage with what is known of the first already. */
    for (int i = 0; i < n; i++)
        y2[i] = y[i] + step_s * (A21 * k1[i] + 0.25 * k2[i]);
    gauss->rate(gauss->plant, t_s + NODE_2 * step_s, y2, next);
    for (int i = 0; i < n; i++) {
        const double difference = fabs(next[i] - k2[i]);
        change = difference > change ? difference : change;
        k2[i] = next[i];
    }
    return change;
}

static double sim_gauss_largest(const double *values, int count)
{
    double largest = 0;

    for (int i = 0; i < count; i++)
        largest = fabs(values[i]) > largest ? fabs(values[i]) : largest;
    return largest;
}

bool sim_gauss_step(struct sim_gauss *gauss, double t_s, double step_s,
                    double *y)
{
    const int n = gauss->count;
    const double *const k1 = gauss->work, *const k2 = k1 + n;
    double before = DBL_MAX, change = 0, floor = 0, stall = 0;

    sim_gauss_predict(gauss, t_s, step_s, y);
    gauss->last_s = 0;
    for (int i = 0;; i++) {
        if (i == SIM_GAUSS_ITERATIONS)
            return false;
        change = sim_gauss_iterate(gauss, t_s, step_s, y);
        if (i == 0) {
            floor = sim_gauss_largest(k1, 2 * n) * gauss->floor;
            stall = fmax(STALL * FLOOR * sim_gauss_largest(k1, 2 * n),
                         STALL * FLOOR * sim_gauss_largest(y, n) / step_s);
        }
        /* Down to rounding, or no nearer: what contracts and then does not is
         * at the rounding of the rates themselves. */
        if (change <= floor || (change >= before && change <= stall))
            break;
        before = change;
    }
    for (int i = 0; i < 2 * n; i++) {
        if (!isfinite(k1[i]))
            return false;
    }
    for (int i = 0; i < n; i++)
        y[i] += 0.5 * step_s * (k1[i] + k2[i]);
    gauss->last_s = step_s;
    return true;
}
