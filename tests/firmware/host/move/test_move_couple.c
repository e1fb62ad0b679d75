/* tests/firmware/host/move/test_move_couple.c - gears and cams of a move file:
 * where the axis is at any time, from where its master is. */
#include "motion/plan/plan_couple.h"

#include "motion/core/err.h"
#include "motion/plan/plan_track.h"
#include "tests/firmware/host/move/move_file.h"

#define RIG "examples/dolly/rig.yaml"
#define DOLLY                                                                  \
    "axes:\n"                                                                  \
    "  dolly: {curve: s-curve, keys: [[0 s, 100 mm], [3 s, 600 mm],"           \
    " [4 s, 600 mm], [8 s, 250 mm], [9 s, 250 mm]]}\n"

static struct move_file file;

/* Worst of position, velocity and acceleration at many times: of what the axis
 * does, less what C(m) and its derivatives say. */
static void expect_curve(double (*curve)(double m, int derivative), double pos,
                         double vel, double acc)
{
    const int64_t end_ns_q12 = move_file_track(&file, "dolly")->end_ns_q12;

    assert_int_equal(move_file_track(&file, "pan")->end_ns_q12, end_ns_q12);
    for (int i = 0; i <= 1237; i++) {
        const int64_t t = end_ns_q12 / 1237 * i;
        const struct motion_state m = move_file_at(&file, "dolly", t);
        const struct motion_state p = move_file_at(&file, "pan", t);
        const double at = ldexp((double)m.pos_q32, -32);
        const double v = ldexp((double)m.vel_q32, -32);
        const double a = ldexp((double)m.acc_q32, -32);
        const double off[] = {
            ldexp((double)p.pos_q32, -32) - curve(at, 0),
            ldexp((double)p.vel_q32, -32) - curve(at, 1) * v,
            ldexp((double)p.acc_q32, -32) -
                (curve(at, 2) * v * v + curve(at, 1) * a),
        };
        if (fabs(off[0]) > pos || fabs(off[1]) > vel || fabs(off[2]) > acc)
            fail_msg("at %.4f s: off by %.3g, %.3g, %.3g", (double)t / 4096e9,
                     off[0], off[1], off[2]);
    }
}

static double gear(double m, int derivative)
{
    return derivative == 0 ? 20 - 3 * m / 40 : derivative == 1 ? -3.0 / 40 : 0;
}

static void a_gear_is_its_ratio_at_any_time(void **state)
{
    (void)state;
    move_file_need(&file, RIG,
                   DOLLY "couplings:\n"
                         "  pan: {master: dolly, numerator: -3, "
                         "denominator: 40, offset: 20 deg}\n");
    expect_curve(gear, 1e-9, 1e-8, 1e-7);
    move_file_close(&file);
}

/* The curve of the file by itself, read where the master is. */
static struct motion_track curve;

static void plan_table(void)
{
    struct plan_error error;

    plan_track_free(&curve);
    assert_int_equal(
        plan_axis_track(&file.move.coupling[0].cam, &curve, &error), 0);
}

static double table(double m, int derivative)
{
    const struct plan_coupling *own = &file.move.coupling[0];
    struct motion_state state;

    motion_track_state(&curve,
                       llrint((m - ldexp((double)own->low_q32, -32)) * 4096e6),
                       &state);
    return ldexp((double)(derivative == 0   ? state.pos_q32
                          : derivative == 1 ? state.vel_q32
                                            : state.acc_q32),
                 -32) /
           pow(1000, derivative);
}

/* Two dwells, and a rise between them that is half over in its middle. */
static void a_cam_dwells_rises_and_dwells(void **state)
{
    unsigned low = 0, high = 0;
    (void)state;
    move_file_need(&file, RIG,
                   DOLLY "couplings:\n"
                         "  pan: {master: dolly, curve: s-curve, cam: "
                         "[[100 mm, 5 deg], [200 mm, 5 deg], [400 mm, 45 deg],"
                         " [600 mm, 45 deg]]}\n");
    plan_table();
    expect_curve(table, 1e-8, 1e-6, 1e-4);
    assert_true(fabs(table(300, 0) - 25) < 1e-6);
    for (double t_s = 0; t_s < 9; t_s += 0.01) {
        const double m = move_file_pos(&file, "dolly", t_s);
        const double p = move_file_pos(&file, "pan", t_s);
        low += m < 200 && fabs(p - 5) < 1e-9;
        high += m > 400 && fabs(p - 45) < 1e-9;
        assert_true(m > 200 || fabs(p - 5) < 1e-9);
        assert_true(m < 400 || fabs(p - 45) < 1e-9);
    }
    assert_true(low > 20 && high > 100);
    move_file_close(&file);
}

/* The master rests at the end of the table and goes back out of its dwell while
 * it speeds up: in the first segment of its way back. */
static void it_leaves_a_dwell_at_the_end_of_the_table(void **state)
{
    (void)state;
    move_file_need(&file, RIG,
                   DOLLY "couplings:\n"
                         "  pan: {master: dolly, curve: s-curve, cam: "
                         "[[0 mm, 5 deg], [590 mm, 45 deg], "
                         "[600 mm, 45 deg]]}\n");
    plan_table();
    expect_curve(table, 1e-8, 1e-6, 1e-4);
    move_file_close(&file);
}

/* What the time of the master is bent by bends both. */
static void a_coupling_comes_after_the_warp(void **state)
{
    (void)state;
    move_file_need(&file, RIG,
                   DOLLY "couplings:\n"
                         "  pan: {master: dolly, numerator: -3, "
                         "denominator: 40, offset: 20 deg}\n"
                         "duration: 17 s\n"
                         "warp: {curve: quintic, keys: [[0 s, 0 s], "
                         "[7 s, 5 s], [12 s, 9 s]]}\n");
    expect_curve(gear, 1e-9, 1e-8, 1e-7);
    move_file_close(&file);
}

/* The limits are the axis's own. */
static void
the_limits_of_the_axis_are_checked_over_the_masters_move(void **state)
{
    static const int numerator[] = { 1, 20 };
    struct plan_violation violation;
    char text[400];
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(numerator); i++) {
        snprintf(text, sizeof text,
                 DOLLY
                 "couplings:\n"
                 "  pan: {master: dolly, numerator: %d, denominator: 100}\n",
                 numerator[i]);
        move_file_need(&file, RIG, text);
        const struct plan_limit *limit =
            &file.rig.axis[rig_axis_index(&file.rig, "pan")].limit;
        assert_int_equal(plan_check_track(move_file_track(&file, "pan"), limit,
                                          &violation, 1) > 0,
                         i == 1);
        move_file_close(&file);
    }
}

static void a_master_that_stands_leaves_the_axis_where_it_is(void **state)
{
    (void)state;
    move_file_need(&file, RIG,
                   "axes: {dolly: {keys: [[0 s, 200 mm], [2 s, 200 mm]]}}\n"
                   "couplings: {pan: {master: dolly, numerator: 1, "
                   "denominator: 10}}\n");
    assert_true(fabs(move_file_pos(&file, "pan", 1) - 20) < 1e-9);
    assert_true(move_file_at(&file, "pan", MOVE_FILE_S).vel_q32 == 0);
    move_file_close(&file);
}

static char example[4096];

/* Above the table the lift stands, beside it too. */
static void the_example_follows_its_slide(void **state)
{
    FILE *from = fopen("examples/gears/move.yaml", "r");
    unsigned level = 0;
    (void)state;
    assert_non_null(from);
    assert_true(fread(example, 1, sizeof example - 1, from) > 0);
    fclose(from);
    move_file_need(&file, "examples/gears/rig.yaml", example);
    const int64_t end_ns_q12 = move_file_track(&file, "slide")->end_ns_q12;
    for (int i = 0; i <= 4001; i++) {
        const int64_t t = end_ns_q12 / 4001 * i;
        const double at =
            ldexp((double)move_file_at(&file, "slide", t).pos_q32, -32);
        const double weight =
            ldexp((double)move_file_at(&file, "counterweight", t).pos_q32, -32);
        const double lift =
            ldexp((double)move_file_at(&file, "lift", t).pos_q32, -32);
        if (fabs(450 - at / 2 - weight) > 1e-9)
            fail_msg("slide %.6f, counterweight %.9f", at, weight);
        if (at >= 350 && at <= 650 && fabs(lift - 90) > 1e-6)
            fail_msg("slide %.6f, lift %.9f", at, lift);
        if ((at <= 50 || at >= 870) && fabs(lift - 10) > 1e-6)
            fail_msg("slide %.6f, lift %.9f", at, lift);
        level += at >= 350 && at <= 650;
    }
    assert_true(level > 500);
    move_file_close(&file);
}

static void a_master_that_leaves_the_cam_is_refused(void **state)
{
    (void)state;
    move_file_refuse(RIG,
                     DOLLY "couplings:\n"
                           "  pan: {master: dolly, cam: [[0 mm, 0 deg], "
                           "[500 mm, 9 deg]]}\n",
                     "4:3: the cam of pan has no place for dolly at 600, where "
                     "that is at 3.000 s, expected one that goes from 0 to 500 "
                     "at most");
    move_file_refuse(RIG,
                     DOLLY "couplings:\n"
                           "  pan: {master: dolly, cam: [[150 mm, 0 deg], "
                           "[700 mm, 9 deg]]}\n",
                     "no place for dolly at 100, where that is at 0.000 s");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_gear_is_its_ratio_at_any_time),
        cmocka_unit_test(a_cam_dwells_rises_and_dwells),
        cmocka_unit_test(it_leaves_a_dwell_at_the_end_of_the_table),
        cmocka_unit_test(a_coupling_comes_after_the_warp),
        cmocka_unit_test(
            the_limits_of_the_axis_are_checked_over_the_masters_move),
        cmocka_unit_test(a_master_that_stands_leaves_the_axis_where_it_is),
        cmocka_unit_test(the_example_follows_its_slide),
        cmocka_unit_test(a_master_that_leaves_the_cam_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
