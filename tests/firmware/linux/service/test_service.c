/* tests/firmware/linux/service/test_service.c - a service on simulated drives,
 * in a process of its own, and what its clients do to it.
 *
 * Reads the real clock.  Takes long. */
#define _GNU_SOURCE /* usleep */
#include <math.h>
#include <poll.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/linux/service/place.h"
#include "firmware/linux/service/service.h"
#include "tests/support/check.h"

#define WAIT_MS 10000

static const char rig_text[] =
    "title: Bench\n"
    "tick: 20 ms\n"
    "watchdog: 100 ms\n"
    "buses: {can: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "axes:\n"
    "  slide:\n"
    "    unit: mm\n"
    "    limits: {position: [-1000 mm, 1000 mm], velocity: 100 mm/s,"
    " acceleration: 1000 mm/s2}\n"
    "    following_error: {floor: 50 mm, time: 200 ms}\n"
    "    drive: {kind: cia402, bus: can, node: 1, counts: 4096 per mm}\n";

static const char move_text[] =
    "title: Away and back\naxes:\n  slide: {curve: s-curve, keys: [[0 s, 10 "
    "mm], [10 s, 400 mm], [20 s, 10 mm]]}\n";
static const char fast_text[] =
    "title: Too fast\naxes:\n  slide: {curve: s-curve, keys: [[0 s, 10 mm], "
    "[1 s, 400 mm]]}\n";

static struct {
    char directory[64], rig[96], socket[96];
    pid_t pid;
} bench;

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * INT64_C(1000) + now.tv_nsec / 1000000;
}

/* --- the service --- */

static int bench_up(void **state)
{
    const struct service_config config = { .rig_path = bench.rig,
                                           .socket = bench.socket,
                                           .cpu = -1 };
    (void)state;
    fflush(NULL);
    bench.pid = fork();
    if (bench.pid == 0)
        _exit((int)service_run(&config));
    for (int i = 0; i < 500; i++) {
        struct service_link link;
        if (service_link_open(&link, bench.socket, NULL, true) == 0) {
            service_link_close(&link);
            return 0;
        }
        usleep(10000);
    }
    return -1;
}

/* Its status, or -1 when it does not end. */
static int bench_end(int number)
{
    int status = 0;
    kill(bench.pid, number);
    for (int i = 0; i < 1000; i++) {
        if (waitpid(bench.pid, &status, WNOHANG) == bench.pid) {
            bench.pid = 0;
            return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
        }
        usleep(10000);
    }
    return -1;
}

/* Every test ends with a service that stops and confirms that torque is off. */
static int bench_down(void **state)
{
    (void)state;
    return bench.pid == 0 || bench_end(SIGTERM) == 0 ? 0 : -1;
}

static int bench_make(void **state)
{
    (void)state;
    snprintf(bench.directory, sizeof bench.directory, "/tmp/slew-test-XXXXXX");
    if (mkdtemp(bench.directory) == NULL)
        return -1;
    snprintf(bench.rig, sizeof bench.rig, "%s/rig.yaml", bench.directory);
    snprintf(bench.socket, sizeof bench.socket, "%s/socket", bench.directory);
    FILE *file = fopen(bench.rig, "w");
    if (file == NULL)
        return -1;
    fputs(rig_text, file);
    return fclose(file);
}

static int bench_clear(void **state)
{
    (void)state;
    unlink(bench.rig);
    unlink(bench.socket);
    return rmdir(bench.directory);
}

/* --- its clients --- */

static struct service_link client_new(void)
{
    struct service_link link;
    assert_int_equal(service_link_open(&link, bench.socket, NULL, false), 0);
    return link;
}

/* The answer to a line as it is, freed by the caller. */
static cJSON *client_ask(struct service_link *link, const char *line)
{
    const char *text;
    assert_int_equal(service_link_send(link, line), 0);
    while ((text = service_link_line(link, WAIT_MS)) != NULL) {
        cJSON *answer = cJSON_Parse(text);
        if (cJSON_HasObjectItem(answer, "ok"))
            return answer;
        cJSON_Delete(answer);
    }
    fail_msg("no answer to %s", line);
    return NULL;
}

/* "" when it was accepted, else the error. */
static const char *client_error(struct service_link *link, const char *line)
{
    static char error[64];
    cJSON *answer = client_ask(link, line);
    const char *name =
        cJSON_GetStringValue(cJSON_GetObjectItem(answer, "error"));
    const bool ok = cJSON_IsTrue(cJSON_GetObjectItem(answer, "ok"));
    assert_true(ok == (name == NULL));
    snprintf(error, sizeof error, "%s", ok ? "" : name);
    cJSON_Delete(answer);
    return error;
}

static void client_do(struct service_link *link, const char *line)
{
    const char *error = client_error(link, line);
    if (error[0] != '\0')
        fail_msg("%s: %s", line, error);
}

static void client_load(struct service_link *link, const char *text,
                        const char *error)
{
    cJSON *command = cJSON_CreateObject();
    cJSON_AddStringToObject(command, "command", "load");
    cJSON_AddStringToObject(command, "text", text);
    char *line = cJSON_PrintUnformatted(command);
    assert_string_equal(client_error(link, line), error);
    free(line);
    cJSON_Delete(command);
}

static double client_number(struct service_link *link, const char *name)
{
    cJSON *status = client_ask(link, "{\"command\":\"status\"}");
    const cJSON *item = cJSON_GetObjectItem(status, name);
    if (item == NULL)
        item = cJSON_GetObjectItem(cJSON_GetObjectItem(status, "tick"), name);
    assert_non_null(item);
    const double value =
        cJSON_IsBool(item) ? cJSON_IsTrue(item) : cJSON_GetNumberValue(item);
    cJSON_Delete(status);
    return value;
}

static double client_axis(struct service_link *link, const char *name)
{
    cJSON *status = client_ask(link, "{\"command\":\"status\"}");
    const double value = cJSON_GetNumberValue(cJSON_GetObjectItem(
        cJSON_GetArrayItem(cJSON_GetObjectItem(status, "axes"), 0), name));
    cJSON_Delete(status);
    return value;
}

/* Until the controller is in that state. */
static void client_wait(struct service_link *link, const char *wanted)
{
    char state[256] = "";
    const char *fault;
    for (int64_t until = now_ms() + WAIT_MS; now_ms() < until;) {
        cJSON *status = client_ask(link, "{\"command\":\"status\"}");
        fault = cJSON_GetStringValue(cJSON_GetObjectItem(status, "fault"));
        snprintf(state, sizeof state, "%s%s%s",
                 cJSON_GetStringValue(cJSON_GetObjectItem(status, "state")),
                 fault != NULL ? ", " : "", fault != NULL ? fault : "");
        cJSON_Delete(status);
        if (strcmp(state, wanted) == 0)
            return;
        if (fault != NULL)
            break;
        usleep(10000);
    }
    fail_msg("state %s, expected %s", state, wanted);
}

static void client_ready(struct service_link *link)
{
    client_do(link, "{\"command\":\"take\",\"lease\":60}");
    client_do(link, "{\"command\":\"enable\"}");
    client_wait(link, "ready");
}

/* --- claims --- */

static void every_line_has_its_answer(void **state)
{
    static const struct {
        const char *line, *error;
    } row[] = {
        { "{\"command\":\"hello\"}", "" },
        { "{\"command\":\"dance\"}", "COMMAND" },
        { "{\"id\":1}", "COMMAND" },
        { "[1]", "JSON" },
        { "{\"id\":{},\"command\":\"hello\"}", "ARG" },
        { "{\"command\":\"enable\"}", "CONTROL" },
        { "{\"command\":\"take\",\"lease\":0.1}", "ARG" },
        { "{\"command\":\"take\",\"lease\":1e300}", "ARG" },
        { "{\"command\":\"take\",\"lease\":60}", "" },
        { "{\"command\":\"take\",\"lease\":60}", "" },
        { "{\"command\":\"renew\"}", "" },
        { "{\"command\":\"start\"}", "EMPTY" },
        { "{\"command\":\"approach\"}", "EMPTY" },
        { "{\"command\":\"hold\"}", "STATE" },
        { "{\"command\":\"override\",\"percent\":201}", "ARG" },
        { "{\"command\":\"override\"}", "ARG" },
        { "{\"command\":\"override\",\"percent\":50}", "" },
        { "{\"command\":\"jog\",\"axis\":\"pan\",\"speed\":1}", "ARG" },
        { "{\"command\":\"jog\",\"axis\":\"slide\"}", "ARG" },
        { "{\"command\":\"jog\",\"axis\":\"slide\",\"speed\":\"1 deg/s\"}",
          "ARG" },
        { "{\"command\":\"jog\",\"axis\":\"slide\",\"speed\":1,\"for\":3}",
          "ARG" },
        { "{\"command\":\"jog\",\"axis\":\"slide\",\"speed\":1}", "STATE" },
        { "{\"command\":\"home\",\"axes\":[\"pan\"]}", "ARG" },
        { "{\"command\":\"home\"}", "STATE" },
        { "{\"command\":\"load\"}", "ARG" },
        { "{\"command\":\"load\",\"text\":\"axes: 1\"}", "INPUT" },
        { "{\"command\":\"stream\",\"rate\":101}", "ARG" },
        { "{\"command\":\"stop\"}", "" },
        { "{\"command\":\"release\"}", "" },
        { "{\"command\":\"release\"}", "CONTROL" },
    };
    struct service_link link = client_new();
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        const char *error = client_error(&link, row[i].line);
        if (strcmp(error, row[i].error) != 0)
            fail_msg("%s: \"%s\", expected \"%s\"", row[i].line, error,
                     row[i].error);
    }
    service_link_close(&link);
}

static void an_id_comes_back_as_it_was(void **state)
{
    struct service_link link = client_new();
    (void)state;
    cJSON *answer =
        client_ask(&link, "{\"id\":\"a\\\"b\",\"command\":\"hello\"}");
    assert_string_equal(cJSON_GetStringValue(cJSON_GetObjectItem(answer, "id")),
                        "a\"b");
    cJSON_Delete(answer);
    service_link_close(&link);
}

static void a_move_is_loaded_approached_and_played(void **state)
{
    struct service_link link = client_new();
    (void)state;
    client_ready(&link);
    client_load(&link, fast_text, "LIMIT");
    assert_string_equal(client_error(&link, "{\"command\":\"start\"}"),
                        "EMPTY");
    client_load(&link, move_text, "");
    assert_string_equal(client_error(&link, "{\"command\":\"start\"}"), "AWAY");
    client_do(&link, "{\"command\":\"approach\"}");
    client_wait(&link, "ready");
    assert_true(client_axis(&link, "demand") == 10);
    client_do(&link, "{\"command\":\"start\"}");
    client_wait(&link, "moving");
    client_load(&link, move_text, "STATE");
    usleep(1000000);
    client_do(&link, "{\"command\":\"hold\"}");
    client_wait(&link, "holding");
    client_do(&link, "{\"command\":\"resume\"}");
    client_wait(&link, "moving");
    client_do(&link, "{\"command\":\"stop\"}");
    client_wait(&link, "ready");
    assert_true(client_axis(&link, "demand") > 10);
    assert_true(client_number(&link, "torque_off") == 0);
    client_do(&link, "{\"command\":\"off\"}");
    client_wait(&link, "off");
    service_link_close(&link);
}

static void client_wait_frame(struct service_link *link, double frame)
{
    for (int i = 0; i < 6000 && client_number(link, "frame_waits") != frame;
         i++)
        usleep(10000);
    assert_true(client_number(link, "frame_waits") == frame);
}

/* A camera program, say, takes each picture and then asks for the next step. */
static void a_shoot_goes_on_frame_by_frame(void **state)
{
    struct service_link link = client_new();
    (void)state;
    client_ready(&link);
    client_load(
        &link,
        "axes: {slide: {curve: s-curve, keys: [[0 s, 10], [1 s, 12]]}}\n"
        "shoot: {mode: stop, frames: 3, exposure: 50 ms, move: 1 s, "
        "step: operator}\n",
        "");
    client_do(&link, "{\"command\":\"approach\"}");
    client_wait(&link, "ready");
    assert_string_equal(client_error(&link, "{\"command\":\"step\"}"), "STATE");
    client_do(&link, "{\"command\":\"start\"}");
    for (int frame = 1; frame <= 3; frame++) {
        client_wait_frame(&link, frame);
        assert_true(fabs(client_axis(&link, "demand") - 9 - frame) < 1e-6);
        client_do(&link, "{\"command\":\"step\"}");
    }
    client_wait(&link, "ready");
    service_link_close(&link);
}

/* move_text: 10 at the start. */
static void a_time_or_key_of_the_move_is_gone_to_and_held(void **state)
{
    struct service_link link = client_new();
    (void)state;
    client_ready(&link);
    assert_string_equal(client_error(&link, "{\"command\":\"go\",\"to\":1}"),
                        "EMPTY");
    client_load(&link, move_text, "");
    assert_string_equal(client_error(&link, "{\"command\":\"go\",\"to\":1000}"),
                        "ARG");
    assert_string_equal(
        client_error(&link, "{\"command\":\"go\",\"to\":\"soon\"}"), "ARG");
    client_do(&link, "{\"command\":\"go\",\"to\":\"0 s\"}");
    client_wait(&link, "holding");
    assert_true(client_axis(&link, "demand") == 10);
    assert_true(client_number(&link, "path_s") == 0);
    client_do(&link, "{\"command\":\"go\",\"axis\":\"slide\",\"key\":3}");
    client_wait(&link, "holding");
    assert_true(client_number(&link, "path_s") == 20);
    client_do(&link, "{\"command\":\"go\",\"to\":0.5}");
    client_wait(&link, "holding");
    assert_true(client_axis(&link, "demand") > 10);
    client_do(&link, "{\"command\":\"resume\"}");
    client_wait(&link, "moving");
    assert_string_equal(client_error(&link, "{\"command\":\"go\",\"to\":0}"),
                        "STATE");
    assert_string_equal(
        client_error(&link,
                     "{\"command\":\"go\",\"axis\":\"slide\",\"key\":9}"),
        "ARG");
    client_do(&link, "{\"command\":\"stop\"}");
    client_wait(&link, "ready");
    service_link_close(&link);
}

static void anybody_may_stop_and_one_may_move(void **state)
{
    struct service_link holder = client_new(), watcher = client_new();
    (void)state;
    client_ready(&holder);
    assert_string_equal(client_error(&watcher, "{\"command\":\"take\"}"),
                        "CONTROL");
    client_load(&holder, move_text, "");
    client_do(&holder, "{\"command\":\"approach\"}");
    client_wait(&holder, "ready");
    client_do(&holder, "{\"command\":\"start\"}");
    client_wait(&watcher, "moving");
    assert_string_equal(client_error(&watcher, "{\"command\":\"hold\"}"),
                        "CONTROL");
    client_do(&watcher, "{\"command\":\"stop\"}");
    client_wait(&watcher, "ready");
    service_link_close(&holder);
    service_link_close(&watcher);
}

static void a_lease_expires(void **state)
{
    struct service_link holder = client_new(), other = client_new();
    (void)state;
    client_do(&holder, "{\"command\":\"take\",\"lease\":0.5}");
    for (int i = 0; i < 5; i++) {
        usleep(200000);
        client_do(&holder, "{\"command\":\"renew\"}");
    }
    assert_string_equal(client_error(&other, "{\"command\":\"take\"}"),
                        "CONTROL");
    usleep(800000);
    assert_string_equal(client_error(&holder, "{\"command\":\"renew\"}"),
                        "CONTROL");
    client_do(&other, "{\"command\":\"take\"}");
    service_link_close(&holder);
    service_link_close(&other);
}

/* Whoever comes next may stop it, and takes control. */
static void a_move_goes_on_without_its_client(void **state)
{
    struct service_link holder = client_new(), watcher = client_new();
    (void)state;
    client_ready(&holder);
    client_load(&holder, move_text, "");
    client_do(&holder, "{\"command\":\"approach\"}");
    client_wait(&holder, "ready");
    client_do(&holder, "{\"command\":\"start\"}");
    client_wait(&watcher, "moving");
    service_link_close(&holder);
    usleep(300000);
    client_wait(&watcher, "moving");
    client_do(&watcher, "{\"command\":\"take\"}");
    client_do(&watcher, "{\"command\":\"stop\"}");
    client_wait(&watcher, "ready");
    service_link_close(&watcher);
}

/* The axis would go on for 2 s by the dead man's time alone. */
static const char jog_long[] =
    "{\"command\":\"jog\",\"axis\":\"slide\",\"speed\":50,\"for\":2}";

static void a_jog_ends_with_its_client(void **state)
{
    struct service_link watcher = client_new(), holder = client_new();
    (void)state;
    client_ready(&holder);
    client_do(&holder, jog_long);
    const int64_t began = now_ms();
    usleep(300000);
    assert_true(client_axis(&watcher, "velocity") > 25);
    service_link_close(&holder);
    client_wait(&watcher, "ready");
    assert_true(now_ms() - began < 1700);
    service_link_close(&watcher);
}

static void a_jog_ends_when_its_client_is_killed(void **state)
{
    struct service_link watcher = client_new();
    (void)state;
    const pid_t pid = fork();
    if (pid == 0) {
        struct service_link holder = client_new();
        client_ready(&holder);
        client_do(&holder, jog_long);
        pause();
        _exit(0);
    }
    client_wait(&watcher, "moving");
    const int64_t began = now_ms();
    usleep(300000);
    kill(pid, SIGKILL);
    waitpid(pid, NULL, 0);
    client_wait(&watcher, "ready");
    assert_true(now_ms() - began < 1700);
    service_link_close(&watcher);
}

static void a_jog_ends_with_its_lease(void **state)
{
    struct service_link watcher = client_new(), holder = client_new();
    (void)state;
    client_ready(&holder);
    client_do(&holder, "{\"command\":\"take\",\"lease\":0.3}");
    client_do(&holder, jog_long);
    const int64_t began = now_ms();
    client_wait(&watcher, "ready");
    assert_true(now_ms() - began < 1700);
    service_link_close(&holder);
    service_link_close(&watcher);
}

static void a_jog_ends_by_its_dead_mans_time(void **state)
{
    struct service_link holder = client_new();
    (void)state;
    client_ready(&holder);
    for (int i = 0; i < 5; i++) {
        client_do(&holder, "{\"command\":\"jog\",\"axis\":\"slide\",\"speed\":-"
                           "20,\"for\":0.5}");
        usleep(100000);
    }
    assert_true(client_axis(&holder, "velocity") < -10);
    const int64_t began = now_ms();
    client_wait(&holder, "ready");
    assert_true(now_ms() - began < 1700);
    assert_true(client_axis(&holder, "demand") > -100);
    service_link_close(&holder);
}

/* The stop is over long before the next jog comes. */
static void a_jog_that_is_held_does_not_go_on_after_a_stop(void **state)
{
    static const char jog[] = "{\"command\":\"jog\",\"axis\":\"slide\","
                              "\"speed\":2,\"for\":0.8}";
    struct service_link holder = client_new(), other = client_new();
    (void)state;
    client_ready(&holder);
    client_do(&holder, jog);
    usleep(200000);
    assert_true(client_axis(&other, "velocity") > 1);
    client_do(&other, "{\"command\":\"stop\"}");
    client_wait(&other, "ready");
    const double stands = client_axis(&other, "demand");
    for (int i = 0; i < 5; i++) {
        assert_string_equal(client_error(&holder, jog), "STATE");
        usleep(300000);
    }
    client_wait(&other, "ready");
    assert_true(client_axis(&other, "demand") == stands);
    usleep(600000); /* 0.9 s after the last of them */
    client_do(&holder, jog);
    client_do(&other, "{\"command\":\"stop\"}");
    client_wait(&other, "ready");
    assert_string_equal(client_error(&holder, jog), "STATE");
    client_do(&holder, "{\"command\":\"jog stop\"}");
    client_do(&holder, jog);
    client_do(&other, "{\"command\":\"stop\"}");
    client_wait(&other, "ready");
    client_do(&holder, "{\"command\":\"release\"}");
    client_do(&other, "{\"command\":\"take\"}");
    client_do(&other, jog);
    service_link_close(&holder);
    service_link_close(&other);
}

/* --- those that are slow, many or hostile --- */

static int raw_client(void)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    snprintf(address.sun_path, sizeof address.sun_path, "%s", bench.socket);
    const int file = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (file >= 0 &&
        connect(file, (struct sockaddr *)&address, sizeof address) == 0)
        return file;
    if (file >= 0)
        close(file);
    return -1;
}

static void one_that_does_not_read_delays_nobody(void **state)
{
    static const char ask[] = "{\"command\":\"stream\",\"rate\":100}\n";
    struct service_link link = client_new();
    const int slow = raw_client();
    (void)state;
    assert_true(send(slow, ask, strlen(ask), 0) > 0);
    client_ready(&link);
    const double before = client_number(&link, "ticks");
    for (int i = 0; i < 50; i++)
        client_do(&link, "{\"command\":\"renew\"}");
    usleep(500000);
    assert_true(client_number(&link, "ticks") > before + 10);
    close(slow);
    client_do(&link, "{\"command\":\"stop\"}");
    service_link_close(&link);
}

static void bad_lines_are_answered_and_delay_nobody(void **state)
{
    char line[] = "{\"command\":\"\xff\xfe nonsense\n";
    struct service_link link = client_new();
    const int bad = raw_client();
    (void)state;
    for (int i = 0; i < 100000; i++)
        if (send(bad, line, strlen(line), MSG_DONTWAIT | MSG_NOSIGNAL) < 0)
            break; /* nobody takes more: its answers are not read */
    client_ready(&link);
    client_do(&link, "{\"command\":\"off\"}");
    close(bad);
    service_link_close(&link);
}

static void a_line_without_an_end_is_refused(void **state)
{
    static char block[65536];
    struct service_link link = client_new();
    const int bad = raw_client();
    char said[4096];
    bool refused = false;
    (void)state;
    memset(block, 'x', sizeof block);
    for (int i = 0; i < 64; i++)
        if (send(bad, block, sizeof block, MSG_NOSIGNAL) < 0)
            break;
    for (ssize_t got; (got = recv(bad, said, sizeof said - 1, 0)) > 0;) {
        said[got] = '\0';
        refused |= strstr(said, "the line is too long") != NULL;
    }
    assert_true(refused);
    client_do(&link, "{\"command\":\"hello\"}");
    close(bad);
    service_link_close(&link);
}

static void a_thousand_connections_delay_nobody(void **state)
{
    static int file[1000];
    struct rlimit most = { 4096, 4096 };
    struct service_link link = client_new();
    unsigned refused = 0;
    char said[128];
    (void)state;
    (void)setrlimit(RLIMIT_NOFILE, &most);
    client_ready(&link);
    for (unsigned i = 0; i < ARRAY_LEN(file); i++) {
        file[i] = raw_client();
        assert_true(file[i] >= 0);
    }
    client_do(&link, "{\"command\":\"jog\",\"axis\":\"slide\",\"speed\":20}");
    client_wait(&link, "ready");
    for (unsigned i = 0; i < ARRAY_LEN(file); i++) {
        const ssize_t got = recv(file[i], said, sizeof said - 1, 0);
        assert_true(got > 0);
        said[got] = '\0';
        refused += strstr(said, "too many clients") != NULL;
        close(file[i]);
    }
    assert_int_equal(refused, 1000 - 63); /* and `link` */
    assert_true(client_number(&link, "clients_refused") == refused);
    service_link_close(&link);
}

static void the_tick_has_no_page_fault(void **state)
{
    struct service_link link = client_new();
    (void)state;
    client_ready(&link);
    for (int i = 0; i < 5; i++)
        client_load(&link, move_text, "");
    client_do(&link, "{\"command\":\"approach\"}");
    client_wait(&link, "ready");
    client_do(&link, "{\"command\":\"start\"}");
    usleep(1500000); /* two looks of the tick at its page faults */
    if (client_number(&link, "memory_locked") == 0)
        skip();         /* this user may not */
#ifndef CHECK_SANITIZED /* which makes locking memory do nothing */
    assert_true(client_number(&link, "page_faults") == 0);
#endif
    service_link_close(&link);
}

/* --- what the service manager hears --- */

/* The next datagram; "" when none came. */
static const char *manager_hears(int file)
{
    static char said[256];
    struct pollfd look = { .fd = file, .events = POLLIN };
    const ssize_t got =
        poll(&look, 1, WAIT_MS) > 0 ? recv(file, said, sizeof said - 1, 0) : 0;
    said[got > 0 ? got : 0] = '\0';
    return said;
}

/* Whether a name in the file system or an abstract one. */
static void the_manager_hears_it(bool is_abstract)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    char name[96];
    const int file = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    snprintf(name, sizeof name, "%s%s/notify", is_abstract ? "@" : "",
             bench.directory);
    memcpy(address.sun_path, name, strlen(name));
    if (is_abstract)
        address.sun_path[0] = '\0';
    assert_int_equal(bind(file, (struct sockaddr *)&address,
                          (socklen_t)(offsetof(struct sockaddr_un, sun_path) +
                                      strlen(name))),
                     0);
    setenv("NOTIFY_SOCKET", name, 1);
    setenv("WATCHDOG_USEC", "400000", 1);
    const int up = bench_up(NULL);
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
    assert_int_equal(up, 0);
    assert_string_equal(manager_hears(file), "READY=1");
    for (int i = 0; i < 5; i++)
        assert_string_equal(manager_hears(file), "WATCHDOG=1");
    kill(bench.pid, SIGTERM);
    const char *said = manager_hears(file);
    while (strcmp(said, "WATCHDOG=1") == 0)
        said = manager_hears(file);
    assert_string_equal(said, "STOPPING=1");
    assert_int_equal(bench_end(SIGCONT), 0);
    close(file);
    unlink(name);
}

static void the_service_manager_is_told(void **state)
{
    (void)state;
    the_manager_hears_it(false);
    the_manager_hears_it(true);
}

/* --- its end --- */

static void sigterm_in_a_move_leaves_no_torque(void **state)
{
    struct service_link link = client_new();
    (void)state;
    client_ready(&link);
    client_load(&link, move_text, "");
    client_do(&link, "{\"command\":\"approach\"}");
    client_wait(&link, "ready");
    client_do(&link, "{\"command\":\"start\"}");
    usleep(1500000);
    assert_true(client_axis(&link, "velocity") > 1);
    assert_int_equal(bench_end(SIGTERM), 0);
    service_link_close(&link);
    assert_int_not_equal(access(bench.socket, F_OK), 0);
}

static void a_second_service_of_a_socket_is_refused(void **state)
{
    const struct service_config config = { .rig_path = bench.rig,
                                           .socket = bench.socket,
                                           .cpu = -1 };
    int status = 0;
    (void)state;
    fflush(NULL);
    const pid_t pid = fork();
    if (pid == 0)
        _exit((int)service_run(&config));
    assert_int_equal(waitpid(pid, &status, 0), pid);
    assert_int_equal(WEXITSTATUS(status), STATUS_SYSTEM);
    struct service_link link = client_new(); /* the first one is still there */
    service_link_close(&link);
}

#define BENCH_TEST(claim)                                                      \
    cmocka_unit_test_setup_teardown(claim, bench_up, bench_down)

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH_TEST(every_line_has_its_answer),
        BENCH_TEST(an_id_comes_back_as_it_was),
        BENCH_TEST(a_move_is_loaded_approached_and_played),
        BENCH_TEST(a_shoot_goes_on_frame_by_frame),
        BENCH_TEST(a_time_or_key_of_the_move_is_gone_to_and_held),
        BENCH_TEST(anybody_may_stop_and_one_may_move),
        BENCH_TEST(a_lease_expires),
        BENCH_TEST(a_move_goes_on_without_its_client),
        BENCH_TEST(a_jog_ends_with_its_client),
        BENCH_TEST(a_jog_ends_when_its_client_is_killed),
        BENCH_TEST(a_jog_ends_with_its_lease),
        BENCH_TEST(a_jog_ends_by_its_dead_mans_time),
        BENCH_TEST(a_jog_that_is_held_does_not_go_on_after_a_stop),
        BENCH_TEST(one_that_does_not_read_delays_nobody),
        BENCH_TEST(bad_lines_are_answered_and_delay_nobody),
        BENCH_TEST(a_line_without_an_end_is_refused),
        BENCH_TEST(a_thousand_connections_delay_nobody),
        BENCH_TEST(the_tick_has_no_page_fault),
        cmocka_unit_test(the_service_manager_is_told),
        BENCH_TEST(sigterm_in_a_move_leaves_no_torque),
        BENCH_TEST(a_second_service_of_a_socket_is_refused),
    };
    return cmocka_run_group_tests(tests, bench_make, bench_clear);
}
