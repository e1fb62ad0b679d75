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

int64_t machine_trigger_lead_ns(const struct machine *machine)
{
    int64_t most_ns = 0;
    for (unsigned i = 0; i < machine->trigger_count; i++) {
        const int64_t lead_ns =
            machine->rig->line[machine->trigger[i].line].lead_ns;
        most_ns = lead_ns > most_ns ? lead_ns : most_ns;
    }
    return most_ns;
}

void machine_trigger_arm(struct machine *machine,
                         const struct plan_shots shots[], int64_t start_ns,
                         int64_t rate_q30)
{
    machine->running_up = true;
    motion_clock_warp_init(&machine->start, start_ns, 0, rate_q30);
    for (unsigned i = 0; i < machine->trigger_count; i++) {
        struct machine_trigger *self = &machine->trigger[i];
        trigger_arm(&self->trigger, shots[self->line].t_ns_q12,
                    shots[self->line].count);
    }
}

void machine_trigger_go(struct machine *machine)
{
    machine->running_up = false;
}

/* Where the path will be when what a pulse sets off comes about; -1: before the
 * start. */
static void machine_trigger_aim(struct machine *machine,
                                struct machine_trigger *self, int64_t now_ns)
{
    const int64_t lead_ns = machine->rig->line[self->line].lead_ns;
    if (!machine->running_up)
        controller_ahead(&machine->controller, lead_ns, &self->aim);
    else if (now_ns + lead_ns < machine->start.t0_ns)
        self->aim = (struct motion_clock_rate){ .s_ns_q12 = -1 };
    else
        motion_clock_warp_at(&machine->start, now_ns + lead_ns, &self->aim);
}

void machine_trigger_step(struct machine *machine, int64_t now_ns)
{
    for (unsigned i = 0; i < machine->trigger_count; i++) {
        struct machine_trigger *self = &machine->trigger[i];
        machine_trigger_aim(machine, self, now_ns);
        self->shot = trigger_step(&self->trigger, self->aim.s_ns_q12, now_ns);
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

void machine_trigger_disarm(struct machine *machine)
{
    machine->running_up = false;
    for (unsigned i = 0; i < machine->trigger_count; i++)
        trigger_disarm(&machine->trigger[i].trigger);
}

void machine_trigger_end(struct machine *machine)
{
    for (unsigned i = 0; i < machine->trigger_count; i++) {
        trigger_end(&machine->trigger[i].trigger);
        machine->trigger[i].shot = 0;
    }
}
