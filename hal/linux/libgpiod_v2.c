/* hal/linux/libgpiod_v2.c - libgpiod 2.x.  See libgpiod_parts.h. */
#include <gpiod.h>

#ifndef GPIOD_LINE_BULK_MAX_LINES /* only 1.x has it */

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "hal/linux/libgpiod_parts.h"

const char *gpio_libgpiod_version(void)
{
    return gpiod_api_version();
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
    struct gpiod_chip_info *info = gpiod_chip_get_info(chip);
    if (info == NULL)
        return false;
    bool is = strcmp(gpiod_chip_info_get_name(info), name) == 0 ||
              strcmp(gpiod_chip_info_get_label(info), name) == 0;
    gpiod_chip_info_free(info);
    return is;
}

unsigned gpio_part_lines(void *chip)
{
    struct gpiod_chip_info *info = gpiod_chip_get_info(chip);
    if (info == NULL)
        return 0;
    unsigned lines = (unsigned)gpiod_chip_info_get_num_lines(info);
    gpiod_chip_info_free(info);
    return lines;
}

int gpio_part_find(void *chip, const char *line)
{
    return gpiod_chip_get_line_offset_from_name(chip, line);
}

bool gpio_part_user(void *chip, unsigned offset, char *user, size_t capacity)
{
    struct gpiod_line_info *info = gpiod_chip_get_line_info(chip, offset);
    const char *consumer =
        info == NULL ? NULL : gpiod_line_info_get_consumer(info);
    snprintf(user, capacity, "%s", consumer == NULL ? "" : consumer);
    bool taken = info != NULL && gpiod_line_info_is_used(info);
    if (info != NULL)
        gpiod_line_info_free(info);
    return taken;
}

static int gpio_part_settle(struct gpiod_line_settings *settings,
                            const struct gpio_libgpiod_config *config)
{
    static const enum gpiod_line_bias bias[] = {
        [HAL_GPIO_AS_IS] = GPIOD_LINE_BIAS_AS_IS,
        [HAL_GPIO_PULL_UP] = GPIOD_LINE_BIAS_PULL_UP,
        [HAL_GPIO_PULL_DOWN] = GPIOD_LINE_BIAS_PULL_DOWN,
        [HAL_GPIO_NO_PULL] = GPIOD_LINE_BIAS_DISABLED,
    };
    gpiod_line_settings_set_active_low(settings, config->active_low);
    if (config->output)
        return gpiod_line_settings_set_direction(settings,
                                                 GPIOD_LINE_DIRECTION_OUTPUT) |
               gpiod_line_settings_set_output_value(settings,
                                                    GPIOD_LINE_VALUE_INACTIVE);
    return gpiod_line_settings_set_direction(settings,
                                             GPIOD_LINE_DIRECTION_INPUT) |
           gpiod_line_settings_set_bias(settings, bias[config->bias]) |
           gpiod_line_settings_set_edge_detection(settings,
                                                  GPIOD_LINE_EDGE_BOTH) |
           gpiod_line_settings_set_event_clock(settings,
                                               GPIOD_LINE_CLOCK_MONOTONIC);
}

/* What a request is put together from; each may be NULL. */
struct gpio_part_order {
    struct gpiod_line_settings *settings;
    struct gpiod_line_config *lines;
    struct gpiod_request_config *request;
};

static void *gpio_part_place(struct gpio_libgpiod *self,
                             const struct gpio_libgpiod_config *config,
                             const struct gpio_part_order *order)
{
    if (order->settings == NULL || order->lines == NULL ||
        order->request == NULL ||
        gpio_part_settle(order->settings, config) != 0 ||
        gpiod_line_config_add_line_settings(order->lines, &self->offset, 1,
                                            order->settings) != 0)
        return NULL;
    gpiod_request_config_set_consumer(order->request, config->consumer);
    return gpiod_chip_request_lines(self->chip, order->request, order->lines);
}

int gpio_part_request(struct gpio_libgpiod *self,
                      const struct gpio_libgpiod_config *config)
{
    const struct gpio_part_order order = {
        gpiod_line_settings_new(),
        gpiod_line_config_new(),
        gpiod_request_config_new(),
    };
    self->handle = gpio_part_place(self, config, &order);
    int error = errno;
    gpiod_request_config_free(order.request);
    gpiod_line_config_free(order.lines);
    gpiod_line_settings_free(order.settings);
    if (self->handle != NULL && !config->output) {
        self->buffer = gpiod_edge_event_buffer_new(1);
        if (self->buffer == NULL) {
            error = errno;
            gpiod_line_request_release(self->handle);
            self->handle = NULL;
        }
    }
    errno = error;
    return self->handle == NULL ? -1 : 0;
}

void gpio_part_release(struct gpio_libgpiod *self)
{
    if (self->buffer != NULL)
        gpiod_edge_event_buffer_free(self->buffer);
    gpiod_line_request_release(self->handle);
}

int gpio_part_get(struct gpio_libgpiod *self)
{
    return (int)gpiod_line_request_get_value(self->handle, self->offset);
}

int gpio_part_set(struct gpio_libgpiod *self, bool active)
{
    return gpiod_line_request_set_value(self->handle, self->offset,
                                        active ? GPIOD_LINE_VALUE_ACTIVE
                                               : GPIOD_LINE_VALUE_INACTIVE);
}

int gpio_part_descriptor(struct gpio_libgpiod *self)
{
    return gpiod_line_request_get_fd(self->handle);
}

int gpio_part_read(struct gpio_libgpiod *self, struct hal_gpio_event *event)
{
    if (gpiod_line_request_read_edge_events(self->handle, self->buffer, 1) != 1)
        return -1;
    struct gpiod_edge_event *edge =
        gpiod_edge_event_buffer_get_event(self->buffer, 0);
    event->t_ns = (int64_t)gpiod_edge_event_get_timestamp_ns(edge);
    event->active =
        gpiod_edge_event_get_event_type(edge) == GPIOD_EDGE_EVENT_RISING_EDGE;
    return 0;
}

#endif
