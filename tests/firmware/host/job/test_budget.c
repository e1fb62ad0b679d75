/* tests/firmware/host/job/test_budget.c - what the arithmetic says of a bus,
 * and what the simulated wire then carries. */
#include <string.h>

#include "firmware/host/job/budget.h"
#include "firmware/linux/commands/planning.h"
#include "firmware/linux/machine/machine_sim.h"
#include "firmware/linux/player/player.h"
#include "tests/support/check.h"

static struct job job;
static struct machine_sim sim;
static struct machine machine;
static struct player player;
static struct report report;
static struct trace trace;

static int open_job(const char *name)
{
    const char *const path[] = { name };
    memset(&job, 0, sizeof job);
    return planning_open(&job, path, 1, false) == STATUS_OK ? 0 : -1;
}

static int open_eight_axes(void **state)
{
    (void)state;
    return open_job("tests/data/eight_axes");
}

static int close_eight_axes(void **state)
{
    (void)state;
    job_free(&job);
    return 0;
}

/* A ninth like the eighth, on the first bus. */
static void add_ninth(struct rig *rig)
{
    static struct rig_axis axis[9];
    memcpy(axis, job.rig.axis, 8 * sizeof *axis);
    *rig = job.rig;
    rig->axis = axis;
    rig->axis[8] = rig->axis[7];
    rig->axis[8].bus = 0;
    rig->axis[8].node_id = 9;
    rig->axis_count = 9;
}

static void bits_are_those_of_the_worst_frames(void **state)
{
    (void)state;
    struct budget budget;
    budget_of(&job.rig, 0, NULL, &budget);
    assert_int_equal(budget.count, 2 + 3 * 4);
    assert_string_equal(budget.item[0].what, "SYNC");
    /* no data: 47 + 33 / 4; six bytes: 47 + 48 + 81 / 4 */
    assert_int_equal(budget.item[0].most_bits, 55);
    assert_int_equal(budget.item[2].most_bits, 115);
    /* per second 1000 SYNC, 30 + 4 x 10 heartbeats of 65, 8000 PDOs */
    double bits = 1000 * 55 + 30.00000003 * 65 + 40 * 65 + 8000 * 115;
    assert_true(budget.most > bits / 1e6 - 1e-9);
    assert_true(budget.most < bits / 1e6 + 1e-9);
    assert_true(budget_fits(&budget));
    budget_free(&budget);
}

static void play(void)
{
    char message[YAML_MESSAGE_MAX] = "";
    struct machine_ports ports;
    const struct player_config config = {
        .override_q30 = MOTION_CLOCK_WARP_ONE_Q30,
        .hold_at_ns = -1,
    };
    const struct player_observer observer = { .trace = &trace,
                                              .report = &report };
    volatile sig_atomic_t interrupts = 0;
    assert_int_equal(machine_sim_init(&sim, &job.rig, false, &ports, message),
                     MOTION_OK);
    trace_init(&trace, &job.rig);
    report_init(&report, &job);
    assert_int_equal(machine_init(&machine, &job.rig, &ports, message),
                     MOTION_OK);
    player_init(&player, &machine, &job, &config, &observer);
    assert_int_equal(player_run(&player, &interrupts), 0);
    trace_free(&trace);
    assert_int_equal(report.end, REPORT_DONE);
}

static void expect_load_as_computed(void)
{
    for (unsigned i = 0; i < job.rig.bus_count; i++) {
        struct budget budget;
        budget_of(&job.rig, i, &job, &budget);
        print_message("bus %u: %.4f %% counted, %.4f %% expected\n", i,
                      100 * report.bus[i].load, 100 * budget.expected);
        assert_true(report.bus[i].load > 0.99 * budget.expected);
        assert_true(report.bus[i].load < 1.01 * budget.expected);
        assert_true(report.bus[i].load < budget.most);
        budget_free(&budget);
    }
}

static void eight_axes_load_two_buses_as_computed(void **state)
{
    (void)state;
    play();
    expect_load_as_computed();
}

/* One of each kind, at several ticks; the ODrive asked for its torque too. */
static void drives_that_count_turns_load_theirs_as_computed(void **state)
{
    static const int64_t tick_ns[] = { 1000000, 2000000, 4000000, 20000000 };
    (void)state;
    for (size_t i = 0; i < 2 * ARRAY_LEN(tick_ns); i++) {
        job_free(&job);
        assert_int_equal(open_job("examples/odrive"), 0);
        job.rig.period_ns = tick_ns[i / 2];
        job.rig.axis[0].rated_torque_mnm = i % 2 == 0 ? 0 : 650;
        play();
        expect_load_as_computed();
    }
    job_free(&job);
    assert_int_equal(open_job("tests/data/eight_axes"), 0);
}

static void a_ninth_does_not_fit_and_what_would_is_said(void **state)
{
    (void)state;
    static struct rig rig;
    struct budget budget;
    char advice[BUDGET_ADVICE_MAX];
    add_ninth(&rig);
    budget_of(&rig, 0, NULL, &budget);
    assert_false(budget_fits(&budget));
    budget_advice(&budget, advice);
    assert_string_equal(
        advice, "4 drives on this bus, a tick of 1.22 ms, or another bus");
    budget_free(&budget);
}

/* What the advice says has to be true. */
static void the_advice_fits_and_a_little_more_does_not(void **state)
{
    (void)state;
    static struct rig rig;
    struct budget budget;
    add_ninth(&rig);
    rig.period_ns = 1220000;
    budget_of(&rig, 0, NULL, &budget);
    assert_true(budget_fits(&budget));
    rig.period_ns = 1210000;
    budget_free(&budget);
    budget_of(&rig, 0, NULL, &budget);
    assert_false(budget_fits(&budget));
    budget_free(&budget);
}

static void a_faster_bus_is_proposed_where_there_is_one(void **state)
{
    (void)state;
    static struct rig rig;
    struct budget budget;
    char advice[BUDGET_ADVICE_MAX];
    struct rig_bus bus[2];
    memcpy(bus, job.rig.bus, sizeof bus);
    rig = job.rig;
    rig.bus = bus;
    rig.bus[0].bit_rate = 500000;
    budget_of(&rig, 0, NULL, &budget);
    assert_false(budget_fits(&budget));
    budget_advice(&budget, advice);
    assert_string_equal(
        advice, "1 drive on this bus, a tick of 1.97 ms, or 1000 kbit/s");
    rig.bus[0].bit_rate = 10000; /* SYNC alone is too much */
    budget_free(&budget);
    budget_of(&rig, 0, NULL, &budget);
    budget_advice(&budget, advice);
    assert_string_equal(advice, "1000 kbit/s");
    budget_free(&budget);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bits_are_those_of_the_worst_frames),
        cmocka_unit_test(eight_axes_load_two_buses_as_computed),
        cmocka_unit_test(drives_that_count_turns_load_theirs_as_computed),
        cmocka_unit_test(a_ninth_does_not_fit_and_what_would_is_said),
        cmocka_unit_test(the_advice_fits_and_a_little_more_does_not),
        cmocka_unit_test(a_faster_bus_is_proposed_where_there_is_one),
    };
    return cmocka_run_group_tests_name("budget", tests, open_eight_axes,
                                       close_eight_axes);
}
