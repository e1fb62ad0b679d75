/* tests/hal/gpio/test_gpio_debounce.c - at the first sign, and late again. */
#include "hal/gpio/debounce.h"

#include "sim/bus/gpio.h"
#include "sim/world.h"
#include "tests/support/check.h"

#define MS INT64_C(1000000)

static struct sim_world world;
static struct sim_gpio switch_line;
static struct gpio_debounce input;

static int begin(void **state)
{
    (void)state;
    const struct sim_gpio_config config = { .clock = &world.clock };
    sim_world_init(&world, 1000 * MS);
    struct hal_gpio *line = sim_gpio_init(&switch_line, &config);
    return gpio_debounce_init(&input, line, 20 * MS);
}

static int after_ms(int ms)
{
    sim_world_run(&world, world.now_ns + ms * MS);
    gpio_debounce_step(&input, world.now_ns);
    return hal_gpio_get(&input.gpio);
}

static void before_the_first_look_it_is_active(void **state)
{
    (void)state;
    assert_int_equal(hal_gpio_get(&input.gpio), 1);
}

static void the_first_look_takes_the_level(void **state)
{
    (void)state;
    assert_int_equal(after_ms(1), 0);
}

static void a_switch_that_is_pressed_at_the_start_is_seen(void **state)
{
    (void)state;
    sim_gpio_drive(&switch_line, SIM_GPIO_HIGH);
    assert_int_equal(after_ms(1), 1);
}

static void active_at_once_inactive_when_quiet(void **state)
{
    (void)state;
    after_ms(1);
    sim_gpio_drive(&switch_line, SIM_GPIO_HIGH);
    assert_int_equal(after_ms(1), 1);
    sim_gpio_drive(&switch_line, SIM_GPIO_LOW);
    for (int i = 0; i < 19; i++)
        assert_int_equal(after_ms(1), 1);
    assert_int_equal(after_ms(1), 0);
}

static void bouncing_starts_the_quiet_anew(void **state)
{
    (void)state;
    after_ms(1);
    for (int i = 0; i < 5; i++) {
        sim_gpio_drive(&switch_line, SIM_GPIO_HIGH);
        assert_int_equal(after_ms(1), 1);
        sim_gpio_drive(&switch_line, SIM_GPIO_LOW);
        assert_int_equal(after_ms(18), 1);
    }
    assert_int_equal(after_ms(2), 0);
}

static void a_pulse_between_two_looks_is_seen(void **state)
{
    (void)state;
    struct hal_gpio_event event;
    after_ms(1);
    const int64_t pressed_ns = world.now_ns;
    sim_gpio_drive(&switch_line, SIM_GPIO_HIGH);
    sim_gpio_drive(&switch_line, SIM_GPIO_LOW);
    assert_int_equal(after_ms(1), 1);
    assert_int_equal(hal_gpio_event(&input.gpio, &event), 1);
    assert_true(event.active);
    assert_int_equal(event.t_ns, pressed_ns);
    assert_int_equal(hal_gpio_event(&input.gpio, &event), 0);
    assert_int_equal(after_ms(20), 0);
    assert_int_equal(hal_gpio_event(&input.gpio, &event), 1);
    assert_false(event.active);
}

static void a_dead_chip_is_an_error_until_it_is_quiet(void **state)
{
    (void)state;
    after_ms(1);
    sim_gpio_drive(&switch_line, SIM_GPIO_DEAD);
    assert_int_equal(after_ms(1), MOTION_E_IO);
    sim_gpio_drive(&switch_line, SIM_GPIO_LOW);
    assert_true(after_ms(1) != 0);
    assert_int_equal(after_ms(20), 0);
}

static void it_cannot_be_set_and_times_are_bounded(void **state)
{
    (void)state;
    assert_int_equal(hal_gpio_set(&input.gpio, true), MOTION_E_STATE);
    assert_int_equal(
        gpio_debounce_init(&input, &switch_line.gpio, INT64_C(10000000001)),
        MOTION_E_ARG);
    assert_int_equal(gpio_debounce_init(&input, &switch_line.gpio, -1),
                     MOTION_E_ARG);
}

#define RUN(test) cmocka_unit_test_setup(test, begin)

int main(void)
{
    const struct CMUnitTest tests[] = {
        RUN(before_the_first_look_it_is_active),
        RUN(the_first_look_takes_the_level),
        RUN(a_switch_that_is_pressed_at_the_start_is_seen),
        RUN(active_at_once_inactive_when_quiet),
        RUN(bouncing_starts_the_quiet_anew),
        RUN(a_pulse_between_two_looks_is_seen),
        RUN(a_dead_chip_is_an_error_until_it_is_quiet),
        RUN(it_cannot_be_set_and_times_are_bounded),
    };
    return cmocka_run_group_tests_name("gpio_debounce", tests, NULL, NULL);
}
