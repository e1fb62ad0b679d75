/* tests/firmware/control/test_path.c - what is played in reverse has the
 * derivatives that its set points have. */
#include <math.h>

#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "tests/support/check.h"

#define MS INT64_C(1000000)

static int64_t in(int64_t low, int64_t high)
{
    return check_random_in(check_stream(), low, high);
}

/* Of what is played, by central differences of the next lower derivative over
 * the time of the clock: forwards, and in reverse, where speed and jerk turn
 * round and acceleration does not. */
static void slope(const char *what, int64_t after, int64_t before, int64_t got)
{
    const double seconds = 2.0 * (double)MS / 1e9;
    const double want = ((double)after - (double)before) / seconds;
    if (fabs((double)got - want) > 1e-3 * (double)MOTION_FIXED_ONE_Q32)
        fail_msg("%s: %.6f unit, expected %.6f", what, (double)got * 0x1p-32,
                 want * 0x1p-32);
}

static void the_state_is_that_of_what_is_played(void **state)
{
    const struct motion_state from = { .vel_q32 = MOTION_FIXED_ONE_Q32 / 4 };
    const struct motion_state to = { .pos_q32 = 3 * MOTION_FIXED_ONE_Q32,
                                     .vel_q32 = -MOTION_FIXED_ONE_Q32 / 2,
                                     .acc_q32 = MOTION_FIXED_ONE_Q32 };
    const int64_t tick = MS * MOTION_FIXED_NS_Q12;
    struct motion_segment segment;
    struct motion_track track;
    (void)state;
    motion_track_init(&track, &segment, 1, 0);
    assert_int_equal(
        motion_track_append_quintic(&track, 3 * MOTION_FIXED_S_Q12, &from, &to),
        MOTION_OK);
    for (int way = 0; way < 2; way++) {
        const struct controller controller = { .is_reversed = way == 1,
                                               .move_end_ns_q12 =
                                                   track.end_ns_q12 };
        for (int run = 0; run < 1000; run++) {
            const int64_t s = in(tick, track.end_ns_q12 - tick);
            struct motion_state before, here, after;
            controller_path_state(&controller, &track, s - tick, &before);
            controller_path_state(&controller, &track, s, &here);
            controller_path_state(&controller, &track, s + tick, &after);
            slope("speed", after.pos_q32, before.pos_q32, here.vel_q32);
            slope("acceleration", after.vel_q32, before.vel_q32, here.acc_q32);
            slope("jerk", after.acc_q32, before.acc_q32, here.jerk_q32);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_state_is_that_of_what_is_played),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
