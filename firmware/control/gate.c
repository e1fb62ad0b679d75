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
 * meanwhile, see clock_ns).
 *
 * What may be beyond them.  A set point is off a curve inside the limits by e at
 * most, so d1 by 2 e and d1 - d2 by 4 e; with what a step of the speed adds, that is
 * R, and v T + R / 2 and a T^2 + R are let pass.  In units of 2^-32:
 *
 *   digits    Of a segment with steps of q = 2^-frac, frac > 0: sampling is within 2
 *             (track.h) and coefficients, rounded to q / 2^k and the last one to 1.5 q,
 *             make 2 q, which is below 1.  Where a segment travels far (frac <= 0) it
 *             is 2 q for sampling, 2 q, and q for the remainder of the travel.
 *             4 e <= 12, or 20 q.
 *   time      At a rate that is not 1 path time is rounded to half of 2^-12 ns, and in
 *             a ramp of 2^20 ticks at most by 2 dur / 2^56 besides (clock_warp.c).
 *             The path goes by at v at most.  4 e <= v / 2^40.9 + v T / 2^33.
 *   rate      A ramp begins at a rate that is rounded to 2^-31 and ends in its target
 *             but for 2^-31 (ramp_step.c); of the three set points one is at such a
 *             place.  v T / 2^30.
 *   follower  Its curve is read where its master was told to be (couple.c): its own
 *             digits, and those of the master times the largest slope.
 *
 * A plan may be over a by 2^-28 of it, and step in speed where segments meet by a
 * hundredth of what the limits let happen in a period (motion/plan/check.c), of which
 * a rate of 2 makes twice as much: a T^2 / 50, or, with a limit of jerk, j T^3 / 50
 * where that is less. */
#include <stddef.h>

#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define GATE_SECOND_NS INT64_C(1000000000)
#define GATE_STEP      50 /* the part of a T^2 that a step may add */
#define GATE_DIGITS    12

/* Times T, rounded up; beyond the format there is no limit. */
static int64_t gate_times(int64_t value_q32, int64_t period_ns)
{
    return motion_fixed_least(
               motion_fixed_muldiv_sat(value_q32, period_ns, GATE_SECOND_NS),
               INT64_MAX / 8) +
           1;
}

static int64_t gate_acc(int64_t acc_q32, int64_t period_ns)
{
    return gate_times(gate_times(acc_q32, period_ns), period_ns);
}

void controller_gate_init(struct controller *controller, unsigned index)
{
    const struct controller_axis_config *config =
        &controller->config.axis[index];
    struct controller_axis *axis = &controller->axis[index];
    const int64_t period_ns = controller->config.period_ns;
    const int64_t limit_q32 = gate_acc(config->limit.acc_q32, period_ns);
    const int64_t most_q32 =
        motion_fixed_most(limit_q32, gate_acc(config->stop.acc_q32, period_ns));
    int64_t step_q32 = limit_q32;
    if (config->limit.jerk_q32 > 0)
        step_q32 = motion_fixed_least(
            step_q32,
            gate_times(gate_acc(config->limit.jerk_q32, period_ns), period_ns));
    axis->gate_vel_q32 = gate_times(config->limit.vel_q32, period_ns);
    axis->gate_acc_q32 = most_q32 + (most_q32 >> 28) + step_q32 / GATE_STEP;
    /* below 2^24 and, of a period of 20 ms, 2^29 */
    axis->rounding_q32 = (int32_t)(GATE_DIGITS + (config->limit.vel_q32 >> 40) +
                                   (axis->gate_vel_q32 >> 29));
}

/* 1 - frac of what an axis is read from in this tick, 0 where that is below 1. */
static inline uint32_t gate_far(const struct controller_axis *axis)
{
    const struct motion_track *track = axis->track;
    if (track == NULL && axis->cam != NULL)
        track = axis->cam->track;
    if (track == NULL)
        track = axis->along;
    if (track == NULL || axis->cursor.index >= track->count)
        return 0;
    const int8_t frac = track->segment[axis->cursor.index].frac;
    return frac > 0 ? 0 : (uint32_t)(1 - frac);
}

/* 20 q - 12 of the set point that goes furthest of these. */
static int64_t gate_digits(uint32_t far)
{
    uint32_t most = 0;
    for (; far != 0; far >>= 4)
        most = (far & 15) > most ? far & 15 : most;
    return most == 0 ? 0 : (INT64_C(10) << most) - GATE_DIGITS;
}

/* Of the last three set points, this one included. */
#define GATE_FAR(axis) ((axis)->sent_far & 0xfff)

/* What there is beside rounding_q32, of axes that go far, and that follow. */
__attribute__((noinline)) static int64_t
gate_more(const struct controller *controller,
          const struct controller_axis *axis)
{
    const struct controller_cam *cam = axis->cam;
    int64_t more_q32 = gate_digits(GATE_FAR(axis));
    if (cam != NULL && axis->track == NULL) {
        /* its master may have been sent already: one more */
        const struct controller_axis *master = &controller->axis[cam->master];
        more_q32 += ((cam->slope_q32 >> 32) + 1) *
                    (GATE_DIGITS +
                     gate_digits(master->sent_far << 4 | gate_far(master)));
    }
    return more_q32;
}

/* Within `most` and `rounding`?  Both fit. */
static bool gate_judge(int64_t value, int64_t most, int64_t rounding,
                       int64_t *bad, int64_t *allowed)
{
    *bad = value;
    *allowed = most;
    return motion_fixed_abs(value) <= (uint64_t)(most + rounding);
}

void controller_gate_mark(struct controller *controller, unsigned index,
                          int64_t pos_q32)
{
    struct controller_axis *axis = &controller->axis[index];
    const bool is_new =
        axis->sent_count == 0 || !controller_range_counts(controller, index);
    axis->highest_q32 =
        is_new ? pos_q32 : motion_fixed_most(axis->highest_q32, pos_q32);
    axis->lowest_q32 =
        is_new ? pos_q32 : motion_fixed_least(axis->lowest_q32, pos_q32);
}

/* From low to high, which rounding may have moved out by over_q32.  The first set
 * point is where the axis stands, inside its range or not, but for what it moved
 * since it was measured. */
static inline bool gate_is_inside(const struct controller *controller,
                                  unsigned index, int64_t low_q32,
                                  int64_t high_q32, int64_t over_q32)
{
    const struct controller_axis_config *config =
        &controller->config.axis[index];
    const struct controller_axis *axis = &controller->axis[index];
    int64_t from_low_q32 = axis->highest_q32, from_high_q32 = axis->lowest_q32;
    int64_t slack_q32 = over_q32;
    if (!controller_range_counts(controller, index))
        return true;
    if (axis->sent_count == 0) {
        from_low_q32 = from_high_q32 = controller_place_q32(axis);
        slack_q32 = config->following_floor_q32;
    }
    if (low_q32 >= config->pos_min_q32 - over_q32)
        from_low_q32 = low_q32;
    if (high_q32 <= config->pos_max_q32 + over_q32)
        from_high_q32 = high_q32;
    return (low_q32 >= from_low_q32 ||
            (uint64_t)from_low_q32 - (uint64_t)low_q32 <=
                (uint64_t)slack_q32) &&
           (high_q32 <= from_high_q32 ||
            (uint64_t)high_q32 - (uint64_t)from_high_q32 <=
                (uint64_t)slack_q32);
}

bool controller_gate_range(const struct controller *controller, unsigned index,
                           int64_t low_q32, int64_t high_q32)
{
    return gate_is_inside(controller, index, low_q32, high_q32,
                          MOTION_TRACK_POS_ROUNDING);
}

bool controller_gate_pass(struct controller *controller, unsigned index,
                          int64_t pos_q32, int64_t *value, int64_t *limit)
{
    struct controller_axis *axis = &controller->axis[index];
    const uint32_t far = gate_far(axis);
    axis->sent_far = axis->sent_far << 4 | far;
    if (!gate_is_inside(controller, index, pos_q32, pos_q32,
                        MOTION_TRACK_POS_ROUNDING << (far > 0 ? far - 1 : 0))) {
        const struct controller_axis_config *config =
            &controller->config.axis[index];
        *value = pos_q32;
        *limit = pos_q32 < config->pos_min_q32 ? config->pos_min_q32
                                               : config->pos_max_q32;
        return false;
    }
    if (axis->sent_count == 0)
        return true;
    int64_t d1, rounding_q32 = axis->rounding_q32;
    if (GATE_FAR(axis) != 0 || axis->cam != NULL)
        rounding_q32 += gate_more(controller, axis);
    if (motion_fixed_sub(pos_q32, axis->sent_q32[0], &d1) < 0 ||
        !gate_judge(d1, axis->gate_vel_q32, rounding_q32 / 2, value, limit))
        return false;
    if (axis->sent_count == 1)
        return true;
    /* both are at most INT64_MAX / 4 */
    const int64_t d2 = axis->sent_q32[0] - axis->sent_q32[1];
    return gate_judge(d1 - d2, axis->gate_acc_q32, rounding_q32, value, limit);
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
