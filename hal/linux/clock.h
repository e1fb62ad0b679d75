/* hal/linux/clock.h - CLOCK_MONOTONIC with absolute sleeps. */
#ifndef HAL_LINUX_CLOCK_H
#define HAL_LINUX_CLOCK_H

#include "hal/clock.h"

struct clock_linux {
    struct hal_clock clock;
};

struct hal_clock *clock_linux_init(struct clock_linux *self);

#endif
