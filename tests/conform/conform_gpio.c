/* tests/conform/conform_gpio.c - see conform_gpio.h. */
#include "tests/conform/conform_gpio.h"

static struct conform_gpio *chip;

static const struct conform_gpio_line input_high = { .active_low = false },
                                      input_low = { .active_low = true },
                                      output_high = { .output = true },
                                      output_low = { .output = true,
                                                     .active_low = true };

/* An input that stands at `high`, with no edge waiting. */
static struct hal_gpio *open_input(const struct conform_gpio_line *line,
                                   bool high)
{
    struct hal_gpio *gpio = chip->open(chip, line);
    struct hal_gpio_event event;
    chip->drive(chip, high);
    while (hal_gpio_event(gpio, &event) == 1)
        ;
    return gpio;
}

static int close_line(void **state)
{
    (void)state;
    chip->close(chip);
    return 0;
}

static void an_input_reads_the_level(void **state)
{
    (void)state;
    struct hal_gpio *gpio = open_input(&input_high, false);
    assert_int_equal(hal_gpio_get(gpio), 0);
    chip->drive(chip, true);
    assert_int_equal(hal_gpio_get(gpio), 1);
    assert_int_equal(hal_gpio_get(gpio), 1);
}

static void active_low_turns_it_round(void **state)
{
    (void)state;
    struct hal_gpio *gpio = open_input(&input_low, false);
    assert_int_equal(hal_gpio_get(gpio), 1);
    chip->drive(chip, true);
    assert_int_equal(hal_gpio_get(gpio), 0);
}

static void expect_event(struct hal_gpio *gpio, bool active, int64_t since_ns)
{
    struct hal_gpio_event event;
    assert_int_equal(hal_gpio_event(gpio, &event), 1);
    assert_int_equal(event.active, active);
    assert_in_range(event.t_ns, since_ns, chip->now_ns(chip));
}

/* A pulse between two looks leaves two edges, oldest first, with their
 * times. */
static void pulse(const struct conform_gpio_line *line, bool first_active)
{
    struct hal_gpio_event event;
    struct hal_gpio *gpio = open_input(line, false);
    chip->pass(chip);
    int64_t up_ns = chip->now_ns(chip);
    chip->drive(chip, true);
    chip->pass(chip);
    int64_t down_ns = chip->now_ns(chip);
    chip->drive(chip, false);
    chip->pass(chip);
    expect_event(gpio, first_active, up_ns);
    expect_event(gpio, !first_active, down_ns);
    assert_int_equal(hal_gpio_event(gpio, &event), 0);
}

static void a_pulse_leaves_its_edges(void **state)
{
    (void)state;
    pulse(&input_high, true);
}

static void edges_of_active_low_are_of_activity(void **state)
{
    (void)state;
    pulse(&input_low, false);
}

static void a_storm_of_edges_ends_and_the_level_is_right(void **state)
{
    (void)state;
    struct hal_gpio_event event;
    struct hal_gpio *gpio = open_input(&input_high, false);
    for (unsigned i = 0; i < 201; i++)
        chip->drive(chip, i % 2 == 0);
    unsigned edges = 0;
    while (edges <= 201 && hal_gpio_event(gpio, &event) == 1)
        edges++;
    assert_in_range(edges, 16, 201);
    assert_int_equal(hal_gpio_get(gpio), 1);
}

static void an_input_cannot_be_set(void **state)
{
    (void)state;
    struct hal_gpio *gpio = open_input(&input_high, false);
    assert_int_equal(hal_gpio_set(gpio, true), MOTION_E_STATE);
    assert_int_equal(hal_gpio_get(gpio), 0);
}

static void an_output_starts_inactive_and_does_as_told(void **state)
{
    (void)state;
    struct hal_gpio *gpio = chip->open(chip, &output_high);
    assert_false(chip->is_high(chip));
    assert_int_equal(hal_gpio_get(gpio), 0);
    assert_int_equal(hal_gpio_set(gpio, true), MOTION_OK);
    assert_true(chip->is_high(chip));
    assert_int_equal(hal_gpio_get(gpio), 1);
    assert_int_equal(hal_gpio_set(gpio, false), MOTION_OK);
    assert_false(chip->is_high(chip));
}

static void an_output_active_low_is_high_at_rest(void **state)
{
    (void)state;
    struct hal_gpio *gpio = chip->open(chip, &output_low);
    assert_true(chip->is_high(chip));
    assert_int_equal(hal_gpio_get(gpio), 0);
    assert_int_equal(hal_gpio_set(gpio, true), MOTION_OK);
    assert_false(chip->is_high(chip));
}

static void an_output_has_no_edges(void **state)
{
    (void)state;
    struct hal_gpio_event event;
    struct hal_gpio *gpio = chip->open(chip, &output_high);
    assert_int_equal(hal_gpio_event(gpio, &event), MOTION_E_STATE);
}

#define CLAIM(test) cmocka_unit_test_teardown(test, close_line)

int conform_gpio(struct conform_gpio *on)
{
    static const struct CMUnitTest claims[] = {
        CLAIM(an_input_reads_the_level),
        CLAIM(active_low_turns_it_round),
        CLAIM(a_pulse_leaves_its_edges),
        CLAIM(edges_of_active_low_are_of_activity),
        CLAIM(a_storm_of_edges_ends_and_the_level_is_right),
        CLAIM(an_input_cannot_be_set),
        CLAIM(an_output_starts_inactive_and_does_as_told),
        CLAIM(an_output_active_low_is_high_at_rest),
        CLAIM(an_output_has_no_edges),
    };
    chip = on;
    return cmocka_run_group_tests_name(on->name, claims, NULL, NULL);
}
