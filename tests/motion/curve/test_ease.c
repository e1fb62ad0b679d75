/* tests/motion/curve/test_ease.c - ease laws and the limited ease, judged by
 * long double formulas written down from the definitions. */
#include <inttypes.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/ease.h"
#include "motion/plan/check.h"
#include "tests/support/check.h"

#define ONE MOTION_FIXED_ONE_Q32
#define SEC MOTION_FIXED_S_Q12

static const enum motion_ease_law laws[] = { MOTION_EASE_PARABOLIC,
                                             MOTION_EASE_SINE,
                                             MOTION_EASE_SCURVE };
static const char *const law_name[] = { "parabolic", "sine", "s-curve" };

/* --- random numbers ------------------------------------------------------- */

/* 2^low .. 2^high, evenly in the exponent. */
static long double draw_scale(double low, double high)
{
    return powl(2, low + (high - low) * draw_unit());
}

/* --- the true curves ------------------------------------------------------ */

static const long double pi = 3.14159265358979323846264338327950288L;

struct truth {
    long double pos, vel, acc;
};

/* Ramp from rest of duration T to speed 1, t after its start.  The s-curve's
 * acceleration peaks at `up`, half the duration but for rounding. */
static struct truth true_ramp(enum motion_ease_law law, long double T,
                              long double up, long double t)
{
    const long double x = t / T, r = T - t, down = T - up;

    if (law == MOTION_EASE_PARABOLIC)
        return (struct truth){ t * x / 2, x, 1 / T };
    if (law == MOTION_EASE_SINE)
        return (struct truth){ T * 2 / pi * (1 - cosl(pi / 2 * x)),
                               sinl(pi / 2 * x),
                               cosl(pi / 2 * x) * pi / 2 / T };
    if (t < up)
        return (struct truth){ t * t * t / (3 * T * up), t * t / (T * up),
                               2 * t / (T * up) };
    return (struct truth){ (T + down) / 3 - r + r * r * r / (3 * T * down),
                           1 - r * r / (T * down), 2 * r / (T * down) };
}

static long double ramp_reach(enum motion_ease_law law, long double T,
                              long double up)
{
    if (law == MOTION_EASE_SINE)
        return T * 2 / pi;
    return law == MOTION_EASE_SCURVE ? (2 * T - up) / 3 : T / 2;
}

/* Distance 1 in phases of T1, T2, T3. */
static struct truth true_ease(enum motion_ease_law law, const int64_t T_q12[3],
                              long double t)
{
    const long double T1 = (long double)T_q12[0] / SEC,
                      T2 = (long double)T_q12[1] / SEC,
                      T3 = (long double)T_q12[2] / SEC;
    const int64_t half1 = T_q12[0] / 2, half3 = T_q12[2] / 2;
    const long double up1 = (long double)half1 / SEC,
                      up3 = (long double)half3 / SEC;
    const long double r1 = ramp_reach(law, T1, up1),
                      r3 = ramp_reach(law, T3, up3);
    const long double speed = 1 / (r1 + T2 + r3);
    struct truth p;

    if (t < T1) {
        p = true_ramp(law, T1, up1, t);
    } else if (t < T1 + T2 || T3 == 0) {
        p = (struct truth){ r1 + t - T1, 1, 0 };
    } else {
        p = true_ramp(law, T3, up3, T1 + T2 + T3 - t);
        p.pos = r1 + T2 + r3 - p.pos;
        p.acc = -p.acc;
    }
    p.pos *= speed;
    p.vel *= speed;
    p.acc *= speed;
    return p;
}

/* --- helpers -------------------------------------------------------------- */

static struct motion_segment storage[MOTION_EASE_SEGMENTS + 2];
static struct motion_track track;

static void start_at(int64_t pos_q32)
{
    motion_track_init(&track, storage, ARRAY_LEN(storage), pos_q32);
}

static const struct plan_limit no_limit = { INT64_MIN, INT64_MAX, INT64_MAX,
                                            INT64_MAX, 0,         0 };

/* Steps at borders, by plan_check; only with a jerk limit are steps in
 * acceleration counted. */
static uint32_t steps(int64_t jerk_q32)
{
    struct plan_limit limit = no_limit;
    struct plan_violation found[64];
    uint32_t count, all;

    limit.jerk_q32 = jerk_q32;
    all = plan_check_track(&track, &limit, found, ARRAY_LEN(found));
    assert_in_range(all, 0, ARRAY_LEN(found));
    count = 0;
    for (uint32_t i = 0; i < all; i++)
        count += found[i].kind >= PLAN_VEL_STEP;
    return count;
}

/* --- laws ----------------------------------------------------------------- */

static void the_true_curves_of_this_test_are_continuous(void **state)
{
    const int64_t T[3] = { SEC / 4, SEC / 2, SEC / 4 };
    const long double h = 1e-7L;

    (void)state;
    for (size_t l = 0; l < ARRAY_LEN(laws); l++) {
        for (int i = 1; i < 1000; i++) {
            const long double t = i / 1000.0L;
            struct truth a = true_ease(laws[l], T, t - h);
            struct truth b = true_ease(laws[l], T, t + h);
            struct truth m = true_ease(laws[l], T, t);
            assert_true(fabsl((b.pos - a.pos) / (2 * h) - m.vel) < 1e-5L);
        }
    }
}

static const struct {
    double k1, k2;
} ramps[] = {
    { 0.2, 0.8 },  { 0, 1 },           { 0, 0 },         { 1, 1 },
    { 0.5, 0.5 },  { 0, 0.7 },         { 0.3, 1 },       { 0.3, 0.3 },
    { 0, 0.5 },    { 1e-6, 1 - 1e-6 }, { 0.999, 0.999 }, { 0.1, 0.11 },
    { 1e-9, 0.5 },
};

static const int64_t ends[][2] = {
    { 0, 10 * ONE },      { 5 * ONE, -7 * ONE },
    { 12345, 12346 },     { -ONE, -ONE + 3 },
    { 0, 1000000 * ONE }, { -100000000 * ONE, 100000000 * ONE },
    { 77, 77 },
};

/* Velocity or acceleration may be beyond the formats. */
static bool too_fast(size_t e, int64_t dur, size_t r)
{
    const double s = (double)dur / SEC;
    const double displacement =
        fabs((double)ends[e][1] - (double)ends[e][0]) / ONE;
    const double in = ramps[r].k1, out = 1 - ramps[r].k2;
    double ramp = in > 0 && (out == 0 || in < out) ? in : out;

    if (ramp * s < 1e-6)
        ramp = 1e-13 / s;
    return displacement / s > 1e8 || displacement / s / (ramp * s) > 1e13;
}

static void every_law_ends_on_its_target_to_the_bit(void **state)
{
    static const int64_t durs[] = { SEC,  1,          2,          3,
                                    4097, SEC / 1000, 3600 * SEC, SEC + 1 };

    (void)state;
    for (size_t i = 0; i < 3 * ARRAY_LEN(ramps) * ARRAY_LEN(ends); i++) {
        const size_t l = i % 3, r = i / 3 % ARRAY_LEN(ramps),
                     e = i / 3 / ARRAY_LEN(ramps);
        for (size_t d = 0; d < ARRAY_LEN(durs); d++) {
            int rc;
            start_at(ends[e][0]);
            rc = motion_ease_append(&track, laws[l], ends[e][1], durs[d],
                                    (int64_t)(ramps[r].k1 * ONE),
                                    (int64_t)(ramps[r].k2 * ONE));
            if (rc == MOTION_E_RANGE && too_fast(e, durs[d], r)) {
                assert_int_equal(track.count, 0);
                continue;
            }
            if (rc != MOTION_OK || track.end.pos_q32 != ends[e][1] ||
                track.end_frac != 0 || track.end_ns_q12 != durs[d] ||
                track.count > MOTION_EASE_SEGMENTS)
                fail_msg("%s k %g %g end %zu dur %" PRId64
                         ": rc %d, %u segments, end %" PRId64,
                         law_name[l], ramps[r].k1, ramps[r].k2, e, durs[d], rc,
                         (unsigned)track.count, track.end.pos_q32);
        }
    }
}

static void sine_is_normalised_by_f(void **state)
{
    /* f = 2 * 0.2/pi + 0.6 + 2 * 0.2/pi; the speed in the middle is 1/f and
     * the end 1, not 3.13. */
    const double f = 4 * 0.2 / 3.14159265358979 + 0.6;
    struct motion_state middle;

    (void)state;
    start_at(0);
    assert_int_equal(MOTION_OK,
                     motion_ease_append(&track, MOTION_EASE_SINE, ONE, SEC,
                                        (int64_t)(0.2 * ONE),
                                        (int64_t)(0.8 * ONE)));
    motion_track_state(&track, SEC / 2, &middle);
    assert_true(fabs((double)middle.vel_q32 / ONE - 1 / f) < 1e-9);
    assert_int_equal(middle.pos_q32, ONE / 2);
    assert_int_equal(track.end.pos_q32, ONE);
}

static void missing_ramps_leave_a_straight_line(void **state)
{
    (void)state;
    for (size_t l = 0; l < ARRAY_LEN(laws); l++) {
        struct motion_state s;
        start_at(0);
        assert_int_equal(MOTION_OK, motion_ease_append(&track, laws[l], 4 * ONE,
                                                       2 * SEC, 0, ONE));
        assert_int_equal(track.count, 1);
        motion_track_state(&track, SEC / 2, &s);
        assert_in_range(s.pos_q32, ONE - 1, ONE);
        assert_int_equal(s.vel_q32, 2 * ONE);
        assert_int_equal(s.acc_q32, 0);
    }
}

/* Largest misses of the track from the true curve. */
static struct truth residual_of(enum motion_ease_law law, int64_t from,
                                int64_t to, const int64_t T_q12[3], int samples)
{
    const long double displacement = (long double)to - (long double)from;
    struct truth worst = { 0, 0, 0 };

    for (int i = 0; i < samples; i++) {
        const int64_t t =
            (int64_t)(draw_unit() * (long double)track.end_ns_q12);
        struct truth want = true_ease(law, T_q12, (long double)t / SEC);
        struct motion_state got;
        motion_track_state(&track, t, &got);
        worst.pos = fmaxl(worst.pos, fabsl((long double)got.pos_q32 - from -
                                           want.pos * displacement));
        worst.vel = fmaxl(worst.vel, fabsl((long double)got.vel_q32 -
                                           want.vel * displacement));
        worst.acc = fmaxl(worst.acc, fabsl((long double)got.acc_q32 -
                                           want.acc * displacement));
    }
    return worst;
}

static long double shortest_segment(void)
{
    int64_t dur = track.end_ns_q12;

    for (uint32_t i = 0; i < track.count; i++)
        if (storage[i].dur_ns_q12 < dur)
            dur = storage[i].dur_ns_q12;
    return (long double)dur;
}

static void check_bound(enum motion_ease_law law, int64_t from, int64_t to,
                        int64_t dur, int64_t k1, int64_t k2)
{
    const bool baked = law == MOTION_EASE_SINE;
    const long double displacement = fabsl((long double)to - (long double)from);
    const int64_t T1 = (int64_t)roundl(ldexpl((long double)dur * k1, -32));
    const int64_t T12 = (int64_t)roundl(ldexpl((long double)dur * k2, -32));
    const int64_t T[3] = { T1, T12 - T1, dur - T12 };
    struct motion_extreme vel, acc;
    struct truth residual;

    start_at(from);
    assert_int_equal(MOTION_OK,
                     motion_ease_append(&track, law, to, dur, k1, k2));
    motion_track_extreme(&track, MOTION_VEL, &vel);
    motion_track_extreme(&track, MOTION_ACC, &acc);
    residual = residual_of(law, from, to, T, 40);
    const long double top_vel =
        (long double)(vel.max > -vel.min ? vel.max : -vel.min);
    const long double top_acc =
        fmaxl((long double)acc.max, -(long double)acc.min);
    /* what the integers of the shortest segment can say (plan/check.c), at
     * frac 31 or with 2^58 steps to the way */
    const long double step = fmaxl(ldexpl(1, -31), ldexpl(displacement, -58));
    const long double rate = (long double)SEC / shortest_segment();
    if (residual.pos > (baked ? 3 + 1e-10L * displacement : 2) + 8 * step ||
        residual.vel > (baked ? 1.3e-8L * top_vel : 0) + 2 + 22 * step * rate ||
        (top_acc < 0x1p62L && /* else it saturates */
         residual.acc > (baked ? 5e-7L * top_acc : 0) + 2 +
                            ldexpl(top_acc, -58) + 80 * step * rate * rate))
        fail_msg("%s from %" PRId64 " to %" PRId64 " in %" PRId64 ", k %" PRId64
                 " %" PRId64 ": misses %Lg %Lg %Lg of %Lg %Lg %Lg",
                 law_name[law], from, to, dur, k1, k2, residual.pos,
                 residual.vel, residual.acc, displacement, top_vel, top_acc);
}

static void every_law_stays_within_its_bound_of_the_true_curve(void **state)
{
    (void)state;
    seed_from("bound");
    for (int i = 0; i < 1500; i++) {
        const enum motion_ease_law law = laws[i % 3];
        const int64_t from = (int64_t)((draw_unit() - 0.5L) * 1e6L * ONE);
        const int64_t displacement =
            (int64_t)(draw_scale(0, 58) * (draw() & 1 ? 1 : -1));
        const int64_t dur = (int64_t)draw_scale(22, 56); /* 1 us .. 5 h */
        const uint64_t a = draw() >> 32, b = draw() >> 32;
        const uint64_t sixteenth = draw();
        int64_t k1 = (int64_t)(a < b ? a : b), k2 = (int64_t)(a < b ? b : a);

        if (sixteenth % 16 == 0)
            k1 = 0;
        if (sixteenth % 16 == 1)
            k2 = ONE;
        if (sixteenth % 16 == 2)
            k2 = k1;
        /* keep most accelerations inside their format: 2^31 unit/s2 */
        if (fabs((double)displacement) / ONE / pow((double)dur / SEC, 2) > 1e8)
            continue;
        if ((k1 && k1 < ONE / 1000) || (k2 < ONE && k2 > ONE - ONE / 1000))
            continue;
        check_bound(law, from, from + displacement, dur, k1, k2);
    }
}

static void acceleration_steps_only_where_the_law_says(void **state)
{
    (void)state;
    for (size_t l = 0; l < ARRAY_LEN(laws); l++) {
        const uint32_t want[] = { 4, 2, 0 };
        start_at(0);
        assert_int_equal(MOTION_OK,
                         motion_ease_append(&track, laws[l], 300 * ONE, 3 * SEC,
                                            ONE / 5, ONE / 2));
        assert_int_equal(steps(0), 0); /* velocity */
        assert_int_equal(steps(INT64_MAX), want[l]);
    }
}

static void velocity_steps_where_a_ramp_is_left_out(void **state)
{
    (void)state;
    for (size_t l = 0; l < ARRAY_LEN(laws); l++) {
        start_at(0);
        assert_int_equal(MOTION_OK, motion_ease_append(&track, laws[l], ONE,
                                                       SEC, 0, ONE / 2));
        assert_int_equal(steps(0), 1);
        start_at(0);
        assert_int_equal(MOTION_OK, motion_ease_append(&track, laws[l], ONE,
                                                       SEC, ONE / 2, ONE));
        assert_int_equal(steps(0), 1);
    }
}

static void no_step_is_left_between_the_pieces(void **state)
{
    (void)state;
    seed_from("pieces");
    for (int i = 0; i < 600; i++) {
        const enum motion_ease_law law = laws[i % 3];
        const int64_t displacement = (int64_t)draw_scale(0, 58);
        const int64_t dur = (int64_t)draw_scale(26, 58);
        const int64_t k1 = (int64_t)(ONE / 50 + (int64_t)(draw() % (ONE / 2)));
        const int64_t k2 = k1 + (int64_t)(draw() % (uint64_t)(ONE - k1));

        if ((double)displacement / ONE / pow((double)dur / SEC, 2) > 1e8 ||
            k2 > ONE - ONE / 50)
            continue;
        start_at(-displacement / 3);
        assert_int_equal(
            MOTION_OK,
            motion_ease_append(&track, law, displacement, dur, k1, k2));
        if (steps(0) != 0 || (law == MOTION_EASE_SCURVE && steps(INT64_MAX)))
            fail_msg("%s way %" PRId64 " dur %" PRId64 " k %" PRId64
                     " %" PRId64,
                     law_name[law], displacement, dur, k1, k2);
    }
}

static void backwards_is_forwards_mirrored(void **state)
{
    (void)state;
    for (size_t l = 0; l < ARRAY_LEN(laws); l++) {
        struct motion_segment other_storage[MOTION_EASE_SEGMENTS];
        struct motion_track other;
        motion_track_init(&other, other_storage, ARRAY_LEN(other_storage), 0);
        start_at(0);
        motion_ease_append(&track, laws[l], 100 * ONE, SEC, ONE / 4, ONE / 2);
        motion_ease_append(&other, laws[l], -100 * ONE, SEC, ONE / 4, ONE / 2);
        for (int i = 0; i <= 100; i++) {
            struct motion_state a, b;
            motion_track_state(&track, SEC / 100 * i, &a);
            motion_track_state(&other, SEC / 100 * i, &b);
            /* the track rounds down */
            assert_in_range(a.pos_q32 + b.pos_q32 + 2, 0, 2);
            assert_in_range(a.vel_q32 + b.vel_q32 + 1, 0, 2);
        }
    }
}

static void a_fraction_left_by_another_curve_is_absorbed(void **state)
{
    const int64_t coef[] = { 5 * ONE };

    (void)state;
    for (size_t l = 0; l < ARRAY_LEN(laws); l++) {
        start_at(0);
        assert_int_equal(MOTION_OK,
                         motion_track_append_poly(&track, SEC, 1, coef, 0,
                                                  5 * ONE, (uint64_t)3 << 62));
        assert_int_equal(MOTION_OK, motion_ease_append(&track, laws[l], 5 * ONE,
                                                       SEC, ONE / 4, ONE / 2));
        assert_int_equal(track.end.pos_q32, 5 * ONE);
        assert_true(track.end_frac == 0);
    }
}

static void bad_arguments_change_nothing(void **state)
{
    static const struct {
        const char *name;
        int law;
        int64_t to, dur, k1, k2;
        int want;
    } rows[] = {
        { "k1 > k2", 1, ONE, SEC, ONE / 2, ONE / 4, MOTION_E_ARG },
        { "k1 < 0", 0, ONE, SEC, -1, ONE, MOTION_E_ARG },
        { "k2 > 1", 2, ONE, SEC, 0, ONE + 1, MOTION_E_ARG },
        { "no such law", 3, ONE, SEC, 0, ONE, MOTION_E_ARG },
        { "law below 0", -1, ONE, SEC, 0, ONE, MOTION_E_ARG },
        { "no time", 1, ONE, 0, 0, ONE, MOTION_E_ARG },
        { "time runs back", 1, ONE, -5, 0, ONE, MOTION_E_ARG },
        { "too long", 1, ONE, MOTION_TRACK_SEGMENT_MAX_NS_Q12 + 1, 0, ONE,
          MOTION_E_ARG },
        { "too fast", 1, 1000000 * ONE, 1, ONE / 4, ONE / 2, MOTION_E_RANGE },
        { "too far", 0, INT64_MAX, SEC, ONE, ONE, MOTION_E_RANGE },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        int rc;
        start_at(-7);
        rc =
            motion_ease_append(&track, (enum motion_ease_law)rows[i].law,
                               rows[i].to, rows[i].dur, rows[i].k1, rows[i].k2);
        if (rc != rows[i].want || track.count != 0 || track.end.pos_q32 != -7 ||
            track.end_ns_q12 != 0)
            fail_msg("%s: %d", rows[i].name, rc);
    }
}

static void without_room_nothing_is_half_done(void **state)
{
    (void)state;
    for (uint32_t capacity = 0; capacity < 19; capacity++) {
        motion_track_init(&track, storage, capacity, 9);
        assert_int_equal(MOTION_E_FULL,
                         motion_ease_append(&track, MOTION_EASE_SINE, 5 * ONE,
                                            SEC, ONE / 2, ONE / 2));
        assert_int_equal(track.count, 0);
        assert_int_equal(track.end.pos_q32, 9);
        assert_int_equal(track.end_ns_q12, 0);
    }
}

/* --- the limited ease ----------------------------------------------------- */

/* Shortest duration [s] for length L under v, a, j (0: none). */
static long double shortest(long double L, long double v, long double a,
                            long double j)
{
    long double tj, ramp;

    if (j == 0)
        return L >= v * v / a ? L / v + v / a : 2 * sqrtl(L / a);
    ramp = v * j >= a * a ? v / a + a / j : 2 * sqrtl(v / j);
    if (L >= v * ramp)
        return L / v + ramp;
    tj = a / j;
    if (L >= 2 * a * tj * tj)
        return tj + sqrtl(tj * tj + 4 * L / a);
    return 4 * cbrtl(L / (2 * j));
}

static void check_limited(int64_t from, int64_t to,
                          const struct motion_ease_limit *limit,
                          long double most_s)
{
    const struct plan_limit judge = {
        from < to ? from : to, from < to ? to : from, limit->vel_q32,
        limit->acc_q32,        limit->jerk_q32,       0
    };
    const long double best = shortest(
        fabsl((long double)to - (long double)from) / ONE,
        (long double)limit->vel_q32 / ONE, (long double)limit->acc_q32 / 0x1p32,
        (long double)limit->jerk_q32 / 0x1p32);
    struct plan_violation bad;
    long double took;
    int rc;

    start_at(from);
    rc = motion_ease_append_limited(&track, to, limit);
    if (best > 2e5L && rc == MOTION_E_RANGE)
        return;
    took = (long double)track.end_ns_q12 / SEC;
    if (rc != MOTION_OK || track.end.pos_q32 != to || track.end_frac != 0 ||
        track.count > (limit->jerk_q32 ? 7 : 3))
        fail_msg("rc %d to %" PRId64 " end %" PRId64 " in %u, best %Lg", rc, to,
                 track.end.pos_q32, (unsigned)track.count, best);
    if (plan_check_track(&track, &judge, &bad, 1) != 0)
        fail_msg("from %" PRId64 " to %" PRId64 " v %" PRId64 " a %" PRId64
                 " j %" PRId64 ": kind %d at %" PRId64 ": %" PRId64
                 ", best %Lg",
                 from, to, limit->vel_q32, limit->acc_q32, limit->jerk_q32,
                 (int)bad.kind, bad.t_ns_q12, bad.value, best);
    if (took < best * (1 - 1e-18L) || took > best + most_s)
        fail_msg("from %" PRId64 " to %" PRId64 " v %" PRId64 " a %" PRId64
                 " j %" PRId64 ": took %.15Lg best %.15Lg",
                 from, to, limit->vel_q32, limit->acc_q32, limit->jerk_q32,
                 took, best);
}

static void limited_hand_values(void **state)
{
    /* length, v, a, j: duration by hand */
    static const struct {
        const char *name;
        double length, vel, acc, jerk, want;
        unsigned segments;
    } rows[] = {
        { "all limits", 20, 4, 2, 2, 5 + 2 + 1, 7 },
        { "speed but not acceleration", 10, 2, 10, 2, 5 + 2, 5 },
        { "acceleration but not speed", 12, 100, 2, 2, 6, 6 },
        { "jerk alone", 2, 100, 100, 1, 4, 4 },
        { "speed exactly reached", 12, 4, 2, 2, 6, 6 },
        { "no jerk limit, speed", 10, 2, 4, 0, 5.5, 3 },
        { "no jerk limit, short", 4, 100, 4, 0, 2, 2 },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct motion_ease_limit limit = {
            (int64_t)(rows[i].vel * ONE), (int64_t)(rows[i].acc * ONE),
            (int64_t)(rows[i].jerk * ONE)
        };
        double took;
        start_at(0);
        assert_int_equal(MOTION_OK,
                         motion_ease_append_limited(
                             &track, (int64_t)(rows[i].length * ONE), &limit));
        took = (double)track.end_ns_q12 / (double)SEC;
        if (fabs(took - rows[i].want) > 2e-12 ||
            track.count != rows[i].segments)
            fail_msg("%s: %.15g, %u segments", rows[i].name, took,
                     (unsigned)track.count);
    }
}

static void limited_is_shortest_and_inside_its_limits(void **state)
{
    (void)state;
    seed_from("limited");
    for (int i = 0; i < 6000; i++) {
        const int64_t from = (int64_t)((draw_unit() - 0.5L) * 1e4L * ONE);
        const int64_t displacement = (int64_t)draw_scale(12, 50);
        struct motion_ease_limit limit = { (int64_t)draw_scale(32, 46),
                                           (int64_t)draw_scale(32, 50),
                                           (int64_t)draw_scale(34, 54) };
        if (i % 5 == 0)
            limit.jerk_q32 = 0;
        check_limited(from,
                      draw() & 1 ? from + displacement : from - displacement,
                      &limit, 5e-9L);
    }
}

static void limited_works_for_tiny_and_huge(void **state)
{
    (void)state;
    seed_from("tiny and huge");
    for (int i = 0; i < 3000; i++) {
        const int64_t displacement = (int64_t)draw_scale(0, 59);
        const struct motion_ease_limit limit = { (int64_t)draw_scale(20, 60),
                                                 (int64_t)draw_scale(20, 60),
                                                 (int64_t)draw_scale(20, 60) };
        /* phases of nanoseconds cost some more */
        check_limited(0, displacement, &limit, 5e-6L);
    }
}

static void limited_goes_nowhere_in_no_time(void **state)
{
    const struct motion_ease_limit limit = { ONE, ONE, ONE };

    (void)state;
    start_at(42);
    assert_int_equal(MOTION_OK, motion_ease_append_limited(&track, 42, &limit));
    assert_int_equal(track.count, 0);
}

static void limited_refuses_what_is_no_limit(void **state)
{
    static const struct {
        struct motion_ease_limit limit;
        int want;
    } rows[] = {
        { { 0, 1, 1 }, MOTION_E_ARG },       { { 1, 0, 1 }, MOTION_E_ARG },
        { { 1, 1, -1 }, MOTION_E_ARG },      { { -5, 1, 1 }, MOTION_E_ARG },
        { { 1, ONE, ONE }, MOTION_E_RANGE }, /* 136 years */
        { { ONE, 1, 1 }, MOTION_E_RANGE },   /* 25 hours per ramp */
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        start_at(3);
        if (motion_ease_append_limited(&track, 1000000 * ONE, &rows[i].limit) !=
                rows[i].want ||
            track.count != 0 || track.end.pos_q32 != 3)
            fail_msg("row %zu", i);
    }
}

static void limited_takes_up_to_three_days(void **state)
{
    const struct motion_ease_limit limit = { ONE, ONE, ONE };

    (void)state;
    start_at(0);
    assert_int_equal(MOTION_OK,
                     motion_ease_append_limited(&track, 260000 * ONE, &limit));
    assert_int_equal(MOTION_E_RANGE,
                     motion_ease_append_limited(&track, 900000 * ONE, &limit));
    assert_int_equal(track.end.pos_q32, 260000 * ONE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_true_curves_of_this_test_are_continuous),
        cmocka_unit_test(every_law_ends_on_its_target_to_the_bit),
        cmocka_unit_test(sine_is_normalised_by_f),
        cmocka_unit_test(missing_ramps_leave_a_straight_line),
        cmocka_unit_test(every_law_stays_within_its_bound_of_the_true_curve),
        cmocka_unit_test(acceleration_steps_only_where_the_law_says),
        cmocka_unit_test(velocity_steps_where_a_ramp_is_left_out),
        cmocka_unit_test(no_step_is_left_between_the_pieces),
        cmocka_unit_test(backwards_is_forwards_mirrored),
        cmocka_unit_test(a_fraction_left_by_another_curve_is_absorbed),
        cmocka_unit_test(bad_arguments_change_nothing),
        cmocka_unit_test(without_room_nothing_is_half_done),
        cmocka_unit_test(limited_hand_values),
        cmocka_unit_test(limited_is_shortest_and_inside_its_limits),
        cmocka_unit_test(limited_works_for_tiny_and_huge),
        cmocka_unit_test(limited_goes_nowhere_in_no_time),
        cmocka_unit_test(limited_refuses_what_is_no_limit),
        cmocka_unit_test(limited_takes_up_to_three_days),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
