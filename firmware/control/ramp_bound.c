/* firmware/control/ramp_bound.c - how steep a change of rate may be, and how
 * long it then takes.
 *
 * On an axis that runs at path speed v and path acceleration a, a ramp within
 * |r'| <= A, |r''| <= J takes, beside what the track takes itself,
 *     acceleration  v A        jerk  v J + 3 a r A
 * so A = acc / v (and jerk / 3 a r) and J = jerk / v are where it alone would
 * use the whole limit. */
#include "firmware/control/ramp.h"

/* r' takes at least so many ticks to its peak, and r so many from 1 to 0. */
#define RAMP_TICKS_MIN 2

/* The state of the clock from which a ramp would start now. */
struct motion_clock_rate
controller_ramp_now(const struct controller *controller)
{
    struct motion_clock_rate now;
    motion_clock_warp_at(&controller->warp, controller->clock_ns, &now);
    now.s_ns_q12 = ramp_least(now.s_ns_q12, controller->move_end_ns_q12);
    return now;
}

/* How fast and how steep an axis is, on its path. */
struct ramp_speed {
    int64_t vel_q32, acc_q32;
};

/* At its fastest and steepest. */
static struct ramp_speed ramp_speed_peak(const struct controller *controller,
                                         unsigned index)
{
    const struct controller_axis *axis = &controller->axis[index];
    return (struct ramp_speed){ axis->vel_peak_q32, axis->acc_peak_q32 };
}

/* Narrow A and J down to what one axis leaves. */
static void ramp_narrow(struct motion_clock_bound *bound,
                        const struct motion_clock_limit *limit,
                        const struct ramp_speed *speed, int64_t rate_q30)
{
    if (speed->vel_q32 > 0)
        bound->accel_q30 = ramp_least(
            bound->accel_q30,
            ramp_muldiv(limit->acc_q32, (int64_t)1 << 30, speed->vel_q32));
    if (limit->jerk_q32 == 0)
        return;
    if (speed->vel_q32 > 0)
        bound->jerk_q30 = ramp_least(
            bound->jerk_q30,
            ramp_muldiv(limit->jerk_q32, (int64_t)1 << 30, speed->vel_q32));
    if (speed->acc_q32 > 0 && rate_q30 > 0)
        bound->accel_q30 = ramp_least(
            bound->accel_q30,
            ramp_muldiv(ramp_muldiv(limit->jerk_q32, (int64_t)1 << 30,
                                    ramp_muldiv(3, speed->acc_q32, 1)),
                        (int64_t)1 << 30, rate_q30));
}

/* Without a limit of the axes: what whole ticks leave. */
static struct motion_clock_bound
ramp_widest(const struct controller *controller)
{
    return (struct motion_clock_bound){
        ramp_muldiv(MOTION_CLOCK_WARP_ONE_Q30, RAMP_SECOND_NS,
                    RAMP_TICKS_MIN * controller->config.period_ns),
        INT64_MAX,
    };
}

static struct motion_clock_bound
ramp_finish(const struct controller *controller,
            struct motion_clock_bound bound, unsigned divisor)
{
    bound.accel_q30 = ramp_most(bound.accel_q30 / divisor, 1);
    const int64_t jerk_q30 =
        ramp_muldiv(bound.accel_q30, RAMP_SECOND_NS,
                    RAMP_TICKS_MIN * controller->config.period_ns);
    bound.jerk_q30 = ramp_least(ramp_most(bound.jerk_q30 / divisor, 1),
                                ramp_most(jerk_q30, 1));
    return bound;
}

struct motion_clock_bound
controller_ramp_bound(const struct controller *controller,
                      const struct motion_clock_rate *now, bool stop,
                      unsigned divisor)
{
    const int64_t rate_q30 = ramp_most(now->rate_q30, controller->wanted_q30);
    struct motion_clock_bound bound = ramp_widest(controller);
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        if (!controller->axis[i].track)
            continue;
        const struct motion_clock_limit *limit =
            ramp_limit(controller, i, stop);
        const struct ramp_speed speed = ramp_speed_peak(controller, i);
        ramp_narrow(&bound, limit, &speed, rate_q30);
    }
    return ramp_finish(controller, bound, divisor);
}

/* p''' = own + f' r'' stays inside the limit while r'' of this sign is at most
 * (jerk - own) / f', or (jerk + own) / f' where it works against it. */
static int64_t ramp_margin(const struct controller *controller,
                           const struct motion_clock_rate *now,
                           const struct motion_track *track, int64_t most_q32,
                           bool down)
{
    struct motion_state state, axis;
    struct motion_clock_rate straight = *now;
    straight.jerk_q30 = 0;
    controller_path_state(controller, track, now->s_ns_q12, &state);
    motion_clock_warp_chain(&straight, &state, &axis);
    const bool against = (axis.jerk_q32 < 0) != ((state.vel_q32 < 0) != down);
    const int64_t own_q32 = ramp_size(axis.jerk_q32);
    if (state.vel_q32 == 0 || (against && own_q32 > INT64_MAX - most_q32))
        return INT64_MAX;
    return ramp_muldiv(against ? most_q32 + own_q32
                               : ramp_most(most_q32 - own_q32, 0),
                       (int64_t)1 << 30, ramp_size(state.vel_q32));
}

int64_t controller_ramp_margin(const struct controller *controller,
                               const struct motion_clock_rate *now, bool down,
                               bool stop)
{
    int64_t jerk_q30 = INT64_MAX;
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        const struct motion_track *track = controller->axis[i].track;
        const int64_t most_q32 = ramp_limit(controller, i, stop)->jerk_q32;
        if (track && most_q32 > 0)
            jerk_q30 = ramp_least(
                jerk_q30, ramp_margin(controller, now, track, most_q32, down));
    }
    return jerk_q30;
}

struct motion_clock_bound
controller_ramp_steepest(const struct controller *controller,
                         const struct motion_clock_rate *now, bool stop)
{
    const bool down = controller->wanted_q30 < now->rate_q30;
    struct motion_clock_bound bound = ramp_widest(controller);
    bound = ramp_finish(controller, bound, 1);
    int64_t margin_q30 = controller_ramp_margin(controller, now, down, stop);
    if (now->accel_q30 != 0)
        margin_q30 = ramp_most(
            margin_q30, controller_ramp_margin(controller, now, !down, stop));
    bound.jerk_q30 = ramp_most(ramp_least(bound.jerk_q30, margin_q30), 1);
    const int64_t change_q30 =
        ramp_size(controller->wanted_q30 - now->rate_q30);
    const int64_t square_q30 =
        ramp_muldiv(bound.jerk_q30, change_q30, (int64_t)1 << 30);
    const int64_t peak_q30 =
        (int64_t)motion_fixed_isqrt_u64((uint64_t)square_q30) << 15;
    const int64_t most_q30 =
        ramp_most(peak_q30, 1 << 15) + ramp_size(now->accel_q30);
    bound.accel_q30 = ramp_least(bound.accel_q30, most_q30);
    return bound;
}

/* How long a ramp to `rate_q30` takes, in ns. */
static int64_t ramp_duration(const struct controller *controller,
                             const struct motion_clock_rate *now,
                             int64_t rate_q30,
                             const struct motion_clock_bound *bound)
{
    int64_t n[MOTION_CLOCK_WARP_PIECES];
    if (motion_clock_warp_ticks(now, rate_q30, bound,
                                controller->config.period_ns, n) < 0)
        return MOTION_CLOCK_WARP_RAMP_MAX_NS;
    return (n[0] + n[1] + n[2]) * controller->config.period_ns;
}

/* An r' that was reached at a low speed may be too steep for the J of the peak:
 * bringing it to 0 may raise the rate by a quarter, r'^2 / 2J = 1/4. */
static void ramp_steepen(struct motion_clock_bound *bound,
                         const struct motion_clock_rate *now)
{
    const int64_t accel = ramp_size(now->accel_q30);
    const int64_t jerk = ramp_muldiv(accel, accel, (int64_t)1 << 29);
    bound->jerk_q30 = ramp_most(bound->jerk_q30, jerk);
}

int64_t controller_ramp_rest_ns(const struct controller *controller,
                                const struct motion_clock_rate *now, bool stop,
                                unsigned divisor)
{
    struct motion_clock_bound bound =
        controller_ramp_bound(controller, now, stop, divisor);
    ramp_steepen(&bound, now);
    return ramp_duration(controller, now, 0, &bound);
}

int64_t controller_ramp_bound_ns(const struct controller *controller, bool stop)
{
    const struct motion_clock_rate now = controller_ramp_now(controller);
    const int64_t within_stop_ns =
        controller_ramp_rest_ns(controller, &now, true, 4) +
        controller->config.period_ns;
    return stop ? within_stop_ns
                : within_stop_ns +
                      controller_ramp_rest_ns(controller, &now, false, 4) +
                      controller_ramp_rest_ns(controller, &now, false, 1);
}

/* A ramp of the slowest kind from rate r to 0 goes r D / 2 of path time, on an
 * axis that does r times the track's speed. */
int64_t controller_ramp_reserve(const struct controller *controller,
                                unsigned index,
                                const struct motion_track *track,
                                int64_t rate_q30)
{
    const struct motion_clock_limit *limit =
        ramp_limit(controller, index, true);
    const struct ramp_speed speed = { controller_peak(track, MOTION_VEL),
                                      controller_peak(track, MOTION_ACC) };
    const struct motion_clock_rate now = { .rate_q30 = rate_q30 };
    struct motion_clock_bound bound = ramp_widest(controller);
    ramp_narrow(&bound, limit, &speed, rate_q30);
    bound = ramp_finish(controller, bound, 4);
    const int64_t ns = ramp_duration(controller, &now, 0, &bound);
    return ramp_muldiv(ns * (MOTION_FIXED_NS_Q12 / 2), rate_q30,
                       MOTION_CLOCK_WARP_ONE_Q30);
}
