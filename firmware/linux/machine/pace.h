/* firmware/linux/machine/pace.h - from tick to tick on a clock that goes on
 * while the machine does something else. */
#ifndef FIRMWARE_LINUX_MACHINE_PACE_H
#define FIRMWARE_LINUX_MACHINE_PACE_H

#include "hal/clock.h"

/* The latest of `due_ns` and the ticks after it that is not in the future;
 * `due_ns` itself when it is. */
static inline int64_t pace_latest_ns(struct hal_clock *clock, int64_t due_ns,
                                     int64_t period_ns)
{
    const int64_t late_ns = hal_clock_now_ns(clock) - due_ns;

    return late_ns < period_ns ? due_ns
                               : due_ns + late_ns / period_ns * period_ns;
}

/* Wait for the tick at `due_ns`; returns the nominal time of the one that it
 * has become.  Whole periods that have passed, before the wait or while the
 * machine did not wake us from it, are left out: never a burst, and never a set
 * point whose time is over.  *late_ns: how late the wake-up was. */
static inline int64_t pace_wait(struct hal_clock *clock, int64_t due_ns,
                                int64_t period_ns, int64_t *late_ns)
{
    due_ns = pace_latest_ns(clock, due_ns, period_ns);
    while (hal_clock_wait_until(clock, due_ns) < 0)
        ; /* a signal woke us; it has been counted */
    *late_ns = hal_clock_now_ns(clock) - due_ns;
    return pace_latest_ns(clock, due_ns, period_ns);
}

#endif
