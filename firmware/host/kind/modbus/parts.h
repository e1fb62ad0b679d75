/* firmware/host/kind/modbus/parts.h - between kind.c and range.c. */
#ifndef FIRMWARE_HOST_KIND_MODBUS_PARTS_H
#define FIRMWARE_HOST_KIND_MODBUS_PARTS_H

#include "firmware/host/rig/rig_parts.h"

/* Of a whole axis: has the drive room for its positions? */
int rig_check_modbus_range(const struct yaml_value *value,
                           const struct modbus_map *map,
                           const struct rig_axis *axis);

#endif
