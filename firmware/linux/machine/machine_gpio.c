/* firmware/linux/machine/machine_gpio.c - see machine_gpio.h. */
#include "firmware/linux/machine/machine_gpio.h"

#include <stdio.h>
#include <unistd.h>

#include "motion/core/err.h"

/* The first lines of the rig are open: is this one of them? */
static const struct rig_line *machine_gpio_own(const struct machine_gpio *gpio,
                                               const struct rig_line *first)
{
    const struct gpio_libgpiod *line = &gpio->line[gpio->count];
    for (unsigned i = 0; i < gpio->count; i++)
        if (gpio->line[i].device == line->device &&
            gpio->line[i].offset == line->offset)
            return &first[i];
    return NULL;
}

/* Others see by the consumer which process has it. */
static int machine_gpio_take(struct machine_gpio *gpio, const struct rig *rig,
                             const struct rig_line *line,
                             char message[YAML_MESSAGE_MAX])
{
    char why[GPIO_LIBGPIOD_MESSAGE_MAX], consumer[32];
    snprintf(consumer, sizeof consumer, "slew %ld", (long)getpid());
    const struct gpio_libgpiod_config config = {
        .chip = line->chip[0] == 0 ? NULL : line->chip,
        .line = line->line,
        .consumer = consumer,
        .output = rig_line_is_output(line),
        .active_low = line->active_low,
        .bias = line->bias,
    };
    int err = gpio_libgpiod_open(&gpio->line[gpio->count], &config, why);
    const struct rig_line *own =
        err == MOTION_E_STATE ? machine_gpio_own(gpio, rig->line) : NULL;
    if (own != NULL) {
        err = MOTION_E_ARG;
        snprintf(why, sizeof why,
                 "is the same as line %s in line %u of the rig file, expected "
                 "a line of its own",
                 own->name, own->place.line);
    }
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
        int err = machine_gpio_take(gpio, rig, &rig->line[i], message);
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
