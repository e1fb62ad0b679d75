/* motion/real.h - positive numbers of any size, 64 bits of them right.
 *
 * A move of 1e-6 mm and one of 1e8 mm, a jerk in unit/s3 and a time in 2^-12 ns
 * share no fixed-point format.  Plan-time formulas that mix them compute with
 * mantissa * 2^exponent, in integers, so that every machine gets the same bits.
 * Every operation rounds to nearest, with a relative error of at most 2^-64,
 * unless it says otherwise.  There are no signs: a difference below zero is
 * zero.  Exponents stay far inside +-10^6 for any product of our formats; they
 * are not checked.  Plan-time: divides. */
#ifndef MOTION_REAL_H
#define MOTION_REAL_H

#include <stdint.h>

#include "motion/fixed.h"

struct motion_real {
    uint64_t mantissa; /* top bit set, or 0 for zero */
    int32_t exponent;
};

/* wide * 2^exponent; one word is exact. */
struct motion_real motion_real_from_u128(struct motion_u128 wide,
                                         int32_t exponent);
struct motion_real motion_real_from_u64(uint64_t word, int32_t exponent);

struct motion_real motion_real_add(struct motion_real a, struct motion_real b);
/* a - b, or zero when b is larger; the error is relative to a. */
struct motion_real motion_real_sub(struct motion_real a, struct motion_real b);
struct motion_real motion_real_mul(struct motion_real a, struct motion_real b);
/* a / b; b must not be zero. */
struct motion_real motion_real_div(struct motion_real a, struct motion_real b);
/* Rounded down, relative error below 2^-63. */
struct motion_real motion_real_sqrt(struct motion_real a);
/* Relative error below 2^-62, either way. */
struct motion_real motion_real_cbrt(struct motion_real a);

/* -1, 0, 1 as a is below, equal to, above b. */
int motion_real_cmp(struct motion_real a, struct motion_real b);

/* a * 2^bits, to nearest; and rounded up.  MOTION_E_RANGE beyond int64. */
int motion_real_round(struct motion_real a, int32_t bits, int64_t *result);
int motion_real_ceil(struct motion_real a, int32_t bits, int64_t *result);

#endif
