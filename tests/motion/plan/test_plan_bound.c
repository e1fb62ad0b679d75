/* tests/motion/plan/test_plan_bound.c - a segment's extremes are inside its
 * bound, and a track's extremes are motion_track_extreme's. */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#include "motion/core/fixed.h"
#include "motion/plan/plan_bound.h"
#include "tests/support/check.h"

#define ROUNDS 400

static struct motion_segment storage[40];
static struct motion_track track;
static uint64_t seed;

static struct motion_state any_state(int64_t size_q32)
{
    return (struct motion_state){
        .pos_q32 = check_random_in(&seed, -size_q32, size_q32),
        .vel_q32 = check_random_in(&seed, -size_q32, size_q32),
        .acc_q32 = check_random_in(&seed, -size_q32, size_q32),
    };
}

/* From 2^-12 to 2^28 units, from microseconds to days, of every degree. */
static void draw_track(void)
{
    const int64_t size = INT64_C(1) << check_random_in(&seed, 20, 60);
    const int64_t longest = INT64_C(1) << check_random_in(&seed, 24, 58);
    struct motion_state start = any_state(size);
    const uint32_t count = (uint32_t)check_random_in(&seed, 1, 40);

    motion_track_init(&track, storage, ARRAY_LEN(storage), start.pos_q32);
    for (uint32_t i = 0; i < count; i++) {
        const struct motion_state end = any_state(size);
        const int degree = (int)check_random_in(&seed, 1, 3);
        if (motion_track_append_constraints(
                &track, check_random_in(&seed, longest / 2, longest), degree,
                &start, (int)check_random_in(&seed, 1, degree), &end) == 0)
            start = end;
    }
}

static int64_t at(const struct motion_segment *segment, int64_t dt, int q)
{
    struct motion_state end;

    motion_segment_state(segment, dt, &end);
    return q == MOTION_POS   ? end.pos_q32
           : q == MOTION_VEL ? end.vel_q32
           : q == MOTION_ACC ? end.acc_q32
                             : end.jerk_q32;
}

/* States saturate. */
static bool is_near(double value, int64_t exact, double margin)
{
    return exact == INT64_MAX || exact == INT64_MIN || exact == -INT64_MAX ||
           fabs(value - (double)exact) <= margin;
}

static void extremes_are_inside_the_bound(void **state)
{
    uint32_t segments = 0, tight = 0;

    (void)state;
    seed = 1;
    for (int round = 0; round < ROUNDS; round++) {
        draw_track();
        for (uint32_t i = 0; i < track.count; i++)
            for (int q = MOTION_POS; q <= MOTION_JERK; q++) {
                const struct motion_segment *segment = &track.segment[i];
                const struct plan_bound bound =
                    plan_segment_bound(segment, (enum motion_quantity)q);
                struct plan_bound all[MOTION_JERK + 1];
                plan_segment_bounds(segment, all);
                assert_int_equal(all[q].low, bound.low);
                assert_int_equal(all[q].high, bound.high);
                struct motion_extreme extreme;
                motion_segment_extreme(segment, (enum motion_quantity)q,
                                       &extreme);
                if (bound.low > extreme.min || bound.high < extreme.max ||
                    !is_near(bound.start, at(segment, 0, q), bound.margin) ||
                    !is_near(bound.end, at(segment, segment->dur_ns_q12, q),
                             bound.margin))
                    fail_msg("quantity %d, segment %u of round %d", q,
                             (unsigned)i, round);
                segments++;
                tight +=
                    (double)bound.high - (double)bound.low <
                    1.5 * ((double)extreme.max - (double)extreme.min) + 1e5;
            }
    }
    if (segments < 4000 || tight < segments / 2)
        fail_msg("%u of %u bounds are tight", (unsigned)tight,
                 (unsigned)segments);
}

static void extremes_of_a_track_are_those_of_all_segments(void **state)
{
    (void)state;
    seed = 2;
    for (int round = 0; round < ROUNDS; round++) {
        draw_track();
        for (int q = MOTION_POS; q <= MOTION_JERK; q++) {
            struct motion_extreme want, is;
            motion_track_extreme(&track, (enum motion_quantity)q, &want);
            plan_track_extreme(&track, (enum motion_quantity)q, &is);
            if (is.min != want.min || is.max != want.max ||
                is.min_ns_q12 != want.min_ns_q12 ||
                is.max_ns_q12 != want.max_ns_q12)
                fail_msg("quantity %d of round %d", q, round);
        }
    }
}

static void a_track_without_segments_stands(void **state)
{
    struct motion_extreme extreme;

    (void)state;
    motion_track_init(&track, storage, ARRAY_LEN(storage), 77);
    plan_track_extreme(&track, MOTION_POS, &extreme);
    assert_int_equal(extreme.min, 77);
    assert_int_equal(extreme.max, 77);
    plan_track_extreme(&track, MOTION_ACC, &extreme);
    assert_int_equal(extreme.max, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(extremes_are_inside_the_bound),
        cmocka_unit_test(extremes_of_a_track_are_those_of_all_segments),
        cmocka_unit_test(a_track_without_segments_stands),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
