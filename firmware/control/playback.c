/* firmware/control/playback.c - see playback.h. */
#include "firmware/control/playback.h"

#include <stddef.h>

#include "firmware/control/arm.h"
#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/ease.h"

#define PLAYBACK_SLOW 4 /* the approach's share of the limits: 1/4 */

void playback_init(struct playback *playback, struct controller *controller,
                   struct controller_jog *jog, struct playback_axis axis[])
{
    *playback = (struct playback){
        .controller = controller, .jog = jog, .axis = axis, .times = 1
    };
}

void playback_unload(struct playback *playback)
{
    playback->is_loaded = false;
    playback->state = PLAYBACK_IDLE;
}

static bool playback_can_repeat(const struct playback *playback, int64_t times,
                                bool is_ping_pong)
{
    const struct controller *controller = playback->controller;
    for (unsigned i = 0; times != 1 && i < controller->config.axis_count; i++) {
        const struct motion_track *track = playback->axis[i].track;
        if (track != NULL &&
            (track->outline != NULL ||
             (is_ping_pong && (controller->config.axis[i].by_goals ||
                               playback_samples(playback, i)))))
            return false;
    }
    return true;
}

int playback_load(struct playback *playback,
                  const struct motion_track *const track[])
{
    const struct controller *controller = playback->controller;
    playback->err_axis = -1;
    if (playback->axis == NULL)
        return MOTION_E_ARG;
    if (controller_in_motion(controller))
        return MOTION_E_STATE;
    playback_unload(playback);
    playback->end_ns_q12 = 0;
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        struct playback_axis *axis = &playback->axis[i];
        axis->track = track[i];
        axis->goal = NULL;
        axis->goal_count = 0;
        if (track[i] != NULL && track[i]->end_ns_q12 > playback->end_ns_q12)
            playback->end_ns_q12 = track[i]->end_ns_q12;
    }
    playback->is_loaded = true;
    if (!playback_can_repeat(playback, playback->times,
                             playback->is_ping_pong)) {
        playback->times = 1;
        playback->is_ping_pong = false;
    }
    return MOTION_OK;
}

void playback_set_goals(struct playback *playback, unsigned index,
                        const struct controller_goal goal[], unsigned count)
{
    playback->axis[index].goal = goal;
    playback->axis[index].goal_count = count;
}

/* --- going to a place of the move --- */

static int64_t playback_place_q32(const struct motion_track *track,
                                  int64_t at_ns_q12)
{
    struct motion_cursor cursor = { 0 };
    struct motion_sample sample;
    motion_track_sample(track, &cursor, at_ns_q12, &sample);
    return sample.pos_q32;
}

/* At so much of a speed, num / den <= 1: its acceleration at the square, its jerk
 * at the cube. */
static int64_t playback_share(int64_t value, int64_t num, int64_t den,
                              int power)
{
    for (int i = 0; i < power; i++)
        if (motion_fixed_muldiv(value, num, den, &value) < 0)
            return 1;
    return value > 0 ? value : 1;
}

/* From rest to rest in den / num of the shortest time; an ease of a quarter of
 * the limits is slower by what that takes, not by four. */
static int playback_plan(struct playback *playback, unsigned index, int64_t num,
                         int64_t den)
{
    const struct controller_axis *from = &playback->controller->axis[index];
    const struct motion_clock_limit most =
        controller_limit(playback->controller, index, false);
    struct playback_axis *axis = &playback->axis[index];
    const struct motion_ease_limit slow = {
        .vel_q32 = playback_share(most.vel_q32 / PLAYBACK_SLOW, num, den, 1),
        .acc_q32 = playback_share(most.acc_q32 / PLAYBACK_SLOW, num, den, 2),
        .jerk_q32 =
            most.jerk_q32 == 0
                ? 0
                : playback_share(most.jerk_q32 / PLAYBACK_SLOW, num, den, 3),
    };
    motion_track_init(&axis->approach, axis->storage, PLAYBACK_SEGMENTS,
                      from->target.pos_q32);
    return motion_ease_append_limited(
        &axis->approach, playback_place_q32(axis->track, playback->at_ns_q12),
        &slow);
}

/* All axes of the move, each in the time of the longest.  Negative: an error. */
static int64_t playback_plan_all(struct playback *playback)
{
    const unsigned count = playback->controller->config.axis_count;
    int64_t dur_ns_q12 = 0;
    int err = MOTION_OK;
    for (unsigned i = 0; i < count && err == MOTION_OK; i++) {
        playback->axis[i].approach.count = 0;
        if (playback->axis[i].track == NULL ||
            playback->controller->axis[i].cam != NULL) /* it is taken along */
            continue;
        playback->err_axis = (int)i;
        err = playback_plan(playback, i, 1, 1);
        if (playback->axis[i].approach.end_ns_q12 > dur_ns_q12)
            dur_ns_q12 = playback->axis[i].approach.end_ns_q12;
    }
    for (unsigned i = 0; i < count && err == MOTION_OK; i++) {
        const struct motion_track *own = &playback->axis[i].approach;
        playback->err_axis = (int)i;
        if (own->count > 0 && own->end_ns_q12 < dur_ns_q12)
            err = playback_plan(playback, i, own->end_ns_q12, dur_ns_q12);
    }
    if (err < 0)
        return err;
    playback->err_axis = -1;
    return dur_ns_q12;
}

/* One motion, from rest to rest. */
static void playback_give_goal(struct playback *playback, unsigned index)
{
    struct playback_axis *axis = &playback->axis[index];
    if (playback->controller->config.axis[index].by_goals &&
        controller_goals_of(&axis->approach, &axis->approach_goal, 1) > 0)
        (void)controller_set_goals(playback->controller, index,
                                   &axis->approach_goal, 1);
}

/* Nothing goes to a place outside its range, also not from further out. */
static bool playback_is_inside(const struct playback *playback, unsigned index)
{
    const struct controller_axis_config *config =
        &playback->controller->config.axis[index];
    const int64_t place_q32 = playback->axis[index].approach.end.pos_q32;
    return !controller_range_counts(playback->controller, index) ||
           (place_q32 >= config->pos_min_q32 - MOTION_TRACK_POS_ROUNDING &&
            place_q32 <= config->pos_max_q32 + MOTION_TRACK_POS_ROUNDING);
}

static int playback_arrive(struct playback *playback);

static int playback_approach(struct playback *playback)
{
    const struct motion_track *track[CONTROLLER_AXES_MAX] = { NULL };
    const int64_t dur_ns_q12 = playback_plan_all(playback);
    if (dur_ns_q12 < 0)
        return (int)dur_ns_q12;
    if (dur_ns_q12 == 0)
        return playback_arrive(playback);
    for (unsigned i = 0; i < playback->controller->config.axis_count; i++) {
        if (playback->axis[i].approach.count == 0)
            continue;
        if (!playback_is_inside(playback, i)) {
            playback->err_axis = (int)i;
            return MOTION_E_LIMIT;
        }
        track[i] = &playback->axis[i].approach;
        playback_give_goal(playback, i);
    }
    return playback_arm_start(playback, track);
}

/* --- playing it --- */

static void playback_give_goals(struct playback *playback)
{
    for (unsigned i = 0; i < playback->controller->config.axis_count; i++) {
        const struct playback_axis *axis = &playback->axis[i];
        if (axis->goal != NULL)
            (void)controller_set_goals(playback->controller, i, axis->goal,
                                       axis->goal_count);
    }
}

/* Held where it stands, or on from there. */
static int playback_cue(struct playback *playback, bool is_reversed)
{
    const struct motion_track *track[CONTROLLER_AXES_MAX];
    for (unsigned i = 0; i < playback->controller->config.axis_count; i++)
        track[i] = playback->axis[i].track;
    playback_give_goals(playback);
    int err = controller_cue(playback->controller, track, playback->at_ns_q12,
                             &playback->err_axis);
    if (err < 0)
        return err;
    playback->state = PLAYBACK_PLAYING;
    if (is_reversed)
        err = controller_reverse(playback->controller, true);
    if (err == MOTION_OK && playback->then == PLAYBACK_PLAY)
        err = playback_resume(playback);
    if (err < 0)
        controller_halt(playback->controller);
    return err;
}

static int playback_arrive(struct playback *playback)
{
    playback->state = PLAYBACK_IDLE;
    return playback->then == PLAYBACK_STAND ? MOTION_OK
                                            : playback_cue(playback, false);
}

static bool playback_is_held(const struct controller *controller)
{
    return controller->state == CONTROLLER_HOLDING &&
           controller_clock_stands(controller) &&
           !controller_goals_are_running(controller);
}

static bool playback_has(const struct playback *playback, int64_t at_ns_q12)
{
    for (unsigned i = 0; i < playback->controller->config.axis_count; i++) {
        const struct motion_track *track = playback->axis[i].track;
        if (track != NULL && at_ns_q12 != 0 &&
            (track->outline != NULL || playback_samples(playback, i)))
            return false;
    }
    return at_ns_q12 >= 0 && at_ns_q12 <= playback->end_ns_q12;
}

static int playback_aim(struct playback *playback, int64_t at_ns_q12,
                        enum playback_then then)
{
    playback->err_axis = -1;
    if (!playback->is_loaded)
        return MOTION_E_EMPTY;
    if (!playback_has(playback, at_ns_q12))
        return MOTION_E_ARG;
    /* those that are a tick behind come to their end by themselves */
    if (playback->arm == PLAYBACK_RUNNING &&
        playback->controller->state == CONTROLLER_READY)
        playback->arm = PLAYBACK_UNARMED;
    playback->at_ns_q12 = at_ns_q12;
    playback->then = then;
    playback->stops = playback->controller->stops;
    playback->played = 0;
    playback->err = MOTION_OK;
    return MOTION_OK;
}

int playback_go(struct playback *playback, int64_t at_ns_q12,
                enum playback_then then)
{
    struct controller *controller = playback->controller;
    const bool leaves = playback_is_held(controller) &&
                        controller->jog == NULL && !controller->homing;
    if (!leaves &&
        (controller->state != CONTROLLER_READY || controller->homing))
        return MOTION_E_STATE;
    int err = playback_aim(playback, at_ns_q12, then);
    if (err < 0)
        return err;
    playback->state = PLAYBACK_GOING;
    playback->leaves = leaves;
    if (leaves)
        controller_halt(controller);
    else
        err = playback_approach(playback);
    if (err < 0)
        playback->state = PLAYBACK_IDLE;
    return err;
}

int playback_begin(struct playback *playback, int64_t at_ns_q12,
                   enum playback_then then)
{
    if (playback->controller->state != CONTROLLER_READY)
        return MOTION_E_STATE;
    const int err = playback_aim(playback, at_ns_q12, then);
    return err < 0 ? err : playback_cue(playback, false);
}

int playback_reverse(struct playback *playback, bool is_reversed)
{
    return playback->state == PLAYBACK_PLAYING &&
                   !playback_any_samples(playback)
               ? controller_reverse(playback->controller, is_reversed)
               : MOTION_E_STATE;
}

/* --- again --- */

int playback_repeat(struct playback *playback, int64_t times, bool is_ping_pong)
{
    if (times < 0 || (playback->is_loaded &&
                      !playback_can_repeat(playback, times, is_ping_pong)))
        return MOTION_E_ARG;
    playback->times = times;
    playback->is_ping_pong = is_ping_pong;
    return MOTION_OK;
}

/* The next time begins where this one has ended, or the axes go there first. */
static int playback_again(struct playback *playback)
{
    playback->then = PLAYBACK_PLAY;
    if (playback->is_ping_pong) {
        /* where its clock has come to */
        const bool is_reversed =
            playback->controller->rate.s_ns_q12 > playback->end_ns_q12 / 2;
        playback->at_ns_q12 = is_reversed ? playback->end_ns_q12 : 0;
        return playback_cue(playback, is_reversed);
    }
    playback->at_ns_q12 = 0;
    playback->state = PLAYBACK_GOING;
    playback->leaves = false;
    return playback_approach(playback);
}

static int playback_over(struct playback *playback)
{
    playback->played++;
    playback->state = PLAYBACK_IDLE;
    if (playback->times != 0 && playback->played >= playback->times)
        return MOTION_OK;
    return playback_again(playback);
}

static int playback_ready(struct playback *playback)
{
    const bool leaves = playback->leaves;
    playback->leaves = false;
    if (playback->state == PLAYBACK_PLAYING)
        return playback_over(playback);
    return leaves ? playback_approach(playback) : playback_arrive(playback);
}

void playback_step(struct playback *playback)
{
    const struct controller *controller = playback->controller;
    if (playback_arm_step(playback) || playback->state == PLAYBACK_IDLE)
        return;
    if (controller->stops != playback->stops ||
        controller->state == CONTROLLER_OFF ||
        controller->state == CONTROLLER_FAULT) {
        playback->state = PLAYBACK_IDLE;
        return;
    }
    /* what was left has set points again a tick later */
    if (controller->state != CONTROLLER_READY ||
        (playback->leaves && controller->since_ns == controller->now_ns))
        return;
    playback->err = playback_ready(playback);
    if (playback->err < 0)
        playback->state = PLAYBACK_IDLE;
}

int playback_jog(struct playback *playback, unsigned axis, int64_t pos_q32,
                 int64_t vel_q32, int64_t for_ns)
{
    const struct controller_jog_goal goal = {
        .axis = axis,
        .pos_q32 = pos_q32,
        .vel_q32 = vel_q32,
        .until_ns = playback->controller->now_ns + for_ns,
    };
    if (playback->jog == NULL || for_ns < 1 || for_ns > PLAYBACK_JOG_MAX_NS)
        return MOTION_E_ARG;
    return controller_jog(playback->controller, playback->jog, &goal);
}

static bool playback_stands(const struct controller *controller)
{
    if (controller->homing || controller->enabling)
        return false;
    return controller->state == CONTROLLER_OFF ||
           controller->state == CONTROLLER_READY ||
           playback_is_held(controller);
}

int playback_capture(const struct playback *playback, int64_t pos_q32[],
                     int64_t *s_ns_q12)
{
    const struct controller *controller = playback->controller;
    if (!playback_stands(controller))
        return MOTION_E_STATE;
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (!controller->axis[i].homed)
            return MOTION_E_UNHOMED;
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        pos_q32[i] = controller->axis[i].target.pos_q32;
    *s_ns_q12 =
        playback->state == PLAYBACK_PLAYING ? controller->rate.s_ns_q12 : 0;
    return MOTION_OK;
}
