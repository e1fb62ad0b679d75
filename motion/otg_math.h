/* motion/otg_math.h - real numbers in integers, for the planner.
 *
 * A real is m * 2^e with 2^61 <= |m| < 2^62, or zero (m = 0, e = REAL_ZERO_E).
 * It is a floating-point number whose every operation is integer adds,
 * multiplies and shifts, so the bits are the same on every machine, and whose
 * range (2^+-30000) has no edge a move could reach.  It carries the *search*
 * for the optimum only.  Nothing a machine follows is a real: otg_exact.c
 * turns the answer into integers and makes these exact.
 *
 * Relative error of one operation: add, sub, mul 2^-59; div, sqrt, rsqrt
 * 2^-52.  Plan-time. */
#ifndef MOTION_OTG_MATH_H
#define MOTION_OTG_MATH_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/fixed.h"
#include "motion/otg_wide.h"

#define REAL_ZERO_E (-100000)

struct real {
    int64_t m;
    int32_t e;
};

static inline unsigned real_clz(uint64_t x)
{
    uint32_t hi = (uint32_t)(x >> 32);
    return hi ? (unsigned)__builtin_clz(hi)
              : 32 + (unsigned)__builtin_clz((uint32_t)x | 1);
}

/* m * 2^e for any m with |m| < 2^63. */
static inline struct real real_make(int64_t m, int32_t e)
{
    if (m == 0)
        return (struct real){ 0, REAL_ZERO_E };
    int shift = (int)real_clz((uint64_t)(m < 0 ? -m : m)) - 2;
    if (shift < 0)
        return (struct real){ m >> 1, e + 1 };
    return (struct real){ (int64_t)((uint64_t)m << shift), e - shift };
}

static inline struct real real_int(int64_t n)
{
    return n == INT64_MIN ? (struct real){ -((int64_t)1 << 61), 2 }
                          : real_make(n, 0);
}

static inline struct real real_zero(void)
{
    return (struct real){ 0, REAL_ZERO_E };
}

static inline struct real real_neg(struct real a)
{
    return (struct real){ -a.m, a.e };
}

static inline struct real real_abs(struct real a)
{
    return (struct real){ a.m < 0 ? -a.m : a.m, a.e };
}

/* a * 2^bits. */
static inline struct real real_scale(struct real a, int bits)
{
    return (struct real){ a.m, a.m ? a.e + bits : REAL_ZERO_E };
}

static inline struct real real_half(struct real a)
{
    return real_scale(a, -1);
}

static inline struct real real_twice(struct real a)
{
    return real_scale(a, 1);
}

static inline struct real real_add(struct real a, struct real b)
{
    int d = a.e - b.e;
    if (d < 0) {
        struct real t = a;
        a = b;
        b = t;
        d = -d;
    }
    if (d > 62)
        return a;
    return real_make(a.m + (b.m >> d), a.e);
}

static inline struct real real_sub(struct real a, struct real b)
{
    return real_add(a, real_neg(b));
}

/* The upper 64 bits of a * b, at most 2 too small: the product of the lower
 * halves is left out. */
static inline int64_t real_mulhi(int64_t a, int64_t b)
{
    int32_t ah = (int32_t)(a >> 32), bh = (int32_t)(b >> 32);
    uint32_t al = (uint32_t)a, bl = (uint32_t)b;
    return (int64_t)ah * bh + (((int64_t)ah * (int64_t)bl) >> 32) +
           (((int64_t)bh * (int64_t)al) >> 32);
}

/* 2^61 <= |a|, |b| < 2^62: with one more bit each the product's upper half is
 * in 2^60 .. 2^62, so one shift normalises it. */
static inline struct real real_mul(struct real a, struct real b)
{
    if (a.m == 0 || b.m == 0)
        return real_zero();
    int64_t m = real_mulhi(a.m * 2, b.m * 2);
    int32_t e = a.e + b.e + 62;
    if (m < (int64_t)1 << 61 && m > -((int64_t)1 << 61))
        return (struct real){ m * 2, e - 1 };
    return (struct real){ m, e };
}

static inline struct real real_sqr(struct real a)
{
    return real_mul(a, a);
}

/* -1, 0, 1 as a is below, equal to, above b. */
static inline int real_cmp(struct real a, struct real b)
{
    int sa = (a.m > 0) - (a.m < 0), sb = (b.m > 0) - (b.m < 0);
    if (sa != sb)
        return sa < sb ? -1 : 1;
    if (a.e != b.e)
        return (a.e < b.e) == (sa > 0) ? -1 : 1;
    return (a.m > b.m) - (a.m < b.m);
}

static inline bool real_lt(struct real a, struct real b)
{
    return real_cmp(a, b) < 0;
}

static inline struct real real_max(struct real a, struct real b)
{
    return real_lt(a, b) ? b : a;
}

static inline struct real real_min(struct real a, struct real b)
{
    return real_lt(a, b) ? a : b;
}

/* 1 / a; beyond every number of a move for a = 0. */
struct real real_inv(struct real a);

static inline struct real real_div(struct real a, struct real b)
{
    return real_mul(a, real_inv(b));
}

/* 1 / sqrt(a) for a > 0; sqrt(a), zero for a <= 0. */
struct real real_rsqrt(struct real a);
struct real real_sqrt(struct real a);

/* A cube root of a > 0 that is not below it and at most 2^(1/3) too large: a
 * first guess, not an answer. */
struct real real_cbrt_above(struct real a);

/* floor(a * 2^bits) as int64; saturates at +-2^62. */
int64_t real_floor(struct real a, int bits);

/* The real nearest to a * 2^e, to 2^-60. */
struct real wide_real(struct wide a, int32_t e);
/* floor(a), for |a| < 2^126. */
struct wide wide_floor(struct real a);

#endif
