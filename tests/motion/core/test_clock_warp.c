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

static struct motion_clock_unit unit;

/* A ramp from the state of a warp at a tick. */
struct ramp {
    struct motion_clock_begin begin;
    int32_t wait, ticks;
    int64_t peak_q56;
};

static int64_t per_tick_q56(int64_t accel_q30)
{
    return (int64_t)((long double)accel_q30 * 0x1p26L / 1000);
}

static struct ramp any_ramp(const struct motion_clock_warp *warp, int64_t t_ns,
                            uint64_t *seed)
{
    struct motion_clock_rate at;
    motion_clock_warp_at(warp, t_ns, &at);
    return (struct ramp){
        .begin = { t_ns, at.s_ns_q12, at.rate_q30 * ((int64_t)1 << 26),
                   per_tick_q56(at.accel_q30) },
        .wait = (int32_t)check_random_in(seed, 0, 300),
        .ticks = (int32_t)check_random_in(seed, 1, 300),
        .peak_q56 = per_tick_q56(check_random_in(seed, -8 * ONE, 8 * ONE)),
    };
}

static int lay_out(const struct ramp *ramp, struct motion_clock_warp *to)
{
    motion_clock_unit_init(&unit, MS);
    return motion_clock_warp_by(&ramp->begin, &unit, ramp->wait, ramp->peak_q56,
                                ramp->ticks, to);
}

/* One from a constant rate, then another from a tick of it. */
static bool two_ramps(uint64_t *seed, struct ramp *second,
                      struct motion_clock_warp *first,
                      struct motion_clock_warp *warp)
{
    motion_clock_warp_init(first, 0, 0, check_random_in(seed, 0, 2 * ONE));
    const struct ramp ramp = any_ramp(first, MS, seed);
    if (ramp.wait == 0 || lay_out(&ramp, first) < 0)
        return false;
    *second = any_ramp(
        first, MS + check_random_in(seed, 0, first->dur_ns / MS) * MS, seed);
    return lay_out(second, warp) == MOTION_OK;
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

static long double q56(int64_t value)
{
    return (long double)value * 0x1p-56L;
}

/* From where it begins over its peak to r' = 0; the rate changes by r' over whole
 * ticks. */
static void a_ramp_joins_rate_and_slope_everywhere(void **state)
{
    (void)state;
    uint64_t seed = 11;
    int made = 0;
    for (int n = 0; n < 20000; n++) {
        struct motion_clock_warp first, warp;
        struct motion_clock_rate a, b;
        struct ramp ramp;
        if (!two_ramps(&seed, &ramp, &first, &warp))
            continue;
        const int64_t from_ns = ramp.begin.t_ns;
        made++;
        motion_clock_warp_at(&first, from_ns, &a);
        motion_clock_warp_at(&warp, from_ns, &b);
        assert_int_equal(a.s_ns_q12, b.s_ns_q12);
        assert_int_equal(a.rate_q30, b.rate_q30);
        if (ramp.wait > 0)
            assert_true(llabs(a.accel_q30 - b.accel_q30) <= 1000);
        int64_t t = from_ns;
        for (unsigned i = 0; i < warp.count; i++) {
            assert_int_equal(
                warp.piece[i].dur_ns,
                (i == 0 && ramp.wait > 0 ? ramp.wait : ramp.ticks) * MS);
            t += warp.piece[i].dur_ns;
            both_sides(&warp, t, &a, &b);
            check_joined(&a, &b);
        }
        assert_int_equal(t, from_ns + warp.dur_ns);
        assert_int_equal(b.rate_q30, warp.rate1_q30);
        assert_int_equal(b.accel_q30, 0);
        const long double rise =
            q56(ramp.begin.accel_q56 + ramp.peak_q56) * ramp.wait / 2 +
            q56(ramp.peak_q56) * ramp.ticks / 2;
        assert_true(fabsl((long double)warp.rate1_q30 / ONE -
                          q56(ramp.begin.rate_q56) - rise) < 1e-8L);
    }
    print_message("%d ramps from ramps\n", made);
    assert_true(made > 2000);
}

/* r' goes evenly to its peak and back: every tick by hand. */
static void a_ramp_is_what_it_was_laid_out_as(void **state)
{
    (void)state;
    uint64_t seed = 14;
    int made = 0;
    for (int n = 0; n < 4000; n++) {
        struct motion_clock_warp first, warp;
        struct ramp ramp;
        if (!two_ramps(&seed, &ramp, &first, &warp))
            continue;
        made++;
        const long double a0 = q56(ramp.begin.accel_q56),
                          a1 = q56(ramp.peak_q56);
        const long double w = ramp.wait, m = ramp.ticks;
        long double r = q56(ramp.begin.rate_q56);
        for (int k = 0; k <= ramp.wait + ramp.ticks; k++) {
            const bool is_back = k >= ramp.wait;
            const long double at =
                is_back ? a1 * (1 - (k - w) / m) : a0 + (a1 - a0) * k / w;
            const long double slope = is_back ? -a1 / m : (a1 - a0) / w;
            struct motion_clock_rate now;
            motion_clock_warp_at(&warp, ramp.begin.t_ns + k * MS, &now);
            assert_true(fabsl((long double)now.rate_q30 / ONE - r) < 1e-7L);
            assert_true(fabsl((long double)now.accel_q30 / ONE - at * 1000) <
                        1e-5L);
            r += at + slope / 2;
        }
    }
    assert_true(made > 400);
}

static void derivatives_are_those_of_path_time(void **state)
{
    (void)state;
    uint64_t seed = 12;
    const long double h = 1e-4L;
    int judged = 0;
    for (int n = 0; n < 4000; n++) {
        struct motion_clock_warp first, warp;
        struct ramp ramp;
        if (!two_ramps(&seed, &ramp, &first, &warp) || warp.dur_ns < 3 * MS)
            continue;
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
        /* of a cubic the difference of s over 2 h is s' + s''' h^2 / 6 */
        assert_true(fabsl(rate - (long double)o.rate_q30 / ONE -
                          (long double)o.jerk_q30 / ONE * h * h / 6) < 1e-6L);
        assert_true(fabsl(accel - (long double)o.accel_q30) / ONE < 1e-4L);
        assert_true(fabsl(jerk - (long double)o.jerk_q30) / ONE < 1e-3L);
        judged++;
    }
    assert_true(judged > 300);
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
    const int64_t one = (int64_t)1 << 56;
    static const struct {
        int64_t rate_percent, accel_millionths, peak_millionths;
        int32_t wait, ticks;
    } rows[] = {
        { 100, 0, 0, 0, 0 },
        { 100, 0, 0, -1, 1 },
        { 100, 0, 0, 0, (1 << 20) + 1 },
        { 100, 0, 0, (1 << 20) + 1, 1 },
        { 201, 0, 0, 0, 1 },
        { -1, 0, 0, 0, 1 },
        /* to 110 % less 120 % */
        { 110, 0, -12000, 100, 100 },
        { 150, 0, 6000, 100, 100 },
        /* on its way down it turns below 0 */
        { 10, -10000, 10000, 100, 1 },
        /* over 16 */
        { 100, 200000, -200000, 100, 100 },
    };
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct ramp ramp = {
            { 0, 0, one / 100 * rows[i].rate_percent,
              one / 1000000 * rows[i].accel_millionths },
            rows[i].wait,
            rows[i].ticks,
            one / 1000000 * rows[i].peak_millionths,
        };
        struct motion_clock_warp warp, before;
        motion_clock_warp_init(&warp, 7, 8, ONE);
        before = warp;
        if (lay_out(&ramp, &warp) != MOTION_E_RANGE)
            fail_msg("row %zu", i);
        assert_memory_equal(&warp, &before, sizeof warp);
    }
}

/* Wherever r' turns meanwhile. */
static void a_ramp_never_leaves_the_range_of_rates(void **state)
{
    (void)state;
    uint64_t seed = 12;
    unsigned ramps = 0, refused = 0;
    for (unsigned n = 0; n < 20000; n++) {
        struct motion_clock_warp first, warp;
        struct motion_clock_rate now;
        struct ramp ramp;
        if (!two_ramps(&seed, &ramp, &first, &warp)) {
            refused++;
            continue;
        }
        ramps++;
        for (int64_t dt = 0; dt <= warp.dur_ns; dt += MS / 4) {
            motion_clock_warp_at(&warp, ramp.begin.t_ns + dt, &now);
            assert_in_range(now.rate_q30 + 1, 0, 2 * ONE + 2);
        }
        assert_int_equal(now.accel_q30, 0);
    }
    assert_true(ramps > 1000 && refused > 1000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_ramp_never_leaves_the_range_of_rates),
        cmocka_unit_test(full_rate_is_the_clock_itself_for_days),
        cmocka_unit_test(a_ramp_joins_rate_and_slope_everywhere),
        cmocka_unit_test(a_ramp_is_what_it_was_laid_out_as),
        cmocka_unit_test(derivatives_are_those_of_path_time),
        cmocka_unit_test(chain_rule_matches_long_double),
        cmocka_unit_test(samples_are_what_the_chain_rule_says_to_the_bit),
        cmocka_unit_test(chain_rule_saturates_and_never_wraps),
        cmocka_unit_test(unusable_ramps_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
