/* firmware/host/kind/virtual/kind.c - a virtual axis, without a motor and on no
 * bus, in a rig file; see firmware/host/rig/kind.h. */
#include "firmware/host/rig/rig_parts.h"

static const struct yaml_field rig_virtual_fields[] = {
    { "kind", YAML_REQUIRED, RIG_KIND_WORDS, rig_read_drive_kind,
      offsetof(struct rig_axis, kind) },
};
const struct yaml_shape rig_virtual_shape = { "virtual_drive",
                                              rig_virtual_fields,
                                              ARRAY_LEN(rig_virtual_fields) };

static bool virtual_is_for(const struct rig_bus *bus)
{
    (void)bus;
    return false;
}

/* It has no counts: where it stands is said in the axis's unit. */
static int virtual_read(struct rig_reader *reader,
                        const struct yaml_value *value, struct rig_axis *axis)
{
    axis->bus = RIG_NO_BUS;
    axis->counts_num = RIG_TURN_COUNTS;
    axis->counts_den = 1;
    return yaml_fields_read(value, &rig_virtual_shape, reader, axis);
}

const struct rig_kind rig_kind_virtual = {
    .is_for = virtual_is_for,
    .read = virtual_read,
    .cannot_home = "a virtual axis, which is at its last set point",
};
