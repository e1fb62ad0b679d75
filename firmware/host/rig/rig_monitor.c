/* firmware/host/rig/rig_monitor.c - drive: monitor. */
#include "firmware/host/device/object.h"
#include "firmware/host/rig/rig_parts.h"

/* To the nearest thousandth, within what can be asked for. */
static int monitor_read(struct rig_reader *reader,
                        const struct yaml_value *value,
                        enum units_quantity quantity, int64_t least_milli,
                        int64_t most_milli, int32_t *milli)
{
    char quote[YAML_QUOTE_MAX];
    int64_t value_q32;

    if (rig_read_quantity(reader, value, quantity, &value_q32) < 0)
        return -1;
    /* beyond any of these limits it is out of range as it is */
    const int64_t most_q32 = (most_milli / 1000 + 1) << 32;
    const int64_t near = value_q32 < -most_q32  ? -most_q32
                         : value_q32 > most_q32 ? most_q32
                                                : value_q32;
    const int64_t wanted = ((near >> 12) * 1000 + (1 << 19)) >> 20;
    if (wanted < least_milli || wanted > most_milli)
        return yaml_value_refuse(value, "%s is out of range",
                                 yaml_value_quote(quote, value));
    *milli = (int32_t)wanted;
    return 0;
}

static int monitor_want(struct rig_reader *reader,
                        const struct yaml_value *value,
                        enum hal_reading reading,
                        const struct drive_monitor_limit *limit)
{
    struct rig_axis *axis = reader->axis;
    const struct rig_kind *kind = rig_kinds[axis->kind];
    const unsigned offered =
        kind->readings != NULL ? kind->readings(reader->rig, axis) : 0;

    if ((offered >> (unsigned)reading & 1) == 0)
        return yaml_value_refuse(value, "is not reported by this drive");
    axis->monitor.wanted |= 1u << (unsigned)reading;
    axis->monitor.limit[reading] = *limit;
    return 0;
}

static int monitor_read_temperature(void *reader,
                                    const struct yaml_value *value, void *out)
{
    struct drive_monitor_limit limit = { INT32_MIN, 0 };

    (void)out;
    if (monitor_read(reader, value, UNITS_TEMPERATURE, 1000, 300000,
                     &limit.high_milli) < 0)
        return -1;
    return monitor_want(reader, value, HAL_READING_TEMPERATURE, &limit);
}

static int monitor_read_current(void *reader, const struct yaml_value *value,
                                void *out)
{
    struct drive_monitor_limit limit = { INT32_MIN, 0 };

    (void)out;
    if (monitor_read(reader, value, UNITS_CURRENT, 10, 1000000,
                     &limit.high_milli) < 0)
        return -1;
    return monitor_want(reader, value, HAL_READING_CURRENT, &limit);
}

static int monitor_read_voltage(void *reader, const struct yaml_value *value,
                                void *out)
{
    struct drive_monitor_limit limit = { 0, 0 };
    struct yaml_value end[2];

    (void)out;
    if (yaml_value_pair(value, end) < 0 ||
        monitor_read(reader, &end[0], UNITS_VOLTAGE, 0, 1000000,
                     &limit.low_milli) < 0 ||
        monitor_read(reader, &end[1], UNITS_VOLTAGE, 0, 1000000,
                     &limit.high_milli) < 0)
        return -1;
    if (limit.low_milli >= limit.high_milli)
        return yaml_value_refuse(&end[1], "ends where it begins or before");
    return monitor_want(reader, value, HAL_READING_VOLTAGE, &limit);
}

/* A drive of the profile has its temperature in an object of its maker. */
static int monitor_read_object(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct rig_reader *self = reader;
    char message[OBJECT_MESSAGE_MAX];
    const char *text = yaml_value_text(value);
    struct object object;

    (void)out;
    if (text == NULL)
        return -1;
    if (self->axis->kind != RIG_CIA402)
        return yaml_value_refuse(value, "is for a cia402 drive");
    if (object_find(text, self->eds, &object, message) < 0)
        return yaml_value_refuse(value, "is not an object of this drive");
    self->axis->monitor.temperature_index = object.index;
    self->axis->monitor.temperature_sub = object.sub;
    self->axis->monitor.temperature_milli = 1000;
    return 0;
}

static int monitor_read_scale(void *reader, const struct yaml_value *value,
                              void *out)
{
    struct rig_reader *self = reader;

    (void)out;
    if (self->axis->monitor.temperature_index == 0)
        return yaml_value_refuse(value, "is given without object");
    return monitor_read(reader, value, UNITS_TEMPERATURE, 1, 10000,
                        &self->axis->monitor.temperature_milli);
}

static const struct yaml_field rig_monitor_fields[] = {
    { "object", YAML_OPTIONAL,
      "cia402: the drive's object for its temperature, such as 2031:1",
      monitor_read_object, 0 },
    { "scale", YAML_OPTIONAL,
      "of the temperature in object: 0.001 .. 10 degC per count",
      monitor_read_scale, 0 },
    { "temperature", YAML_OPTIONAL,
      "the highest temperature of the drive, 1 .. 300 degC",
      monitor_read_temperature, 0 },
    { "voltage", YAML_OPTIONAL,
      "the supply as [lowest, highest], such as [20 V, 56 V]",
      monitor_read_voltage, 0 },
    { "current", YAML_OPTIONAL,
      "the highest current of the motor, 0.01 .. 1000 A", monitor_read_current,
      0 },
};
const struct yaml_shape rig_monitor_shape = { "monitor", rig_monitor_fields,
                                              ARRAY_LEN(rig_monitor_fields) };

int rig_read_monitor(void *reader, const struct yaml_value *value, void *out)
{
    return yaml_fields_read(value, &rig_monitor_shape, reader, out);
}
