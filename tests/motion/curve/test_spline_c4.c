/* tests/motion/curve/test_spline_c4.c - what makes a quintic spline C4, in long
 * double. */
#include "tests/support/spline_keys.h"

static struct motion_spline_work work[KEYS];

/* Coefficients of u^0 .. u^5 of span i. */
static void coefficients(uint32_t i, long double c[6])
{
    const long double T = span(i), D = displacement(i);
    const long double a = T * vel(i), b = T * vel(i + 1);
    const long double A = T * T * acc(i) / 2, B = T * T * acc(i + 1) / 2;

    c[0] = 0;
    c[1] = a;
    c[2] = A;
    c[3] = 10 * D - 6 * a - 4 * b - 3 * A + B;
    c[4] = -15 * D + 8 * a + 7 * b + 3 * A - 2 * B;
    c[5] = 6 * D - 3 * a - 3 * b - A + B;
}

static long double derivative(uint32_t i, int order, long double u)
{
    long double c[6], sum = 0;

    coefficients(i, c);
    for (int k = 5; k >= order; k--) {
        long double falling = 1;
        for (int n = 0; n < order; n++)
            falling *= k - n;
        sum = sum * u + falling * c[k];
    }
    return sum / powl(span(i), order);
}

static long double size(uint32_t i, int order)
{
    return (fabsl(displacement(i)) +
            span(i) * (fabsl(vel(i)) + fabsl(vel(i + 1))) +
            span(i) * span(i) * (fabsl(acc(i)) + fabsl(acc(i + 1)))) *
           1000 / powl(span(i), order);
}

static void assert_joined(uint32_t i, int highest)
{
    for (int order = 3; order <= highest; order++)
        assert_equal_to(derivative(i - 1, order, 1), derivative(i, order, 0),
                        size(i - 1, order) + size(i, order), "derivative");
}

static void fourth_derivative_is_continuous_from_rest_to_rest(void **state)
{
    (void)state;
    seed_from("c4 rest");
    for (int round = 0; round < 1500; round++) {
        const uint32_t n = 2 + (uint32_t)(draw() % (KEYS - 2));

        draw_keys(n, 1);
        assert_int_equal(0, motion_spline_c4(key, n, MOTION_SPLINE_REST,
                                             MOTION_SPLINE_REST, work));
        for (uint32_t i = 1; i + 1 < n; i++)
            assert_joined(i, 4);
        assert_true(vel(0) == 0 && acc(0) == 0);
        assert_true(vel(n - 1) == 0 && acc(n - 1) == 0);
        start_track();
        assert_int_equal(0, motion_spline_append_quintic(&track, key, n, NULL));
        assert_keys_hit(n);
    }
}

static void without_a_knot_the_end_spans_are_one_polynomial(void **state)
{
    (void)state;
    seed_from("c4 not a knot");
    for (int round = 0; round < 1500; round++) {
        const uint32_t n = 4 + (uint32_t)(draw() % (KEYS - 4));
        const bool both = n > 6 && draw() % 2;

        draw_keys(n, 1);
        assert_int_equal(0, motion_spline_c4(key, n, MOTION_SPLINE_NOT_A_KNOT,
                                             both ? MOTION_SPLINE_NOT_A_KNOT
                                                  : MOTION_SPLINE_REST,
                                             work));
        for (uint32_t i = 1; i + 1 < n; i++)
            assert_joined(i, i < 3 || (both && i > n - 4) ? 5 : 4);
    }
}

static void up_to_six_free_keys_have_their_one_polynomial(void **state)
{
    (void)state;
    seed_from("c4 few");
    for (uint32_t n = 1; n <= 6; n++) {
        draw_keys(n, 1);
        assert_int_equal(0, motion_spline_c4(key, n, MOTION_SPLINE_NOT_A_KNOT,
                                             MOTION_SPLINE_NOT_A_KNOT, work));
        for (uint32_t i = 1; i + 1 < n; i++)
            assert_joined(i, 5);
        for (int order = (int)n; n > 1 && order <= 5; order++)
            assert_equal_to(derivative(0, order, 0.5L), 0, size(0, order),
                            "degree");
    }
}

static void given_values_are_kept(void **state)
{
    (void)state;
    seed_from("c4 given");
    draw_keys(9, 1);
    key[0].has_vel = key[4].has_vel = key[4].has_acc = true;
    key[6].has_vel = key[7].has_acc = true;
    for (int i = 0; i < 9; i++) {
        key[i].vel = motion_real_int(i + 1);
        key[i].acc = motion_real_int(10 * i);
    }
    assert_int_equal(0, motion_spline_c4(key, 9, MOTION_SPLINE_REST,
                                         MOTION_SPLINE_REST, work));
    assert_equal_to(vel(0), 1, 1, "first velocity");
    assert_equal_to(acc(0), 0, 1, "first acceleration");
    assert_equal_to(vel(4), 5, 5, "inner velocity");
    assert_equal_to(acc(4), 40, 40, "inner acceleration");
    assert_equal_to(vel(6), 7, 7, "velocity alone");
    assert_equal_to(acc(7), 70, 70, "acceleration alone");
    assert_joined(3, 4);
    assert_joined(6, 3);
    assert_joined(7, 3);
}

static void what_is_no_spline_is_refused(void **state)
{
    (void)state;
    seed_from("c4 refused");
    draw_keys(8, 1);
    assert_int_equal(
        MOTION_E_EMPTY,
        motion_spline_c4(key, 0, MOTION_SPLINE_REST, MOTION_SPLINE_REST, work));
    assert_int_equal(MOTION_E_ARG,
                     motion_spline_c4(key, 8, MOTION_SPLINE_NATURAL,
                                      MOTION_SPLINE_REST, work));
    assert_int_equal(MOTION_E_ARG,
                     motion_spline_c4(key, 3, MOTION_SPLINE_NOT_A_KNOT,
                                      MOTION_SPLINE_REST, work));
    key[5].t_ns_q12 = key[4].t_ns_q12;
    assert_int_equal(
        MOTION_E_ORDER,
        motion_spline_c4(key, 8, MOTION_SPLINE_REST, MOTION_SPLINE_REST, work));
    key[5].t_ns_q12 = key[4].t_ns_q12 + 1;
    assert_int_equal(
        MOTION_E_RANGE,
        motion_spline_c4(key, 8, MOTION_SPLINE_REST, MOTION_SPLINE_REST, work));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fourth_derivative_is_continuous_from_rest_to_rest),
        cmocka_unit_test(without_a_knot_the_end_spans_are_one_polynomial),
        cmocka_unit_test(up_to_six_free_keys_have_their_one_polynomial),
        cmocka_unit_test(given_values_are_kept),
        cmocka_unit_test(what_is_no_spline_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
