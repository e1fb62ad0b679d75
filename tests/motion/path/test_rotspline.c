/* tests/motion/path/test_rotspline.c - curves through rotations, judged by long
 * double and by what they must be. */
#include "motion/path/rotspline.h"

#include <inttypes.h>
#include <math.h>

#include "motion/core/err.h"
#include "motion/number/trig.h"
#include "tests/motion/path/rotspline_at.h"
#include "tests/support/check.h"
#include "tests/support/quat_real.h"

#define SEED  UINT64_C(20250312)
#define ONE   ((int64_t)1 << 62)
#define S_Q12 (INT64_C(1000000000) << 12)

#define KEYS 9

static void any_keys(uint64_t *seed, struct motion_rotkey *key, uint32_t count)
{
    int64_t t = check_random_in(seed, -S_Q12, S_Q12);

    for (uint32_t i = 0; i < count; i++) {
        key[i] = (struct motion_rotkey){ .t_ns_q12 = t, .q = any(seed) };
        t += check_random_in(seed, S_Q12 / 4, S_Q12 * 2);
    }
}

static long double apart(struct motion_vec a, struct motion_vec b)
{
    return scalar(motion_vec_length(motion_vec_sub(a, b)));
}

static void the_spline_meets_keys_without_steps(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    for (int round = 0; round < 20; round++) {
        struct motion_rotkey key[KEYS];
        struct motion_rotspline spline;

        any_keys(&seed, key, KEYS);
        assert_int_equal(motion_rotspline_plan(&spline, key, KEYS,
                                               MOTION_ROTSPLINE_REST,
                                               MOTION_ROTSPLINE_CHORD, 0),
                         MOTION_OK);
        for (int i = 0; i < KEYS; i++) {
            struct motion_quat at, just;
            struct motion_vec rate[2], acc[2];

            rotspline_at(&spline, key[i].t_ns_q12, &at, &rate[0], &acc[0]);
            assert_true(rotation_between(at, key[i].q) < 0x1p-56L);
            if (i == 0)
                assert_true(scalar(motion_vec_length(rate[0])) < 1e-15L);
            if (i == 0 || i == KEYS - 1)
                continue;
            /* one unit of time before: 2.4e-13 s, another span */
            rotspline_at(&spline, key[i].t_ns_q12 - 1, &just, &rate[1],
                         &acc[1]);
            if (apart(rate[0], rate[1]) > 1e-9L ||
                apart(acc[0], acc[1]) > 1e-8L)
                fail_msg("seed %" PRIu64 " round %d key %d: steps %Lg, %Lg",
                         SEED, round, i, apart(rate[0], rate[1]),
                         apart(acc[0], acc[1]));
        }
    }
}

/* Rate and acceleration against what the rotations do. */
static void the_splines_rates_are_its_derivatives(void **state)
{
    const int64_t h = S_Q12 / 10000;
    uint64_t seed = SEED;
    struct motion_rotkey key[KEYS];
    struct motion_rotspline spline;
    (void)state;
    any_keys(&seed, key, KEYS);
    assert_int_equal(motion_rotspline_plan(&spline, key, KEYS,
                                           MOTION_ROTSPLINE_CHORD,
                                           MOTION_ROTSPLINE_CHORD, 0),
                     MOTION_OK);
    for (int i = 0; i < 300; i++) {
        const int span = i % (KEYS - 1);
        const int64_t t = check_random_in(&seed, key[span].t_ns_q12 + h,
                                          key[span + 1].t_ns_q12 - h);
        struct motion_quat before, at, after;
        struct motion_vec rate, acc, in, out, low, high, unused;

        rotspline_at(&spline, t, &at, &rate, &acc);
        rotspline_at(&spline, t - h, &before, &low, &unused);
        rotspline_at(&spline, t + h, &after, &high, &unused);
        (void)motion_quat_log(motion_quat_mul(motion_quat_inverse(at), after),
                              &out);
        (void)motion_quat_log(motion_quat_mul(motion_quat_inverse(at), before),
                              &in);
        const struct motion_real per = motion_real_int(5000); /* 1 / 2h */
        const long double rate_off =
            apart(motion_vec_scale(motion_vec_sub(out, in), per), rate);
        const long double acc_off =
            apart(motion_vec_scale(motion_vec_sub(high, low), per), acc);
        if (rate_off > 1e-4L || acc_off > 1e-2L)
            fail_msg("seed %" PRIu64 " round %d: %Lg, %Lg", SEED, i, rate_off,
                     acc_off);
    }
}

static void about_one_axis_the_spline_is_the_clamped_cubic(void **state)
{
    /* keys 0, 1, 0 rad at 0, 1, 2 s from rest to rest: 3t^2 - 2t^3 */
    const struct motion_dir axis = { { 0, 0, ONE } };
    const int64_t one_rad = motion_trig_from_rad(motion_real_int(1));
    struct motion_rotkey key[3] = {
        { .t_ns_q12 = 0, .q = MOTION_QUAT_ONE },
        { .t_ns_q12 = S_Q12, .q = motion_quat_about(axis, one_rad) },
        { .t_ns_q12 = 2 * S_Q12, .q = MOTION_QUAT_ONE },
    };
    struct motion_rotspline spline;
    (void)state;
    assert_int_equal(motion_rotspline_plan(&spline, key, 3,
                                           MOTION_ROTSPLINE_REST,
                                           MOTION_ROTSPLINE_REST, 0),
                     MOTION_OK);
    for (int i = 0; i <= 10; i++) {
        const long double t = i / 10.0L;
        struct motion_quat q;
        struct motion_vec rate, acc;
        rotspline_at(&spline, S_Q12 / 10 * i, &q, &rate, &acc);
        assert_true(fabsl(2 * atan2l(real(q).z, real(q).w) -
                          (3 * t * t - 2 * t * t * t)) < 1e-15L);
        assert_true(fabsl(scalar(rate.x[2]) - (6 * t - 6 * t * t)) < 1e-15L);
        assert_true(fabsl(scalar(acc.x[2]) - (6 - 12 * t)) < 1e-14L);
    }
}

static void one_key_stands_and_two_turn_evenly(void **state)
{
    uint64_t seed = SEED;
    struct motion_rotkey key[2];
    struct motion_rotspline spline;
    struct motion_quat q, want;
    struct motion_vec rate, acc;
    (void)state;
    any_keys(&seed, key, 2);
    assert_int_equal(motion_rotspline_plan(&spline, key, 1,
                                           MOTION_ROTSPLINE_CHORD,
                                           MOTION_ROTSPLINE_CHORD, 0),
                     MOTION_OK);
    rotspline_at(&spline, key[0].t_ns_q12 + 5, &q, &rate, &acc);
    assert_true(rotation_between(q, key[0].q) == 0);
    assert_int_equal(motion_rotspline_plan(&spline, key, 2,
                                           MOTION_ROTSPLINE_CHORD,
                                           MOTION_ROTSPLINE_CHORD, 0),
                     MOTION_OK);
    const int64_t half = (key[1].t_ns_q12 - key[0].t_ns_q12) / 2;
    rotspline_at(&spline, key[0].t_ns_q12 + half, &q, &rate, &acc);
    (void)motion_quat_slerp(key[0].q, key[1].q, ONE / 2, &want);
    assert_true(rotation_between(q, want) < 1e-12L);
    assert_true(scalar(motion_vec_length(acc)) < 1e-14L);
    /* after the end: the key, at rest */
    rotspline_at(&spline, key[1].t_ns_q12 + 1, &q, &rate, &acc);
    assert_true(rotation_between(q, key[1].q) == 0);
    assert_true(motion_real_is_zero(motion_vec_length(rate)));
}

static void given_rates_are_met(void **state)
{
    uint64_t seed = SEED;
    struct motion_rotkey key[4];
    struct motion_rotspline spline;
    struct motion_quat q;
    struct motion_vec rate, acc;
    (void)state;
    any_keys(&seed, key, 4);
    const int64_t first[3] = { 1, -2, 3 }, last[3] = { -3, 1, 0 };
    key[0].rate = motion_vec_shift(motion_vec_from_q32(first), 32);
    key[3].rate = motion_vec_shift(motion_vec_from_q32(last), 32);
    assert_int_equal(motion_rotspline_plan(&spline, key, 4,
                                           MOTION_ROTSPLINE_GIVEN,
                                           MOTION_ROTSPLINE_GIVEN, 0),
                     MOTION_OK);
    rotspline_at(&spline, key[0].t_ns_q12, &q, &rate, &acc);
    assert_true(fabsl(scalar(rate.x[1]) + 2) < 1e-15L);
    rotspline_at(&spline, key[3].t_ns_q12, &q, &rate, &acc);
    assert_true(fabsl(scalar(rate.x[0]) + 3) < 1e-12L);
    assert_true(fabsl(scalar(rate.x[2])) < 1e-12L);
}

static void bad_keys_are_refused(void **state)
{
    uint64_t seed = SEED;
    struct motion_rotkey key[3];
    struct motion_rotspline spline;
    (void)state;
    any_keys(&seed, key, 3);
    assert_int_equal(motion_rotspline_plan(&spline, key, 0,
                                           MOTION_ROTSPLINE_REST,
                                           MOTION_ROTSPLINE_REST, 0),
                     MOTION_E_EMPTY);
    assert_int_equal(motion_rotspline_plan(&spline, key, 3,
                                           (enum motion_rotspline_end)3,
                                           MOTION_ROTSPLINE_REST, 0),
                     MOTION_E_ARG);
    key[2].t_ns_q12 = key[1].t_ns_q12;
    assert_int_equal(motion_rotspline_plan(&spline, key, 3,
                                           MOTION_ROTSPLINE_REST,
                                           MOTION_ROTSPLINE_REST, 0),
                     MOTION_E_ORDER);
    key[1].t_ns_q12 = INT64_MIN;
    key[2].t_ns_q12 = INT64_MAX;
    assert_true(motion_rotspline_plan(&spline, key, 3, MOTION_ROTSPLINE_REST,
                                      MOTION_ROTSPLINE_REST, 0) < 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_spline_meets_keys_without_steps),
        cmocka_unit_test(the_splines_rates_are_its_derivatives),
        cmocka_unit_test(about_one_axis_the_spline_is_the_clamped_cubic),
        cmocka_unit_test(one_key_stands_and_two_turn_evenly),
        cmocka_unit_test(given_rates_are_met),
        cmocka_unit_test(bad_keys_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
