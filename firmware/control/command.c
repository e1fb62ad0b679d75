/* firmware/control/command.c - what an operator may ask for, and when.
 *
 * Between two ticks, and counted to the next one: a command may divide, and asks
 * of a whole track what its summary (motion/core/track.h) has; those without one
 * are short, or each of their segments costs as much as some samples. */
#include <stddef.h>

#include "firmware/control/jog.h"
#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

/* At most this far from where its track starts may an axis stand whose drive goes
 * there by itself: 2^-20.  What is sent set points would jump by that. */
#define START_WINDOW_Q32 ((int64_t)1 << 12)

bool controller_ask(struct controller *controller)
{
    if (controller->is_asked)
        return true;
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        const enum hal_drive_state state = controller->axis[i].feedback.state;
        if (state == HAL_DRIVE_ENABLED || state == HAL_DRIVE_QUICK_STOP)
            return false;
    }
    controller->is_asked = true;
    controller_request(controller, HAL_DRIVE_REQUEST_ENABLE);
    return true;
}

int controller_enable(struct controller *controller)
{
    if (controller->state != CONTROLLER_OFF || controller->enabling ||
        controller->resetting)
        return MOTION_E_STATE;
    controller->enabling = true;
    controller->is_asked = false;
    controller->since_ns = controller->now_ns;
    (void)controller_ask(controller);
    return MOTION_OK;
}

int controller_off(struct controller *controller)
{
    if (controller_is_held(controller)) {
        controller->reaction = CONTROLLER_REACT_STOP; /* the fault stays */
        controller_request(controller, HAL_DRIVE_REQUEST_OFF);
        return MOTION_OK;
    }
    if (controller->state != CONTROLLER_READY &&
        controller->state != CONTROLLER_OFF)
        return MOTION_E_STATE;
    controller->enabling = false;
    controller_request(controller, HAL_DRIVE_REQUEST_OFF);
    controller_enter(controller, CONTROLLER_OFF);
    return MOTION_OK;
}

int64_t controller_largest(const struct motion_track *track,
                           enum motion_quantity quantity)
{
    struct motion_extreme extreme;
    motion_track_extreme(track, quantity, &extreme);
    const uint64_t low = motion_fixed_abs(extreme.min);
    const uint64_t high = motion_fixed_abs(extreme.max);
    const uint64_t most = low > high ? low : high;
    return most > INT64_MAX ? INT64_MAX : (int64_t)most;
}

int64_t controller_peak(const struct motion_track *track,
                        enum motion_quantity quantity)
{
    if (quantity <= MOTION_VEL)
        return controller_largest(track, quantity);
    const int64_t peak = track->outline != NULL
                             ? controller_largest(track, quantity)
                             : motion_track_peak(track, quantity);
    return peak - (peak >> 28);
}

/* Largest r with peak * r^power <= limit, Q30, at most 200 %, found by halving:
 * once per move and per quantity, not on the tick. */
static int64_t controller_rate_most(int64_t peak, int64_t limit, int power)
{
    int64_t low = 0, high = MOTION_CLOCK_WARP_MAX_Q30;
    while (low < high) {
        const int64_t r = low + (high - low + 1) / 2;
        int64_t value = peak;
        for (int i = 0; i < power; i++)
            if (motion_fixed_mulshift(value, r, 30, &value) < 0)
                value = INT64_MAX;
        if (value <= limit)
            low = r;
        else
            high = r - 1;
    }
    return low;
}

static int64_t controller_axis_rate_most(const struct controller *controller,
                                         unsigned index)
{
    const struct controller_axis *axis = &controller->axis[index];
    const struct motion_clock_limit limit =
        controller_limit(controller, index, false);
    const int64_t vel =
        controller_rate_most(axis->vel_peak_q32, limit.vel_q32, 1);
    const int64_t acc = controller_rate_most(
        controller_peak(axis->track, MOTION_ACC), limit.acc_q32, 2);
    const int64_t most = motion_fixed_least(vel, acc);
    if (limit.jerk_q32 == 0)
        return most;
    return motion_fixed_least(
        most, controller_rate_most(controller_peak(axis->track, MOTION_JERK),
                                   limit.jerk_q32, 3));
}

static bool controller_is_there(const struct controller *controller,
                                unsigned index,
                                const struct motion_track *track,
                                int64_t at_ns_q12)
{
    const struct controller_axis *axis = &controller->axis[index];
    const int64_t window_q32 = controller->config.axis[index].by_goals
                                   ? START_WINDOW_Q32
                                   : MOTION_TRACK_POS_ROUNDING;
    struct motion_sample start;
    struct motion_cursor cursor = { 0 };
    int64_t apart;
    motion_track_sample(track, &cursor, at_ns_q12, &start);
    return axis->sent_count > 0 &&
           motion_fixed_sub(start.pos_q32, axis->sent_q32[0], &apart) ==
               MOTION_OK &&
           motion_fixed_abs(apart) <= (uint64_t)window_q32;
}

/* Outside the range it moves inward alone; of a window, which does not show the
 * whole of the move, nothing may be outside. */
static bool controller_only_comes_in(const struct controller_axis_config *range,
                                     const struct motion_track *track)
{
    int64_t down_to_q32, up_to_q32;
    motion_track_reach(track, &down_to_q32, &up_to_q32);
    return down_to_q32 >= range->pos_min_q32 - MOTION_TRACK_POS_ROUNDING &&
           up_to_q32 <= range->pos_max_q32 + MOTION_TRACK_POS_ROUNDING;
}

/* The range as a track sees it that is so far beside the axis. */
static struct controller_axis_config
controller_range_beside(const struct controller_axis_config *range,
                        int64_t beside_q32)
{
    struct controller_axis_config moved = *range;
    if (motion_fixed_sub(range->pos_min_q32, beside_q32, &moved.pos_min_q32) <
            0 ||
        motion_fixed_sub(range->pos_max_q32, beside_q32, &moved.pos_max_q32) <
            0)
        moved.pos_min_q32 = moved.pos_max_q32 = 0;
    return moved;
}

bool controller_admit(struct controller *controller, unsigned index,
                      const struct motion_track *track, int64_t beside_q32)
{
    const struct controller_axis_config range =
        controller_range_beside(&controller->config.axis[index], beside_q32);
    struct controller_axis *axis = &controller->axis[index];
    const int64_t highest_q32 = axis->highest_q32;
    const int64_t lowest_q32 = axis->lowest_q32;
    struct motion_extreme pos;
    motion_track_extreme(track, MOTION_POS, &pos);
    controller_gate_mark(controller, index, axis->target.pos_q32);
    if (!controller_range_counts(controller, index) ||
        (motion_fixed_add(pos.min, beside_q32, &pos.min) == MOTION_OK &&
         motion_fixed_add(pos.max, beside_q32, &pos.max) == MOTION_OK &&
         controller_gate_range(controller, index, pos.min, pos.max) &&
         controller_only_comes_in(&range, track)))
        return true;
    axis->highest_q32 = highest_q32;
    axis->lowest_q32 = lowest_q32;
    return false;
}

int64_t controller_reserve_ns_q12(const struct controller *controller,
                                  const struct motion_track *const track[],
                                  int64_t rate_q30)
{
    int64_t reserve_ns_q12 = 0;
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        if (!track[i])
            continue;
        const int64_t ns_q12 =
            controller_ramp_reserve(controller, i, track[i], rate_q30);
        if (ns_q12 > reserve_ns_q12)
            reserve_ns_q12 = ns_q12;
    }
    return reserve_ns_q12;
}

/* Of the clock once it is up to speed. */
static int64_t controller_rate(const struct controller *controller)
{
    return controller->jog != NULL
               ? MOTION_CLOCK_WARP_ONE_Q30
               : motion_fixed_least(controller->override_q30,
                                    controller->override_max_q30);
}

/* Only windows run out; for others it would be work for nothing. */
void controller_set_reserve(struct controller *controller)
{
    const int64_t rate_q30 =
        controller->rate.rate_q30 > controller->override_q30
            ? controller->rate.rate_q30
            : controller->override_q30;
    controller->reserve_ns_q12 = 0;
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        const struct motion_track *track = controller->axis[i].track;
        if (!track || !track->outline)
            continue;
        const int64_t ns_q12 =
            controller_ramp_reserve(controller, i, track, rate_q30);
        if (ns_q12 > controller->reserve_ns_q12)
            controller->reserve_ns_q12 = ns_q12;
    }
}

void controller_axis_play(struct controller_axis *axis,
                          const struct motion_track *track)
{
    axis->track = track;
    axis->cursor = (struct motion_cursor){ 0 };
    if (!track)
        return;
    axis->vel_peak_q32 = controller_peak(track, MOTION_VEL);
}

/* Is a rate within the limits of the move?  A master may be at its own but for what
 * the slopes of its followers are rounded up by, and is played that much slower. */
static bool controller_may_have(const struct controller *controller,
                                int64_t rate_q30)
{
    const int64_t over_q30 = rate_q30 - controller->override_max_q30;
    return over_q30 <= (controller->couplings != NULL
                            ? MOTION_CLOCK_WARP_ONE_Q30 >> 28
                            : 0);
}

/* True when every track is inside its axis's limits at 100 %. */
static bool controller_load(struct controller *controller,
                            const struct motion_track *const track[])
{
    controller->move_end_ns_q12 = 0;
    controller->override_max_q30 = MOTION_CLOCK_WARP_MAX_Q30;
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        controller_axis_play(&controller->axis[i], track[i]);
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        if (!track[i])
            continue;
        if (track[i]->end_ns_q12 > controller->move_end_ns_q12)
            controller->move_end_ns_q12 = track[i]->end_ns_q12;
        controller->override_max_q30 =
            motion_fixed_least(controller->override_max_q30,
                               controller_axis_rate_most(controller, i));
        if (!controller_admit(controller, i, track[i], 0))
            controller->override_max_q30 = 0;
    }
    controller_set_reserve(controller);
    if (!controller_may_have(controller, MOTION_CLOCK_WARP_ONE_Q30))
        return false;
    controller_step_load(controller);
    return true;
}

/* MOTION_OK, or why these tracks cannot begin at this time, and *axis. */
static int controller_may_start(const struct controller *controller,
                                const struct motion_track *const track[],
                                int64_t at_ns_q12, int *axis)
{
    const struct controller_axis *own = controller->axis;
    for (*axis = 0; *axis < (int)controller->config.axis_count; ++*axis)
        if (track[*axis] && controller->config.axis[*axis].by_goals &&
            own[*axis].leg.goal == NULL)
            return MOTION_E_ARG;
    for (*axis = 0; *axis < (int)controller->config.axis_count; ++*axis)
        if (track[*axis] && !own[*axis].homed)
            return MOTION_E_UNHOMED;
    for (*axis = 0; *axis < (int)controller->config.axis_count; ++*axis)
        if (track[*axis] && own[*axis].cam == NULL &&
            !controller_is_there(controller, (unsigned)*axis, track[*axis],
                                 at_ns_q12))
            return MOTION_E_AWAY;
    *axis = -1;
    return MOTION_OK;
}

/* The tracks are there to be played from this time on. */
static int controller_begin(struct controller *controller,
                            const struct motion_track *const track[],
                            int64_t at_ns_q12, int *axis)
{
    int which;
    if (controller->state != CONTROLLER_READY || controller->homing)
        return MOTION_E_STATE;
    int err = controller_may_start(controller, track, at_ns_q12, &which);
    if (err == MOTION_OK && controller->couplings != NULL)
        err =
            controller->couplings->admit(controller, track, at_ns_q12, &which);
    if (err == MOTION_OK && controller->gantries != NULL)
        err = controller->gantries->admit(controller, track, &which);
    if (err == MOTION_OK && !controller_load(controller, track)) {
        controller_rest(controller);
        err = MOTION_E_LIMIT;
    }
    if (err < 0) {
        controller_goal_forget(controller);
        if (axis)
            *axis = which;
        return err;
    }
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (!track[i])
            controller->axis[i].leg = (struct controller_leg){ .goal = NULL };
    controller->jog = NULL;
    return MOTION_OK;
}

int controller_start(struct controller *controller,
                     const struct motion_track *const track[], int *axis)
{
    const int err = controller_begin(controller, track, 0, axis);
    if (err < 0)
        return err;
    /* The first set point of the move, one tick from now, is path time one
     * period: a track that starts from rest may be read at full rate. */
    controller_play(controller, controller_rate(controller));
    return MOTION_OK;
}

static bool controller_has(const struct controller *controller,
                           const struct motion_track *const track[],
                           int64_t at_ns_q12)
{
    int64_t end_ns_q12 = 0;
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        if (!track[i])
            continue;
        if (track[i]->outline != NULL && at_ns_q12 != 0)
            return false;
        if (track[i]->end_ns_q12 > end_ns_q12)
            end_ns_q12 = track[i]->end_ns_q12;
    }
    return at_ns_q12 >= 0 && at_ns_q12 <= end_ns_q12;
}

/* Goals that end before are behind. */
static void controller_skip_goals(struct controller_leg *leg, int64_t at_ns_q12)
{
    while (leg->at < leg->count && leg->goal[leg->at].end_ns_q12 <= at_ns_q12)
        leg->at++;
}

int controller_cue(struct controller *controller,
                   const struct motion_track *const track[], int64_t at_ns_q12,
                   int *axis)
{
    if (axis)
        *axis = -1;
    if (controller->state != CONTROLLER_READY || controller->homing)
        return MOTION_E_STATE;
    if (!controller_has(controller, track, at_ns_q12))
        return MOTION_E_ARG;
    const int err = controller_begin(controller, track, at_ns_q12, axis);
    if (err < 0)
        return err;
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        controller_skip_goals(&controller->axis[i].leg, at_ns_q12);
    controller->wanted_q30 = 0;
    controller->rest_by_ns = 0;
    controller->is_held = true;
    controller_clock_set(controller, at_ns_q12, 0);
    controller_enter(controller, CONTROLLER_HOLDING);
    return MOTION_OK;
}

void controller_play(struct controller *controller, int64_t rate_q30)
{
    controller->wanted_q30 = rate_q30;
    controller_clock_set(controller, 0, rate_q30);
    controller_enter(controller, CONTROLLER_MOVING);
}

void controller_slow_down(struct controller *controller,
                          enum controller_state state)
{
    const bool slows = controller_slows(controller);
    const bool has_ramp = slows && controller->warp.rate1_q30 == 0;
    const int64_t due_ns = slows ? controller->rest_by_ns : INT64_MAX;
    controller->wanted_q30 = 0;
    controller_enter(controller, state);
    controller->rest_by_ns =
        has_ramp ? due_ns
                 : motion_fixed_least(
                       due_ns, controller->clock_ns +
                                   controller_step_bound_ns(controller, false));
    if (!has_ramp && controller_freeze(controller))
        return;
    controller_step_request(controller);
}

int controller_hold(struct controller *controller)
{
    if (controller->state != CONTROLLER_MOVING)
        return MOTION_E_STATE;
    controller->is_held = true;
    controller_slow_down(controller, CONTROLLER_HOLDING);
    return MOTION_OK;
}

/* Does the path begin here, from rest? Then it may be read at full rate, as
 * after a start. */
static bool controller_is_at_start(const struct controller *controller)
{
    if (controller->jog != NULL || controller->rate.rate_q30 != 0 ||
        controller->warp.rate1_q30 != 0 ||
        controller_path_ns_q12(controller, controller->rate.s_ns_q12) != 0)
        return false;
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        struct motion_state state;
        if (!controller->axis[i].track)
            continue;
        controller_path_state(controller, controller->axis[i].track, 0, &state);
        if (motion_fixed_abs(state.vel_q32) > MOTION_TRACK_STANDS_Q32)
            return false;
    }
    return true;
}

int controller_resume(struct controller *controller)
{
    const bool is_between = controller->state == CONTROLLER_READY &&
                            controller->homing && controller->is_held;
    if (controller->state != CONTROLLER_HOLDING && !is_between)
        return MOTION_E_STATE;
    controller->is_held = false;
    if (is_between)
        return MOTION_OK;
    controller->wanted_q30 = controller_rate(controller);
    controller_enter(controller, CONTROLLER_MOVING);
    if (controller_is_at_start(controller))
        controller_clock_set(controller, 0, controller->wanted_q30);
    return MOTION_OK;
}

/* Tracks that are held as a whole, and no goals, which have an order; and an
 * axis that came in from outside its range does not go out again. */
static int controller_can_reverse(const struct controller *controller)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        const struct controller_axis_config *config =
            &controller->config.axis[i];
        const struct motion_track *track = controller->axis[i].track;
        struct motion_extreme pos;
        if (track == NULL)
            continue;
        if (track->outline != NULL || config->by_goals)
            return MOTION_E_ARG;
        motion_track_extreme(track, MOTION_POS, &pos);
        if (controller_range_counts(controller, i) &&
            (pos.min < config->pos_min_q32 - MOTION_TRACK_POS_ROUNDING ||
             pos.max > config->pos_max_q32 + MOTION_TRACK_POS_ROUNDING))
            return MOTION_E_LIMIT;
    }
    return MOTION_OK;
}

int controller_reverse(struct controller *controller, bool is_reversed)
{
    if (controller->state != CONTROLLER_HOLDING || controller->jog != NULL ||
        !controller_clock_stands(controller))
        return MOTION_E_STATE;
    const int err = controller_can_reverse(controller);
    if (err < 0)
        return err;
    controller->is_reversed = is_reversed;
    controller_stand(controller);
    return MOTION_OK;
}

void controller_halt(struct controller *controller)
{
    if (controller->jog != NULL)
        controller->jog->brake(controller, true);
    else if (controller->state == CONTROLLER_MOVING ||
             controller->state == CONTROLLER_HOLDING ||
             (controller_slows(controller) &&
              controller->reaction == CONTROLLER_REACT_NONE))
        controller_slow_down(controller, CONTROLLER_STOPPING);
    else if (controller->enabling)
        (void)controller_off(controller);
}

void controller_stop(struct controller *controller)
{
    controller->stops++;
    controller_halt(controller);
}

int controller_override(struct controller *controller, int64_t rate_q30)
{
    if (rate_q30 < 0 || rate_q30 > MOTION_CLOCK_WARP_MAX_Q30)
        return MOTION_E_ARG;
    if (controller_in_motion(controller) && controller->jog == NULL &&
        !controller_may_have(controller, rate_q30))
        return MOTION_E_LIMIT;
    controller->override_q30 = rate_q30;
    controller_set_reserve(controller);
    if (controller->state == CONTROLLER_MOVING && controller->jog == NULL)
        controller->wanted_q30 = controller_rate(controller);
    return MOTION_OK;
}

int controller_reset(struct controller *controller)
{
    if (controller->state != CONTROLLER_FAULT || controller->resetting ||
        controller_estop_bars(&controller->estop))
        return MOTION_E_STATE;
    if (controller_is_held(controller))
        controller_off(controller);
    controller->resetting = true;
    controller->since_ns = controller->now_ns;
    controller_request(controller, HAL_DRIVE_REQUEST_RESET);
    return MOTION_OK;
}
