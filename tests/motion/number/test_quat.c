/* tests/motion/number/test_quat.c - rotations and what lies between two,
 * judged by long double and by what they must be. */
#include <inttypes.h>
#include <math.h>

#include "motion/core/err.h"
#include "motion/number/quat.h"
#include "motion/number/trig.h"
#include "tests/support/check.h"
#include "tests/support/quat_real.h"

#define SEED   UINT64_C(20250312)
#define ROUNDS 2000
#define ONE    ((int64_t)1 << 62)

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

/* --- squad --------------------------------------------------------------- */

static void squad_meets_its_keys_without_a_step_in_velocity(void **state)
{
    const int64_t h = ONE >> 20;
    uint64_t seed = SEED;
    struct motion_quat key[8], inner[8];
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(key); i++) {
        key[i] = any(&seed);
        if (i > 0 && motion_quat_dot_q62(key[i - 1], key[i]) < 0)
            key[i] = motion_quat_neg(key[i]); /* the shorter way */
    }
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
        cmocka_unit_test(squad_meets_its_keys_without_a_step_in_velocity),
        cmocka_unit_test(squad_of_a_steady_turn_is_slerp),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
