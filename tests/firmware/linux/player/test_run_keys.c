/* tests/firmware/linux/player/test_run_keys.c - the keys of a terminal while a
 * move runs on the clock.  Reads the real clock.  Takes long. */
#define _XOPEN_SOURCE 700 /* posix_openpt, of terminal_program.h */
#include "firmware/linux/player/run_keys.h"

#include <termios.h>

#include "tests/support/terminal_program.h"

#define MOVE "tests/data/keys"

static void begin(void)
{
    static const char *const argv[] = { "slew", "run", "--realtime", MOVE,
                                        NULL };
    forget();
    start(argv, true);
    expect("keys: space holds");
}

/* A quarter of the move or more is over: of the bar's forty places ten. */
static void expect_a_quarter(void)
{
    expect("[##########");
}

static void finish_stopped(void)
{
    const int status = finish();
    if (status != 130)
        fail_msg("status %d:\n%s", status, heard);
}

static void space_holds_and_resumes(void **state)
{
    (void)state;
    begin();
    expect("s left");
    press(" ");
    expect("holding");
    forget();
    press(" ");
    expect("s left");
    press("q");
    finish_stopped();
    assert_non_null(strstr(heard, "stopped"));
}

static void n_takes_the_frame_that_waits(void **state)
{
    static const char *const argv[] = { "slew", "run", "--realtime",
                                        "tests/data/steps", NULL };
    char waits[] = "frame 1 waits";
    (void)state;
    forget();
    start(argv, true);
    expect("n takes the frame that waits");
    for (; waits[6] <= '5'; waits[6]++) {
        expect(waits);
        press("n");
    }
    const int status = finish();
    if (status != 0 || strstr(heard, "step by step: 5 of 5 frames") == NULL)
        fail_msg("status %d:\n%s", status, heard);
}

static void plus_and_minus_change_the_speed(void **state)
{
    (void)state;
    begin();
    press("-");
    expect("once the move has begun");
    expect("s left");
    press("---");
    expect("at 70 %");
    press("+");
    expect("at 80 %");
    press("0");
    forget();
    expect("s left\033[K");
    press("q");
    finish_stopped();
}

static void a_speed_beyond_the_limits_is_refused(void **state)
{
    (void)state;
    begin();
    expect("s left");
    for (int i = 0; i < 10; i++) {
        press("+");
        hear(0.1);
    }
    expect("% the move would break a limit");
    press("q");
    finish_stopped();
}

static void q_stops_before_the_move_too(void **state)
{
    (void)state;
    begin();
    press("q");
    finish_stopped();
}

static void r_goes_back_along_the_path(void **state)
{
    (void)state;
    begin();
    expect_a_quarter(); /* so that the way back is long enough to be seen */
    press("r");
    expect(", back");
    assert_int_equal(finish(), 0); /* over at its start */
    assert_non_null(strstr(heard, "done"));
}

static void b_goes_back_to_the_start_and_holds_there(void **state)
{
    (void)state;
    begin();
    expect_a_quarter();
    forget();
    press("b");
    expect("going to the start");
    expect("  0 %  holding");
    press(" ");
    expect("s left");
    press("q");
    finish_stopped();
}

/* Half of the time of a curve that is as fast after it as before. */
static void g_goes_to_a_time_and_c_says_where_that_is(void **state)
{
    (void)state;
    begin();
    expect("s left");
    press("c");
    expect("no position to capture: hold the axes first");
    press("g40");
    expect("go to: 40");
    press("\n");
    expect("it cannot go there: the time is not within the move");
    press("g7\1774 s\n");
    expect(" 50 %  holding");
    press("c");
    expect("at 4.000 s: slide 450.000000 mm");
    press("gx\n");
    expect("is not a number");
    press("g1\177\177r");
    expect(", back");
    press("q");
    finish_stopped();
}

static void l_sets_how_often_it_is_played(void **state)
{
    static const char *const argv[] = { "slew",        "run", "--realtime",
                                        "--ping-pong", MOVE,  NULL };
    (void)state;
    forget();
    start(argv, true);
    expect("moving, 1 of 2 ");
    press("lx\n");
    expect("expected how often it is played in all, 0 to 999999999");
    press("l1234567890\n");
    expect_times("expected how often it is played in all", 2);
    press("l0");
    expect("times: 0");
    press("\n");
    expect("played until it is stopped, every second time in reverse");
    expect("moving, time 1 ");
    press("l3\n");
    expect("played 3 times in all");
    expect("moving, 1 of 3 ");
    press("q");
    finish_stopped();
}

static void ctrl_c_and_the_terminal_stay_what_they_are(void **state)
{
    struct termios during;
    (void)state;
    begin();
    assert_int_equal(tcgetattr(line, &during), 0);
    assert_int_equal(during.c_lflag & ICANON, 0);
    expect("s left");
    press("\003");
    expect("stopped");
    finish_stopped();
}

static void without_a_terminal_there_are_no_keys(void **state)
{
    static const char *const argv[] = { "slew", "run", MOVE, NULL };
    (void)state;
    forget();
    start(argv, false);
    assert_int_equal(finish(), 0);
    assert_null(strstr(heard, "keys:"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(space_holds_and_resumes),
        cmocka_unit_test(n_takes_the_frame_that_waits),
        cmocka_unit_test(plus_and_minus_change_the_speed),
        cmocka_unit_test(a_speed_beyond_the_limits_is_refused),
        cmocka_unit_test(q_stops_before_the_move_too),
        cmocka_unit_test(r_goes_back_along_the_path),
        cmocka_unit_test(b_goes_back_to_the_start_and_holds_there),
        cmocka_unit_test(g_goes_to_a_time_and_c_says_where_that_is),
        cmocka_unit_test(l_sets_how_often_it_is_played),
        cmocka_unit_test(ctrl_c_and_the_terminal_stay_what_they_are),
        cmocka_unit_test(without_a_terminal_there_are_no_keys),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
