/* tests/firmware/linux/service/test_service_api.c - the session of docs/API.md,
 * as it stands there, and what a service says to those who do not read.  In
 * virtual time. */
#include <errno.h>
#include <time.h>

#include "tests/support/check.h"
#include "tests/support/service_bench.h"

#define SAID_MAX 262144
#define TICKS    2000 /* of 5 ms, until something has come about */

static const char rig_text[] =
    "tick: 5 ms\nbuses: {can: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "axes:\n  pan:\n    unit: deg\n    limits: {position: [-90 deg, 90 deg],"
    " velocity: 40 deg/s, acceleration: 100 deg/s2}\n"
    "    following_error: {floor: 5 deg, time: 100 ms}\n"
    "    homing: {by: here}\n"
    "    drive: {kind: cia402, bus: can, node: 1, counts: 131072 per rev}\n"
    "gpio:\n  camera: {kind: trigger, line: GPIO5, width: 50 ms}\n";

static struct service_bench bench;
static char said[SAID_MAX];
static size_t said_length;

static int up(void **state)
{
    (void)state;
    said_length = 0;
    return service_bench_ready(&bench, rig_text);
}

static int down(void **state)
{
    (void)state;
    service_bench_close(&bench);
    return 0;
}

static void send_line(int file, const char *line)
{
    const size_t length = strlen(line);
    assert_int_equal(send(file, line, length, MSG_NOSIGNAL), (ssize_t)length);
    assert_int_equal(send(file, "\n", 1, MSG_NOSIGNAL), 1);
}

/* The next line that has come; NULL: none. */
static cJSON *next_line(int file)
{
    ssize_t got;
    while ((got = recv(file, said + said_length, SAID_MAX - said_length, 0)) >
           0)
        said_length += (size_t)got;
    char *end = memchr(said, '\n', said_length);
    if (end == NULL)
        return NULL;
    *end = '\0';
    cJSON *object = cJSON_Parse(said);
    said_length -= (size_t)(end + 1 - said);
    memmove(said, end + 1, said_length);
    assert_true(cJSON_IsObject(object));
    return object;
}

/* The next that has this member. */
static cJSON *next_with(int file, const char *member)
{
    for (int i = 0; i < TICKS; i++) {
        cJSON *object;
        while ((object = next_line(file)) != NULL) {
            if (cJSON_HasObjectItem(object, member))
                return object;
            cJSON_Delete(object);
        }
        if (service_bench_plans(&bench)) {
            (void)nanosleep(&(struct timespec){ .tv_nsec = 100000 }, NULL);
            service_bench_serve(&bench);
            i = 0;
        } else {
            service_bench_tick(&bench);
        }
    }
    fail_msg("no \"%s\" has come", member);
    return NULL;
}

/* Every motion that a line begins is over, but what is played. */
static void settle(const char *line)
{
    const struct controller *controller = &bench.machine.controller;
    const bool plays =
        strstr(line, "start") != NULL || strstr(line, "resume") != NULL ||
        strstr(line, "loop") != NULL || strstr(line, "override") != NULL ||
        strstr(line, "renew") != NULL;
    for (int i = 0; i < (plays ? 100 : TICKS); i++) {
        service_bench_tick(&bench);
        if (!plays && !controller->enabling &&
            !homing_is_running(&bench.machine.homing) &&
            (controller->state == CONTROLLER_OFF ||
             controller->state == CONTROLLER_READY ||
             (controller->state == CONTROLLER_HOLDING &&
              controller->rate.rate_q30 == 0)))
            return;
    }
}

static void compare(const cJSON *answer, const char *part)
{
    cJSON *wanted = cJSON_Parse(part);
    const cJSON *member;
    assert_true(cJSON_IsObject(wanted));
    cJSON_ArrayForEach(member, wanted)
    {
        if (!cJSON_Compare(member, cJSON_GetObjectItem(answer, member->string),
                           true))
            fail_msg("expected %s, got %s", part,
                     cJSON_PrintUnformatted(answer));
    }
    cJSON_Delete(wanted);
}

static void the_session_of_the_document_is_as_it_stands_there(void **state)
{
    static const char *const commands[] = {
        "hello",  "status",  "stream",  "stop",     "take",    "renew",
        "enable", "off",     "reset",   "home",     "check",   "load",
        "start",  "hold",    "resume",  "approach", "reverse", "override",
        "jog",    "capture", "release", "jog stop", "latency",
    };
    static char line[2048];
    bool seen[ARRAY_LEN(commands)] = { false };
    const int file = service_bench_connect(&bench);
    FILE *document = fopen("docs/API.md", "r");
    (void)state;
    assert_non_null(document);
    while (fgets(line, sizeof line, document) != NULL) {
        line[strcspn(line, "\n")] = '\0';
        if (strncmp(line, "    > ", 6) != 0)
            continue;
        char *sent = strdup(line + 6);
        send_line(file, sent);
        assert_non_null(fgets(line, sizeof line, document));
        assert_int_equal(strncmp(line, "    < ", 6), 0);
        cJSON *answer = next_with(file, "ok");
        cJSON *command = cJSON_Parse(sent);
        compare(answer, line + 6);
        for (size_t i = 0; i < ARRAY_LEN(commands); i++)
            seen[i] |=
                strcmp(commands[i], cJSON_GetStringValue(cJSON_GetObjectItem(
                                        command, "command"))) == 0;
        cJSON_Delete(command);
        cJSON_Delete(answer);
        settle(sent);
        free(sent);
    }
    fclose(document);
    for (size_t i = 0; i < ARRAY_LEN(commands); i++)
        if (!seen[i])
            fail_msg("docs/API.md has no example of %s", commands[i]);
    close(file);
}

/* What did not fit is counted, and said once there is room again. */
static void who_never_reads_is_told_what_was_left_out(void **state)
{
    const int deaf = service_bench_connect(&bench);
    int small = 4096;
    (void)state;
    (void)setsockopt(deaf, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
    send_line(deaf, "{\"command\":\"stream\",\"rate\":100}");
    for (int i = 0; i < 20000 && bench.control.clients.client[0].dropped < 100;
         i++)
        service_bench_tick(&bench);
    const uint64_t dropped = bench.control.clients.client[0].dropped;
    assert_true(dropped >= 100);
    cJSON *stream = next_with(deaf, "dropped");
    assert_true(cJSON_GetNumberValue(cJSON_GetObjectItem(stream, "dropped")) >=
                (double)dropped);
    cJSON_Delete(stream);
    assert_int_equal(bench.machine.controller.ticks_lost, 0);
    close(deaf);
}

/* In virtual time nothing is late: what is counted here is put there. */
static void wake_ups_are_counted_by_how_late_they_were(void **state)
{
    static const struct {
        int64_t late_us;
        double bin_us;
    } row[] = {
        { 1, 1 },         { 1999, 1999 },   { 2000, 2000 },
        { 2099, 2000 },   { 2100, 2100 },   { 19999, 19900 },
        { 20000, 20000 }, { 99000, 20000 }, { INT64_MAX / 1000, 20000 },
    };
    const int file = service_bench_connect(&bench);
    double last = -1, found = 0;
    const cJSON *bin;
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        const unsigned at = service_late_bin(row[i].late_us);
        bench.loop.board.late[at]++;
        assert_true(service_late_us(at) == row[i].bin_us);
    }
    assert_int_equal(service_late_bin(-1), 0);
    for (int i = 0; i < 20; i++)
        service_bench_tick(&bench);
    send_line(file, "{\"command\":\"latency\"}");
    cJSON *answer = next_with(file, "late_us");
    cJSON_ArrayForEach(bin, cJSON_GetObjectItem(answer, "late_us"))
    {
        const double us = cJSON_GetNumberValue(cJSON_GetArrayItem(bin, 0));
        assert_true(us > last);
        last = us;
        found += us > 0 ? cJSON_GetNumberValue(cJSON_GetArrayItem(bin, 1)) : 0;
    }
    assert_true(found == ARRAY_LEN(row) && last == SERVICE_LATE_MOST_US);
    assert_true(cJSON_GetNumberValue(
                    cJSON_GetObjectItem(answer, "late_us_p999")) >= last);
    cJSON_Delete(answer);
    close(file);
}

/* Homing and jogs begin with torque, so this is where they are refused, too. */
static void a_bus_that_cannot_carry_the_rig_gets_no_torque(void **state)
{
    const int file = service_bench_connect(&bench);
    (void)state;
    bench.rig.bus[0].bit_rate = 10000;
    send_line(file, "{\"command\":\"take\"}");
    cJSON_Delete(next_with(file, "ok"));
    send_line(file, "{\"command\":\"enable\"}");
    cJSON *answer = next_with(file, "ok");
    compare(answer, "{\"ok\":false,\"error\":\"LIMIT\"}");
    const char *text =
        cJSON_GetStringValue(cJSON_GetObjectItem(answer, "text"));
    assert_non_null(strstr(text, "rig.yaml:2:9: bus can would need "));
    assert_non_null(strstr(text, " kbit/s would fit"));
    for (int i = 0; i < 100; i++) {
        service_bench_tick(&bench);
        assert_int_equal(bench.machine.controller.state, CONTROLLER_OFF);
        assert_false(bench.machine.controller.enabling);
    }
    cJSON_Delete(answer);
    close(file);
}

#define API_TEST(claim) cmocka_unit_test_setup_teardown(claim, up, down)

int main(void)
{
    const struct CMUnitTest tests[] = {
        API_TEST(the_session_of_the_document_is_as_it_stands_there),
        API_TEST(who_never_reads_is_told_what_was_left_out),
        API_TEST(a_bus_that_cannot_carry_the_rig_gets_no_torque),
        API_TEST(wake_ups_are_counted_by_how_late_they_were),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
