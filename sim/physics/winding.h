/* sim/physics/winding.h - what the winding of a servo's motor limits: its torque
 * at a speed, by the voltage that is left beside the back-EMF, and how long it
 * has a torque, by its heat (I2t, thermal.h).
 *
 * A torque is the acceleration that it gives to motor and load together,
 * counts/s2, as in mechanics.h.  With the supply U, torque constant K (V s/rad),
 * resistance R and inertia J, of motor and load:
 *   stall = K U / (R J)    no-load speed = U / K    rated = K I_rated / J
 * and between -U and U the torque at speed v is within
 *   stall (-1 - v / no_load) .. stall (1 - v / no_load)
 * The inductance is left out.  Source: Leonhard, Control of Electrical Drives,
 * 3rd ed. (2001), 5.1. */
#ifndef SIM_PHYSICS_WINDING_H
#define SIM_PHYSICS_WINDING_H

#include "sim/physics/thermal.h"

#define SIM_WINDING_RATE_MAX 1000.0 /* stall / no_load, 1/s */

struct sim_winding_config {
    double stall_counts_s2; /* > 0; 0: the voltage limits nothing */
    double no_load_counts_s;
    double rated_counts_s2; /* > 0; 0: it does not get warm */
    double time_constant_s; /* 0.1 .. 1e5 */
    double warm_load;       /* of the rated heat, 0.1 .. 1: a warning */
};

struct sim_winding {
    bool given;
    bool warm, hot; /* hot from the rated heat on; either until it has less than
                       9/10 of warm_load */
    struct sim_winding_config config;
    struct sim_thermal thermal;
};

/* Cold.  MOTION_E_ARG when a value is outside the ranges above, stall / no_load
 * is above SIM_WINDING_RATE_MAX, or nothing is limited. */
int sim_winding_init(struct sim_winding *winding,
                     const struct sim_winding_config *config);

/* The torque nearest to this one that its voltage makes at that speed. */
double sim_winding_torque(const struct sim_winding *winding,
                          double torque_counts_s2, double speed_counts_s);

/* step_s (> 0) with that torque. */
void sim_winding_heat(struct sim_winding *winding, double torque_counts_s2,
                      double step_s);

#endif
