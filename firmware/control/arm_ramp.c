/* firmware/control/arm_ramp.c - hold, resume and override of what drives sample by
 * themselves; see arm.h and ramp_scheduled.h.
 *
 *   wanted, and not there --steady, a ramp is found--> scheduled --its tick, all will-->
 *
 * Wanted is a state, not a request: 0 while the operator holds, else the override.
 *
 * All are told one ramp and when it begins, far enough ahead for the slowest of
 * them; in that tick the controller's own clock begins it, if all have said that
 * theirs will.  When one has not, the motion is stopped.  On the PC a tick that
 * is lost delays the path's time, on a drive it does not: what is counted from
 * where all were in step is the path's clock.  From rest they are in step anew. */
#include <stddef.h>

#include "firmware/control/arm.h"
#include "firmware/control/parts.h"
#include "motion/core/err.h"

#define ARM_RAMP_NS                                                            \
    INT64_C(10000000000) /* to a hold: to find one, and be steady */
/* Of what a hold takes at most as a rule. */
#define ARM_RAMP_LONG 4

static const struct hal_drive_tracks *
arm_ramp_tracks(const struct playback *playback, unsigned index)
{
    return playback->axis[index].is_armed
               ? playback->controller->axis[index].drive->ops->tracks
               : NULL;
}

bool playback_ramps(const struct playback *playback)
{
    for (unsigned i = 0; i < playback->controller->config.axis_count; i++) {
        const struct hal_drive_tracks *tracks = arm_ramp_tracks(playback, i);
        if (tracks != NULL && tracks->ramp == NULL)
            return false;
    }
    return true;
}

int64_t playback_rate_q30(const struct playback *playback)
{
    const struct controller *controller = playback->controller;
    return controller->override_q30 < controller->override_max_q30
               ? controller->override_q30
               : controller->override_max_q30;
}

void playback_ramp_begin(struct playback *playback)
{
    playback->ramp = (struct playback_ramp){
        .rate_q30 = playback->ramp.rate_q30,
        .anchor_ns = playback->controller->clock_ns,
    };
}

void playback_ramp_ask(struct playback *playback)
{
    playback->ramp.ticks = playback->ramp.tried = 0;
}

/* MOTION_E_AGAIN: not all have said that they will. */
static int arm_ramp_tell(const struct playback *playback)
{
    const struct playback_ramp *own = &playback->ramp;
    const struct hal_drive_ramp ramp = {
        .rate_q30 = own->ramp.rate_q30,
        .tick_ns = own->ramp.tick_ns,
        .change = own->ramp.change,
        .flat = own->ramp.flat,
        .at_ns = own->at_ns,
        .since_ns = own->since_ns,
    };
    int worst = MOTION_OK;
    for (unsigned i = 0; i < playback->controller->config.axis_count; i++) {
        const struct hal_drive_tracks *tracks = arm_ramp_tracks(playback, i);
        const int err =
            tracks == NULL
                ? MOTION_OK
                : tracks->ramp(playback->controller->axis[i].drive, &ramp);
        if (err < 0 && err != MOTION_E_AGAIN)
            return err;
        if (err < 0)
            worst = err;
    }
    return worst;
}

static int64_t arm_ramp_wanted_q30(const struct playback *playback)
{
    return playback->ramp.holds ? 0 : playback_rate_q30(playback);
}

/* It would begin after the end. */
static bool arm_ramp_is_late(const struct playback *playback)
{
    const struct controller *controller = playback->controller;
    struct motion_clock_rate then;
    motion_clock_warp_at(
        &controller->warp,
        playback->ramp.begin_ns + 2 * controller->config.period_ns, &then);
    return then.s_ns_q12 >= controller->move_end_ns_q12;
}

/* A hold that is as good as none: where the path is now it leaves nothing better, a
 * little later it mostly does. */
static bool arm_ramp_is_long(const struct controller *controller,
                             const struct controller_ramp *ramp)
{
    return ramp->rate_q30 == 0 &&
           (2 * ramp->change + ramp->flat) * ramp->tick_ns >
               ARM_RAMP_LONG * controller_step_bound_ns(controller, false);
}

/* Looked for from the clock of the tick in which it is taken. */
static void arm_ramp_find(struct playback *playback)
{
    struct controller *controller = playback->controller;
    struct playback_ramp *own = &playback->ramp;
    const int64_t period_ns = controller->config.period_ns;
    int64_t lead_ns = playback_arm_lead_ns(playback);
    if (lead_ns < own->ticks * period_ns)
        lead_ns = own->ticks * period_ns;
    own->ramp.rate_q30 = arm_ramp_wanted_q30(playback);
    own->at_ns = controller->now_ns + lead_ns;
    own->begin_ns = controller->clock_ns + lead_ns;
    own->since_ns =
        controller->rate.rate_q30 == 0 ? -1 : own->begin_ns - own->anchor_ns;
    if (own->ramp.rate_q30 == controller->warp.rate1_q30 ||
        arm_ramp_is_late(playback))
        return;
    const int32_t ticks = controller_ramp_find(controller, own->begin_ns,
                                               &own->ramp, &own->tried);
    own->is_scheduled = ticks > 0 && ticks * period_ns <= lead_ns &&
                        !arm_ramp_is_long(controller, &own->ramp);
    if (ticks > own->ticks)
        own->ticks = ticks; /* from further ahead in the next tick */
}

/* What has been asked for since it was found comes next. */
static int arm_ramp_start(struct playback *playback)
{
    struct controller *controller = playback->controller;
    struct playback_ramp *own = &playback->ramp;
    const int64_t override_q30 = controller->override_q30;
    own->is_scheduled = false;
    if (own->since_ns < 0)
        own->anchor_ns = own->begin_ns;
    const int err = controller_ramp_begin(controller);
    controller->override_q30 = override_q30;
    playback_ramp_ask(playback);
    return err;
}

/* A hold that does not come is a stop. */
static bool arm_ramp_is_over(const struct playback *playback)
{
    const struct controller *controller = playback->controller;
    return playback->ramp.holds && controller->state == CONTROLLER_MOVING &&
           controller->now_ns - playback->ramp.holds_ns > ARM_RAMP_NS;
}

int playback_ramp_step(struct playback *playback)
{
    const struct controller *controller = playback->controller;
    struct playback_ramp *own = &playback->ramp;
    if (!own->is_scheduled && controller_is_steady(controller))
        arm_ramp_find(playback);
    if (!own->is_scheduled)
        return arm_ramp_is_over(playback) ? MOTION_E_TIMEOUT : MOTION_OK;
    const int err = arm_ramp_tell(playback);
    if (err == MOTION_E_AGAIN)
        return controller->clock_ns < own->begin_ns ? MOTION_OK
                                                    : MOTION_E_TIMEOUT;
    return err == MOTION_OK && controller->clock_ns >= own->begin_ns
               ? arm_ramp_start(playback)
               : err;
}
