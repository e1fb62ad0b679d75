/* tests/firmware/linux/kind/virtual/test_machine_virtual.c - a virtual axis in a
 * rig: beside one with a drive, alone, and what the commands say of it.
 * Reads the real clock. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include <string.h>

#include "motion/core/fixed.h"
#include "sim/device/cia402/servo.h"
#include "tests/firmware/linux/machine/machine_bench.h"
#include "tests/support/kind/drives.h"
#include "tests/support/run_slew.h"

/* Of tests/data/virtual. */
enum { MASTER, SLIDE, AXES };

#define DEG MOTION_FIXED_ONE_Q32

static int open_job(void **state)
{
    return run_open(state) < 0 ? -1 : job_setup("tests/data/virtual");
}

static int close_job(void **state)
{
    return job_teardown(state) < 0 ? -1 : run_close(state);
}

static int64_t actual(unsigned i)
{
    return machine.controller.axis[i].feedback.pos_q32;
}

static void start(void)
{
    const struct motion_track *track[AXES] = { &job.track[MASTER],
                                               &job.track[SLIDE] };

    while (machine.controller.axis[SLIDE].feedback.state != HAL_DRIVE_OFF)
        tick();
    assert_int_equal(controller_enable(&machine.controller), MOTION_OK);
    until(CONTROLLER_READY);
    assert_int_equal(actual(MASTER), 10 * DEG);
    assert_int_equal(controller_start(&machine.controller, track, NULL),
                     MOTION_OK);
}

static void both_axes_end_at_their_last_keys(void **state)
{
    (void)state;
    start();
    ticks(6100);
    assert_int_equal(machine.controller.state, CONTROLLER_READY);
    assert_int_equal(actual(MASTER), 190 * DEG);
    assert_int_equal(machine.controller.axis[MASTER].target.pos_q32, 190 * DEG);
}

/* Along the path: neither axis is left where the other is not. */
static void a_fault_beside_it_stops_it_too(void **state)
{
    (void)state;
    start();
    ticks(3000);
    const int64_t there = actual(MASTER);
    sim_servo_inject(&SERVO_OF(sim_cia402, &sim, SLIDE)->base, SIM_SERVO_TRIP);
    until(CONTROLLER_FAULT);
    ticks(500);
    const int64_t stood = actual(MASTER);
    assert_true(stood >= there && stood < there + 40 * DEG);
    ticks(1000);
    assert_int_equal(actual(MASTER), stood);
    assert_int_equal(machine.controller.axis[MASTER].feedback.state,
                     HAL_DRIVE_OFF);
    assert_true(machine_is_at_rest(&machine));
}

static void alone_it_needs_no_bus(void **state)
{
    (void)state;
    run_put("rig.yaml",
            "axes:\n"
            "  joint:\n"
            "    unit: rad\n"
            "    limits: {position: [-3 rad, 3 rad], velocity: 2 rad/s,\n"
            "             acceleration: 4 rad/s2, jerk: 20 rad/s3}\n"
            "    following_error: {floor: 0.01 rad}\n"
            "    drive: {kind: virtual}\n");
    run_put("move.yaml", "axes:\n  joint: {curve: quintic, keys: [[0 s, 0 rad],"
                         " [3 s, 2 rad]]}\n");
    const char *const rig_path = run_path("rig.yaml");
    const char *const move_path = run_path("move.yaml");

    run("check", rig_path, move_path);
    run_expect(0);
    run("run", rig_path, move_path);
    run_expect(0);
    run_says("virtual");
    run_says("done after 3.000 s");
    run("run", "--real", "--yes", rig_path, move_path);
    run_expect(0);
    run("off", rig_path);
    run_expect(0);
    run_says("off");
    run("drive", "info", rig_path, "joint");
    run_expect(2);
    run_complains("'joint' is a virtual axis, which has no drive");
    run("sim", rig_path);
    run_expect(2);
    run_complains("the rig has no bus that its drives could be shown on");
    run("sim", "export", "--out", run_path("x.fmu"), rig_path);
    run_expect(2);
    run_complains("axis joint is virtual, expected axes with drives");
}

static void no_fault_can_be_made_on_it(void **state)
{
    static const struct {
        const char *text, *says;
    } row[] = {
        { "faults: [{fault: reboot, axis: master, at: 2 s}]\n",
          "axis is a virtual axis, which has no faults" },
        { "faults: [{fault: reboot, axis: slide, of: master,"
          " position: 20 deg}]\n",
          "of is a virtual axis, which is simulated nowhere" },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        run_put("faults.yaml", row[i].text);
        run("run", "--faults", run_path("faults.yaml"), "tests/data/virtual");
        run_expect(2);
        run_complains(row[i].says);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(both_axes_end_at_their_last_keys, begin),
        cmocka_unit_test_setup(a_fault_beside_it_stops_it_too, begin),
        cmocka_unit_test(alone_it_needs_no_bus),
        cmocka_unit_test(no_fault_can_be_made_on_it),
    };

    return cmocka_run_group_tests(tests, open_job, close_job);
}
