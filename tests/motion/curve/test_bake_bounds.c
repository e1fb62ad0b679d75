/* tests/motion/curve/test_bake_bounds.c - what baking promises holds, and is no
 * more than ten times what is seen: easing equations, time warps and
 * cross-fades (speed laws along a curve: test_speed_law.c).  Each is compared at
 * random times with its definition, computed in motion/number/real.h or long
 * double; SLEW_SAMPLES says at how many (`make bake-bounds`: a million). */
#include <inttypes.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/curve/bake.h"
#include "motion/curve/ease.h"
#include "motion/curve/fcurve.h"
#include "motion/curve/pose.h"
#include "motion/curve/time_warp.h"
#include "tests/support/check.h"
#include "tests/support/real_double.h"

#define SEC      MOTION_FIXED_S_Q12
#define ONE      MOTION_FIXED_ONE_Q32
#define CAPACITY 20000

static struct motion_segment storage[4][CAPACITY];
static struct motion_track baked;
static uint64_t seed;

static long samples(void)
{
    const char *text = getenv("SLEW_SAMPLES");
    const long count = text != NULL ? strtol(text, NULL, 10) : 0;
    return count > 0 ? count : 20000;
}

/* The definition: position at a time. */
typedef long double truth_at(int64_t t_ns_q12);

/* Sampling rounds to 2 units of 2^-32: below that nothing can be seen. */
#define ROUNDING 0x1p-31L

static void compare(const char *name, truth_at *truth, long double stated)
{
    struct motion_cursor cursor = { 0 };
    long double worst = 0;

    for (long i = samples(); i > 0; i--) {
        const int64_t t = check_random_in(&seed, 0, baked.end_ns_q12 - 1);
        struct motion_sample sample;
        motion_track_sample(&baked, &cursor, t, &sample);
        worst = fmaxl(
            worst, fabsl(ldexpl((long double)sample.pos_q32, -32) - truth(t)));
    }
    print_message("%-24s %4u segments, %.2Le seen, %.2Le stated\n", name,
                  (unsigned)baked.count, worst, stated);
    if (worst > stated || stated > 10 * fmaxl(worst, ROUNDING))
        fail_msg("%s: %.3Le seen, %.3Le stated", name, worst, stated);
}

/* --- Blender's easing equations ------------------------------------------- */

static struct motion_fcurve_key key[2];
static struct motion_fcurve curve = { .key = key, .count = 2 };

static long double fcurve_at(int64_t t)
{
    struct motion_fcurve_value value;

    assert_int_equal(motion_fcurve_at(&curve, t, MOTION_FCURVE_AT, &value),
                     MOTION_OK);
    return real_value(value.pos);
}

static void easing(int displacement, int ease)
{
    const struct motion_fcurve_range range = {
        .to_ns_q12 = 2 * SEC,
        .within = { real_of(1e-6L), motion_real_zero(), motion_real_zero() },
        .step = motion_real_int(1),
    };
    struct motion_fcurve_report report;
    char name[64];

    for (int i = 0; i < 2; i++)
        key[i] = (struct motion_fcurve_key){
            .at = { i * 2 * SEC, i * 100 * ONE },
            .left = { i * 2 * SEC - SEC / 2, i * 120 * ONE },
            .right = { i * 2 * SEC + SEC, i * 120 * ONE - 30 * ONE },
            .interpolation = (uint8_t)displacement,
            .easing = (uint8_t)ease,
            .back_q32 = ONE + ONE / 2,
        };
    assert_int_equal(motion_fcurve_handles(&curve, NULL, NULL), MOTION_OK);
    motion_track_init(&baked, storage[0], CAPACITY, 0);
    const int err = motion_fcurve_append(&baked, &curve, &range, &report);
    snprintf(name, sizeof name, "easing %d, %d", displacement, ease);
    if (err == MOTION_E_SINGULAR && displacement == MOTION_FCURVE_CIRC)
        return; /* infinitely steep: a machine cannot follow */
    if (err < 0)
        fail_msg("%s: %s", name, motion_err_text(err));
    compare(name, fcurve_at, fmaxl(real_value(report.bound.pos), ROUNDING));
}

static void easing_equations(void **state)
{
    (void)state;
    seed = 3;
    for (int displacement = MOTION_FCURVE_LINEAR;
         displacement <= MOTION_FCURVE_ELASTIC; displacement++)
        for (int ease = MOTION_FCURVE_IN; ease <= MOTION_FCURVE_IN_OUT; ease++)
            easing(displacement, ease);
}

/* --- bezier spans ---------------------------------------------------------- */

/* Handles of any length, also beyond the other key, which are shortened; where
 * both are, the curve is vertical. */
static void draw_span(void)
{
    const int64_t at = check_random_in(&seed, -SEC, SEC);
    const int64_t dur = check_random_in(&seed, SEC / 20, 5 * SEC);

    for (int i = 0; i < 2; i++) {
        const struct motion_fcurve_point point = {
            at + i * dur, check_random_in(&seed, -100 * ONE, 100 * ONE)
        };
        const int64_t rise = check_random_in(&seed, -50 * ONE, 50 * ONE);
        const int64_t length = check_random_in(
            &seed, dur / 50, i == 0 ? dur - dur / 5 : dur + dur / 4);
        key[i] = (struct motion_fcurve_key){
            .at = point,
            .left = { point.t_ns_q12 - length, point.pos_q32 - rise },
            .right = { point.t_ns_q12 + length, point.pos_q32 + rise },
            .interpolation = MOTION_FCURVE_BEZIER,
        };
    }
}

/* Within what is allowed, and no more than three times what is seen. */
static void near_enough(const char *name, long double seen, long double stated,
                        long double allowed)
{
    print_message("    %-4s %.2Le seen, %.2Le stated, %.2Le allowed\n", name,
                  seen, stated, allowed);
    if (seen > stated || stated > 3 * seen || (stated > allowed && allowed > 0))
        fail_msg("%s: %.3Le seen, %.3Le stated, %.3Le allowed", name, seen,
                 stated, allowed);
}

static void span_with(struct motion_bake_bound within, int64_t from, int64_t to)
{
    const struct motion_fcurve_range range = { from, to, within,
                                               motion_real_zero() };
    struct motion_fcurve_report report;
    struct motion_fcurve_value start;
    long double worst[3] = { 0 };
    uint64_t times = 1; /* so that the spans do not depend on their number */
    int64_t pos;

    motion_fcurve_at(&curve, from, MOTION_FCURVE_AT, &start);
    assert_int_equal(motion_real_round(start.pos, 32, &pos), MOTION_OK);
    motion_track_init(&baked, storage[0], CAPACITY, pos);
    const int err = motion_fcurve_append(&baked, &curve, &range, &report);
    if (err < 0)
        fail_msg("%s", motion_err_text(err));
    for (long i = samples() / 4; i > 0; i--) {
        const int64_t t = check_random_in(&times, 1, to - from - 1);
        const struct motion_bake_point is =
            motion_bake_track(&baked, t, MOTION_BAKE_RIGHT);
        struct motion_fcurve_value want;
        motion_fcurve_at(&curve, from + t, MOTION_FCURVE_RIGHT, &want);
        const struct motion_real off[3] = { motion_real_sub(is.pos, want.pos),
                                            motion_real_sub(is.vel, want.vel),
                                            motion_real_sub(is.acc, want.acc) };
        for (int k = 0; k < 3; k++)
            worst[k] = fmaxl(worst[k], fabsl(real_value(off[k])));
    }
    print_message("%u segments\n", (unsigned)baked.count);
    near_enough("pos", worst[0], real_value(report.bound.pos),
                real_value(within.pos));
    near_enough("vel", worst[1], real_value(report.bound.vel),
                real_value(within.vel));
    near_enough("acc", worst[2], real_value(report.bound.acc),
                real_value(within.acc));
}

/* Whole, from and to the middle, there and back. */
static void bezier_spans(void **state)
{
    (void)state;
    const struct motion_real zero = motion_real_zero();
    const struct motion_bake_bound within[] = {
        { real_of(1e-6L), zero, zero },
        { real_of(1e-3L), real_of(1e-4L), zero },
        { real_of(1e-3L), real_of(1), real_of(1e-3L) },
    };

    seed = 6;
    for (int round = 0; round < 12; round++) {
        draw_span();
        const int64_t start = key[0].at.t_ns_q12, end = key[1].at.t_ns_q12;
        const int64_t dur = end - start;
        curve.after = (struct motion_fcurve_cycles){ 0 };
        assert_int_equal(motion_fcurve_handles(&curve, NULL, NULL), MOTION_OK);
        span_with(within[round % 3], start, end);
        span_with(within[round % 3], start + dur / 3, end - dur / 7);
        curve.after.mode = MOTION_FCURVE_MIRROR;
        span_with(within[round % 3], end, end + dur - dur / 5);
    }
    curve.after = (struct motion_fcurve_cycles){ 0 };
}

/* --- time warps and cross-fades ------------------------------------------- */

static struct motion_track part[3];

static struct motion_real at_of(const struct motion_track *track, int64_t t)
{
    uint32_t i = 0;

    if (t >= track->end_ns_q12)
        return motion_real_from_q(track->end.pos_q32, 32);
    while (i + 1 < track->count && track->segment[i + 1].start_ns_q12 <= t)
        i++;
    return motion_bake_segment(&track->segment[i],
                               t - track->segment[i].start_ns_q12)
        .pos;
}

/* Quintics between random keys. */
static void draw_part(int i, uint32_t segments, int64_t least, int64_t most)
{
    motion_track_init(&part[i], storage[1 + i], CAPACITY,
                      check_random_in(&seed, least, most));
    for (uint32_t k = 0; k < segments; k++) {
        const struct motion_state end = { .pos_q32 = check_random_in(
                                              &seed, least, most) };
        assert_int_equal(motion_track_append_quintic(
                             &part[i], check_random_in(&seed, SEC, 2 * SEC),
                             &part[i].end, &end),
                         MOTION_OK);
    }
}

/* At a time in seconds from its start. */
static long double segment_at(const struct motion_segment *segment,
                              long double dt_s)
{
    const long double u =
        dt_s / real_value(motion_bake_seconds(segment->dur_ns_q12));
    struct motion_real coef[MOTION_TRACK_DEGREE + 1];
    long double sum = 0;

    motion_bake_coefficients(segment, coef);
    for (int i = MOTION_TRACK_DEGREE; i >= 0; i--)
        sum = sum * u + real_value(coef[i]);
    return sum;
}

/* w in seconds is no multiple of the clock's tick. */
static long double warped_at(int64_t t)
{
    const struct motion_track *f = &part[0];
    const struct motion_real w_s =
        motion_real_div(at_of(&part[1], t), motion_real_int(1000));
    uint32_t i = 0;

    while (i + 1 < f->count &&
           motion_real_cmp(motion_bake_seconds(f->segment[i + 1].start_ns_q12),
                           w_s) <= 0)
        i++;
    return segment_at(
        &f->segment[i],
        real_value(motion_real_sub(
            w_s, motion_bake_seconds(f->segment[i].start_ns_q12))));
}

static void time_warps(void **state)
{
    (void)state;
    seed = 4;
    for (int round = 0; round < 4; round++) {
        struct motion_real bound;
        struct motion_state start;

        draw_part(0, 3, -100 * ONE, 100 * ONE);
        draw_part(1, 3, 0, motion_time_warp_ms(part[0].end_ns_q12 - 1));
        motion_time_warp_state(&part[0], &part[1], 0, &start);
        motion_track_init(&baked, storage[0], CAPACITY, start.pos_q32);
        assert_int_equal(
            motion_time_warp_append(&baked, &part[0], &part[1], &bound),
            MOTION_OK);
        compare("time warp", warped_at, fmaxl(real_value(bound), ROUNDING));
    }
}

static long double faded_at(int64_t t)
{
    const long double from = real_value(at_of(&part[0], t)),
                      to = real_value(at_of(&part[1], t)),
                      weight = real_value(at_of(&part[2], t));
    return from + weight * (to - from);
}

static void cross_fades(void **state)
{
    (void)state;
    seed = 5;
    for (int round = 0; round < 4; round++) {
        struct motion_real bound;

        draw_part(0, 3, -100 * ONE, 100 * ONE);
        draw_part(1, 3, -100 * ONE, 100 * ONE);
        draw_part(2, 2, 0, ONE);
        motion_track_init(&baked, storage[0], CAPACITY, 0);
        assert_int_equal(motion_pose_fade(&baked, &part[0], &part[1], &part[2],
                                          ONE / 1000000, &bound),
                         MOTION_OK);
        compare("cross-fade", faded_at, fmaxl(real_value(bound), ROUNDING));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(easing_equations),
        cmocka_unit_test(bezier_spans),
        cmocka_unit_test(time_warps),
        cmocka_unit_test(cross_fades),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
