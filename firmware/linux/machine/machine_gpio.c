/* firmware/linux/machine/machine_gpio.c - see machine_gpio.h. */
#include "firmware/linux/machine/machine_gpio.h"

#include <stdio.h>

static int machine_gpio_take(struct machine_gpio *gpio,
                             const struct rig_line *line,
                             char message[YAML_MESSAGE_MAX])
{
    char why[GPIO_LIBGPIOD_MESSAGE_MAX];
    const struct gpio_libgpiod_config config = {
        .chip = line->chip[0] == 0 ? NULL : line->chip,
        .line = line->line,
        .consumer = "slew",
        .output = rig_line_is_output(line),
        .active_low = line->active_low,
        .bias = line->bias,
    };
    int err = gpio_libgpiod_open(&gpio->line[gpio->count], &config, why);
    if (err < 0)
        snprintf(message, YAML_MESSAGE_MAX, "line %s: %s", line->name, why);
    else
        gpio->count++;
    return err;
}

int machine_gpio_open(struct machine_gpio *gpio, const struct rig *rig,
                      struct machine_ports *ports,
                      char message[YAML_MESSAGE_MAX])
{
    *gpio = (struct machine_gpio){ .count = 0 };
    gpio->line =
        memory_pool_new(&gpio->memory, rig->line_count, sizeof *gpio->line);
    for (uint32_t i = 0; i < rig->line_count; i++) {
        int err = machine_gpio_take(gpio, &rig->line[i], message);
        if (err < 0) {
            machine_gpio_close(gpio);
            return err;
        }
        ports->line[i] = &gpio->line[i].gpio;
    }
    return MOTION_OK;
}

void machine_gpio_leave(struct machine_gpio *gpio, unsigned line)
{
    gpio->line[line].output = false;
}

void machine_gpio_close(struct machine_gpio *gpio)
{
    while (gpio->count > 0)
        gpio_libgpiod_close(&gpio->line[--gpio->count]);
    memory_pool_free(&gpio->memory);
}
