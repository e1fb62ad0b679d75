/* tests/motion/plan/keys/test_plan_edges.c - every kind of curve at the edges of
 * what keys can be: few, many, equal, out of order, at the ends of the range,
 * too steep.  Each gives a track that is right or one sentence that names the
 * key.  Takes long. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/move.h"
#include "tests/support/check.h"

#define ONE MOTION_FIXED_ONE_Q32
#define SEC MOTION_FIXED_S_Q12
#define TOP MOTION_TRACK_POS_MAX_Q32
#ifdef CHECK_SANITIZED /* ten times slower */
#define MILLION 100000
#else
#define MILLION PLAN_KEYS_MAX
#endif
#define MANY     (MILLION / 10)
#define LAGRANGE 16

static const enum plan_curve curves[] = {
#define CURVE(name, spelling, text) name,
    PLAN_CURVE_LIST(CURVE)
#undef CURVE
};

static struct plan_key keys[PLAN_KEYS_MAX + 1];
static struct plan_axis axis;
static struct motion_track track;
static struct plan_error error;

/* --- bench ---------------------------------------------------------------- */

static void make_axis(enum plan_curve curve, uint32_t count)
{
    axis = (struct plan_axis){ .name = "pan",
                               .curve = curve,
                               .mu_q32 = ONE,
                               .k1_q32 = ONE / 4,
                               .k2_q32 = 3 * ONE / 4,
                               .blend_ns_q12 = SEC / 100,
                               .key = keys,
                               .key_count = count,
                               .place = { 5, 1 } };
    for (uint32_t i = 0; i < count; i++)
        keys[i].key.has_vel = curve == PLAN_CURVE_HERMITE;
}

/* A walk whose spans are 25 to 50 ms. */
static void make_walk(enum plan_curve curve, uint32_t count)
{
    uint64_t seed = 7;
    int64_t t = 0, pos = 0;

    memset(keys, 0, count * sizeof keys[0]);
    make_axis(curve, count);
    for (uint32_t i = 0; i < count; i++) {
        keys[i].key.t_ns_q12 = t;
        keys[i].key.pos_q32 = pos;
        keys[i].place = (struct plan_place){ 10 + i, 3 };
        t += check_random_in(&seed, SEC / 40, SEC / 20);
        pos += check_random_in(&seed, -ONE, ONE);
    }
}

static int plan(void)
{
    memset(&error, 0, sizeof error);
    return plan_axis_track(&axis, &track, &error);
}

static const char *name(void)
{
    return plan_curve_rules(axis.curve)->name;
}

/* The curve passes by its inner keys. */
static bool passes_by(enum plan_curve curve)
{
    return curve == PLAN_CURVE_ROUNDED || curve == PLAN_CURVE_SMOOTHED ||
           curve == PLAN_CURVE_BSPLINE;
}

static void assert_hits(uint32_t i)
{
    struct motion_state state;

    motion_track_state(&track, keys[i].key.t_ns_q12, &state);
    if (state.pos_q32 != keys[i].key.pos_q32)
        fail_msg("%s: key %u missed", name(), (unsigned)i + 1);
}

/* Every key to the bit, no gap, and inside the formats. */
static void assert_right(void)
{
    struct motion_continuity worst;
    const uint32_t last = axis.key_count - 1;

    motion_track_continuity(&track, &worst);
    assert_int_equal(worst.pos_step_q32, 0);
    assert_int_equal(track.end_ns_q12, keys[last].key.t_ns_q12);
    assert_int_equal(track.end.pos_q32, keys[last].key.pos_q32);
    assert_hits(0);
    for (uint32_t i = 1; i < last && !passes_by(axis.curve); i++)
        assert_hits(i);
}

static void assert_refused(const char *what, int code, uint32_t key)
{
    const int rc = plan();

    if (rc != code || error.key != key || error.text[0] == 0)
        fail_msg("%s, %s: %d, key %u: \"%s\"", name(), what, rc,
                 (unsigned)error.key + 1, error.text);
    assert_null(track.segment);
}

/* Right, or a sentence; never something else. */
static bool assert_right_or_refused(const char *what)
{
    if (plan() == MOTION_OK) {
        assert_right();
        plan_track_free(&track);
        return true;
    }
    if (error.text[0] == 0 || track.segment != NULL)
        fail_msg("%s, %s: \"%s\"", name(), what, error.text);
    return false;
}

/* --- how many ------------------------------------------------------------- */

static void no_key_is_refused(void **state)
{
    (void)state;
    for (size_t c = 0; c < ARRAY_LEN(curves); c++) {
        make_walk(curves[c], 0);
        assert_refused("no keys", MOTION_E_EMPTY, 0);
    }
}

static void one_key_stands(void **state)
{
    (void)state;
    for (size_t c = 0; c < ARRAY_LEN(curves); c++) {
        make_walk(curves[c], 1);
        keys[0].key.pos_q32 = 3 * ONE;
        assert_int_equal(plan(), MOTION_OK);
        assert_int_equal(track.end.pos_q32, 3 * ONE);
        assert_int_equal(track.end.vel_q32, 0);
        plan_track_free(&track);
    }
}

static void two_keys_are_joined(void **state)
{
    (void)state;
    for (size_t c = 0; c < ARRAY_LEN(curves); c++) {
        make_walk(curves[c], 2);
        if (!assert_right_or_refused("two keys"))
            fail_msg("%s: %s", name(), error.text);
    }
}

static double seconds(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec / 1e9;
}

static void assert_many(uint32_t count)
{
    const double start = seconds();

    if (plan() != MOTION_OK)
        fail_msg("%s: %s", name(), error.text);
    print_message("%-18s %7u keys, %8u segments, %5.2f s\n", name(),
                  (unsigned)count, (unsigned)track.count, seconds() - start);
    assert_int_equal(track.end_ns_q12, keys[count - 1].key.t_ns_q12);
    for (uint32_t i = 0; i < count && !passes_by(axis.curve);
         i += count / 97 + 1)
        assert_hits(i);
    plan_track_free(&track);
}

/* A million of what users have most of; 100,000 of each other kind, which
 * bench-curves shows to be linear; the sine takes 26 segments a key. */
static void many_keys_take_time_that_has_an_end(void **state)
{
    (void)state;
    for (size_t c = 0; c < ARRAY_LEN(curves); c++) {
        const uint32_t count = curves[c] == PLAN_CURVE_LINEAR     ? MILLION
                               : curves[c] == PLAN_CURVE_LAGRANGE ? LAGRANGE
                               : curves[c] == PLAN_CURVE_SINE     ? MANY / 20
                                                                  : MANY;
        make_walk(curves[c], count);
        assert_many(count);
    }
    make_walk(PLAN_CURVE_C2, MILLION);
    assert_many(MILLION);
}

static void one_more_than_a_million_is_refused(void **state)
{
    (void)state;
    for (size_t c = 0; c < ARRAY_LEN(curves); c++) {
        make_axis(curves[c], PLAN_KEYS_MAX + 1);
        assert_refused("a million and one", MOTION_E_FULL, 0);
    }
}

/* --- times ---------------------------------------------------------------- */

static void equal_times_are_refused_by_the_later_key(void **state)
{
    (void)state;
    for (size_t c = 0; c < ARRAY_LEN(curves); c++) {
        make_walk(curves[c], 6);
        keys[3].key.t_ns_q12 = keys[2].key.t_ns_q12;
        assert_refused("equal times", MOTION_E_ORDER, 3);
        assert_int_equal(error.place.line, 13);
    }
}

static void times_out_of_order_are_refused(void **state)
{
    (void)state;
    for (size_t c = 0; c < ARRAY_LEN(curves); c++) {
        make_walk(curves[c], 6);
        keys[4].key.t_ns_q12 = keys[1].key.t_ns_q12 - 1;
        assert_refused("out of order", MOTION_E_ORDER, 4);
        make_walk(curves[c], 6);
        keys[0].key.t_ns_q12 = -1;
        if (curves[c] != PLAN_CURVE_BEZIER) /* comes in from before its start */
            assert_refused("before the move", MOTION_E_ORDER, 0);
    }
}

static void the_shortest_and_the_longest_span(void **state)
{
    (void)state;
    for (size_t c = 0; c < ARRAY_LEN(curves); c++) {
        make_walk(curves[c], 2);
        keys[1].key.t_ns_q12 = 1;
        (void)assert_right_or_refused("2^-12 ns");
        keys[1].key.t_ns_q12 = MOTION_TRACK_SEGMENT_MAX_NS_Q12;
        (void)assert_right_or_refused("3 days");
        keys[1].key.t_ns_q12 = MOTION_TRACK_MAX_NS_Q12;
        (void)assert_right_or_refused("19 days");
        keys[1].key.t_ns_q12 = INT64_MAX;
        (void)assert_right_or_refused("for ever");
    }
}

/* --- positions ------------------------------------------------------------ */

/* To and fro between the ends of the range: slowly it can be done, where the
 * curve does not swing beyond; it is refused where it does. */
static void positions_at_the_ends_of_the_range(void **state)
{
    unsigned right = 0;

    (void)state;
    for (size_t c = 0; c < ARRAY_LEN(curves); c++) {
        make_walk(curves[c], 5);
        for (uint32_t i = 0; i < 5; i++) {
            keys[i].key.t_ns_q12 = (int64_t)i * 3600 * SEC;
            keys[i].key.pos_q32 = i % 2 ? TOP : -TOP;
        }
        right += assert_right_or_refused("the ends of the range");
        for (uint32_t i = 0; i < 5; i++)
            keys[i].key.pos_q32 = TOP;
        if (!assert_right_or_refused("at the top"))
            fail_msg("%s: %s", name(), error.text);
        for (uint32_t i = 0; i < 5; i++)
            keys[i].key.pos_q32 = i % 2 ? INT64_MAX : INT64_MIN;
        if (assert_right_or_refused("beyond"))
            fail_msg("%s: goes beyond the range", name());
    }
    assert_true(right >= 9); /* all cubics but kochanek, linear, quintic */
}

/* From end to end in a nanosecond: no format holds that speed. */
static void what_is_too_fast_is_refused(void **state)
{
    (void)state;
    for (size_t c = 0; c < ARRAY_LEN(curves); c++) {
        make_walk(curves[c], 5);
        keys[2].key.t_ns_q12 = keys[1].key.t_ns_q12 + 4096;
        keys[1].key.pos_q32 = -TOP;
        keys[2].key.pos_q32 = TOP;
        if (assert_right_or_refused("a jump"))
            fail_msg("%s: jumps", name());
    }
}

static void tangents_that_overflow_are_refused(void **state)
{
    (void)state;
    for (size_t c = 0; c < ARRAY_LEN(curves); c++) {
        if (plan_curve_rules(curves[c])->vel < PLAN_MAY)
            continue;
        for (int e = -20; e <= 2000; e += 20) {
            make_walk(curves[c], 4);
            keys[1].key.has_vel = true;
            keys[1].key.vel = motion_real_make(e % 40 ? 1 : -1, e);
            if (assert_right_or_refused("steep") && e >= 40)
                fail_msg("%s: takes a velocity of 2^%d", name(), e);
        }
        if (plan_curve_rules(curves[c])->acc < PLAN_MAY)
            continue;
        for (int e = -20; e <= 2000; e += 20) {
            make_walk(curves[c], 4);
            keys[0].key.has_acc = true;
            keys[0].key.acc = motion_real_make(e % 40 ? 1 : -1, e);
            if (assert_right_or_refused("bent") && e >= 60)
                fail_msg("%s: takes an acceleration of 2^%d", name(), e);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_key_is_refused),
        cmocka_unit_test(one_key_stands),
        cmocka_unit_test(two_keys_are_joined),
        cmocka_unit_test(many_keys_take_time_that_has_an_end),
        cmocka_unit_test(one_more_than_a_million_is_refused),
        cmocka_unit_test(equal_times_are_refused_by_the_later_key),
        cmocka_unit_test(times_out_of_order_are_refused),
        cmocka_unit_test(the_shortest_and_the_longest_span),
        cmocka_unit_test(positions_at_the_ends_of_the_range),
        cmocka_unit_test(what_is_too_fast_is_refused),
        cmocka_unit_test(tangents_that_overflow_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
