/* hal/drive_moteus_parts.h - private to drive_moteus.c and drive_moteus_wire.c.
 */
#ifndef HAL_DRIVE_MOTEUS_PARTS_H
#define HAL_DRIVE_MOTEUS_PARTS_H

#include "hal/drive_moteus.h"

extern const struct can_bus_node_ops drive_moteus_node_ops;

#endif
