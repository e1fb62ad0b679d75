/* tests/firmware/linux/commands/run/test_served.c - slew jog, home and monitor
 * where a service has the rig: they ask it, and what it moves for them stops when
 * they hang or are killed.
 *
 * A tick of 20 ms, so that a busy machine loses none.  Reads the real clock.
 * Takes long. */
#define _XOPEN_SOURCE 700 /* posix_openpt, of terminal_program.h */
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/run/served.h"
#include "firmware/linux/service/place.h"
#include "firmware/linux/service/service.h"
#include "tests/support/check.h"
#include "tests/support/terminal_program.h"

#define RIGHT "\033[C"

static const char rig_text[] =
    "title: Served\n"
    "tick: 20 ms\n"
    "watchdog: 100 ms\n"
    "buses: {can: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "axes:\n"
    "  slide:\n"
    "    unit: mm\n"
    "    limits: {position: [-1000 mm, 1000 mm], velocity: 100 mm/s,"
    " acceleration: 1000 mm/s2}\n"
    "    following_error: {floor: 50 mm, time: 200 ms}\n"
    "    drive: {kind: cia402, bus: can, node: 1, counts: 4096 per mm}\n"
    "  lift:\n"
    "    unit: mm\n"
    "    limits: {position: [0 mm, 300 mm], velocity: 100 mm/s,"
    " acceleration: 1000 mm/s2}\n"
    "    following_error: {floor: 50 mm, time: 200 ms}\n"
    "    drive: {kind: cia402, bus: can, node: 2, counts: 4096 per mm}\n"
    "    homing: {by: switch, speed: 50 mm/s, slow: 5 mm/s, distance: 400 mm,"
    " position: -3 mm}\n"
    "    sim: {start: 40 mm, home_switch: [-10 mm, -3 mm]}\n";

static char directory[] = "/tmp/slew-served-XXXXXX";
static char rig[64];
static pid_t service;

/* --- the service --- */

static int service_up(void **state)
{
    const struct service_config config = { .rig_path = rig, .cpu = -1 };
    struct service_link link;
    (void)state;
    fflush(NULL);
    service = fork();
    if (service == 0)
        _exit((int)service_run(&config));
    for (double end_s = now_s() + FOR_EVER_S; now_s() < end_s;) {
        if (service_link_open(&link, NULL, rig, true) == 0) {
            service_link_close(&link);
            return 0;
        }
        nanosleep(&(struct timespec){ .tv_nsec = 10000000 }, NULL);
    }
    return -1;
}

/* It stops, and confirms that torque is off. */
static int service_down(void **state)
{
    int status = -1;
    (void)state;
    kill(service, SIGTERM);
    return waitpid(service, &status, 0) == service && WIFEXITED(status) &&
                   WEXITSTATUS(status) == 0
               ? 0
               : -1;
}

static int make_rig(void **state)
{
    (void)state;
    if (mkdtemp(directory) == NULL)
        return -1;
    snprintf(rig, sizeof rig, "%s/rig.yaml", directory);
    (void)setenv("SLEW_RUN_DIR", directory, 1);
    FILE *file = fopen(rig, "w");
    if (file == NULL)
        return -1;
    fputs(rig_text, file);
    return fclose(file);
}

static int remove_rig(void **state)
{
    (void)state;
    unlink(rig);
    return rmdir(directory);
}

/* Its status now. */
static cJSON *look(void)
{
    struct service_link link;
    assert_int_equal(service_link_open(&link, NULL, rig, false), 0);
    cJSON *answer =
        service_link_ask(&link, cJSON_Parse("{\"command\":\"status\"}"),
                         (int)(FOR_EVER_S * 1000), NULL, NULL);
    assert_non_null(answer);
    service_link_close(&link);
    return answer;
}

static double slide_at(const char *name)
{
    cJSON *status = look();
    const double value = cJSON_GetNumberValue(cJSON_GetObjectItem(
        cJSON_GetArrayItem(cJSON_GetObjectItem(status, "axes"), 0), name));
    cJSON_Delete(status);
    return value;
}

static void await(const char *state)
{
    char now[32] = "";
    for (double end_s = now_s() + FOR_EVER_S; now_s() < end_s;) {
        cJSON *status = look();
        snprintf(now, sizeof now, "%s",
                 cJSON_GetStringValue(cJSON_GetObjectItem(status, "state")));
        cJSON_Delete(status);
        if (strcmp(now, state) == 0)
            return;
        nanosleep(&(struct timespec){ .tv_nsec = 10000000 }, NULL);
    }
    fail_msg("state %s, expected %s", now, state);
}

/* --- claims --- */

/* argv to its end; its status. */
static int runs(const char *const argv[])
{
    forget();
    start(argv, false);
    return finish();
}

static void heard_of(const char *text)
{
    if (strstr(heard, text) == NULL)
        fail_msg("no '%s' in:\n%s", text, heard);
}

static void a_jog_by_words_is_the_services(void **state)
{
    const char *const by[] = { "slew", "jog", rig, "slide", "+30mm", NULL };
    const char *const to[] = { "slew",  "jog", "--json",  rig,
                               "slide", "to",  "-12.5mm", NULL };
    const char *const at[] = { "slew",    "jog", rig,  "slide", "at",
                               "-20mm/s", "for", "1s", NULL };
    (void)state;
    assert_int_equal(runs(by), 0);
    heard_of("a service has this rig");
    heard_of("slide: from 0.0000 to 30.0000 mm in");
    await("off");
    assert_true(slide_at("demand") == 30);
    assert_int_equal(runs(to), 0);
    heard_of("\"from\":\t30");
    assert_true(slide_at("demand") == -12.5);
    assert_int_equal(runs(at), 0);
    const double went = slide_at("demand") + 12.5;
    if (went > -15 || went < -25) /* 20 mm, and what it needs to stop */
        fail_msg("%.3f mm", went);
    const char *const over[] = { "slew", "jog", rig, "slide", "+5000mm", NULL };
    assert_int_equal(runs(over), 1);
    heard_of("is above the upper limit of slide");
}

static void homing_is_the_services_and_lasts_there(void **state)
{
    const char *const home[] = { "slew", "home", rig, NULL };
    const char *const to[] = { "slew", "jog", rig, "lift", "to", "60mm", NULL };
    const char *const no[] = { "slew", "home", rig, "slide", NULL };
    const char *const first[] = { "slew", "jog", "--home", rig,
                                  "lift", "to",  "10mm",   NULL };
    (void)state;
    assert_int_equal(runs(to), 1);
    heard_of("lift is not homed");
    assert_int_equal(runs(first), 0);
    assert_int_equal(runs(home), 0);
    heard_of("a service has this rig");
    heard_of("lift: searching");
    heard_of("homed");
    heard_of("after ");
    assert_int_equal(runs(to), 0);
    heard_of("to 60.0000 mm in");
    assert_int_equal(runs(no), 2);
}

/* What a service says between a command and its answer. */
static void warnings_are_said_and_break_no_line(void **state)
{
    static const char lines[] =
        "{\"event\":\"state\",\"state\":\"moving\",\"text\":\"no\"}\n"
        "{\"event\":\"drive\",\"text\":\"slide: warning 1\"}\n"
        "{\"event\":\"bus\",\"text\":7}\n"
        "{\"event\":\"warning\",\"text\":\"lift: current\"}\n"
        "{\"id\":77,\"ok\":false}\n" /* a late one */
        "{\"id\":2,\"ok\":true}\n{\"id\":1,\"ok\":true}\n";
    const struct options options = { .json = true };
    struct served served = { .options = &options, .verb = "run" };
    char text[512] = "";
    int pair[2];
    FILE *file = tmpfile();
    const int console = dup(STDERR_FILENO);
    (void)state;
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, pair), 0);
    served.link.file = pair[0];
    assert_true(dup2(fileno(file), STDERR_FILENO) >= 0);
    for (unsigned i = 0; i < 2; i++) {
        served.draws = i > 0;
        assert_int_equal(write(pair[1], lines, sizeof lines - 1),
                         sizeof lines - 1);
        assert_int_equal(served_do(&served, served_command("hold")), STATUS_OK);
    }
    assert_true(dup2(console, STDERR_FILENO) >= 0);
    rewind(file);
    text[fread(text, 1, sizeof text - 1, file)] = '\0';
    assert_string_equal(text, "slew run: warning: slide: warning 1\n"
                              "slew run: warning: lift: current\n");
    service_link_close(&served.link);
    close(pair[1]);
    close(console);
    fclose(file);
}

/* Whatever is waited for, and be it a plan of a minute. */
static void a_stop_does_not_wait_for_an_answer(void **state)
{
    const struct options options = { .json = true };
    const volatile sig_atomic_t interrupts = 1;
    struct served served = { .options = &options,
                             .verb = "run",
                             .interrupts = &interrupts };
    char text[512] = "";
    size_t length = 0;
    int pair[2];
    (void)state;
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, pair), 0);
    served.link.file = pair[0];
    const pid_t other = fork();
    if (other == 0) { /* the service: answers once it is told to stop */
        static const char answer[] = "{\"id\":1,\"ok\":false,\"text\":\"-\"}\n";
        (void)alarm((unsigned)FOR_EVER_S);
        while (strstr(text, "\"load\"") == NULL ||
               strstr(text, "{\"command\":\"stop\"}\n") == NULL ||
               strstr(text, "{\"command\":\"cancel\"}\n") == NULL) {
            const ssize_t got =
                read(pair[1], text + length, sizeof text - 1 - length);
            length += got > 0 ? (size_t)got : 0;
        }
        _exit(write(pair[1], answer, sizeof answer - 1) < 0);
    }
    assert_int_equal(served_do(&served, served_command("load")),
                     STATUS_INTERRUPTED);
    assert_true(served.link.stopped);
    int status = -1;
    assert_int_equal(waitpid(other, &status, 0), other);
    assert_int_equal(status, 0);
    service_link_close(&served.link);
    close(pair[1]);
}

static void monitor_asks_the_service(void **state)
{
    const char *const once[] = { "slew", "monitor", "--once", rig, NULL };
    const char *const json[] = { "slew",  "monitor", "--json", "--rate", "20",
                                 "--for", "0.3s",    rig,      NULL };
    const char *const jog[] = { "slew",  "jog", rig,   "slide", "at",
                                "5mm/s", "for", "60s", NULL };
    (void)state;
    start(jog, false);
    const pid_t jogger = child;
    const int other = line;
    await("moving");
    assert_int_equal(runs(once), 0);
    heard_of("Served, 0.2 s, simulated drives");
    heard_of("operation enabled");
    heard_of("error-active");
    heard_of("% in use");
    assert_int_equal(runs(json), 0);
    heard_of("\"load\":0.");
    await("moving"); /* undisturbed */
    kill(jogger, SIGTERM);
    child = jogger;
    line = other;
    assert_int_equal(finish(), 130);
    await("off");
}

/* From where it was once nothing more could come: at 2 mm/s the dead-man time is
 * 0.5 mm; the lease, which would end it too, 10 mm. */
static void stops_soon(void)
{
    const double from = slide_at("demand");
    await("ready");
    const double went = slide_at("demand") - from;
    if (went > 3)
        fail_msg("it went on for %.3f mm", went);
}

static const char *const slow_jog[] = { "slew",  "jog", rig,    "slide", "at",
                                        "2mm/s", "for", "100s", NULL };

static void a_jog_that_is_killed_stops(void **state)
{
    (void)state;
    forget();
    start(slow_jog, false);
    await("moving");
    kill(child, SIGKILL);
    (void)finish();
    stops_soon();
}

/* It is there, its connection too, and says nothing. */
static void a_jog_that_hangs_stops(void **state)
{
    (void)state;
    forget();
    start(slow_jog, false);
    await("moving");
    kill(child, SIGSTOP);
    stops_soon();
    kill(child, SIGKILL);
    kill(child, SIGCONT);
    (void)finish();
}

static void keys_jog_what_the_service_has(void **state)
{
    const char *const argv[] = { "slew",  "jog",     "--dead-man",
                                 "500ms", "--speed", "20mm/s",
                                 rig,     "slide",   NULL };
    (void)state;
    forget();
    start(argv, true);
    expect("a service has this rig");
    expect("ready");
    for (double end_s = now_s() + FOR_EVER_S; slide_at("position") < 10;) {
        if (now_s() > end_s)
            fail_msg("it does not move:\n%s", heard);
        press(RIGHT);
        hear(0.05);
    }
    await("ready"); /* nobody holds the key */
    press("h");
    expect("this axis has no homing in the rig");
    press("\033[B");
    expect("lift");
    press("h");
    expect("searching");
    await("ready");
    press("q");
    assert_int_equal(finish(), 0);
    await("off");
}

static void what_a_service_cannot_do_is_said(void **state)
{
    const char *const keys[] = { "slew", "jog",   "--dead-man", "10s",
                                 rig,    "slide", NULL };
    const char *const dry[] = { "slew",  "jog",  "--dry-run", rig,
                                "slide", "+1mm", NULL };
    (void)state;
    assert_int_equal(runs(keys), 2);
    heard_of("--dead-man is longer than a service allows");
    assert_int_equal(runs(dry), 0); /* by itself */
    assert_null(strstr(heard, "a service has this rig"));
}

#define SERVED(claim)                                                          \
    cmocka_unit_test_setup_teardown(claim, service_up, service_down)

int main(void)
{
    const struct CMUnitTest tests[] = {
        SERVED(a_jog_by_words_is_the_services),
        SERVED(homing_is_the_services_and_lasts_there),
        cmocka_unit_test(warnings_are_said_and_break_no_line),
        cmocka_unit_test(a_stop_does_not_wait_for_an_answer),
        SERVED(monitor_asks_the_service),
        SERVED(a_jog_that_is_killed_stops),
        SERVED(a_jog_that_hangs_stops),
        SERVED(keys_jog_what_the_service_has),
        SERVED(what_a_service_cannot_do_is_said),
    };
    return cmocka_run_group_tests(tests, make_rig, remove_rig);
}
