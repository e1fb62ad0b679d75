/* firmware/linux/service/follow.c - see follow.h. */
#include "firmware/linux/service/follow.h"

#include "firmware/linux/player/run_start.h"
#include "motion/core/err.h"

#define FOLLOW_EDGES 64 /* of before, that are left out */

int service_follow_arm(struct service_follow *follow, struct run_follow *clock,
                       struct machine *machine, int64_t now_ns)
{
    struct hal_gpio_event event;
    if (machine->controller.state != CONTROLLER_READY)
        return MOTION_E_STATE;
    for (unsigned i = 0; i < FOLLOW_EDGES && clock->gpio != NULL &&
                         hal_gpio_event(clock->gpio, &event) == 1;
         i++)
        ;
    follow->clock = clock;
    follow->since_ns = now_ns;
    follow->stops = machine->controller.stops;
    atomic_store(&follow->turn, SERVICE_FOLLOW_WAITS);
    return MOTION_OK;
}

static void follow_leave(struct service_follow *follow,
                         enum service_follow_turn turn)
{
    follow->clock = NULL;
    atomic_store(&follow->turn, (int)turn);
}

/* Whatever else was asked of the axes meanwhile ends the wait. */
static void follow_wait(struct service_follow *follow, struct machine *machine,
                        int64_t now_ns)
{
    const struct controller *controller = &machine->controller;
    const int64_t due_ns = run_follow_due_ns(
        follow->clock, now_ns, follow->since_ns, machine->rig->period_ns);
    if (controller->state != CONTROLLER_READY ||
        controller->stops != follow->stops ||
        homing_is_running(&machine->homing))
        follow_leave(follow, SERVICE_FOLLOW_OVER);
    else if (due_ns < follow->since_ns)
        follow_leave(follow, SERVICE_FOLLOW_MISSED);
    else if (due_ns <= now_ns &&
             playback_begin(&machine->playback, 0, PLAYBACK_PLAY) < 0)
        follow_leave(follow, SERVICE_FOLLOW_OVER);
    else if (due_ns <= now_ns)
        atomic_store(&follow->turn, SERVICE_FOLLOW_PLAYS);
}

void service_follow_step(struct service_follow *follow, struct machine *machine,
                         int64_t now_ns)
{
    if (follow->clock == NULL)
        return;
    run_follow_tick(follow->clock);
    if (service_follow_waits(follow))
        follow_wait(follow, machine, now_ns);
    else if (machine->playback.state == PLAYBACK_IDLE)
        follow_leave(follow, SERVICE_FOLLOW_OVER);
}
