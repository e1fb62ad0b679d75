/* motion/number/real.h - numbers of any size, in integers, for planning.
 *
 * A move of 1e-6 mm and one of 1e8 mm, a jerk in unit/s3 and a time in 2^-12 ns
 * share no fixed-point format.  Plan-time formulas that mix them compute with
 * m * 2^e, 2^61 <= |m| < 2^62, or zero (m = 0, e = MOTION_REAL_ZERO_E): a
 * floating-point number whose every operation is integer adds, multiplies and
 * shifts, so every machine gets the same bits.  Two bits are left free, so that
 * a sum fits its word and a product needs one shift.  Exponents stay far inside
 * +-30000 for any product of our formats; they are not checked.
 *
 * Relative error of one operation, of the larger operand where it adds:
 *   add, sub, mul      2^-59
 *   div, sqrt, cbrt    2^-58
 *   rsqrt              2^-52; no division
 * Plan-time. */
#ifndef MOTION_NUMBER_REAL_H
#define MOTION_NUMBER_REAL_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/fixed.h"

#define MOTION_REAL_ZERO_E (-100000)

struct motion_real {
    int64_t m;
    int32_t e;
};

static inline unsigned motion_real_clz(uint64_t x)
{
    uint32_t hi = (uint32_t)(x >> 32);
    return hi ? (unsigned)__builtin_clz(hi)
              : 32 + (unsigned)__builtin_clz((uint32_t)x | 1);
}

/* m * 2^e for any m with |m| < 2^63. */
static inline struct motion_real motion_real_make(int64_t m, int32_t e)
{
    if (m == 0)
        return (struct motion_real){ 0, MOTION_REAL_ZERO_E };
    int shift = (int)motion_real_clz((uint64_t)(m < 0 ? -m : m)) - 2;
    if (shift < 0)
        return (struct motion_real){ m >> 1, e + 1 };
    return (struct motion_real){ (int64_t)((uint64_t)m << shift), e - shift };
}

/* n / 2^bits: from Q32.32 with 32. */
static inline struct motion_real motion_real_from_q(int64_t n, int bits)
{
    return n == INT64_MIN
               ? (struct motion_real){ -((int64_t)1 << 61), 2 - bits }
               : motion_real_make(n, -bits);
}

static inline struct motion_real motion_real_int(int64_t n)
{
    return motion_real_from_q(n, 0);
}

static inline struct motion_real motion_real_zero(void)
{
    return (struct motion_real){ 0, MOTION_REAL_ZERO_E };
}

/* wide * 2^e, or word * 2^e, without a sign, to nearest. */
struct motion_real motion_real_from_u128(struct motion_u128 wide, int32_t e);
struct motion_real motion_real_from_u64(uint64_t word, int32_t e);

static inline bool motion_real_is_zero(struct motion_real a)
{
    return a.m == 0;
}

/* -1, 0, 1 */
static inline int motion_real_sign(struct motion_real a)
{
    return (a.m > 0) - (a.m < 0);
}

static inline struct motion_real motion_real_neg(struct motion_real a)
{
    return (struct motion_real){ -a.m, a.e };
}

static inline struct motion_real motion_real_abs(struct motion_real a)
{
    return (struct motion_real){ a.m < 0 ? -a.m : a.m, a.e };
}

/* a * 2^bits. */
static inline struct motion_real motion_real_scale(struct motion_real a,
                                                   int bits)
{
    return (struct motion_real){ a.m, a.m ? a.e + bits : MOTION_REAL_ZERO_E };
}

static inline struct motion_real motion_real_half(struct motion_real a)
{
    return motion_real_scale(a, -1);
}

static inline struct motion_real motion_real_twice(struct motion_real a)
{
    return motion_real_scale(a, 1);
}

static inline struct motion_real motion_real_add(struct motion_real a,
                                                 struct motion_real b)
{
    int d = a.e - b.e;
    if (d < 0) {
        struct motion_real t = a;
        a = b;
        b = t;
        d = -d;
    }
    if (d > 62)
        return a;
    return motion_real_make(a.m + (b.m >> d), a.e);
}

static inline struct motion_real motion_real_sub(struct motion_real a,
                                                 struct motion_real b)
{
    return motion_real_add(a, motion_real_neg(b));
}

/* The upper 64 bits of a * b, rounded down.  All of them: with the product of
 * the lower halves left out, a product of two negative numbers can end below
 * 2^60 and would not be normalised. */
static inline int64_t motion_real_mulhi(int64_t a, int64_t b)
{
#ifdef MOTION_CORE_FIXED_INT128_H /* one instruction there */
    return FIXED_BY(mulhi)(a, b);
#else
    const int32_t ah = (int32_t)(a >> 32), bh = (int32_t)(b >> 32);
    const uint32_t al = (uint32_t)a, bl = (uint32_t)b;
    const int64_t t = (int64_t)ah * bl + (int64_t)(((uint64_t)al * bl) >> 32);
    const int64_t u = (int64_t)bh * al + (uint32_t)t;
    return (int64_t)ah * bh + (t >> 32) + (u >> 32);
#endif
}

/* With one more bit each the product's upper half is in 2^60 .. 2^62, so one
 * shift normalises it. */
static inline struct motion_real motion_real_mul(struct motion_real a,
                                                 struct motion_real b)
{
    if (a.m == 0 || b.m == 0)
        return motion_real_zero();
    int64_t m = motion_real_mulhi(a.m * 2, b.m * 2);
    int32_t e = a.e + b.e + 62;
    if (m < (int64_t)1 << 61 && m > -((int64_t)1 << 61))
        return (struct motion_real){ m * 2, e - 1 };
    return (struct motion_real){ m, e };
}

static inline struct motion_real motion_real_sqr(struct motion_real a)
{
    return motion_real_mul(a, a);
}

/* -1, 0, 1 as a is below, equal to, above b. */
static inline int motion_real_cmp(struct motion_real a, struct motion_real b)
{
    int sa = motion_real_sign(a), sb = motion_real_sign(b);
    if (sa != sb)
        return sa < sb ? -1 : 1;
    if (a.e != b.e)
        return (a.e < b.e) == (sa > 0) ? -1 : 1;
    return (a.m > b.m) - (a.m < b.m);
}

static inline bool motion_real_lt(struct motion_real a, struct motion_real b)
{
    return motion_real_cmp(a, b) < 0;
}

static inline struct motion_real motion_real_max(struct motion_real a,
                                                 struct motion_real b)
{
    return motion_real_lt(a, b) ? b : a;
}

static inline struct motion_real motion_real_min(struct motion_real a,
                                                 struct motion_real b)
{
    return motion_real_lt(a, b) ? a : b;
}

/* a / b; b must not be zero. */
struct motion_real motion_real_div(struct motion_real a, struct motion_real b);
/* Zero for a <= 0. */
struct motion_real motion_real_sqrt(struct motion_real a);
struct motion_real motion_real_cbrt(struct motion_real a);

/* 1 / sqrt(a) for a > 0. */
struct motion_real motion_real_rsqrt(struct motion_real a);

/* a * 2^bits as an integer: to nearest, ties away from zero; up; down.
 * MOTION_E_RANGE from +-2^63 on, *result is of no use then. */
int motion_real_round(struct motion_real a, int32_t bits, int64_t *result);
int motion_real_ceil(struct motion_real a, int32_t bits, int64_t *result);
int motion_real_floor(struct motion_real a, int32_t bits, int64_t *result);
/* Down; saturates at +-2^62. */
int64_t motion_real_floor_clamped(struct motion_real a, int32_t bits);

#endif
