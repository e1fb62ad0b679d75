/* tests/conform/conform_can.h - what every CAN port keeps to (hal/can.h), as
 * claims that run on any two ports of one bus: simulated, virtual, real. */
#ifndef TESTS_CONFORM_CONFORM_CAN_H
#define TESTS_CONFORM_CONFORM_CAN_H

#include "tests/support/check.h"

#include "hal/can.h"

struct conform_can {
    const char *name;
    struct hal_can *a, *b;
    bool fd;           /* both take FD frames */
    bool remote_empty; /* remote frames of length 0 alone get through */
    void (*pass)(struct conform_can *bus, int64_t ns); /* let time pass */
    int64_t (*now_ns)(struct conform_can *bus);        /* hal_clock's */
    /* a's interface goes down, or comes up again. */
    void (*set_down)(struct conform_can *bus, bool down);
    void *context;
};

/* Runs all claims; returns how many failed, as cmocka does. */
int conform_can(struct conform_can *bus);

#endif
