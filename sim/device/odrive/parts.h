/* sim/device/odrive/parts.h - private to servo.c and motion.c. */
#ifndef SIM_DEVICE_ODRIVE_PARTS_H
#define SIM_DEVICE_ODRIVE_PARTS_H

#include "sim/device/odrive/servo.h"

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

#define ODRIVE_ONE_Q24  (INT64_C(1) << 24)
#define ODRIVE_TURN_Q24 ((double)SIM_ODRIVE_COUNTS * (double)ODRIVE_ONE_Q24)

/* Counts in Q24; 0 for what a plant of 32-bit counts cannot be told. */
static inline int64_t odrive_q24(double turns)
{
    const double counts = turns * SIM_ODRIVE_COUNTS;

    if (!(counts < 4e9 && counts > -4e9)) /* NaN too */
        return 0;
    return (int64_t)(counts * (double)ODRIVE_ONE_Q24);
}

/* One step of the inner loop. */
void odrive_motion_step(struct sim_servo *base, int64_t dt_ns);
/* Torque on: from where it stands. */
void odrive_motion_begin(struct sim_odrive *self);
/* Homing has ended. */
void odrive_motion_homed(struct sim_odrive *self);

#endif
