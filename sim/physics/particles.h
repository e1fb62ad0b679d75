/* sim/physics/particles.h - particles and springs: a cable, a cloth, a chain, a
 * load on a spring.
 *
 * A spring pulls its node i towards j with k (l - l0) + c l', and pushes when
 * it is shorter than l0.  Two spheres of half the distance l0 about its nodes are
 * a spring that only pushes: below l0, with k (l0 - l) less c l' (l0 - l) / l0, as
 * long as that is a push (Hunt and Crossley, J. Appl. Mech. 42 (1975), 440).
 * With it a cloth does not pass through itself.  Drag is -linear v - quadratic |v| v on every free
 * node.  A fixed node stays; the driven node follows the input.  Steps are
 * Gauss collocation (gauss.h): momentum and angular momentum are kept to
 * rounding, energy within a bounded error.  A cloth is a grid with structural,
 * shear and bending springs: Provot, Graphics Interface 1995, 3; Parent,
 * Computer Animation, 3rd ed., 7.6.
 *
 * The caller gives all memory; a step takes none. */
#ifndef SIM_PHYSICS_PARTICLES_H
#define SIM_PHYSICS_PARTICLES_H

#include <stdbool.h>

#include "sim/physics/gauss.h"
#include "sim/physics/signal.h"

#define SIM_PARTICLES_NODES 100000
/* Doubles: places, speeds and the steps' workspace of n nodes. */
#define SIM_PARTICLES_WORK(n) (6 * (n) + SIM_GAUSS_WORK(6 * (n)))

struct sim_node {
    double mass_kg; /* > 0 */
    bool fixed;     /* stays where it is, or follows the input */
};

struct sim_spring {
    int i, j;             /* different nodes */
    double stiffness_n_m; /* >= 0 */
    double damping_n_s_m; /* >= 0 */
    double rest_m;        /* >= 0 */
    bool pushes;          /* and never pulls: rest_m > 0 */
};

struct sim_particles_config {
    int nodes, springs; /* 1 .. SIM_PARTICLES_NODES, 0 .. */
    const struct sim_node *node;
    const struct sim_spring *spring;
    double gravity_m_s2[3];
    double drag_linear_n_s_m, drag_quadratic_n_s2_m2; /* >= 0 */
    int driven; /* a fixed node that follows the input, or -1 */
};

struct sim_particles_input {
    struct sim_signal pos_m[3]; /* of the driven node */
};

struct sim_particles {
    struct sim_particles_config config;
    /* State, x y z of every node; may be set between steps. */
    double *pos_m, *vel_m_s;
    /* private */
    const struct sim_particles_input *input;
    struct sim_gauss gauss;
    double substep_max_s;
};

/* At rest at the origin.  work: SIM_PARTICLES_WORK(nodes) doubles, which are
 * the particles' from now on, like the nodes and springs of config.
 * MOTION_E_ARG when a value is outside the ranges above. */
int sim_particles_init(struct sim_particles *particles,
                       const struct sim_particles_config *config, double *work);

/* One step of step_s (> 0), cut so that substep x fastest rate stays small.
 * input may be NULL without a driven node.  MOTION_E_RANGE: a substep does not
 * converge (two nodes of a spring in one place, or far too fast). */
int sim_particles_step(struct sim_particles *particles, double step_s,
                       const struct sim_particles_input *input);

/* Positive: tension, without damping. */
double sim_particles_tension_n(const struct sim_particles *particles,
                               int spring);

/* The springs of a grid of columns x rows nodes (index = column rows + row):
 * structural to the neighbours, shear on both diagonals, bending to the second
 * neighbours along rows and columns.  A kind whose stiffness is 0 is left out.
 * Returns the number of springs, or MOTION_E_FULL. */
struct sim_cloth {
    int columns, rows;
    double spacing_m;
    double structural_n_m, shear_n_m, bending_n_m;
    double structural_n_s_m, shear_n_s_m, bending_n_s_m;
};
int sim_cloth_springs(const struct sim_cloth *cloth, struct sim_spring *springs,
                      int capacity);
/* Of every pair of nodes of a cloth, or any other number of nodes. */
#define SIM_SPHERES_PAIRS(nodes) ((nodes) * ((nodes)-1) / 2)
/* Every node is a sphere with half the rest_m of `like`, which pushes: a spring of
 * that kind between any two.  Returns how many. */
int sim_spheres_springs(const struct sim_spring *like, int nodes,
                        struct sim_spring *springs);

#endif
