/* firmware/controller_gate.c - the last gate before the bus.
 *
 * Whatever went wrong before it, a set point leaves only when it is inside the
 * position range and the step from the set points sent before stays inside
 * speed and acceleration.  A violation is a fault, never a silent clamp.
 *
 * With d2 and d1 the steps between the last three set points,
 *     |d1| <= v T          |d1 - d2| <= a T^2
 * which hold for every curve inside the limits: the second difference of a
 * curve is T^2 times its acceleration at some point between.  T is one period
 * also where ticks were lost: a drive that stood still meanwhile cannot be
 * asked for the distance of all of them in one (the clock of the move stands
 * meanwhile, see clock_ns). */
#include <stddef.h>

#include "firmware/controller_parts.h"
#include "motion/err.h"
#include "motion/fixed.h"

/* Each set point is rounded to within 2 units of 2^-32; three of them, with
 * weights up to 2, and the rounding of the limits. */
#define GATE_ROUNDING 16

/* Limits per tick: v T and a T^2, rounded up, Q32.32.  Plan-time. */
void controller_gate_init(struct controller *controller, unsigned index)
{
    const struct controller_axis_config *config =
        &controller->config.axis[index];
    struct controller_axis *axis = &controller->axis[index];
    const int64_t period_ns = controller->config.period_ns;
    const int64_t second_ns = INT64_C(1000000000);
    const int64_t acc_q16 = config->stop.acc_q16 > config->limit.acc_q16
                                ? config->stop.acc_q16
                                : config->limit.acc_q16;
    int64_t step_q32, dv_q32;
    axis->gate_vel_q32 = INT64_MAX / 4;
    axis->gate_acc_q32 = INT64_MAX / 4;
    if (motion_fixed_muldiv(config->limit.vel_q32, period_ns, second_ns,
                            &step_q32) == MOTION_OK)
        axis->gate_vel_q32 = step_q32 + 1;
    if (motion_fixed_muldiv(acc_q16, period_ns * 65536, second_ns, &dv_q32) ==
            MOTION_OK &&
        motion_fixed_muldiv(dv_q32, period_ns, second_ns, &step_q32) ==
            MOTION_OK)
        axis->gate_acc_q32 = step_q32 + 1;
}

static bool gate_judge(int64_t value, int64_t most, int64_t *bad,
                       int64_t *allowed)
{
    *bad = value;
    *allowed = most;
    return motion_fixed_abs(value) <= (uint64_t)most + GATE_ROUNDING;
}

/* Inside the range; or, where the axis stands outside (homing found it there),
 * no further out than the set point before. */
static bool gate_range(const struct controller_axis_config *config,
                       const struct controller_axis *axis, int64_t pos_q32,
                       int64_t *bad, int64_t *allowed)
{
    int64_t low_q32 = config->pos_min_q32 - MOTION_TRACK_POS_ROUNDING;
    int64_t high_q32 = config->pos_max_q32 + MOTION_TRACK_POS_ROUNDING;
    if (axis->sent_count > 0 && axis->sent_q32[0] < low_q32)
        low_q32 = axis->sent_q32[0];
    if (axis->sent_count > 0 && axis->sent_q32[0] > high_q32)
        high_q32 = axis->sent_q32[0];
    *bad = pos_q32;
    *allowed = pos_q32 < low_q32 ? low_q32 : high_q32;
    return pos_q32 >= low_q32 && pos_q32 <= high_q32;
}

bool controller_gate_pass(const struct controller *controller, unsigned index,
                          int64_t pos_q32, int64_t *value, int64_t *limit)
{
    const struct controller_axis *axis = &controller->axis[index];
    if (controller_range_counts(controller, index) &&
        !gate_range(&controller->config.axis[index], axis, pos_q32, value,
                    limit))
        return false;
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
    for (unsigned i = CONTROLLER_HISTORY - 1; i > 0; i--) {
        axis->sent_q32[i] = axis->sent_q32[i - 1];
        axis->sent_ns[i] = axis->sent_ns[i - 1];
    }
    axis->sent_q32[0] = pos_q32;
    axis->sent_ns[0] = controller->now_ns;
    if (axis->sent_count < CONTROLLER_HISTORY)
        axis->sent_count++;
}
