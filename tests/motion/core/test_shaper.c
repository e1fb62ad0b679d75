/* tests/motion/core/test_shaper.c - the shaper of the tick, judged by the
 * samples of the track itself. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/core/shaper.h"
#include "tests/support/check.h"

#define UNIT     MOTION_FIXED_ONE_Q32
#define SEC      MOTION_FIXED_S_Q12
#define ONE      MOTION_SHAPER_ONE_Q62
#define SEGMENTS 6

static struct motion_segment storage[SEGMENTS];
static struct motion_track track;

static int64_t pick(int64_t low, int64_t high)
{
    return check_random_in(check_stream(), low, high);
}

/* Quintics from rest to rest. */
static void any_track(int64_t size_q32)
{
    motion_track_init(&track, storage, SEGMENTS, pick(-size_q32, size_q32));
    for (int i = 0; i < SEGMENTS; i++) {
        const bool last = i + 1 == SEGMENTS;
        const struct motion_state end = {
            .pos_q32 = pick(-size_q32, size_q32),
            .vel_q32 = last ? 0 : pick(-size_q32, size_q32),
            .acc_q32 = last ? 0 : pick(-size_q32, size_q32),
        };
        const struct motion_state start = track.end;
        assert_int_equal(motion_track_append_quintic(
                             &track, pick(SEC / 100, 2 * SEC), &start, &end),
                         MOTION_OK);
    }
}

static struct motion_shaper any_shaper(void)
{
    const uint32_t count = (uint32_t)pick(1, MOTION_SHAPER_IMPULSES_MAX);
    uint64_t amplitude[MOTION_SHAPER_IMPULSES_MAX], left = ONE;
    int64_t delay[MOTION_SHAPER_IMPULSES_MAX], at = pick(0, SEC / 10);
    struct motion_shaper shaper;

    for (uint32_t i = 0; i < count; i++) {
        delay[i] = at;
        at += pick(1, SEC / 4);
        amplitude[i] =
            i + 1 == count ? left : (uint64_t)pick(1, (int64_t)left / 2);
        left -= amplitude[i];
    }
    assert_int_equal(motion_shaper_init(&shaper, count, amplitude, delay),
                     MOTION_OK);
    return shaper;
}

static struct motion_sample sample_at(const struct motion_shaper *shaper,
                                      int64_t t)
{
    struct motion_shaper_cursor cursor = { 0 };
    struct motion_sample sample;

    motion_shaper_sample(shaper, &track, &cursor, t, &sample);
    return sample;
}

static void what_is_no_shaper_is_refused_and_nothing_is_written(void **state)
{
    static const struct {
        const char *name;
        uint32_t count;
        uint64_t amplitude[5];
        int64_t delay[5];
        int want;
    } rows[] = {
        { "a delay", 1, { ONE }, { 7 }, MOTION_OK },
        { "two", 2, { ONE / 2, ONE / 2 }, { 0, 1 }, MOTION_OK },
        { "the longest", 1, { ONE }, { MOTION_SHAPER_DELAY_MAX_NS_Q12 }, 0 },
        { "none", 0, { ONE }, { 0 }, MOTION_E_ARG },
        { "five",
          5,
          { ONE / 4, ONE / 4, ONE / 4, ONE / 8, ONE / 8 },
          { 0, 1, 2, 3, 4 },
          MOTION_E_ARG },
        { "too little", 2, { ONE / 2, ONE / 2 - 1 }, { 0, 1 }, MOTION_E_ARG },
        { "too much", 2, { ONE / 2, ONE / 2 + 1 }, { 0, 1 }, MOTION_E_ARG },
        { "wrapped", 2, { ONE / 2, ONE / 2 + (ONE << 1) }, { 0, 1 }, -2 },
        { "an empty one", 2, { ONE, 0 }, { 0, 1 }, MOTION_E_ARG },
        { "same time", 2, { ONE / 2, ONE / 2 }, { 5, 5 }, MOTION_E_ARG },
        { "back", 2, { ONE / 2, ONE / 2 }, { 5, 4 }, MOTION_E_ARG },
        { "early", 1, { ONE }, { -1 }, MOTION_E_ARG },
        { "late", 1, { ONE }, { MOTION_SHAPER_DELAY_MAX_NS_Q12 + 1 }, -2 },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct motion_shaper shaper, before;
        memset(&shaper, 0x5a, sizeof shaper);
        before = shaper;
        const int got = motion_shaper_init(&shaper, rows[i].count,
                                           rows[i].amplitude, rows[i].delay);
        if (got != rows[i].want ||
            (got < 0 && (shaper.count != before.count ||
                         shaper.amplitude_q62[0] != before.amplitude_q62[0] ||
                         shaper.delay_ns_q12[0] != before.delay_ns_q12[0])))
            fail_msg("%s: %d", rows[i].name, got);
    }
}

static void one_impulse_is_a_delay_to_the_bit(void **state)
{
    const uint64_t amplitude = ONE;
    const int64_t delay = 12345678;
    struct motion_shaper shaper;
    struct motion_cursor cursor = { 0 };

    (void)state;
    seed_from("delay");
    any_track(1000 * UNIT);
    assert_int_equal(motion_shaper_init(&shaper, 1, &amplitude, &delay), 0);
    for (int64_t t = -SEC; t < track.end_ns_q12 + SEC; t += SEC / 97) {
        const struct motion_sample got = sample_at(&shaper, t);
        struct motion_sample want;
        motion_track_sample(&track, &cursor, t - delay, &want);
        assert_memory_equal(&got, &want, sizeof got);
    }
}

/* The mean in long double, whose 64 bits hold it to 2^-10 units here. */
static void the_answer_is_the_mean_rounded_once(void **state)
{
    (void)state;
    seed_from("mean");
    for (int n = 0; n < 20000; n++) {
        if (n % 100 == 0)
            any_track(1000 * UNIT);
        const struct motion_shaper shaper = any_shaper();
        const int64_t t = pick(-SEC, track.end_ns_q12 + 2 * SEC);
        const struct motion_sample got = sample_at(&shaper, t);
        long double pos = 0, vel = 0, acc = 0;
        for (uint32_t i = 0; i < shaper.count; i++) {
            const long double part = (long double)shaper.amplitude_q62[i] / ONE;
            struct motion_cursor cursor = { 0 };
            struct motion_sample at;
            motion_track_sample(&track, &cursor, t - shaper.delay_ns_q12[i],
                                &at);
            pos += part * (long double)at.pos_q32;
            vel += part * (long double)at.vel_q32;
            acc += part * (long double)at.acc_q32;
        }
        if (fabsl((long double)got.pos_q32 - pos) > 0.501L ||
            fabsl((long double)got.vel_q32 - vel) > 0.51L ||
            fabsl((long double)got.acc_q32 - acc) > 0.6L)
            fail_msg("case %d", n);
    }
}

static void the_end_and_the_start_are_the_keys_to_the_bit(void **state)
{
    (void)state;
    seed_from("ends");
    for (int n = 0; n < 2000; n++) {
        any_track((int64_t)1 << pick(8, 50));
        const struct motion_shaper shaper = any_shaper();
        const int64_t done =
            track.end_ns_q12 + shaper.delay_ns_q12[shaper.count - 1];
        const struct motion_sample first = sample_at(&shaper, -1);
        const struct motion_sample last = sample_at(&shaper, done);
        assert_int_equal(first.pos_q32, storage[0].pos_q32);
        assert_int_equal(last.pos_q32, track.end.pos_q32);
        assert_int_equal(first.vel_q32, 0);
        assert_int_equal(last.vel_q32, 0);
        assert_int_equal(last.acc_q32, 0);
        assert_int_equal(sample_at(&shaper, INT64_MIN).pos_q32, first.pos_q32);
        assert_int_equal(sample_at(&shaper, INT64_MAX).pos_q32, last.pos_q32);
    }
}

/* At the ends of the format nothing wraps: a mean is between what it is of. */
static void it_holds_at_the_ends_of_the_format(void **state)
{
    (void)state;
    seed_from("format");
    const int64_t most = MOTION_TRACK_POS_MAX_Q32;
    motion_track_init(&track, storage, SEGMENTS, -most);
    assert_int_equal(
        motion_track_append_cubic(&track, 20 * SEC, 0,
                                  &(struct motion_state){ .pos_q32 = most }),
        MOTION_OK);
    for (int n = 0; n < 200; n++) {
        const struct motion_shaper shaper = any_shaper();
        int64_t before = -most;
        for (int64_t t = 0; t < 23 * SEC; t += SEC / 7) {
            const int64_t pos = sample_at(&shaper, t).pos_q32;
            if (pos < before || pos > most)
                fail_msg("case %d at %" PRId64, n, t);
            before = pos;
        }
    }
}

static void
velocity_and_acceleration_stay_within_those_of_the_track(void **state)
{
    (void)state;
    seed_from("limits");
    for (int n = 0; n < 200; n++) {
        struct motion_extreme vel, acc;
        any_track(100 * UNIT);
        motion_track_extreme(&track, MOTION_VEL, &vel);
        motion_track_extreme(&track, MOTION_ACC, &acc);
        const struct motion_shaper shaper = any_shaper();
        const int64_t step = track.end_ns_q12 / 500;
        for (int64_t t = 0; t < track.end_ns_q12 + 2 * SEC; t += step) {
            const struct motion_sample at = sample_at(&shaper, t);
            /* what a sample rounds, of track.h */
            const int64_t rounding = 3 + (acc.max >> 20) - (acc.min >> 20);
            if (at.vel_q32 > vel.max + 3 || at.vel_q32 < vel.min - 3 ||
                at.acc_q32 > acc.max + rounding ||
                at.acc_q32 < acc.min - rounding)
                fail_msg("case %d at %" PRId64, n, t);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_no_shaper_is_refused_and_nothing_is_written),
        cmocka_unit_test(one_impulse_is_a_delay_to_the_bit),
        cmocka_unit_test(the_answer_is_the_mean_rounded_once),
        cmocka_unit_test(the_end_and_the_start_are_the_keys_to_the_bit),
        cmocka_unit_test(it_holds_at_the_ends_of_the_format),
        cmocka_unit_test(
            velocity_and_acceleration_stay_within_those_of_the_track),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
