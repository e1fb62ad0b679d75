/* tests/motion/plan/test_plan_move.c - from keys to tracks, and what is
 * refused. */
#include <inttypes.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/check.h"
#include "motion/plan/move.h"
#include "tests/support/check.h"

#define ONE  MOTION_FIXED_ONE_Q32
#define SEC  MOTION_FIXED_S_Q12
#define ACC  MOTION_FIXED_ONE_Q32
#define KEYS 30

static const enum plan_curve curves[] = {
#define CURVE(name, spelling, text) name,
    PLAN_CURVE_LIST(CURVE)
#undef CURVE
};

static struct plan_key keys[KEYS];
static struct plan_axis axis;
static struct motion_track track;
static struct plan_error error;

/* An axis named pan with keys at the given times and positions. */
static void make_axis(enum plan_curve curve, uint32_t count, const double *t,
                      const double *pos)
{
    memset(keys, 0, sizeof keys);
    axis = (struct plan_axis){ .name = "pan",
                               .curve = curve,
                               .mu_q32 = ONE,
                               .k1_q32 = ONE / 4,
                               .k2_q32 = 3 * ONE / 4,
                               .blend_ns_q12 = SEC / 4,
                               .key = keys,
                               .key_count = count,
                               .place = { 5, 1 } };
    for (uint32_t i = 0; i < count; i++) {
        keys[i].key.t_ns_q12 = (int64_t)(t[i] * SEC);
        keys[i].key.pos_q32 = (int64_t)(pos[i] * ONE);
        keys[i].place = (struct plan_place){ 10 + i, 3 };
        if (curve == PLAN_CURVE_HERMITE) {
            keys[i].key.has_vel = true;
            keys[i].key.vel = motion_real_from_q(((int64_t)i - 2) * ONE, 32);
        }
    }
}

static const double some_times[] = { 0, 1, 2.5, 3, 7 };
static const double some_positions[] = { 1, -2, 4, 4, 0.5 };

static void make_some(enum plan_curve curve)
{
    make_axis(curve, 5, some_times, some_positions);
}

static void plan(void)
{
    memset(&error, 0, sizeof error);
    if (plan_axis_track(&axis, &track, &error) != MOTION_OK)
        fail_msg("refused: %s", error.text);
}

static void expect_refusal(const char *name, int code, uint32_t key,
                           const char *text)
{
    memset(&error, 0, sizeof error);
    const int rc = plan_axis_track(&axis, &track, &error);

    if (rc != code || error.code != code || error.key != key ||
        strcmp(error.text, text) != 0)
        fail_msg("%s: %d, key %u: \"%s\"", name, rc, (unsigned)error.key,
                 error.text);
    assert_null(track.segment);
    assert_int_equal(track.count, 0);
    assert_int_equal(track.capacity, 0);
}

/* --- curves --------------------------------------------------------------- */

static void every_curve_takes_the_segments_it_needs(void **state)
{
    static const uint32_t want[] = {
        [PLAN_CURVE_LINEAR] = 4,
        [PLAN_CURVE_PARABOLIC] = 3 * 3 + 1, /* one span stands still */
        [PLAN_CURVE_SINE] = 0,              /* depends on the bound */
        [PLAN_CURVE_SCURVE] = 3 * 5 + 1,
        [PLAN_CURVE_HERMITE] = 4,
        [PLAN_CURVE_CATMULL_ROM] = 4,
        [PLAN_CURVE_CARDINAL] = 4,
        [PLAN_CURVE_ROUNDED] = 5 + 4,
        [PLAN_CURVE_SMOOTHED] = 5 + 4,
        [PLAN_CURVE_KOCHANEK] = 4,
        [PLAN_CURVE_MONOTONE] = 4,
        [PLAN_CURVE_AKIMA] = 4,
        [PLAN_CURVE_AKIMA_MONOTONE] = 4,
        [PLAN_CURVE_C2] = 4,
        [PLAN_CURVE_QUINTIC] = 4,
        [PLAN_CURVE_C4] = 4,
        [PLAN_CURVE_CONSTRAINTS] = 4,
        [PLAN_CURVE_BSPLINE] = 4,
        [PLAN_CURVE_LAGRANGE] = 4,
        [PLAN_CURVE_BEZIER] = 0, /* by the bound */
    };

    (void)state;
    for (size_t c = 0; c < ARRAY_LEN(curves); c++) {
        make_some(curves[c]);
        plan();
        if (want[c])
            assert_int_equal(track.count, want[c]);
        assert_int_equal(track.capacity, track.count);
        assert_int_equal(track.end_ns_q12, 7 * SEC);
        plan_track_free(&track);
        assert_null(track.segment);
    }
}

static bool passes_by(enum plan_curve curve)
{
    return curve == PLAN_CURVE_ROUNDED || curve == PLAN_CURVE_SMOOTHED ||
           curve == PLAN_CURVE_BSPLINE;
}

/* Any end rule that the curve has. */
static enum motion_spline_end draw_end(enum plan_curve curve)
{
    const unsigned end = (unsigned)(draw() % MOTION_SPLINE_PERIODIC);

    return plan_curve_rules(curve)->ends & 1u << end
               ? (enum motion_spline_end)end
               : MOTION_SPLINE_REST;
}

static void keys_are_hit_to_the_bit_on_every_curve(void **state)
{
    (void)state;
    seed_from("keys");
    for (uint32_t round = 0; round < 400; round++) {
        const enum plan_curve curve = curves[round % ARRAY_LEN(curves)];
        const uint32_t most = curve == PLAN_CURVE_LAGRANGE ? 5 : KEYS;
        /* without a knot, what is uneven swings beyond all formats */
        const double decades = curve == PLAN_CURVE_C4 ? 1 : 3;
        const uint32_t count = 1 + (uint32_t)(draw() % most);
        double t[KEYS], pos[KEYS], at = draw() & 1 ? 0 : 2.5;
        struct motion_cursor cursor = { 0 };

        for (uint32_t i = 0; i < count; i++) {
            t[i] = at;
            pos[i] = (double)(draw_unit() * 2000 - 1000);
            at += pow(10, (double)draw_unit() * decades - 2);
        }
        make_axis(curve, count, t, pos);
        axis.first = axis.last = draw_end(curve);
        plan();
        for (uint32_t i = 0; i < count; i++) {
            struct motion_sample s;
            if (passes_by(curve) && i > 0 && i + 1 < count)
                continue;
            motion_track_sample(&track, &cursor, keys[i].key.t_ns_q12, &s);
            assert_int_equal(s.pos_q32, keys[i].key.pos_q32);
        }
        plan_track_free(&track);
    }
}

/* Which steps plan_check finds at inner keys: C0, C1, C2. */
static void curves_are_as_smooth_as_they_say(void **state)
{
    static const struct {
        enum plan_curve curve;
        bool vel_steps, acc_steps;
    } rows[] = {
        { PLAN_CURVE_LINEAR, true, false },
        { PLAN_CURVE_PARABOLIC, false, true },
        { PLAN_CURVE_SINE, false, true },
        { PLAN_CURVE_SCURVE, false, false },
        { PLAN_CURVE_HERMITE, false, true },
        { PLAN_CURVE_CATMULL_ROM, false, true },
        { PLAN_CURVE_CARDINAL, false, true },
        { PLAN_CURVE_ROUNDED, false, true },
        { PLAN_CURVE_SMOOTHED, false, false },
        { PLAN_CURVE_KOCHANEK, false, true },
        { PLAN_CURVE_MONOTONE, false, true },
        { PLAN_CURVE_AKIMA, false, true },
        { PLAN_CURVE_AKIMA_MONOTONE, false, true },
        { PLAN_CURVE_C2, false, true }, /* from and to rest */
        { PLAN_CURVE_QUINTIC, false, false },
        { PLAN_CURVE_C4, false, false },
        { PLAN_CURVE_CONSTRAINTS, true, false },
        { PLAN_CURVE_BSPLINE, false, true }, /* from and to rest */
    };
    const struct plan_limit limit = { INT64_MIN, INT64_MAX,     INT64_MAX,
                                      INT64_MAX, INT64_MAX - 1, 0 };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct plan_violation found[64];
        bool vel = false, acc = false;
        make_some(rows[i].curve);
        if (rows[i].curve == PLAN_CURVE_HERMITE)
            keys[0].key.vel = keys[4].key.vel = motion_real_zero();
        plan();
        const uint32_t all = plan_check_track(&track, &limit, found, 64);
        for (uint32_t k = 0; k < all; k++) {
            vel |= found[k].kind == PLAN_VEL_STEP;
            acc |= found[k].kind == PLAN_ACC_STEP;
        }
        if (vel != rows[i].vel_steps || acc != rows[i].acc_steps)
            fail_msg("curve %zu: velocity %d acceleration %d", i, vel, acc);
        plan_track_free(&track);
    }
}

static void an_axis_stands_at_its_first_key_until_then(void **state)
{
    static const double t[] = { 2.5, 4 }, pos[] = { 7, 9 };

    (void)state;
    for (size_t c = 0; c < ARRAY_LEN(curves); c++) {
        struct motion_state s;
        make_axis(curves[c], 2, t, pos);
        plan();
        for (int i = 0; i < 25; i++) {
            motion_track_state(&track, SEC / 10 * i, &s);
            assert_int_equal(s.pos_q32, 7 * ONE);
            assert_int_equal(s.vel_q32, 0);
        }
        assert_int_equal(track.end_ns_q12, 4 * SEC);
        assert_int_equal(track.end.pos_q32, 9 * ONE);
        plan_track_free(&track);
    }
}

static void one_key_is_a_place_to_stand(void **state)
{
    static const double t[] = { 0, 3 }, pos[] = { 7, 8 };

    (void)state;
    for (size_t c = 0; c < ARRAY_LEN(curves); c++) {
        make_axis(curves[c], 1, t, pos);
        plan();
        assert_int_equal(track.count, 0);
        assert_int_equal(track.end.pos_q32, 7 * ONE);
        plan_track_free(&track);
        make_axis(curves[c], 1, t + 1, pos + 1);
        plan();
        assert_int_equal(track.count, 1);
        assert_int_equal(track.end_ns_q12, 3 * SEC);
        plan_track_free(&track);
    }
}

static void quintic_keeps_what_is_given_and_fills_the_rest(void **state)
{
    struct motion_state s;

    (void)state;
    make_some(PLAN_CURVE_QUINTIC);
    keys[1].key.has_vel = true;
    keys[1].key.vel = motion_real_from_q(3 * ONE, 32);
    keys[2].key.has_acc = true;
    keys[2].key.acc = motion_real_from_q(-5 * ACC, 32);
    plan();
    motion_track_state(&track, SEC, &s);
    assert_in_range(s.vel_q32, 3 * ONE - 2, 3 * ONE + 2);
    motion_track_state(&track, SEC * 5 / 2, &s);
    assert_in_range(s.acc_q32 + 5 * ACC + 2, 0, 4);
    motion_track_state(&track, 3 * SEC, &s);
    /* parabola through (2.5, 4) (3, 4) (7, 0.5): chords 0 and -0.875 */
    assert_in_range(s.vel_q32 + (int64_t)(0.875 / 9 * ONE) + 2, 0, 4);
    plan_track_free(&track);
}

static void keys_given_in_the_axis_are_not_touched(void **state)
{
    struct plan_key before[KEYS];

    (void)state;
    for (size_t c = 0; c < ARRAY_LEN(curves); c++) {
        make_some(curves[c]);
        memcpy(before, keys, sizeof keys);
        plan();
        assert_memory_equal(before, keys, sizeof keys);
        plan_track_free(&track);
    }
}

/* --- several curves ------------------------------------------------------- */

static bool rests_or_rounds(enum plan_curve curve)
{
    return curve == PLAN_CURVE_PARABOLIC || curve == PLAN_CURVE_SINE ||
           curve == PLAN_CURVE_SCURVE || curve == PLAN_CURVE_ROUNDED ||
           curve == PLAN_CURVE_SMOOTHED;
}

/* Both have a velocity of their own where they meet. */
static bool would_step(enum plan_curve a, enum plan_curve b)
{
    if (a == PLAN_CURVE_LAGRANGE || b == PLAN_CURVE_LAGRANGE)
        return rests_or_rounds(a) || rests_or_rounds(b);
    return a != b && passes_by(a) && passes_by(b) && a != PLAN_CURVE_BSPLINE &&
           b != PLAN_CURVE_BSPLINE;
}

/* Velocities on both sides of a key. */
static double step_at(const struct plan_key *key)
{
    const int64_t t = key->key.t_ns_q12;

    for (uint32_t i = 1; i < track.count; i++) {
        struct motion_state before, after;

        if (track.segment[i].start_ns_q12 != t)
            continue;
        motion_segment_state(&track.segment[i - 1],
                             track.segment[i - 1].dur_ns_q12, &before);
        motion_segment_state(&track.segment[i], 0, &after);
        return fabs((double)(after.vel_q32 - before.vel_q32)) / ONE;
    }
    return NAN;
}

/* Every pair of curves, one after the other. */
static void spans_of_different_curves_join_at_their_keys(void **state)
{
    (void)state;
    for (size_t a = 0; a < ARRAY_LEN(curves); a++)
        for (size_t b = 0; b < ARRAY_LEN(curves); b++) {
            struct motion_cursor cursor = { 0 };
            make_some(curves[a]);
            for (int i = 0; i < 5; i++) {
                const bool hermite =
                    curves[i < 2 ? a : b] == PLAN_CURVE_HERMITE;
                keys[i].has_curve = i >= 2;
                keys[i].curve = curves[b];
                keys[i].key.has_vel =
                    hermite || (i == 2 && (curves[a] == PLAN_CURVE_HERMITE));
                keys[i].key.vel = motion_real_zero();
            }
            if (a != b && (plan_curve_rules(curves[a])->own ||
                           plan_curve_rules(curves[b])->own))
                keys[2].key.has_vel = false;
            if (would_step(curves[a], curves[b])) {
                assert_int_equal(plan_axis_track(&axis, &track, &error),
                                 MOTION_E_ARG);
                assert_non_null(strstr(error.text, "speed would step"));
                continue;
            }
            plan();
            if (a != b && curves[a] != PLAN_CURVE_LINEAR &&
                curves[b] != PLAN_CURVE_LINEAR && !(step_at(&keys[2]) < 1e-7))
                fail_msg("%s to %s: speed steps by %g",
                         plan_curve_rules(curves[a])->name,
                         plan_curve_rules(curves[b])->name, step_at(&keys[2]));
            for (int i = 0; i < 5; i += 2) {
                struct motion_sample s;
                if (i == 2 && a == b && passes_by(curves[a]))
                    continue;
                motion_track_sample(&track, &cursor, keys[i].key.t_ns_q12, &s);
                assert_int_equal(s.pos_q32, keys[i].key.pos_q32);
            }
            plan_track_free(&track);
        }
}

static void a_given_velocity_that_would_step_is_refused(void **state)
{
    (void)state;
    make_some(PLAN_CURVE_QUINTIC);
    keys[1].has_curve = true;
    keys[1].curve = PLAN_CURVE_ROUNDED;
    keys[1].key.has_vel = true;
    keys[1].key.vel = motion_real_from_q(3 * ONE, 32);
    expect_refusal("rounded", MOTION_E_ARG, 1,
                   "key 2 of axis pan: speed would step: rounded has 4 there "
                   "and the key 3");
    keys[1].key.vel = motion_real_from_q(4 * ONE, 32);
    plan();
    assert_true(step_at(&keys[1]) < 1e-7);
    plan_track_free(&track);
    keys[1].curve = PLAN_CURVE_HERMITE;
    keys[2].key.has_vel = true;
    keys[0].has_curve = true;
    keys[0].curve = PLAN_CURVE_SINE;
    expect_refusal("sine", MOTION_E_ARG, 1,
                   "key 2 of axis pan: speed would step: sine has 0 there and "
                   "the key 4");
}

/* An ease of its own on the second span; a tension on the third. */
static void spans_may_have_parameters_of_their_own(void **state)
{
    struct motion_state mid;

    (void)state;
    make_some(PLAN_CURVE_PARABOLIC);
    keys[1].has_shape = true;
    keys[1].shape.ease.k1_q32 = keys[1].shape.ease.k2_q32 = ONE / 2;
    plan();
    /* 6 in 1.5 s without a stretch of constant speed: 8/s in the middle */
    motion_track_state(&track, keys[1].key.t_ns_q12 + 3 * SEC / 4, &mid);
    assert_in_range(mid.vel_q32, 8 * ONE - 4, 8 * ONE + 4);
    motion_track_state(&track, SEC / 2, &mid);
    assert_in_range(-mid.vel_q32, 4 * ONE - 4, 4 * ONE + 4);
    plan_track_free(&track);
    make_some(PLAN_CURVE_CARDINAL);
    keys[2].has_shape = true;
    keys[2].shape.mu_q32 = 0;
    plan();
    assert_true(step_at(&keys[2]) < 1e-7);
    assert_true(step_at(&keys[3]) < 1e-7);
    plan_track_free(&track);
    keys[2].shape.mu_q32 = 3 * ONE;
    expect_refusal("mu", MOTION_E_ARG, 2,
                   "key 3 of axis pan: mu is not 0 to 2");
    axis.curve = PLAN_CURVE_C2;
    expect_refusal("c2", MOTION_E_ARG, 2,
                   "key 3 of axis pan: its curve has no parameters");
}

static void a_line_hands_its_speed_to_a_smooth_neighbour(void **state)
{
    static const double t[] = { 0, 1, 2, 3 }, pos[] = { 0, 4, 3, 9 };
    struct motion_continuity step;

    (void)state;
    make_axis(PLAN_CURVE_QUINTIC, 4, t, pos);
    keys[0].has_curve = true;
    keys[0].curve = PLAN_CURVE_LINEAR;
    plan();
    struct motion_state s;
    motion_segment_state(&track.segment[1], 0, &s);
    assert_in_range(s.vel_q32, 4 * ONE - 2, 4 * ONE + 2);
    assert_in_range(s.acc_q32 + 2, 0, 4);
    motion_track_continuity(&track, &step);
    assert_int_equal(step.vel_step_ns_q12, 0); /* only where it starts */
    plan_track_free(&track);
}

static void lagrange_that_swings_is_remarked_upon(void **state)
{
    double t[11], pos[11];
    char text[160];

    (void)state;
    for (int i = 0; i < 11; i++) {
        t[i] = i;
        pos[i] = 1 / (1 + 25 * pow(i / 5.0 - 1, 2)); /* Runge */
    }
    make_axis(PLAN_CURVE_LAGRANGE, 11, t, pos);
    plan();
    assert_true(plan_axis_remark(&axis, &track, text));
    assert_non_null(strstr(text, "axis pan: lagrange goes "));
    plan_track_free(&track);
    axis.curve = PLAN_CURVE_MONOTONE;
    plan();
    assert_false(plan_axis_remark(&axis, &track, text));
    plan_track_free(&track);
}

/* --- refusals ------------------------------------------------------------- */

static void a_wrong_axis_is_refused_in_a_sentence(void **state)
{
    (void)state;
    make_axis(PLAN_CURVE_LINEAR, 0, NULL, NULL);
    expect_refusal("no keys", MOTION_E_EMPTY, 0, "axis pan: there are no keys");
    assert_int_equal(error.place.line, 5);

    make_some(PLAN_CURVE_LINEAR);
    axis.key_count = PLAN_KEYS_MAX + 1;
    expect_refusal("too many", MOTION_E_FULL, 0,
                   "axis pan: 1000001 keys are more than the 1000000 allowed");

    make_some((enum plan_curve)99);
    expect_refusal("curve", MOTION_E_ARG, 0,
                   "axis pan: there is no curve with number 99");

    make_some(PLAN_CURVE_CARDINAL);
    axis.mu_q32 = 5 * ONE / 2;
    expect_refusal("mu", MOTION_E_ARG, 0, "axis pan: mu is 2.5, not 0 to 2");

    make_some(PLAN_CURVE_SINE);
    axis.k1_q32 = ONE * 3 / 4;
    axis.k2_q32 = ONE / 4;
    expect_refusal("k", MOTION_E_ARG, 0,
                   "axis pan: k1 is 0.75 and k2 is 0.25, expected 0 <= k1 <= "
                   "k2 <= 1");

    make_some(PLAN_CURVE_QUINTIC);
    axis.last = (enum motion_spline_end)7;
    expect_refusal("end rule", MOTION_E_ARG, 0,
                   "axis pan: there is no end rule with number 7");

    make_some(PLAN_CURVE_AKIMA);
    axis.first = MOTION_SPLINE_NATURAL;
    expect_refusal("end", MOTION_E_ARG, 0,
                   "axis pan: curve akima has no end natural");

    make_some(PLAN_CURVE_C2);
    axis.first = MOTION_SPLINE_PERIODIC;
    expect_refusal("half a ring", MOTION_E_ARG, 0,
                   "axis pan: periodic needs both ends and one curve");
    axis.last = MOTION_SPLINE_PERIODIC;
    expect_refusal("open ring", MOTION_E_ARG, 4,
                   "key 5 of axis pan: a periodic axis must end where it "
                   "starts");

    make_some(PLAN_CURVE_KOCHANEK);
    axis.shape.bias_q32 = 2 * ONE;
    expect_refusal("shape", MOTION_E_ARG, 0,
                   "axis pan: tension, continuity and bias are 0, 0, 2, not "
                   "-1 to 1");

    make_some(PLAN_CURVE_ROUNDED);
    axis.blend_ns_q12 = -SEC;
    expect_refusal("blend", MOTION_E_ARG, 0, "axis pan: blend is -1 s");

    make_some(PLAN_CURVE_C4);
    axis.key_count = 3;
    axis.last = MOTION_SPLINE_NOT_A_KNOT;
    expect_refusal("few", MOTION_E_ARG, 0,
                   "key 1 of axis pan: too few keys follow for curve c4 and "
                   "its ends");
}

static void a_wrong_time_is_refused_at_its_key(void **state)
{
    (void)state;
    make_some(PLAN_CURVE_LINEAR);
    keys[2].key.t_ns_q12 = 5 * SEC / 2;
    keys[1].key.t_ns_q12 = 3 * SEC;
    expect_refusal("order", MOTION_E_ORDER, 2,
                   "key 3 of axis pan: time 2.5 s is not after the key before "
                   "it (3 s)");
    assert_int_equal(error.place.line, 12);
    assert_int_equal(error.place.column, 3);

    make_some(PLAN_CURVE_SCURVE);
    keys[3].key.t_ns_q12 = keys[2].key.t_ns_q12;
    expect_refusal("equal", MOTION_E_ORDER, 3,
                   "key 4 of axis pan: time 2.5 s is not after the key before "
                   "it (2.5 s)");

    make_some(PLAN_CURVE_LINEAR);
    keys[0].key.t_ns_q12 = -SEC;
    expect_refusal("negative", MOTION_E_ORDER, 0,
                   "key 1 of axis pan: time -1 s is before the start of the "
                   "move");

    make_some(PLAN_CURVE_LINEAR);
    keys[4].key.t_ns_q12 = 300000 * SEC;
    expect_refusal("late", MOTION_E_RANGE, 4,
                   "key 5 of axis pan: time 300000 s is too late: at most "
                   "281474.977 s after the key before it and 1688849.86 s in "
                   "all");
}

static void what_a_curve_cannot_keep_is_refused_at_its_key(void **state)
{
    static const struct {
        enum plan_curve curve;
        bool has_vel, has_acc;
        int64_t vel, acc;
        const char *want; /* NULL: planned */
    } rows[] = {
        { PLAN_CURVE_LINEAR, true, false, 0, 0,
          "key 3 of axis pan: velocity is given, but linear cannot keep it" },
        { PLAN_CURVE_LINEAR, false, true, 0, 0,
          "key 3 of axis pan: acceleration is given, but linear cannot keep "
          "it" },
        { PLAN_CURVE_PARABOLIC, true, false, 0, 0, NULL },
        { PLAN_CURVE_PARABOLIC, true, false, 1, 0,
          "key 3 of axis pan: velocity is not zero, but parabolic rests at "
          "every key" },
        { PLAN_CURVE_SINE, true, false, -1, 0,
          "key 3 of axis pan: velocity is not zero, but sine rests at every "
          "key" },
        { PLAN_CURVE_SINE, false, true, 0, 0,
          "key 3 of axis pan: acceleration is given, but sine cannot keep "
          "it" },
        { PLAN_CURVE_SCURVE, true, true, 0, 0, NULL },
        { PLAN_CURVE_SCURVE, true, true, 0, 1,
          "key 3 of axis pan: acceleration is not zero, but s-curve rests at "
          "every key" },
        { PLAN_CURVE_HERMITE, false, false, 0, 0,
          "key 3 of axis pan: no velocity, which hermite needs at every key" },
        { PLAN_CURVE_CATMULL_ROM, true, false, 1, 0, NULL },
        { PLAN_CURVE_CATMULL_ROM, true, true, 1, 0,
          "key 3 of axis pan: acceleration is given, but catmull-rom cannot "
          "keep it" },
        { PLAN_CURVE_CARDINAL, true, false, 1, 0, NULL },
        { PLAN_CURVE_QUINTIC, true, true, 1, 1, NULL },
        { PLAN_CURVE_C4, true, true, 1, 1, NULL },
        { PLAN_CURVE_CONSTRAINTS, true, true, 1, 1, NULL },
        { PLAN_CURVE_CONSTRAINTS, false, true, 1, 1, NULL },
        { PLAN_CURVE_C2, true, false, 1, 0, NULL },
        { PLAN_CURVE_C2, false, true, 0, 1,
          "key 3 of axis pan: acceleration is given, but c2 keeps one only at "
          "its ends, instead of a velocity" },
        { PLAN_CURVE_AKIMA, true, false, 1, 0, NULL },
        { PLAN_CURVE_BSPLINE, true, false, 0, 0,
          "key 3 of axis pan: velocity is given, but b-spline cannot keep "
          "it" },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        make_some(rows[i].curve);
        keys[2].key.has_vel = rows[i].has_vel;
        keys[2].key.has_acc = rows[i].has_acc;
        keys[2].key.vel = motion_real_from_q(rows[i].vel, 32);
        keys[2].key.acc = motion_real_from_q(rows[i].acc, 32);
        if (rows[i].want) {
            expect_refusal(rows[i].want, MOTION_E_ARG, 2, rows[i].want);
            continue;
        }
        plan();
        plan_track_free(&track);
    }
}

static void a_way_beyond_the_formats_is_refused_at_its_key(void **state)
{
    static const enum plan_curve some[] = { PLAN_CURVE_LINEAR, PLAN_CURVE_SINE,
                                            PLAN_CURVE_CATMULL_ROM };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(some); i++) {
        make_some(some[i]);
        keys[3].key.t_ns_q12 = keys[2].key.t_ns_q12 + 1;
        keys[3].key.pos_q32 = 1000000 * ONE;
        memset(&error, 0, sizeof error);
        assert_int_equal(plan_axis_track(&axis, &track, &error),
                         MOTION_E_RANGE);
        assert_null(track.segment);
        if (some[i] == PLAN_CURVE_CATMULL_ROM)
            assert_string_equal(error.text,
                                "axis pan: a velocity or acceleration between "
                                "the keys is beyond its format");
        else
            assert_string_equal(
                error.text,
                "key 4 of axis pan: the displacement from key 3 at 2.5 "
                "s is beyond the range of position, velocity "
                "or acceleration");
    }
}

static void a_long_name_leaves_a_whole_sentence(void **state)
{
    (void)state;
    make_some(PLAN_CURVE_LINEAR);
    memset(axis.name, 'x', sizeof axis.name); /* not even terminated */
    keys[4].key.t_ns_q12 = INT64_MAX;
    assert_int_equal(plan_axis_track(&axis, &track, &error), MOTION_E_RANGE);
    assert_string_equal(error.text + strlen(error.text) - 9, " s in all");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_curve_takes_the_segments_it_needs),
        cmocka_unit_test(keys_are_hit_to_the_bit_on_every_curve),
        cmocka_unit_test(curves_are_as_smooth_as_they_say),
        cmocka_unit_test(an_axis_stands_at_its_first_key_until_then),
        cmocka_unit_test(one_key_is_a_place_to_stand),
        cmocka_unit_test(quintic_keeps_what_is_given_and_fills_the_rest),
        cmocka_unit_test(keys_given_in_the_axis_are_not_touched),
        cmocka_unit_test(spans_of_different_curves_join_at_their_keys),
        cmocka_unit_test(a_given_velocity_that_would_step_is_refused),
        cmocka_unit_test(spans_may_have_parameters_of_their_own),
        cmocka_unit_test(a_line_hands_its_speed_to_a_smooth_neighbour),
        cmocka_unit_test(lagrange_that_swings_is_remarked_upon),
        cmocka_unit_test(a_wrong_axis_is_refused_in_a_sentence),
        cmocka_unit_test(a_wrong_time_is_refused_at_its_key),
        cmocka_unit_test(what_a_curve_cannot_keep_is_refused_at_its_key),
        cmocka_unit_test(a_way_beyond_the_formats_is_refused_at_its_key),
        cmocka_unit_test(a_long_name_leaves_a_whole_sentence),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
