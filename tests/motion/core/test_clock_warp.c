/* tests/motion/core/test_clock_warp.c - the clock of a move, judged in long
 * double. */
#include <math.h>
#include <stdlib.h>

#include "motion/core/clock_warp.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "tests/support/check.h"

#define MS     INT64_C(1000000)
#define SECOND INT64_C(1000000000)
#define ONE    MOTION_CLOCK_WARP_ONE_Q30
#define UNIT   MOTION_FIXED_ONE_Q32
#define ACC    MOTION_FIXED_ONE_Q32

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

static struct motion_clock_bound bound_of(int64_t accel_q30, int64_t jerk_q30)
{
    return (struct motion_clock_bound){ accel_q30, jerk_q30 };
}

static struct motion_clock_bound any_bound(uint64_t *seed)
{
    const int64_t accel = check_random_in(seed, ONE / 50, 20 * ONE);
    return bound_of(accel, accel * check_random_in(seed, 1, 50));
}

/* The state just before t, and at t. */
static void both_sides(const struct motion_clock_warp *warp, int64_t t_ns,
                       struct motion_clock_rate *left,
                       struct motion_clock_rate *right)
{
    motion_clock_warp_at(warp, t_ns - 1, left);
    motion_clock_warp_at(warp, t_ns, right);
}

static void check_joined(const struct motion_clock_rate *left,
                         const struct motion_clock_rate *right)
{
    const int64_t ds = right->s_ns_q12 - left->s_ns_q12;
    const int64_t dr = right->rate_q30 - left->rate_q30;
    const int64_t da = right->accel_q30 - left->accel_q30;
    const int64_t slope = llabs(left->accel_q30) / SECOND;
    const int64_t jerk =
        (llabs(left->jerk_q30) + llabs(right->jerk_q30)) / SECOND;
    assert_true(llabs(ds - (right->rate_q30 >> 18)) <= 3 + slope / 1000);
    assert_true(llabs(dr) <= 4 + slope);
    assert_true(llabs(da) <= 8 + jerk);
}

static void ramp_joins_rate_and_slope_everywhere(void **state)
{
    (void)state;
    uint64_t seed = 11;
    for (int n = 0; n < 2000; n++) {
        struct motion_clock_warp warp, first;
        const int64_t r0 = check_random_in(&seed, 0, 2 * ONE);
        const int64_t r1 = check_random_in(&seed, 0, 2 * ONE);
        const struct motion_clock_bound bound = any_bound(&seed);
        motion_clock_warp_init(&first, 0, 0, r0);
        assert_int_equal(
            motion_clock_warp_ramp(&first, MS, r1, &bound, MS, &warp),
            MOTION_OK);
        struct motion_clock_rate a, b;
        motion_clock_warp_at(&first, MS, &a);
        motion_clock_warp_at(&warp, MS, &b);
        assert_int_equal(a.s_ns_q12, b.s_ns_q12);
        assert_int_equal(b.rate_q30, r0);
        assert_int_equal(b.accel_q30, 0);
        int64_t t = MS;
        for (unsigned i = 0; i < warp.count; i++) {
            t += warp.piece[i].dur_ns;
            assert_int_equal(warp.piece[i].dur_ns % MS, 0);
            both_sides(&warp, t, &a, &b);
            check_joined(&a, &b);
        }
        assert_int_equal(t, MS + warp.dur_ns);
        assert_int_equal(b.rate_q30, r1);
        assert_int_equal(b.accel_q30, 0);
        /* from rest to rest it is symmetrical: the mean of the rates */
        const long double want = (long double)warp.dur_ns * 4096.0L *
                                 (long double)(r0 + r1) / 2 / ONE;
        /* the peak is rounded to 2^-57 per tick */
        const long double ticks = (long double)warp.dur_ns / MS;
        const long double rounding = ldexpl(ticks * ticks * MS * 4096, -57);
        assert_true(fabsl((long double)(warp.s1_ns_q12 - warp.s0_ns_q12) -
                          want) <= 4 + rounding);
    }
}

/* Again from anywhere in a ramp: within the bounds, in the least time but for
 * whole ticks, and above where it started by r0'^2 / 2J at most. */
static void ramp_from_a_ramp_rises_by_what_cannot_be_avoided(void **state)
{
    (void)state;
    uint64_t seed = 14;
    int made = 0;
    long double most = 0;
    for (int n = 0; n < 20000; n++) {
        struct motion_clock_warp warp;
        struct motion_clock_rate from, now;
        struct motion_clock_bound bound = any_bound(&seed);
        motion_clock_warp_init(&warp, 0, 0, check_random_in(&seed, 0, 2 * ONE));
        motion_clock_warp_ramp(&warp, 0, check_random_in(&seed, 0, 2 * ONE),
                               &bound, MS, &warp);
        const int64_t t = check_random_in(&seed, 0, warp.dur_ns / MS) * MS;
        const int64_t r1 = check_random_in(&seed, 0, 2 * ONE);
        motion_clock_warp_at(&warp, t, &from);
        bound = any_bound(&seed);
        if (motion_clock_warp_ramp(&warp, t, r1, &bound, MS, &warp) < 0)
            continue;
        made++;
        const long double a0 = (long double)from.accel_q30 / ONE;
        const long double r0 = (long double)from.rate_q30 / ONE;
        const long double jerk = (long double)bound.jerk_q30 / ONE;
        const long double accel = (long double)bound.accel_q30 / ONE;
        /* whole ticks lengthen the first piece: r' stays for one more at
         * most */
        const long double over = a0 * fabsl(a0) / (2 * jerk) + a0 * 1e-3L;
        const long double end = (long double)r1 / ONE;
        const long double high = fmaxl(fmaxl(r0, end), r0 + fmaxl(over, 0));
        const long double low = fminl(fminl(r0, end), r0 + fminl(over, 0));
        for (int64_t dt = 0; dt <= warp.dur_ns; dt += MS) {
            motion_clock_warp_at(&warp, t + dt, &now);
            const long double r = (long double)now.rate_q30 / ONE;
            if (!(r <= high + 1e-8L && r >= low - 1e-8L))
                fail_msg("%d: r %Lf not in %Lf .. %Lf: r0 %Lf a0 %Lf r1 %Lf A "
                         "%Lf J %Lf",
                         n, r, low, high, r0, a0, end, accel, jerk);
            most = fmaxl(most, fabsl((long double)now.jerk_q30 / ONE) / jerk);
            assert_true(now.rate_q30 >= 0 && now.rate_q30 <= 2 * ONE);
            assert_true(fabsl((long double)now.accel_q30 / ONE) <=
                        fmaxl(accel, fabsl(a0)) * 1.001L + 1e-8L);
            assert_true(fabsl((long double)now.jerk_q30 / ONE) <=
                        jerk * 1.001L + 1e-8L);
        }
        assert_int_equal(now.rate_q30, r1);
        assert_int_equal(now.accel_q30, 0);
    }
    print_message("%d ramps from ramps, r'' at most %.6Lf J\n", made, most);
    assert_true(made > 10000);
}

static void derivatives_are_those_of_path_time(void **state)
{
    (void)state;
    uint64_t seed = 12;
    const long double h = 1e-4L;
    for (int n = 0; n < 500; n++) {
        struct motion_clock_warp warp;
        const struct motion_clock_bound bound = bound_of(ONE, 4 * ONE);
        motion_clock_warp_init(&warp, 0, 0, ONE);
        motion_clock_warp_ramp(&warp, 0, check_random_in(&seed, 0, 2 * ONE),
                               &bound, MS, &warp);
        /* from a slope, too */
        motion_clock_warp_ramp(&warp, warp.dur_ns / 3,
                               check_random_in(&seed, ONE / 2, 3 * ONE / 2),
                               &bound, MS, &warp);
        struct motion_clock_rate m, o, p;
        const int64_t t =
            warp.t0_ns + check_random_in(&seed, MS, warp.dur_ns - MS);
        motion_clock_warp_at(&warp, t - 100000, &m);
        motion_clock_warp_at(&warp, t, &o);
        motion_clock_warp_at(&warp, t + 100000, &p);
        if (m.jerk_q30 != p.jerk_q30)
            continue; /* over the border of two pieces */
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
            check_random_in(&seed, -900 * ACC, 900 * ACC),
            check_random_in(&seed, -90000 * ACC, 90000 * ACC)
        };
        struct motion_state p;
        motion_clock_warp_chain(&now, &f, &p);
        const long double r = (long double)now.rate_q30 / ONE;
        const long double r1 = (long double)now.accel_q30 / ONE;
        const long double r2 = (long double)now.jerk_q30 / ONE;
        const long double v = (long double)f.vel_q32 / UNIT;
        const long double a = (long double)f.acc_q32 / 0x1p32;
        const long double j = (long double)f.jerk_q32 / 0x1p32;
        assert_int_equal(p.pos_q32, f.pos_q32);
        assert_true(fabsl((long double)p.vel_q32 / UNIT - v * r) < 1e-6L);
        assert_true(fabsl((long double)p.acc_q32 / 0x1p32 -
                          (a * r * r + v * r1)) < 1e-4L);
        assert_true(fabsl((long double)p.jerk_q32 / 0x1p32 -
                          (j * r * r * r + 3 * a * r * r1 + v * r2)) < 1e-2L);
    }
}

static void samples_are_what_the_chain_rule_says_to_the_bit(void **state)
{
    (void)state;
    uint64_t seed = 77;
    for (int n = 0; n < 20000; n++) {
        const struct motion_clock_rate now = {
            .rate_q30 = check_random_in(&seed, 0, 2 * ONE),
            .accel_q30 = check_random_in(&seed, -400 * ONE, 400 * ONE),
        };
        const int64_t most = INT64_MAX >> check_random_in(&seed, 0, 62);
        const struct motion_state f = {
            check_random_in(&seed, -most, most),
            check_random_in(&seed, -most, most),
            check_random_in(&seed, -most, most),
            0,
        };
        const struct motion_sample track = { f.pos_q32, f.vel_q32, f.acc_q32 };
        struct motion_state p;
        struct motion_sample axis;
        motion_clock_warp_chain(&now, &f, &p);
        motion_clock_warp_sample(&now, motion_clock_warp_square(&now), &track,
                                 &axis);
        assert_int_equal(axis.pos_q32, p.pos_q32);
        assert_int_equal(axis.vel_q32, p.vel_q32);
        assert_int_equal(axis.acc_q32, p.acc_q32);
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
    assert_int_equal(p.acc_q32, INT64_MAX);
    assert_int_equal(p.jerk_q32, INT64_MAX);
}

static void unusable_ramps_are_refused(void **state)
{
    (void)state;
    struct motion_clock_warp warp, out;
    motion_clock_warp_init(&warp, 0, 0, ONE);
    static const struct {
        int64_t rate, accel, jerk, tick;
        int err;
    } rows[] = {
        { -1, ONE, ONE, MS, MOTION_E_ARG },
        { 2 * ONE + 1, ONE, ONE, MS, MOTION_E_ARG },
        { 0, 0, ONE, MS, MOTION_E_ARG },
        { 0, ONE, 0, MS, MOTION_E_ARG },
        { 0, ONE, ONE, MOTION_CLOCK_WARP_TICK_MIN_NS - 1, MOTION_E_ARG },
        { 0, ONE, ONE, MOTION_CLOCK_WARP_TICK_MAX_NS + 1, MOTION_E_ARG },
        { 0, 1, ONE, MS, MOTION_E_RANGE }, /* over an hour */
        { 0, ONE, 1, MS, MOTION_E_RANGE },
    };
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct motion_clock_bound bound =
            bound_of(rows[i].accel, rows[i].jerk);
        assert_int_equal(motion_clock_warp_ramp(&warp, 0, rows[i].rate, &bound,
                                                rows[i].tick, &out),
                         rows[i].err);
    }
    /* braking hard, then asked to ease off: the rate would go below 0 */
    struct motion_clock_bound bound = bound_of(100 * ONE, 10000 * ONE);
    motion_clock_warp_ramp(&warp, 0, 0, &bound, MS, &warp);
    bound = bound_of(ONE, ONE);
    assert_int_equal(
        motion_clock_warp_ramp(&warp, 10 * MS, 0, &bound, MS, &out),
        MOTION_E_RANGE);
    /* speeding up steeply to 200 %: it would go over that */
    bound = bound_of(100 * ONE, 10000 * ONE);
    motion_clock_warp_init(&warp, 0, 0, ONE);
    motion_clock_warp_ramp(&warp, 0, 2 * ONE, &bound, MS, &warp);
    bound = bound_of(ONE, ONE);
    assert_int_equal(
        motion_clock_warp_ramp(&warp, 10 * MS, 0, &bound, MS, &out),
        MOTION_E_RANGE);
}

/* Whatever r'' comes before it, and where r' turns meanwhile. */
static void a_level_never_leaves_the_range_of_rates(void **state)
{
    (void)state;
    uint64_t seed = 11;
    unsigned levels = 0, refused = 0;
    for (unsigned n = 0; n < 20000; n++) {
        const struct motion_clock_bound bound = any_bound(&seed);
        const int64_t jerk =
            check_random_in(&seed, -16, 16) * (bound.jerk_q30 / 16);
        const int64_t wait = check_random_in(&seed, 0, 300);
        const int64_t ticks = check_random_in(&seed, 1, 200);
        struct motion_clock_warp warp;
        struct motion_clock_rate now;
        motion_clock_warp_init(&warp, 0, 0, check_random_in(&seed, 0, 2 * ONE));
        if (motion_clock_warp_ramp(&warp, 0, check_random_in(&seed, 0, 2 * ONE),
                                   &bound, MS, &warp) < 0)
            continue;
        const int64_t t = check_random_in(&seed, 0, warp.dur_ns / MS) * MS;
        if (motion_clock_warp_level(&warp, t, wait, jerk, ticks, MS, &warp) <
            0) {
            refused++;
            continue;
        }
        levels++;
        for (int64_t dt = 0; dt <= warp.dur_ns; dt += MS / 4) {
            motion_clock_warp_at(&warp, t + dt, &now);
            assert_in_range(now.rate_q30 + 1, 0, 2 * ONE + 2);
        }
        assert_int_equal(now.accel_q30, 0);
    }
    assert_true(levels > 1000 && refused > 1000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_level_never_leaves_the_range_of_rates),
        cmocka_unit_test(full_rate_is_the_clock_itself_for_days),
        cmocka_unit_test(ramp_joins_rate_and_slope_everywhere),
        cmocka_unit_test(ramp_from_a_ramp_rises_by_what_cannot_be_avoided),
        cmocka_unit_test(derivatives_are_those_of_path_time),
        cmocka_unit_test(chain_rule_matches_long_double),
        cmocka_unit_test(samples_are_what_the_chain_rule_says_to_the_bit),
        cmocka_unit_test(chain_rule_saturates_and_never_wraps),
        cmocka_unit_test(unusable_ramps_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
