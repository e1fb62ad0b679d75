/* tests/firmware/control/test_trigger.c - pulses at times of the path: none
 * missed, none twice, whatever the path's time does. */
#include "firmware/control/trigger.h"

#include <string.h>

#include "tests/support/check.h"

#define MS  INT64_C(1000000)
#define Q12 INT64_C(4096)

struct fake_line {
    struct hal_gpio gpio;
    bool active, dead;
    unsigned pulses;
};

static int fake_set(struct hal_gpio *gpio, bool active)
{
    struct fake_line *line = (struct fake_line *)gpio;
    if (line->dead)
        return MOTION_E_IO;
    assert_true(active != line->active); /* every set is a change */
    line->active = active;
    line->pulses += active;
    return MOTION_OK;
}

static const struct hal_gpio_ops fake_ops = { .set = fake_set };

static struct fake_line line;
static struct trigger trigger;

static void begin(int64_t width_ms, int64_t rest_ms)
{
    const struct trigger_config config = { width_ms * MS, rest_ms * MS };
    line = (struct fake_line){ .gpio.ops = &fake_ops };
    assert_int_equal(trigger_init(&trigger, &line.gpio, &config), MOTION_OK);
}

static uint32_t step_ms(int64_t s_ms, int64_t now_ms)
{
    return trigger_step(&trigger, s_ms * MS * Q12, now_ms * MS);
}

static void a_pulse_has_its_width(void **state)
{
    static const int64_t at[] = { 10 * MS * Q12 };
    (void)state;
    begin(5, 0);
    trigger_arm(&trigger, at, 1);
    for (int64_t t = 0; t < 30; t++) {
        assert_int_equal(step_ms(t, 100 + t), t == 10);
        assert_int_equal(line.active, t >= 10 && t < 15);
    }
    assert_true(trigger_is_idle(&trigger, 30 * MS * Q12));
}

static void a_time_between_two_ticks_is_the_next_tick(void **state)
{
    static const int64_t at[] = { 10 * MS * Q12 + 1 };
    (void)state;
    begin(1, 0);
    trigger_arm(&trigger, at, 1);
    assert_int_equal(step_ms(10, 10), 0);
    assert_int_equal(step_ms(11, 11), 1);
}

static void shots_that_are_too_close_follow_one_another(void **state)
{
    static const int64_t at[] = { 0, 0, 1 * MS * Q12 };
    int64_t fired[3] = { 0 };
    unsigned count = 0;
    (void)state;
    begin(4, 3);
    trigger_arm(&trigger, at, 3);
    for (int64_t t = 0; t < 40; t++)
        if (step_ms(t, t) > 0)
            fired[count++] = t;
    assert_int_equal(count, 3);
    assert_int_equal(fired[0], 0);
    assert_int_equal(fired[1], 7);
    assert_int_equal(fired[2], 14);
    assert_int_equal(line.pulses, 3);
}

static void a_dead_line_is_counted_and_stops_nothing(void **state)
{
    static const int64_t at[] = { 1 * MS * Q12, 9 * MS * Q12 };
    (void)state;
    begin(2, 0);
    line.dead = true;
    trigger_arm(&trigger, at, 2);
    for (int64_t t = 0; t < 5; t++)
        (void)step_ms(t, t);
    assert_int_equal(trigger.failures, 2); /* on and off */
    line.dead = false;
    for (int64_t t = 5; t < 15; t++)
        (void)step_ms(t, t);
    assert_int_equal(trigger.failures, 2);
    assert_int_equal(line.pulses, 1);
}

static void the_end_ends_a_pulse(void **state)
{
    static const int64_t at[] = { 0, 50 * MS * Q12 };
    (void)state;
    begin(20, 0);
    trigger_arm(&trigger, at, 2);
    assert_int_equal(step_ms(0, 0), 1);
    trigger_end(&trigger);
    assert_false(line.active);
    for (int64_t t = 1; t < 100; t++)
        assert_int_equal(step_ms(t, t), 0);
}

/* Holds, overrides and lost ticks: the path's time stands, runs, leaps. */
static void whatever_time_does_each_shot_is_fired_once(void **state)
{
    (void)state;
    seed_from("trigger");
    for (int round = 0; round < 200; round++) {
        static int64_t at[500];
        int64_t s = 0, now = 1000 * MS, last = 0;
        uint32_t expected = 1;
        for (unsigned i = 0; i < 500; i++)
            at[i] = (last += (int64_t)(draw() % 40000000)) * Q12;
        begin((int64_t)(draw() % 12), (int64_t)(draw() % 5));
        trigger_arm(&trigger, at, 500);
        for (int tick = 0; expected <= 500; tick++) {
            const uint32_t number = trigger_step(&trigger, s, now);
            if (number > 0) {
                assert_int_equal(number, expected);
                assert_true(at[number - 1] <= s);
                expected++;
            }
            assert_true(tick < 100000);
            now += MS * (int64_t)(1 + (draw() % 50 == 0 ? draw() % 9 : 0));
            if (draw() % 4 != 0) /* else a hold */
                s += (int64_t)(draw() % 2000000) * Q12;
        }
        for (int i = 0; i < 30; i++) {
            now += MS;
            assert_int_equal(trigger_step(&trigger, s, now), 0);
        }
        assert_int_equal(line.pulses, 500);
        assert_false(line.active);
    }
}

static void times_below_zero_are_refused(void **state)
{
    const struct trigger_config bad[] = { { -1, 0 }, { 0, -1 } };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(bad); i++)
        assert_int_equal(trigger_init(&trigger, &line.gpio, &bad[i]),
                         MOTION_E_ARG);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_pulse_has_its_width),
        cmocka_unit_test(a_time_between_two_ticks_is_the_next_tick),
        cmocka_unit_test(shots_that_are_too_close_follow_one_another),
        cmocka_unit_test(a_dead_line_is_counted_and_stops_nothing),
        cmocka_unit_test(the_end_ends_a_pulse),
        cmocka_unit_test(whatever_time_does_each_shot_is_fired_once),
        cmocka_unit_test(times_below_zero_are_refused),
    };
    return cmocka_run_group_tests_name("trigger", tests, NULL, NULL);
}
