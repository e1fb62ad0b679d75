/* tests/firmware/host/track/test_compiled.c - compiled moves run on the
 * simulated machine: every set point as from memory, a file that goes bad stops
 * the group along the path. */
#define _XOPEN_SOURCE 700 /* mkstemp */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/track/compiled.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "tests/firmware/linux/player/player_bench.h"

#define SEGMENTS 12000
#define STEP     (MOTION_FIXED_S_Q12 / 125) /* 8 ms each: 96 s */
#define SECOND   INT64_C(1000000000)

static struct motion_segment storage[SEGMENTS];
static struct motion_track whole;
static char path[64];

static struct motion_cursor cursor;
static uint32_t compared, most;

/* p = 200 + 300 (1 - cos x)^2: begins and ends at rest, without acceleration
 * and jerk. */
static struct motion_state wave(int64_t t_ns_q12)
{
    const double x = 0.2617993877991494 * (double)t_ns_q12 /
                     (double)MOTION_FIXED_S_Q12; /* 2 pi / 24 s */
    const double w = 0.2617993877991494, c = 1 - cos(x), s = sin(x);
    return (struct motion_state){
        .pos_q32 = llround((200 + 300 * c * c) * 4294967296.0),
        .vel_q32 = llround(600 * w * c * s * 4294967296.0),
        .acc_q32 = llround(600 * w * w * (s * s + c * cos(x)) * 0x1p32),
    };
}

static void plan_wave(void)
{
    motion_track_init(&whole, storage, SEGMENTS, wave(0).pos_q32);
    for (int i = 1; i <= SEGMENTS; i++) {
        struct motion_state to = wave(i * STEP);
        if (i == SEGMENTS)
            to.vel_q32 = to.acc_q32 = 0;
        assert_int_equal(
            motion_track_append_quintic(&whole, STEP, &whole.end, &to),
            MOTION_OK);
    }
}

static void save_wave(void)
{
    struct track_file_axis axis = { .name = "dolly",
                                    .unit = "mm",
                                    .keys = SEGMENTS + 1 };
    struct track_file file = { .axis_count = 1, .axis = &axis };
    FILE *out = fopen(path, "wb");
    assert_non_null(out);
    track_file_write(out, &file, &whole);
    assert_int_equal(fclose(out), 0);
}

static int64_t before_wait(int64_t t_ns)
{
    const struct controller *controller = &bench.machine.controller;
    struct motion_sample want;
    if (bench.player.phase == TELEMETRY_MOVE &&
        controller->state == CONTROLLER_MOVING && controller->rate.s_ns_q12) {
        motion_track_sample(&whole, &cursor, controller->rate.s_ns_q12, &want);
        assert_int_equal(controller->axis[0].target.pos_q32, want.pos_q32);
        compared++;
    }
    if (bench.job.track[0].count > most)
        most = bench.job.track[0].count;
    return t_ns;
}

static int open_wave(void **state)
{
    const char *const files[] = { "examples/dolly/rig.yaml", path };

    (void)state;
    strcpy(path, "/tmp/slew-compiled-XXXXXX");
    const int made = mkstemp(path);
    if (made < 0 || close(made) < 0)
        return -1;
    plan_wave();
    save_wave();
    cursor = (struct motion_cursor){ 0 };
    compared = most = 0;
    bench_open(files, 2, true);
    return 0;
}

static int close_wave(void **state)
{
    (void)state;
    bench_free();
    return unlink(path);
}

static void run(int64_t hold_at_ns)
{
    const struct player_config config = {
        .override_q30 = MOTION_CLOCK_WARP_ONE_Q30,
        .hold_at_ns = hold_at_ns,
        .resume_after_ns = SECOND,
    };
    bench_play(&config, (struct player_observer){ .report = NULL });
}

static void it_is_inside_the_limits(void **state)
{
    (void)state;
    job_check(&bench.job, MOTION_CLOCK_WARP_ONE_Q30);
    assert_int_equal(bench.job.violation_count, 0);
}

static void every_set_point_is_as_from_memory(void **state)
{
    (void)state;
    run(40 * SECOND);
    assert_int_equal(bench.report.end, REPORT_DONE);
    assert_int_equal(bench.report.path_ns_q12, whole.end_ns_q12);
    assert_true(compared > 95000);
    assert_in_range(most, TRACK_STREAM_PLAY / 2, TRACK_STREAM_PLAY);
    assert_null(compiled_error(bench.job.compiled));
}

/* From one byte in the middle on the file is bad. */
static void a_file_that_goes_bad_stops_along_the_path(void **state)
{
    const struct rig_axis *rig = &bench.job.rig.axis[bench.job.rig_axis[0]];
    struct motion_state left;
    FILE *out = fopen(path, "r+b");

    (void)state;
    assert_non_null(out);
    fseek(out, SEGMENTS / TRACK_FILE_BLOCK / 2 * 2576, SEEK_SET);
    fwrite("?????", 1, 5, out);
    fclose(out);
    run(-1);
    assert_int_equal(bench.report.end, REPORT_FAULT);
    assert_int_equal(bench.report.fault.fault, CONTROLLER_FAULT_TRACK);
    assert_non_null(strstr(bench.report.fault_text, "is damaged"));
    assert_int_equal(bench.machine.controller.reaction, CONTROLLER_REACT_STOP);
    assert_in_range(bench.report.path_ns_q12, 35 * MOTION_FIXED_S_Q12,
                    49 * MOTION_FIXED_S_Q12);
    motion_track_state(&whole, bench.report.path_ns_q12, &left);
    /* torque goes off as soon as the set point stands; the motor is behind */
    const double behind =
        ldexp((double)(bench.report.axis[0].end_q32 - left.pos_q32), -32);
    print_message("%.4f mm beside the path\n", behind);
    assert_true(fabs(behind) < 0.1);
    assert_true(bench.report.axis[0].peak[2] <= rig->stop_acc_q32);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(it_is_inside_the_limits, open_wave,
                                        close_wave),
        cmocka_unit_test_setup_teardown(every_set_point_is_as_from_memory,
                                        open_wave, close_wave),
        cmocka_unit_test_setup_teardown(
            a_file_that_goes_bad_stops_along_the_path, open_wave, close_wave),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
