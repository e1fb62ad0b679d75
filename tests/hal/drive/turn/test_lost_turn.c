/* tests/hal/drive/turn/test_lost_turn.c - drives that count turns and
 * are not heard any more, or hear nothing either, have no torque in the end. */
#include <inttypes.h>
#include <string.h>

#include "tests/hal/drive/turn/turn_world.h"

static void expect_text(const char *want)
{
    if (strstr(b.seen.fault_text, want) != b.seen.fault_text)
        fail_msg("\"%s\", not \"%s\"", b.seen.fault_text, want);
}

/* And then it does nothing, for nothing asks for it. */
static void expect_dark(void)
{
    assert_int_equal(b.seen.state, HAL_DRIVE_OFFLINE);
    assert_false(b.turn->has_torque());
    b.leaky.sent = 0;
    pass(1000 * MS);
    assert_int_equal(b.seen.state, HAL_DRIVE_OFFLINE);
    assert_false(b.turn->has_torque());
}

static void lose(const struct kind_turn *turn, enum motion motion, bool deaf,
                 bool comes_back)
{
    get_moving(turn, motion);
    b.leaky.mute = true;
    b.leaky.deaf = deaf;
    until(HAL_DRIVE_OFFLINE);
    expect_text("lost; trying to switch it off: ");
    pass(2000 * MS);
    if (!comes_back) {
        expect_text("lost; trying to switch it off: ");
        expect_dark();
        assert_in_range(b.leaky.sent, 5, 30); /* a second */
        return;
    }
    b.leaky.mute = b.leaky.deaf = false;
    pass(500 * MS);
    expect_text("lost, then switched off: ");
    expect_dark();
    assert_int_equal(b.leaky.sent, 0);
}

static void keeps_no_torque(const struct kind_turn *turn)
{
    for (int motion = STANDING; motion <= GOING; motion++) {
        lose(turn, (enum motion)motion, false, true);
        lose(turn, (enum motion)motion, true, true);
        lose(turn, (enum motion)motion, false, false);
    }
}

/* 10 units/s are a turn a second, 65536 counts/s. */
static void is_ramped_down(const struct kind_turn *turn)
{
    lose(turn, STREAMED, false, true);
    print_message("%s: %" PRId64 " counts/s when torque went\n", turn->text,
                  b.cut_vel_q24 >> 24);
    assert_true(b.cut_vel_q24 >> 24 < 3000);
    assert_true(b.cut_vel_q24 >> 24 > -3000);
}

/* A reset before it was heard: it is still being switched off. */
static void is_reset(const struct kind_turn *turn)
{
    get_moving(turn, STANDING);
    b.leaky.mute = b.leaky.deaf = true;
    until(HAL_DRIVE_OFFLINE);
    pass(500 * MS);
    hal_drive_request(b.drive, HAL_DRIVE_REQUEST_RESET);
    b.streams = false;
    pass(500 * MS);
    b.leaky.deaf = false; /* it hears again, and is not heard */
    pass(500 * MS);
    assert_false(b.turn->has_torque());
    b.leaky.mute = false;
    until(HAL_DRIVE_OFF);
    pass(500 * MS);
    assert_int_equal(b.seen.state, HAL_DRIVE_OFF);
    assert_false(b.turn->has_torque());
}

static void none_keeps_its_torque(void **state)
{
    (void)state;
    each(keeps_no_torque);
}

static void one_that_hears_is_ramped_down_first(void **state)
{
    (void)state;
    each(is_ramped_down);
}

static void a_reset_does_not_forget_the_torque(void **state)
{
    (void)state;
    each(is_reset);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(none_keeps_its_torque),
        cmocka_unit_test(one_that_hears_is_ramped_down_first),
        cmocka_unit_test(a_reset_does_not_forget_the_torque),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
