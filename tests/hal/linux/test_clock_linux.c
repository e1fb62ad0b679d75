/* tests/hal/linux/test_clock_linux.c - the machine's own clock.
 * Reads the real clock. */
#include "tests/support/check.h"

#include <signal.h>
#include <sys/time.h>

#include "hal/linux/clock.h"

#define MS       INT64_C(1000000)
#define FOR_EVER (60000 * MS) /* no pause of the machine is as long */

static struct hal_clock *start(void)
{
    static struct clock_linux self;

    return clock_linux_init(&self);
}

static void waiting_ends_at_or_after_its_time(void **state)
{
    struct hal_clock *clock = start();
    int64_t until_ns = hal_clock_now_ns(clock);

    (void)state;
    for (int i = 0; i < 10; i++) {
        until_ns += 1 * MS;
        assert_int_equal(hal_clock_wait_until(clock, until_ns), MOTION_OK);
        assert_true(hal_clock_now_ns(clock) >= until_ns);
    }
}

static void a_time_that_has_passed_is_not_waited_for(void **state)
{
    struct hal_clock *clock = start();
    const int64_t before_ns = hal_clock_now_ns(clock);

    (void)state;
    assert_int_equal(hal_clock_wait_until(clock, before_ns - 1), MOTION_OK);
    assert_int_equal(hal_clock_wait_until(clock, 0), MOTION_OK);
    assert_int_equal(hal_clock_wait_until(clock, -5 * MS), MOTION_OK);
    assert_true(hal_clock_now_ns(clock) - before_ns < FOR_EVER);
}

static void on_alarm(int number)
{
    (void)number;
}

/* Again and again, for the first may come before the wait has begun. */
static void a_signal_breaks_the_wait_off(void **state)
{
    struct hal_clock *clock = start();
    const int64_t before_ns = hal_clock_now_ns(clock);
    const struct itimerval soon = { .it_value = { .tv_usec = 20000 },
                                    .it_interval = { .tv_usec = 20000 } };
    const struct itimerval never = { 0 };
    struct sigaction action = { .sa_handler = on_alarm };

    (void)state;
    assert_int_equal(sigaction(SIGALRM, &action, NULL), 0);
    assert_int_equal(setitimer(ITIMER_REAL, &soon, NULL), 0);
    assert_int_equal(hal_clock_wait_until(clock, before_ns + FOR_EVER),
                     MOTION_E_IO);
    assert_true(hal_clock_now_ns(clock) - before_ns < FOR_EVER);
    assert_int_equal(setitimer(ITIMER_REAL, &never, NULL), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(waiting_ends_at_or_after_its_time),
        cmocka_unit_test(a_time_that_has_passed_is_not_waited_for),
        cmocka_unit_test(a_signal_breaks_the_wait_off),
    };

    return cmocka_run_group_tests_name("clock_linux", tests, NULL, NULL);
}
