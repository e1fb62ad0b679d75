/* tests/firmware/linux/player/test_player.c - whole runs on the simulated
 * machine, in virtual time, with everything that may cut them short.  Takes long. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/job/budget.h"
#include "motion/core/fixed.h"
#include "sim/device/cia402/servo.h"
#include "tests/firmware/linux/player/player_bench.h"
#include "tests/support/kind/drives.h"

#define SECOND INT64_C(1000000000)
#define SEED   UINT64_C(0xA0761D6478BD642F)

/* What happens at a given time of the run; the clock makes it happen. */
static struct {
    int64_t interrupt_ns[2]; /* of the run; 0: never */
    int64_t fault_ns;
    enum sim_cia402_fault fault;
    unsigned faulty;
    int64_t pause_at_ns, pause_ns; /* the machine does not run us; 0: never */
    int64_t approach_vel_q32[RIG_AXES_MAX]; /* fastest set point of it */
} given;

static struct trace trace;

static void bench_watch_approach(void)
{
    for (unsigned i = 0; i < bench.job.rig.axis_count; i++) {
        int64_t vel_q32 =
            llabs(bench.machine.controller.axis[i].target.vel_q32);
        if (bench.player.phase == TELEMETRY_APPROACH &&
            vel_q32 > given.approach_vel_q32[i])
            given.approach_vel_q32[i] = vel_q32;
    }
}

static int64_t before_wait(int64_t t_ns)
{
    const int64_t run_ns = t_ns - bench.player.start_ns;
    bench_watch_approach();
    for (int i = 0; i < 2; i++)
        if (given.interrupt_ns[i] > 0 && run_ns >= given.interrupt_ns[i]) {
            bench.interrupts = bench.interrupts + 1;
            given.interrupt_ns[i] = 0;
        }
    if (given.fault_ns > 0 && run_ns >= given.fault_ns) {
        sim_cia402_inject(SERVO_OF(sim_cia402, &bench.sim, given.faulty),
                          given.fault);
        given.fault_ns = 0;
    }
    if (given.pause_at_ns > 0 && run_ns >= given.pause_at_ns) {
        given.pause_at_ns = 0;
        t_ns += given.pause_ns;
    }
    return t_ns;
}

static const struct player_config plain = {
    .override_q30 = MOTION_CLOCK_WARP_ONE_Q30,
    .hold_at_ns = -1,
    .resume_after_ns = SECOND,
};

static int open_dolly(void **state)
{
    const char *const path[] = { "examples/dolly" };

    (void)state;
    memset(&given, 0, sizeof given);
    bench_open(path, 1, false);
    trace_init(&trace, &bench.job.rig);
    return 0;
}

static int close_dolly(void **state)
{
    (void)state;
    trace_free(&trace);
    bench_free();
    return 0;
}

static void run(const struct player_config *config)
{
    bench_play(config, (struct player_observer){ .trace = &trace });
}

/* One count of the axis's encoder, and the rounding of its conversion. */
static int64_t one_count_q32(unsigned axis)
{
    const struct rig_axis *rig = job_rig_axis(&bench.job, axis);
    return (int64_t)((double)MOTION_FIXED_ONE_Q32 * (double)rig->counts_den /
                     (double)llabs(rig->counts_num)) +
           2;
}

static void assert_axes_at_their_last_keys(void)
{
    for (unsigned i = 0; i < bench.job.move.axis_count; i++) {
        const struct plan_axis *axis = &bench.job.move.axis[i];
        int64_t key_q32 = axis->key[axis->key_count - 1].key.pos_q32;
        assert_int_equal(bench.job.track[i].end.pos_q32, key_q32);
        assert_true(bench.report.axis[i].arrived);
        assert_in_range(llabs(bench.report.axis[i].end_q32 - key_q32), 0,
                        one_count_q32(i));
    }
}

static void assert_limits_kept(void)
{
    for (unsigned i = 0; i < bench.job.move.axis_count; i++)
        for (unsigned order = 1; order <= 3; order++) {
            int64_t limit =
                job_limit_of(&job_rig_axis(&bench.job, i)->limit, order);
            assert_true(bench.report.axis[i].peak[order] <= limit);
        }
}

static void assert_torque_is_off(void)
{
    for (unsigned i = 0; i < bench.job.rig.axis_count; i++) {
        const struct controller_axis *axis = &bench.machine.controller.axis[i];
        assert_int_not_equal(axis->feedback.state, HAL_DRIVE_ENABLED);
        assert_int_not_equal(axis->feedback.state, HAL_DRIVE_ENABLING);
    }
}

static void an_undisturbed_run_arrives_at_the_last_keys(void **state)
{
    (void)state;
    run(&plain);
    assert_int_equal(bench.report.end, REPORT_DONE);
    assert_int_equal(bench.report.played_ns,
                     bench.job.end_ns_q12 / MOTION_FIXED_NS_Q12);
    assert_axes_at_their_last_keys();
    assert_limits_kept();
    assert_torque_is_off();
    assert_int_equal(bench.report.rows_dropped, 0);
    assert_int_equal(bench.report.ticks_lost, 0);
    assert_false(trace.warped);
    for (unsigned i = 0; i < bench.job.move.axis_count; i++)
        assert_int_equal(bench.report.axis[i].warnings.number, 0);
    for (unsigned i = 0; i < bench.job.rig.bus_count; i++) {
        struct budget budget;
        budget_of(&bench.job.rig, i, &bench.job, &budget);
        assert_true(bench.report.bus[i].load > 0.99 * budget.expected);
        assert_true(bench.report.bus[i].load < 1.01 * budget.expected);
        assert_true(bench.report.bus[i].load < budget.most);
        budget_free(&budget);
    }
}

static void axes_go_to_their_first_keys_at_a_quarter_of_the_limits(void **state)
{
    (void)state;
    given.interrupt_ns[0] = 12 * SECOND;
    run(&plain);
    assert_true(bench.report.started);
    int pan = rig_axis_index(&bench.job.rig, "pan"); /* 58 deg to go */
    /* sampling rounds velocity to one unit of its format */
    int64_t most_q32 = bench.job.rig.axis[pan].limit.vel_q32 / 4 + 1;
    assert_in_range(given.approach_vel_q32[pan], most_q32 - (1 << 20),
                    most_q32);
    for (unsigned i = 0; i < bench.job.rig.axis_count; i++)
        assert_true(given.approach_vel_q32[i] <=
                    bench.job.rig.axis[i].limit.vel_q32 / 4 + 1);
}

static void half_speed_takes_twice_as_long(void **state)
{
    (void)state;
    struct player_config slow = plain;
    slow.override_q30 = MOTION_CLOCK_WARP_ONE_Q30 / 2;
    run(&slow);
    assert_int_equal(bench.report.end, REPORT_DONE);
    assert_int_equal(bench.report.played_ns,
                     2 * bench.job.end_ns_q12 / MOTION_FIXED_NS_Q12);
    assert_axes_at_their_last_keys();
    assert_limits_kept();
}

static void a_hold_only_makes_it_later(void **state)
{
    (void)state;
    struct player_config hold = plain;
    hold.hold_at_ns = 8 * SECOND;
    hold.resume_after_ns = 3 * SECOND;
    run(&hold);
    assert_int_equal(bench.report.end, REPORT_DONE);
    assert_true(bench.report.played_ns >
                bench.job.end_ns_q12 / MOTION_FIXED_NS_Q12 + 3 * SECOND);
    assert_true(trace.warped);
    assert_axes_at_their_last_keys();
    assert_limits_kept();
}

static void assert_axes_on_the_path_at(int64_t s_ns_q12)
{
    for (unsigned i = 0; i < bench.job.move.axis_count; i++) {
        struct motion_state there;
        motion_track_state(&bench.job.track[i], s_ns_q12, &there);
        assert_in_range(llabs(bench.report.axis[i].end_q32 - there.pos_q32), 0,
                        one_count_q32(i));
    }
}

static void it_begins_at_a_time_of_the_move(void **state)
{
    (void)state;
    struct player_config later = plain;
    later.from_ns_q12 = 5 * SECOND * MOTION_FIXED_NS_Q12;
    run(&later);
    const int64_t rest_ns =
        bench.job.end_ns_q12 / MOTION_FIXED_NS_Q12 - 5 * SECOND;
    assert_int_equal(bench.report.end, REPORT_DONE);
    assert_true(bench.report.played_ns > rest_ns);
    assert_true(bench.report.played_ns < rest_ns + 5 * SECOND);
    assert_axes_at_their_last_keys();
    assert_limits_kept();
}

static void there_and_back_ends_where_it_began(void **state)
{
    (void)state;
    struct player_config both = plain;
    both.times = 2;
    both.is_ping_pong = true;
    run(&both);
    assert_int_equal(bench.report.end, REPORT_DONE);
    assert_int_equal(bench.report.times, 2);
    assert_int_equal(bench.report.played_ns,
                     2 * bench.job.end_ns_q12 / MOTION_FIXED_NS_Q12);
    assert_axes_on_the_path_at(0);
    assert_limits_kept();
}

static void a_loop_goes_back_to_its_first_keys(void **state)
{
    (void)state;
    struct player_config again = plain;
    again.times = 3;
    run(&again);
    assert_int_equal(bench.report.end, REPORT_DONE);
    assert_int_equal(bench.report.times, 3);
    assert_true(bench.report.played_ns >
                3 * bench.job.end_ns_q12 / MOTION_FIXED_NS_Q12);
    assert_axes_at_their_last_keys();
    assert_limits_kept();
}

static void an_endless_one_stops_along_its_path(void **state)
{
    uint64_t seed = SEED;
    struct player_config endless = plain;
    endless.times = -1;
    endless.is_ping_pong = true;
    for (int i = 0; i < 6; i++) {
        if (i > 0) {
            close_dolly(state);
            assert_int_equal(open_dolly(state), 0);
        }
        given.interrupt_ns[0] =
            check_random_in(&seed, 30 * SECOND, 120 * SECOND);
        run(&endless);
        assert_int_equal(bench.report.end, REPORT_STOPPED);
        assert_limits_kept();
        assert_torque_is_off();
        assert_axes_on_the_path_at(bench.report.path_ns_q12);
    }
}

static void an_interrupt_at_any_time_stops_along_the_path(void **state)
{
    uint64_t seed = SEED;
    for (int i = 0; i < 12; i++) {
        if (i > 0) {
            close_dolly(state);
            assert_int_equal(open_dolly(state), 0);
        }
        int64_t at_ns = check_random_in(&seed, 1000000, 34 * SECOND);
        given.interrupt_ns[0] = at_ns;
        run(&plain);
        if (bench.report.end != REPORT_STOPPED)
            fail_msg("seed %#llx, run %d: interrupt at %lld ns ended as %d",
                     (unsigned long long)SEED, i, (long long)at_ns,
                     bench.report.end);
        assert_limits_kept();
        assert_torque_is_off();
        /* where the path was left is where the axes stand */
        for (unsigned a = 0;
             bench.report.started && a < bench.job.move.axis_count; a++) {
            struct motion_state left;
            motion_track_state(&bench.job.track[a], bench.report.path_ns_q12,
                               &left);
            assert_in_range(llabs(bench.report.axis[a].end_q32 - left.pos_q32),
                            0, one_count_q32(a));
        }
    }
}

/* Not what the drives did about it, nor how far they were left behind. */
static void a_long_pause_is_named_as_what_it_was(void **state)
{
    static const struct {
        int64_t at_ns, pause_ns;
    } rows[] = {
        { 20 * SECOND, SECOND / 80 }, { 20 * SECOND, SECOND / 10 },
        { 20 * SECOND, SECOND / 2 },  { 20 * SECOND, 3 * SECOND },
        { SECOND / 50, SECOND / 2 }, /* enabling */
    };
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        if (i > 0) {
            close_dolly(state);
            assert_int_equal(open_dolly(state), 0);
        }
        given.pause_at_ns = rows[i].at_ns;
        given.pause_ns = rows[i].pause_ns;
        run(&plain);
        assert_int_equal(bench.report.end, REPORT_FAULT);
        if (bench.report.fault.fault != CONTROLLER_FAULT_OVERRUN)
            fail_msg("row %zu: %s", i,
                     controller_fault_text(bench.report.fault.fault));
        assert_true(bench.report.late_ns >= rows[i].pause_ns);
        assert_torque_is_off();
    }
}

/* 4.6 ticks: four are left out, and the fifth comes when it is due. */
static void a_short_pause_leaves_its_ticks_out(void **state)
{
    (void)state;
    given.pause_at_ns = 20 * SECOND;
    given.pause_ns = 46 * bench.job.rig.period_ns / 10;
    run(&plain);
    assert_int_equal(bench.report.end, REPORT_DONE);
    assert_int_equal(bench.report.ticks_lost, 4);
    assert_int_equal(bench.report.late_ns, given.pause_ns);
    assert_axes_at_their_last_keys();
}

static void two_interrupts_stop_every_drive_at_once(void **state)
{
    (void)state;
    given.interrupt_ns[0] = 20 * SECOND;
    given.interrupt_ns[1] = 20 * SECOND + SECOND / 20;
    run(&plain);
    assert_int_equal(bench.report.end, REPORT_QUICK_STOPPED);
    assert_torque_is_off();
    assert_true(bench.report.bus[0].load > 0.2);
    /* dolly: 225 mm/s at 400 mm/s2 */
    assert_in_range(bench.player.now_ns - bench.player.phase_ns, 1, SECOND);
}

static void a_drive_fault_stops_the_group_and_is_named(void **state)
{
    (void)state;
    int pan = rig_axis_index(&bench.job.rig, "pan");
    assert_in_range(pan, 0, 3);
    given.fault_ns = 18 * SECOND;
    given.fault = SIM_CIA402_OVERCURRENT;
    given.faulty = (unsigned)pan;
    run(&plain);
    assert_int_equal(bench.report.end, REPORT_FAULT);
    assert_int_equal(bench.report.fault.axis, pan);
    assert_int_equal(bench.report.fault.fault, CONTROLLER_FAULT_DRIVE);
    assert_int_equal(bench.report.fault.drive_code, 0x2310);
    assert_true(strlen(bench.report.fault_text) > 0);
    for (unsigned i = 0; i < bench.job.move.axis_count; i++)
        assert_int_equal(
            bench.report.axis[i].events.count[HAL_DRIVE_EVENT_EMERGENCY],
            bench.job.rig_axis[i] == (unsigned)pan);
    assert_torque_is_off();
}

static void a_dead_drive_is_found_before_anything_moves(void **state)
{
    (void)state;
    given.fault_ns = 1;
    given.fault = SIM_CIA402_SILENT;
    given.faulty = 0;
    run(&plain);
    assert_int_equal(bench.report.end, REPORT_FAULT);
    assert_int_equal(bench.report.fault.axis, 0);
    assert_false(bench.report.started);
}

/* A disk too slow by far: by virtual time on the loop's own thread thousands of
 * ticks come and go while the thread with the rows sleeps for a second. */
static void rows_that_are_lost_change_no_figure_of_the_report(void **state)
{
    struct report_axis whole_axis[8];
    struct report whole;
    struct player_config hasty = plain;
    (void)state;
    run(&plain);
    assert_int_equal(bench.report.rows_dropped, 0);
    whole = bench.report;
    const unsigned axes = bench.job.move.axis_count;
    assert_true(axes <= ARRAY_LEN(whole_axis));
    memcpy(whole_axis, whole.axis, axes * sizeof *whole_axis);
    close_dolly(NULL);
    assert_int_equal(open_dolly(NULL), 0);
    hasty.realtime = true;
    hasty.observe_ns = SECOND;
    run(&hasty);
    assert_true(bench.report.rows_dropped > 1000);
    assert_int_equal(bench.report.ticks, whole.ticks);
    assert_int_equal(bench.report.played_ns, whole.played_ns);
    assert_int_equal(bench.report.path_ns_q12, whole.path_ns_q12);
    assert_memory_equal(bench.report.axis, whole_axis,
                        axes * sizeof *whole_axis);
}

static void reports_are_text_and_json(void **state)
{
    (void)state;
    char text[8192];
    static struct telemetry_axis axis[16];
    static uint32_t bus_warnings[RIG_BUSES_MAX] = { 3 };
    struct telemetry_row row = { .t_ns = 2500000000,
                                 .phase = TELEMETRY_STOP,
                                 .axis = axis,
                                 .bus_warnings = bus_warnings };
    FILE *file = tmpfile();
    assert_non_null(file);
    given.fault_ns = 18 * SECOND;
    given.fault = SIM_CIA402_BLOCKED;
    run(&plain);
    row.axis[bench.job.rig_axis[0]].events = (struct hal_drive_events){
        .count = { [HAL_DRIVE_EVENT_WARNING] = 2,
                   [HAL_DRIVE_EVENT_EMERGENCY] = 1 },
        .emergency_code = 0x8130,
    };
    report_take(&bench.report, &row);
    report_print(&bench.report, file);
    report_json(&bench.report, file);
    rewind(file);
    text[fread(text, 1, sizeof text - 1, file)] = 0;
    fclose(file);
    assert_non_null(strstr(text, "stopped by a fault after"));
    assert_non_null(strstr(text, "fault: dolly: the axis does not follow"));
    assert_non_null(strstr(
        text, "events: dolly: warning 2, emergency message 1 (0x8130)\n"));
    assert_non_null(strstr(text, "\"emergency message\":\t1"));
    assert_non_null(strstr(
        text, "events: dolly: following error over half of its limit 1 ("));
    assert_non_null(strstr(text, "\"following_error_warning\":"));
    assert_non_null(strstr(text, "events: bus can0: error-warning 3 (first "
                                 "after 2.500 s of the run)\n"));
    assert_non_null(strstr(text, "\"error_warning\":"));
    assert_non_null(strstr(text, "\"fault\":"));
    assert_non_null(strstr(text, "\"axis\":\t\"dolly\""));
    /* it stood still before where it should have gone: one sign for both */
    assert_true(report_end_error(&bench.report, 0) != 0);
    assert_true((report_end_error(&bench.report, 0) > 0) ==
                (bench.report.fault.value > 0));
}

#define RUN(test) cmocka_unit_test_setup_teardown(test, open_dolly, close_dolly)

int main(void)
{
    const struct CMUnitTest tests[] = {
        RUN(an_undisturbed_run_arrives_at_the_last_keys),
        RUN(axes_go_to_their_first_keys_at_a_quarter_of_the_limits),
        RUN(half_speed_takes_twice_as_long),
        RUN(a_hold_only_makes_it_later),
        RUN(it_begins_at_a_time_of_the_move),
        RUN(there_and_back_ends_where_it_began),
        RUN(a_loop_goes_back_to_its_first_keys),
        RUN(an_endless_one_stops_along_its_path),
        RUN(an_interrupt_at_any_time_stops_along_the_path),
        RUN(a_long_pause_is_named_as_what_it_was),
        RUN(a_short_pause_leaves_its_ticks_out),
        RUN(two_interrupts_stop_every_drive_at_once),
        RUN(a_drive_fault_stops_the_group_and_is_named),
        RUN(a_dead_drive_is_found_before_anything_moves),
        RUN(rows_that_are_lost_change_no_figure_of_the_report),
        RUN(reports_are_text_and_json),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
