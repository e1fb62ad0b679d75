/* tests/firmware/linux/service/test_service_follow.c - moves of a service that keep to
 * frame pulses of a simulated line, in virtual time: when they begin, how far they are
 * from the clock, and what ends that. */
#include <math.h>
#include <sys/stat.h>

#include "motion/core/clock_warp.h"
#include "tests/support/service_ask.h"

#define PULSE_NS 39600000.0 /* of the line; a frame of the move is 40 ms */
#define FRAME_NS 40000000.0
#define MOVE_NS  9e9

static const char rig_text[] =
    "tick: 10 ms\nbuses: {can: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "axes:\n  pan:\n    unit: deg\n    limits: {position: [-90 deg, 90 deg],"
    " velocity: 30 deg/s, acceleration: 60 deg/s2, jerk: 500 deg/s3}\n"
    "    following_error: {floor: 5 deg, time: 100 ms}\n"
    "    drive: {kind: cia402, bus: can, node: 1, counts: 131072 per rev}\n"
    "gpio:\n"
    "  sync: {kind: frame, line: rig0, sim: 39.6 ms}\n"
    "  mute: {kind: frame, line: rig1}\n";

#define MOVE(fps)                                                              \
    "{\"command\":\"load\",\"text\":\"" fps                                    \
    "axes: {pan: {curve: s-curve, keys: [[0, 0], [9, 40]]}}\\n\"}"
#define START "{\"command\":\"start\",\"follow\":\"sync\"}"

/* Since the start of the move, where it began and how far from the clock it is. */
static struct {
    int64_t begin_ns, end_ns;
    double off_ns; /* once it had 4 s */
} played;

static int up(void **state)
{
    (void)state;
    memset(&bench, 0, sizeof bench);
    memset(&played, 0, sizeof played);
    return service_bench_open(&bench, rig_text);
}

static int down(void **state)
{
    (void)state;
    service_bench_close(&bench);
    return 0;
}

static void tick(void)
{
    const struct controller *controller = &bench.machine.controller;
    service_bench_tick(&bench);
    if (controller->state != CONTROLLER_MOVING ||
        bench.loop.follow.turn != SERVICE_FOLLOW_PLAYS)
        return;
    if (played.begin_ns == 0)
        played.begin_ns = controller->now_ns;
    played.end_ns = controller->now_ns;
    const double since_ns = (double)(controller->now_ns - played.begin_ns);
    const double off_ns = (double)controller->rate.s_ns_q12 / 4096 -
                          since_ns * FRAME_NS / PULSE_NS;
    if (since_ns > 4e9 && controller->rate.s_ns_q12 / 4096 < MOVE_NS)
        played.off_ns = fmax(played.off_ns, fabs(off_ns));
}

static void ticks(int64_t ms)
{
    for (int64_t i = 0; i < ms / 10; i++)
        tick();
}

static int at_start(const char *load)
{
    const int file = service_bench_connect(&bench);
    ticks(1000);
    done(file, "{\"command\":\"take\",\"lease\":10}");
    done(file, load);
    done(file, "{\"command\":\"enable\"}");
    ticks(2000);
    done(file, "{\"command\":\"approach\"}");
    assert_int_equal(bench.machine.controller.state, CONTROLLER_READY);
    return file;
}

/* The lease expires on the way: the move goes on, and is steered.  Afterwards the
 * speed is that of before. */
static void a_move_keeps_to_pulses(void **state)
{
    const int file = at_start(MOVE("fps: 25\\n"));
    (void)state;
    done(file, START);
    refused(file, "{\"command\":\"override\",\"percent\":50}", "STATE",
            "keeps to another clock");
    refused(file, "{\"command\":\"loop\",\"times\":2}", "STATE",
            "keeps to another clock");
    refused(file, START, "ARG", "another start");
    ticks(12000);
    assert_null(bench.control.holder);
    assert_int_equal(bench.machine.controller.state, CONTROLLER_READY);
    const double took_ns = (double)(played.end_ns - played.begin_ns);
    printf("%.3f s, at most %.2f ms off: %s\n", took_ns / 1e9,
           played.off_ns / 1e6, bench.control.follow_text);
    assert_true(fabs(took_ns - MOVE_NS * PULSE_NS / FRAME_NS) < 3e7);
    assert_true(played.off_ns < 2e7);
    assert_memory_equal(bench.control.follow_text, "followed to", 11);
    assert_false(bench.control.follow_opened);
    assert_int_equal(bench.machine.controller.override_q30,
                     MOTION_CLOCK_WARP_ONE_Q30);
    close(file);
}

static void a_hold_is_a_hold_and_a_stop_ends_it(void **state)
{
    const int file = at_start(MOVE("fps: 25\\n"));
    (void)state;
    done(file, START);
    ticks(3000);
    done(file, "{\"command\":\"hold\"}");
    ticks(2000);
    assert_int_equal(bench.machine.controller.state, CONTROLLER_HOLDING);
    done(file, "{\"command\":\"resume\"}");
    ticks(500);
    assert_int_equal(bench.machine.controller.state, CONTROLLER_MOVING);
    assert_memory_equal(bench.control.follow_text, "the move is more than half",
                        26);
    done(file, "{\"command\":\"stop\"}");
    ticks(2000);
    assert_int_equal(bench.machine.controller.state, CONTROLLER_READY);
    assert_false(bench.control.follow_opened);
    assert_int_equal(bench.machine.controller.override_q30,
                     MOTION_CLOCK_WARP_ONE_Q30);
    close(file);
}

static void a_stop_before_the_start_begins_nothing(void **state)
{
    const int file = at_start(MOVE("fps: 25\\n"));
    char path[64], line[128];
    (void)state;
    snprintf(path, sizeof path, "%s/mtc", bench.directory);
    assert_int_equal(mkfifo(path, 0600), 0);
    snprintf(
        line, sizeof line,
        "{\"command\":\"start\",\"follow\":\"mtc:%s\",\"at\":\"00:00:01:00\"}",
        path);
    done(file, line);
    assert_true(bench.control.state->starting);
    done(file, "{\"command\":\"stop\"}");
    ticks(100);
    assert_false(bench.control.state->starting);
    assert_false(bench.control.follow_opened);
    done(file, line); /* again, and the torque goes off */
    done(file, "{\"command\":\"off\"}");
    ticks(100);
    assert_false(bench.control.state->starting);
    assert_int_equal(played.begin_ns, 0);
    unlink(path);
    close(file);
}

static void what_cannot_be_followed_is_refused(void **state)
{
    static const struct {
        const char *line, *part;
    } rows[] = {
        { "{\"command\":\"start\",\"follow\":\"nobody\"}", "is no clock" },
        { "{\"command\":\"start\",\"follow\":\"mute\"}", "without pulses" },
        { "{\"command\":\"start\",\"follow\":7}", "expected a text" },
        { "{\"command\":\"start\",\"follow\":\"mtc:nowhere\"}",
          "No such file" },
        { "{\"command\":\"start\",\"follow\":\"mtc:/nowhere\"}", "--clock" },
        { "{\"command\":\"start\",\"follow\":\"ltc:/dev/zero\"}", "--clock" },
        { "{\"command\":\"start\",\"follow\":\"ltc:../../etc/passwd\"}",
          "--clock" },
        { "{\"command\":\"start\",\"follow\":\"ltc:.\"}", "--clock" },
        { "{\"command\":\"start\",\"follow\":\"sync\",\"at\":\"01:00:00:00\"}",
          "pulses have no number" },
        { "{\"command\":\"start\",\"follow\":\"mtc:/dev/"
          "null\",\"at\":\"noon\"}",
          "expected a timecode" },
        { "{\"command\":\"start\",\"at\":\"01:00:00:00\"}", "expected a text" },
        { "{\"command\":\"start\",\"follow\":\"sync\",\"times\":2}",
          "played once" },
    };
    const int file = at_start(MOVE("fps: 25\\n"));
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        refused(file, rows[i].line, "ARG", rows[i].part);
    done(file, "{\"command\":\"override\",\"percent\":90}");
    ticks(1000);
    refused(file, START, "ARG", "an override of 100 %");
    done(file, "{\"command\":\"override\",\"percent\":100}");
    ticks(1000);
    done(file, MOVE(""));
    refused(file, START, "ARG", "no frame rate");
    assert_false(bench.control.follow_opened);
    assert_int_equal(bench.machine.controller.state, CONTROLLER_READY);
    close(file);
}

#define FOLLOW_TEST(claim) cmocka_unit_test_setup_teardown(claim, up, down)

int main(void)
{
    const struct CMUnitTest tests[] = {
        FOLLOW_TEST(a_move_keeps_to_pulses),
        FOLLOW_TEST(a_hold_is_a_hold_and_a_stop_ends_it),
        FOLLOW_TEST(a_stop_before_the_start_begins_nothing),
        FOLLOW_TEST(what_cannot_be_followed_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
