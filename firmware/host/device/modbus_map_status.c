/* firmware/host/device/modbus_map_status.c - what a register map asks of items:
 * the status of the drive, and which drive it is; see modbus_map_load.h. */
#include <string.h>

#include "firmware/host/device/modbus_map_parts.h"

const char *const map_statuses[] = {
#define MAP_NAME(name) #name,
    MODBUS_MAP_STATUS_LIST(MAP_NAME)
};

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

static const struct yaml_field map_condition_fields[] = {
    { "item", YAML_REQUIRED, "the name of an item", map_read_condition_item,
      offsetof(struct modbus_map_condition, item) },
    { "mask", YAML_OPTIONAL, "the bits that count", map_read_mask,
      offsetof(struct modbus_map_condition, mask) },
    { "equals", YAML_OPTIONAL, "what they must be (the mask)", map_read_mask,
      offsetof(struct modbus_map_condition, equals) },
};
const struct yaml_shape map_condition_shape = {
    "condition", map_condition_fields, ARRAY_LEN(map_condition_fields)
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
const struct yaml_shape map_status_shape = { "status", map_status_fields,
                                             ARRAY_LEN(map_status_fields) };

static bool map_is_polled(const struct modbus_map *map,
                          const struct modbus_map_condition *condition)
{
    return condition->item == MODBUS_MAP_NO_ITEM ||
           map->item[condition->item].poll == MODBUS_POLL_FAST;
}

int map_read_status(void *reader, const struct yaml_value *value, void *out)
{
    const struct modbus_map *map = out;

    if (yaml_fields_read(value, &map_status_shape, reader, out) < 0)
        return -1;
    for (unsigned i = 0; i < MODBUS_STATUS_COUNT; i++)
        if (!map_is_polled(map, &map->status[i]))
            return yaml_value_refuse(value,
                                     "%s uses an item without poll: "
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
const struct yaml_shape map_identify_shape = { "identify", map_identify_fields,
                                               ARRAY_LEN(map_identify_fields) };

int map_read_identify(void *reader, const struct yaml_value *value, void *out)
{
    return yaml_fields_read(value, &map_identify_shape, reader, out);
}
