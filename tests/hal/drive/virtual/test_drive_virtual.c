/* tests/hal/drive/virtual/test_drive_virtual.c - a drive without a motor: what
 * hal/drive.h says of any drive, and that it is where it was told to be. */
#include "hal/drive/virtual/drive.h"
#include "motion/core/fixed.h"
#include "tests/support/check.h"

#define ONE MOTION_FIXED_ONE_Q32

static struct drive_virtual_bus bus;
static struct drive_virtual own;
static struct hal_drive *const drive = &own.drive;
static int64_t now_ns;

static int begin(void **state)
{
    (void)state;
    drive_virtual_bus_init(&bus);
    drive_virtual_init(&own, &bus, 3 * ONE);
    now_ns = 1000;
    return 0;
}

static struct hal_drive_feedback tick(void)
{
    struct hal_drive_feedback feedback;

    now_ns += 1000000;
    assert_int_equal(hal_fieldbus_begin(&bus.fieldbus, now_ns),
                     HAL_FIELDBUS_GOOD);
    hal_drive_feedback(drive, &feedback);
    assert_int_equal(feedback.t_ns, now_ns);
    hal_fieldbus_end(&bus.fieldbus, now_ns);
    return feedback;
}

static void send(int64_t pos_q32, int64_t vel_q32)
{
    const struct hal_drive_target target = { .pos_q32 = pos_q32,
                                             .vel_q32 = vel_q32 };

    assert_int_equal(hal_drive_set_target(drive, &target), MOTION_OK);
}

static void it_stands_off_where_it_began(void **state)
{
    const struct hal_drive_feedback feedback = tick();

    (void)state;
    assert_int_equal(feedback.state, HAL_DRIVE_OFF);
    assert_true(feedback.torque_off);
    assert_int_equal(feedback.pos_q32, 3 * ONE);
    send(50 * ONE, ONE);
    assert_int_equal(tick().pos_q32, 3 * ONE);
}

static void enabled_it_is_where_it_was_told_to_be(void **state)
{
    (void)state;
    hal_drive_request(drive, HAL_DRIVE_REQUEST_ENABLE);
    assert_int_equal(tick().state, HAL_DRIVE_ENABLED);
    for (int64_t i = 0; i < 100; i++) {
        send(i * ONE / 7, ONE);
        const struct hal_drive_feedback feedback = tick();
        assert_int_equal(feedback.pos_q32, i * ONE / 7);
        assert_int_equal(feedback.vel_q32, ONE);
        assert_true(feedback.following && feedback.demand_known);
        assert_int_equal(feedback.demand_q32, feedback.pos_q32);
        assert_false(feedback.torque_off);
    }
}

static void it_stands_after_a_quick_stop_and_when_off(void **state)
{
    static const enum hal_drive_request request[] = {
        HAL_DRIVE_REQUEST_QUICK_STOP, HAL_DRIVE_REQUEST_OFF
    };
    static const enum hal_drive_state then[] = { HAL_DRIVE_QUICK_STOP,
                                                 HAL_DRIVE_OFF };

    (void)state;
    hal_drive_request(drive, HAL_DRIVE_REQUEST_QUICK_STOP);
    assert_int_equal(tick().state,
                     HAL_DRIVE_OFF); /* there is nothing to stop */
    for (size_t i = 0; i < ARRAY_LEN(request); i++) {
        hal_drive_request(drive, HAL_DRIVE_REQUEST_ENABLE);
        send(20 * ONE, 5 * ONE);
        hal_drive_request(drive, request[i]);
        send(30 * ONE, 5 * ONE);
        const struct hal_drive_feedback feedback = tick();
        assert_int_equal(feedback.state, then[i]);
        assert_int_equal(feedback.pos_q32, 20 * ONE);
        assert_int_equal(feedback.vel_q32, 0);
        assert_false(feedback.following);
    }
}

static void a_reset_switches_nothing_on(void **state)
{
    (void)state;
    hal_drive_request(drive, HAL_DRIVE_REQUEST_RESET);
    assert_int_equal(tick().state, HAL_DRIVE_OFF);
    assert_int_equal(hal_drive_modes(drive), 1u << HAL_DRIVE_STREAM_POSITION);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(it_stands_off_where_it_began, begin),
        cmocka_unit_test_setup(enabled_it_is_where_it_was_told_to_be, begin),
        cmocka_unit_test_setup(it_stands_after_a_quick_stop_and_when_off,
                               begin),
        cmocka_unit_test_setup(a_reset_switches_nothing_on, begin),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
