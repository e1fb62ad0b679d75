/* firmware/control/jog.c - see jog.h. */
#include "firmware/control/jog.h"

#include <stddef.h>

#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

static struct motion_otg_limit jog_limit(const struct motion_clock_limit *limit,
                                         int64_t vel_q32)
{
    const int64_t vel = vel_q32 < limit->vel_q32 ? vel_q32 : limit->vel_q32;
    return (struct motion_otg_limit){
        .vel_max_q32 = vel,
        .vel_min_q32 = -vel,
        .acc_max_q32 = limit->acc_q32,
        .acc_min_q32 = -limit->acc_q32,
        .jerk_q32 = limit->jerk_q32,
    };
}

/* Where the axis was sent last, as exactly as is known of what is played. */
static struct motion_state jog_start(const struct controller *controller,
                                     unsigned axis)
{
    const struct motion_track *track = controller->axis[axis].track;
    const struct hal_drive_target *target = &controller->axis[axis].target;
    struct motion_state state = { .pos_q32 = target->pos_q32,
                                  .vel_q32 = target->vel_q32,
                                  .acc_q32 = target->acc_q32 };
    if (track != NULL) {
        struct motion_state path;
        motion_track_state(track, controller->rate.s_ns_q12, &path);
        motion_clock_warp_chain(&controller->rate, &path, &state);
        state.pos_q32 = target->pos_q32;
    }
    return state;
}

/* Set points are the jog's own plan at the path's time; else the clock is on a
 * ramp, or held. */
static bool jog_is_on_plan(const struct controller *controller,
                           const struct controller_jog *jog)
{
    return controller->jog == jog &&
           controller->rate.rate_q30 == MOTION_CLOCK_WARP_ONE_Q30 &&
           controller->rate.accel_q30 == 0 &&
           controller->warp.rate1_q30 == MOTION_CLOCK_WARP_ONE_Q30;
}

static void jog_give_goal(struct controller *controller,
                          struct controller_jog *jog,
                          const struct controller_jog_goal *goal)
{
    const struct controller_axis_config *config =
        &controller->config.axis[goal->axis];
    struct controller_goal *own = &jog->goal[jog->which];
    const struct motion_track *track = &jog->track[jog->which];
    if (!config->by_goals)
        return;
    *own = (struct controller_goal){
        .end_ns_q12 = track->end_ns_q12,
        .pos_q32 = track->end.pos_q32,
        .vel_q32 = jog_limit(&config->limit, goal->vel_q32).vel_max_q32,
        .acc_q32 = config->limit.acc_q32,
    };
    struct controller_axis *axis = &controller->axis[goal->axis];
    const bool is_on = controller_goal_is_running(&axis->leg);
    controller_goal_set(axis, own, track->count > 0 || is_on ? 1 : 0);
}

static void jog_stop(struct controller *controller, bool hard);

/* The spare trajectory becomes the one that is played, from path time 0. */
static int jog_play(struct controller *controller, struct controller_jog *jog,
                    unsigned index)
{
    const unsigned next = 1 - jog->which;
    struct motion_track *track = &jog->track[next];
    struct controller_axis *axis = &controller->axis[index];
    int err = motion_otg_track(&jog->trajectory[next], jog->storage[next],
                               MOTION_OTG_PHASES, track);
    if (err < 0)
        return err;
    if (!controller_admit(controller, index, track, 0))
        return MOTION_E_LIMIT;
    err = controller_coupled_follow(controller, index, track);
    if (err == MOTION_OK)
        err = controller_gantry_follow(controller, index, track);
    if (err < 0)
        return err;
    if (controller->state == CONTROLLER_READY)
        controller_goal_forget(controller); /* of a move that did not begin */
    jog->brake = jog_stop;
    jog->which = next;
    jog->axis = index;
    controller_axis_play(axis, track);
    controller->move_end_ns_q12 = track->end_ns_q12;
    controller->override_max_q30 = MOTION_CLOCK_WARP_ONE_Q30;
    controller->reserve_ns_q12 = 0;
    controller->jog = jog;
    controller_play(controller, MOTION_CLOCK_WARP_ONE_Q30);
    controller_step_load(controller);
    return MOTION_OK;
}

static bool jog_may_start(const struct controller *controller,
                          const struct controller_jog *jog, unsigned axis)
{
    if (controller->axis[axis].by_profile || controller->axis[axis].cam != NULL)
        return false;
    return controller->state == CONTROLLER_READY ||
           (controller->state == CONTROLLER_MOVING && controller->jog == jog &&
            jog->axis == axis);
}

/* Plan into the spare trajectory: from the plan that is played, to which
 * nothing is lost by rounding, or from the set point.  1: the old plan is as
 * good. */
static int jog_plan(const struct controller *controller,
                    struct controller_jog *jog, unsigned index,
                    struct motion_otg_move *move)
{
    struct motion_otg_trajectory *next = &jog->trajectory[1 - jog->which];
    enum motion_otg_field field = MOTION_OTG_FIELD_NONE;
    if (!jog_is_on_plan(controller, jog)) {
        move->start = jog_start(controller, index);
        return motion_otg_begin(move, next, &field);
    }
    switch (motion_otg_replan(&jog->trajectory[jog->which],
                              controller->rate.s_ns_q12, move, next, &field)) {
    case MOTION_OTG_NEW:
        return MOTION_OK;
    case MOTION_OTG_KEPT:
        return field == MOTION_OTG_FIELD_NONE ? 1 : MOTION_E_RANGE;
    default:
        return MOTION_E_RANGE;
    }
}

int controller_jog_run(struct controller *controller,
                       struct controller_jog *jog,
                       const struct controller_jog_goal *goal)
{
    if (goal->axis >= controller->config.axis_count || goal->vel_q32 <= 0)
        return MOTION_E_ARG;
    if (!jog_may_start(controller, jog, goal->axis))
        return MOTION_E_STATE;
    const struct motion_clock_limit most =
        controller_limit(controller, goal->axis, false);
    struct motion_otg_move move = {
        .goal = { .pos_q32 = controller_coupled_place(controller, goal->axis,
                                                      goal->pos_q32) },
        .limit = jog_limit(&most, goal->vel_q32),
    };
    int err = jog_plan(controller, jog, goal->axis, &move);
    if (err == MOTION_OK)
        err = jog_play(controller, jog, goal->axis);
    if (err < 0)
        return err;
    if (err == MOTION_OK)
        jog_give_goal(controller, jog, goal);
    jog->until_ns = goal->until_ns;
    return MOTION_OK;
}

int controller_jog(struct controller *controller, struct controller_jog *jog,
                   const struct controller_jog_goal *goal)
{
    if (goal->axis < controller->config.axis_count &&
        controller->axis[goal->axis].drive->ops->tracks != NULL)
        return MOTION_E_ARG; /* it would have to be planned anew on its way */
    return controller->homing ? MOTION_E_STATE
                              : controller_jog_run(controller, jog, goal);
}

/* The plan that is played, also where a hold had been asked for and the clock
 * has not slowed down yet. */
static void jog_go_on(struct controller *controller)
{
    controller->wanted_q30 = MOTION_CLOCK_WARP_ONE_Q30;
    controller_enter(controller, CONTROLLER_MOVING);
}

/* A motion of its own to rest: sooner there than by a ramp of the clock.
 * MOTION_E_LIMIT: it would leave the range, or end later than what is under
 * way. */
static int jog_brake(struct controller *controller, bool hard)
{
    struct controller_jog *jog = controller->jog;
    const struct controller_axis_config *config =
        &controller->config.axis[jog->axis];
    struct motion_otg_trajectory *next = &jog->trajectory[1 - jog->which];
    const struct motion_clock_limit most =
        controller_limit(controller, jog->axis, hard);
    const struct motion_otg_move stop = {
        .start = jog_start(controller, jog->axis),
        .limit = jog_limit(&most, config->limit.vel_q32),
        .mode = MOTION_OTG_VELOCITY,
    };
    int err =
        jog_is_on_plan(controller, jog)
            ? motion_otg_stop_from(&jog->trajectory[jog->which],
                                   controller->rate.s_ns_q12, &stop.limit, next)
            : motion_otg_begin(&stop, next, NULL);
    if (err == MOTION_OTG_KEPT)
        jog_go_on(controller);
    else if (err >= 0 && controller->clock_ns +
                                 next->plan.dur_ns_q12 / MOTION_FIXED_NS_Q12 >
                             controller_due_ns(controller))
        err = MOTION_E_LIMIT;
    else if (err >= 0)
        err = jog_play(controller, jog, jog->axis);
    if (err >= 0)
        controller->axis[jog->axis].leg.stops = true;
    return err;
}

/* The track ends at rest, so it is its own bound. */
static void jog_brake_hard(struct controller *controller)
{
    controller_enter(controller, CONTROLLER_STOPPING);
    controller->is_brake = true;
    controller->rest_by_ns =
        controller->clock_ns +
        (controller->move_end_ns_q12 - controller->rate.s_ns_q12) /
            MOTION_FIXED_NS_Q12 +
        2 * controller->config.period_ns;
}

/* See controller_jog_stop; after a fault the same, unless the drives brake. */
static void jog_stop(struct controller *controller, bool hard)
{
    const bool is_stopping = controller->state == CONTROLLER_STOPPING;
    controller->jog->until_ns = 0;
    if (controller->reaction >= CONTROLLER_REACT_QUICK || controller->is_brake)
        return;
    hard = hard || is_stopping;
    int err = jog_brake(controller, hard);
    if (err < 0 && !hard)
        err = jog_brake(controller, hard = true);
    if (err < 0 && !is_stopping)
        controller_slow_down(controller, CONTROLLER_STOPPING);
    else if (err >= 0 && hard)
        jog_brake_hard(controller);
}

void controller_jog_stop(struct controller *controller,
                         struct controller_jog *jog, bool hard)
{
    controller->stops++;
    if (controller->jog == jog && jog != NULL)
        jog_stop(controller, hard);
    else
        controller_halt(controller);
}

void controller_jog_step(struct controller *controller,
                         struct controller_jog *jog)
{
    const bool is_over =
        jog->until_ns != 0 && controller->now_ns >= jog->until_ns;
    if (is_over)
        jog->until_ns = 0;
    if (controller->jog == jog &&
        (is_over || controller->state == CONTROLLER_STOPPING))
        jog_stop(controller, !is_over);
}
