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

/* The clock runs at full rate, and only this axis has a track, of a jog. */
static bool jog_is_playing(const struct controller *controller,
                           const struct controller_jog *jog)
{
    return controller->state == CONTROLLER_MOVING &&
           controller->axis[jog->axis].track == &jog->track[jog->which] &&
           controller->rate.rate_q30 == MOTION_CLOCK_WARP_ONE_Q30 &&
           controller->warp.rate1_q30 == MOTION_CLOCK_WARP_ONE_Q30;
}

/* From outside it may come in. */
static bool jog_in_range(const struct controller *controller, unsigned axis,
                         const struct motion_track *track)
{
    const struct controller_axis_config *config =
        &controller->config.axis[axis];
    struct motion_extreme pos;
    if (!controller_range_counts(controller, axis))
        return true;
    motion_track_extreme(track, MOTION_POS, &pos);
    const int64_t from_q32 = controller->axis[axis].target.pos_q32;
    return (pos.min >= config->pos_min_q32 || pos.min >= from_q32) &&
           (pos.max <= config->pos_max_q32 || pos.max <= from_q32);
}

/* A curve that ends on the border may round to beyond it on its way: goals on
 * the border itself are 2^-28 inside. */
#define JOG_BORDER_Q32 ((int64_t)16)
static int64_t jog_goal_q32(const struct controller *controller,
                            const struct controller_jog_goal *goal)
{
    const struct controller_axis_config *config =
        &controller->config.axis[goal->axis];
    const int64_t low_q32 = config->pos_min_q32 + JOG_BORDER_Q32;
    const int64_t high_q32 = config->pos_max_q32 - JOG_BORDER_Q32;
    if (!controller_range_counts(controller, goal->axis) || low_q32 > high_q32)
        return goal->pos_q32;
    if (goal->pos_q32 < low_q32 && goal->pos_q32 >= config->pos_min_q32)
        return low_q32;
    return goal->pos_q32 > high_q32 && goal->pos_q32 <= config->pos_max_q32
               ? high_q32
               : goal->pos_q32;
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
    if (!jog_in_range(controller, index, track))
        return MOTION_E_LIMIT;
    jog->which = next;
    jog->axis = index;
    axis->track = track;
    axis->cursor = (struct motion_cursor){ 0 };
    axis->vel_peak_q32 = controller_peak(track, MOTION_VEL);
    controller->move_end_ns_q12 = track->end_ns_q12;
    controller->override_max_q30 = MOTION_CLOCK_WARP_ONE_Q30;
    controller->reserve_ns_q12 = 0;
    controller->wanted_q30 = MOTION_CLOCK_WARP_ONE_Q30;
    controller->rate.s_ns_q12 = 0;
    motion_clock_warp_init(&controller->warp, controller->clock_ns, 0,
                           MOTION_CLOCK_WARP_ONE_Q30);
    controller_enter(controller, CONTROLLER_MOVING);
    return MOTION_OK;
}

int controller_jog(struct controller *controller, struct controller_jog *jog,
                   const struct controller_jog_goal *goal)
{
    struct motion_otg_plan plan;
    if (goal->axis >= controller->config.axis_count || goal->vel_q32 <= 0)
        return MOTION_E_ARG;
    if (controller->state != CONTROLLER_READY &&
        !(jog_is_playing(controller, jog) && jog->axis == goal->axis))
        return MOTION_E_STATE;
    if (controller->axis[goal->axis].by_itself)
        return MOTION_E_STATE;
    const struct motion_otg_move move = {
        .start = jog_start(controller, goal->axis),
        .goal = { .pos_q32 = jog_goal_q32(controller, goal) },
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

int controller_jog_stop(struct controller *controller,
                        struct controller_jog *jog, bool hard)
{
    const struct controller_axis_config *config =
        &controller->config.axis[jog->axis];
    struct motion_otg_plan plan;
    if (controller->state == CONTROLLER_READY)
        return MOTION_OK;
    if (!jog_is_playing(controller, jog))
        return MOTION_E_STATE;
    const struct motion_state start = jog_start(controller, jog->axis);
    const struct motion_otg_limit limit =
        jog_limit(hard ? &config->stop : &config->limit, config->limit.vel_q32);
    int err = motion_otg_stop(&start, &limit, &plan);
    jog->until_ns = 0;
    if (err == MOTION_OK)
        err = jog_play(controller, jog, jog->axis, &plan);
    if (err == MOTION_OK)
        controller->axis[jog->axis].leg.stops = true;
    return err;
}

void controller_jog_step(struct controller *controller,
                         struct controller_jog *jog)
{
    if (jog->until_ns == 0 || controller->now_ns < jog->until_ns)
        return;
    jog->until_ns = 0;
    if (jog_is_playing(controller, jog))
        (void)controller_jog_stop(controller, jog, false);
}
