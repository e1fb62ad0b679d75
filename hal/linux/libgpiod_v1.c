/* hal/linux/libgpiod_v1.c - libgpiod 1.6.  See libgpiod_parts.h. */
#include <gpiod.h>

#ifdef GPIOD_LINE_BULK_MAX_LINES /* only 1.x has it */

#include <stdio.h>
#include <string.h>

#include "hal/linux/libgpiod_parts.h"

#define NS_PER_S INT64_C(1000000000)

const char *gpio_libgpiod_version(void)
{
    return gpiod_version_string();
}

void *gpio_part_open(const char *path)
{
    return gpiod_chip_open(path);
}

void gpio_part_close(void *chip)
{
    gpiod_chip_close(chip);
}

bool gpio_part_is(void *chip, const char *name)
{
    return strcmp(gpiod_chip_name(chip), name) == 0 ||
           strcmp(gpiod_chip_label(chip), name) == 0;
}

unsigned gpio_part_lines(void *chip)
{
    return gpiod_chip_num_lines(chip);
}

int gpio_part_find(void *chip, const char *line)
{
    struct gpiod_line *found = gpiod_chip_find_line(chip, line);
    return found == NULL ? -1 : (int)gpiod_line_offset(found);
}

bool gpio_part_user(void *chip, unsigned offset, char *user, size_t capacity)
{
    struct gpiod_line *line = gpiod_chip_get_line(chip, offset);
    const char *consumer = line == NULL ? NULL : gpiod_line_consumer(line);
    snprintf(user, capacity, "%s", consumer == NULL ? "" : consumer);
    return line != NULL && gpiod_line_is_used(line);
}

static int gpio_part_flags(const struct gpio_libgpiod_config *config)
{
    static const int bias[] = {
        [HAL_GPIO_AS_IS] = 0,
        [HAL_GPIO_PULL_UP] = GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP,
        [HAL_GPIO_PULL_DOWN] = GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN,
        [HAL_GPIO_NO_PULL] = GPIOD_LINE_REQUEST_FLAG_BIAS_DISABLE,
    };
    return (config->output ? 0 : bias[config->bias]) |
           (config->active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0);
}

int gpio_part_request(struct gpio_libgpiod *self,
                      const struct gpio_libgpiod_config *config)
{
    struct gpiod_line *line = gpiod_chip_get_line(self->chip, self->offset);
    if (line == NULL)
        return -1;
    self->handle = line;
    const struct gpiod_line_request_config request = {
        .consumer = config->consumer,
        .request_type = config->output ? GPIOD_LINE_REQUEST_DIRECTION_OUTPUT
                                       : GPIOD_LINE_REQUEST_EVENT_BOTH_EDGES,
        .flags = gpio_part_flags(config),
    };
    return gpiod_line_request(line, &request, 0);
}

void gpio_part_release(struct gpio_libgpiod *self)
{
    gpiod_line_release(self->handle);
}

int gpio_part_get(struct gpio_libgpiod *self)
{
    return gpiod_line_get_value(self->handle);
}

int gpio_part_set(struct gpio_libgpiod *self, bool active)
{
    return gpiod_line_set_value(self->handle, active);
}

int gpio_part_descriptor(struct gpio_libgpiod *self)
{
    return gpiod_line_event_get_fd(self->handle);
}

int gpio_part_read(struct gpio_libgpiod *self, struct hal_gpio_event *event)
{
    struct gpiod_line_event edge;
    if (gpiod_line_event_read(self->handle, &edge) < 0)
        return -1;
    event->t_ns = edge.ts.tv_sec * NS_PER_S + edge.ts.tv_nsec;
    event->active = edge.event_type == GPIOD_LINE_EVENT_RISING_EDGE;
    return 0;
}

#endif
