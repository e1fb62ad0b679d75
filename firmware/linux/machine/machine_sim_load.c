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

int machine_sim_attach(const struct rig_axis *axis, struct sim_plant *plant,
                       struct sim_mechanics *mechanics)
{
    const struct rig_sim_load *load = &axis->sim.load;
    const double factor = machine_sim_factor(axis);
    const double size = fabs(factor);
    struct sim_mechanics_config config = {
        .inertia_ratio = load->inertia_ratio,
        .frequency_hz = load->frequency_hz,
        .damping = load->damping,
        .backlash_counts = (double)load->backlash_q32 * size,
        .coulomb_counts_s2 = (double)load->friction_q32 * size,
        .static_counts_s2 = (double)load->static_q32 * size,
        .stribeck_counts_s = (double)load->stribeck_q32 * size,
        .weight_counts_s2 = (double)load->weight_q32 * factor,
        .has_stops = load->has_stops,
    };
    int err = load->has_stops ? machine_sim_stops(axis, &config) : MOTION_OK;

    if (err == MOTION_OK)
        err = sim_mechanics_init(mechanics, &config, plant->pos_q24);
    if (err == MOTION_OK)
        plant->mechanics = mechanics;
    return err;
}

static struct sim_plant *machine_sim_plant_of(struct machine_sim *sim,
                                              unsigned i)
{
    const struct machine_kind *kind = machine_kinds[sim->rig->axis[i].kind];

    return kind->sim_servo != NULL ? &kind->sim_servo(sim, i)->plant
                                   : &machine_sim_modbus_servo(sim, i)->plant;
}

int machine_sim_loads(struct machine_sim *sim, unsigned *axis)
{
    for (unsigned i = 0; i < sim->rig->axis_count; i++) {
        if (!sim->rig->axis[i].sim.load.given)
            continue;
        *axis = i;
        const int err =
            machine_sim_attach(&sim->rig->axis[i], machine_sim_plant_of(sim, i),
                               &sim->mechanics[i]);
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
