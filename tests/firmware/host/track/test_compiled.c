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
#include "firmware/linux/commands/planning.h"
#include "firmware/linux/machine/machine_sim.h"
#include "firmware/linux/player/player.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "tests/support/check.h"

#define SEGMENTS 12000
#define STEP     (MOTION_FIXED_S_Q12 / 125) /* 8 ms each: 96 s */
#define SECOND   INT64_C(1000000000)

static struct motion_segment storage[SEGMENTS];
static struct motion_track whole;
static char path[64];
static volatile sig_atomic_t interrupts;

static struct bench {
    struct hal_clock clock; /* passes on to the world's */
    struct job job;
    struct machine_sim sim;
    struct machine machine;
    struct player player;
    struct report report;
    struct motion_cursor cursor;
    uint32_t compared, most;
} bench;

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
    struct track_file file = {
        .axis_count = 1,
        .axis = { { .name = "dolly", .unit = "mm", .keys = SEGMENTS + 1 } }
    };
    FILE *out = fopen(path, "wb");
    assert_non_null(out);
    track_file_write(out, &file, &whole);
    assert_int_equal(fclose(out), 0);
}

static int64_t bench_now_ns(struct hal_clock *clock)
{
    (void)clock;
    return bench.sim.world.now_ns;
}

/* Between ticks: was the last set point the one of the whole track? */
static int bench_wait_until(struct hal_clock *clock, int64_t t_ns)
{
    const struct controller *controller = &bench.machine.controller;
    struct motion_sample want;
    (void)clock;
    if (bench.player.phase == TELEMETRY_MOVE &&
        controller->state == CONTROLLER_MOVING && controller->rate.s_ns_q12) {
        motion_track_sample(&whole, &bench.cursor, controller->rate.s_ns_q12,
                            &want);
        assert_int_equal(controller->axis[0].target.pos_q32, want.pos_q32);
        bench.compared++;
    }
    if (bench.job.track[0].count > bench.most)
        bench.most = bench.job.track[0].count;
    return hal_clock_wait_until(&bench.sim.world.clock, t_ns);
}

static const struct hal_clock_ops bench_clock_ops = {
    .now_ns = bench_now_ns,
    .wait_until = bench_wait_until,
};

static void bench_free(void)
{
    player_free(&bench.player);
    report_free(&bench.report);
    machine_free(&bench.machine);
    machine_sim_free(&bench.sim);
    job_free(&bench.job);
}

static int bench_open(void **state)
{
    char message[YAML_MESSAGE_MAX] = "";
    struct machine_ports ports;
    const char *const files[] = { "examples/dolly/rig.yaml", path };

    (void)state;
    strcpy(path, "/tmp/slew-compiled-XXXXXX");
    const int made = mkstemp(path);
    if (made < 0 || close(made) < 0)
        return -1;
    plan_wave();
    save_wave();
    memset(&bench, 0, sizeof bench);
    if (planning_open(&bench.job, files, 2, true) != STATUS_OK ||
        machine_sim_init(&bench.sim, &bench.job.rig, false, &ports, message) <
            0)
        return -1;
    bench.clock.ops = &bench_clock_ops;
    ports.clock = &bench.clock;
    report_init(&bench.report, &bench.job);
    return machine_init(&bench.machine, &bench.job.rig, &ports, message);
}

static int bench_close(void **state)
{
    (void)state;
    bench_free();
    return unlink(path);
}

static void bench_run(int64_t hold_at_ns)
{
    const struct player_config config = {
        .override_q30 = MOTION_CLOCK_WARP_ONE_Q30,
        .hold_at_ns = hold_at_ns,
        .resume_after_ns = SECOND,
    };
    const struct player_observer observer = { .report = &bench.report };
    player_init(&bench.player, &bench.machine, &bench.job, &config, &observer);
    assert_int_equal(player_run(&bench.player, &interrupts), 0);
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
    bench_run(40 * SECOND);
    assert_int_equal(bench.report.end, REPORT_DONE);
    assert_int_equal(bench.report.path_ns_q12, whole.end_ns_q12);
    assert_true(bench.compared > 95000);
    assert_in_range(bench.most, TRACK_STREAM_PLAY / 2, TRACK_STREAM_PLAY);
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
    bench_run(-1);
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
        cmocka_unit_test_setup_teardown(it_is_inside_the_limits, bench_open,
                                        bench_close),
        cmocka_unit_test_setup_teardown(every_set_point_is_as_from_memory,
                                        bench_open, bench_close),
        cmocka_unit_test_setup_teardown(
            a_file_that_goes_bad_stops_along_the_path, bench_open, bench_close),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
