/* firmware/host/device/modbus_map_load.c - see modbus_map_load.h.
 *
 * One table per map of the file, in the order in which they need each other:
 * items first (modbus_map_item.c), then what names items (modbus_map_status.c,
 * modbus_map_group.c, modbus_map_steps.c). */
#include "firmware/host/device/modbus_map_load.h"

#include "firmware/host/device/modbus_map_parts.h"
#include "firmware/host/yaml/yaml_shapes.h"

/* ---- line ---- */

static const char *const map_formats[] = { "8N1", "8N2", "8E1",
                                           "8E2", "8O1", "8O2" };

static int map_read_baud(void *reader, const struct yaml_value *value,
                         void *out)
{
    int64_t number = 0;

    (void)reader;
    if (yaml_value_number(value, MODBUS_RTU_BAUD_MIN, MODBUS_RTU_BAUD_MAX,
                          &number) < 0)
        return -1;
    *(uint32_t *)out = (uint32_t)number;
    return 0;
}

static int map_read_format(void *reader, const struct yaml_value *value,
                           void *out)
{
    static const enum modbus_parity parity[] = { MODBUS_PARITY_NONE,
                                                 MODBUS_PARITY_EVEN,
                                                 MODBUS_PARITY_ODD };
    struct modbus_rtu_line *line = &((struct modbus_map *)out)->line;
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, map_formats, 6, &index) < 0)
        return -1;
    line->parity = parity[index / 2];
    line->stop_bits = (uint8_t)(1 + index % 2);
    return 0;
}

static int map_read_gap(void *reader, const struct yaml_value *value, void *out)
{
    (void)reader;
    return map_read_time(value, 100 * MAP_MS, out);
}

static int map_read_timeout(void *reader, const struct yaml_value *value,
                            void *out)
{
    char quote[YAML_QUOTE_MAX];

    (void)reader;
    if (map_read_time(value, 10000 * MAP_MS, out) < 0)
        return -1;
    if (*(int64_t *)out < MAP_MS)
        return yaml_value_refuse(value, "%s is out of range",
                                 yaml_value_quote(quote, value));
    return 0;
}

static int map_read_registers(void *reader, const struct yaml_value *value,
                              void *out)
{
    int64_t number = 0;

    (void)reader;
    if (yaml_value_number(value, 2, HAL_MODBUS_WRITE_MAX, &number) < 0)
        return -1;
    *(uint16_t *)out = (uint16_t)number;
    return 0;
}

static const struct yaml_field map_line_fields[] = {
    { "baud", YAML_OPTIONAL, "1200 .. 4000000", map_read_baud,
      offsetof(struct modbus_map, line.baud) },
    { "format", YAML_OPTIONAL, "8N1, 8N2, 8E1, 8E2, 8O1 or 8O2",
      map_read_format, 0 },
    { "gap", YAML_OPTIONAL,
      "the silence between frames, 0 .. 100 ms; 0: the standard's",
      map_read_gap, offsetof(struct modbus_map, line.gap_ns) },
    { "turnaround", YAML_OPTIONAL,
      "how long the drive takes to answer, 0 .. 100 ms", map_read_gap,
      offsetof(struct modbus_map, turnaround_ns) },
    { "timeout", YAML_OPTIONAL, "1 ms .. 10 s", map_read_timeout,
      offsetof(struct modbus_map, timeout_ns) },
    { "registers", YAML_OPTIONAL, "the most in one request, 2 .. 123",
      map_read_registers, offsetof(struct modbus_map, registers_max) },
};
static const struct yaml_shape map_line_shape = { "line", map_line_fields,
                                                  ARRAY_LEN(map_line_fields) };

static int map_read_line(void *reader, const struct yaml_value *value,
                         void *out)
{
    return yaml_fields_read(value, &map_line_shape, reader, out);
}

/* ---- alarms ---- */

static int map_read_alarm_text(void *reader, const struct yaml_value *value,
                               void *out)
{
    (void)reader;
    return yaml_value_copy(value, out,
                           sizeof((struct modbus_map_alarm *)0)->text);
}

static const struct yaml_field map_alarm_fields[] = {
    { "code", YAML_REQUIRED, "the alarm's number", map_read_mask,
      offsetof(struct modbus_map_alarm, code) },
    { "text", YAML_REQUIRED, "what it means, at most 47 bytes",
      map_read_alarm_text, offsetof(struct modbus_map_alarm, text) },
};
static const struct yaml_shape map_alarm_shape = {
    "alarm", map_alarm_fields, ARRAY_LEN(map_alarm_fields)
};

static int map_read_alarms(void *reader, const struct yaml_value *value,
                           void *out)
{
    struct modbus_map *map = out;
    const struct yaml_tree *tree = value->tree;
    uint32_t count, node;

    if (yaml_value_list(value, 1, MODBUS_MAP_ALARMS_MAX, &count) < 0)
        return -1;
    for (node = yaml_value_node(value)->first; node != 0;
         node = tree->node[node].next) {
        const struct yaml_value item = yaml_value_at(value, node);

        if (yaml_fields_read(&item, &map_alarm_shape, reader,
                             &map->alarms[map->alarm_count]) < 0)
            return -1;
        map->alarm_count++;
    }
    return 0;
}

/* ---- the file ---- */

static int map_read_title(void *reader, const struct yaml_value *value,
                          void *out)
{
    (void)reader;
    return yaml_value_copy(value, ((struct modbus_map *)out)->title,
                           MODBUS_MAP_TITLE_MAX);
}

static int map_read_unverified(void *reader, const struct yaml_value *value,
                               void *out)
{
    (void)reader;
    return yaml_value_bool(value, &((struct modbus_map *)out)->is_unverified);
}

static int map_read_resolution(void *reader, const struct yaml_value *value,
                               void *out)
{
    (void)reader;
    return yaml_value_number(value, 1, 100000000,
                             &((struct modbus_map *)out)->resolution);
}

static int map_read_default_order(void *reader, const struct yaml_value *value,
                                  void *out)
{
    (void)out;
    return map_read_order(reader, value, &((struct map_reader *)reader)->order);
}

static const struct yaml_field map_fields[] = {
    { "title", YAML_REQUIRED, "a text of at most 95 bytes", map_read_title, 0 },
    { "unverified", YAML_OPTIONAL, "yes or no", map_read_unverified, 0 },
    { "line", YAML_OPTIONAL, "a map with baud, format, gap and turnaround",
      map_read_line, 0 },
    { "resolution", YAML_REQUIRED, "counts per revolution of the motor",
      map_read_resolution, 0 },
    { "watchdog", YAML_OPTIONAL,
      "the drive stops when it receives nothing for "
      "so long, 1 ms .. 10 s",
      map_read_timeout, offsetof(struct modbus_map, watchdog_ns) },
    { "order", YAML_OPTIONAL, "ABCD, CDAB, BADC or DCBA",
      map_read_default_order, 0 },
    { "items", YAML_REQUIRED, "a map of 1 .. 24 items by name", map_read_items,
      0 },
    { "apart", YAML_OPTIONAL,
      "a list of 1 .. 16 pairs of items, such as [[position, state]]",
      map_read_apart, 0 },
    { "identify", YAML_OPTIONAL, "a map with item, equals and else",
      map_read_identify, 0 },
    { "status", YAML_REQUIRED, "a map of conditions", map_read_status, 0 },
    { "move", YAML_OPTIONAL, "a map with at and fields", map_read_group,
      offsetof(struct modbus_map, move) },
    { "stream", YAML_OPTIONAL, "a map with at and fields", map_read_group,
      offsetof(struct modbus_map, stream) },
    { "sequences", YAML_REQUIRED, "a map of lists of steps", map_read_sequences,
      0 },
    { "alarms", YAML_OPTIONAL, "a list of {code, text}", map_read_alarms, 0 },
};
static const struct yaml_shape map_shape = { "map", map_fields,
                                             ARRAY_LEN(map_fields) };

const struct yaml_shape *const map_shapes[] = {
    &map_shape,        &map_line_shape,      &map_item_shape,
    &map_status_shape, &map_condition_shape, &map_identify_shape,
    &map_group_shape,  &map_field_shape,     &map_sequence_shape,
    &map_step_shape,   &map_alarm_shape,     NULL,
};

/* A field has every type but the last, bit; a value is no constant. */
const struct yaml_words map_words[] = {
    { "map.order", map_orders, ARRAY_LEN(map_orders) },
    { "line.format", map_formats, ARRAY_LEN(map_formats) },
    { "item.type", map_types, ARRAY_LEN(map_types) },
    { "item.order", map_orders, ARRAY_LEN(map_orders) },
    { "item.poll", map_polls, ARRAY_LEN(map_polls) },
    { "field.type", map_types, MODBUS_BIT },
    { "field.order", map_orders, ARRAY_LEN(map_orders) },
    { "field.value", map_quantities + 1, MODBUS_DECELERATION },
    { "field.unit", map_units, MODBUS_MS_PER_1000_RPM + 1 },
    { "step.until", map_statuses, ARRAY_LEN(map_statuses) },
    { NULL, NULL, 0 },
};

/* Is every item of the class in a block? */
static bool map_polls_all(const struct modbus_map *map,
                          enum modbus_map_poll poll)
{
    struct modbus_map_block block[MODBUS_MAP_BLOCKS_MAX];
    const unsigned count = modbus_map_blocks(map, poll, block);

    for (unsigned i = 0; i < map->item_count; i++) {
        const struct modbus_map_item *item = &map->item[i];
        bool is_read = item->poll != poll;

        for (unsigned k = 0; k < count && !is_read; k++)
            is_read = block[k].read == item->read && block[k].at <= item->at &&
                      item->at < (uint32_t)block[k].at + block[k].count;
        if (!is_read)
            return false;
    }
    return true;
}

static int map_judge(const struct yaml_value *value,
                     const struct modbus_map *map)
{
    if (map->move.count == 0 && map->stream.count == 0)
        return yaml_value_refuse(value, "has neither move nor stream");
    if (map->sequence[MODBUS_SEQUENCE_stop].count == 0 ||
        map->sequence[MODBUS_SEQUENCE_enable].count == 0 ||
        map->sequence[MODBUS_SEQUENCE_disable].count == 0)
        return yaml_value_refuse(
            value, "lacks one of the sequences enable, disable and stop");
    for (unsigned poll = MODBUS_POLL_FAST; poll <= MODBUS_POLL_MONITOR; poll++)
        if (!map_polls_all(map, (enum modbus_map_poll)poll))
            return yaml_value_refuse(
                value, "has items that need more than %u reads in one cycle",
                MODBUS_MAP_BLOCKS_MAX);
    return 0;
}

static void map_defaults(struct modbus_map *map)
{
    *map = (struct modbus_map){
        .line = { .baud = 115200, .stop_bits = 1 },
        .timeout_ns = 50 * MAP_MS,
        .registers_max = 16,
        .position = MODBUS_MAP_NO_ITEM,
        .alarm = MODBUS_MAP_NO_ITEM,
        .identify.item = MODBUS_MAP_NO_ITEM,
    };
    for (unsigned i = 0; i < MODBUS_STATUS_COUNT; i++)
        map->status[i].item = MODBUS_MAP_NO_ITEM;
}

int modbus_map_load(const struct files *files, const char *path,
                    struct modbus_map *map, char message[YAML_MESSAGE_MAX])
{
    const struct yaml_report report = { path, message, YAML_MESSAGE_MAX };
    struct map_reader reader = { .map = map };
    struct yaml_tree tree;
    int err;

    map_defaults(map);
    if (yaml_tree_load(files, &tree, &report) < 0)
        return -1;
    const struct yaml_value root = { &tree, 0, "the map",
                                     "a map with items, status and sequences" };
    err = yaml_fields_read(&root, &map_shape, &reader, map);
    if (err == 0)
        err = map_judge(&root, map);
    yaml_tree_free(&tree);
    return err;
}
