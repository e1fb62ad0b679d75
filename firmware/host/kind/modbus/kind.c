/* firmware/host/kind/modbus/kind.c - a Modbus servo in a rig file; see
 * firmware/host/rig/kind.h. */
#include "firmware/host/rig/rig_parts.h"

static bool modbus_is_for(const struct rig_bus *bus)
{
    return !rig_bus_is_can(bus);
}

const struct rig_kind rig_kind_modbus = {
    .is_for = modbus_is_for,
};
