/* firmware/control/watch.c - is everything as it should be?
 *
 * One function per kind of fault, called every tick for every axis, in the
 * order of their seriousness; the first that trips is latched. */
#include <stddef.h>

#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define LOST_PER_TICK 10
#define LOST_MAX      100 /* ten in a row */
#define RUNAWAY_TICKS 3   /* of two bits */

/* An axis that goes to goals is to stay where it stands, in whatever mode its
 * drive is enabled. */
static void watch_place(struct controller_axis *axis, bool enabling)
{
    const bool stands =
        axis->feedback.state == HAL_DRIVE_ENABLED &&
        (axis->feedback.mode == HAL_DRIVE_PROFILE_POSITION || enabling) &&
        !controller_goal_is_running(&axis->leg);
    if (!axis->stands)
        axis->stands_q32 = axis->feedback.pos_q32;
    axis->stands = stands;
}

void controller_watch_read(struct controller *controller)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        struct controller_axis *axis = &controller->axis[i];
        const uint64_t speed = motion_fixed_abs(axis->feedback.vel_q32);
        hal_drive_feedback(axis->drive, &axis->feedback);
        axis->is_faster = motion_fixed_abs(axis->feedback.vel_q32) > speed;
        controller_from_drive(axis, &axis->feedback);
        axis->by_profile =
            axis->feedback.state == HAL_DRIVE_ENABLED &&
            axis->feedback.mode != HAL_DRIVE_STREAM_POSITION &&
            axis->feedback.mode != controller_usual_mode(controller, i);
        if (axis->feedback.state == HAL_DRIVE_OFFLINE &&
            controller->config.axis[i].needs_homing)
            axis->homed = false; /* where it comes back is not known */
        if (controller->config.axis[i].by_goals)
            watch_place(axis, controller->enabling);
    }
}

bool controller_input(struct hal_gpio *line)
{
    return line != NULL && hal_gpio_get(line) != 0;
}

/* Name the fault that one of two lines has raised: a line that cannot be read counts
 * as active. */
static enum controller_fault watch_why(struct hal_gpio *const line[2],
                                       enum controller_fault active)
{
    for (unsigned i = 0; i < 2; i++)
        if (line[i] != NULL && hal_gpio_get(line[i]) < 0)
            return CONTROLLER_FAULT_INPUT;
    return active;
}

/* The set point that was in force when the position was measured. */
static bool watch_demand(const struct controller_axis *axis, int64_t *pos_q32)
{
    const int64_t given_ns = axis->feedback.t_ns - axis->feedback.demand_age_ns;
    if (axis->feedback.demand_known) {
        *pos_q32 = axis->feedback.demand_q32;
        return true;
    }
    for (unsigned i = 0; i < axis->sent_count; i++)
        if (axis->sent_ns[i] <= given_ns) {
            *pos_q32 = axis->sent_q32[i];
            return true;
        }
    return false;
}

static void watch_drive(struct controller *controller, unsigned i)
{
    const struct controller_axis *axis = &controller->axis[i];
    switch (axis->feedback.state) {
    case HAL_DRIVE_ENABLED:
        return;
    case HAL_DRIVE_FAULT:
        controller_raise(controller, CONTROLLER_FAULT_DRIVE, (int)i,
                         axis->feedback.fault_code, 0);
        return;
    case HAL_DRIVE_OFFLINE:
        controller_raise(controller, CONTROLLER_FAULT_OFFLINE, (int)i, 0, 0);
        return;
    case HAL_DRIVE_OFF:
    case HAL_DRIVE_ENABLING:
    case HAL_DRIVE_QUICK_STOP:
        controller_raise(controller, CONTROLLER_FAULT_STATE, (int)i,
                         (int64_t)axis->feedback.state, 0);
        return;
    }
}

/* Nobody sends SYNC in a tick that is lost, so feedback is that much older
 * without being at fault; lost_score holds over eight per lost tick. */
static void watch_age(struct controller *controller, unsigned i)
{
    const int64_t age_ns =
        controller->now_ns - controller->axis[i].feedback.t_ns;
    const int64_t lost = (int64_t)(controller->lost_score + 7) >> 3;
    const int64_t own_ns = controller->config.axis[i].feedback_max_age_ns;
    const int64_t most_ns =
        (own_ns > 0 ? own_ns : controller->config.feedback_max_age_ns) +
        lost * controller->config.period_ns;
    if (age_ns > most_ns)
        controller_raise(controller, CONTROLLER_FAULT_STALE, (int)i, age_ns,
                         most_ns);
}

/* |v| * k, k of controller.c: the largest there is means that no speed has a
 * limit. */
static int64_t watch_allowance(const struct controller_axis_config *config,
                               const struct controller_axis *axis)
{
    const struct motion_u128 product =
        motion_fixed_mul_u64(motion_fixed_abs(axis->target.vel_q32),
                             (uint64_t)axis->following_k_q62);
    const int64_t allowed_q32 =
        (int64_t)(product.hi << 2 | product.lo >> 62) + 1; /* rounded up */
    if (axis->following_k_q62 == INT64_MAX || product.hi >= (uint64_t)1 << 61)
        return INT64_MAX;
    return allowed_q32 > config->following_floor_q32
               ? allowed_q32
               : config->following_floor_q32;
}

/* Beyond its following error, that grows, in three ticks with an answer of its
 * drive: against what it is told, which is no creep, or away from there and faster
 * and faster, either by more than a sixteenth of its limit, or by a fifth faster
 * than it may be at all.  No stop along the path is for that.  One that is slow to
 * brake, stands against something or has slipped does none of it: torque is what
 * stops it.  Small rather than fast: something is wrong already. */
__attribute__((cold, noinline)) static void
watch_runaway(struct controller *controller, unsigned i, uint64_t before)
{
    struct controller_axis *axis = &controller->axis[i];
    const int64_t most_q32 = controller->config.axis[i].limit.vel_q32;
    const int64_t told_q32 = axis->target.vel_q32;
    const int64_t vel_q32 = axis->feedback.vel_q32;
    const uint64_t little = (uint64_t)most_q32 / 16;
    const uint64_t told = motion_fixed_abs(told_q32);
    const uint64_t now = motion_fixed_abs(axis->following_q32);
    uint64_t allowed = (uint64_t)most_q32 + 3 * little;
    if ((told_q32 ^ vel_q32) < 0 && told > little)
        allowed = little;
    else if ((axis->following_q32 ^ vel_q32) < 0 && axis->is_faster)
        allowed = told + little;
    if (now < before || axis->feedback.state != HAL_DRIVE_ENABLED ||
        motion_fixed_abs(vel_q32) <= allowed)
        axis->away = 0;
    else if (now > before && ++axis->away == RUNAWAY_TICKS)
        controller_raise(controller, CONTROLLER_FAULT_RUNAWAY, (int)i, vel_q32,
                         most_q32);
}

static void watch_following(struct controller *controller, unsigned i)
{
    struct controller_axis *axis = &controller->axis[i];
    const uint64_t before = motion_fixed_abs(axis->following_q32);
    int64_t demand_q32;
    if (axis->by_profile || controller->config.axis[i].by_goals ||
        axis->sent_count == 0 || !watch_demand(axis, &demand_q32) ||
        motion_fixed_sub(demand_q32, axis->feedback.pos_q32,
                         &axis->following_q32) < 0)
        return;
    const int64_t most_q32 = watch_allowance(&controller->config.axis[i], axis);
    if (motion_fixed_abs(axis->following_q32) <= (uint64_t)most_q32) {
        axis->away = 0;
        return;
    }
    controller_raise(controller, CONTROLLER_FAULT_FOLLOWING, (int)i,
                     axis->following_q32, most_q32);
    watch_runaway(controller, i, before);
}

static void watch_standing(struct controller *controller, unsigned i)
{
    const struct controller_axis *axis = &controller->axis[i];
    const int64_t most_q32 = controller->config.axis[i].following_floor_q32;
    int64_t off_q32 = INT64_MAX;
    if (axis->stands &&
        (motion_fixed_sub(axis->stands_q32, axis->feedback.pos_q32, &off_q32) <
             0 ||
         motion_fixed_abs(off_q32) > (uint64_t)most_q32))
        controller_raise(controller, CONTROLLER_FAULT_FOLLOWING, (int)i,
                         off_q32, most_q32);
}

/* Which way it runs: what it was told, or, on its way to a goal and halting
 * there, what it does. */
static int64_t watch_vel_q32(const struct controller_axis *axis)
{
    return controller_goal_is_running(&axis->leg) ? axis->feedback.vel_q32
                                                  : axis->target.vel_q32;
}

/* A switch is a fault only for motion towards it. */
static void watch_switches(struct controller *controller, unsigned i)
{
    const struct controller_axis *axis = &controller->axis[i];
    const bool low = axis->feedback.limit_negative ||
                     controller_input(axis->switches.limit_negative);
    const bool high = axis->feedback.limit_positive ||
                      controller_input(axis->switches.limit_positive);
    const int64_t vel_q32 = watch_vel_q32(axis);
    const bool towards = (low && vel_q32 < 0) || (high && vel_q32 > 0);
    const bool is_awaited = axis->seeking || axis->by_profile;
    struct hal_gpio *const line[] = { axis->switches.limit_negative,
                                      axis->switches.limit_positive };
    if ((low && high) || (towards && !is_awaited))
        controller_raise(controller,
                         watch_why(line, CONTROLLER_FAULT_LIMIT_SWITCH), (int)i,
                         axis->feedback.pos_q32, 0);
}

/* While there is still enough to stop on, eight ticks at least; where no stop has been
 * found on that, the drives brake two ticks before the clock leaves it. */
static void watch_track(struct controller *controller, unsigned i)
{
    const struct motion_track *track = controller->axis[i].track;
    if (!track)
        return;
    const int64_t ahead_ns_q12 =
        motion_track_ahead(track, controller->rate.s_ns_q12);
    if (ahead_ns_q12 < controller->reserve_ns_q12)
        controller_raise(controller, CONTROLLER_FAULT_TRACK, (int)i,
                         ahead_ns_q12 / MOTION_FIXED_NS_Q12,
                         controller->reserve_ns_q12 / MOTION_FIXED_NS_Q12);
    /* per tick, Q30, to Q12 */
    if (ahead_ns_q12 <
        controller->rate.rate_q30 * controller->config.period_ns >> 17)
        controller_raise(controller, CONTROLLER_FAULT_REST, (int)i,
                         ahead_ns_q12 / MOTION_FIXED_NS_Q12, 0);
}

static void watch_ticks(struct controller *controller)
{
    if (controller->lost_score >= LOST_MAX)
        controller_raise(controller, CONTROLLER_FAULT_OVERRUN, -1,
                         (int64_t)controller->ticks_lost, 0);
}

/* The stop that was asked for has come to its bound. */
static void watch_rest(struct controller *controller)
{
    const bool is_stopping = controller->state == CONTROLLER_HOLDING ||
                             controller->state == CONTROLLER_STOPPING;
    const int64_t late_ns = controller->clock_ns - controller->rest_by_ns;
    if (is_stopping && controller->rest_by_ns != 0 && late_ns > 0)
        controller_raise(controller, CONTROLLER_FAULT_REST, -1, late_ns, 0);
}

/* That its channels disagree is seen later than that it stops, and is why. */
static void watch_estop(struct controller *controller)
{
    struct controller_estop *estop = &controller->estop;
    controller_estop_look(estop, controller->now_ns);
    if (estop->is_active)
        controller_raise(controller,
                         watch_why(estop->channel, CONTROLLER_FAULT_ESTOP), -1,
                         0, 0);
    if (!estop->disagrees)
        return;
    controller_raise(controller, CONTROLLER_FAULT_ESTOP_CHANNELS, -1, 0, 0);
    if (controller->fault.fault == CONTROLLER_FAULT_ESTOP)
        controller->fault.fault = CONTROLLER_FAULT_ESTOP_CHANNELS;
}

static void watch_bus(struct controller *controller)
{
    static const enum controller_fault fault[] = {
        [HAL_FIELDBUS_PASSIVE] = CONTROLLER_FAULT_BUS_PASSIVE,
        [HAL_FIELDBUS_FULL] = CONTROLLER_FAULT_BUS_FULL,
        [HAL_FIELDBUS_FOREIGN] = CONTROLLER_FAULT_MASTER,
        [HAL_FIELDBUS_BUS_OFF] = CONTROLLER_FAULT_BUS,
        [HAL_FIELDBUS_DOWN] = CONTROLLER_FAULT_BUS,
    };
    const unsigned health = controller->bus.health;
    if (health != HAL_FIELDBUS_GOOD)
        controller_raise(controller,
                         health < sizeof fault / sizeof fault[0]
                             ? fault[health]
                             : CONTROLLER_FAULT_BUS,
                         -1, (int64_t)health, 0);
}

static void watch_axis(struct controller *controller, unsigned i)
{
    watch_drive(controller, i);
    watch_age(controller, i);
    watch_following(controller, i);
    watch_standing(controller, i);
    watch_switches(controller, i);
    watch_track(controller, i);
}

/* Those that are up while others still enable; a bus is judged once it holds
 * one of them. */
static void watch_enabling(struct controller *controller)
{
    watch_ticks(controller); /* drives give up meanwhile, and do not say why */
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        if (controller->axis[i].sent_count == 0 || !controller->is_asked)
            continue;
        watch_bus(controller);
        watch_axis(controller, i);
    }
}

void controller_watch_judge(struct controller *controller)
{
    watch_estop(controller);
    if (controller->enabling)
        watch_enabling(controller);
    if (controller->state == CONTROLLER_OFF ||
        (controller->state == CONTROLLER_FAULT &&
         !controller_is_held(controller)))
        return; /* no torque: nothing else to lose */
    watch_bus(controller);
    watch_ticks(controller);
    watch_rest(controller);
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        watch_axis(controller, i);
    if (controller->gantries != NULL)
        controller->gantries->ops->judge(controller);
}

/* How many ticks a gap swallowed, rounded at the half: long division in base 2,
 * as the tick has none and a gap may be of hours. */
#define LOST_BITS 36
static uint64_t watch_lost(int64_t gap_ns, int64_t period_ns)
{
    int64_t rest_ns = gap_ns - period_ns - period_ns / 2 - 1;
    uint64_t lost = 0;
    if (rest_ns < 0)
        return 0;
    for (unsigned bit = LOST_BITS; bit-- > 0;) {
        const int64_t part_ns = period_ns << bit;
        if (rest_ns < part_ns)
            continue;
        rest_ns -= part_ns;
        lost += UINT64_C(1) << bit;
    }
    return lost + 1;
}

void controller_watch_tick(struct controller *controller, int64_t now_ns)
{
    const int64_t period_ns = controller->config.period_ns;
    const uint64_t lost = watch_lost(now_ns - controller->now_ns, period_ns);
    controller->now_ns = now_ns;
    if (controller->ticks++ == 0)
        return;
    controller->clock_ns += period_ns;
    if (controller->lost_score > 0)
        controller->lost_score--;
    controller->ticks += lost;
    controller->ticks_lost += lost;
    controller->lost_score +=
        LOST_PER_TICK * (unsigned)(lost < LOST_MAX ? lost : LOST_MAX);
}
