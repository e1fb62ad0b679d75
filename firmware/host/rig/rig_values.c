/* firmware/host/rig/rig_values.c - values that more than one section of
 * rig.yaml has. */
#include "firmware/host/rig/rig_parts.h"

#include <math.h>

#include "firmware/host/yaml/yaml_units.h"
#include "motion/core/fixed.h"

#define RIG_MRAD_PER_HZ 6283.185307179586

int rig_read_quantity(struct rig_reader *reader, const struct yaml_value *value,
                      enum units_quantity quantity, int64_t *out)
{
    return yaml_units_read(value, quantity, &reader->units, out);
}

int rig_read_positive(struct rig_reader *reader, const struct yaml_value *value,
                      enum units_quantity quantity, int64_t *out)
{
    char quote[YAML_QUOTE_MAX];

    if (rig_read_quantity(reader, value, quantity, out) < 0)
        return -1;
    if (*out <= 0)
        return yaml_value_refuse(value, "%s is not above zero",
                                 yaml_value_quote(quote, value));
    return 0;
}

static int rig_within(const struct yaml_value *value, double low, double high,
                      double slack, double *number)
{
    char quote[YAML_QUOTE_MAX];

    if (*number < low - slack || *number > high + slack)
        return yaml_value_refuse(value, "%s is out of range",
                                 yaml_value_quote(quote, value));
    *number = fmin(fmax(*number, low), high);
    return 0;
}

int rig_read_share(struct rig_reader *reader, const struct yaml_value *value,
                   double low, double high, double *out)
{
    int64_t ratio_q32;

    if (rig_read_quantity(reader, value, UNITS_RATIO, &ratio_q32) < 0)
        return -1;
    *out = (double)ratio_q32 / (double)MOTION_FIXED_ONE_Q32;
    return rig_within(value, low, high, 1e-9, out);
}

int rig_read_frequency(struct rig_reader *reader,
                       const struct yaml_value *value, double low_hz,
                       double high_hz, double *out_hz)
{
    int64_t mrad_s;

    if (rig_read_quantity(reader, value, UNITS_FREQUENCY, &mrad_s) < 0)
        return -1;
    *out_hz = (double)mrad_s / RIG_MRAD_PER_HZ;
    return rig_within(value, low_hz, high_hz, 1e-4, out_hz);
}

int rig_read_velocity(void *reader, const struct yaml_value *value, void *out)
{
    return rig_read_positive(reader, value, UNITS_VELOCITY, out);
}

int rig_read_acceleration(void *reader, const struct yaml_value *value,
                          void *out)
{
    return rig_read_positive(reader, value, UNITS_ACCELERATION, out);
}

int rig_read_jerk(void *reader, const struct yaml_value *value, void *out)
{
    return rig_read_positive(reader, value, UNITS_JERK, out);
}

/* A time of whole `step`s from min to max. */
int rig_read_time(struct rig_reader *reader, const struct yaml_value *value,
                  int64_t min_ns, int64_t max_ns, int64_t step_ns,
                  int64_t *out_ns)
{
    char quote[YAML_QUOTE_MAX];
    int64_t ns_q12;

    if (rig_read_quantity(reader, value, UNITS_TIME, &ns_q12) < 0)
        return -1;
    yaml_value_quote(quote, value);
    if (ns_q12 < min_ns * MOTION_FIXED_NS_Q12 ||
        ns_q12 > max_ns * MOTION_FIXED_NS_Q12)
        return yaml_value_refuse(value, "%s is out of range", quote);
    if (ns_q12 % (step_ns * MOTION_FIXED_NS_Q12) != 0)
        return yaml_value_refuse(value, "%s is not a whole number of %s", quote,
                                 step_ns == RIG_MS   ? "ms"
                                 : step_ns == RIG_US ? "us"
                                                     : "ns");
    *out_ns = ns_q12 / MOTION_FIXED_NS_Q12;
    return 0;
}

int rig_read_node_id(void *reader, const struct yaml_value *value, void *out)
{
    int64_t number;
    (void)reader;
    if (yaml_value_integer(value, 1, 127, &number) < 0)
        return -1;
    *(uint8_t *)out = (uint8_t)number;
    return 0;
}
