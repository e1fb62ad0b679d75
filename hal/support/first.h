/* hal/support/first.h - the first set point after enabling must be where the axis
 * is. */
#ifndef HAL_SUPPORT_FIRST_H
#define HAL_SUPPORT_FIRST_H

#include <stdbool.h>
#include <stdint.h>

#define HAL_FIRST_AWAY "first set point is too far from where the axis is"

/* Whether a set point `step` away from the axis may be sent: any is, where it is
 * not the first; otherwise |step| <= most, and the next is not the first any more.
 * |step| < 2^63. */
static inline bool hal_first_fits(bool *first, int64_t step, int64_t most)
{
    if (*first && (step > most || step < -most))
        return false;
    *first = false;
    return true;
}

#endif
