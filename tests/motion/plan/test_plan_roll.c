/* tests/motion/plan/test_plan_roll.c - what begins or ends in motion is brought up to
 * speed before, and to rest after: without a step, and the shot to the bit. */
#include "motion/plan/plan_roll.h"

#include <math.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/check.h"
#include "motion/plan/move.h"
#include "motion/plan/plan_track.h"
#include "tests/support/check.h"

#define UNIT MOTION_FIXED_ONE_Q32
#define SEC  MOTION_FIXED_S_Q12

static double between(double low, double high)
{
    return low + (high - low) * (double)draw_unit();
}

static int64_t q32(double x)
{
    return llrint(x * (double)UNIT);
}

static struct motion_state any_state(double most)
{
    return (struct motion_state){ .pos_q32 = q32(between(-500, 500)),
                                  .vel_q32 = q32(between(-most, most)),
                                  .acc_q32 = q32(between(-most, most)) };
}

/* Two segments, which begin and end in motion. */
static void any_track(struct motion_track *track, struct motion_state *first)
{
    const struct motion_state middle = any_state(90), last = any_state(90);

    *first = any_state(90);
    plan_track_init(track, first->pos_q32);
    plan_track_reserve(track, 2);
    assert_int_equal(
        motion_track_append_quintic(track, llrint(between(1, 4) * (double)SEC),
                                    first, &middle),
        MOTION_OK);
    assert_int_equal(
        motion_track_append_quintic(track, llrint(between(1, 4) * (double)SEC),
                                    &track->end, &last),
        MOTION_OK);
}

/* No step, and rest at both ends: with limits far above what there is, all that
 * could be broken is that. */
static void expect_smooth(const struct motion_track *track)
{
    const struct plan_limit limit = { .pos_min_q32 = q32(-1e8),
                                      .pos_max_q32 = q32(1e8),
                                      .vel_q32 = q32(1e7),
                                      .acc_q32 = q32(1e8),
                                      .jerk_q32 = q32(1e9) };
    struct plan_violation found;

    if (plan_check_track(track, &limit, &found, 1) > 0)
        fail_msg("kind %d at %g s: %g", (int)found.kind,
                 (double)found.t_ns_q12 / (double)SEC,
                 (double)found.value / (double)UNIT);
}

static void a_roll_is_smooth_and_the_shot_is_kept_to_the_bit(void **state)
{
    (void)state;
    seed_from("a_roll_is_smooth_and_the_shot_is_kept_to_the_bit");
    for (int n = 0; n < 500; n++) {
        const int64_t before = llrint(between(0.1, 3) * (double)SEC),
                      after = llrint(between(0.1, 3) * (double)SEC);
        struct motion_state first, now;
        struct motion_track track, shot;
        any_track(&track, &first);
        any_track(&shot, &first);
        plan_track_free(&track);
        struct motion_segment was[2] = { shot.segment[0], shot.segment[1] };
        const int64_t end = shot.end_ns_q12;
        assert_int_equal(plan_roll_track(&shot, before, after), MOTION_OK);
        assert_int_equal(shot.count, 4);
        assert_int_equal(shot.end_ns_q12, before + end + after);
        expect_smooth(&shot);
        for (int i = 0; i < 2; i++) {
            const struct motion_segment *is = &shot.segment[i + 1];
            assert_int_equal(is->start_ns_q12, was[i].start_ns_q12 + before);
            assert_int_equal(is->dur_ns_q12, was[i].dur_ns_q12);
            assert_memory_equal(is->coef, was[i].coef, sizeof is->coef);
            assert_int_equal(is->pos_q32, was[i].pos_q32);
        }
        motion_track_state(&shot, 0, &now);
        const double t = (double)before / (double)SEC,
                     want = (double)first.pos_q32 -
                            t / 2 * (double)first.vel_q32 +
                            t * t / 12 * (double)first.acc_q32;
        assert_true(fabs((double)now.pos_q32 - want) < 1e-3 * (double)UNIT);
        plan_track_free(&shot);
    }
}

/* From rest to 150 mm/s in 2 s: 150 mm, at most 112.5 mm/s2 and 225 mm/s3. */
static void the_figures_are_those_of_the_formulas(void **state)
{
    const struct motion_state speed = { .vel_q32 = q32(150) };
    struct motion_extreme acc, jerk;
    struct motion_track track;

    (void)state;
    plan_track_init(&track, q32(400));
    plan_track_reserve(&track, 1);
    assert_int_equal(motion_track_append_line(&track, 8 * SEC, q32(1600)),
                     MOTION_OK);
    assert_int_equal(track.end.vel_q32, speed.vel_q32);
    assert_int_equal(plan_roll_track(&track, 2 * SEC, 0), MOTION_OK);
    assert_int_equal(track.segment[0].pos_q32, q32(250));
    track.count = 1;
    track.end_ns_q12 = 2 * SEC;
    motion_track_extreme(&track, MOTION_ACC, &acc);
    motion_track_extreme(&track, MOTION_JERK, &jerk);
    assert_true(fabs((double)acc.max / (double)UNIT - 112.5) < 1e-6);
    assert_true(fabs((double)jerk.max / (double)UNIT - 225) < 1e-6);
    assert_true(fabs((double)jerk.min / (double)UNIT + 225) < 1e-6);
    plan_track_free(&track);
}

static void what_stands_stays_where_it_is(void **state)
{
    const struct motion_state rest = { .pos_q32 = q32(3) },
                              to = { .pos_q32 = q32(9) };
    struct motion_track track;

    (void)state;
    plan_track_init(&track, rest.pos_q32);
    assert_int_equal(plan_roll_track(&track, SEC, SEC), MOTION_OK);
    assert_int_equal(track.count, 0); /* an axis that does not move */
    plan_track_reserve(&track, 1);
    assert_int_equal(motion_track_append_quintic(&track, SEC, &rest, &to),
                     MOTION_OK);
    assert_int_equal(plan_roll_track(&track, SEC, SEC), MOTION_OK);
    assert_int_equal(track.segment[0].pos_q32, rest.pos_q32);
    assert_int_equal(track.segment[1].pos_q32, rest.pos_q32);
    assert_int_equal(track.end.pos_q32, to.pos_q32);
    assert_int_equal(plan_roll_track(&track, MOTION_TRACK_MAX_NS_Q12, 0),
                     MOTION_E_RANGE);
    assert_int_equal(track.count, 3);
    plan_track_free(&track);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_roll_is_smooth_and_the_shot_is_kept_to_the_bit),
        cmocka_unit_test(the_figures_are_those_of_the_formulas),
        cmocka_unit_test(what_stands_stays_where_it_is),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
