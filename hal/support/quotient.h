/* hal/support/quotient.h - division where nothing divides: long division in base
 * 2, the same number of steps whatever the numbers.  The tick may use it. */
#ifndef HAL_SUPPORT_QUOTIENT_H
#define HAL_SUPPORT_QUOTIENT_H

#include <stdint.h>

/* Divide, rounding down; the remainder goes to *rest.  divisor 1 .. 2^63. */
static inline uint64_t hal_quotient(uint64_t dividend, uint64_t divisor,
                                    uint64_t *rest)
{
    uint64_t quotient = 0;

    *rest = 0;
    for (unsigned bit = 64; bit-- > 0;) {
        *rest = *rest << 1 | (dividend >> bit & 1);
        quotient <<= 1;
        if (*rest >= divisor) {
            *rest -= divisor;
            quotient |= 1;
        }
    }
    return quotient;
}

/* 2^20 * 1 s / dt, dt_ns > 0: times a distance made in dt, and shifted back, its
 * speed. */
static inline int64_t hal_per_second_q20(int64_t dt_ns)
{
    uint64_t rest;

    return (int64_t)hal_quotient(UINT64_C(1000000000) << 20, (uint64_t)dt_ns,
                                 &rest);
}

#endif
