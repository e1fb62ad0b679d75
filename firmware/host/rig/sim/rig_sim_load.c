/* firmware/host/rig/sim/rig_sim_load.c - what the motor of a simulated axis turns:
 * see sim/physics/mechanics.h. */
#include "firmware/host/rig/rig_parts.h"

#define LOAD_DAMPING     0.02
#define LOAD_PITCH_PARTS 13 /* 4 pi: sim/physics/drivetrain.h */

static int load_read_inertia(void *reader, const struct yaml_value *value,
                             void *out)
{
    return rig_read_share(reader, value, 0.01, 1000, out);
}

static int load_read_damping(void *reader, const struct yaml_value *value,
                             void *out)
{
    return rig_read_share(reader, value, 0, 1, out);
}

static int load_read_frequency(void *reader, const struct yaml_value *value,
                               void *out)
{
    return rig_read_frequency(reader, value, 0.1, 500, out);
}

static int load_read_viscous(void *reader, const struct yaml_value *value,
                             void *out)
{
    return rig_read_share(reader, value, 0, 1000, out);
}

static int load_read_backlash(void *reader, const struct yaml_value *value,
                              void *out)
{
    return rig_read_positive(reader, value, UNITS_POSITION, out);
}

/* Coulomb friction comes before it in the table. */
static int load_read_static(void *reader, const struct yaml_value *value,
                            void *out)
{
    struct rig_sim_load *load = out;

    if (rig_read_acceleration(reader, value, &load->static_q32) < 0)
        return -1;
    if (load->static_q32 < load->friction_q32)
        return yaml_value_refuse(value, "is below friction");
    return 0;
}

static int load_read_weight(void *reader, const struct yaml_value *value,
                            void *out)
{
    return rig_read_quantity(reader, value, UNITS_ACCELERATION, out);
}

static int load_read_stops(void *reader, const struct yaml_value *value,
                           void *out)
{
    struct rig_sim_load *load = out;

    load->has_stops = true;
    return rig_read_ends(reader, value, &load->stop_q32[0], &load->stop_q32[1]);
}

static int load_read_efficiency(void *reader, const struct yaml_value *value,
                                void *out)
{
    return rig_read_share(reader, value, 0.05, 1, out);
}

static const struct yaml_field rig_transmission_fields[] = {
    { "efficiency", YAML_OPTIONAL, "of a screw, belt or gear, 0.05 .. 1",
      load_read_efficiency, offsetof(struct rig_sim_load, efficiency) },
    { "pitch", YAML_OPTIONAL, "the travel after which its error repeats",
      load_read_backlash, offsetof(struct rig_sim_load, pitch_q32) },
    { "pitch_error", YAML_OPTIONAL, "the amplitude of its error, above zero",
      load_read_backlash, offsetof(struct rig_sim_load, pitch_error_q32) },
};
const struct yaml_shape rig_transmission_shape = {
    "transmission", rig_transmission_fields, ARRAY_LEN(rig_transmission_fields)
};

static int load_read_transmission(void *reader, const struct yaml_value *value,
                                  void *out)
{
    const struct rig_sim_load *load = out;

    if (yaml_fields_read(value, &rig_transmission_shape, reader, out) < 0)
        return -1;
    if ((load->pitch_q32 == 0) != (load->pitch_error_q32 == 0))
        return yaml_value_refuse(value, "has one of pitch and pitch_error");
    if (load->pitch_error_q32 > load->pitch_q32 / LOAD_PITCH_PARTS)
        return yaml_value_refuse(value, "has a pitch_error above pitch / 13");
    return 0;
}

static const struct yaml_field rig_sim_second_fields[] = {
    { "inertia", YAML_REQUIRED, "over the motor, 0.01 .. 1000",
      load_read_inertia, offsetof(struct rig_sim_second, inertia_ratio) },
    { "frequency", YAML_REQUIRED,
      "0.1 Hz .. 500 Hz, of it while the load is held", load_read_frequency,
      offsetof(struct rig_sim_second, frequency_hz) },
    { "damping", YAML_OPTIONAL, "a ratio of 0 .. 1", load_read_damping,
      offsetof(struct rig_sim_second, damping) },
    { "backlash", YAML_OPTIONAL, "the whole gap, above zero",
      load_read_backlash, offsetof(struct rig_sim_second, backlash_q32) },
};
const struct yaml_shape rig_sim_second_shape = {
    "second", rig_sim_second_fields, ARRAY_LEN(rig_sim_second_fields)
};

static int load_read_second(void *reader, const struct yaml_value *value,
                            void *out)
{
    struct rig_sim_second *second = out;

    second->damping = LOAD_DAMPING;
    return yaml_fields_read(value, &rig_sim_second_shape, reader, second);
}

static const struct yaml_field rig_sim_load_fields[] = {
    { "inertia", YAML_REQUIRED, "load over motor, 0.01 .. 1000",
      load_read_inertia, offsetof(struct rig_sim_load, inertia_ratio) },
    { "frequency", YAML_REQUIRED,
      "0.1 Hz .. 500 Hz, of the load while the motor is held",
      load_read_frequency, offsetof(struct rig_sim_load, frequency_hz) },
    { "damping", YAML_OPTIONAL, "a ratio of 0 .. 1", load_read_damping,
      offsetof(struct rig_sim_load, damping) },
    { "backlash", YAML_OPTIONAL, "the whole gap, above zero",
      load_read_backlash, offsetof(struct rig_sim_load, backlash_q32) },
    { "friction", YAML_OPTIONAL, "the deceleration that it alone makes",
      rig_read_acceleration, offsetof(struct rig_sim_load, friction_q32) },
    { "static_friction", YAML_OPTIONAL, "at rest, at least friction",
      load_read_static, 0 },
    { "viscous", YAML_OPTIONAL, "a deceleration per speed, 0 .. 1000 (1/s)",
      load_read_viscous, offsetof(struct rig_sim_load, viscous_1_s) },
    { "stribeck", YAML_OPTIONAL, "the speed at which static friction is gone",
      rig_read_velocity, offsetof(struct rig_sim_load, stribeck_q32) },
    { "weight", YAML_OPTIONAL, "the acceleration with which it falls",
      load_read_weight, offsetof(struct rig_sim_load, weight_q32) },
    { "stops", YAML_OPTIONAL, "where it meets something, as [lower, upper]",
      load_read_stops, 0 },
    { "transmission", YAML_OPTIONAL,
      "a map of efficiency, pitch and pitch_error", load_read_transmission, 0 },
    { "second", YAML_OPTIONAL, "a map with inertia and frequency",
      load_read_second, offsetof(struct rig_sim_load, second) },
};
const struct yaml_shape rig_sim_load_shape = { "load", rig_sim_load_fields,
                                               ARRAY_LEN(rig_sim_load_fields) };

int rig_read_sim_load(void *reader, const struct yaml_value *value, void *out)
{
    const struct rig_reader *self = reader;
    const struct plan_limit *limit = &self->axis->limit;
    struct rig_sim_load *load = out;

    if (rig_kinds[self->axis->kind]->samples)
        return yaml_value_refuse(value, "is not for an axis of a board");
    *load = (struct rig_sim_load){ .given = true, .damping = LOAD_DAMPING };
    if (yaml_fields_read(value, &rig_sim_load_shape, reader, load) < 0)
        return -1;
    if (load->static_q32 == 0)
        load->static_q32 = load->friction_q32;
    if (load->static_q32 > load->friction_q32 && load->stribeck_q32 == 0)
        return yaml_value_refuse(value, "has static_friction above friction, "
                                        "but no stribeck");
    if (load->has_stops && (load->stop_q32[0] > limit->pos_min_q32 ||
                            load->stop_q32[1] < limit->pos_max_q32))
        return yaml_value_refuse(value,
                                 "has stops inside the axis's position limits");
    return 0;
}
