/* firmware/linux/machine/machine_sim_turns.c - simulated drives that count
 * turns; see machine_sim.h. */
#include "firmware/linux/machine/machine_sim.h"

#include "motion/core/err.h"

#define MACHINE_SIM_BOOT_NS INT64_C(150000000)

_Static_assert(SIM_ODRIVE_COUNTS == RIG_TURN_COUNTS &&
                   SIM_MOTEUS_COUNTS == RIG_TURN_COUNTS,
               "one turn is the same number of counts everywhere");

/* With endpoints it is one with firmware 0.6. */
int machine_sim_odrive(struct machine_sim *sim, const struct rig *rig,
                       unsigned i)
{
    const struct rig_axis *axis = &rig->axis[i];
    struct sim_odrive_config config = {
        .node = axis->node_id,
        .is_05 = axis->watchdog_timeout == 0,
        .heartbeat_ns = rig->heartbeat_ns,
        .boot_ns = MACHINE_SIM_BOOT_NS,
        .enable_watchdog = axis->enable_watchdog,
        .watchdog_timeout = axis->watchdog_timeout,
    };
    int err = machine_sim_plant(axis, &config.plant, &config.start_counts);

    if (err == MOTION_OK && axis->homing.by == HOMING_DRIVE)
        err =
            machine_sim_place(axis, axis->homing.pos_q32, &config.home_counts);
    if (err < 0)
        return err;
    return sim_odrive_init(&sim->odrive[i], &sim->wire[axis->bus], &config);
}

int machine_sim_moteus(struct machine_sim *sim, const struct rig_axis *axis,
                       unsigned i)
{
    struct sim_moteus_config config = { .id = axis->node_id,
                                        .boot_ns = MACHINE_SIM_BOOT_NS };
    int err = machine_sim_plant(axis, &config.plant, &config.start_counts);

    if (err < 0)
        return err;
    return sim_moteus_init(&sim->moteus[i], &sim->wire[axis->bus], &config);
}
