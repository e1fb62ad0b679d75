/* firmware/linux/rig_load.c - rig.yaml to struct rig.  See rig.h.
 *
 * One table per map of the file (docs/FILES.md shows them), one small function
 * per kind of value.  What can only be judged when two values are known is
 * judged where the second is read; the tables' order says which that is. */
#include "firmware/linux/rig.h"

#include <string.h>

#include "firmware/linux/yaml_shapes.h"
#include "firmware/linux/yaml_units.h"
#include "motion/err.h"
#include "motion/fixed.h"

#define ARRAY_LEN(a) (sizeof(a) / sizeof(a)[0])

#define RIG_US INT64_C(1000)
#define RIG_MS INT64_C(1000000)

/* No position in a file can be this: units are read as +-(2^63 - 1). */
#define RIG_NOT_GIVEN INT64_MIN

struct rig_reader {
    struct rig *rig;
    struct rig_axis *axis; /* being read */
    struct units_context units;
};

static const char *const rig_units[] = {
    [RIG_UNIT_MM] = "mm",
    [RIG_UNIT_DEG] = "deg",
    [RIG_UNIT_REV] = "rev",
    [RIG_UNIT_COUNT] = "count",
};
static const char *const rig_bus_kinds[] = { "canopen" };
static const char *const rig_drive_kinds[] = { "cia402" };

const struct yaml_words rig_words[] = {
    { "axis.unit", rig_units, ARRAY_LEN(rig_units) },
    { "bus.kind", rig_bus_kinds, ARRAY_LEN(rig_bus_kinds) },
    { "drive.kind", rig_drive_kinds, ARRAY_LEN(rig_drive_kinds) },
    { NULL, NULL, 0 },
};

const char *rig_unit_text(enum rig_unit unit)
{
    return rig_units[unit];
}

int rig_axis_index(const struct rig *rig, const char *name)
{
    for (uint32_t i = 0; i < rig->axis_count; i++)
        if (strcmp(rig->axis[i].name, name) == 0)
            return (int)i;
    return -1;
}

/* ---- values with units ---- */

static int rig_read_quantity(struct rig_reader *reader,
                             const struct yaml_value *value,
                             enum units_quantity quantity, int64_t *out)
{
    return yaml_units_read(value, quantity, &reader->units, out);
}

static int rig_read_positive(struct rig_reader *reader,
                             const struct yaml_value *value,
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

static int rig_read_velocity(void *reader, const struct yaml_value *value,
                             void *out)
{
    return rig_read_positive(reader, value, UNITS_VELOCITY, out);
}

static int rig_read_acceleration(void *reader, const struct yaml_value *value,
                                 void *out)
{
    return rig_read_positive(reader, value, UNITS_ACCELERATION, out);
}

static int rig_read_jerk(void *reader, const struct yaml_value *value,
                         void *out)
{
    return rig_read_positive(reader, value, UNITS_JERK, out);
}

/* A time of whole `step`s from min to max. */
static int rig_read_time(struct rig_reader *reader,
                         const struct yaml_value *value, int64_t min_ns,
                         int64_t max_ns, int64_t step_ns, int64_t *out_ns)
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
                                 step_ns == RIG_MS ? "ms" : "us");
    *out_ns = ns_q12 / MOTION_FIXED_NS_Q12;
    return 0;
}

/* ---- axis: limits, stop, following error ---- */

static int rig_read_unit(void *reader, const struct yaml_value *value,
                         void *out)
{
    struct rig_reader *self = reader;
    unsigned index;

    if (yaml_value_choice(value, rig_units, ARRAY_LEN(rig_units), &index) < 0)
        return -1;
    *(enum rig_unit *)out = (enum rig_unit)index;
    self->units.unit = (enum rig_unit)index;
    return 0;
}

/* [min, max] */
static int rig_read_range(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct plan_limit *limit = out;
    struct yaml_value low, high;
    uint32_t count;

    if (yaml_value_list(value, 2, 2, &count) < 0)
        return -1;
    low = yaml_value_at(value, yaml_value_node(value)->first);
    high = yaml_value_at(value, yaml_value_node(&low)->next);
    if (rig_read_quantity(reader, &low, UNITS_POSITION, &limit->pos_min_q32) <
            0 ||
        rig_read_quantity(reader, &high, UNITS_POSITION, &limit->pos_max_q32) <
            0)
        return -1;
    if (limit->pos_min_q32 >= limit->pos_max_q32)
        return yaml_value_refuse(&high, "ends where it begins or before");
    return 0;
}

static const struct yaml_field rig_limit_fields[] = {
    { "position", YAML_REQUIRED, "the range as [lowest, highest]",
      rig_read_range, 0 },
    { "velocity", YAML_REQUIRED, "the highest speed, such as 300 mm/s",
      rig_read_velocity, offsetof(struct plan_limit, vel_q32) },
    { "acceleration", YAML_REQUIRED,
      "the highest acceleration, such as 400 mm/s2", rig_read_acceleration,
      offsetof(struct plan_limit, acc_q16) },
    { "jerk", YAML_OPTIONAL, "the highest jerk, such as 2000 mm/s3",
      rig_read_jerk, offsetof(struct plan_limit, jerk_q16) },
};
static const struct yaml_shape rig_limit_shape = {
    "limits", rig_limit_fields, ARRAY_LEN(rig_limit_fields)
};

static int rig_read_limits(void *reader, const struct yaml_value *value,
                           void *out)
{
    return yaml_fields_read(value, &rig_limit_shape, reader, out);
}

static int rig_read_stop_acceleration(void *reader,
                                      const struct yaml_value *value, void *out)
{
    const struct rig_reader *self = reader;

    if (rig_read_acceleration(reader, value, out) < 0)
        return -1;
    if (*(int64_t *)out < self->axis->limit.acc_q16)
        return yaml_value_refuse(value, "is below the axis's own limit");
    return 0;
}

static int rig_read_stop_jerk(void *reader, const struct yaml_value *value,
                              void *out)
{
    const struct rig_reader *self = reader;

    if (rig_read_jerk(reader, value, out) < 0)
        return -1;
    if (self->axis->limit.jerk_q16 == 0)
        return yaml_value_refuse(value, "is given, but the axis has none among "
                                        "its limits");
    if (*(int64_t *)out < self->axis->limit.jerk_q16)
        return yaml_value_refuse(value, "is below the axis's own limit");
    return 0;
}

static const struct yaml_field rig_stop_fields[] = {
    { "acceleration", YAML_OPTIONAL,
      "an acceleration for stops after a fault, at least that of limits",
      rig_read_stop_acceleration, offsetof(struct rig_axis, stop_acc_q16) },
    { "jerk", YAML_OPTIONAL,
      "a jerk for stops after a fault, at least that of limits",
      rig_read_stop_jerk, offsetof(struct rig_axis, stop_jerk_q16) },
};
static const struct yaml_shape rig_stop_shape = { "stop", rig_stop_fields,
                                                  ARRAY_LEN(rig_stop_fields) };

static int rig_read_stop(void *reader, const struct yaml_value *value,
                         void *out)
{
    return yaml_fields_read(value, &rig_stop_shape, reader, out);
}

static int rig_read_floor(void *reader, const struct yaml_value *value,
                          void *out)
{
    return rig_read_positive(reader, value, UNITS_POSITION, out);
}

static int rig_read_following_time(void *reader, const struct yaml_value *value,
                                   void *out)
{
    return rig_read_time(reader, value, 0, 10000 * RIG_MS, RIG_US, out);
}

static const struct yaml_field rig_following_fields[] = {
    { "floor", YAML_REQUIRED,
      "the following error that is always allowed, such as 2 mm",
      rig_read_floor, offsetof(struct rig_axis, following_floor_q32) },
    { "time", YAML_OPTIONAL,
      "a time of 0 .. 10 s in whole us: speed times this is allowed",
      rig_read_following_time, offsetof(struct rig_axis, following_k_ns) },
};
static const struct yaml_shape rig_following_shape = {
    "following_error", rig_following_fields, ARRAY_LEN(rig_following_fields)
};

static int rig_read_following(void *reader, const struct yaml_value *value,
                              void *out)
{
    return yaml_fields_read(value, &rig_following_shape, reader, out);
}

/* ---- axis: drive ---- */

static int rig_read_drive_kind(void *reader, const struct yaml_value *value,
                               void *out)
{
    unsigned index;
    (void)reader;
    (void)out;
    return yaml_value_choice(value, rig_drive_kinds, ARRAY_LEN(rig_drive_kinds),
                             &index);
}

static int rig_read_drive_bus(void *reader, const struct yaml_value *value,
                              void *out)
{
    const struct rig *rig = ((struct rig_reader *)reader)->rig;
    const char *names[RIG_BUSES_MAX];
    unsigned index;

    for (uint32_t i = 0; i < rig->bus_count; i++)
        names[i] = rig->bus[i].name;
    if (yaml_value_choice(value, names, rig->bus_count, &index) < 0)
        return -1;
    *(uint32_t *)out = index;
    return 0;
}

static int rig_read_node_id(void *reader, const struct yaml_value *value,
                            void *out)
{
    int64_t number;
    (void)reader;
    if (yaml_value_integer(value, 1, 127, &number) < 0)
        return -1;
    *(uint8_t *)out = (uint8_t)number;
    return 0;
}

static int rig_read_drive_node(void *reader, const struct yaml_value *value,
                               void *out)
{
    const struct rig_reader *self = reader;
    const struct rig_axis *axis = self->axis;
    const struct rig_bus *bus = &self->rig->bus[axis->bus];

    if (rig_read_node_id(reader, value, out) < 0)
        return -1;
    if (axis->node_id == bus->node_id)
        return yaml_value_refuse(value, "%u is our own on bus %s",
                                 axis->node_id, bus->name);
    for (const struct rig_axis *other = self->rig->axis; other < axis; other++)
        if (other->bus == axis->bus && other->node_id == axis->node_id)
            return yaml_value_refuse(value, "%u on bus %s is axis %s already",
                                     axis->node_id, bus->name, other->name);
    return 0;
}

static int rig_read_counts_num(void *reader, const struct yaml_value *value,
                               void *out)
{
    char quote[YAML_QUOTE_MAX];
    (void)reader;
    if (yaml_value_integer(value, -INT64_MAX, INT64_MAX, out) < 0)
        return -1;
    if (*(int64_t *)out == 0)
        return yaml_value_refuse(value, "%s is zero",
                                 yaml_value_quote(quote, value));
    return 0;
}

static int rig_read_counts_den(void *reader, const struct yaml_value *value,
                               void *out)
{
    (void)reader;
    return yaml_value_integer(value, 1, INT64_MAX, out);
}

static const struct yaml_field rig_counts_fields[] = {
    { "num", YAML_REQUIRED,
      "a whole number of counts, negative for a reversed "
      "axis",
      rig_read_counts_num, offsetof(struct rig_axis, counts_num) },
    { "den", YAML_OPTIONAL, "the whole number of units they are for",
      rig_read_counts_den, offsetof(struct rig_axis, counts_den) },
};
static const struct yaml_shape rig_counts_shape = {
    "counts", rig_counts_fields, ARRAY_LEN(rig_counts_fields)
};

/* Set points go to the drive as 32-bit counts: both ends of the axis must fit,
 * which is when they fit in Q32.32 after the conversion. */
static bool rig_counts_fit(const struct rig_axis *axis)
{
    int64_t counts_q32;
    return motion_fixed_muldiv(axis->limit.pos_min_q32, axis->counts_num,
                               axis->counts_den, &counts_q32) == MOTION_OK &&
           motion_fixed_muldiv(axis->limit.pos_max_q32, axis->counts_num,
                               axis->counts_den, &counts_q32) == MOTION_OK;
}

static int rig_read_counts(void *reader, const struct yaml_value *value,
                           void *out)
{
    struct rig_axis *axis = out;
    const bool is_map = yaml_value_node(value)->kind == YAML_TREE_MAP;

    axis->counts_den = 1;
    if ((is_map ? yaml_fields_read(value, &rig_counts_shape, reader, axis)
                : yaml_units_read_counts(value, axis->unit, &axis->counts_num,
                                         &axis->counts_den)) < 0)
        return -1;
    if (!rig_counts_fit(axis))
        return yaml_value_refuse(value, "gives more than 2147483647 counts at "
                                        "the end of the axis");
    return 0;
}

static const struct yaml_field rig_drive_fields[] = {
    { "kind", YAML_REQUIRED, "cia402", rig_read_drive_kind, 0 },
    { "bus", YAML_REQUIRED, "the name of a bus", rig_read_drive_bus,
      offsetof(struct rig_axis, bus) },
    { "node", YAML_REQUIRED, "a node number, 1 .. 127, of its own on the bus",
      rig_read_drive_node, offsetof(struct rig_axis, node_id) },
    { "counts", YAML_REQUIRED,
      "counts per unit of the axis, such as '4096 per mm' or "
      "{num: 1048576, den: 360}",
      rig_read_counts, 0 },
};
static const struct yaml_shape rig_drive_shape = {
    "drive", rig_drive_fields, ARRAY_LEN(rig_drive_fields)
};

static int rig_read_drive(void *reader, const struct yaml_value *value,
                          void *out)
{
    return yaml_fields_read(value, &rig_drive_shape, reader, out);
}

/* ---- axis: simulated servo ---- */

static int rig_read_bandwidth(void *reader, const struct yaml_value *value,
                              void *out)
{
    char quote[YAML_QUOTE_MAX];
    int64_t mrad_s;

    if (rig_read_quantity(reader, value, UNITS_FREQUENCY, &mrad_s) < 0)
        return -1;
    if (mrad_s < 628 || mrad_s > 1256637)
        return yaml_value_refuse(value, "%s is out of range",
                                 yaml_value_quote(quote, value));
    *(uint32_t *)out = (uint32_t)mrad_s;
    return 0;
}

static int rig_read_damping(void *reader, const struct yaml_value *value,
                            void *out)
{
    char quote[YAML_QUOTE_MAX];
    int64_t ratio_q32, permille;

    if (rig_read_quantity(reader, value, UNITS_RATIO, &ratio_q32) < 0)
        return -1;
    if (motion_fixed_muldiv(ratio_q32, 1000, MOTION_FIXED_ONE_Q32, &permille) <
            0 ||
        permille < 100 || permille > 5000)
        return yaml_value_refuse(value, "%s is out of range",
                                 yaml_value_quote(quote, value));
    *(uint16_t *)out = (uint16_t)permille;
    return 0;
}

static int rig_read_start(void *reader, const struct yaml_value *value,
                          void *out)
{
    const struct plan_limit *limit =
        &((struct rig_reader *)reader)->axis->limit;
    const int64_t *start_q32 = out;

    if (rig_read_quantity(reader, value, UNITS_POSITION, out) < 0)
        return -1;
    if (*start_q32 < limit->pos_min_q32 || *start_q32 > limit->pos_max_q32)
        return yaml_value_refuse(value, "is outside the axis's limits");
    return 0;
}

static const struct yaml_field rig_sim_fields[] = {
    { "bandwidth", YAML_OPTIONAL, "0.1 Hz .. 200 Hz", rig_read_bandwidth,
      offsetof(struct rig_sim, omega_mrad_s) },
    { "damping", YAML_OPTIONAL, "0.1 .. 5", rig_read_damping,
      offsetof(struct rig_sim, zeta_permille) },
    { "start", YAML_OPTIONAL, "where the axis stands at power-on",
      rig_read_start, offsetof(struct rig_sim, start_q32) },
    { "velocity", YAML_OPTIONAL, "the highest speed of the motor",
      rig_read_velocity, offsetof(struct rig_sim, vel_max_q32) },
    { "acceleration", YAML_OPTIONAL, "the highest acceleration of the motor",
      rig_read_acceleration, offsetof(struct rig_sim, acc_max_q16) },
};
static const struct yaml_shape rig_sim_shape = { "sim", rig_sim_fields,
                                                 ARRAY_LEN(rig_sim_fields) };

static int rig_read_sim(void *reader, const struct yaml_value *value, void *out)
{
    return yaml_fields_read(value, &rig_sim_shape, reader, out);
}

/* ---- axes ---- */

static const struct yaml_field rig_axis_fields[] = {
    { "unit", YAML_REQUIRED, "mm, deg, rev or count", rig_read_unit,
      offsetof(struct rig_axis, unit) },
    { "limits", YAML_REQUIRED,
      "a map with position, velocity, acceleration and jerk", rig_read_limits,
      offsetof(struct rig_axis, limit) },
    { "stop", YAML_OPTIONAL, "a map with acceleration and jerk", rig_read_stop,
      0 },
    { "following_error", YAML_REQUIRED, "a map with floor and time",
      rig_read_following, 0 },
    { "drive", YAML_REQUIRED, "a map with kind, bus, node and counts",
      rig_read_drive, 0 },
    { "sim", YAML_OPTIONAL,
      "a map with bandwidth, damping, start, velocity and acceleration",
      rig_read_sim, offsetof(struct rig_axis, sim) },
};
static const struct yaml_shape rig_axis_shape = { "axis", rig_axis_fields,
                                                  ARRAY_LEN(rig_axis_fields) };

static int64_t rig_saturated_product(int64_t a, int64_t num, int64_t den)
{
    int64_t product;
    return motion_fixed_muldiv(a, num, den, &product) == MOTION_OK ? product
                                                                   : INT64_MAX;
}

static int64_t rig_nearest_to_zero(const struct plan_limit *limit)
{
    if (limit->pos_min_q32 > 0)
        return limit->pos_min_q32;
    return limit->pos_max_q32 < 0 ? limit->pos_max_q32 : 0;
}

/* What was left out; members that are still 0 were. */
static void rig_complete_axis(struct rig_axis *axis)
{
    if (axis->stop_acc_q16 == 0)
        axis->stop_acc_q16 = axis->limit.acc_q16;
    if (axis->stop_jerk_q16 == 0)
        axis->stop_jerk_q16 = axis->limit.jerk_q16;
    if (axis->sim.vel_max_q32 == 0)
        axis->sim.vel_max_q32 =
            rig_saturated_product(axis->limit.vel_q32, 3, 2);
    if (axis->sim.acc_max_q16 == 0)
        axis->sim.acc_max_q16 = rig_saturated_product(axis->stop_acc_q16, 2, 1);
    if (axis->sim.start_q32 == RIG_NOT_GIVEN)
        axis->sim.start_q32 = rig_nearest_to_zero(&axis->limit);
}

static int rig_read_axis(void *reader, uint32_t key,
                         const struct yaml_value *entry)
{
    struct rig_reader *self = reader;
    struct rig_axis *axis = &self->rig->axis[self->rig->axis_count];
    struct yaml_value value = *entry;

    *axis = (struct rig_axis){
        .following_k_ns = 20 * RIG_MS,
        .sim = { .omega_mrad_s = 157080,
                 .zeta_permille = 900,
                 .start_q32 = RIG_NOT_GIVEN },
        .place = yaml_tree_place(entry->tree, key),
    };
    memcpy(axis->name, entry->name, strlen(entry->name) + 1);
    self->axis = axis;
    value.expected = "a map with unit, limits, following_error and drive";
    if (yaml_fields_read(&value, &rig_axis_shape, reader, axis) < 0)
        return -1;
    rig_complete_axis(axis);
    self->rig->axis_count++;
    return 0;
}

static int rig_read_axes(void *reader, const struct yaml_value *value,
                         void *out)
{
    (void)out;
    return yaml_fields_each(value, RIG_AXES_MAX, reader, rig_read_axis);
}

/* ---- buses ---- */

static int rig_read_bus_kind(void *reader, const struct yaml_value *value,
                             void *out)
{
    unsigned index;
    (void)reader;
    (void)out;
    return yaml_value_choice(value, rig_bus_kinds, ARRAY_LEN(rig_bus_kinds),
                             &index);
}

/* CiA 301, table 1. */
static int rig_read_bit_rate(void *reader, const struct yaml_value *value,
                             void *out)
{
    static const uint32_t allowed[] = { 10000,  20000,  50000,  125000,
                                        250000, 500000, 800000, 1000000 };
    char quote[YAML_QUOTE_MAX];
    int64_t bit_rate;

    if (rig_read_quantity(reader, value, UNITS_BIT_RATE, &bit_rate) < 0)
        return -1;
    for (size_t i = 0; i < ARRAY_LEN(allowed); i++) {
        if (bit_rate != allowed[i])
            continue;
        *(uint32_t *)out = allowed[i];
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
static const struct yaml_shape rig_bus_shape = { "bus", rig_bus_fields,
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

static int rig_read_buses(void *reader, const struct yaml_value *value,
                          void *out)
{
    (void)out;
    return yaml_fields_each(value, RIG_BUSES_MAX, reader, rig_read_bus);
}

/* ---- the rig ---- */

static int rig_read_title(void *reader, const struct yaml_value *value,
                          void *out)
{
    (void)reader;
    return yaml_value_copy(value, out, sizeof(((struct rig *)0)->title));
}

static int rig_read_tick(void *reader, const struct yaml_value *value,
                         void *out)
{
    return rig_read_time(reader, value, 125 * RIG_US, 20 * RIG_MS, RIG_US, out);
}

static int rig_read_heartbeat(void *reader, const struct yaml_value *value,
                              void *out)
{
    return rig_read_time(reader, value, 10 * RIG_MS, 10000 * RIG_MS, RIG_MS,
                         out);
}

static int rig_read_watchdog(void *reader, const struct yaml_value *value,
                             void *out)
{
    const struct rig *rig = ((struct rig_reader *)reader)->rig;
    return rig_read_time(reader, value, 2 * rig->period_ns, 100 * RIG_MS,
                         RIG_MS, out);
}

static const struct yaml_field rig_fields[] = {
    { "title", YAML_OPTIONAL, "a text of at most 127 bytes", rig_read_title,
      offsetof(struct rig, title) },
    { "tick", YAML_OPTIONAL, "125 us .. 20 ms in whole us", rig_read_tick,
      offsetof(struct rig, period_ns) },
    { "heartbeat", YAML_OPTIONAL, "10 ms .. 10 s in whole ms",
      rig_read_heartbeat, offsetof(struct rig, heartbeat_ns) },
    { "watchdog", YAML_OPTIONAL, "2 ticks .. 100 ms in whole ms",
      rig_read_watchdog, offsetof(struct rig, watchdog_ns) },
    { "buses", YAML_REQUIRED, "a map of 1 .. 8 buses by name", rig_read_buses,
      0 },
    { "axes", YAML_REQUIRED, "a map of 1 .. 16 axes by name", rig_read_axes,
      0 },
};
static const struct yaml_shape rig_shape = { "rig", rig_fields,
                                             ARRAY_LEN(rig_fields) };

const struct yaml_shape *const rig_shapes[] = {
    &rig_shape,       &rig_bus_shape,
    &rig_axis_shape,  &rig_limit_shape,
    &rig_stop_shape,  &rig_following_shape,
    &rig_drive_shape, &rig_counts_shape,
    &rig_sim_shape,   NULL,
};

int rig_load(const char *path, struct rig *rig, char message[RIG_MESSAGE_MAX])
{
    const struct yaml_report report = { path, message, RIG_MESSAGE_MAX };
    struct rig_reader reader = { .rig = rig };
    struct yaml_tree tree;
    int err;

    *rig = (struct rig){ .period_ns = RIG_MS,
                         .heartbeat_ns = 100 * RIG_MS,
                         .watchdog_ns = 100 * RIG_MS };
    if (yaml_tree_load(&tree, &report) < 0)
        return -1;
    err = yaml_fields_read(&(struct yaml_value){ &tree, 0, "the rig",
                                                 "a map with buses and axes" },
                           &rig_shape, &reader, rig);
    yaml_tree_free(&tree);
    return err;
}
