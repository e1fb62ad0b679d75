/* tests/test_machine_turns.c - the rig of examples/odrive: an ODrive and a
 * moteus, built, driven, and what happens when they fail. */
#include <stdio.h>
#include <string.h>

#include "firmware/linux/machine/machine.h"
#include "firmware/linux/machine/machine_sim.h"
#include "firmware/linux/move/budget.h"
#include "firmware/linux/rig/turns_budget.h"
#include "motion/fixed.h"
#include "tests/check.h"

#define MS INT64_C(1000000)

enum { SLIDER, PAN };

static struct rig rig;
static struct machine machine;
static struct machine_sim sim;
static int64_t now_ns;

static void load(void)
{
    char message[RIG_MESSAGE_MAX];

    if (rig_load("examples/odrive/rig.yaml", &rig, message) < 0)
        fail_msg("%s", message);
}

static void build(void)
{
    struct machine_ports ports;
    char message[RIG_MESSAGE_MAX];

    if (machine_sim_init(&sim, &rig, false, &ports, message) < 0 ||
        machine_init(&machine, &rig, &ports, message) < 0)
        fail_msg("%s", message);
    now_ns = hal_clock_now_ns(ports.clock);
}

static void tick(void)
{
    now_ns += rig.period_ns;
    (void)hal_clock_wait_until(machine.ports.clock, now_ns);
    machine_tick(&machine, now_ns);
}

static void until(enum controller_state state)
{
    for (int i = 0; i < 8000 && machine.controller.state != state; i++)
        tick();
    if (machine.controller.state != state)
        fail_msg("%s", controller_state_text(machine.controller.state));
}

static void build_ready(void)
{
    load();
    build();
    tick();
    assert_int_equal(controller_enable(&machine.controller), 0);
    until(CONTROLLER_READY);
}

static void the_example_is_read_as_written(void **state)
{
    int64_t num, den;

    (void)state;
    load();
    assert_int_equal(rig.bus[0].kind, RIG_CAN);
    assert_int_equal(rig.bus[0].data_bit_rate, 0);
    assert_int_equal(rig.bus[1].data_bit_rate, 5000000);
    assert_int_equal(rig.axis[SLIDER].kind, RIG_ODRIVE);
    assert_int_equal(rig.axis[SLIDER].node_id, 0);
    assert_int_equal(rig.axis[SLIDER].enable_watchdog, 190);
    assert_int_equal(rig.axis[SLIDER].watchdog_timeout, 191);
    rig_axis_turns(&rig.axis[SLIDER], &num, &den);
    assert_int_equal(num * 8, den); /* 0.125 per mm */
    assert_int_equal(rig.axis[PAN].kind, RIG_MOTEUS);
    rig_axis_turns(&rig.axis[PAN], &num, &den);
    assert_int_equal(num * 360, den * 50);
}

static void its_watchdogs_are_in_force(void **state)
{
    (void)state;
    build_ready();
    assert_true(sim.odrive[SLIDER].watchdog_on);
    assert_true(sim.odrive[SLIDER].watchdog_s > 0.0999f &&
                sim.odrive[SLIDER].watchdog_s < 0.1001f);
    assert_true(sim.moteus[PAN].command[0x7] > 0.0999f &&
                sim.moteus[PAN].command[0x7] < 0.1001f);
}

/* slew hangs: nothing is sent any more, and both let go by themselves. */
static void they_stop_when_nobody_speaks(void **state)
{
    (void)state;
    build_ready();
    now_ns += 150 * MS;
    (void)hal_clock_wait_until(machine.ports.clock, now_ns);
    assert_int_equal(sim.odrive[SLIDER].axis_state, 1); /* idle */
    assert_int_equal(sim.odrive[SLIDER].error, 0x1000000);
    assert_int_equal(sim.moteus[PAN].mode, 11);
}

static const struct {
    int axis;
    enum sim_servo_fault device;
    enum controller_fault fault;
    int64_t most_ms;
    const char *text;
} failures[] = {
    { SLIDER, SIM_SERVO_ENCODER, CONTROLLER_FAULT_DRIVE, 25,
      "ODrive error 0x00000008: missing estimate" },
    { SLIDER, SIM_SERVO_TRIP, CONTROLLER_FAULT_DRIVE, 25,
      "ODrive error 0x00001000: current limit" },
    /* alone on its bus: nobody acknowledges what slew sends */
    { SLIDER, SIM_SERVO_SILENT, CONTROLLER_FAULT_BUS_PASSIVE, 10, "" },
    { SLIDER, SIM_SERVO_NOT_A_NUMBER, CONTROLLER_FAULT_STALE, 10, "" },
    { SLIDER, SIM_SERVO_DEAF, CONTROLLER_FAULT_STALE, 20, "" },
    { PAN, SIM_SERVO_ENCODER, CONTROLLER_FAULT_DRIVE, 3,
      "moteus fault 35: encoder" },
    { PAN, SIM_SERVO_TRIP, CONTROLLER_FAULT_DRIVE, 3,
      "moteus fault 33: motor driver, perhaps under-voltage" },
    { PAN, SIM_SERVO_SILENT, CONTROLLER_FAULT_BUS_PASSIVE, 10, "" },
    { PAN, SIM_SERVO_DEAF, CONTROLLER_FAULT_STALE, 10, "" },
    { PAN, SIM_SERVO_NOT_A_NUMBER, CONTROLLER_FAULT_STALE, 10, "" },
};

static void inject(int axis, enum sim_servo_fault fault)
{
    sim_servo_inject(axis == SLIDER ? &sim.odrive[SLIDER].base
                                    : &sim.moteus[PAN].base,
                     fault);
}

/* Latched, the group off, nothing by itself. */
static void faults_stop_the_group(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(failures); i++) {
        const struct controller *controller = &machine.controller;
        int64_t since_ns;

        build_ready();
        since_ns = now_ns;
        inject(failures[i].axis, failures[i].device);
        until(CONTROLLER_FAULT);
        if (controller->fault.fault != failures[i].fault ||
            (controller->fault.axis != failures[i].axis &&
             controller->fault.axis != -1))
            fail_msg("row %zu: axis %d, %s", i, controller->fault.axis,
                     controller_fault_text(controller->fault.fault));
        assert_in_range(now_ns - since_ns, 1, failures[i].most_ms * MS);
        if (failures[i].text[0] != '\0')
            assert_string_equal(
                controller->axis[failures[i].axis].feedback.fault_text,
                failures[i].text);
        for (int n = 0; n < 1000; n++)
            tick();
        assert_int_equal(controller->state, CONTROLLER_FAULT);
        assert_true(machine_is_at_rest(&machine));
    }
}

static void after_a_fault_it_starts_again(void **state)
{
    (void)state;
    build_ready();
    inject(SLIDER, SIM_SERVO_TRIP);
    inject(PAN, SIM_SERVO_TRIP);
    until(CONTROLLER_FAULT);
    for (int n = 0; n < 300; n++)
        tick();
    assert_int_equal(controller_reset(&machine.controller), 0);
    until(CONTROLLER_OFF);
    assert_int_equal(controller_enable(&machine.controller), 0);
    until(CONTROLLER_READY);
}

/* By hand: 47 + 8 * 8 + (34 + 64 - 1) / 4 = 135, and 47 + 33 / 4 = 55. */
static void the_budget_of_an_odrive(void **state)
{
    struct turns_frame frame[TURNS_FRAMES_MAX];
    struct budget budget;
    char advice[BUDGET_ADVICE_MAX];

    (void)state;
    load();
    assert_int_equal(turns_budget_frames(&rig, SLIDER, frame), 4);
    assert_int_equal((int)frame[0].bits, 135);
    assert_int_equal((int)frame[1].bits, 55);
    /* behind its own question and answer, with the set point's own time */
    assert_int_equal(turns_budget_latency_ns(&rig, SLIDER), 325000);
    assert_int_equal(turns_budget_answer_ns(&rig, SLIDER), 135000);
    budget_of(&rig, 0, NULL, &budget);
    assert_true(budget_fits(&budget));
    assert_in_range((int)(budget.most * 10000), 3316, 3318);
    rig.bus[0].bit_rate = 250000;
    budget_of(&rig, 0, NULL, &budget);
    assert_false(budget_fits(&budget));
    budget_advice(&budget, advice);
    assert_string_equal(advice, "0 drives on this bus, a tick of 1.34 ms, or "
                                "500 kbit/s");
}

/* What was counted is never less than what a frame really has. */
static void no_frame_is_longer_than_its_budget(void **state)
{
    struct turns_frame frame[TURNS_FRAMES_MAX];

    (void)state;
    seed_from("frames");
    load();
    (void)turns_budget_frames(&rig, PAN, frame);
    for (int i = 0; i < 20000; i++) {
        struct hal_can_frame order = { .id = 0x8001,
                                       .extended = true,
                                       .fd = true,
                                       .switched = true,
                                       .len = 32 };
        struct sim_can_bits bits;

        for (unsigned k = 0; k < order.len; k++)
            order.data[k] = (i & 1) != 0 ? 0 : (uint8_t)draw();
        bits = sim_can_frame_bits(&order);
        assert_true(bits.slow + bits.fast / 5.0 <= frame[0].bits);
        order.id = 0x0100;
        order.extended = false;
        order.len = 24;
        bits = sim_can_frame_bits(&order);
        assert_true(bits.slow + bits.fast / 5.0 <= frame[1].bits);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_example_is_read_as_written),
        cmocka_unit_test(its_watchdogs_are_in_force),
        cmocka_unit_test(they_stop_when_nobody_speaks),
        cmocka_unit_test(faults_stop_the_group),
        cmocka_unit_test(after_a_fault_it_starts_again),
        cmocka_unit_test(the_budget_of_an_odrive),
        cmocka_unit_test(no_frame_is_longer_than_its_budget),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
