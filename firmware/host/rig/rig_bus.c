/* firmware/host/rig/rig_bus.c - the buses of a rig. */
#include "firmware/host/rig/rig_parts.h"

#include <stdio.h>
#include <string.h>

const char *const rig_bus_kinds[RIG_BUS_KINDS] = {
    [RIG_CANOPEN] = "canopen",
    [RIG_MODBUS_RTU] = "modbus-rtu",
    [RIG_MODBUS_TCP] = "modbus-tcp",
    [RIG_CAN] = "can",
};

int rig_read_bus_kind(void *reader, const struct yaml_value *value, void *out)
{
    unsigned index;
    (void)reader;
    if (yaml_value_choice(value, rig_bus_kinds, RIG_BUS_KINDS, &index) < 0)
        return -1;
    *(enum rig_bus_kind *)out = (enum rig_bus_kind)index;
    return 0;
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

/* As Linux names them: no slash, no space, shorter than 16. */
static bool rig_is_interface(const char *name, size_t length)
{
    if (length == 0 || length >= RIG_INTERFACE_MAX)
        return false;
    for (size_t i = 0; i < length; i++)
        if (name[i] <= ' ' || name[i] > '~' || strchr("/:,=", name[i]) != NULL)
            return false;
    return true;
}

static int rig_read_interface(void *reader, const struct yaml_value *value,
                              void *out)
{
    const char *name = yaml_value_text(value);
    char quote[YAML_QUOTE_MAX];
    (void)reader;
    if (name == NULL)
        return -1;
    if (!rig_is_interface(name, strlen(name)))
        return yaml_value_refuse(value, "%s cannot be one",
                                 yaml_value_quote(quote, value));
    memcpy(out, name, strlen(name) + 1);
    return 0;
}

static int rig_read_sync_counter(void *reader, const struct yaml_value *value,
                                 void *out)
{
    int64_t last;
    (void)reader;
    if (yaml_value_integer(value, 2, 240, &last) < 0)
        return -1;
    *(uint8_t *)out = (uint8_t)last;
    return 0;
}

static const struct yaml_field rig_bus_fields[] = {
    { "kind", YAML_REQUIRED, "canopen, can, modbus-rtu or modbus-tcp",
      rig_read_bus_kind, offsetof(struct rig_bus, kind) },
    { "bit_rate", YAML_REQUIRED,
      "10, 20, 50, 125, 250, 500, 800 or 1000 kbit/s", rig_read_bit_rate,
      offsetof(struct rig_bus, bit_rate) },
    { "interface", YAML_OPTIONAL,
      "the name of a CAN interface of this machine, such as can0",
      rig_read_interface, offsetof(struct rig_bus, interface) },
    { "node", YAML_OPTIONAL, "our own node number, 1 .. 127", rig_read_node_id,
      offsetof(struct rig_bus, node_id) },
    { "sync_counter", YAML_OPTIONAL, "a whole number, 2 .. 240",
      rig_read_sync_counter, offsetof(struct rig_bus, sync_counter) },
};
const struct yaml_shape rig_bus_shape = { "bus", rig_bus_fields,
                                          ARRAY_LEN(rig_bus_fields) };

/* ---- CAN without CANopen ---- */

static int rig_read_data_bit_rate(void *reader, const struct yaml_value *value,
                                  void *out)
{
    static const unsigned factor[] = { 1, 2, 4, 5, 8 };
    const struct rig *rig = ((struct rig_reader *)reader)->rig;
    const struct rig_bus *bus = &rig->bus[rig->bus_count - 1];
    char quote[YAML_QUOTE_MAX];
    int64_t rate;

    if (rig_read_quantity(reader, value, UNITS_BIT_RATE, &rate) < 0)
        return -1;
    for (size_t i = 0; i < ARRAY_LEN(factor); i++) {
        if (rate != (int64_t)bus->bit_rate * factor[i])
            continue;
        *(uint32_t *)out = (uint32_t)rate;
        return 0;
    }
    return yaml_value_refuse(value, "%s does not fit a bit_rate of %u kbit/s",
                             yaml_value_quote(quote, value),
                             bus->bit_rate / 1000);
}

static const struct yaml_field rig_can_bus_fields[] = {
    { "kind", YAML_REQUIRED, "canopen, can, modbus-rtu or modbus-tcp",
      rig_read_bus_kind, offsetof(struct rig_bus, kind) },
    { "bit_rate", YAML_REQUIRED,
      "10, 20, 50, 125, 250, 500, 800 or 1000 kbit/s", rig_read_bit_rate,
      offsetof(struct rig_bus, bit_rate) },
    { "data_bit_rate", YAML_OPTIONAL, "1, 2, 4, 5 or 8 times bit_rate",
      rig_read_data_bit_rate, offsetof(struct rig_bus, data_bit_rate) },
    { "interface", YAML_OPTIONAL,
      "the name of a CAN interface of this machine, such as can0",
      rig_read_interface, offsetof(struct rig_bus, interface) },
};
const struct yaml_shape rig_can_bus_shape = { "can_bus", rig_can_bus_fields,
                                              ARRAY_LEN(rig_can_bus_fields) };

static int rig_read_can_bus(struct rig_reader *reader,
                            const struct yaml_value *value, struct rig_bus *bus)
{
    bus->node_id = 0;
    return yaml_fields_read(value, &rig_can_bus_shape, reader, bus);
}

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
    int err;
    if (strncmp(rig_kind_of(&value), "modbus", 6) == 0)
        err = rig_read_modbus_bus(self, &value, bus);
    else if (strcmp(rig_kind_of(&value), rig_bus_kinds[RIG_CAN]) == 0)
        err = rig_read_can_bus(self, &value, bus);
    else
        err = yaml_fields_read(&value, &rig_bus_shape, reader, bus);
    return err < 0 ? err : rig_claim_bus(self, &value, bus);
}

bool rig_bus_is_can(const struct rig_bus *bus)
{
    return bus->kind == RIG_CANOPEN || bus->kind == RIG_CAN;
}

int rig_read_buses(void *reader, const struct yaml_value *value, void *out)
{
    struct rig *rig = ((struct rig_reader *)reader)->rig;
    (void)out;
    rig->bus =
        memory_pool_new(&rig->memory, yaml_fields_count(value, RIG_BUSES_MAX),
                        sizeof *rig->bus);
    return yaml_fields_each(value, RIG_BUSES_MAX, reader, rig_read_bus);
}

/* ---- from the command line ---- */

static struct rig_bus *rig_find_bus(struct rig *rig, const char *name,
                                    size_t length)
{
    for (uint32_t i = 0; i < rig->bus_count; i++)
        if (strlen(rig->bus[i].name) == length &&
            memcmp(rig->bus[i].name, name, length) == 0)
            return &rig->bus[i];
    return NULL;
}

static int rig_refuse_interface(const struct rig *rig, const char *text,
                                size_t length, const char *what,
                                char message[YAML_MESSAGE_MAX])
{
    const char *names[RIG_BUSES_MAX];
    char list[QUOTE_LIST_MAX], quote[QUOTE_MAX];
    unsigned count = 0;

    for (uint32_t i = 0; i < rig->bus_count; i++)
        if (rig_bus_is_can(&rig->bus[i]))
            names[count++] = rig->bus[i].name;
    snprintf(message, YAML_MESSAGE_MAX, "%s %s, expected %s%s",
             quote_text(quote, text, length), what,
             count > 0 ? "BUS=INTERFACE, such as can0=vcan0, where BUS is "
                       : "the option left out, as the rig has no CAN bus",
             count > 0 ? quote_list(list, names, count) : "");
    return -1;
}

/* One "BUS=INTERFACE", or "INTERFACE", of `length` bytes. */
static int rig_set_interface(struct rig *rig, const char *text, size_t length,
                             char message[YAML_MESSAGE_MAX])
{
    const char *equals = memchr(text, '=', length);
    const char *name = equals == NULL ? text : equals + 1;
    const size_t name_length = length - (size_t)(name - text);
    struct rig_bus *bus = rig->bus;

    if (equals == NULL && rig->bus_count != 1)
        return rig_refuse_interface(rig, text, length,
                                    "does not say of which bus", message);
    if (equals != NULL)
        bus = rig_find_bus(rig, text, (size_t)(equals - text));
    if (equals != NULL && bus == NULL)
        return rig_refuse_interface(rig, text, length,
                                    "names no bus of the rig", message);
    if (!rig_bus_is_can(bus))
        return rig_refuse_interface(
            rig, text, length, "is for a Modbus bus, which has none", message);
    if (!rig_is_interface(name, name_length))
        return rig_refuse_interface(rig, text, length,
                                    "is not the name of an interface", message);
    memset(bus->interface, 0, sizeof bus->interface);
    memcpy(bus->interface, name, name_length);
    return 0;
}

/* As rig_claim_bus does of what the file has. */
static int rig_judge_interfaces(const struct rig *rig,
                                char message[YAML_MESSAGE_MAX])
{
    for (uint32_t i = 0; i < rig->bus_count; i++)
        for (uint32_t k = 0; k < i; k++)
            if (rig->bus[i].interface[0] != '\0' &&
                strcmp(rig->bus[i].interface, rig->bus[k].interface) == 0) {
                snprintf(message, YAML_MESSAGE_MAX,
                         "%s is of bus %s and of bus %s, expected an interface "
                         "of its own for each",
                         rig->bus[i].interface, rig->bus[k].name,
                         rig->bus[i].name);
                return -1;
            }
    return 0;
}

int rig_set_interfaces(struct rig *rig, const char *text,
                       char message[YAML_MESSAGE_MAX])
{
    for (;;) {
        const size_t length = strcspn(text, ",");

        if (rig_set_interface(rig, text, length, message) < 0)
            return -1;
        if (text[length] == '\0')
            return rig_judge_interfaces(rig, message);
        text += length + 1;
    }
}
