/* firmware/host/rig/rig_drive.c - an axis's drive. */
#include "firmware/host/rig/rig_parts.h"

#include <string.h>

#include "firmware/host/yaml/yaml_units.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

int rig_read_drive_kind(void *reader, const struct yaml_value *value, void *out)
{
    unsigned index;
    (void)reader;
    if (yaml_value_choice(value, rig_drive_kinds, RIG_DRIVE_KINDS, &index) < 0)
        return -1;
    *(enum rig_drive_kind *)out = (enum rig_drive_kind)index;
    return 0;
}

static const char *rig_bus_rates_text(const struct rig_bus *bus)
{
    if (bus->kind != RIG_CAN)
        return "";
    return bus->data_bit_rate > 0 ? " with FD frames" : " without FD frames";
}

int rig_read_drive_bus(void *reader, const struct yaml_value *value, void *out)
{
    const struct rig *rig = ((struct rig_reader *)reader)->rig;
    const char *names[RIG_BUSES_MAX];
    unsigned index;

    for (uint32_t i = 0; i < rig->bus_count; i++)
        names[i] = rig->bus[i].name;
    if (yaml_value_choice(value, names, rig->bus_count, &index) < 0)
        return -1;
    *(uint32_t *)out = index;
    if (!rig_kinds[((struct rig_reader *)reader)->axis->kind]->is_for(
            &rig->bus[index]))
        return yaml_value_refuse(value,
                                 "%s is a %s bus%s, not one for this kind "
                                 "of drive",
                                 names[index],
                                 rig_bus_kinds[rig->bus[index].kind],
                                 rig_bus_rates_text(&rig->bus[index]));
    return 0;
}

int rig_refuse_taken(const struct rig_reader *reader,
                     const struct yaml_value *value)
{
    const struct rig *rig = reader->rig;
    const struct rig_axis *axis = reader->axis;

    for (const struct rig_axis *other = rig->axis; other < axis; other++)
        if (other->bus == axis->bus && other->node_id == axis->node_id &&
            other->cia402.axis == axis->cia402.axis)
            return yaml_value_refuse(value, "%u on bus %s is axis %s already",
                                     axis->node_id, rig->bus[axis->bus].name,
                                     other->name);
    return 0;
}

int rig_read_drive_node(void *reader, const struct yaml_value *value, void *out)
{
    const struct rig_reader *self = reader;
    const struct rig_axis *axis = self->axis;
    const struct rig_bus *bus = &self->rig->bus[axis->bus];

    if (rig_read_node_id(reader, value, out) < 0)
        return -1;
    if (bus->kind == RIG_CANOPEN && axis->node_id == bus->node_id)
        return yaml_value_refuse(value, "%u is our own on bus %s",
                                 axis->node_id, bus->name);
    return rig_refuse_taken(self, value);
}

static int rig_read_counts_num(void *reader, const struct yaml_value *value,
                               void *out)
{
    char quote[YAML_QUOTE_MAX];
    (void)reader;
    if (yaml_value_integer(value, -INT64_MAX, INT64_MAX, out) < 0)
        return -1;
    if (*(int64_t *)out == 0)
        return yaml_value_refuse(value, "%s is zero",
                                 yaml_value_quote(quote, value));
    return 0;
}

static int rig_read_counts_den(void *reader, const struct yaml_value *value,
                               void *out)
{
    (void)reader;
    return yaml_value_integer(value, 1, INT64_MAX, out);
}

static const struct yaml_field rig_counts_fields[] = {
    { "num", YAML_REQUIRED,
      "a whole number of counts, negative for a reversed "
      "axis",
      rig_read_counts_num, offsetof(struct rig_axis, counts_num) },
    { "den", YAML_OPTIONAL, "the whole number of units they are for",
      rig_read_counts_den, offsetof(struct rig_axis, counts_den) },
};
const struct yaml_shape rig_counts_shape = { "counts", rig_counts_fields,
                                             ARRAY_LEN(rig_counts_fields) };

/* They fit when they do in Q32.32 after the conversion. */
bool rig_counts_fit(const struct rig_axis *axis)
{
    int64_t counts_q32;
    return motion_fixed_muldiv(axis->limit.pos_min_q32, axis->counts_num,
                               axis->counts_den, &counts_q32) == MOTION_OK &&
           motion_fixed_muldiv(axis->limit.pos_max_q32, axis->counts_num,
                               axis->counts_den, &counts_q32) == MOTION_OK;
}

int rig_read_ratio(struct rig_reader *reader, const struct yaml_value *value,
                   struct rig_axis *axis)
{
    const bool is_map = yaml_value_node(value)->kind == YAML_TREE_MAP;

    axis->counts_den = 1;
    return is_map ? yaml_fields_read(value, &rig_counts_shape, reader, axis)
                  : yaml_units_read_counts(value, axis->unit, &axis->counts_num,
                                           &axis->counts_den);
}

int rig_read_counts(void *reader, const struct yaml_value *value, void *out)
{
    struct rig_axis *axis = out;

    if (rig_read_ratio(reader, value, axis) < 0)
        return -1;
    if (!rig_counts_fit(axis))
        return yaml_value_refuse(value, "gives more than 2147483647 counts at "
                                        "the end of the axis");
    return 0;
}

static const struct yaml_field rig_drive_fields[] = {
    { "kind", YAML_REQUIRED, RIG_KIND_WORDS,
      rig_read_drive_kind, offsetof(struct rig_axis, kind) },
    { "bus", YAML_REQUIRED, "the name of a bus", rig_read_drive_bus,
      offsetof(struct rig_axis, bus) },
    { "axis", YAML_OPTIONAL, "1 .. 8, where several axes are behind one node",
      rig_read_cia402_axis, offsetof(struct rig_axis, cia402.axis) },
    { "node", YAML_REQUIRED, "a node number, 1 .. 127, of its own on the bus",
      rig_read_drive_node, offsetof(struct rig_axis, node_id) },
    { "counts", YAML_REQUIRED,
      "counts per unit of the axis, such as '4096 per mm' or "
      "{num: 1048576, den: 360}",
      rig_read_counts, 0 },
    { "pdo", YAML_OPTIONAL,
      "a map with rx, tx, rx2, tx2 and number, such as {rx: 0x401, tx: 0x381}",
      rig_read_cia402_pdo, offsetof(struct rig_axis, cia402.pdo) },
    { "eds", YAML_OPTIONAL,
      "the maker's EDS or DCF file, a path from the rig's directory",
      rig_read_eds, offsetof(struct rig_axis, eds) },
    { "parameters", YAML_OPTIONAL,
      "a map of objects and their values, such as {6065: 20000}",
      rig_read_parameters, 0 },
    { "mode", YAML_OPTIONAL, "csp, ip or csv", rig_read_cia402_mode,
      offsetof(struct rig_axis, cia402) },
    { "bandwidth", YAML_OPTIONAL, "0.1 Hz .. 50 Hz", rig_read_cia402_bandwidth,
      offsetof(struct rig_axis, cia402.gain_q16) },
    { "torque", YAML_OPTIONAL,
      "a share of the rated torque, 0 .. 3, that the highest acceleration "
      "takes",
      rig_read_cia402_torque, offsetof(struct rig_axis, torque_q32) },
    { "velocity_units", YAML_OPTIONAL,
      "the drive's units per count/s, such as {num: 10, den: 1}",
      rig_read_scale, offsetof(struct rig_axis, cia402.velocity) },
    { "acceleration_units", YAML_OPTIONAL,
      "the drive's units per count/s2, such as {num: 1, den: 1000}",
      rig_read_scale, offsetof(struct rig_axis, cia402.acceleration) },
    { "revolution", YAML_OPTIONAL,
      "the travel in one revolution of the drive's shaft, such as 10 mm",
      rig_read_cia402_revolution,
      offsetof(struct rig_axis, cia402.travel_q32) },
    { "options", YAML_OPTIONAL,
      "a map with quick_stop, shutdown, disable, halt and fault",
      rig_read_options, offsetof(struct rig_axis, cia402.option) },
    { "guarding", YAML_OPTIONAL,
      "a time of whole ms, at most half of the watchdog",
      rig_read_cia402_guarding,
      offsetof(struct rig_axis, cia402.guard_period_ns) },
    { "times", YAML_OPTIONAL,
      "a map with sdo, state, boot, brake and precharge", rig_read_times,
      offsetof(struct rig_axis, cia402.time) },
    { "quirks", YAML_OPTIONAL,
      "one of slew's quirks, such as maxon-epos4, or a path that ends in "
      ".yaml",
      rig_read_quirks, offsetof(struct rig_axis, cia402) },
    { "unsupervised", YAML_OPTIONAL,
      "yes: the drive may do without 0x1016, 0x6007 or 0x6066, and something "
      "else takes its torque off",
      rig_read_unsupervised, offsetof(struct rig_axis, unsupervised) },
};
const struct yaml_shape rig_drive_shape = { "drive", rig_drive_fields,
                                            ARRAY_LEN(rig_drive_fields) };

int rig_read_drive(void *reader, const struct yaml_value *value, void *out)
{
    const char *kind = rig_kind_of(value);

    if (strcmp(kind, rig_drive_kinds[RIG_MODBUS]) == 0)
        return rig_read_modbus_drive(reader, value, out);
    if (strcmp(kind, rig_drive_kinds[RIG_ODRIVE]) == 0 ||
        strcmp(kind, rig_drive_kinds[RIG_MOTEUS]) == 0)
        return rig_read_turns_drive(reader, value, out);
    if (yaml_fields_read(value, &rig_drive_shape, reader, out) < 0 ||
        rig_know_quirks(reader, value) < 0 || rig_check_node(reader, value) < 0)
        return -1;
    return rig_check_cia402(value, out);
}
