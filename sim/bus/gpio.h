/* sim/bus/gpio.h - a simulated digital line: switch, lamp, broken wire.
 *
 * The line has a level (low, high) or is open; an open input reads as its pull
 * resistor makes it, so a normally closed switch to ground with a pull-up, read
 * as active high, reports a broken wire as active. */
#ifndef SIM_BUS_GPIO_H
#define SIM_BUS_GPIO_H

#include <stdbool.h>

#include "hal/clock.h"
#include "hal/gpio.h"

enum sim_gpio_level {
    SIM_GPIO_LOW,
    SIM_GPIO_HIGH,
    SIM_GPIO_OPEN, /* nothing connected: the pull resistor decides */
    SIM_GPIO_DEAD, /* the chip does not answer: every call is MOTION_E_IO */
};

#define SIM_GPIO_EVENTS 16 /* kept; more are lost, the oldest stay */

struct sim_gpio_config {
    struct hal_clock *clock; /* of time stamps */
    bool output;
    bool active_low;
    bool pull_up; /* else pull-down */
};

/* What a camera on an output has seen: pulses that made it active. */
struct sim_gpio_camera {
    uint32_t pictures;
    int64_t first_ns, last_ns; /* the pulses' begins */
    int64_t closest_ns;        /* between two of them; 0: there were not two */
    int64_t shortest_ns;       /* pulse that is over; 0: none is */
};

struct sim_gpio {
    struct hal_gpio gpio;
    struct sim_gpio_camera camera;
    struct sim_gpio_config config;
    enum sim_gpio_level level;
    struct hal_gpio_event event[SIM_GPIO_EVENTS];
    unsigned head, count;
};

/* An input starts open, an output inactive. */
struct hal_gpio *sim_gpio_init(struct sim_gpio *line,
                               const struct sim_gpio_config *config);
/* The outside world sets the line (on an output: a short circuit, until the
 * next set). */
void sim_gpio_drive(struct sim_gpio *line, enum sim_gpio_level level);

#endif
