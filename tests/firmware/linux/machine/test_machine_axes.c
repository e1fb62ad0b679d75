/* tests/firmware/linux/machine/test_machine_axes.c - a rig with several axes
 * behind one CANopen node, simulated: a move, its load, a fault of one axis, a
 * restart of the node; what such a rig may not say; what slew drive info
 * shows. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include <string.h>

#include "firmware/host/job/budget.h"
#include "firmware/linux/base/disk.h"
#include "hal/drive/cia402/drive.h"
#include "motion/core/fixed.h"
#include "sim/device/cia402/servo.h"
#include "tests/firmware/linux/machine/machine_bench.h"
#include "tests/support/kind/drives.h"
#include "tests/support/run_slew.h"

/* Of tests/data/axes, in the order of the file. */
enum { FIRST, SECOND, EIGHTH, BESIDE, AXES };

static int open_job(void **state)
{
    return run_open(state) < 0 ? -1 : job_setup("tests/data/axes");
}

static int close_job(void **state)
{
    return job_teardown(state) < 0 ? -1 : run_close(state);
}

static bool all_off(void)
{
    for (unsigned i = 0; i < AXES; i++)
        if (machine.controller.axis[i].feedback.state != HAL_DRIVE_OFF)
            return false;
    return true;
}

static void get_ready(void)
{
    for (unsigned i = 0; !all_off(); i++) {
        if (i > 10000)
            fail_msg("%s", machine.controller.axis[SECOND].feedback.fault_text);
        tick();
    }
    assert_int_equal(controller_enable(&machine.controller), MOTION_OK);
    until(CONTROLLER_READY);
}

/* Counts from where it should be; 1000 per mm. */
static int64_t off_by(unsigned i, int64_t pos_q32)
{
    const int64_t at =
        (sim_servo_pos_q24(&SERVO_OF(sim_cia402, &sim, i)->base) >> 24) *
        (i == SECOND ? -1 : 1);
    int64_t want = 0;

    motion_fixed_muldiv(pos_q32, 1000, MOTION_FIXED_ONE_Q32, &want);
    return at > want ? at - want : want - at;
}

static void start(void)
{
    const struct motion_track *track[RIG_AXES_MAX];

    for (unsigned i = 0; i < AXES; i++)
        track[i] = &job.track[i];
    assert_int_equal(controller_start(&machine.controller, track, NULL),
                     MOTION_OK);
}

static void follow(void)
{
    start();
    while (machine.controller.state == CONTROLLER_MOVING) {
        tick();
        for (unsigned i = 0; i < AXES; i++)
            if (off_by(i, machine.controller.axis[i].target.pos_q32) > 300)
                fail_msg("axis %u is off", i);
    }
    assert_int_equal(machine.controller.state, CONTROLLER_READY);
    ticks(500);
    for (unsigned i = 0; i < AXES; i++)
        assert_true(off_by(i, 0) <= 2);
}

static bool any_torque(void)
{
    for (unsigned i = 0; i < AXES; i++)
        if (!machine.controller.axis[i].feedback.torque_off)
            return true;
    return false;
}

static void every_axis_follows_the_move(void **state)
{
    (void)state;
    get_ready();
    assert_int_equal(SERVO_OF(sim_cia402, &sim, SECOND)->mode, 9);
    assert_int_equal(SERVO_OF(sim_cia402, &sim, EIGHTH)->mode, 8);
    follow();
    assert_int_equal(machine.bus[0].stats.foreign_master, 0);
    assert_int_equal(machine.bus[0].stats.malformed, 0);
}

static void a_fault_of_one_axis_stops_all(void **state)
{
    (void)state;
    for (unsigned i = 0; i < AXES; i++) {
        bench_build(&job.rig);
        get_ready();
        start();
        ticks(350);
        sim_cia402_inject(SERVO_OF(sim_cia402, &sim, i),
                          SIM_CIA402_OVERCURRENT);
        until(CONTROLLER_FAULT);
        ticks(2000);
        assert_false(any_torque());
        for (unsigned k = 0; k < AXES; k++)
            assert_int_equal(DRIVER_OF(drive_cia402, &machine, k)->fault_code,
                             k == i ? 0x2310 : 0);
        assert_int_equal(controller_reset(&machine.controller), MOTION_OK);
        until(CONTROLLER_OFF);
        ticks(100);
        assert_false(any_torque());
        get_ready();
    }
}

static void after_a_restart_every_axis_is_set_up_anew(void **state)
{
    (void)state;
    get_ready();
    start();
    ticks(350);
    sim_cia402_inject(SERVO_OF(sim_cia402, &sim, EIGHTH), SIM_CIA402_REBOOT);
    until(CONTROLLER_FAULT);
    ticks(3000);
    for (unsigned i = 0; i < BESIDE; i++)
        assert_int_equal(SERVO_OF(sim_cia402, &sim, i)->controlword & 0x8, 0);
    assert_int_equal(DRIVER_OF(drive_cia402, &machine, FIRST)->phase,
                     DRIVE_CIA402_LOST);
    assert_int_equal(DRIVER_OF(drive_cia402, &machine, BESIDE)->phase,
                     DRIVE_CIA402_RUN);
    assert_int_equal(controller_reset(&machine.controller), MOTION_OK);
    until(CONTROLLER_OFF);
    ticks(100);
    assert_false(any_torque());
    get_ready();
    assert_int_equal(SERVO_OF(sim_cia402, &sim, SECOND)->mode, 9);
}

static void without_us_every_axis_stops(void **state)
{
    (void)state;
    get_ready();
    start();
    ticks(350);
    sim_world_run(&sim.world, sim.world.now_ns + 2000 * INT64_C(1000000));
    for (unsigned i = 0; i < AXES; i++)
        assert_int_equal(SERVO_OF(sim_cia402, &sim, i)->motion,
                         0); /* no torque */
}

static unsigned count_of(const struct budget *budget, const char *what)
{
    unsigned count = 0;

    for (unsigned i = 0; i < budget->count; i++)
        count += strcmp(budget->item[i].what, what) == 0;
    return count;
}

/* Ours, and one of each node. */
static void the_budget_has_one_heartbeat_per_node(void **state)
{
    struct budget budget;

    (void)state;
    budget_of(&job.rig, 0, &job, &budget);
    assert_int_equal(count_of(&budget, "set point"), AXES);
    assert_int_equal(count_of(&budget, "feedback"), AXES);
    assert_int_equal(count_of(&budget, "speed"), 1);
    assert_int_equal(count_of(&budget, "heartbeat"), 3);
    budget_free(&budget);
}

/* What it may not say, of the second drive of two on node 5 by these fields. */
static void what_a_rig_may_not_say_of_axes(void **state)
{
    static const char *const format =
        "buses:\n"
        "  can0: {kind: canopen, bit_rate: 1 Mbit/s}\n"
        "axes:\n"
        "  pan:\n"
        "    unit: mm\n"
        "    limits: {position: [0, 9], velocity: 5, acceleration: 20}\n"
        "    following_error: {floor: 1, time: 20 ms}\n"
        "    drive: {kind: cia402, bus: can0, node: 5, counts: 1000%s}\n"
        "  tilt:\n"
        "    unit: mm\n"
        "    limits: {position: [0, 9], velocity: 5, acceleration: 20}\n"
        "    following_error: {floor: 1, time: 20 ms}\n"
        "    drive: {kind: cia402, bus: can0, counts: 1000, %s}\n";
    static const struct {
        const char *first, *second, *says; /* NULL: it may */
    } rows[] = {
        { "", "node: 5, axis: 2", NULL },
        { "", "node: 5, axis: 8, pdo: {rx: 0x385, tx: 0x505}", NULL },
        { ", axis: 3", "node: 5, axis: 2", NULL },
        { ", pdo: {rx: 0x6DF, tx: 1760}", "node: 6",
          "tx '1760' is not for a PDO" },
        { "", "node: 5",
          "13:58: node 5 on bus can0 is axis pan's already, as in line "
          "8" },
        { ", axis: 2", "node: 5, axis: 2",
          "node 5, axis 2, on bus can0 is axis pan's already" },
        { "", "node: 5, axis: 0", "axis '0' is not in 1 .. 8" },
        { "", "node: 5, axis: 9", "axis '9' is not in 1 .. 8" },
        { "", "node: 5, axis: two", "axis 'two'" },
        { "", "node: 5, axis: 2, pdo: {rx: 0x580}", "rx '0x580' is not for" },
        { "", "node: 5, axis: 2, pdo: {tx: 0x180}",
          "tx '0x180' is not for a PDO" },
        { "", "node: 5, axis: 2, pdo: {rx2: 0x401, tx: 0x401}",
          "has 0x401 twice among its pdo" },
        { "", "node: 5, axis: 2, pdo: {tx: 0x185}",
          "has 0x185 among its pdo, which its node has for its first axis" },
        { "", "node: 6, pdo: {tx: 0x385}",
          "has 0x385 among its pdo, which axis pan on line 4 has on the same" },
        { ", pdo: {tx: 0x401}", "node: 5, axis: 2, pdo: {rx: 0x401}",
          "has 0x401 among its pdo, which axis pan on line 4 has on the same" },
        { ", pdo: {tx: 0x406}", "node: 6",
          "has 0x406 by its node, which axis pan on line 4 has among its pdo" },
        { "", "node: 5, axis: 2, guarding: 20 ms",
          "drive differs in guarding from axis pan on line 4, which is "
          "of the same node: expected the same" },
        { ", times: {sdo: 1 s}", "node: 5, axis: 2", "differs in times: sdo" },
        { ", nmt_reset: node", "node: 5, axis: 2", "differs in nmt_reset" },
        { ", times: {boot: 9 s}", "node: 5, axis: 2",
          "differs in times: boot" },
        { ", times: {brake: 9 s}", "node: 5, axis: 2", NULL },
        { ", quirks: jvl-mis", "node: 5, axis: 2", "differs in quirks" },
        { ", unsupervised: yes", "node: 5, axis: 2",
          "differs in unsupervised" },
        { "", "node: 5, axis: 2, pdo: {number: 4}",
          "has PDOs from number 4 on, and axis pan on line 4, of the same "
          "node, from 1 on: expected at least 4 between them" },
        { "", "node: 5, axis: 2, pdo: {number: 5}", NULL },
        { "", "node: 5, axis: 2, pdo: {number: 510}", "is not in 1 .. 509" },
        { "", "node: 5, axis: 2, parameters: {6840: 15 u16}", "6840" },
        { "", "node: 5, axis: 2, parameters: {6807: 0 i16}", "6807" },
        { "", "node: 5, axis: 2, parameters: {1440:1: 5 u32}", "1440" },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        char text[1024], message[YAML_MESSAGE_MAX] = "";
        static struct rig rig;
        int err;

        snprintf(text, sizeof text, format, rows[i].first, rows[i].second);
        run_put("axes.yaml", text);
        err = rig_load(&disk_files, run_path("axes.yaml"), &rig, message);
        if ((err < 0) != (rows[i].says != NULL) ||
            (err < 0 && strstr(message, rows[i].says) == NULL))
            fail_msg("%zu: \"%s\"", i, message);
    }
}

static void drive_info_shows_each_axis(void **state)
{
    (void)state;
    run("drive", "info", "tests/data/axes/rig.yaml", "second");
    run_expect(STATUS_OK);
    run_says("second (axis 2 of node 5 on can0)");
    run_says("6864:0  Position actual value");
    run_says("6064:0  axis 1: Position actual value");
    run_says("9864:0  axis 8: Position actual value");
    run("drive", "info", "tests/data/axes/rig.yaml", "first");
    run_expect(STATUS_OK);
    run_says("6841:0  axis 2: Statusword");
    run_says("it has what slew needs");
    run("drive", "info", "tests/data/axes/rig.yaml", "beside");
    run_expect(STATUS_OK);
    assert_null(strstr(run_slew()->out, "axis 2"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(every_axis_follows_the_move, begin),
        cmocka_unit_test(a_fault_of_one_axis_stops_all),
        cmocka_unit_test_setup(after_a_restart_every_axis_is_set_up_anew,
                               begin),
        cmocka_unit_test_setup(without_us_every_axis_stops, begin),
        cmocka_unit_test(the_budget_has_one_heartbeat_per_node),
        cmocka_unit_test(what_a_rig_may_not_say_of_axes),
        cmocka_unit_test(drive_info_shows_each_axis),
    };

    return cmocka_run_group_tests(tests, open_job, close_job);
}
