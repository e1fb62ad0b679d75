/* tests/motion/plan/keys/test_plan_cycles.c - keys that repeat, under every curve.
 *
 * What is planned is compared with the same axis whose keys a person wrote out,
 * and judged by itself: where one lap goes over to the next it does not
 * step. */
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/move.h"
#include "tests/support/check.h"

#define ONE  MOTION_FIXED_ONE_Q32
#define SEC  MOTION_FIXED_S_Q12
#define KEYS 20

static const char *const curve_name[] = {
#define CYCLES_CURVE(name, spelling, text) [name] = spelling,
    PLAN_CURVE_LIST(CYCLES_CURVE)
#undef CYCLES_CURVE
};

/* How far what joins two spans is continuous there; -1: it has no cycles. */
static const int smooth[] = {
    [PLAN_CURVE_LINEAR] = 0,      [PLAN_CURVE_ROUNDED] = 1,
    [PLAN_CURVE_SMOOTHED] = 2,    [PLAN_CURVE_PARABOLIC] = 1,
    [PLAN_CURVE_SINE] = 1,        [PLAN_CURVE_SCURVE] = 2,
    [PLAN_CURVE_HERMITE] = 1,     [PLAN_CURVE_CATMULL_ROM] = 1,
    [PLAN_CURVE_CARDINAL] = 1,    [PLAN_CURVE_KOCHANEK] = 1,
    [PLAN_CURVE_MONOTONE] = 1,    [PLAN_CURVE_AKIMA] = 1,
    [PLAN_CURVE_C2] = 2,          [PLAN_CURVE_AKIMA_MONOTONE] = 1,
    [PLAN_CURVE_QUINTIC] = 2,     [PLAN_CURVE_C4] = 2,
    [PLAN_CURVE_CONSTRAINTS] = 0, [PLAN_CURVE_BSPLINE] = 2,
    [PLAN_CURVE_LAGRANGE] = -1,   [PLAN_CURVE_BEZIER] = -1,
};

static struct plan_key keys[KEYS];
static struct plan_axis axis;
static struct motion_track track;
static struct plan_error error;

static void key_at(uint32_t i, double t, double pos)
{
    keys[i] = (struct plan_key){
        .key = { .t_ns_q12 = (int64_t)(t * SEC),
                 .pos_q32 = (int64_t)(pos * ONE),
                 .vel = motion_real_zero(),
                 .acc = motion_real_zero(),
                 .has_vel = axis.curve == PLAN_CURVE_HERMITE },
        .place = { 10 + i, 3 },
    };
}

static void start_axis(enum plan_curve curve, uint32_t count)
{
    axis = (struct plan_axis){ .name = "pan",
                               .curve = curve,
                               .mu_q32 = ONE,
                               .k1_q32 = ONE / 8,
                               .k2_q32 = ONE / 2,
                               .blend_ns_q12 = SEC / 4,
                               .shape = { ONE / 4, 0, ONE / 2 },
                               .key = keys,
                               .key_count = count };
}

static const double lap_t[] = { 0, 1, 2.5, 4 };
static double lap_pos[] = { 1, 6, -2, 1 };

/* Keys at 0, 1, 2.5 and 4 s; the last is where the first is. */
static void make_axis(enum plan_curve curve, uint8_t mode, uint32_t count)
{
    start_axis(curve, 4);
    for (uint32_t i = 0; i < 4; i++)
        key_at(i, lap_t[i], lap_pos[i]);
    axis.bezier.after = (struct motion_fcurve_cycles){ mode, count };
}

static void plan(struct motion_track *out)
{
    if (plan_axis_track(&axis, out, &error) != MOTION_OK)
        fail_msg("%s: %s", curve_name[axis.curve], error.text);
}

static void refused(int code, uint32_t line, const char *says)
{
    memset(&error, 0, sizeof error);
    const int rc = plan_axis_track(&axis, &track, &error);

    if (rc != code || strcmp(error.text, says) != 0 || error.place.line != line)
        fail_msg("%d \"%s\" in line %u instead of %d \"%s\"", rc, error.text,
                 (unsigned)error.place.line, code, says);
    assert_null(track.segment);
}

static double pos_at(const struct motion_track *of, double t)
{
    struct motion_state state;

    motion_track_state(of, (int64_t)(t * SEC), &state);
    return (double)state.pos_q32 / ONE;
}

/* The largest step of p', both ends included, or of p'' between two segments
 * (at rest a cubic has one at the ends). */
static double worst_step(const struct motion_track *of, int order)
{
    double before = 0, worst = 0;

    for (uint32_t i = 0; i < of->count; i++) {
        const struct motion_segment *segment = &of->segment[i];
        struct motion_state a, b;

        motion_segment_state(segment, 0, &a);
        motion_segment_state(segment, segment->dur_ns_q12, &b);
        const double now = (double)(order == 1 ? a.vel_q32 : a.acc_q32) / ONE;
        if (order == 1 || i > 0)
            worst = fmax(worst, fabs(now - before));
        before = (double)(order == 1 ? b.vel_q32 : b.acc_q32) / ONE;
    }
    return order == 1 ? fmax(worst, fabs(before)) : worst;
}

static void near_to(double got, double want, double within)
{
    if (!(fabs(got - want) <= within))
        fail_msg("%s: %.12g instead of %.12g", curve_name[axis.curve], got,
                 want);
}

static void expect_smooth(enum plan_curve curve)
{
    if (smooth[curve] >= 1)
        near_to(worst_step(&track, 1), 0, 1e-6);
    if (smooth[curve] >= 2)
        near_to(worst_step(&track, 2), 0, 1e-5);
}

static void expect_same(double end, const struct motion_track *of)
{
    assert_int_equal(of->end_ns_q12, (int64_t)(end * SEC));
    assert_int_equal(track.end_ns_q12, of->end_ns_q12);
    for (double t = 0; t <= end; t += 1.0 / 64)
        near_to(pos_at(&track, t), pos_at(of, t), 2e-9);
}

/* Position of key i of a lap, as a person counts it out. */
static void written_key(uint32_t number, int lap, uint32_t i, uint8_t mode)
{
    const bool back = mode == MOTION_FCURVE_MIRROR && lap % 2 != 0;
    const double rise =
        mode == MOTION_FCURVE_REPEAT_OFFSET ? lap_pos[3] - lap_pos[0] : 0;

    key_at(number, 4 * lap + (back ? 4 - lap_t[3 - i] : lap_t[i]),
           lap * rise + (back ? lap_pos[3 - i] : lap_pos[i]));
}

/* Curves whose spans have a direction are mirrored with them. */
static void written_shape(uint32_t number, bool back)
{
    keys[number].has_shape = back && (axis.curve == PLAN_CURVE_PARABOLIC ||
                                      axis.curve == PLAN_CURVE_SINE ||
                                      axis.curve == PLAN_CURVE_SCURVE);
    keys[number].shape.ease.k1_q32 = ONE - axis.k2_q32;
    keys[number].shape.ease.k2_q32 = ONE - axis.k1_q32;
}

static void cycles_are_keys_written_out(enum plan_curve curve, uint8_t mode)
{
    struct motion_track whole;

    make_axis(curve, mode, 3);
    plan(&track);
    expect_smooth(curve);
    start_axis(curve, 13);
    for (int lap = 0; lap < 4; lap++)
        for (uint32_t i = lap > 0; i < 4; i++)
            written_key((uint32_t)lap * 3 + i, lap, i, mode);
    for (uint32_t i = 0; i < 13; i++)
        written_shape(i, mode == MOTION_FCURVE_MIRROR && (i / 3) % 2 != 0);
    plan(&whole);
    expect_same(16, &whole);
    plan_track_free(&whole);
    plan_track_free(&track);
}

static void every_curve_repeats_without_a_step(void **state)
{
    (void)state;
    for (int curve = 0; curve < (int)ARRAY_LEN(smooth); curve++) {
        if (smooth[curve] < 0)
            continue;
        lap_pos[3] = lap_pos[0];
        cycles_are_keys_written_out((enum plan_curve)curve,
                                    MOTION_FCURVE_REPEAT);
        lap_pos[3] = 3.5;
        cycles_are_keys_written_out((enum plan_curve)curve,
                                    MOTION_FCURVE_REPEAT_OFFSET);
        if (curve != PLAN_CURVE_KOCHANEK) /* its bias turns round */
            cycles_are_keys_written_out((enum plan_curve)curve,
                                        MOTION_FCURVE_MIRROR);
    }
}

/* Also with curves that are solved for all keys at once, away from the ends. */
static void inner_laps_are_alike(void **state)
{
    (void)state;
    for (int curve = 0; curve < (int)ARRAY_LEN(smooth); curve++) {
        if (smooth[curve] < 0)
            continue;
        make_axis((enum plan_curve)curve, MOTION_FCURVE_REPEAT, 19);
        plan(&track);
        for (double t = 36; t < 40; t += 1.0 / 32)
            near_to(pos_at(&track, t + 4), pos_at(&track, t), 4e-9);
        plan_track_free(&track);
    }
}

static void a_mirrored_lap_is_the_lap_backwards(void **state)
{
    (void)state;
    lap_pos[3] = 3.5;
    for (int curve = 0; curve < (int)ARRAY_LEN(smooth); curve++) {
        if (smooth[curve] < 0)
            continue;
        make_axis((enum plan_curve)curve, MOTION_FCURVE_MIRROR, 1);
        plan(&track);
        expect_smooth((enum plan_curve)curve);
        for (double t = 0; t < 4; t += 1.0 / 32)
            near_to(pos_at(&track, 8 - t), pos_at(&track, t), 4e-9);
        plan_track_free(&track);
    }
}

static void a_periodic_c2_is_the_same_in_every_lap(void **state)
{
    (void)state;
    make_axis(PLAN_CURVE_C2, MOTION_FCURVE_REPEAT, 3);
    axis.first = axis.last = MOTION_SPLINE_PERIODIC;
    plan(&track);
    for (double t = 0; t < 4; t += 1.0 / 32)
        for (int lap = 1; lap < 4; lap++)
            near_to(pos_at(&track, t + 4 * lap), pos_at(&track, t), 2e-9);
    plan_track_free(&track);
}

/* Before: the first key at 4 s, so that one lap is there. */
static void cycles_before_the_first_key_begin_at_zero(void **state)
{
    struct motion_track whole;

    (void)state;
    make_axis(PLAN_CURVE_QUINTIC, MOTION_FCURVE_ONCE, 0);
    for (uint32_t i = 0; i < 4; i++)
        keys[i].key.t_ns_q12 += 4 * SEC;
    axis.bezier.before.mode = MOTION_FCURVE_REPEAT;
    plan(&track);
    make_axis(PLAN_CURVE_QUINTIC, MOTION_FCURVE_REPEAT, 1);
    plan(&whole);
    expect_same(8, &whole);
    plan_track_free(&track);
    make_axis(PLAN_CURVE_QUINTIC, MOTION_FCURVE_ONCE, 0);
    for (uint32_t i = 0; i < 4; i++)
        keys[i].key.t_ns_q12 += 10 * SEC;
    axis.bezier.before =
        (struct motion_fcurve_cycles){ MOTION_FCURVE_REPEAT, 1 };
    plan(&track);
    for (double t = 0; t <= 8; t += 1.0 / 64)
        near_to(pos_at(&track, t + 6), pos_at(&whole, t), 2e-9);
    near_to(pos_at(&track, 3), 1, 0);
    plan_track_free(&track);
    plan_track_free(&whole);
    axis.bezier.before.count = 0;
    refused(MOTION_E_ARG, 0,
            "axis pan: the move starts between two keys of its cycles, "
            "expected a key at 0 s, or curve bezier on all spans");
}

static void until_is_a_key_of_any_lap(void **state)
{
    (void)state;
    make_axis(PLAN_CURVE_QUINTIC, MOTION_FCURVE_REPEAT, 0);
    refused(MOTION_E_ARG, 0,
            "axis pan: its cycles never end, expected after_count or until");
    axis.bezier.has_end = true;
    axis.bezier.end_ns_q12 = 12 * SEC;
    plan(&track);
    assert_int_equal(track.end_ns_q12, 12 * SEC);
    expect_smooth(PLAN_CURVE_QUINTIC);
    plan_track_free(&track);
    axis.bezier.end_ns_q12 = 9 * SEC; /* the second key of the third lap */
    plan(&track);
    near_to(pos_at(&track, 9), 6, 0);
    assert_int_equal(track.end_ns_q12, 9 * SEC);
    expect_smooth(PLAN_CURVE_QUINTIC);
    plan_track_free(&track);
    axis.bezier.end_ns_q12 = 9 * SEC + SEC / 2;
    refused(MOTION_E_ARG, 0,
            "axis pan: until is 9.5 s, where there is no key, expected the "
            "time of one such as 9 s, or curve bezier on all spans");
    axis.bezier.end_ns_q12 = -SEC;
    refused(MOTION_E_ORDER, 0,
            "axis pan: until is -1 s, which is not after the start");
}

static void what_cannot_repeat_is_refused(void **state)
{
    (void)state;
    make_axis(PLAN_CURVE_LAGRANGE, MOTION_FCURVE_REPEAT, 2);
    refused(MOTION_E_ARG, 0,
            "axis pan: lagrange has neither cycles nor until, as it is one "
            "polynomial through all keys, expected another curve such as c2");
    make_axis(PLAN_CURVE_QUINTIC, MOTION_FCURVE_REPEAT, 2);
    keys[1].has_curve = true;
    keys[1].curve = PLAN_CURVE_BEZIER;
    refused(MOTION_E_ARG, 0,
            "axis pan: cycles and until need curve bezier on all spans, or on "
            "none");
    make_axis(PLAN_CURVE_QUINTIC, MOTION_FCURVE_REPEAT, 2);
    keys[3].key.pos_q32 += 1;
    refused(MOTION_E_DISCONTINUITY, 10,
            "key 1 of axis pan: a cycle would jump here, as it does not end "
            "where it starts; repeat-offset would not");
    make_axis(PLAN_CURVE_QUINTIC, MOTION_FCURVE_REPEAT, 2);
    axis.key_count = 1;
    refused(MOTION_E_ARG, 0,
            "axis pan: cycles and until need two keys or more");
    make_axis(PLAN_CURVE_QUINTIC, MOTION_FCURVE_REPEAT, 400000);
    refused(MOTION_E_FULL, 0,
            "axis pan: its cycles take more than the 1000000 keys allowed");
    make_axis(PLAN_CURVE_QUINTIC, MOTION_FCURVE_REPEAT, 2);
    axis.bezier.extrapolation = MOTION_FCURVE_LINE;
    refused(MOTION_E_ARG, 0,
            "axis pan: extrapolation needs curve bezier on all spans");
}

static void what_both_ends_of_a_lap_give_must_be_the_same(void **state)
{
    (void)state;
    make_axis(PLAN_CURVE_QUINTIC, MOTION_FCURVE_REPEAT, 2);
    keys[0].key.has_vel = keys[3].key.has_vel = true;
    keys[3].key.vel = motion_real_int(2);
    refused(MOTION_E_ARG, 10,
            "key 1 of axis pan: where cycles meet, the first and the last key "
            "are one, but each gives another velocity");
    keys[0].key.vel = motion_real_int(2);
    plan(&track);
    plan_track_free(&track);
    keys[0].key.has_vel = false;
    plan(&track);
    plan_track_free(&track);
    axis.bezier.after.mode = MOTION_FCURVE_MIRROR;
    refused(MOTION_E_ARG, 13,
            "key 4 of axis pan: its velocity is not zero, but a mirrored cycle "
            "turns round here");
}

/* A sentence about a lap names the key that the user wrote. */
static void keys_are_named_as_they_were_written(void **state)
{
    (void)state;
    make_axis(PLAN_CURVE_C2, MOTION_FCURVE_REPEAT, 2);
    keys[0].key.has_acc = true;
    refused(MOTION_E_ARG, 10,
            "key 1 of axis pan: acceleration is given, but c2 keeps one only "
            "at its ends, instead of a velocity");
}

/* A lap ends where it starts. */
static int closed(void **state)
{
    (void)state;
    lap_pos[3] = lap_pos[0];
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(every_curve_repeats_without_a_step, closed),
        cmocka_unit_test_setup(inner_laps_are_alike, closed),
        cmocka_unit_test_setup(a_mirrored_lap_is_the_lap_backwards, closed),
        cmocka_unit_test_setup(a_periodic_c2_is_the_same_in_every_lap, closed),
        cmocka_unit_test_setup(cycles_before_the_first_key_begin_at_zero,
                               closed),
        cmocka_unit_test_setup(until_is_a_key_of_any_lap, closed),
        cmocka_unit_test_setup(what_cannot_repeat_is_refused, closed),
        cmocka_unit_test_setup(what_both_ends_of_a_lap_give_must_be_the_same,
                               closed),
        cmocka_unit_test_setup(keys_are_named_as_they_were_written, closed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
