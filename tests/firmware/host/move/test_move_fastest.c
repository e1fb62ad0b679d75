/* tests/firmware/host/move/test_move_fastest.c - paths with speed: fastest, from
 * the file to the tracks.  SEED=n for other random points.  Takes long. */
#include "motion/otg/otg.h"
#include "motion/plan/path/plan_joints.h"
#include "motion/plan/path/plan_timing.h"
#include "tests/firmware/host/move/move_file.h"

#define RIG "examples/flyby/rig.yaml"

#define POINTS                                                                 \
    "  points:\n"                                                              \
    "    - [200 mm, -900 mm, 300 mm]\n"                                        \
    "    - [900 mm, -1100 mm, 500 mm]\n"                                       \
    "    - [1900 mm, -600 mm, 900 mm]\n"                                       \
    "    - [2700 mm, 300 mm, 1200 mm]\n"                                       \
    "    - [3500 mm, 1000 mm, 1500 mm]\n"

static double seconds(int64_t t_ns_q12)
{
    return (double)t_ns_q12 / (double)MOVE_FILE_S;
}

static double duration(const struct move_file *file)
{
    return seconds(file->track[0].end_ns_q12);
}

/* The same without limits of jerk. */
static void without_jerk(struct move_file *file)
{
    struct plan_error error;

    for (uint32_t i = 0; i < file->move.axis_count; i++)
        plan_track_free(&file->track[i]);
    plan_outcome_free(&file->outcome);
    for (int i = 0; i < 3; i++)
        file->move.path->fastest->limit[i].jerk_q32 = 0;
    if (plan_compose(&file->move, file->track, &file->outcome, NULL, &error) <
        0)
        fail_msg("%s", error.text);
}

/* As slew check judges it; and the time is that of the law which was found, but
 * for a part in a thousand that baking may take. */
static void need_inside(const struct move_file *file, const char *what)
{
    const struct plan_path *path = file->move.path;
    struct plan_timing timing;
    struct plan_violation first;
    double failed, law;

    for (uint32_t i = 0; i < path->points.axes; i++) {
        struct plan_limit limit = path->fastest->limit[i];
        limit.pos_min_q32 = INT64_MIN;
        limit.pos_max_q32 = INT64_MAX;
        limit.period_ns = file->rig.period_ns;
        if (plan_check_track(&file->track[path->axis[i]], &limit, &first, 1) >
            0)
            fail_msg("%s: axis %u breaks a limit, kind %d at %g s: %g of %g",
                     what, (unsigned)i, first.kind, seconds(first.t_ns_q12),
                     ldexp((double)first.value, -32),
                     ldexp((double)first.limit, -32));
    }
    if (path->fastest->caps > 0)
        return;
    assert_int_equal(plan_timing_solve(file->outcome.drive.space.list,
                                       path->points.axes, path->fastest->limit,
                                       NULL, 0, NULL, &timing, &failed),
                     MOTION_OK);
    law = plan_timing_duration(&timing);
    plan_timing_free(&timing);
    if (!(duration(file) >= law * (1 - 1e-9) &&
          duration(file) <= law * (1 + 1e-3)))
        fail_msg("%s: %.9g s, the law %.9g s", what, duration(file), law);
}

static void limits_hold_on_the_tracks_of_every_curve(void **state)
{
    static const char *const curve[] = {
        "linear",
        "rounded\n  corner: 100 mm",
        "smoothed\n  corner: 100 mm",
        "catmull-rom",
        "catmull-rom\n  closed: true",
        "akima",
        "c2",
        "c2\n  closed: true",
        "quintic\n  spacing: uniform",
        "b-spline",
    };
    static struct move_file file;
    char text[1024];

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(curve); i++) {
        snprintf(text, sizeof text,
                 "path:\n  axes: [x, y, z]\n  curve: %s\n" POINTS
                 "  speed: fastest\n",
                 curve[i]);
        move_file_need(&file, RIG, text);
        need_inside(&file, curve[i]);
        const double with_jerk = duration(&file);
        without_jerk(&file);
        need_inside(&file, curve[i]);
        if (!(duration(&file) < with_jerk))
            fail_msg("%s: %.9g s without limits of jerk, %.9g with", curve[i],
                     duration(&file), with_jerk);
        move_file_close(&file);
    }
}

static double pick(uint64_t *seed, double low, double high)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * (double)(*seed >> 40) / (1 << 24);
}

static void random_points_in_two_and_three_axes(void **state)
{
    const char *given = getenv("SEED");
    uint64_t seed = given != NULL ? strtoull(given, NULL, 10) : 11;
    static struct move_file file;
    char text[2048];

    (void)state;
    for (int i = 0; i < 6; i++) {
        const int axes = 2 + i % 2, points = 2 + i;
        int at = snprintf(text, sizeof text,
                          "path:\n  axes: [x, y%s]\n  curve: %s\n"
                          "  speed: fastest\n  points:\n",
                          axes == 3 ? ", z" : "", i % 3 ? "c2" : "akima");
        for (int k = 0; k < points; k++)
            at += snprintf(text + at, sizeof text - (size_t)at,
                           axes == 3 ? "    - [%.3f, %.3f, %.3f]\n"
                                     : "    - [%.3f, %.3f]\n",
                           pick(&seed, 0, 3000), pick(&seed, -900, 900),
                           pick(&seed, 0, 1000));
        move_file_need(&file, RIG, text);
        need_inside(&file, text);
        move_file_close(&file);
    }
}

/* The slowest of the axes, each alone, is as fast as the generator makes it. */
static void a_straight_line_takes_the_time_of_the_generator(void **state)
{
    static struct move_file file;
    struct motion_otg_plan plan;

    (void)state;
    move_file_need(&file, RIG,
                   "path:\n  axes: [x, y]\n  points: [[0, 0], [900, 300]]\n"
                   "  speed: fastest\n");
    const struct plan_limit *limit = file.move.path->fastest->limit;
    const struct motion_otg_move move = {
        .goal.pos_q32 = (int64_t)900 << 32,
        .limit = { .vel_max_q32 = limit->vel_q32,
                   .vel_min_q32 = -limit->vel_q32,
                   .acc_max_q32 = limit->acc_q32,
                   .acc_min_q32 = -limit->acc_q32,
                   .jerk_q32 = limit->jerk_q32 },
    };
    assert_int_equal(motion_otg_make(&move, &plan, NULL), MOTION_OK);
    const double want = seconds(plan.dur_ns_q12);
    if (!(fabs(duration(&file) - want) <= 1e-6 * want))
        fail_msg("%.12g s, the generator %.12g", duration(&file), want);
    need_inside(&file, "straight");
    move_file_close(&file);
}

static void caps_hold_and_stops_are_made(void **state)
{
    static struct move_file file;
    int capped = 0;
    double slowest = 1e9;

    (void)state;
    move_file_need(&file, RIG,
                   "path:\n  axes: [x, y, z]\n" POINTS "  speed: fastest\n"
                   "  caps: [{from: 20 %, to: 40 %, speed: 100 mm/s}]\n"
                   "  stops: [2500 mm]\n");
    need_inside(&file, "caps");
    const struct motion_track *distance = &file.outcome.distance;
    const double length = ldexp((double)distance->end.pos_q32, -32);
    for (int i = 0; i < 20000; i++) {
        struct motion_state at;
        motion_track_state(distance, distance->end_ns_q12 / 20000 * i, &at);
        const double pos = ldexp((double)at.pos_q32, -32);
        const double vel = ldexp((double)at.vel_q32, -32);
        if (pos >= 0.2 * length && pos <= 0.4 * length) {
            capped += vel > 99;
            if (!(vel <= 100 * (1 + 1e-6)))
                fail_msg("%.9g mm/s at %.9g mm", vel, pos);
        }
        if (fabs(pos - 2500) < 0.01)
            slowest = fmin(slowest, vel);
    }
    assert_true(capped > 8000);
    assert_true(slowest < 1);
    move_file_close(&file);
}

/* --- keys without times -------------------------------------------------------- */

#define JOINTS 12
#define KEYS   7

/* How far the axes are from key k together, in shares of what they travel, at
 * the time when they are nearest to it. */
static double nearest(const struct plan_move *move,
                      const struct motion_track track[], uint32_t k)
{
    double least = INFINITY;
    const int64_t end = track[0].end_ns_q12;

    for (int i = 0; i <= 20000; i++) {
        double most = 0;
        for (uint32_t a = 0; a < move->axis_count; a++) {
            struct motion_state at;
            motion_track_state(&track[a], end / 20000 * i, &at);
            most = fmax(most,
                        fabs(ldexp((double)at.pos_q32 -
                                       (double)move->axis[a].key[k].key.pos_q32,
                                   -32)));
        }
        least = fmin(least, most);
    }
    return least;
}

/* More axes than are baked together; without the file. */
static void twelve_joints_pass_their_keys_together(void **state)
{
    static struct plan_key key[JOINTS][KEYS];
    static struct plan_axis axis[JOINTS];
    static struct motion_track track[JOINTS];
    static struct plan_outcome outcome;
    struct plan_joints joints = { .axes = JOINTS, .tolerance_q32 = 4295 };
    struct plan_move move = { .axis = axis,
                              .axis_count = JOINTS,
                              .joints = &joints };
    struct plan_error error;
    uint64_t seed = 5;

    (void)state;
    for (uint32_t a = 0; a < JOINTS; a++) {
        axis[a] = (struct plan_axis){ .curve = PLAN_CURVE_C2,
                                      .first = MOTION_SPLINE_NATURAL,
                                      .last = MOTION_SPLINE_NATURAL,
                                      .key = key[a],
                                      .key_count = KEYS,
                                      .driver = PLAN_BY_TIMING };
        joints.axis[a] = a;
        joints.limit[a] = (struct plan_limit){
            .pos_min_q32 = INT64_MIN,
            .pos_max_q32 = INT64_MAX,
            .vel_q32 = (int64_t)(pick(&seed, 20, 90) * 0x1p32),
            .acc_q32 = (int64_t)(pick(&seed, 50, 300) * 0x1p32),
            .jerk_q32 = (int64_t)(pick(&seed, 500, 3000) * 0x1p32),
            .period_ns = 1000000,
        };
        for (uint32_t k = 0; k < KEYS; k++)
            key[a][k].key.pos_q32 = (int64_t)(pick(&seed, -60, 60) * 0x1p32);
    }
    if (plan_compose(&move, track, &outcome, NULL, &error) < 0)
        fail_msg("%s", error.text);
    for (uint32_t a = 0; a < JOINTS; a++) {
        assert_true(track[a].end_ns_q12 == track[0].end_ns_q12);
        assert_true(track[a].end.pos_q32 == key[a][KEYS - 1].key.pos_q32);
        assert_int_equal(plan_check_track(&track[a], &joints.limit[a], NULL, 0),
                         0);
    }
    /* half a step of time at the largest speed */
    const double step = 90 * seconds(track[0].end_ns_q12) / 40000;
    for (uint32_t k = 0; k < KEYS; k++)
        if (!(nearest(&move, track, k) <= step + 1e-6))
            fail_msg("key %u is missed by %g", (unsigned)k,
                     nearest(&move, track, k));
    for (uint32_t a = 0; a < JOINTS; a++)
        plan_track_free(&track[a]);
    plan_outcome_free(&outcome);
}

static void joints_from_a_file(void **state)
{
    static struct move_file file;

    (void)state;
    move_file_need(&file, RIG,
                   "timing: fastest\naxes:\n"
                   "  pan: {keys: [0 deg, 30 deg, 10 deg]}\n"
                   "  x: {curve: linear, keys: [200 mm, 900 mm, 1.1 m]}\n"
                   "  z: {keys: [300 mm, 300 mm, 500 mm]}\n");
    assert_true(file.outcome.is_bent);
    for (uint32_t i = 0; i < 3; i++) {
        struct plan_limit limit = file.move.joints->limit[i];
        limit.period_ns = file.rig.period_ns;
        assert_int_equal(plan_check_track(&file.track[i], &limit, NULL, 0), 0);
    }
    for (uint32_t k = 0; k < 3; k++)
        assert_true(nearest(&file.move, file.track, k) < 0.2);
    move_file_close(&file);
}

static void what_cannot_be_read_is_said_at_its_place(void **state)
{
#define HEAD "path:\n  axes: [x, y, z]\n" POINTS
    static const struct {
        const char *text, *message;
    } rows[] = {
        { HEAD "  speed: slowest\n",
          "9:10: unknown speed 'slowest', expected fastest" },
        { HEAD "  speed: {law: quintic, time: 9 s}\n  stops: [5 %]\n",
          "10:10: stops is not used without speed: fastest" },
        { HEAD "  speed: fastest\n  stops: [5 %, 9 m]\n",
          "10:16: stop at 9000 is not on the path, which is " },
        { HEAD "  speed: fastest\n"
               "  caps: [{from: 30 %, to: 9 m, speed: 1 mm/s}]\n",
          "10:10: cap at 9000 is not on the path, which is " },
        { HEAD "  speed: fastest\n"
               "  caps: [{from: 30 %, to: 10 %, speed: 1 mm/s}]\n",
          "10:10: cap ends at " },
        { HEAD "  speed: fastest\n"
               "  caps: [{from: 1 %, to: 10 %, speed: 0 mm/s}]\n",
          "is not above zero" },
        { HEAD "  speed: fastest\n  caps: [{from: 1 %, to: 10 %}]\n", "speed" },
        { "timing: soon\naxes:\n  x: {keys: [0, 1]}\n",
          "1:9: unknown timing 'soon', expected fastest" },
        { "timing: fastest\naxes:\n  x: {keys: [[0 s, 0], [1 s, 9]]}\n",
          "expected a position, as timing: fastest finds the times" },
        { "timing: fastest\naxes:\n  x: {keys: [0, 9]}\n  y: {keys: [0]}\n",
          "axis y has 1 keys, expected 2 as axis x" },
        { "timing: fastest\naxes:\n  x: {keys: [0, 9, 9]}\n",
          "3:20: key 3 is the same as the one before it in all axes" },
        { "timing: fastest\naxes:\n  x: {curve: rounded, keys: [0, 9]}\n",
          "has curve rounded, which is not for timing: fastest" },
        { "timing: fastest\naxes:\n  x: {keys: [7]}\n",
          "axis x has one key, and timing goes from key to key" },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        move_file_refuse(RIG, rows[i].text, rows[i].message);
}

static double speed_at(const struct move_file *file, double t_s)
{
    double sum = 0;

    for (uint32_t i = 0; i < 3; i++) {
        struct motion_state state;
        motion_track_state(&file->track[i], llround(t_s * (double)MOVE_FILE_S),
                           &state);
        sum += pow(ldexp((double)state.vel_q32, -32), 2);
    }
    return sqrt(sum);
}

/* The rolls take it from rest and to rest; between them it is faster than from
 * rest to rest, with limits of jerk and without. */
static void a_path_starts_and_ends_at_speed(void **state)
{
    static struct move_file file;

    (void)state;
    move_file_need(&file, RIG,
                   "path:\n  axes: [x, y, z]\n" POINTS "  speed: fastest\n");
    const double rest = duration(&file);
    move_file_close(&file);
    move_file_need(&file, RIG,
                   "pre_roll: 1 s\npost_roll: 1 s\n"
                   "path:\n  axes: [x, y, z]\n" POINTS
                   "  speed: fastest\n  start: 300 mm/s\n  end: 200 mm/s\n");
    for (int jerk = 1; jerk >= 0; jerk--) {
        if (jerk == 0)
            without_jerk(&file);
        const double end = duration(&file);
        for (uint32_t i = 0; i < 3; i++) {
            struct plan_limit limit = file.move.path->fastest->limit[i];
            struct plan_violation first;
            limit.period_ns = file.rig.period_ns; /* as slew check has it */
            if (plan_check_track(&file.track[i], &limit, &first, 1) > 0)
                fail_msg("axis %u: %d at %.6f s", (unsigned)i, first.kind,
                         seconds(first.t_ns_q12));
        }
        print_message("%.6f s, %.6f s from rest, %.6f and %.6f mm/s\n", end - 2,
                      rest, speed_at(&file, 1), speed_at(&file, end - 1));
        assert_true(end - 2 < rest);
        assert_true(fabs(speed_at(&file, 1) / 300 - 1) < 1e-3);
        assert_true(fabs(speed_at(&file, end - 1) / 200 - 1) < 1e-3);
        assert_true(speed_at(&file, 0) == 0 && speed_at(&file, end) == 0);
    }
    move_file_close(&file);
    move_file_refuse(RIG,
                     "path:\n  axes: [x, y, z]\n" POINTS
                     "  speed: fastest\n  end: 3 m/s\n",
                     "does not allow the speed at its start or its end");
    move_file_refuse(RIG,
                     "path:\n  axes: [x, y, z]\n" POINTS
                     "  speed: {law: quintic, time: 9}\n  end: 3 m/s\n",
                     "end is not used without speed: fastest");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(limits_hold_on_the_tracks_of_every_curve),
        cmocka_unit_test(random_points_in_two_and_three_axes),
        cmocka_unit_test(a_straight_line_takes_the_time_of_the_generator),
        cmocka_unit_test(caps_hold_and_stops_are_made),
        cmocka_unit_test(a_path_starts_and_ends_at_speed),
        cmocka_unit_test(twelve_joints_pass_their_keys_together),
        cmocka_unit_test(joints_from_a_file),
        cmocka_unit_test(what_cannot_be_read_is_said_at_its_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
