/* hal/gpio.h - one digital line: e-stop, limit switch, trigger, lamp.
 *
 * A line is read and written as "active" or not; which level that is belongs
 * to the line's configuration.  The level decides; events only tell of pulses
 * between two looks, and when they were.  Nothing here waits.
 *
 * Implementations: hal/linux/libgpiod.c (Linux), sim/bus/gpio.c (simulated);
 * tests/conform/conform_gpio.c is what both keep to.  hal/gpio/debounce.c
 * stands between a switch that bounces and whoever reads it. */
#ifndef HAL_GPIO_H
#define HAL_GPIO_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/err.h"

MOTION_C_BEGIN

/* An edge of an input. */
struct hal_gpio_event {
    int64_t t_ns; /* on the clock of hal_clock; the kernel's time stamp */
    bool active;  /* it became so */
};

/* What the line is drawn to when nothing drives it. */
enum hal_gpio_bias {
    HAL_GPIO_AS_IS,
    HAL_GPIO_PULL_UP,
    HAL_GPIO_PULL_DOWN,
    HAL_GPIO_NO_PULL,
};

struct hal_gpio;

struct hal_gpio_ops {
    /* 1 active, 0, or MOTION_E_IO.  An output: what was set. */
    int (*get)(struct hal_gpio *line);
    /* MOTION_OK, MOTION_E_IO, or MOTION_E_STATE on an input. */
    int (*set)(struct hal_gpio *line, bool active);
    /* Oldest edge that was not asked for yet: 1 when there was one, 0 when
     * not, MOTION_E_IO, or MOTION_E_STATE on an output.  Edges may be lost when
     * there are many (16 are kept): the level decides. */
    int (*event)(struct hal_gpio *line, struct hal_gpio_event *event);
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

static inline int hal_gpio_event(struct hal_gpio *line,
                                 struct hal_gpio_event *event)
{
    return line->ops->event(line, event);
}

MOTION_C_END

#endif
