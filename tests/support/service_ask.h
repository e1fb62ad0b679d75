/* tests/support/service_ask.h - the service_bench of a test, and a client of it: a
 * line and its answer. */
#ifndef TESTS_SUPPORT_SERVICE_ASK_H
#define TESTS_SUPPORT_SERVICE_ASK_H

#include <time.h>

#include "tests/support/check.h"
#include "tests/support/service_bench.h"

static struct service_bench bench;

/* The test's: a tick of the bench, and whatever is looked at then. */
static void tick(void);

static inline void service_ask_pause(void)
{
    nanosleep(&(struct timespec){ .tv_nsec = 1000000 }, NULL);
}

/* The answer to a line; events before it are left out. */
static inline cJSON *service_ask(int file, const char *line)
{
    static char text[65536];
    size_t length = 0;
    assert_int_equal(send(file, line, strlen(line), MSG_NOSIGNAL),
                     (ssize_t)strlen(line));
    assert_int_equal(send(file, "\n", 1, MSG_NOSIGNAL), 1);
    for (int i = 0; i < 30000; i++) {
        const ssize_t got =
            recv(file, text + length, sizeof text - 1 - length, 0);
        length += got > 0 ? (size_t)got : 0;
        for (char *end; (end = memchr(text, '\n', length)) != NULL;) {
            *end = '\0';
            cJSON *object = cJSON_Parse(text);
            length -= (size_t)(end + 1 - text);
            memmove(text, end + 1, length);
            if (cJSON_HasObjectItem(object, "ok"))
                return object;
            cJSON_Delete(object);
        }
        if (!service_bench_plans(&bench)) {
            tick();
            continue;
        }
        service_ask_pause();
        service_bench_serve(&bench);
    }
    fail_msg("no answer to %s", line);
    return NULL;
}

static inline void done(int file, const char *line)
{
    cJSON *answer = service_ask(file, line);
    if (!cJSON_IsTrue(cJSON_GetObjectItem(answer, "ok")))
        fail_msg("%s: %s", line, cJSON_PrintUnformatted(answer));
    cJSON_Delete(answer);
}

/* With that error, and that part of a sentence. */
static inline void refused(int file, const char *line, const char *error,
                           const char *part)
{
    cJSON *answer = service_ask(file, line);
    const char *text =
        cJSON_GetStringValue(cJSON_GetObjectItem(answer, "text"));
    assert_false(cJSON_IsTrue(cJSON_GetObjectItem(answer, "ok")));
    assert_string_equal(
        cJSON_GetStringValue(cJSON_GetObjectItem(answer, "error")), error);
    if (text == NULL || strstr(text, part) == NULL)
        fail_msg("%s: %s", line, text);
    cJSON_Delete(answer);
}

#endif
