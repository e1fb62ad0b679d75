/* firmware/controller_ramp.c - the shortest change of rate that fits.
 *
 * On an axis that runs at path speed v and path acceleration a, a ramp within
 * |r'| <= A, |r''| <= J takes, beside what the track takes itself,
 *     acceleration  v A        jerk  v J + 3 a r A
 * so A = acc / v (and jerk / 3 a r) and J = jerk / v are where it alone would
 * use the whole limit.  Candidates are a grid of A and J around these, from
 * four times as much (a track that speeds up leaves that for slowing down) to a
 * quarter of what is right at the highest speed of the tracks.  They are tried
 * in the order of their durations: at a few looks first, then at the very set
 * points that would be sent, by the formulas of the gate, and by p', p'', p'''
 * at every tick; of a long ramp at RAMP_LOOKS of its ticks, with what can come
 * between.  A candidate starts in the tick in which it is judged, so it is
 * judged as it will be. */
#include <stddef.h>

#include "firmware/controller_parts.h"
#include "motion/err.h"
#include "motion/fixed.h"

#define SECOND_NS INT64_C(1000000000)

/* Looks: per axis at first, and at most at ticks; what one candidate may take
 * per axis, dense tracks included; after which no other is tried. */
#define RAMP_LOOKS_FIRST 24
#define RAMP_LOOKS       128
#define RAMP_LOOKS_AXIS  4096
#define RAMP_LOOKS_SEEK  512
#define RAMP_LOOKS_STOP  8192
/* What making a candidate and laying out the grid count as. */
#define RAMP_LOOKS_MAKE  8
#define RAMP_LOOKS_SWEEP 256

/* r' takes at least so many ticks to its peak, and r so many from 1 to 0. */
#define RAMP_TICKS_MIN 2

/* a * b / c, saturated; c > 0, the others >= 0. */
static int64_t ramp_muldiv(int64_t a, int64_t b, int64_t c)
{
    int64_t result;
    return motion_fixed_muldiv(a, b, c, &result) < 0 ? INT64_MAX : result;
}

static int64_t ramp_least(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

static int64_t ramp_most(int64_t a, int64_t b)
{
    return a > b ? a : b;
}

static int64_t ramp_size(int64_t value)
{
    const uint64_t size = motion_fixed_abs(value);
    return size > INT64_MAX ? INT64_MAX : (int64_t)size;
}

static const struct motion_clock_limit *
ramp_limit(const struct controller *controller, unsigned axis, bool stop)
{
    const struct controller_axis_config *config =
        &controller->config.axis[axis];
    return stop ? &config->stop : &config->limit;
}

/* The state of the clock from which a ramp would start now. */
static struct motion_clock_rate ramp_now(const struct controller *controller)
{
    struct motion_clock_rate now;
    motion_clock_warp_at(&controller->warp, controller->clock_ns, &now);
    now.s_ns_q12 = ramp_least(now.s_ns_q12, controller->move_end_ns_q12);
    return now;
}

/* -- what A and J are right ------------------------------------------------ */

/* How fast and how steep an axis is, on its path. */
struct ramp_speed {
    int64_t vel_q32, acc_q16;
};

/* At `now`.  An axis that is slow but speeds up will not stay slow: it counts
 * with what it gains while the acceleration can be taken back, at most with its
 * track's peak. */
static struct ramp_speed ramp_speed_at(const struct controller *controller,
                                       unsigned index,
                                       const struct motion_clock_rate *now,
                                       const struct motion_clock_limit *limit)
{
    const struct controller_axis *axis = &controller->axis[index];
    struct motion_state state;
    motion_track_state(axis->track, now->s_ns_q12, &state);
    const int64_t acc_q16 = ramp_size(state.acc_q16);
    const int64_t gain_q16 =
        limit->jerk_q16 > 0
            ? ramp_muldiv(acc_q16, limit->acc_q16, limit->jerk_q16)
            : ramp_muldiv(acc_q16, 4 * controller->config.period_ns, SECOND_NS);
    const int64_t gain_q32 =
        ramp_least(ramp_muldiv(gain_q16, 65536, 1), axis->vel_peak_q32);
    return (struct ramp_speed){ ramp_most(ramp_size(state.vel_q32), gain_q32),
                                acc_q16 };
}

/* At its fastest; the steepest that a speed is reached with inside the limits
 * is the lesser of acc and sqrt(v jerk). */
static struct ramp_speed ramp_speed_peak(int64_t vel_q32,
                                         const struct motion_clock_limit *limit)
{
    const uint64_t root = motion_fixed_isqrt_u128(motion_fixed_mul_u64(
        (uint64_t)vel_q32 >> 16, (uint64_t)limit->jerk_q16));
    return (struct ramp_speed){ vel_q32,
                                ramp_least(limit->acc_q16, (int64_t)root) };
}

/* Narrow A and J down to what one axis leaves. */
static void ramp_narrow(struct motion_clock_bound *bound,
                        const struct motion_clock_limit *limit,
                        const struct ramp_speed *speed, int64_t rate_q30)
{
    if (speed->vel_q32 > 0)
        bound->accel_q30 = ramp_least(
            bound->accel_q30,
            ramp_muldiv(limit->acc_q16, (int64_t)1 << 46, speed->vel_q32));
    if (limit->jerk_q16 == 0)
        return;
    if (speed->vel_q32 > 0)
        bound->jerk_q30 = ramp_least(
            bound->jerk_q30,
            ramp_muldiv(limit->jerk_q16, (int64_t)1 << 46, speed->vel_q32));
    if (speed->acc_q16 > 0 && rate_q30 > 0)
        bound->accel_q30 = ramp_least(
            bound->accel_q30,
            ramp_muldiv(ramp_muldiv(limit->jerk_q16, (int64_t)1 << 30,
                                    ramp_muldiv(3, speed->acc_q16, 1)),
                        (int64_t)1 << 30, rate_q30));
}

/* Without a limit of the axes: what whole ticks leave. */
static struct motion_clock_bound
ramp_widest(const struct controller *controller)
{
    return (struct motion_clock_bound){
        ramp_muldiv(MOTION_CLOCK_WARP_ONE_Q30, SECOND_NS,
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
        ramp_muldiv(bound.accel_q30, SECOND_NS,
                    RAMP_TICKS_MIN * controller->config.period_ns);
    bound.jerk_q30 = ramp_least(ramp_most(bound.jerk_q30 / divisor, 1),
                                ramp_most(jerk_q30, 1));
    return bound;
}

/* What is right now; what the axes' peaks leave, by `divisor`. */
static struct motion_clock_bound
ramp_bound_now(const struct controller *controller,
               const struct motion_clock_rate *now, bool stop)
{
    struct motion_clock_bound bound = ramp_widest(controller);
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        if (!controller->axis[i].track)
            continue;
        const struct motion_clock_limit *limit =
            ramp_limit(controller, i, stop);
        const struct ramp_speed speed =
            ramp_speed_at(controller, i, now, limit);
        ramp_narrow(&bound, limit, &speed,
                    ramp_most(now->rate_q30, controller->wanted_q30));
    }
    return ramp_finish(controller, bound, 1);
}

static struct motion_clock_bound
ramp_bound_peak(const struct controller *controller,
                const struct motion_clock_rate *now, bool stop,
                unsigned divisor)
{
    struct motion_clock_bound bound = ramp_widest(controller);
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        if (!controller->axis[i].track)
            continue;
        const struct motion_clock_limit *limit =
            ramp_limit(controller, i, stop);
        const struct ramp_speed speed =
            ramp_speed_peak(controller->axis[i].vel_peak_q32, limit);
        ramp_narrow(&bound, limit, &speed,
                    ramp_most(now->rate_q30, controller->wanted_q30));
    }
    return ramp_finish(controller, bound, divisor);
}

/* -- how long it takes ----------------------------------------------------- */

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

static int64_t ramp_rest(const struct controller *controller,
                         const struct motion_clock_rate *now, bool stop,
                         unsigned divisor)
{
    struct motion_clock_bound bound =
        ramp_bound_peak(controller, now, stop, divisor);
    ramp_steepen(&bound, now);
    return ramp_duration(controller, now, 0, &bound);
}

int64_t controller_ramp_bound_ns(const struct controller *controller, bool stop)
{
    const struct motion_clock_rate now = ramp_now(controller);
    const int64_t within_stop_ns =
        ramp_rest(controller, &now, true, 4) + controller->config.period_ns;
    return stop ? within_stop_ns
                : within_stop_ns + ramp_rest(controller, &now, false, 4) +
                      ramp_rest(controller, &now, false, 1);
}

/* A ramp of the slowest kind from rate r to 0 goes r D / 2 of path time, on an
 * axis that does r times the track's speed. */
int64_t controller_ramp_reserve(const struct controller *controller,
                                unsigned index, int64_t vel_q32,
                                int64_t rate_q30)
{
    const struct motion_clock_limit *limit =
        ramp_limit(controller, index, true);
    const struct ramp_speed speed = ramp_speed_peak(vel_q32, limit);
    const struct motion_clock_rate now = { .rate_q30 = rate_q30 };
    struct motion_clock_bound bound = ramp_widest(controller);
    ramp_narrow(&bound, limit, &speed, rate_q30);
    bound = ramp_finish(controller, bound, 4);
    const int64_t ns = ramp_duration(controller, &now, 0, &bound);
    return ramp_muldiv(ns * (MOTION_FIXED_NS_Q12 / 2), rate_q30,
                       MOTION_CLOCK_WARP_ONE_Q30);
}

/* -- candidates ------------------------------------------------------------ */

/* value / 2^(eighths / 8), at least 1 */
static int64_t ramp_rung(int64_t value, unsigned eighths)
{
    static const uint32_t root_q30[8] = { 0x40000000, 0x3AB031BA, 0x35D13F33,
                                          0x31590D81, 0x2D413CCD, 0x2981CEDC,
                                          0x260DFC14, 0x22DE3FD1 };
    const int64_t part =
        ramp_muldiv(value, root_q30[eighths % 8], (int64_t)1 << 30);
    return ramp_most(part >> (eighths / 8), 1);
}

/* From `high` down to `low`, in eighths of an octave; at least two octaves. */
static unsigned ramp_span(int64_t high, int64_t low)
{
    const unsigned high_bits = motion_fixed_clz_u64((uint64_t)high);
    const unsigned low_bits = motion_fixed_clz_u64((uint64_t)low);
    return 8 * (low_bits > high_bits + 1 ? low_bits - high_bits + 1 : 2);
}

static struct motion_clock_bound
ramp_candidate(const struct controller_seek *seek, unsigned which)
{
    const unsigned accel = which / CONTROLLER_RAMP_JERKS;
    const unsigned jerk = which % CONTROLLER_RAMP_JERKS;
    return (struct motion_clock_bound){
        ramp_rung(seek->most.accel_q30,
                  accel * seek->accel_span / (CONTROLLER_RAMP_ACCELS - 1)),
        ramp_rung(seek->most.jerk_q30,
                  jerk * seek->jerk_span / (CONTROLLER_RAMP_JERKS - 1)),
    };
}

/* In between those that are shorter and those that are longer; the same ticks
 * as another's make the same ramp. */
static void ramp_insert(struct controller_seek *seek, uint64_t *key,
                        unsigned which, uint64_t ticks)
{
    unsigned at = seek->count;
    while (at > 0 && key[at - 1] > ticks)
        at--;
    if (at > 0 && key[at - 1] == ticks)
        return;
    for (unsigned i = seek->count; i > at; i--) {
        key[i] = key[i - 1];
        seek->order[i] = seek->order[i - 1];
    }
    key[at] = ticks;
    seek->order[at] = (uint8_t)which;
    seek->count++;
}

/* Lay out the grid for the state there is, the shortest first. */
static void ramp_sweep(struct controller *controller,
                       const struct motion_clock_rate *now, bool stop)
{
    struct controller_seek *seek = &controller->seek;
    uint64_t key[CONTROLLER_RAMP_CANDIDATES];
    const struct motion_clock_bound least =
        ramp_bound_peak(controller, now, stop, 4);
    seek->most = ramp_bound_now(controller, now, stop);
    seek->most.accel_q30 = ramp_muldiv(seek->most.accel_q30, 4, 1);
    seek->most.jerk_q30 = ramp_muldiv(seek->most.jerk_q30, 4, 1);
    seek->accel_span = ramp_span(seek->most.accel_q30, least.accel_q30);
    seek->jerk_span = ramp_span(seek->most.jerk_q30, least.jerk_q30);
    seek->stop = stop;
    seek->which = 0;
    seek->count = 0;
    for (unsigned i = 0; i < CONTROLLER_RAMP_CANDIDATES; i++) {
        const struct motion_clock_bound bound = ramp_candidate(seek, i);
        int64_t n[MOTION_CLOCK_WARP_PIECES];
        if (motion_clock_warp_ticks(now, controller->wanted_q30, &bound,
                                    controller->config.period_ns,
                                    n) == MOTION_OK)
            ramp_insert(seek, key, i,
                        (uint64_t)(n[0] + n[1] + n[2]) << 32 | (uint64_t)n[0]);
    }
}

/* -- judging --------------------------------------------------------------- */

/* The set point of an axis at a time of the clock. */
static int64_t ramp_set_point(const struct controller *controller,
                              const struct motion_clock_warp *warp,
                              unsigned index, struct motion_cursor *cursor,
                              int64_t t_ns)
{
    struct motion_clock_rate rate;
    struct motion_sample sample;
    motion_clock_warp_at(warp, t_ns, &rate);
    motion_track_sample(controller->axis[index].track, cursor,
                        ramp_least(rate.s_ns_q12, controller->move_end_ns_q12),
                        &sample);
    return sample.pos_q32;
}

/* The set points before, at and after every `step` ticks, up to the first that
 * is all after the ramp; the one before the ramp is the present warp's. */
static bool ramp_passes_gate(const struct controller *controller,
                             const struct motion_clock_warp *warp, bool stop,
                             unsigned index, int64_t step, int64_t *looks)
{
    const struct controller_axis *axis = &controller->axis[index];
    const int64_t period_ns = controller->config.period_ns;
    const int64_t acc_q32 = stop ? axis->gate_acc_q32 : axis->limit_acc_q32;
    struct motion_cursor cursor = axis->cursor;
    for (int64_t dt = 0; dt <= warp->dur_ns + step * period_ns;
         dt += step * period_ns) {
        const int64_t t_ns = warp->t0_ns + dt;
        const int64_t before =
            ramp_set_point(controller, dt == 0 ? &controller->warp : warp,
                           index, &cursor, t_ns - period_ns);
        const int64_t here =
            ramp_set_point(controller, warp, index, &cursor, t_ns);
        const int64_t after =
            ramp_set_point(controller, warp, index, &cursor, t_ns + period_ns);
        if (--*looks < 0 ||
            !controller_gate_steps(axis, acc_q32, after - here, here - before))
            return false;
    }
    return true;
}

/* At a few looks: rules out most candidates. */
static bool ramp_seems_to_fit(const struct controller *controller,
                              const struct motion_clock_warp *warp, bool stop,
                              int64_t *looks)
{
    const int64_t step_ns = ramp_most(warp->dur_ns / RAMP_LOOKS_FIRST,
                                      controller->config.period_ns);
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (controller->axis[i].track &&
            !motion_clock_warp_fits(warp, controller->axis[i].track,
                                    ramp_limit(controller, i, stop), step_ns,
                                    false, looks))
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
             !motion_clock_warp_fits(warp, controller->axis[i].track,
                                     ramp_limit(controller, i, stop),
                                     step * period_ns, step > 1, looks)))
            return false;
    return true;
}

/* Judge one ramp; *looks is reduced by what that took. */
static bool ramp_judge(const struct controller *controller,
                       const struct motion_clock_warp *warp, bool stop,
                       int64_t *looks)
{
    const int64_t most =
        (int64_t)RAMP_LOOKS_AXIS * controller->config.axis_count;
    int64_t left = most;
    const bool fits = ramp_seems_to_fit(controller, warp, stop, &left) &&
                      ramp_fits(controller, warp, stop, &left);
    *looks -= most - left;
    return fits;
}

/* -- the search ------------------------------------------------------------ */

void controller_ramp_reset(struct controller *controller)
{
    controller->seek = (struct controller_seek){ 0 };
}

/* By when rest is due; INT64_MAX: at no time. */
static int64_t ramp_due_ns(const struct controller *controller)
{
    const bool slows = controller->state == CONTROLLER_HOLDING ||
                       controller->state == CONTROLLER_STOPPING;
    return slows && controller->wanted_q30 == 0 && controller->rest_by_ns != 0
               ? controller->rest_by_ns
               : INT64_MAX;
}

/* Up to where a ramp within `bound` takes the rate: r' > 0 has to come to 0
 * first, in whole ticks. */
static int64_t ramp_top(const struct controller *controller,
                        const struct motion_clock_rate *now,
                        const struct motion_clock_bound *bound)
{
    if (now->accel_q30 <= 0)
        return now->rate_q30;
    return now->rate_q30 +
           ramp_muldiv(now->accel_q30, now->accel_q30,
                       ramp_muldiv(2, bound->jerk_q30, 1)) +
           ramp_muldiv(now->accel_q30, controller->config.period_ns, SECOND_NS);
}

/* What slows down does not speed up first: whatever ramp will fit, r' > 0 is
 * brought to 0 from now on, as fast as the limits allow, faster where they come
 * to allow more, and no later ramp may take the rate higher. */
static void ramp_level(struct controller *controller,
                       const struct motion_clock_rate *now)
{
    struct controller_seek *seek = &controller->seek;
    int64_t looks = seek->is_level ? RAMP_LOOKS_SEEK : RAMP_LOOKS_STOP;
    if (now->accel_q30 <= 0 || controller->wanted_q30 >= now->rate_q30 ||
        seek->level_q30 == INT64_MAX)
        return;
    for (unsigned i = 0; i <= seek->jerk_span && looks > 0; i += 2) {
        const struct motion_clock_bound bound = {
            seek->most.accel_q30,
            ramp_rung(seek->most.jerk_q30, i),
        };
        const int64_t rate_q30 =
            now->rate_q30 + ramp_muldiv(now->accel_q30, now->accel_q30,
                                        ramp_muldiv(2, bound.jerk_q30, 1));
        struct motion_clock_warp warp;
        if (seek->is_level && rate_q30 >= controller->warp.rate1_q30)
            return; /* the one under way is as good */
        if (motion_clock_warp_ramp(&controller->warp, controller->clock_ns,
                                   rate_q30, &bound,
                                   controller->config.period_ns, &warp) < 0 ||
            !ramp_judge(controller, &warp, seek->stop, &looks))
            continue;
        controller->warp = warp;
        seek->is_level = true;
        seek->level_q30 = ramp_top(controller, now, &bound);
        return;
    }
}

/* The next candidates, at most `looks` and what the last one takes.  Those that
 * would end too late are none. */
static bool ramp_search(struct controller *controller,
                        const struct motion_clock_rate *now, bool stop,
                        int64_t looks)
{
    struct controller_seek *seek = &controller->seek;
    if (seek->which >= seek->count || seek->stop != stop) {
        ramp_sweep(controller, now, stop);
        looks -= RAMP_LOOKS_SWEEP;
    }
    ramp_level(controller, now);
    while (seek->which < seek->count && looks > 0) {
        const struct motion_clock_bound bound =
            ramp_candidate(seek, seek->order[seek->which++]);
        struct motion_clock_warp warp;
        looks -= RAMP_LOOKS_MAKE;
        if (seek->is_level &&
            ramp_top(controller, now, &bound) > seek->level_q30)
            continue;
        if (motion_clock_warp_ramp(&controller->warp, controller->clock_ns,
                                   controller->wanted_q30, &bound,
                                   controller->config.period_ns, &warp) < 0)
            continue;
        if (warp.t0_ns + warp.dur_ns > ramp_due_ns(controller))
            seek->which = seek->count;
        else if (ramp_judge(controller, &warp, stop, &looks)) {
            controller->warp = warp;
            return true;
        }
    }
    return false;
}

bool controller_ramp_stop(struct controller *controller)
{
    const struct motion_clock_warp before = controller->warp;
    const struct motion_clock_rate now = ramp_now(controller);
    controller_ramp_reset(controller);
    if (ramp_search(controller, &now, true, RAMP_LOOKS_STOP))
        return true;
    controller->warp = before;
    if (!controller->seek.is_level)
        return false;
    /* rather along the path, a little faster at first, than off it */
    controller->seek.level_q30 = INT64_MAX;
    controller->seek.which = 0;
    return ramp_search(controller, &now, true, RAMP_LOOKS_STOP);
}

void controller_ramp_begin(struct controller *controller)
{
    const struct motion_clock_rate now = ramp_now(controller);
    (void)ramp_search(controller, &now, false, RAMP_LOOKS_STOP);
}

void controller_ramp_seek(struct controller *controller)
{
    const struct motion_clock_rate now = ramp_now(controller);
    const int64_t left_ns = ramp_due_ns(controller) - controller->clock_ns;
    const bool stop = left_ns <= ramp_rest(controller, &now, true, 4);
    (void)ramp_search(controller, &now, stop, RAMP_LOOKS_SEEK);
}
