/* firmware/linux/rig_bus.c - the buses of a rig. */
#include "firmware/linux/rig_parts.h"

#include <string.h>

const char *const rig_bus_kinds[RIG_BUS_KINDS] = { "canopen" };

static int rig_read_bus_kind(void *reader, const struct yaml_value *value,
                             void *out)
{
    unsigned index;
    (void)reader;
    (void)out;
    return yaml_value_choice(value, rig_bus_kinds, RIG_BUS_KINDS, &index);
}

const uint32_t rig_bit_rates[RIG_BIT_RATES] = {
    10000, 20000, 50000, 125000, 250000, 500000, 800000, 1000000,
};

static int rig_read_bit_rate(void *reader, const struct yaml_value *value,
                             void *out)
{
    char quote[YAML_QUOTE_MAX];
    int64_t bit_rate;

    if (rig_read_quantity(reader, value, UNITS_BIT_RATE, &bit_rate) < 0)
        return -1;
    for (size_t i = 0; i < RIG_BIT_RATES; i++) {
        if (bit_rate != rig_bit_rates[i])
            continue;
        *(uint32_t *)out = rig_bit_rates[i];
        return 0;
    }
    return yaml_value_refuse(value, "%s is not one of CANopen's",
                             yaml_value_quote(quote, value));
}

static const struct yaml_field rig_bus_fields[] = {
    { "kind", YAML_REQUIRED, "canopen", rig_read_bus_kind, 0 },
    { "bit_rate", YAML_REQUIRED,
      "10, 20, 50, 125, 250, 500, 800 or 1000 kbit/s", rig_read_bit_rate,
      offsetof(struct rig_bus, bit_rate) },
    { "node", YAML_OPTIONAL, "our own node number, 1 .. 127", rig_read_node_id,
      offsetof(struct rig_bus, node_id) },
};
const struct yaml_shape rig_bus_shape = { "bus", rig_bus_fields,
                                          ARRAY_LEN(rig_bus_fields) };

static int rig_read_bus(void *reader, uint32_t key,
                        const struct yaml_value *entry)
{
    struct rig_reader *self = reader;
    struct rig_bus *bus = &self->rig->bus[self->rig->bus_count++];
    struct yaml_value value = *entry;

    *bus = (struct rig_bus){ .node_id = 127,
                             .place = yaml_tree_place(entry->tree, key) };
    memcpy(bus->name, entry->name, strlen(entry->name) + 1);
    value.expected = "a map with kind and bit_rate";
    return yaml_fields_read(&value, &rig_bus_shape, reader, bus);
}

int rig_read_buses(void *reader, const struct yaml_value *value, void *out)
{
    (void)out;
    return yaml_fields_each(value, RIG_BUSES_MAX, reader, rig_read_bus);
}
