/* tests/firmware/linux/commands/files/test_cmd_report.c - recordings of slew
 * run: what is in them, and what a kill, a full disk and a pipe that nobody
 * reads leave of them.  Reads the real clock. */
#define _GNU_SOURCE /* F_SETPIPE_SZ; mkdtemp, nftw */
#include "tests/support/run_slew.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <signal.h>
#include <sys/resource.h>
#include <time.h>

#define TRIES  5
#define ENOUGH 50 /* rows: a second */

#define RIG                                                                    \
    "buses:\n"                                                                 \
    "  can0: {kind: canopen, bit_rate: 1 Mbit/s}\n"                            \
    "axes:\n"                                                                  \
    "  slide:\n"                                                               \
    "    unit: mm\n"                                                           \
    "    limits: {position: [0 mm, 600 mm], velocity: 200 mm/s,\n"             \
    "             acceleration: 400 mm/s2, jerk: 4000 mm/s3}\n"                \
    "    following_error: {floor: 2 mm, time: 20 ms}\n"                        \
    "    drive: {kind: cia402, bus: can0, node: 1, counts: 4096 per mm}\n"     \
    "    sim: {start: 10 mm}\n"                                                \
    "gpio:\n"                                                                  \
    "  shutter: {kind: trigger, line: GPIO23}\n"
static const char rig_text[] = RIG;
/* On the clock: the longest tick and the longest silence there is, so that a
 * machine that others use too is late for neither. */
static const char clock_rig_text[] = "tick: 20 ms\nwatchdog: 100 ms\n" RIG;
static const char move_text[] =
    "title: There and back\n"
    "axes:\n"
    "  slide: {curve: s-curve, keys: [[0 s, 10 mm], [2 s, 90 mm],\n"
    "                                 [4 s, 50 mm]]}\n"
    "events:\n"
    "  - {line: shutter, at: 1 s}\n"
    "  - {line: shutter, at: 3 s}\n";

/* There and back for two minutes: nothing waits for its end. */
static const char long_move_text[] =
    "axes:\n"
    "  slide: {curve: s-curve, keys: [[0 s, 10 mm], [60 s, 90 mm],\n"
    "                                 [120 s, 50 mm]]}\n";

static const char *place, *recording;

static int open_place(void **state)
{
    static char directory[256], path[256];
    if (run_open(state) != 0)
        return -1;
    run_put("m/rig.yaml", rig_text);
    run_put("m/move.yaml", move_text);
    snprintf(directory, sizeof directory, "%s", run_path("m"));
    snprintf(path, sizeof path, "%s", run_path("run.mcap"));
    place = directory;
    recording = path;
    return 0;
}

static double number(const cJSON *object, const char *name)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, name);
    if (!cJSON_IsNumber(item))
        fail_msg("no number %s", name);
    return item->valuedouble;
}

static const char *text_of(const cJSON *object, const char *name)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, name);
    if (!cJSON_IsString(item))
        fail_msg("no text %s", name);
    return item->valuestring;
}

static cJSON *said(void)
{
    cJSON *object = cJSON_Parse(run_slew()->out);
    if (object == NULL)
        fail_msg("no JSON: %s\n%s", run_slew()->out, run_slew()->err);
    return object;
}

static cJSON *report(void)
{
    run("report", "--json", recording);
    run_expect(STATUS_OK);
    return said();
}

static const cJSON *first_axis(const cJSON *object)
{
    return cJSON_GetArrayItem(cJSON_GetObjectItemCaseSensitive(object, "axes"),
                              0);
}

/* What was counted on every tick, and what is read from the file. */
static void a_recording_has_the_figures_of_its_run(void **state)
{
    (void)state;
    run("run", "--json", "--record", recording, place);
    run_expect(STATUS_OK);
    cJSON *ran = said(), *read = report();
    const cJSON *a = first_axis(ran), *b = first_axis(read);
    assert_string_equal(text_of(ran, "recording"), recording);
    assert_string_equal(text_of(read, "end"), "done");
    assert_string_equal(text_of(read, "title"), "There and back");
    assert_true(cJSON_IsTrue(cJSON_GetObjectItem(read, "ended")));
    assert_true(number(read, "rows") == number(ran, "ticks"));
    assert_true(number(read, "rows_missing") == 0);
    assert_true(fabs(number(a, "following_error") -
                     number(b, "following_error")) < 1e-7);
    assert_true(number(b, "following_error") > 0);
    assert_true(number(b, "following_error_rms") <
                number(b, "following_error"));
    assert_true(fabs(number(cJSON_GetObjectItem(a, "velocity"), "peak") -
                     number(b, "peak_velocity")) < 1e-8);
    assert_true(fabs(number(cJSON_GetObjectItem(a, "jerk"), "peak") -
                     number(b, "peak_jerk")) < 1e-8);
    assert_true(number(cJSON_GetObjectItem(read, "phases_s"), "move") == 4);
    assert_true(number(cJSON_GetObjectItem(read, "shots"), "shutter") == 2);
    cJSON_Delete(ran);
    cJSON_Delete(read);
    run("report", recording);
    run_expect(STATUS_OK);
    run_says("There and back");
    run_says("done, the move took 4.000 s");
}

static void the_same_run_gives_the_same_bytes(void **state)
{
    static char first[RUN_OUT_MAX], second[RUN_OUT_MAX];
    const char *again = run_path("again.mcap");
    (void)state;
    run("run", "--record", recording, place);
    run("run", "--record", again, place);
    run_read(recording, first, sizeof first);
    run_read(again, second, sizeof second);
    assert_memory_equal(first, second, sizeof first);
}

/* The files of the move are gone by then. */
static void a_recording_draws_as_its_move_and_telemetry(void **state)
{
    static char picture[1 << 20];
    const char *csv = run_path("t.csv"), *a = run_path("a.svg"),
               *b = run_path("b.svg");
    (void)state;
    run("run", "--record", recording, "--telemetry", csv, place);
    run_expect(STATUS_OK);
    run("plot", "--telemetry", csv, "--out", a, place);
    run_expect(STATUS_OK);
    assert_int_equal(unlink(run_path("m/rig.yaml")), 0);
    assert_int_equal(unlink(run_path("m/move.yaml")), 0);
    run("plot", "--out", b, recording);
    run_expect(STATUS_OK);
    run_read(a, picture, sizeof picture);
    run_read(b, run_slew()->out, RUN_OUT_MAX);
    assert_non_null(strstr(picture, "</svg>"));
    assert_string_equal(picture, run_slew()->out);
}

static void a_recording_is_not_replaced(void **state)
{
    (void)state;
    run("run", "--record", recording, place);
    run_expect(STATUS_OK);
    run("run", "--record", recording, place);
    run_expect(STATUS_SYSTEM);
    run_complains("is there already");
    cJSON_Delete(report()); /* it is what it was */
}

static void a_move_that_is_refused_leaves_no_recording(void **state)
{
    (void)state;
    run("run", "--override", "200", "--record", recording, place);
    run_expect(STATUS_REFUSED);
    assert_int_equal(access(recording, F_OK), -1);
}

static void a_full_disk_costs_rows_and_says_how_many(void **state)
{
    struct rlimit limit;
    (void)state;
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &limit), 0);
    const rlim_t before = limit.rlim_cur;
    limit.rlim_cur = 2000000;
    signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
    run("run", "--json", "--record", recording, place);
    limit.rlim_cur = before;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
    signal(SIGXFSZ, SIG_DFL);
    run_expect(STATUS_SYSTEM);
    run_complains("File too large");
    cJSON *ran = said(), *read = report();
    const double lost = number(ran, "recording_rows_not_written");
    assert_true(lost > 0);
    assert_true(number(read, "rows") > 1000);
    assert_true(number(read, "rows") + lost == number(ran, "ticks"));
    assert_string_equal(text_of(ran, "end"), "done");
    assert_true(cJSON_IsFalse(cJSON_GetObjectItem(read, "ended")));
    cJSON_Delete(ran);
    cJSON_Delete(read);
}

/* The move goes on to its end on the clock, and nobody waits at its end.  The
 * smallest pipe there is holds some 20 rows of 200. */
static void a_pipe_that_nobody_reads_costs_rows_and_no_tick(void **state)
{
    const char *pipe = run_path("pipe");
    (void)state;
    run_put("m/rig.yaml", clock_rig_text);
    assert_int_equal(mkfifo(pipe, 0600), 0);
    const int reader = open(pipe, O_RDWR);
    assert_true(reader >= 0);
    assert_true(fcntl(reader, F_SETPIPE_SZ, 4096) >= 0);
    for (int i = 0; i < TRIES; i++) {
        run("run", "--json", "--realtime", "--record", pipe, place);
        if (strstr(run_slew()->out, "\"fault\"") == NULL)
            break; /* else this machine did something else meanwhile */
    }
    run_expect(STATUS_SYSTEM);
    cJSON *ran = said();
    assert_string_equal(text_of(ran, "end"), "done");
    assert_true(number(ran, "played_s") >= 4);
    assert_true(number(ran, "recording_rows_not_written") +
                    number(ran, "rows_lost") >
                100);
    cJSON_Delete(ran);
    close(reader);
}

static pid_t begin_a_run_on_the_clock(void)
{
    fflush(NULL);
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        char *argv[] = { "slew",
                         "run",
                         "--json",
                         "--realtime",
                         "--record",
                         (char *)(uintptr_t)recording,
                         (char *)(uintptr_t)place,
                         NULL };
        run_redirect(STDOUT_FILENO, "/dev/null");
        run_redirect(STDERR_FILENO, "/dev/null");
        exit((int)command_main(7, argv));
    }
    return child;
}

/* What the recording is, read while `child` writes it, once it has enough rows;
 * NULL when `child` ended by itself before. */
static cJSON *report_during(pid_t child)
{
    const struct timespec a_while = { .tv_nsec = 20000000 };

    while (waitpid(child, NULL, WNOHANG) == 0) {
        nanosleep(&a_while, NULL);
        if (access(recording, F_OK) < 0 ||
            run("report", "--json", recording) != STATUS_OK)
            continue; /* its head is not there yet */
        cJSON *during = said();
        if (number(during, "rows") >= ENOUGH)
            return during;
        cJSON_Delete(during);
    }
    return NULL;
}

/* A run that a machine with other things to do has stopped before is begun
 * anew. */
static void a_kill_leaves_what_was_recorded(void **state)
{
    pid_t child;
    cJSON *during;
    int status, tries = 0;
    (void)state;
    run_put("m/rig.yaml", clock_rig_text);
    run_put("m/move.yaml", long_move_text);
    do {
        assert_true(tries++ < TRIES);
        (void)unlink(recording);
        child = begin_a_run_on_the_clock();
    } while ((during = report_during(child)) == NULL);
    assert_int_equal(kill(child, SIGKILL), 0);
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFSIGNALED(status));
    cJSON *after = report();
    assert_true(number(after, "rows") >= number(during, "rows"));
    assert_true(cJSON_IsFalse(cJSON_GetObjectItem(after, "ended")));
    cJSON_Delete(during);
    cJSON_Delete(after);
    run("report", recording);
    run_says("the recording has no end");
}

#define RUN(test) cmocka_unit_test_setup_teardown(test, open_place, run_close)

int main(void)
{
    const struct CMUnitTest tests[] = {
        RUN(a_recording_has_the_figures_of_its_run),
        RUN(the_same_run_gives_the_same_bytes),
        RUN(a_recording_draws_as_its_move_and_telemetry),
        RUN(a_recording_is_not_replaced),
        RUN(a_move_that_is_refused_leaves_no_recording),
        RUN(a_full_disk_costs_rows_and_says_how_many),
        RUN(a_pipe_that_nobody_reads_costs_rows_and_no_tick),
        RUN(a_kill_leaves_what_was_recorded),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
