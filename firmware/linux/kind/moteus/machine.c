/* firmware/linux/kind/moteus/machine.c - driver and simulated drive of a moteus
 * axis: see firmware/linux/machine/kind.h. */
#include "firmware/linux/kind/turn/machine.h"
#include "hal/drive/moteus/drive.h"
#include "motion/core/err.h"
#include "sim/device/moteus/servo.h"

_Static_assert(SIM_MOTEUS_COUNTS == RIG_TURN_COUNTS,
               "one turn is the same number of counts everywhere");

static int moteus_init(struct machine *machine, unsigned i)
{
    const struct rig *rig = machine->rig;
    const struct rig_axis *axis = &rig->axis[i];
    const struct rig_bus *bus = &rig->bus[axis->bus];
    const struct drive_moteus_config config = {
        .id = axis->node_id,
        .switched = bus->data_bit_rate > bus->bit_rate,
        .watchdog_ns = rig->watchdog_ns,
        .turn = turn_config(machine, i),
    };

    struct drive_moteus *drive = machine->drive[i];
    machine->axis[i] = &drive->turn.drive;
    return drive_moteus_init(drive, &machine->can[axis->bus], &config);
}
static int moteus_sim_init(struct machine_sim *sim, const struct rig *rig,
                           unsigned i)
{
    const struct rig_axis *axis = &rig->axis[i];
    struct sim_moteus_config config = { .id = axis->node_id,
                                        .loop_ns = TURN_SIM_LOOP_NS,
                                        .boot_ns = TURN_BOOT_NS,
                                        .torque_nm =
                                            axis->rated_torque_mnm / 1000.0 };
    int err = machine_sim_plant(axis, &config.plant, &config.start_counts);

    if (err < 0)
        return err;
    return sim_moteus_init(sim->servo[i], &sim->wire[axis->bus], &config);
}

static struct hal_readings *moteus_readings(struct machine *machine, unsigned i)
{
    return &((struct drive_moteus *)machine->drive[i])->turn.readings;
}

static struct sim_servo *moteus_sim_servo(struct machine_sim *sim, unsigned i)
{
    return &((struct sim_moteus *)sim->servo[i])->base;
}

static int64_t moteus_sim_counts_q24(const struct machine_sim *sim, unsigned i)
{
    return sim_servo_pos_q24(&((const struct sim_moteus *)sim->servo[i])->base);
}

const struct machine_kind machine_kind_moteus = {
    .drive_size = sizeof(struct drive_moteus),
    .sim_size = sizeof(struct sim_moteus),
    .init = moteus_init,
    .readings = moteus_readings,
    .sim_init = moteus_sim_init,
    .sim_servo = moteus_sim_servo,
    .sim_loop_ns = TURN_SIM_LOOP_NS,
    .sim_counts_q24 = moteus_sim_counts_q24,
};
