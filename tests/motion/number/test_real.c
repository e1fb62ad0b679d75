/* tests/motion/number/test_real.c - numbers of any size, judged by long
 * double. */
#include <inttypes.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/number/real.h"
#include "tests/support/check.h"

static struct motion_real draw_real(void)
{
    const int64_t low = (int64_t)1 << 61;
    int64_t m = low + (int64_t)(draw() % (uint64_t)low);

    if (draw() % 8 == 0)
        m = low * 2 - 1 - (int64_t)(draw() % 3);
    if (draw() % 8 == 0)
        m = low + (int64_t)(draw() % 3);
    return (struct motion_real){ draw() % 2 ? m : -m,
                                 (int32_t)(draw() % 401) - 200 };
}

static long double value(struct motion_real a)
{
    return ldexpl((long double)a.m, a.e);
}

/* Within 2^-bits of `scale`; normalised, or zero as zero is written. */
static void assert_close(struct motion_real got, long double want, int bits,
                         long double scale, const char *what)
{
    const int64_t size = got.m < 0 ? -got.m : got.m;

    if (fabsl(value(got) - want) > ldexpl(fabsl(scale), -bits))
        fail_msg("%s: got %.20Lg, want %.20Lg", what, value(got), want);
    if (got.m == 0 ? got.e != MOTION_REAL_ZERO_E : size >> 61 != 1)
        fail_msg("%s: not normalised", what);
}

static void arithmetic_agrees_with_long_double(void **state)
{
    (void)state;
    seed_from("arithmetic");
    for (int i = 0; i < 100000; i++) {
        const struct motion_real a = draw_real(), b = draw_real();
        const long double x = value(a), y = value(b), size = fabsl(x);
        const long double larger = size > fabsl(y) ? size : fabsl(y);

        assert_close(motion_real_add(a, b), x + y, 59, larger, "add");
        assert_close(motion_real_sub(a, b), x - y, 59, larger, "sub");
        assert_close(motion_real_mul(a, b), x * y, 59, x * y, "mul");
        assert_close(motion_real_div(a, b), x / y, 58, x / y, "div");
        assert_close(motion_real_sqrt(motion_real_abs(a)), sqrtl(size), 58,
                     sqrtl(size), "sqrt");
        assert_close(motion_real_cbrt(a), cbrtl(x), 58, cbrtl(x), "cbrt");
        assert_int_equal(motion_real_cmp(a, b), (x > y) - (x < y));
        assert_true(value(motion_real_max(a, b)) == (x > y ? x : y));
        assert_true(value(motion_real_min(a, b)) == (x < y ? x : y));
    }
}

static void the_reciprocal_root_is_good_to_52_bits(void **state)
{
    (void)state;
    seed_from("quick");
    for (int i = 0; i < 100000; i++) {
        const struct motion_real size = motion_real_abs(draw_real());
        const long double root = sqrtl(value(size));

        assert_close(motion_real_rsqrt(size), 1 / root, 52, 1 / root, "rsqrt");
    }
}

static void zero_is_zero(void **state)
{
    const struct motion_real zero = motion_real_from_u64(0, 7);
    const struct motion_real two = motion_real_int(2);
    const struct motion_real minus = motion_real_int(-2);

    (void)state;
    assert_true(motion_real_is_zero(zero));
    assert_true(motion_real_is_zero(motion_real_mul(zero, two)));
    assert_true(motion_real_is_zero(motion_real_div(zero, two)));
    assert_true(motion_real_is_zero(motion_real_sqrt(zero)));
    assert_true(motion_real_is_zero(motion_real_sqrt(minus)));
    assert_true(motion_real_is_zero(motion_real_cbrt(zero)));
    assert_true(motion_real_is_zero(motion_real_sub(two, two)));
    assert_true(motion_real_is_zero(motion_real_scale(zero, 70)));
    assert_true(value(motion_real_add(zero, two)) == 2);
    assert_true(value(motion_real_add(zero, zero)) == 0);
    assert_true(value(motion_real_sub(two, zero)) == 2);
    assert_int_equal(motion_real_cmp(zero, two), -1);
    assert_int_equal(motion_real_cmp(zero, minus), 1);
    assert_int_equal(motion_real_cmp(two, zero), 1);
    assert_int_equal(motion_real_cmp(zero, zero), 0);
}

static void exact_roots_are_exact(void **state)
{
    (void)state;
    for (int64_t n = 1; n < 2000000; n = n * 3 / 2 + 1) {
        const struct motion_real a = motion_real_int(n);
        assert_true(value(motion_real_sqrt(motion_real_mul(a, a))) ==
                    (long double)n);
        assert_close(
            motion_real_cbrt(motion_real_mul(a, motion_real_mul(a, a))),
            (long double)n, 58, (long double)n, "cube");
    }
}

static void integers_come_in_exactly(void **state)
{
    static const int64_t rows[] = { 1,        -1,        3,
                                    -77,      INT32_MAX, ((int64_t)1 << 61) - 1,
                                    INT64_MIN };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        assert_true(value(motion_real_int(rows[i])) == (long double)rows[i]);
        assert_true(value(motion_real_from_q(rows[i], 32)) ==
                    ldexpl((long double)rows[i], -32));
    }
}

static void rounding_to_whole_numbers(void **state)
{
    static const struct {
        const char *name;
        int64_t m;
        int32_t e, bits;
        int rc;
        int64_t round, ceil, floor;
    } rows[] = {
        { "whole", 42, 0, 0, 0, 42, 42, 42 },
        { "half goes up", 5, -1, 0, 0, 3, 3, 2 },
        { "minus half goes down", -5, -1, 0, 0, -3, -2, -3 },
        { "below half", 9, -2, 0, 0, 2, 3, 2 },
        { "minus below half", -9, -2, 0, 0, -2, -2, -3 },
        { "minus above half", -11, -2, 0, 0, -3, -2, -3 },
        { "bits", 9, -2, 2, 0, 9, 9, 9 },
        { "quarter", 1, -2, 0, 0, 0, 1, 0 },
        { "zero", 0, 0, 60, 0, 0, 0, 0 },
        { "tiny", 1, -500, 0, 0, 0, 1, 0 },
        { "minus tiny", -1, -500, 0, 0, 0, 0, -1 },
        { "smallest shift", 1, -64, 0, 0, 0, 1, 0 },
        { "two words down", 3, -66, 0, 0, 0, 1, 0 },
        { "minus two words down", -3, -66, 0, 0, 0, 0, -1 },
        { "half of one", 1, -1, 0, 0, 1, 1, 0 },
        { "largest", ((int64_t)1 << 62) - 1, 1, 0, 0, INT64_MAX - 1,
          INT64_MAX - 1, INT64_MAX - 1 },
        { "one past", (int64_t)1 << 62, 1, 0, MOTION_E_RANGE, 0, 0, 0 },
        { "one past below", -((int64_t)1 << 62), 1, 0, MOTION_E_RANGE, 0, 0,
          0 },
        { "far past", 1, 500, 0, MOTION_E_RANGE, 0, 0, 0 },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct motion_real a = motion_real_make(rows[i].m, rows[i].e);
        int64_t round = 0, ceil = 0, floor = 0;
        if (motion_real_round(a, rows[i].bits, &round) != rows[i].rc ||
            motion_real_ceil(a, rows[i].bits, &ceil) != rows[i].rc ||
            motion_real_floor(a, rows[i].bits, &floor) != rows[i].rc)
            fail_msg("%s: wrong code", rows[i].name);
        if (rows[i].rc == MOTION_OK &&
            (round != rows[i].round || ceil != rows[i].ceil ||
             floor != rows[i].floor ||
             (floor < (int64_t)1 << 62 &&
              motion_real_floor_clamped(a, rows[i].bits) != floor)))
            fail_msg("%s: %" PRId64 " %" PRId64 " %" PRId64, rows[i].name,
                     round, ceil, floor);
    }
    assert_true(motion_real_floor_clamped(motion_real_make(1, 99), 0) ==
                (int64_t)1 << 62);
    assert_true(motion_real_floor_clamped(motion_real_make(-1, 99), 0) ==
                -((int64_t)1 << 62));
}

static void rounding_agrees_with_long_double(void **state)
{
    (void)state;
    seed_from("rounding");
    for (int i = 0; i < 100000; i++) {
        struct motion_real a = draw_real();
        int64_t round, ceil, floor;

        a.e = -(int32_t)(draw() % 140);
        assert_int_equal(0, motion_real_round(a, 0, &round));
        assert_int_equal(0, motion_real_ceil(a, 0, &ceil));
        assert_int_equal(0, motion_real_floor(a, 0, &floor));
        assert_true((long double)round == roundl(value(a)));
        assert_true((long double)ceil == ceill(value(a)));
        assert_true((long double)floor == floorl(value(a)));
    }
}

static void wide_integers_come_in_to_nearest(void **state)
{
    static const struct {
        uint64_t high, low;
        int64_t m;
        int32_t e;
    } rows[] = {
        { UINT64_MAX, 0, (int64_t)1 << 61, 67 },
        { (uint64_t)1 << 63, 0, (int64_t)1 << 61, 66 },
        { (uint64_t)1 << 63 | 1, UINT64_MAX, (int64_t)1 << 61, 66 },
        { (uint64_t)1 << 63 | 2, 0, ((int64_t)1 << 61) + 1, 66 },
        { 0, 1, (int64_t)1 << 61, -61 },
        { 1, 0, (int64_t)1 << 61, 3 },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct motion_real a = motion_real_from_u128(
            (struct motion_u128){ rows[i].high, rows[i].low }, 0);
        if (a.m != rows[i].m || a.e != rows[i].e)
            fail_msg("row %zu: %" PRId64 " * 2^%d", i, a.m, (int)a.e);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(arithmetic_agrees_with_long_double),
        cmocka_unit_test(the_reciprocal_root_is_good_to_52_bits),
        cmocka_unit_test(zero_is_zero),
        cmocka_unit_test(exact_roots_are_exact),
        cmocka_unit_test(integers_come_in_exactly),
        cmocka_unit_test(rounding_to_whole_numbers),
        cmocka_unit_test(rounding_agrees_with_long_double),
        cmocka_unit_test(wide_integers_come_in_to_nearest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
