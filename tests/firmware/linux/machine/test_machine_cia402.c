/* tests/firmware/linux/machine/test_machine_cia402.c - what the rig file says
 * of a CiA 402 drive reaches the drive. */
#include <string.h>

#include "firmware/host/job/budget.h"
#include "hal/drive/cia402/drive.h"
#include "motion/core/fixed.h"
#include "sim/device/cia402/servo.h"
#include "tests/firmware/linux/machine/machine_bench.h"
#include "tests/support/kind/drives.h"

#define MS INT64_C(1000000)

/* Of tests/data/cia402, in the order of the file. */
enum { CSP, IP, CSV, AXES };

static int open_job(void **state)
{
    (void)state;
    return job_setup("tests/data/cia402");
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
        assert_true(i < 10000);
        tick();
    }
    assert_int_equal(controller_enable(&machine.controller), MOTION_OK);
    until(CONTROLLER_READY);
}

/* In counts; every axis has 1000 per mm. */
static int64_t off_by(unsigned i, int64_t pos_q32)
{
    const int64_t at =
        (sim_servo_pos_q24(&SERVO_OF(sim_cia402, &sim, i)->base) >> 24) *
        (i == IP ? -1 : 1);
    int64_t want = 0;
    motion_fixed_muldiv(pos_q32, 1000, MOTION_FIXED_ONE_Q32, &want);
    return at > want ? at - want : want - at;
}

static void every_mode_follows_the_move(void **state)
{
    (void)state;
    const struct motion_track *track[RIG_AXES_MAX];
    int64_t pushed = 0, acc_q32 = 0;
    for (unsigned i = 0; i < AXES; i++)
        track[i] = &job.track[i];
    get_ready();
    assert_int_equal(SERVO_OF(sim_cia402, &sim, CSP)->mode, 8);
    assert_int_equal(SERVO_OF(sim_cia402, &sim, IP)->mode, 7);
    assert_int_equal(SERVO_OF(sim_cia402, &sim, CSV)->mode, 9);
    assert_int_equal(controller_start(&machine.controller, track, NULL),
                     MOTION_OK);
    while (machine.controller.state == CONTROLLER_MOVING) {
        tick();
        for (unsigned i = 0; i < AXES; i++)
            if (off_by(i, machine.controller.axis[i].target.pos_q32) > 300)
                fail_msg("axis %u is off", i);
        if (machine.controller.axis[CSP].target.acc_q32 > acc_q32)
            acc_q32 = machine.controller.axis[CSP].target.acc_q32;
        if (SERVO_OF(sim_cia402, &sim, CSP)->base.plant.push_q8 > pushed)
            pushed = SERVO_OF(sim_cia402, &sim, CSP)->base.plant.push_q8;
    }
    for (unsigned i = 0; i < 500; i++)
        tick();
    for (unsigned i = 0; i < AXES; i++)
        assert_true(off_by(i, 0) <= 2);
    /* 200 mm/s2 take 0.4 of the torque, so 1 mm/s2 2 permille, and a permille
     * is 400 counts/s2 of this plant */
    assert_true(acc_q32 > INT64_C(50) << 32);
    assert_in_range(pushed / (400 * 256), (acc_q32 >> 31) - 1,
                    (acc_q32 >> 31) + 1);
}

static uint32_t object(unsigned axis, uint16_t index, uint8_t sub)
{
    struct canopen_node *node = &DRIVER_OF(drive_cia402, &machine, axis)->node;
    uint32_t value = 0;
    for (unsigned i = 0; i < 100; i++) {
        if (canopen_sdo_take(node, &value, NULL) == MOTION_OK)
            return value;
        (void)canopen_sdo_read(node, now_ns, index, sub);
        tick();
    }
    fail_msg("0x%04X:%u is not answered", index, sub);
    return 0;
}

static void the_drive_has_what_the_file_says(void **state)
{
    (void)state;
    get_ready();
    assert_int_equal(object(CSP, 0x605A, 0), 6);
    assert_int_equal(object(CSP, 0x605E, 0), 1);
    assert_int_equal(object(CSP, 0x1019, 0), 10);
    assert_int_equal((int32_t)object(CSP, 0x607D, 1), -1001);
    assert_int_equal((int32_t)object(CSP, 0x607D, 2), 100001);
    /* max(1 mm, 50 mm/s x 20 ms) twice; two ticks */
    assert_int_equal(object(CSP, 0x6065, 0), 2000);
    assert_int_equal(object(CSP, 0x6066, 0), 2);
    assert_int_equal((int32_t)object(IP, 0x607D, 1), -100001);
    assert_int_equal((int32_t)object(IP, 0x607D, 2), 1001);
    assert_int_equal(object(IP, 0x100C, 0), 30);
    assert_int_equal(object(IP, 0x100D, 0), 3);
    assert_int_equal(DRIVER_OF(drive_cia402, &machine, CSV)->config.gain_q16 >>
                         16,
                     31); /* 2 pi 5 */
    assert_int_equal(DRIVER_OF(drive_cia402, &machine, CSV)->config.acc_den,
                     1000);
    assert_int_equal(
        canopen_sdo_timeout_ns(&DRIVER_OF(drive_cia402, &machine, IP)->node),
        700 * MS);
    assert_int_equal(
        DRIVER_OF(drive_cia402, &machine, IP)->config.state_timeout_ns,
        2000 * MS);
    assert_int_equal(
        DRIVER_OF(drive_cia402, &machine, IP)->config.brake_timeout_ns,
        6000 * MS);
    assert_int_equal(
        DRIVER_OF(drive_cia402, &machine, IP)->config.precharge_timeout_ns,
        9000 * MS);
    assert_true(DRIVER_OF(drive_cia402, &machine, IP)->config.unsupervised);
    assert_false(DRIVER_OF(drive_cia402, &machine, CSP)->config.unsupervised);
    assert_int_equal(
        canopen_sdo_timeout_ns(&DRIVER_OF(drive_cia402, &machine, CSP)->node),
        200 * MS);
    assert_int_equal(machine.controller.config.enable_timeout_ns, 13000 * MS);
    assert_int_equal(
        SERVO_OF(sim_cia402, &sim, CSP)->config.rail.limit_negative, -5000);
    assert_int_equal(SERVO_OF(sim_cia402, &sim, CSP)->config.rail.home_to,
                     12000);
    assert_int_equal(SERVO_OF(sim_cia402, &sim, CSP)->config.rail.index_every,
                     5000);
    assert_int_equal(SERVO_OF(sim_cia402, &sim, IP)->config.rail.limit_negative,
                     -105000);
    assert_int_equal(SERVO_OF(sim_cia402, &sim, IP)->config.rail.limit_positive,
                     5000);
}

static void a_revolution_that_is_not_the_drives_is_refused(void **state)
{
    (void)state;
    job.rig.axis[CSP].cia402.travel_q32 /= 2;
    bench_build(&job.rig);
    for (unsigned i = 0; i < 2000; i++)
        tick();
    assert_int_equal(machine.controller.axis[CSP].feedback.state,
                     HAL_DRIVE_FAULT);
    assert_non_null(strstr(machine.controller.axis[CSP].feedback.fault_text,
                           "10000 counts per turn, we 5000"));
    job.rig.axis[CSP].cia402.travel_q32 *= 2;
}

static double most_of(const struct budget *budget, const char *what,
                      unsigned axis)
{
    for (unsigned i = 0; i < budget->count; i++)
        if (budget->item[i].axis == job.rig.axis[axis].name &&
            strcmp(budget->item[i].what, what) == 0)
            return budget->item[i].most_bits;
    return 0;
}

/* 47 + 8 n + (34 + 8 n - 1) / 4 bits. */
static void the_budget_counts_what_they_need(void **state)
{
    (void)state;
    struct budget budget;
    budget_of(&job.rig, 0, NULL, &budget);
    assert_int_equal(most_of(&budget, "set point", CSP), 135);
    assert_int_equal(most_of(&budget, "feedback", CSP), 135);
    assert_int_equal(most_of(&budget, "set point", IP), 115);
    assert_int_equal(most_of(&budget, "guard", IP), 55);
    assert_int_equal(most_of(&budget, "answer", IP), 65);
    assert_int_equal(most_of(&budget, "heartbeat", IP), 0);
    assert_int_equal(most_of(&budget, "speed", CSV), 95);
    assert_int_equal(most_of(&budget, "speed", CSP), 0);
    assert_int_equal(budget.item[0].most_bits, 65); /* SYNC, with its counter */
    budget_free(&budget);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(every_mode_follows_the_move, begin),
        cmocka_unit_test_setup(the_drive_has_what_the_file_says, begin),
        cmocka_unit_test_setup(a_revolution_that_is_not_the_drives_is_refused,
                               begin),
        cmocka_unit_test_setup(the_budget_counts_what_they_need, begin),
    };
    return cmocka_run_group_tests(tests, open_job, job_teardown);
}
