/* firmware/linux/machine/machine_gpio.h - the digital lines of a rig on real
 * chips. */
#ifndef FIRMWARE_LINUX_MACHINE_MACHINE_GPIO_H
#define FIRMWARE_LINUX_MACHINE_MACHINE_GPIO_H

#include "firmware/linux/machine/machine.h"
#include "hal/linux/libgpiod.h"

struct machine_gpio {
    struct memory_pool memory;
    struct gpio_libgpiod *line; /* one per line of the rig */
    unsigned count;             /* open */
};

/* Take every line of the rig and put it into ports->line.  On an error returns
 * its code, writes "line estop: ..." and holds nothing. */
int machine_gpio_open(struct machine_gpio *gpio, const struct rig *rig,
                      struct machine_ports *ports,
                      char message[YAML_MESSAGE_MAX]);

/* Outputs are inactive afterwards, but those that are to be left as they
 * are. */
void machine_gpio_close(struct machine_gpio *gpio);
void machine_gpio_leave(struct machine_gpio *gpio, unsigned line);

#endif
