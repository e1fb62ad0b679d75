/* sim/physics/hybrid.h - steps of a plant whose equation changes at events:
 * a contact, a start, a stop.
 *
 * Between events the equation is smooth and is stepped by gauss.h.  An event is
 * where a guard falls below 0; its time is found by repeating the substep with
 * other lengths, so that a step may hold several events and none is rounded to
 * a substep.  Source: Hairer, Norsett & Wanner, Solving Ordinary Differential
 * Equations I (1993), II.6 (location of discontinuities). */
#ifndef SIM_PHYSICS_HYBRID_H
#define SIM_PHYSICS_HYBRID_H

#include "sim/physics/gauss.h"

#define SIM_HYBRID_GUARDS  32
#define SIM_HYBRID_EVENTS  512 /* in one step */
#define SIM_HYBRID_WORK(n) (SIM_GAUSS_WORK(n) + (n))

struct sim_hybrid_ops {
    sim_gauss_rate *rate;
    /* The guards of the mode in force (at most SIM_HYBRID_GUARDS); their
     * number.  Those that do not apply are positive. */
    int (*guards)(void *plant, double t_s, const double *y, double *guard);
    /* Guard `which` is below 0: change the mode, and y where it jumps. */
    void (*event)(void *plant, double t_s, double *y, int which);
};

struct sim_hybrid {
    struct sim_gauss gauss;
    const struct sim_hybrid_ops *ops;
    void *plant;
    double substep_max_s;
    double *trial; /* private, in the caller's workspace */
};

/* work: SIM_HYBRID_WORK(count) doubles. */
void sim_hybrid_init(struct sim_hybrid *hybrid,
                     const struct sim_hybrid_ops *ops, void *plant, int count,
                     double *work, double substep_max_s);

/* y[] to step_s later; times that the plant sees are since the begin of the
 * step.  MOTION_E_RANGE when the iteration of a substep does not converge or
 * there are more than SIM_HYBRID_EVENTS events; y is then where it got. */
int sim_hybrid_step(struct sim_hybrid *hybrid, double step_s, double *y);

#endif
