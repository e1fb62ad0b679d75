/* tests/motion/number/test_num.c - short reals: the functions for 32-bit
 * machines and the inline ones for 64-bit machines give the same bits, and both
 * what long double says, as nearly as motion/number/num.h promises. */
#include <math.h>
#include <stdbool.h>

#include "motion/number/num.h"
#include "tests/support/check.h"

#define ROUNDS 200000

/* Where carries, signs and shifts go wrong. */
static const int32_t edge[] = { 0,
                                NUM_ONE,
                                -NUM_ONE,
                                NUM_ONE + 1,
                                2 * NUM_ONE - 1,
                                -NUM_ONE - 1,
                                NUM_ONE * 3 / 2,
                                1 - 2 * NUM_ONE };

static struct num any(int32_t near)
{
    int32_t m = edge[draw() % ARRAY_LEN(edge)];
    if (draw() & 1)
        m = (int32_t)(NUM_ONE + (int32_t)(draw() % (uint32_t)NUM_ONE));
    if (draw() & 1)
        m = -m;
    if (m == 0)
        return num_zero();
    return (struct num){ m, near + (int32_t)(draw() % 71) - 35 };
}

static long double value(struct num a)
{
    return ldexpl((long double)a.m, a.e);
}

static void assert_form(struct num a)
{
    int32_t size = a.m < 0 ? -a.m : a.m;
    if (a.m == 0)
        assert_int_equal(a.e, NUM_ZERO_E);
    else
        assert_true(size >= NUM_ONE && size < 2 * NUM_ONE);
}

static void assert_near(struct num got, long double want, long double size,
                        int bits)
{
    assert_form(got);
    if (fabsl(value(got) - want) > ldexpl(fabsl(size), -bits))
        fail_msg("got %.20Lg, expected %.20Lg", value(got), want);
}

static void sums_products_and_order_are_right(void **state)
{
    (void)state;
    seed_from("num");
    for (int i = 0; i < ROUNDS; i++) {
        int32_t near = (int32_t)(draw() % 20001) - 10000;
        struct num a = any(near), b = any(near);
        long double x = ldexpl(value(a), -near), y = ldexpl(value(b), -near);
        struct num sum = num_unpack(motion_num_add(num_pack(a), num_pack(b)));
        struct num product =
            num_unpack(motion_num_mul(num_pack(a), num_pack(b)));
        long double size = fmaxl(fabsl(x), fabsl(y));
        assert_near(num_scale(sum, sum.m ? -near : 0), x + y, size, 28);
        assert_near(num_scale(product, product.m ? -2 * near : 0), x * y, x * y,
                    28);
        assert_int_equal(motion_num_lt(num_pack(a), num_pack(b)), x < y);
    }
}

static void words_become_numbers(void **state)
{
    (void)state;
    seed_from("make");
    for (int i = 0; i < ROUNDS; i++) {
        int64_t m = (int64_t)draw() >> (draw() & 63);
        struct num a = num_unpack(motion_num_make(m, -7));
        assert_near(a, ldexpl((long double)m, -7), ldexpl((long double)m, -7),
                    28);
    }
}

static void inverses_and_roots_are_near(void **state)
{
    (void)state;
    seed_from("inv");
    for (int i = 0; i < ROUNDS; i++) {
        struct num a = any(0);
        if (a.m == 0)
            continue;
        long double x = value(a);
        assert_near(num_inv(a), 1 / x, 1 / x, 28);
        a = num_abs(a);
        x = value(a);
        assert_near(num_rsqrt(a), 1 / sqrtl(x), 1 / sqrtl(x), 28);
        assert_near(num_sqrt(a), sqrtl(x), sqrtl(x), 27);
        long double root = value(motion_num_cbrt_above(a)) / cbrtl(x);
        assert_true(root > 1 - 1e-8L && root < 1.015L);
    }
}

#if UINTPTR_MAX > UINT32_MAX
static void both_widths_give_the_same_bits(void **state)
{
    (void)state;
    seed_from("widths");
    for (int i = 0; i < ROUNDS; i++) {
        struct num a = any(0), b = any(0);
        uint64_t x = num_pack(a), y = num_pack(b);
        int64_t m = (int64_t)draw() >> (draw() & 63);
        assert_int_equal(num_pack(num_wide_add(a, b)), motion_num_add(x, y));
        assert_int_equal(num_pack(num_wide_mul(a, b)), motion_num_mul(x, y));
        assert_int_equal(num_wide_lt(a, b), motion_num_lt(x, y));
        assert_int_equal(num_pack(num_wide_make(m, 3)), motion_num_make(m, 3));
        assert_int_equal(num_pack(num_wide_make(0, 3)), motion_num_make(0, 3));
    }
}
#endif

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sums_products_and_order_are_right),
        cmocka_unit_test(words_become_numbers),
        cmocka_unit_test(inverses_and_roots_are_near),
#if UINTPTR_MAX > UINT32_MAX
        cmocka_unit_test(both_widths_give_the_same_bits),
#endif
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
