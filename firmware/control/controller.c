/* firmware/control/controller.c - see controller.h for the picture.
 *
 * Order within a tick: count time, read feedback, judge, then the state's own
 * step, which ends in set points for every drive, and goals that are due. */
#include "firmware/control/controller.h"

#include <stddef.h>

#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define ENABLE_TIMES 12 /* in all, of drives that go on */

const char *controller_state_text(enum controller_state state)
{
    static const char *const text[] = { "off",     "ready",    "moving",
                                        "holding", "stopping", "fault" };
    return (unsigned)state < sizeof text / sizeof text[0] ? text[state]
                                                          : "unknown";
}

const char *controller_fault_text(enum controller_fault fault)
{
    static const char *const text[] = {
#define FAULT_TEXT(name, reaction, text) text,
        CONTROLLER_FAULT_LIST(FAULT_TEXT)
#undef FAULT_TEXT
    };
    return (unsigned)fault < sizeof text / sizeof text[0] ? text[fault]
                                                          : "unknown fault";
}

/* Apart from the texts, which a board does not have. */
static const uint8_t fault_reaction[] = {
#define FAULT_REACTION(name, reaction, text) reaction,
    CONTROLLER_FAULT_LIST(FAULT_REACTION)
#undef FAULT_REACTION
};

/* -- state changes ------------------------------------------------------ */

/* A drive that samples its track by itself comes to rest by itself: what it says is
 * followed from here on, and no path of ours. */
static void controller_part(struct controller *controller, unsigned i)
{
    struct controller_axis *axis = &controller->axis[i];
    const struct hal_drive_tracks *tracks = axis->drive->ops->tracks;
    if (tracks == NULL)
        return;
    tracks->stop(axis->drive);
    axis->track = NULL;
    axis->sent_count = 0;
    axis->by_profile = true; /* until it is looked at */
    controller->step.stage = STEP_NONE;
}

void controller_enter(struct controller *controller,
                      enum controller_state state)
{
    controller->state = state;
    controller->since_ns = controller->now_ns;
    if (state != CONTROLLER_STOPPING)
        controller->is_brake = false;
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        if (state == CONTROLLER_OFF || state == CONTROLLER_FAULT)
            controller->axis[i].cam = NULL;
        if (state == CONTROLLER_STOPPING)
            controller_part(controller, i);
    }
}

void controller_request(struct controller *controller,
                        enum hal_drive_request request)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        hal_drive_request(controller->axis[i].drive, request);
}

void controller_rest(struct controller *controller)
{
    controller->rate.rate_q30 = 0;
    controller->rate.accel_q30 = 0;
    controller->rate.jerk_q30 = 0;
    controller->is_reversed = false;
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        controller->axis[i].track = NULL;
        controller->axis[i].along = NULL;
        controller->axis[i].target.vel_q32 = 0;
        controller->axis[i].target.acc_q32 = 0;
        controller->axis[i].target.torque_permille = 0;
        controller_goal_drop(&controller->axis[i]);
    }
    controller->jog = NULL;
}

bool controller_is_held(const struct controller *controller)
{
    return controller->state == CONTROLLER_FAULT && !controller->resetting &&
           controller->reaction == CONTROLLER_REACT_HOLD;
}

__attribute__((cold)) static void
controller_enter_fault(struct controller *controller)
{
    controller_rest(controller);
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        controller->axis[i].seeking = false;
        if (controller->reaction == CONTROLLER_REACT_QUICK)
            controller->axis[i].sent_count = 0; /* it has left its set point */
    }
    if (controller->reaction != CONTROLLER_REACT_HOLD)
        controller_request(controller,
                           controller->reaction == CONTROLLER_REACT_OFF
                               ? HAL_DRIVE_REQUEST_TORQUE_OFF
                               : HAL_DRIVE_REQUEST_OFF);
    controller_enter(controller, CONTROLLER_FAULT);
}

bool controller_in_motion(const struct controller *controller)
{
    return controller->state == CONTROLLER_MOVING ||
           controller->state == CONTROLLER_HOLDING ||
           controller->state == CONTROLLER_STOPPING;
}

/* In either direction. */
static bool controller_at_end(const struct controller *controller)
{
    return controller_path_ns_q12(controller, controller->rate.s_ns_q12) >=
           controller->move_end_ns_q12;
}

bool controller_clock_stands(const struct controller *controller)
{
    if (controller_at_end(controller))
        return true;
    return controller->rate.rate_q30 == 0 && controller->wanted_q30 == 0 &&
           controller->warp.rate1_q30 == 0;
}

static bool controller_at_rest(const struct controller *controller)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (controller->axis[i].target.vel_q32 != 0 ||
            controller->axis[i].target.acc_q32 != 0)
            return false;
    return true;
}

void controller_stand(struct controller *controller)
{
    controller_clock_set(
        controller,
        controller_path_ns_q12(controller, controller->rate.s_ns_q12), 0);
}

void controller_clock_set(struct controller *controller, int64_t s_ns_q12,
                          int64_t rate_q30)
{
    motion_clock_warp_init(&controller->warp, controller->clock_ns, s_ns_q12,
                           rate_q30);
    controller->step.stage = STEP_NONE; /* what was found begins elsewhere */
    controller->step.scheduled.state = CONTROLLER_SCHEDULED_NONE;
    motion_clock_warp_at(&controller->warp, controller->clock_ns,
                         &controller->rate);
    controller_path(controller, &controller->rate);
}

bool controller_freeze(struct controller *controller)
{
    if (!controller_at_rest(controller))
        return false;
    controller_stand(controller);
    return true;
}

/* Along the path within the stop limits, at once.  A jog that brakes by these
 * already goes on; any other slows down until a brake has been planned, before the
 * next tick (jog.h). */
static void controller_stop_along(struct controller *controller)
{
    if (controller->is_brake)
        return;
    controller->wanted_q30 = 0;
    controller->rest_by_ns =
        controller->clock_ns + controller_step_bound_ns(controller, true);
    if (!controller_freeze(controller))
        controller_step_request(controller);
}

/* Stop along the path, or let the drives brake by themselves.  Once per fault: small
 * rather than fast, as what calls it. */
__attribute__((cold)) static void
controller_react(struct controller *controller)
{
    const bool by_profile = controller_any_by_profile(controller, false);
    if (controller->reaction == CONTROLLER_REACT_OFF ||
        controller->state == CONTROLLER_FAULT || /* held */
        !(controller_in_motion(controller) || by_profile)) {
        controller_enter_fault(controller);
        return;
    }
    controller_enter(controller, CONTROLLER_STOPPING);
    if (by_profile)
        controller->reaction = CONTROLLER_REACT_QUICK;
    if (controller->reaction != CONTROLLER_REACT_QUICK) {
        controller_stop_along(controller);
        return;
    }
    controller->rest_by_ns = 0;
    controller_request(controller, HAL_DRIVE_REQUEST_QUICK_STOP);
}

/* Take the drive's own words for a fault, which may come once it has been asked, and
 * nothing that becomes of the drive after it. */
static __attribute__((cold)) void
controller_complete_fault(struct controller *controller)
{
    struct controller_fault_record *fault = &controller->fault;
    const struct hal_drive_feedback *feedback;
    const bool is_new = fault->t_ns == controller->now_ns;

    if (fault->axis < 0) {
        fault->is_whole = true;
        return;
    }
    feedback = &controller->axis[fault->axis].feedback;
    if (is_new || feedback->state == HAL_DRIVE_FAULT) {
        fault->drive_code = feedback->fault_code;
        for (unsigned i = 0; i < sizeof fault->reason; i++)
            fault->reason[i] = feedback->fault_text[i];
    }
    fault->is_whole = !feedback->fault_code_awaited ||
                      controller->now_ns - fault->t_ns >= CONTROLLER_REASON_NS;
}

__attribute__((cold)) void controller_raise(struct controller *controller,
                                            enum controller_fault fault,
                                            int axis, int64_t value,
                                            int64_t limit)
{
    const enum controller_reaction reaction = fault_reaction[fault];
    if (controller->fault.fault == CONTROLLER_FAULT_NONE) {
        controller->fault = (struct controller_fault_record){
            .fault = fault,
            .axis = axis,
            .t_ns = controller->now_ns,
            .value = value,
            .limit = limit,
            .bus = controller->bus,
        };
        controller_complete_fault(controller);
    }
    if (reaction <= controller->reaction)
        return;
    /* the ramp that a hold has begun serves a stop as well */
    const bool stopping = controller->state == CONTROLLER_STOPPING &&
                          controller->reaction == CONTROLLER_REACT_HOLD &&
                          reaction == CONTROLLER_REACT_STOP;
    controller->reaction = reaction;
    controller->enabling = false;
    if (!stopping)
        controller_react(controller);
}

void controller_trip(struct controller *controller, enum controller_fault fault)
{
    controller_raise(controller, fault, -1, 0, 0);
}

/* -- set points --------------------------------------------------------- */

static void controller_send(struct controller *controller, unsigned i)
{
    struct controller_axis *axis = &controller->axis[i];
    int64_t value = axis->target.pos_q32, limit = 0;
    const bool passes = controller_gate_pass(
        controller, i, axis->target.pos_q32, &value, &limit);
    const int err =
        passes ? controller_to_drive(axis, &axis->target) : MOTION_E_LIMIT;
    if (err < 0) {
        controller_raise(controller,
                         err == MOTION_E_RANGE ? CONTROLLER_FAULT_COUNTER
                                               : CONTROLLER_FAULT_GATE,
                         (int)i, value, limit);
        return;
    }
    controller_gate_sent(controller, i, axis->target.pos_q32);
}

/* Without torque, or while the drive moves it, the set point follows the axis,
 * so that what comes next does not make it jump. */
static void controller_follow(struct controller_axis *axis)
{
    axis->target =
        (struct hal_drive_target){ .pos_q32 = controller_place_q32(axis) };
    axis->sent_count = 0;
    axis->following_q32 = 0;
    axis->away = 0;
    (void)controller_to_drive(axis, &axis->target);
}

/* An axis without a set point, new to us or back from a mode of its drive's
 * own, begins where it is. */
static void controller_begin(struct controller_axis *axis)
{
    if (axis->sent_count == 0 && axis->track == NULL)
        axis->target.pos_q32 = controller_place_q32(axis);
}

static void controller_send_all(struct controller *controller)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        controller_begin(&controller->axis[i]);
        if (controller->axis[i].by_profile)
            controller_follow(&controller->axis[i]);
        else if (controller->reaction < CONTROLLER_REACT_QUICK)
            controller_send(controller, i);
    }
}

/* Outside of motion.  An axis with torque keeps the place where it stood when
 * its drive first reported torque: were it given its actual position, whatever
 * it droops by would be added to the set point in every tick. */
static void controller_keep_place(struct controller *controller)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        struct controller_axis *axis = &controller->axis[i];
        if (axis->feedback.state != HAL_DRIVE_ENABLED || axis->by_profile) {
            controller_follow(axis);
            continue;
        }
        controller_begin(axis);
        controller_send(controller, i);
    }
}

/* A drive may have been left in a mode of its own, by homing that was cut short
 * above all.  True: every one takes set points, or goals. */
static bool controller_usual_modes(struct controller *controller)
{
    bool all = true;
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        const enum hal_drive_mode usual = controller_usual_mode(controller, i);
        if (controller->axis[i].feedback.mode == usual)
            continue;
        (void)hal_drive_set_mode(controller->axis[i].drive, usual);
        all = false;
    }
    return all;
}

/* What the acceleration takes, as far as 32 bits go. */
static int32_t controller_torque(int64_t torque_q32, int64_t acc_q32)
{
    const struct motion_u128 product = motion_fixed_mul_u64(
        motion_fixed_abs(acc_q32), motion_fixed_abs(torque_q32));
    const uint64_t permille = product.hi + (product.lo >> 63); /* nearest */
    if (permille > INT32_MAX)
        return 0;
    return (acc_q32 < 0) != (torque_q32 < 0) ? -(int32_t)permille
                                             : (int32_t)permille;
}

void controller_tell(struct controller *controller, unsigned i,
                     const struct motion_sample *sample)
{
    struct hal_drive_target *target = &controller->axis[i].target;
    target->pos_q32 = sample->pos_q32;
    target->vel_q32 = sample->vel_q32;
    target->acc_q32 = sample->acc_q32;
    target->torque_permille = controller_torque(
        controller->config.axis[i].torque_q32, sample->acc_q32);
}

/* Every track at the same path time; speed and acceleration by the chain rule
 * p' = f' r, p'' = f'' r^2 + f' r'. */
static void controller_sample(struct controller *controller)
{
    const int64_t r2_q30 = motion_clock_warp_square(&controller->rate);
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        struct controller_axis *axis = &controller->axis[i];
        if (!axis->track)
            continue;
        struct motion_sample track, warped;
        motion_track_sample(axis->track, &axis->cursor,
                            controller->rate.s_ns_q12, &track);
        motion_clock_warp_sample(&controller->rate, r2_q30, &track, &warped);
        controller_tell(controller, i, &warped);
    }
    if (controller->couplings != NULL)
        controller->couplings->ops->follow(controller);
    if (controller->gantries != NULL)
        controller->gantries->ops->follow(controller);
}

/* -- one step per state ------------------------------------------------- */

static bool controller_all(const struct controller *controller,
                           enum hal_drive_state state)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (controller->axis[i].feedback.state != state)
            return false;
    return true;
}

static int controller_first_not(const struct controller *controller,
                                enum hal_drive_state state)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (controller->axis[i].feedback.state != state)
            return (int)i;
    return -1;
}

/* See controller.h. */
__attribute__((cold)) bool
controller_waited_for_drives(struct controller *controller, int64_t since_ns)
{
    const int64_t most_ns = controller->config.enable_timeout_ns;
    uint32_t steps = 0;

    for (unsigned i = 0; i < controller->config.axis_count; i++)
        steps += controller->axis[i].feedback.steps;
    if (steps != controller->steps) {
        controller->steps = steps;
        controller->step_ns = controller->now_ns;
    }
    if (controller->step_ns < since_ns)
        controller->step_ns = since_ns;
    return controller->now_ns - controller->step_ns > most_ns ||
           controller->now_ns - since_ns > ENABLE_TIMES * most_ns;
}

/* Without torque there is time: small rather than fast, as for a fault. */
__attribute__((cold)) static void
controller_step_off(struct controller *controller)
{
    controller_keep_place(controller);
    if (!controller->enabling)
        return;
    if (controller_ask(controller) && controller_usual_modes(controller) &&
        controller_all(controller, HAL_DRIVE_ENABLED)) {
        controller->enabling = false;
        controller_rest(controller);
        controller_enter(controller, CONTROLLER_READY);
    } else if (controller_waited_for_drives(controller, controller->since_ns)) {
        controller_raise(controller, CONTROLLER_FAULT_ENABLE,
                         controller_first_not(controller, HAL_DRIVE_ENABLED),
                         controller->now_ns - controller->since_ns,
                         controller->config.enable_timeout_ns);
    }
}

static void controller_step_ready(struct controller *controller)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (controller->axis[i].feedback.mode == HAL_DRIVE_HOMING &&
            !controller->homing)
            (void)hal_drive_set_mode(controller->axis[i].drive,
                                     controller_usual_mode(controller, i));
    controller_send_all(controller);
}

static void controller_clock(struct controller *controller)
{
    controller_step_seek(controller);
    motion_clock_warp_at(&controller->warp, controller->clock_ns,
                         &controller->rate);
    if (controller->rate.s_ns_q12 > controller->move_end_ns_q12)
        controller->rate.s_ns_q12 = controller->move_end_ns_q12;
    controller_path(controller, &controller->rate);
    if (controller_clock_stands(controller))
        controller->rest_by_ns = 0;
}

void controller_ahead(const struct controller *controller, int64_t ahead_ns,
                      struct motion_clock_rate *then)
{
    *then = controller->rate;
    if (!controller_in_motion(controller) ||
        controller->reaction >= CONTROLLER_REACT_QUICK)
        return;
    motion_clock_warp_at(&controller->warp, controller->clock_ns + ahead_ns,
                         then);
    controller_path(controller, then);
}

static void controller_step_moving(struct controller *controller)
{
    controller_clock(controller);
    controller_sample(controller);
    controller_send_all(controller);
    if (!controller_at_end(controller) ||
        !controller_goals_reached(controller) ||
        controller->reaction != CONTROLLER_REACT_NONE)
        return;
    if (controller->state == CONTROLLER_HOLDING) {
        controller_stand(controller); /* until it is resumed */
        return;
    }
    controller_rest(controller);
    controller_enter(controller, CONTROLLER_READY);
}

static bool controller_standing(const struct controller *controller)
{
    return !controller_any_by_profile(controller, true) &&
           controller_clock_stands(controller);
}

/* By what was measured since it was asked for. */
static bool controller_quick_stop_done(const struct controller *controller)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        const struct hal_drive_feedback *feedback =
            &controller->axis[i].feedback;
        if (feedback->state == HAL_DRIVE_ENABLED ||
            (feedback->state == HAL_DRIVE_QUICK_STOP &&
             (feedback->vel_q32 != 0 ||
              feedback->t_ns <= controller->since_ns)))
            return false;
    }
    return true;
}

static void controller_step_stopping(struct controller *controller)
{
    if (controller->reaction >= CONTROLLER_REACT_QUICK) {
        if (controller_quick_stop_done(controller) ||
            controller->now_ns - controller->since_ns >
                controller->config.stop_timeout_ns)
            controller_enter_fault(controller);
        return;
    }
    controller_clock(controller);
    controller_sample(controller);
    controller_send_all(controller);
    if (controller->state != CONTROLLER_STOPPING ||
        controller->reaction >= CONTROLLER_REACT_QUICK ||
        !controller_standing(controller))
        return;
    if (controller->reaction != CONTROLLER_REACT_NONE) {
        controller_enter_fault(controller);
    } else {
        controller_rest(controller);
        controller_enter(controller, CONTROLLER_READY);
    }
}

__attribute__((cold)) static void
controller_step_fault(struct controller *controller)
{
    if (controller_is_held(controller)) {
        controller_send_all(controller);
        return;
    }
    controller_keep_place(controller);
    if (!controller->resetting)
        return;
    if (controller_estop_bars(&controller->estop)) {
        controller->resetting = false; /* pressed since then */
    } else if (controller_all(controller, HAL_DRIVE_OFF)) {
        controller->resetting = false;
        controller->fault = (struct controller_fault_record){ 0 };
        controller->reaction = CONTROLLER_REACT_NONE;
        controller->lost_score = 0;
        controller_enter(controller, CONTROLLER_OFF);
    } else if (controller_waited_for_drives(controller, controller->since_ns)) {
        controller->resetting = false; /* the cause is still there */
    }
}

void controller_step(struct controller *controller, int64_t now_ns,
                     struct hal_fieldbus_worst bus)
{
    static void (*const step[])(struct controller *) = {
        [CONTROLLER_OFF] = controller_step_off,
        [CONTROLLER_READY] = controller_step_ready,
        [CONTROLLER_MOVING] = controller_step_moving,
        [CONTROLLER_HOLDING] = controller_step_moving,
        [CONTROLLER_STOPPING] = controller_step_stopping,
        [CONTROLLER_FAULT] = controller_step_fault,
    };
    controller_watch_tick(controller, now_ns);
    controller_watch_read(controller);
    controller->bus = bus;
    controller_watch_judge(controller);
    if (controller->fault.fault != CONTROLLER_FAULT_NONE &&
        !controller->fault.is_whole)
        controller_complete_fault(controller);
    step[controller->state](controller);
    controller_goal_step(controller);
}
