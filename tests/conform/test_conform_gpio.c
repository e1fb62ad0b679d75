/* tests/conform/test_conform_gpio.c - the claims of conform_gpio.h on every
 * kind of line.
 *
 *   test_conform_gpio              simulated lines; refusals of libgpiod's
 *   test_conform_gpio LINE SIM     the named line of a gpio-sim chip, whose other
 *                                  side are the files SIM/pull and SIM/value;
 *                                  as root (make test-vm) */
#include "tests/conform/conform_gpio.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "hal/linux/clock.h"
#include "hal/linux/libgpiod.h"
#include "sim/bus/gpio.h"
#include "sim/world.h"

/* ---- simulated ---- */

struct simulated {
    struct sim_world world;
    struct sim_gpio line;
};

static struct hal_gpio *simulated_open(struct conform_gpio *chip,
                                       const struct conform_gpio_line *line)
{
    struct simulated *self = chip->context;
    const struct sim_gpio_config config = {
        .clock = &self->world.clock,
        .output = line->output,
        .active_low = line->active_low,
        .pull_up = line->bias == HAL_GPIO_PULL_UP,
    };
    return sim_gpio_init(&self->line, &config);
}

static void simulated_close(struct conform_gpio *chip)
{
    (void)chip;
}

static void simulated_drive(struct conform_gpio *chip, bool high)
{
    struct simulated *self = chip->context;
    sim_gpio_drive(&self->line, high ? SIM_GPIO_HIGH : SIM_GPIO_LOW);
}

static bool simulated_is_high(struct conform_gpio *chip)
{
    return ((struct simulated *)chip->context)->line.level == SIM_GPIO_HIGH;
}

static int64_t simulated_now_ns(struct conform_gpio *chip)
{
    return ((struct simulated *)chip->context)->world.now_ns;
}

static void simulated_pass(struct conform_gpio *chip)
{
    struct simulated *self = chip->context;
    sim_world_run(&self->world, self->world.now_ns + 1000000);
}

static int on_simulated(void)
{
    static struct simulated self;
    struct conform_gpio chip = {
        .name = "simulated",
        .open = simulated_open,
        .close = simulated_close,
        .drive = simulated_drive,
        .is_high = simulated_is_high,
        .now_ns = simulated_now_ns,
        .pass = simulated_pass,
        .context = &self,
    };
    sim_world_init(&self.world, 1000000000);
    return conform_gpio(&chip);
}

/* ---- gpio-sim ---- */

struct real {
    const char *name, *files;
    struct gpio_libgpiod line;
    struct clock_linux clock;
};

static FILE *real_file(struct conform_gpio *chip, const char *name,
                       const char *mode)
{
    struct real *self = chip->context;
    char path[256];
    snprintf(path, sizeof path, "%s/%s", self->files, name);
    FILE *file = fopen(path, mode);
    if (file == NULL)
        fail_msg("%s cannot be opened", path);
    return file;
}

static struct hal_gpio *real_open(struct conform_gpio *chip,
                                  const struct conform_gpio_line *line)
{
    struct real *self = chip->context;
    char message[GPIO_LIBGPIOD_MESSAGE_MAX] = "";
    const struct gpio_libgpiod_config config = {
        .line = self->name,
        .consumer = "conform",
        .output = line->output,
        .active_low = line->active_low,
        .bias = line->bias,
    };
    gpio_libgpiod_close(&self->line);
    if (gpio_libgpiod_open(&self->line, &config, message) < 0)
        fail_msg("%s", message);
    return &self->line.gpio;
}

static void real_close(struct conform_gpio *chip)
{
    gpio_libgpiod_close(&((struct real *)chip->context)->line);
}

static void real_drive(struct conform_gpio *chip, bool high)
{
    FILE *file = real_file(chip, "pull", "w");
    fputs(high ? "pull-up" : "pull-down", file);
    assert_int_equal(fclose(file), 0);
}

static bool real_is_high(struct conform_gpio *chip)
{
    FILE *file = real_file(chip, "value", "r");
    int level = fgetc(file);
    fclose(file);
    return level == '1';
}

static int64_t real_now_ns(struct conform_gpio *chip)
{
    return hal_clock_now_ns(&((struct real *)chip->context)->clock.clock);
}

static void real_pass(struct conform_gpio *chip)
{
    struct real *self = chip->context;
    (void)hal_clock_wait_until(&self->clock.clock, real_now_ns(chip) + 1000000);
}

static struct real real;

/* Somebody else has the line. */
static void a_taken_line_is_refused_with_its_user(void **state)
{
    (void)state;
    char message[GPIO_LIBGPIOD_MESSAGE_MAX] = "";
    struct gpio_libgpiod first = { 0 }, second = { 0 };
    struct gpio_libgpiod_config config = { .line = real.name,
                                           .consumer = "somebody else" };
    assert_int_equal(gpio_libgpiod_open(&first, &config, message), MOTION_OK);
    config.consumer = "us";
    assert_int_equal(gpio_libgpiod_open(&second, &config, message),
                     MOTION_E_STATE);
    assert_non_null(strstr(message, "is taken by 'somebody else'"));
    gpio_libgpiod_close(&second);
    gpio_libgpiod_close(&first);
    assert_int_equal(gpio_libgpiod_open(&second, &config, message), MOTION_OK);
    gpio_libgpiod_close(&second);
}

static int on_real(const char *name, const char *files)
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_taken_line_is_refused_with_its_user),
    };
    struct conform_gpio chip = {
        .name = name,
        .open = real_open,
        .close = real_close,
        .drive = real_drive,
        .is_high = real_is_high,
        .now_ns = real_now_ns,
        .pass = real_pass,
        .context = &real,
    };
    real.name = name;
    real.files = files;
    clock_linux_init(&real.clock);
    return conform_gpio(&chip) + cmocka_run_group_tests(tests, NULL, NULL);
}

/* ---- what is not there ---- */

static void a_line_that_is_not_there_is_named(void **state)
{
    (void)state;
    char message[GPIO_LIBGPIOD_MESSAGE_MAX] = "";
    struct gpio_libgpiod line;
    struct gpio_libgpiod_config config = { .line = "no such line" };
    assert_int_equal(gpio_libgpiod_open(&line, &config, message), MOTION_E_ARG);
    assert_non_null(strstr(message, "no GPIO line 'no such line' on any chip"));
    config.chip = "no such chip";
    assert_int_equal(gpio_libgpiod_open(&line, &config, message), MOTION_E_ARG);
    assert_non_null(strstr(message, "no GPIO chip 'no such chip'"));
    gpio_libgpiod_close(&line); /* nothing to let go */
}

int main(int argc, char *argv[])
{
    static const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_line_that_is_not_there_is_named),
    };
    if (argc == 3)
        return on_real(argv[1], argv[2]);
    return on_simulated() +
           cmocka_run_group_tests_name("libgpiod", tests, NULL, NULL);
}
