/* tests/motion/plan/keys/test_plan_bezier.c - axes whose keys have handles. */
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/check.h"
#include "motion/plan/move.h"
#include "tests/support/check.h"

#define ONE  MOTION_FIXED_ONE_Q32
#define SEC  MOTION_FIXED_S_Q12
#define KEYS 6

static struct plan_key keys[KEYS];
static struct plan_bezier_key handles[KEYS];
static struct plan_axis axis;
static struct motion_track track;
static struct plan_error error;

/* Keys at 0, 2, 3, 6, 7 s. */
static void make_axis(uint32_t count)
{
    static const double t[KEYS] = { 0, 2, 3, 6, 7, 9 };
    static const double pos[KEYS] = { 0, 10, 30, 45, 40, -5 };

    memset(keys, 0, sizeof keys);
    memset(handles, 0, sizeof handles);
    axis = (struct plan_axis){ .name = "pan",
                               .curve = PLAN_CURVE_BEZIER,
                               .mu_q32 = ONE,
                               .k1_q32 = ONE / 4,
                               .k2_q32 = 3 * ONE / 4,
                               .blend_ns_q12 = SEC / 4,
                               .bezier.key = handles,
                               .key = keys,
                               .key_count = count };
    for (uint32_t i = 0; i < count; i++) {
        keys[i].key.t_ns_q12 = (int64_t)(t[i] * SEC);
        keys[i].key.pos_q32 = (int64_t)(pos[i] * ONE);
        handles[i].left.kind = handles[i].right.kind = MOTION_FCURVE_CLAMPED;
        handles[i].interpolation = MOTION_FCURVE_BEZIER;
    }
}

static void plan(void)
{
    if (plan_axis_track(&axis, &track, &error) != MOTION_OK)
        fail_msg("%s", error.text);
}

static void refused(int code, const char *says)
{
    const int rc = plan_axis_track(&axis, &track, &error);

    if (rc != code || strstr(error.text, says) == NULL)
        fail_msg("%d \"%s\" instead of %d \"%s\"", rc, error.text, code, says);
    assert_null(track.segment);
}

static double pos_at(double t)
{
    struct motion_state state;

    motion_track_state(&track, (int64_t)(t * SEC), &state);
    return (double)state.pos_q32 / ONE;
}

static double vel_at(double t)
{
    struct motion_state state;

    motion_track_state(&track, (int64_t)(t * SEC), &state);
    return (double)state.vel_q32 / ONE;
}

static void near_to(double got, double want, double within)
{
    if (!(fabs(got - want) <= within))
        fail_msg("%.12g instead of %.12g", got, want);
}

static void free_to(struct plan_handle *handle, double dt, double dp)
{
    *handle = (struct plan_handle){ MOTION_FCURVE_FREE, (int64_t)(dt * SEC),
                                    (int64_t)(dp * ONE) };
}

/* --- tests ---------------------------------------------------------------- */

static void handles_are_offsets_from_their_keys(void **state)
{
    (void)state;
    make_axis(2);
    free_to(&handles[0].right, 0.5, 8);
    free_to(&handles[1].left, -1.25, -1);
    plan();
    for (double u = 0; u <= 1; u += 1.0 / 64) {
        /* by hand: 0, 0.5, 0.75, 2 s and 0, 8, 9, 10 */
        const double w = 1 - u;
        const double t =
            3 * w * w * u * 0.5 + 3 * w * u * u * 0.75 + u * u * u * 2;
        const double p = 3 * w * w * u * 8 + 3 * w * u * u * 9 + u * u * u * 10;
        near_to(pos_at(t), p, 2e-8);
    }
    plan_track_free(&track);
}

static void without_handles_they_are_automatic(void **state)
{
    double want[64];

    (void)state;
    make_axis(5);
    plan();
    for (int i = 0; i < 64; i++)
        want[i] = pos_at(i * 7.0 / 64);
    plan_track_free(&track);
    axis.bezier.key = NULL;
    plan();
    for (int i = 0; i < 64; i++)
        assert_true(pos_at(i * 7.0 / 64) == want[i]);
    near_to(vel_at(0), 0, 1e-9);
    plan_track_free(&track);
}

/* A largest step of velocity. */
static double worst_step(void)
{
    struct motion_continuity step;

    motion_track_continuity(&track, &step);
    return (double)step.vel_step_q32 / ONE;
}

static void automatic_handles_join_every_other_curve(void **state)
{
    static const enum plan_curve curves[] = {
#define CURVE(name, spelling, text) name,
        PLAN_CURVE_LIST(CURVE)
#undef CURVE
    };

    (void)state;
    for (size_t c = 0; c < ARRAY_LEN(curves); c++) {
        if (curves[c] == PLAN_CURVE_LINEAR || curves[c] == PLAN_CURVE_BEZIER ||
            curves[c] == PLAN_CURVE_BSPLINE || curves[c] == PLAN_CURVE_LAGRANGE)
            continue;
        make_axis(6);
        for (uint32_t i = 2; i < 5; i++) {
            keys[i].has_curve = true;
            keys[i].curve = curves[c];
        }
        if (curves[c] == PLAN_CURVE_HERMITE)
            keys[3].key.has_vel = true;
        if (curves[c] == PLAN_CURVE_HERMITE)
            keys[4].key.has_vel = true;
        keys[5].key.has_vel = curves[c] == PLAN_CURVE_HERMITE;
        plan();
        /* constraints gives no acceleration, so lines between its keys */
        if (curves[c] != PLAN_CURVE_CONSTRAINTS && worst_step() > 1e-6)
            fail_msg("%s: velocity steps by %g",
                     plan_curve_rules(curves[c])->name, worst_step());
        plan_track_free(&track);
    }
}

static void a_given_handle_tells_its_neighbour(void **state)
{
    (void)state;
    make_axis(4);
    keys[1].has_curve = true;
    keys[1].curve = PLAN_CURVE_QUINTIC;
    free_to(&handles[1].left, -0.5, -6);
    plan();
    near_to(vel_at(2), 12, 1e-6);
    near_to(worst_step(), 0, 1e-6);
    plan_track_free(&track);
    keys[1].curve = PLAN_CURVE_SINE;
    refused(MOTION_E_ARG, "speed would step: bezier has 12 there and sine 0");
    keys[1].curve = PLAN_CURVE_QUINTIC;
    keys[1].key.has_vel = true;
    refused(MOTION_E_ARG, "velocity is given, but bezier has one of its own");
}

static void what_would_jump_is_refused(void **state)
{
    (void)state;
    make_axis(3);
    handles[1].interpolation = MOTION_FCURVE_CONSTANT;
    refused(MOTION_E_DISCONTINUITY,
            "key 3 of axis pan: constant keeps 10 until here, "
            "where it would jump by 20");
    keys[2].key.pos_q32 = keys[1].key.pos_q32;
    plan();
    near_to(pos_at(2.5), 10, 0);
    plan_track_free(&track);
    make_axis(2);
    free_to(&handles[0].right, 0, 5);
    refused(MOTION_E_SINGULAR, "key 1 of axis pan: the velocity");
    make_axis(2);
    axis.bezier.after =
        (struct motion_fcurve_cycles){ MOTION_FCURVE_REPEAT, 2 };
    refused(MOTION_E_DISCONTINUITY, "a cycle would jump here");
}

static void cycles_and_lines_go_on_until_the_end(void **state)
{
    (void)state;
    make_axis(2);
    axis.bezier.after =
        (struct motion_fcurve_cycles){ MOTION_FCURVE_REPEAT_OFFSET, 3 };
    plan();
    assert_int_equal(track.end_ns_q12, 8 * SEC);
    near_to(pos_at(8), 40, 1e-9);
    near_to(pos_at(5), 25, 1e-8);
    plan_track_free(&track);
    axis.bezier.after =
        (struct motion_fcurve_cycles){ MOTION_FCURVE_MIRROR, 0 };
    refused(MOTION_E_ARG, "its cycles never end");
    axis.bezier.has_end = true;
    axis.bezier.end_ns_q12 = 7 * SEC;
    plan();
    assert_int_equal(track.end_ns_q12, 7 * SEC);
    near_to(pos_at(7), 5, 1e-8);
    plan_track_free(&track);
    axis.bezier.after = (struct motion_fcurve_cycles){ MOTION_FCURVE_ONCE, 0 };
    axis.bezier.extrapolation = MOTION_FCURVE_LINE;
    free_to(&handles[1].right, 1, 2);
    plan();
    near_to(pos_at(7), 20, 1e-8);
    plan_track_free(&track);
    keys[0].has_curve = true;
    keys[0].curve = PLAN_CURVE_SINE;
    refused(MOTION_E_ARG, "needs curve bezier on all spans");
}

static void keys_may_be_before_the_start(void **state)
{
    (void)state;
    make_axis(2);
    handles[0].interpolation = MOTION_FCURVE_LINEAR;
    keys[0].key.t_ns_q12 = -2 * SEC;
    plan();
    assert_int_equal(track.end_ns_q12, 2 * SEC);
    near_to(pos_at(0), 5, 1e-9);
    near_to(vel_at(1), 2.5, 1e-9);
    plan_track_free(&track);
    axis.curve = PLAN_CURVE_LINEAR;
    refused(MOTION_E_ORDER, "before the start of the move");
}

static void an_endless_row_of_cycles_is_refused(void **state)
{
    (void)state;
    make_axis(2);
    keys[1].key.t_ns_q12 = 4096;
    keys[1].key.pos_q32 = 0;
    axis.bezier.has_end = true;
    axis.bezier.end_ns_q12 = 1000 * SEC;
    axis.bezier.after =
        (struct motion_fcurve_cycles){ MOTION_FCURVE_REPEAT, 0 };
    refused(MOTION_E_FULL, "segments");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(handles_are_offsets_from_their_keys),
        cmocka_unit_test(without_handles_they_are_automatic),
        cmocka_unit_test(automatic_handles_join_every_other_curve),
        cmocka_unit_test(a_given_handle_tells_its_neighbour),
        cmocka_unit_test(what_would_jump_is_refused),
        cmocka_unit_test(cycles_and_lines_go_on_until_the_end),
        cmocka_unit_test(keys_may_be_before_the_start),
        cmocka_unit_test(an_endless_row_of_cycles_is_refused),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
