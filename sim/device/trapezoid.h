/* sim/device/trapezoid.h - the ramps that a drive makes by itself: up to a
 * speed, and down to rest at a place. */
#ifndef SIM_DEVICE_TRAPEZOID_H
#define SIM_DEVICE_TRAPEZOID_H

#include <stdbool.h>

struct sim_trapezoid {
    double vel_max, acc, dec; /* > 0; turns/s, turns/s2 */
};

/* One step of dt_s towards `to`, from any state; true: it is there. */
bool sim_trapezoid_step(const struct sim_trapezoid *shape, double to,
                        double dt_s, double *pos, double *vel);
/* One step of the speed towards `to` (no more than acc). */
bool sim_trapezoid_speed(const struct sim_trapezoid *shape, double to,
                         double dt_s, double *pos, double *vel);

#endif
