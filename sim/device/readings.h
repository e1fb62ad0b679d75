/* sim/device/readings.h - what a simulated servo measures of itself: the heat of
 * its motor, its supply, the current of its motor.
 *
 * A temperature is that at rest, which is its kind's own, and where its motor has
 * a winding that gets warm (sim/physics/winding.h) 70 degC more at the rated
 * heat.  Temperature and supply can be moved off from outside, and all readings
 * can be taken from what it answers. */
#ifndef SIM_DEVICE_READINGS_H
#define SIM_DEVICE_READINGS_H

#include <stdbool.h>

#include "sim/physics/plant.h"

/* All zero: as it is built. */
struct sim_readings {
    double more_degc; /* than its own heat makes */
    double more_v;    /* than its supply has */
    bool missing;     /* it answers no question for a reading */
};

/* Above its temperature at rest. */
double sim_readings_warmth_degc(const struct sim_readings *readings,
                                const struct sim_plant *plant);

#endif
