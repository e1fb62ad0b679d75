/* tests/firmware/control/test_gear.c - the curve of a gear that is engaged: its ends,
 * slopes and bounds are those of the formulas in gear.h, in either direction. */
#include "firmware/control/gear.h"

#include <math.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "tests/support/check.h"

#define UNIT MOTION_FIXED_ONE_Q32

static struct motion_segment segment[CONTROLLER_GEAR_SEGMENTS];
static struct motion_track track;
static struct controller_cam cam;

static int make(const struct controller_gear *gear)
{
    motion_track_init(&track, segment, CONTROLLER_GEAR_SEGMENTS, 0);
    return controller_gear_cam(gear, &track, &cam);
}

/* C, C' and C'' at a place of the master, by the track's time. */
static struct motion_state curve_at(double m)
{
    struct motion_state state;
    motion_track_state(
        &track, controller_cam_ns_q12(&cam, llrint(m * (double)UNIT)), &state);
    return state;
}

static double q32(int64_t value)
{
    return (double)value / (double)UNIT;
}

static void its_place_and_slope_are_those_of_the_formulas(void **state)
{
    (void)state;
    for (int n = 0; n < 200; n++) {
        const bool back = draw() % 2 == 0;
        const double ratio = (back ? -1 : 1) * (0.1 + 3 * (double)draw_unit());
        const double over = 1 + 40 * (double)draw_unit();
        const double f = 20 * (double)draw_unit() - 10;
        const double m0 = 40 * (double)draw_unit() - 20;
        const double way = back ? -1 : 1;
        const struct controller_gear gear = {
            .ratio_q32 = llrint(ratio * (double)UNIT),
            .place_q32 = llrint(f * (double)UNIT),
            .begin_q32 = llrint(m0 * (double)UNIT),
            .over_q32 = llrint(over * (double)UNIT),
            .low_q32 = -100 * UNIT,
            .high_q32 = 100 * UNIT,
            .is_backwards = back,
        };
        assert_int_equal(make(&gear), MOTION_OK);
        for (double x = -0.5; x < 1.5; x += 0.03125) {
            const double u = fmin(fmax(x, 0), 1), past = fmax(x - 1, 0);
            const struct motion_state at = curve_at(m0 + way * over * x);
            const double place =
                f + way * ratio * over * (u * u * u - u * u * u * u / 2 + past);
            const double slope = ratio * (3 * u * u - 2 * u * u * u);
            assert_true(fabs(q32(at.pos_q32) - place) < 1e-7);
            assert_true(fabs(ldexp(q32(at.vel_q32), -cam.shift) - slope) <
                        1e-6);
            assert_true(fabs(ldexp(q32(at.acc_q32), -2 * cam.shift)) <=
                        1.5 * fabs(ratio) / over * (1 + 1e-6));
        }
        assert_true(q32(cam.slope_q32) >= fabs(ratio) * (1 - 1e-6));
        assert_true(ldexp(q32(cam.second_q32), -2 * cam.shift) >=
                    1.5 * fabs(ratio) / over * (1 - 1e-6));
        assert_true(ldexp(q32(cam.third_q32), -3 * cam.shift) >=
                    6 * fabs(ratio) / (over * over) * (1 - 1e-6));
    }
}

/* Nothing to engage, or no room for it within the master's range. */
static void what_is_no_gear_is_refused(void **state)
{
    static const struct controller_gear good = {
        UNIT, 0, 0, 10 * UNIT, -50 * UNIT, 50 * UNIT, false
    };
    struct controller_gear gear;
    (void)state;
    assert_int_equal(make(&good), MOTION_OK);
    gear = good, gear.ratio_q32 = 0;
    assert_int_equal(make(&gear), MOTION_E_ARG);
    gear = good, gear.over_q32 = 0;
    assert_int_equal(make(&gear), MOTION_E_ARG);
    gear = good, gear.over_q32 = -UNIT;
    assert_int_equal(make(&gear), MOTION_E_ARG);
    gear = good, gear.over_q32 = 50 * UNIT;
    assert_int_equal(make(&gear), MOTION_E_ARG);
    gear.is_backwards = true;
    assert_int_equal(make(&gear), MOTION_E_ARG);
    gear = good, gear.begin_q32 = -50 * UNIT;
    assert_int_equal(make(&gear), MOTION_E_ARG);
    gear = good, gear.begin_q32 = 50 * UNIT;
    assert_int_equal(make(&gear), MOTION_E_ARG);
    gear = good, gear.ratio_q32 = INT64_MAX / 2, gear.high_q32 = 50 * UNIT;
    assert_int_equal(make(&gear), MOTION_E_RANGE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(its_place_and_slope_are_those_of_the_formulas),
        cmocka_unit_test(what_is_no_gear_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
