/* hal/support/ratio.c - see ratio.h. */
#include "hal/support/ratio.h"

#include <stddef.h>

#include "motion/core/fixed.h"

/* num of a and den of b bits: shift = 62 + b - a, 0 .. 124, so that num <<
 * shift has 62 + b bits; its upper word is below den, as the division needs,
 * and the quotient is below 2^63. */
int hal_ratio_init(struct hal_ratio *ratio, int64_t num, int64_t den, int bits)
{
    const uint64_t n = motion_fixed_abs(num);
    struct motion_u128 shifted;
    uint64_t mantissa;
    int shift;

    if (num == 0 || num == INT64_MIN || den <= 0)
        return MOTION_E_ARG;
    shift = 62 + (int)motion_fixed_clz_u64(n) -
            (int)motion_fixed_clz_u64((uint64_t)den);
    shifted =
        motion_fixed_shl_u128((struct motion_u128){ 0, n }, (unsigned)shift);
    if (shift - bits < 0 || shift - bits > 127)
        return MOTION_E_RANGE;
    (void)motion_fixed_div_u128(shifted, (uint64_t)den, &mantissa, NULL);
    ratio->mantissa = num < 0 ? -(int64_t)mantissa : (int64_t)mantissa;
    ratio->shift = (uint8_t)(shift - bits);
    return MOTION_OK;
}

int64_t hal_ratio_scale(const struct hal_ratio *ratio, int64_t value)
{
    int64_t result;

    if (motion_fixed_mulshift(value, ratio->mantissa, ratio->shift, &result) ==
        MOTION_OK)
        return result;
    return (value < 0) == (ratio->mantissa < 0) ? INT64_MAX : INT64_MIN;
}
