/* firmware/host/rig/rig_modbus.c - buses and drives on Modbus. */
#include <string.h>

#include "firmware/host/device/modbus_map_load.h"
#include "firmware/host/device/own_file.h"
#include "firmware/host/rig/rig_parts.h"

/* TCP has no baud rate.  For the simulation and for the arithmetic of set
 * points it is a fast line: 0.3 ms for a read of two registers. */
#define RIG_TCP_BAUD   4000000
#define RIG_TCP_GAP_NS INT64_C(100000)
#define RIG_TCP_PORT   502

#define RIG_LATE_NS (1000 * RIG_MS) /* point to point */

const char *rig_kind_of(const struct yaml_value *value)
{
    const struct yaml_tree *tree = value->tree;

    if (yaml_value_node(value)->kind != YAML_TREE_MAP)
        return "";
    for (uint32_t key = yaml_value_node(value)->first; key != 0;
         key = tree->node[tree->node[key].next].next)
        if (strcmp(yaml_tree_text(tree, key), "kind") == 0 &&
            tree->node[tree->node[key].next].kind == YAML_TREE_TEXT)
            return yaml_tree_text(tree, tree->node[key].next);
    return "";
}

/* ---- buses ---- */

static int rig_read_device(void *reader, const struct yaml_value *value,
                           void *out)
{
    (void)reader;
    return yaml_value_copy(value, out, MODBUS_LIBMODBUS_TEXT_MAX);
}

static int rig_read_baud(void *reader, const struct yaml_value *value,
                         void *out)
{
    char quote[YAML_QUOTE_MAX];
    int64_t baud;

    if (rig_read_quantity(reader, value, UNITS_BIT_RATE, &baud) < 0)
        return -1;
    if (baud <= 0 || baud > UINT32_MAX ||
        !modbus_libmodbus_is_baud((uint32_t)baud))
        return yaml_value_refuse(value, "%s is not a baud rate",
                                 yaml_value_quote(quote, value));
    *(uint32_t *)out = (uint32_t)baud;
    return 0;
}

static int rig_read_parity(void *reader, const struct yaml_value *value,
                           void *out)
{
    static const char *const words[] = { "even", "odd", "none" };
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, words, 3, &index) < 0)
        return -1;
    *(enum modbus_parity *)out = (enum modbus_parity)index;
    return 0;
}

static int rig_read_stop_bits(void *reader, const struct yaml_value *value,
                              void *out)
{
    int64_t number = 0;

    (void)reader;
    if (yaml_value_integer(value, 1, 2, &number) < 0)
        return -1;
    *(uint8_t *)out = (uint8_t)number;
    return 0;
}

static int rig_read_gap(void *reader, const struct yaml_value *value, void *out)
{
    return rig_read_time(reader, value, 10 * RIG_US, 100 * RIG_MS, RIG_US, out);
}

static int rig_read_timeout(void *reader, const struct yaml_value *value,
                            void *out)
{
    return rig_read_time(reader, value, RIG_MS, 5000 * RIG_MS, RIG_MS, out);
}

static int rig_read_rs485(void *reader, const struct yaml_value *value,
                          void *out)
{
    static const char *const words[] = { "automatic", "kernel", "rts-up",
                                         "rts-down" };
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, words, 4, &index) < 0)
        return -1;
    *(enum modbus_libmodbus_rs485 *)out = (enum modbus_libmodbus_rs485)index;
    return 0;
}

static int rig_read_rts_delay(void *reader, const struct yaml_value *value,
                              void *out)
{
    return rig_read_time(reader, value, RIG_US, 100 * RIG_MS, RIG_US, out);
}

static int rig_read_port(void *reader, const struct yaml_value *value,
                         void *out)
{
    int64_t number = 0;

    (void)reader;
    if (yaml_value_integer(value, 1, UINT16_MAX, &number) < 0)
        return -1;
    *(uint16_t *)out = (uint16_t)number;
    return 0;
}

#define MODBUS(member) offsetof(struct rig_bus, modbus.member)

static const struct yaml_field rig_modbus_bus_fields[] = {
    { "kind", YAML_REQUIRED, "canopen, modbus-rtu or modbus-tcp",
      rig_read_bus_kind, offsetof(struct rig_bus, kind) },
    { "device", YAML_OPTIONAL, "a serial port, such as /dev/ttyUSB0",
      rig_read_device, MODBUS(device) },
    { "baud", YAML_OPTIONAL, "a standard rate such as 115200", rig_read_baud,
      MODBUS(line.baud) },
    { "parity", YAML_OPTIONAL, "even, odd or none", rig_read_parity,
      MODBUS(line.parity) },
    { "stop_bits", YAML_OPTIONAL, "1 or 2", rig_read_stop_bits,
      MODBUS(line.stop_bits) },
    { "gap", YAML_OPTIONAL,
      "the silence between frames, 10 us .. 100 ms in whole us", rig_read_gap,
      MODBUS(line.gap_ns) },
    { "rs485", YAML_OPTIONAL, "automatic, kernel, rts-up or rts-down",
      rig_read_rs485, MODBUS(rs485) },
    { "rts_delay", YAML_OPTIONAL, "1 us .. 100 ms in whole us",
      rig_read_rts_delay, MODBUS(rts_delay_ns) },
    { "host", YAML_OPTIONAL, "a name or an address", rig_read_device,
      MODBUS(host) },
    { "port", YAML_OPTIONAL, "a TCP port, 1 .. 65535", rig_read_port,
      MODBUS(port) },
    { "timeout", YAML_OPTIONAL, "1 ms .. 5 s in whole ms", rig_read_timeout,
      MODBUS(timeout_ns) },
};
const struct yaml_shape rig_modbus_bus_shape = {
    "modbus_bus", rig_modbus_bus_fields, ARRAY_LEN(rig_modbus_bus_fields)
};

static int rig_judge_rtu(const struct yaml_value *value,
                         const struct rig_bus *bus)
{
    const struct modbus_libmodbus_config *modbus = &bus->modbus;

    if (modbus->host[0] != '\0' || modbus->port != 0)
        return yaml_value_refuse(value, "is a serial line, which has neither "
                                        "host nor port");
    if (modbus->device[0] == '\0' || modbus->line.baud == 0)
        return yaml_value_refuse(value, "lacks device or baud");
    if (modbus->rts_delay_ns != 0 && modbus->rs485 == RS485_AUTOMATIC)
        return yaml_value_refuse(value, "has rts_delay, but the adapter "
                                        "switches the direction (rs485: "
                                        "automatic)");
    if (modbus->rs485 == RS485_KERNEL && modbus->rts_delay_ns % RIG_MS != 0)
        return yaml_value_refuse(value, "has rts_delay, which for rs485: "
                                        "kernel is in whole ms");
    return 0;
}

static int rig_judge_tcp(const struct yaml_value *value, struct rig_bus *bus)
{
    struct modbus_libmodbus_config *modbus = &bus->modbus;

    if (modbus->device[0] != '\0' || modbus->line.baud != 0 ||
        modbus->line.gap_ns != 0 || modbus->rs485 != RS485_AUTOMATIC ||
        modbus->rts_delay_ns != 0)
        return yaml_value_refuse(value, "is TCP, which has no device, baud, "
                                        "gap, rs485 or rts_delay");
    if (modbus->host[0] == '\0')
        return yaml_value_refuse(value, "lacks host");
    if (modbus->port == 0)
        modbus->port = RIG_TCP_PORT;
    modbus->line = (struct modbus_rtu_line){ .baud = RIG_TCP_BAUD,
                                             .parity = MODBUS_PARITY_NONE,
                                             .stop_bits = 1,
                                             .gap_ns = RIG_TCP_GAP_NS };
    return 0;
}

int rig_read_modbus_bus(struct rig_reader *reader,
                        const struct yaml_value *value, struct rig_bus *bus)
{
    const struct yaml_value entry = {
        value->tree, value->node, value->name,
        "kind: modbus-rtu, device and baud, or kind: modbus-tcp and host"
    };

    bus->node_id = 0;
    bus->modbus.line.stop_bits = 1;
    if (yaml_fields_read(&entry, &rig_modbus_bus_shape, reader, bus) < 0 ||
        (bus->kind == RIG_MODBUS_RTU ? rig_judge_rtu(&entry, bus)
                                     : rig_judge_tcp(&entry, bus)) < 0)
        return -1;
    bus->bit_rate = bus->modbus.line.baud;
    return 0;
}

/* ---- drives ---- */

static int rig_read_unit_number(void *reader, const struct yaml_value *value,
                                void *out)
{
    int64_t number = 0;

    if (yaml_value_integer(value, 1, 247, &number) < 0)
        return -1;
    *(uint8_t *)out = (uint8_t)number;
    return rig_refuse_taken(reader, value);
}

/* Every file once. */
static int rig_load_map(const struct rig_reader *self,
                        const struct yaml_value *value, const char *path,
                        uint32_t *index)
{
    struct rig *rig = self->rig;
    const struct yaml_report *report = &value->tree->report;

    for (*index = 0; *index < rig->map_count; ++*index)
        if (strcmp(rig->map_path[*index], path) == 0)
            return 0;
    if (strlen(path) >= RIG_PATH_MAX)
        return yaml_value_refuse(value, "has too long a path");
    rig->map = memory_pool_more(&rig->memory, rig->map, rig->map_count,
                                sizeof *rig->map);
    rig->map_path = memory_pool_more(&rig->memory, rig->map_path,
                                     rig->map_count, sizeof *rig->map_path);
    memcpy(rig->map_path[*index], path, strlen(path) + 1);
    if (modbus_map_load(path, &rig->map[*index], report->message) < 0)
        return -1;
    rig->map_count++;
    return 0;
}

static int rig_read_map(void *reader, const struct yaml_value *value, void *out)
{
    const char *name = yaml_value_text(value);
    char path[OWN_FILE_PATH_MAX], quote[YAML_QUOTE_MAX];

    if (name == NULL)
        return -1;
    if (own_file_find(OWN_FILE_MAPS, name, value->tree->report.path, path) < 0)
        return yaml_value_refuse(value,
                                 "%s is not a register map that can be read",
                                 yaml_value_quote(quote, value));
    return rig_load_map(reader, value, path, out);
}

int rig_read_unsupervised(void *reader, const struct yaml_value *value,
                          void *out)
{
    (void)reader;
    return yaml_value_bool(value, out);
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

static const struct yaml_field rig_modbus_drive_fields[] = {
    { "kind", YAML_REQUIRED, RIG_KIND_WORDS,
      rig_read_drive_kind, offsetof(struct rig_axis, kind) },
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
      rig_read_unsupervised, offsetof(struct rig_axis, unsupervised) },
    { "parameters", YAML_OPTIONAL,
      "a map of the register map's items and their values", rig_read_parameters,
      0 },
};
const struct yaml_shape rig_modbus_drive_shape = {
    "modbus_drive", rig_modbus_drive_fields, ARRAY_LEN(rig_modbus_drive_fields)
};

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

int rig_read_modbus_drive(struct rig_reader *reader,
                          const struct yaml_value *value, struct rig_axis *axis)
{
    const struct modbus_map *map;

    if (yaml_fields_read(value, &rig_modbus_drive_shape, reader, axis) < 0)
        return -1;
    map = &reader->rig->map[axis->map];
    if (rig_judge_mode(value, map, axis) < 0)
        return -1;
    if (map->watchdog_ns == 0 && !axis->unsupervised)
        return yaml_value_refuse(
            value, "does not stop by itself when the line is dead: say "
                   "unsupervised: yes once its torque-off input is wired");
    return 0;
}
