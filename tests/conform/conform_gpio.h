/* tests/conform/conform_gpio.h - what every line keeps to (hal/gpio.h), as
 * claims that run on any chip whose other side can be driven and read:
 * simulated, real. */
#ifndef TESTS_CONFORM_CONFORM_GPIO_H
#define TESTS_CONFORM_CONFORM_GPIO_H

#include "tests/support/check.h"

#include "hal/gpio.h"

struct conform_gpio_line {
    bool output, active_low;
    enum hal_gpio_bias bias;
};

struct conform_gpio {
    const char *name;
    /* A line so configured; it is closed before the next is opened. */
    struct hal_gpio *(*open)(struct conform_gpio *chip,
                             const struct conform_gpio_line *line);
    void (*close)(struct conform_gpio *chip);
    /* What the outside makes of it. */
    void (*drive)(struct conform_gpio *chip, bool high);
    bool (*is_high)(struct conform_gpio *chip);
    int64_t (*now_ns)(struct conform_gpio *chip); /* hal_clock's */
    void (*pass)(struct conform_gpio *chip);      /* 1 ms */
    void *context;
};

/* Runs all claims; returns how many failed, as cmocka does. */
int conform_gpio(struct conform_gpio *on);

#endif
