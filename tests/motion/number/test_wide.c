/* tests/motion/number/test_wide.c - 128 and 192 bits of the planner, judged by
 * whole numbers of any length (tests/support/big.h).  tests/qemu/golden_wide.c
 * does the same arithmetic on microcontrollers. */
#include <inttypes.h>

#include "motion/number/wide.h"
#include "tests/support/big.h"
#include "tests/support/check.h"

#define ROUNDS 20000

/* Of every length and sign; `spare` bits are left free at the top. */
static struct motion_u128 any_wide(unsigned spare)
{
    struct motion_u128 a = { draw(), draw() };
    if (draw() % 8 == 0)
        a.lo = draw() & 1 ? UINT64_MAX : 0;
    return wide_shr(a, spare + (unsigned)(draw() % (128 - spare)));
}

static struct wider any_wider(unsigned spare)
{
    struct wider a = { draw(), draw(), draw() };
    if (draw() % 8 == 0)
        a.mid = a.lo = draw() & 1 ? UINT64_MAX : 0;
    return wider_shr(a, spare + (unsigned)(draw() % (192 - spare)));
}

static int64_t any_word(unsigned spare)
{
    return (int64_t)draw() >> (spare + draw() % (64 - spare));
}

static void big_of(struct big *to, struct wider a)
{
    struct big low;
    big_set_wide(to, a.hi, a.mid);
    big_shl(to, to, 64);
    big_set_wide(&low, 0, a.lo);
    big_add(to, to, &low);
}

static void assert_is(struct wider got, const struct big *want,
                      const char *what)
{
    struct big is;
    big_of(&is, got);
    if (big_cmp(&is, want) != 0)
        fail_msg("%s: %016" PRIx64 "%016" PRIx64 "%016" PRIx64, what, got.hi,
                 got.mid, got.lo);
}

static void sums_and_order_are_exact(void **state)
{
    struct big x, y, z;
    (void)state;
    seed_from(__func__);
    for (int i = 0; i < ROUNDS; i++) {
        struct wider a = any_wider(1), b = any_wider(1);
        if (i % 4 == 0) { /* next to each other */
            b = a;
            b.lo ^= draw() & 3;
        }
        big_of(&x, a);
        big_of(&y, b);
        big_add(&z, &x, &y);
        assert_is(wider_add(a, b), &z, "add");
        big_sub(&z, &x, &y);
        assert_is(wider_sub(a, b), &z, "sub");
        assert_int_equal(wider_is_less(a, b), big_cmp(&x, &y) < 0);
        assert_int_equal(wider_is_negative(a), x.sign < 0);
        big_mul_int(&z, &x, -1);
        assert_is(wider_neg(a), &z, "neg");
        assert_is(wider_abs(a), x.sign < 0 ? &z : &x, "abs");
    }
}

static void sums_of_128_bits_are_exact(void **state)
{
    struct big x, y, z;
    (void)state;
    seed_from(__func__);
    for (int i = 0; i < ROUNDS; i++) {
        struct motion_u128 a = any_wide(1), b = any_wide(1);
        if (i % 4 == 0) {
            b = a;
            b.lo ^= draw() & 3;
        }
        big_of(&x, wider_from(a));
        big_of(&y, wider_from(b));
        big_add(&z, &x, &y);
        assert_is(wider_from(wide_add(a, b)), &z, "add");
        big_sub(&z, &x, &y);
        assert_is(wider_from(wide_sub(a, b)), &z, "sub");
        assert_int_equal(wide_is_less(a, b), big_cmp(&x, &y) < 0);
        assert_int_equal(wide_is_negative(a), x.sign < 0);
        big_mul_int(&z, &x, -1);
        assert_is(wider_from(wide_neg(a)), &z, "neg");
        assert_is(wider_from(wide_abs(a)), x.sign < 0 ? &z : &x, "abs");
    }
}

static void products_are_exact(void **state)
{
    struct big x, y, z;
    (void)state;
    seed_from(__func__);
    for (int i = 0; i < ROUNDS; i++) {
        struct motion_u128 a = any_wide(0);
        int64_t k = any_word(0), n = any_word(0) & INT64_MAX;
        big_of(&x, wider_from(a));
        big_mul_int(&z, &x, n);
        assert_is(wider_mul(a, n), &z, "128 by 64");
        big_set(&x, k);
        big_mul_int(&z, &x, n);
        assert_is(wider_from(wide_mul_i64(k, n)), &z, "64 by 64");
        big_set_wide(&x, 0, (uint64_t)k);
        big_set_wide(&y, 0, a.lo);
        big_mul(&z, &x, &y);
        struct motion_u128 p = wide_mul_u64((uint64_t)k, a.lo);
        assert_is((struct wider){ 0, p.hi, p.lo }, &z, "without a sign");
    }
}

static void products_are_added_exactly(void **state)
{
    struct big x, z;
    (void)state;
    seed_from(__func__);
    for (int i = 0; i < ROUNDS; i++) {
        struct motion_u128 a = any_wide(2), to = any_wide(2);
        struct wider sum = any_wider(2);
        int64_t k = any_word(0), n = any_word(1) & INT64_MAX;
        big_of(&x, wider_from(a));
        big_mul_int(&x, &x, k);
        big_of(&z, sum);
        big_add(&z, &z, &x);
        wider_add_mul(&sum, k, &a);
        assert_is(sum, &z, "128 by 64");
        big_set(&x, k);
        big_mul_int(&x, &x, n);
        big_of(&z, wider_from(to));
        big_add(&z, &z, &x);
        wide_add_mul(&to, k, n);
        assert_is(wider_from(to), &z, "64 by 64");
    }
}

/* b 2^bits is a, or a with its lower bits cut. */
static void assert_is_floor(struct wider b, unsigned bits, struct wider a)
{
    struct big x, y, one;
    big_of(&x, a);
    big_of(&y, b);
    big_set(&one, 1);
    big_shl(&one, &one, bits);
    big_shl(&y, &y, bits);
    assert_true(big_cmp(&y, &x) <= 0);
    big_add(&y, &y, &one);
    assert_true(big_cmp(&y, &x) > 0);
}

static void shifts_reach_every_distance(void **state)
{
    struct big x;
    (void)state;
    seed_from(__func__);
    for (int i = 0; i < ROUNDS; i++) {
        unsigned bits = (unsigned)i % 128;
        struct wider a = any_wider(0), small = wider_shr(a, bits);
        struct motion_u128 b = any_wide(0);
        assert_is_floor(small, bits, a);
        assert_is_floor(wider_from(wide_shr(b, bits)), bits, wider_from(b));
        big_of(&x, small);
        big_shl(&x, &x, bits);
        assert_is(wider_shl(small, bits), &x, "shl");
        assert_is_floor(wider_shr(a, 64 + bits), 64 + bits, a);
    }
}

static void leading_zeros_are_counted(void **state)
{
    (void)state;
    struct wider a = { UINT64_MAX, UINT64_MAX, UINT64_MAX };
    assert_int_equal(wider_clz((struct wider){ 0, 0, 0 }), 192);
    for (unsigned i = 0; i < 192; i++) {
        struct wider one = { 0, 0, 0 };
        uint64_t *word = i < 64 ? &one.lo : i < 128 ? &one.mid : &one.hi;
        *word = UINT64_C(1) << (i & 63);
        assert_int_equal(wider_clz(one), 191 - i);
        one.lo |= 1;
        assert_int_equal(wider_clz(one), 191 - i);
    }
    assert_int_equal(wider_clz(a), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sums_and_order_are_exact),
        cmocka_unit_test(sums_of_128_bits_are_exact),
        cmocka_unit_test(products_are_exact),
        cmocka_unit_test(products_are_added_exactly),
        cmocka_unit_test(shifts_reach_every_distance),
        cmocka_unit_test(leading_zeros_are_counted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
