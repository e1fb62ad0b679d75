/* motion/real.c - see real.h. */
#include "motion/real.h"

#include <stdbool.h>
#include <stddef.h>

#include "motion/err.h"

struct motion_real motion_real_from_u128(struct motion_u128 wide,
                                         int32_t exponent)
{
    const bool one_word = wide.hi == 0;
    unsigned up;

    if (one_word)
        wide = (struct motion_u128){ wide.lo, 0 };
    if (wide.hi == 0)
        return (struct motion_real){ 0, 0 };
    up = motion_fixed_clz_u64(wide.hi);
    wide = motion_fixed_shl_u128(wide, up);
    exponent += (one_word ? 0 : 64) - (int32_t)up;
    if (wide.lo >> 63 == 0)
        return (struct motion_real){ wide.hi, exponent };
    if (wide.hi == UINT64_MAX)
        return (struct motion_real){ (uint64_t)1 << 63, exponent + 1 };
    return (struct motion_real){ wide.hi + 1, exponent };
}

struct motion_real motion_real_from_u64(uint64_t word, int32_t exponent)
{
    return motion_real_from_u128((struct motion_u128){ 0, word }, exponent);
}

int motion_real_cmp(struct motion_real a, struct motion_real b)
{
    if (a.mantissa == 0 || b.mantissa == 0)
        return (a.mantissa != 0) - (b.mantissa != 0);
    if (a.exponent != b.exponent)
        return a.exponent < b.exponent ? -1 : 1;
    return (a.mantissa > b.mantissa) - (a.mantissa < b.mantissa);
}

/* a's mantissa in units of 2^(exponent - 63): one bit is free for a carry, 63
 * below catch what is shifted out.  Needs exponent >= a.exponent. */
static struct motion_u128 real_align(struct motion_real a, int32_t exponent)
{
    const struct motion_u128 wide = { a.mantissa, 0 };
    const int32_t down = exponent - a.exponent + 1;

    if (a.mantissa == 0 || down > 127)
        return (struct motion_u128){ 0, 0 };
    return motion_fixed_shr_u128(wide, (unsigned)down);
}

struct motion_real motion_real_add(struct motion_real a, struct motion_real b)
{
    const int32_t exponent =
        motion_real_cmp(a, b) < 0 ? b.exponent : a.exponent;

    return motion_real_from_u128(
        motion_fixed_add_u128(real_align(a, exponent), real_align(b, exponent)),
        exponent - 63);
}

struct motion_real motion_real_sub(struct motion_real a, struct motion_real b)
{
    if (motion_real_cmp(a, b) <= 0)
        return (struct motion_real){ 0, 0 };
    return motion_real_from_u128(
        motion_fixed_sub_u128(real_align(a, a.exponent),
                              real_align(b, a.exponent)),
        a.exponent - 63);
}

struct motion_real motion_real_mul(struct motion_real a, struct motion_real b)
{
    return motion_real_from_u128(motion_fixed_mul_u64(a.mantissa, b.mantissa),
                                 a.exponent + b.exponent);
}

/* a * 2^63 / b: the upper word, a/2, is below 2^63 <= b, so the quotient fits.
 * It has 63 or 64 bits; the rest gives 64 more. */
struct motion_real motion_real_div(struct motion_real a, struct motion_real b)
{
    const struct motion_u128 n = { a.mantissa >> 1, a.mantissa << 63 };
    struct motion_u128 quotient = { 0, 0 };
    uint64_t rest = 0;

    (void)motion_fixed_div_u128(n, b.mantissa, &quotient.hi, &rest);
    (void)motion_fixed_div_u128((struct motion_u128){ rest, 0 }, b.mantissa,
                                &quotient.lo, NULL);
    return motion_real_from_u128(quotient, a.exponent - b.exponent - 63 - 64);
}

/* The mantissa, widened to 127 or 128 bits so that the exponent is even, has a
 * root of 64 bits. */
struct motion_real motion_real_sqrt(struct motion_real a)
{
    struct motion_u128 wide = { a.mantissa, 0 };
    int32_t exponent = a.exponent - 64;

    if (exponent & 1) {
        wide = motion_fixed_shr_u128(wide, 1);
        exponent++;
    }
    return motion_real_from_u64(motion_fixed_isqrt_u128(wide), exponent / 2);
}

/* floor of the cube root, bit by bit; 2642245^3 is the last cube in 64 bits. */
static uint64_t real_icbrt(uint64_t n)
{
    uint64_t root = 0;

    for (int bit = 21; bit >= 0; bit--) {
        const uint64_t next = root | (uint64_t)1 << bit;
        if (next <= 2642245 && next * next * next <= n)
            root = next;
    }
    return root;
}

/* A 21-bit guess, relative error 2^-20; a Newton step x <- (2x + a/x^2) / 3
 * squares the error, so 2^-40, 2^-80. */
struct motion_real motion_real_cbrt(struct motion_real a)
{
    const struct motion_real three = motion_real_from_u64(3, 0);
    struct motion_real x;
    unsigned down = 0;

    if (a.mantissa == 0)
        return a;
    while ((a.exponent + (int32_t)down) % 3 != 0)
        down++;
    x = motion_real_from_u64(real_icbrt(a.mantissa >> down),
                             (a.exponent + (int32_t)down) / 3);
    for (int i = 0; i < 3; i++) {
        struct motion_real twice = { x.mantissa, x.exponent + 1 };
        x = motion_real_div(
            motion_real_add(twice, motion_real_div(a, motion_real_mul(x, x))),
            three);
    }
    return x;
}

/* a * 2^bits as whole part and Q0.64 fraction. */
static int real_split(struct motion_real a, int32_t bits,
                      struct motion_u128 *split)
{
    const int32_t up = a.exponent + bits;

    if (a.mantissa == 0 || up < -127) {
        *split = (struct motion_u128){ 0, a.mantissa != 0 };
        return MOTION_OK;
    }
    if (up >= 0)
        return MOTION_E_RANGE;
    *split = motion_fixed_shr_u128((struct motion_u128){ a.mantissa, 0 },
                                   (unsigned)-up);
    return MOTION_OK;
}

static int real_whole(uint64_t whole, int64_t *result)
{
    if (whole > INT64_MAX)
        return MOTION_E_RANGE;
    *result = (int64_t)whole;
    return MOTION_OK;
}

int motion_real_round(struct motion_real a, int32_t bits, int64_t *result)
{
    struct motion_u128 split;

    if (real_split(a, bits, &split))
        return MOTION_E_RANGE;
    return real_whole(split.hi + (split.lo >> 63), result);
}

int motion_real_ceil(struct motion_real a, int32_t bits, int64_t *result)
{
    struct motion_u128 split;

    if (real_split(a, bits, &split))
        return MOTION_E_RANGE;
    return real_whole(split.hi + (split.lo != 0), result);
}
