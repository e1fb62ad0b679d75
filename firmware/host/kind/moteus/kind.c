/* firmware/host/kind/moteus/kind.c - a moteus in a rig file; see
 * firmware/host/rig/kind.h. */
#include "firmware/host/rig/rig_parts.h"

static bool moteus_is_for(const struct rig_bus *bus)
{
    return bus->kind == RIG_CAN && bus->data_bit_rate > 0;
}

const struct rig_kind rig_kind_moteus = {
    .is_for = moteus_is_for,
};
