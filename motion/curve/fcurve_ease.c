/* motion/curve/fcurve_ease.c - Penner's easing equations.  See fcurve.h.
 *
 * Each kind is written once, as it eases in: a jet of y, which goes from 0 to 1
 * and ends at the change.  Out is the same turned round, y = 1 - x; in-out is
 * one half of each, y = 2x and then 2 - 2x. */
#include "motion/curve/fcurve_internal.h"

#include "motion/core/fixed.h"
#include "motion/number/elementary.h"

/* y, and what chooses the formula. */
struct ease_at {
    struct motion_real y, rest; /* rest = 1 - y without cancelling */
    struct motion_real inside;  /* 1 - y inside the piece */
    int64_t dur;
    struct motion_real change;
    bool halves;
};

typedef struct fcurve_jet ease_kind(const struct motion_fcurve_key *key,
                                    const struct ease_at *at);

static struct motion_real ease_one(void)
{
    return motion_real_int(1);
}

static struct fcurve_jet ease_scale(struct fcurve_jet jet,
                                    struct motion_real by)
{
    jet.f = motion_real_mul(jet.f, by);
    jet.d = motion_real_mul(jet.d, by);
    jet.dd = motion_real_mul(jet.dd, by);
    return jet;
}

/* y^2 .. y^5 */
static struct fcurve_jet ease_power(const struct motion_fcurve_key *key,
                                    const struct ease_at *at)
{
    const int64_t n = key->interpolation - MOTION_FCURVE_QUAD + 2;
    struct motion_real low = ease_one();
    struct fcurve_jet jet = { 0 };

    for (int i = 2; i < n; i++)
        low = motion_real_mul(low, at->y);
    jet.dd = curve_times(low, n * (n - 1));
    low = motion_real_mul(low, at->y);
    jet.d = curve_times(low, n);
    jet.f = motion_real_mul(low, at->y);
    return ease_scale(jet, at->change);
}

/* 1 - cos(y pi/2) = 2 sin(y pi/4)^2, which does not cancel. */
static struct fcurve_jet ease_sine(const struct motion_fcurve_key *key,
                                   const struct ease_at *at)
{
    const struct motion_real turn = motion_real_half(motion_elementary_pi());
    struct motion_real s, c;
    struct fcurve_jet jet = { 0 };

    (void)key;
    motion_elementary_sincos(motion_real_half(at->y), &s, &c);
    jet.f = motion_real_twice(motion_real_sqr(s));
    motion_elementary_sincos(at->y, &s, &c);
    jet.d = motion_real_mul(turn, s);
    jet.dd = motion_real_mul(motion_real_sqr(turn), c);
    return ease_scale(jet, at->change);
}

/* 2^(10 (y - 1)) and the factor of its derivative. */
static struct motion_real ease_exp(const struct ease_at *at)
{
    return motion_elementary_exp2(curve_times(at->rest, -10));
}

static struct motion_real ease_exp_rate(void)
{
    return curve_times(motion_elementary_ln2(), 10);
}

/* (2^(10 (y-1)) - 2^-10) / (1 - 2^-10) */
static struct fcurve_jet ease_expo(const struct motion_fcurve_key *key,
                                   const struct ease_at *at)
{
    const struct motion_real e = ease_exp(at), rate = ease_exp_rate();
    const struct motion_real least = motion_real_scale(ease_one(), -10);
    struct fcurve_jet jet = { 0 };

    (void)key;
    jet.f = motion_real_sub(e, least);
    jet.d = motion_real_mul(rate, e);
    jet.dd = motion_real_mul(rate, jet.d);
    return ease_scale(
        jet, motion_real_div(at->change, motion_real_sub(ease_one(), least)));
}

/* 1 - sqrt(1 - y^2) = y^2 / (1 + sqrt(1 - y^2)); vertical at the end. */
static struct fcurve_jet ease_circ(const struct motion_fcurve_key *key,
                                   const struct ease_at *at)
{
    const struct motion_real root = motion_real_sqrt(
        motion_real_mul(at->rest, motion_real_add(ease_one(), at->y)));
    struct fcurve_jet jet = { .steep = motion_real_is_zero(root) };

    (void)key;
    jet.f = motion_real_div(motion_real_sqr(at->y),
                            motion_real_add(ease_one(), root));
    if (jet.steep) {
        jet.d = motion_real_scale(ease_one(), 200);
    } else {
        jet.d = motion_real_div(at->y, root);
        jet.dd = motion_real_div(ease_one(),
                                 motion_real_mul(root, motion_real_sqr(root)));
    }
    return ease_scale(jet, at->change);
}

/* (o + 1) y^3 - o y^2 */
static struct fcurve_jet ease_back(const struct motion_fcurve_key *key,
                                   const struct ease_at *at)
{
    struct motion_real o = motion_real_from_q(key->back_q32, 32), o1;
    struct fcurve_jet jet = { 0 };

    if (at->halves)
        o = fcurve_over(curve_times(o, 1525), 1000);
    o1 = motion_real_add(o, ease_one());
    jet.dd = motion_real_sub(motion_real_mul(curve_times(o1, 6), at->y),
                             motion_real_twice(o));
    jet.d = motion_real_mul(
        at->y, motion_real_sub(motion_real_mul(curve_times(o1, 3), at->y),
                               motion_real_twice(o)));
    jet.f = motion_real_mul(motion_real_sqr(at->y),
                            motion_real_sub(motion_real_mul(o1, at->y), o));
    return ease_scale(jet, at->change);
}

/* Where bounces end, in 1/11 of the span from the end of in, and where they are
 * lowest, in 1/22, and how high that is, in 1/64. */
static const struct {
    int end_11, centre_22, low_64;
} ease_bounces[] = {
    { 4, 0, 0 }, { 8, 12, 48 }, { 10, 18, 60 }, { 11, 21, 63 }
};
#define EASE_BOUNCES 4

/* 1 - (121/16 (z - centre)^2 + low), z = 1 - y */
static struct fcurve_jet ease_bounce(const struct motion_fcurve_key *key,
                                     const struct ease_at *at)
{
    const struct motion_real steep = fcurve_over(fcurve_whole(121), 16);
    struct motion_real z;
    struct fcurve_jet jet = { 0 };
    int i = 0;

    (void)key;
    while (i < EASE_BOUNCES - 1 &&
           motion_real_cmp(curve_times(at->inside, 11),
                           fcurve_whole(ease_bounces[i].end_11)) >= 0)
        i++;
    z = motion_real_sub(
        at->rest, fcurve_over(fcurve_whole(ease_bounces[i].centre_22), 22));
    jet.f = motion_real_sub(
        fcurve_over(fcurve_whole(64 - ease_bounces[i].low_64), 64),
        motion_real_mul(steep, motion_real_sqr(z)));
    jet.d = motion_real_mul(motion_real_twice(steep), z);
    jet.dd = motion_real_neg(motion_real_twice(steep));
    return ease_scale(jet, at->change);
}

/* An oscillation that grows: -g A 2^(10k) sin(2 pi (k D - s)/P), k = y - 1. */
struct ease_spring {
    struct motion_real swing;       /* A */
    struct motion_real quarters;    /* 4 s/P */
    struct motion_real per_quarter; /* 4 D/P */
    struct motion_real weak;        /* g far from the end */
    struct motion_real fade;        /* |s|/D: nearer to the end g goes to 1 */
    bool fades;
};

static struct ease_spring ease_spring(const struct motion_fcurve_key *key,
                                      struct motion_real change, int64_t dur,
                                      bool halves)
{
    const struct motion_real amplitude =
        motion_real_from_q(key->amplitude_q32, 32);
    const struct motion_real size = motion_real_abs(change);
    struct motion_real period = fcurve_whole(key->period_ns_q12);
    struct ease_spring spring = { .weak = ease_one() };

    if (key->period_ns_q12 == 0)
        period =
            fcurve_over(curve_times(fcurve_whole(dur), halves ? 45 : 30), 100);
    spring.per_quarter =
        motion_real_div(curve_times(fcurve_whole(dur), 4), period);
    spring.swing = amplitude;
    if (motion_real_cmp(amplitude, size) >= 0) {
        if (!motion_real_is_zero(amplitude))
            spring.quarters =
                motion_elementary_asin(motion_real_div(change, amplitude));
        else
            spring.quarters = motion_real_zero();
        return spring;
    }
    spring.swing = change;
    spring.quarters = ease_one();
    spring.fade =
        motion_real_abs(motion_real_div(ease_one(), spring.per_quarter));
    spring.fades = !motion_real_is_zero(size);
    if (spring.fades)
        spring.weak = motion_real_div(amplitude, size);
    return spring;
}

/* g and its derivative: 1 + (weak - 1) (1 - y)/fade, until it is weak. */
static void ease_spring_strength(const struct ease_spring *spring,
                                 const struct ease_at *at,
                                 struct motion_real *g, struct motion_real *d)
{
    struct motion_real less;

    *g = spring->weak;
    *d = motion_real_zero();
    if (!spring->fades || motion_real_cmp(at->inside, spring->fade) >= 0)
        return;
    less = motion_real_sub(spring->weak, ease_one());
    less = motion_real_div(less, spring->fade);
    *g = motion_real_add(ease_one(), motion_real_mul(less, at->rest));
    *d = motion_real_neg(less);
}

/* With rate r of the exponential and w of the sine, q = 2^(10k) sin:
 * q' = 2^(10k) (r sin + w cos), q'' = 2^(10k) ((r^2 - w^2) sin + 2 r w cos) */
static struct fcurve_jet ease_elastic(const struct motion_fcurve_key *key,
                                      const struct ease_at *at)
{
    const struct ease_spring spring =
        ease_spring(key, at->change, at->dur, at->halves);
    const struct motion_real e = ease_exp(at), r = ease_exp_rate();
    const struct motion_real w = motion_real_mul(
        spring.per_quarter, motion_real_half(motion_elementary_pi()));
    struct motion_real s, c, g, dg;
    struct fcurve_jet q = { 0 }, jet = { 0 };

    motion_elementary_sincos(
        motion_real_neg(motion_real_add(
            motion_real_mul(spring.per_quarter, at->rest), spring.quarters)),
        &s, &c);
    q.f = s;
    q.d = motion_real_add(motion_real_mul(r, s), motion_real_mul(w, c));
    q.dd = motion_real_sub(motion_real_sqr(r), motion_real_sqr(w));
    q.dd = motion_real_add(
        motion_real_mul(q.dd, s),
        motion_real_twice(motion_real_mul(motion_real_mul(r, w), c)));
    ease_spring_strength(&spring, at, &g, &dg);
    jet.f = motion_real_mul(g, q.f);
    jet.d = motion_real_add(motion_real_mul(dg, q.f), motion_real_mul(g, q.d));
    jet.dd = motion_real_add(motion_real_twice(motion_real_mul(dg, q.d)),
                             motion_real_mul(g, q.dd));
    return ease_scale(jet, motion_real_neg(motion_real_mul(spring.swing, e)));
}

static ease_kind *const ease_kinds[] = {
    [MOTION_FCURVE_SINE] = ease_sine,
    [MOTION_FCURVE_QUAD] = ease_power,
    [MOTION_FCURVE_CUBIC] = ease_power,
    [MOTION_FCURVE_QUART] = ease_power,
    [MOTION_FCURVE_QUINT] = ease_power,
    [MOTION_FCURVE_EXPO] = ease_expo,
    [MOTION_FCURVE_CIRC] = ease_circ,
    [MOTION_FCURVE_BACK] = ease_back,
    [MOTION_FCURVE_BOUNCE] = ease_bounce,
    [MOTION_FCURVE_ELASTIC] = ease_elastic,
};

static int ease_direction(const struct motion_fcurve_key *key)
{
    if (key->easing != MOTION_FCURVE_BY_KIND)
        return key->easing;
    return key->interpolation >= MOTION_FCURVE_BACK ? MOTION_FCURVE_OUT
                                                    : MOTION_FCURVE_IN;
}

/* In from the start: y = x; out towards the end: y = 1 - x; halves at twice
 * the speed.  at, dur <= 2^61. */
static struct ease_at ease_place(const struct fcurve_when *when, bool out,
                                 bool halves, struct motion_real change)
{
    const int64_t at = out ? when->dur - when->at : when->at;
    const int64_t inside = out ? when->dur - when->inside : when->inside;
    const int times = halves ? 2 : 1;
    const struct motion_real dur = fcurve_whole(when->dur);

    return (struct ease_at){
        .y = motion_real_div(fcurve_whole(times * at), dur),
        .rest = motion_real_div(fcurve_whole(when->dur - times * at), dur),
        .inside =
            motion_real_div(fcurve_whole(when->dur - times * inside), dur),
        .dur = when->dur,
        .change = change,
        .halves = halves,
    };
}

struct fcurve_jet fcurve_ease(const struct motion_fcurve_key *key,
                              struct motion_real change,
                              const struct fcurve_when *when)
{
    const int direction = ease_direction(key);
    const bool halves = direction == MOTION_FCURVE_IN_OUT;
    const bool out = direction == MOTION_FCURVE_OUT ||
                     (halves && when->inside > when->dur - when->inside);
    const struct ease_at at = ease_place(when, out, halves, change);
    struct fcurve_jet jet = ease_kinds[key->interpolation](key, &at);

    if (halves) {
        jet.f = motion_real_half(jet.f);
        jet.dd = motion_real_twice(jet.dd);
    }
    if (out) {
        jet.f = motion_real_sub(change, jet.f);
        jet.dd = motion_real_neg(jet.dd);
    }
    return jet;
}

/* --- breaks --------------------------------------------------------------- */

/* Where the formula of easing in changes, 1 - y, descending with y. */
static int ease_base_breaks(const struct motion_fcurve_key *key,
                            struct motion_real change, int64_t dur, bool halves,
                            struct motion_real rest[3])
{
    int n = 0;

    if (key->interpolation == MOTION_FCURVE_BOUNCE) {
        for (int i = EASE_BOUNCES - 2; i >= 0; i--)
            rest[n++] = fcurve_over(fcurve_whole(ease_bounces[i].end_11), 11);
    } else if (key->interpolation == MOTION_FCURVE_ELASTIC) {
        const struct ease_spring spring = ease_spring(key, change, dur, halves);

        if (spring.fades && motion_real_lt(spring.fade, ease_one()))
            rest[n++] = spring.fade;
    }
    return n;
}

static int64_t ease_break(struct motion_real x, int64_t dur)
{
    int64_t at = 0;

    (void)motion_real_floor(motion_real_mul(x, fcurve_whole(dur)), 0, &at);
    return at;
}

int fcurve_ease_breaks(const struct motion_fcurve_key *key,
                       struct motion_real change, int64_t dur,
                       int64_t at[FCURVE_BREAKS_MAX])
{
    const int direction = ease_direction(key);
    const bool halves = direction == MOTION_FCURVE_IN_OUT;
    struct motion_real rest[3], x[FCURVE_BREAKS_MAX];
    int n = ease_base_breaks(key, change, dur, halves, rest), count = 0;

    for (int i = 0; i < n && direction != MOTION_FCURVE_OUT; i++)
        x[count++] = motion_real_sub(ease_one(), rest[i]);
    if (halves) {
        for (int i = 0; i < n; i++)
            x[i] = motion_real_half(x[i]);
        x[count++] = motion_real_half(ease_one());
        for (int i = n - 1; i >= 0; i--)
            x[count++] = motion_real_sub(ease_one(), x[i]);
    }
    for (int i = n - 1; i >= 0 && direction == MOTION_FCURVE_OUT; i--)
        x[count++] = rest[i];
    for (int i = 0; i < count; i++)
        at[i] = ease_break(x[i], dur);
    return count;
}
