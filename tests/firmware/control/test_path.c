/* tests/firmware/control/test_path.c - what is played in reverse has the
 * derivatives that its set points have, and a ramp run backwards in time is the
 * same ramp: random ones, compared nanosecond by nanosecond. */
#include <math.h>

#include "firmware/control/parts.h"
#include "motion/core/clock_walk.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/ease.h"
#include "tests/support/check.h"

#define MS   INT64_C(1000000)
#define RUNS 20000

static int64_t in(int64_t low, int64_t high)
{
    return check_random_in(check_stream(), low, high);
}

static bool random_ramp(struct motion_clock_warp *warp)
{
    const struct motion_clock_bound bound = {
        in(1, 4000) * (MOTION_CLOCK_WARP_ONE_Q30 / 200),
        in(1, 4000) * (MOTION_CLOCK_WARP_ONE_Q30 / 20),
    };
    motion_clock_warp_init(warp, 7 * MS, in(0, 1000 * MS) * MOTION_FIXED_NS_Q12,
                           in(0, MOTION_CLOCK_WARP_MAX_Q30));
    if (motion_clock_warp_ramp(warp, 7 * MS, in(0, MOTION_CLOCK_WARP_MAX_Q30),
                               &bound, MS, warp) < 0)
        return false;
    /* from the middle of it, with r' */
    const int64_t t_ns = warp->t0_ns + in(0, warp->dur_ns / MS) * MS;
    struct motion_clock_warp next;
    if (motion_clock_warp_ramp(warp, t_ns, 0, &bound, MS, &next) == MOTION_OK)
        *warp = next;
    return warp->dur_ns > 0;
}

static void near_to(const char *what, int64_t got, int64_t want, int64_t most)
{
    if (got - want > most || want - got > most)
        fail_msg("%s: %" PRId64 ", expected %" PRId64, what, got, want);
}

static void a_ramp_turned_is_the_ramp_backwards(void **state)
{
    struct controller controller = { .is_reversed = true,
                                     .move_end_ns_q12 =
                                         5000 * MS * MOTION_FIXED_NS_Q12 };
    int ramps = 0;
    (void)state;
    for (int run = 0; run < RUNS; run++) {
        struct motion_clock_warp warp, turned;
        if (!random_ramp(&warp))
            continue;
        ramps++;
        controller_path_turn(&controller, &warp, &turned);
        for (int k = 0; k < 20; k++) {
            const int64_t dt = in(0, warp.dur_ns - 1);
            struct motion_clock_rate a, b;
            motion_clock_warp_at(&warp, warp.t0_ns + dt, &a);
            motion_clock_warp_at(&turned, warp.t0_ns + warp.dur_ns - dt, &b);
            if (dt == 0)
                continue; /* the rate after the ramp */
            controller_path(&controller, &a);
            near_to("path", b.s_ns_q12, a.s_ns_q12, 4);
            near_to("rate", b.rate_q30, -a.rate_q30, 2);
            near_to("accel", b.accel_q30, a.accel_q30, 1 << 10);
        }
    }
    assert_true(ramps > RUNS / 4);
}

/* In reverse a ramp may end beyond the start of the path, where its turned one
 * begins, at rest: what it does on the path counts all the same. */
static void a_ramp_from_before_the_path_is_judged_on_it(void **state)
{
    const struct motion_ease_limit ease = { MOTION_FIXED_ONE_Q32,
                                            10 * MOTION_FIXED_ONE_Q32, 0 };
    struct motion_clock_limit limit = { 2 * MOTION_FIXED_ONE_Q32,
                                        14 * MOTION_FIXED_ONE_Q32, 0 };
    struct motion_segment segment[8];
    struct motion_track track;
    struct motion_clock_warp warp;
    int64_t looks = 10000;
    (void)state;
    motion_track_init(&track, segment, 8, 0);
    assert_int_equal(
        motion_ease_append_limited(&track, MOTION_FIXED_ONE_Q32, &ease),
        MOTION_OK);
    motion_clock_warp_init(&warp, 0, -20 * MS * MOTION_FIXED_NS_Q12,
                           MOTION_CLOCK_WARP_ONE_Q30 / 2);
    const struct motion_clock_bound bound = { 8 * MOTION_CLOCK_WARP_ONE_Q30,
                                              400 * MOTION_CLOCK_WARP_ONE_Q30 };
    assert_int_equal(motion_clock_warp_ramp(&warp, 0, MOTION_CLOCK_WARP_ONE_Q30,
                                            &bound, MS, &warp),
                     MOTION_OK);
    assert_true(motion_clock_warp_fits(&warp, &track, &limit, MS, &looks));
    limit.acc_q32 = 5 * MOTION_FIXED_ONE_Q32;
    assert_false(motion_clock_warp_fits(&warp, &track, &limit, MS, &looks));
}

/* In reverse the turned ramp ends where the ramp begins, with the r' that there
 * is: 3 f'' r r' of the jerk is largest there, and the only place over the
 * limit. */
static void a_ramp_in_reverse_is_judged_where_it_begins(void **state)
{
    const struct motion_state from = { 0 };
    const struct motion_state to = { .pos_q32 = 3 * MOTION_FIXED_ONE_Q32,
                                     .vel_q32 = 4 * MOTION_FIXED_ONE_Q32,
                                     .acc_q32 = 4 * MOTION_FIXED_ONE_Q32 };
    const struct motion_clock_bound bound = { 8 * MOTION_CLOCK_WARP_ONE_Q30,
                                              40 * MOTION_CLOCK_WARP_ONE_Q30 };
    struct motion_clock_limit limit = { 100 * MOTION_FIXED_ONE_Q32,
                                        1000 * MOTION_FIXED_ONE_Q32, 0 };
    struct motion_segment segment;
    struct motion_track track;
    struct motion_clock_warp warp, turned;
    int64_t begin_q32 = 0, rest_q32 = 0;
    (void)state;
    motion_track_init(&track, &segment, 1, 0);
    assert_int_equal(
        motion_track_append_quintic(&track, 2 * MOTION_FIXED_S_Q12, &from, &to),
        MOTION_OK);
    const struct controller controller = { .is_reversed = true,
                                           .move_end_ns_q12 =
                                               track.end_ns_q12 };
    motion_clock_warp_init(&warp, 0, 0, MOTION_CLOCK_WARP_ONE_Q30 / 10);
    assert_int_equal(motion_clock_warp_ramp(&warp, 0, MOTION_CLOCK_WARP_ONE_Q30,
                                            &bound, MS, &warp),
                     MOTION_OK);
    assert_int_equal(motion_clock_warp_ramp(&warp, 190 * MS,
                                            MOTION_CLOCK_WARP_ONE_Q30, &bound,
                                            MS, &warp),
                     MOTION_OK);
    for (int64_t dt = 0; dt <= warp.dur_ns; dt += MS) {
        struct motion_clock_rate now;
        struct motion_state path, axis;
        motion_clock_warp_at(&warp, warp.t0_ns + dt, &now);
        controller_path_state(&controller, &track, now.s_ns_q12, &path);
        motion_clock_warp_chain(&now, &path, &axis);
        if (dt == 0)
            begin_q32 = llabs(axis.jerk_q32);
        else if (llabs(axis.jerk_q32) > rest_q32)
            rest_q32 = llabs(axis.jerk_q32);
    }
    assert_true(begin_q32 > rest_q32);
    controller_path_turn(&controller, &warp, &turned);
    for (int over = 0; over < 2; over++) {
        struct motion_clock_walk walk;
        int64_t looks = 10000;
        int more;
        limit.jerk_q32 =
            over ? begin_q32 - begin_q32 / 1000 : begin_q32 + begin_q32 / 1000;
        motion_clock_walk_begin(&walk, &turned, &track, &limit, MS);
        walk.is_open = true;
        do
            more = motion_clock_walk_next(&walk, &looks);
        while (more > 0);
        assert_int_equal(more, over ? MOTION_E_LIMIT : 0);
    }
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
        cmocka_unit_test(a_ramp_turned_is_the_ramp_backwards),
        cmocka_unit_test(a_ramp_from_before_the_path_is_judged_on_it),
        cmocka_unit_test(a_ramp_in_reverse_is_judged_where_it_begins),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
