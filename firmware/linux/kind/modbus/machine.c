/* firmware/linux/kind/modbus/machine.c - driver and simulated drive of an axis
 * on Modbus: see firmware/linux/machine/kind.h. */
#include "firmware/host/rig/modbus_budget.h"
#include "firmware/host/rig/modbus_stream.h"
#include "firmware/linux/machine/kind.h"
#include "hal/drive/modbus/drive.h"
#include "sim/device/modbus/servo.h"

static int modbus_init(struct machine *machine, unsigned i)
{
    const struct rig *rig = machine->rig;
    const unsigned bus = rig->axis[i].bus;
    struct drive_modbus_config config;

    modbus_stream_config(rig, i, &config);
    config.readings = rig->axis[i].monitor.wanted;
    struct drive_modbus *drive = machine->drive[i];
    machine->axis[i] = &drive->drive;
    return drive_modbus_init(drive, &machine->modbus[bus], &config);
}

/* A lost transaction costs its time-out and a silence: as old as feedback. */
static struct hal_readings *modbus_readings(struct machine *machine, unsigned i)
{
    struct drive_modbus *drive = machine->drive[i];
    drive->readings.missing_ns =
        modbus_budget_age_ns(machine->rig, machine->rig->axis[i].bus);
    return &drive->readings;
}

static int64_t modbus_age_ns(const struct rig *rig, const struct rig_axis *axis)
{
    return modbus_budget_age_ns(rig, axis->bus);
}

static int modbus_sim_init(struct machine_sim *sim, const struct rig *rig,
                           unsigned i)
{
    struct sim_modbus_servo_config config;
    int err = machine_sim_servo_config(rig, i, &config);

    if (err < 0)
        return err;
    return sim_modbus_servo_init(sim->servo[i], &sim->world,
                                 &sim->modbus_line[rig->axis[i].bus], &config);
}

static int64_t modbus_sim_counts_q24(const struct machine_sim *sim, unsigned i)
{
    return sim_modbus_servo_counts(machine_sim_modbus_servo(sim, i)) *
           (1 << 24);
}

const struct machine_kind machine_kind_modbus = {
    .drive_size = sizeof(struct drive_modbus),
    .sim_size = sizeof(struct sim_modbus_servo),
    .init = modbus_init,
    .readings = modbus_readings,
    .age_ns = modbus_age_ns,
    .sim_init = modbus_sim_init,
    .sim_counts_q24 = modbus_sim_counts_q24,
};
