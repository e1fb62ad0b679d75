/* firmware/host/kind/turn/parts.h - what a rig says alike of all drives that
 * count turns. */
#ifndef FIRMWARE_HOST_KIND_TURN_PARTS_H
#define FIRMWARE_HOST_KIND_TURN_PARTS_H

#include "firmware/host/rig/rig_parts.h"

/* turns: */
#define RIG_TURN_EXPECTED                                                      \
    "turns of the motor per unit of the axis, such as '0.2 per mm' or "        \
    "{num: 50, den: 360}"
int rig_read_turn(void *reader, const struct yaml_value *value, void *out);
/* rated_torque: */
#define RIG_RATED_TORQUE_EXPECTED "0.001 .. 10000 (Nm), of the motor"
int rig_read_rated_torque(void *reader, const struct yaml_value *value,
                          void *out);

#endif
