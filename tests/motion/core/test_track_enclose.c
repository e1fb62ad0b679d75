/* tests/motion/core/test_track_enclose.c - between what derivatives of a track lie:
 * whatever the track and the stretch, they lie there at every time of it
 * (motion_track_state), and in a short stretch there is little room beside them. */
#include <math.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/core/track.h"
#include "motion/core/track_enclose.h"
#include "tests/support/check.h"

#define SEGMENTS 12
#define TRACKS   check_many(20000, 1000)
#define TIMES    40

struct bench {
    struct motion_segment segment[SEGMENTS];
    struct motion_track track;
    bool is_told; /* by motion_state, which saturates */
    int64_t one_q32[3];
    struct motion_track_unit unit;
};

static int64_t octaves(double low, double high)
{
    return (int64_t)(low * pow(high / low, (double)draw_unit()));
}

/* Of either sign, as far as the format goes. */
static int64_t sign(double value)
{
    const int64_t size = (int64_t)fmin(value, 0x1p61);
    return draw() % 2 ? size : -size;
}

/* Any degree; durations and places over many octaves, as far as f''' fits its
 * format. */
static void append(struct bench *bench)
{
    const int64_t dur = octaves(0x1p32, (double)MOTION_FIXED_S_Q12 * 100);
    const double s = (double)dur / (double)MOTION_FIXED_S_Q12;
    const double step =
        (double)octaves(0x1p16, fmin(0x1p52, 0x1p52 * s * s * s) + 0x1p17);
    const struct motion_state start = {
        .vel_q32 = sign(step / s / 4),
        .acc_q32 = sign(step / s / s / 4),
    };
    const struct motion_state end = {
        .pos_q32 = bench->track.end.pos_q32 / 2 + sign(step),
        .vel_q32 = sign(step / s / 8),
        .acc_q32 = sign(step / s / s / 8),
    };
    const int from = 1 + (int)draw_below(3);
    (void)motion_track_append_constraints(&bench->track, dur, from, &start,
                                          1 + (int)draw_below(3), &end);
}

static void make(struct bench *bench)
{
    static const enum motion_quantity of[3] = { MOTION_VEL, MOTION_ACC,
                                                MOTION_JERK };
    motion_track_init(&bench->track, bench->segment, SEGMENTS, 0);
    for (int i = 0; i < SEGMENTS; i++)
        append(bench);
    bench->is_told = true;
    for (unsigned i = 0; i < 3; i++) {
        struct motion_extreme extreme;
        motion_track_extreme(&bench->track, of[i], &extreme);
        const double most =
            fmax(fabs((double)extreme.min), fabs((double)extreme.max));
        bench->is_told &= most < 0x1p62;
        bench->one_q32[i] =
            most < 0x1p60 ? octaves(most + 1, most * 8 + 8) : INT64_MAX;
    }
    motion_track_unit_init(&bench->unit, bench->one_q32);
}

/* One stretch; how many calls it took. */
static int enclose(const struct bench *bench, struct motion_cursor *cursor,
                   int64_t from, int64_t to, struct motion_range range[3])
{
    int calls = 0;
    for (unsigned i = 0; i < 3; i++)
        range[i] = (struct motion_range){ INT32_MAX, INT32_MIN };
    for (; from < to; calls++)
        assert_true(motion_track_enclose(&bench->track, cursor, &bench->unit,
                                         &from, to, range));
    return calls;
}

static void at(const struct bench *bench, int64_t t, double value[3])
{
    struct motion_state state;
    motion_track_state(&bench->track, t, &state);
    value[0] = (double)state.vel_q32 / (double)bench->one_q32[0];
    value[1] = (double)state.acc_q32 / (double)bench->one_q32[1];
    value[2] = (double)state.jerk_q32 / (double)bench->one_q32[2];
}

static void lies_between(const struct bench *bench, int64_t t,
                         const struct motion_range range[3])
{
    double value[3];
    at(bench, t, value);
    for (unsigned i = 0; i < 3; i++) {
        /* the state's own rounding */
        const double slack = 2 + 0x1p30 / (double)bench->one_q32[i];
        if (value[i] * 0x1p30 < range[i].low - slack ||
            value[i] * 0x1p30 > range[i].high + slack)
            fail_msg("at %" PRId64 ": p%.*s is %.9f, not in %.9f .. %.9f", t,
                     (int)i + 1, "'''", value[i], range[i].low / 0x1p30,
                     range[i].high / 0x1p30);
    }
}

static void derivatives_lie_between(void **state)
{
    struct motion_cursor cursor = { 0 };
    (void)state;
    seed_from("between");
    for (int n = 0; n < TRACKS; n++) {
        struct bench bench;
        struct motion_range range[3];
        make(&bench);
        if (!bench.is_told)
            continue;
        const int64_t end = bench.track.end_ns_q12;
        const int64_t from = check_random_in(check_stream(), -end / 8, end);
        const int64_t to = from + octaves(1, (double)end);
        (void)enclose(&bench, &cursor, from, to, range);
        /* at their ends they are furthest out */
        for (uint32_t i = 0; i < bench.track.count; i++)
            for (int side = 0; side < 2; side++) {
                const int64_t t = bench.segment[i].start_ns_q12 +
                                  side * (bench.segment[i].dur_ns_q12 - 1);
                if (t >= from && t < to)
                    lies_between(&bench, t, range);
            }
        for (int k = 0; k < TIMES; k++)
            lies_between(&bench, check_random_in(check_stream(), from, to - 1),
                         range);
    }
}

/* A stretch of 2^-12 of its segment. */
static void short_stretches_are_told_closely(void **state)
{
    struct motion_cursor cursor = { 0 };
    double worst[3] = { 0 };
    int judged = 0;
    (void)state;
    seed_from("closely");
    for (int n = 0; n < TRACKS; n++) {
        struct bench bench;
        struct motion_range range[3];
        make(&bench);
        if (bench.track.count == 0 || !bench.is_told)
            continue;
        const struct motion_segment *segment =
            &bench.segment[draw_below(bench.track.count)];
        const int64_t span = segment->dur_ns_q12 >> 12;
        if (span < 2)
            continue;
        const int64_t from =
            segment->start_ns_q12 +
            check_random_in(check_stream(), 0, segment->dur_ns_q12 - span);
        assert_int_equal(enclose(&bench, &cursor, from, from + span, range), 1);
        for (unsigned i = 0; i < 3; i++)
            worst[i] = fmax(worst[i],
                            ((double)range[i].high - range[i].low) * 0x1p-30);
        judged++;
    }
    print_message(
        "%d stretches, widest: %.6f of f', %.6f of f'', %.6f of f'''\n", judged,
        worst[0], worst[1], worst[2]);
    assert_true(judged > TRACKS / 8);
    assert_true(worst[0] < 0.002 && worst[1] < 0.002 && worst[2] < 0.002);
}

/* A cubic of jerk 6 for 1 s from rest: f' = 3 t^2, f'' = 6 t. */
static void a_cubic_is_as_by_hand(void **state)
{
    const struct motion_state end = { .pos_q32 = MOTION_FIXED_ONE_Q32,
                                      .vel_q32 = 3 * MOTION_FIXED_ONE_Q32 };
    struct bench bench = { .one_q32 = { 4 * MOTION_FIXED_ONE_Q32,
                                        8 * MOTION_FIXED_ONE_Q32,
                                        8 * MOTION_FIXED_ONE_Q32 } };
    struct motion_cursor cursor = { 0 };
    struct motion_range range[3];
    (void)state;
    motion_track_init(&bench.track, bench.segment, SEGMENTS, 0);
    assert_int_equal(
        motion_track_append_cubic(&bench.track, MOTION_FIXED_S_Q12, 0, &end),
        MOTION_OK);
    motion_track_unit_init(&bench.unit, bench.one_q32);
    assert_int_equal(enclose(&bench, &cursor, MOTION_FIXED_S_Q12 / 4,
                             MOTION_FIXED_S_Q12 / 2, range),
                     1);
    /* at 3/8 +- 1/8: 27/64 +- (18/8 / 8 + 3/64) of 4 */
    assert_true(fabs(range[0].low * 0x1p-30 - 0.09375 / 4) < 4e-6);
    assert_true(fabs(range[0].high * 0x1p-30 - 0.75 / 4) < 4e-6);
    assert_true(fabs(range[1].low * 0x1p-30 - 1.5 / 8) < 4e-6);
    assert_true(fabs(range[1].high * 0x1p-30 - 3.0 / 8) < 4e-6);
    assert_true(fabs(range[2].low * 0x1p-30 - 6.0 / 8) < 4e-6);
    assert_true(fabs(range[2].high * 0x1p-30 - 6.0 / 8) < 4e-6);
    /* half of it is after the end, where it stands */
    assert_int_equal(enclose(&bench, &cursor, MOTION_FIXED_S_Q12 / 2,
                             2 * MOTION_FIXED_S_Q12, range),
                     2);
    assert_int_equal(range[2].low, 0);
}

/* Nothing is told of a stretch that a window lacks. */
static void a_window_says_what_it_lacks(void **state)
{
    struct motion_track_outline outline = { .count = 2 };
    struct motion_cursor cursor = { 0 };
    struct motion_range range[3] = { { 0, 0 }, { 0, 0 }, { 0, 0 } };
    struct bench bench = { .one_q32 = { 1, 1, 1 } };
    int64_t from = 0;
    (void)state;
    motion_track_init(&bench.track, bench.segment, SEGMENTS, 0);
    for (int i = 1; i <= 2; i++)
        assert_int_equal(motion_track_append_line(&bench.track,
                                                  MOTION_FIXED_S_Q12,
                                                  i * MOTION_FIXED_ONE_Q32),
                         MOTION_OK);
    motion_track_unit_init(&bench.unit, bench.one_q32);
    bench.track.outline = &outline;
    bench.track.count = 1;
    assert_true(motion_track_enclose(&bench.track, &cursor, &bench.unit, &from,
                                     2 * MOTION_FIXED_S_Q12, range));
    assert_int_equal(from, MOTION_FIXED_S_Q12);
    assert_false(motion_track_enclose(&bench.track, &cursor, &bench.unit, &from,
                                      2 * MOTION_FIXED_S_Q12, range));
    assert_int_equal(from, MOTION_FIXED_S_Q12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(derivatives_lie_between),
        cmocka_unit_test(short_stretches_are_told_closely),
        cmocka_unit_test(a_cubic_is_as_by_hand),
        cmocka_unit_test(a_window_says_what_it_lacks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
