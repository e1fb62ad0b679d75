/* hal/drive/moteus/parts.h - private to drive.c and wire.c.
 */
#ifndef HAL_DRIVE_MOTEUS_PARTS_H
#define HAL_DRIVE_MOTEUS_PARTS_H

#include "hal/drive/moteus/drive.h"

extern const struct can_bus_node_ops drive_moteus_node_ops;

#endif
