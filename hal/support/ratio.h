/* hal/support/ratio.h - multiply by a fraction without dividing on the tick. */
#ifndef HAL_SUPPORT_RATIO_H
#define HAL_SUPPORT_RATIO_H

#include <stdint.h>

#include "motion/core/err.h"

/* value * mantissa / 2^shift, mantissa of 62 or 63 bits and a sign. */
struct hal_ratio {
    int64_t mantissa;
    uint8_t shift;
};

/* num / den x 2^bits to 2^-61 of it; num != 0, den > 0, both below 2^63 in
 * magnitude, else MOTION_E_ARG; MOTION_E_RANGE when it is beyond 2^63 or below
 * 2^-66.  Divides. */
int hal_ratio_init(struct hal_ratio *ratio, int64_t num, int64_t den, int bits);
/* value * ratio to nearest; saturates. */
int64_t hal_ratio_scale(const struct hal_ratio *ratio, int64_t value);

#endif
