/* tests/motion/path/test_lookat.c - a camera that looks at something: frames
 * that can be written down by hand, and the way over the top. */
#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/number/trig.h"
#include "motion/path/lookat.h"
#include "tests/motion/path/lookat_point.h"
#include "tests/support/check.h"
#include "tests/support/real_double.h"

#define SEED  UINT64_C(20250314)
#define ONE   ((int64_t)1 << 62)
#define Q32   MOTION_FIXED_ONE_Q32
#define S_Q12 MOTION_FIXED_S_Q12

static const struct motion_lookat y_up = {
    .up = { { 0, ONE, 0 } },
    .ahead = { { 0, 0, -ONE } },
};

static struct motion_vec point(long double x, long double y, long double z)
{
    const int64_t p[3] = { llrintl(ldexpl(x, 32)), llrintl(ldexpl(y, 32)),
                           llrintl(ldexpl(z, 32)) };
    return motion_vec_from_q32(p);
}

static long double apart(struct motion_dir a, long double x, long double y,
                         long double z)
{
    return fmaxl(fabsl(q62(a.q62[0]) - x),
                 fmaxl(fabsl(q62(a.q62[1]) - y), fabsl(q62(a.q62[2]) - z)));
}

/* --- the frame ----------------------------------------------------------- */

static void looking_forward_is_the_identity(void **state)
{
    struct motion_lookat_state s = { .valid = false };
    struct motion_view v;
    (void)state;
    assert_int_equal(
        lookat_point(&y_up, &s, point(0, 0, 5), point(0, 0, 1), 0, &v),
        MOTION_OK);
    assert_true(apart(v.right, 1, 0, 0) < 1e-18L);
    assert_true(apart(v.up, 0, 1, 0) < 1e-18L);
    assert_true(apart(v.view, 0, 0, -1) < 1e-18L);
    assert_true(motion_view_quat(&v).w > ONE - 8);
}

static void frames_are_level_right_handed_and_of_length_one(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    for (int i = 0; i < 2000; i++) {
        struct motion_lookat_state s = { .valid = false };
        int64_t p[3], c[3];
        struct motion_view v;

        for (int k = 0; k < 3; k++) {
            const unsigned small = (unsigned)(check_random(&seed) % 40);
            p[k] = (int64_t)check_random(&seed) >> 2;
            c[k] = p[k] + ((int64_t)check_random(&seed) >> (2 + small));
        }
        assert_int_equal(lookat_point(&y_up, &s, motion_vec_from_q32(p),
                                      motion_vec_from_q32(c), 0, &v),
                         MOTION_OK);
        const long double x = (long double)c[0] - (long double)p[0],
                          y = (long double)c[1] - (long double)p[1],
                          z = (long double)c[2] - (long double)p[2];
        const long double r = sqrtl(x * x + y * y + z * z),
                          level = sqrtl(x * x + z * z);
        if (level < r * 0x1p-19L)
            continue;
        /* w x (0, 1, 0) = (-z, 0, x) */
        if (apart(v.view, x / r, y / r, z / r) > 1e-18L ||
            apart(v.right, -z / level, 0, x / level) > 1e-18L ||
            apart(v.up, -x * y / level / r, level / r, -z * y / level / r) >
                1e-17L)
            fail_msg("seed %" PRIu64 " round %d", SEED, i);
    }
}

static void tilt_is_clockwise(void **state)
{
    struct motion_lookat_state s = { .valid = false };
    struct motion_view v;
    (void)state;
    for (int i = 0; i < 2; i++) { /* the state is that without tilt */
        assert_int_equal(lookat_point(&y_up, &s, point(0, 0, 0),
                                      point(0, 0, -1), MOTION_TRIG_QUARTER_TURN,
                                      &v),
                         MOTION_OK);
        assert_true(apart(v.right, 0, -1, 0) < 1e-18L);
        assert_true(apart(v.up, 1, 0, 0) < 1e-18L);
    }
}

static void in_the_target_there_is_no_view(void **state)
{
    struct motion_lookat_state s = { .valid = false }, was;
    struct motion_view v;
    (void)state;
    memset(&was, 0, sizeof was);
    memset(&s, 0, sizeof s);
    assert_int_equal(
        lookat_point(&y_up, &s, point(1, 2, 3), point(1, 2, 3), 0, &v),
        MOTION_E_RANGE);
    assert_memory_equal(&s, &was, sizeof s);
}

/* --- the way over the top ------------------------------------------------ */

/* A camera flies over (side = 1: under) the origin in steps; the largest turn
 * of its right vector in one step, as the smallest cosine. */
static long double fly_over(const struct motion_lookat *lookat,
                            long double height, long double off,
                            long double step, bool *inverted)
{
    struct motion_lookat_state s = { .valid = false };
    struct motion_view v, before = { .right = { { 0, 0, 0 } } };
    long double worst = 1;

    for (long double x = -2; x <= 2; x += step) {
        assert_int_equal(lookat_point(lookat, &s, point(x, height, off),
                                      point(0, 0, 0), 0, &v),
                         MOTION_OK);
        if (x > -2)
            worst =
                fminl(worst, q62(motion_dir_dot_q62(v.right, before.right)));
        before = v;
    }
    *inverted = v.up.q62[1] < 0;
    return worst;
}

static void straight_over_the_target_the_picture_does_not_flip(void **state)
{
    /* steps that meet the vertical, miss it on both sides, wide and narrow */
    static const long double step[] = { 0.25L, 0.3L, 1.0L, 0.07L, 0.001L };
    struct motion_lookat upright = y_up;
    bool inverted;
    (void)state;
    upright.pole = MOTION_POLE_UPRIGHT;
    for (size_t i = 0; i < ARRAY_LEN(step); i++) {
        for (int side = -1; side <= 1; side += 2) {
            assert_true(fly_over(&y_up, side * 3, 0, step[i], &inverted) >
                        1 - 1e-15L);
            assert_true(inverted);
            /* unless that is asked for */
            assert_true(fly_over(&upright, side * 3, 0, step[i], &inverted) <
                        0);
            assert_false(inverted);
        }
    }
}

static void beside_the_vertical_the_horizon_stays_level(void **state)
{
    bool inverted;
    (void)state;
    /* 0.01 beside: the right vector swings round in many small steps */
    assert_true(fly_over(&y_up, 3, 0.01L, 0.0005L, &inverted) > 0.99L);
    assert_false(inverted);
    assert_true(fly_over(&y_up, -3, -0.01L, 0.0005L, &inverted) > 0.99L);
    assert_false(inverted);
    /* or in one, where steps are wide */
    assert_true(fly_over(&y_up, 3, 0.01L, 0.3L, &inverted) < 0);
    assert_false(inverted);
}

static void turning_round_on_the_level_is_no_way_over_the_top(void **state)
{
    struct motion_lookat_state s = { .valid = false };
    struct motion_view v;
    (void)state;
    (void)lookat_point(&y_up, &s, point(0, 0, 0), point(1, 0.1L, 0), 0, &v);
    assert_int_equal(
        lookat_point(&y_up, &s, point(0, 0, 0), point(-1, 0.1L, 0), 0, &v),
        MOTION_OK);
    assert_true(v.up.q62[1] > 0);
    assert_true(apart(v.right, 0, 0, -1) < 1e-18L);
}

static void over_and_back_is_upright_again(void **state)
{
    static const long double x[] = { -1, -0.2L, 0.3L, 1, 0.4L, -0.5L };
    struct motion_lookat_state s = { .valid = false };
    struct motion_view v;
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(x); i++) {
        assert_int_equal(
            lookat_point(&y_up, &s, point(x[i], 3, 0), point(0, 0, 0), 0, &v),
            MOTION_OK);
        assert_true((v.up.q62[1] < 0) == (x[i] > 0));
    }
}

static void a_camera_that_starts_straight_down_faces_ahead(void **state)
{
    struct motion_lookat wrong = y_up;
    struct motion_lookat_state s = { .valid = false };
    struct motion_view v;
    (void)state;
    wrong.ahead = wrong.up;
    assert_int_equal(
        lookat_point(&wrong, &s, point(0, 3, 0), point(0, 0, 0), 0, &v),
        MOTION_E_ARG);
    assert_int_equal(
        lookat_point(&y_up, &s, point(0, 3, 0), point(0, 0, 0), 0, &v),
        MOTION_OK);
    assert_true(apart(v.right, 1, 0, 0) < 1e-18L);
    assert_true(apart(v.up, 0, 0, -1) < 1e-18L);
    /* and comes up to it without a flip */
    assert_int_equal(
        lookat_point(&y_up, &s, point(0, 3, 0), point(0, 0, -1), 0, &v),
        MOTION_OK);
    assert_true(apart(v.right, 1, 0, 0) < 1e-18L);
    assert_true(v.up.q62[1] > 0);
}

/* --- targets ------------------------------------------------------------- */

/* A straight path along x, 8 long; context: where it starts. */
static int line_at(const void *context, int64_t distance_q32,
                   struct motion_vec *pos, struct motion_dir *tangent)
{
    const int64_t *const from = context;
    const int64_t p[3] = { from[0] + distance_q32, from[1], from[2] };

    *pos = motion_vec_from_q32(p);
    if (tangent != NULL)
        *tangent = (struct motion_dir){ { ONE, 0, 0 } };
    return distance_q32 < 0 || distance_q32 > 8 * Q32 ? MOTION_E_ARG
                                                      : MOTION_OK;
}

static const int64_t origin[3] = { 0, 0, 0 }, beside[3] = { 0, 5 * Q32, 0 };
static const struct motion_lookat_path line = { line_at, origin, 8 * Q32 };
static const struct motion_lookat_path half_line = { line_at, beside, 4 * Q32 };

static long double target_x(const struct motion_target *target,
                            long double distance)
{
    struct motion_vec coi;

    assert_int_equal(
        motion_target_at(target, &line, llrintl(ldexpl(distance, 32)), &coi),
        MOTION_OK);
    return real_value(coi.x[0]);
}

static void looking_ahead_has_the_end_one_picks(void **state)
{
    struct motion_target ahead = { .kind = MOTION_TARGET_AHEAD,
                                   .ahead_q32 = 3 * Q32 };
    struct motion_lookat_state s = { .valid = false };
    struct motion_view v;
    (void)state;
    ahead.end = MOTION_AHEAD_STRAIGHT;
    assert_true(target_x(&ahead, 1) == 4);
    assert_true(target_x(&ahead, 5) == 8);
    assert_true(target_x(&ahead, 7) == 10);
    ahead.end = MOTION_AHEAD_HOLD;
    assert_true(target_x(&ahead, 1) == 4);
    assert_true(target_x(&ahead, 7) == 8);
    ahead.end = MOTION_AHEAD_CLOSED;
    assert_true(target_x(&ahead, 7) == 2);
    /* held, the end itself is looked at along the path */
    ahead.end = MOTION_AHEAD_HOLD;
    assert_int_equal(motion_lookat_at(&y_up, &s, &ahead, &line, 8 * Q32, 0, &v),
                     MOTION_OK);
    assert_true(apart(v.view, 1, 0, 0) < 1e-18L);
}

static void a_path_of_targets_is_followed_by_fraction(void **state)
{
    const struct motion_target other = { .kind = MOTION_TARGET_PATH,
                                         .path = &half_line };
    struct motion_vec coi;
    (void)state;
    assert_true(target_x(&other, 6) == 3);
    assert_int_equal(motion_target_at(&other, &line, 0, &coi), MOTION_OK);
    assert_true(real_value(coi.x[1]) == 5);
}

static void rests_are_rests_and_between_them_it_eases(void **state)
{
    static const struct motion_dwell dwell[] = {
        { { 10 * Q32, 0, 0 }, 1 * Q32, 2 * Q32 },
        { { 20 * Q32, 0, 0 }, 4 * Q32, 4 * Q32 },
        { { 0, 0, 0 }, 5 * Q32, 6 * Q32 },
    };
    static const struct {
        long double at, cubic, quintic;
    } rows[] = {
        { 0, 10, 10 },    { 1, 10, 10 },
        { 2, 10, 10 },    { 2.5L, 11.5625L, 11.03515625L },
        { 3, 15, 15 },    { 4, 20, 20 },
        { 4.5L, 10, 10 }, { 5, 0, 0 },
        { 5.5L, 0, 0 },   { 8, 0, 0 },
    };
    struct motion_target target = { .kind = MOTION_TARGET_DWELL,
                                    .dwell = dwell,
                                    .dwells = ARRAY_LEN(dwell) };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        target.ease = MOTION_DWELL_CUBIC;
        assert_true(fabsl(target_x(&target, rows[i].at) - rows[i].cubic) <
                    1e-15L);
        target.ease = MOTION_DWELL_QUINTIC;
        assert_true(fabsl(target_x(&target, rows[i].at) - rows[i].quintic) <
                    1e-15L);
    }
}

static void targets_that_make_no_sense_are_refused(void **state)
{
    static const struct motion_dwell overlap[] = {
        { { 0, 0, 0 }, 0, 2 * Q32 }, { { 0, 0, 0 }, 2 * Q32, 3 * Q32 }
    };
    static const struct motion_dwell back[] = { { { 0, 0, 0 }, Q32, 0 } };
    const struct {
        struct motion_target target;
        int64_t at_q32;
        int want;
    } rows[] = {
        { { .kind = MOTION_TARGET_FIXED }, -1, MOTION_E_ARG },
        { { .kind = MOTION_TARGET_FIXED }, 8 * Q32 + 1, MOTION_E_ARG },
        { { .kind = (enum motion_target_kind)9 }, 0, MOTION_E_ARG },
        { { .kind = MOTION_TARGET_AHEAD }, 0, MOTION_E_ARG },
        { { .kind = MOTION_TARGET_AHEAD,
            .ahead_q32 = 20 * Q32,
            .end = (enum motion_ahead_end)7 },
          0,
          MOTION_E_ARG },
        { { .kind = MOTION_TARGET_PATH }, 0, MOTION_E_ARG },
        { { .kind = MOTION_TARGET_DWELL }, 0, MOTION_E_EMPTY },
        { { .kind = MOTION_TARGET_DWELL, .dwell = overlap, .dwells = 2 },
          0,
          MOTION_E_ORDER },
        { { .kind = MOTION_TARGET_DWELL, .dwell = back, .dwells = 1 },
          0,
          MOTION_E_ORDER },
    };
    struct motion_vec coi;
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        if (motion_target_at(&rows[i].target, &line, rows[i].at_q32, &coi) !=
            rows[i].want)
            fail_msg("row %zu", i);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(looking_forward_is_the_identity),
        cmocka_unit_test(frames_are_level_right_handed_and_of_length_one),
        cmocka_unit_test(tilt_is_clockwise),
        cmocka_unit_test(in_the_target_there_is_no_view),
        cmocka_unit_test(straight_over_the_target_the_picture_does_not_flip),
        cmocka_unit_test(beside_the_vertical_the_horizon_stays_level),
        cmocka_unit_test(turning_round_on_the_level_is_no_way_over_the_top),
        cmocka_unit_test(over_and_back_is_upright_again),
        cmocka_unit_test(a_camera_that_starts_straight_down_faces_ahead),
        cmocka_unit_test(looking_ahead_has_the_end_one_picks),
        cmocka_unit_test(a_path_of_targets_is_followed_by_fraction),
        cmocka_unit_test(rests_are_rests_and_between_them_it_eases),
        cmocka_unit_test(targets_that_make_no_sense_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
