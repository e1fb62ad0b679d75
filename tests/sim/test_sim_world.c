/* tests/sim/test_sim_world.c - virtual time, and simulated lines. */
#include "sim/bus/gpio.h"
#include "tests/sim/bus/sim_bus.h"

/* A member that ticks and writes its name into a log. */
struct ticker {
    struct sim_member member;
    char name;
    int64_t next_ns, period_ns;
    struct ticker *wakes; /* is due at once after it; NULL: nobody */
};

static char ticks[64];

static int64_t ticker_due_ns(const struct sim_member *member)
{
    return CONTAINER_OF_CONST(member, struct ticker, member)->next_ns;
}

static void ticker_run(struct sim_member *member, int64_t now_ns)
{
    struct ticker *ticker = CONTAINER_OF(member, struct ticker, member);
    size_t len = strlen(ticks);

    assert_true(now_ns >= ticker->next_ns);
    assert_true(len + 1 < sizeof(ticks));
    ticks[len] = ticker->name;
    ticks[len + 1] = 0;
    ticker->next_ns = ticker->period_ns ? ticker->next_ns + ticker->period_ns
                                        : SIM_WORLD_NEVER;
    if (ticker->wakes != NULL)
        ticker->wakes->next_ns = now_ns;
}

static const struct sim_member_ops ticker_ops = {
    .due_ns = ticker_due_ns,
    .run = ticker_run,
};

static struct ticker ticker(char name, int64_t next_ns, int64_t period_ns)
{
    ticks[0] = 0;
    return (struct ticker){ .member.ops = &ticker_ops,
                            .name = name,
                            .next_ns = next_ns,
                            .period_ns = period_ns };
}

static void members_run_in_the_order_of_time(void **state)
{
    struct sim_world world;
    struct ticker a = ticker('a', 5, 3), b = ticker('b', 4, 0);

    (void)state;
    sim_world_init(&world, 0);
    sim_world_add(&world, &a.member);
    sim_world_add(&world, &b.member);
    sim_world_run(&world, 12);
    assert_string_equal(ticks, "baaa");
    assert_int_equal(world.now_ns, 12);
}

static void ties_run_in_the_order_of_adding(void **state)
{
    struct sim_world world;
    struct ticker a = ticker('a', 2, 2), b = ticker('b', 2, 2);

    (void)state;
    sim_world_init(&world, 0);
    sim_world_add(&world, &b.member);
    sim_world_add(&world, &a.member);
    sim_world_run(&world, 4);
    assert_string_equal(ticks, "baba");
}

static void running_includes_the_end_and_only_that(void **state)
{
    struct sim_world world;
    struct ticker a = ticker('a', 10, 0);

    (void)state;
    sim_world_init(&world, 0);
    sim_world_add(&world, &a.member);
    sim_world_run(&world, 9);
    assert_string_equal(ticks, "");
    sim_world_run(&world, 10);
    assert_string_equal(ticks, "a");
}

static void what_is_overdue_runs_at_once_and_time_never_goes_back(void **state)
{
    struct sim_world world;
    struct ticker a = ticker('a', 3, 0);

    (void)state;
    sim_world_init(&world, 100);
    sim_world_add(&world, &a.member);
    sim_world_run(&world, 50);
    assert_int_equal(world.now_ns, 100);
    assert_string_equal(ticks, "");
    sim_world_run(&world, 100);
    assert_string_equal(ticks, "a");
    assert_int_equal(world.now_ns, 100);
}

static void the_clock_of_the_world_waits_by_running_it(void **state)
{
    struct sim_world world;
    struct ticker a = ticker('a', 10, 10);

    (void)state;
    sim_world_init(&world, 7);
    sim_world_add(&world, &a.member);
    assert_int_equal(hal_clock_now_ns(&world.clock), 7);
    assert_int_equal(hal_clock_wait_until(&world.clock, 30), MOTION_OK);
    assert_int_equal(hal_clock_now_ns(&world.clock), 30);
    assert_string_equal(ticks, "aaa");
    assert_int_equal(hal_clock_wait_until(&world.clock, 20), MOTION_OK);
    assert_int_equal(hal_clock_now_ns(&world.clock), 30);
}

static void a_member_without_operations_is_refused(void **s)
{
    struct sim_world world;
    struct sim_group group = { 0 };
    struct sim_member empty = { 0 };

    (void)s;
    sim_world_init(&world, 0);
    assert_int_equal(sim_world_add(&world, &empty), MOTION_E_ARG);
    assert_null(world.alone.first);
    assert_int_equal(sim_world_add_to(&world, &group, &empty), MOTION_E_ARG);
    assert_null(world.first);
}

static void ties_in_groups_too_run_in_the_order_of_adding(void **state)
{
    struct sim_world world;
    struct sim_group even = { 0 }, odd = { 0 };
    struct ticker a = ticker('a', 2, 2), b = ticker('b', 2, 2),
                  c = ticker('c', 2, 2), d = ticker('d', 2, 2);

    (void)state;
    sim_world_init(&world, 0);
    sim_world_add_to(&world, &even, &d.member);
    sim_world_add_to(&world, &odd, &c.member);
    sim_world_add(&world, &b.member);
    sim_world_add_to(&world, &even, &a.member);
    sim_world_run(&world, 4);
    assert_string_equal(ticks, "dcbadcba");
}

/* Nobody stands outside of a group: each is run to the end, from the begin on, and
 * one that has nothing to do holds nobody up. */
static void groups_alone_run_one_after_the_other(void **state)
{
    struct sim_world world;
    struct sim_group twos = { 0 }, threes = { 0 }, none = { 0 };
    struct ticker a = ticker('a', 2, 2), b = ticker('b', 3, 3),
                  c = ticker('c', 3, 3), n = ticker('n', SIM_WORLD_NEVER, 0);

    (void)state;
    sim_world_init(&world, 0);
    sim_world_add_to(&world, &none, &n.member);
    sim_world_add_to(&world, &twos, &a.member);
    sim_world_add_to(&world, &threes, &b.member);
    sim_world_add_to(&world, &twos, &c.member);
    sim_world_run(&world, 6);
    assert_string_equal(ticks, "acaacbb");
    assert_int_equal(world.now_ns, 6);
    b.next_ns = 5; /* overdue: at once */
    sim_world_run(&world, 7);
    assert_string_equal(ticks, "acaacbbb");
    assert_int_equal(world.now_ns, 7);
}

/* One wakes another that would have slept for ever. */
static void what_a_member_wakes_runs_at_once(void **state)
{
    struct sim_world world;
    struct sim_group group = { 0 }, other = { 0 };
    struct ticker sleeper = ticker('s', SIM_WORLD_NEVER, 0);
    struct ticker lone = ticker('l', 3, 0);
    struct ticker beside = ticker('b', 5, 0), last = ticker('z', 7, 0);

    (void)state;
    sim_world_init(&world, 0);
    sim_world_add(&world, &lone.member);
    sim_world_add_to(&world, &group, &sleeper.member);
    sim_world_add_to(&world, &group, &beside.member);
    sim_world_add_to(&world, &other, &last.member);
    lone.wakes = beside.wakes = &sleeper; /* from outside, from within */
    last.wakes = &lone;
    sim_world_run(&world, 100);
    assert_string_equal(ticks, "lsbszls");
    sleeper.next_ns = 100; /* between two runs */
    assert_int_equal(sim_world_due_ns(&world), 100);
    sim_world_run(&world, 100);
    assert_string_equal(ticks, "lsbszlss");
}

/* ---- lines ------------------------------------------------------------- */

static const struct {
    const char *name;
    bool active_low, pull_up;
    enum sim_gpio_level level;
    int want;
} lines[] = {
    { "high, active high", false, false, SIM_GPIO_HIGH, 1 },
    { "low, active high", false, false, SIM_GPIO_LOW, 0 },
    { "high, active low", true, false, SIM_GPIO_HIGH, 0 },
    { "low, active low", true, true, SIM_GPIO_LOW, 1 },
    { "broken wire, normally closed to ground", false, true, SIM_GPIO_OPEN, 1 },
    { "broken wire, normally open to ground", true, true, SIM_GPIO_OPEN, 0 },
    { "open, pulled down", false, false, SIM_GPIO_OPEN, 0 },
    { "dead chip", false, false, SIM_GPIO_DEAD, MOTION_E_IO },
};

static void a_line_reads_as_its_level_pull_and_polarity_say(void **state)
{
    (void)state;
    struct sim_world world;
    sim_world_init(&world, 0);
    for (size_t i = 0; i < ARRAY_LEN(lines); i++) {
        const struct sim_gpio_config config = { .clock = &world.clock,
                                                .active_low =
                                                    lines[i].active_low,
                                                .pull_up = lines[i].pull_up };
        struct sim_gpio line;
        struct hal_gpio *gpio = sim_gpio_init(&line, &config);

        sim_gpio_drive(&line, lines[i].level);
        if (hal_gpio_get(gpio) != lines[i].want)
            fail_msg("%s: got %d", lines[i].name, hal_gpio_get(gpio));
    }
}

static void only_an_output_can_be_set(void **state)
{
    struct sim_world world;
    struct sim_gpio in, out;
    (void)state;
    sim_world_init(&world, 0);
    struct hal_gpio *input =
        sim_gpio_init(&in, &(struct sim_gpio_config){ .clock = &world.clock });
    struct hal_gpio *output = sim_gpio_init(
        &out, &(struct sim_gpio_config){
                  .clock = &world.clock, .output = true, .active_low = true });

    assert_int_equal(hal_gpio_set(input, true), MOTION_E_STATE);
    assert_int_equal(hal_gpio_get(output), 0);
    assert_int_equal(out.level, SIM_GPIO_HIGH);
    assert_int_equal(hal_gpio_set(output, true), MOTION_OK);
    assert_int_equal(out.level, SIM_GPIO_LOW);
    assert_int_equal(hal_gpio_get(output), 1);
    sim_gpio_drive(&out, SIM_GPIO_DEAD);
    assert_int_equal(hal_gpio_set(output, false), MOTION_E_IO);
}

static void a_camera_counts_the_pulses_of_its_output(void **state)
{
    struct sim_world world;
    struct sim_gpio line;
    (void)state;
    sim_world_init(&world, 0);
    struct hal_gpio *output =
        sim_gpio_init(&line, &(struct sim_gpio_config){ .clock = &world.clock,
                                                        .output = true });
    static const int64_t pulse[][2] = { { 10, 20 }, { 35, 38 }, { 90, 95 } };
    for (size_t i = 0; i < ARRAY_LEN(pulse); i++)
        for (int edge = 0; edge < 2; edge++) {
            (void)hal_clock_wait_until(&world.clock, pulse[i][edge]);
            assert_int_equal(hal_gpio_set(output, edge == 0), MOTION_OK);
            /* told again, it is no other pulse */
            assert_int_equal(hal_gpio_set(output, edge == 0), MOTION_OK);
        }
    assert_int_equal(line.camera.pictures, 3);
    assert_int_equal(line.camera.first_ns, 10);
    assert_int_equal(line.camera.last_ns, 90);
    assert_int_equal(line.camera.closest_ns, 25);
    assert_int_equal(line.camera.shortest_ns, 3);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(members_run_in_the_order_of_time),
        cmocka_unit_test(ties_run_in_the_order_of_adding),
        cmocka_unit_test(running_includes_the_end_and_only_that),
        cmocka_unit_test(what_is_overdue_runs_at_once_and_time_never_goes_back),
        cmocka_unit_test(the_clock_of_the_world_waits_by_running_it),
        cmocka_unit_test(a_member_without_operations_is_refused),
        cmocka_unit_test(ties_in_groups_too_run_in_the_order_of_adding),
        cmocka_unit_test(groups_alone_run_one_after_the_other),
        cmocka_unit_test(what_a_member_wakes_runs_at_once),
        cmocka_unit_test(a_line_reads_as_its_level_pull_and_polarity_say),
        cmocka_unit_test(only_an_output_can_be_set),
        cmocka_unit_test(a_camera_counts_the_pulses_of_its_output),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
