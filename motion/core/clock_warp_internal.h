/* motion/core/clock_warp_internal.h - what the files of clock_warp.h share. */
#ifndef MOTION_CORE_CLOCK_WARP_INTERNAL_H
#define MOTION_CORE_CLOCK_WARP_INTERNAL_H

#include <stdint.h>

#include "motion/core/clock_warp.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

static inline int64_t clock_warp_saturate(int negative)
{
    return negative ? INT64_MIN : INT64_MAX;
}

/* (a * b) >> bits to nearest, saturated; 1 <= bits <= 63, known to the
 * compiler.  What motion_fixed_mulshift gives, at a third of its price where a
 * product is a few instructions. */
#if FIXED_IS_SHORT
FIXED_INLINE int64_t clock_warp_mul(int64_t a, int64_t b, unsigned bits)
{
    const int64_t minus = (a ^ b) >> 63;
    const struct motion_u128 product = motion_fixed_add_u128(
        FIXED_BY(mul)(motion_fixed_abs(a), motion_fixed_abs(b)),
        (struct motion_u128){ 0, (uint64_t)1 << (bits - 1) });
    const uint64_t size = product.hi << (64 - bits) | product.lo >> bits;
    if (product.hi >> (bits - 1) != 0) /* 2^63 and above */
        return clock_warp_saturate(minus != 0);
    return ((int64_t)size ^ minus) - minus;
}
#else
static inline int64_t clock_warp_mul(int64_t a, int64_t b, unsigned bits)
{
    int64_t result;
    if (motion_fixed_mulshift(a, b, bits, &result) < 0)
        return clock_warp_saturate((a < 0) != (b < 0));
    return result;
}
#endif

#endif
