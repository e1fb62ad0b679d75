/* firmware/host/device/modbus_map_steps.c - the sequences of a register map; see
 * modbus_map_load.h. */
#include "firmware/host/device/modbus_map_parts.h"

static int map_read_step_write(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct modbus_map_step *step = out;

    step->kind = MODBUS_STEP_WRITE;
    ((struct map_reader *)reader)->step_kinds++;
    return map_read_item(reader, value, &step->item);
}

static int map_read_step_check(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct modbus_map_step *step = out;

    step->kind = MODBUS_STEP_CHECK;
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

    if ((step->kind != MODBUS_STEP_WRITE && step->kind != MODBUS_STEP_CHECK) ||
        self->step_kinds != 1)
        return yaml_value_refuse(value, "belongs to a write or a check");
    modbus_map_range(self->map->item[step->item].type, &min, &max);
    return yaml_value_number(value, min, max, &step->value);
}

static int map_read_step_is(void *reader, const struct yaml_value *value,
                            void *out)
{
    struct modbus_map_step *step = out;

    (void)reader;
    if (step->kind != MODBUS_STEP_UNTIL)
        return yaml_value_refuse(value, "belongs to an until");
    return yaml_value_number(value, 0, 1, &step->value);
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
    { "check", YAML_OPTIONAL, "the name of an item", map_read_step_check, 0 },
    { "until", YAML_OPTIONAL, "a status of this map", map_read_step_until, 0 },
    { "delay", YAML_OPTIONAL, "a time up to 60 s", map_read_step_delay, 0 },
    { "value", YAML_OPTIONAL, "a number that fits the item",
      map_read_step_value, 0 },
    { "is", YAML_OPTIONAL, "0 or 1", map_read_step_is, 0 },
    { "within", YAML_OPTIONAL, "a time up to 10 min", map_read_step_within, 0 },
};
const struct yaml_shape map_step_shape = { "step", map_step_fields,
                                           ARRAY_LEN(map_step_fields) };

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
            return yaml_value_refuse(
                &item, "is not one of write, check, until and delay");
        sequence->count++;
    }
    return 0;
}

static const struct yaml_field map_sequence_fields[] = {
#define MAP_SEQUENCE_FIELD(name)                                               \
    { #name, YAML_OPTIONAL,                                                    \
      "a list of {write, value}, {check, value}, {until, is, within} and "     \
      "{delay}",                                                               \
      map_read_sequence,                                                       \
      offsetof(struct modbus_map, sequence[MODBUS_SEQUENCE_##name]) },
    MODBUS_MAP_SEQUENCE_LIST(MAP_SEQUENCE_FIELD)
};
const struct yaml_shape map_sequence_shape = { "sequences", map_sequence_fields,
                                               ARRAY_LEN(map_sequence_fields) };

/* What goes with every set point must not wait. */
int map_read_sequences(void *reader, const struct yaml_value *value, void *out)
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
