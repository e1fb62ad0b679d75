/* firmware/control/arm_ramp.c - hold, resume and override of what drives sample by
 * themselves; see arm.h and ramp_scheduled.h.
 *
 *   wanted --the clock is steady, a ramp is found--> scheduled --its tick, all will-->
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

#define ARM_RAMP_NS INT64_C(10000000000) /* to find one, and to be steady */

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

void playback_ramp_begin(struct playback *playback)
{
    playback->ramp = (struct playback_ramp){
        .anchor_ns = playback->controller->clock_ns,
    };
}

int playback_ramp_ask(struct playback *playback, int64_t rate_q30)
{
    const struct controller *controller = playback->controller;
    if (!playback_ramps(playback) || (controller->state != CONTROLLER_MOVING &&
                                      controller->state != CONTROLLER_HOLDING))
        return MOTION_E_STATE;
    if (rate_q30 < 0 || rate_q30 > MOTION_CLOCK_WARP_MAX_Q30)
        return MOTION_E_ARG;
    if (rate_q30 > controller->override_max_q30)
        return MOTION_E_LIMIT;
    playback->ramp.is_wanted = true;
    playback->ramp.wanted_q30 = rate_q30;
    playback->ramp.wanted_ns = controller->now_ns;
    playback->ramp.ticks = playback->ramp.tried = 0;
    return MOTION_OK;
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

/* Looked for from the clock of the tick in which it is taken. */
static void arm_ramp_find(struct playback *playback)
{
    struct controller *controller = playback->controller;
    struct playback_ramp *own = &playback->ramp;
    const int64_t period_ns = controller->config.period_ns;
    int64_t lead_ns = playback_arm_lead_ns(playback);
    if (lead_ns < own->ticks * period_ns)
        lead_ns = own->ticks * period_ns;
    own->ramp.rate_q30 = own->wanted_q30;
    own->at_ns = controller->now_ns + lead_ns;
    own->begin_ns = controller->clock_ns + lead_ns;
    own->since_ns =
        controller->rate.rate_q30 == 0 ? -1 : own->begin_ns - own->anchor_ns;
    if (own->wanted_q30 == controller->warp.rate1_q30 ||
        arm_ramp_is_late(playback)) {
        own->is_wanted = false;
        return;
    }
    const int32_t ticks = controller_ramp_find(controller, own->begin_ns,
                                               &own->ramp, &own->tried);
    own->is_scheduled = ticks > 0 && ticks * period_ns <= lead_ns;
    if (own->is_scheduled)
        own->is_wanted = false;
    else if (ticks > own->ticks)
        own->ticks = ticks; /* from further ahead in the next tick */
}

static int arm_ramp_start(struct playback *playback)
{
    struct playback_ramp *own = &playback->ramp;
    own->is_scheduled = false;
    if (own->since_ns < 0)
        own->anchor_ns = own->begin_ns;
    return controller_ramp_begin(playback->controller);
}

int playback_ramp_step(struct playback *playback)
{
    const struct controller *controller = playback->controller;
    struct playback_ramp *own = &playback->ramp;
    if (!own->is_scheduled && own->is_wanted &&
        controller_is_steady(controller))
        arm_ramp_find(playback);
    if (!own->is_scheduled)
        return own->is_wanted &&
                       controller->now_ns - own->wanted_ns > ARM_RAMP_NS
                   ? MOTION_E_TIMEOUT
                   : MOTION_OK;
    const int err = arm_ramp_tell(playback);
    if (err == MOTION_E_AGAIN)
        return controller->clock_ns < own->begin_ns ? MOTION_OK
                                                    : MOTION_E_TIMEOUT;
    return err == MOTION_OK && controller->clock_ns >= own->begin_ns
               ? arm_ramp_start(playback)
               : err;
}
