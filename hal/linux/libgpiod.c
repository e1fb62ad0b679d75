/* hal/linux/libgpiod.c - see libgpiod.h. */
#include "hal/linux/libgpiod.h"

#include <dirent.h>
#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "hal/linux/libgpiod_parts.h"
#include "hal/support/container_of.h"

#define DEVICES    "/dev"
#define PREFIX     "gpiochip"
#define DEVICE_MAX 64

static struct gpio_libgpiod *gpio_libgpiod_of(struct hal_gpio *gpio)
{
    return CONTAINER_OF(gpio, struct gpio_libgpiod, gpio);
}

static int gpio_libgpiod_get(struct hal_gpio *gpio)
{
    int value = gpio_part_get(gpio_libgpiod_of(gpio));
    return value < 0 ? MOTION_E_IO : value != 0;
}

static int gpio_libgpiod_set(struct hal_gpio *gpio, bool active)
{
    struct gpio_libgpiod *self = gpio_libgpiod_of(gpio);
    if (!self->output)
        return MOTION_E_STATE;
    return gpio_part_set(self, active) < 0 ? MOTION_E_IO : MOTION_OK;
}

static int gpio_libgpiod_event(struct hal_gpio *gpio,
                               struct hal_gpio_event *event)
{
    struct gpio_libgpiod *self = gpio_libgpiod_of(gpio);
    if (self->output)
        return MOTION_E_STATE;
    struct pollfd poll_for = { gpio_part_descriptor(self), POLLIN, 0 };
    int ready = poll(&poll_for, 1, 0);
    if (ready < 0 || (poll_for.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0)
        return MOTION_E_IO;
    if (ready == 0)
        return 0;
    return gpio_part_read(self, event) < 0 ? MOTION_E_IO : 1;
}

static const struct hal_gpio_ops gpio_libgpiod_ops = {
    .get = gpio_libgpiod_get,
    .set = gpio_libgpiod_set,
    .event = gpio_libgpiod_event,
};

/* --- which chip, which line --- */

struct gpio_search {
    const struct gpio_libgpiod_config *config;
    void *chip; /* found; open */
    uint64_t device;
    unsigned offset;
    unsigned found;
    bool chip_seen;
};

/* Number of the line on this chip: by name, or by number where the chip was
 * named; -1. */
static int gpio_search_line(const struct gpio_search *search, void *chip)
{
    int offset = gpio_part_find(chip, search->config->line);
    if (offset >= 0 || search->config->chip == NULL)
        return offset;
    char *end;
    errno = 0;
    unsigned long number = strtoul(search->config->line, &end, 10);
    if (errno != 0 || *end != 0 || end == search->config->line ||
        search->config->line[0] == '-' || number >= gpio_part_lines(chip))
        return -1;
    return (int)number;
}

static bool gpio_search_is_chip(const struct gpio_search *search, void *chip,
                                const char *path)
{
    const char *name = search->config->chip;
    return name == NULL || strcmp(name, path) == 0 || gpio_part_is(chip, name);
}

/* A link to a chip (boards have some for old names) is that chip. */
static void gpio_search_look(struct gpio_search *search, const char *path)
{
    struct stat status = { 0 };
    void *chip = gpio_part_open(path);
    if (chip == NULL)
        return;
    if (stat(path, &status) == 0 && gpio_search_is_chip(search, chip, path)) {
        search->chip_seen = true;
        int offset = gpio_search_line(search, chip);
        if (offset >= 0 &&
            !(search->found > 0 && search->device == status.st_rdev &&
              search->offset == (unsigned)offset) &&
            search->found++ == 0) {
            search->chip = chip;
            search->device = status.st_rdev;
            search->offset = (unsigned)offset;
            return;
        }
    }
    gpio_part_close(chip);
}

static void gpio_search_all(struct gpio_search *search)
{
    DIR *devices = opendir(DEVICES);
    if (devices == NULL)
        return;
    for (struct dirent *entry; (entry = readdir(devices)) != NULL;) {
        char path[DEVICE_MAX];
        if (strncmp(entry->d_name, PREFIX, strlen(PREFIX)) != 0 ||
            snprintf(path, sizeof path, "%s/%s", DEVICES, entry->d_name) >=
                (int)sizeof path)
            continue;
        gpio_search_look(search, path);
    }
    closedir(devices);
}

static int gpio_search_fail(const struct gpio_search *search,
                            char message[GPIO_LIBGPIOD_MESSAGE_MAX])
{
    const struct gpio_libgpiod_config *config = search->config;
    if (search->found > 1)
        snprintf(
            message, GPIO_LIBGPIOD_MESSAGE_MAX,
            "%u GPIO lines are called '%.60s', expected one: name the chip",
            search->found, config->line);
    else if (!search->chip_seen && config->chip != NULL)
        snprintf(message, GPIO_LIBGPIOD_MESSAGE_MAX,
                 "no GPIO chip '%.60s' that can be opened, expected one of "
                 "those that gpiodetect lists",
                 config->chip);
    else
        snprintf(message, GPIO_LIBGPIOD_MESSAGE_MAX,
                 "no GPIO line '%.60s' on %.60s, expected one of those that "
                 "gpioinfo lists",
                 config->line,
                 config->chip == NULL ? "any chip that can be opened"
                                      : config->chip);
    return MOTION_E_ARG;
}

/* --- open, close --- */

static int gpio_libgpiod_refused(struct gpio_libgpiod *self,
                                 const struct gpio_libgpiod_config *config,
                                 char message[GPIO_LIBGPIOD_MESSAGE_MAX])
{
    const int error = errno;
    char user[64];
    bool taken = gpio_part_user(self->chip, self->offset, user, sizeof user);
    if (error == EBUSY || taken)
        snprintf(message, GPIO_LIBGPIOD_MESSAGE_MAX,
                 "GPIO line '%.60s' is taken by '%s'", config->line,
                 user[0] == 0 ? "somebody" : user);
    else
        snprintf(message, GPIO_LIBGPIOD_MESSAGE_MAX,
                 "GPIO line '%.60s' cannot be had: %s", config->line,
                 strerror(error));
    return error == EBUSY || taken ? MOTION_E_STATE : MOTION_E_IO;
}

int gpio_libgpiod_open(struct gpio_libgpiod *self,
                       const struct gpio_libgpiod_config *config,
                       char message[GPIO_LIBGPIOD_MESSAGE_MAX])
{
    struct gpio_search search = { .config = config };
    *self = (struct gpio_libgpiod){ .gpio.ops = &gpio_libgpiod_ops,
                                    .output = config->output };
    gpio_search_all(&search);
    if (search.found != 1) {
        if (search.found > 1)
            gpio_part_close(search.chip);
        return gpio_search_fail(&search, message);
    }
    self->chip = search.chip;
    self->device = search.device;
    self->offset = search.offset;
    if (gpio_part_request(self, config) == 0)
        return MOTION_OK;
    int err = gpio_libgpiod_refused(self, config, message);
    gpio_part_close(self->chip);
    *self = (struct gpio_libgpiod){ .device = search.device,
                                    .offset = search.offset };
    return err;
}

void gpio_libgpiod_close(struct gpio_libgpiod *self)
{
    if (self->chip == NULL)
        return;
    if (self->output)
        (void)gpio_part_set(self, false);
    gpio_part_release(self);
    gpio_part_close(self->chip);
    *self = (struct gpio_libgpiod){ 0 };
}
