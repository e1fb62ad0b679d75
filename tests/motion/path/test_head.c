/* tests/motion/path/test_head.c - rotations as pan, tilt and roll, unwrapped,
 * and baked into tracks whose bound is checked at random times. */
#include <inttypes.h>
#include <math.h>

#include "motion/core/err.h"
#include "motion/number/trig.h"
#include "motion/path/head.h"
#include "motion/path/rotspline.h"
#include "tests/motion/path/rotspline_at.h"
#include "tests/support/check.h"

#define SEED   UINT64_C(20250315)
#define ONE    ((int64_t)1 << 62)
#define Q32    MOTION_FIXED_ONE_Q32
#define S_Q12  MOTION_FIXED_S_Q12
#define DEG(a) ((int64_t)((a)*4294967296.0))

static int64_t turn(double deg)
{
    return motion_trig_from_deg_q32(DEG(deg));
}

static struct motion_quat rotation(double pan, double tilt, double roll)
{
    const int64_t angle[MOTION_HEAD_AXES] = { turn(pan), turn(tilt),
                                              turn(roll) };
    return motion_head_quat(angle);
}

static double degrees(const struct motion_head *head,
                      enum motion_head_axis axis)
{
    return (double)motion_head_deg_q32(head, axis) / 4294967296.0;
}

static void assert_angles(const struct motion_head *head, double pan,
                          double tilt, double roll)
{
    const double want[] = { pan, tilt, roll };
    for (int i = 0; i < MOTION_HEAD_AXES; i++) {
        const double got = degrees(head, (enum motion_head_axis)i);
        if (fabs(got - want[i]) > 1e-9)
            fail_msg("axis %d: %.12f, not %.12f (pan %g tilt %g roll %g)", i,
                     got, want[i], pan, tilt, roll);
    }
}

/* --- angles -------------------------------------------------------------- */

static void each_axis_turns_the_right_way(void **state)
{
    static const struct {
        double pan, tilt, roll;
        int axis; /* of the camera, and where it points in the mount */
        int64_t to[3];
    } rows[] = {
        { 90, 0, 0, 2, { ONE, 0, 0 } },   /* left: view -x, back +x */
        { 0, 90, 0, 2, { 0, -ONE, 0 } },  /* up: back points down */
        { 0, 0, 90, 0, { 0, -ONE, 0 } },  /* clockwise: right points down */
        { 90, 0, 90, 0, { 0, -ONE, 0 } }, /* roll comes last */
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct motion_dir e = { { 0, 0, 0 } };
        e.q62[rows[i].axis] = ONE;
        const struct motion_dir got = motion_quat_turn(
            rotation(rows[i].pan, rows[i].tilt, rows[i].roll), e);
        for (int k = 0; k < 3; k++)
            assert_true(motion_fixed_abs(got.q62[k] - rows[i].to[k]) < 64);
    }
}

static void angles_of_a_rotation_are_those_it_was_made_of(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    for (int i = 0; i < 2000; i++) {
        const double pan =
            (double)check_random_in(&seed, -179999, 179999) / 1e3;
        const double tilt = (double)check_random_in(&seed, -89999, 89999) / 1e3;
        const double roll =
            (double)check_random_in(&seed, -179999, 179999) / 1e3;
        struct motion_head head = { .valid = false };

        assert_int_equal(motion_head_follow(&head, rotation(pan, tilt, roll)),
                         MOTION_OK);
        assert_angles(&head, pan, tilt, roll);
    }
}

static void pan_and_roll_run_on_over_half_turns(void **state)
{
    struct motion_head head = { .valid = false };
    (void)state;
    for (int i = 0; i <= 100; i++) {
        assert_int_equal(
            motion_head_follow(&head, rotation(25 * i, 10, -35 * i)),
            MOTION_OK);
        assert_angles(&head, 25 * i, 10, -35 * i);
    }
    for (int i = 100; i >= -100; i--)
        assert_int_equal(
            motion_head_follow(&head, rotation(25 * i, 10, -35 * i)),
            MOTION_OK);
    assert_angles(&head, -2500, 10, 3500);
}

static void a_tilt_goes_on_over_the_top(void **state)
{
    static const double step[] = { 1, 7, 30 }; /* 30 meets the pole itself */
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(step); k++) {
        struct motion_head head = { .valid = false };
        for (int i = 0; step[k] * i <= 720; i++) {
            assert_int_equal(
                motion_head_follow(&head, rotation(20, step[k] * i, 5)),
                MOTION_OK);
            assert_angles(&head, 20, step[k] * i, 5);
        }
    }
}

static void straight_up_pan_stands_and_roll_turns(void **state)
{
    struct motion_head head = { .valid = false };
    (void)state;
    assert_int_equal(motion_head_follow(&head, rotation(30, 89, 0)), MOTION_OK);
    for (int i = 0; i <= 30; i++) {
        assert_int_equal(
            motion_head_follow(&head, rotation(30 + 20 * i, 90, 0)), MOTION_OK);
        assert_angles(&head, 30, 90, 20 * i);
    }
}

static void an_angle_that_is_set_is_read_again(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    for (int i = 0; i < 2000; i++) {
        struct motion_head head = { .valid = false };
        const int64_t deg_q32 =
            i < 5 ? (i - 2) * 180 * Q32
                  : check_random_in(&seed, -1000000 * Q32, 1000000 * Q32);
        motion_head_set_deg_q32(&head, MOTION_HEAD_TILT, deg_q32);
        assert_true(head.valid);
        if (motion_fixed_abs(motion_head_deg_q32(&head, MOTION_HEAD_TILT) -
                             deg_q32) > 1)
            fail_msg("%g deg", (double)deg_q32 / Q32);
    }
}

static void too_many_turns_are_refused(void **state)
{
    struct motion_head head = { .valid = true };
    struct motion_head was;
    (void)state;
    head.turn[MOTION_HEAD_PAN] = INT64_MAX;
    head.whole[MOTION_HEAD_PAN] = 1 << 22;
    was = head;
    assert_int_equal(motion_head_follow(&head, rotation(-179, 0, 0)),
                     MOTION_E_RANGE);
    assert_memory_equal(&head, &was, sizeof head);
}

/* --- tracks -------------------------------------------------------------- */

#define SEGMENTS 2000

struct rig {
    struct motion_segment segment[MOTION_HEAD_AXES][SEGMENTS];
    struct motion_track track[MOTION_HEAD_AXES];
    struct motion_track *list[MOTION_HEAD_AXES];
    struct motion_head head;
};

/* Tracks that begin where the turning does. */
static void rig_init(struct rig *rig, const struct motion_turning *turning,
                     int64_t from, uint32_t capacity)
{
    struct motion_head start = { .valid = false };
    struct motion_quat q;

    assert_int_equal(turning->at(turning->context, from, &q), MOTION_OK);
    assert_int_equal(motion_head_follow(&start, q), MOTION_OK);
    rig->head = (struct motion_head){ .valid = false };
    for (int i = 0; i < MOTION_HEAD_AXES; i++) {
        rig->list[i] = &rig->track[i];
        motion_track_init(
            &rig->track[i], rig->segment[i], capacity,
            motion_head_deg_q32(&start, (enum motion_head_axis)i));
    }
}

/* The largest distance of each track from the turning at random times. */
static void rig_error(const struct rig *rig, const struct motion_turning *what,
                      int64_t from, int64_t to, uint64_t worst[])
{
    uint64_t seed = SEED;

    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        worst[i] = 0;
    for (int k = 0; k < 5000; k++) {
        const int64_t t = check_random_in(&seed, from, to);
        struct motion_head near = { .valid = true };
        struct motion_state at[MOTION_HEAD_AXES];
        struct motion_quat q;

        assert_int_equal(what->at(what->context, t, &q), MOTION_OK);
        for (int i = 0; i < MOTION_HEAD_AXES; i++) {
            motion_track_state(&rig->track[i], t - from, &at[i]);
            near.turn[i] = motion_trig_from_deg_q32(at[i].pos_q32);
        }
        const struct motion_head was = near;
        assert_int_equal(motion_head_follow(&near, q), MOTION_OK);
        for (int i = 0; i < MOTION_HEAD_AXES; i++) {
            const uint64_t off = motion_fixed_abs(motion_trig_deg_q32(
                motion_trig_diff(near.turn[i], was.turn[i])));
            if (off > worst[i])
                worst[i] = off;
        }
    }
}

static int spline_at(void *context, int64_t t, struct motion_quat *q)
{
    struct motion_vec rate, acc;

    rotspline_at(context, t, q, &rate, &acc);
    return MOTION_OK;
}

#define SPLINE_KEYS 6

static void any_spline(struct motion_rotspline *spline,
                       struct motion_rotkey *key)
{
    static const double angle[SPLINE_KEYS][3] = {
        { 0, 0, 0 },     { 40, 20, 5 },   { 100, -30, 0 },
        { 190, 10, 30 }, { 250, 50, 10 }, { 200, 0, 0 },
    };
    for (int i = 0; i < SPLINE_KEYS; i++)
        key[i] = (struct motion_rotkey){
            .t_ns_q12 = S_Q12 * i + (i & 1) * S_Q12 / 3,
            .q = rotation(angle[i][0], angle[i][1], angle[i][2]),
        };
    assert_int_equal(motion_rotspline_plan(spline, key, SPLINE_KEYS,
                                           MOTION_ROTSPLINE_REST,
                                           MOTION_ROTSPLINE_REST, 0),
                     MOTION_OK);
}

static void baked_tracks_hold_their_bound_and_do_not_step(void **state)
{
    static const int64_t tolerance[] = { Q32 / 100, Q32 / 10000 };
    static struct rig rig;
    struct motion_rotkey key[SPLINE_KEYS];
    struct motion_rotspline spline;
    struct motion_turning turning = { spline_at, &spline };
    int64_t border[SPLINE_KEYS];
    uint32_t count[2];
    (void)state;
    any_spline(&spline, key);
    for (int i = 0; i < SPLINE_KEYS; i++)
        border[i] = key[i].t_ns_q12;
    for (int k = 0; k < 2; k++) {
        const struct motion_head_bake bake = {
            .border_ns_q12 = border,
            .borders = SPLINE_KEYS,
            .tolerance_q32 = tolerance[k],
        };
        int64_t bound[MOTION_HEAD_AXES];
        uint64_t worst[MOTION_HEAD_AXES];

        rig_init(&rig, &turning, 0, SEGMENTS);
        assert_int_equal(
            motion_head_bake(&bake, &turning, &rig.head, rig.list, bound),
            MOTION_OK);
        rig_error(&rig, &turning, 0, border[SPLINE_KEYS - 1], worst);
        for (int i = 0; i < MOTION_HEAD_AXES; i++) {
            struct motion_continuity step;
            assert_true(bound[i] <= tolerance[k]);
            if (worst[i] > (uint64_t)bound[i] ||
                (uint64_t)bound[i] > 10 * worst[i] + 100)
                fail_msg("axis %d: seen %" PRIu64 ", bound %" PRId64, i,
                         worst[i], bound[i]);
            assert_int_equal(rig.track[i].end_ns_q12, border[SPLINE_KEYS - 1]);
            motion_track_continuity(&rig.track[i], &step);
            assert_int_equal(step.pos_step_q32, 0);
            /* rest to rest, and smooth: derivatives agree to 1e-6 deg/s, and
             * 1e-3 deg/s2 but for the steps from rest */
            assert_true(step.vel_step_q32 < (uint64_t)Q32 / 1000000);
        }
        count[k] = rig.track[0].count;
    }
    /* 100 times finer: 100^(1/6) = 2.2 times as many */
    assert_true(count[1] > count[0] && count[1] < 8 * count[0]);
}

/* Of 2^-64 turn per 2^-12 ns: 0.4 turn/s. */
#define OVER_SPEED 1800000

/* A head that tilts over the top at constant speed, past the pole exactly. */
static int over_the_top_at(void *context, int64_t t, struct motion_quat *q)
{
    const int64_t angle[MOTION_HEAD_AXES] = { turn(10), t * OVER_SPEED, 0 };
    (void)context;
    *q = motion_head_quat(angle);
    return MOTION_OK;
}

static void a_turning_over_the_top_is_one_line_on_its_axis(void **state)
{
    static struct rig rig;
    const struct motion_turning turning = { over_the_top_at, NULL };
    const int64_t border[2] = { 0, S_Q12 };
    const struct motion_head_bake bake = { .border_ns_q12 = border,
                                           .borders = 2,
                                           .tolerance_q32 = Q32 / 1000000 };
    int64_t bound[MOTION_HEAD_AXES];
    (void)state;
    rig_init(&rig, &turning, 0, SEGMENTS);
    assert_int_equal(
        motion_head_bake(&bake, &turning, &rig.head, rig.list, bound),
        MOTION_OK);
    assert_int_equal(rig.track[MOTION_HEAD_TILT].count, 1);
    assert_true(rig.track[MOTION_HEAD_TILT].end.pos_q32 > 140 * Q32);
    assert_int_equal(rig.track[MOTION_HEAD_PAN].end.pos_q32, 10 * Q32);
}

static int jump_at(void *context, int64_t t, struct motion_quat *q)
{
    (void)context;
    *q = rotation(t < S_Q12 / 3 ? 0 : 30, 0, 0);
    return MOTION_OK;
}

static int broken_at(void *context, int64_t t, struct motion_quat *q)
{
    *q = MOTION_QUAT_ONE;
    (void)context;
    return t > S_Q12 / 2 ? MOTION_E_STATE : MOTION_OK;
}

static void what_cannot_be_baked_leaves_the_tracks(void **state)
{
    static const int64_t border[2] = { 0, S_Q12 }, back[2] = { S_Q12, S_Q12 };
    static const int64_t close[2] = { 0, 100 };
    static const struct {
        const char *name;
        int (*at)(void *context, int64_t t, struct motion_quat *q);
        struct motion_head_bake bake;
        uint32_t capacity;
        int want;
    } rows[] = {
        { "a jump",
          jump_at,
          { border, 2, Q32 / 100, 0, 0, 0, false },
          SEGMENTS,
          MOTION_E_TOLERANCE },
        { "its own error",
          broken_at,
          { border, 2, Q32 / 100, 0, 0, 0, false },
          SEGMENTS,
          MOTION_E_STATE },
        { "no room",
          over_the_top_at,
          { border, 2, Q32 / 100, 0, 0, 0, false },
          0,
          MOTION_E_FULL },
        { "one border",
          over_the_top_at,
          { border, 1, Q32 / 100, 0, 0, 0, false },
          SEGMENTS,
          MOTION_E_ARG },
        { "no tolerance",
          over_the_top_at,
          { border, 2, 0, 0, 0, 0, false },
          SEGMENTS,
          MOTION_E_ARG },
        { "negative segments",
          over_the_top_at,
          { border, 2, 1, -1, 0, 0, false },
          SEGMENTS,
          MOTION_E_ARG },
        { "borders in place",
          over_the_top_at,
          { back, 2, 1, 0, 0, 0, false },
          SEGMENTS,
          MOTION_E_ORDER },
        { "borders too close",
          over_the_top_at,
          { close, 2, 1, 0, 0, 0, false },
          SEGMENTS,
          MOTION_E_RANGE },
    };
    static struct rig rig;
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct motion_turning turning = { rows[i].at, NULL };
        int64_t bound[MOTION_HEAD_AXES] = { 7, 7, 7 };

        rig_init(&rig, &turning, 0, rows[i].capacity);
        const int err = motion_head_bake(&rows[i].bake, &turning, &rig.head,
                                         rig.list, bound);
        if (err != rows[i].want)
            fail_msg("%s: %d", rows[i].name, err);
        assert_int_equal(bound[0], 7);
        assert_false(rig.head.valid);
        for (int k = 0; k < MOTION_HEAD_AXES; k++)
            assert_int_equal(rig.track[k].count, 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_axis_turns_the_right_way),
        cmocka_unit_test(angles_of_a_rotation_are_those_it_was_made_of),
        cmocka_unit_test(pan_and_roll_run_on_over_half_turns),
        cmocka_unit_test(a_tilt_goes_on_over_the_top),
        cmocka_unit_test(straight_up_pan_stands_and_roll_turns),
        cmocka_unit_test(an_angle_that_is_set_is_read_again),
        cmocka_unit_test(too_many_turns_are_refused),
        cmocka_unit_test(baked_tracks_hold_their_bound_and_do_not_step),
        cmocka_unit_test(a_turning_over_the_top_is_one_line_on_its_axis),
        cmocka_unit_test(what_cannot_be_baked_leaves_the_tracks),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
