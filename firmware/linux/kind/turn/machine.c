/* firmware/linux/kind/turn/machine.c - see machine.h. */
#include "firmware/linux/kind/turn/machine.h"

#include "firmware/host/kind/turn/budget.h"

struct drive_turn_config turn_config(const struct machine *machine, unsigned i)
{
    const struct rig *rig = machine->rig;
    const struct rig_axis *axis = &rig->axis[i];
    struct drive_turn_config config = {
        .period_ns = rig->period_ns,
        .latency_ns = turn_budget_latency_ns(rig, i),
        .answer_ns = turn_budget_answer_ns(rig, i),
        .stop_acc_q32 = axis->stop_acc_q32,
        .vel_max_q32 = axis->limit.vel_q32,
        .rated_torque_mnm = axis->rated_torque_mnm,
        .readings = axis->monitor.wanted,
    };

    rig_axis_turn(axis, &config.turns_num, &config.turns_den);
    return config;
}
