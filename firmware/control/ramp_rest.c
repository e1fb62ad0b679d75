/* firmware/control/ramp_rest.c - by when a change of rate has come to rest; see
 * ramp_step.h. */
#include "firmware/control/ramp.h"
#include "firmware/control/ramp_step.h"

/* What a change shares with the track: it takes as long as within A and J by this. */
#define REST_K       3
#define REST_K_STOP  4
#define REST_MOST_Q4 (1 << 30)

/* Ticks that a ramp from the rate to 0 within A / k and J / k takes, k up to 4: with
 * x = k r / A and s = (k r / J)^1/2 they are x + s^2 / x where r' comes up to A / k,
 * for x >= s, else 2 s. */
static int64_t rest_ramp_ticks(const struct controller_step_rest *rest,
                               int64_t rate_q30, int32_t k)
{
    const int64_t cross_q4 = (int64_t)rest->cross_q4 * (rate_q30 >> 14) >> 16;
    const int64_t x_q4 =
        (k * motion_fixed_most(rest->accel_q4, cross_q4) * (rate_q30 >> 14) >>
         16) +
        1;
    const int64_t root_q14 =
        (int64_t)ramp_root((uint32_t)(k * (rate_q30 >> 2)) | 1) + 1;
    const int64_t s_q4 = (root_q14 * rest->root_q4 >> 14) + 1;
    const int64_t level_q4 = ramp_ratio(s_q4 * s_q4, x_q4);
    const int64_t ticks_q4 =
        x_q4 < s_q4 ? 2 * s_q4
                    : x_q4 + (level_q4 < RAMP_TICKS_MAX ? level_q4 : s_q4);
    return (ticks_q4 >> 4) + 1;
}

int64_t controller_step_stop_ticks(const struct controller *controller,
                                   int64_t rate_q30)
{
    return INT64_C(3) * RAMP_LEAD_MAX +
           rest_ramp_ticks(&controller->step.rest[1], rate_q30, REST_K_STOP);
}

int64_t controller_step_rest_ticks(const struct controller *controller,
                                   int64_t rate_q30, bool stop)
{
    const int64_t ticks = controller_step_stop_ticks(controller, rate_q30);
    return stop ? ticks
                : ticks + rest_ramp_ticks(&controller->step.rest[0], rate_q30,
                                          REST_K);
}

/* Ticks of a rise, r' = a, until the rate falls. */
static int64_t rest_shared_ticks(const struct controller *controller,
                                 int64_t a_q56, bool stop)
{
    return RAMP_LEAD_MAX +
           ramp_ratio(REST_K * (a_q56 >> 2),
                      controller->step.rest[stop ? 1 : 0].jerk_q56 >> 2);
}

/* Return the ticks of a rise for which no fall was judged, such as a scheduled one:
 * until it ends, and no longer than until the rate falls; and the rate then. */
static int64_t rest_rise_ticks(const struct controller *controller, bool stop,
                               int64_t *rate_q30)
{
    const struct motion_clock_warp *warp = &controller->warp;
    struct motion_clock_rate now;
    int64_t a_q56;
    const int64_t left = ramp_ratio(
        motion_fixed_most(ramp_end_ns(controller) - controller->clock_ns, 0),
        controller->config.period_ns);
    motion_clock_warp_at(warp, controller->clock_ns, &now);
    (void)motion_fixed_mulshift(now.accel_q30, controller->step.tick_q56, 30,
                                &a_q56);
    const int64_t shared =
        rest_shared_ticks(controller, motion_fixed_most(a_q56, 0), stop);
    *rate_q30 = warp->rate1_q30;
    if (shared >= left)
        return left;
    *rate_q30 = motion_fixed_least(*rate_q30, now.rate_q30 + a_q56 * shared /
                                                                 RAMP_Q30_Q56);
    return shared;
}

int64_t controller_step_bound_ns(const struct controller *controller, bool stop)
{
    int64_t rate_q30 = ramp_rate_q30(controller), ticks = 0;
    struct controller_step_fall fall;
    if (controller_step_fall(controller, stop, &fall)) {
        const int64_t a_q56 = fall.begin.accel_q56;
        ticks = motion_fixed_least(fall.ticks + 1,
                                   rest_shared_ticks(controller, a_q56, stop));
        rate_q30 =
            (fall.begin.rate_q56 + a_q56 / 2 * (ticks + 1)) / RAMP_Q30_Q56;
    } else if (controller->warp.rate1_q30 > rate_q30) {
        ticks = rest_rise_ticks(controller, stop, &rate_q30);
    }
    rate_q30 = motion_fixed_least(rate_q30, MOTION_CLOCK_WARP_MAX_Q30 - 1);
    ticks += controller_step_rest_ticks(controller, rate_q30, stop);
    return motion_fixed_least(ticks * controller->config.period_ns,
                              RAMP_MAX_NS);
}

static int32_t rest_q4(const struct controller *controller, int64_t accel_q30)
{
    const int64_t q4 = motion_fixed_muldiv_sat(
        16 * RAMP_SECOND_NS, (int64_t)1 << 30,
        motion_fixed_most(
            motion_fixed_muldiv_sat(accel_q30, controller->config.period_ns, 1),
            1));
    return (int32_t)motion_fixed_least(q4 + 1, REST_MOST_Q4);
}

struct controller_step_rest
controller_step_rest(const struct controller *controller, bool stop)
{
    const int64_t period_ns = controller->config.period_ns;
    const struct ramp_bound slow = controller_ramp_bound(controller, 0, stop);
    const struct ramp_bound fast =
        controller_ramp_bound(controller, MOTION_CLOCK_WARP_MAX_Q30, stop);
    const int64_t jerk_q56 = motion_fixed_most(
        motion_fixed_muldiv_sat(
            motion_fixed_muldiv_sat(slow.jerk_q30, period_ns, RAMP_SECOND_NS),
            period_ns * RAMP_Q30_Q56, RAMP_SECOND_NS),
        64);
    const int64_t root_q4 = (int64_t)motion_fixed_isqrt_u64(
                                ((uint64_t)1 << 63) / (uint64_t)jerk_q56 * 2) +
                            1;
    return (struct controller_step_rest){
        jerk_q56,
        rest_q4(controller, slow.accel_q30),
        rest_q4(controller, fast.accel_q30) / 2 + 1,
        (int32_t)motion_fixed_least(root_q4, REST_MOST_Q4),
    };
}
