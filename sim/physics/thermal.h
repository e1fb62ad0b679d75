/* sim/physics/thermal.h - the I2t model of a motor's or a drive's heat:
 *
 *   time_constant load' = (current/rated)^2 - load
 *
 * so that load is 1 after a long time at the rated current.  Source: IEC
 * 60034-11 and IEC 60255-149, thermal overload (first-order model). */
#ifndef SIM_PHYSICS_THERMAL_H
#define SIM_PHYSICS_THERMAL_H

#include <stdbool.h>

#include "sim/physics/signal.h"

struct sim_thermal_config {
    double rated_current_a; /* > 0 */
    double time_constant_s; /* > 0 */
    double trip_load;       /* > 0 */
};

struct sim_thermal {
    struct sim_thermal_config config;
    double load;   /* part of the rated heat */
    bool tripped;  /* load has reached trip_load */
    double trip_s; /* first at this time */
    /* private: what a step leaves of the load after half of it */
    double step_s, half;
};

/* MOTION_E_ARG when a value is outside the ranges above, or load is negative. */
int sim_thermal_init(struct sim_thermal *thermal,
                     const struct sim_thermal_config *config, double load);

/* One step of step_s, at most a tenth of the time constant, from begin_s on:
 * exact for a constant current, of order 4 for another. */
void sim_thermal_step(struct sim_thermal *thermal, double begin_s,
                      double step_s, const struct sim_signal *current_a);

#endif
