/* firmware/control/goal.c - see goal.h. */
#include "firmware/control/goal.h"

#include <stddef.h>

#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

bool controller_goal_is_running(const struct controller_leg *leg)
{
    return leg->is_left || leg->state == CONTROLLER_LEG_RUNNING ||
           leg->state == CONTROLLER_LEG_HALTING;
}

bool controller_goals_are_running(const struct controller *controller)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (controller_goal_is_running(&controller->axis[i].leg))
            return true;
    return false;
}

bool controller_goals_reached(const struct controller *controller)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        const struct controller_leg *leg = &controller->axis[i].leg;
        if (leg->state != CONTROLLER_LEG_IDLE || leg->is_left ||
            (leg->at < leg->count && !leg->stops))
            return false;
    }
    return true;
}

/* The track is a prediction: a drive may have been at its goal sooner. */
void controller_goal_drop(struct controller_axis *axis)
{
    const struct controller_leg leg = axis->leg;
    const bool is_short = leg.at < leg.count;
    axis->leg = (struct controller_leg){ .goal = NULL };
    if (leg.count == 0 ||
        (!is_short && axis->target.pos_q32 == leg.goal[leg.count - 1].pos_q32))
        return;
    axis->target.pos_q32 =
        is_short ? axis->feedback.pos_q32 : leg.goal[leg.count - 1].pos_q32;
    axis->sent_count = 0;
}

void controller_goal_forget(struct controller *controller)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        controller->axis[i].leg = (struct controller_leg){ .goal = NULL };
}

/* --- sending --- */

static int64_t goal_between(int64_t value, int64_t low, int64_t high)
{
    if (value < low)
        value = low;
    return value > high ? high : value;
}

/* At the rate that the clock is to have: its ramps are short beside a motion.  The
 * drive also halts by dec, so that is no less than brings it to rest in a
 * second (v / 1 s), as far as the axis's limit goes: a calm motion, or a low
 * override, would take minutes to stop. */
static struct hal_drive_go goal_order(const struct controller *controller,
                                      unsigned index,
                                      const struct controller_goal *goal)
{
    const struct motion_clock_limit *limit =
        &controller->config.axis[index].limit;
    const int64_t rate_q30 = controller->wanted_q30;
    struct hal_drive_go go = { .pos_q32 = goal->pos_q32 };
    (void)motion_fixed_mulshift(goal->vel_q32, rate_q30, 30, &go.vel_q32);
    (void)motion_fixed_mulshift(goal->acc_q32, rate_q30, 30, &go.acc_q32);
    (void)motion_fixed_mulshift(go.acc_q32, rate_q30, 30, &go.acc_q32);
    go.vel_q32 = goal_between(go.vel_q32, 1, limit->vel_q32);
    go.acc_q32 = goal_between(go.acc_q32, 1, limit->acc_q32);
    go.dec_q32 = goal_between(go.vel_q32, go.acc_q32, limit->acc_q32);
    return go;
}

static int64_t goal_add(int64_t a, int64_t b)
{
    int64_t result;
    return motion_fixed_add(a, b, &result) < 0 ? INT64_MAX : result;
}

int64_t controller_goal_distance_ns_q12(const struct hal_drive_feedback *now,
                                        const struct hal_drive_go *go)
{
    const int64_t vel = go->vel_q32, acc = go->acc_q32;
    const int64_t speed = (int64_t)(motion_fixed_abs(now->vel_q32) & INT64_MAX);
    const int64_t turn = motion_fixed_muldiv_sat(speed, speed, acc) / 2;
    int64_t distance;
    if (motion_fixed_sub(go->pos_q32, now->pos_q32, &distance) < 0)
        return INT64_MAX;
    distance =
        goal_add((int64_t)(motion_fixed_abs(distance) & INT64_MAX), turn);
    return goal_add(
        motion_fixed_muldiv_sat(distance, MOTION_FIXED_S_Q12, vel),
        motion_fixed_muldiv_sat(goal_add(speed, vel), MOTION_FIXED_S_Q12, acc));
}

/* As long as its track has for it, or, for one that is elsewhere than its track
 * begins, as long as its own profile takes: a drive without a halt goes on
 * while the clock stands. */
static void goal_sent(struct controller_axis *axis,
                      const struct hal_drive_go *go, int64_t rate_q30)
{
    struct controller_leg *leg = &axis->leg;
    const struct controller_goal *goal = &leg->goal[leg->at];
    int64_t dur_ns_q12 = goal->end_ns_q12 - goal->start_ns_q12, own_ns_q12;
    if (motion_fixed_mulshift(
            controller_goal_distance_ns_q12(&axis->feedback, go), rate_q30, 30,
            &own_ns_q12) < 0)
        own_ns_q12 = INT64_MAX / 2;
    if (own_ns_q12 > dur_ns_q12)
        dur_ns_q12 = own_ns_q12;
    leg->state = CONTROLLER_LEG_RUNNING;
    leg->is_left = false;
    leg->left_ns_q12 = goal_add(dur_ns_q12, dur_ns_q12 >> 3);
    leg->rate_q30 = rate_q30;
    leg->late_ns = 0;
    axis->stands = false;
}

static void goal_raise(struct controller *controller, unsigned index)
{
    const struct controller_axis *axis = &controller->axis[index];
    int64_t off_q32 = 0;
    (void)motion_fixed_sub(axis->leg.goal[axis->leg.at].pos_q32,
                           axis->feedback.pos_q32, &off_q32);
    controller_raise(controller, CONTROLLER_FAULT_ARRIVAL, (int)index, off_q32,
                     controller->config.axis[index].following_floor_q32);
}

/* A tick more of what it may be late; a fault once that is over. */
static void goal_wait(struct controller *controller, unsigned index,
                      int64_t most_ns)
{
    struct controller_leg *leg = &controller->axis[index].leg;
    leg->late_ns += controller->config.period_ns;
    if (leg->late_ns > most_ns)
        goal_raise(controller, index);
}

/* Outside the range, and further out than where the axis can come to rest: it
 * was to come in as far as there, and has come further since, because it was
 * faster than its track, or was held. */
static bool goal_is_outward(const struct controller *controller, unsigned index,
                            const struct hal_drive_go *go)
{
    const struct controller_axis_config *config =
        &controller->config.axis[index];
    const struct hal_drive_feedback *now = &controller->axis[index].feedback;
    const bool is_below = go->pos_q32 < config->pos_min_q32;
    const int64_t speed = (int64_t)(motion_fixed_abs(now->vel_q32) & INT64_MAX);
    int64_t inward_q32;
    if (!controller_range_counts(controller, index) ||
        (!is_below && go->pos_q32 <= config->pos_max_q32) ||
        motion_fixed_sub(is_below ? go->pos_q32 : now->pos_q32,
                         is_below ? now->pos_q32 : go->pos_q32,
                         &inward_q32) < 0)
        return false;
    if (speed == 0 || is_below != (now->vel_q32 > 0))
        return inward_q32 < -MOTION_TRACK_POS_ROUNDING;
    /* 2 a d < v^2 */
    return inward_q32 < 0 ||
           motion_fixed_cmp_u128(
               motion_fixed_mul_u64(2 * (uint64_t)inward_q32,
                                    (uint64_t)go->dec_q32),
               motion_fixed_mul_u64((uint64_t)speed, (uint64_t)speed)) < 0;
}

/* It has been there; the last one ends the motion where that comes to rest. */
static void goal_pass(struct controller_leg *leg)
{
    leg->state = CONTROLLER_LEG_IDLE;
    if (leg->at + 1 < leg->count)
        leg->at++;
    else
        leg->stops = true;
}

static void goal_send(struct controller *controller, unsigned index)
{
    struct controller_axis *axis = &controller->axis[index];
    struct controller_leg *leg = &axis->leg;
    const struct hal_drive_go go =
        goal_order(controller, index, &leg->goal[leg->at]);
    int err = MOTION_E_STATE;
    if (goal_is_outward(controller, index, &go)) {
        goal_pass(leg);
        return;
    }
    if (axis->feedback.mode == HAL_DRIVE_PROFILE_POSITION)
        err = controller_go_to_drive(axis, &go);
    else
        (void)hal_drive_set_mode(axis->drive, HAL_DRIVE_PROFILE_POSITION);
    if (err == MOTION_OK) {
        goal_sent(axis, &go, controller->wanted_q30);
    } else if (err == MOTION_E_STATE) {
        leg->state = CONTROLLER_LEG_REQUESTED;
        goal_wait(controller, index, controller->config.axis[index].late_ns);
    } else {
        controller_raise(controller,
                         err == MOTION_E_RANGE ? CONTROLLER_FAULT_COUNTER
                                               : CONTROLLER_FAULT_GATE,
                         (int)index, go.pos_q32, 0);
    }
}

/* --- watching --- */

/* The clock is to stand, or the motion to end. */
static bool goal_is_to_stand(const struct controller *controller,
                             const struct controller_leg *leg)
{
    return controller->wanted_q30 == 0 || leg->stops;
}

static bool goal_is_there(const struct controller *controller, unsigned index)
{
    const struct controller_axis *axis = &controller->axis[index];
    int64_t off_q32;
    return axis->feedback.arrived &&
           motion_fixed_sub(axis->leg.goal[axis->leg.at].pos_q32,
                            axis->feedback.pos_q32, &off_q32) == MOTION_OK &&
           motion_fixed_abs(off_q32) <=
               (uint64_t)controller->config.axis[index].following_floor_q32;
}

/* A drive says MOTION_OK to the mode that it is in when it stands. */
static bool goal_stands(const struct controller *controller, unsigned index)
{
    return hal_drive_set_mode(controller->axis[index].drive,
                              HAL_DRIVE_PROFILE_POSITION) == MOTION_OK;
}

/* A hold lets a drive that has no halt run on to its goal; a stop does not. */
static bool goal_halt(struct controller *controller, unsigned index)
{
    struct controller_leg *leg = &controller->axis[index].leg;
    const int err = hal_drive_halt(controller->axis[index].drive);
    const bool stops = leg->stops || controller->state == CONTROLLER_STOPPING;
    if (err == MOTION_OK) {
        leg->late_ns = 0;
        leg->state = CONTROLLER_LEG_HALTING;
        leg->is_left = false;
    } else if (err == MOTION_E_STATE && goal_stands(controller, index)) {
        leg->state = CONTROLLER_LEG_IDLE; /* short of its goal */
        leg->is_left = false;
    } else if (err == MOTION_E_EMPTY && stops) {
        controller_raise(controller, CONTROLLER_FAULT_REST, (int)index, 0, 0);
    } else {
        return false;
    }
    return true;
}

static void goal_idle(struct controller *controller, unsigned index)
{
    const struct controller_leg *leg = &controller->axis[index].leg;
    if (goal_is_to_stand(controller, leg)) {
        if (leg->is_left)
            (void)goal_halt(controller, index);
    } else if (leg->at < leg->count &&
               controller->rate.s_ns_q12 >= leg->goal[leg->at].start_ns_q12) {
        goal_send(controller, index);
    }
}

static void goal_requested(struct controller *controller, unsigned index)
{
    struct controller_leg *leg = &controller->axis[index].leg;
    if (goal_is_to_stand(controller, leg)) {
        leg->state = CONTROLLER_LEG_IDLE;
        goal_idle(controller, index);
    } else {
        goal_send(controller, index);
    }
}

static void goal_running(struct controller *controller, unsigned index)
{
    struct controller_axis *axis = &controller->axis[index];
    struct controller_leg *leg = &axis->leg;
    int64_t step_ns_q12 = controller->config.period_ns * MOTION_FIXED_NS_Q12;
    if (goal_is_there(controller, index)) {
        axis->stands = true;
        axis->stands_q32 = leg->goal[leg->at].pos_q32;
        leg->at++;
        leg->late_ns = 0;
        leg->state = CONTROLLER_LEG_IDLE;
        goal_idle(controller, index);
        return;
    }
    if (goal_is_to_stand(controller, leg) && goal_halt(controller, index))
        return;
    if (leg->left_ns_q12 <= 0) {
        goal_wait(controller, index, controller->config.axis[index].late_ns);
        return;
    }
    (void)motion_fixed_mulshift(step_ns_q12, leg->rate_q30, 30, &step_ns_q12);
    leg->left_ns_q12 -= step_ns_q12;
}

static void goal_halting(struct controller *controller, unsigned index)
{
    struct controller_axis *axis = &controller->axis[index];
    if (goal_stands(controller, index)) {
        axis->leg.late_ns = 0;
        axis->leg.state = CONTROLLER_LEG_IDLE;
    } else {
        goal_wait(controller, index, controller->config.stop_timeout_ns);
    }
}

void controller_goal_step(struct controller *controller)
{
    static void (*const step[])(struct controller *, unsigned) = {
        [CONTROLLER_LEG_IDLE] = goal_idle,
        [CONTROLLER_LEG_REQUESTED] = goal_requested,
        [CONTROLLER_LEG_RUNNING] = goal_running,
        [CONTROLLER_LEG_HALTING] = goal_halting,
    };
    if (!controller_in_motion(controller) ||
        controller->reaction != CONTROLLER_REACT_NONE)
        return;
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (controller->axis[i].leg.goal != NULL)
            step[controller->axis[i].leg.state](controller, i);
}

/* --- before a motion --- */

void controller_goal_set(struct controller_axis *axis,
                         const struct controller_goal goal[], unsigned count)
{
    axis->leg = (struct controller_leg){
        .goal = goal,
        .count = count,
        .is_left = controller_goal_is_running(&axis->leg),
    };
}

int controller_set_goals(struct controller *controller, unsigned index,
                         const struct controller_goal goal[], unsigned count)
{
    if (controller->state != CONTROLLER_READY)
        return MOTION_E_STATE;
    if (index >= controller->config.axis_count ||
        !controller->config.axis[index].by_goals || goal == NULL)
        return MOTION_E_ARG;
    controller_goal_set(&controller->axis[index], goal, count);
    return MOTION_OK;
}

static int64_t goal_most(const struct motion_extreme *extreme, int64_t most)
{
    const uint64_t low = motion_fixed_abs(extreme->min);
    const uint64_t high = motion_fixed_abs(extreme->max);
    const uint64_t value = low > high ? low : high;
    if (value <= (uint64_t)most)
        return most;
    return value > INT64_MAX ? INT64_MAX : (int64_t)value;
}

unsigned controller_goals_of(const struct motion_track *track,
                             struct controller_goal goal[], unsigned capacity)
{
    struct controller_goal distance = { .vel_q32 = 0 };
    bool moves = false;
    unsigned count = 0;
    for (uint32_t i = 0; i < track->count; i++) {
        const struct motion_segment *segment = &track->segment[i];
        struct motion_extreme extreme[MOTION_JERK + 1];
        struct motion_state end;
        motion_segment_extremes(segment, extreme);
        if (!moves && extreme[MOTION_POS].min == extreme[MOTION_POS].max)
            continue;
        if (!moves)
            distance =
                (struct controller_goal){ .start_ns_q12 = segment->start_ns_q12,
                                          .vel_q32 = 1,
                                          .acc_q32 = 1 };
        motion_segment_state(segment, segment->dur_ns_q12, &end);
        distance.vel_q32 = goal_most(&extreme[MOTION_VEL], distance.vel_q32);
        distance.acc_q32 = goal_most(&extreme[MOTION_ACC], distance.acc_q32);
        distance.end_ns_q12 = segment->start_ns_q12 + segment->dur_ns_q12;
        distance.pos_q32 =
            i + 1 < track->count ? segment[1].pos_q32 : track->end.pos_q32;
        moves = motion_fixed_abs(end.vel_q32) > MOTION_TRACK_STANDS_Q32;
        if (moves)
            continue;
        if (count < capacity)
            goal[count] = distance;
        count++;
    }
    return count;
}
