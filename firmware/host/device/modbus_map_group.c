/* firmware/host/device/modbus_map_group.c - the groups of a register map; see
 * modbus_map_load.h. */
#include "firmware/host/device/modbus_map_parts.h"

#define MAP_RATIO_MAX INT64_C(1000000000)

const char *const map_quantities[] = { "const", "position", "velocity",
                                       "acceleration", "deceleration" };
const char *const map_units[] = { "counts", "rpm", "ms_per_1000rpm" };

/* ---- fields ---- */

static int map_read_value(void *reader, const struct yaml_value *value,
                          void *out)
{
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, map_quantities + 1, 4, &index) < 0)
        return -1;
    ((struct modbus_map_field *)out)->quantity =
        (enum modbus_map_quantity)(index + 1);
    return 0;
}

static int map_read_const(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct modbus_map_field *field = out;
    int64_t min, max;

    (void)reader;
    if (field->quantity != MODBUS_CONST)
        return yaml_value_refuse(value, "stands beside value");
    modbus_map_range(field->type, &min, &max);
    return yaml_value_number(value, min, max, &field->constant);
}

static int map_read_unit(void *reader, const struct yaml_value *value,
                         void *out)
{
    struct modbus_map_field *field = out;
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, map_units, 3, &index) < 0)
        return -1;
    field->unit = (enum modbus_map_unit)index;
    if ((field->quantity <= MODBUS_POSITION && field->unit != MODBUS_COUNTS) ||
        (field->quantity == MODBUS_VELOCITY &&
         field->unit == MODBUS_MS_PER_1000_RPM))
        return yaml_value_refuse(value, "%s is no unit of a %s",
                                 map_units[index],
                                 map_quantities[field->quantity]);
    return 0;
}

static int map_read_ratio(void *reader, const struct yaml_value *value,
                          void *out)
{
    (void)reader;
    return yaml_value_number(value, 1, MAP_RATIO_MAX, out);
}

static int map_read_bound(void *reader, const struct yaml_value *value,
                          void *out)
{
    (void)reader;
    return yaml_value_number(value, INT32_MIN, UINT32_MAX, out);
}

static const struct yaml_field map_field_fields[] = {
    { "type", YAML_REQUIRED, "u16, i16, u32, i32 or f32", map_read_type,
      offsetof(struct modbus_map_field, type) },
    { "order", YAML_OPTIONAL, "ABCD, CDAB, BADC or DCBA", map_read_order,
      offsetof(struct modbus_map_field, order) },
    { "value", YAML_OPTIONAL,
      "position, velocity, acceleration or deceleration", map_read_value, 0 },
    { "const", YAML_OPTIONAL, "a number that fits the type", map_read_const,
      0 },
    { "unit", YAML_OPTIONAL, "counts, rpm or ms_per_1000rpm", map_read_unit,
      0 },
    { "num", YAML_OPTIONAL, "1 .. 1000000000", map_read_ratio,
      offsetof(struct modbus_map_field, num) },
    { "den", YAML_OPTIONAL, "1 .. 1000000000", map_read_ratio,
      offsetof(struct modbus_map_field, den) },
    { "min", YAML_OPTIONAL, "the least the register may be", map_read_bound,
      offsetof(struct modbus_map_field, min) },
    { "max", YAML_OPTIONAL, "the most the register may be", map_read_bound,
      offsetof(struct modbus_map_field, max) },
};
const struct yaml_shape map_field_shape = { "field", map_field_fields,
                                            ARRAY_LEN(map_field_fields) };

#define MAP_NOT_GIVEN INT64_MAX

static int map_complete_field(const struct yaml_value *value,
                              struct modbus_map_field *field)
{
    int64_t min, max;

    modbus_map_range(field->type, &min, &max);
    if (field->type == MODBUS_BIT)
        return yaml_value_refuse(value, "is a bit, groups have registers");
    if (field->quantity == MODBUS_CONST && field->constant == MAP_NOT_GIVEN)
        return yaml_value_refuse(value, "has neither value nor const");
    if (field->type == MODBUS_F32) { /* beyond 2^24 in steps */
        min = INT32_MIN;
        max = INT32_MAX;
    }
    if (field->min == MAP_NOT_GIVEN)
        field->min = field->quantity == MODBUS_POSITION ? min : 0;
    if (field->max == MAP_NOT_GIVEN)
        field->max = max;
    if (field->min < min || field->max > max || field->min > field->max)
        return yaml_value_refuse(value,
                                 "has a min or max that its type cannot say");
    return 0;
}

static int map_read_field(struct map_reader *self,
                          const struct yaml_value *value)
{
    struct modbus_map_group *group = self->group;
    struct modbus_map_field *field = &group->field[group->count];

    *field = (struct modbus_map_field){ .order = self->order,
                                        .constant = MAP_NOT_GIVEN,
                                        .num = 1,
                                        .den = 1,
                                        .min = MAP_NOT_GIVEN,
                                        .max = MAP_NOT_GIVEN };
    if (yaml_fields_read(value, &map_field_shape, self, field) < 0 ||
        map_complete_field(value, field) < 0)
        return -1;
    group->registers =
        (uint8_t)(group->registers + modbus_map_registers(field->type));
    group->count++;
    return 0;
}

/* ---- groups ---- */

static bool map_has_position(const struct modbus_map_group *group)
{
    for (unsigned i = 0; i < group->count; i++)
        if (group->field[i].quantity == MODBUS_POSITION)
            return true;
    return false;
}

static int map_read_fields(void *reader, const struct yaml_value *value,
                           void *out)
{
    struct map_reader *self = reader;
    struct modbus_map_group *group = out;
    const struct yaml_tree *tree = value->tree;
    uint32_t count, node;

    if (yaml_value_list(value, 1, MODBUS_MAP_FIELDS_MAX, &count) < 0)
        return -1;
    self->group = group;
    for (node = yaml_value_node(value)->first; node != 0;
         node = tree->node[node].next) {
        const struct yaml_value item = yaml_value_at(value, node);

        if (map_read_field(self, &item) < 0)
            return -1;
    }
    if (!map_has_position(group))
        return yaml_value_refuse(value, "has no field with value: position");
    if (group->registers > self->map->registers_max)
        return yaml_value_refuse(value,
                                 "has %u registers, more than one "
                                 "request may have",
                                 group->registers);
    if (group->at + group->registers > 65536)
        return yaml_value_refuse(value, "ends beyond address 0xFFFF");
    return 0;
}

static const struct yaml_field map_group_fields[] = {
    { "at", YAML_REQUIRED, "an address 0 .. 0xFFFF as in the frame",
      map_read_address, offsetof(struct modbus_map_group, at) },
    { "fields", YAML_REQUIRED,
      "a list of {type, value or const, unit, num, den, min, max}",
      map_read_fields, 0 },
};
const struct yaml_shape map_group_shape = { "group", map_group_fields,
                                            ARRAY_LEN(map_group_fields) };

int map_read_group(void *reader, const struct yaml_value *value, void *out)
{
    return yaml_fields_read(value, &map_group_shape, reader, out);
}
