/* firmware/host/rig/rig_modbus.c - buses of Modbus. */
#include "firmware/host/rig/rig_parts.h"

/* TCP has no baud rate.  For the simulation and for the arithmetic of set
 * points it is a fast line: 0.3 ms for a read of two registers. */
#define RIG_TCP_BAUD   4000000
#define RIG_TCP_GAP_NS INT64_C(100000)
#define RIG_TCP_PORT   502

static int rig_read_device(void *reader, const struct yaml_value *value,
                           void *out)
{
    (void)reader;
    return yaml_value_copy(value, out, MODBUS_LINE_TEXT_MAX);
}

static int rig_read_baud(void *reader, const struct yaml_value *value,
                         void *out)
{
    char quote[YAML_QUOTE_MAX];
    int64_t baud;

    if (rig_read_quantity(reader, value, UNITS_BIT_RATE, &baud) < 0)
        return -1;
    if (baud <= 0 || baud > UINT32_MAX || !modbus_line_is_baud((uint32_t)baud))
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

/* Read one of two counts of bits. */
static int rig_read_bits(const struct yaml_value *value, int64_t low,
                         int64_t high, uint8_t *bits)
{
    int64_t number = 0;

    if (yaml_value_integer(value, low, high, &number) < 0)
        return -1;
    *bits = (uint8_t)number;
    return 0;
}

static int rig_read_stop_bits(void *reader, const struct yaml_value *value,
                              void *out)
{
    (void)reader;
    return rig_read_bits(value, 1, 2, out);
}

static int rig_read_data_bits(void *reader, const struct yaml_value *value,
                              void *out)
{
    (void)reader;
    return rig_read_bits(value, 7, 8, out);
}

static int rig_read_framing(void *reader, const struct yaml_value *value,
                            void *out)
{
    static const char *const words[] = { "rtu", "ascii" };
    unsigned index;

    (void)reader;
    if (yaml_value_choice(value, words, 2, &index) < 0)
        return -1;
    *(bool *)out = index == 1;
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
    *(enum modbus_line_rs485 *)out = (enum modbus_line_rs485)index;
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
    { "framing", YAML_OPTIONAL, "rtu or ascii", rig_read_framing,
      MODBUS(line.is_ascii) },
    { "data_bits", YAML_OPTIONAL, "7 or 8", rig_read_data_bits,
      MODBUS(line.data_bits) },
    { "gap", YAML_OPTIONAL,
      "the silence between frames, 10 us .. 100 ms in whole us", rig_read_gap,
      MODBUS(line.gap_ns) },
    { "rs485", YAML_OPTIONAL, "automatic, kernel, rts-up or rts-down",
      rig_read_rs485, MODBUS(rs485) },
    { "rts_delay", YAML_OPTIONAL, "1 us .. 100 ms in whole us",
      rig_read_rts_delay, MODBUS(rts_delay_ns) },
    { "echo", YAML_OPTIONAL, "yes or no", yaml_read_bool, MODBUS(echo) },
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
    const struct modbus_line_config *modbus = &bus->modbus;

    if (modbus->host[0] != '\0' || modbus->port != 0)
        return yaml_value_refuse(value, "is a serial line, which has neither "
                                        "host nor port");
    if (modbus->device[0] == '\0' || modbus->line.baud == 0)
        return yaml_value_refuse(value, "lacks device or baud");
    if (modbus->line.data_bits == 7 && !modbus->line.is_ascii)
        return yaml_value_refuse(value, "has data_bits: 7, but framing: rtu "
                                        "needs 8");
    if (modbus->line.is_ascii &&
        (modbus->rs485 == RS485_RTS_UP || modbus->rs485 == RS485_RTS_DOWN))
        return yaml_value_refuse(value, "has framing: ascii, around which RTS "
                                        "is not switched; rs485 is automatic "
                                        "or kernel then");
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
    struct modbus_line_config *modbus = &bus->modbus;

    if (modbus->device[0] != '\0' || modbus->line.baud != 0 ||
        modbus->line.gap_ns != 0 || modbus->line.is_ascii ||
        modbus->line.data_bits != 0 || modbus->rs485 != RS485_AUTOMATIC ||
        modbus->rts_delay_ns != 0 || modbus->echo)
        return yaml_value_refuse(value,
                                 "is TCP, which has no device, baud, "
                                 "framing, gap, rs485, rts_delay or echo");
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
