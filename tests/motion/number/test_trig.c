/* tests/motion/number/test_trig.c - vectors and angles, judged by libm in
 * long double. */
#include <inttypes.h>
#include <math.h>

#include "motion/core/err.h"
#include "motion/number/trig.h"
#include "motion/number/vec.h"
#include "tests/support/check.h"
#include "tests/support/real_double.h"

#define SEED   UINT64_C(20250311)
#define ROUNDS 20000
#define ONE    ((int64_t)1 << 62)
#define PI     3.141592653589793238462643383279502884L

/* In radian, -pi .. pi. */
static long double angle(int64_t turn)
{
    return ldexpl((long double)turn, -64) * 2 * PI;
}

/* Of every size and sign. */
static struct motion_real any_real(uint64_t *seed)
{
    const int64_t whole =
        (int64_t)check_random(seed) >> (check_random(seed) % 64);
    return motion_real_from_q(whole, (int)check_random_in(seed, -20, 60));
}

/* --- vectors ------------------------------------------------------------- */

static void unit_vectors_keep_their_bits_at_every_size(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    for (int i = 0; i < ROUNDS; i++) {
        const int32_t size = (int32_t)check_random_in(&seed, -200, 200);
        struct motion_vec v;
        struct motion_dir unit;
        long double x[3], length = 0;

        for (int k = 0; k < 3; k++) {
            const int64_t a = (int64_t)check_random(&seed) >> 8;
            v.x[k] = motion_real_from_q(a, -size);
            x[k] = (long double)a;
            length += x[k] * x[k];
        }
        length = sqrtl(length);
        assert_int_equal(motion_vec_unit(v, &unit), MOTION_OK);
        for (int k = 0; k < 3; k++) {
            if (fabsl(q62(unit.q62[k]) - x[k] / length) > 0x1p-61L)
                fail_msg("seed %" PRIu64 " round %d", SEED, i);
        }
    }
}

static void the_zero_vector_has_no_direction(void **state)
{
    struct motion_dir unit = { { 1, 2, 3 } };
    (void)state;
    assert_int_equal(motion_vec_unit(motion_vec_zero(), &unit), MOTION_E_RANGE);
    assert_int_equal(unit.q62[1], 2);
}

static void x_cross_y_is_z(void **state)
{
    const struct motion_dir x = { { ONE, 0, 0 } }, y = { { 0, ONE, 0 } };
    const struct motion_dir z = motion_dir_cross(x, y);
    int64_t v[3];
    (void)state;
    assert_int_equal(z.q62[0], 0);
    assert_int_equal(z.q62[1], 0);
    assert_int_equal(z.q62[2], ONE);
    assert_int_equal(motion_vec_round(motion_vec_cross(motion_vec_from_dir(x),
                                                       motion_vec_from_dir(y)),
                                      32, v),
                     MOTION_OK);
    assert_int_equal(v[2], MOTION_FIXED_ONE_Q32);
    assert_int_equal(v[0], 0);
}

static void a_quarter_turn_about_z_takes_x_to_y(void **state)
{
    const struct motion_dir x = { { ONE, 0, 0 } }, z = { { 0, 0, ONE } };
    const struct motion_dir y = motion_dir_turn(x, z, ONE, 0);
    (void)state;
    assert_int_equal(y.q62[0], 0);
    assert_int_equal(y.q62[1], ONE);
}

static void a_vector_that_does_not_fit_is_refused_whole(void **state)
{
    const int64_t point[3] = { 1, 2, 3 };
    struct motion_vec v = motion_vec_from_q32(point);
    int64_t got[3] = { 7, 7, 7 };
    (void)state;
    v.x[2] = motion_real_from_q(1, -40);
    assert_int_equal(motion_vec_round(v, 32, got), MOTION_E_RANGE);
    assert_int_equal(got[0], 7);
}

/* --- angles -------------------------------------------------------------- */

static void sine_and_cosine_go_all_the_way_round(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    for (int i = 0; i < ROUNDS; i++) {
        const int64_t turn =
            i < 8 ? (int64_t)((uint64_t)i << 61) : (int64_t)check_random(&seed);
        int64_t s, c;

        motion_trig_sincos(turn, &s, &c);
        if (fabsl(q62(s) - sinl(angle(turn))) > 0x1p-59L ||
            fabsl(q62(c) - cosl(angle(turn))) > 0x1p-59L)
            fail_msg("seed %" PRIu64 " round %d: %" PRIx64, SEED, i,
                     (uint64_t)turn);
    }
}

static void the_angle_of_a_point_is_found_in_every_quadrant(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    for (int i = 0; i < ROUNDS; i++) {
        const int64_t y =
            (int64_t)check_random(&seed) >> (check_random(&seed) & 63);
        const int64_t x =
            (int64_t)check_random(&seed) >> (check_random(&seed) & 63);
        const long double want = atan2l((long double)y, (long double)x);
        const int64_t got = motion_trig_atan2(y, x);
        const long double off = remainderl(angle(got) - want, 2 * PI);

        /* what is shifted out of the smaller one: 2^-61 */
        if (fabsl(off) > 0x1p-59L)
            fail_msg("seed %" PRIu64 " round %d: %" PRId64 ", %" PRId64
                     ": off %Lg",
                     SEED, i, y, x, off);
    }
}

static void angles_on_the_axes_are_exact(void **state)
{
    static const struct {
        int64_t y, x;
        int64_t want;
    } rows[] = {
        { 0, 0, 0 },
        { 0, 5, 0 },
        { 5, 0, (int64_t)1 << 62 },
        { 0, -5, INT64_MIN },
        { -5, 0, -((int64_t)1 << 62) },
        { INT64_MIN, 0, -((int64_t)1 << 62) },
        { 0, INT64_MIN, INT64_MIN },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const int64_t got = motion_trig_atan2(rows[i].y, rows[i].x);
        if (motion_fixed_abs(motion_trig_diff(got, rows[i].want)) > 8)
            fail_msg("row %zu: %" PRIx64, i, (uint64_t)got);
    }
    assert_true(motion_fixed_abs(motion_trig_diff(motion_trig_atan2(7, 7),
                                                  (int64_t)1 << 61)) <= 8);
}

static void numbers_of_any_size_have_an_angle(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    for (int i = 0; i < ROUNDS; i++) {
        const struct motion_real y = any_real(&seed), x = any_real(&seed);
        const long double want = atan2l(real_value(y), real_value(x));
        const long double got = angle(motion_trig_atan2_real(y, x));

        if (fabsl(remainderl(got - want, 2 * PI)) > 0x1p-59L)
            fail_msg("seed %" PRIu64 " round %d", SEED, i);
    }
    assert_int_equal(
        motion_trig_atan2_real(motion_real_zero(), motion_real_zero()), 0);
}

static void the_hypotenuse_is_rounded_down(void **state)
{
    static const struct {
        int64_t x, y;
        uint64_t want;
    } rows[] = {
        { 3, 4, 5 },
        { -3, -4, 5 },
        { 1, 1, 1 },
        { 0, INT64_MIN, (uint64_t)1 << 63 },
        { INT64_MIN, INT64_MIN, UINT64_C(13043817825332782212) },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        assert_int_equal(motion_trig_hypot(rows[i].x, rows[i].y), rows[i].want);
}

static void degrees_and_turns_are_each_others_inverse(void **state)
{
    static const struct {
        int64_t deg_q32, turn;
    } rows[] = {
        { 0, 0 },
        { (int64_t)90 << 32, (int64_t)1 << 62 },
        { (int64_t)180 << 32, INT64_MIN },
        { -((int64_t)180 << 32), INT64_MIN },
        { (int64_t)450 << 32, (int64_t)1 << 62 },
        { -((int64_t)450 << 32), -((int64_t)1 << 62) },
    };
    uint64_t seed = SEED;
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        assert_int_equal(motion_trig_from_deg_q32(rows[i].deg_q32),
                         rows[i].turn);
    for (int i = 0; i < ROUNDS; i++) {
        const int64_t deg = check_random_in(&seed, -((int64_t)180 << 32),
                                            ((int64_t)180 << 32) - 1);
        const int64_t turn = motion_trig_from_deg_q32(deg);
        if (motion_trig_deg_q32(turn) != deg)
            fail_msg("seed %" PRIu64 " round %d: %" PRId64, SEED, i, deg);
    }
}

static void radians_and_turns_are_each_others_inverse(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    for (int i = 0; i < ROUNDS; i++) {
        const int64_t turn = (int64_t)check_random(&seed);
        const struct motion_real rad = motion_trig_rad(turn);

        if (fabsl(real_value(rad) - angle(turn)) > 0x1p-60L ||
            motion_fixed_abs(
                motion_trig_diff(motion_trig_from_rad(rad), turn)) > 2)
            fail_msg("seed %" PRIu64 " round %d", SEED, i);
    }
    /* 1000 pi is 500 turns: whatever is whole is dropped */
    const struct motion_real much =
        motion_real_mul(motion_trig_rad(INT64_MIN), motion_real_int(1001));
    assert_true(motion_fixed_abs(motion_trig_diff(motion_trig_from_rad(much),
                                                  INT64_MIN)) < 2000);
    assert_int_equal(motion_trig_from_rad(motion_real_zero()), 0);
    assert_int_equal(motion_trig_from_rad(motion_real_from_q(1, 300)), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(unit_vectors_keep_their_bits_at_every_size),
        cmocka_unit_test(the_zero_vector_has_no_direction),
        cmocka_unit_test(x_cross_y_is_z),
        cmocka_unit_test(a_quarter_turn_about_z_takes_x_to_y),
        cmocka_unit_test(a_vector_that_does_not_fit_is_refused_whole),
        cmocka_unit_test(sine_and_cosine_go_all_the_way_round),
        cmocka_unit_test(the_angle_of_a_point_is_found_in_every_quadrant),
        cmocka_unit_test(angles_on_the_axes_are_exact),
        cmocka_unit_test(numbers_of_any_size_have_an_angle),
        cmocka_unit_test(the_hypotenuse_is_rounded_down),
        cmocka_unit_test(degrees_and_turns_are_each_others_inverse),
        cmocka_unit_test(radians_and_turns_are_each_others_inverse),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
