/* firmware/linux/machine/machine_sim_switch.c - simulated switches: pressed
 * where their axis stands, or again and again, to start a move. */
#include "firmware/linux/machine/kind.h"
#include "motion/core/fixed.h"
#include "sim/util.h"

#define SWITCH_LOOK_NS  INT64_C(250000)
#define SWITCH_PULSE_NS INT64_C(100000000)

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

static bool machine_sim_switch_is_pressed(const struct machine_sim *sim,
                                          const struct rig_line *line,
                                          int64_t now_ns)
{
    if (line->kind == RIG_LINE_START)
        return now_ns % line->sim_every_ns < SWITCH_PULSE_NS;
    if (line->kind == RIG_LINE_FRAME)
        return now_ns % line->sim_every_ns < line->sim_every_ns / 2;
    const int64_t pos_q32 = machine_sim_pos_q32(sim, (unsigned)line->axis) +
                            sim->zero_q32[line->axis];
    return pos_q32 >= line->sim_low_q32 && pos_q32 <= line->sim_high_q32;
}

static bool machine_sim_switch_is_simulated(const struct rig_line *line)
{
    return line->has_sim || line->sim_every_ns > 0;
}

static enum sim_gpio_level machine_sim_level(const struct machine_sim *sim,
                                             unsigned i)
{
    return sim->pressed[i] != sim->rig->line[i].active_low ? SIM_GPIO_HIGH
                                                           : SIM_GPIO_LOW;
}

static void machine_sim_switch_look(struct machine_sim *sim, unsigned i,
                                    int64_t now_ns)
{
    const struct rig_line *line = &sim->rig->line[i];
    const bool before = sim->pressed[i];
    sim->pressed[i] = machine_sim_switch_is_pressed(sim, line, now_ns);
    if (sim->pressed[i] != before && !sim->stuck[i])
        sim_gpio_drive(&sim->line[i], machine_sim_level(sim, i));
}

void machine_sim_stick(struct machine_sim *sim, unsigned i,
                       enum sim_gpio_level level)
{
    sim->stuck[i] = true;
    sim_gpio_drive(&sim->line[i], level);
}

void machine_sim_let_go(struct machine_sim *sim, unsigned i)
{
    sim->stuck[i] = false;
    sim_gpio_drive(&sim->line[i], machine_sim_level(sim, i));
}

static void machine_sim_switch_run(struct sim_member *member, int64_t now_ns)
{
    struct machine_sim *sim =
        CONTAINER_OF(member, struct machine_sim, switches);
    for (unsigned i = 0; i < sim->rig->line_count; i++)
        if (machine_sim_switch_is_simulated(&sim->rig->line[i]))
            machine_sim_switch_look(sim, i, now_ns);
    sim->switches_due_ns = now_ns + SWITCH_LOOK_NS;
}

static const struct sim_member_ops machine_sim_switch_ops = {
    .due_ns = machine_sim_switch_due_ns,
    .run = machine_sim_switch_run,
};

int machine_sim_switches(struct machine_sim *sim)
{
    bool any = false;
    for (unsigned i = 0; i < sim->rig->line_count; i++) {
        const struct rig_line *line = &sim->rig->line[i];
        any |= machine_sim_switch_is_simulated(line);
        if (line->kind == RIG_LINE_START ||
            line->kind == RIG_LINE_FRAME) /* released, not open */
            sim_gpio_drive(&sim->line[i],
                           line->active_low ? SIM_GPIO_HIGH : SIM_GPIO_LOW);
    }
    sim->switches.ops = &machine_sim_switch_ops;
    sim->switches_due_ns = sim->world.now_ns + SWITCH_LOOK_NS;
    return any ? sim_world_add(&sim->world, &sim->switches) : MOTION_OK;
}
