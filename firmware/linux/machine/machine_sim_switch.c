/* firmware/linux/machine/machine_sim_switch.c - simulated switches: pressed
 * where their axis stands. */
#include "firmware/linux/machine/kind.h"
#include "motion/core/fixed.h"
#include "sim/util.h"

#define SWITCH_LOOK_NS INT64_C(250000)

int64_t machine_sim_pos_q32(const struct machine_sim *sim, unsigned i)
{
    const struct rig_axis *axis = &sim->rig->axis[i];
    int64_t pos_q32;
    if (motion_fixed_muldiv(machine_kinds[axis->kind]->sim_counts_q24(sim, i),
                            axis->counts_den << 8, axis->counts_num,
                            &pos_q32) < 0)
        return 0;
    return pos_q32;
}

static int64_t machine_sim_switch_due_ns(const struct sim_member *member)
{
    return CONTAINER_OF(member, const struct machine_sim, switches)
        ->switches_due_ns;
}

static void machine_sim_switch_look(struct machine_sim *sim, unsigned i)
{
    const struct rig_line *line = &sim->rig->line[i];
    const int64_t pos_q32 = machine_sim_pos_q32(sim, (unsigned)line->axis) +
                            sim->zero_q32[line->axis];
    const bool pressed =
        pos_q32 >= line->sim_low_q32 && pos_q32 <= line->sim_high_q32;
    const enum sim_gpio_level level =
        pressed != line->active_low ? SIM_GPIO_HIGH : SIM_GPIO_LOW;
    if (sim->pressed[i] != pressed)
        sim_gpio_drive(&sim->line[i], level);
    sim->pressed[i] = pressed;
}

static void machine_sim_switch_run(struct sim_member *member, int64_t now_ns)
{
    struct machine_sim *sim =
        CONTAINER_OF(member, struct machine_sim, switches);
    for (unsigned i = 0; i < sim->rig->line_count; i++)
        if (sim->rig->line[i].has_sim)
            machine_sim_switch_look(sim, i);
    sim->switches_due_ns = now_ns + SWITCH_LOOK_NS;
}

static const struct sim_member_ops machine_sim_switch_ops = {
    .due_ns = machine_sim_switch_due_ns,
    .run = machine_sim_switch_run,
};

int machine_sim_switches(struct machine_sim *sim)
{
    bool any = false;
    for (unsigned i = 0; i < sim->rig->line_count; i++)
        any |= sim->rig->line[i].has_sim;
    sim->switches.ops = &machine_sim_switch_ops;
    sim->switches_due_ns = sim->world.now_ns + SWITCH_LOOK_NS;
    return any ? sim_world_add(&sim->world, &sim->switches) : MOTION_OK;
}
