/* tests/firmware/linux/commands/test_cli.c - the commands of slew, as a user
 * meets them: what they print, what they leave behind, how they end.  Takes
 * long. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "tests/support/run_slew.h"

#include <arpa/inet.h>
#include <cjson/cJSON.h>
#include <dirent.h>
#include <math.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>

#include "firmware/linux/base/output.h"

static const char *directory;
static char rig[256], move[256];
static char *out, *err;

/* --- the bench --- */

static int lines_of(const char *text)
{
    int lines = 0;
    for (; *text != 0; text++)
        lines += *text == '\n';
    return lines;
}

static void expect(int status, int want)
{
    if (status != want)
        fail_msg("status %d, expected %d\nout: %s\nerr: %s", status, want, out,
                 err);
}

/* One line on stderr with `text` in it, and status 2. */
static void expect_bad_input(int status, const char *text)
{
    expect(status, STATUS_INPUT);
    if (lines_of(err) != 1 || strstr(err, text) == NULL)
        fail_msg("expected one line with \"%s\", got: %s", text, err);
    cJSON *object = cJSON_Parse(out); /* with --json */
    if (object == NULL)
        assert_string_equal(out, "");
    else
        assert_string_equal(
            cJSON_GetStringValue(cJSON_GetObjectItem(object, "error")),
            strtok(err, "\n"));
    cJSON_Delete(object);
}

static int entries(void)
{
    int count = 0;
    DIR *handle = opendir(directory);
    assert_non_null(handle);
    while (readdir(handle) != NULL)
        count++;
    closedir(handle);
    return count;
}

static const char *const small_rig =
    "title: Bench\n"
    "buses:\n"
    "  can0: {kind: canopen, bit_rate: 1 Mbit/s}\n"
    "axes:\n"
    "  slide:\n"
    "    unit: mm\n"
    "    limits: {position: [-5 mm, 600 mm], velocity: 400 mm/s,\n"
    "             acceleration: 800 mm/s2, jerk: 8000 mm/s3}\n"
    "    stop: {acceleration: 2000 mm/s2, jerk: 40000 mm/s3}\n"
    "    following_error: {floor: 2 mm, time: 20 ms}\n"
    "    drive: {kind: cia402, bus: can0, node: 1, counts: 4096 per mm}\n"
    "    sim: {bandwidth: 25 Hz, damping: 0.9, start: 10 mm}\n";

static void write_move(const char *curve, const char *keys)
{
    static char text[9000];
    snprintf(text, sizeof text,
             "title: Bench\naxes:\n  slide:\n    curve: %s\n    keys: [%s]\n",
             curve, keys);
    run_write(move, text);
}

static int open_bench(void **state)
{
    if (run_open(state) < 0)
        return -1;
    directory = run_slew()->directory;
    out = run_slew()->out;
    err = run_slew()->err;
    snprintf(rig, sizeof rig, "%s", run_path("rig.yaml"));
    snprintf(move, sizeof move, "%s", run_path("move.yaml"));
    run_write(rig, small_rig);
    write_move("s-curve", "[0 s, 10 mm], [2 s, 300 mm], [3.125 s, 250.1 mm]");
    return 0;
}

/* --- help and arguments --- */

static void help_shows_every_option_and_parses_it(void **state)
{
    (void)state;
    assert_int_equal(run("--help"), STATUS_OK);
    for (size_t i = 0; command_list[i] != NULL; i++) {
        const struct command *command = command_list[i];
        assert_non_null(strstr(out, command->summary));
        assert_int_equal(run(command->name, "--help"), STATUS_OK);
        assert_non_null(strstr(out, "examples:"));
        assert_non_null(strstr(out, "exit status:"));
        for (size_t k = 0; k < command->option_count; k++) {
            char name[40];
            snprintf(name, sizeof name, "  --%s", command->option[k].name);
            assert_non_null(strstr(out, name));
        }
        assert_int_equal(run("--help"), STATUS_OK);
    }
}

static void bad_arguments_get_one_line_and_status_2(void **state)
{
    static const struct {
        const char *words[7], *want;
    } rows[] = {
        { { "fly" }, "no command \"fly\"" },
        { { "check" }, "which files?" },
        { { "check", "--frobnicate", "x" }, "unknown option --frobnicate" },
        { { "check", "-x", "y" }, "unknown option -x" },
        { { "plan", "--out" }, "no value after --out" },
        { { "plan", "a", "b", "c" }, "one argument too many: c" },
        { { "plan", "/nowhere" }, "/nowhere: No such file" },
        { { "sample", "examples/dolly" }, "expected --rate HZ" },
        { { "sample", "--rate", "0", "examples/dolly" }, "--rate 0: expected" },
        { { "sample", "--rate", "1e3", "examples/dolly" }, "--rate 1e3" },
        { { "sample", "--rate", "nan", "examples/dolly" }, "--rate nan" },
        { { "sample", "--rate", "1", "--from", "-1", "examples/dolly" },
          "--from is before the move" },
        { { "sample", "--rate", "1", "--to", "3 furlongs", "examples/dolly" },
          "--to: '3 furlongs' has the unknown unit" },
        { { "run", "--override", "201", "x" }, "expected a percentage" },
        { { "run", "--override", "0", "x" }, "expected a percentage" },
        { { "plot", "examples/dolly" }, "expected --out" },
        { { "plot", "--out", "a.gif", "examples/dolly" }, "expected --out" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        expect_bad_input(run_words(rows[i].words), rows[i].want);
    expect_bad_input(
        run("sample", "--rate", "100", "--axis", "crane", "examples/dolly"),
        "no axis \"crane\", expected dolly, ");
    expect_bad_input(run("run", "--plot", "x.gif", "--json", directory),
                     "ends in .svg or .png");
}

static void a_bad_file_is_named_with_its_place(void **state)
{
    (void)state;
    char want[300];
    write_move("s-curve", "[0 s, 10 mm], [2 s, 300 kg]");
    snprintf(want, sizeof want, "%s:5:", move);
    int before = entries();
    expect_bad_input(run("run", "--telemetry", run_path("t.csv"), "--plot",
                         run_path("p.png"), directory),
                     want);
    assert_int_equal(entries(), before);
}

/* --- check --- */

static void a_good_move_passes(void **state)
{
    (void)state;
    expect(run("check", rig, move), STATUS_OK);
    assert_non_null(strstr(out, "together at most 28.76 %"));
    assert_non_null(strstr(out, "1 axis, 3.125 s: within all limits\n"));
    expect(run("check", "--json", directory), STATUS_OK);
    cJSON *report = cJSON_Parse(out);
    assert_true(cJSON_IsTrue(cJSON_GetObjectItem(report, "ok")));
    cJSON_Delete(report);
}

/* On standard error, and in the report. */
static void what_is_hardly_meant_is_a_warning(void **state)
{
    static const char said[] =
        ":5:3: warning: slide has a jerk of 8e+05 mm/s3, which is its whole "
        "acceleration of 800 mm/s2 within one tick of 1 ms: it limits nothing, "
        "as less than 8e+05 would [limits]";
    static const char *const commands[] = { "check", "run" };
    /* acknowledged: not said any more */
    static const char *const known[] = { "", "    acknowledged: [limits]\n" };
    char text[1024], path[256];
    const char *jerk = strstr(small_rig, "8000 mm/s3}");

    (void)state;
    snprintf(path, sizeof path, "%s", run_path("hasty.yaml"));
    for (size_t i = 0; i < ARRAY_LEN(commands) * ARRAY_LEN(known); i++) {
        const bool is_said = i < ARRAY_LEN(commands);
        snprintf(text, sizeof text, "%.*s800000 mm/s3}\n%s%s",
                 (int)(jerk - small_rig), small_rig, known[is_said ? 0 : 1],
                 strstr(small_rig, "    following_error"));
        run_put("hasty.yaml", text);
        expect(run(commands[i % ARRAY_LEN(commands)], "--json", path, move),
               STATUS_OK);
        assert_true((strstr(err, said) != NULL) == is_said);
        assert_true((strstr(err, "warning") != NULL) == is_said);
        cJSON *report = cJSON_Parse(out);
        const cJSON *list = cJSON_GetObjectItem(report, "warnings");
        assert_int_equal(cJSON_GetArraySize(list), is_said ? 1 : 0);
        if (is_said)
            assert_non_null(
                strstr(cJSON_GetArrayItem(list, 0)->valuestring, said));
        cJSON_Delete(report);
    }
    assert_int_equal(unlink(path), 0);
}

static const cJSON *violation(const cJSON *report, const char *what)
{
    const cJSON *item;
    cJSON_ArrayForEach(item, cJSON_GetObjectItem(report, "violations"))
    {
        const char *text = cJSON_GetObjectItem(item, "what")->valuestring;
        if (strcmp(text, what) == 0)
            return item;
    }
    fail_msg("no violation of %s in %s", what, out);
    return NULL;
}

static double number(const cJSON *item, const char *name)
{
    return cJSON_GetObjectItem(item, name)->valuedouble;
}

static void every_violation_has_axis_time_value_limit(void **state)
{
    (void)state;
    /* straight lines: 500 mm/s for 1 s, then 101 mm beyond the range */
    write_move("linear", "[0 s, 10 mm], [1 s, 510 mm], [2 s, 701 mm]");
    expect(run("check", "--json", directory), STATUS_REFUSED);
    cJSON *report = cJSON_Parse(out);
    assert_true(cJSON_IsFalse(cJSON_GetObjectItem(report, "ok")));
    const cJSON *item = violation(report, "velocity");
    assert_string_equal(cJSON_GetObjectItem(item, "axis")->valuestring,
                        "slide");
    assert_true(number(item, "value") == 500);
    assert_true(number(item, "limit") == 400);
    assert_true(number(item, "line") == 5);
    item = violation(report, "position above the highest");
    assert_true(number(item, "value") == 701);
    assert_true(number(item, "limit") == 600);
    assert_true(number(item, "time_s") == 2);
    item = violation(report, "velocity steps (infinite acceleration)");
    assert_true(number(item, "time_s") == 1);
    assert_true(number(item, "key") == 2);
    item = violation(report, "not at rest at the first key");
    assert_true(number(item, "time_s") == 0);
    assert_true(number(item, "value") == 500);
    item = violation(report, "not at rest at the last key");
    assert_true(number(item, "time_s") == 2);
    assert_true(number(item, "value") == 191);
    cJSON_Delete(report);
    expect(run("check", directory), STATUS_REFUSED);
    assert_non_null(strstr(out, "position above the highest"));
}

static void override_scales_the_limits(void **state)
{
    (void)state;
    /* 675 mm/s2 at full speed; 675 r^2 <= 800 up to r = 1.0886 */
    write_move("s-curve", "[0 s, 0 mm], [2 s, 300 mm]");
    expect(run("check", directory), STATUS_OK);
    expect(run("check", "--override", "108.8 %", directory), STATUS_OK);
    expect(run("check", "--override", "108.9 %", directory), STATUS_REFUSED);
    expect(run("run", "--override", "108.9 %", directory), STATUS_REFUSED);
    /* 225 mm/s; 225 r <= 400 up to r = 1.7777 */
    expect(run("check", "--override", "177.7", directory), STATUS_REFUSED);
    assert_null(strstr(out, " velocity"));
    expect(run("check", "--override", "177.8", directory), STATUS_REFUSED);
    assert_non_null(strstr(out, " velocity"));
    /* a slow one, too, must be within them at 100 % */
    write_move("s-curve", "[0 s, 0 mm], [1 s, 300 mm]");
    expect(run("check", "--override", "50", directory), STATUS_REFUSED);
    expect(run("run", "--override", "50", directory), STATUS_REFUSED);
    assert_non_null(strstr(out, "acceleration"));
    assert_non_null(strstr(err, "nothing was moved"));
}

static void a_move_over_its_limits_is_not_run(void **state)
{
    (void)state;
    write_move("linear", "[0 s, 10 mm], [1 s, 510 mm]");
    int before = entries();
    expect(run("run", "--telemetry", run_path("t.csv"), "--plot",
               run_path("p.png"), directory),
           STATUS_REFUSED);
    assert_non_null(strstr(err, "nothing was moved"));
    assert_int_equal(entries(), before);
}

/* --- sample --- */

/* The fields of the line that starts with `t_ns`. */
static const char *row_at(const char *text, const char *t_ns)
{
    static char row[256];
    char start[64];
    snprintf(start, sizeof start, "\n%s,", t_ns);
    const char *at = strstr(text, start);
    if (at == NULL)
        fail_msg("no sample at %s", t_ns);
    snprintf(row, sizeof row, "%.*s", (int)strcspn(at + 1, "\n"), at + 1);
    return row;
}

static void a_key_time_gives_the_key_to_the_bit(void **state)
{
    (void)state;
    expect(run("sample", "--rate", "1000", "--raw", directory), STATUS_OK);
    /* 250.1 mm is 1074171320729.6 / 2^32 */
    assert_string_equal(row_at(out, "3125000000"),
                        "3125000000,1074171320730,0,0");
    assert_string_equal(row_at(out, "2000000000"),
                        "2000000000,1288490188800,0,0");
    expect(run("sample", "--rate", "1000", directory), STATUS_OK);
    assert_string_equal(row_at(out, "3125000000"),
                        "3125000000,250.1000000000931322574615478515625,0,0");
}

static void rates_agree_at_common_times_to_the_bit(void **state)
{
    (void)state;
    static char slow[1 << 20], fast[1 << 22];
    static const char *const rates[] = { "1000", "8000" };
    expect(run("sample", "--rate", "100", directory), STATUS_OK);
    memcpy(slow, out, sizeof slow);
    for (size_t r = 0; r < ARRAY_LEN(rates); r++) {
        expect(run("sample", "--rate", rates[r], directory), STATUS_OK);
        memcpy(fast, out, sizeof fast);
        int compared = 0;
        for (char *line = strtok(slow, "\n"); line != NULL;
             line = strtok(NULL, "\n"), compared++)
            assert_non_null(strstr(fast, line));
        assert_int_equal(compared, 314); /* heading and 313 samples */
        expect(run("sample", "--rate", "100", directory), STATUS_OK);
        memcpy(slow, out, sizeof slow);
    }
}

static void six_hours_drift_by_nothing(void **state)
{
    (void)state;
    write_move("s-curve", "[0 s, 10 mm], [21600 s, 300.3 mm]");
    expect(run("sample", "--rate", "1000", "--raw", "--from", "21599.999s",
               directory),
           STATUS_OK);
    assert_int_equal(lines_of(out), 3);
    assert_string_equal(row_at(out, "21600000000000"),
                        "21600000000000,1289778678989,0,0");
}

static void uneven_rates_are_rounded_once_per_sample(void **state)
{
    (void)state;
    expect(run("sample", "--rate", "23.976", "--to", "1 s", directory),
           STATUS_OK);
    /* k / 23.976: 41.708375 ms, 83.416750 ms, ... 959.292626 ms */
    row_at(out, "41708375");
    row_at(out, "83416750");
    row_at(out, "959292626");
    assert_int_equal(lines_of(out), 1 + 24);
}

static void samples_are_json_too(void **state)
{
    (void)state;
    expect(run("sample", "--rate", "10", "--json", "--axis", "pan",
               "examples/dolly"),
           STATUS_OK);
    cJSON *report = cJSON_Parse(out);
    assert_non_null(report);
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(report, "columns")),
                     4);
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(report, "rows")),
                     241);
    cJSON_Delete(report);
}

/* --- plan and files --- */

static void the_saved_tracks_are_whole_json_with_integers(void **state)
{
    (void)state;
    const char *path = run_path("tracks.json");
    expect(run("plan", "--out", path, directory), STATUS_OK);
    run_read(path, out, RUN_OUT_MAX);
    cJSON *report = cJSON_Parse(out);
    assert_non_null(report);
    const cJSON *axis =
        cJSON_GetArrayItem(cJSON_GetObjectItem(report, "axes"), 0);
    assert_true(number(axis, "end_ns_q12") == 3125000000. * 4096);
    const cJSON *segments = cJSON_GetObjectItem(axis, "segments");
    assert_true(cJSON_GetArraySize(segments) >= 8);
    const cJSON *coef =
        cJSON_GetObjectItem(cJSON_GetArrayItem(segments, 0), "coef");
    assert_int_equal(cJSON_GetArraySize(coef), 6);
    assert_null(strchr(out, 'e' - 32)); /* no exponents: 1E18 */
    cJSON_Delete(report);
    unlink(path);
}

static void a_file_that_cannot_be_written_leaves_nothing_behind(void **state)
{
    (void)state;
    int before = entries();
    expect(run("plan", "--out", run_path("no/such/place.json"), directory),
           STATUS_SYSTEM);
    assert_int_equal(lines_of(err), 1);
    mkdir(run_path("sub"), 0700);
    expect(run("plan", "--out", run_path("sub"), directory), STATUS_SYSTEM);
    assert_int_equal(entries(), before + 1);
    expect(run("plan", "--out", "/dev/full", directory), STATUS_SYSTEM);
    assert_non_null(strstr(err, "/dev/full: cannot write"));
}

static void an_abandoned_file_leaves_nothing_behind(void **state)
{
    (void)state;
    struct output output;
    int before = entries();
    assert_int_equal(output_open(&output, run_path("half")), 0);
    assert_int_equal(entries(), before + 1);
    output_abandon(&output);
    assert_int_equal(entries(), before);
    output_abandon(&output); /* again does nothing */
}

static void an_interrupt_while_writing_leaves_nothing_behind(void **state)
{
    (void)state;
    int before = entries();
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        struct output output;
        if (output_open(&output, run_path("half")) == 0 &&
            entries() == before + 1)
            raise(SIGINT);
        _exit(0);
    }
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFSIGNALED(status) && WTERMSIG(status) == SIGINT);
    assert_int_equal(entries(), before);
}

static void a_full_disk_under_stdout_is_status_3(void **state)
{
    (void)state;
    assert_int_equal(
        run_to("/dev/full", (const char *const[]){ "plan", rig, move, NULL }),
        STATUS_SYSTEM);
    assert_non_null(strstr(err, "standard output"));
}

static void a_link_stays_a_link(void **state)
{
    (void)state;
    struct stat status;
    const char *target = run_path("target.json");
    const char *link = run_path("link.json");
    run_write(target, "old");
    assert_int_equal(symlink(target, link), 0);
    expect(run("plan", "--out", link, directory), STATUS_OK);
    assert_int_equal(lstat(link, &status), 0);
    assert_true(S_ISLNK(status.st_mode));
    run_read(target, out, RUN_OUT_MAX);
    assert_non_null(strstr(out, "slew-tracks"));
}

static void plan_prints_the_segments_when_asked(void **state)
{
    (void)state;
    expect(run("plan", "--segments", directory), STATUS_OK);
    assert_non_null(strstr(out, "2000000000.000"));
    expect(run("plan", "--json", directory), STATUS_OK);
    cJSON *report = cJSON_Parse(out);
    assert_non_null(report);
    assert_true(number(report, "duration_s") == 3.125);
    cJSON_Delete(report);
}

/* --- run --- */

static void a_dry_run_writes_nothing(void **state)
{
    (void)state;
    int before = entries();
    expect(run("run", "--dry-run", "--telemetry", run_path("t.csv"), directory),
           STATUS_OK);
    assert_non_null(strstr(out, "3.125 s at 100 % speed"));
    assert_int_equal(entries(), before);
}

static void two_runs_write_the_same_telemetry(void **state)
{
    (void)state;
    static char first[1 << 21];
    const char *path = run_path("t.csv");
    for (int i = 0; i < 2; i++) {
        expect(run("run", "--telemetry", path, "--hold-at", "1s",
                   "--resume-after", "250ms", directory),
               STATUS_OK);
        run_read(path, i == 0 ? first : out, sizeof first);
    }
    assert_true(strlen(first) > 100000);
    assert_string_equal(first, out);
}

static void a_run_reports_and_its_telemetry_can_be_drawn(void **state)
{
    (void)state;
    const char *csv = run_path("t.csv"), *png = run_path("p.png"),
               *svg = run_path("p.svg");
    expect(run("run", "--json", "--telemetry", csv, "--plot", png, directory),
           STATUS_OK);
    cJSON *report = cJSON_Parse(out);
    assert_non_null(report);
    assert_string_equal(cJSON_GetObjectItem(report, "end")->valuestring,
                        "done");
    assert_true(number(report, "played_s") == 3.125);
    assert_string_equal(cJSON_GetObjectItem(report, "picture")->valuestring,
                        png);
    cJSON_Delete(report);
    assert_int_equal(access(png, R_OK), 0);
    expect(run("plot", "--telemetry", csv, "--out", svg, directory), STATUS_OK);
    run_read(svg, out, RUN_OUT_MAX);
    assert_non_null(strstr(out, "</svg>"));
    run_write(csv, "t_ns,phase,state,path_ns\n1,move,moving,x\n");
    expect_bad_input(run("plot", "--telemetry", csv, "--out", svg, directory),
                     "t.csv:2: 'x', expected a number");
}

/* Keys too close to be drawn: what is left is the same, from window or file. */
static void a_compiled_move_draws_as_the_move_itself(void **state)
{
    static char keys[8192], plain[1 << 22];
    const char *slt = run_path("m.slt"), *svg = run_path("p.svg");
    size_t used = 0;
    (void)state;
    for (int i = 0; i < 240; i++)
        used +=
            (size_t)snprintf(keys + used, sizeof keys - used, "%s[%d s, %d mm]",
                             i > 0 ? ", " : "", i, 10 + i * 7 % 13);
    write_move("s-curve", keys);
    expect(run("plot", "--out", svg, directory), STATUS_OK);
    run_read(svg, plain, sizeof plain);
    expect(run("compile", "--out", slt, directory), STATUS_OK);
    expect(run("plot", "--out", svg, rig, slt), STATUS_OK);
    run_read(svg, out, RUN_OUT_MAX);
    assert_string_equal(out, plain);
    expect_bad_input(run("plot", "--out", svg, "--compare", "all", rig, slt),
                     "is a compiled move");
    expect(run("run", "--plot", svg, rig, slt), STATUS_OK);
    run_read(svg, out, RUN_OUT_MAX);
    assert_non_null(strstr(out, "</svg>"));
    assert_true(strlen(out) > strlen(plain)); /* what the servo did, too */
}

static void a_key_that_cannot_be_planned_is_named_once(void **state)
{
    (void)state;
    write_move("bezier", "{t: 0 s, p: 10 mm, interpolation: constant}, "
                         "[1 s, 20 mm]");
    expect_bad_input(run("check", directory),
                     "move.yaml:5:57: key 2 of axis slide: constant keeps 10 ");
}

static void a_path_and_a_blend_go_all_the_way(void **state)
{
    static const char *const examples[] = { "examples/flyby",
                                            "examples/poses" };
    (void)state;
    for (size_t i = 0; i < 2; i++) {
        const char *svg = run_path("p.svg");
        expect(run("check", examples[i]), STATUS_OK);
        expect(run("sample", "--rate", "10", examples[i]), STATUS_OK);
        expect(run("plot", "--out", svg, examples[i]), STATUS_OK);
        expect(run("run", "--json", examples[i]), STATUS_OK);
        cJSON *report = cJSON_Parse(out);
        assert_non_null(report);
        assert_string_equal(cJSON_GetObjectItem(report, "end")->valuestring,
                            "done");
        cJSON_Delete(report);
    }
}

/* Counts per radian are a quotient of long numbers in every driver. */
static void joints_in_rad_run_on_every_kind_of_drive(void **state)
{
    (void)state;
    expect(run("run", "--json", "tests/data/rad"), STATUS_OK);
    cJSON *report = cJSON_Parse(out);
    assert_non_null(report);
    const cJSON *axes = cJSON_GetObjectItem(report, "axes");
    assert_int_equal(cJSON_GetArraySize(axes), 4);
    for (int i = 0; i < 4; i++) {
        const cJSON *axis = cJSON_GetArrayItem(axes, i);
        const cJSON *error = cJSON_GetObjectItem(axis, "end_error");
        assert_string_equal(cJSON_GetObjectItem(axis, "unit")->valuestring,
                            "rad");
        assert_true(error->valuedouble < 0.001 && error->valuedouble > -0.001);
    }
    cJSON_Delete(report);
}

/* With pan, tilt and roll 0 the head looks along x: w = 1/2 each. */
static void a_camera_is_sampled_as_a_quaternion(void **state)
{
    (void)state;
    run_write(move, "path:\n  axes: [x, y, z]\n"
                    "  points: [[0, 0, 900], [1000, 0, 900]]\n"
                    "  speed: {law: quintic, time: 4 s}\n"
                    "camera:\n  axes: {pan: pan, tilt: tilt, roll: roll}\n"
                    "  look: {at: [2000, 0, 900]}\n"
                    "  roll: {keys: [[0 s, 0], [2 s, 60 deg]]}\n");
    expect(run("sample", "--json", "--quaternion", "--rate", "0.25",
               "examples/flyby/rig.yaml", move),
           STATUS_OK);
    cJSON *report = cJSON_Parse(out);
    assert_non_null(report);
    /* right is -y, up z, back -x; then 60 degrees about x */
    const cJSON *rows = cJSON_GetObjectItem(report, "rows");
    const double want[2][4] = {
        { 0.5, 0.5, -0.5, -0.5 },
        { (sqrt(3) - 1) / 4, (sqrt(3) + 1) / 4, -(sqrt(3) - 1) / 4,
          -(sqrt(3) + 1) / 4 },
    };
    for (int row = 0; row < 2; row++) {
        double sign = 0;
        for (int i = 0; i < 4; i++) {
            const double got =
                cJSON_GetArrayItem(cJSON_GetArrayItem(rows, row), 19 + i)
                    ->valuedouble;
            sign = i == 0 ? (got < 0 ? -1 : 1) : sign;
            if (fabs(sign * got - want[row][i]) > 1e-6)
                fail_msg("row %d: %d is %g", row, i, got);
        }
    }
    cJSON_Delete(report);
    expect_bad_input(
        run("sample", "--quaternion", "--rate", "1", "examples/dolly"),
        "the move has no camera");
}

static void plan_says_how_long_and_how_fast_a_path_is(void **state)
{
    (void)state;
    expect(run("plan", "--json", "examples/flyby"), STATUS_OK);
    cJSON *report = cJSON_Parse(out);
    const cJSON *path = cJSON_GetObjectItem(report, "path");
    assert_non_null(path);
    assert_true(fabs(number(path, "speed_peak") - 380) < 1e-6);
    assert_true(number(path, "length_error") < 1e-9);
    assert_true(number(path, "bound") <= 2e-6);
    cJSON_Delete(report);
    expect(run("plan", "--rules", "examples/flyby"), STATUS_OK);
    assert_non_null(strstr(out, "380.000000 mm/s along it"));
    assert_non_null(strstr(out, "simpson"));
    expect(run("check", "examples/flyby"), STATUS_OK);
    assert_non_null(strstr(out, "380.000000 mm/s along it"));
}

static void a_path_that_cannot_be_planned_names_its_place(void **state)
{
    (void)state;
    run_write(move, "path:\n  axes: [x, y]\n  points: [[0, 0], [9, 9]]\n"
                    "  speed: {law: constant, from: 1, time: 1 s}\n");
    expect_bad_input(run("check", "examples/flyby/rig.yaml", move),
                     "move.yaml:4:10: the speed law covers 1 of the path's");
    expect_bad_input(run("plot", "--out", "p.svg", "--compare", "linear",
                         "--axis", "x", "examples/flyby"),
                     "no keys drive the axis x");
}

static void too_many_drives_for_the_bus_are_refused(void **state)
{
    (void)state;
    char text[2048];
    snprintf(text, sizeof text, "%s", small_rig);
    memcpy(strstr(text, "1 Mbit/s"), "125 kbit", 8);
    memmove(strstr(text, "125 kbit") + 10, strstr(text, "125 kbit") + 8,
            strlen(strstr(text, "125 kbit") + 8) + 1);
    memcpy(strstr(text, "125 kbit") + 8, "/s", 2);
    run_write(rig, text);
    const char *const sentence =
        "rig.yaml:3:3: bus can0 would need 230.1 % of its time, expected at "
        "most 100 %: a tick of 2.33 ms, or 500 kbit/s "
        "would fit\n";
    expect(run("check", directory), STATUS_REFUSED);
    assert_non_null(strstr(err, sentence));
    expect(run("run", directory), STATUS_REFUSED);
    assert_non_null(strstr(err, sentence));
}

static void real_drives_are_asked_for_and_need_an_interface(void **state)
{
    (void)state;
    expect_bad_input(run("run", "--json", "--real", directory),
                     "slew run: REAL drives would move, expected --yes");
    expect_bad_input(run("run", "--json", "--real", "--yes", directory),
                     "bus can0 has no interface");
    expect_bad_input(run("run", "--json", "--real", "--yes", "--interface",
                         "nocan7", directory),
                     "there is no interface nocan7");
    expect_bad_input(
        run("run", "--json", "--real", "--yes", "--interface", "lo", directory),
        "lo is not a CAN interface");
    expect_bad_input(run("run", "--interface", "can1=can7", directory),
                     "'can1=can7' names no bus of the rig");
    /* what a dry run can find out, it does, and ends as the real one would */
    expect(run("run", "--dry-run", "--real", "--interface", "can0=nocan7",
               directory),
           STATUS_INPUT);
    assert_non_null(strstr(out, "REAL drives"));
    assert_non_null(strstr(out, "interface nocan7"));
    assert_non_null(strstr(err, "there is no interface nocan7"));
}

static void simulated_drives_need_an_interface_to_be_seen_on(void **state)
{
    (void)state;
    expect_bad_input(run("sim", directory), "bus can0 has no interface");
    expect_bad_input(run("sim", "--interface", "nocan7", directory),
                     "there is no interface nocan7");
    expect_bad_input(run("sim", "--interface", "", rig), "--interface");
    expect_bad_input(run("sim", run_path("none.yaml")), "none.yaml");
}

/* A port that this process has taken. */
static int take_port(uint16_t *port)
{
    struct sockaddr_in at = { .sin_family = AF_INET,
                              .sin_addr.s_addr = htonl(INADDR_LOOPBACK) };
    socklen_t length = sizeof at;
    const int taken = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);

    assert_true(taken >= 0);
    assert_int_equal(bind(taken, (struct sockaddr *)&at, length), 0);
    assert_int_equal(listen(taken, 1), 0);
    assert_int_equal(getsockname(taken, (struct sockaddr *)&at, &length), 0);
    *port = ntohs(at.sin_port);
    return taken;
}

static void a_port_that_another_program_has_is_said_so(void **state)
{
    char text[2048], says[128];
    uint16_t port;
    const int taken = take_port(&port);

    (void)state;
    snprintf(text, sizeof text,
             "tick: 5 ms\n"
             "buses: {net1: {kind: modbus-tcp, host: 127.0.0.1, port: %u}}\n"
             "axes:\n"
             "  pan:\n"
             "    unit: deg\n"
             "    limits: {position: [-170, 170], velocity: 30, acceleration: "
             "10, jerk: 30}\n"
             "    following_error: {floor: 3 deg, time: 100 ms}\n"
             "    drive: {kind: modbus, bus: net1, node: 1, map: "
             "lexium-32, counts: 500000 per rev}\n",
             port);
    run_put("taken.yaml", text);
    snprintf(says, sizeof says,
             "slew sim: bus net1: TCP port %u of 127.0.0.1 is in use by "
             "another program, expected one that is free\n",
             port);
    assert_int_equal(run("sim", "--for", "100ms", run_path("taken.yaml")),
                     STATUS_INPUT);
    assert_string_equal(err, says);
    close(taken);
}

static void a_drive_is_judged_by_its_data_sheet(void **state)
{
    (void)state;
    const char *sheet = run_path("servo.eds");
    expect(run("sim", "--eds", directory), STATUS_OK);
    run_write(sheet, out);
    expect(run("drive", "info", sheet), STATUS_OK);
    assert_non_null(strstr(out, "this drive will do"));
    expect(run("drive", "--json", "info", sheet), STATUS_OK);
    assert_non_null(strstr(out, "\"ok\""));
    run_write(sheet, "[1000]\nDataType=7\nAccessType=ro\n[6502]\nDataType=7\n"
                     "AccessType=ro\nDefaultValue=0x25\n");
    expect(run("drive", "info", sheet), STATUS_REFUSED);
    assert_non_null(strstr(out, "has no CSP"));
    assert_non_null(strstr(out, "lacks 18 of the objects"));
    expect_bad_input(run("drive", "info", rig),
                     "rig.yaml is a rig, expected RIG AXIS");
    expect_bad_input(run("drive", "look", sheet), "expected info");
}

#define RUN(test) cmocka_unit_test_setup_teardown(test, open_bench, run_close)

int main(void)
{
    const struct CMUnitTest tests[] = {
        RUN(help_shows_every_option_and_parses_it),
        RUN(bad_arguments_get_one_line_and_status_2),
        RUN(a_bad_file_is_named_with_its_place),
        RUN(a_good_move_passes),
        RUN(what_is_hardly_meant_is_a_warning),
        RUN(every_violation_has_axis_time_value_limit),
        RUN(override_scales_the_limits),
        RUN(a_move_over_its_limits_is_not_run),
        RUN(a_key_time_gives_the_key_to_the_bit),
        RUN(rates_agree_at_common_times_to_the_bit),
        RUN(six_hours_drift_by_nothing),
        RUN(uneven_rates_are_rounded_once_per_sample),
        RUN(samples_are_json_too),
        RUN(the_saved_tracks_are_whole_json_with_integers),
        RUN(a_file_that_cannot_be_written_leaves_nothing_behind),
        RUN(an_abandoned_file_leaves_nothing_behind),
        RUN(an_interrupt_while_writing_leaves_nothing_behind),
        RUN(a_full_disk_under_stdout_is_status_3),
        RUN(a_link_stays_a_link),
        RUN(plan_prints_the_segments_when_asked),
        RUN(a_dry_run_writes_nothing),
        RUN(two_runs_write_the_same_telemetry),
        RUN(a_run_reports_and_its_telemetry_can_be_drawn),
        RUN(a_compiled_move_draws_as_the_move_itself),
        RUN(a_key_that_cannot_be_planned_is_named_once),
        RUN(a_path_and_a_blend_go_all_the_way),
        RUN(joints_in_rad_run_on_every_kind_of_drive),
        RUN(a_camera_is_sampled_as_a_quaternion),
        RUN(plan_says_how_long_and_how_fast_a_path_is),
        RUN(a_path_that_cannot_be_planned_names_its_place),
        RUN(too_many_drives_for_the_bus_are_refused),
        RUN(a_drive_is_judged_by_its_data_sheet),
        RUN(real_drives_are_asked_for_and_need_an_interface),
        RUN(simulated_drives_need_an_interface_to_be_seen_on),
        RUN(a_port_that_another_program_has_is_said_so),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
