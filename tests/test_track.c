/* tests/test_track.c - the trajectory form; see motion/track.h. */
#include <inttypes.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "motion/err.h"
#include "motion/fixed.h"
#include "motion/track.h"

#define ARRAY_LEN(a) (sizeof(a) / sizeof((a)[0]))
#define ONE          MOTION_FIXED_ONE_Q32
#define S            MOTION_FIXED_S_Q12
#define MS           (S / 1000)
#define HOUR         (3600 * S)

static struct motion_segment room[64];

static struct motion_track start_at(int64_t pos_q32)
{
    struct motion_track track;
    motion_track_init(&track, room, ARRAY_LEN(room), pos_q32);
    return track;
}

static struct motion_sample sample_at(const struct motion_track *track,
                                      int64_t t_ns_q12)
{
    struct motion_cursor cursor = { 0 };
    struct motion_sample sample;
    motion_track_sample(track, &cursor, t_ns_q12, &sample);
    return sample;
}

static void assert_near(int64_t got, int64_t want, int64_t room_for,
                        const char *what)
{
    if (got - want > room_for || want - got > room_for)
        fail_msg("%s: got %" PRId64 ", want %" PRId64, what, got, want);
}

static void a_line_goes_straight(void **state)
{
    struct motion_track track = start_at(-3 * ONE);
    (void)state;
    assert_int_equal(motion_track_append_line(&track, 4 * S, 5 * ONE), 0);
    struct motion_sample s = sample_at(&track, S);
    assert_near(s.pos_q32, -ONE, 1, "pos");
    assert_near(s.vel_q32, 2 * ONE, 1, "vel");
    assert_near(s.acc_q16, 0, 0, "acc");
    assert_int_equal(track.end.pos_q32, 5 * ONE);
    assert_int_equal(track.end.vel_q32, 2 * ONE);
}

static void a_quintic_meets_its_ends(void **state)
{
    struct motion_track track = start_at(7 * ONE);
    const struct motion_state a = { .vel_q32 = 3 * ONE, .acc_q16 = -(2 << 16) };
    const struct motion_state b = { 100 * ONE, -ONE, 5 << 16, 0 };
    struct motion_state got;
    (void)state;
    assert_int_equal(motion_track_append_quintic(&track, 3 * S, &a, &b), 0);
    motion_track_state(&track, 0, &got);
    assert_int_equal(got.pos_q32, 7 * ONE);
    assert_near(got.vel_q32, a.vel_q32, 1, "v0");
    assert_near(got.acc_q16, a.acc_q16, 1, "a0");
    assert_int_equal(track.end.pos_q32, b.pos_q32);
    assert_near(track.end.vel_q32, b.vel_q32, 1, "v1");
    assert_near(track.end.acc_q16, b.acc_q16, 1, "a1");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_line_goes_straight),
        cmocka_unit_test(a_quintic_meets_its_ends),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
