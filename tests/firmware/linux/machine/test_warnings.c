/* tests/firmware/linux/machine/test_warnings.c - at which following error there is
 * a warning, and how often. */
#include <string.h>

#include "firmware/linux/machine/warnings.h"
#include "motion/core/fixed.h"
#include "tests/support/check.h"

#define UNIT MOTION_FIXED_ONE_Q32
#define MS   INT64_C(1000000)

/* 2 mm, and from 100 mm/s on 20 ms of the speed. */
static const struct rig_axis rail = { .name = "rail",
                                      .unit = UNITS_AXIS_MM,
                                      .following_floor_q32 = 2 * UNIT,
                                      .following_k_ns = 20 * MS };

static struct machine_warnings warnings;

static int begin(void **state)
{
    (void)state;
    memset(&warnings, 0, sizeof warnings);
    return 0;
}

static uint32_t take(int64_t off_q32, int64_t vel_q32)
{
    const struct controller_axis axis = { .following_q32 = off_q32,
                                          .target.vel_q32 = vel_q32 };
    machine_warnings_step(&warnings, &rail, &axis, NULL, NULL);
    return warnings.newest.number;
}

static void it_comes_over_half_of_the_limit(void **state)
{
    static const struct {
        int64_t off_q32, vel_q32;
        uint32_t count;
    } rows[] = {
        { 0, 0, 0 },
        { UNIT, 0, 0 },
        { UNIT + 1, 0, 1 },
        { -UNIT, 0, 0 },
        { -UNIT - 1, 0, 1 },
        { UNIT + 1, 100 * UNIT, 1 },
        { 2 * UNIT, 200 * UNIT, 0 },
        { 2 * UNIT + 1, -200 * UNIT, 1 },
        { INT64_MIN, 0, 1 },
        { 4 * UNIT, INT64_MIN, 0 }, /* no number for the limit */
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        memset(&warnings, 0, sizeof warnings);
        if (take(rows[i].off_q32, rows[i].vel_q32) != rows[i].count)
            fail_msg("row %zu: %u", i, warnings.newest.number);
    }
}

static void it_is_one_until_it_has_been_below_three_eighths(void **state)
{
    (void)state;
    assert_int_equal(take(UNIT + UNIT / 2, 0), 1);
    assert_true(warnings.newest.value_q32 == UNIT + UNIT / 2);
    assert_true(warnings.newest.limit_q32 == 2 * UNIT);
    assert_int_equal(take(UNIT * 9 / 10, 0), 1);
    assert_int_equal(take(UNIT + UNIT / 4, 0), 1);
    assert_int_equal(take(UNIT * 3 / 4, 0), 1);
    assert_int_equal(take(UNIT + 1, 0), 1);
    assert_int_equal(take(UNIT * 3 / 4 - 1, 0), 1);
    assert_int_equal(take(-UNIT - 1, 0), 2);
    assert_int_equal(take(UNIT + 2, 0), 2);
    assert_true(warnings.newest.value_q32 == -UNIT - 1);
    assert_int_equal(warnings.newest.kind, WARNING_FOLLOWING);
}

static void it_is_said_with_its_axis_and_values(void **state)
{
    char text[WARNING_TEXT_MAX];
    (void)state;
    (void)take(-UNIT - UNIT / 4, 0);
    warning_text(&warnings.newest, &rail, text);
    assert_string_equal(text,
                        "rail: following error over half of its limit, -1.25 "
                        "of 2 mm");
}

/* Each time once, when it has been stopped. */
static void a_drive_that_was_found_enabled_is_said(void **state)
{
    struct hal_drive_found found = { .count = 0 };
    struct controller_axis axis = { .feedback.state = HAL_DRIVE_OFF };
    char text[WARNING_TEXT_MAX];
    (void)state;
    machine_warnings_step(&warnings, &rail, &axis, NULL, &found);
    assert_int_equal(warnings.newest.number, 0);
    found = (struct hal_drive_found){ .count = 1, .vel_q32 = -30 * UNIT };
    for (int state_now = HAL_DRIVE_OFFLINE; state_now <= HAL_DRIVE_FAULT;
         state_now++) {
        axis.feedback.state = (enum hal_drive_state)state_now;
        memset(&warnings, 0, sizeof warnings);
        machine_warnings_step(&warnings, &rail, &axis, NULL, &found);
        machine_warnings_step(&warnings, &rail, &axis, NULL, &found);
        assert_int_equal(warnings.newest.number,
                         state_now != HAL_DRIVE_OFFLINE &&
                             state_now != HAL_DRIVE_QUICK_STOP);
    }
    warning_text(&warnings.newest, &rail, text);
    assert_string_equal(text, "rail: found enabled: stopped, then torque off, "
                              "moving at -30.000 mm/s");
    found = (struct hal_drive_found){ .count = 2, .goes_on = true };
    machine_warnings_step(&warnings, &rail, &axis, NULL, &found);
    assert_int_equal(warnings.newest.number, 2);
    warning_text(&warnings.newest, &rail, text);
    assert_string_equal(text, "rail: found enabled: torque off, as it did not "
                              "come to rest in its time (another master?)");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(it_comes_over_half_of_the_limit, begin),
        cmocka_unit_test_setup(it_is_one_until_it_has_been_below_three_eighths,
                               begin),
        cmocka_unit_test_setup(it_is_said_with_its_axis_and_values, begin),
        cmocka_unit_test_setup(a_drive_that_was_found_enabled_is_said, begin),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
