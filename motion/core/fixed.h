/* motion/core/fixed.h - wide integer arithmetic, the same bits on every
 * machine.
 *
 * Formats used all over slew:
 *   *_q32       int64, 32 fraction bits: positions [unit], velocities [unit/s],
 *               accelerations [unit/s2] and jerks [unit/s3]; +-2.1e9, step
 *               2.3e-10.  One format for all four: 1e-6 rev/s2 is held to 1e-4,
 *               1e-4 rev/s3 to 1e-6, and 2.1e9 mm/s3 are 2.1e6 m/s3; counts of
 *               a fine encoder, which go beyond, are taken by the 1000 (kcount)
 *   *_ns_q12    int64 nanoseconds, 12 fraction bits: time inside slew;
 *               +-26 days, step 0.24 ps.  A whole nanosecond is exact.
 *   *_ns        int64 nanoseconds, at the edges
 *
 * 32-bit ARM has no __int128, so 128-bit numbers are made here from 32-bit
 * halves, and from a machine's own instructions where those do better
 * (fixed_halves.h).  Rounding is "nearest, ties away from zero" unless
 * a name says floor.  Functions marked plan-time divide; the others may be
 * called on the tick. */
#ifndef MOTION_CORE_FIXED_H
#define MOTION_CORE_FIXED_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/err.h"

#define MOTION_FIXED_ONE_Q32 ((int64_t)1 << 32)
#define MOTION_FIXED_NS_Q12  ((int64_t)1 << 12)          /* one ns */
#define MOTION_FIXED_S_Q12   (INT64_C(1000000000) << 12) /* one s */

struct motion_u128 {
    uint64_t hi, lo;
};

/* Also when optimising for size: on a 32-bit machine a call moves more than
 * these add. */
#define FIXED_INLINE static inline __attribute__((always_inline))

/* FIXED_BY(mul)(a, b) is the product by the machine's own instructions: inline,
 * for what is made of these; FIXED_IS_SHORT where they are only a few. */
#include "motion/core/fixed_halves.h"
#if defined(__SIZEOF_INT128__)
#include "motion/core/fixed_int128.h"
#define FIXED_BY(name) fixed_int128_##name
#define FIXED_IS_SHORT 1
#elif defined(__thumb2__) && defined(__ARM_FEATURE_DSP) &&                     \
    defined(__GCC_ASM_FLAG_OUTPUTS__)
#include "motion/core/fixed_thumb.h"
#define FIXED_BY(name) fixed_thumb_##name
#define FIXED_IS_SHORT 1
#else
#define FIXED_BY(name) fixed_halves_##name
#define FIXED_IS_SHORT 0
#endif

MOTION_C_BEGIN

/* a * b, all 128 bits. */
struct motion_u128 motion_fixed_mul_u64(uint64_t a, uint64_t b);

/* The upper 64 bits of a * b. */
uint64_t motion_fixed_mulhi_u64(uint64_t a, uint64_t b);

/* a + b, a - b, modulo 2^128. */
FIXED_INLINE struct motion_u128 motion_fixed_add_u128(struct motion_u128 a,
                                                      struct motion_u128 b)
{
    return FIXED_BY(add)(a, b);
}

FIXED_INLINE struct motion_u128 motion_fixed_sub_u128(struct motion_u128 a,
                                                      struct motion_u128 b)
{
    return FIXED_BY(sub)(a, b);
}

/* -1, 0, 1 as a is below, equal to, above b. */
int motion_fixed_cmp_u128(struct motion_u128 a, struct motion_u128 b);
/* Shifts by 0..127. */
struct motion_u128 motion_fixed_shl_u128(struct motion_u128 a, unsigned bits);
struct motion_u128 motion_fixed_shr_u128(struct motion_u128 a, unsigned bits);

/* The same 128 bits as two's complement: add and sub as above. */
static inline struct motion_u128 motion_fixed_from_i64(int64_t a)
{
    return (struct motion_u128){ a < 0 ? UINT64_MAX : 0, (uint64_t)a };
}
static inline bool motion_fixed_is_neg_i128(struct motion_u128 a)
{
    return a.hi >> 63;
}
FIXED_INLINE struct motion_u128 motion_fixed_neg_i128(struct motion_u128 a)
{
    return FIXED_BY(sub)((struct motion_u128){ 0, 0 }, a);
}
/* -a where `minus` is all ones, a where it is zero. */
FIXED_INLINE struct motion_u128 motion_fixed_sign_i128(struct motion_u128 a,
                                                       uint64_t minus)
{
    return FIXED_BY(sub)((struct motion_u128){ a.hi ^ minus, a.lo ^ minus },
                         (struct motion_u128){ minus, minus });
}
FIXED_INLINE struct motion_u128 motion_fixed_abs_i128(struct motion_u128 a)
{
    return motion_fixed_sign_i128(a, (uint64_t)((int64_t)a.hi >> 63));
}
/* a * b, modulo 2^128. */
struct motion_u128 motion_fixed_mul_i128(struct motion_u128 a, int32_t b);
/* a / 2^bits to nearest; 0 for bits above 127. */
struct motion_u128 motion_fixed_round_i128(struct motion_u128 a, unsigned bits);
/* MOTION_E_RANGE beyond int64. */
int motion_fixed_to_i64(struct motion_u128 a, int64_t *result);

/* floor(n / d) and the rest.  Needs n.hi < d (else the quotient does not fit);
 * d == 0 or n.hi >= d returns MOTION_E_RANGE and writes nothing.  `rest` may be
 * NULL.  Plan-time. */
int motion_fixed_div_u128(struct motion_u128 n, uint64_t d, uint64_t *quotient,
                          uint64_t *rest);

/* A divisor, made ready for many divisions: d 2^up with its upper bit set, and
 * its reciprocal.  d must not be zero.  Plan-time. */
struct motion_divisor {
    uint64_t d;
    uint32_t per;
    uint8_t up;
};
void motion_divisor_init(struct motion_divisor *by, uint64_t d);
/* floor(n / d) and the rest, which may be NULL; n.hi < d.  n is given, and the
 * rest returned, times 2^up: who shifts n anyway does it once. */
uint64_t motion_divisor_apply(const struct motion_divisor *by,
                              struct motion_u128 n, uint64_t *rest);

/* a * b / c with a 128-bit product, to nearest.  MOTION_E_RANGE when c == 0 or
 * the result is beyond int64.  Plan-time. */
int motion_fixed_muldiv(int64_t a, int64_t b, int64_t c, int64_t *result);
/* The same, saturated, also by c = 0, which counts as positive.  Plan-time. */
int64_t motion_fixed_muldiv_sat(int64_t a, int64_t b, int64_t c);

/* (a * b) >> bits to nearest, bits 0..127; MOTION_E_RANGE beyond int64. */
int motion_fixed_mulshift(int64_t a, int64_t b, unsigned bits, int64_t *result);

/* floor(sqrt(n)).  Plan-time. */
uint32_t motion_fixed_isqrt_u64(uint64_t n);
uint64_t motion_fixed_isqrt_u128(struct motion_u128 n);

/* Checked sums: MOTION_E_RANGE instead of wrapping, nothing written then.
 * Where size counts (-Os) they are calls; fixed.c has the one copy. */
#if defined MOTION_FIXED_SUMS || !defined __OPTIMIZE_SIZE__
inline int motion_fixed_add(int64_t a, int64_t b, int64_t *result)
{
    int64_t sum;
    if (__builtin_add_overflow(a, b, &sum))
        return MOTION_E_RANGE;
    *result = sum;
    return MOTION_OK;
}
inline int motion_fixed_sub(int64_t a, int64_t b, int64_t *result)
{
    int64_t difference;
    if (__builtin_sub_overflow(a, b, &difference))
        return MOTION_E_RANGE;
    *result = difference;
    return MOTION_OK;
}
#else
int motion_fixed_add(int64_t a, int64_t b, int64_t *result);
int motion_fixed_sub(int64_t a, int64_t b, int64_t *result);
#endif

/* a + b, saturated. */
static inline int64_t motion_fixed_add_sat(int64_t a, int64_t b)
{
    int64_t sum;
    if (motion_fixed_add(a, b, &sum) < 0)
        return b < 0 ? INT64_MIN : INT64_MAX;
    return sum;
}

static inline int64_t motion_fixed_least(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

static inline int64_t motion_fixed_most(int64_t a, int64_t b)
{
    return a > b ? a : b;
}

/* |a| without overflow: 2^63 for INT64_MIN. */
static inline uint64_t motion_fixed_abs(int64_t a)
{
    return a < 0 ? 0 - (uint64_t)a : (uint64_t)a;
}

/* Number of leading zero bits, 64 for zero.  Of halves, which a 32-bit machine
 * has an instruction for. */
static inline unsigned motion_fixed_clz_u64(uint64_t a)
{
    const uint32_t high = (uint32_t)(a >> 32), low = (uint32_t)a;
    if (high != 0)
        return (unsigned)__builtin_clz(high);
    return low != 0 ? 32 + (unsigned)__builtin_clz(low) : 64;
}

/* sin and cos of phase quarter turns / 2^62, phase 0 .. 2^62 (a quarter turn),
 * as Q2.62; error at most 4 units of 2^-62.  Taylor series.  Plan-time. */
void motion_fixed_sincos_q62(uint64_t phase_q62, int64_t *sin_q62,
                             int64_t *cos_q62);

MOTION_C_END

#endif
