/* firmware/linux/machine/machine_sim_load.c - what the motors of a simulated rig
 * turn; see machine_sim.h. */
#include "firmware/linux/machine/machine_sim.h"

#include <math.h>

#include "firmware/linux/machine/kind.h"

/* Counts of the axis's unit; negative for a reversed axis. */
static double machine_sim_factor(const struct rig_axis *axis)
{
    return (double)axis->counts_num / (double)axis->counts_den * 0x1p-32;
}

static int machine_sim_stops(const struct rig_axis *axis,
                             struct sim_mechanics_config *config)
{
    int32_t at[2] = { 0 };
    int err = machine_sim_place(axis, axis->sim.load.stop_q32[0], &at[0]);

    if (err == MOTION_OK)
        err = machine_sim_place(axis, axis->sim.load.stop_q32[1], &at[1]);
    config->stop_low_counts = fmin(at[0], at[1]);
    config->stop_high_counts = fmax(at[0], at[1]);
    return err;
}

void machine_sim_load_config(const struct rig_axis *axis,
                             struct sim_mechanics_config *config)
{
    const struct rig_sim_load *load = &axis->sim.load;
    const double factor = machine_sim_factor(axis);
    const double size = fabs(factor);

    *config = (struct sim_mechanics_config){
        .inertia_ratio = load->inertia_ratio,
        .frequency_hz = load->frequency_hz,
        .damping = load->damping,
        .backlash_counts = (double)load->backlash_q32 * size,
        .coulomb_counts_s2 = (double)load->friction_q32 * size,
        .static_counts_s2 = (double)load->static_q32 * size,
        .stribeck_counts_s = (double)load->stribeck_q32 * size,
        .viscous_1_s = load->viscous_1_s,
        .weight_counts_s2 = (double)load->weight_q32 * factor,
        .has_stops = load->has_stops,
        .second = { .inertia_ratio = load->second.inertia_ratio,
                    .frequency_hz = load->second.frequency_hz,
                    .damping = load->second.damping,
                    .backlash_counts =
                        (double)load->second.backlash_q32 * size },
        .transmission = { .efficiency = load->efficiency,
                          .pitch_error_counts =
                              (double)load->pitch_error_q32 * size,
                          .pitch_counts = (double)load->pitch_q32 * size },
    };
}

static int machine_sim_attach_load(const struct rig_axis *axis,
                                   struct sim_plant *plant,
                                   struct sim_mechanics *mechanics)
{
    struct sim_mechanics_config config;

    machine_sim_load_config(axis, &config);
    int err = config.has_stops ? machine_sim_stops(axis, &config) : MOTION_OK;

    if (err == MOTION_OK)
        err = sim_mechanics_init(mechanics, &config, plant->pos_q24);
    if (err == MOTION_OK)
        plant->mechanics = mechanics;
    return err;
}

void machine_sim_winding_config(const struct rig_axis *axis,
                                struct sim_winding_config *config)
{
    const struct rig_sim_motor *const motor = &axis->sim.motor;
    const double size = fabs(machine_sim_factor(axis));

    *config = (struct sim_winding_config){
        .stall_counts_s2 = (double)motor->stall_q32 * size,
        .no_load_counts_s = (double)motor->no_load_q32 * size,
        .rated_counts_s2 = (double)motor->rated_q32 * size,
        .time_constant_s = 1e-9 * (double)motor->thermal_ns,
        .warm_load = motor->warm_load,
    };
}

static int machine_sim_attach_motor(const struct rig_axis *axis,
                                    struct sim_plant *plant)
{
    struct sim_winding_config config;

    machine_sim_winding_config(axis, &config);
    return axis->sim.motor.given ? sim_plant_set_winding(plant, &config)
                                 : MOTION_OK;
}

void machine_sim_loops_config(const struct rig_axis *axis,
                              struct sim_loops_config *config)
{
    const struct rig_sim_loops *const loops = &axis->sim.loops;

    *config = (struct sim_loops_config){
        .position_hz = loops->position_hz,
        .velocity_hz = loops->velocity_hz,
        .current_hz = loops->current_hz,
        .reset_s = 1e-9 * (double)loops->reset_ns,
        .position_ns = loops->position_ns,
        .velocity_ns = loops->velocity_ns,
        .current_ns = loops->current_ns,
    };
}

static int machine_sim_attach_loops(const struct rig_axis *axis,
                                    struct sim_plant *plant)
{
    struct sim_loops_config config;

    machine_sim_loops_config(axis, &config);
    return axis->sim.loops.given ? sim_plant_set_loops(plant, &config)
                                 : MOTION_OK;
}

/* Counts, with 24 fraction bits; beyond the motor's range it is as far. */
static int64_t machine_sim_length_q24(const struct rig_axis *axis,
                                      int64_t length_q32)
{
    return llround(fmin(
        fabs((double)length_q32 * machine_sim_factor(axis)) * 0x1p24, 0x1p48));
}

int machine_sim_attach(const struct rig_axis *axis, unsigned number,
                       struct sim_plant *plant, struct sim_mechanics *mechanics)
{
    plant->encoder_step_q24 =
        machine_sim_length_q24(axis, axis->sim.encoder_step_q32);
    plant->encoder_noise_q24 =
        machine_sim_length_q24(axis, axis->sim.encoder_noise_q32);
    plant->encoder_seed = number + 1;
    int err = machine_sim_attach_motor(axis, plant);
    if (err == MOTION_OK)
        err = machine_sim_attach_loops(axis, plant);
    if (err < 0)
        return err;
    return axis->sim.load.given
               ? machine_sim_attach_load(axis, plant, mechanics)
               : MOTION_OK;
}

struct sim_plant *machine_sim_plant_of(struct machine_sim *sim, unsigned i)
{
    const struct machine_kind *kind = machine_kinds[sim->rig->axis[i].kind];

    return kind->sim_servo != NULL ? &kind->sim_servo(sim, i)->plant
                                   : &machine_sim_modbus_servo(sim, i)->plant;
}

int machine_sim_loads(struct machine_sim *sim, unsigned *axis)
{
    for (unsigned i = 0; i < sim->rig->axis_count; i++) {
        const struct rig_sim *const has = &sim->rig->axis[i].sim;
        struct sim_mechanics *const mechanics =
            has->load.given ? &sim->mechanics[i] : NULL;
        if (rig_axis_is_virtual(&sim->rig->axis[i]))
            continue;
        *axis = i;
        const int err = machine_sim_attach(
            &sim->rig->axis[i], i, machine_sim_plant_of(sim, i), mechanics);
        if (err < 0)
            return err;
    }
    return MOTION_OK;
}

int64_t machine_sim_twist_q32(struct machine_sim *sim, unsigned i)
{
    const struct sim_plant *plant = machine_sim_plant_of(sim, i);
    const double counts =
        (double)(sim_mechanics_load_q24(plant->mechanics) - plant->pos_q24) *
        0x1p-24;

    return llround(counts / machine_sim_factor(&sim->rig->axis[i]));
}

int64_t machine_sim_swing_q32(struct machine_sim *sim, unsigned i)
{
    const struct sim_plant *plant = machine_sim_plant_of(sim, i);
    const double factor = fabs(machine_sim_factor(&sim->rig->axis[i]));

    return llround(sim_mechanics_swing_counts(plant->mechanics) / factor);
}
