/* firmware/control/gate.c - the last gate before the bus.
 *
 * Whatever went wrong before it, a set point leaves only when it is inside the
 * position range and the step from the set points sent before stays inside
 * speed and acceleration.  A violation is a fault, never a silent clamp.  An
 * axis may stand outside its range (it was pushed, or homing found it there):
 * then it may come in.  The place where a motion of it begins is the border for
 * that motion and all later ones, so that it never goes further out, not by
 * rounding either.
 *
 * With d2 and d1 the steps between the last three set points,
 *     |d1| <= v T          |d1 - d2| <= a T^2
 * which hold for every curve inside the limits: the second difference of a
 * curve is T^2 times its acceleration at some point between.  T is one period
 * also where ticks were lost: a drive that stood still meanwhile cannot be
 * asked for the distance of all of them in one (the clock of the move stands
 * meanwhile, see clock_ns). */
#include <stddef.h>

#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

/* Each set point is rounded to within 2 units of 2^-32; three of them, with
 * weights up to 2; 16 with the limits, which are rounded up by 2 at most. */
#define GATE_ROUNDING 14

/* v T, rounded up; beyond the format there is no limit. */
static int64_t gate_step(int64_t vel_q32, int64_t period_ns)
{
    const int64_t step_q32 =
        motion_fixed_muldiv_sat(vel_q32, period_ns, INT64_C(1000000000));
    return step_q32 < INT64_MAX / 4 ? step_q32 + 1 : INT64_MAX / 4;
}

/* a T^2 */
static int64_t gate_acc(int64_t acc_q32, int64_t period_ns)
{
    return gate_step(
        motion_fixed_muldiv_sat(acc_q32, period_ns, INT64_C(1000000000)),
        period_ns);
}

void controller_gate_init(struct controller *controller, unsigned index)
{
    const struct controller_axis_config *config =
        &controller->config.axis[index];
    struct controller_axis *axis = &controller->axis[index];
    const int64_t period_ns = controller->config.period_ns;
    axis->gate_vel_q32 = gate_step(config->limit.vel_q32, period_ns);
    axis->limit_acc_q32 = gate_acc(config->limit.acc_q32, period_ns);
    axis->gate_acc_q32 = gate_acc(config->stop.acc_q32 > config->limit.acc_q32
                                      ? config->stop.acc_q32
                                      : config->limit.acc_q32,
                                  period_ns);
}

static bool gate_judge(int64_t value, int64_t most, int64_t *bad,
                       int64_t *allowed)
{
    *bad = value;
    *allowed = most;
    return motion_fixed_abs(value) <= (uint64_t)most + GATE_ROUNDING;
}

bool controller_gate_steps(const struct controller_axis *axis, int64_t acc_q32,
                           int64_t step, int64_t before)
{
    int64_t bad, allowed;
    return gate_judge(step, axis->gate_vel_q32, &bad, &allowed) &&
           gate_judge(before, axis->gate_vel_q32, &bad, &allowed) &&
           gate_judge(step - before, acc_q32, &bad, &allowed);
}

static int64_t gate_least(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

static int64_t gate_most(int64_t a, int64_t b)
{
    return a > b ? a : b;
}

void controller_gate_mark(struct controller *controller, unsigned index,
                          int64_t pos_q32)
{
    struct controller_axis *axis = &controller->axis[index];
    const bool is_new =
        axis->sent_count == 0 || !controller_range_counts(controller, index);
    axis->highest_q32 =
        is_new ? pos_q32 : gate_most(axis->highest_q32, pos_q32);
    axis->lowest_q32 = is_new ? pos_q32 : gate_least(axis->lowest_q32, pos_q32);
}

/* The first set point is where the axis stands, inside its range or not, but
 * for what it moved since it was measured. */
bool controller_gate_range(const struct controller *controller, unsigned index,
                           int64_t low_q32, int64_t high_q32)
{
    const struct controller_axis_config *config =
        &controller->config.axis[index];
    const struct controller_axis *axis = &controller->axis[index];
    int64_t from_low_q32 = axis->highest_q32, from_high_q32 = axis->lowest_q32;
    int64_t slack_q32 = MOTION_TRACK_POS_ROUNDING;
    if (!controller_range_counts(controller, index))
        return true;
    if (axis->sent_count == 0) {
        from_low_q32 = from_high_q32 = axis->feedback.pos_q32;
        slack_q32 = config->following_floor_q32;
    }
    if (low_q32 >= config->pos_min_q32 - MOTION_TRACK_POS_ROUNDING)
        from_low_q32 = low_q32;
    if (high_q32 <= config->pos_max_q32 + MOTION_TRACK_POS_ROUNDING)
        from_high_q32 = high_q32;
    return (low_q32 >= from_low_q32 ||
            (uint64_t)from_low_q32 - (uint64_t)low_q32 <=
                (uint64_t)slack_q32) &&
           (high_q32 <= from_high_q32 ||
            (uint64_t)high_q32 - (uint64_t)from_high_q32 <=
                (uint64_t)slack_q32);
}

bool controller_gate_pass(const struct controller *controller, unsigned index,
                          int64_t pos_q32, int64_t *value, int64_t *limit)
{
    const struct controller_axis *axis = &controller->axis[index];
    if (!controller_gate_range(controller, index, pos_q32, pos_q32)) {
        const struct controller_axis_config *config =
            &controller->config.axis[index];
        *value = pos_q32;
        *limit = pos_q32 < config->pos_min_q32 ? config->pos_min_q32
                                               : config->pos_max_q32;
        return false;
    }
    if (axis->sent_count == 0)
        return true;
    int64_t d1;
    if (motion_fixed_sub(pos_q32, axis->sent_q32[0], &d1) < 0 ||
        !gate_judge(d1, axis->gate_vel_q32, value, limit))
        return false;
    if (axis->sent_count == 1)
        return true;
    /* both are at most INT64_MAX / 4 + GATE_ROUNDING */
    const int64_t d2 = axis->sent_q32[0] - axis->sent_q32[1];
    return gate_judge(d1 - d2, axis->gate_acc_q32, value, limit);
}

void controller_gate_sent(struct controller *controller, unsigned index,
                          int64_t pos_q32)
{
    struct controller_axis *axis = &controller->axis[index];
    if (axis->sent_count == 0 || !controller_range_counts(controller, index))
        controller_gate_mark(controller, index, pos_q32);
    for (unsigned i = CONTROLLER_HISTORY - 1; i > 0; i--) {
        axis->sent_q32[i] = axis->sent_q32[i - 1];
        axis->sent_ns[i] = axis->sent_ns[i - 1];
    }
    axis->sent_q32[0] = pos_q32;
    axis->sent_ns[0] = controller->now_ns;
    if (axis->sent_count < CONTROLLER_HISTORY)
        axis->sent_count++;
}
