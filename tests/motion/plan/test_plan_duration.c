/* tests/motion/plan/test_plan_duration.c - a track in another time reaches the
 * same positions, to the bit at its borders, and breaks no scaled limit. */
#include "motion/plan/plan_duration.h"

#include <math.h>
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/check.h"
#include "motion/plan/move.h"
#include "tests/support/check.h"

#define UNIT MOTION_FIXED_ONE_Q32
#define SEC  MOTION_FIXED_S_Q12
#define KEYS 7

static struct plan_key keys[KEYS];
static struct plan_axis axis;

static double between(double low, double high)
{
    return low + (high - low) * (double)draw_unit();
}

static void any_track(struct motion_track *track)
{
    struct plan_error error;
    int64_t t = 0;

    axis = (struct plan_axis){ .curve = PLAN_CURVE_QUINTIC,
                               .key = keys,
                               .key_count = KEYS };
    for (uint32_t i = 0; i < KEYS; i++) {
        keys[i] = (struct plan_key){ .key = {
                                         .t_ns_q12 = t,
                                         .pos_q32 = llrint(between(-50, 50) *
                                                           (double)UNIT),
                                     } };
        t += llrint(between(0.1, 3) * (double)SEC);
    }
    assert_int_equal(plan_axis_track(&axis, track, &error), MOTION_OK);
}

static double peak(const struct motion_track *track, enum motion_quantity of)
{
    struct motion_extreme extreme;

    motion_track_extreme(track, of, &extreme);
    return fmax(fabs((double)extreme.min), fabs((double)extreme.max));
}

/* A little above, in the format. */
static int64_t limit_of(double most)
{
    return llrint(fmin(most * (1 + 1e-9) + 64, 0x1p62));
}

static struct motion_segment *copy_of(const struct motion_track *track)
{
    struct motion_segment *was = calloc(track->count, sizeof *was);

    assert_non_null(was);
    for (uint32_t i = 0; i < track->count; i++)
        was[i] = track->segment[i];
    return was;
}

/* Halfway through every segment there is the same position as before. */
static void expect_same_path(const struct motion_track *track,
                             const struct motion_segment *was, double by)
{
    for (uint32_t i = 0; i < track->count; i++) {
        const struct motion_segment *is = &track->segment[i];
        struct motion_state before, after;
        assert_true(is->pos_q32 == was[i].pos_q32);
        motion_segment_state(&was[i], was[i].dur_ns_q12 / 2, &before);
        motion_segment_state(is, is->dur_ns_q12 / 2, &after);
        /* half a tick of time at that speed, and rounding */
        assert_true(fabs((double)(after.pos_q32 - before.pos_q32)) <=
                    fabs((double)before.vel_q32) / (double)SEC * 2 + 4);
        assert_true(fabs((double)after.vel_q32 * by - (double)before.vel_q32) <=
                    1e-9 * fabs((double)before.vel_q32) + 64 * (1 + by));
    }
}

static void a_track_keeps_its_positions_in_any_time(void **state)
{
    (void)state;
    seed_from("duration");
    for (int n = 0; n < 300; n++) {
        struct motion_track track;
        any_track(&track);
        const int64_t from = track.end_ns_q12,
                      to = llrint((double)from * pow(10, between(-0.5, 2)));
        const double by = (double)to / (double)from;
        const int64_t end = track.end.pos_q32;
        struct plan_limit limit = {
            -MOTION_TRACK_POS_MAX_Q32,
            MOTION_TRACK_POS_MAX_Q32,
            limit_of(peak(&track, MOTION_VEL) / by),
            limit_of(peak(&track, MOTION_ACC) / by / by),
            limit_of(peak(&track, MOTION_JERK) / by / by / by),
            1000000
        };
        struct motion_segment *was = copy_of(&track);
        assert_int_equal(plan_duration_apply(&track, from, to), MOTION_OK);
        assert_true(track.end_ns_q12 == to && track.end.pos_q32 == end);
        expect_same_path(&track, was, by);
        assert_int_equal(plan_check_track(&track, &limit, NULL, 0), 0);
        limit.vel_q32 = llrint((double)limit.vel_q32 * 0.99);
        assert_true(plan_check_track(&track, &limit, NULL, 0) > 0);
        free(was);
        plan_track_free(&track);
    }
}

static void what_the_formats_cannot_hold_is_refused(void **state)
{
    struct motion_track track;

    (void)state;
    seed_from("refused");
    any_track(&track);
    assert_int_equal(plan_duration_apply(&track, track.end_ns_q12, 3),
                     MOTION_E_RANGE);
    plan_track_free(&track);
    any_track(&track);
    assert_int_equal(plan_duration_apply(&track, 1, INT64_MAX / 2),
                     MOTION_E_RANGE);
    plan_track_free(&track);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_track_keeps_its_positions_in_any_time),
        cmocka_unit_test(what_the_formats_cannot_hold_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
