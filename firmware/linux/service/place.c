/* firmware/linux/service/place.c - see place.h. */
#define _GNU_SOURCE /* realpath */
#include "firmware/linux/service/place.h"

#include <errno.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include "firmware/host/base/memory.h"
#include "firmware/linux/base/error.h"
#include "hal/support/crc32.h"

#define PLACE_LINE_MAX 1048576
#define PLACE_PIECE    4096
#define PLACE_COUNT    4
#define PLACE_SLICE_MS 50 /* between two looks at Ctrl-C */

/* --- where --- */

/* Directory `which` of the list in place.h; false: there is none such. */
static bool place_directory(unsigned which, char path[SERVICE_PATH_MAX])
{
    const char *own = getenv("SLEW_RUN_DIR");
    const char *given = getenv("RUNTIME_DIRECTORY");
    const char *user = getenv("XDG_RUNTIME_DIR");
    int n = 0;
    if (own != NULL && own[0] != '\0')
        n = which == 0 ? snprintf(path, SERVICE_PATH_MAX, "%s", own) : 0;
    else if (which == 0 && given != NULL && given[0] == '/')
        n = snprintf(path, SERVICE_PATH_MAX, "%.*s", (int)strcspn(given, ":"),
                     given);
    else if (which == 1)
        n = snprintf(path, SERVICE_PATH_MAX, "/run/slew");
    else if (which == 2 && user != NULL && user[0] == '/')
        n = snprintf(path, SERVICE_PATH_MAX, "%s/slew", user);
    else if (which == 3)
        n = snprintf(path, SERVICE_PATH_MAX, "/tmp/slew-%u",
                     (unsigned)getuid());
    return n > 0 && n < SERVICE_PATH_MAX;
}

/* The name of the socket under it. */
static bool place_under(const char *directory, const char *rig_path,
                        char path[SERVICE_PATH_MAX])
{
    char *full = realpath(rig_path, NULL);
    const char *name = full != NULL ? full : rig_path;
    const int n =
        snprintf(path, SERVICE_PATH_MAX, "%s/rig-%08x.sock", directory,
                 (unsigned)crc32_of(0, name, strlen(name)));
    free(full);
    return n < SERVICE_PATH_MAX;
}

/* A directory in /tmp that somebody else has made, or can write into, is not to
 * be trusted; the others only their owner can make. */
bool service_place_is_trusted(const char *directory)
{
    struct stat status;
    return lstat(directory, &status) == 0 && S_ISDIR(status.st_mode) &&
           (strncmp(directory, "/tmp/", 5) != 0 ||
            (status.st_uid == getuid() && (status.st_mode & 022) == 0));
}

int service_place_new(const char *rig_path, const char *command,
                      char path[SERVICE_PATH_MAX])
{
    char directory[SERVICE_PATH_MAX];
    for (unsigned i = 0; i < PLACE_COUNT; i++) {
        if (!place_directory(i, directory))
            continue;
        (void)mkdir(directory, i == 1 ? 0755 : 0700);
        if (service_place_is_trusted(directory) &&
            access(directory, W_OK | X_OK) == 0 &&
            place_under(directory, rig_path, path))
            return 0;
    }
    error_say("slew %s: no directory for the socket, expected one that can be "
              "written in SLEW_RUN_DIR",
              command);
    return -1;
}

/* --- to and from it --- */

static int link_connect(struct service_link *link, const char *path)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    if (strlen(path) >= sizeof address.sun_path)
        return -1;
    memcpy(address.sun_path, path, strlen(path));
    link->file = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (link->file >= 0 &&
        connect(link->file, (struct sockaddr *)&address, sizeof address) == 0)
        return 0;
    if (link->file >= 0)
        close(link->file);
    link->file = -1;
    return -1;
}

static int link_find(struct service_link *link, const char *rig_path)
{
    char directory[SERVICE_PATH_MAX], path[SERVICE_PATH_MAX];
    for (unsigned i = 0; i < PLACE_COUNT; i++)
        if (place_directory(i, directory) &&
            service_place_is_trusted(directory) &&
            place_under(directory, rig_path, path) &&
            link_connect(link, path) == 0)
            return 0;
    return -1;
}

int service_link_open(struct service_link *link, const char *socket_path,
                      const char *rig_path, bool quiet)
{
    *link = (struct service_link){ .file = -1 };
    const int err = socket_path != NULL ? link_connect(link, socket_path)
                                        : link_find(link, rig_path);
    const char *line =
        err < 0 ? NULL : service_link_line(link, SERVICE_ANSWER_MS);
    if (line != NULL)
        link->hello = cJSON_Parse(line);
    if (link->hello != NULL && cJSON_HasObjectItem(link->hello, "version"))
        return 0;
    if (!quiet)
        error_say("%s: no service %s",
                  socket_path != NULL ? socket_path : rig_path,
                  err < 0 ? "runs for it" : "answers");
    service_link_close(link);
    return -1;
}

void service_link_close(struct service_link *link)
{
    if (link->file >= 0)
        close(link->file);
    memory_free(link->in);
    cJSON_Delete(link->hello);
    *link = (struct service_link){ .file = -1 };
}

static void link_lose(struct service_link *link)
{
    if (link->file >= 0)
        close(link->file);
    link->file = -1;
}

int service_link_send(struct service_link *link, const char *line)
{
    const size_t length = strlen(line);
    for (size_t at = 0; link->file >= 0 && at <= length;) {
        const ssize_t sent =
            at < length ? send(link->file, line + at, length - at, MSG_NOSIGNAL)
                        : send(link->file, "\n", 1, MSG_NOSIGNAL);
        if (sent < 0 && errno != EINTR)
            link_lose(link);
        at += sent > 0 ? (size_t)sent : 0;
    }
    return link->file < 0 ? -1 : 0;
}

static int64_t link_now_ms(void)
{
    struct timespec now = { 0 };
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * INT64_C(1000) + now.tv_nsec / 1000000;
}

static void link_look(struct service_link *link)
{
    if (link->stopped || link->interrupts == NULL || *link->interrupts == 0)
        return;
    link->stopped = true;
    (void)service_link_send(link, "{\"command\":\"stop\"}");
    (void)service_link_send(link, "{\"command\":\"cancel\"}");
}

/* False: nothing has come until then. */
static bool link_wait(struct service_link *link, int64_t until_ms)
{
    struct pollfd look = { .fd = link->file, .events = POLLIN };
    for (;;) {
        link_look(link);
        const int64_t left_ms = until_ms - link_now_ms();
        const int64_t slice_ms =
            left_ms < PLACE_SLICE_MS ? left_ms : PLACE_SLICE_MS;
        const int got = poll(&look, 1, slice_ms > 0 ? (int)slice_ms : 0);
        if (got > 0)
            return true;
        if ((got < 0 && errno != EINTR) || left_ms <= 0)
            return false;
    }
}

/* More of what comes; false: it took too long, or nothing comes any more. */
static bool link_read(struct service_link *link, int64_t until_ms)
{
    if (!link_wait(link, until_ms))
        return false;
    if (link->length + PLACE_PIECE > link->size) {
        link->size += link->size + PLACE_PIECE;
        link->in = memory_resize(link->in, link->size, 1);
    }
    const ssize_t got =
        recv(link->file, link->in + link->length, PLACE_PIECE, 0);
    if (got <= 0 || link->length > PLACE_LINE_MAX)
        link_lose(link);
    link->length += got > 0 ? (size_t)got : 0;
    return got > 0;
}

const char *service_link_line(struct service_link *link, int timeout_ms)
{
    const int64_t until_ms = link_now_ms() + timeout_ms;
    link->length -= link->line;
    if (link->length > 0)
        memmove(link->in, link->in + link->line, link->length);
    link->line = 0;
    for (;;) {
        char *end =
            link->length == 0 ? NULL : memchr(link->in, '\n', link->length);
        if (end != NULL) {
            *end = '\0';
            link->line = (size_t)(end - link->in) + 1;
            return link->in;
        }
        if (link->file < 0 || !link_read(link, until_ms))
            return NULL;
    }
}

/* Is it the answer to that command? */
static bool link_answers(const cJSON *object, double id)
{
    const cJSON *own = cJSON_GetObjectItemCaseSensitive(object, "id");
    return cJSON_IsNumber(own) && own->valuedouble == id &&
           cJSON_HasObjectItem(object, "ok");
}

cJSON *service_link_ask(struct service_link *link, cJSON *command,
                        int timeout_ms,
                        void (*event)(void *context, const cJSON *event),
                        void *context)
{
    const double id = ++link->asked;
    const char *line;
    cJSON_AddNumberToObject(command, "id", id);
    char *text = cJSON_PrintUnformatted(command);
    cJSON_Delete(command);
    if (text == NULL)
        memory_fail();
    const int err = service_link_send(link, text);
    free(text);
    while (err == 0 && (line = service_link_line(link, timeout_ms)) != NULL) {
        cJSON *object = cJSON_Parse(line);
        if (link_answers(object, id))
            return object;
        if (event != NULL && cJSON_HasObjectItem(object, "event"))
            event(context, object);
        cJSON_Delete(object);
    }
    return NULL;
}
