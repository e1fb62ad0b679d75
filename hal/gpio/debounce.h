/* hal/gpio/debounce.h - an input that stops at the first sign and lets go late.
 *
 * Active at once: by its level, or by an edge since the last look, however
 * short the pulse was.  Not active again before it has been quiet for
 * release_ns.  A line that cannot be read gives its error, which whoever
 * stops a machine takes for active.  The time of a change is that of the
 * earliest edge, or of the step where there was none or where it is further
 * from the step than a second: such a stamp is not of our clock. */
#ifndef HAL_GPIO_DEBOUNCE_H
#define HAL_GPIO_DEBOUNCE_H

#include "hal/gpio.h"

struct gpio_debounce {
    struct hal_gpio gpio; /* get and event; set is MOTION_E_STATE */
    struct hal_gpio *line;
    int64_t release_ns;
    int64_t active_ns; /* when it was seen active last */
    int level;         /* 1, 0, or an error */
    bool looked;
    bool changed; /* since the last event that was given */
    int64_t changed_ns;
};

/* release_ns 0 .. 10 s, else MOTION_E_ARG.  Until the first step it is
 * active. */
int gpio_debounce_init(struct gpio_debounce *self, struct hal_gpio *line,
                       int64_t release_ns);

/* Once per tick, before it is read. */
void gpio_debounce_step(struct gpio_debounce *self, int64_t now_ns);

#endif
