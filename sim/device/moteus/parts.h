/* sim/device/moteus/parts.h - private to servo.c and
 * subframes.c. */
#ifndef SIM_DEVICE_MOTEUS_PARTS_H
#define SIM_DEVICE_MOTEUS_PARTS_H

#include "sim/device/moteus/servo.h"

enum {
    SIM_MOTEUS_STOPPED = 0,
    SIM_MOTEUS_FAULT = 1,
    SIM_MOTEUS_POSITION = 10,
    SIM_MOTEUS_TIMEOUT = 11,

    SIM_MOTEUS_FAULT_DRIVER = 33,
    SIM_MOTEUS_FAULT_ENCODER = 35,
    SIM_MOTEUS_FAULT_HOT = 38,
};

/* Commands by register minus 0x020. */
enum {
    SIM_MOTEUS_COMMAND_POSITION = 0x0,
    SIM_MOTEUS_COMMAND_VELOCITY = 0x1,
    SIM_MOTEUS_COMMAND_TORQUE = 0x2,
    SIM_MOTEUS_COMMAND_TIMEOUT = 0x7,
    SIM_MOTEUS_COMMAND_VEL_LIMIT = 0x8,
    SIM_MOTEUS_COMMAND_ACC_LIMIT = 0x9,
};

/* ---- moteus_subframes.c: the sub-frames ---- */

void sim_moteus_on_frame(struct sim_servo *base,
                         const struct hal_can_frame *frame);

/* ---- moteus.c: registers ---- */

/* False: there is no such register, or not for this. */
bool sim_moteus_read(struct sim_moteus *self, unsigned reg, double *value);
bool sim_moteus_write(struct sim_moteus *self, unsigned reg, double value);
/* The frame has been read: what it commanded is in force. */
void sim_moteus_commanded(struct sim_moteus *self);

#endif
