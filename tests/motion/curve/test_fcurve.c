/* tests/motion/curve/test_fcurve.c - keys with handles: handles from their
 * kinds, values by hand and by the definitions in long double, and tracks
 * against the curve. */
#include <inttypes.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/fcurve.h"
#include "motion/number/elementary.h"
#include "tests/support/check.h"

#define FRAME     (MOTION_FIXED_S_Q12 / 24)
#define KEYS      40
#define SEGMENTS  20000
#define REACH     (1 / 2.5614L)
#define NO_FAILED 99

static const long double pi = 3.14159265358979323846264338327950288L;

/* --- curves to write down ------------------------------------------------- */

static struct motion_fcurve_key keys[KEYS];
static struct motion_fcurve_work work[KEYS];
static struct motion_fcurve curve;

static int64_t frames(long double t)
{
    return (int64_t)llroundl(t * FRAME);
}

static int64_t units(long double v)
{
    return (int64_t)llroundl(v * 4294967296.0L);
}

static struct motion_fcurve_point point(long double t, long double v)
{
    return (struct motion_fcurve_point){ frames(t), units(v) };
}

static void begin(void)
{
    memset(keys, 0, sizeof keys);
    curve = (struct motion_fcurve){ .key = keys };
}

static struct motion_fcurve_key *
add(long double t, long double v, enum motion_fcurve_handle kind,
    enum motion_fcurve_interpolation displacement)
{
    struct motion_fcurve_key *key = &keys[curve.count++];

    *key = (struct motion_fcurve_key){ .at = point(t, v),
                                       .left = point(t, v),
                                       .right = point(t, v),
                                       .left_kind = (uint8_t)kind,
                                       .right_kind = (uint8_t)kind,
                                       .interpolation = (uint8_t)displacement };
    return key;
}

static void compute_handles(void)
{
    uint32_t failed = NO_FAILED;

    assert_int_equal(motion_fcurve_handles(&curve, work, &failed), MOTION_OK);
}

/* --- what comes back ------------------------------------------------------ */

static long double value_of(struct motion_real a)
{
    return ldexpl((long double)a.m, a.e);
}

static struct motion_fcurve_value at_side(int64_t t,
                                          enum motion_fcurve_side side)
{
    struct motion_fcurve_value value;

    assert_int_equal(motion_fcurve_at(&curve, t, side, &value), MOTION_OK);
    return value;
}

static long double pos_at(long double t)
{
    return value_of(at_side(frames(t), MOTION_FCURVE_AT).pos);
}

static void near_to(const char *what, long double got, long double want,
                    long double within)
{
    if (!(fabsl(got - want) <= within))
        fail_msg("%s: %.15Lg instead of %.15Lg", what, got, want);
}

static void handle_is(const char *what, const struct motion_fcurve_point *got,
                      long double t, long double v)
{
    near_to(what, (long double)got->t_ns_q12 / FRAME, t, 1e-9L);
    near_to(what, (long double)got->pos_q32 / 4294967296.0L, v, 1e-8L);
}

/* --- handles -------------------------------------------------------------- */

static void automatic_handles_have_the_mean_slope(void **state)
{
    (void)state;
    begin();
    add(0, 0, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    add(10, 20, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    add(14, 24, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    compute_handles();
    handle_is("left", &keys[1].left, 10 - 10 * REACH, 20 - 15 * REACH);
    handle_is("right", &keys[1].right, 10 + 4 * REACH, 20 + 6 * REACH);
    handle_is("flat end", &keys[2].left, 14 - 4 * REACH, 24);
    curve.extrapolation = MOTION_FCURVE_LINE;
    compute_handles();
    handle_is("end", &keys[2].left, 14 - 4 * REACH, 24 - 4 * REACH);
    handle_is("mirrored", &keys[0].left, -10 * REACH, -20 * REACH);
}

static void a_span_counts_for_at_most_five_of_its_neighbour(void **state)
{
    (void)state;
    begin();
    add(0, 0, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    add(100, 0, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    add(101, 2, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    compute_handles();
    handle_is("left", &keys[1].left, 100 - 5 * REACH, -5 * REACH);
    handle_is("right", &keys[1].right, 100 + REACH, REACH);
}

static void clamped_handles_stay_within_their_neighbours(void **state)
{
    (void)state;
    begin();
    add(0, 0, MOTION_FCURVE_CLAMPED, MOTION_FCURVE_BEZIER);
    add(10, 1, MOTION_FCURVE_CLAMPED, MOTION_FCURVE_BEZIER);
    add(20, 41, MOTION_FCURVE_CLAMPED, MOTION_FCURVE_BEZIER);
    add(30, 41, MOTION_FCURVE_CLAMPED, MOTION_FCURVE_BEZIER);
    add(40, 7, MOTION_FCURVE_CLAMPED, MOTION_FCURVE_BEZIER);
    compute_handles();
    /* slope 2.05 would reach 8 below; the other one turns with it */
    handle_is("clamped", &keys[1].left, 10 - 10 * REACH, 0);
    handle_is("turned", &keys[1].right, 10 + 10 * REACH, 2);
    handle_is("plateau", &keys[2].right, 20 + 10 * REACH, 41);
    handle_is("plateau", &keys[3].left, 30 - 10 * REACH, 41);
}

static void span_only_rises(uint32_t i)
{
    const int64_t from = keys[i].at.t_ns_q12;
    const int64_t dur = keys[i + 1].at.t_ns_q12 - from;
    const long double top = (long double)keys[i + 1].at.pos_q32 / 4294967296.0L;
    long double last = (long double)keys[i].at.pos_q32 / 4294967296.0L;

    for (int k = 1; k <= 50; k++) {
        const long double p =
            value_of(at_side(from + dur / 50 * k, MOTION_FCURVE_AT).pos);

        if (p < last - 1e-8L || p > top + 1e-8L)
            fail_msg("span %u, %d: %Lg after %Lg", i, k, p, last);
        last = p;
    }
}

static void a_clamped_curve_never_leaves_its_keys(void **state)
{
    static const int v[] = { 0, 3, 3, 20, 21, 90, 90, 91 };
    uint64_t seed = 0x5EED;

    (void)state;
    for (int smooth = 0; smooth < 2; smooth++) {
        long double t = 0;

        begin();
        curve.smoothing = (uint8_t)smooth;
        for (size_t i = 0; i < ARRAY_LEN(v); i++) {
            t += (long double)check_random_in(&seed, 1, 30);
            add(t, v[i], MOTION_FCURVE_CLAMPED, MOTION_FCURVE_BEZIER);
        }
        compute_handles();
        for (uint32_t i = 0; i + 1 < ARRAY_LEN(v); i++)
            span_only_rises(i);
    }
}

static void vector_handles_go_a_third_of_the_way(void **state)
{
    (void)state;
    begin();
    add(0, 0, MOTION_FCURVE_VECTOR, MOTION_FCURVE_BEZIER);
    add(30, 90, MOTION_FCURVE_VECTOR, MOTION_FCURVE_BEZIER);
    compute_handles();
    handle_is("right", &keys[0].right, 10, 30);
    handle_is("left", &keys[1].left, 20, 60);
    handle_is("outside", &keys[1].right, 40, 120);
    near_to("straight", pos_at(7), 21, 1e-8L);
    add(42, 0, MOTION_FCURVE_VECTOR, MOTION_FCURVE_BEZIER);
    compute_handles();
    handle_is("left", &keys[1].left, 20, 60);
    handle_is("right", &keys[1].right, 34, 60);
}

/* 3-4-5: frames and values count alike. */
static void an_aligned_handle_keeps_its_length(void **state)
{
    (void)state;
    for (int scale = 1; scale <= 1000; scale *= 1000) {
        begin();
        curve.value_q32 = units(scale);
        add(0, 0, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER);
        add(50, 0, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER);
        keys[1].left = point(40, 0);
        keys[1].right = point(53, 4 * scale);
        keys[1].left_kind = keys[1].right_kind = MOTION_FCURVE_ALIGNED;
        compute_handles();
        handle_is("aligned", &keys[1].left, 44, -8 * scale);
    }
}

static void an_aligned_handle_beside_a_free_one_stays(void **state)
{
    (void)state;
    begin();
    add(0, 0, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER);
    add(50, 0, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER);
    keys[1].left = point(40, 0);
    keys[1].right = point(53, 4);
    keys[1].left_kind = MOTION_FCURVE_ALIGNED;
    compute_handles();
    handle_is("aligned", &keys[1].left, 40, 0);
}

static void handles_do_not_stand_on_the_wrong_side(void **state)
{
    (void)state;
    begin();
    add(0, 0, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER)->right = point(-5, 3);
    add(10, 5, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER)->left = point(12, 4);
    compute_handles();
    handle_is("right", &keys[0].right, 0, 3);
    handle_is("left", &keys[1].left, 10, 4);
}

/* Natural conditions do not apply: free ends of a HOLD curve are at rest. */
static void smooth_handles_join_accelerations(void **state)
{
    (void)state;
    begin();
    curve.smoothing = MOTION_FCURVE_SMOOTH_ACCELERATION;
    add(0, 0, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    add(7, 12, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    add(9, -5, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    add(30, 2, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    add(33, 8, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    compute_handles();
    near_to("rest", value_of(at_side(frames(0), MOTION_FCURVE_RIGHT).vel), 0,
            1e-6L);
    for (uint32_t i = 1; i < 4; i++) {
        const int64_t t = keys[i].at.t_ns_q12;
        const struct motion_fcurve_value l = at_side(t, MOTION_FCURVE_LEFT);
        const struct motion_fcurve_value r = at_side(t, MOTION_FCURVE_RIGHT);

        near_to("vel", value_of(l.vel), value_of(r.vel), 1e-6L);
        near_to("acc", value_of(l.acc), value_of(r.acc), 1e-4L);
    }
}

/* Whatever the times of the handles that stay are. */
static void smooth_handles_join_those_that_stay(void **state)
{
    (void)state;
    begin();
    curve.smoothing = MOTION_FCURVE_SMOOTH_ACCELERATION;
    add(0, 0, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER)->right = point(1, 9);
    add(10, 12, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    add(16, -5, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    add(28, 2, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER)->left = point(21, 4);
    compute_handles();
    for (uint32_t i = 1; i < 3; i++) {
        const int64_t t = keys[i].at.t_ns_q12;
        const struct motion_fcurve_value l = at_side(t, MOTION_FCURVE_LEFT);
        const struct motion_fcurve_value r = at_side(t, MOTION_FCURVE_RIGHT);

        near_to("vel", value_of(l.vel), value_of(r.vel), 1e-6L);
        near_to("acc", value_of(l.acc), value_of(r.acc), 1e-4L);
    }
}

/* Handles from a model in double precision: key 63 is first held at a limit
 * and then let go, because its neighbours are held too. */
static void held_slopes_are_let_go_again(void **state)
{
    enum {
        V = MOTION_FCURVE_VECTOR,
        A = MOTION_FCURVE_AUTO,
        C = MOTION_FCURVE_CLAMPED
    };
    static const struct {
        int t, v;
        uint8_t left_kind, right_kind;
        double left, right;
    } rows[] = {
        { -14, 10, V, A, 5, 15 },
        { 16, 20, A, C, 22.5, 20 },
        { 46, -5, A, A, -2.635135135135135, -5.551801801801802 },
        { 53, -5, V, C, -5, -5 },
        { 56, 20, C, A, 20, 28.055555555555557 },
        { 63, 10, C, C, 19.242424242424246, 6.0389610389610375 },
        { 66, -5, V, C, 0.5194805194805188, -5 },
        { 73, 10, V, C, 2.5, 17.5 },
    };

    (void)state;
    begin();
    curve.smoothing = MOTION_FCURVE_SMOOTH_ACCELERATION;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        add(rows[i].t, rows[i].v, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER);
        keys[i].left_kind = rows[i].left_kind;
        keys[i].right_kind = rows[i].right_kind;
    }
    compute_handles();
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        near_to("left", (long double)keys[i].left.pos_q32 / 4294967296.0L,
                rows[i].left, 1e-8L);
        near_to("right", (long double)keys[i].right.pos_q32 / 4294967296.0L,
                rows[i].right, 1e-8L);
    }
}

static void smooth_cycles_join_across_the_seam(void **state)
{
    (void)state;
    begin();
    curve.smoothing = MOTION_FCURVE_SMOOTH_ACCELERATION;
    curve.before.mode = curve.after.mode = MOTION_FCURVE_REPEAT;
    add(0, 0, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    add(7, 12, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    add(9, -5, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    add(30, 0, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    compute_handles();
    const struct motion_fcurve_value l =
        at_side(frames(30), MOTION_FCURVE_LEFT);
    const struct motion_fcurve_value r =
        at_side(frames(30), MOTION_FCURVE_RIGHT);
    near_to("vel", value_of(l.vel), value_of(r.vel), 1e-6L);
    near_to("acc", value_of(l.acc), value_of(r.acc), 1e-4L);
    assert_true(fabsl(value_of(l.vel)) > 1);
}

/* --- Bezier --------------------------------------------------------------- */

/* Handles at a third of the span make t linear in u: a cubic by hand. */
static void thirds_are_a_cubic_of_time(void **state)
{
    (void)state;
    begin();
    add(0, 0, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER)->right = point(8, 6);
    add(24, 8, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER)->left = point(16, 9);
    compute_handles();
    for (int k = 0; k <= 24; k++) {
        const long double u = k / 24.0L;

        near_to("cubic", pos_at(k),
                18 * u * (1 - u) * (1 - u) + 27 * u * u * (1 - u) +
                    8 * u * u * u,
                1e-9L);
    }
    near_to("vel", value_of(at_side(0, MOTION_FCURVE_RIGHT).vel), 18, 1e-9L);
    near_to("acc", value_of(at_side(0, MOTION_FCURVE_RIGHT).acc), -18, 1e-8L);
}

/* t = x(u) of any handles, with u chosen: y must come back. */
static void bezier_spans_solve_for_time(void **state)
{
    uint64_t seed = 0xB5297A4D;

    (void)state;
    for (int i = 0; i < 2000; i++) {
        long double x[2], y[2], u, t, v;

        for (int k = 0; k < 2; k++) {
            x[k] = (long double)check_random_in(&seed, 0, 1000) / 1000;
            y[k] = (long double)check_random_in(&seed, -1000, 1000) / 100;
        }
        u = (long double)check_random_in(&seed, 1, 999) / 1000;
        begin();
        add(0, 0, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER)->right =
            point(24 * x[0], y[0]);
        add(24, 5, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER)->left =
            point(24 - 24 * x[1], y[1]);
        compute_handles();
        v = 1 - u;
        t = 3 * u * v * v * x[0] + 3 * u * u * v * (1 - x[1]) + u * u * u;
        if (3 * v * v * x[0] + 6 * u * v * (1 - x[1] - x[0]) +
                3 * u * u * x[1] <
            1e-3L)
            continue; /* vertical there */
        near_to("y", pos_at(24 * t),
                3 * u * v * v * y[0] + 3 * u * u * v * y[1] + 5 * u * u * u,
                1e-6L);
    }
}

static void long_handles_are_cut_to_the_span(void **state)
{
    (void)state;
    begin();
    add(0, 0, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER)->right = point(40, 8);
    add(10, 9, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER)->left = point(-20, 9);
    compute_handles();
    /* as handles (10, 2) and (0, 9): u = 1/2 at the middle */
    near_to("middle", pos_at(5), (3 * 2 + 3 * 9 + 9) / 8.0L, 1e-8L);
    near_to("start", pos_at(1e-6L), 0, 1e-3L);
}

static void vertical_handles_are_steep_not_wrong(void **state)
{
    struct motion_fcurve_value value;

    (void)state;
    begin();
    add(0, 0, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER)->right = point(0, 9);
    add(8, 0, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER)->left = point(8, 9);
    compute_handles();
    value = at_side(0, MOTION_FCURVE_RIGHT);
    assert_true(value.steep);
    assert_true(value_of(value.vel) > 1e9L);
    near_to("middle", pos_at(4), 27 / 4.0L, 1e-9L);
    near_to("start", pos_at(0), 0, 0);
}

static void no_handles_are_a_straight_line(void **state)
{
    (void)state;
    begin();
    add(0, -3, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER);
    add(24, 5, MOTION_FCURVE_FREE, MOTION_FCURVE_BEZIER);
    compute_handles();
    for (int k = 0; k <= 24; k++)
        near_to("line", pos_at(k), -3 + k / 3.0L, 1e-8L);
    assert_false(at_side(0, MOTION_FCURVE_RIGHT).steep);
    near_to("vel", value_of(at_side(0, MOTION_FCURVE_RIGHT).vel), 8, 1e-9L);
}

/* --- easing --------------------------------------------------------------- */

struct ease_case {
    enum motion_fcurve_interpolation kind;
    long double back, amplitude, period;
};

static const struct ease_case ease_cases[] = {
    { MOTION_FCURVE_SINE, 0, 0, 0 },     { MOTION_FCURVE_QUAD, 0, 0, 0 },
    { MOTION_FCURVE_CUBIC, 0, 0, 0 },    { MOTION_FCURVE_QUART, 0, 0, 0 },
    { MOTION_FCURVE_QUINT, 0, 0, 0 },    { MOTION_FCURVE_EXPO, 0, 0, 0 },
    { MOTION_FCURVE_CIRC, 0, 0, 0 },     { MOTION_FCURVE_BACK, 0, 0, 0 },
    { MOTION_FCURVE_BACK, 1.7L, 0, 0 },  { MOTION_FCURVE_BOUNCE, 0, 0, 0 },
    { MOTION_FCURVE_ELASTIC, 0, 0, 0 },  { MOTION_FCURVE_ELASTIC, 0, 3, 5 },
    { MOTION_FCURVE_ELASTIC, 0, 20, 7 },
};

static long double true_bounce(long double z)
{
    const long double a = 121 / 16.0L;

    if (z < 4 / 11.0L)
        return a * z * z;
    if (z < 8 / 11.0L)
        return a * (z - 6 / 11.0L) * (z - 6 / 11.0L) + 0.75L;
    if (z < 10 / 11.0L)
        return a * (z - 9 / 11.0L) * (z - 9 / 11.0L) + 0.9375L;
    return a * (z - 21 / 22.0L) * (z - 21 / 22.0L) + 0.984375L;
}

/* Elastic in, as its definition has it: k D is how long before the end. */
static long double true_elastic(const struct ease_case *c, long double y,
                                long double change, long double dur, bool half)
{
    const long double P =
        c->period != 0 ? c->period : dur * (half ? 0.45L : 0.3L);
    const long double k = y - 1;
    long double A = c->amplitude, g = 1, s;

    if (A >= fabsl(change)) {
        s = P / (2 * pi) * asinl(change / A);
    } else {
        s = P / 4;
        g = A / fabsl(change);
        A = change;
        if (-k * dur < s)
            g = g * (-k * dur / s) + 1 - -k * dur / s;
    }
    return -g * A * powl(2, 10 * k) * sinl(2 * pi * (k * dur - s) / P);
}

/* Easing in, from 0 to change. */
static long double true_in(const struct ease_case *c, long double y,
                           long double change, long double dur, bool half)
{
    const long double o = c->back * (half ? 1.525L : 1);

    switch (c->kind) {
    case MOTION_FCURVE_SINE:
        return change * (1 - cosl(y * pi / 2));
    case MOTION_FCURVE_EXPO:
        return change * (powl(2, 10 * (y - 1)) - 1 / 1024.0L) /
               (1 - 1 / 1024.0L);
    case MOTION_FCURVE_CIRC:
        return change * (1 - sqrtl(1 - y * y));
    case MOTION_FCURVE_BACK:
        return change * y * y * ((o + 1) * y - o);
    case MOTION_FCURVE_BOUNCE:
        return change * (1 - true_bounce(1 - y));
    case MOTION_FCURVE_ELASTIC:
        return true_elastic(c, y, change, dur, half);
    default:
        return change * powl(y, c->kind - MOTION_FCURVE_QUAD + 2);
    }
}

static long double true_ease(const struct ease_case *c, int displacement,
                             long double x, long double change, long double dur)
{
    if (displacement == MOTION_FCURVE_IN)
        return true_in(c, x, change, dur, false);
    if (displacement == MOTION_FCURVE_OUT)
        return change - true_in(c, 1 - x, change, dur, false);
    if (x <= 0.5L)
        return true_in(c, 2 * x, change, dur, true) / 2;
    return change - true_in(c, 2 - 2 * x, change, dur, true) / 2;
}

static void begin_ease(const struct ease_case *c, int displacement)
{
    begin();
    add(-4, 3, MOTION_FCURVE_FREE, c->kind);
    add(26, -7, MOTION_FCURVE_FREE, MOTION_FCURVE_LINEAR);
    keys[0].easing = (uint8_t)displacement;
    keys[0].back_q32 = units(c->back);
    keys[0].amplitude_q32 = units(c->amplitude);
    keys[0].period_ns_q12 = frames(c->period);
    compute_handles();
}

static void easing_follows_its_equation(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(ease_cases); i++)
        for (int displacement = MOTION_FCURVE_IN;
             displacement <= MOTION_FCURVE_IN_OUT; displacement++) {
            begin_ease(&ease_cases[i], displacement);
            for (int k = 1; k < 60; k++) {
                const long double x = k / 60.0L;
                const long double want =
                    3 + true_ease(&ease_cases[i], displacement, x, -10, 30);

                if (fabsl(pos_at(-4 + 30 * x) - want) > 1e-8L)
                    fail_msg("kind %d, way %d, x %Lg: %Lg instead of %Lg",
                             ease_cases[i].kind, displacement, x,
                             pos_at(-4 + 30 * x), want);
            }
        }
}

/* Differences of the value, h apart, away from breaks. */
static void easing_derivatives_are_those_of_its_value(void **state)
{
    const long double h = 0.01L;

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(ease_cases); i++)
        for (int displacement = MOTION_FCURVE_IN;
             displacement <= MOTION_FCURVE_IN_OUT; displacement++) {
            begin_ease(&ease_cases[i], displacement);
            for (int k = 1; k < 9; k++) {
                const long double t = -4 + 30 * (k / 9.0L + 0.013L);
                const struct motion_fcurve_value v =
                    at_side(frames(t), MOTION_FCURVE_AT);
                const long double a = pos_at(t - h), b = pos_at(t + h);
                const long double vel = (b - a) / (2 * h) * 24;
                const long double acc =
                    (a + b - 2 * value_of(v.pos)) / (h * h) * 576;

                near_to("vel", value_of(v.vel), vel, 2e-3L * (fabsl(vel) + 30));
                near_to("acc", value_of(v.acc), acc,
                        5e-3L * (fabsl(acc) + 3000));
            }
        }
}

static void easing_by_kind_is_out_for_the_lively_ones(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(ease_cases); i++) {
        const struct ease_case *c = &ease_cases[i];
        long double got;

        begin_ease(c, MOTION_FCURVE_BY_KIND);
        got = pos_at(5);
        begin_ease(c, c->kind >= MOTION_FCURVE_BACK ? MOTION_FCURVE_OUT
                                                    : MOTION_FCURVE_IN);
        near_to("by kind", got, pos_at(5), 0);
    }
}

static void sine_easing_matches_hand_values(void **state)
{
    const struct ease_case sine = { MOTION_FCURVE_SINE, 0, 0, 0 };

    (void)state;
    begin_ease(&sine, MOTION_FCURVE_IN);
    near_to("third", pos_at(6), 3 - 10 * (1 - sqrtl(3) / 2), 1e-9L);
    begin_ease(&sine, MOTION_FCURVE_IN_OUT);
    near_to("middle", pos_at(11), -2, 1e-9L);
    near_to("peak", value_of(at_side(frames(11), MOTION_FCURVE_AT).vel),
            -10 * pi / 2 * 24 / 30, 1e-9L);
}

/* --- outside -------------------------------------------------------------- */

static void begin_line(void)
{
    begin();
    add(0, 1, MOTION_FCURVE_VECTOR, MOTION_FCURVE_LINEAR);
    add(10, 3, MOTION_FCURVE_VECTOR, MOTION_FCURVE_LINEAR);
    add(20, 9, MOTION_FCURVE_VECTOR, MOTION_FCURVE_LINEAR);
    compute_handles();
}

static void ends_are_held_or_continued(void **state)
{
    (void)state;
    begin_line();
    near_to("held", pos_at(-5), 1, 0);
    near_to("held", pos_at(25), 9, 0);
    curve.extrapolation = MOTION_FCURVE_LINE;
    near_to("before", pos_at(-5), 0, 1e-9L);
    near_to("after", pos_at(25), 12, 1e-9L);
    keys[2].interpolation = MOTION_FCURVE_BEZIER;
    keys[2].right = point(22, 8);
    near_to("handle", pos_at(26), 6, 1e-9L);
    keys[2].interpolation = MOTION_FCURVE_CONSTANT;
    near_to("constant", pos_at(26), 9, 0);
    curve.count = 1;
    near_to("one key", pos_at(-5), 1, 0);
}

static void cycles_repeat_offset_and_mirror(void **state)
{
    static const struct {
        int mode;
        long double t, want;
    } rows[] = {
        { MOTION_FCURVE_REPEAT, 25, 2 },
        { MOTION_FCURVE_REPEAT, 20, 9 },
        { MOTION_FCURVE_REPEAT, 40, 9 },
        { MOTION_FCURVE_REPEAT, -5, 6 },
        { MOTION_FCURVE_REPEAT, -20, 1 },
        { MOTION_FCURVE_REPEAT_OFFSET, 25, 10 },
        { MOTION_FCURVE_REPEAT_OFFSET, 40, 17 },
        { MOTION_FCURVE_REPEAT_OFFSET, 65, 26 },
        { MOTION_FCURVE_REPEAT_OFFSET, -5, -2 },
        { MOTION_FCURVE_REPEAT_OFFSET, -40, -15 },
        { MOTION_FCURVE_MIRROR, 25, 6 },
        { MOTION_FCURVE_MIRROR, 40, 1 },
        { MOTION_FCURVE_MIRROR, 45, 2 },
        { MOTION_FCURVE_MIRROR, -5, 2 },
        { MOTION_FCURVE_MIRROR, -20, 9 },
        { MOTION_FCURVE_MIRROR, -25, 6 },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        begin_line();
        curve.before.mode = curve.after.mode = (uint8_t)rows[i].mode;
        if (fabsl(pos_at(rows[i].t) - rows[i].want) > 1e-9L)
            fail_msg("mode %d at %Lg: %Lg", rows[i].mode, rows[i].t,
                     pos_at(rows[i].t));
    }
    near_to("backwards", value_of(at_side(frames(-5), MOTION_FCURVE_AT).vel),
            -0.2L * 24, 1e-9L);
}

static void cycles_end_after_their_count(void **state)
{
    (void)state;
    begin_line();
    curve.before.mode = curve.after.mode = MOTION_FCURVE_REPEAT;
    curve.before.count = 1;
    curve.after.count = 2;
    near_to("second", pos_at(45), 2, 1e-9L);
    near_to("its end", pos_at(60), 9, 1e-9L);
    near_to("held", pos_at(61), 9, 0);
    near_to("first", pos_at(-15), 2, 1e-9L);
    near_to("held", pos_at(-21), 1, 0);
}

/* --- refusals ------------------------------------------------------------- */

static void bad_curves_are_refused(void **state)
{
    struct motion_fcurve_value value;
    uint32_t failed = NO_FAILED;

    (void)state;
    begin();
    assert_int_equal(motion_fcurve_handles(&curve, work, &failed),
                     MOTION_E_EMPTY);
    assert_int_equal(motion_fcurve_at(&curve, 0, MOTION_FCURVE_AT, &value),
                     MOTION_E_EMPTY);
    begin_line();
    keys[2].at.t_ns_q12 = keys[1].at.t_ns_q12;
    assert_int_equal(motion_fcurve_handles(&curve, work, &failed),
                     MOTION_E_ORDER);
    assert_int_equal(failed, 2);
    begin_line();
    keys[1].left_kind = 7;
    assert_int_equal(motion_fcurve_handles(&curve, work, NULL), MOTION_E_ARG);
    begin_line();
    curve.smoothing = MOTION_FCURVE_SMOOTH_ACCELERATION;
    assert_int_equal(motion_fcurve_handles(&curve, NULL, NULL), MOTION_E_ARG);
    begin_line();
    keys[2].at.t_ns_q12 = ((int64_t)1 << 60) + 1;
    assert_int_equal(motion_fcurve_handles(&curve, work, &failed),
                     MOTION_E_RANGE);
    begin_line();
    keys[0].interpolation = 13;
    assert_int_equal(motion_fcurve_at(&curve, 5, MOTION_FCURVE_AT, &value),
                     MOTION_E_ARG);
    assert_int_equal(
        motion_fcurve_at(&curve, INT64_MAX, MOTION_FCURVE_AT, &value),
        MOTION_E_RANGE);
    begin();
    add(0, 2147483647, MOTION_FCURVE_VECTOR, MOTION_FCURVE_BEZIER);
    add(1, -2147483647, MOTION_FCURVE_VECTOR, MOTION_FCURVE_BEZIER);
    assert_int_equal(motion_fcurve_handles(&curve, work, &failed),
                     MOTION_E_RANGE);
    assert_int_equal(failed, 0);
}

/* --- tracks --------------------------------------------------------------- */

static struct motion_segment segments[SEGMENTS];
static struct motion_track track;
static struct motion_fcurve_report report;

static int append(long double from, long double to, long double step)
{
    struct motion_fcurve_range range = {
        .from_ns_q12 = frames(from),
        .to_ns_q12 = frames(to),
        .within = { motion_real_make(1, -27), motion_real_zero(),
                    motion_real_zero() },
        .step = motion_real_from_q(units(step), 32),
    };

    motion_track_init(&track, segments, SEGMENTS, units(pos_at(from)));
    return motion_fcurve_append(&track, &curve, &range, &report);
}

/* Everywhere within the bound that was stated, and 2^-31 for rounding. */
static void track_follows_the_curve(long double from, long double to)
{
    const long double bound = value_of(report.bound.pos) + 0x1p-30L;
    struct motion_cursor cursor = { 0 };
    struct motion_sample sample;

    assert_int_equal(track.end_ns_q12, frames(to) - frames(from));
    for (int k = 0; k <= 5000; k++) {
        const int64_t t = track.end_ns_q12 / 5000 * k;
        const long double want =
            value_of(at_side(frames(from) + t, MOTION_FCURVE_AT).pos);

        motion_track_sample(&track, &cursor, t, &sample);
        if (fabsl((long double)sample.pos_q32 / 4294967296.0L - want) > bound)
            fail_msg("%d: %.12Lg instead of %.12Lg, bound %Lg", k,
                     (long double)sample.pos_q32 / 4294967296.0L, want, bound);
    }
}

static void polynomial_spans_are_one_segment_each(void **state)
{
    (void)state;
    begin();
    curve.smoothing = MOTION_FCURVE_SMOOTH_ACCELERATION;
    add(0, 3, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    add(7, 12, MOTION_FCURVE_AUTO, MOTION_FCURVE_LINEAR);
    add(9, -5, MOTION_FCURVE_AUTO, MOTION_FCURVE_QUINT);
    add(30, 2, MOTION_FCURVE_AUTO, MOTION_FCURVE_BACK);
    add(33, 2, MOTION_FCURVE_AUTO, MOTION_FCURVE_CONSTANT);
    add(50, 2, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    compute_handles();
    assert_int_equal(append(0, 50, 0), MOTION_OK);
    assert_int_equal(track.count, 5);
    near_to("bound", value_of(report.bound.pos), 0, 0);
    track_follows_the_curve(0, 50);
}

static void every_easing_becomes_a_track(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(ease_cases); i++)
        for (int displacement = MOTION_FCURVE_IN;
             displacement <= MOTION_FCURVE_IN_OUT; displacement++) {
            if (ease_cases[i].kind == MOTION_FCURVE_CIRC)
                continue;
            begin_ease(&ease_cases[i], displacement);
            if (append(-4, 26, 0.1L) != MOTION_OK)
                fail_msg("kind %d, way %d, key %u", ease_cases[i].kind,
                         displacement, report.failed);
            track_follows_the_curve(-4, 26);
        }
}

/* Its pieces meet at k/11 of the span, which in some falls on a tick and in
 * others between two. */
static void bounces_stay_between_their_keys(void **state)
{
    (void)state;
    for (int tick = 0; tick < 44; tick++)
        for (int displacement = MOTION_FCURVE_IN;
             displacement <= MOTION_FCURVE_IN_OUT; displacement++) {
            struct motion_extreme extreme;

            begin();
            add(0, 1371, MOTION_FCURVE_AUTO, MOTION_FCURVE_BOUNCE)->easing =
                (uint8_t)displacement;
            add(2, 1640, MOTION_FCURVE_AUTO, MOTION_FCURVE_BOUNCE);
            keys[1].at.t_ns_q12 += tick;
            compute_handles();
            if (append(0, 2, 0) != MOTION_OK)
                fail_msg("tick %d, way %d: refused", tick, displacement);
            motion_track_extreme(&track, MOTION_POS, &extreme);
            if (extreme.min < units(1371) - 64 ||
                extreme.max > units(1640) + 64)
                fail_msg("tick %d, way %d: beyond", tick, displacement);
        }
}

static void any_handles_become_a_track(void **state)
{
    (void)state;
    begin();
    add(0, 3, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    add(7, 12, MOTION_FCURVE_CLAMPED, MOTION_FCURVE_BEZIER);
    add(9, -5, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    add(30, 2, MOTION_FCURVE_VECTOR, MOTION_FCURVE_BEZIER);
    add(50, 8, MOTION_FCURVE_AUTO, MOTION_FCURVE_BEZIER);
    compute_handles();
    assert_int_equal(append(0, 50, 0), MOTION_OK);
    track_follows_the_curve(0, 50);
    assert_int_equal(append(3.3L, 41.7L, 0), MOTION_OK);
    track_follows_the_curve(3.3L, 41.7L);
    assert_true(value_of(report.bound.pos) < 0x1p-26L);
}

static void cycles_and_ends_become_a_track(void **state)
{
    (void)state;
    for (int mode = MOTION_FCURVE_REPEAT_OFFSET; mode <= MOTION_FCURVE_MIRROR;
         mode++) {
        begin_line();
        keys[1].interpolation = MOTION_FCURVE_BEZIER;
        curve.extrapolation = MOTION_FCURVE_LINE;
        curve.before.mode = curve.after.mode = (uint8_t)mode;
        curve.before.count = 2;
        curve.after.count = 0;
        if (mode == MOTION_FCURVE_REPEAT_OFFSET)
            assert_int_equal(append(-30, 70, 0), MOTION_OK);
        else
            assert_int_equal(append(-40, 70, 0), MOTION_OK);
        track_follows_the_curve(mode == MOTION_FCURVE_MIRROR ? -40 : -30, 70);
    }
    curve.before.mode = MOTION_FCURVE_ONCE;
    assert_int_equal(append(-40, 70, 0), MOTION_OK);
    track_follows_the_curve(-40, 70);
}

/* What a machine cannot follow, and which key is to blame. */
static void steps_and_infinite_slopes_are_refused(void **state)
{
    static const struct {
        const char *name;
        int kind, displacement;
        uint32_t failed;
        int want;
    } rows[] = {
        { "constant", MOTION_FCURVE_CONSTANT, 0, 1, MOTION_E_DISCONTINUITY },
        { "circ in", MOTION_FCURVE_CIRC, MOTION_FCURVE_IN, 1,
          MOTION_E_SINGULAR },
        { "circ out", MOTION_FCURVE_CIRC, MOTION_FCURVE_OUT, 0,
          MOTION_E_SINGULAR },
        { "circ both", MOTION_FCURVE_CIRC, MOTION_FCURVE_IN_OUT, 1,
          MOTION_E_SINGULAR },
        { "elastic in", MOTION_FCURVE_ELASTIC, MOTION_FCURVE_IN, 0,
          MOTION_E_DISCONTINUITY },
        { "elastic out", MOTION_FCURVE_ELASTIC, MOTION_FCURVE_OUT, 1,
          MOTION_E_DISCONTINUITY },
        { "vertical", MOTION_FCURVE_BEZIER, 0, 0, MOTION_E_SINGULAR },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        int rc;

        begin_line();
        keys[0].interpolation = (uint8_t)rows[i].kind;
        keys[0].easing = (uint8_t)rows[i].displacement;
        keys[0].amplitude_q32 = units(1);
        keys[0].right = point(0, 8);
        rc = append(0, 20, 0);
        if (rc != rows[i].want || report.failed != rows[i].failed)
            fail_msg("%s: %s at key %u", rows[i].name, motion_err_text(rc),
                     report.failed);
        assert_int_equal(track.count, 0);
        assert_int_equal(track.end_ns_q12, 0);
    }
}

static void a_cycle_that_does_not_close_is_refused(void **state)
{
    (void)state;
    begin_line();
    curve.after.mode = MOTION_FCURVE_REPEAT;
    assert_int_equal(append(0, 20, 0), MOTION_OK);
    assert_int_equal(append(0, 21, 0), MOTION_E_DISCONTINUITY);
    assert_int_equal(append(5, 5, 0), MOTION_E_ARG);
}

/* --- elementary functions ------------------------------------------------- */

static struct motion_real real_of(long double a)
{
    int e;
    const long double m = frexpl(a, &e);

    return motion_real_make((int64_t)ldexpl(m, 62), e - 62);
}

static void elementary_functions_match_long_double(void **state)
{
    uint64_t seed = 0xE1E;

    (void)state;
    for (int i = 0; i < 20000; i++) {
        const long double a =
            (double)check_random_in(&seed, -4000000, 4000000) / 1000000;
        struct motion_real s, c;

        near_to("exp2",
                value_of(motion_elementary_exp2(real_of(a))) / powl(2, a), 1,
                0x1p-54L);
        motion_elementary_sincos(real_of(a), &s, &c);
        near_to("sin", value_of(s), sinl(a * pi / 2), 0x1p-58L);
        near_to("cos", value_of(c), cosl(a * pi / 2), 0x1p-58L);
        near_to("asin", value_of(motion_elementary_asin(real_of(a / 4))),
                asinl(a / 4) * 2 / pi, 0x1p-57L);
    }
    near_to("asin 1", value_of(motion_elementary_asin(real_of(1))), 1, 0);
    near_to("asin 2", value_of(motion_elementary_asin(real_of(-2))), -1, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(automatic_handles_have_the_mean_slope),
        cmocka_unit_test(a_span_counts_for_at_most_five_of_its_neighbour),
        cmocka_unit_test(clamped_handles_stay_within_their_neighbours),
        cmocka_unit_test(a_clamped_curve_never_leaves_its_keys),
        cmocka_unit_test(vector_handles_go_a_third_of_the_way),
        cmocka_unit_test(an_aligned_handle_keeps_its_length),
        cmocka_unit_test(an_aligned_handle_beside_a_free_one_stays),
        cmocka_unit_test(handles_do_not_stand_on_the_wrong_side),
        cmocka_unit_test(smooth_handles_join_accelerations),
        cmocka_unit_test(smooth_handles_join_those_that_stay),
        cmocka_unit_test(held_slopes_are_let_go_again),
        cmocka_unit_test(smooth_cycles_join_across_the_seam),
        cmocka_unit_test(thirds_are_a_cubic_of_time),
        cmocka_unit_test(bezier_spans_solve_for_time),
        cmocka_unit_test(long_handles_are_cut_to_the_span),
        cmocka_unit_test(vertical_handles_are_steep_not_wrong),
        cmocka_unit_test(no_handles_are_a_straight_line),
        cmocka_unit_test(easing_follows_its_equation),
        cmocka_unit_test(easing_derivatives_are_those_of_its_value),
        cmocka_unit_test(easing_by_kind_is_out_for_the_lively_ones),
        cmocka_unit_test(sine_easing_matches_hand_values),
        cmocka_unit_test(ends_are_held_or_continued),
        cmocka_unit_test(cycles_repeat_offset_and_mirror),
        cmocka_unit_test(cycles_end_after_their_count),
        cmocka_unit_test(bad_curves_are_refused),
        cmocka_unit_test(polynomial_spans_are_one_segment_each),
        cmocka_unit_test(every_easing_becomes_a_track),
        cmocka_unit_test(bounces_stay_between_their_keys),
        cmocka_unit_test(any_handles_become_a_track),
        cmocka_unit_test(cycles_and_ends_become_a_track),
        cmocka_unit_test(steps_and_infinite_slopes_are_refused),
        cmocka_unit_test(a_cycle_that_does_not_close_is_refused),
        cmocka_unit_test(elementary_functions_match_long_double),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
