/* tests/firmware/linux/commands/run/test_cmd_jog.c - slew jog, home and monitor as
 * a person uses them: words, and the keys of a real pseudo-terminal.
 *
 * The program and this one may be paused by the machine at any time, together
 * or alone: what is awaited is what the program says, and how far the axis goes
 * is judged by what it said before.  Reads the real clock.
 * Takes long. */
#define _XOPEN_SOURCE 700 /* posix_openpt, of terminal_program.h */
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "firmware/linux/commands/command.h"
#include "tests/support/check.h"
#include "tests/support/terminal_program.h"

#define RIG   "tests/data/homing"
#define LEFT  "\033[D"
#define RIGHT "\033[C"
#define FAST  "\033[1;2C"
#define DOWN  "\033[B"
#define CLEAR "\033[K" /* before every status line, ten in its own second */

static char directory[] = "/tmp/slew-jog-XXXXXX";
static char path[64];

static int make_directory(void **state)
{
    (void)state;
    if (mkdtemp(directory) == NULL)
        return -1;
    snprintf(path, sizeof path, "%s/move.yaml", directory);
    return 0;
}

static int remove_directory(void **state)
{
    (void)state;
    unlink(path);
    return rmdir(directory);
}

/* What a status line says. */
struct status_line {
    char axis[16];
    double pos, vel;
};

static bool read_line(const char *text, struct status_line *to)
{
    char unit[16];
    const char *vel = strstr(text, "  ");
    return vel != NULL &&
           sscanf(text, "%15s %lf %15s", to->axis, &to->pos, unit) == 3 &&
           sscanf(vel, " %lf %15[^/]/s ", &to->vel, unit) == 2;
}

/* The last whole one. */
static bool last_line(struct status_line *to)
{
    bool any = false;
    for (const char *at = heard; (at = strstr(at, CLEAR)) != NULL; at++) {
        struct status_line next;
        if (strstr(at, "/s") != NULL && read_line(at + strlen(CLEAR), &next)) {
            *to = next;
            any = true;
        }
    }
    return any;
}

static struct status_line shown(void)
{
    struct status_line last;
    const double end_s = now_s() + FOR_EVER_S;
    while (!last_line(&last)) {
        if (now_s() > end_s)
            fail_msg("no status line in:\n%s", heard);
        hear(0.02);
    }
    return last;
}

static bool near(double got, double want, double by)
{
    return got >= want - by && got <= want + by;
}

/* As a terminal repeats a key that is held, until the axis has the speed and
 * has gone so far; what was shown then, and before the last key. */
static struct status_line before_last;
static struct status_line hold(const char *key, double speed,
                               double displacement)
{
    const struct status_line from = shown();
    struct status_line at = from;
    const double end_s = now_s() + FOR_EVER_S;
    while (!near(at.vel, speed, 0.5) || near(at.pos, from.pos, displacement)) {
        if (now_s() > end_s)
            fail_msg("not %.1f at %.1f mm/s from %.1f mm on:\n%s", displacement,
                     speed, from.pos, heard);
        before_last = at;
        press(key);
        hear(0.03);
        at = shown();
    }
    return at;
}

/* Where it stands: the same on ten lines. */
static struct status_line standing(void)
{
    struct status_line before = shown(), now;
    for (int i = 0; i < 100; i++, before = now) {
        forget();
        expect_times(CLEAR, 11);
        now = shown();
        if (near(now.pos, before.pos, 0.0005) && near(now.vel, 0, 0.005))
            return now;
    }
    fail_msg("it goes on:\n%s", heard);
    return before;
}

static int run(const char *const argv[])
{
    forget();
    start(argv, false);
    return finish();
}

/* --- words ---------------------------------------------------------------- */

static void words_say_what_moves(void **state)
{
    static const struct {
        const char *argv[12];
        int status;
        const char *says;
    } rows[] = {
        { { "slew", "jog", RIG, "slide", "+10mm" },
          0,
          "from 0.0000 to 10.0000 mm (unhomed)" },
        { { "slew", "jog", RIG, "slide", "-10", "mm" },
          0,
          "from 0.0000 to -10.0000 mm" },
        { { "slew", "jog", RIG, "slide", "at", "-5mm/s", "for", "2", "s" },
          0,
          "from 0.0000 to -10.0000 mm" },
        { { "slew", "jog", "--home", RIG, "slide", "to", "45mm" },
          0,
          "to 45.0000 mm in" },
        { { "slew", "jog", "--dry-run", RIG, "slide", "+1", "cm" },
          0,
          "10 mm from where it is, 0.358 s" },
        { { "slew", "jog", "examples/dolly", "pan", "to", "12deg" },
          0,
          "to 12.000" },
        { { "slew", "jog", RIG, "slide", "to", "45mm" },
          1,
          "slide is not homed" },
        { { "slew", "jog", RIG, "slide", "to", "601mm" },
          1,
          "limit of slide, expected a position from" },
        { { "slew", "jog", "examples/dolly", "dolly", "-200mm" },
          1,
          "below the lower limit of dolly" },
        { { "slew", "jog", RIG, "slide", "at", "201mm/s", "for", "1s" },
          1,
          "above the limit of slide" },
        { { "slew", "jog", RIG, "slide", "at", "5mm/s" }, 2, "expected +10mm" },
        { { "slew", "jog", RIG, "slide", "10mm" }, 2, "expected +10mm" },
        { { "slew", "jog", RIG, "slide", "+10deg" }, 2, "is an angle" },
        { { "slew", "jog", RIG, "crane", "+1" }, 2, "no axis \"crane\"" },
        { { "slew", "jog", RIG }, 2, "which axis?" },
        { { "slew", "jog", "--real", RIG, "slide", "+1" },
          2,
          "expected --yes" },
        { { "slew", "jog", RIG, "slide" }, 2, "is not a terminal" },
        { { "slew", "home", RIG }, 0, "homed" },
        { { "slew", "home", "--dry-run", RIG, "lift" }, 0, "limit-positive" },
        { { "slew", "home", "examples/dolly" }, 2, "no axis of the rig" },
        { { "slew", "home", RIG, "crane" }, 2, "no axis \"crane\"" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const int status = run(rows[i].argv);
        if (status != rows[i].status || strstr(heard, rows[i].says) == NULL)
            fail_msg("row %zu: status %d, expected %d and '%s':\n%s", i, status,
                     rows[i].status, rows[i].says, heard);
    }
}

static void monitor_shows_everything_and_enables_nothing(void **state)
{
    static const struct {
        const char *argv[10];
        int status;
        const char *says[4];
    } rows[] = {
        { { "slew", "monitor", "--once", RIG },
          0,
          { "slide", "switch on disabled", "(unhomed)", "stop (e-stop): -" } },
        { { "slew", "monitor", "--once", "examples/dolly" },
          0,
          { "dolly", "120.0000", "can1: error-active", "% in use" } },
        { { "slew", "monitor", "--once", "examples/modbus" },
          0,
          { "pan", "-58.0003", "line1: ", "0 errors" } },
        { { "slew", "monitor", "--once", "--json", RIG },
          0,
          { "\"statusword\":592", "\"homed\":false", "\"kind\":\"home\"",
            "\"load\":0." } },
        { { "slew", "monitor", "--for", "1s", "--rate", "4", "--json", RIG },
          0,
          { "{\"t_s\":0.25,", "{\"t_s\":0.5,", "{\"t_s\":0.75,",
            "{\"t_s\":1," } },
        { { "slew", "monitor" }, 2, { "which files?", "", "", "" } },
        { { "slew", "monitor", "--real", RIG },
          2,
          { "bus can0 has no interface", "", "", "" } },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const int status = run(rows[i].argv);
        if (status != rows[i].status)
            fail_msg("row %zu: status %d:\n%s", i, status, heard);
        for (int k = 0; k < 4; k++)
            if (strstr(heard, rows[i].says[k]) == NULL)
                fail_msg("row %zu: no '%s' in:\n%s", i, rows[i].says[k], heard);
        assert_null(strstr(heard, "operation enabled"));
    }
}

/* On a terminal the table is drawn in place until Ctrl-C. */
static void monitor_is_live_on_a_terminal(void **state)
{
    const char *const argv[] = { "slew", "monitor", "--rate", "20", RIG, NULL };
    (void)state;
    forget();
    start(argv, true);
    expect("switch on disabled");
    forget();
    expect("lines: stop (e-stop)");
    expect_times("\033[H", 40); /* two seconds: all drives have been found */
    press("\003");
    assert_int_equal(finish(), 0);
}

static void a_program_reads_the_result(void **state)
{
    const char *const jog[] = { "slew",  "jog",   "--json", RIG,
                                "slide", "+10mm", NULL };
    const char *const home[] = { "slew", "home", "--json", RIG, NULL };
    (void)state;
    assert_int_equal(run(jog), 0);
    assert_non_null(strstr(heard, "\"homed\":\tfalse"));
    assert_non_null(strstr(heard, "\"ok\":\ttrue"));
    assert_int_equal(run(home), 0);
    assert_non_null(strstr(heard, "\"result\":\t\"homed\""));
}

/* An axis whose following error at speed is over half of its limit. */
static void what_an_axis_warns_of_is_said(void **state)
{
    char rig[64];
    const char *const jog[] = { "slew",  "jog",   "--home", rig,
                                "slide", "+30mm", NULL };
    const char *const home[] = { "slew", "home", "--json", rig, NULL };
    (void)state;
    snprintf(rig, sizeof rig, "%s/rig.yaml", directory);
    FILE *file = fopen(rig, "w");
    assert_non_null(file);
    fputs("buses: {can: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
          "axes:\n"
          "  slide:\n"
          "    unit: mm\n"
          "    limits: {position: [-10 mm, 100 mm], velocity: 100 mm/s,"
          " acceleration: 1000 mm/s2}\n"
          "    following_error: {floor: 0.06 mm}\n"
          "    drive: {kind: cia402, bus: can, node: 1, counts: 4096 per mm}\n"
          "    homing: {by: switch, speed: 25 mm/s, slow: 5 mm/s,"
          " distance: 100 mm, position: -3 mm}\n"
          "    sim: {start: 20 mm, home_switch: [-10 mm, -3 mm]}\n",
          file);
    fclose(file);
    assert_int_equal(run(jog), 0);
    assert_non_null(strstr(heard, "slew jog: warning: slide: following error "
                                  "over half of its limit, "));
    assert_int_equal(run(home), 0);
    assert_non_null(strstr(heard, "slew home: warning: slide: following error "
                                  "over half of its limit, "));
    unlink(rig);
}

/* --- keys ------------------------------------------------------------------ */

static const char *const by_keys[] = { "slew", "jog",     "--dead-man",
                                       "1s",   "--speed", "20mm/s",
                                       RIG,    "slide",   NULL };

/* A second at the speed, from the key that was the last one: more than that
 * from what was shown before it, less from what was shown after it.  Lines are
 * 2 mm or 10 mm apart. */
static void an_arrow_jogs_while_it_is_held(void **state)
{
    static const struct {
        const char *key;
        double vel, displacement, least, most;
    } rows[] = {
        { RIGHT, 20, 20, 18, 28 },
        { FAST, 100, 0, 90, 140 }, /* five times */
        { LEFT, -20, 20, 18, 28 },
    };
    (void)state;
    forget();
    start(by_keys, true);
    expect("ready");
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const double after =
            hold(rows[i].key, rows[i].vel, rows[i].displacement).pos;
        const double at = standing().pos;
        const double whole = fabs(at - before_last.pos),
                     rest = fabs(at - after);
        if (whole < rows[i].least || rest > rows[i].most)
            fail_msg("row %zu: %.3f mm and %.3f mm with the last key", i, whole,
                     rest);
    }
    press("q");
    assert_int_equal(finish(), 0);
}

/* Long before the last key is over: 200 mm from there. */
static void space_stops_at_once(void **state)
{
    const char *const argv[] = { "slew", "jog",     "--dead-man",
                                 "10s",  "--speed", "20mm/s",
                                 RIG,    "slide",   NULL };
    (void)state;
    forget();
    start(argv, true);
    expect("ready");
    const double from = hold(LEFT, -20, 0).pos;
    press(" ");
    const double displacement = standing().pos - from;
    if (displacement > 0 || displacement < -100)
        fail_msg("%.3f mm after space", displacement);
    press("q");
    assert_int_equal(finish(), 0);
}

/* `h`, until it stands where it is to go. */
static void home(void)
{
    forget();
    press("h");
    expect("going to its place");
    (void)standing();
}

static void choose_next(const char *axis)
{
    forget();
    press(DOWN);
    expect(axis);
    (void)standing();
}

static void h_homes_and_s_sets_keys_of_a_move(void **state)
{
    const char *const argv[] = { "slew",   "jog",   "--speed",     "50mm/s",
                                 "--keys", path,    "--key-every", "3s",
                                 RIG,      "slide", NULL };
    static const char rig[] = RIG "/rig.yaml";
    const char *const check[] = { "slew", "check", rig, path, NULL };
    (void)state;
    forget();
    start(argv, true);
    expect("ready");
    expect("(unhomed)");
    press("s");
    expect("not while an axis is unhomed");
    press("h");
    expect("searching");
    press(DOWN);
    expect("it is being homed");
    expect("going to its place");
    assert_string_equal(standing().axis, "slide");
    choose_next("lift");
    home();
    choose_next("pan");
    press("h");
    (void)standing();
    choose_next("slide ");
    press("s");
    expect("key 1 set");
    (void)hold(RIGHT, 50, 30);
    (void)standing();
    press("s");
    expect("key 2 set");
    press("q");
    assert_int_equal(finish(), 0);
    assert_int_equal(run(check), 0);
    assert_int_equal(run(argv), 2); /* the file is there */
    assert_non_null(strstr(heard, "is there already"));
}

static void a_terminal_that_is_gone_stops_the_axis(void **state)
{
    int status = -1;
    (void)state;
    forget();
    start(by_keys, true);
    expect("ready");
    (void)hold(RIGHT, 20, 5);
    close(line);
    for (int i = 0; i < 1200 && waitpid(child, &status, WNOHANG) == 0; i++)
        nanosleep(&(struct timespec){ .tv_nsec = 50000000 }, NULL);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 0);
}

static void the_terminal_is_as_it_was(void **state)
{
    struct termios before, after;
    (void)state;
    forget();
    const int master = posix_openpt(O_RDWR | O_NOCTTY);
    assert_true(grantpt(master) == 0 && unlockpt(master) == 0);
    const int slave = open(ptsname(master), O_RDWR | O_NOCTTY);
    tcgetattr(slave, &before);
    child = fork();
    if (child == 0) {
        char *argv[] = { (char[]){ "slew" }, (char[]){ "jog" }, (char[]){ RIG },
                         (char[]){ "slide" }, NULL };
        dup2(slave, 0);
        dup2(slave, 1);
        dup2(slave, 2);
        exit((int)command_main(4, argv));
    }
    line = master;
    expect("ready");
    tcgetattr(slave, &after);
    assert_true((after.c_lflag & ICANON) == 0);
    press("q");
    int status = -1;
    while (waitpid(child, &status, WNOHANG) == 0)
        hear(0.05);
    tcgetattr(slave, &after);
    assert_int_equal(after.c_lflag, before.c_lflag);
    assert_int_equal(fcntl(slave, F_GETFL) & O_NONBLOCK, 0);
    close(slave);
    close(master);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(words_say_what_moves),
        cmocka_unit_test(monitor_shows_everything_and_enables_nothing),
        cmocka_unit_test(monitor_is_live_on_a_terminal),
        cmocka_unit_test(a_program_reads_the_result),
        cmocka_unit_test(what_an_axis_warns_of_is_said),
        cmocka_unit_test(an_arrow_jogs_while_it_is_held),
        cmocka_unit_test(space_stops_at_once),
        cmocka_unit_test(h_homes_and_s_sets_keys_of_a_move),
        cmocka_unit_test(a_terminal_that_is_gone_stops_the_axis),
        cmocka_unit_test(the_terminal_is_as_it_was),
    };
    signal(SIGPIPE, SIG_IGN);
    return cmocka_run_group_tests_name("cmd_jog", tests, make_directory,
                                       remove_directory);
}
