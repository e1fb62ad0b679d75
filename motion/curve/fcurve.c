/* motion/curve/fcurve.c - the value of a curve at a time.  See fcurve.h. */
#include "motion/curve/fcurve.h"

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/fcurve_internal.h"

/* --- a span --------------------------------------------------------------- */

static struct fcurve_jet fcurve_straight(struct motion_real change,
                                         const struct fcurve_when *when)
{
    struct fcurve_jet jet = { .d = change, .dd = motion_real_zero() };

    jet.f = motion_real_div(motion_real_mul(change, fcurve_whole(when->at)),
                            fcurve_whole(when->dur));
    return jet;
}

/* From the key's value, in the span that starts at `a`. */
static struct fcurve_jet fcurve_span_at(const struct motion_fcurve_key *a,
                                        const struct fcurve_when *when)
{
    const struct motion_fcurve_key *b = a + 1;
    const struct motion_real change =
        fcurve_difference(b->at.pos_q32, a->at.pos_q32, 32);

    switch (a->interpolation) {
    case MOTION_FCURVE_CONSTANT:
        return fcurve_straight(motion_real_zero(), when);
    case MOTION_FCURVE_LINEAR:
        return fcurve_straight(change, when);
    case MOTION_FCURVE_BEZIER:
        return fcurve_bezier_at(a, b, when);
    default:
        return fcurve_ease(a, change, when);
    }
}

/* By seconds instead of by the span, from the key's value. */
static void fcurve_in_seconds(struct motion_fcurve_value *value,
                              const struct fcurve_jet *jet,
                              const struct motion_fcurve_key *from,
                              struct motion_real dur)
{
    const struct motion_real per_s =
        motion_real_div(fcurve_whole(MOTION_FIXED_S_Q12), dur);

    value->pos =
        motion_real_add(motion_real_from_q(from->at.pos_q32, 32), jet->f);
    value->vel = motion_real_mul(jet->d, per_s);
    value->acc = motion_real_mul(jet->dd, motion_real_sqr(per_s));
    value->steep = jet->steep;
}

uint32_t fcurve_find(const struct motion_fcurve *curve, int64_t t, bool left)
{
    uint32_t low = 0, high = curve->count - 1;

    while (low + 1 < high) {
        const uint32_t middle = low + (high - low) / 2;
        const int64_t at = curve->key[middle].at.t_ns_q12;

        if (at < t || (at == t && !left))
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* A time beside t that tells the pieces of a formula apart: further off than
 * the rounding of where they meet, which is 1 and 2^-58 of the span. */
static int64_t fcurve_beside(int64_t t, int64_t dur, bool before)
{
    const int64_t off = 2 + (dur >> 50);

    if (before)
        return t > off ? t - off : 0;
    return t < dur - off ? t + off : dur;
}

/* Between the first and the last key. */
static int fcurve_inside(const struct motion_fcurve *curve, int64_t t,
                         enum motion_fcurve_side side,
                         struct motion_fcurve_value *value)
{
    const struct motion_fcurve_key *a =
        &curve->key[fcurve_find(curve, t, side == MOTION_FCURVE_LEFT)];
    const int64_t start = a->at.t_ns_q12, dur = a[1].at.t_ns_q12 - start;
    struct fcurve_when when = { t - start, t - start, dur };
    struct fcurve_jet jet;

    if (a->interpolation > MOTION_FCURVE_ELASTIC ||
        a->easing > MOTION_FCURVE_IN_OUT)
        return MOTION_E_ARG;
    when.inside = fcurve_beside(when.at, dur,
                                side == MOTION_FCURVE_LEFT || t == start + dur);
    jet = fcurve_span_at(a, &when);
    fcurve_in_seconds(value, &jet, a, fcurve_whole(dur));
    if (side == MOTION_FCURVE_AT && (t == start || t == start + dur))
        value->pos = motion_real_from_q(a[t == start ? 0 : 1].at.pos_q32, 32);
    return MOTION_OK;
}

/* --- outside -------------------------------------------------------------- */

static struct fcurve_offset fcurve_outer(const struct motion_fcurve *curve,
                                         bool before)
{
    const uint32_t last = curve->count - 1;
    const struct motion_fcurve_key *end = &curve->key[before ? 0 : last];
    const struct motion_fcurve_key *next = before ? end + 1 : end - 1;

    if (curve->extrapolation == MOTION_FCURVE_HOLD ||
        end->interpolation == MOTION_FCURVE_CONSTANT)
        return (struct fcurve_offset){ fcurve_whole(1), fcurve_whole(0) };
    if (end->interpolation != MOTION_FCURVE_LINEAR)
        return fcurve_get(before ? &end->left : &end->right, &end->at);
    if (last == 0)
        return (struct fcurve_offset){ fcurve_whole(1), fcurve_whole(0) };
    return fcurve_get(&next->at, &end->at);
}

static void fcurve_beyond(const struct motion_fcurve *curve, int64_t t,
                          bool before, struct motion_fcurve_value *value)
{
    const struct motion_fcurve_key *end =
        &curve->key[before ? 0 : curve->count - 1];
    const struct fcurve_offset displacement = fcurve_outer(curve, before);
    const struct fcurve_when when = { t - end->at.t_ns_q12, 0, 1 };
    struct motion_real slope = motion_real_zero();
    struct fcurve_jet jet;

    if (!motion_real_is_zero(displacement.t))
        slope = motion_real_div(displacement.pos, displacement.t);
    jet = fcurve_straight(slope, &when);
    fcurve_in_seconds(value, &jet, end, fcurve_whole(1));
}

bool fcurve_place(const struct motion_fcurve *curve, int64_t t,
                  enum motion_fcurve_side side, struct fcurve_lap *lap)
{
    const int64_t first = curve->key[0].at.t_ns_q12;
    const int64_t last = curve->key[curve->count - 1].at.t_ns_q12;
    const bool before = side == MOTION_FCURVE_LEFT ? t <= first : t < first;
    const bool after = side == MOTION_FCURVE_RIGHT ? t >= last : t > last;
    const struct motion_fcurve_cycles *cycles =
        before ? &curve->before : &curve->after;
    const int64_t period = last - first;
    int64_t phase;
    bool end;

    *lap = (struct fcurve_lap){ .t = t };
    if (!before && !after)
        return true;
    if (cycles->mode == MOTION_FCURVE_ONCE || period == 0)
        return false;
    lap->number = (t - first) / period;
    phase = (t - first) % period;
    if (phase < 0) {
        phase += period;
        lap->number--;
    }
    end = side == MOTION_FCURVE_LEFT || (side == MOTION_FCURVE_AT && after);
    if (phase == 0 && end) {
        phase = period;
        lap->number--;
    }
    if (cycles->count != 0 && (lap->number > (int64_t)cycles->count ||
                               -lap->number > (int64_t)cycles->count))
        return false;
    lap->back = cycles->mode == MOTION_FCURVE_MIRROR && (lap->number & 1);
    lap->offset = cycles->mode == MOTION_FCURVE_REPEAT_OFFSET;
    lap->t = lap->back ? last - phase : first + phase;
    return true;
}

/* Derivatives change sign when time runs backwards; the limit changes side. */
static int fcurve_repeat(const struct motion_fcurve *curve,
                         const struct fcurve_lap *lap,
                         enum motion_fcurve_side side,
                         struct motion_fcurve_value *value)
{
    const struct motion_fcurve_key *last = &curve->key[curve->count - 1];
    int rc;

    if (side != MOTION_FCURVE_AT && lap->back)
        side = side == MOTION_FCURVE_LEFT ? MOTION_FCURVE_RIGHT
                                          : MOTION_FCURVE_LEFT;
    rc = fcurve_inside(curve, lap->t, side, value);
    if (rc != MOTION_OK)
        return rc;
    if (lap->back)
        value->vel = motion_real_neg(value->vel);
    if (lap->offset)
        value->pos = motion_real_add(
            value->pos,
            curve_times(fcurve_difference(last->at.pos_q32,
                                          curve->key[0].at.pos_q32, 32),
                        lap->number));
    return MOTION_OK;
}

int motion_fcurve_at(const struct motion_fcurve *curve, int64_t t_ns_q12,
                     enum motion_fcurve_side side,
                     struct motion_fcurve_value *value)
{
    struct fcurve_lap lap;

    if (curve->count == 0)
        return MOTION_E_EMPTY;
    if (t_ns_q12 < -FCURVE_TIME_MAX_NS_Q12 || t_ns_q12 > FCURVE_TIME_MAX_NS_Q12)
        return MOTION_E_RANGE;
    if (fcurve_place(curve, t_ns_q12, side, &lap) && curve->count > 1)
        return fcurve_repeat(curve, &lap, side, value);
    fcurve_beyond(curve, t_ns_q12, t_ns_q12 <= curve->key[0].at.t_ns_q12,
                  value);
    return MOTION_OK;
}
