/* tests/sim/oracle.h - what the steps of sim/physics are judged by: energy and
 * momentum of a state, shapes at rest, modes of vibration. */
#ifndef TESTS_SIM_ORACLE_H
#define TESTS_SIM_ORACLE_H

#include <stdbool.h>

#include "sim/physics/bodies.h"
#include "sim/physics/drivetrain.h"
#include "sim/physics/linkage.h"
#include "sim/physics/particles.h"

/* Kinetic, with rotation, and -m g p. */
double oracle_bodies_energy_j(const struct sim_bodies *bodies);
/* Angular momentum is about the origin, spin included. */
void oracle_bodies_momentum(const struct sim_bodies *bodies, double linear[3],
                            double angular[3]);
/* Between the surfaces of a pair, at t_s of the last step. */
double oracle_bodies_gap_m(const struct sim_bodies *bodies,
                           const struct sim_contact *contact, double t_s);

/* Kinetic, of the springs, and -m g p of all nodes. */
double oracle_particles_energy_j(const struct sim_particles *particles);
void oracle_particles_momentum(const struct sim_particles *particles,
                               double linear[3], double angular[3]);
/* Step until the nodes rest, stopping them all whenever their kinetic energy
 * falls (A. S. Day, The Engineer 219 (1965), 218: dynamic relaxation).  False
 * when nothing rests after `steps` of them. */
bool oracle_particles_settle(struct sim_particles *particles, long steps);

/* 0 when it hangs straight down, at rest. */
double oracle_linkage_energy_j(const struct sim_linkage *linkage);
/* Small swings of a linkage: frequencies and sideways shapes of its masses as
 * of oracle_modes, by what its steps do. */
bool oracle_linkage_modes(const struct sim_linkage_config *config, double *hz,
                          double *shape);

/* Kinetic, in the couplings and the springs to a support at 0, and of gravity
 * (0 at angle 0). */
double oracle_drivetrain_energy_j(const struct sim_drivetrain *drive);

/* Modes, lowest first, where acc[i n + j] is the acceleration of coordinate i
 * when j alone is displaced by 1: frequencies in Hz (0 for a motion without
 * stiffness), and in row i of shape (n x n) the displacements, the largest 1 in
 * size.  acc is spoilt.  Cyclic Jacobi: Golub & Van Loan, Matrix Computations,
 * 4th ed. (2013), 8.5.2.  False when the iteration does not end. */
bool oracle_modes(const double *mass, double *acc, int n, double *hz,
                  double *shape);

#endif
