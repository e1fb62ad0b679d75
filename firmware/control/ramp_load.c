/* firmware/control/ramp_load.c - what judging a ramp needs of the tracks, worked out
 * once when they are loaded; see ramp_limit.h. */
#include "firmware/control/parts.h"
#include "firmware/control/ramp.h"
#include "firmware/control/ramp_limit.h"

/* value / 2^bits as m / 2^e, m below 2^24, rounded up. */
static struct controller_scale limit_scale(int64_t value, int bits)
{
    value = motion_fixed_least(value, INT64_MAX - 1) + 1;
    for (; value > (1 << 24) - 1 || bits > 62; bits--)
        value = (value >> 1) + 1;
    return (struct controller_scale){ (uint32_t)value, (uint8_t)bits };
}

/* seconds Q40 of so many ticks as 1 / tick, Q30 */
static int64_t limit_ticks_q30(int64_t s_q40, int64_t tick_ns)
{
    return motion_fixed_muldiv_sat(s_q40, RAMP_SECOND_NS, tick_ns) >> 10;
}

static int64_t limit_peak_vel(const struct controller *controller, unsigned i)
{
    return motion_fixed_most(controller->axis[i].vel_peak_q32, 1);
}

/* A little more than a / b, Q40. */
static int64_t limit_above(int64_t a, int64_t b)
{
    return motion_fixed_least(motion_fixed_muldiv_sat(a, (int64_t)1 << 40, b),
                              INT64_MAX - 1) +
           1;
}

/* G and K, s, Q40. */
static void limit_units(const struct controller *controller, int64_t *g_q40,
                        int64_t *k_q40)
{
    *g_q40 = 1;
    *k_q40 = 0;
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        if (!controller->axis[i].track)
            continue;
        const struct motion_clock_limit limit =
            controller_limit(controller, i, false);
        *g_q40 = motion_fixed_most(
            *g_q40, limit_above(limit_peak_vel(controller, i), limit.acc_q32));
        if (limit.jerk_q32 > 0)
            *k_q40 = motion_fixed_most(
                *k_q40, limit_above(limit.acc_q32, limit.jerk_q32));
    }
}

/* Return a stop limit in units of the limit. */
static int32_t limit_stop(int64_t stop_q32, int64_t limit_q32)
{
    if (limit_q32 == 0)
        return 0;
    return (int32_t)motion_fixed_muldiv_sat(stop_q32, RAMP_LIMIT_ONE,
                                            limit_q32);
}

/* Of the largest, Q31, rounded up. */
static int32_t limit_part(int64_t own_q40, int64_t most_q40)
{
    return (int32_t)motion_fixed_least(
        motion_fixed_muldiv_sat(own_q40, (int64_t)1 << 31, most_q40) + 1,
        INT32_MAX);
}

static void limit_of_axis(struct controller *controller, unsigned i,
                          int64_t g_q40, int64_t k_q40)
{
    struct controller_share *share = &controller->axis[i].share;
    const struct motion_clock_limit limit =
        controller_limit(controller, i, false);
    const struct motion_clock_limit stop =
        controller_ramp_limit(controller, i, true);
    const int64_t one_q32[3] = { limit_peak_vel(controller, i), limit.acc_q32,
                                 limit.jerk_q32 };
    motion_track_unit_init(&share->unit, one_q32);
    share->vel_q31 = limit_part(
        motion_fixed_muldiv_sat(one_q32[0], (int64_t)1 << 40, limit.acc_q32),
        g_q40);
    share->share_q31 =
        limit.jerk_q32 == 0
            ? 0
            : limit_part(motion_fixed_muldiv_sat(
                             limit.acc_q32, (int64_t)1 << 40, limit.jerk_q32),
                         k_q40);
    share->vel_share_q31 = (int32_t)motion_fixed_least(
        ((int64_t)share->vel_q31 * share->share_q31 >> 31) + 1, INT32_MAX);
    share->stop_acc = limit_stop(stop.acc_q32, limit.acc_q32);
    share->stop_jerk = limit_stop(stop.jerk_q32, limit.jerk_q32);
}

void controller_limit_load(struct controller *controller)
{
    struct controller_scales *scales = &controller->step.scales;
    const int64_t tick_ns = controller->config.period_ns;
    int64_t g_q40, k_q40;
    limit_units(controller, &g_q40, &k_q40);
    const int64_t g = limit_ticks_q30(g_q40, tick_ns);
    const int64_t k = limit_ticks_q30(k_q40, tick_ns);
    /* from Q56 to Q24 */
    scales->accel = limit_scale(g, 30 + 32);
    scales->cross_q12 = (int32_t)motion_fixed_least(
        motion_fixed_muldiv_sat(3 * k, 1 << 12, motion_fixed_most(g, 1)) +
            (k > 0 ? 1 : 0),
        (int64_t)1 << 30);
    scales->jerk =
        limit_scale(motion_fixed_muldiv_sat(g, k, (int64_t)1 << 30), 30 + 32);
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (controller->axis[i].track)
            limit_of_axis(controller, i, g_q40, k_q40);
}
