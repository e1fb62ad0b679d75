/* firmware/control/ramp_judge.c - does a ramp keep every axis inside its
 * limits?
 *
 * It is judged at a few looks first, beginning where the candidate before it
 * failed, then at the very set points that would be sent, by the formulas of the
 * gate, and by p', p'', p''' at every tick; a long ramp at RAMP_LOOKS of its
 * ticks, with what can come between. */
#include "firmware/control/ramp.h"

/* Looks per axis at first, and at most at ticks; what one candidate may take per
 * axis after the first, dense tracks included. */
#define RAMP_LOOKS_FIRST 24
#define RAMP_LOOKS       128
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

/* The set points before, at and after every `step` ticks, up to the first that
 * is all after the ramp. */
static bool ramp_passes_gate(const struct controller *controller,
                             const struct motion_clock_warp *warp, bool stop,
                             unsigned index, int64_t step, int64_t *looks)
{
    const struct controller_axis *axis = &controller->axis[index];
    const int64_t period_ns = controller->config.period_ns;
    const int64_t acc_q32 = stop ? axis->gate_acc_q32 : axis->limit_acc_q32;
    struct motion_cursor cursor = axis->cursor;
    int64_t before = ramp_point_before(controller, warp, index, &cursor);
    int64_t here =
        ramp_set_point(controller, warp, index, &cursor, warp->t0_ns);
    for (int64_t dt = 0; dt <= warp->dur_ns + step * period_ns;
         dt += step * period_ns) {
        const int64_t t_ns = warp->t0_ns + dt;
        if (dt > 0 && step > 1) {
            before = ramp_set_point(controller, warp, index, &cursor,
                                    t_ns - period_ns);
            here = ramp_set_point(controller, warp, index, &cursor, t_ns);
        }
        const int64_t after =
            ramp_set_point(controller, warp, index, &cursor, t_ns + period_ns);
        if (--*looks < 0 ||
            !controller_gate_steps(axis, acc_q32, after - here, here - before))
            return false;
        before = here; /* of the next tick, where no step is left out */
        here = after;
    }
    return true;
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

/* motion_clock_warp_fits, in either direction. */
static bool ramp_axis_fits(const struct controller *controller,
                           const struct motion_clock_warp *warp, unsigned index,
                           bool stop, int64_t step_ns, bool between,
                           int64_t *looks)
{
    const struct motion_track *track = controller->axis[index].track;
    const struct motion_clock_limit *limit =
        ramp_limit(controller, index, stop);
    struct motion_clock_warp turned;
    if (!controller->is_reversed)
        return motion_clock_warp_fits(warp, track, limit, step_ns, between,
                                      looks);
    controller_path_turn(controller, warp, &turned);
    return motion_clock_warp_fits(&turned, track, limit, step_ns, between,
                                  looks);
}

/* All axes, from `first` round to the one before it, at one time of a ramp; the
 * clock is the same for all of them. */
static bool ramp_keeps_at(const struct controller *controller,
                          const struct motion_clock_warp *warp, bool stop,
                          unsigned first, int64_t dt_ns,
                          struct ramp_effort *effort)
{
    const unsigned axes = controller->config.axis_count;
    struct motion_clock_rate now;
    motion_clock_warp_at(warp, warp->t0_ns + dt_ns, &now);
    for (unsigned n = 0; n < axes; n++) {
        const unsigned i = first + n < axes ? first + n : first + n - axes;
        if (!controller->axis[i].track)
            continue;
        effort->looks--;
        if (!ramp_keeps(controller, &now, i, stop)) {
            effort->dt_ns = dt_ns;
            effort->axis = i;
            return false;
        }
    }
    return true;
}

/* At a few looks, first where the last candidate did not fit: rules out most
 * candidates. */
static bool ramp_seems_to_fit(const struct controller *controller,
                              const struct motion_clock_warp *warp, bool stop,
                              struct ramp_effort *effort)
{
    const int64_t step_ns = ramp_most(warp->dur_ns / RAMP_LOOKS_FIRST,
                                      controller->config.period_ns);
    const unsigned first = effort->axis;
    if (effort->dt_ns < warp->dur_ns &&
        !ramp_keeps_at(controller, warp, stop, first, effort->dt_ns, effort))
        return false;
    for (int64_t dt_ns = 0; dt_ns < warp->dur_ns; dt_ns += step_ns)
        if (!ramp_keeps_at(controller, warp, stop, first, dt_ns, effort))
            return false;
    return true;
}

static bool ramp_fits(const struct controller *controller,
                      const struct motion_clock_warp *warp, bool stop,
                      int64_t *looks)
{
    const int64_t period_ns = controller->config.period_ns;
    const int64_t step = warp->dur_ns / period_ns / RAMP_LOOKS + 1;
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (controller->axis[i].track &&
            (!ramp_passes_gate(controller, warp, stop, i, step, looks) ||
             !ramp_axis_fits(controller, warp, i, stop, step * period_ns,
                             step > 1, looks)))
            return false;
    return true;
}

bool controller_ramp_judge(const struct controller *controller,
                           const struct motion_clock_warp *warp, bool stop,
                           struct ramp_effort *effort)
{
    const int64_t most =
        (int64_t)RAMP_LOOKS_AXIS * controller->config.axis_count;
    int64_t left = most;
    if (!ramp_seems_to_fit(controller, warp, stop, effort))
        return false;
    const bool fits = ramp_fits(controller, warp, stop, &left);
    effort->looks -= most - left;
    return fits;
}
