/* sim/physics/linkage.h - point masses on rigid massless links, one hung from
 * another, in a plane: a pendulum, a load under a dolly, a double pendulum, a
 * chain.
 *
 * Angles are from straight down, positive towards +x.  With a[i][j] = l[i] l[j]
 * (mass from the lower of i and j down) and w = angle':
 *
 *   momentum p[i] = sum_j a[i][j] cos(angle[i] - angle[j]) w[j]
 *   p[i]' = - sum_j a[i][j] w[i] w[j] sin(angle[i] - angle[j])
 *           - mu[i] l[i] (g sin(angle[i]) + pivot_x'' cos(angle[i]))
 *           - damping w[0], for i = 0
 *
 * where mu[i] is the mass from i down: Lagrange's equations in the frame of the
 * pivot.  Angle and momentum are canonical, so that gauss.h keeps the energy of
 * an undamped linkage within a bounded error.  Source: Goldstein, Poole &
 * Safko, Classical Mechanics, 3rd ed. (2002), 1.4, 8.1. */
#ifndef SIM_PHYSICS_LINKAGE_H
#define SIM_PHYSICS_LINKAGE_H

#include "sim/physics/gauss.h"
#include "sim/physics/signal.h"

#define SIM_LINKAGE_LINKS 16

struct sim_linkage_config {
    int links;                          /* 1 .. SIM_LINKAGE_LINKS */
    double mass_kg[SIM_LINKAGE_LINKS];  /* > 0 */
    double length_m[SIM_LINKAGE_LINKS]; /* > 0 */
    double damping_n_m_s;               /* at the pivot, >= 0 */
    double gravity_m_s2;                /* >= 0 */
};

struct sim_linkage {
    struct sim_linkage_config config;
    double angle_rad[SIM_LINKAGE_LINKS];
    double speed_rad_s[SIM_LINKAGE_LINKS];
    /* private */
    double below_kg[SIM_LINKAGE_LINKS]; /* mass from a link down */
    struct sim_signal pivot_acc_m_s2;
    struct sim_gauss gauss;
    double work[SIM_GAUSS_WORK(2 * SIM_LINKAGE_LINKS)];
};

/* Straight down, at rest.  It points into itself: do not copy.  MOTION_E_ARG
 * when a value is outside the ranges above. */
int sim_linkage_init(struct sim_linkage *linkage,
                     const struct sim_linkage_config *config);

/* One step of step_s (> 0), over which the pivot moves as pivot_x_m.  Angles
 * and speeds may be set between steps.  MOTION_E_RANGE when it moves so fast
 * that the step does not converge. */
int sim_linkage_step(struct sim_linkage *linkage, double step_s,
                     const struct sim_signal *pivot_x_m);

/* Of mass i, from the pivot. */
void sim_linkage_place_m(const struct sim_linkage *linkage, int i, double *x_m,
                         double *z_m);

#endif
