/* firmware/control/ramp_judge.c - does a ramp keep every axis inside its
 * limits?
 *
 * It is judged at a few looks first, beginning where the candidate before it
 * failed, then by p', p'', p''' at every tick, or within bounds that hold between
 * ticks too (motion/core/clock_walk.h); where bounds do not reach, by the very
 * set points that would be sent and the formulas of the gate as well.  What is
 * within bounds passes the gate: its differences are means of p' and p''. */
#include "firmware/control/ramp.h"
#include "motion/core/clock_walk.h"

/* Looks per axis at first; what one candidate may take per axis after these,
 * dense tracks included. */
#define RAMP_LOOKS_FIRST 24
#define RAMP_LOOKS_AXIS  4096

/* Of p''', in units, beside what 2^-28 of the rates makes of f' and f''. */
#define RAMP_ROUNDING 4

/* The set point of an axis at a time of the clock. */
static int64_t ramp_set_point(const struct controller *controller,
                              const struct motion_clock_warp *warp,
                              unsigned index, struct motion_cursor *cursor,
                              int64_t t_ns)
{
    struct motion_clock_rate rate;
    struct motion_sample sample;
    motion_clock_warp_at(warp, t_ns, &rate);
    rate.s_ns_q12 = ramp_least(rate.s_ns_q12, controller->move_end_ns_q12);
    controller_path(controller, &rate);
    motion_track_sample(controller->axis[index].track, cursor, rate.s_ns_q12,
                        &sample);
    return sample.pos_q32;
}

/* The set point a tick before the ramp: of the one in force where it begins
 * later, else what was sent, this tick's apart where it was sent already (a
 * command comes between ticks; the one in force may itself begin now). */
static int64_t ramp_point_before(const struct controller *controller,
                                 const struct motion_clock_warp *warp,
                                 unsigned index, struct motion_cursor *cursor)
{
    const struct controller_axis *axis = &controller->axis[index];
    const unsigned newest =
        axis->sent_count > 0 && axis->sent_ns[0] == controller->now_ns ? 1 : 0;
    if (warp->t0_ns <= controller->clock_ns && axis->sent_count > newest)
        return axis->sent_q32[newest];
    return ramp_set_point(controller, &controller->warp, index, cursor,
                          warp->t0_ns - controller->config.period_ns);
}

/* Three set points a tick apart, at dt and beside it. */
struct ramp_points {
    struct motion_cursor cursor;
    int64_t dt; /* -1: none yet */
    int64_t before, here, after;
};

/* Would the gate let the set points at dt and beside it pass? */
static bool ramp_passes_gate(const struct controller *controller,
                             const struct motion_clock_warp *warp, bool stop,
                             unsigned index, int64_t dt,
                             struct ramp_points *points, int64_t *looks)
{
    const struct controller_axis *axis = &controller->axis[index];
    const int64_t period_ns = controller->config.period_ns;
    const int64_t t_ns = warp->t0_ns + dt;
    struct motion_cursor *cursor = &points->cursor;
    if (points->dt == dt)
        return true;
    if (points->dt >= 0 && points->dt + period_ns == dt) {
        points->before = points->here;
        points->here = points->after;
    } else {
        points->before =
            dt == 0 ? ramp_point_before(controller, warp, index, cursor)
                    : ramp_set_point(controller, warp, index, cursor,
                                     t_ns - period_ns);
        points->here = ramp_set_point(controller, warp, index, cursor, t_ns);
    }
    points->after =
        ramp_set_point(controller, warp, index, cursor, t_ns + period_ns);
    points->dt = dt;
    --*looks;
    return controller_gate_steps(
        axis, stop ? axis->gate_acc_q32 : axis->limit_acc_q32,
        points->after - points->here, points->here - points->before);
}

static bool ramp_within(int64_t value, int64_t limit, int64_t rounding)
{
    return ramp_size(value) - rounding - (limit >> 28) <= limit;
}

/* One axis at one time of a ramp. */
static bool ramp_keeps(const struct controller *controller,
                       const struct motion_clock_rate *now, unsigned index,
                       bool stop)
{
    const struct motion_clock_limit *limit =
        ramp_limit(controller, index, stop);
    struct motion_state state, axis;
    controller_path_state(controller, controller->axis[index].track,
                          now->s_ns_q12, &state);
    motion_clock_warp_chain(now, &state, &axis);
    const int64_t rounding = RAMP_ROUNDING + (ramp_size(state.vel_q32) >> 28) +
                             (ramp_size(state.acc_q32) >> 28);
    return ramp_within(axis.vel_q32, limit->vel_q32, RAMP_ROUNDING) &&
           ramp_within(axis.acc_q32, limit->acc_q32, rounding) &&
           (limit->jerk_q32 == 0 ||
            ramp_within(axis.jerk_q32, limit->jerk_q32, rounding));
}

/* Where the last candidate did not fit: rules out most of them. */
static bool ramp_seems_to_fit(const struct controller *controller,
                              const struct motion_clock_warp *warp, bool stop,
                              struct ramp_effort *effort)
{
    struct motion_clock_rate now;
    if (effort->dt_ns >= warp->dur_ns || !controller->axis[effort->axis].track)
        return true;
    effort->looks--;
    motion_clock_warp_at(warp, warp->t0_ns + effort->dt_ns, &now);
    return ramp_keeps(controller, &now, effort->axis, stop);
}

/* A time of the ramp, which runs backwards in what is played in reverse. */
static int64_t ramp_time(const struct controller *controller,
                         const struct motion_clock_warp *warp, int64_t dt)
{
    return controller->is_reversed ? warp->dur_ns - dt : dt;
}

/* Both ends of what lies between two looks and is not within bounds. */
static bool ramp_looks_pass_gate(const struct controller *controller,
                                 const struct motion_clock_warp *warp,
                                 bool stop, unsigned index,
                                 const struct motion_clock_walk *walk,
                                 struct ramp_points *points, int64_t *looks)
{
    return walk->is_bounded || walk->before_ns < 0 ||
           (ramp_passes_gate(controller, warp, stop, index,
                             ramp_time(controller, warp, walk->before_ns),
                             points, looks) &&
            ramp_passes_gate(controller, warp, stop, index,
                             ramp_time(controller, warp, walk->at_ns), points,
                             looks));
}

/* What follows a ramp, which a walk that goes backwards does not see. */
static bool ramp_end_keeps(const struct controller *controller,
                           const struct motion_clock_warp *warp, bool stop,
                           unsigned index)
{
    struct motion_clock_rate end;
    motion_clock_warp_at(warp, warp->t0_ns + warp->dur_ns, &end);
    return ramp_keeps(controller, &end, index, stop);
}

/* One axis: where it begins and ends, what was sent before and what follows
 * count, too. */
static bool ramp_axis_fits(const struct controller *controller,
                           const struct motion_clock_warp *warp, bool stop,
                           unsigned index, struct ramp_effort *effort)
{
    const int64_t period_ns = controller->config.period_ns;
    struct ramp_points points = { controller->axis[index].cursor, -1, 0, 0, 0 };
    struct motion_clock_warp turned;
    struct motion_clock_walk walk;
    int more;
    if (controller->is_reversed)
        controller_path_turn(controller, warp, &turned);
    motion_clock_walk_begin(&walk, controller->is_reversed ? &turned : warp,
                            controller->axis[index].track,
                            ramp_limit(controller, index, stop), period_ns);
    walk.is_open = controller->is_reversed;
    bool passes =
        ramp_passes_gate(controller, warp, stop, index, 0, &points,
                         &effort->left) &&
        (!walk.is_open || ramp_end_keeps(controller, warp, stop, index));
    do
        more = motion_clock_walk_next(&walk, &effort->left);
    while (passes && more > 0 &&
           (passes = ramp_looks_pass_gate(controller, warp, stop, index, &walk,
                                          &points, &effort->left)));
    if (more != 0) {
        effort->dt_ns = ramp_time(controller, warp, walk.at_ns);
        effort->axis = index;
    }
    return passes && more == 0 &&
           ramp_passes_gate(controller, warp, stop, index, warp->dur_ns,
                            &points, &effort->left) &&
           ramp_passes_gate(controller, warp, stop, index,
                            warp->dur_ns + period_ns, &points, &effort->left);
}

static bool ramp_fits(const struct controller *controller,
                      const struct motion_clock_warp *warp, bool stop,
                      struct ramp_effort *effort)
{
    const unsigned axes = controller->config.axis_count;
    const unsigned first = effort->axis;
    for (unsigned n = 0; n < axes; n++) {
        const unsigned i = first + n < axes ? first + n : first + n - axes;
        if (controller->axis[i].track &&
            !ramp_axis_fits(controller, warp, stop, i, effort))
            return false;
    }
    return effort->left >= 0;
}

bool controller_ramp_judge(const struct controller *controller,
                           const struct motion_clock_warp *warp, bool stop,
                           struct ramp_effort *effort)
{
    const int64_t most =
        (int64_t)RAMP_LOOKS_AXIS * controller->config.axis_count;
    if (!ramp_seems_to_fit(controller, warp, stop, effort))
        return false;
    effort->left = most;
    const bool fits = ramp_fits(controller, warp, stop, effort);
    effort->looks -= most - effort->left;
    return fits;
}
