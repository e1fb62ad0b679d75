/* firmware/host/rig/sim/rig_sim.c - how an axis's servo behaves when it is
 * simulated. */
#include "firmware/host/rig/rig_parts.h"

#include "motion/core/err.h"
#include "motion/core/fixed.h"

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
        permille < 100 || permille > 2000)
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

/* ---- switches that are wired to the drive ---- */

static int rig_read_pair(struct rig_reader *self,
                         const struct yaml_value *value, int64_t pair_q32[2])
{
    if (!rig_kinds[self->axis->kind]->has_inputs)
        return yaml_value_refuse(value, "is only for a cia402 drive");
    return rig_read_ends(self, value, &pair_q32[0], &pair_q32[1]);
}

static int rig_read_limit_switches(void *reader, const struct yaml_value *value,
                                   void *out)
{
    struct rig_sim *sim = out;

    sim->has_limits = true;
    return rig_read_pair(reader, value, sim->limit_q32);
}

static int rig_read_home_switch(void *reader, const struct yaml_value *value,
                                void *out)
{
    struct rig_sim *sim = out;

    sim->has_home = true;
    return rig_read_pair(reader, value, sim->home_q32);
}

static int rig_read_hard_stops(void *reader, const struct yaml_value *value,
                               void *out)
{
    struct rig_reader *self = reader;
    struct rig_sim *sim = out;

    if (!rig_bus_is_can(&self->rig->bus[self->axis->bus]))
        return yaml_value_refuse(value, "is not for a modbus drive");
    sim->has_stops = true;
    return rig_read_ends(self, value, &sim->stop_q32[0], &sim->stop_q32[1]);
}

static int rig_read_index(void *reader, const struct yaml_value *value,
                          void *out)
{
    struct rig_reader *self = reader;

    if (!rig_kinds[self->axis->kind]->has_inputs)
        return yaml_value_refuse(value, "is only for a cia402 drive");
    return rig_read_positive(self, value, UNITS_POSITION, out);
}

/* ---- its encoder ---- */

static int rig_read_sim_length(void *reader, const struct yaml_value *value,
                               void *out)
{
    return rig_read_positive(reader, value, UNITS_POSITION, out);
}

static const struct yaml_field rig_encoder_fields[] = {
    { "resolution", YAML_OPTIONAL,
      "the smallest distance that it resolves, above zero", rig_read_sim_length,
      offsetof(struct rig_sim, encoder_step_q32) },
    { "noise", YAML_OPTIONAL, "its standard deviation, above zero",
      rig_read_sim_length, offsetof(struct rig_sim, encoder_noise_q32) },
};
const struct yaml_shape rig_encoder_shape = { "encoder", rig_encoder_fields,
                                              ARRAY_LEN(rig_encoder_fields) };

static int rig_read_encoder(void *reader, const struct yaml_value *value,
                            void *out)
{
    return yaml_fields_read(value, &rig_encoder_shape, reader, out);
}

/* ---- a Modbus servo as its maker describes it ---- */

const char *const rig_sim_device_words[RIG_SIM_DEVICES] = {
    "map",         "leadshine-el7", "leadshine-cs2rs",
    "oriental-az", "delta-asda",    "lexium-32",
};

static int rig_read_device(void *reader, const struct yaml_value *value,
                           void *out)
{
    unsigned index;

    if (!rig_kinds[((struct rig_reader *)reader)->axis->kind]->has_map)
        return yaml_value_refuse(value, "is only for a modbus drive");
    if (yaml_value_choice(value, rig_sim_device_words, RIG_SIM_DEVICES,
                          &index) < 0)
        return -1;
    *(uint8_t *)out = (uint8_t)(index + 1);
    return 0;
}

static const struct yaml_field rig_sim_fields[] = {
    { "bandwidth", YAML_OPTIONAL, "0.1 Hz .. 200 Hz", rig_read_bandwidth,
      offsetof(struct rig_sim, omega_mrad_s) },
    { "damping", YAML_OPTIONAL, "0.1 .. 2", rig_read_damping,
      offsetof(struct rig_sim, zeta_permille) },
    { "start", YAML_OPTIONAL, "where the axis stands at power-on",
      rig_read_start, offsetof(struct rig_sim, start_q32) },
    { "velocity", YAML_OPTIONAL, "the highest speed of the motor",
      rig_read_velocity, offsetof(struct rig_sim, vel_max_q32) },
    { "acceleration", YAML_OPTIONAL, "the highest acceleration of the motor",
      rig_read_acceleration, offsetof(struct rig_sim, acc_max_q32) },
    { "limit_switches", YAML_OPTIONAL, "where they are, as [lower, upper]",
      rig_read_limit_switches, 0 },
    { "home_switch", YAML_OPTIONAL, "where it is active, as [from, to]",
      rig_read_home_switch, 0 },
    { "hard_stops", YAML_OPTIONAL, "where they are, as [lower, upper]",
      rig_read_hard_stops, 0 },
    { "index", YAML_OPTIONAL, "the travel from one index pulse to the next",
      rig_read_index, offsetof(struct rig_sim, index_q32) },
    { "device", YAML_OPTIONAL, "a maker's drive such as leadshine-el7, or map",
      rig_read_device, offsetof(struct rig_sim, device) },
    { "encoder", YAML_OPTIONAL, "a map of resolution and noise",
      rig_read_encoder, 0 },
    { "quirks", YAML_OPTIONAL, "a map of what its drive lacks or has otherwise",
      rig_read_sim_quirks, offsetof(struct rig_sim, quirks) },
    { "load", YAML_OPTIONAL, "a map with inertia and frequency",
      rig_read_sim_load, offsetof(struct rig_sim, load) },
    { "motor", YAML_OPTIONAL,
      "a map of stall and no_load_speed, rated and thermal_time",
      rig_read_sim_motor, offsetof(struct rig_sim, motor) },
    { "loops", YAML_OPTIONAL, "a map with position and velocity",
      rig_read_sim_loops, offsetof(struct rig_sim, loops) },
};
const struct yaml_shape rig_sim_shape = { "sim", rig_sim_fields,
                                          ARRAY_LEN(rig_sim_fields) };

/* A virtual axis is nothing but where it stands. */
static const struct yaml_field rig_virtual_sim_fields[] = {
    { "start", YAML_OPTIONAL, "where the axis stands at power-on",
      rig_read_start, offsetof(struct rig_sim, start_q32) },
};
const struct yaml_shape rig_virtual_sim_shape = {
    "virtual_sim", rig_virtual_sim_fields, ARRAY_LEN(rig_virtual_sim_fields)
};

int rig_read_sim(void *reader, const struct yaml_value *value, void *out)
{
    const struct rig_reader *self = reader;

    return yaml_fields_read(value,
                            rig_axis_is_virtual(self->axis)
                                ? &rig_virtual_sim_shape
                                : &rig_sim_shape,
                            reader, out);
}
