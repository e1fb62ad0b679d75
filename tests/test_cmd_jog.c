/* tests/test_cmd_jog.c - slew jog, home and monitor as a person uses them:
 * words, and the keys of a real pseudo-terminal. */
#define _XOPEN_SOURCE 700 /* posix_openpt */
#include <fcntl.h>
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
#include "tests/check.h"

#define RIG   "tests/data/homing"
#define ROOM  65536
#define LEFT  "\033[D"
#define RIGHT "\033[C"
#define FAST  "\033[1;2C"
#define DOWN  "\033[B"

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

/* --- a program and what it writes ---------------------------------------- */

static char heard[ROOM];
static size_t heard_count;
static pid_t child;
static int line;

static void start(const char *const argv[], bool terminal)
{
    static char copy[16][64];
    char *word[17] = { NULL };
    int argc = 0, pipes[2] = { -1, -1 };
    for (; argv[argc] != NULL; argc++) {
        snprintf(copy[argc], sizeof copy[argc], "%s", argv[argc]);
        word[argc] = copy[argc];
    }
    heard_count = 0;
    line = terminal ? posix_openpt(O_RDWR | O_NOCTTY) : -1;
    if (terminal)
        assert_true(grantpt(line) == 0 && unlockpt(line) == 0);
    else
        assert_int_equal(pipe(pipes), 0);
    child = fork();
    assert_true(child >= 0);
    if (child > 0) {
        if (!terminal) {
            close(pipes[1]);
            line = pipes[0];
        }
        return;
    }
    setsid();
    const int in =
        terminal ? open(ptsname(line), O_RDWR) : open("/dev/null", O_RDONLY);
    const int out = terminal ? in : pipes[1];
    dup2(in, 0);
    dup2(out, 1);
    dup2(out, 2);
    close(line); /* only the parent holds the other end */
    exit((int)command_main(argc, word));
}

static double now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec / 1e9;
}

/* Read for at most so long; false: the other side has gone. */
static bool hear(double seconds)
{
    struct pollfd ready = { .fd = line, .events = POLLIN };
    if (poll(&ready, 1, (int)(seconds * 1000)) <= 0)
        return true;
    const ssize_t count =
        read(line, heard + heard_count, ROOM - 1 - heard_count);
    if (count <= 0)
        return false;
    heard_count += (size_t)count;
    heard[heard_count] = 0;
    if (heard_count > ROOM / 2) { /* the end is what matters */
        memmove(heard, heard + ROOM / 4, heard_count - ROOM / 4 + 1);
        heard_count -= ROOM / 4;
    }
    return true;
}

static void listen_for(double seconds)
{
    const double end_s = now_s() + seconds;
    while (now_s() < end_s)
        hear(0.01);
}

static void expect(const char *text, double seconds)
{
    const double end_s = now_s() + seconds;
    while (strstr(heard, text) == NULL) {
        if (now_s() > end_s)
            fail_msg("no '%s' in:\n%s", text, heard);
        hear(0.02);
    }
}

static int finish(void)
{
    int status = -1;
    while (hear(20.0) && heard_count < ROOM - 1)
        if (waitpid(child, &status, WNOHANG) == child)
            break;
    if (status == -1)
        waitpid(child, &status, 0);
    for (int i = 0; i < 20 && hear(0.01); i++)
        ;
    close(line);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static void press(const char *key)
{
    assert_int_equal(write(line, key, strlen(key)), (ssize_t)strlen(key));
}

/* As a terminal repeats a key that is held, faster than a dead-man waits. */
static void hold(const char *key, double seconds)
{
    const double end_s = now_s() + seconds;
    while (now_s() < end_s) {
        press(key);
        hear(0.03);
    }
}

/* The last position that the status line has shown. */
static double shown(void)
{
    const char *at = heard, *next;
    double value = 0;
    while ((next = strstr(at, "slide ")) != NULL) {
        at = next + 1;
        (void)sscanf(next, "slide %lf", &value);
    }
    return value;
}

static void forget(void)
{
    heard_count = 0;
    heard[0] = 0;
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
          "outside the limits of slide" },
        { { "slew", "jog", "examples/dolly", "dolly", "-200mm" },
          1,
          "outside its limits" },
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
        { { "slew", "jog", RIG, "slide" }, 2, "is no terminal" },
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
    expect("switch on disabled", 10);
    forget();
    expect("\033[H", 2);
    expect("lines: stop (e-stop)", 2);
    listen_for(2); /* all drives have been found */
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

/* --- keys ------------------------------------------------------------------ */

static const char *const by_keys[] = { "slew",  "jog",     "--dead-man",
                                       "150ms", "--speed", "20mm/s",
                                       RIG,     "slide",   NULL };

static void an_arrow_jogs_while_it_is_held(void **state)
{
    (void)state;
    forget();
    start(by_keys, true);
    expect("ready", 10);
    hold(RIGHT, 1.0);
    listen_for(0.6); /* nothing comes any more: it stops */
    const double at_mm = shown();
    if (at_mm < 14 || at_mm > 30)
        fail_msg("at %.3f mm after a second at 20 mm/s:\n%s", at_mm, heard);
    forget();
    listen_for(0.5);
    if (shown() < at_mm - 0.01 || shown() > at_mm + 0.01)
        fail_msg("went on from %.3f mm to %.3f mm", at_mm, shown());
    hold(FAST, 1.0); /* five times */
    listen_for(0.6);
    assert_true(shown() > at_mm + 60 && shown() < at_mm + 150);
    hold(LEFT, 0.5);
    press(" "); /* at once */
    listen_for(0.5);
    press("q");
    assert_int_equal(finish(), 0);
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
    expect("ready", 10);
    expect("(unhomed)", 2);
    press("s");
    expect("not while an axis is unhomed", 2);
    press("h");
    expect("searching", 2);
    expect("going to its place", 20);
    press(DOWN); /* refused while it moves: stops first */
    listen_for(1.5);
    forget();
    press(DOWN);
    expect("lift", 2);
    press("h");
    expect("going to its place", 30);
    listen_for(2);
    press(DOWN);
    expect("pan", 2);
    press("h");
    listen_for(0.5);
    press(DOWN);
    expect("slide ", 2);
    press("s");
    expect("key 1 set", 2);
    hold(RIGHT, 1.0);
    listen_for(1.0);
    press("s");
    expect("key 2 set", 2);
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
    expect("ready", 10);
    hold(RIGHT, 0.5);
    close(line);
    for (int i = 0; i < 100 && waitpid(child, &status, WNOHANG) == 0; i++)
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
    expect("ready", 10);
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
        cmocka_unit_test(an_arrow_jogs_while_it_is_held),
        cmocka_unit_test(h_homes_and_s_sets_keys_of_a_move),
        cmocka_unit_test(a_terminal_that_is_gone_stops_the_axis),
        cmocka_unit_test(the_terminal_is_as_it_was),
    };
    signal(SIGPIPE, SIG_IGN);
    return cmocka_run_group_tests_name("cmd_jog", tests, make_directory,
                                       remove_directory);
}
