/* firmware/control/arm.c - see arm.h.
 *
 *   UNARMED --cued--> LOADING --all have it--> WAITING --it is time--> RUNNING
 *      ^                 |                        |                       |
 *      |                 '-- stop, fault, not all would begin --> PARTED  |
 *      '------------------------ all at rest ---------------------'-------'
 *
 * All are told one time, far enough ahead for the slowest of them, and it is a
 * tick's: there the controller's own clock begins, if all have said that theirs
 * will.  A stop tells all of them in its tick (controller.c). */
#include "firmware/control/arm.h"

#include <stddef.h>

#include "firmware/control/parts.h"
#include "firmware/control/ramp_step.h"
#include "motion/core/err.h"

#define ARM_MOST_NS INT64_C(120000000000) /* to load */
#define ARM_END_NS  INT64_C(10000000000)
#define ARM_LATE_NS INT64_C(5000000) /* our own clock, after ticks lost */
/* Beyond what a drive has for coming to rest, and for saying so. */
#define ARM_REST_NS INT64_C(1000000000)

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

/* Twice what the limits of all axes make of it, from the fastest that they may go, and
 * what it takes to tell it, and to hear that it is done. */
static int64_t arm_rest_ns(const struct playback *playback)
{
    const struct controller *controller = playback->controller;
    const struct controller_ramp *ramp = &playback->ramp.ramp;
    int64_t rate_q30 = playback->ramp.rate_q30;
    int64_t lead_ns = 0;

    if (controller->override_q30 > rate_q30)
        rate_q30 = playback_rate_q30(playback);
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (playback_samples(playback, i)) {
            const int64_t own_ns =
                arm_tracks(playback, i)->lead_ns(controller->axis[i].drive);
            lead_ns = own_ns > lead_ns ? own_ns : lead_ns;
        }
    return 2 * (controller_step_rest_ticks(controller, rate_q30, false) *
                    controller->config.period_ns +
                (2 * ramp->change + ramp->flat) * ramp->tick_ns + lead_ns) +
           ARM_REST_NS;
}

/* All have been told, but where the controller stands already. */
static void arm_part(struct playback *playback)
{
    for (unsigned i = 0; i < playback->controller->config.axis_count; i++)
        if (playback_samples(playback, i))
            arm_tracks(playback, i)->stop(playback->controller->axis[i].drive);
    playback->arm = PLAYBACK_PARTED;
    playback->rest_ns = playback->controller->now_ns + arm_rest_ns(playback);
}

static void arm_fail(struct playback *playback, int err)
{
    arm_part(playback);
    controller_halt(playback->controller);
    playback->err = err;
    playback->state = PLAYBACK_IDLE;
}

/* Until all stand: each watches itself, and this is for one that is told and does not
 * do it. */
static void arm_parted(struct playback *playback)
{
    struct controller *controller = playback->controller;
    const int64_t late_ns = controller->now_ns - playback->rest_ns;

    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (playback_samples(playback, i) && controller->axis[i].by_profile) {
            if (late_ns > 0)
                controller_raise(controller, CONTROLLER_FAULT_REST, (int)i,
                                 late_ns, 0);
            return;
        }
    playback->arm = PLAYBACK_UNARMED;
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
    const int64_t rate_q30 = playback_rate_q30(playback);

    if (rate_q30 <= 0)
        return MOTION_E_LIMIT;
    playback->ramp = (struct playback_ramp){ .rate_q30 = rate_q30 };
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

/* At the rate that all were told, whatever has been asked for since. */
static int arm_waiting(struct playback *playback)
{
    struct controller *controller = playback->controller;
    const int64_t late_ns = controller->now_ns - playback->start_ns;
    const int64_t override_q30 = controller->override_q30;
    int err;

    if (late_ns < 0)
        return MOTION_OK;
    if (late_ns > ARM_LATE_NS || !arm_all(playback, HAL_DRIVE_TRACK_WAITING))
        return MOTION_E_TIMEOUT;
    playback->arm = PLAYBACK_RUNNING;
    playback_ramp_begin(playback);
    controller->override_q30 = playback->ramp.rate_q30;
    err = controller_resume(controller);
    controller->override_q30 = override_q30;
    return err;
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

/* Neither stopped nor left, nor in fault. */
static bool arm_goes_on(const struct playback *playback)
{
    const struct controller *controller = playback->controller;

    return controller->stops == playback->stops &&
           (controller->state == CONTROLLER_HOLDING ||
            (playback->arm == PLAYBACK_RUNNING &&
             (controller->state == CONTROLLER_MOVING ||
              controller->state == CONTROLLER_READY)));
}

bool playback_arm_step(struct playback *playback)
{
    int err = MOTION_OK;

    if (playback->arm == PLAYBACK_PARTED)
        arm_parted(playback);
    else if (playback->arm != PLAYBACK_UNARMED && !arm_goes_on(playback))
        arm_part(playback);
    if (playback->arm == PLAYBACK_UNARMED || playback->arm == PLAYBACK_PARTED)
        return false;
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

/* Is what is played, or about to be, sampled by drives too? */
static bool arm_is_on(const struct playback *playback)
{
    return playback_is_arming(playback) ||
           (playback->arm == PLAYBACK_RUNNING &&
            controller_in_motion(playback->controller));
}

int playback_hold(struct playback *playback)
{
    struct playback_ramp *ramp = &playback->ramp;

    if (!arm_is_on(playback))
        return controller_hold(playback->controller);
    if (playback->arm != PLAYBACK_RUNNING || !playback_ramps(playback)) {
        controller_stop(playback->controller);
        return MOTION_OK;
    }
    if (playback->controller->state != CONTROLLER_MOVING)
        return MOTION_E_STATE;
    if (!ramp->holds)
        ramp->holds_ns = playback->controller->now_ns;
    ramp->holds = true;
    playback_ramp_ask(playback);
    return MOTION_OK;
}

/* Held where it begins, it begins. */
int playback_resume(struct playback *playback)
{
    const struct controller *controller = playback->controller;

    if (!playback_any_samples(playback))
        return controller_resume(playback->controller);
    if (playback->arm == PLAYBACK_RUNNING && playback->ramp.holds &&
        controller->state != CONTROLLER_STOPPING) {
        playback->ramp.holds = false;
        playback_ramp_ask(playback);
        return MOTION_OK;
    }
    if ((playback->arm != PLAYBACK_UNARMED &&
         playback->arm != PLAYBACK_PARTED) ||
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
    struct controller *controller = playback->controller;

    if (!arm_is_on(playback))
        return controller_override(controller, rate_q30);
    if (rate_q30 < 0 || rate_q30 > MOTION_CLOCK_WARP_MAX_Q30)
        return MOTION_E_ARG;
    if (rate_q30 == 0 || !playback_ramps(playback))
        return MOTION_E_STATE;
    if (rate_q30 > controller->override_max_q30)
        return MOTION_E_LIMIT;
    controller->override_q30 = rate_q30;
    playback_ramp_ask(playback);
    return MOTION_OK;
}
