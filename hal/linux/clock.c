/* hal/linux/clock.c - see clock.h. */
#include "hal/linux/clock.h"

#include <time.h>

#define NS_PER_S INT64_C(1000000000)

static int64_t clock_linux_now_ns(struct hal_clock *clock)
{
    struct timespec now;

    (void)clock;
    clock_gettime(CLOCK_MONOTONIC, &now); /* cannot fail for this clock */
    return now.tv_sec * NS_PER_S + now.tv_nsec;
}

static int clock_linux_wait_until(struct hal_clock *clock, int64_t t_ns)
{
    struct timespec until = { .tv_sec = (time_t)(t_ns / NS_PER_S),
                              .tv_nsec = (long)(t_ns % NS_PER_S) };

    (void)clock;
    if (t_ns <= 0)
        return MOTION_OK; /* long past, and a negative tv_nsec is refused */
    if (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL) != 0)
        return MOTION_E_IO;
    return MOTION_OK;
}

static const struct hal_clock_ops clock_linux_ops = {
    .now_ns = clock_linux_now_ns,
    .wait_until = clock_linux_wait_until,
};

struct hal_clock *clock_linux_init(struct clock_linux *self)
{
    *self = (struct clock_linux){ .clock.ops = &clock_linux_ops };
    return &self->clock;
}
