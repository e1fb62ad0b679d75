/* firmware/host/kind/odrive/kind.c - an ODrive in a rig file; see
 * firmware/host/rig/kind.h. */
#include "firmware/host/rig/rig_parts.h"

static bool odrive_is_for(const struct rig_bus *bus)
{
    return bus->kind == RIG_CAN && bus->data_bit_rate == 0;
}

const struct rig_kind rig_kind_odrive = {
    .is_for = odrive_is_for,
};
