/* tests/motion/curve/test_pose.c - sums, blends and cross-fades against what
 * the tracks they are made of say. */
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/curve/pose.h"
#include "tests/support/check.h"

#define SEED     UINT64_C(0x9E3779B97F4A7C15)
#define SEGMENTS 64
#define ONE      MOTION_FIXED_ONE_Q32

struct made {
    struct motion_segment segment[SEGMENTS];
    struct motion_track track;
};

static int64_t q32(double value)
{
    return llround(ldexp(value, 32));
}

static double real_of(struct motion_real a)
{
    return ldexp((double)a.m, a.e);
}

/* `count` segments of mixed degree up to `degree`, of 1 ms .. 5 s (or of what
 * `same` has), within +-scale units. */
static void make(struct made *made, uint64_t *seed, int count, int degree,
                 double scale, const struct made *same)
{
    int64_t range = q32(scale);
    motion_track_init(&made->track, made->segment, SEGMENTS,
                      check_random_in(seed, -range, range));
    for (int i = 0; i < count; i++) {
        int64_t dur =
            check_random_in(seed, 1000000, INT64_C(5000000000)) * 4096;
        struct motion_state to[2];
        int order = (int)check_random_in(seed, 1, (degree + 1) / 2);
        if (same != NULL)
            dur = same->segment[i].dur_ns_q12;
        for (int k = 0; k < 2; k++)
            to[k] = (struct motion_state){
                .pos_q32 = check_random_in(seed, -range, range),
                .vel_q32 = check_random_in(seed, -range, range),
                .acc_q32 = check_random_in(seed, -range, range),
            };
        assert_int_equal(motion_track_append_constraints(
                             &made->track, dur, order, &to[0], order, &to[1]),
                         MOTION_OK);
    }
}

static int64_t pos_at(const struct motion_track *track, int64_t t)
{
    struct motion_cursor cursor = { 0 };
    struct motion_sample sample;
    motion_track_sample(track, &cursor, t, &sample);
    return sample.pos_q32;
}

static int64_t longest(const struct made *a, const struct made *b)
{
    return a->track.end_ns_q12 > b->track.end_ns_q12 ? a->track.end_ns_q12
                                                     : b->track.end_ns_q12;
}

static void a_sum_is_where_its_tracks_are_together(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    for (int round = 0; round < 300; round++) {
        static struct made a, b, sum;
        double scale = ldexp(1, (int)check_random_in(&seed, -6, 14));
        make(&a, &seed, (int)check_random_in(&seed, 0, 12), 5, scale, NULL);
        make(&b, &seed, (int)check_random_in(&seed, 0, 12), 5, scale, NULL);
        motion_track_init(&sum.track, sum.segment, SEGMENTS, 0);
        assert_int_equal(motion_pose_add(&sum.track, &a.track, &b.track), 0);
        assert_int_equal(sum.track.end_ns_q12, longest(&a, &b));
        for (int i = 0; i < 200; i++) {
            int64_t t = check_random_in(&seed, 0, sum.track.end_ns_q12);
            struct motion_state got, x, y;
            int64_t off = pos_at(&sum.track, t) - pos_at(&a.track, t) -
                          pos_at(&b.track, t);
            motion_track_state(&sum.track, t, &got);
            motion_track_state(&a.track, t, &x);
            motion_track_state(&b.track, t, &y);
            if (llabs(off) > 6 ||
                llabs(got.vel_q32 - x.vel_q32 - y.vel_q32) > 8 ||
                llabs(got.acc_q32 - x.acc_q32 - y.acc_q32) > 8)
                fail_msg("seed %#" PRIx64 ", round %d: off by %" PRId64
                         ", v %" PRId64 ", a %" PRId64,
                         SEED, round, off, got.vel_q32 - x.vel_q32 - y.vel_q32,
                         got.acc_q32 - x.acc_q32 - y.acc_q32);
        }
    }
}

/* Same borders: nothing is expanded, so the keys are sums to the bit and a
 * track less itself is zero all along. */
static void common_borders_add_to_the_bit(void **state)
{
    uint64_t seed = SEED + 1;
    (void)state;
    for (int round = 0; round < 200; round++) {
        static struct made a, b, sum, none;
        const struct motion_pose_term less[] = { { &a.track, ONE },
                                                 { &a.track, -ONE } };
        make(&a, &seed, 8, 5, 1000, NULL);
        make(&b, &seed, 8, 5, 1000, &a);
        motion_track_init(&sum.track, sum.segment, SEGMENTS, 0);
        motion_track_init(&none.track, none.segment, SEGMENTS, 0);
        assert_int_equal(motion_pose_add(&sum.track, &a.track, &b.track), 0);
        assert_int_equal(motion_pose_sum(&none.track, 7, less, 2), 0);
        assert_int_equal(sum.track.count, 8);
        for (uint32_t i = 0; i < 8; i++) {
            int64_t t = a.segment[i].start_ns_q12;
            assert_int_equal(pos_at(&sum.track, t),
                             pos_at(&a.track, t) + pos_at(&b.track, t));
            assert_int_equal(
                pos_at(&none.track, t + a.segment[i].dur_ns_q12 / 3), 7);
            for (int k = 0; k <= MOTION_TRACK_DEGREE; k++)
                assert_int_equal(none.segment[i].coef[k], 0);
        }
    }
}

static void a_sum_with_a_track_at_rest_is_that_track(void **state)
{
    static struct made a, still, sum;
    uint64_t seed = SEED + 2;
    (void)state;
    make(&a, &seed, 10, 5, 300, NULL);
    make(&still, &seed, 0, 5, 300, NULL);
    motion_track_init(&sum.track, sum.segment, SEGMENTS, 0);
    assert_int_equal(motion_pose_add(&sum.track, &a.track, &still.track), 0);
    for (uint32_t i = 0; i < a.track.count; i++)
        assert_memory_equal(sum.segment[i].coef, a.segment[i].coef,
                            sizeof a.segment[i].coef);
    assert_int_equal(sum.track.end.pos_q32,
                     a.track.end.pos_q32 + still.track.end.pos_q32);
}

/* base + sum w_i (pose_i - base), in long double. */
static void a_blend_is_the_base_and_weighted_offsets(void **state)
{
    enum { POSES = 3 };
    static struct made weight[POSES], blend;
    uint64_t seed = SEED + 3;
    (void)state;
    for (int round = 0; round < 200; round++) {
        struct motion_pose_term term[POSES];
        int64_t base = check_random_in(&seed, q32(-900), q32(900));
        for (int i = 0; i < POSES; i++) {
            make(&weight[i], &seed, (int)check_random_in(&seed, 0, 9), 5, 1,
                 NULL);
            term[i] = (struct motion_pose_term){
                &weight[i].track, check_random_in(&seed, q32(-2000), q32(2000))
            };
        }
        motion_track_init(&blend.track, blend.segment, SEGMENTS, 0);
        assert_int_equal(motion_pose_sum(&blend.track, base, term, POSES), 0);
        for (int i = 0; i < 200; i++) {
            int64_t t = check_random_in(&seed, 0, blend.track.end_ns_q12);
            long double want = (long double)base;
            for (int k = 0; k < POSES; k++)
                want += ldexpl((long double)pos_at(term[k].track, t) *
                                   (long double)term[k].factor_q32,
                               -32);
            /* a weight's sample is 2 units off, times up to 2000 */
            long double off = (long double)pos_at(&blend.track, t) - want;
            if (fabsl(off) > 3 * 2 * 2000 + 4)
                fail_msg("seed %#" PRIx64 ", round %d: %Lg", SEED + 3, round,
                         off);
        }
    }
}

static void a_full_weight_is_the_pose_to_the_bit(void **state)
{
    static struct made weight, blend;
    uint64_t seed = SEED + 4;
    (void)state;
    for (int round = 0; round < 200; round++) {
        int64_t base = check_random_in(&seed, q32(-1e6), q32(1e6));
        int64_t pose = check_random_in(&seed, q32(-1e6), q32(1e6));
        const struct motion_pose_term term = { &weight.track, pose - base };
        motion_track_init(&weight.track, weight.segment, SEGMENTS, 0);
        motion_track_append_quintic(&weight.track, MOTION_FIXED_S_Q12,
                                    &(struct motion_state){ 0 },
                                    &(struct motion_state){ .pos_q32 = ONE });
        motion_track_init(&blend.track, blend.segment, SEGMENTS, 0);
        assert_int_equal(motion_pose_sum(&blend.track, base, &term, 1), 0);
        assert_int_equal(pos_at(&blend.track, 0), base);
        assert_int_equal(pos_at(&blend.track, MOTION_FIXED_S_Q12), pose);
    }
}

static void what_cannot_be_summed_leaves_nothing(void **state)
{
    static struct made a, b, sum;
    uint64_t seed = SEED + 5;
    struct motion_pose_term term[MOTION_POSE_TERMS + 1];
    (void)state;
    make(&a, &seed, 6, 5, 100, NULL);
    make(&b, &seed, 6, 5, 100, NULL);
    motion_track_init(&sum.track, sum.segment, 10, 5);
    assert_int_equal(motion_pose_add(&sum.track, &a.track, &b.track),
                     MOTION_E_FULL);
    assert_int_equal(sum.track.count, 0);
    motion_track_init(&sum.track, sum.segment, SEGMENTS, 5);
    for (int i = 0; i <= MOTION_POSE_TERMS; i++)
        term[i] = (struct motion_pose_term){ &a.track, ONE };
    assert_int_equal(
        motion_pose_sum(&sum.track, 0, term, MOTION_POSE_TERMS + 1),
        MOTION_E_ARG);
    term[0].factor_q32 = INT64_MAX;
    assert_int_equal(motion_pose_sum(&sum.track, 0, term, 1), MOTION_E_RANGE);
    assert_int_equal(motion_pose_sum(&sum.track, INT64_MAX, term + 2, 1),
                     MOTION_E_RANGE);
    assert_int_equal(sum.track.count, 0);
    assert_int_equal(motion_pose_sum(&sum.track, 3, term, 0), MOTION_OK);
    assert_int_equal(sum.track.end.pos_q32, 3);
}

/* --- cross-fades --- */

/* The true fade from the state of the three tracks. */
static long double faded(const struct made made[3], int64_t t)
{
    long double from = (long double)pos_at(&made[0].track, t);
    long double to = (long double)pos_at(&made[1].track, t);
    long double w = ldexpl((long double)pos_at(&made[2].track, t), -32);
    return from + w * (to - from);
}

static void check_fade(const struct made made[3], uint64_t *seed,
                       int64_t tolerance_q32)
{
    static struct made fade;
    static struct motion_segment storage[4096];
    struct motion_real bound;
    double worst = 0;
    motion_track_init(&fade.track, storage, 4096, 0);
    int err = motion_pose_fade(&fade.track, &made[0].track, &made[1].track,
                               &made[2].track, tolerance_q32, &bound);
    if (err < 0)
        fail_msg("fade refused: %s", motion_err_text(err));
    double promised = ldexp(real_of(bound), 32);
    for (int i = 0; i < 2000; i++) {
        int64_t t = check_random_in(seed, 0, fade.track.end_ns_q12);
        double off = fabs(
            (double)((long double)pos_at(&fade.track, t) - faded(made, t)));
        worst = off > worst ? off : worst;
    }
    /* the oracle's own samples: 2 units each, the weight's times the travel */
    if (worst > promised + 6 + 2 * 400)
        fail_msg("off by %g units of 2^-32, promised %g", worst, promised);
    assert_true(promised <= (double)tolerance_q32 + 4);
}

static void a_fade_of_low_degree_is_exact(void **state)
{
    static struct made made[3];
    uint64_t seed = SEED + 6;
    (void)state;
    for (int round = 0; round < 60; round++) {
        make(&made[0], &seed, 6, 3, 100, NULL);
        make(&made[1], &seed, 6, 3, 100, NULL);
        make(&made[2], &seed, 4, 1, 1, NULL);
        check_fade(made, &seed, 1);
    }
}

static void a_fade_of_high_degree_is_baked_within_its_tolerance(void **state)
{
    static struct made made[3];
    uint64_t seed = SEED + 7;
    (void)state;
    for (int round = 0; round < 20; round++) {
        make(&made[0], &seed, 3, 5, 100, NULL);
        make(&made[1], &seed, 3, 5, 100, NULL);
        motion_track_init(&made[2].track, made[2].segment, SEGMENTS, 0);
        motion_track_append_dwell(&made[2].track, MOTION_FIXED_S_Q12);
        motion_track_append_quintic(&made[2].track, 3 * MOTION_FIXED_S_Q12,
                                    &(struct motion_state){ 0 },
                                    &(struct motion_state){ .pos_q32 = ONE });
        check_fade(made, &seed, q32(1e-5));
    }
}

static void a_fade_begins_on_one_move_and_ends_on_the_other(void **state)
{
    static struct made made[3], fade;
    static struct motion_segment storage[1024];
    uint64_t seed = SEED + 8;
    (void)state;
    make(&made[0], &seed, 3, 5, 100, NULL);
    make(&made[1], &seed, 3, 5, 100, NULL);
    motion_track_init(&made[2].track, made[2].segment, SEGMENTS, 0);
    motion_track_append_quintic(&made[2].track, MOTION_FIXED_S_Q12,
                                &(struct motion_state){ 0 },
                                &(struct motion_state){ .pos_q32 = ONE });
    motion_track_init(&fade.track, storage, 1024, 0);
    assert_int_equal(motion_pose_fade(&fade.track, &made[0].track,
                                      &made[1].track, &made[2].track, q32(1e-6),
                                      NULL),
                     0);
    assert_int_equal(pos_at(&fade.track, 0), pos_at(&made[0].track, 0));
    assert_int_equal(fade.track.end.pos_q32 >> 2,
                     made[1].track.end.pos_q32 >> 2);
    assert_int_equal(motion_pose_fade(&fade.track, &made[0].track,
                                      &made[1].track, &made[2].track, 0, NULL),
                     MOTION_E_ARG);
    assert_int_equal(fade.track.count, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sum_is_where_its_tracks_are_together),
        cmocka_unit_test(common_borders_add_to_the_bit),
        cmocka_unit_test(a_sum_with_a_track_at_rest_is_that_track),
        cmocka_unit_test(a_blend_is_the_base_and_weighted_offsets),
        cmocka_unit_test(a_full_weight_is_the_pose_to_the_bit),
        cmocka_unit_test(what_cannot_be_summed_leaves_nothing),
        cmocka_unit_test(a_fade_of_low_degree_is_exact),
        cmocka_unit_test(a_fade_of_high_degree_is_baked_within_its_tolerance),
        cmocka_unit_test(a_fade_begins_on_one_move_and_ends_on_the_other),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
