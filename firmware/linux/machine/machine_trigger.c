/* firmware/linux/machine/machine_trigger.c - see machine_trigger.h. */
#include "firmware/linux/machine/machine_trigger.h"

int machine_trigger_init(struct machine *machine)
{
    const struct rig *rig = machine->rig;
    for (unsigned i = 0; i < rig->line_count; i++) {
        const struct rig_line *line = &rig->line[i];
        const struct trigger_config config = { line->width_ns, line->rest_ns };
        struct machine_trigger *self =
            &machine->trigger[machine->trigger_count];
        if (line->kind != RIG_LINE_TRIGGER)
            continue;
        int err = trigger_init(&self->trigger, machine->ports.line[i], &config);
        if (err < 0)
            return err;
        self->line = i;
        machine->trigger_count++;
    }
    return MOTION_OK;
}

void machine_trigger_arm(struct machine *machine,
                         const struct plan_shots shots[])
{
    for (unsigned i = 0; i < machine->trigger_count; i++) {
        struct machine_trigger *self = &machine->trigger[i];
        trigger_arm(&self->trigger, shots[self->line].t_ns_q12,
                    shots[self->line].count);
    }
}

void machine_trigger_step(struct machine *machine, int64_t now_ns)
{
    const int64_t s_ns_q12 = machine->controller.rate.s_ns_q12;
    for (unsigned i = 0; i < machine->trigger_count; i++) {
        struct machine_trigger *self = &machine->trigger[i];
        self->shot = trigger_step(&self->trigger, s_ns_q12, now_ns);
        if (self->shot > 0)
            self->shot_ns = hal_clock_now_ns(machine->ports.clock);
    }
}

bool machine_trigger_is_idle(const struct machine *machine)
{
    for (unsigned i = 0; i < machine->trigger_count; i++)
        if (!trigger_is_idle(&machine->trigger[i].trigger,
                             machine->controller.rate.s_ns_q12))
            return false;
    return true;
}

void machine_trigger_end(struct machine *machine)
{
    for (unsigned i = 0; i < machine->trigger_count; i++) {
        trigger_end(&machine->trigger[i].trigger);
        machine->trigger[i].shot = 0;
    }
}
