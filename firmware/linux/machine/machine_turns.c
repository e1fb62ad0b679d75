/* firmware/linux/machine/machine_turns.c - see machine_turns.h. */
#include "firmware/linux/machine/machine_turns.h"

#include "firmware/host/rig/turns_budget.h"

static struct drive_turns_config machine_turns(const struct machine *machine,
                                               unsigned i)
{
    const struct rig *rig = machine->rig;
    const struct rig_axis *axis = &rig->axis[i];
    struct drive_turns_config config = {
        .period_ns = rig->period_ns,
        .latency_ns = turns_budget_latency_ns(rig, i),
        .answer_ns = turns_budget_answer_ns(rig, i),
        .stop_acc_q32 = axis->stop_acc_q32,
    };

    rig_axis_turns(axis, &config.turns_num, &config.turns_den);
    return config;
}

int machine_init_odrive(struct machine *machine, unsigned i)
{
    const struct rig_axis *axis = &machine->rig->axis[i];
    const struct drive_odrive_config config = {
        .node = axis->node_id,
        .turns = machine_turns(machine, i),
        .heartbeat_ns = machine->rig->heartbeat_ns,
        .enable_watchdog = axis->enable_watchdog,
        .watchdog_timeout = axis->watchdog_timeout,
        .watchdog_ns = machine->rig->watchdog_ns,
    };

    machine->axis[i] = &machine->odrive[i].turns.drive;
    return drive_odrive_init(&machine->odrive[i], &machine->can[axis->bus],
                             &config);
}

int machine_init_moteus(struct machine *machine, unsigned i)
{
    const struct rig *rig = machine->rig;
    const struct rig_axis *axis = &rig->axis[i];
    const struct rig_bus *bus = &rig->bus[axis->bus];
    const struct drive_moteus_config config = {
        .id = axis->node_id,
        .switched = bus->data_bit_rate > bus->bit_rate,
        .watchdog_ns = rig->watchdog_ns,
        .turns = machine_turns(machine, i),
    };

    machine->axis[i] = &machine->moteus[i].turns.drive;
    return drive_moteus_init(&machine->moteus[i], &machine->can[axis->bus],
                             &config);
}
