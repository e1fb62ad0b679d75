/* tests/motion/plan/shaper/test_plan_shape.c - shaped tracks against the shaper of the
 * tick, which samples the plain one, and on a simulated drivetrain. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/check.h"
#include "motion/plan/plan_track.h"
#include "motion/plan/shaper/plan_shape.h"
#include "sim/physics/drivetrain.h"
#include "tests/support/check.h"

#define UNIT MOTION_FIXED_ONE_Q32
#define SEC  MOTION_FIXED_S_Q12
#define PI   3.14159265358979323846

static double between(double low, double high)
{
    return low + (high - low) * (double)draw_unit();
}

static struct plan_shaper design(enum plan_shaper_kind kind, double hz,
                                 double damping)
{
    const struct plan_shaper_request request = { kind, hz, damping, 0.05 };
    struct plan_shaper shaper;
    struct plan_error error;

    assert_int_equal(plan_shaper_design(&request, &shaper, &error), MOTION_OK);
    return shaper;
}

/* From rest to rest, through random points; quintic. */
static void wander(struct motion_track *track, int segments)
{
    struct motion_state from = { .pos_q32 = 0 }, to = { .pos_q32 = 0 };

    plan_track_init(track, (int64_t)(between(-100, 100) * (double)UNIT));
    from.pos_q32 = track->end.pos_q32;
    for (int i = 0; i < segments; i++) {
        const bool last = i + 1 == segments;
        to.pos_q32 = (int64_t)(between(-100, 100) * (double)UNIT);
        to.vel_q32 = last ? 0 : (int64_t)(between(-50, 50) * (double)UNIT);
        to.acc_q32 = last ? 0 : (int64_t)(between(-50, 50) * (double)UNIT);
        const int64_t dur = (int64_t)(between(0.05, 2) * (double)SEC);
        while (motion_track_append_quintic(track, dur, &from, &to) ==
               MOTION_E_FULL)
            assert_int_equal(plan_track_grow(track), MOTION_OK);
        from = to;
    }
}

/* A second one, which the first one's owner keeps. */
static void copy_of(const struct motion_track *track, struct motion_track *copy)
{
    *copy = *track;
    copy->segment = malloc(track->count * sizeof *copy->segment);
    assert_non_null(copy->segment);
    copy->capacity = track->count;
    memcpy(copy->segment, track->segment, track->count * sizeof *copy->segment);
}

static int64_t peak_of(const struct motion_track *track,
                       enum motion_quantity quantity)
{
    struct motion_extreme extreme;

    motion_track_extreme(track, quantity, &extreme);
    return (int64_t)fmax(fabs((double)extreme.min), fabs((double)extreme.max));
}

/* Each factor is a multiple of 2^-32: up to four of them off by one, times the
 * largest value there is; and what sampling rounds (track.h). */
static double allowed(const struct motion_track *track,
                      enum motion_quantity quantity)
{
    return 4 * ldexp((double)peak_of(track, quantity), -32) + 8 +
           ldexp((double)peak_of(track, quantity), -46);
}

static void compare(const struct motion_track *shaped,
                    const struct motion_shaper *shaper,
                    const struct motion_track *plain)
{
    struct motion_shaper_cursor cursor = { 0 };
    const double pos_most = allowed(plain, MOTION_POS);
    const double vel_most = allowed(plain, MOTION_VEL);

    for (int i = 0; i <= 2000; i++) {
        const int64_t t = shaped->end_ns_q12 / 2000 * i;
        struct motion_sample want;
        struct motion_state got;
        motion_shaper_sample(shaper, plain, &cursor, t, &want);
        motion_track_state(shaped, t, &got);
        const double pos = fabs((double)(got.pos_q32 - want.pos_q32));
        const double vel = fabs((double)(got.vel_q32 - want.vel_q32));
        if (pos > pos_most || vel > vel_most)
            fail_msg("%d of 2000: position %g, velocity %g units of 2^-32 "
                     "beside that of the tick",
                     i, pos, vel);
    }
}

static void a_shaped_track_is_what_the_tick_makes_of_the_plain_one(void **state)
{
    (void)state;
    seed_from("shaped");
    for (int n = 0; n < 200; n++) {
        const enum plan_shaper_kind kind =
            (enum plan_shaper_kind)(n % PLAN_SHAPER_KINDS);
        const struct plan_shaper shaper =
            design(kind, between(0.3, 30), between(0, 0.3));
        struct motion_track plain, shaped;
        struct motion_shaper tick;
        wander(&plain, 1 + n % 7);
        copy_of(&plain, &shaped);
        assert_int_equal(
            plan_shaper_to_tick(&shaper, (int64_t)(between(0, 1) * (double)SEC),
                                &tick),
            MOTION_OK);
        assert_int_equal(plan_shape_track(&tick, &shaped), MOTION_OK);
        compare(&shaped, &tick, &plain);
        assert_int_equal(shaped.end_ns_q12,
                         plain.end_ns_q12 + tick.delay_ns_q12[tick.count - 1]);
        assert_true(shaped.end.pos_q32 == plain.end.pos_q32);
        assert_true(shaped.end_frac == plain.end_frac);
        assert_true(shaped.segment[0].pos_q32 == plain.segment[0].pos_q32);
        plan_track_free(&plain);
        plan_track_free(&shaped);
    }
}

/* The limits are the plain track's own peaks, so that there is no margin. */
static void what_was_inside_its_limits_stays_there(void **state)
{
    (void)state;
    seed_from("limits");
    for (int n = 0; n < 200; n++) {
        const struct plan_shaper shaper =
            design((enum plan_shaper_kind)(n % PLAN_SHAPER_KINDS),
                   between(0.3, 30), between(0, 0.3));
        struct motion_track track;
        struct motion_extreme range;
        struct motion_shaper tick;
        struct plan_violation found[4];
        wander(&track, 1 + n % 7);
        motion_track_extreme(&track, MOTION_POS, &range);
        const struct plan_limit limit = {
            .pos_min_q32 = range.min,
            .pos_max_q32 = range.max,
            .vel_q32 = peak_of(&track, MOTION_VEL),
            .acc_q32 = peak_of(&track, MOTION_ACC),
            .jerk_q32 = peak_of(&track, MOTION_JERK),
            .period_ns = 1000000,
        };
        assert_int_equal(plan_check_track(&track, &limit, found, 4), 0);
        assert_int_equal(plan_shaper_to_tick(&shaper, 0, &tick), MOTION_OK);
        assert_int_equal(plan_shape_track(&tick, &track), MOTION_OK);
        if (plan_check_track(&track, &limit, found, 4) != 0)
            fail_msg("%d: kind %d at %.9g s: %.9g, limit %.9g", n,
                     (int)found[0].kind,
                     (double)found[0].t_ns_q12 / (double)SEC,
                     (double)found[0].value / (double)UNIT,
                     (double)found[0].limit / (double)UNIT);
        plan_track_free(&track);
    }
}

/* --- a move of several axes ----------------------------------------------- */

static double mean_time(const struct motion_track *track, double speed)
{
    /* Of a long ramp: where it would have begun at full speed. */
    struct motion_state at;
    const int64_t middle = track->end_ns_q12 / 2;

    motion_track_state(track, middle, &at);
    return (double)middle / (double)SEC -
           (double)at.pos_q32 / (double)UNIT / speed;
}

static void ramp(struct motion_track *track)
{
    plan_track_init(track, 0);
    assert_int_equal(plan_track_grow(track), MOTION_OK);
    assert_int_equal(motion_track_append_line(track, 20 * SEC, 2000 * UNIT),
                     MOTION_OK);
}

static void axes_of_a_move_keep_together(void **state)
{
    const struct plan_shaper slow = design(PLAN_SHAPER_ZVD, 1.5, 0.02),
                             quick = design(PLAN_SHAPER_EI2, 9, 0.1);
    const struct plan_shaper *const shaper[] = { &slow, NULL, &quick };
    struct motion_track track[3];
    struct plan_outcome outcome = { .has_path = false };
    struct plan_shape_cost cost;
    struct plan_error error;

    (void)state;
    for (int i = 0; i < 3; i++)
        ramp(&track[i]);
    assert_int_equal(plan_shape_move(shaper, 3, track, &outcome, &cost, &error),
                     MOTION_OK);
    assert_true(fabs(cost.lag_s - plan_shaper_delay(&slow)) < 1e-9);
    assert_true(fabs(cost.longer_s - slow.time_s[2]) < 1e-9);
    for (int i = 0; i < 3; i++)
        if (fabs(mean_time(&track[i], 100) - cost.lag_s) > 1e-9)
            fail_msg("axis %d lags %.12g s, expected %.12g", i,
                     mean_time(&track[i], 100), cost.lag_s);
    assert_int_equal(plan_outcome_time(&outcome, outcome.lag_ns_q12 + 5), 5);
    assert_int_equal(track[0].end_ns_q12 - outcome.lag_ns_q12 -
                         outcome.tail_ns_q12,
                     20 * SEC);
    for (int i = 0; i < 3; i++)
        plan_track_free(&track[i]);
}

static void without_shapers_nothing_changes(void **state)
{
    const struct plan_shaper *const shaper[] = { NULL };
    struct motion_track track, before;
    struct plan_outcome outcome = { .has_path = false };
    struct plan_shape_cost cost;
    struct plan_error error;

    (void)state;
    ramp(&track);
    before = track;
    assert_int_equal(
        plan_shape_move(shaper, 1, &track, &outcome, &cost, &error), MOTION_OK);
    assert_memory_equal(&before, &track, sizeof track);
    assert_true(cost.lag_s == 0 && cost.longer_s == 0);
    assert_int_equal(outcome.lag_ns_q12, 0);
    plan_track_free(&track);
}

/* --- a carriage on a post that bends --------------------------------------- */

/* The carriage is moved as told: an inertia so large that the load does not
 * disturb it, with the torque that its acceleration takes.  Returns the largest
 * twist in the two seconds after the end. */
static double residual_twist(const struct motion_track *track, double hz,
                             double damping)
{
    const double heavy = 1e6, load = 1, w = 2 * PI * hz;
    const struct sim_drivetrain_config config = {
        .inertias = 2,
        .inertia = { { .inertia_kg_m2 = heavy }, { .inertia_kg_m2 = load } },
        .coupling = { { .stiffness_n_m_rad = w * w * load,
                        .damping_n_m_s = 2 * damping * w * load,
                        .ratio = 1 } },
    };
    static struct sim_drivetrain drive;
    const double step = 1e-3;
    const double end = (double)track->end_ns_q12 / (double)SEC;
    double most = 0;

    assert_int_equal(sim_drivetrain_init(&drive, &config), MOTION_OK);
    for (int i = 0; i * step < end + 2; i++) {
        struct sim_drivetrain_input input = { 0 };
        struct motion_state at;
        motion_track_state(track, llround((i + 0.5) * step * (double)SEC), &at);
        if ((i + 0.5) * step < end)
            input.torque_n_m.c[0] = heavy * (double)at.acc_q32 / (double)UNIT;
        assert_int_equal(sim_drivetrain_step(&drive, i * step, step, &input),
                         MOTION_OK);
        if (i * step > end)
            most = fmax(most, fabs(sim_drivetrain_twist_rad(&drive, 0)));
    }
    return most;
}

static void zvd_leaves_at_most_a_twentieth_of_the_vibration(void **state)
{
    (void)state;
    seed_from("residual");
    for (int n = 0; n < 40; n++) {
        const double hz = between(1, 8), damping = between(0, 0.05);
        /* within five per cent of what the rig file says */
        const double real = hz * between(0.95, 1.05);
        const struct plan_shaper shaper = design(PLAN_SHAPER_ZVD, hz, damping);
        const struct motion_state rest = { 0 }, to = { .pos_q32 = UNIT };
        struct motion_track track;
        struct motion_shaper tick;
        plan_track_init(&track, 0);
        assert_int_equal(plan_track_grow(&track), MOTION_OK);
        assert_int_equal(motion_track_append_quintic(
                             &track,
                             llround((double)SEC * between(0.8, 1.4) / hz),
                             &rest, &to),
                         MOTION_OK);
        const double before = residual_twist(&track, real, damping);
        assert_int_equal(plan_shaper_to_tick(&shaper, 0, &tick), MOTION_OK);
        assert_int_equal(plan_shape_track(&tick, &track), MOTION_OK);
        const double after = residual_twist(&track, real, damping);
        if (after > 0.05 * before)
            fail_msg("%.3g Hz (%.3g planned), damping %.3g: %.3g of %.3g", real,
                     hz, damping, after, before);
        plan_track_free(&track);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(
            a_shaped_track_is_what_the_tick_makes_of_the_plain_one),
        cmocka_unit_test(what_was_inside_its_limits_stays_there),
        cmocka_unit_test(axes_of_a_move_keep_together),
        cmocka_unit_test(without_shapers_nothing_changes),
        cmocka_unit_test(zvd_leaves_at_most_a_twentieth_of_the_vibration),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
