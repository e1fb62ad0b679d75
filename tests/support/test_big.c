/* tests/support/test_big.c - the numbers that judge plans, judged
 * themselves. */
#include "tests/support/big.h"
#include "tests/support/check.h"

__extension__ typedef __int128 wide;

static wide wide_of(const struct big *a)
{
    unsigned __int128 sum = 0;
    for (int i = a->count - 1; i >= 0; i--)
        sum = sum << 64 | a->limb[i];
    return a->sign < 0 ? -(wide)sum : (wide)sum;
}

static int64_t draw_signed(void)
{
    return (int64_t)draw() >> (draw() % 64);
}

static void sums_and_products_match_128_bits(void **state)
{
    (void)state;
    seed_from("big");
    for (int i = 0; i < 100000; i++) {
        const int64_t x = draw_signed(), y = draw_signed();
        const unsigned up = (unsigned)(draw() % 60);
        struct big a, b, c;
        big_set(&a, x);
        big_set(&b, y);
        big_add(&c, &a, &b);
        assert_true(wide_of(&c) == (wide)x + y);
        big_sub(&c, &a, &b);
        assert_true(wide_of(&c) == (wide)x - y);
        big_mul(&c, &a, &b);
        assert_true(wide_of(&c) == (wide)x * y);
        assert_int_equal(big_cmp(&a, &b), (x > y) - (x < y));
        big_shl(&c, &a, up);
        assert_true(wide_of(&c) == (wide)x * ((wide)1 << up));
        big_set_wide(&c, (uint64_t)((wide)x * y >> 64),
                     (uint64_t)x * (uint64_t)y);
        big_mul_int(&b, &a, y);
        assert_int_equal(big_cmp(&b, &c), 0);
    }
}

/* (a + b)(a - b) = a^2 - b^2 with numbers of thousands of bits. */
static void long_products_agree_with_each_other(void **state)
{
    (void)state;
    seed_from("long");
    for (int i = 0; i < 200; i++) {
        struct big a, b, sum, difference, square;
        big_set(&a, 1);
        big_set(&b, -1);
        for (uint64_t k = draw() % 40; k > 0; k--) {
            big_mul_int(&a, &a, (int64_t)draw() | 1);
            big_mul_int(&b, &b, (int64_t)draw() | 1);
            big_shl(&b, &b, (unsigned)(draw() % 70));
        }
        big_add(&sum, &a, &b);
        big_sub(&difference, &a, &b);
        big_mul(&sum, &sum, &difference);
        big_mul(&square, &a, &a);
        big_mul(&b, &b, &b);
        big_sub(&square, &square, &b);
        assert_int_equal(big_cmp(&sum, &square), 0);
    }
}

/* f = (q x - p)^2 g + c with g > 0 on the interval. */
static void touching(struct big_poly *f, int64_t p, int64_t q, int64_t c)
{
    const int64_t g[3] = { 3, -2, 5 }; /* 3 - 2 x + 5 x^2 > 0 */
    const int64_t square[3] = { p * p, -2 * p * q, q * q };
    f->degree = 4;
    for (int k = 0; k <= 4; k++)
        big_set(&f->c[k], k == 0 ? c : 0);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) {
            struct big term;
            big_set(&term, square[i]);
            big_mul_int(&term, &term, g[k]);
            big_add(&f->c[i + k], &f->c[i + k], &term);
        }
}

static void a_touch_is_told_from_a_crossing(void **state)
{
    struct big_poly f;
    const long before = big_poly_counted;
    (void)state;
    seed_from("touch");
    for (int i = 0; i < 300; i++) {
        const int64_t q = (int64_t)(draw() % 1000000000) + 3;
        const int64_t p = (int64_t)(draw() % (uint64_t)(q - 1)) + 1;
        touching(&f, p, q, 0);
        assert_true(big_poly_is_not_negative(&f));
        touching(&f, p, q, 1);
        assert_true(big_poly_is_not_negative(&f));
        touching(&f, p, q, -1);
        assert_false(big_poly_is_not_negative(&f));
    }
    assert_true(big_poly_counted > before);
}

/* Three equal roots: the sign changes although f' has a double root there. */
static void a_flat_crossing_is_a_crossing(void **state)
{
    struct big_poly f = { .degree = 3 };
    (void)state;
    const int64_t c[2][4] = { { 1, -9, 27, -27 },   /* (1 - 3 x)^3 */
                              { -1, 9, -27, 27 } }; /* its negative */
    for (int i = 0; i < 2; i++) {
        for (int k = 0; k < 4; k++)
            big_set(&f.c[k], c[i][k]);
        assert_false(big_poly_is_not_negative(&f));
    }
}

static void borders_count(void **state)
{
    static const struct {
        int64_t c[3];
        bool want;
    } rows[] = {
        { { 0, 1, 0 }, true },  { { 0, -1, 0 }, false },
        { { 1, -1, 0 }, true }, { { 0, 0, 0 }, true },
        { { 0, 1, -1 }, true }, { { 0, 1, -2 }, false },
        { { 1, -2, 1 }, true }, { { -1, 3, 0 }, false },
        { { 5, 0, 0 }, true },  { { -5, 0, 0 }, false },
        { { 1, -4, 4 }, true }, { { 2, -9, 9 }, false },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct big_poly f = { .degree = 2 };
        for (int k = 0; k < 3; k++)
            big_set(&f.c[k], rows[i].c[k]);
        if (big_poly_is_not_negative(&f) != rows[i].want)
            fail_msg("row %zu", i);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sums_and_products_match_128_bits),
        cmocka_unit_test(long_products_agree_with_each_other),
        cmocka_unit_test(a_touch_is_told_from_a_crossing),
        cmocka_unit_test(a_flat_crossing_is_a_crossing),
        cmocka_unit_test(borders_count),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
