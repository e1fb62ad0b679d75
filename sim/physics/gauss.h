/* sim/physics/gauss.h - one step of y' = f(t, y) by Gauss collocation with two
 * stages.
 *
 * Order 4, symmetric, symplectic, A-stable, and it keeps quadratic invariants:
 * momentum and angular momentum of particles to rounding, the energy of a
 * conservative plant within a bounded error, however many steps; what damps in
 * the equation damps in the step.  Source: Hairer, Lubich & Wanner, Geometric
 * Numerical Integration (2006), II.1.3, IV.2.1, VI.4.2; the stopping rule of
 * the iteration is that of VIII.6.
 *
 * The stages are found by fixed-point iteration, which converges for
 * step_s x (largest rate of the system) < 3; plants cut their steps so that it
 * is below 1/2. */
#ifndef SIM_PHYSICS_GAUSS_H
#define SIM_PHYSICS_GAUSS_H

#include <stdbool.h>

/* Doubles of workspace for n values. */
#define SIM_GAUSS_WORK(n)    (5 * (n))
#define SIM_GAUSS_ITERATIONS 40

/* rate[] of y[] at t_s since the step of the plant began. */
typedef void sim_gauss_rate(void *plant, double t_s, const double *y,
                            double *rate);

struct sim_gauss {
    int count;
    sim_gauss_rate *rate;
    void *plant;
    double *work; /* SIM_GAUSS_WORK(count), the caller's */
    /* Of the largest rate: what an iteration changes at the end.  By default so
       little that nothing adds up over 1e6 steps of a plant that keeps its energy;
       may be set larger after init for one that loses it. */
    double floor;
    /* private: the length of the last step, whose stages predict the next; 0
       when there is none */
    double last_s;
};

void sim_gauss_init(struct sim_gauss *gauss, int count, sim_gauss_rate *rate,
                    void *plant, double *work);

/* The equation has changed: the last stages do not predict the next. */
void sim_gauss_restart(struct sim_gauss *gauss);

/* y[] at t_s to y[] at t_s + step_s.  False when the iteration did not
 * converge: step_s is too long; y is then as it was. */
bool sim_gauss_step(struct sim_gauss *gauss, double t_s, double step_s,
                    double *y);

#endif
