/* sim/physics/drivetrain_config.h - what may be a drivetrain, and how fast it
 * is. */
#ifndef SIM_PHYSICS_DRIVETRAIN_CONFIG_H
#define SIM_PHYSICS_DRIVETRAIN_CONFIG_H

#include "sim/physics/drivetrain.h"

bool sim_drivetrain_is_legal(const struct sim_drivetrain_config *config);

/* No less than any rate of the system, 1/s: rows of its matrix, Gershgorin. */
double sim_drivetrain_fastest(const struct sim_drivetrain_config *config);

#endif
