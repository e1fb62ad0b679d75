/* tests/firmware/control/test_mailbox.c - commands go in once and in order,
 * every one is answered, a stop is never refused; two threads on one mailbox.
 */
#include "firmware/control/mailbox.h"

#include <pthread.h>
#include <string.h>

#include "firmware/control/playback.h"
#include "tests/support/check.h"

/* One without axes: off, so that there is nothing to hold, while an override
 * is taken at any time. */
static struct controller controller;
static struct playback playback;
static struct mailbox mailbox;

static int begin(void **state)
{
    (void)state;
    memset(&controller, 0, sizeof controller);
    playback_init(&playback, &controller, NULL, NULL);
    mailbox_init(&mailbox);
    return 0;
}

static void commands_are_answered_in_order(void **state)
{
    struct mailbox_entry answer;
    (void)state;
    assert_false(mailbox_answer(&mailbox, &answer));
    assert_int_equal(mailbox_put(&mailbox, MAILBOX_OVERRIDE, 5), MOTION_OK);
    assert_int_equal(mailbox_put(&mailbox, MAILBOX_HOLD, 0), MOTION_OK);
    assert_int_equal(mailbox_put(&mailbox, MAILBOX_OVERRIDE, -1), MOTION_OK);
    assert_false(mailbox_answer(&mailbox, &answer));
    assert_false(mailbox_step(&mailbox, &playback));
    assert_int_equal(controller.override_q30, 5);
    assert_true(mailbox_answer(&mailbox, &answer));
    assert_int_equal(answer.command, MAILBOX_OVERRIDE);
    assert_int_equal(answer.err, MOTION_OK);
    assert_true(mailbox_answer(&mailbox, &answer));
    assert_int_equal(answer.command, MAILBOX_HOLD);
    assert_int_equal(answer.err, MOTION_E_STATE);
    assert_true(mailbox_answer(&mailbox, &answer));
    assert_int_equal(answer.value, -1);
    assert_int_equal(answer.err, MOTION_E_ARG);
    assert_false(mailbox_answer(&mailbox, &answer));
}

static void a_full_mailbox_refuses_all_but_a_stop(void **state)
{
    struct mailbox_entry answer;
    (void)state;
    for (int i = 0; i < MAILBOX_CAPACITY; i++)
        assert_int_equal(mailbox_put(&mailbox, MAILBOX_OVERRIDE, i), MOTION_OK);
    assert_int_equal(mailbox_put(&mailbox, MAILBOX_HOLD, 0), MOTION_E_FULL);
    mailbox_stop(&mailbox);
    assert_true(mailbox_step(&mailbox, &playback));
    assert_int_equal(controller.stops, 1);
    /* Done, but the answers still have their places. */
    assert_int_equal(mailbox_put(&mailbox, MAILBOX_HOLD, 0), MOTION_E_FULL);
    assert_true(mailbox_answer(&mailbox, &answer));
    assert_int_equal(mailbox_put(&mailbox, MAILBOX_HOLD, 0), MOTION_OK);
    assert_false(mailbox_step(&mailbox, &playback));
}

static void a_stop_refuses_all_but_off_that_came_with_it(void **state)
{
    struct mailbox_entry answer;
    (void)state;
    assert_int_equal(mailbox_put(&mailbox, MAILBOX_OVERRIDE, 7), MOTION_OK);
    assert_int_equal(mailbox_put(&mailbox, MAILBOX_OFF, 0), MOTION_OK);
    mailbox_stop(&mailbox);
    mailbox_stop(&mailbox);
    assert_true(mailbox_step(&mailbox, &playback));
    assert_int_equal(controller.stops, 1);
    assert_int_equal(controller.override_q30, 0);
    assert_true(mailbox_answer(&mailbox, &answer));
    assert_int_equal(answer.err, MOTION_E_STATE);
    assert_true(mailbox_answer(&mailbox, &answer));
    assert_int_equal(answer.command, MAILBOX_OFF);
    assert_int_equal(answer.err, MOTION_OK);
    assert_false(mailbox_step(&mailbox, &playback));
}

static void an_unknown_command_is_refused(void **state)
{
    (void)state;
    assert_int_equal(mailbox_put(&mailbox, MAILBOX_COMMANDS, 0), MOTION_E_ARG);
    assert_int_equal(mailbox_put(&mailbox, (enum mailbox_command) - 1, 0),
                     MOTION_E_ARG);
}

static void counters_wrap(void **state)
{
    struct mailbox_entry answer;
    (void)state;
    mailbox.put = UINT32_MAX - 2;
    mailbox.done = UINT32_MAX - 2;
    mailbox.answered = UINT32_MAX - 2;
    for (int64_t i = 1; i < 40; i++) {
        assert_int_equal(mailbox_put(&mailbox, MAILBOX_OVERRIDE, i), MOTION_OK);
        assert_false(mailbox_step(&mailbox, &playback));
        assert_int_equal(controller.override_q30, i);
        assert_true(mailbox_answer(&mailbox, &answer));
        assert_int_equal(answer.value, i);
    }
}

/* --- two threads ----------------------------------------------------------- */

#define SENT 200000

static _Atomic bool over;

static void *tick(void *context)
{
    unsigned *stops = context;
    int64_t last = 0;
    while (!over) {
        controller.override_q30 = last;
        *stops += mailbox_step(&mailbox, &playback);
        /* Overrides come in rising order: none twice, none before another. */
        if (controller.override_q30 < last)
            return context;
        last = controller.override_q30;
    }
    *stops += mailbox_step(&mailbox, &playback);
    return NULL;
}

static void two_threads_lose_nothing(void **state)
{
    struct mailbox_entry answer;
    unsigned stops = 0;
    int64_t sent = 0, answered = 0;
    pthread_t thread;
    void *failed;
    (void)state;
    over = false;
    assert_int_equal(pthread_create(&thread, NULL, tick, &stops), 0);
    while (answered < SENT) {
        if (sent < SENT &&
            mailbox_put(&mailbox, MAILBOX_OVERRIDE, sent + 1) == MOTION_OK)
            sent++;
        while (mailbox_answer(&mailbox, &answer)) {
            assert_int_equal(answer.value, ++answered);
            assert_true(answer.err == MOTION_OK ||
                        answer.err == MOTION_E_STATE);
        }
        if (sent % 1000 == 999)
            mailbox_stop(&mailbox);
    }
    over = true;
    assert_int_equal(pthread_join(thread, &failed), 0);
    assert_null(failed);
    assert_true(stops > 0);
    assert_int_equal(controller.stops, stops);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(commands_are_answered_in_order, begin),
        cmocka_unit_test_setup(a_full_mailbox_refuses_all_but_a_stop, begin),
        cmocka_unit_test_setup(a_stop_refuses_all_but_off_that_came_with_it,
                               begin),
        cmocka_unit_test_setup(an_unknown_command_is_refused, begin),
        cmocka_unit_test_setup(counters_wrap, begin),
        cmocka_unit_test_setup(two_threads_lose_nothing, begin),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
