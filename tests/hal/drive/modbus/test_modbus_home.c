/* tests/hal/drive/modbus/test_modbus_home.c - a drive is at home by the homing
 * that was asked for, and not by what the last one left in its status. */
#include "tests/hal/drive/modbus/strict_bench.h"

#define AT_Q32 (7 * UNIT_Q32)
#define NEAR   1 /* half units: within the first step */
#define FAR    6

static struct strict_bench bench;

static const struct hal_drive_home there = { .pos_q32 = AT_Q32,
                                             .timeout_ns = 60000 * MS };

static void home(void)
{
    assert_int_equal(hal_drive_home(&bench.drive.drive, &there), MOTION_OK);
    for (int i = 0; i < 70000; i++) {
        strict_bench_tick(&bench);
        if (bench.feedback.homing != HAL_DRIVE_HOMING_RUNNING)
            return;
    }
    fail_msg("%s: still homing", bench.map.title);
}

static void expect_home(void)
{
    if (bench.feedback.homing != HAL_DRIVE_HOMING_DONE)
        fail_msg("%s: not home: %s", bench.map.title,
                 bench.feedback.fault_text);
    assert_true(bench.servo.homed);
    assert_false(bench.servo.homing);
    strict_bench_run(&bench, 100 * MS);
    assert_int_equal(bench.feedback.state, HAL_DRIVE_ENABLED);
    assert_true(llabs(bench.feedback.pos_q32 - AT_Q32) < UNIT_Q32 / 1000);
}

/* No further than a position may jump. */
static void stand_at(int counts)
{
    bench.servo.pos = bench.servo.target = counts;
    strict_bench_run(&bench, 200 * MS);
}

/* Homed once, then so many half units off: its flag is set. */
static void homed_bench(enum strict_modbus_kind kind, int halves)
{
    strict_bench_init(&bench, kind);
    strict_bench_enable(&bench);
    bench.servo.ramp = 20 * STRICT_COUNTS;
    assert_int_equal(hal_drive_set_mode(&bench.drive.drive, HAL_DRIVE_HOMING),
                     MOTION_OK);
    home();
    expect_home();
    for (int i = 1; i <= halves; i++)
        stand_at(i * STRICT_COUNTS / 2);
    bench.servo.home_away = halves * STRICT_COUNTS / 2;
}

/* It begins late, and clears its flag later still.  Near home its position does
 * not give it away. */
static void a_flag_that_lingers_is_not_believed(void **state)
{
    (void)state;
    for (unsigned i = 0; i < 2 * ARRAY_LEN(strict_map); i++) {
        homed_bench((enum strict_modbus_kind)(i / 2), i % 2 == 0 ? NEAR : FAR);
        bench.servo.home_late_ns = 400 * MS;
        bench.servo.homed_lingers_ns = 150 * MS;
        home();
        expect_home();
    }
}

static void a_flag_that_is_never_cleared_is_not_believed(void **state)
{
    (void)state;
    for (unsigned i = 0; i < 2 * ARRAY_LEN(strict_map); i++) {
        homed_bench((enum strict_modbus_kind)(i / 2), i % 2 == 0 ? NEAR : FAR);
        bench.servo.home_late_ns = 400 * MS;
        bench.servo.homed_stays = true;
        home();
        expect_home();
    }
}

/* Low before the mode was written, and then that of the last homing: whenever
 * the polls come. */
static void a_flag_that_was_low_before_the_start_is_not_believed(void **state)
{
    (void)state;
    for (int offset = 0; offset < 30; offset++) {
        homed_bench(STRICT_LEXIUM, NEAR);
        bench.servo.homed_hides = bench.servo.homed_stays = true;
        bench.servo.home_late_ns = 400 * MS;
        strict_bench_run(&bench, (100 + offset) * MS);
        home();
        expect_home();
    }
}

/* Faster than the polls: its flag is not seen low.  From 0, and from where it
 * stands to 0 at once. */
static void one_that_is_there_already_is_at_home(void **state)
{
    (void)state;
    for (unsigned i = 0; i < 2 * ARRAY_LEN(strict_map); i++) {
        homed_bench((enum strict_modbus_kind)(i / 2), i % 2 == 0 ? 0 : FAR);
        bench.servo.home_away = 0;
        home();
        expect_home();
    }
}

/* It stands where it stood, half a unit from home or more, with the flag of the last homing. */
static void one_that_does_not_begin_is_a_fault(void **state)
{
    static const char *const want[] = {
        [STRICT_LEXIUM] =
            "homed (status, 0x1B04) stays set: at 30000, not at 0",
        [STRICT_EL7] = "homed (state, 0x0B05) stays set: at 30000, not at 0",
        [STRICT_ASDA] = "homed (outputs, 0x005C) stays set: at 30000, not at 0",
        [STRICT_AZ] = "homed (outputs, 0x007E) stays set: at 30000, not at 0",
    };

    (void)state;
    for (unsigned kind = 0; kind < ARRAY_LEN(strict_map); kind++) {
        homed_bench((enum strict_modbus_kind)kind, FAR);
        bench.servo.homes_not = true;
        home();
        assert_int_equal(bench.feedback.homing, HAL_DRIVE_HOMING_FAILED);
        assert_string_equal(bench.feedback.fault_text, want[kind]);
        strict_bench_run(&bench, 2000 * MS);
        assert_false(bench.servo.torque);
        homed_bench((enum strict_modbus_kind)kind, NEAR);
        bench.servo.homes_not = true;
        home();
        assert_int_equal(bench.feedback.homing, HAL_DRIVE_HOMING_FAILED);
    }
}

/* Its flag is clear while it homes, and it counts from elsewhere then. */
static void a_home_that_does_not_read_0_is_a_fault(void **state)
{
    (void)state;
    for (unsigned kind = 0; kind < ARRAY_LEN(strict_map); kind++) {
        homed_bench((enum strict_modbus_kind)kind, FAR);
        bench.servo.home_late_ns = 100 * MS;
        assert_int_equal(hal_drive_home(&bench.drive.drive, &there), MOTION_OK);
        bench.servo.lies = true;
        strict_bench_until(&bench, HAL_DRIVE_FAULT);
        assert_int_equal(bench.feedback.homing, HAL_DRIVE_HOMING_FAILED);
        assert_string_equal(bench.feedback.fault_text,
                            "homing ended at 400000, not at 0");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_flag_that_lingers_is_not_believed),
        cmocka_unit_test(a_flag_that_is_never_cleared_is_not_believed),
        cmocka_unit_test(a_flag_that_was_low_before_the_start_is_not_believed),
        cmocka_unit_test(one_that_is_there_already_is_at_home),
        cmocka_unit_test(one_that_does_not_begin_is_a_fault),
        cmocka_unit_test(a_home_that_does_not_read_0_is_a_fault),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
