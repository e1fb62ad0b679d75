/* firmware/host/kind/cia402/kind.c - a CiA 402 drive in a rig file; see
 * firmware/host/rig/kind.h. */
#include "firmware/host/rig/rig_parts.h"

static bool cia402_is_for(const struct rig_bus *bus)
{
    return bus->kind == RIG_CANOPEN;
}

const struct rig_kind rig_kind_cia402 = {
    .is_for = cia402_is_for,
};
