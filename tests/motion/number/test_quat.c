/* tests/motion/number/test_quat.c - rotations and the curves between them,
 * judged by long double and by what they must be. */
#include <inttypes.h>
#include <math.h>

#include "motion/core/err.h"
#include "motion/number/quat.h"
#include "motion/number/trig.h"
#include "motion/path/rotspline.h"
#include "tests/support/check.h"

#define SEED   UINT64_C(20250312)
#define ROUNDS 2000
#define ONE    ((int64_t)1 << 62)
#define S_Q12  (INT64_C(1000000000) << 12)

struct quat {
    long double w, x, y, z;
};

static struct quat real(struct motion_quat q)
{
    return (struct quat){ ldexpl((long double)q.w, -62),
                          ldexpl((long double)q.x, -62),
                          ldexpl((long double)q.y, -62),
                          ldexpl((long double)q.z, -62) };
}

static long double scalar(struct motion_real a)
{
    return ldexpl((long double)a.m, a.e);
}

static long double difference(struct quat a, struct quat b)
{
    return fmaxl(fmaxl(fabsl(a.w - b.w), fabsl(a.x - b.x)),
                 fmaxl(fabsl(a.y - b.y), fabsl(a.z - b.z)));
}

static long double rotation_between(struct motion_quat a, struct motion_quat b)
{
    const struct quat p = real(a), q = real(b);
    const struct quat n = { -q.w, -q.x, -q.y, -q.z };
    return fminl(difference(p, q), difference(p, n));
}

static struct motion_quat any(uint64_t *seed)
{
    int64_t part[4];
    struct motion_quat q = MOTION_QUAT_ONE;

    for (int i = 0; i < 4; i++)
        part[i] = check_random_in(seed, -1000000000, 1000000000);
    assert_int_equal(motion_quat_unit(part, &q), MOTION_OK);
    return q;
}

/* Shoemake's formula, the other way to say it. */
static struct quat slerp_formula(struct quat a, struct quat b, long double x)
{
    const long double cosine = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z;
    const long double angle = acosl(cosine);
    const long double p = sinl((1 - x) * angle) / sinl(angle);
    const long double q = sinl(x * angle) / sinl(angle);

    return (struct quat){ p * a.w + q * b.w, p * a.x + q * b.x,
                          p * a.y + q * b.y, p * a.z + q * b.z };
}

static void a_product_is_hamiltons(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    for (int i = 0; i < ROUNDS; i++) {
        const struct motion_quat p = any(&seed), q = any(&seed);
        const struct quat a = real(p), b = real(q);
        const struct quat want = {
            a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
            a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
            a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
            a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
        };
        if (difference(real(motion_quat_mul(p, q)), want) > 0x1p-61L)
            fail_msg("seed %" PRIu64 " round %d", SEED, i);
        assert_true(rotation_between(motion_quat_mul(p, motion_quat_inverse(p)),
                                     MOTION_QUAT_ONE) < 0x1p-59L);
    }
}

static void a_quaternion_of_any_length_becomes_a_unit(void **state)
{
    static const int64_t rows[][4] = {
        { 1, 0, 0, 0 },
        { 0, 0, 0, -1 },
        { INT64_MIN, INT64_MIN, INT64_MIN, INT64_MIN },
        { INT64_MAX, 1, -1, 0 },
    };
    const int64_t zero[4] = { 0, 0, 0, 0 };
    struct motion_quat q = { 1, 2, 3, 4 };
    (void)state;
    assert_int_equal(motion_quat_unit(zero, &q), MOTION_E_RANGE);
    assert_int_equal(q.x, 2);
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        assert_int_equal(motion_quat_unit(rows[i], &q), MOTION_OK);
        assert_true(motion_fixed_abs(motion_quat_dot_q62(q, q) - ONE) <= 8);
        assert_true((q.w < 0) == (rows[i][0] < 0));
    }
}

static void turning_a_vector_is_what_the_axes_say(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    for (int i = 0; i < ROUNDS; i++) {
        const struct motion_quat q = any(&seed);
        struct motion_dir axis[3];
        struct motion_quat back;

        for (int k = 0; k < 3; k++) {
            struct motion_dir e = { { 0, 0, 0 } };
            e.q62[k] = ONE;
            axis[k] = motion_quat_turn(q, e);
        }
        assert_int_equal(motion_quat_from_axes(axis, &back), MOTION_OK);
        assert_true(back.w >= 0);
        if (rotation_between(q, back) > 0x1p-58L)
            fail_msg("seed %" PRIu64 " round %d", SEED, i);
    }
}

static void half_turns_have_axes_too(void **state)
{
    static const struct motion_quat rows[] = {
        { 0, ONE, 0, 0 }, { 0, 0, ONE, 0 }, { 0, 0, 0, ONE }, { ONE, 0, 0, 0 }
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct motion_dir axis[3];
        struct motion_quat back;
        for (int k = 0; k < 3; k++) {
            struct motion_dir e = { { 0, 0, 0 } };
            e.q62[k] = ONE;
            axis[k] = motion_quat_turn(rows[i], e);
        }
        assert_int_equal(motion_quat_from_axes(axis, &back), MOTION_OK);
        assert_true(rotation_between(rows[i], back) < 0x1p-59L);
    }
}

static void a_left_handed_frame_is_refused(void **state)
{
    const struct motion_dir x = { { ONE, 0, 0 } }, y = { { 0, ONE, 0 } };
    const struct motion_dir z = { { 0, 0, -ONE } };
    const struct motion_dir left[3] = { x, y, z }, flat[3] = { x, x, y };
    struct motion_quat q;
    (void)state;
    assert_int_equal(motion_quat_from_axes(left, &q), MOTION_E_ARG);
    assert_int_equal(motion_quat_from_axes(flat, &q), MOTION_E_ARG);
}

static void logarithm_and_exponential_are_inverse_at_every_angle(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    for (int i = 0; i < ROUNDS; i++) {
        /* from 2^-60 to half a turn, and just below a whole one */
        const int64_t angle =
            i < 64 ? (int64_t)1 << (i % 62) : (int64_t)check_random(&seed) >> 1;
        const struct motion_quat dir = any(&seed);
        struct motion_dir axis = { { dir.x, dir.y, dir.z } };
        struct motion_quat q;
        struct motion_vec r;

        assert_int_equal(motion_vec_unit(motion_vec_from_dir(axis), &axis),
                         MOTION_OK);
        q = motion_quat_about(axis, angle);
        assert_int_equal(motion_quat_log(q, &r), MOTION_OK);
        if (difference(real(motion_quat_exp(r)), real(q)) > 0x1p-58L)
            fail_msg("seed %" PRIu64 " round %d", SEED, i);
        if (fabsl(scalar(motion_vec_length(r)) -
                  fabsl(scalar(motion_trig_rad(angle)))) > 0x1p-56L)
            fail_msg("seed %" PRIu64 " round %d: length", SEED, i);
    }
}

static void minus_one_has_no_axis(void **state)
{
    const struct motion_quat q = { -ONE, 0, 0, 0 };
    struct motion_vec r;
    (void)state;
    assert_int_equal(motion_quat_log(q, &r), MOTION_E_RANGE);
    assert_int_equal(motion_quat_log(MOTION_QUAT_ONE, &r), MOTION_OK);
    assert_true(motion_real_is_zero(motion_vec_length(r)));
}

static void slerp_is_shoemakes_formula(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    for (int i = 0; i < ROUNDS; i++) {
        const struct motion_quat a = any(&seed), b = any(&seed);
        const int64_t x = check_random_in(&seed, 0, ONE);
        struct quat end = real(b);
        struct motion_quat q;

        if (motion_quat_dot_q62(a, b) < 0)
            end = (struct quat){ -end.w, -end.x, -end.y, -end.z };
        assert_int_equal(motion_quat_slerp(a, b, x, &q), MOTION_OK);
        const struct quat want =
            slerp_formula(real(a), end, ldexpl((long double)x, -62));
        if (difference(real(q), want) > 1e-15L)
            fail_msg("seed %" PRIu64 " round %d", SEED, i);
    }
}

static void slerp_ends_at_its_keys(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    for (int i = 0; i < ROUNDS; i++) {
        const struct motion_quat a = any(&seed), b = any(&seed);
        struct motion_quat q;
        assert_int_equal(motion_quat_slerp(a, b, 0, &q), MOTION_OK);
        assert_true(rotation_between(q, a) < 0x1p-58L);
        assert_int_equal(motion_quat_slerp(a, b, ONE, &q), MOTION_OK);
        assert_true(rotation_between(q, b) < 0x1p-58L);
    }
}

static void slerp_of_one_rotation_stays(void **state)
{
    uint64_t seed = SEED;
    const struct motion_quat a = any(&seed);
    struct motion_quat q;
    (void)state;
    for (int64_t x = 0; x <= ONE; x += ONE / 8) {
        assert_int_equal(motion_quat_slerp(a, a, x, &q), MOTION_OK);
        assert_true(difference(real(q), real(a)) < 0x1p-58L);
        assert_int_equal(motion_quat_slerp(a, motion_quat_neg(a), x, &q),
                         MOTION_OK);
        assert_true(difference(real(q), real(a)) < 0x1p-58L);
    }
    assert_int_equal(
        motion_quat_slerp_signed(a, motion_quat_neg(a), ONE / 2, &q),
        MOTION_E_RANGE);
}

static void slerp_of_tiny_and_half_turns_keeps_constant_speed(void **state)
{
    static const int64_t angle[] = { 1 << 20, (int64_t)1 << 40,
                                     INT64_MAX - 1000, INT64_MAX };
    const struct motion_dir axis = { { 0, ONE / 5 * 3, ONE / 5 * 4 } };
    uint64_t seed = SEED;
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(angle); i++) {
        const struct motion_quat a = any(&seed);
        const struct motion_quat b =
            motion_quat_mul(a, motion_quat_about(axis, angle[i]));
        for (int k = 0; k <= 8; k++) {
            const struct motion_quat want =
                motion_quat_mul(a, motion_quat_about(axis, angle[i] / 8 * k));
            struct motion_quat q;
            assert_int_equal(motion_quat_slerp(a, b, ONE / 8 * k, &q),
                             MOTION_OK);
            if (rotation_between(q, want) > 0x1p-57L)
                fail_msg("angle %zu at %d/8", i, k);
        }
    }
}

static void a_fraction_outside_is_refused(void **state)
{
    const struct motion_quat pair[2] = { MOTION_QUAT_ONE, MOTION_QUAT_ONE };
    struct motion_quat q;
    (void)state;
    assert_int_equal(motion_quat_slerp(pair[0], pair[1], -1, &q), MOTION_E_ARG);
    assert_int_equal(motion_quat_slerp(pair[0], pair[1], ONE + 1, &q),
                     MOTION_E_ARG);
    assert_int_equal(motion_quat_squad(pair, pair, -1, &q), MOTION_E_ARG);
    assert_int_equal(motion_quat_squad(pair, pair, ONE + 1, &q), MOTION_E_ARG);
}

static void a_chain_takes_the_shorter_way_everywhere(void **state)
{
    uint64_t seed = SEED;
    struct motion_quat key[50], was[50];
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(key); i++)
        key[i] = was[i] = any(&seed);
    motion_quat_chain(key, ARRAY_LEN(key));
    for (size_t i = 0; i < ARRAY_LEN(key); i++) {
        assert_true(rotation_between(key[i], was[i]) == 0);
        if (i > 0)
            assert_true(motion_quat_dot_q62(key[i - 1], key[i]) >= 0);
    }
}

/* --- squad --------------------------------------------------------------- */

static void squad_meets_its_keys_without_a_step_in_velocity(void **state)
{
    const int64_t h = ONE >> 20;
    uint64_t seed = SEED;
    struct motion_quat key[8], inner[8];
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(key); i++)
        key[i] = any(&seed);
    motion_quat_chain(key, ARRAY_LEN(key));
    assert_int_equal(motion_quat_squad_inner(key, ARRAY_LEN(key), inner),
                     MOTION_OK);
    for (size_t i = 1; i + 1 < ARRAY_LEN(key); i++) {
        struct motion_quat before, at, after;
        struct motion_vec in, out;

        assert_int_equal(motion_quat_squad(&key[i], &inner[i], 0, &at),
                         MOTION_OK);
        assert_true(difference(real(at), real(key[i])) < 0x1p-57L);
        (void)motion_quat_squad(&key[i - 1], &inner[i - 1], ONE - h, &before);
        (void)motion_quat_squad(&key[i], &inner[i], h, &after);
        (void)motion_quat_log(motion_quat_mul(motion_quat_inverse(before), at),
                              &in);
        (void)motion_quat_log(motion_quat_mul(motion_quat_inverse(at), after),
                              &out);
        const long double step =
            scalar(motion_vec_length(motion_vec_sub(in, out)));
        /* a step in acceleration is left: h^2, times what it may be */
        if (step > 100 * 0x1p-40L)
            fail_msg("key %zu: %Lg of %Lg", i, step,
                     scalar(motion_vec_length(in)));
    }
}

static void squad_of_a_steady_turn_is_slerp(void **state)
{
    const struct motion_dir axis = { { ONE, 0, 0 } };
    struct motion_quat key[5], inner[5];
    (void)state;
    for (int i = 0; i < 5; i++)
        key[i] = motion_quat_about(axis, ((int64_t)1 << 59) * i);
    assert_int_equal(motion_quat_squad_inner(key, 5, inner), MOTION_OK);
    for (int64_t u = 0; u <= ONE; u += ONE / 16) {
        struct motion_quat a, b;
        assert_int_equal(motion_quat_squad(&key[2], &inner[2], u, &a),
                         MOTION_OK);
        assert_int_equal(motion_quat_slerp(key[2], key[3], u, &b), MOTION_OK);
        assert_true(difference(real(a), real(b)) < 0x1p-57L);
    }
    assert_int_equal(motion_quat_squad_inner(key, 0, inner), MOTION_E_EMPTY);
    assert_int_equal(motion_quat_squad_inner(key, 1, inner), MOTION_OK);
}

/* --- the spline ---------------------------------------------------------- */

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

            motion_rotspline_at(&spline, key[i].t_ns_q12, &at, &rate[0],
                                &acc[0]);
            assert_true(rotation_between(at, key[i].q) < 0x1p-56L);
            if (i == 0)
                assert_true(scalar(motion_vec_length(rate[0])) < 1e-15L);
            if (i == 0 || i == KEYS - 1)
                continue;
            /* one unit of time before: 2.4e-13 s, another span */
            motion_rotspline_at(&spline, key[i].t_ns_q12 - 1, &just, &rate[1],
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
        struct motion_vec rate, acc, in, out, low, high;

        motion_rotspline_at(&spline, t, &at, &rate, &acc);
        motion_rotspline_at(&spline, t - h, &before, &low, NULL);
        motion_rotspline_at(&spline, t + h, &after, &high, NULL);
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
        motion_rotspline_at(&spline, S_Q12 / 10 * i, &q, &rate, &acc);
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
    motion_rotspline_at(&spline, key[0].t_ns_q12 + 5, &q, &rate, &acc);
    assert_true(rotation_between(q, key[0].q) == 0);
    assert_int_equal(motion_rotspline_plan(&spline, key, 2,
                                           MOTION_ROTSPLINE_CHORD,
                                           MOTION_ROTSPLINE_CHORD, 0),
                     MOTION_OK);
    const int64_t half = (key[1].t_ns_q12 - key[0].t_ns_q12) / 2;
    motion_rotspline_at(&spline, key[0].t_ns_q12 + half, &q, &rate, &acc);
    (void)motion_quat_slerp(key[0].q, key[1].q, ONE / 2, &want);
    assert_true(rotation_between(q, want) < 1e-12L);
    assert_true(scalar(motion_vec_length(acc)) < 1e-14L);
    /* after the end: the key, at rest */
    motion_rotspline_at(&spline, key[1].t_ns_q12 + 1, &q, &rate, &acc);
    assert_true(rotation_between(q, key[1].q) == 0);
    assert_true(motion_real_is_zero(motion_vec_length(rate)));
}

static void given_rates_are_met(void **state)
{
    uint64_t seed = SEED;
    struct motion_rotkey key[4];
    struct motion_rotspline spline;
    struct motion_quat q;
    struct motion_vec rate;
    (void)state;
    any_keys(&seed, key, 4);
    const int64_t first[3] = { 1, -2, 3 }, last[3] = { -3, 1, 0 };
    key[0].rate = motion_vec_shift(motion_vec_from_q32(first), 32);
    key[3].rate = motion_vec_shift(motion_vec_from_q32(last), 32);
    assert_int_equal(motion_rotspline_plan(&spline, key, 4,
                                           MOTION_ROTSPLINE_GIVEN,
                                           MOTION_ROTSPLINE_GIVEN, 0),
                     MOTION_OK);
    motion_rotspline_at(&spline, key[0].t_ns_q12, &q, &rate, NULL);
    assert_true(fabsl(scalar(rate.x[1]) + 2) < 1e-15L);
    motion_rotspline_at(&spline, key[3].t_ns_q12, &q, &rate, NULL);
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
        cmocka_unit_test(a_product_is_hamiltons),
        cmocka_unit_test(a_quaternion_of_any_length_becomes_a_unit),
        cmocka_unit_test(turning_a_vector_is_what_the_axes_say),
        cmocka_unit_test(half_turns_have_axes_too),
        cmocka_unit_test(a_left_handed_frame_is_refused),
        cmocka_unit_test(logarithm_and_exponential_are_inverse_at_every_angle),
        cmocka_unit_test(minus_one_has_no_axis),
        cmocka_unit_test(slerp_is_shoemakes_formula),
        cmocka_unit_test(slerp_ends_at_its_keys),
        cmocka_unit_test(slerp_of_one_rotation_stays),
        cmocka_unit_test(slerp_of_tiny_and_half_turns_keeps_constant_speed),
        cmocka_unit_test(a_fraction_outside_is_refused),
        cmocka_unit_test(a_chain_takes_the_shorter_way_everywhere),
        cmocka_unit_test(squad_meets_its_keys_without_a_step_in_velocity),
        cmocka_unit_test(squad_of_a_steady_turn_is_slerp),
        cmocka_unit_test(the_spline_meets_keys_without_steps),
        cmocka_unit_test(the_splines_rates_are_its_derivatives),
        cmocka_unit_test(about_one_axis_the_spline_is_the_clamped_cubic),
        cmocka_unit_test(one_key_stands_and_two_turn_evenly),
        cmocka_unit_test(given_rates_are_met),
        cmocka_unit_test(bad_keys_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
