/* hal/support/float32.c - see float32.h. */
#include "hal/support/float32.h"

#include "motion/core/fixed.h"

#define SIGN          UINT32_C(0x80000000)
#define FRACTION_BITS 23u
#define HIDDEN        (UINT32_C(1) << FRACTION_BITS)
#define EXPONENT_MAX  255u
#define BIAS          127

static unsigned float32_exponent(uint32_t bits)
{
    return bits >> FRACTION_BITS & EXPONENT_MAX;
}

bool hal_float32_is_finite(uint32_t bits)
{
    return float32_exponent(bits) != EXPONENT_MAX;
}

/* The upper 24 of the 64 - zeros bits, rounded; a carry out of them is one more
 * in the exponent, which the sum below does by itself. */
static uint32_t float32_round(uint64_t magnitude, unsigned zeros)
{
    const uint64_t top = magnitude << zeros; /* bit 63 is set */
    const uint32_t kept = (uint32_t)(top >> 40);
    const uint64_t rest = top << 24;
    const uint64_t half = UINT64_C(1) << 63;
    const bool up = rest > half || (rest == half && (kept & 1) != 0);

    return kept + (up ? 1 : 0);
}

/* |value| is at least 2^-63, far from the smallest normal number. */
uint32_t hal_float32_from_fixed(int64_t value, unsigned fraction_bits)
{
    const uint64_t magnitude = motion_fixed_abs(value);
    const unsigned zeros = motion_fixed_clz_u64(magnitude);
    const uint32_t sign = value < 0 ? SIGN : 0;
    uint32_t exponent;

    if (magnitude == 0)
        return 0;
    exponent = (uint32_t)(BIAS + 63) - zeros - fraction_bits;
    return sign | ((exponent << FRACTION_BITS) +
                   float32_round(magnitude, zeros) - HIDDEN);
}

/* mantissa x 2^shift to nearest, mantissa below 2^24. */
static uint64_t float32_shift(uint32_t mantissa, int shift)
{
    if (shift >= 0)
        return (uint64_t)mantissa << shift;
    if (shift < -25)
        return 0;
    return ((uint64_t)mantissa + (UINT64_C(1) << (-shift - 1))) >> -shift;
}

int64_t hal_float32_to_fixed(uint32_t bits, unsigned fraction_bits)
{
    const unsigned exponent = float32_exponent(bits);
    const uint32_t fraction = bits & (HIDDEN - 1);
    const bool negative = (bits & SIGN) != 0;
    /* a number without the hidden bit has the exponent of 1 */
    const int shift = (int)(exponent > 0 ? exponent : 1) - BIAS -
                      (int)FRACTION_BITS + (int)fraction_bits;
    uint64_t magnitude;

    if (exponent == EXPONENT_MAX && fraction != 0)
        return 0;
    if (exponent > 0 && shift > 39) /* 24 bits would reach beyond bit 62 */
        return negative ? INT64_MIN : INT64_MAX;
    magnitude = float32_shift(fraction | (exponent > 0 ? HIDDEN : 0), shift);
    return negative ? -(int64_t)magnitude : (int64_t)magnitude;
}

void hal_float32_put(uint8_t at[4], uint32_t bits)
{
    for (unsigned i = 0; i < 4; i++)
        at[i] = (uint8_t)(bits >> 8 * i);
}

uint32_t hal_float32_get(const uint8_t at[4])
{
    uint32_t bits = 0;

    for (unsigned i = 0; i < 4; i++)
        bits |= (uint32_t)at[i] << 8 * i;
    return bits;
}
