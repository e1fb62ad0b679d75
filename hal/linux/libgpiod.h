/* hal/linux/libgpiod.h - a line of a Linux GPIO chip; see hal/gpio.h.
 *
 * One source for libgpiod 1.6 and 2.x, which share no call: what differs is in
 * libgpiod_v1.c and libgpiod_v2.c, of which the header that is installed lets
 * one through.  Edges carry the kernel's monotonic time stamp. */
#ifndef HAL_LINUX_LIBGPIOD_H
#define HAL_LINUX_LIBGPIOD_H

#include "hal/gpio.h"

#define GPIO_LIBGPIOD_MESSAGE_MAX 256

struct gpio_libgpiod_config {
    const char *chip; /* "gpiochip0", "/dev/gpiochip0" or a label; NULL: the one
                         chip that has a line of this name */
    const char *line; /* its name, or, with a chip, its number */
    const char *consumer; /* what others see who ask who has it */
    bool output;          /* starts inactive */
    bool active_low;
    enum hal_gpio_bias bias; /* of an input */
};

/* Visible so that it can be static; use the functions. */
struct gpio_libgpiod {
    struct hal_gpio gpio;
    bool output;
    uint64_t
        device; /* the chip's number, and the line's on it: the same line, */
    unsigned offset;              /* whatever it was called */
    void *chip, *handle, *buffer; /* libgpiod's own */
};

/* Find the line and take it for ourselves.  On an error returns MOTION_E_ARG
 * (no such chip or line, or more than one), MOTION_E_STATE (somebody has it,
 * which the kernel knows) or MOTION_E_IO, and writes a sentence; nothing is held
 * then, and device and offset are those of a line that was found. */
int gpio_libgpiod_open(struct gpio_libgpiod *self,
                       const struct gpio_libgpiod_config *config,
                       char message[GPIO_LIBGPIOD_MESSAGE_MAX]);

/* Let go of the line; an output is inactive before.  The line may be one that
 * was never opened, zeroed. */
void gpio_libgpiod_close(struct gpio_libgpiod *self);

/* Of the library that is linked, "1.6.3". */
const char *gpio_libgpiod_version(void);

#endif
