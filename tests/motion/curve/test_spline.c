/* tests/motion/curve/test_spline.c - tangents and spans, judged by long
 * double. */
#include <inttypes.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/spline.h"
#include "tests/support/check.h"

#define ONE  MOTION_FIXED_ONE_Q32
#define SEC  MOTION_FIXED_S_Q12
#define KEYS 40

/* --- random keys ---------------------------------------------------------- */

static struct motion_key key[KEYS];
static struct motion_segment storage[KEYS];

/* Filled in values in the units of tracks: 2^-32 unit/s, unit/s2. */
static int64_t vel_q32(const struct motion_key *k)
{
    int64_t v = INT64_MIN;
    assert_int_equal(0, motion_real_round(k->vel, 32, &v));
    return v;
}

static int64_t acc_q32(const struct motion_key *k)
{
    int64_t a = INT64_MIN;
    assert_int_equal(0, motion_real_round(k->acc, 32, &a));
    return a;
}

static struct motion_track track;

/* Spans of 1 ms to 100 s beside each other, positions of +-2^`bits` units. */
static uint32_t draw_keys(int bits)
{
    const uint32_t count = 1 + (uint32_t)(draw() % (KEYS - 1));
    int64_t t = (int64_t)(draw() % (uint64_t)(10 * SEC)) - SEC;

    memset(key, 0, sizeof key);
    for (uint32_t i = 0; i < count; i++) {
        key[i].t_ns_q12 = t;
        key[i].pos_q32 =
            (int64_t)(ldexpl(draw_unit() * 2 - 1, bits) * (long double)ONE);
        t += (int64_t)(powl(10, draw_unit() * 5 - 3) * (long double)SEC);
    }
    return count;
}

static void start_track(void)
{
    motion_track_init(&track, storage, ARRAY_LEN(storage), key[0].pos_q32);
}

/* --- oracles -------------------------------------------------------------- */

static long double span(uint32_t i)
{
    return (long double)(key[i + 1].t_ns_q12 - key[i].t_ns_q12) / SEC;
}

/* Units of 2^-32 per second. */
static long double chord(uint32_t i)
{
    return ((long double)key[i + 1].pos_q32 - (long double)key[i].pos_q32) /
           span(i);
}

/* Velocity (2^-32 unit/s) and acceleration (2^-32 unit/s2) of the parabola
 * through keys i, i+1, i+2 at x seconds after key i. */
static long double parabola_vel(uint32_t i, long double x)
{
    const long double a = (chord(i + 1) - chord(i)) / (span(i) + span(i + 1));

    return chord(i) + a * (2 * x - span(i));
}

static long double parabola_acc(uint32_t i)
{
    return 2 * (chord(i + 1) - chord(i)) / (span(i) + span(i + 1));
}

static void assert_near(long double got, long double want, long double units,
                        const char *what)
{
    /* 2^-60: the oracle subtracts chords in 64 bits */
    if (fabsl(got - want) > units + ldexpl(fabsl(want), -60))
        fail_msg("%s: got %.20Lg, want %.20Lg (units %Lg)", what, got, want,
                 units);
}

/* --- tangents ------------------------------------------------------------- */

static void parabola_tangents_are_exact_on_parabolas(void **state)
{
    /* p = 3 + 2 t + t^2 / 2 at uneven times */
    static const double times[] = { 0, 1, 1.5, 4, 4.25, 9 };
    const uint32_t n = ARRAY_LEN(times);

    (void)state;
    memset(key, 0, sizeof key);
    for (uint32_t i = 0; i < n; i++) {
        const double t = times[i];
        key[i].t_ns_q12 = (int64_t)(t * SEC);
        key[i].pos_q32 = (int64_t)((3 + 2 * t + t * t / 2) * ONE);
    }
    assert_int_equal(
        0, motion_spline_tangents_parabola(key, n, MOTION_SPLINE_ONE_SIDED,
                                           MOTION_SPLINE_ONE_SIDED));
    assert_int_equal(0, motion_spline_accelerations(key, n,
                                                    MOTION_SPLINE_ONE_SIDED,
                                                    MOTION_SPLINE_ONE_SIDED));
    for (uint32_t i = 0; i < n; i++) {
        assert_int_equal(vel_q32(&key[i]), (int64_t)((2 + times[i]) * ONE));
        assert_int_equal(acc_q32(&key[i]), MOTION_FIXED_ONE_Q32);
    }
}

static void parabola_tangents_match_long_double(void **state)
{
    (void)state;
    seed_from("parabola");
    for (int round = 0; round < 2000; round++) {
        const uint32_t n = draw_keys(4 + round % 12);
        if (n < 3)
            continue;
        assert_int_equal(
            0, motion_spline_tangents_parabola(key, n, MOTION_SPLINE_ONE_SIDED,
                                               MOTION_SPLINE_ONE_SIDED));
        assert_int_equal(
            0, motion_spline_accelerations(key, n, MOTION_SPLINE_ONE_SIDED,
                                           MOTION_SPLINE_ONE_SIDED));
        for (uint32_t i = 1; i + 1 < n; i++) {
            const long double scale = fabsl(chord(i)) + fabsl(chord(i - 1));
            assert_near((long double)vel_q32(&key[i]),
                        parabola_vel(i - 1, span(i - 1)),
                        0.7L + ldexpl(scale, -60), "inner velocity");
            if (fabsl(parabola_acc(i - 1)) >= 0x1p62L)
                continue; /* beyond the format */
            assert_near((long double)acc_q32(&key[i]), parabola_acc(i - 1),
                        1 + ldexpl(scale / (span(i - 1) + span(i)), -60),
                        "inner acceleration");
        }
        assert_near((long double)vel_q32(&key[0]), parabola_vel(0, 0),
                    0.9L + ldexpl(fabsl(chord(0)) + fabsl(chord(1)), -58),
                    "first velocity");
        assert_near((long double)vel_q32(&key[n - 1]),
                    parabola_vel(n - 3, span(n - 3) + span(n - 2)),
                    0.9L +
                        ldexpl(fabsl(chord(n - 3)) + fabsl(chord(n - 2)), -58),
                    "last velocity");
        if (fabsl(parabola_acc(0)) >= 0x1p62L ||
            fabsl(parabola_acc(n - 3)) >= 0x1p62L)
            continue;
        assert_near((long double)acc_q32(&key[0]), parabola_acc(0),
                    1 + ldexpl(fabsl(chord(0)) / span(0), -54),
                    "first acceleration");
        assert_near((long double)acc_q32(&key[n - 1]), parabola_acc(n - 3),
                    1 + ldexpl(fabsl(chord(n - 3)) / span(n - 3), -54),
                    "last acceleration");
    }
}

static void cardinal_tangents_match_long_double(void **state)
{
    (void)state;
    seed_from("cardinal");
    for (int round = 0; round < 2000; round++) {
        const uint32_t n = draw_keys(4 + round % 12);
        const int64_t mu_q32 =
            round == 0 ? 2 * ONE : (int64_t)(draw() % (2 * (uint64_t)ONE));
        const long double mu = ldexpl((long double)mu_q32, -32);
        if (n < 2)
            continue;
        assert_int_equal(0, motion_spline_tangents_cardinal(
                                key, n, mu_q32, MOTION_SPLINE_ONE_SIDED,
                                MOTION_SPLINE_ONE_SIDED));
        for (uint32_t i = 1; i + 1 < n; i++)
            assert_near(
                (long double)vel_q32(&key[i]),
                mu * (long double)(key[i + 1].pos_q32 - key[i - 1].pos_q32) /
                    (span(i - 1) + span(i)),
                0.6L, "inner");
        assert_near((long double)vel_q32(&key[0]), mu * chord(0), 0.6L,
                    "first");
        assert_near((long double)vel_q32(&key[n - 1]), mu * chord(n - 2), 0.6L,
                    "last");
    }
}

static void cardinal_with_mu_one_is_first_order_on_uneven_keys(void **state)
{
    /* p = t^2 at 0, 1, 3: p'(1) = 2; the cardinal tangent is 9/3 = 3. */
    static const struct motion_key keys[] = {
        { .t_ns_q12 = 0, .pos_q32 = 0 },
        { .t_ns_q12 = SEC, .pos_q32 = ONE },
        { .t_ns_q12 = 3 * SEC, .pos_q32 = 9 * ONE },
    };

    (void)state;
    memcpy(key, keys, sizeof keys);
    assert_int_equal(0, motion_spline_tangents_cardinal(key, 3, ONE,
                                                        MOTION_SPLINE_REST,
                                                        MOTION_SPLINE_REST));
    assert_int_equal(vel_q32(&key[1]), 3 * ONE);
    assert_int_equal(0, motion_spline_tangents_parabola(
                            key, 3, MOTION_SPLINE_REST, MOTION_SPLINE_REST));
    assert_int_equal(vel_q32(&key[1]), 2 * ONE);
    assert_int_equal(vel_q32(&key[0]), 0);
    assert_int_equal(vel_q32(&key[2]), 0);
}

/* mu = 2 tau: the tension convention's tau = 1/2 is mu = 1. */
static void mu_one_on_even_keys_is_catmull_rom(void **state)
{
    static const int64_t pos[] = { 0, 5, -3, 8, 8 };

    (void)state;
    memset(key, 0, sizeof key);
    for (int i = 0; i < 5; i++) {
        key[i].t_ns_q12 = i * SEC / 2;
        key[i].pos_q32 = pos[i] * ONE;
    }
    assert_int_equal(0, motion_spline_tangents_cardinal(key, 5, ONE,
                                                        MOTION_SPLINE_REST,
                                                        MOTION_SPLINE_REST));
    for (int i = 1; i < 4; i++) {
        const int64_t cardinal = vel_q32(&key[i]);
        assert_int_equal(cardinal, (pos[i + 1] - pos[i - 1]) * ONE);
    }
    assert_int_equal(0, motion_spline_tangents_parabola(
                            key, 5, MOTION_SPLINE_REST, MOTION_SPLINE_REST));
    for (int i = 1; i < 4; i++)
        assert_int_equal(vel_q32(&key[i]), (pos[i + 1] - pos[i - 1]) * ONE);
}

static void given_velocities_and_accelerations_are_kept(void **state)
{
    (void)state;
    seed_from("given");
    for (int round = 0; round < 300; round++) {
        const uint32_t n = draw_keys(8);
        for (uint32_t i = 0; i < n; i++) {
            key[i].has_vel = draw() & 1;
            key[i].has_acc = draw() & 1;
            key[i].vel = motion_real_from_q(1000 + (int64_t)i, 32);
            key[i].acc = motion_real_from_q(2000 + (int64_t)i, 32);
        }
        struct motion_key before[KEYS];
        memcpy(before, key, sizeof key);
        assert_int_equal(
            0, motion_spline_tangents_parabola(key, n, MOTION_SPLINE_NATURAL,
                                               MOTION_SPLINE_ONE_SIDED));
        assert_int_equal(
            0, motion_spline_accelerations(key, n, MOTION_SPLINE_NATURAL,
                                           MOTION_SPLINE_ONE_SIDED));
        for (uint32_t i = 0; i < n; i++) {
            if (before[i].has_vel)
                assert_int_equal(vel_q32(&key[i]), 1000 + (int64_t)i);
            if (before[i].has_acc)
                assert_int_equal(acc_q32(&key[i]), 2000 + (int64_t)i);
            assert_true(key[i].has_vel == before[i].has_vel);
            assert_true(key[i].has_acc == before[i].has_acc);
        }
    }
}

/* --- ends ----------------------------------------------------------------- */

static void natural_ends_have_no_acceleration(void **state)
{
    (void)state;
    seed_from("natural");
    for (int round = 0; round < 500; round++) {
        const uint32_t n = draw_keys(8);
        struct motion_state a, b;
        if (n < 2)
            continue;
        const bool cardinal = draw() & 1;
        assert_int_equal(
            0, cardinal
                   ? motion_spline_tangents_cardinal(key, n, ONE / 2,
                                                     MOTION_SPLINE_NATURAL,
                                                     MOTION_SPLINE_NATURAL)
                   : motion_spline_tangents_parabola(
                         key, n, MOTION_SPLINE_NATURAL, MOTION_SPLINE_NATURAL));
        start_track();
        assert_int_equal(0, motion_spline_append_cubic(&track, key, n, NULL));
        motion_segment_state(&storage[0], 0, &a);
        motion_segment_state(&storage[n - 2], storage[n - 2].dur_ns_q12, &b);
        /* the tangent's half unit is 6 / T of acceleration */
        assert_true(fabsl((long double)a.acc_q32) <= 1 + 6 / span(0));
        assert_true(fabsl((long double)b.acc_q32) <= 1 + 6 / span(n - 2));
    }
}

static void two_keys_go_straight_unless_they_rest(void **state)
{
    static const struct {
        enum motion_spline_end first, last;
        int64_t v0, v1; /* of a chord of 4 */
    } rows[] = {
        { MOTION_SPLINE_ONE_SIDED, MOTION_SPLINE_ONE_SIDED, 8, 8 },
        { MOTION_SPLINE_NATURAL, MOTION_SPLINE_NATURAL, 8, 8 },
        { MOTION_SPLINE_ONE_SIDED, MOTION_SPLINE_NATURAL, 8, 8 },
        { MOTION_SPLINE_REST, MOTION_SPLINE_REST, 0, 0 },
        { MOTION_SPLINE_REST, MOTION_SPLINE_NATURAL, 0, 12 },
        { MOTION_SPLINE_NATURAL, MOTION_SPLINE_REST, 12, 0 },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        memset(key, 0, sizeof key);
        key[1].t_ns_q12 = SEC / 2;
        key[1].pos_q32 = 4 * ONE;
        assert_int_equal(0, motion_spline_tangents_parabola(
                                key, 2, rows[i].first, rows[i].last));
        if (vel_q32(&key[0]) != rows[i].v0 * ONE ||
            vel_q32(&key[1]) != rows[i].v1 * ONE)
            fail_msg("row %zu: %" PRId64 " %" PRId64, i, vel_q32(&key[0]),
                     vel_q32(&key[1]));
        assert_int_equal(0, motion_spline_accelerations(key, 2, rows[i].first,
                                                        rows[i].last));
        assert_int_equal(acc_q32(&key[0]), 0);
        assert_int_equal(acc_q32(&key[1]), 0);
    }
}

static void natural_follows_a_velocity_given_at_the_other_end(void **state)
{
    (void)state;
    memset(key, 0, sizeof key);
    key[1].t_ns_q12 = SEC;
    key[1].pos_q32 = 4 * ONE;
    key[0].has_vel = true;
    key[0].vel = motion_real_from_q(2 * ONE, 32);
    assert_int_equal(0, motion_spline_tangents_parabola(key, 2,
                                                        MOTION_SPLINE_NATURAL,
                                                        MOTION_SPLINE_NATURAL));
    assert_int_equal(vel_q32(&key[1]), 5 * ONE);
    key[0].has_vel = false;
    key[1].has_vel = true;
    assert_int_equal(0, motion_spline_tangents_parabola(key, 2,
                                                        MOTION_SPLINE_NATURAL,
                                                        MOTION_SPLINE_NATURAL));
    assert_int_equal(vel_q32(&key[0]), 7 * ONE / 2);
}

static void one_key_rests(void **state)
{
    (void)state;
    for (int end = MOTION_SPLINE_REST; end <= MOTION_SPLINE_NATURAL; end++) {
        const enum motion_spline_end rule = (enum motion_spline_end)end;
        memset(key, 0, sizeof key);
        key[0].vel = motion_real_from_q(77, 32);
        key[0].acc = motion_real_from_q(77, 32);
        assert_int_equal(0,
                         motion_spline_tangents_parabola(key, 1, rule, rule));
        assert_int_equal(0, motion_spline_accelerations(key, 1, rule, rule));
        assert_int_equal(vel_q32(&key[0]), 0);
        assert_int_equal(acc_q32(&key[0]), 0);
        start_track();
        assert_int_equal(0, motion_spline_append_cubic(&track, key, 1, NULL));
        assert_int_equal(track.count, 0);
    }
}

/* --- refusals ------------------------------------------------------------- */

static void what_is_no_list_of_keys_is_refused(void **state)
{
    static const struct {
        const char *name;
        uint32_t count;
        int64_t t1, t2, pos1, mu;
        int first, want;
    } rows[] = {
        { "no keys", 0, SEC, 2 * SEC, 1, ONE, 0, MOTION_E_EMPTY },
        { "equal times", 3, SEC, SEC, 1, ONE, 0, MOTION_E_ORDER },
        { "first two equal", 3, 0, SEC, 1, ONE, 0, MOTION_E_ORDER },
        { "back in time", 3, SEC, SEC - 1, 1, ONE, 0, MOTION_E_ORDER },
        { "span too long", 3, SEC, ((int64_t)1 << 60) + SEC + 1, 1, ONE, 0,
          MOTION_E_RANGE },
        { "times wrap", 3, INT64_MAX, INT64_MIN, 1, ONE, 0, MOTION_E_RANGE },
        { "too steep", 3, 1, SEC, ONE, ONE, 1, MOTION_E_RANGE },
        { "mu below 0", 3, SEC, 2 * SEC, 1, -1, 0, MOTION_E_ARG },
        { "mu above 2", 3, SEC, 2 * SEC, 1, 2 * ONE + 1, 0, MOTION_E_ARG },
        { "no such end", 3, SEC, 2 * SEC, 1, ONE, 3, MOTION_E_ARG },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        memset(key, 0, sizeof key);
        key[1].t_ns_q12 = rows[i].t1;
        key[2].t_ns_q12 = rows[i].t2;
        key[1].pos_q32 = rows[i].pos1;
        int rc = motion_spline_tangents_cardinal(
            key, rows[i].count, rows[i].mu,
            (enum motion_spline_end)rows[i].first, MOTION_SPLINE_REST);
        if (rc != rows[i].want)
            fail_msg("%s: cardinal %d", rows[i].name, rc);
        if (rows[i].mu != ONE)
            continue;
        rc = motion_spline_tangents_parabola(
            key, rows[i].count, (enum motion_spline_end)rows[i].first,
            MOTION_SPLINE_REST);
        if (rc != rows[i].want)
            fail_msg("%s: parabola %d", rows[i].name, rc);
        rc = motion_spline_accelerations(key, rows[i].count,
                                         (enum motion_spline_end)rows[i].first,
                                         MOTION_SPLINE_REST);
        if (rc != rows[i].want && rows[i].want != MOTION_E_RANGE)
            fail_msg("%s: accelerations %d", rows[i].name, rc);
    }
}

static void extreme_positions_are_answered_or_refused(void **state)
{
    static const int64_t pos[] = { INT64_MIN, -ONE, 0, ONE, INT64_MAX };
    static const int64_t dur[] = { 1, SEC / 1000, SEC, 1000 * SEC,
                                   (int64_t)1 << 60 };

    (void)state;
    for (size_t i = 0; i < 5 * 5 * 5 * 5 * 5; i++) {
        memset(key, 0, sizeof key);
        key[0].pos_q32 = pos[i % 5];
        key[1].pos_q32 = pos[i / 5 % 5];
        key[2].pos_q32 = pos[i / 25 % 5];
        key[1].t_ns_q12 = dur[i / 125 % 5];
        key[2].t_ns_q12 = key[1].t_ns_q12 + dur[i / 625];
        if (motion_spline_tangents_parabola(key, 3, MOTION_SPLINE_ONE_SIDED,
                                            MOTION_SPLINE_ONE_SIDED))
            continue;
        const long double scale = fabsl(chord(0)) + fabsl(chord(1));
        assert_near((long double)vel_q32(&key[1]), parabola_vel(0, span(0)),
                    0.7L + ldexpl(scale, -60), "inner");
        assert_near((long double)vel_q32(&key[2]),
                    parabola_vel(0, span(0) + span(1)),
                    0.9L + ldexpl(scale, -58), "last");
    }
}

static void a_span_that_fails_leaves_the_track_as_it_was(void **state)
{
    uint32_t failed = 99;

    (void)state;
    memset(key, 0, sizeof key);
    for (int i = 0; i < 6; i++) {
        key[i].t_ns_q12 = i * SEC;
        key[i].pos_q32 = i * ONE;
    }
    key[4].vel =
        motion_real_from_q(INT64_MAX, 32); /* the curve overshoots the format */
    key[4].t_ns_q12 = 3 * SEC + ((int64_t)1 << 59);
    key[5].t_ns_q12 = key[4].t_ns_q12 + SEC;
    start_track();
    assert_int_equal(MOTION_E_RANGE,
                     motion_spline_append_cubic(&track, key, 6, &failed));
    assert_int_equal(failed, 3);
    assert_int_equal(track.count, 0);
    assert_int_equal(track.end_ns_q12, 0);
    assert_int_equal(track.end.pos_q32, 0);

    track.capacity = 2;
    assert_int_equal(MOTION_E_FULL,
                     motion_spline_append_linear(&track, key, 6, &failed));
    assert_int_equal(failed, 2);
    assert_int_equal(track.count, 0);
}

static void the_track_must_end_at_the_first_key(void **state)
{
    uint32_t failed;

    (void)state;
    draw_keys(4);
    motion_track_init(&track, storage, ARRAY_LEN(storage), key[0].pos_q32 + 1);
    assert_int_equal(MOTION_E_ARG,
                     motion_spline_append_quintic(&track, key, 2, &failed));
    start_track();
    assert_int_equal(MOTION_E_EMPTY,
                     motion_spline_append_quintic(&track, key, 0, &failed));
    key[1].t_ns_q12 = key[0].t_ns_q12;
    assert_int_equal(MOTION_E_ARG,
                     motion_spline_append_quintic(&track, key, 2, &failed));
}

/* --- curves --------------------------------------------------------------- */

/* s = (t - ti)/T needs tangents times T: on p = t through uneven keys the
 * velocity is 1 everywhere, not 2.0 and 0.4. */
static void a_straight_line_through_uneven_keys_stays_straight(void **state)
{
    static const double times[] = { 0, 2, 2.4, 9, 9.001, 10 };

    (void)state;
    memset(key, 0, sizeof key);
    for (uint32_t i = 0; i < ARRAY_LEN(times); i++) {
        key[i].t_ns_q12 = (int64_t)(times[i] * 1e9) * 4096;
        key[i].pos_q32 = (int64_t)roundl((long double)key[i].t_ns_q12 / SEC *
                                         (long double)ONE);
        key[i].vel = motion_real_from_q(ONE, 32);
    }
    start_track();
    assert_int_equal(
        0, motion_spline_append_cubic(&track, key, ARRAY_LEN(times), NULL));
    for (int i = 0; i < 1000; i++) {
        struct motion_state s;
        motion_track_state(&track, SEC / 100 * i, &s);
        assert_near((long double)s.vel_q32, (long double)ONE, 1.5L / 0.001L + 2,
                    "velocity");
        assert_near((long double)s.pos_q32, i / 100.0L * (long double)ONE, 3,
                    "position");
    }
}

/* h01 = -2 s^3 + 3 s^2: half way between resting keys is half the way, and
 * the end is reached. */
static void the_basis_is_hermites(void **state)
{
    struct motion_state s;

    (void)state;
    memset(key, 0, sizeof key);
    key[1].t_ns_q12 = SEC;
    key[1].pos_q32 = 16 * ONE;
    start_track();
    assert_int_equal(0, motion_spline_append_cubic(&track, key, 2, NULL));
    motion_track_state(&track, SEC / 2, &s);
    assert_near((long double)s.pos_q32, 8 * (long double)ONE, 1, "half");
    assert_near((long double)s.vel_q32, 24 * (long double)ONE, 1, "speed");
    motion_track_state(&track, SEC / 4, &s);
    assert_near((long double)s.pos_q32, 2.5L * (long double)ONE, 1, "quarter");
}

/* Two units of a span's rounding: see plan/check.c. */
static long double vel_slack(uint32_t segment)
{
    return 2 + ldexpl(22 / ((long double)storage[segment].dur_ns_q12 / SEC),
                      -storage[segment].frac);
}

static long double acc_slack(uint32_t segment)
{
    const long double T = (long double)storage[segment].dur_ns_q12 / SEC;

    /* and that a curve is worked out in reals of 62 bits: the terms of a
     * quintic's second derivative add up to 180 times the chord */
    return 2 + ldexpl(80 / (T * T), -storage[segment].frac) +
           ldexpl(fabsl(chord(segment)) / T, -54);
}

static void keys_are_hit_to_the_bit_and_joins_are_smooth(void **state)
{
    (void)state;
    seed_from("joins");
    for (int round = 0; round < 600; round++) {
        const uint32_t n = draw_keys(8);
        const bool quintic = round % 2;
        struct motion_cursor cursor = { 0 };

        assert_int_equal(
            0, motion_spline_tangents_parabola(key, n, MOTION_SPLINE_ONE_SIDED,
                                               MOTION_SPLINE_REST));
        assert_int_equal(0, motion_spline_accelerations(key, n,
                                                        MOTION_SPLINE_ONE_SIDED,
                                                        MOTION_SPLINE_REST));
        start_track();
        assert_int_equal(
            0, quintic ? motion_spline_append_quintic(&track, key, n, NULL)
                       : motion_spline_append_cubic(&track, key, n, NULL));
        assert_int_equal(track.count, n - 1);
        for (uint32_t i = 0; i < n; i++) {
            struct motion_sample s;
            motion_track_sample(&track, &cursor,
                                key[i].t_ns_q12 - key[0].t_ns_q12, &s);
            assert_int_equal(s.pos_q32, key[i].pos_q32);
        }
        for (uint32_t i = 0; i + 1 < n; i++) {
            struct motion_state a, b;
            motion_segment_state(&storage[i], 0, &a);
            motion_segment_state(&storage[i], storage[i].dur_ns_q12, &b);
            assert_near((long double)a.vel_q32, (long double)vel_q32(&key[i]),
                        vel_slack(i), "start velocity");
            assert_near((long double)b.vel_q32,
                        (long double)vel_q32(&key[i + 1]), vel_slack(i),
                        "end velocity");
            if (!quintic)
                continue;
            assert_near((long double)a.acc_q32, (long double)acc_q32(&key[i]),
                        acc_slack(i), "start acceleration");
            assert_near((long double)b.acc_q32,
                        (long double)acc_q32(&key[i + 1]), acc_slack(i),
                        "end acceleration");
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(parabola_tangents_are_exact_on_parabolas),
        cmocka_unit_test(parabola_tangents_match_long_double),
        cmocka_unit_test(cardinal_tangents_match_long_double),
        cmocka_unit_test(cardinal_with_mu_one_is_first_order_on_uneven_keys),
        cmocka_unit_test(mu_one_on_even_keys_is_catmull_rom),
        cmocka_unit_test(given_velocities_and_accelerations_are_kept),
        cmocka_unit_test(natural_ends_have_no_acceleration),
        cmocka_unit_test(two_keys_go_straight_unless_they_rest),
        cmocka_unit_test(natural_follows_a_velocity_given_at_the_other_end),
        cmocka_unit_test(one_key_rests),
        cmocka_unit_test(what_is_no_list_of_keys_is_refused),
        cmocka_unit_test(extreme_positions_are_answered_or_refused),
        cmocka_unit_test(a_span_that_fails_leaves_the_track_as_it_was),
        cmocka_unit_test(the_track_must_end_at_the_first_key),
        cmocka_unit_test(a_straight_line_through_uneven_keys_stays_straight),
        cmocka_unit_test(the_basis_is_hermites),
        cmocka_unit_test(keys_are_hit_to_the_bit_and_joins_are_smooth),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
