/* motion/number/num.h - short real numbers in integers, for searches.
 *
 * A num is m * 2^e with 2^29 <= |m| < 2^30, or zero (m = 0, e = NUM_ZERO_E).
 * Every operation is integer adds, multiplies and shifts, so the bits are the
 * same on every machine; the range (2^+-30000) has no edge a move could reach.
 * Two bits are left free, so that a sum fits its word.
 *
 * For 62 bits see real.h, at four times the price: a search ends some 2^-27
 * beside the root, and what needs more is made exact in integers afterwards.
 *
 * Relative error of one operation: add, sub (of the larger operand), mul, inv,
 * rsqrt 2^-28; div, sqrt 2^-27.  Plan-time. */
#ifndef MOTION_NUMBER_NUM_H
#define MOTION_NUMBER_NUM_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/number/real.h"

#define NUM_ZERO_E (-100000)
#define NUM_ONE    ((int32_t)1 << 29) /* smallest mantissa */
/* Also when optimising for size: a call that returns 8 bytes in a struct goes
 * through memory, the ones below do not. */
#define NUM_INLINE static inline __attribute__((always_inline))

struct num {
    int32_t m, e;
};

/* Two words in one: what a 32-bit ARM passes and returns in registers. */
uint64_t motion_num_make(int64_t m, int32_t e);
uint64_t motion_num_add(uint64_t a, uint64_t b);
uint64_t motion_num_mul(uint64_t a, uint64_t b);
uint64_t motion_num_inv(uint64_t a);
uint64_t motion_num_rsqrt(uint64_t a);
uint64_t motion_num_sqrt(uint64_t a);
bool motion_num_lt(uint64_t a, uint64_t b);

NUM_INLINE uint64_t num_pack(struct num a)
{
    return (uint32_t)a.e * ((uint64_t)1 << 32) | (uint32_t)a.m;
}

NUM_INLINE struct num num_unpack(uint64_t word)
{
    return (struct num){ (int32_t)(uint32_t)word, (int32_t)(word >> 32) };
}

NUM_INLINE struct num num_zero(void)
{
    return (struct num){ 0, NUM_ZERO_E };
}

/* For 64-bit machines: the same bits as the functions of num.c, which suit 32-bit
 * ones.  Inline, because registers are there for both words, and without
 * branches but for zero, because which of two operands is larger is a coin's
 * side, and a wrong guess costs more than the sum. */
NUM_INLINE struct num num_wide_make(int64_t m, int32_t e)
{
    int64_t minus = m >> 63;
    uint64_t size = (uint64_t)(m ^ minus) - (uint64_t)minus;
    if (m == 0)
        return num_zero();
    int lead = __builtin_clzll(size);
    int64_t cut = (int64_t)(size << lead >> 34);
    return (struct num){ (int32_t)((cut ^ minus) - minus), e + 34 - lead };
}

NUM_INLINE struct num num_wide_add(struct num a, struct num b)
{
    int32_t d = a.e - b.e, below = d >> 31; /* all ones where a is smaller */
    int32_t size = (d ^ below) - below;
    size = size < 31 ? size : 31;
    int32_t m = (a.m >> (size & below)) + (b.m >> (size & ~below));
    if (m == 0)
        return num_zero();
    int32_t minus = m >> 31;
    int up = __builtin_clz((uint32_t)((m ^ minus) - minus)) - 1;
    return (struct num){ (int32_t)((uint32_t)m << up) >> 1,
                         a.e - (d & below) - up + 1 };
}

NUM_INLINE struct num num_wide_mul(struct num a, struct num b)
{
    int64_t product = (int64_t)a.m * b.m;
    if (product == 0)
        return num_zero();
    int32_t m = (int32_t)(product >> 30);
    int32_t up = (uint32_t)(m + (NUM_ONE - 1)) < 2 * (uint32_t)NUM_ONE - 1;
    return (struct num){ (int32_t)(product >> (30 - up)), a.e + b.e + 30 - up };
}

/* A whole number that is ordered as the num is. */
NUM_INLINE int64_t num_wide_order(struct num a)
{
    int64_t minus = a.m >> 31;
    int64_t e = (((int64_t)a.e + (1 << 20)) ^ minus) - minus;
    return a.m == 0 ? 0 : e * ((int64_t)1 << 30) + a.m;
}

NUM_INLINE bool num_wide_lt(struct num a, struct num b)
{
    return num_wide_order(a) < num_wide_order(b);
}

/* The four that most of the search is made of. */
#if UINTPTR_MAX > UINT32_MAX
#define NUM_MAKE(m, e) num_wide_make(m, e)
#define NUM_ADD(a, b)  num_wide_add(a, b)
#define NUM_MUL(a, b)  num_wide_mul(a, b)
#define NUM_LT(a, b)   num_wide_lt(a, b)
#else
#define NUM_MAKE(m, e) num_unpack(motion_num_make(m, e))
#define NUM_ADD(a, b)  num_unpack(motion_num_add(num_pack(a), num_pack(b)))
#define NUM_MUL(a, b)  num_unpack(motion_num_mul(num_pack(a), num_pack(b)))
#define NUM_LT(a, b)   motion_num_lt(num_pack(a), num_pack(b))
#endif

/* m * 2^e for any m. */
NUM_INLINE struct num num_make(int64_t m, int32_t e)
{
    return NUM_MAKE(m, e);
}

NUM_INLINE struct num num_int(int64_t n)
{
    return num_make(n, 0);
}

NUM_INLINE struct num num_one(void)
{
    return (struct num){ 1 << 29, -29 };
}

NUM_INLINE struct num num_neg(struct num a)
{
    return (struct num){ -a.m, a.e };
}

NUM_INLINE struct num num_abs(struct num a)
{
    return (struct num){ a.m < 0 ? -a.m : a.m, a.e };
}

/* a * 2^bits, |bits| below 1000.  The exponent of zero may wander a little. */
NUM_INLINE struct num num_scale(struct num a, int bits)
{
    return (struct num){ a.m, a.e + bits };
}

NUM_INLINE struct num num_half(struct num a)
{
    return num_scale(a, -1);
}

NUM_INLINE struct num num_twice(struct num a)
{
    return num_scale(a, 1);
}

NUM_INLINE struct num num_add(struct num a, struct num b)
{
    return NUM_ADD(a, b);
}

NUM_INLINE struct num num_sub(struct num a, struct num b)
{
    return num_add(a, num_neg(b));
}

NUM_INLINE struct num num_mul(struct num a, struct num b)
{
    return NUM_MUL(a, b);
}

NUM_INLINE struct num num_sqr(struct num a)
{
    return num_mul(a, a);
}

NUM_INLINE bool num_lt(struct num a, struct num b)
{
    return NUM_LT(a, b);
}

NUM_INLINE struct num num_max(struct num a, struct num b)
{
    return num_lt(a, b) ? b : a;
}

NUM_INLINE struct num num_min(struct num a, struct num b)
{
    return num_lt(a, b) ? a : b;
}

/* 1 / a; beyond every number of a move for a = 0. */
NUM_INLINE struct num num_inv(struct num a)
{
    return num_unpack(motion_num_inv(num_pack(a)));
}

NUM_INLINE struct num num_div(struct num a, struct num b)
{
    return num_mul(a, num_inv(b));
}

/* 1 / sqrt(a) for a > 0; sqrt(a), zero for a <= 0. */
NUM_INLINE struct num num_rsqrt(struct num a)
{
    return num_unpack(motion_num_rsqrt(num_pack(a)));
}

NUM_INLINE struct num num_sqrt(struct num a)
{
    return num_unpack(motion_num_sqrt(num_pack(a)));
}

/* A cube root of a > 0, not below it and at most 1.5 % too large. */
struct num motion_num_cbrt_above(struct num a);

static inline struct motion_real num_real(struct num a)
{
    if (a.m == 0)
        return motion_real_zero();
    return (struct motion_real){ (int64_t)a.m * ((int64_t)1 << 32), a.e - 32 };
}

#endif
