/* hal/clock.h - monotonic time and waiting for it.
 *
 * Implementations: hal/linux/clock.c (CLOCK_MONOTONIC, absolute sleeps) and
 * sim/world.c (virtual: waiting runs the simulated world up to then). */
#ifndef HAL_CLOCK_H
#define HAL_CLOCK_H

#include <stdint.h>

#include "motion/core/err.h"

MOTION_C_BEGIN

struct hal_clock;

struct hal_clock_ops {
    int64_t (*now_ns)(struct hal_clock *clock);
    /* Return at or after `t_ns`; at once when it has passed.  MOTION_OK, or
     * MOTION_E_IO when waiting was broken off (a signal). */
    int (*wait_until)(struct hal_clock *clock, int64_t t_ns);
};

struct hal_clock {
    const struct hal_clock_ops *ops;
};

static inline int64_t hal_clock_now_ns(struct hal_clock *clock)
{
    return clock->ops->now_ns(clock);
}

static inline int hal_clock_wait_until(struct hal_clock *clock, int64_t t_ns)
{
    return clock->ops->wait_until(clock, t_ns);
}

MOTION_C_END

#endif
