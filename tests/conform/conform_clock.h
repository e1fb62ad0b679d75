/* tests/conform/conform_clock.h - what every clock keeps to (hal/clock.h). */
#ifndef TESTS_CONFORM_CONFORM_CLOCK_H
#define TESTS_CONFORM_CONFORM_CLOCK_H

#include "tests/support/check.h"

#include "hal/clock.h"

struct conform_clock {
    const char *name;
    struct hal_clock *clock;
    /* It wakes no later than this, but for pauses of the machine; 0: it is
     * never late at all */
    int64_t late_ns;
};

/* Runs all claims; returns how many failed, as cmocka does. */
int conform_clock(struct conform_clock *bench);

#endif
