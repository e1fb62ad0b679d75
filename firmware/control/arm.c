/* firmware/control/arm.c - see arm.h.
 *
 *   UNARMED --cued--> LOADING --all have it--> WAITING --it is time--> RUNNING
 *      ^                 |                        |                       |
 *      '---- stop, fault, time over, not all would begin --- all at rest -'
 *
 * All are told one time, far enough ahead for the slowest of them, and it is a
 * tick's: there the controller's own clock begins, if all have said that theirs
 * will. */
#include "firmware/control/arm.h"

#include <stddef.h>

#include "firmware/control/parts.h"
#include "motion/core/err.h"

#define ARM_MOST_NS INT64_C(120000000000) /* to load */
#define ARM_END_NS  INT64_C(10000000000)
#define ARM_LATE_NS INT64_C(5000000) /* our own clock, after ticks lost */

static const struct hal_drive_tracks *
arm_tracks(const struct playback *playback, unsigned index)
{
    return playback->controller->axis[index].drive->ops->tracks;
}

bool playback_samples(const struct playback *playback, unsigned index)
{
    return arm_tracks(playback, index) != NULL;
}

/* Moved by what is played, by its own samples. */
static bool arm_is_in_it(const struct playback *playback, unsigned index)
{
    return playback->controller->axis[index].track != NULL &&
           playback_samples(playback, index);
}

bool playback_any_samples(const struct playback *playback)
{
    for (unsigned i = 0; i < playback->controller->config.axis_count; i++)
        if (arm_is_in_it(playback, i))
            return true;
    return false;
}

bool playback_is_arming(const struct playback *playback)
{
    return playback->arm == PLAYBACK_LOADING ||
           playback->arm == PLAYBACK_WAITING;
}

static void arm_begin(struct playback *playback)
{
    for (unsigned i = 0; i < playback->controller->config.axis_count; i++)
        playback->axis[i].is_armed = false;
    playback->arm = PLAYBACK_LOADING;
    playback->arm_ns = playback->controller->now_ns;
}

int playback_arm_start(struct playback *playback,
                       const struct motion_track *const track[])
{
    bool any = false;

    for (unsigned i = 0; i < playback->controller->config.axis_count; i++)
        any = any || (track[i] != NULL && playback_samples(playback, i));
    if (!any)
        return controller_start(playback->controller, track, NULL);
    const int err = controller_cue(playback->controller, track, 0, NULL);
    if (err == MOTION_OK)
        arm_begin(playback);
    return err;
}

static void arm_drop(struct playback *playback)
{
    for (unsigned i = 0; i < playback->controller->config.axis_count; i++)
        if (playback_samples(playback, i))
            arm_tracks(playback, i)->stop(playback->controller->axis[i].drive);
    playback->arm = PLAYBACK_UNARMED;
}

static void arm_fail(struct playback *playback, int err)
{
    arm_drop(playback);
    controller_halt(playback->controller);
    playback->err = err;
    playback->state = PLAYBACK_IDLE;
}

/* A drive that still ends what it did before takes it a little later. */
static int arm_load(struct playback *playback)
{
    for (unsigned i = 0; i < playback->controller->config.axis_count; i++) {
        struct controller_axis *axis = &playback->controller->axis[i];
        int err;

        if (!arm_is_in_it(playback, i) || playback->axis[i].is_armed)
            continue;
        err = arm_tracks(playback, i)->load(axis->drive, axis->track);
        if (err < 0 && err != MOTION_E_STATE)
            return err;
        playback->axis[i].is_armed = err == MOTION_OK;
    }
    return MOTION_OK;
}

static bool arm_all(const struct playback *playback, enum hal_drive_track state)
{
    for (unsigned i = 0; i < playback->controller->config.axis_count; i++)
        if (arm_is_in_it(playback, i) &&
            (!playback->axis[i].is_armed ||
             arm_tracks(playback, i)
                     ->state(playback->controller->axis[i].drive) < state))
            return false;
    return true;
}

int64_t playback_arm_lead_ns(const struct playback *playback)
{
    int64_t most_ns = playback->controller->config.period_ns;

    for (unsigned i = 0; i < playback->controller->config.axis_count; i++)
        if (arm_is_in_it(playback, i)) {
            const int64_t lead_ns =
                arm_tracks(playback, i)
                    ->lead_ns(playback->controller->axis[i].drive);
            most_ns = lead_ns > most_ns ? lead_ns : most_ns;
        }
    return most_ns;
}

static int arm_tell(struct playback *playback)
{
    const struct controller *controller = playback->controller;
    const int64_t rate_q30 =
        controller->override_q30 < controller->override_max_q30
            ? controller->override_q30
            : controller->override_max_q30;

    if (rate_q30 <= 0)
        return MOTION_E_LIMIT;
    playback->start_ns = controller->now_ns + playback_arm_lead_ns(playback);
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        const int err = !arm_is_in_it(playback, i)
                            ? MOTION_OK
                            : arm_tracks(playback, i)
                                  ->start(controller->axis[i].drive,
                                          playback->start_ns, rate_q30);
        if (err < 0)
            return err;
    }
    playback->arm = PLAYBACK_WAITING;
    return MOTION_OK;
}

static int arm_loading(struct playback *playback)
{
    const int err = arm_load(playback);

    if (err < 0)
        return err;
    if (arm_all(playback, HAL_DRIVE_TRACK_LOADED))
        return arm_tell(playback);
    return playback->controller->now_ns - playback->arm_ns > ARM_MOST_NS
               ? MOTION_E_TIMEOUT
               : MOTION_OK;
}

static int arm_waiting(struct playback *playback)
{
    struct controller *controller = playback->controller;
    const int64_t late_ns = controller->now_ns - playback->start_ns;

    if (late_ns < 0)
        return MOTION_OK;
    if (late_ns > ARM_LATE_NS || !arm_all(playback, HAL_DRIVE_TRACK_WAITING))
        return MOTION_E_TIMEOUT;
    playback->arm = PLAYBACK_RUNNING;
    playback_ramp_begin(playback);
    return controller_resume(controller);
}

/* The controller's own clock has come to the end; theirs may be a little
 * behind. */
static int arm_ending(struct playback *playback)
{
    const struct controller *controller = playback->controller;

    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (playback->axis[i].is_armed &&
            arm_tracks(playback, i)->state(controller->axis[i].drive) ==
                HAL_DRIVE_TRACK_PLAYING)
            return controller->now_ns - controller->since_ns > ARM_END_NS
                       ? MOTION_E_TIMEOUT
                       : MOTION_OK;
    playback->arm = PLAYBACK_UNARMED;
    return MOTION_OK;
}

/* Neither stopped nor in fault. */
static bool arm_goes_on(const struct playback *playback)
{
    const struct controller *controller = playback->controller;

    return controller->stops == playback->stops &&
           (controller->state == CONTROLLER_MOVING ||
            controller->state == CONTROLLER_READY ||
            controller->state == CONTROLLER_HOLDING);
}

bool playback_arm_step(struct playback *playback)
{
    int err = MOTION_OK;

    if (playback->arm == PLAYBACK_UNARMED)
        return false;
    if (!arm_goes_on(playback)) {
        arm_drop(playback);
        return false;
    }
    if (playback->arm == PLAYBACK_LOADING)
        err = arm_loading(playback);
    else if (playback->arm == PLAYBACK_WAITING)
        err = arm_waiting(playback);
    else if (playback->controller->state == CONTROLLER_READY)
        err = arm_ending(playback);
    else
        err = playback_ramp_step(playback);
    if (err < 0)
        arm_fail(playback, err);
    return playback_is_arming(playback) ||
           (playback->arm == PLAYBACK_RUNNING &&
            playback->controller->state == CONTROLLER_READY);
}

/* --- what an operator may do with it --- */

int playback_hold(struct playback *playback)
{
    if (!playback_is_arming(playback) &&
        !(controller_in_motion(playback->controller) &&
          playback_any_samples(playback)))
        return controller_hold(playback->controller);
    if (playback->arm == PLAYBACK_RUNNING && playback_ramps(playback))
        return playback_ramp_ask(playback, 0);
    controller_stop(playback->controller);
    return MOTION_OK;
}

/* Held where it begins, it begins. */
int playback_resume(struct playback *playback)
{
    const struct controller *controller = playback->controller;

    if (!playback_any_samples(playback))
        return controller_resume(playback->controller);
    if (controller->state == CONTROLLER_HOLDING &&
        playback->arm == PLAYBACK_RUNNING)
        return playback_ramp_ask(playback, controller->override_q30 <
                                                   controller->override_max_q30
                                               ? controller->override_q30
                                               : controller->override_max_q30);
    if (playback->arm != PLAYBACK_UNARMED ||
        controller->state != CONTROLLER_HOLDING ||
        controller->rate.s_ns_q12 != 0 || !controller_clock_stands(controller))
        return MOTION_E_STATE;
    arm_begin(playback);
    return MOTION_OK;
}

int playback_couple(struct playback *playback, unsigned axis,
                    struct controller_cam *cam)
{
    const unsigned count = playback->controller->config.axis_count;

    if ((axis < count && playback_samples(playback, axis)) ||
        (cam->master < count && playback_samples(playback, cam->master)))
        return MOTION_E_ARG;
    return controller_couple(playback->controller, axis, cam);
}

int playback_override(struct playback *playback, int64_t rate_q30)
{
    const struct controller *controller = playback->controller;

    const bool stands = controller->state == CONTROLLER_HOLDING &&
                        controller_clock_stands(controller);

    if (controller_in_motion(controller) && controller->jog == NULL &&
        !stands && playback_any_samples(playback))
        return playback->arm == PLAYBACK_RUNNING && rate_q30 > 0
                   ? playback_ramp_ask(playback, rate_q30)
                   : MOTION_E_STATE;
    return controller_override(playback->controller, rate_q30);
}
