/* tests/test_real.c - wide-range numbers, judged by long double. */
#include <inttypes.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "motion/err.h"
#include "motion/real.h"
#include "tests/check.h"

static uint64_t seed_state;

static uint64_t draw(void)
{
    return check_random(&seed_state);
}

static void seed_from(const char *what)
{
    const char *given = getenv("SEED");

    seed_state =
        given ? strtoull(given, NULL, 0) : UINT64_C(0x2545F4914F6CDD1D);
    print_message("%s: SEED=%#" PRIx64 "\n", what, seed_state);
}

static struct motion_real draw_real(void)
{
    struct motion_real a = { draw() | (uint64_t)1 << 63,
                             (int32_t)(draw() % 401) - 200 };
    if (draw() % 8 == 0)
        a.mantissa = UINT64_MAX - draw() % 3;
    if (draw() % 8 == 0)
        a.mantissa = ((uint64_t)1 << 63) + draw() % 3;
    return a;
}

static long double value(struct motion_real a)
{
    return ldexpl((long double)a.mantissa, a.exponent);
}

/* Long double has 64 bits as well: allow for its own rounding. */
static void assert_close(struct motion_real got, long double want,
                         const char *what)
{
    if (fabsl(value(got) - want) > ldexpl(want, -62))
        fail_msg("%s: got %.20Lg, want %.20Lg", what, value(got), want);
    if (got.mantissa != 0 && got.mantissa >> 63 == 0)
        fail_msg("%s: not normalised", what);
}

static void arithmetic_agrees_with_long_double(void **state)
{
    (void)state;
    seed_from("arithmetic");
    for (int i = 0; i < 100000; i++) {
        const struct motion_real a = draw_real(), b = draw_real();
        const long double x = value(a), y = value(b);
        assert_close(motion_real_add(a, b), x + y, "add");
        if (x > y)
            assert_close(motion_real_sub(a, b), x - y, "sub");
        else
            assert_true(motion_real_sub(a, b).mantissa == 0);
        assert_close(motion_real_mul(a, b), x * y, "mul");
        assert_close(motion_real_div(a, b), x / y, "div");
        assert_close(motion_real_sqrt(a), sqrtl(x), "sqrt");
        assert_close(motion_real_cbrt(a), cbrtl(x), "cbrt");
        assert_int_equal(motion_real_cmp(a, b), (x > y) - (x < y));
    }
}

static void zero_is_zero(void **state)
{
    const struct motion_real zero = motion_real_from_u64(0, 7);
    const struct motion_real two = motion_real_from_u64(2, 0);

    (void)state;
    assert_true(motion_real_mul(zero, two).mantissa == 0);
    assert_true(motion_real_div(zero, two).mantissa == 0);
    assert_true(motion_real_sqrt(zero).mantissa == 0);
    assert_true(motion_real_cbrt(zero).mantissa == 0);
    assert_true(motion_real_sub(two, two).mantissa == 0);
    assert_true(value(motion_real_add(zero, two)) == 2);
    assert_true(value(motion_real_add(zero, zero)) == 0);
    assert_true(value(motion_real_sub(two, zero)) == 2);
    assert_int_equal(motion_real_cmp(zero, two), -1);
    assert_int_equal(motion_real_cmp(two, zero), 1);
    assert_int_equal(motion_real_cmp(zero, zero), 0);
}

static void exact_roots_are_exact(void **state)
{
    (void)state;
    for (uint64_t n = 1; n < 2000000; n = n * 3 / 2 + 1) {
        const struct motion_real a = motion_real_from_u64(n, 0);
        assert_true(value(motion_real_sqrt(motion_real_mul(a, a))) ==
                    (long double)n);
        assert_close(
            motion_real_cbrt(motion_real_mul(a, motion_real_mul(a, a))),
            (long double)n, "cube");
    }
}

static void rounding_to_whole_numbers(void **state)
{
    static const struct {
        const char *name;
        uint64_t word;
        int32_t exponent, bits;
        int rc;
        int64_t round, ceil;
    } rows[] = {
        { "whole", 42, 0, 0, 0, 42, 42 },
        { "half goes up", 5, -1, 0, 0, 3, 3 },
        { "below half", 9, -2, 0, 0, 2, 3 },
        { "bits", 9, -2, 2, 0, 9, 9 },
        { "quarter", 1, -2, 0, 0, 0, 1 },
        { "zero", 0, 0, 60, 0, 0, 0 },
        { "tiny", 1, -500, 0, 0, 0, 1 },
        { "smallest shift", 1, -64, 0, 0, 0, 1 },
        { "half of one", 1, -1, 0, 0, 1, 1 },
        { "largest", INT64_MAX, 0, 0, 0, INT64_MAX, INT64_MAX },
        { "one past", (uint64_t)1 << 63, 0, 0, MOTION_E_RANGE, 0, 0 },
        { "far past", 1, 500, 0, MOTION_E_RANGE, 0, 0 },
        { "rounds past", UINT64_MAX, -1, 0, MOTION_E_RANGE, 0, 0 },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct motion_real a =
            motion_real_from_u64(rows[i].word, rows[i].exponent);
        int64_t round = 0, ceil = 0;
        if (motion_real_round(a, rows[i].bits, &round) != rows[i].rc ||
            motion_real_ceil(a, rows[i].bits, &ceil) != rows[i].rc ||
            round != rows[i].round || ceil != rows[i].ceil)
            fail_msg("%s: %" PRId64 " %" PRId64, rows[i].name, round, ceil);
    }
}

static void a_carry_out_of_the_mantissa_is_kept(void **state)
{
    const struct motion_u128 wide = { UINT64_MAX, (uint64_t)1 << 63 };
    const struct motion_real a = motion_real_from_u128(wide, -128);

    (void)state;
    assert_true(a.mantissa == (uint64_t)1 << 63);
    assert_int_equal(a.exponent, -63);
}

static void what_is_cut_off_rounds_to_nearest(void **state)
{
    static const struct {
        uint64_t low, want;
    } rows[] = {
        { 0, 1 },
        { ((uint64_t)1 << 63) - 1, 1 },
        { (uint64_t)1 << 63, 2 },
        { UINT64_MAX, 2 },
    };
    const uint64_t top = (uint64_t)1 << 63;

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct motion_u128 wide = { top | 1, rows[i].low };
        const struct motion_real a = motion_real_from_u128(wide, 0);
        assert_true(a.mantissa == (top | rows[i].want));
        assert_int_equal(a.exponent, 64);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(arithmetic_agrees_with_long_double),
        cmocka_unit_test(zero_is_zero),
        cmocka_unit_test(exact_roots_are_exact),
        cmocka_unit_test(rounding_to_whole_numbers),
        cmocka_unit_test(a_carry_out_of_the_mantissa_is_kept),
        cmocka_unit_test(what_is_cut_off_rounds_to_nearest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
