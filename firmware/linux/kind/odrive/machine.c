/* firmware/linux/kind/odrive/machine.c - driver and simulated drive of an ODrive
 * axis: see firmware/linux/machine/kind.h. */
#include <math.h>

#include "firmware/linux/kind/turn/machine.h"
#include "hal/drive/odrive/drive.h"
#include "motion/core/err.h"
#include "sim/device/odrive/servo.h"

_Static_assert(SIM_ODRIVE_COUNTS == RIG_TURN_COUNTS,
               "one turn is the same number of counts everywhere");

static int odrive_init(struct machine *machine, unsigned i)
{
    const struct rig_axis *axis = &machine->rig->axis[i];
    const struct drive_odrive_config config = {
        .node = axis->node_id,
        .turn = turn_config(machine, i),
        .heartbeat_ns = machine->rig->heartbeat_ns,
        .enable_watchdog = axis->enable_watchdog,
        .watchdog_timeout = axis->watchdog_timeout,
        .watchdog_ns = machine->rig->watchdog_ns,
        .reads_torque = axis->rated_torque_mnm > 0,
        .torque_constant_q32 = axis->torque_constant_q32,
    };

    struct drive_odrive *drive = machine->drive[i];
    machine->axis[i] = &drive->turn.drive;
    return drive_odrive_init(drive, &machine->can[axis->bus], &config);
}

/* With endpoints it is one with firmware 0.6. */
static int odrive_sim_init(struct machine_sim *sim, const struct rig *rig,
                           unsigned i)
{
    const struct rig_axis *axis = &rig->axis[i];
    struct sim_odrive_config config = {
        .node = axis->node_id,
        .is_05 = axis->watchdog_timeout == 0,
        .heartbeat_ns = rig->heartbeat_ns,
        .loop_ns = TURN_SIM_LOOP_NS,
        .boot_ns = TURN_BOOT_NS,
        .torque_nm = axis->rated_torque_mnm / 1000.0,
        .torque_constant = ldexp((double)axis->torque_constant_q32, -32),
        .enable_watchdog = axis->enable_watchdog,
        .watchdog_timeout = axis->watchdog_timeout,
    };
    int err = machine_sim_plant(axis, &config.plant, &config.start_counts);

    if (err == MOTION_OK && axis->homing.by == HOMING_DRIVE)
        err =
            machine_sim_place(axis, axis->homing.pos_q32, &config.home_counts);
    if (err < 0)
        return err;
    return sim_odrive_init(sim->servo[i], &sim->wire[axis->bus], &config);
}

static struct hal_readings *odrive_readings(struct machine *machine, unsigned i)
{
    return &((struct drive_odrive *)machine->drive[i])->turn.readings;
}

static struct sim_servo *odrive_sim_servo(struct machine_sim *sim, unsigned i)
{
    return &((struct sim_odrive *)sim->servo[i])->base;
}

static int64_t odrive_sim_counts_q24(const struct machine_sim *sim, unsigned i)
{
    return sim_servo_pos_q24(&((const struct sim_odrive *)sim->servo[i])->base);
}

const struct machine_kind machine_kind_odrive = {
    .drive_size = sizeof(struct drive_odrive),
    .sim_size = sizeof(struct sim_odrive),
    .init = odrive_init,
    .readings = odrive_readings,
    .sim_init = odrive_sim_init,
    .sim_servo = odrive_sim_servo,
    .sim_loop_ns = TURN_SIM_LOOP_NS,
    .sim_counts_q24 = odrive_sim_counts_q24,
};
