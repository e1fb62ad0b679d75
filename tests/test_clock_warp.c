/* tests/test_clock_warp.c - the clock of a move, judged in long double. */
#include <math.h>
#include <stdlib.h>

#include "motion/clock_warp.h"
#include "motion/err.h"
#include "motion/fixed.h"
#include "tests/check.h"

#define MS     INT64_C(1000000)
#define SECOND INT64_C(1000000000)
#define ONE    MOTION_CLOCK_WARP_ONE_Q30
#define UNIT   MOTION_FIXED_ONE_Q32
#define ACC    MOTION_FIXED_ONE_Q16

static void full_rate_is_the_clock_itself_for_days(void **state)
{
    (void)state;
    struct motion_clock_warp warp;
    struct motion_clock_rate now;
    motion_clock_warp_init(&warp, 5 * SECOND, 7, ONE);
    for (int64_t t = 0; t < 20 * 86400 * SECOND; t += 86399 * SECOND + 1) {
        motion_clock_warp_at(&warp, 5 * SECOND + t, &now);
        assert_int_equal(now.s_ns_q12, 7 + t * MOTION_FIXED_NS_Q12);
        assert_int_equal(now.rate_q30, ONE);
        assert_int_equal(now.accel_q30, 0);
    }
}

static void ramp_meets_rate_and_slope_at_both_ends(void **state)
{
    (void)state;
    uint64_t seed = 11;
    for (int n = 0; n < 2000; n++) {
        struct motion_clock_warp warp, first;
        const int64_t r0 = check_random_in(&seed, 0, 2 * ONE);
        const int64_t r1 = check_random_in(&seed, 0, 2 * ONE);
        const int64_t dur = check_random_in(&seed, MS, 20 * SECOND);
        motion_clock_warp_init(&first, 0, 0, r0);
        assert_int_equal(motion_clock_warp_ramp(&first, MS, r1, dur, &warp),
                         MOTION_OK);
        struct motion_clock_rate a, b;
        motion_clock_warp_at(&first, MS, &a);
        motion_clock_warp_at(&warp, MS, &b);
        assert_int_equal(a.s_ns_q12, b.s_ns_q12);
        assert_int_equal(b.rate_q30, r0);
        assert_true(llabs(b.accel_q30) <= 1);
        motion_clock_warp_at(&warp, MS + dur - 1, &a);
        motion_clock_warp_at(&warp, MS + dur, &b);
        assert_true(llabs(a.rate_q30 - b.rate_q30) <= 4);
        assert_int_equal(b.rate_q30, r1);
        const int64_t ds = b.s_ns_q12 - a.s_ns_q12;
        assert_true(llabs(ds - (r1 >> 18)) <= 3);
        /* a symmetric cubic covers the mean of its rates */
        const long double want =
            (long double)dur * 4096.0L * (long double)(r0 + r1) / 2 / ONE;
        assert_true(
            fabsl((long double)(warp.s1_ns_q12 - warp.s0_ns_q12) - want) <= 2);
    }
}

static void derivatives_are_those_of_path_time(void **state)
{
    (void)state;
    uint64_t seed = 12;
    const long double h = 1e-4L;
    for (int n = 0; n < 500; n++) {
        struct motion_clock_warp warp;
        const int64_t dur = check_random_in(&seed, SECOND / 2, 4 * SECOND);
        motion_clock_warp_init(&warp, 0, 0, ONE);
        motion_clock_warp_ramp(&warp, 0, check_random_in(&seed, 0, 2 * ONE),
                               dur, &warp);
        /* from a slope, too */
        motion_clock_warp_ramp(&warp, dur / 3,
                               check_random_in(&seed, 0, 2 * ONE), dur, &warp);
        const int64_t t = dur / 3 + check_random_in(&seed, dur / 8, dur / 2);
        struct motion_clock_rate m, o, p;
        motion_clock_warp_at(&warp, t - 100000, &m);
        motion_clock_warp_at(&warp, t, &o);
        motion_clock_warp_at(&warp, t + 100000, &p);
        const long double rate =
            (long double)(p.s_ns_q12 - m.s_ns_q12) / (2 * h * 1e9L * 4096);
        const long double accel =
            (long double)(p.rate_q30 - m.rate_q30) / (2 * h);
        const long double jerk =
            (long double)(p.accel_q30 - m.accel_q30) / (2 * h);
        assert_true(fabsl(rate - (long double)o.rate_q30 / ONE) < 1e-6L);
        assert_true(fabsl(accel - (long double)o.accel_q30) / ONE < 1e-4L);
        assert_true(fabsl(jerk - (long double)o.jerk_q30) / ONE < 1e-3L);
    }
}

static void chain_rule_matches_long_double(void **state)
{
    (void)state;
    uint64_t seed = 13;
    for (int n = 0; n < 2000; n++) {
        const struct motion_clock_rate now = {
            0, check_random_in(&seed, 0, 2 * ONE),
            check_random_in(&seed, -8 * ONE, 8 * ONE),
            check_random_in(&seed, -64 * ONE, 64 * ONE)
        };
        const struct motion_state f = {
            check_random_in(&seed, -UNIT, UNIT),
            check_random_in(&seed, -900 * UNIT, 900 * UNIT),
            check_random_in(&seed, -900 * 65536, 900 * 65536),
            check_random_in(&seed, -90000 * ACC, 90000 * ACC)
        };
        struct motion_state p;
        motion_clock_warp_chain(&now, &f, &p);
        const long double r = (long double)now.rate_q30 / ONE;
        const long double r1 = (long double)now.accel_q30 / ONE;
        const long double r2 = (long double)now.jerk_q30 / ONE;
        const long double v = (long double)f.vel_q32 / UNIT;
        const long double a = (long double)f.acc_q16 / 65536;
        const long double j = (long double)f.jerk_q16 / 65536;
        assert_int_equal(p.pos_q32, f.pos_q32);
        assert_true(fabsl((long double)p.vel_q32 / UNIT - v * r) < 1e-6L);
        assert_true(fabsl((long double)p.acc_q16 / 65536 -
                          (a * r * r + v * r1)) < 1e-4L);
        assert_true(fabsl((long double)p.jerk_q16 / 65536 -
                          (j * r * r * r + 3 * a * r * r1 + v * r2)) < 1e-2L);
    }
}

static void chain_rule_saturates_and_never_wraps(void **state)
{
    (void)state;
    const struct motion_clock_rate now = { 0, 2 * ONE, INT64_MAX, INT64_MAX };
    const struct motion_state f = { 0, INT64_MAX, INT64_MAX, INT64_MAX };
    struct motion_state p;
    motion_clock_warp_chain(&now, &f, &p);
    assert_int_equal(p.vel_q32, INT64_MAX);
    assert_int_equal(p.acc_q16, INT64_MAX);
    assert_int_equal(p.jerk_q16, INT64_MAX);
}

static void unusable_ramps_are_refused(void **state)
{
    (void)state;
    struct motion_clock_warp warp, out;
    motion_clock_warp_init(&warp, 0, 0, ONE);
    static const struct {
        int64_t rate, dur;
    } rows[] = {
        { -1, SECOND },
        { 2 * ONE + 1, SECOND },
        { 0, 0 },
        { 0, MOTION_CLOCK_WARP_RAMP_MIN_NS - 1 },
        { 0, MOTION_CLOCK_WARP_RAMP_MAX_NS + 1 },
    };
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        assert_int_equal(
            motion_clock_warp_ramp(&warp, 0, rows[i].rate, rows[i].dur, &out),
            MOTION_E_ARG);
    /* braking hard, then asked to go on braking for an hour */
    motion_clock_warp_ramp(&warp, 0, 0, 20 * MS, &warp);
    assert_int_equal(motion_clock_warp_ramp(&warp, 10 * MS, 0,
                                            MOTION_CLOCK_WARP_RAMP_MAX_NS,
                                            &out),
                     MOTION_E_RANGE);
}

static void a_ramp_that_breaks_a_limit_does_not_fit(void **state)
{
    (void)state;
    struct motion_segment room[4];
    struct motion_track track;
    motion_track_init(&track, room, ARRAY_LEN(room), 0);
    /* 100 unit/s for ten seconds */
    assert_int_equal(
        motion_track_append_line(&track, 10 * MOTION_FIXED_S_Q12, 1000 * UNIT),
        MOTION_OK);
    /* 1 -> 0 over D: acceleration 150 / D, jerk 600 / D^2 */
    static const struct {
        int64_t dur_ns, acc, jerk, vel;
        bool fits;
    } rows[] = {
        { SECOND, 151, 601, 100, true },    { SECOND, 149, 0, 100, false },
        { SECOND, 151, 599, 100, false },   { SECOND, 151, 0, 100, true },
        { 2 * SECOND, 76, 151, 100, true }, { 2 * SECOND, 74, 151, 100, false },
        { SECOND, 151, 601, 99, false },
    };
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct motion_clock_limit limit = { rows[i].vel * UNIT,
                                                  rows[i].acc * ACC,
                                                  rows[i].jerk * ACC };
        struct motion_clock_warp warp;
        motion_clock_warp_init(&warp, 0, MOTION_FIXED_S_Q12, ONE);
        motion_clock_warp_ramp(&warp, 0, 0, rows[i].dur_ns, &warp);
        if (motion_clock_warp_fits(&warp, &track, &limit, 0, warp.dur_ns, MS) !=
            rows[i].fits)
            fail_msg("row %zu", i);
    }
}

static void a_step_between_two_looks_is_seen(void **state)
{
    (void)state;
    struct motion_segment room[4];
    struct motion_track track;
    motion_track_init(&track, room, ARRAY_LEN(room), 0);
    struct motion_state slow = { 100 * UNIT, 100 * UNIT, 0, 0 };
    /* a blip of 0.2 ms at three times the speed, between two looks 1 ms apart */
    motion_track_append_line(&track, MOTION_FIXED_S_Q12, slow.pos_q32);
    motion_track_append_line(&track, MOTION_FIXED_S_Q12 / 5000,
                             100 * UNIT + UNIT * 6 / 100);
    motion_track_append_line(&track, MOTION_FIXED_S_Q12, 200 * UNIT);
    const struct motion_clock_limit limit = { 150 * UNIT, 100000 * ACC, 0 };
    struct motion_clock_warp warp;
    motion_clock_warp_init(&warp, 0, MOTION_FIXED_S_Q12 / 2, ONE);
    motion_clock_warp_ramp(&warp, 0, ONE / 2, SECOND, &warp);
    assert_false(
        motion_clock_warp_fits(&warp, &track, &limit, 0, warp.dur_ns, MS));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(full_rate_is_the_clock_itself_for_days),
        cmocka_unit_test(ramp_meets_rate_and_slope_at_both_ends),
        cmocka_unit_test(derivatives_are_those_of_path_time),
        cmocka_unit_test(chain_rule_matches_long_double),
        cmocka_unit_test(chain_rule_saturates_and_never_wraps),
        cmocka_unit_test(unusable_ramps_are_refused),
        cmocka_unit_test(a_ramp_that_breaks_a_limit_does_not_fit),
        cmocka_unit_test(a_step_between_two_looks_is_seen),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
