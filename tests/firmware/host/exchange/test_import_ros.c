/* tests/firmware/host/exchange/test_import_ros.c - JointTrajectory of ROS: what
 * people write, what is wrong with it, and a move there and back. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "firmware/linux/base/disk.h"
#include "firmware/linux/commands/planning.h"
#include "motion/core/fixed.h"
#include "tests/firmware/host/exchange/import_bench.h"

#define PI   3.14159265358979323846
#define HEAD "joint_names: [tilt, dolly]\npoints:\n"
#define POINT(p, more, s, ns)                                                  \
    "- positions: " p "\n" more "  time_from_start: {sec: " #s                 \
    ", nanosec: " #ns "}\n"

static struct imported got;

static int read_text(const char *text, const char *columns)
{
    const char *path = import_bench_write(text, strlen(text));
    struct import_settings settings = import_bench_settings(0);
    int err;
    import_bench_message[0] = '\0';
    if (columns != NULL)
        assert_int_equal(
            import_settings_columns(&settings, columns, import_bench_message),
            0);
    err = import_ros(&disk_files, path, &settings, &got, import_bench_message);
    unlink(path);
    return err;
}

static void expect_keys(unsigned axis, const char *name, enum plan_curve curve,
                        uint32_t count)
{
    assert_string_equal(got.move.axis[axis].name, name);
    assert_int_equal(got.move.axis[axis].curve, curve);
    assert_int_equal(got.move.axis[axis].key_count, count);
}

static void radians_and_metres_are_the_axes_units(void **state)
{
    const struct motion_key *key;
    (void)state;
    assert_int_equal(
        read_text(HEAD POINT("[0.5, 1.25]",
                             "  velocities: [-0.25, 0.1]\n"
                             "  accelerations: [1e-1, -2]\n  effort: []\n",
                             0, 0) POINT("[-0.5, 2.0]",
                                         "  velocities: [0, 0]\n"
                                         "  accelerations: [0, 0]\n",
                                         12, 345678901),
                  NULL),
        0);
    expect_keys(0, "tilt", PLAN_CURVE_QUINTIC, 2);
    expect_keys(1, "dolly", PLAN_CURVE_QUINTIC, 2);
    key = &got.move.axis[0].key[0].key;
    assert_int_equal(key->pos_q32, q32(0.5 * 180 / PI));
    assert_int_equal(vel_q32(key), q32(-0.25 * 180 / PI));
    assert_int_equal(acc_q32(key), q32(0.1 * 180 / PI));
    key = &got.move.axis[1].key[0].key;
    assert_int_equal(key->pos_q32, q32(1250));
    assert_int_equal(vel_q32(key), q32(100));
    assert_int_equal(acc_q32(key), q32(-2000));
    assert_int_equal(got.move.axis[1].key[1].key.t_ns_q12,
                     INT64_C(12345678901) * MOTION_FIXED_NS_Q12);
    move_free(&got.move);
}

static void ros_1_and_json_and_goals_are_read(void **state)
{
    static const char *const text[] = {
        "joint_names:\n- dolly\npoints:\n- positions: [1]\n"
        "  velocities: [0]\n  time_from_start: {secs: 0, nsecs: 0}\n"
        "- positions: [1.5]\n  velocities: [0]\n"
        "  time_from_start: {secs: 2, nsecs: 500000000}\n",
        "{\"header\": {\"frame_id\": \"\"}, \"joint_names\": [\"dolly\"],\n"
        " \"points\": [{\"positions\": [1.0], \"velocities\": [0.0],\n"
        "  \"accelerations\": [], \"time_from_start\": {\"sec\": 0}},\n"
        "  {\"positions\": [1.5], \"velocities\": [0.0],\n"
        "  \"time_from_start\": {\"sec\": 2, \"nanosec\": 500000000}}]}",
        "trajectory:\n  joint_names: [dolly]\n  points:\n"
        "  - {positions: [1], velocities: [0], time_from_start: {sec: 0}}\n"
        "  - {positions: [1.5], velocities: [0],\n"
        "     time_from_start: {sec: 2, nanosec: 500000000}}\n",
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(text); i++) {
        if (read_text(text[i], NULL) < 0)
            fail_msg("%s", import_bench_message);
        expect_keys(0, "dolly", PLAN_CURVE_HERMITE, 2);
        assert_int_equal(got.move.axis[0].key[1].key.pos_q32, q32(1500));
        assert_int_equal(got.move.axis[0].key[1].key.t_ns_q12,
                         INT64_C(2500000000) * MOTION_FIXED_NS_Q12);
        move_free(&got.move);
    }
}

static void columns_name_the_joints(void **state)
{
    (void)state;
    assert_int_equal(read_text("joint_names: [j1, j2, j3]\npoints:\n" POINT(
                                   "[0, 1, 2]", "", 0, 0)
                                   POINT("[0, 1.5, 2]", "", 3, 0),
                               "pan,dolly,-"),
                     0);
    assert_int_equal(got.move.axis_count, 2);
    expect_keys(0, "pan", PLAN_CURVE_QUINTIC, 2);
    expect_keys(1, "dolly", PLAN_CURVE_QUINTIC, 2);
    assert_false(got.move.axis[1].key[0].key.has_vel);
    move_free(&got.move);
}

static void what_is_wrong_is_said_where_it_is(void **state)
{
    static const struct {
        const char *text, *says;
    } rows[] = {
        { "[]\n", ":1:1: the message is a list, expected a map" },
        { "points: []\n", ":1:1: the message has no joint_names" },
        { "joint_names: [dolly]\n", ":1:1: the message has no points" },
        { "joint_names: [dolly]\npoints: []\n", ":2:9: points" },
        { "joint_names: [crane]\npoints: []\n",
          ":1:15: 'crane' is not an axis of the rig" },
        { "joint_names: [dolly, dolly]\npoints: []\n",
          ":1:22: axis dolly appears twice" },
        { HEAD POINT("[1]", "", 0, 0), ":3:14: positions has 1 number for 2" },
        { HEAD POINT("[1, x]", "", 0, 0), ":3:18: positions 'x m' is not a" },
        { HEAD POINT("[1, .nan]", "", 0, 0), "is not a number" },
        { HEAD "- velocities: [1, 2]\n", "the point has no positions" },
        { HEAD "- positions: [1, 2]\n", "the point has no time_from_start" },
        { HEAD POINT("[1, 2]", "", 1, 0) POINT("[1, 2]", "", 1, 0),
          "time_from_start does not increase" },
        { HEAD POINT("[1, 2]", "", 1, 1000000000), "nanosec" },
        { HEAD POINT("[1, 2]", "", -1, 0), "sec" },
        { HEAD POINT("[1, 2]", "", 2147483647, 0), "is beyond 26 days" },
        { HEAD POINT("[1, 2]", "  velocities: [0, 0]\n", 0, 0)
              POINT("[1, 2]", "", 1, 0),
          "the point has other lists than the first" },
        { HEAD POINT("[1, 2]", "  accelerations: [0, 0]\n", 0, 0),
          "has accelerations and no velocities" },
        { HEAD "- 5\n", "the point" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        if (read_text(rows[i].text, NULL) == 0)
            fail_msg("row %zu was read", i);
        if (strstr(import_bench_message, rows[i].says) == NULL)
            fail_msg("row %zu: %s", i, import_bench_message);
        assert_null(strchr(import_bench_message, '\n'));
        assert_null(got.move.axis);
    }
    assert_int_equal(read_text(HEAD POINT("[1, 2]", "", 0, 0), "dolly"), -1);
    assert_non_null(strstr(import_bench_message,
                           "and --columns 1, expected a name for each"));
}

/* Every segment of any degree is a quintic between points: the same move.  But
 * for rounding, and for thirds of an s-curve nearer than 1 ms to a point of
 * another axis: 180 deg/s3 (1 ms)^2 / 2 = 9e-5 deg/s, and by that times 1 ms. */
static void there_and_back(const char *format)
{
    static struct job job;
    const char *const paths[] = { "examples/dolly" };
    const struct units_fps none = { 0, 0 };
    struct import_settings settings = import_bench_settings(0);
    const char *path = import_bench_path("there");
    FILE *file = fopen(path, "wb");
    assert_int_equal(planning_open(&job, paths, 1, false), STATUS_OK);
    settings.rig = &job.rig;
    if (import_format_find(format)->write(&job, &none, file,
                                          import_bench_message) < 0)
        fail_msg("%s", import_bench_message);
    fclose(file);
    if (import_ros(&disk_files, path, &settings, &got, import_bench_message) <
        0)
        fail_msg("%s", import_bench_message);
    unlink(path);
    assert_int_equal(got.move.axis_count, job.move.axis_count);
    for (unsigned i = 0; i < job.move.axis_count; i++) {
        struct motion_cursor a = { 0 }, b = { 0 };
        struct motion_track track;
        struct plan_error error;
        assert_int_equal(plan_axis_track(&got.move.axis[i], &track, &error), 0);
        assert_int_equal(track.end_ns_q12, job.end_ns_q12);
        for (int k = 0; k <= 1000; k++) {
            const int64_t t = job.end_ns_q12 / 1000 * k;
            struct motion_sample x, y;
            motion_track_sample(&job.track[i], &a, t, &x);
            motion_track_sample(&track, &b, t, &y);
            /* 16 steps of 2.3e-10, and velocities of half a step times 24 s */
            if (llabs(x.pos_q32 - y.pos_q32) > q32(1e-7) ||
                llabs(x.vel_q32 - y.vel_q32) > q32(9e-5))
                fail_msg("%s at %d: off by %lld, %lld", got.move.axis[i].name,
                         k, (long long)(x.pos_q32 - y.pos_q32),
                         (long long)(x.vel_q32 - y.vel_q32));
        }
        plan_track_free(&track);
    }
    move_free(&got.move);
    job_free(&job);
}

static void a_move_comes_back_as_the_same_curves(void **state)
{
    (void)state;
    there_and_back("ros-yaml");
    there_and_back("ros-json");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(radians_and_metres_are_the_axes_units),
        cmocka_unit_test(ros_1_and_json_and_goals_are_read),
        cmocka_unit_test(columns_name_the_joints),
        cmocka_unit_test(what_is_wrong_is_said_where_it_is),
        cmocka_unit_test(a_move_comes_back_as_the_same_curves),
    };
    return cmocka_run_group_tests(tests, import_bench_open, import_bench_close);
}
