/* tests/firmware/linux/machine/test_own_homing.c - drives that home by themselves
 * are stopped, or the process is told to go, or the drive beside them has a fault:
 * none coasts, and none has torque in the end. */
#include <math.h>

#include "firmware/linux/machine/kind.h"
#include "tests/firmware/linux/machine/machine_bench.h"
#include "tests/support/kind/kind.h"

enum { PAN, LIFT, FOCUS, AXES };

static struct rig rig;

static struct sim_servo *servo(unsigned axis)
{
    return machine_kinds[rig.axis[axis].kind]->sim_servo(&sim, axis);
}

static bool has_torque(unsigned axis)
{
    return kind_tests[rig.axis[axis].kind]->has_torque(sim.servo[axis]);
}

/* Counts/s. */
static double speed(unsigned axis)
{
    return fabs((double)servo(axis)->plant.vel_q24 / (1 << 24));
}

/* ---- what happens -------------------------------------------------------- */

static void off_tick(void)
{
    now_ns += rig.period_ns;
    (void)hal_clock_wait_until(machine.ports.clock, now_ns);
    machine_tick_off(&machine, now_ns);
}

static void quick_tick(void)
{
    now_ns += rig.period_ns;
    (void)hal_clock_wait_until(machine.ports.clock, now_ns);
    machine_tick_quick_stop(&machine, now_ns);
}

static void nothing(void)
{
}

static void stop(void)
{
    controller_stop(&machine.controller);
}

static void neighbour_fails(void)
{
    sim_servo_inject(servo(FOCUS), SIM_SERVO_TRIP);
}

static void neighbour_is_silent(void)
{
    sim_servo_inject(servo(FOCUS), SIM_SERVO_SILENT);
}

static const struct {
    const char *text;
    void (*begin)(void);
    void (*tick)(void); /* 100 of these, then off_tick */
} ends[] = {
    { "stop", stop, tick },
    { "the neighbour has a fault", neighbour_fails, tick },
    { "the neighbour is silent", neighbour_is_silent, tick },
    { "told to go", nothing, off_tick },
    { "told to go at once", nothing, quick_tick },
    { "stopped and told to go", stop, off_tick },
};

/* ---- claims -------------------------------------------------------------- */

/* Where it moves by itself. */
static void home(unsigned axis)
{
    bench_build_ready(&rig);
    assert_int_equal(homing_start(&machine.homing, UINT64_C(1) << axis), 0);
    for (int i = 0; machine.homing.state != HOMING_RUN; i++) {
        assert_true(i < 2000);
        tick();
    }
    ticks(400);
    assert_int_equal(machine.homing.state, HOMING_RUN);
}

static void run_end(unsigned axis, unsigned end)
{
    double cut = 0;

    home(axis);
    const double from = speed(axis);

    assert_true(from > 1000);
    ends[end].begin();
    for (int i = 0; i < 3000; i++) {
        const bool torque = has_torque(axis);
        const double was = speed(axis);

        if (i < 100)
            ends[end].tick();
        else
            off_tick();
        if (torque && !has_torque(axis))
            cut = was;
    }
    if (has_torque(axis) || cut > from / 20 || speed(axis) > from / 20 ||
        machine.controller.axis[axis].homed)
        fail_msg("%s, %s: %g counts/s, %g when torque went, torque %s",
                 rig.axis[axis].name, ends[end].text, from, cut,
                 has_torque(axis) ? "on" : "off");
}

static int down(void **state)
{
    (void)state;
    machine_free(&machine);
    machine_sim_free(&sim);
    return 0;
}

static void none_coasts(void **state)
{
    bench_load("tests/data/homing/own.yaml", &rig);
    for (unsigned axis = PAN; axis <= LIFT; axis++)
        for (unsigned end = 0; end < ARRAY_LEN(ends); end++) {
            run_end(axis, end);
            down(state);
        }
    rig_free(&rig);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(none_coasts, down),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
