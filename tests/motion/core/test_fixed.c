/* tests/motion/core/test_fixed.c - wide integers, judged by the compiler's own
 * __int128 and by libm in long double; error sentences. */
#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "tests/support/check.h"

__extension__ typedef unsigned __int128 u128;
__extension__ typedef __int128 i128;

#define SEED   UINT64_C(20240607)
#define ROUNDS 20000

/* Where carries, signs and shifts go wrong. */
static const uint64_t edge[] = {
    0,
    1,
    2,
    3,
    (UINT64_C(1) << 31) - 1,
    UINT64_C(1) << 31,
    UINT32_MAX,
    UINT64_C(1) << 32,
    (UINT64_C(1) << 32) + 1,
    (UINT64_C(1) << 62) - 1,
    UINT64_C(1) << 62,
    INT64_MAX,
    UINT64_C(1) << 63,
    (UINT64_C(1) << 63) + 1,
    UINT64_MAX - 1,
    UINT64_MAX,
};

/* The edges against each other first, then numbers of every length. */
struct source {
    uint64_t seed;
    size_t round;
};

static uint64_t any(struct source *from)
{
    uint64_t r = check_random(&from->seed);
    return r >> (check_random(&from->seed) & 63);
}

static bool next_pair(struct source *from, uint64_t *a, uint64_t *b)
{
    const size_t edges = ARRAY_LEN(edge) * ARRAY_LEN(edge);

    if (from->round < edges) {
        *a = edge[from->round / ARRAY_LEN(edge)];
        *b = edge[from->round % ARRAY_LEN(edge)];
    } else {
        *a = any(from);
        *b = any(from);
        if (check_random(&from->seed) & 1)
            *a = 0 - *a;
        if (check_random(&from->seed) & 1)
            *b = 0 - *b;
    }
    return from->round++ < edges + ROUNDS;
}

static u128 join(struct motion_u128 a)
{
    return (u128)a.hi << 64 | a.lo;
}

static struct motion_u128 split(u128 a)
{
    return (struct motion_u128){ (uint64_t)(a >> 64), (uint64_t)a };
}

static void assert_same(struct motion_u128 got, u128 want, const char *what,
                        uint64_t a, uint64_t b)
{
    if (join(got) != want)
        fail_msg("%s of %" PRIx64 ", %" PRIx64 ": got %" PRIx64 "%016" PRIx64,
                 what, a, b, got.hi, got.lo);
}

static void a_product_has_all_its_bits(void **state)
{
    struct source from = { SEED, 0 };
    uint64_t a, b;
    (void)state;
    while (next_pair(&from, &a, &b)) {
        assert_same(motion_fixed_mul_u64(a, b), (u128)a * b, "mul", a, b);
        assert_int_equal(motion_fixed_mulhi_u64(a, b),
                         (uint64_t)((u128)a * b >> 64));
    }
}

static void sums_differences_and_order_carry(void **state)
{
    struct source from = { SEED, 0 };
    uint64_t a, b;
    (void)state;
    while (next_pair(&from, &a, &b)) {
        u128 x = (u128)a << 64 | b, y = (u128)b << 64 | a;
        assert_same(motion_fixed_add_u128(split(x), split(y)), x + y, "add", a,
                    b);
        assert_same(motion_fixed_sub_u128(split(x), split(y)), x - y, "sub", a,
                    b);
        assert_int_equal(motion_fixed_cmp_u128(split(x), split(y)),
                         (x > y) - (x < y));
        assert_int_equal(motion_fixed_cmp_u128(split(x), split(x)), 0);
        y = x + 1;
        if (y != 0)
            assert_int_equal(motion_fixed_cmp_u128(split(x), split(y)), -1);
    }
}

/* What every machine can do, beside what this one does. */
static void halves_are_as_good_as_the_machine(void **state)
{
    struct source from = { SEED, 0 };
    uint64_t a, b;
    (void)state;
    while (next_pair(&from, &a, &b)) {
        uint64_t c = any(&from), d = from.round % 3 ? any(&from) : ~c;
        u128 x = (u128)a << 64 | c, y = (u128)b << 64 | d;
        struct motion_u128 p = split(x), q = split(y);
        assert_same(fixed_halves_mul(a, b), (u128)a * b, "mul", a, b);
        assert_same(fixed_halves_mul_add(a, b, c, d), (u128)a * b + c + d,
                    "mul_add", a, b);
        assert_same(FIXED_BY(mul_add)(a, b, c, d), (u128)a * b + c + d,
                    "the machine's mul_add", a, b);
        assert_same(fixed_halves_add(p, q), x + y, "add", a, b);
        assert_same(fixed_halves_sub(p, q), x - y, "sub", a, b);
        assert_int_equal(fixed_halves_is_less(p, q), x < y);
        assert_int_equal(fixed_halves_is_less_i128(p, q), (i128)x < (i128)y);
        assert_int_equal(FIXED_BY(is_less_i128)(p, q), (i128)x < (i128)y);
        assert_int_equal(fixed_halves_is_less(p, p), false);
        assert_int_equal(FIXED_BY(is_less_i128)(p, p), false);
    }
}

static void shifts_reach_every_distance(void **state)
{
    struct source from = { SEED, 0 };
    (void)state;
    for (unsigned bits = 0; bits < 128; bits++) {
        u128 x = (u128)any(&from) << 64 | any(&from) | (u128)1 << 127 | 1;
        assert_same(motion_fixed_shl_u128(split(x), bits), x << bits, "shl",
                    bits, 0);
        assert_same(motion_fixed_shr_u128(split(x), bits), x >> bits, "shr",
                    bits, 0);
    }
}

static void division_leaves_the_rest_below_the_divisor(void **state)
{
    struct source from = { SEED, 0 };
    uint64_t a, b;
    (void)state;
    while (next_pair(&from, &a, &b)) {
        uint64_t d = any(&from) | 1, q = 7, r = 8;
        u128 n = (u128)(a % d) << 64 | b;
        assert_int_equal(motion_fixed_div_u128(split(n), d, &q, &r), 0);
        assert_int_equal(q, (uint64_t)(n / d));
        assert_int_equal(r, (uint64_t)(n % d));
        assert_int_equal(motion_fixed_div_u128(split(n), d, &q, NULL), 0);
        q = 7;
        r = 8;
        n = (u128)d << 64 | b;
        assert_int_equal(motion_fixed_div_u128(split(n), d, &q, &r),
                         MOTION_E_RANGE);
        assert_true(q == 7 && r == 8);
        assert_int_equal(motion_fixed_div_u128(split(b), 0, &q, &r),
                         MOTION_E_RANGE);
    }
}

/* n / d to nearest, ties away from zero, where it fits an int64 */
static int nearest(i128 n, i128 d, int64_t *result)
{
    u128 un = n < 0 ? 0 - (u128)n : (u128)n, ud = d < 0 ? 0 - (u128)d : (u128)d;
    if (d == 0)
        return MOTION_E_RANGE;
    u128 q = un / ud, r = un % ud;
    if (r >= ud - r)
        q++;
    bool negative = (n < 0) != (d < 0);
    if (q > (u128)INT64_MAX + (negative ? 1 : 0))
        return MOTION_E_RANGE;
    *result = (int64_t)(negative ? 0 - (uint64_t)q : (uint64_t)q);
    return MOTION_OK;
}

static void muldiv_rounds_to_nearest_or_refuses(void **state)
{
    struct source from = { SEED, 0 };
    uint64_t ua, ub;
    (void)state;
    while (next_pair(&from, &ua, &ub)) {
        int64_t a = (int64_t)ua, b = (int64_t)ub;
        int64_t c = from.round % 3 ? (int64_t)any(&from)
                                   : (int64_t)edge[from.round % 16];
        int64_t got = 42, want = 42;
        int want_err = nearest((i128)a * b, c, &want);
        if (motion_fixed_muldiv(a, b, c, &got) != want_err || got != want)
            fail_msg("%" PRId64 " * %" PRId64 " / %" PRId64 ": got %" PRId64
                     ", want %" PRId64 " (seed %" PRIu64 ")",
                     a, b, c, got, want, SEED);
        if (want_err < 0)
            want = (a < 0) != ((b < 0) != (c < 0)) ? INT64_MIN : INT64_MAX;
        assert_int_equal(motion_fixed_muldiv_sat(a, b, c), want);
    }
}

static void mulshift_rounds_to_nearest_or_refuses(void **state)
{
    struct source from = { SEED, 0 };
    uint64_t ua, ub;
    (void)state;
    while (next_pair(&from, &ua, &ub)) {
        int64_t a = (int64_t)ua, b = (int64_t)ub, got = 42, want = 42;
        unsigned bits = (unsigned)(from.round % 127); /* 2^127 is no i128 */
        int want_err = nearest((i128)a * b, (i128)1 << bits, &want);
        if (motion_fixed_mulshift(a, b, bits, &got) != want_err || got != want)
            fail_msg("(%" PRId64 " * %" PRId64 ") >> %u: got %" PRId64, a, b,
                     bits, got);
    }
    int64_t got = 42;
    assert_int_equal(motion_fixed_mulshift(INT64_MIN, INT64_MIN, 127, &got), 0);
    assert_int_equal(got, 1); /* 2^126 / 2^127 = 1/2, away from zero */
    assert_int_equal(motion_fixed_mulshift(1, 1, 128, &got), MOTION_E_ARG);
}

static void ties_go_away_from_zero(void **state)
{
    static const struct {
        int64_t a, b, c, want;
    } rows[] = {
        { 1, 1, 2, 1 },   { -1, 1, 2, -1 }, { 1, 1, -2, -1 },
        { -1, 1, -2, 1 }, { 1, 5, 3, 2 },   { 1, 4, 3, 1 },
        { -1, 4, 3, -1 }, { 7, 0, 3, 0 },   { INT64_MIN, 1, 1, INT64_MIN },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        int64_t got = 42;
        assert_int_equal(
            motion_fixed_muldiv(rows[i].a, rows[i].b, rows[i].c, &got), 0);
        assert_int_equal(got, rows[i].want);
    }
    int64_t got = 42;
    assert_int_equal(motion_fixed_muldiv(INT64_MIN, 1, -1, &got),
                     MOTION_E_RANGE);
    assert_int_equal(got, 42);
}

static void sums_are_checked(void **state)
{
    struct source from = { SEED, 0 };
    uint64_t ua, ub;
    (void)state;
    while (next_pair(&from, &ua, &ub)) {
        int64_t a = (int64_t)ua, b = (int64_t)ub, got = 42, want = 42;
        int err = __builtin_add_overflow(a, b, &want) ? MOTION_E_RANGE : 0;
        assert_int_equal(motion_fixed_add(a, b, &got), err);
        assert_int_equal(got, err ? 42 : want);
        got = want = 42;
        err = __builtin_sub_overflow(a, b, &want) ? MOTION_E_RANGE : 0;
        assert_int_equal(motion_fixed_sub(a, b, &got), err);
        assert_int_equal(got, err ? 42 : want);
    }
}

static void signed_128_bits_agree_with_the_compiler(void **state)
{
    struct source from = { SEED, 0 };
    uint64_t a, b;
    (void)state;
    while (next_pair(&from, &a, &b)) {
        i128 x = (i128)((u128)a << 64 | b);
        int32_t k = (int32_t)(uint32_t)any(&from);
        unsigned bits = (unsigned)(from.round % 130);
        assert_same(motion_fixed_from_i64((int64_t)a), (u128)(i128)(int64_t)a,
                    "from", a, b);
        assert_same(motion_fixed_neg_i128(split((u128)x)), 0 - (u128)x, "neg",
                    a, b);
        assert_same(motion_fixed_mul_i128(split((u128)x), k),
                    (u128)x * (u128)(i128)k, "mul", a, b);
        assert_int_equal(motion_fixed_is_neg_i128(split((u128)x)), x < 0);
        int64_t got = 42, want = (int64_t)x;
        int err = motion_fixed_to_i64(split((u128)x), &got);
        assert_int_equal(err, (i128)want == x ? 0 : MOTION_E_RANGE);
        assert_int_equal(got, err < 0 ? 42 : want);

        u128 m = x < 0 ? 0 - (u128)x : (u128)x, half;
        assert_same(motion_fixed_abs_i128(split((u128)x)), m, "abs", a, b);
        half = bits >= 1 && bits <= 127 ? (u128)1 << (bits - 1) : 0;
        m = bits > 127 ? 0 : (m + half) >> bits;
        assert_same(motion_fixed_round_i128(split((u128)x), bits),
                    x < 0 ? 0 - m : m, "round", a, b);
    }
}

static void square_roots_are_the_floor(void **state)
{
    struct source from = { SEED, 0 };
    uint64_t a, b;
    (void)state;
    while (next_pair(&from, &a, &b)) {
        u128 n = (u128)a << 64 | b;
        u128 r = motion_fixed_isqrt_u128(split(n));
        assert_true(r * r <= n);
        assert_true(r == UINT64_MAX || (r + 1) * (r + 1) > n);
        uint64_t s = motion_fixed_isqrt_u64(a);
        assert_true(s * s <= a);
        assert_true(s == UINT32_MAX || (s + 1) * (s + 1) > a);
        n = (u128)a * a; /* and exact on squares */
        assert_int_equal(motion_fixed_isqrt_u128(split(n)), a);
        if (a > 0) /* and one below them */
            assert_int_equal(motion_fixed_isqrt_u128(split(n - 1)), a - 1);
    }
    /* The last whose upper half is its root. */
    const u128 last = ((u128)UINT64_MAX - 1) << 64;
    assert_int_equal(motion_fixed_isqrt_u128(split(last)), UINT64_MAX - 1);
}

static void leading_zeros_and_magnitudes(void **state)
{
    (void)state;
    assert_int_equal(motion_fixed_clz_u64(0), 64);
    for (unsigned i = 0; i < 64; i++) {
        assert_int_equal(motion_fixed_clz_u64(UINT64_C(1) << i), 63 - i);
        assert_int_equal(motion_fixed_clz_u64(UINT64_MAX >> i), i);
    }
    assert_int_equal(motion_fixed_abs(INT64_MIN), UINT64_C(1) << 63);
    assert_int_equal(motion_fixed_abs(-5), 5);
    assert_int_equal(motion_fixed_abs(INT64_MAX), INT64_MAX);
}

static void sine_and_cosine_are_within_four_units(void **state)
{
    static const uint64_t turn = UINT64_C(1) << 62; /* a quarter */
    const long double half_pi = acosl(0.0L);
    uint64_t seed = SEED;
    int64_t s, c;
    (void)state;
    for (int i = 0; i < 50000; i++) {
        uint64_t phase = check_random(&seed) >> 2;
        if (i < 40) /* near the ends and the fold */
            phase = (uint64_t)(i / 10) * (turn / 4) + (uint64_t)(i % 10);
        long double x = ldexpl((long double)phase, -62) * half_pi;
        motion_fixed_sincos_q62(phase, &s, &c);
        if (fabsl(ldexpl(sinl(x), 62) - (long double)s) > 4 ||
            fabsl(ldexpl(cosl(x), 62) - (long double)c) > 4)
            fail_msg("phase %" PRIu64 ": %" PRId64 ", %" PRId64, phase, s, c);
    }
    motion_fixed_sincos_q62(0, &s, &c);
    assert_true(s == 0 && c == (int64_t)turn);
    motion_fixed_sincos_q62(turn, &s, &c);
    assert_true(s == (int64_t)turn && c == 0);
    motion_fixed_sincos_q62(UINT64_MAX, &s, &c); /* held at the quarter */
    assert_true(s == (int64_t)turn && c == 0);
}

static void every_code_has_its_sentence(void **state)
{
    (void)state;
#define CHECK(name, value, text)                                               \
    assert_int_equal(name, value);                                             \
    assert_string_equal(motion_err_text(name), text);
    MOTION_ERR_LIST(CHECK)
#undef CHECK
    assert_string_equal(motion_err_text(0), "done");
    assert_string_equal(motion_err_text(INT32_MAX), "done");
    assert_string_equal(motion_err_text(-9999), "unknown error");
    assert_string_equal(motion_err_text(INT32_MIN), "unknown error");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_product_has_all_its_bits),
        cmocka_unit_test(sums_differences_and_order_carry),
        cmocka_unit_test(halves_are_as_good_as_the_machine),
        cmocka_unit_test(shifts_reach_every_distance),
        cmocka_unit_test(division_leaves_the_rest_below_the_divisor),
        cmocka_unit_test(muldiv_rounds_to_nearest_or_refuses),
        cmocka_unit_test(mulshift_rounds_to_nearest_or_refuses),
        cmocka_unit_test(ties_go_away_from_zero),
        cmocka_unit_test(sums_are_checked),
        cmocka_unit_test(signed_128_bits_agree_with_the_compiler),
        cmocka_unit_test(square_roots_are_the_floor),
        cmocka_unit_test(leading_zeros_and_magnitudes),
        cmocka_unit_test(sine_and_cosine_are_within_four_units),
        cmocka_unit_test(every_code_has_its_sentence),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
