/* hal/linux/libgpiod_parts.h - what differs between libgpiod 1.6 and 2.x. */
#ifndef HAL_LINUX_LIBGPIOD_PARTS_H
#define HAL_LINUX_LIBGPIOD_PARTS_H

#include <stddef.h>

#include "hal/linux/libgpiod.h"

/* NULL with errno. */
void *gpio_part_open(const char *path);
void gpio_part_close(void *chip);
/* The chip is called so, or has that label. */
bool gpio_part_is(void *chip, const char *name);
unsigned gpio_part_lines(void *chip);
/* Number of the line of that name; -1. */
int gpio_part_find(void *chip, const char *line);
/* Who has the line, empty when nobody; true when it is taken. */
bool gpio_part_user(void *chip, unsigned offset, char *user, size_t capacity);

/* Take the line: fills handle and buffer.  0, or -1 with errno. */
int gpio_part_request(struct gpio_libgpiod *self,
                      const struct gpio_libgpiod_config *config);
void gpio_part_release(struct gpio_libgpiod *self);

/* 1, 0, or -1. */
int gpio_part_get(struct gpio_libgpiod *self);
/* 0 or -1. */
int gpio_part_set(struct gpio_libgpiod *self, bool active);
/* Of an edge to read: */
int gpio_part_descriptor(struct gpio_libgpiod *self);
int gpio_part_read(struct gpio_libgpiod *self, struct hal_gpio_event *event);

#endif
