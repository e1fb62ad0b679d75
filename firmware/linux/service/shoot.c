/* firmware/linux/service/shoot.c - see shoot.h. */
#include "firmware/linux/service/shoot.h"

#include "firmware/linux/machine/machine_trigger.h"
#include "motion/core/err.h"

void service_shoot_drop(struct service_shoot *shoot, struct machine *machine)
{
    if (shoot->is_armed)
        machine_trigger_disarm(machine);
    *shoot = (struct service_shoot){ .is_armed = false };
}

/* The move, in READY at its start. */
static int shoot_play(struct service_shoot *shoot, struct machine *machine)
{
    const int err = playback_begin(&machine->playback, 0, PLAYBACK_PLAY);
    shoot->is_due = false;
    if (err < 0)
        service_shoot_drop(shoot, machine);
    else if (!playback_is_arming(&machine->playback))
        machine_trigger_go(machine);
    return err;
}

int service_shoot_arm(struct service_shoot *shoot, struct machine *machine,
                      const struct plan_shots shots[])
{
    const struct controller *controller = &machine->controller;
    const int64_t period_ns = machine->rig->period_ns;
    const int64_t ticks =
        (machine_trigger_lead_ns(machine) + period_ns - 1) / period_ns;

    if (controller->state != CONTROLLER_READY)
        return MOTION_E_STATE;
    *shoot = (struct service_shoot){
        .is_armed = true,
        .is_due = true,
        .start_ns = controller->now_ns + ticks * period_ns,
        .stops = controller->stops,
    };
    machine_trigger_arm(machine, shots, shoot->start_ns,
                        controller->override_q30);
    return ticks > 0 ? MOTION_OK : shoot_play(shoot, machine);
}

void service_shoot_begin(struct service_shoot *shoot, struct machine *machine)
{
    const struct controller *controller = &machine->controller;

    if (!shoot->is_armed)
        return;
    const bool stands = controller->state == CONTROLLER_READY &&
                        controller->stops == shoot->stops &&
                        !homing_is_running(&machine->homing);
    const bool is_other = shoot->is_due
                              ? !stands
                              : machine->playback.state == PLAYBACK_IDLE &&
                                    controller->state != CONTROLLER_READY;
    if (is_other)
        service_shoot_drop(shoot, machine);
    else if (shoot->is_due && controller->now_ns >= shoot->start_ns)
        (void)shoot_play(shoot, machine);
}

/* Its last pulses come after its end where the line is slower; after a stop the
 * rest is not fired. */
void service_shoot_step(struct service_shoot *shoot, struct machine *machine)
{
    const struct playback *playback = &machine->playback;

    if (!shoot->is_armed || shoot->is_due)
        return;
    if (machine->running_up && playback->state == PLAYBACK_PLAYING &&
        !playback_is_arming(playback))
        machine_trigger_go(machine);
    if (playback->state == PLAYBACK_IDLE &&
        (machine->controller.stops != shoot->stops ||
         machine_trigger_is_idle(machine)))
        service_shoot_drop(shoot, machine);
}
