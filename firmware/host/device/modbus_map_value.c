/* firmware/host/device/modbus_map_value.c - the kinds of value in a register map;
 * see modbus_map_parts.h. */
#include "firmware/host/device/modbus_map_parts.h"

int map_read_time(const struct yaml_value *value, int64_t max_ns, int64_t *out)
{
    const struct units_context none = { UNITS_AXIS_COUNT, { 0, 0 } };
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

const char *const map_orders[] = { "ABCD", "CDAB", "BADC", "DCBA" };
const char *const map_types[] = { "u16", "i16", "u32", "i32", "f32", "bit" };
int map_read_type(void *reader, const struct yaml_value *value, void *out)
{
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, map_types, ARRAY_LEN(map_types), &index) < 0)
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
    if (yaml_value_number(value, 0, UINT16_MAX, &number) < 0)
        return -1;
    *(uint16_t *)out = (uint16_t)number;
    return 0;
}

int map_read_mask(void *reader, const struct yaml_value *value, void *out)
{
    int64_t number = 0;

    (void)reader;
    if (yaml_value_number(value, 0, UINT32_MAX, &number) < 0)
        return -1;
    *(uint32_t *)out = (uint32_t)number;
    return 0;
}
