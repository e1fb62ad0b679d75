/* tests/motion/core/test_track_summary.c - what a summary answers of a track is what
 * a look at all of its segments gives, to the bit, for as long as it is of them. */
#include <inttypes.h>
#include <stdbool.h>

#include "motion/core/fixed.h"
#include "motion/core/track.h"
#include "tests/support/check.h"

#define SEED     UINT64_C(20261129)
#define SEGMENTS 24
#define ONE      MOTION_FIXED_ONE_Q32
#define SECOND   MOTION_FIXED_S_Q12

static struct motion_segment storage[SEGMENTS + 2];
static struct motion_track_summary summary;

static int64_t any_size(uint64_t *seed, int bits)
{
    const int64_t size =
        (int64_t)((UINT64_C(1) << check_random_in(seed, 0, bits)) - 1);
    return check_random_in(seed, -size, size);
}

/* One of any shape and duration, or one that stands, or crawls, or goes straight. */
static int append_any(uint64_t *seed, struct motion_track *track)
{
    const int64_t dur_ns_q12 =
        1 + (int64_t)motion_fixed_abs(any_size(seed, 55));
    const struct motion_state start = { .vel_q32 = any_size(seed, 45),
                                        .acc_q32 = any_size(seed, 50) };
    const struct motion_state end = {
        .pos_q32 = track->end.pos_q32 + any_size(seed, 55),
        .vel_q32 = any_size(seed, 45),
        .acc_q32 = any_size(seed, 50),
    };
    if (check_random_in(seed, 0, 5) == 0)
        return motion_track_append_dwell(track, dur_ns_q12);
    if (check_random_in(seed, 0, 5) == 0)
        return motion_track_append_line(
            track, SECOND, track->end.pos_q32 + any_size(seed, 14));
    return motion_track_append_constraints(
        track, dur_ns_q12, (int)check_random_in(seed, 1, 3), &start,
        (int)check_random_in(seed, 1, 3), &end);
}

static struct motion_track any_track(uint64_t *seed)
{
    const int64_t count = check_random_in(seed, 0, SEGMENTS);
    struct motion_track track;
    motion_track_init(&track, storage, ARRAY_LEN(storage), any_size(seed, 55));
    for (int64_t i = 0; i < count; i++)
        (void)append_any(seed, &track);
    return track;
}

/* All that is asked of a whole track. */
struct answers {
    struct motion_extreme extreme[MOTION_JERK + 1];
    int64_t peak[2], down_to_q32, up_to_q32;
};

static struct answers answers_of(const struct motion_track *track)
{
    struct answers answers;
    for (int q = MOTION_POS; q <= MOTION_JERK; q++)
        motion_track_extreme(track, (enum motion_quantity)q,
                             &answers.extreme[q]);
    answers.peak[0] = motion_track_peak(track, MOTION_ACC);
    answers.peak[1] = motion_track_peak(track, MOTION_JERK);
    motion_track_reach(track, &answers.down_to_q32, &answers.up_to_q32);
    return answers;
}

/* Answer by the definition of each function, segment by segment. */
static struct answers answers_by_segment(const struct motion_track *track)
{
    const struct motion_extreme none = { .min = INT64_MAX, .max = INT64_MIN };
    struct answers all = {
        { none, none, none, none }, { 0, 0 }, INT64_MAX, INT64_MIN
    };
    for (uint32_t i = 0; i < track->count; i++) {
        const struct motion_segment *segment = &track->segment[i];
        struct motion_extreme one[MOTION_JERK + 1];
        for (int q = MOTION_POS; q <= MOTION_JERK; q++) {
            motion_segment_extreme(segment, (enum motion_quantity)q, &one[q]);
            motion_extreme_extend(&all.extreme[q], &one[q]);
        }
        for (int q = MOTION_ACC; q <= MOTION_JERK; q++) {
            const int64_t peak =
                motion_segment_peak(segment, (enum motion_quantity)q);
            if (peak > all.peak[q - MOTION_ACC])
                all.peak[q - MOTION_ACC] = peak;
        }
        if (one[MOTION_VEL].min < -MOTION_TRACK_STANDS_Q32 &&
            one[MOTION_POS].min < all.down_to_q32)
            all.down_to_q32 = one[MOTION_POS].min;
        if (one[MOTION_VEL].max > MOTION_TRACK_STANDS_Q32 &&
            one[MOTION_POS].max > all.up_to_q32)
            all.up_to_q32 = one[MOTION_POS].max;
    }
    return all;
}

/* The track is asked without its segments, so that none is looked at. */
static void a_summary_answers_as_all_segments_do(void **state)
{
    uint64_t seed = SEED;
    int stood = 0, went = 0;
    (void)state;
    for (int i = 0; i < check_cases(4000); i++) {
        struct motion_track track = any_track(&seed);
        const struct answers scanned = answers_of(&track);
        if (track.count > 0) {
            const struct answers want = answers_by_segment(&track);
            assert_memory_equal(&scanned, &want, sizeof want);
        }
        motion_track_summarise(&track, &summary);
        if (track.count > 0)
            summary.segment = track.segment = NULL;
        const struct answers got = answers_of(&track);
        assert_memory_equal(&got, &scanned, sizeof got);
        stood += got.down_to_q32 == INT64_MAX;
        went += got.down_to_q32 < got.extreme[MOTION_POS].max;
    }
    assert_true(stood > 0 && went > 0); /* the generator is no sham */
}

/* However a track has changed since: it answers for what it is. */
static void a_summary_is_not_asked_of_another_track(void **state)
{
    uint64_t seed = SEED + 1;
    (void)state;
    for (int i = 0; i < check_cases(2000); i++) {
        struct motion_track track = any_track(&seed);
        const uint32_t count = track.count;
        motion_track_summarise(&track, &summary);
        const int kind = (int)check_random_in(&seed, 0, 3);
        if (kind == 0 && count > 1) { /* shortened, without a word */
            track.count--;
        } else if (kind == 1) { /* emptied, and filled to the same count */
            track.count = 0;
            track.end_ns_q12 = 0;
            while (track.count < count &&
                   motion_track_append_line(&track, SECOND,
                                            track.end.pos_q32 + 3 * ONE) == 0)
                ;
        } else if (kind == 2) { /* copied, and the copy has others */
            static struct motion_segment other[ARRAY_LEN(storage)];
            for (uint32_t k = 0; k < count; k++)
                other[k] = storage[count - 1 - k];
            track.segment = other;
        } else {
            (void)append_any(&seed, &track);
        }
        struct motion_track plain = track;
        plain.summary = NULL;
        const struct answers want = answers_of(&plain);
        const struct answers got = answers_of(&track);
        assert_memory_equal(&got, &want, sizeof got);
    }
}

/* A window is asked by its outline, whatever it was copied from. */
static void a_window_has_no_summary(void **state)
{
    struct motion_track_outline outline = { .count = 3 };
    struct motion_track track;
    struct motion_extreme got;
    int64_t down_to_q32, up_to_q32;
    (void)state;
    motion_track_init(&track, storage, ARRAY_LEN(storage), 0);
    assert_int_equal(motion_track_append_line(&track, SECOND, ONE), 0);
    motion_track_summarise(&track, &summary);
    outline.extreme[MOTION_POS] =
        (struct motion_extreme){ -ONE, 9 * ONE, 1, 2 };
    outline.extreme[MOTION_VEL] = (struct motion_extreme){ -ONE, ONE, 1, 2 };
    track.outline = &outline;
    motion_track_extreme(&track, MOTION_POS, &got);
    assert_memory_equal(&got, &outline.extreme[MOTION_POS], sizeof got);
    motion_track_reach(&track, &down_to_q32, &up_to_q32);
    assert_int_equal(down_to_q32, -ONE);
    assert_int_equal(up_to_q32, 9 * ONE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_summary_answers_as_all_segments_do),
        cmocka_unit_test(a_summary_is_not_asked_of_another_track),
        cmocka_unit_test(a_window_has_no_summary),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
