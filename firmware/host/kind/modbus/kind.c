/* firmware/host/kind/modbus/kind.c - a Modbus servo in a rig file; see
 * firmware/host/rig/kind.h. */
#include "firmware/host/rig/rig_parts.h"

#define RIG_LATE_NS (1000 * RIG_MS) /* point to point */

static bool modbus_is_for(const struct rig_bus *bus)
{
    return !rig_bus_is_can(bus);
}

static int rig_read_modbus_mode(void *reader, const struct yaml_value *value,
                                void *out)
{
    static const char *const words[] = { "streamed", "point-to-point" };
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, words, 2, &index) < 0)
        return -1;
    *(bool *)out = index == 1;
    return 0;
}

static int rig_read_settle(void *reader, const struct yaml_value *value,
                           void *out)
{
    return rig_read_time(reader, value, RIG_MS, 60000 * RIG_MS, RIG_MS, out);
}

/* One register under two names would be written twice, with two values. */
static int modbus_claim_registers(struct rig_reader *reader,
                                  const struct yaml_value *key,
                                  const struct modbus_map_item *item)
{
    const unsigned count = modbus_map_registers(item->type);
    struct yaml_value at = *key;
    int err = 0;

    at.name = item->type == MODBUS_BIT ? "coil" : "register";
    at.expected = "each register once";
    for (unsigned i = 0; i < count && err == 0; i++)
        err = rig_claim(reader, &at, yaml_tree_text(key->tree, key->node),
                        "0x%04X of axis %s", item->at + i, reader->axis->name);
    return err;
}

static int modbus_item(void *of, const struct yaml_value *key,
                       const struct yaml_value *value)
{
    struct rig_reader *self = of;
    struct rig_axis *axis = self->axis;
    const struct modbus_map *map = &self->rig->map[axis->map];
    const char *names[MODBUS_MAP_ITEMS_MAX];
    int64_t min, max, wanted = 0;
    unsigned item;

    for (unsigned i = 0; i < map->item_count; i++)
        names[i] = map->item[i].name;
    const struct yaml_value choice = { key->tree, key->node, "register",
                                       key->expected };
    if (yaml_value_choice(&choice, names, map->item_count, &item) < 0)
        return -1;
    if (item == map->position || item == map->alarm)
        return yaml_value_refuse(key, "is what the drive says");
    if (modbus_claim_registers(self, key, &map->item[item]) < 0)
        return -1;
    modbus_map_range(map->item[item].type, &min, &max);
    if (yaml_value_integer(value, min, max, &wanted) < 0)
        return -1;
    axis->item[axis->parameter_count++] =
        (struct drive_modbus_parameter){ .item = (uint8_t)item,
                                         .value = wanted };
    return 0;
}

static int modbus_read_parameters(void *reader, const struct yaml_value *value,
                                  void *out)
{
    struct rig_reader *self = reader;

    (void)out;
    return rig_read_pairs(value, &self->axis->parameter_count,
                          RIG_PARAMETERS_MAX, self, modbus_item);
}

static const struct yaml_field rig_modbus_fields[] = {
    { "kind", YAML_REQUIRED, RIG_KIND_WORDS, rig_read_drive_kind,
      offsetof(struct rig_axis, kind) },
    { "bus", YAML_REQUIRED, "the name of a bus", rig_read_drive_bus,
      offsetof(struct rig_axis, bus) },
    { "node", YAML_REQUIRED, "a unit number, 1 .. 247, of its own on the bus",
      rig_read_unit_number, offsetof(struct rig_axis, node_id) },
    { "map", YAML_REQUIRED,
      "one of slew's register maps, such as leadshine-el7, or a path that "
      "ends in .yaml",
      rig_read_map, offsetof(struct rig_axis, map) },
    { "counts", YAML_REQUIRED,
      "counts per unit of the axis, such as '10000 per rev' or "
      "{num: 1048576, den: 360}",
      rig_read_counts, 0 },
    { "mode", YAML_OPTIONAL, "streamed or point-to-point", rig_read_modbus_mode,
      offsetof(struct rig_axis, point_to_point) },
    { "settle", YAML_OPTIONAL, "1 ms .. 60 s in whole ms", rig_read_settle,
      offsetof(struct rig_axis, settle_ns) },
    { "late", YAML_OPTIONAL, "1 ms .. 60 s in whole ms", rig_read_settle,
      offsetof(struct rig_axis, late_ns) },
    { "unsupervised", YAML_OPTIONAL,
      "yes: the drive does not stop by itself when the line is dead, and "
      "something else takes its torque off",
      yaml_read_bool, offsetof(struct rig_axis, unsupervised) },
    { "parameters", YAML_OPTIONAL,
      "a map of the register map's items and their values",
      modbus_read_parameters, 0 },
    RIG_MONITOR_FIELD,
};
const struct yaml_shape rig_modbus_shape = { "modbus_drive", rig_modbus_fields,
                                             ARRAY_LEN(rig_modbus_fields) };

/* What the mode needs: of the map, and of the axis, whose limits were read
 * before. */
static int rig_judge_mode(const struct yaml_value *value,
                          const struct modbus_map *map, struct rig_axis *axis)
{
    if (!axis->point_to_point && map->stream.count == 0)
        return yaml_value_refuse(value, "has a map without stream, which "
                                        "cannot follow set points: say mode: "
                                        "point-to-point");
    if (!axis->point_to_point && (axis->settle_ns != 0 || axis->late_ns != 0))
        return yaml_value_refuse(value, "is streamed: settle and late are for "
                                        "mode: point-to-point");
    if (!axis->point_to_point)
        return 0;
    if (map->move.count == 0)
        return yaml_value_refuse(value, "has a map without move, whose drive "
                                        "has no profile of its own: leave out "
                                        "mode: point-to-point");
    if (axis->limit.jerk_q32 != 0)
        return yaml_value_refuse(value, "is point-to-point, and the drive's "
                                        "own ramps have no limit of jerk: "
                                        "leave out jerk among the limits");
    if (axis->late_ns == 0)
        axis->late_ns = RIG_LATE_NS;
    return 0;
}

static int modbus_read(struct rig_reader *reader,
                       const struct yaml_value *value, struct rig_axis *axis)
{
    const struct modbus_map *map;

    if (yaml_fields_read(value, &rig_modbus_shape, reader, axis) < 0)
        return -1;
    map = &reader->rig->map[axis->map];
    if (rig_judge_mode(value, map, axis) < 0)
        return -1;
    if (map->watchdog_ns == 0 && !axis->unsupervised) {
        struct yaml_value drive = *value;
        drive.expected = "unsupervised: yes once its torque-off input is wired";
        return yaml_value_refuse(
            &drive, "does not stop by itself when the line is dead");
    }
    return 0;
}

static int modbus_judge_axis(const struct rig_reader *reader,
                             const struct yaml_value *value)
{
    struct yaml_value entry = *value;

    entry.expected = "a smaller range or fewer counts";
    return rig_check_modbus_range(&entry, &reader->rig->map[reader->axis->map],
                                  reader->axis);
}

/* The register map says how: what the drive was set to, at its own speeds. */
static int modbus_judge_homing(const struct rig_reader *reader,
                               const struct yaml_value *value,
                               struct homing_config *homing)
{
    const struct modbus_map *map = &reader->rig->map[reader->axis->map];

    if (homing->method != 0 || homing->slow_q32 != 0)
        return yaml_value_refuse(value, "by drive has a 'method' or a 'slow', "
                                        "but a drive with a register map homes "
                                        "as it was set up");
    if (map->sequence[MODBUS_SEQUENCE_home].count == 0)
        return yaml_value_refuse(value, "is by drive, but the map of the drive "
                                        "has no sequence home");
    return 0;
}

/* A register map with a watchdog has it written and read back all the same. */
static const char *modbus_unsupervised(const struct rig *rig,
                                       const struct rig_axis *axis)
{
    return rig->map[axis->map].watchdog_ns == 0
               ? "its register map has no watchdog: when its line is dead or "
                 "slew is silent the drive goes on to its last set point, and "
                 "nothing but its torque-off input takes its torque"
               : NULL;
}

static int64_t modbus_turn_ns(const struct rig *rig, unsigned i,
                              const struct modbus_rtu_time *time, bool streamed,
                              unsigned *transactions)
{
    const struct rig_axis *axis = &rig->axis[i];

    const struct modbus_map *map = &rig->map[axis->map];
    const int64_t cycle_ns = modbus_map_cycle_ns(
        map, time, streamed || !axis->point_to_point, transactions);

    return axis->monitor.wanted == 0
               ? cycle_ns
               : cycle_ns + modbus_map_monitor_ns(map, time, transactions);
}

static unsigned modbus_readings(const struct rig *rig,
                                const struct rig_axis *axis)
{
    const struct modbus_map *map = &rig->map[axis->map];
    unsigned readings = 0;

    for (unsigned i = 0; i < map->item_count; i++)
        if (map->item[i].reading > 0)
            readings |= 1u << (map->item[i].reading - 1);
    return readings;
}

static int64_t modbus_answer_ns(const struct rig *rig, unsigned i)
{
    return rig->map[rig->axis[i].map].timeout_ns;
}

const struct rig_kind rig_kind_modbus = {
    .code_max = UINT16_MAX,
    .is_for = modbus_is_for,
    .read = modbus_read,
    .judge_axis = modbus_judge_axis,
    .judge_homing = modbus_judge_homing,
    .unsupervised = modbus_unsupervised,
    .has_map = true,
    .readings = modbus_readings,
    .turn_ns = modbus_turn_ns,
    .answer_ns = modbus_answer_ns,
};
