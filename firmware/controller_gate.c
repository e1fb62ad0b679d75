/* firmware/controller_gate.c - the last gate before the bus.
 *
 * Whatever went wrong before it, a set point leaves only when it is inside the
 * position range and the step from the set points sent before stays inside
 * speed and acceleration.  A violation is a fault, never a silent clamp.
 *
 * With the last three set points n2 and n1 ticks apart and d2, d1 the steps,
 *     |d1| <= v T n1          |d1 n2 - d2 n1| <= a T^2 n1 n2 (n1 + n2) / 2
 * which hold for every curve inside the limits: the second divided difference
 * of a curve is half its acceleration at some point between. */
#include <stddef.h>

#include "firmware/controller_parts.h"
#include "motion/err.h"
#include "motion/fixed.h"

#define GATE_TICKS_MAX 1024 /* longer gaps start anew */
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

/* |value| <= limit * factor / 2^shift, with room for rounding. */
static bool gate_judge(int64_t value, int64_t limit, int64_t factor,
                       unsigned shift, int64_t rounding, int64_t *bad,
                       int64_t *allowed)
{
    int64_t most;
    if (motion_fixed_mulshift(limit, factor, shift, &most) < 0)
        return true; /* beyond the format, so beyond any value */
    *bad = value;
    *allowed = most;
    return motion_fixed_abs(value) <= (uint64_t)most + (uint64_t)rounding;
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

/* Ticks since the set point `age` places back, 0 when that is no base for a
 * slope any more. */
static int64_t gate_ticks(const struct controller_axis *axis, unsigned age,
                          uint64_t tick)
{
    if (axis->sent_count <= age)
        return 0;
    const uint64_t ticks = tick - axis->sent_tick[age];
    return ticks <= GATE_TICKS_MAX ? (int64_t)ticks : 0;
}

bool controller_gate_pass(const struct controller *controller, unsigned index,
                          int64_t pos_q32, int64_t *value, int64_t *limit)
{
    const struct controller_axis *axis = &controller->axis[index];
    if (controller_range_counts(controller, index) &&
        !gate_range(&controller->config.axis[index], axis, pos_q32, value,
                    limit))
        return false;
    const int64_t n1 = gate_ticks(axis, 0, controller->ticks);
    if (n1 == 0)
        return true;
    int64_t d1;
    if (motion_fixed_sub(pos_q32, axis->sent_q32[0], &d1) < 0 ||
        !gate_judge(d1, axis->gate_vel_q32, n1, 0, GATE_ROUNDING, value, limit))
        return false;
    const int64_t n2 = gate_ticks(axis, 1, axis->sent_tick[0]);
    if (n2 == 0)
        return true;
    /* |d| < 2^52 for any speed limit below 2^20 unit per tick; n <= 2^10 */
    const int64_t d2 = axis->sent_q32[0] - axis->sent_q32[1];
    return gate_judge(d1 * n2 - d2 * n1, axis->gate_acc_q32,
                      n1 * n2 * (n1 + n2), 1, GATE_ROUNDING * (n1 + n2), value,
                      limit);
}

void controller_gate_sent(struct controller *controller, unsigned index,
                          int64_t pos_q32)
{
    struct controller_axis *axis = &controller->axis[index];
    for (unsigned i = CONTROLLER_HISTORY - 1; i > 0; i--) {
        axis->sent_q32[i] = axis->sent_q32[i - 1];
        axis->sent_ns[i] = axis->sent_ns[i - 1];
        axis->sent_tick[i] = axis->sent_tick[i - 1];
    }
    axis->sent_q32[0] = pos_q32;
    axis->sent_ns[0] = controller->now_ns;
    axis->sent_tick[0] = controller->ticks;
    if (axis->sent_count < CONTROLLER_HISTORY)
        axis->sent_count++;
}
