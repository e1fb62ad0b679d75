/* firmware/control/ramp_span.c - one span of a candidate, axis by axis; see
 * ramp_step.h. */
#include "firmware/control/ramp.h"
#include "firmware/control/ramp_limit.h"
#include "firmware/control/ramp_step.h"

/* A piece of more ticks is two spans: what is between the limits of one that is long
 * is far from what the track does. */
#define SPAN_LONG 16
/* Of a whole ramp that is scheduled, which the path of its spans makes longer. */
#define SPAN_SCHEDULED 8
/* Of r' and r'': what is common to all axes. */
#define SPAN_BIG   ((int64_t)1 << 26)
#define SPAN_SHIFT 15

/* Q56, below 1/2, to Q24, or to `more` bits more. */
static inline int64_t span_scaled(int64_t value_q56,
                                  struct controller_scale scale, int more)
{
    return ramp_size(value_q56) < (int64_t)1 << 38
               ? value_q56 * (int32_t)scale.m >> (scale.e - more)
               : (value_q56 >> 17) * (int32_t)scale.m >> (scale.e - 17 - more);
}

/* What is the same for the whole of a piece.  False: beyond what spans hold. */
static bool span_piece(struct controller_step *step)
{
    const int64_t slope = step->slope_q56[step->piece];
    const int32_t n = step->n[step->piece];
    const int64_t begin =
        span_scaled(step->at.accel_q56, step->scales.accel, 0);
    const int64_t end =
        span_scaled(step->at.accel_q56 + slope * n, step->scales.accel, 0);
    const int64_t jerk = span_scaled(slope, step->scales.jerk, 0);
    int64_t accel = motion_fixed_most(ramp_size(begin), ramp_size(end));
    accel = motion_fixed_most(accel, accel * step->scales.cross_q12 >> 12);
    int64_t most = motion_fixed_most(accel, ramp_size(jerk));
    if (step->is_rise)
        most = motion_fixed_most(
            most, span_scaled(step->fall_q56[1], step->scales.jerk, 0));
    step->cut = step->scheduled.state != CONTROLLER_SCHEDULED_NONE
                    ? n / SPAN_SCHEDULED + 1
                : n > SPAN_LONG ? n / 2 + 1
                                : n;
    step->shift = 0;
    while (most >= (SPAN_BIG << step->shift) && step->shift < SPAN_SHIFT)
        step->shift += 5;
    step->accel_q40 = begin * (1 << 16);
    step->gain_q40 = span_scaled(slope, step->scales.accel, 16);
    step->jerk = (int32_t)(jerk >> step->shift);
    return most < SPAN_BIG << step->shift;
}

static inline int32_t span_down(int32_t a_q24, int32_t b_q24)
{
    return (int32_t)((int64_t)a_q24 * b_q24 >> 24);
}

static inline int32_t span_up(int32_t a_q24, int32_t b_q24)
{
    return (int32_t)(((int64_t)a_q24 * b_q24 + (1 << 24) - 1) >> 24);
}

/* Powers of the rate, from low to high, and r r' of r' from least to most. */
static inline void span_powers(const struct controller_step *step, int32_t low,
                               int32_t high, int32_t least, int32_t most,
                               struct controller_span *span)
{
    /* it is rounded up: too much where it works against r'' */
    const int32_t cross = step->scales.cross_q12;
    span->r2 =
        (struct controller_part){ span_down(low, low), span_up(high, high) };
    span->r3 = (struct controller_part){ span_down(low, span->r2.low),
                                         span_up(high, span->r2.high) };
    span->accel = (struct controller_part){ least, most };
    span->cross = (struct controller_part){
        (int32_t)((int64_t)span_down(least, least < 0 ? high : low) *
                      (cross - (least > 0)) >>
                  12),
        (int32_t)(((int64_t)span_up(most, most > 0 ? high : low) *
                       (cross - (most < 0)) +
                   4095) >>
                  12),
    };
}

/* In what is played in reverse f' and f''' are the negative; so, but for its sign,
 * are p'' with r' and p''' with r r' the negative. */
static inline void span_reverse(struct controller_part *part)
{
    *part = (struct controller_part){ -part->high, -part->low };
}

/* A margin for what 2^-24 of each tick adds up to, and a little. */
static inline void span_path(const struct controller *controller,
                             int64_t from_ns_q12, int32_t h,
                             struct controller_span *span)
{
    const struct controller_step *step = &controller->step;
    const int64_t margin = step->tick_ns_q12 * (h + (1 << 12)) >> 22;
    span->from_ns_q12 = from_ns_q12 - margin;
    span->to_ns_q12 = step->to.path_ns_q12 + margin;
    if (controller->is_reversed) {
        from_ns_q12 = span->from_ns_q12;
        span->from_ns_q12 = controller->move_end_ns_q12 - span->to_ns_q12;
        span->to_ns_q12 = controller->move_end_ns_q12 - from_ns_q12;
        span_reverse(&span->accel);
        span_reverse(&span->cross);
    }
}

/* a / 12, to 2^-16 of it */
static inline int64_t span_twelfth(int64_t a)
{
    return (a >> 18) * 21845;
}

/* Up to 2^45 ticks, Q24, in two parts. */
static inline int64_t span_ticks_ns_q12(const struct controller_step *step,
                                        int64_t ticks_q24)
{
    return ((ticks_q24 >> 20) * step->tick_ns_q12 >> 4) +
           ((ticks_q24 & ((1 << 20) - 1)) * step->tick_ns_q12 >> 24);
}

/* The rate's mean is that of both ends, less slope h^2 / 12. */
static inline void span_after(const struct controller_step *step, int32_t h,
                              struct controller_step_state *to)
{
    const struct controller_step_state *from = &step->at;
    const int64_t gain = step->slope_q56[step->piece] * h;
    to->accel_q56 = from->accel_q56 + gain;
    to->rate_q56 = from->rate_q56 + (from->accel_q56 + gain / 2) * h;
    const int64_t mean_q56 =
        from->rate_q56 / 2 + to->rate_q56 / 2 - span_twelfth(gain * h);
    to->path_ns_q12 =
        from->path_ns_q12 + span_ticks_ns_q12(step, (mean_q56 >> 32) * h);
}

/* Where r' goes through 0 the rate turns by |r'| h / 2 at most. */
static inline int32_t span_turn(const struct controller_step *step,
                                const struct controller_step_state *to,
                                int32_t h)
{
    const int64_t a = step->at.accel_q56, b = to->accel_q56;
    if (a == 0 || b == 0 || (a < 0) == (b < 0))
        return 0;
    const int64_t turn = motion_fixed_most(ramp_size(a), ramp_size(b)) / 2 * h;
    return (int32_t)((a < 0 ? -turn : turn) >> 32);
}

/* How far behind the candidate r' is brought to 0 instead, from any tick of it on, as
 * steeply as may be: of the rate, Q32, and of the path.  r' is between that of the
 * candidate and 0 for as many ticks as it takes by `which` at the most. */
static inline int64_t span_behind(const struct controller_step *step,
                                  unsigned which, int32_t h,
                                  int64_t *path_ns_q12)
{
    const int32_t most = step->fall_ticks[which];
    const int32_t since = step->tick + h + (step->piece == 0 ? 0 : step->n[0]);
    const int32_t t = since < most ? since : most;
    const int64_t behind_q32 = (step->rise_accel_q56 >> 24) * t;
    *path_ns_q12 = span_ticks_ns_q12(step, (behind_q32 >> 8) * t / 2);
    return behind_q32;
}

/* What may come instead of a rise: r'' of it, and how much lower the rate then is,
 * Q24, and how far behind the path. */
__attribute__((noinline)) static int32_t
span_falls(struct controller_step *step, int32_t h, int64_t *path_ns_q12)
{
    struct controller_span *span = &step->span;
    int64_t ns_q12[2], behind_q32[2];
    for (unsigned i = 0; i < 2; i++) {
        behind_q32[i] = span_behind(step, i, h, &ns_q12[i]);
        span->fall[i] =
            (int32_t)(span_scaled(-step->fall_q56[i], step->scales.jerk, 0) >>
                      step->shift);
    }
    if (step->fall_q56[1] == step->fall_q56[0])
        span->fall[1] = 0;
    *path_ns_q12 -= motion_fixed_most(ns_q12[0], ns_q12[1]);
    return (int32_t)(motion_fixed_most(behind_q32[0], behind_q32[1]) >> 8) + 1;
}

static void span_make(struct controller *controller, int32_t h)
{
    struct controller_step *step = &controller->step;
    struct controller_step_state *to = &step->to;
    struct controller_span *span = &step->span;
    span_after(step, h, to);
    const int32_t r0 = (int32_t)(step->at.rate_q56 >> 32);
    const int32_t r1 = (int32_t)(to->rate_q56 >> 32);
    const int32_t turn = span_turn(step, to, h);
    int32_t low = (r0 < r1 ? r0 : r1) + (turn < 0 ? turn : 0);
    /* what is below 2^-24 counts up */
    const int64_t top =
        step->at.rate_q56 > to->rate_q56 ? step->at.rate_q56 : to->rate_q56;
    const int32_t high = (int32_t)((top + ((int64_t)1 << 32) - 1) >> 32) +
                         (turn > 0 ? turn + 1 : 0);
    const int bits = 16 + step->shift;
    const int64_t begin_q40 = step->accel_q40;
    const int64_t end_q40 = begin_q40 + step->gain_q40 * h;
    int32_t least = (int32_t)(motion_fixed_least(begin_q40, end_q40) >> bits);
    const int32_t most =
        (int32_t) - (-motion_fixed_most(begin_q40, end_q40) >> bits);
    int64_t path_ns_q12 = step->at.path_ns_q12;
    span->fall[0] = 0;
    if (step->is_rise) {
        low -= span_falls(step, h, &path_ns_q12);
        least = 0;
    }
    span_powers(step, low > 0 ? low : 0, high, least, most, span);
    span->jerk = step->jerk;
    span->shift = step->shift;
    span->stop = step->stop;
    span->is_first = step->piece == 0;
    span_path(controller, path_ns_q12, h, span);
}

/* The next axis that has a track. */
static void span_axis(struct controller *controller, unsigned from)
{
    static const struct motion_range none = { INT32_MAX, INT32_MIN };
    struct controller_step *step = &controller->step;
    while (from < controller->config.axis_count &&
           !controller->axis[from].track)
        from++;
    step->axis = from;
    step->along_ns_q12 = step->span.from_ns_q12;
    for (unsigned i = 0; i < 3; i++)
        step->range[i] = none;
}

/* Not kept, nor by a little less. */
static void span_fails(struct controller_verdict *verdict)
{
    verdict->acc = verdict->jerk = false;
    verdict->acc_q10 = verdict->jerk_q10 = 64;
}

static void span_begin(struct controller *controller)
{
    struct controller_step *step = &controller->step;
    struct controller_verdict *verdict = &step->verdict;
    const int32_t left = step->n[step->piece] - step->tick;
    verdict->acc = verdict->jerk = verdict->fall = true;
    verdict->more = false;
    verdict->acc_q10 = verdict->jerk_q10 = CONTROLLER_FACTOR_MOST;
    if (step->cut == 0 && !span_piece(step)) {
        span_fails(verdict);
        step->to = step->at;
        step->to.accel_q56 += step->slope_q56[step->piece] * step->cut;
        step->h = step->cut = 1;
        step->axis = controller->config.axis_count;
        return;
    }
    step->h = step->cut < left ? step->cut : left;
    span_make(controller, step->h);
    span_axis(controller, 0);
}

static void span_look(struct controller *controller)
{
    struct controller_step *step = &controller->step;
    struct controller_axis *axis = &controller->axis[step->axis];
    if (step->is_new && step->along_ns_q12 == step->span.from_ns_q12)
        axis->share.cursor = axis->cursor;
    if (!motion_track_enclose(axis->track, &axis->share.cursor,
                              &axis->share.unit, &step->along_ns_q12,
                              step->span.to_ns_q12, step->range)) {
        /* what a window does not reach is not looked at; what ends sooner may be */
        span_fails(&step->verdict);
        step->axis = controller->config.axis_count;
    } else if (step->along_ns_q12 >= step->span.to_ns_q12) {
        controller_limit_judge(&axis->share, &step->span, step->range,
                               &step->verdict);
        if (step->verdict.acc && step->verdict.jerk && step->verdict.fall)
            span_axis(controller, step->axis + 1);
        else
            step->axis = controller->config.axis_count;
    }
}

static void span_end(struct controller *controller)
{
    struct controller_step *step = &controller->step;
    const struct controller_step_state *to = &step->to;
    const int64_t most = controller->override_max_q30 * RAMP_Q30_Q56;
    if ((to->rate_q56 > most && to->rate_q56 > step->from.rate_q56) ||
        to->rate_q56 < -RAMP_Q30_Q56)
        step->verdict.acc = false;
    step->at = *to;
    step->accel_q40 += step->gain_q40 * step->h;
    step->tick += step->h;
    step->is_new = false;
}

bool controller_span_step(struct controller *controller)
{
    struct controller_step *step = &controller->step;
    if (step->stage == STEP_SPAN) {
        step->stage = STEP_AXIS;
        span_begin(controller);
    } else if (step->axis < controller->config.axis_count) {
        span_look(controller);
    } else {
        step->stage = STEP_SPAN;
        span_end(controller);
        return true;
    }
    return false;
}
