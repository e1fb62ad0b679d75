/* tests/motion/plan/keys/test_plan_simplify.c - few keys that stand for many. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/fixed.h"
#include "motion/plan/keys/simplify.h"
#include "motion/plan/keys/stand.h"
#include "tests/support/check.h"

#define UNIT  MOTION_FIXED_ONE_Q32
#define S     (INT64_C(1000000000) * MOTION_FIXED_NS_Q12)
#define LOOKS 500

static struct plan_key seen[LOOKS], key[LOOKS];

/* A hand: some waves, and what an encoder and a hand add to it. */
static struct plan_axis hand(double noise)
{
    const double a = 40 * (double)(draw() % 1000) / 1000;
    const double b = 15 * (double)(draw() % 1000) / 1000;
    for (int i = 0; i < LOOKS; i++) {
        const double t = i / 25.0;
        const double at = a * sin(0.7 * t) + b * sin(1.9 * t + 1) +
                          noise * ((double)(draw() % 2001) / 1000 - 1);
        seen[i] = (struct plan_key){ .key = { .t_ns_q12 = i * S / 25,
                                              .pos_q32 =
                                                  llrint(at * (double)UNIT) } };
    }
    memcpy(key, seen, sizeof key);
    return (struct plan_axis){ .curve = PLAN_CURVE_QUINTIC,
                               .key = key,
                               .key_count = LOOKS };
}

static double furthest(const struct plan_axis *axis)
{
    struct motion_track track;
    struct motion_cursor cursor = { 0 };
    struct plan_error error;
    double most = 0;
    assert_int_equal(plan_axis_track(axis, &track, &error), MOTION_OK);
    for (int i = 0; i < LOOKS; i++) {
        struct motion_sample sample;
        motion_track_sample(&track, &cursor, seen[i].key.t_ns_q12, &sample);
        const double off =
            fabs((double)(sample.pos_q32 - seen[i].key.pos_q32) / (double)UNIT);
        most = off > most ? off : most;
    }
    plan_track_free(&track);
    return most;
}

static void the_curve_is_within_the_tolerance_of_all(void **state)
{
    struct plan_error error;
    (void)state;
    seed_from("hand");
    for (int round = 0; round < 20; round++) {
        const double tolerance = 0.05 * (1 + (double)(draw() % 20));
        struct plan_axis axis = hand(0.02);
        assert_int_equal(plan_simplify(&axis, llrint(tolerance * (double)UNIT),
                                       NULL, &error),
                         MOTION_OK);
        if (furthest(&axis) > tolerance * 1.000001)
            fail_msg("round %d: %.4f beyond %.4f", round, furthest(&axis),
                     tolerance);
        if (axis.key_count > LOOKS / 4)
            fail_msg("round %d: %u keys for %.3f", round,
                     (unsigned)axis.key_count, tolerance);
        assert_true(axis.key[0].key.t_ns_q12 == 0);
        assert_true(axis.key[axis.key_count - 1].key.t_ns_q12 ==
                    seen[LOOKS - 1].key.t_ns_q12);
    }
}

/* Without one of its keys it would be too far off. */
static void none_of_them_could_go(void **state)
{
    struct plan_error error;
    static struct plan_key less[LOOKS];
    (void)state;
    seed_from("hand");
    struct plan_axis axis = hand(0.02);
    assert_int_equal(plan_simplify(&axis, UNIT / 5, NULL, &error), MOTION_OK);
    for (uint32_t i = 1; i + 1 < axis.key_count; i++) {
        struct plan_axis other = axis;
        memcpy(less, axis.key, i * sizeof *less);
        memcpy(less + i, axis.key + i + 1,
               (axis.key_count - i - 1) * sizeof *less);
        other.key = less;
        other.key_count--;
        if (furthest(&other) <= 0.2 && i + 2 == axis.key_count)
            fail_msg("key %u could go", (unsigned)i);
    }
}

static void a_straight_line_has_two_keys(void **state)
{
    struct plan_error error;
    (void)state;
    seed_from("line");
    struct plan_axis axis = hand(0);
    axis.curve = PLAN_CURVE_LINEAR;
    for (int i = 0; i < LOOKS; i++)
        key[i].key.pos_q32 = i * UNIT / 10;
    assert_int_equal(plan_simplify(&axis, UNIT / 1000, NULL, &error),
                     MOTION_OK);
    assert_int_equal(axis.key_count, 2);
}

static void no_tolerance_keeps_every_key(void **state)
{
    struct plan_error error;
    (void)state;
    seed_from("all");
    struct plan_axis axis = hand(1);
    assert_int_equal(plan_simplify(&axis, 0, NULL, &error), MOTION_OK);
    assert_int_equal(axis.key_count, LOOKS);
    assert_memory_equal(key, seen, sizeof key);
}

static void a_curve_beside_its_keys_is_refused(void **state)
{
    struct plan_error error;
    (void)state;
    struct plan_axis axis = hand(0);
    axis.curve = PLAN_CURVE_BSPLINE;
    assert_int_equal(plan_simplify(&axis, UNIT, NULL, &error), MOTION_E_ARG);
    assert_int_equal(axis.key_count, LOOKS);
}

/* Pushed away from an end of the range, to and fro, and back to it; with what an
 * encoder adds, which is kept inside as a machine keeps it. */
static void what_keeps_a_range_is_not_taken_out_of_it(void **state)
{
    struct plan_error error;
    unsigned stand = 0;
    (void)state;
    seed_from("range");
    for (int round = 0; round < 60; round++) {
        const double noise = round % 3 == 0 ? 0 : 0.02;
        const double tolerance = 0.06 * (1 + (double)(draw() % 20));
        const double wait = 20 + (double)(draw() % 60);
        struct plan_axis axis = hand(noise);
        int64_t low = INT64_MAX, high = INT64_MIN;
        for (int i = 0; i < LOOKS; i++) {
            int64_t *pos = &seen[i].key.pos_q32;
            const double t = (i - wait) / 25.0;
            const double hill = t > 0 && t < 12 ? 1 - cos(t * 2 * 3.14159 / 6)
                                                : 0; /* twice, from rest */
            *pos = round % 2 == 0
                       ? llrint((30 * hill + noise * (double)(draw() % 3)) *
                                (double)UNIT)
                       : *pos;
            low = *pos < low ? *pos : low;
            high = *pos > high ? *pos : high;
        }
        memcpy(key, seen, sizeof key);
        const struct plan_limit limit = { .pos_min_q32 = low,
                                          .pos_max_q32 = high };
        struct motion_track track;
        int64_t at;
        assert_int_equal(plan_simplify(&axis, llrint(tolerance * (double)UNIT),
                                       &limit, &error),
                         MOTION_OK);
        assert_int_equal(plan_axis_track(&axis, &track, &error), MOTION_OK);
        if (plan_stand_leaves(&track, &limit, &at))
            fail_msg("round %d: leaves %g .. %g at %g s", round,
                     (double)low / (double)UNIT, (double)high / (double)UNIT,
                     (double)at / (double)S);
        plan_track_free(&track);
        if (furthest(&axis) > tolerance * 1.000001)
            fail_msg("round %d: %.4f beyond %.4f", round, furthest(&axis),
                     tolerance);
        if (axis.key_count > LOOKS / 3)
            fail_msg("round %d: %u keys for %.3f", round,
                     (unsigned)axis.key_count, tolerance);
        for (uint32_t i = 0; i < axis.key_count; i++)
            stand += axis.key[i].key.has_vel;
    }
    assert_true(stand > 60); /* where they turn at the end of the range */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_curve_is_within_the_tolerance_of_all),
        cmocka_unit_test(none_of_them_could_go),
        cmocka_unit_test(a_straight_line_has_two_keys),
        cmocka_unit_test(no_tolerance_keeps_every_key),
        cmocka_unit_test(a_curve_beside_its_keys_is_refused),
        cmocka_unit_test(what_keeps_a_range_is_not_taken_out_of_it),
    };
    return cmocka_run_group_tests_name("plan_simplify", tests, NULL, NULL);
}
