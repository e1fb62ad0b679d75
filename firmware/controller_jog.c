/* firmware/controller_jog.c - see controller_jog.h. */
#include "firmware/controller_jog.h"

#include <stddef.h>

#include "firmware/controller_parts.h"
#include "motion/err.h"
#include "motion/fixed.h"
#include "motion/otg_replan.h"

static struct motion_otg_limit jog_limit(const struct motion_clock_limit *limit,
                                         int64_t vel_q32)
{
    const int64_t vel = vel_q32 < limit->vel_q32 ? vel_q32 : limit->vel_q32;
    return (struct motion_otg_limit){
        .vel_max_q32 = vel,
        .vel_min_q32 = -vel,
        .acc_max_q16 = limit->acc_q16,
        .acc_min_q16 = -limit->acc_q16,
        .jerk_q16 = limit->jerk_q16,
    };
}

/* Where the motion goes on from: the set point that was sent last. */
static struct motion_state jog_start(const struct controller *controller,
                                     unsigned axis)
{
    const struct hal_drive_target *target = &controller->axis[axis].target;
    return (struct motion_state){
        .pos_q32 = target->pos_q32,
        .vel_q32 = target->vel_q32,
        .acc_q16 = target->acc_q16,
    };
}

/* The drive's profile takes no longer than the plan, which has the same limits
 * and is as long or, with a limit of jerk, longer. */
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
        .acc_q16 = config->limit.acc_q16,
    };
    controller_goal_set(&controller->axis[goal->axis], own,
                        track->count > 0 ? 1 : 0);
}

/* The spare track becomes the one that is played, from path time 0. */
static int jog_play(struct controller *controller, struct controller_jog *jog,
                    unsigned index, const struct motion_otg_plan *plan)
{
    const unsigned next = 1 - jog->which;
    struct motion_track *track = &jog->track[next];
    struct controller_axis *axis = &controller->axis[index];
    motion_track_init(track, jog->room[next], MOTION_OTG_PHASES,
                      plan->start_pos_q32);
    int err = motion_otg_append(plan, track);
    if (err < 0)
        return err;
    if (!controller_admit(controller, index, track))
        return MOTION_E_LIMIT;
    jog->which = next;
    jog->axis = index;
    axis->track = track;
    axis->cursor = (struct motion_cursor){ 0 };
    axis->vel_peak_q32 = controller_peak(track, MOTION_VEL);
    controller->move_end_ns_q12 = track->end_ns_q12;
    controller->override_max_q30 = MOTION_CLOCK_WARP_ONE_Q30;
    controller->reserve_ns_q12 = 0;
    controller->jog = jog;
    controller_play(controller, MOTION_CLOCK_WARP_ONE_Q30);
    return MOTION_OK;
}

static bool jog_may_start(const struct controller *controller,
                          const struct controller_jog *jog, unsigned axis)
{
    if (controller->axis[axis].by_itself)
        return false;
    return controller->state == CONTROLLER_READY ||
           (controller->state == CONTROLLER_MOVING && controller->jog == jog &&
            jog->axis == axis);
}

int controller_jog_run(struct controller *controller,
                       struct controller_jog *jog,
                       const struct controller_jog_goal *goal)
{
    struct motion_otg_plan plan;
    if (goal->axis >= controller->config.axis_count || goal->vel_q32 <= 0)
        return MOTION_E_ARG;
    if (!jog_may_start(controller, jog, goal->axis))
        return MOTION_E_STATE;
    const struct motion_otg_move move = {
        .start = jog_start(controller, goal->axis),
        .goal = { .pos_q32 = goal->pos_q32 },
        .limit = jog_limit(&controller->config.axis[goal->axis].limit,
                           goal->vel_q32),
    };
    int err = motion_otg_make(&move, &plan, NULL);
    if (err == MOTION_OK)
        err = jog_play(controller, jog, goal->axis, &plan);
    if (err < 0)
        return err;
    jog_give_goal(controller, jog, goal);
    jog->until_ns = goal->until_ns;
    return MOTION_OK;
}

int controller_jog(struct controller *controller, struct controller_jog *jog,
                   const struct controller_jog_goal *goal)
{
    return controller->homing ? MOTION_E_STATE
                              : controller_jog_run(controller, jog, goal);
}

/* A motion of its own to rest, from the set point that was sent last: sooner
 * there than by a ramp of the clock. */
static int jog_brake(struct controller *controller, bool hard)
{
    struct controller_jog *jog = controller->jog;
    const struct controller_axis_config *config =
        &controller->config.axis[jog->axis];
    const struct motion_state start = jog_start(controller, jog->axis);
    const struct motion_otg_limit limit =
        jog_limit(hard ? &config->stop : &config->limit, config->limit.vel_q32);
    struct motion_otg_plan plan;
    int err = motion_otg_stop(&start, &limit, &plan);
    if (err == MOTION_OK)
        err = jog_play(controller, jog, jog->axis, &plan);
    if (err == MOTION_OK)
        controller->axis[jog->axis].leg.stops = true;
    return err;
}

/* The track ends at rest, so it is its own bound. */
static void jog_brake_hard(struct controller *controller)
{
    controller_enter(controller, CONTROLLER_STOPPING);
    controller->is_brake = true;
    controller->rest_by_ns = controller->clock_ns +
                             controller->move_end_ns_q12 / MOTION_FIXED_NS_Q12 +
                             2 * controller->config.period_ns;
}

void controller_jog_brake(struct controller *controller, bool hard)
{
    const bool is_stopping = controller->state == CONTROLLER_STOPPING;
    controller->jog->until_ns = 0;
    if (controller->reaction != CONTROLLER_REACT_NONE || controller->is_brake ||
        (is_stopping && !hard))
        return;
    if (jog_brake(controller, hard) == MOTION_OK) {
        if (hard)
            jog_brake_hard(controller);
    } else if (!is_stopping) {
        controller_slow_down(controller, CONTROLLER_STOPPING);
    }
}

void controller_jog_stop(struct controller *controller,
                         struct controller_jog *jog, bool hard)
{
    controller->stops++;
    if (controller->jog == jog && jog != NULL)
        controller_jog_brake(controller, hard);
    else
        controller_halt(controller);
}

void controller_jog_step(struct controller *controller,
                         struct controller_jog *jog)
{
    if (jog->until_ns == 0 || controller->now_ns < jog->until_ns)
        return;
    jog->until_ns = 0;
    if (controller->jog == jog)
        controller_jog_brake(controller, false);
}
