/* sim/odrive_parts.h - private to sim_odrive.c and odrive_motion.c. */
#ifndef SIM_ODRIVE_PARTS_H
#define SIM_ODRIVE_PARTS_H

#include "sim/sim_odrive.h"

enum sim_odrive_state {
    SIM_ODRIVE_IDLE = 1,
    SIM_ODRIVE_CLOSED_LOOP = 8,
    SIM_ODRIVE_HOMING = 11,
};

enum {
    SIM_ODRIVE_CONTROL_VELOCITY = 2,
    SIM_ODRIVE_CONTROL_POSITION = 3,
    SIM_ODRIVE_PASSTHROUGH = 1,
    SIM_ODRIVE_TRAPEZOIDAL = 5,
};

/* One step of the inner loop. */
void odrive_motion_step(struct sim_servo *base, int64_t dt_ns);
/* Torque on: from where it stands. */
void odrive_motion_begin(struct sim_odrive *self);
/* Homing has ended. */
void odrive_motion_homed(struct sim_odrive *self);

#endif
