/* firmware/host/device/modbus_map_item.c - the items of a register map; see
 * modbus_map_load.h. */
#include <string.h>

#include "firmware/host/device/modbus_map_parts.h"
#include "firmware/host/yaml/yaml_units.h"
#include "hal/readings.h"

const char *const map_polls[] = { "never", "fast", "slow" };

static int map_read_read(void *reader, const struct yaml_value *value,
                         void *out)
{
    int64_t number = 0;

    (void)reader;
    if (yaml_value_number(value, 1, 4, &number) < 0)
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

/* The names of readings, and what one count of them is. */
static const struct {
    const char *name;
    enum units_quantity quantity;
} map_readings[HAL_READINGS] = {
    [HAL_READING_TEMPERATURE] = { "temperature", UNITS_TEMPERATURE },
    [HAL_READING_VOLTAGE] = { "bus_voltage", UNITS_VOLTAGE },
    [HAL_READING_CURRENT] = { "current", UNITS_CURRENT },
};

static int map_read_scale(void *reader, const struct yaml_value *value,
                          void *out)
{
    const struct units_context units = { .unit = UNITS_AXIS_COUNT };
    struct modbus_map_item *item = out;
    int64_t scale_q32, milli;
    unsigned i = 0;

    (void)reader;
    while (i < HAL_READINGS && strcmp(item->name, map_readings[i].name) != 0)
        i++;
    if (i == HAL_READINGS)
        return yaml_value_refuse(value, "is for an item named temperature, "
                                        "bus_voltage or current");
    if (item->type == MODBUS_BIT || item->poll != MODBUS_POLL_NEVER)
        return yaml_value_refuse(value, "is for a register without poll, which "
                                        "is read where it is monitored");
    if (yaml_units_read(value, map_readings[i].quantity, &units, &scale_q32) <
        0)
        return -1;
    milli = scale_q32 > INT64_C(100) << 32 || scale_q32 < 0
                ? 0
                : (scale_q32 * 1000 + (INT64_C(1) << 31)) >> 32;
    if (milli < 1)
        return yaml_value_refuse(value, "is out of range");
    item->poll = MODBUS_POLL_MONITOR;
    item->reading = (uint8_t)(i + 1);
    item->milli = (int32_t)milli;
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
    { "scale", YAML_OPTIONAL,
      "what one count of it is, 0.001 .. 100 degC, V or A", map_read_scale, 0 },
};
const struct yaml_shape map_item_shape = { "item", map_item_fields,
                                           ARRAY_LEN(map_item_fields) };

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
int map_read_items(void *reader, const struct yaml_value *value, void *out)
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

/* ---- items that are never read together ---- */

static int map_read_pair(struct map_reader *self,
                         const struct yaml_value *value)
{
    struct modbus_map *map = self->map;
    struct modbus_map_apart *pair = &map->apart[map->apart_count];
    uint32_t count, node = yaml_value_node(value)->first;

    if (yaml_value_list(value, 2, 2, &count) < 0)
        return -1;
    for (unsigned i = 0; i < 2; i++, node = value->tree->node[node].next) {
        const struct yaml_value name = yaml_value_at(value, node);

        if (map_read_item(self, &name, &pair->item[i]) < 0)
            return -1;
    }
    const struct modbus_map_item *one = &map->item[pair->item[0]];
    const struct modbus_map_item *other = &map->item[pair->item[1]];
    if (one->read == other->read &&
        one->at < other->at + modbus_map_registers(other->type) &&
        other->at < one->at + modbus_map_registers(one->type))
        return yaml_value_refuse(value,
                                 "has two items that share address 0x%04X",
                                 one->at > other->at ? one->at : other->at);
    map->apart_count++;
    return 0;
}

int map_read_apart(void *reader, const struct yaml_value *value, void *out)
{
    const struct yaml_tree *tree = value->tree;
    uint32_t count;

    (void)out;
    if (yaml_value_list(value, 1, MODBUS_MAP_APART_MAX, &count) < 0)
        return -1;
    for (uint32_t node = yaml_value_node(value)->first; node != 0;
         node = tree->node[node].next) {
        struct yaml_value pair = yaml_value_at(value, node);

        pair.expected = "two different items, such as [position, state]";
        if (map_read_pair(reader, &pair) < 0)
            return -1;
    }
    return 0;
}
