/* hal/gpio.h - one digital line: e-stop, limit switch, home, trigger, lamp.
 *
 * A line is read and written as "active" or not; which level that is belongs
 * to the line's configuration.  Implementations: sim/sim_gpio.c. */
#ifndef HAL_GPIO_H
#define HAL_GPIO_H

#include <stdbool.h>

#include "motion/err.h"

struct hal_gpio;

struct hal_gpio_ops {
    int (*get)(struct hal_gpio *line);              /* 1 active, 0, or E_IO */
    int (*set)(struct hal_gpio *line, bool active); /* E_STATE on an input */
};

struct hal_gpio {
    const struct hal_gpio_ops *ops;
};

static inline int hal_gpio_get(struct hal_gpio *line)
{
    return line->ops->get(line);
}

static inline int hal_gpio_set(struct hal_gpio *line, bool active)
{
    return line->ops->set(line, active);
}

#endif
