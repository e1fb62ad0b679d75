/* motion/number/wide.h - 128 and 192 bits, for the exact half of the planner.
 *
 * Two's complement; 128 bits are those of fixed.h, and so is what both are made
 * of.  A plan's cost is mostly these.  Plan-time, no division. */
#ifndef MOTION_NUMBER_WIDE_H
#define MOTION_NUMBER_WIDE_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/fixed.h"

/* Also when optimising for size: where a plan spends its time. */
#define WIDE_INLINE static inline __attribute__((always_inline))

/* 192 bits. */
struct wider {
    uint64_t hi, mid, lo;
};

WIDE_INLINE struct motion_u128 wide_from(int64_t a)
{
    return (struct motion_u128){ (uint64_t)(a >> 63), (uint64_t)a };
}

WIDE_INLINE struct motion_u128 wide_add(struct motion_u128 a,
                                        struct motion_u128 b)
{
    return FIXED_BY(add)(a, b);
}

WIDE_INLINE struct motion_u128 wide_sub(struct motion_u128 a,
                                        struct motion_u128 b)
{
    return FIXED_BY(sub)(a, b);
}

WIDE_INLINE struct motion_u128 wide_neg(struct motion_u128 a)
{
    return motion_fixed_neg_i128(a);
}

WIDE_INLINE bool wide_is_negative(struct motion_u128 a)
{
    return (int64_t)a.hi < 0;
}

static inline struct motion_u128 wide_abs(struct motion_u128 a)
{
    return motion_fixed_abs_i128(a);
}

WIDE_INLINE bool wide_is_less(struct motion_u128 a, struct motion_u128 b)
{
    return FIXED_BY(is_less_i128)(a, b);
}

/* a b, both without a sign. */
WIDE_INLINE struct motion_u128 wide_mul_inline(uint64_t a, uint64_t b)
{
    return FIXED_BY(mul)(a, b);
}

/* a n, n >= 0. */
WIDE_INLINE struct motion_u128 wide_mul_i64_inline(int64_t a, int64_t n)
{
    struct motion_u128 p = FIXED_BY(mul)((uint64_t)a, (uint64_t)n);
    p.hi -= (uint64_t)(a >> 63) & (uint64_t)n;
    return p;
}

#if FIXED_IS_SHORT
#define wide_mul_u64(a, b) wide_mul_inline(a, b)
#define wide_mul_i64(a, n) wide_mul_i64_inline(a, n)
#else
struct motion_u128 wide_mul_u64(uint64_t a, uint64_t b);
struct motion_u128 wide_mul_i64(int64_t a, int64_t n);
#endif

WIDE_INLINE struct wider wider_from(struct motion_u128 a)
{
    return (struct wider){ (uint64_t)((int64_t)a.hi >> 63), a.hi, a.lo };
}

/* The lower two words. */
WIDE_INLINE struct motion_u128 wider_low(struct wider a)
{
    return (struct motion_u128){ a.mid, a.lo };
}

WIDE_INLINE struct wider wider_add(struct wider a, struct wider b)
{
    struct motion_u128 low = wide_add(wider_low(a), wider_low(b));
    uint64_t carry = FIXED_BY(is_less)(low, wider_low(b));
    return (struct wider){ a.hi + b.hi + carry, low.hi, low.lo };
}

WIDE_INLINE struct wider wider_sub(struct wider a, struct wider b)
{
    struct motion_u128 low = wide_sub(wider_low(a), wider_low(b));
    uint64_t borrow = FIXED_BY(is_less)(wider_low(a), wider_low(b));
    return (struct wider){ a.hi - b.hi - borrow, low.hi, low.lo };
}

static inline struct wider wider_neg(struct wider a)
{
    uint64_t minus = a.lo != 0 ? UINT64_MAX : 0; /* the borrow */
    struct motion_u128 high = wide_sub((struct motion_u128){ minus, minus },
                                       (struct motion_u128){ a.hi, a.mid });
    return (struct wider){ high.hi, high.lo, 0 - a.lo };
}

WIDE_INLINE bool wider_is_negative(struct wider a)
{
    return (int64_t)a.hi < 0;
}

static inline struct wider wider_abs(struct wider a)
{
    return wider_is_negative(a) ? wider_neg(a) : a;
}

static inline bool wider_is_less(struct wider a, struct wider b)
{
    if (a.hi != b.hi)
        return (int64_t)a.hi < (int64_t)b.hi;
    return FIXED_BY(is_less)(wider_low(a), wider_low(b));
}

/* a n, n >= 0; the product fits when |a| n < 2^191. */
WIDE_INLINE struct wider wider_mul_inline(struct motion_u128 a, int64_t n)
{
    struct motion_u128 low = FIXED_BY(mul)(a.lo, (uint64_t)n);
    struct motion_u128 high = FIXED_BY(mul_add)(a.hi, (uint64_t)n, low.hi, 0);
    high.hi -= (uint64_t)((int64_t)a.hi >> 63) & (uint64_t)n;
    return (struct wider){ high.hi, high.lo, low.lo };
}
struct wider wider_mul(struct motion_u128 a, int64_t n);

/* sum + a n, n >= 0, modulo 2^128; sum + a x modulo 2^192. */
void wide_add_mul(struct motion_u128 *sum, int64_t a, int64_t n);
void wider_add_mul(struct wider *sum, int64_t a, const struct motion_u128 *x);

/* floor(a / 2^bits), 0..127. */
struct motion_u128 wide_shr(struct motion_u128 a, unsigned bits);
/* a * 2^bits, 0..127, modulo 2^192; floor(a / 2^bits), 0..191. */
struct wider wider_shl(struct wider a, unsigned bits);
struct wider wider_shr(struct wider a, unsigned bits);
/* Leading zeros of an a >= 0; 192 for zero. */
unsigned wider_clz(struct wider a);

#endif
