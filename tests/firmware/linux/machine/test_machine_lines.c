/* tests/firmware/linux/machine/test_machine_lines.c - switches and lamps of a
 * rig, from the level on the wire to what the axes do. */
#include <string.h>

#include "firmware/host/base/array.h"
#include "tests/firmware/linux/machine/machine_bench.h"

#define MS INT64_C(1000000)

/* Of tests/data/lines, in the order of the file. */
enum { STOP, LOW, HIGH, LAMP };

static int open_job(void **state)
{
    (void)state;
    return job_setup("tests/data/lines");
}

static bool lamp_is_lit(void)
{
    return sim.line[LAMP].level == SIM_GPIO_HIGH;
}

static void get_ready(void)
{
    for (unsigned i = 0;
         machine.controller.axis[0].feedback.state != HAL_DRIVE_OFF; i++) {
        assert_true(i < 10000);
        ticks(1);
    }
    assert_int_equal(controller_enable(&machine.controller), MOTION_OK);
    until(CONTROLLER_READY);
}

static void get_moving(unsigned for_ticks)
{
    const struct motion_track *track[RIG_AXES_MAX] = { &job.track[0] };
    get_ready();
    assert_int_equal(controller_start(&machine.controller, track, NULL),
                     MOTION_OK);
    ticks(for_ticks);
    assert_int_equal(machine.controller.state, CONTROLLER_MOVING);
}

static void expect_stop(enum controller_fault fault, int axis)
{
    until(CONTROLLER_FAULT);
    assert_int_equal(machine.controller.fault.fault, fault);
    assert_int_equal(machine.controller.fault.axis, axis);
    ticks(200);
    assert_int_equal(machine.controller.state, CONTROLLER_FAULT);
    assert_int_equal(controller_enable(&machine.controller), MOTION_E_STATE);
}

static void the_lamp_is_lit_while_there_is_torque(void **state)
{
    (void)state;
    ticks(10);
    assert_false(lamp_is_lit());
    get_ready();
    assert_true(lamp_is_lit());
    assert_int_equal(controller_off(&machine.controller), MOTION_OK);
    ticks(2000);
    assert_false(lamp_is_lit());
}

static void the_estop_stops_in_the_next_tick_and_latches(void **state)
{
    (void)state;
    get_moving(700);
    sim_gpio_drive(&sim.line[STOP], SIM_GPIO_HIGH);
    ticks(1);
    assert_int_equal(machine.controller.fault.fault, CONTROLLER_FAULT_ESTOP);
    sim_gpio_drive(&sim.line[STOP], SIM_GPIO_LOW);
    expect_stop(CONTROLLER_FAULT_ESTOP, -1);
    assert_false(lamp_is_lit());
}

static void a_broken_wire_is_an_estop(void **state)
{
    (void)state;
    get_moving(700);
    sim_gpio_drive(&sim.line[STOP], SIM_GPIO_OPEN); /* pulled up */
    ticks(1);
    expect_stop(CONTROLLER_FAULT_ESTOP, -1);
}

static void a_blip_between_two_ticks_is_an_estop(void **state)
{
    (void)state;
    get_moving(700);
    sim_gpio_drive(&sim.line[STOP], SIM_GPIO_HIGH);
    sim_gpio_drive(&sim.line[STOP], SIM_GPIO_LOW);
    ticks(1);
    expect_stop(CONTROLLER_FAULT_ESTOP, -1);
}

static void no_reset_before_the_estop_has_been_let_go(void **state)
{
    (void)state;
    get_moving(700);
    sim_gpio_drive(&sim.line[STOP], SIM_GPIO_HIGH);
    expect_stop(CONTROLLER_FAULT_ESTOP, -1);
    assert_int_equal(controller_reset(&machine.controller), MOTION_E_STATE);
    sim_gpio_drive(&sim.line[STOP], SIM_GPIO_LOW);
    ticks(50);
    assert_int_equal(controller_reset(&machine.controller), MOTION_E_STATE);
    ticks(60); /* release: 100 ms */
    assert_int_equal(controller_reset(&machine.controller), MOTION_OK);
    until(CONTROLLER_OFF);
    ticks(500);
    assert_int_equal(machine.controller.state, CONTROLLER_OFF);
}

/* --- two channels --- */

static struct rig two_rig;
static struct rig_line two_line[4];

static int begin_two(void **state)
{
    (void)state;
    two_rig = job.rig;
    assert_int_equal(two_rig.line_count, ARRAY_LEN(two_line));
    memcpy(two_line, two_rig.line, sizeof two_line);
    two_rig.line = two_line;
    two_rig.line[HIGH].kind = RIG_LINE_ESTOP; /* the second channel */
    two_rig.line[HIGH].discrepancy_ns = 200 * MS;
    bench_build(&two_rig);
    sim_gpio_drive(&sim.line[STOP], SIM_GPIO_LOW);
    sim_gpio_drive(&sim.line[HIGH], SIM_GPIO_LOW);
    return 0;
}

static void press(int line, bool pressed)
{
    sim_gpio_drive(&sim.line[line], pressed ? SIM_GPIO_HIGH : SIM_GPIO_LOW);
}

static void either_of_two_channels_stops(void **state)
{
    (void)state;
    get_moving(700);
    press(HIGH, true);
    ticks(1);
    assert_int_equal(machine.controller.fault.fault, CONTROLLER_FAULT_ESTOP);
    press(STOP, true);
    expect_stop(CONTROLLER_FAULT_ESTOP, -1);
    press(HIGH, false);
    press(STOP, false);
    ticks(200);
    assert_int_equal(controller_reset(&machine.controller), MOTION_OK);
}

static void two_channels_that_disagree_are_said(void **state)
{
    (void)state;
    get_moving(700);
    press(STOP, true);
    expect_stop(CONTROLLER_FAULT_ESTOP, -1);
    ticks(10);
    assert_int_equal(machine.controller.fault.fault,
                     CONTROLLER_FAULT_ESTOP_CHANNELS);
    press(STOP, false);
    ticks(200);
    assert_int_equal(controller_reset(&machine.controller), MOTION_E_STATE);
    /* once with both, and the second of them in time */
    press(STOP, true);
    ticks(100);
    press(HIGH, true);
    ticks(100);
    press(STOP, false);
    press(HIGH, false);
    ticks(200);
    assert_int_equal(controller_reset(&machine.controller), MOTION_OK);
    until(CONTROLLER_OFF);
}

static void a_limit_switch_stops_motion_towards_it(void **state)
{
    (void)state;
    get_moving(700); /* to the positive side */
    sim_gpio_drive(&sim.line[HIGH], SIM_GPIO_HIGH);
    ticks(1);
    expect_stop(CONTROLLER_FAULT_LIMIT_SWITCH, 0);
}

static void but_not_motion_away_from_it(void **state)
{
    (void)state;
    get_moving(700);
    sim_gpio_drive(&sim.line[LOW], SIM_GPIO_LOW); /* active low */
    ticks(500);
    assert_int_equal(machine.controller.state, CONTROLLER_MOVING);
    ticks(1000); /* the move turns round after 2 s */
    expect_stop(CONTROLLER_FAULT_LIMIT_SWITCH, 0);
}

static int gone_get(struct hal_gpio *gpio)
{
    (void)gpio;
    return MOTION_E_IO;
}

static int gone_event(struct hal_gpio *gpio, struct hal_gpio_event *event)
{
    (void)gpio;
    (void)event;
    return MOTION_E_IO;
}

/* An adapter that was pulled out: the stop is the same, and not the reason. */
static void a_chip_that_is_gone_is_said(void **state)
{
    static const struct hal_gpio_ops gone_ops = { .get = gone_get,
                                                  .event = gone_event };
    static struct hal_gpio gone = { .ops = &gone_ops };
    static const struct {
        int line, axis;
        unsigned ticks;
    } rows[] = { { STOP, -1, 700 }, { HIGH, 0, 700 } };
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        char text[MACHINE_FAULT_MAX], want[64];
        assert_int_equal(i == 0 ? 0 : begin(state), 0);
        get_moving(rows[i].ticks);
        machine.input[rows[i].line].line = &gone;
        ticks(1);
        expect_stop(CONTROLLER_FAULT_INPUT, rows[i].axis);
        machine_fault_text(&machine, text);
        snprintf(want, sizeof want, "line %s, is its chip gone?",
                 job.rig.line[rows[i].line].name);
        if (strstr(text, want) == NULL)
            fail_msg("%s: %s", want, text);
    }
}

#define RUN(test) cmocka_unit_test_setup(test, begin)

int main(void)
{
    const struct CMUnitTest tests[] = {
        RUN(the_lamp_is_lit_while_there_is_torque),
        RUN(the_estop_stops_in_the_next_tick_and_latches),
        RUN(a_broken_wire_is_an_estop),
        RUN(a_chip_that_is_gone_is_said),
        RUN(a_blip_between_two_ticks_is_an_estop),
        RUN(no_reset_before_the_estop_has_been_let_go),
        cmocka_unit_test_setup(either_of_two_channels_stops, begin_two),
        cmocka_unit_test_setup(two_channels_that_disagree_are_said, begin_two),
        RUN(a_limit_switch_stops_motion_towards_it),
        RUN(but_not_motion_away_from_it),
    };
    return cmocka_run_group_tests_name("machine_lines", tests, open_job,
                                       job_teardown);
}
