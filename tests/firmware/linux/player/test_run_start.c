/* tests/firmware/linux/player/test_run_start.c - starts at a time of the wall
 * clock and at an edge of a line.  Reads the real clock. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "firmware/linux/player/run_start.h"

#include <time.h>

#include "firmware/host/recording/record_read.h"
#include "firmware/linux/base/disk.h"
#include "hal/linux/clock.h"
#include "tests/support/run_slew.h"

#define SECOND INT64_C(1000000000)
#define PERIOD INT64_C(10000000)
#define TRIES  5
#define SEED   UINT64_C(0x94D049BB133111EB)

static int64_t wall_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return now.tv_sec * SECOND + now.tv_nsec;
}

static void a_tick_falls_on_the_start(void **state)
{
    struct clock_linux own;
    struct hal_clock *clock = clock_linux_init(&own);
    uint64_t seed = SEED;
    (void)state;
    for (int i = 0; i < 1000; i++) {
        const int64_t period_ns = 1000 * check_random_in(&seed, 125, 20000);
        const int64_t now_ns = hal_clock_now_ns(clock);
        struct run_start start = {
            .wall_ns = wall_ns() + check_random_in(&seed, 0, 100 * SECOND),
        };
        const int64_t first_ns =
            run_start_align_ns(&start, clock, now_ns, period_ns);
        assert_in_range(first_ns, now_ns - period_ns, now_ns);
        assert_int_equal((start.due_ns - first_ns) % period_ns, 0);
        assert_int_equal(
            run_start_due_ns(&start, clock, first_ns, 0, period_ns),
            start.due_ns);
        assert_false(start.late);
    }
}

/* As if it had been set back and forth: the start goes along, by whole ticks. */
static void a_clock_that_is_set_moves_the_start(void **state)
{
    struct clock_linux own;
    struct hal_clock *clock = clock_linux_init(&own);
    uint64_t seed = SEED;
    (void)state;
    for (int i = 0; i < 1000; i++) {
        struct run_start start = { .wall_ns = wall_ns() + 10 * SECOND };
        const int64_t set_ns =
            check_random_in(&seed, -3600 * SECOND, 3600 * SECOND);
        const int64_t first_ns =
            run_start_align_ns(&start, clock, hal_clock_now_ns(clock), PERIOD);
        const int64_t before_ns = start.due_ns;
        start.wall_ns += set_ns;
        const int64_t due_ns =
            run_start_due_ns(&start, clock, first_ns, first_ns, PERIOD);
        assert_in_range(due_ns - before_ns - set_ns + SECOND, SECOND - PERIOD,
                        SECOND + PERIOD);
        assert_int_equal((due_ns - first_ns) % PERIOD, 0);
        assert_int_equal(start.late, due_ns < first_ns);
        assert_int_equal(start.passed, due_ns < first_ns);
        assert_in_range(atomic_load(&start.set_ns) + set_ns + SECOND,
                        SECOND - PERIOD, SECOND + PERIOD);
    }
}

/* The axes have been ready for long when it is set past the start: what is over is
 * not begun. */
static void a_clock_that_is_set_past_the_start_begins_nothing(void **state)
{
    struct clock_linux own;
    struct hal_clock *clock = clock_linux_init(&own);
    struct run_start start = { .wall_ns = wall_ns() + 10 * SECOND };
    (void)state;
    const int64_t first_ns =
        run_start_align_ns(&start, clock, hal_clock_now_ns(clock), PERIOD);
    start.wall_ns -= 9 * SECOND;
    (void)run_start_due_ns(&start, clock, first_ns, first_ns - 60 * SECOND,
                           PERIOD);
    assert_false(start.passed);
    start.wall_ns -= 2 * SECOND;
    (void)run_start_due_ns(&start, clock, first_ns, first_ns - 60 * SECOND,
                           PERIOD);
    assert_false(start.late);
    assert_true(start.passed);
}

static void without_a_time_it_is_at_once(void **state)
{
    struct clock_linux own;
    struct hal_clock *clock = clock_linux_init(&own);
    struct run_start start = { .wall_ns = 0 };
    (void)state;
    assert_int_equal(run_start_align_ns(&start, clock, 12345, PERIOD), 12345);
    assert_int_equal(run_start_due_ns(&start, clock, 70, 77, PERIOD), 77);
    assert_false(start.late);
}

/* --- the program --- */

static const char rig_text[] =
    "tick: 10 ms\n"
    "buses:\n"
    "  can0: {kind: canopen, bit_rate: 1 Mbit/s}\n"
    "axes:\n"
    "  slide:\n"
    "    unit: mm\n"
    "    limits: {position: [0 mm, 600 mm], velocity: 200 mm/s,\n"
    "             acceleration: 400 mm/s2, jerk: 4000 mm/s3}\n"
    "    following_error: {floor: 2 mm, time: 20 ms}\n"
    "    drive: {kind: cia402, bus: can0, node: 1, counts: 4096 per mm}\n"
    "    sim: {start: 10 mm}\n"
    "gpio:\n"
    "  go: {kind: start, line: GPIO5, bias: pull-up, active: low, sim: 3 s}\n"
    "  silent: {kind: start, line: GPIO6}\n"
    "  shutter: {kind: trigger, line: GPIO23, lead: 250 ms}\n";

/* From a place on; at 10 mm the axis is there already. */
static void put_files(int from_mm)
{
    char move[200];
    snprintf(move, sizeof move,
             "axes:\n"
             "  slide: {curve: s-curve, keys: [[0 s, %d mm], [1 s, %d mm]]}\n",
             from_mm, from_mm + 20);
    run_put("m/rig.yaml", rig_text);
    run_put("m/move.yaml", move);
}

static const char *time_text(int64_t t_ns)
{
    static char text[64];
    char date[32];
    struct tm tm;
    const time_t t = (time_t)(t_ns / SECOND);
    assert_non_null(gmtime_r(&t, &tm));
    strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%S", &tm);
    snprintf(text, sizeof text, "%s.%09" PRId64 "Z", date, t_ns % SECOND);
    return text;
}

/* On the clock, so far ahead; again when this machine did something else
 * meanwhile.  Returns when it was to start. */
static int64_t run_at(const char *recording, int64_t ahead_ns)
{
    int64_t at_ns = 0;
    for (int i = 0; i < TRIES; i++) {
        (void)unlink(recording);
        at_ns = wall_ns() + ahead_ns;
        run("run", "--realtime", "--record", recording, "--at",
            time_text(at_ns), run_path("m"));
        if (strstr(run_slew()->out, "did something else meanwhile") == NULL)
            break;
    }
    return at_ns;
}

static void take_first_of_the_move(void *context,
                                   const struct telemetry_row *row)
{
    int64_t *first_ns = context;
    if (row->phase == TELEMETRY_MOVE && *first_ns < 0)
        *first_ns = row->t_ns;
}

/* Reads a recording; the time of the first row of the move, -1: there is none. */
static int64_t first_of_the_move(struct record_file *file,
                                 const char *recording)
{
    int64_t first_ns = -1;
    const struct record_taker taker = { .row = take_first_of_the_move,
                                        .context = &first_ns };
    char message[YAML_MESSAGE_MAX];
    assert_int_equal(
        record_read(file, &disk_files, recording, NULL, &taker, message), 0);
    return first_ns;
}

/* The row before the first of the move is the tick of its start. */
static void a_move_starts_at_its_time(void **state)
{
    const char *recording = run_path("run.mcap");
    struct record_file file;
    (void)state;
    put_files(10);
    const int64_t at_ns = run_at(recording, 3 * SECOND + 123456789);
    run_expect(STATUS_OK);
    run_says("there it waits until");
    int64_t first_ns = first_of_the_move(&file, recording);
    first_ns += record_integer(file.plan, file.plan_count, "epoch_ns");
    const int64_t lost_ns =
        PERIOD * record_integer(file.end, file.end_count, "ticks_lost");
    record_file_free(&file);
    assert_in_range(first_ns - at_ns, PERIOD * 9 / 10,
                    PERIOD * 11 / 10 + lost_ns);
}

static void axes_that_are_not_ready_are_not_moved(void **state)
{
    const char *recording = run_path("run.mcap");
    struct record_file file;
    (void)state;
    put_files(500);
    (void)run_at(recording, 4 * SECOND);
    run_expect(STATUS_REFUSED);
    run_says("the axes were not ready at the time of the start");
    const int64_t first_ns = first_of_the_move(&file, recording);
    record_file_free(&file);
    assert_int_equal(first_ns, -1);
}

/* Virtual time begins at 1 s, so that pulses are 2 s, 5 s, 8 s, 11 s and 14 s
 * after the start of the run.  The displacement to 500 mm takes 11.3 s. */
static void a_move_starts_at_the_first_edge_once_it_is_ready(void **state)
{
    static const struct {
        int from_mm;
        int64_t want_ns;
    } rows[] = { { 10, 2 * SECOND }, { 500, 14 * SECOND } };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const char *recording = run_path(i == 0 ? "a.mcap" : "b.mcap");
        struct record_file file;
        put_files(rows[i].from_mm);
        run("run", "--record", recording, "--on-edge", "go", run_path("m"));
        run_expect(STATUS_OK);
        run_says("there it waits for go");
        const int64_t first_ns = first_of_the_move(&file, recording);
        record_file_free(&file);
        /* the lead of the shutter is ahead of it */
        assert_in_range(first_ns, rows[i].want_ns + SECOND / 4,
                        rows[i].want_ns + SECOND / 4 + 3 * PERIOD);
    }
}

static void lines_that_start_nothing_are_refused(void **state)
{
    (void)state;
    put_files(10);
    run("run", "--on-edge", "silent", run_path("m"));
    run_expect(STATUS_INPUT);
    run_complains("has no pulses, expected sim: TIME");
    run("run", "--on-edge", "shutter", run_path("m"));
    run_expect(STATUS_INPUT);
    run_complains("'shutter' is not a line of this rig of kind start");
}

#define RUN(test) cmocka_unit_test_setup_teardown(test, run_open, run_close)

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_tick_falls_on_the_start),
        cmocka_unit_test(a_clock_that_is_set_moves_the_start),
        cmocka_unit_test(a_clock_that_is_set_past_the_start_begins_nothing),
        cmocka_unit_test(without_a_time_it_is_at_once),
        RUN(a_move_starts_at_its_time),
        RUN(axes_that_are_not_ready_are_not_moved),
        RUN(a_move_starts_at_the_first_edge_once_it_is_ready),
        RUN(lines_that_start_nothing_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
