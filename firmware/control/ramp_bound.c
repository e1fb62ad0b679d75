/* firmware/control/ramp_bound.c - how steep a change of rate may be, and how
 * long it then takes.
 *
 * On an axis that runs at path speed v and path acceleration a, a ramp within
 * |r'| <= A, |r''| <= J takes, beside what the track takes itself,
 *     acceleration  v A        jerk  v J + 3 a r A
 * so A = acc / v (and jerk / 3 a r) and J = jerk / v are where it alone would
 * use the whole limit. */
#include <stddef.h>

#include "firmware/control/ramp.h"
#include "firmware/control/ramp_step.h"

/* r' takes at least so many ticks to its peak, and r so many from 1 to 0. */
#define RAMP_TICKS_MIN 2

bool controller_slows(const struct controller *controller)
{
    return (controller->state == CONTROLLER_HOLDING ||
            controller->state == CONTROLLER_STOPPING) &&
           controller->wanted_q30 == 0 && controller->rest_by_ns != 0;
}

int64_t controller_due_ns(const struct controller *controller)
{
    return controller_slows(controller) ? controller->rest_by_ns : INT64_MAX;
}

/* How fast and how steep an axis is, on its path. */
struct ramp_speed {
    int64_t vel_q32, acc_q32;
};

/* Narrow A and J down to what one axis leaves. */
static void ramp_narrow(struct ramp_bound *bound,
                        const struct motion_clock_limit *limit,
                        const struct ramp_speed *speed, int64_t rate_q30)
{
    if (speed->vel_q32 > 0)
        bound->accel_q30 = motion_fixed_least(
            bound->accel_q30,
            motion_fixed_muldiv_sat(limit->acc_q32, (int64_t)1 << 30,
                                    speed->vel_q32));
    if (limit->jerk_q32 == 0)
        return;
    if (speed->vel_q32 > 0)
        bound->jerk_q30 = motion_fixed_least(
            bound->jerk_q30,
            motion_fixed_muldiv_sat(limit->jerk_q32, (int64_t)1 << 30,
                                    speed->vel_q32));
    if (speed->acc_q32 > 0 && rate_q30 > 0)
        bound->accel_q30 = motion_fixed_least(
            bound->accel_q30,
            motion_fixed_muldiv_sat(
                motion_fixed_muldiv_sat(
                    limit->jerk_q32, (int64_t)1 << 30,
                    motion_fixed_muldiv_sat(3, speed->acc_q32, 1)),
                (int64_t)1 << 30, rate_q30));
}

/* Without a limit of the axes: what whole ticks leave. */
static struct ramp_bound ramp_widest(const struct controller *controller)
{
    return (struct ramp_bound){
        motion_fixed_muldiv_sat(MOTION_CLOCK_WARP_ONE_Q30, RAMP_SECOND_NS,
                                RAMP_TICKS_MIN * controller->config.period_ns),
        INT64_MAX,
    };
}

static struct ramp_bound ramp_finish(const struct controller *controller,
                                     struct ramp_bound bound)
{
    bound.accel_q30 = motion_fixed_most(bound.accel_q30, 1);
    const int64_t jerk_q30 =
        motion_fixed_muldiv_sat(bound.accel_q30, RAMP_SECOND_NS,
                                RAMP_TICKS_MIN * controller->config.period_ns);
    bound.jerk_q30 = motion_fixed_least(motion_fixed_most(bound.jerk_q30, 1),
                                        motion_fixed_most(jerk_q30, 1));
    return bound;
}

struct motion_clock_limit controller_limit(const struct controller *controller,
                                           unsigned axis, bool stop)
{
    const struct controller_axis_config *config =
        &controller->config.axis[axis];
    struct motion_clock_limit limit = stop ? config->stop : config->limit;
    if (controller->couplings != NULL)
        controller->couplings->reduce(controller, axis, stop, &limit);
    if (controller->gantries != NULL)
        controller->gantries->reduce(controller, axis, stop, &limit);
    return limit;
}

struct motion_clock_limit
controller_ramp_limit(const struct controller *controller, unsigned axis,
                      bool stop)
{
    const struct motion_clock_limit limit =
        controller_limit(controller, axis, false);
    struct motion_clock_limit used = controller_limit(controller, axis, stop);
    used.acc_q32 = motion_fixed_least(
        used.acc_q32,
        motion_fixed_muldiv_sat(limit.acc_q32, RAMP_STOP_TIMES, 1));
    if (used.jerk_q32 > 0)
        used.jerk_q32 = motion_fixed_least(
            used.jerk_q32,
            motion_fixed_muldiv_sat(limit.jerk_q32, RAMP_STOP_TIMES, 1));
    return used;
}

struct ramp_bound controller_ramp_bound(const struct controller *controller,
                                        int64_t rate_q30, bool stop)
{
    struct ramp_bound bound = ramp_widest(controller);
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        const struct controller_axis *axis = &controller->axis[i];
        if (!axis->track)
            continue;
        const struct ramp_speed speed = {
            axis->vel_peak_q32, controller_peak(axis->track, MOTION_ACC)
        };
        const struct motion_clock_limit limit =
            controller_ramp_limit(controller, i, stop);
        ramp_narrow(&bound, &limit, &speed, rate_q30);
    }
    return ramp_finish(controller, bound);
}

/* Rest is due within 8 ticks, 4 r / A and A / J (ramp_step.h), at a rate of r at most,
 * on an axis that does r times the track's speed. */
int64_t controller_ramp_reserve(const struct controller *controller,
                                unsigned index,
                                const struct motion_track *track,
                                int64_t rate_q30)
{
    const struct ramp_speed speed = { controller_peak(track, MOTION_VEL),
                                      controller_peak(track, MOTION_ACC) };
    struct ramp_bound bound = ramp_widest(controller);
    const struct motion_clock_limit limit =
        controller_ramp_limit(controller, index, true);
    ramp_narrow(&bound, &limit, &speed, rate_q30);
    bound = ramp_finish(controller, bound);
    const int64_t rate_ns =
        motion_fixed_muldiv_sat(4 * rate_q30, RAMP_SECOND_NS, bound.accel_q30);
    const int64_t jerk_ns = motion_fixed_muldiv_sat(
        bound.accel_q30, RAMP_SECOND_NS, bound.jerk_q30);
    const int64_t ns = motion_fixed_least(rate_ns, RAMP_MAX_NS) +
                       motion_fixed_least(jerk_ns, RAMP_MAX_NS) +
                       8 * controller->config.period_ns;
    return motion_fixed_muldiv_sat(ns * MOTION_FIXED_NS_Q12, rate_q30,
                                   MOTION_CLOCK_WARP_ONE_Q30);
}
