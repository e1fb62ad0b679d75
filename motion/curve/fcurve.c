/* motion/curve/fcurve.c - the value of a curve at a time.  See fcurve.h. */
#include "motion/curve/fcurve.h"

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/fcurve_internal.h"

#define FCURVE_NEWTON_MAX 200
#define FCURVE_NEAR_STEPS 6
#define FCURVE_NEAR_SLOPE ((int64_t)1 << 22) /* Q28; below, halving is safer */

/* --- Bezier --------------------------------------------------------------- */

/* The middle control points, the span being 1 wide: from its start (x1, y1),
 * back from its end (x2, y2). */
struct fcurve_bezier {
    struct motion_real x1, x2, y1, y2, change;
};

/* A handle longer in time than the span is shortened to it. */
static void fcurve_shorten(struct motion_real *x, struct motion_real *y)
{
    if (motion_real_cmp(*x, fcurve_whole(1)) <= 0)
        return;
    *y = motion_real_div(*y, *x);
    *x = fcurve_whole(1);
}

static struct fcurve_bezier fcurve_bezier(const struct motion_fcurve_key *a,
                                          const struct motion_fcurve_key *b)
{
    const struct fcurve_offset from = fcurve_get(&a->right, &a->at);
    const struct fcurve_offset to = fcurve_get(&b->left, &b->at);
    const struct fcurve_offset chord = fcurve_get(&b->at, &a->at);
    struct fcurve_bezier z = { motion_real_div(motion_real_abs(from.t),
                                               chord.t),
                               motion_real_div(motion_real_abs(to.t), chord.t),
                               from.pos, motion_real_neg(to.pos), chord.pos };

    fcurve_shorten(&z.x1, &z.y1);
    fcurve_shorten(&z.x2, &z.y2);
    return z;
}

/* The cubic 0, p1, end - p2, end:
 * 3 p1 u + 3 (end - p2 - 2 p1) u^2 + (3 p1 + 3 p2 - 2 end) u^3 */
struct fcurve_cubic {
    struct motion_real c1, c2, c3;
};

static struct fcurve_cubic fcurve_powers(struct motion_real p1,
                                         struct motion_real p2,
                                         struct motion_real end)
{
    return (struct fcurve_cubic){
        fcurve_times(p1, 3),
        fcurve_times(
            motion_real_sub(motion_real_sub(end, p2), motion_real_twice(p1)),
            3),
        motion_real_sub(fcurve_times(motion_real_add(p1, p2), 3),
                        motion_real_twice(end)),
    };
}

/* Its value at u and its derivatives by u. */
static struct fcurve_jet fcurve_cubic(const struct fcurve_cubic *c,
                                      struct motion_real u)
{
    const struct motion_real twice = motion_real_twice(c->c2);
    const struct motion_real c3u = motion_real_mul(c->c3, u);
    const struct motion_real thrice = fcurve_times(c3u, 3);
    struct fcurve_jet jet = { 0 };

    jet.f = motion_real_mul(motion_real_add(c->c2, c3u), u);
    jet.f = motion_real_mul(motion_real_add(jet.f, c->c1), u);
    jet.d = motion_real_add(twice, thrice);
    jet.d = motion_real_add(motion_real_mul(jet.d, u), c->c1);
    jet.dd = motion_real_add(twice, motion_real_twice(thrice));
    return jet;
}

/* About u where x(u) = x, to 28 bits as a rule, by Newton's method in 64 bits;
 * coefficients in Q28, u in Q30. */
static struct motion_real fcurve_near(const struct fcurve_bezier *z,
                                      struct motion_real x)
{
    const int64_t one = (int64_t)1 << 28, whole = (int64_t)1 << 30;
    int64_t p1, p2, at, u;

    if (motion_real_round(z->x1, 28, &p1) < 0 ||
        motion_real_round(z->x2, 28, &p2) < 0 ||
        motion_real_round(x, 28, &at) < 0)
        return x;
    const int64_t c1 = 3 * p1, c2 = 3 * (one - p2 - 2 * p1),
                  c3 = 3 * (p1 + p2) - 2 * one;
    u = at * 4;
    for (int i = 0; i < FCURVE_NEAR_STEPS; i++) {
        const int64_t f =
            ((((((c3 * u) >> 30) + c2) * u) >> 30) + c1) * u / whole - at;
        const int64_t d = (((3 * ((c3 * u) >> 30) + 2 * c2) * u) >> 30) + c1;
        if (d < FCURVE_NEAR_SLOPE)
            return x;
        u -= f * whole / d;
        u = u < 0 ? 0 : u > whole ? whole : u;
    }
    return motion_real_from_q(u, 30);
}

/* u where x(u) = x: Newton's method kept between two bounds, which are halved
 * where it would leave them or does not halve its step.  x(u) rises, as 0 <=
 * x1, x2 <= 1, but may be level at one place. */
static struct motion_real fcurve_invert(const struct fcurve_bezier *z,
                                        struct motion_real x)
{
    const struct fcurve_cubic x_of =
        fcurve_powers(z->x1, z->x2, fcurve_whole(1));
    struct motion_real low = motion_real_zero(), high = fcurve_whole(1);
    struct motion_real u = fcurve_near(z, x), step = high;

    for (int i = 0; i < FCURVE_NEWTON_MAX; i++) {
        const struct fcurve_jet at = fcurve_cubic(&x_of, u);
        const struct motion_real over = motion_real_sub(at.f, x);
        struct motion_real next;

        if (over.m == 0)
            return u;
        if (over.m < 0)
            low = u;
        else
            high = u;
        next = u;
        if (at.d.m > 0)
            next = motion_real_sub(u, motion_real_div(over, at.d));
        if (at.d.m <= 0 || motion_real_lt(next, low) ||
            motion_real_lt(high, next) ||
            motion_real_cmp(motion_real_abs(motion_real_sub(next, u)),
                            motion_real_half(step)) > 0)
            next = motion_real_half(motion_real_add(low, high));
        step = motion_real_abs(motion_real_sub(next, u));
        u = next;
        if (step.m == 0 || step.e < u.e - 58)
            return u;
    }
    return u;
}

/* Where x(u) stands still.  With u small, x = a2 u^2 + .., y = b2 u^2 + ..: the
 * slope is finite where y stands still too, the second derivative where y is
 * a multiple of x. */
static struct fcurve_jet fcurve_standing(const struct fcurve_jet *x,
                                         const struct fcurve_jet *y,
                                         struct motion_real jerk_x,
                                         struct motion_real jerk_y)
{
    struct fcurve_jet jet = { .f = y->f, .steep = true };
    struct motion_real cross;

    jet.dd = motion_real_zero();
    jet.d = motion_real_scale(fcurve_whole(motion_real_sign(y->d)), 200);
    if (!motion_real_is_zero(y->d))
        return jet;
    if (motion_real_is_zero(x->dd)) { /* x = u^3 */
        jet.d = motion_real_scale(fcurve_whole(motion_real_sign(y->dd)), 200);
        if (motion_real_is_zero(y->dd)) {
            jet.d = motion_real_div(jerk_y, jerk_x);
            jet.steep = false;
        }
        return jet;
    }
    jet.d = motion_real_div(y->dd, x->dd);
    cross = motion_real_sub(jerk_y, motion_real_mul(jet.d, jerk_x));
    jet.steep = !motion_real_is_zero(cross) && cross.e > jerk_y.e - 50;
    return jet;
}

static struct motion_real fcurve_jerk(struct motion_real p1,
                                      struct motion_real p2,
                                      struct motion_real end)
{
    return fcurve_times(
        motion_real_sub(fcurve_times(motion_real_add(p1, p2), 3),
                        motion_real_twice(end)),
        6);
}

/* By x: dy/dx = y'/x', d2y/dx2 = (y'' - dy/dx x'') / x'^2 */
static struct fcurve_jet fcurve_at_u(const struct fcurve_bezier *z,
                                     struct motion_real u)
{
    const struct motion_real one = fcurve_whole(1);
    const struct fcurve_cubic x_of = fcurve_powers(z->x1, z->x2, one),
                              y_of = fcurve_powers(z->y1, z->y2, z->change);
    const struct fcurve_jet x = fcurve_cubic(&x_of, u),
                            y = fcurve_cubic(&y_of, u);
    struct fcurve_jet jet = { .f = y.f };

    if (x.d.m <= 0 || x.d.e < -61 - 50)
        return fcurve_standing(&x, &y, fcurve_jerk(z->x1, z->x2, one),
                               fcurve_jerk(z->y1, z->y2, z->change));
    jet.d = motion_real_div(y.d, x.d);
    jet.dd = motion_real_sub(y.dd, motion_real_mul(jet.d, x.dd));
    jet.dd = motion_real_div(jet.dd, motion_real_sqr(x.d));
    return jet;
}

/* The nearer end is where u = 0, so that what stands still there is exact. */
static struct fcurve_jet fcurve_bezier_at(const struct motion_fcurve_key *a,
                                          const struct motion_fcurve_key *b,
                                          const struct fcurve_when *when)
{
    const struct motion_real dur = fcurve_whole(when->dur);
    struct fcurve_bezier z = fcurve_bezier(a, b);
    const bool back = when->at > when->dur - when->at;
    const int64_t near = back ? when->dur - when->at : when->at;
    struct motion_real x = motion_real_div(fcurve_whole(near), dur);
    struct fcurve_jet jet;

    if (back)
        z = (struct fcurve_bezier){ z.x2, z.x1, z.y2, z.y1, z.change };
    jet = fcurve_at_u(&z, fcurve_invert(&z, x));
    if (back) {
        jet.f = motion_real_sub(z.change, jet.f);
        jet.dd = motion_real_neg(jet.dd);
    }
    return jet;
}

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
            fcurve_times(fcurve_difference(last->at.pos_q32,
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
