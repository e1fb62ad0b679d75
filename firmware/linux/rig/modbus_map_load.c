/* firmware/linux/rig/modbus_map_load.c - see modbus_map_load.h.
 *
 * One table per map of the file, in the order in which they need each other:
 * items first, then what names items.  Groups are read in modbus_map_group.c. */
#include "firmware/linux/rig/modbus_map_load.h"

#include <string.h>

#include "firmware/linux/rig/modbus_map_parts.h"
#include "firmware/linux/yaml/yaml_shapes.h"

/* ---- kinds of value ---- */

int map_read_number(const struct yaml_value *value, int64_t min, int64_t max,
                    int64_t *out)
{
    char quote[YAML_QUOTE_MAX], *end;
    const char *text = yaml_value_text(value);
    long long number;
    bool hex;

    if (text == NULL)
        return -1;
    hex = text[0] == '0' && (text[1] == 'x' || text[1] == 'X');
    errno = 0;
    number = strtoll(text, &end, hex ? 16 : 10);
    yaml_value_quote(quote, value);
    if (end == text || *end != '\0')
        return yaml_value_refuse(value, "%s is not a whole number", quote);
    if (errno == ERANGE || number < min || number > max)
        return yaml_value_refuse(value, "%s is out of range", quote);
    *out = number;
    return 0;
}

int map_read_time(const struct yaml_value *value, int64_t max_ns, int64_t *out)
{
    const struct units_context none = { RIG_UNIT_COUNT, { 0, 0 } };
    char quote[YAML_QUOTE_MAX];
    int64_t ns_q12;

    if (yaml_units_read(value, UNITS_TIME, &none, &ns_q12) < 0)
        return -1;
    *out = ns_q12 / 4096;
    if (*out < 0 || *out > max_ns)
        return yaml_value_refuse(value, "%s is out of range",
                                 yaml_value_quote(quote, value));
    return 0;
}

int map_read_item(const struct map_reader *reader,
                  const struct yaml_value *value, uint8_t *out)
{
    const char *names[MODBUS_MAP_ITEMS_MAX];
    unsigned index;

    for (unsigned i = 0; i < reader->map->item_count; i++)
        names[i] = reader->map->item[i].name;
    if (yaml_value_choice(value, names, reader->map->item_count, &index) < 0)
        return -1;
    *out = (uint8_t)index;
    return 0;
}

static const char *const map_orders[] = { "ABCD", "CDAB", "BADC", "DCBA" };
const char *const map_types[] = { "u16", "i16", "u32", "i32", "f32", "bit" };
static const char *const map_polls[] = { "never", "fast", "slow" };
static const char *const map_formats[] = { "8N1", "8N2", "8E1",
                                           "8E2", "8O1", "8O2" };
static const char *const map_statuses[] = {
#define MAP_NAME(name) #name,
    MODBUS_MAP_STATUS_LIST(MAP_NAME)
};

int map_read_type(void *reader, const struct yaml_value *value, void *out)
{
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, map_types, MAP_LEN(map_types), &index) < 0)
        return -1;
    *(enum modbus_map_type *)out = (enum modbus_map_type)index;
    return 0;
}

int map_read_order(void *reader, const struct yaml_value *value, void *out)
{
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, map_orders, 4, &index) < 0)
        return -1;
    *(enum modbus_map_order *)out = (enum modbus_map_order)index;
    return 0;
}

int map_read_address(void *reader, const struct yaml_value *value, void *out)
{
    int64_t number = 0;

    (void)reader;
    if (map_read_number(value, 0, UINT16_MAX, &number) < 0)
        return -1;
    *(uint16_t *)out = (uint16_t)number;
    return 0;
}

/* ---- line ---- */

static int map_read_baud(void *reader, const struct yaml_value *value,
                         void *out)
{
    int64_t number = 0;

    (void)reader;
    if (map_read_number(value, MODBUS_RTU_BAUD_MIN, MODBUS_RTU_BAUD_MAX,
                        &number) < 0)
        return -1;
    *(uint32_t *)out = (uint32_t)number;
    return 0;
}

int modbus_format_read(const struct yaml_value *value,
                       struct modbus_rtu_line *line)
{
    static const enum modbus_parity parity[] = { MODBUS_PARITY_NONE,
                                                 MODBUS_PARITY_EVEN,
                                                 MODBUS_PARITY_ODD };
    unsigned index;

    if (yaml_value_choice(value, map_formats, 6, &index) < 0)
        return -1;
    line->parity = parity[index / 2];
    line->stop_bits = (uint8_t)(1 + index % 2);
    return 0;
}

static int map_read_format(void *reader, const struct yaml_value *value,
                           void *out)
{
    (void)reader;
    return modbus_format_read(value, &((struct modbus_map *)out)->line);
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
    if (map_read_number(value, 2, HAL_MODBUS_WRITE_MAX, &number) < 0)
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
                                                  MAP_LEN(map_line_fields) };

static int map_read_line(void *reader, const struct yaml_value *value,
                         void *out)
{
    return yaml_fields_read(value, &map_line_shape, reader, out);
}

/* ---- items ---- */

static int map_read_read(void *reader, const struct yaml_value *value,
                         void *out)
{
    int64_t number = 0;

    (void)reader;
    if (map_read_number(value, 1, 4, &number) < 0)
        return -1;
    *(uint8_t *)out = (uint8_t)number;
    return 0;
}

static int map_read_write(void *reader, const struct yaml_value *value,
                          void *out)
{
    static const char *const functions[] = { "5", "6", "16", "15" };
    static const uint8_t code[] = { 5, 6, 16, 15 };
    const struct map_reader *self = reader;
    unsigned index;

    if (yaml_value_choice(value, functions, 4, &index) < 0)
        return -1;
    if (code[index] != 16 && modbus_map_registers(self->item->type) == 2)
        return yaml_value_refuse(value,
                                 "%u writes one register, the item has "
                                 "two",
                                 code[index]);
    *(uint8_t *)out = code[index];
    return 0;
}

static int map_read_poll(void *reader, const struct yaml_value *value,
                         void *out)
{
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, map_polls, 3, &index) < 0)
        return -1;
    *(enum modbus_map_poll *)out = (enum modbus_map_poll)index;
    return 0;
}

static const struct yaml_field map_item_fields[] = {
    { "at", YAML_REQUIRED, "an address 0 .. 0xFFFF as in the frame",
      map_read_address, offsetof(struct modbus_map_item, at) },
    { "type", YAML_REQUIRED, "u16, i16, u32, i32, f32 or bit", map_read_type,
      offsetof(struct modbus_map_item, type) },
    { "order", YAML_OPTIONAL, "ABCD, CDAB, BADC or DCBA", map_read_order,
      offsetof(struct modbus_map_item, order) },
    { "read", YAML_OPTIONAL, "function 3 or 4; of a bit 1 or 2", map_read_read,
      offsetof(struct modbus_map_item, read) },
    { "write", YAML_OPTIONAL, "function 5, 6 or 16; of a bit 5 or 15",
      map_read_write, offsetof(struct modbus_map_item, write) },
    { "poll", YAML_OPTIONAL, "never, fast or slow", map_read_poll,
      offsetof(struct modbus_map_item, poll) },
};
static const struct yaml_shape map_item_shape = { "item", map_item_fields,
                                                  MAP_LEN(map_item_fields) };

/* Functions that were not given, and those that do not go together. */
static int map_complete_item(const struct yaml_value *value,
                             struct modbus_map_item *item)
{
    const bool bit = item->type == MODBUS_BIT;

    if (item->read == 0)
        item->read = bit ? HAL_MODBUS_READ_COILS : HAL_MODBUS_READ;
    if (item->write == 0)
        item->write = bit ? HAL_MODBUS_WRITE_COIL
                      : modbus_map_registers(item->type) == 2
                          ? HAL_MODBUS_WRITE_MANY
                          : HAL_MODBUS_WRITE;
    if (bit != (item->read < HAL_MODBUS_READ))
        return yaml_value_refuse(value,
                                 "is read by function %u, which is for "
                                 "%s",
                                 item->read, bit ? "registers" : "bits");
    if (bit ? item->write != HAL_MODBUS_WRITE_COIL &&
                  item->write != HAL_MODBUS_WRITE_COILS
            : item->write == HAL_MODBUS_WRITE_COILS)
        return yaml_value_refuse(value,
                                 "is written by function %u, which is "
                                 "for %s",
                                 item->write, bit ? "registers" : "bits");
    return 0;
}

static int map_read_one_item(void *reader, uint32_t key,
                             const struct yaml_value *entry)
{
    struct map_reader *self = reader;
    struct modbus_map *map = self->map;
    struct modbus_map_item *item = &map->item[map->item_count];
    struct yaml_value value = *entry;

    (void)key;
    *item = (struct modbus_map_item){ .order = self->order };
    memcpy(item->name, entry->name, strlen(entry->name) + 1);
    self->item = item;
    value.expected = "a map with at and type";
    if (yaml_fields_read(&value, &map_item_shape, reader, item) < 0)
        return -1;
    if (map_complete_item(&value, item) < 0)
        return -1;
    if (item->at + modbus_map_registers(item->type) > 65536)
        return yaml_value_refuse(&value, "ends beyond address 0xFFFF");
    map->item_count++;
    return 0;
}

/* `position` is where the motor is, `alarm` why it stands. */
static int map_read_items(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct modbus_map *map = out;

    if (yaml_fields_each(value, MODBUS_MAP_ITEMS_MAX, reader,
                         map_read_one_item) < 0)
        return -1;
    for (uint8_t i = 0; i < map->item_count; i++) {
        if (strcmp(map->item[i].name, "position") == 0)
            map->position = i;
        if (strcmp(map->item[i].name, "alarm") == 0)
            map->alarm = i;
    }
    if (map->alarm != MODBUS_MAP_NO_ITEM &&
        map->item[map->alarm].type == MODBUS_F32)
        return yaml_value_refuse(value, "has an alarm in f32");
    if (map->position == MODBUS_MAP_NO_ITEM ||
        map->item[map->position].poll != MODBUS_POLL_FAST)
        return yaml_value_refuse(value, "has no position with poll: fast");
    return 0;
}

/* ---- conditions ---- */

static int map_read_condition_item(void *reader, const struct yaml_value *value,
                                   void *out)
{
    const struct map_reader *self = reader;
    uint8_t *item = out;

    if (map_read_item(reader, value, item) < 0)
        return -1;
    if (self->map->item[*item].type == MODBUS_F32)
        return yaml_value_refuse(value, "is an f32, which has no bits");
    return 0;
}

static int map_read_mask(void *reader, const struct yaml_value *value,
                         void *out)
{
    int64_t number = 0;

    (void)reader;
    if (map_read_number(value, 0, UINT32_MAX, &number) < 0)
        return -1;
    *(uint32_t *)out = (uint32_t)number;
    return 0;
}

static const struct yaml_field map_condition_fields[] = {
    { "item", YAML_REQUIRED, "the name of an item", map_read_condition_item,
      offsetof(struct modbus_map_condition, item) },
    { "mask", YAML_OPTIONAL, "the bits that count", map_read_mask,
      offsetof(struct modbus_map_condition, mask) },
    { "equals", YAML_OPTIONAL, "what they must be (the mask)", map_read_mask,
      offsetof(struct modbus_map_condition, equals) },
};
static const struct yaml_shape map_condition_shape = {
    "condition", map_condition_fields, MAP_LEN(map_condition_fields)
};

static bool map_has_key(const struct yaml_value *value, const char *name)
{
    const struct yaml_tree *tree = value->tree;

    for (uint32_t key = yaml_value_node(value)->first; key != 0;
         key = tree->node[tree->node[key].next].next)
        if (strcmp(yaml_tree_text(tree, key), name) == 0)
            return true;
    return false;
}

/* Without a mask all bits count; with one and no `equals` they are all set. */
static int map_read_condition(void *reader, const struct yaml_value *value,
                              void *out)
{
    struct modbus_map_condition *condition = out;

    *condition = (struct modbus_map_condition){ .mask = UINT32_MAX };
    if (yaml_fields_read(value, &map_condition_shape, reader, condition) < 0)
        return -1;
    if (!map_has_key(value, "equals")) {
        if (!map_has_key(value, "mask"))
            return yaml_value_refuse(value, "has neither mask nor equals");
        condition->equals = condition->mask;
    }
    if ((condition->equals & ~condition->mask) != 0)
        return yaml_value_refuse(value, "can never be: equals has bits outside "
                                        "the mask");
    if (modbus_map_registers(
            ((struct map_reader *)reader)->map->item[condition->item].type) ==
        1)
        condition->mask &= UINT16_MAX;
    return 0;
}

static const struct yaml_field map_status_fields[] = {
#define MAP_STATUS_FIELD(name)                                                 \
    { #name, YAML_OPTIONAL, "a map with item, mask and equals",                \
      map_read_condition,                                                      \
      offsetof(struct modbus_map, status[MODBUS_STATUS_##name]) },
    MODBUS_MAP_STATUS_LIST(MAP_STATUS_FIELD)
};
static const struct yaml_shape map_status_shape = {
    "status", map_status_fields, MAP_LEN(map_status_fields)
};

static bool map_is_polled(const struct modbus_map *map,
                          const struct modbus_map_condition *condition)
{
    return condition->item == MODBUS_MAP_NO_ITEM ||
           map->item[condition->item].poll == MODBUS_POLL_FAST;
}

static int map_read_status(void *reader, const struct yaml_value *value,
                           void *out)
{
    const struct modbus_map *map = out;

    if (yaml_fields_read(value, &map_status_shape, reader, out) < 0)
        return -1;
    for (unsigned i = 0; i < MODBUS_STATUS_COUNT; i++)
        if (!map_is_polled(map, &map->status[i]))
            return yaml_value_refuse(value,
                                     "%s looks at an item without poll: "
                                     "fast",
                                     map_statuses[i]);
    return 0;
}

static int map_read_else(void *reader, const struct yaml_value *value,
                         void *out)
{
    (void)reader;
    return yaml_value_copy(value, ((struct modbus_map *)out)->identify_else,
                           MODBUS_MAP_TEXT_MAX);
}

static int map_read_identify_item(void *reader, const struct yaml_value *value,
                                  void *out)
{
    return map_read_condition_item(reader, value,
                                   &((struct modbus_map *)out)->identify.item);
}

static int map_read_identify_equals(void *reader,
                                    const struct yaml_value *value, void *out)
{
    struct modbus_map *map = out;

    map->identify.mask =
        modbus_map_registers(map->item[map->identify.item].type) == 1
            ? UINT16_MAX
            : UINT32_MAX;
    return map_read_mask(reader, value, &map->identify.equals);
}

static const struct yaml_field map_identify_fields[] = {
    { "item", YAML_REQUIRED, "the name of an item", map_read_identify_item, 0 },
    { "equals", YAML_REQUIRED, "what it must be", map_read_identify_equals, 0 },
    { "else", YAML_REQUIRED, "a sentence of at most 63 bytes", map_read_else,
      0 },
};
static const struct yaml_shape map_identify_shape = {
    "identify", map_identify_fields, MAP_LEN(map_identify_fields)
};

static int map_read_identify(void *reader, const struct yaml_value *value,
                             void *out)
{
    return yaml_fields_read(value, &map_identify_shape, reader, out);
}

/* ---- sequences ---- */

static int map_read_step_write(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct modbus_map_step *step = out;

    step->kind = MODBUS_STEP_WRITE;
    ((struct map_reader *)reader)->step_kinds++;
    return map_read_item(reader, value, &step->item);
}

static int map_read_step_until(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct map_reader *self = reader;
    struct modbus_map_step *step = out;
    unsigned index;

    if (yaml_value_choice(value, map_statuses, MODBUS_STATUS_COUNT, &index) < 0)
        return -1;
    if (self->map->status[index].item == MODBUS_MAP_NO_ITEM)
        return yaml_value_refuse(value, "is not among the status of this map");
    step->kind = MODBUS_STEP_UNTIL;
    step->status = (enum modbus_map_status)index;
    step->value = 1;
    step->dur_ns = 2000 * MAP_MS;
    self->step_kinds++;
    return 0;
}

static int map_read_step_delay(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct modbus_map_step *step = out;

    step->kind = MODBUS_STEP_DELAY;
    ((struct map_reader *)reader)->step_kinds++;
    return map_read_time(value, 60000 * MAP_MS, &step->dur_ns);
}

static int map_read_step_value(void *reader, const struct yaml_value *value,
                               void *out)
{
    const struct map_reader *self = reader;
    struct modbus_map_step *step = out;
    int64_t min, max;

    if (step->kind != MODBUS_STEP_WRITE || self->step_kinds != 1)
        return yaml_value_refuse(value, "belongs to a write");
    modbus_map_range(self->map->item[step->item].type, &min, &max);
    return map_read_number(value, min, max, &step->value);
}

static int map_read_step_is(void *reader, const struct yaml_value *value,
                            void *out)
{
    struct modbus_map_step *step = out;

    (void)reader;
    if (step->kind != MODBUS_STEP_UNTIL)
        return yaml_value_refuse(value, "belongs to an until");
    return map_read_number(value, 0, 1, &step->value);
}

static int map_read_step_within(void *reader, const struct yaml_value *value,
                                void *out)
{
    struct modbus_map_step *step = out;

    (void)reader;
    if (step->kind != MODBUS_STEP_UNTIL)
        return yaml_value_refuse(value, "belongs to an until");
    return map_read_time(value, 600000 * MAP_MS, &step->dur_ns);
}

static const struct yaml_field map_step_fields[] = {
    { "write", YAML_OPTIONAL, "the name of an item", map_read_step_write, 0 },
    { "until", YAML_OPTIONAL, "a status of this map", map_read_step_until, 0 },
    { "delay", YAML_OPTIONAL, "a time up to 60 s", map_read_step_delay, 0 },
    { "value", YAML_OPTIONAL, "a number that fits the item",
      map_read_step_value, 0 },
    { "is", YAML_OPTIONAL, "0 or 1", map_read_step_is, 0 },
    { "within", YAML_OPTIONAL, "a time up to 10 min", map_read_step_within, 0 },
};
static const struct yaml_shape map_step_shape = { "step", map_step_fields,
                                                  MAP_LEN(map_step_fields) };

static int map_read_sequence(void *reader, const struct yaml_value *value,
                             void *out)
{
    struct map_reader *self = reader;
    struct modbus_map_sequence *sequence = out;
    const struct yaml_tree *tree = value->tree;
    uint32_t count, node;

    if (yaml_value_list(value, 1, MODBUS_MAP_STEPS_MAX, &count) < 0)
        return -1;
    for (node = yaml_value_node(value)->first; node != 0;
         node = tree->node[node].next) {
        const struct yaml_value item = yaml_value_at(value, node);

        self->step_kinds = 0;
        if (yaml_fields_read(&item, &map_step_shape, reader,
                             &sequence->step[sequence->count]) < 0)
            return -1;
        if (self->step_kinds != 1)
            return yaml_value_refuse(&item,
                                     "is not one of write, until and delay");
        sequence->count++;
    }
    return 0;
}

static const struct yaml_field map_sequence_fields[] = {
#define MAP_SEQUENCE_FIELD(name)                                               \
    { #name, YAML_OPTIONAL,                                                    \
      "a list of {write, value}, {until, is, within} and {delay}",             \
      map_read_sequence,                                                       \
      offsetof(struct modbus_map, sequence[MODBUS_SEQUENCE_##name]) },
    MODBUS_MAP_SEQUENCE_LIST(MAP_SEQUENCE_FIELD)
};
static const struct yaml_shape map_sequence_shape = {
    "sequences", map_sequence_fields, MAP_LEN(map_sequence_fields)
};

/* What goes with every set point must not wait. */
static int map_read_sequences(void *reader, const struct yaml_value *value,
                              void *out)
{
    const struct modbus_map *map = out;
    const struct modbus_map_sequence *go =
        &map->sequence[MODBUS_SEQUENCE_stream_go];

    if (yaml_fields_read(value, &map_sequence_shape, reader, out) < 0)
        return -1;
    for (unsigned i = 0; i < go->count; i++)
        if (go->step[i].kind != MODBUS_STEP_WRITE)
            return yaml_value_refuse(value,
                                     "stream_go waits, it may only write");
    return 0;
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
static const struct yaml_shape map_alarm_shape = { "alarm", map_alarm_fields,
                                                   MAP_LEN(map_alarm_fields) };

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

static int map_read_resolution(void *reader, const struct yaml_value *value,
                               void *out)
{
    (void)reader;
    return map_read_number(value, 1, 100000000,
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
    { "line", YAML_OPTIONAL, "a map with baud, format, gap and turnaround",
      map_read_line, 0 },
    { "resolution", YAML_REQUIRED, "counts per revolution of the motor",
      map_read_resolution, 0 },
    { "watchdog", YAML_OPTIONAL,
      "the drive stops when it hears nothing for "
      "so long, 1 ms .. 10 s",
      map_read_timeout, offsetof(struct modbus_map, watchdog_ns) },
    { "order", YAML_OPTIONAL, "ABCD, CDAB, BADC or DCBA",
      map_read_default_order, 0 },
    { "items", YAML_REQUIRED, "a map of 1 .. 24 items by name", map_read_items,
      0 },
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
                                             MAP_LEN(map_fields) };

const struct yaml_shape *const map_shapes[] = {
    &map_shape,        &map_line_shape,      &map_item_shape,
    &map_status_shape, &map_condition_shape, &map_identify_shape,
    &map_group_shape,  &map_field_shape,     &map_sequence_shape,
    &map_step_shape,   &map_alarm_shape,     NULL,
};

/* A field has every type but the last, bit; a value is no constant. */
const struct yaml_words map_words[] = {
    { "map.order", map_orders, MAP_LEN(map_orders) },
    { "line.format", map_formats, MAP_LEN(map_formats) },
    { "item.type", map_types, MAP_LEN(map_types) },
    { "item.order", map_orders, MAP_LEN(map_orders) },
    { "item.poll", map_polls, MAP_LEN(map_polls) },
    { "field.type", map_types, MODBUS_BIT },
    { "field.order", map_orders, MAP_LEN(map_orders) },
    { "field.value", map_quantities + 1, MODBUS_DECELERATION },
    { "field.unit", map_units, MODBUS_MS_PER_1000_RPM + 1 },
    { "step.until", map_statuses, MAP_LEN(map_statuses) },
    { NULL, NULL, 0 },
};

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

int modbus_map_load(const char *path, struct modbus_map *map,
                    char message[RIG_MESSAGE_MAX])
{
    const struct yaml_report report = { path, message, RIG_MESSAGE_MAX };
    struct map_reader reader = { .map = map };
    struct yaml_tree tree;
    int err;

    map_defaults(map);
    if (yaml_tree_load(&tree, &report) < 0)
        return -1;
    const struct yaml_value root = { &tree, 0, "the map",
                                     "a map with items, status and sequences" };
    err = yaml_fields_read(&root, &map_shape, &reader, map);
    if (err == 0)
        err = map_judge(&root, map);
    yaml_tree_free(&tree);
    return err;
}
