/* tests/firmware/linux/machine/test_events.c - events of a move, from the file
 * to the level on the line, on the simulated machine: under hold, override,
 * stop and a dead line. */
#include <string.h>

#include "firmware/host/job/job_shots.h"
#include "firmware/linux/machine/machine_trigger.h"
#include "motion/core/fixed.h"
#include "tests/firmware/linux/player/player_bench.h"

#define MS    INT64_C(1000000)
#define SHOTS 100

static struct shots shots;
static int64_t stop_ns, dead_ns; /* of the run; 0: never */

/* What the lines and the path did. */
static struct {
    bool active[RIG_LINES_MAX];
    unsigned pulses[RIG_LINES_MAX];
    int64_t rise_ns[RIG_LINES_MAX], shortest_ns[RIG_LINES_MAX];
    /* of every shot: its pulse, and the first tick whose path time has it */
    int64_t fired_ns[RIG_LINES_MAX][SHOTS], reached_ns[RIG_LINES_MAX][SHOTS];
    uint32_t reached[RIG_LINES_MAX];
} seen;

static void look_at_line(unsigned i)
{
    const struct sim_gpio *line = &bench.sim.line[i];
    const bool active =
        (line->level == SIM_GPIO_HIGH) != line->config.active_low;
    const int64_t now_ns = bench.sim.world.now_ns;
    if (active == seen.active[i] || line->level == SIM_GPIO_DEAD)
        return;
    seen.active[i] = active;
    if (active && seen.pulses[i] < SHOTS)
        seen.fired_ns[i][seen.pulses[i]] = now_ns;
    seen.pulses[i] += active;
    if (active)
        seen.rise_ns[i] = now_ns;
    else if (now_ns - seen.rise_ns[i] < seen.shortest_ns[i])
        seen.shortest_ns[i] = now_ns - seen.rise_ns[i];
}

static void look_at_path(unsigned i)
{
    const struct plan_shots *planned = &bench.job.shots[i];
    uint32_t *reached = &seen.reached[i];
    if (bench.player.phase < TELEMETRY_MOVE)
        return;
    while (*reached < planned->count && *reached < SHOTS &&
           planned->t_ns_q12[*reached] <=
               bench.machine.controller.rate.s_ns_q12)
        seen.reached_ns[i][(*reached)++] = bench.sim.world.now_ns;
}

static int64_t before_wait(int64_t t_ns)
{
    const int64_t run_ns = t_ns - bench.player.start_ns;
    for (unsigned i = 0; i < bench.job.rig.line_count; i++) {
        look_at_line(i);
        look_at_path(i);
    }
    if (stop_ns > 0 && run_ns >= stop_ns)
        bench.interrupts = 1;
    if (dead_ns > 0 && run_ns >= dead_ns)
        sim_gpio_drive(&bench.sim.line[0], SIM_GPIO_DEAD);
    return t_ns;
}

static void open_rig(const char *directory)
{
    stop_ns = dead_ns = 0;
    memset(&seen, 0, sizeof seen);
    for (unsigned i = 0; i < RIG_LINES_MAX; i++)
        seen.shortest_ns[i] = INT64_MAX;
    bench_open(&directory, 1, false);
    shots_init(&shots, &bench.job);
}

static int close_rig(void **state)
{
    (void)state;
    shots_free(&shots);
    bench_free();
    return 0;
}

static void run(int percent, int64_t hold_at_ns, int64_t resume_after_ns)
{
    const struct player_config config = {
        .override_q30 = MOTION_CLOCK_WARP_ONE_Q30 * percent / 100,
        .hold_at_ns = hold_at_ns,
        .resume_after_ns = resume_after_ns,
    };
    bench_play(&config, (struct player_observer){ .shots = &shots });
}

static void expect_all(void)
{
    for (unsigned i = 0; i < shots.count; i++) {
        const struct shots_line *line = &shots.line[i];
        assert_int_equal(line->fired, bench.job.shots[line->line].count);
        assert_int_equal(seen.pulses[line->line], line->fired);
        assert_in_range(seen.shortest_ns[line->line],
                        bench.job.rig.line[line->line].width_ns,
                        bench.job.rig.line[line->line].width_ns);
        /* a tick, and what 2^-30 of override leaves */
        assert_in_range(line->late_ns, 0, MS + 1000);
        for (uint32_t k = 0; k < line->fired; k++)
            assert_true(line->seen[k].late_ns >= -1000);
    }
    assert_int_equal(bench.report.end, REPORT_DONE);
}

static void all_shots_of_a_move_are_fired_in_time(void **state)
{
    (void)state;
    open_rig("tests/data/triggers");
    assert_int_equal(bench.job.shots[0].count, 82); /* (3000 - 1) / 37 + 1 */
    assert_int_equal(bench.job.shots[2].count, 2);
    run(100, -1, MS);
    expect_all();
}

static void a_hold_delays_them_and_loses_none(void **state)
{
    (void)state;
    seed_from("hold");
    for (int i = 0; i < 12; i++) {
        open_rig("tests/data/triggers");
        run(i % 2 ? 100 : 70, (int64_t)(draw() % 2900) * MS,
            (int64_t)(draw() % 300) * MS);
        expect_all();
        if (i < 11)
            close_rig(NULL);
    }
}

static void a_stop_leaves_the_rest_out(void **state)
{
    (void)state;
    open_rig("tests/data/triggers");
    stop_ns = 2500 * MS;
    run(100, -1, MS);
    assert_int_equal(bench.report.end, REPORT_STOPPED);
    const struct shots_line *line = &shots.line[0];
    assert_in_range(line->fired, 1, 81);
    assert_int_equal(seen.pulses[0], line->fired);
    assert_true(bench.job.shots[0].t_ns_q12[line->fired - 1] <=
                bench.report.path_ns_q12);
    assert_true(bench.job.shots[0].t_ns_q12[line->fired] >
                bench.report.path_ns_q12);
    assert_false(seen.active[0]);
}

/* Of tests/data/triggers; whole ticks. */
#define CAMERA       0
#define FLASH        2
#define CAMERA_LEAD  (12 * MS)
#define FLASH_LEAD   (250 * MS) /* longer than the rest before a move */
#define CAMERA_SHOTS 82
#define FLASH_SHOTS  2

static void open_rig_with_leads(void)
{
    open_rig("tests/data/triggers");
    bench.job.rig.line[CAMERA].lead_ns = CAMERA_LEAD;
    bench.job.rig.line[FLASH].lead_ns = FLASH_LEAD;
}

/* The first one, at 1 ms, before the move. */
static void a_lead_is_time_on_the_clock_at_any_rate(void **state)
{
    static const int percent[] = { 100, 70, 130 };
    (void)state;
    for (size_t n = 0; n < ARRAY_LEN(percent); n++) {
        open_rig_with_leads();
        run(percent[n], -1, MS);
        expect_all();
        assert_int_equal(seen.reached[CAMERA], CAMERA_SHOTS);
        assert_int_equal(seen.reached[FLASH], FLASH_SHOTS);
        for (uint32_t k = 0; k < CAMERA_SHOTS; k++)
            assert_int_equal(seen.reached_ns[CAMERA][k] -
                                 seen.fired_ns[CAMERA][k],
                             CAMERA_LEAD);
        for (uint32_t k = 0; k < FLASH_SHOTS; k++)
            assert_int_equal(seen.reached_ns[FLASH][k] -
                                 seen.fired_ns[FLASH][k],
                             FLASH_LEAD);
        assert_true(seen.fired_ns[CAMERA][0] < bench.player.move_ns);
        if (n + 1 < ARRAY_LEN(percent))
            close_rig(NULL);
    }
}

/* What has been fired when the hold comes stays fired; what is closer than the
 * lead when it goes on is fired at once. */
static void a_lead_under_holds_loses_and_repeats_none(void **state)
{
    (void)state;
    seed_from("lead");
    for (int i = 0; i < 12; i++) {
        open_rig_with_leads();
        run(i % 2 ? 100 : 70, (int64_t)(draw() % 2900) * MS,
            (int64_t)(draw() % 300) * MS);
        assert_int_equal(bench.report.end, REPORT_DONE);
        assert_int_equal(seen.pulses[CAMERA], CAMERA_SHOTS);
        assert_int_equal(seen.pulses[FLASH], FLASH_SHOTS);
        for (uint32_t k = 0; k < CAMERA_SHOTS; k++)
            assert_true(seen.fired_ns[CAMERA][k] <= seen.reached_ns[CAMERA][k]);
        for (uint32_t k = 0; k < FLASH_SHOTS; k++)
            assert_true(seen.fired_ns[FLASH][k] <= seen.reached_ns[FLASH][k]);
        assert_in_range(shots.line[0].late_ns, 0, CAMERA_LEAD + MS);
        if (i < 11)
            close_rig(NULL);
    }
}

/* The run-up has fired one; then it is called off. */
static void a_stop_in_the_run_up_ends_it(void **state)
{
    (void)state;
    open_rig_with_leads();
    run(100, -1, MS);
    const int64_t first_ns = seen.fired_ns[CAMERA][0] - bench.player.start_ns;
    close_rig(NULL);
    open_rig_with_leads();
    stop_ns = first_ns + 2 * MS;
    run(100, -1, MS);
    assert_int_equal(bench.report.end, REPORT_STOPPED);
    assert_int_equal(seen.pulses[CAMERA], 1);
    assert_int_equal(seen.reached[CAMERA], 0);
    assert_false(seen.active[CAMERA]);
}

static void a_dead_line_stops_nothing_and_is_told(void **state)
{
    (void)state;
    open_rig("tests/data/triggers");
    dead_ns = 1500 * MS;
    run(100, -1, MS);
    assert_int_equal(bench.report.end, REPORT_DONE);
    assert_int_equal(shots.line[0].fired, 82);
    assert_true(shots.line[0].failures > 2 * (82 - seen.pulses[0]) - 3);
    assert_int_equal(shots.line[1].failures, 0);
}

/* The example: each frame is shot while both axes stand. */
static void stopmotion_shoots_at_rest(void **state)
{
    (void)state;
    open_rig("examples/stopmotion");
    run(100, -1, MS);
    expect_all();
    const struct shots_line *line = &shots.line[0];
    assert_int_equal(line->fired, 8);
    for (uint32_t k = 0; k < line->fired; k++)
        for (unsigned i = 0; i < 2; i++) {
            struct motion_state at;
            motion_track_state(&bench.job.track[i],
                               bench.job.shots[line->line].t_ns_q12[k], &at);
            assert_int_equal(at.vel_q32, 0);
            assert_int_equal(line->seen[k].t_ns - shots.start_ns,
                             600 * MS + (int64_t)k * 2000 * MS);
        }
}

static bool keeps_up(int64_t rate_q30)
{
    struct messages messages = { .text = NULL };
    const bool fits = job_shots_check(&bench.job, rate_q30, &messages);
    assert_int_equal(messages.length > 0, !fits);
    messages_free(&messages);
    return fits;
}

static void what_a_line_cannot_do_is_refused(void **state)
{
    (void)state;
    open_rig("tests/data/triggers");
    assert_true(keeps_up(MOTION_CLOCK_WARP_ONE_Q30));
    /* 37 ms apart, 5 ms wide, 2 ms of rest: 5.28 times as fast is the most */
    assert_true(keeps_up(MOTION_CLOCK_WARP_ONE_Q30 * 528 / 100));
    assert_false(keeps_up(MOTION_CLOCK_WARP_ONE_Q30 * 529 / 100));
    bench.job.rig.line[0].width_ns = 36 * MS;
    bench.job.rig.line[0].rest_ns = 0;
    assert_true(keeps_up(MOTION_CLOCK_WARP_ONE_Q30));
    bench.job.rig.line[0].width_ns = 37 * MS; /* no tick between two pulses */
    assert_false(keeps_up(MOTION_CLOCK_WARP_ONE_Q30));
}

#define RUN(test) cmocka_unit_test_teardown(test, close_rig)

int main(void)
{
    const struct CMUnitTest tests[] = {
        RUN(all_shots_of_a_move_are_fired_in_time),
        RUN(a_hold_delays_them_and_loses_none),
        RUN(a_stop_leaves_the_rest_out),
        RUN(a_lead_is_time_on_the_clock_at_any_rate),
        RUN(a_lead_under_holds_loses_and_repeats_none),
        RUN(a_stop_in_the_run_up_ends_it),
        RUN(a_dead_line_stops_nothing_and_is_told),
        RUN(stopmotion_shoots_at_rest),
        RUN(what_a_line_cannot_do_is_refused),
    };
    return cmocka_run_group_tests_name("events", tests, NULL, NULL);
}
