/* hal/drive/turn/moteus_parts.h - private to moteus.c and moteus_wire.c.
 */
#ifndef HAL_DRIVE_TURN_MOTEUS_PARTS_H
#define HAL_DRIVE_TURN_MOTEUS_PARTS_H

#include "hal/drive/turn/moteus.h"

extern const struct can_bus_node_ops drive_moteus_node_ops;

#endif
