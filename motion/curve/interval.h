/* motion/curve/interval.h - which of neighbouring intervals a value is in. */
#ifndef MOTION_CURVE_INTERVAL_H
#define MOTION_CURVE_INTERVAL_H

#include <stddef.h>
#include <stdint.h>

/* The last of `count` intervals that begins at or before `value`; the first where
 * none does.  `begin`: where the first begins, a member of an array whose elements
 * are `stride` bytes long and ascend.  0 without intervals. */
static inline uint32_t motion_interval_find(const int64_t *begin, size_t stride,
                                            uint32_t count, int64_t value)
{
    uint32_t low = 0, high = count;

    while (high - low > 1) {
        const uint32_t middle = low + (high - low) / 2;
        const void *at = (const char *)begin + middle * stride;
        if (*(const int64_t *)at <= value)
            low = middle;
        else
            high = middle;
    }
    return low;
}

#endif
