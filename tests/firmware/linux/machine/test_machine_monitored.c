/* tests/firmware/linux/machine/test_machine_monitored.c - limits of temperature,
 * voltage and current, of each kind of drive that reports them: near one an event,
 * at one a stop with no torque left, and so without a value. */
#include <string.h>

#include "firmware/host/rig/modbus_budget.h"
#include "firmware/linux/machine/kind.h"
#include "tests/firmware/linux/machine/machine_bench.h"
#include "tests/support/kind/kind.h"

#define MS INT64_C(1000000)
/* docs/FAULTS.md. */
#define BOUND_NS (100 * MS)

/* Each has tests/data/monitored/NAME.yaml with one axis: 80 degC, 20 to 30 V,
 * 12 A, at 24 V. */
static const struct {
    const char *name;
    double degc;         /* at rest */
    const char *missing; /* what is said when it has no values */
    uint16_t code;
} kinds[] = {
    { "odrive", 31.5, ": no value for three periods", 0x7300 },
    { "moteus", 31, ": no value for three periods", 0x7300 },
    { "modbus", 30, "a read was refused: ", 0 },
    { "cia402", 30, ": no value for three periods", 0x7300 },
};

static struct rig rig;

static void load(size_t k)
{
    char path[96];
    snprintf(path, sizeof path, "tests/data/monitored/%s.yaml", kinds[k].name);
    memset(&rig, 0, sizeof rig);
    bench_load(path, &rig);
}

static void unload(void)
{
    machine_free(&machine);
    machine_sim_free(&sim);
    rig_free(&rig);
}

static struct sim_readings *readings(void)
{
    const struct machine_kind *kind = machine_kinds[rig.axis[0].kind];
    return kind->sim_servo != NULL
               ? &kind->sim_servo(&sim, 0)->readings
               : &machine_sim_modbus_servo(&sim, 0)->readings;
}

/* In the middle of a jog. */
static void move(size_t k)
{
    const struct controller_jog_goal goal = { .axis = 0,
                                              .vel_q32 = (int64_t)30 << 32,
                                              .pos_q32 = (int64_t)80 << 32 };
    load(k);
    bench_build_ready(&rig);
    ticks(500);
    assert_int_equal(machine.warnings[0].newest.number, 0);
    assert_int_equal(controller_jog(&machine.controller, &machine.jog, &goal),
                     MOTION_OK);
    ticks(500);
    assert_int_equal(machine.controller.state, CONTROLLER_MOVING);
}

/* Until it stops; the fault is latched within its bound, and the axis goes on
 * along its path until it rests. */
static void stops(size_t k, const char *words)
{
    const int64_t begun_ns = now_ns;
    const char *said = machine.controller.axis[0].feedback.fault_text;
    while (machine.controller.fault.fault == CONTROLLER_FAULT_NONE &&
           now_ns - begun_ns <= BOUND_NS + rig.period_ns)
        tick();
    if (machine.controller.fault.fault != CONTROLLER_FAULT_DRIVE ||
        strncmp(said, words, strlen(words)) != 0)
        fail_msg("%s: %s, expected %s", kinds[k].name, said, words);
    assert_int_equal(machine.controller.fault.axis, 0);
    assert_int_equal(machine.controller.reaction, CONTROLLER_REACT_STOP);
    assert_true(kind_tests[rig.axis[0].kind]->has_torque(sim.servo[0]));
    until(CONTROLLER_FAULT);
    ticks(3000);
    if (kind_tests[rig.axis[0].kind]->has_torque(sim.servo[0]))
        fail_msg("%s has torque", kinds[k].name);
    assert_true(machine_is_off(&machine));
}

static void near_a_limit_is_one_event(void **state)
{
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(kinds); k++) {
        move(k);
        readings()->more_degc = 74 - kinds[k].degc;
        ticks(200);
        assert_int_equal(machine.warnings[0].newest.number, 1);
        assert_int_equal(machine.warnings[0].newest.kind, WARNING_TEMPERATURE);
        readings()->more_degc = 70 - kinds[k].degc;
        ticks(100);
        readings()->more_degc = 74 - kinds[k].degc;
        ticks(100);
        assert_int_equal(machine.warnings[0].newest.number, 1);
        readings()->more_degc = 60 - kinds[k].degc;
        ticks(100);
        readings()->more_degc = 74 - kinds[k].degc;
        ticks(100);
        assert_int_equal(machine.warnings[0].newest.number, 2);
        assert_int_equal(machine.controller.state, CONTROLLER_MOVING);
        assert_int_equal(machine.controller.fault.fault, CONTROLLER_FAULT_NONE);
        unload();
    }
}

static void at_a_limit_the_group_stops_and_no_torque_is_left(void **state)
{
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(kinds); k++) {
        move(k);
        readings()->more_degc = 85 - kinds[k].degc;
        stops(k, "temperature 85.0 degC, limit 80.0 degC");
        assert_int_equal(machine.controller.fault.drive_code, 0x4310);
        unload();
        move(k);
        readings()->more_v = 7;
        stops(k, "bus voltage 31.0 V, limit 30.0 V");
        unload();
        move(k);
        readings()->more_v = -5;
        stops(k, "bus voltage 19.0 V, limit 20.0 V");
        unload();
    }
}

static void what_is_missing_is_a_fault(void **state)
{
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(kinds); k++) {
        move(k);
        readings()->missing = true;
        stops(k, "");
        assert_non_null(strstr(machine.controller.axis[0].feedback.fault_text,
                               kinds[k].missing));
        assert_int_equal(machine.controller.fault.drive_code, kinds[k].code);
        unload();
    }
}

static void a_reset_takes_it_back_once_it_is_cool(void **state)
{
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(kinds); k++) {
        move(k);
        readings()->more_degc = 85 - kinds[k].degc;
        stops(k, "temperature");
        (void)controller_reset(&machine.controller);
        ticks(6000); /* the reset gives up */
        assert_int_equal(machine.controller.state, CONTROLLER_FAULT);
        readings()->more_degc = 0;
        ticks(100);
        assert_int_equal(machine.controller.state, CONTROLLER_FAULT);
        assert_int_equal(controller_reset(&machine.controller), MOTION_OK);
        until(CONTROLLER_OFF);
        assert_int_equal(controller_enable(&machine.controller), MOTION_OK);
        until(CONTROLLER_READY);
        unload();
    }
}

/* The lists of a CiA 402 drive have its SDOs; what they keep waiting does not
 * grow old. */
static void while_a_drive_is_enabled_by_sdo_nothing_is_missing(void **state)
{
    (void)state;
    load(ARRAY_LEN(kinds) - 1);
    assert_string_equal(kinds[ARRAY_LEN(kinds) - 1].name, "cia402");
    bench_build(&rig);
    ticks(3000);
    const struct hal_readings *at = machine.monitor[0]->readings;
    const int64_t found_ns = at->from_ns;
    assert_true(now_ns - found_ns > 1000 * MS);
    assert_int_equal(controller_enable(&machine.controller), MOTION_OK);
    until(CONTROLLER_READY);
    assert_true(at->from_ns > found_ns);
    assert_true(at->from_ns < now_ns);
    unload();
}

/* Both ask by SDO; neither keeps the other from it. */
static void a_probe_and_readings_take_turns(void **state)
{
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(kinds); k++) {
        load(k);
        bench_build_ready(&rig);
        struct hal_drive *drive = machine.axis[0];
        if (hal_drive_probe(drive, HAL_DRIVE_PROBE_RISING) == MOTION_OK) {
            const struct hal_readings *at = machine.monitor[0]->readings;
            ticks(2000);
            assert_int_equal(machine.controller.state, CONTROLLER_READY);
            for (unsigned i = 0; i < HAL_READINGS; i++)
                assert_true(now_ns - at->value[i].t_ns < 2 * HAL_READING_NS);
            assert_string_equal(kinds[k].name, "cia402");
        }
        unload();
    }
}

/* How long the bus is in use for a second of standing; a line is never silent:
 * its cycle. */
static int64_t load_ns(void)
{
    if (!rig_bus_is_can(&rig.bus[0]))
        return modbus_budget_cycle_ns(&rig, 0);
    const int64_t begun_ns = machine_busy_ns(&machine, 0);
    ticks(1000);
    return machine_busy_ns(&machine, 0) - begun_ns;
}

/* Without limits nothing is read that is not read anyway, and nothing judged. */
static void without_limits_nothing_is_monitored(void **state)
{
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(kinds); k++) {
        load(k);
        rig.axis[0].monitor.wanted = 0;
        bench_build_ready(&rig);
        readings()->more_degc = 200;
        readings()->missing = true;
        const int64_t plain_ns = load_ns();
        ticks(1000);
        assert_int_equal(machine.controller.state, CONTROLLER_READY);
        assert_null(machine.monitor[0]);
        assert_int_equal(machine.warnings[0].newest.number, 0);
        unload();
        load(k);
        bench_build_ready(&rig);
        assert_true(load_ns() > plain_ns);
        unload();
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(near_a_limit_is_one_event),
        cmocka_unit_test(at_a_limit_the_group_stops_and_no_torque_is_left),
        cmocka_unit_test(what_is_missing_is_a_fault),
        cmocka_unit_test(a_reset_takes_it_back_once_it_is_cool),
        cmocka_unit_test(while_a_drive_is_enabled_by_sdo_nothing_is_missing),
        cmocka_unit_test(a_probe_and_readings_take_turns),
        cmocka_unit_test(without_limits_nothing_is_monitored),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
