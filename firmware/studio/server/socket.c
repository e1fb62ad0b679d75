/* firmware/studio/server/socket.c - a WebSocket: lines of the service both ways,
 * frames of the tick down; see parts.h.
 *
 * Nothing waits for a browser: of one that does not read, lines stay with the
 * service, which leaves streams out, and frames are joined. */
#define _GNU_SOURCE
#include <cjson/cJSON.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "firmware/host/base/memory.h"
#include "firmware/studio/server/parts.h"

#define SOCKET_RATE_LOW    30
#define SOCKET_RATE_HIGH   60
#define SOCKET_KERNEL      65536 /* bytes on their way in the system: old ones */
#define SOCKET_DROPPED_MAX 1048576 /* bytes that are read after the end */

/* --- the service's side ------------------------------------------------------ */

static int socket_link(const char *path)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    const int file =
        socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);

    if (file < 0 || strlen(path) >= sizeof address.sun_path) {
        if (file >= 0)
            close(file);
        return -1;
    }
    memcpy(address.sun_path, path, strlen(path));
    if (connect(file, (const struct sockaddr *)&address, sizeof address) == 0)
        return file;
    close(file);
    return -1;
}

static void socket_unlink(struct studio_connection *self)
{
    if (self->link >= 0)
        close(self->link);
    self->link = -1;
}

/* As much as the service takes; the browser is not read further until it has
 * all of the line. */
static void socket_send_up(struct studio_connection *self)
{
    while (self->up_whole && self->up_done < self->up_length) {
        const ssize_t sent =
            send(self->link, self->up + self->up_done,
                 self->up_length - self->up_done, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (sent < 0 && errno == EINTR)
            continue;
        if (sent < 0 && errno != EAGAIN)
            socket_unlink(self);
        if (sent <= 0)
            return;
        self->up_done += (size_t)sent;
    }
    if (!self->up_whole)
        return;
    self->up_whole = false;
    self->up_length = self->up_done = 0;
    (void)lws_rx_flow_control(self->wsi, 1);
}

static void socket_receive_down(struct studio_connection *self)
{
    while (self->link >= 0 && self->down_length < sizeof self->down) {
        const ssize_t got =
            recv(self->link, self->down + self->down_length,
                 sizeof self->down - self->down_length, MSG_DONTWAIT);
        if (got < 0 && errno == EINTR)
            continue;
        if (got == 0 || (got < 0 && errno != EAGAIN))
            socket_unlink(self);
        if (got <= 0)
            return;
        self->down_length += (size_t)got;
    }
}

/* --- the browser's side ------------------------------------------------------ */

/* The service is left at once.  The browser is told why as soon as it can be written
 * to, and libwebsockets waits 5 s for its answer.  What it sends meanwhile is read and
 * dropped: a wire that is closed with something unread is reset, and the browser might
 * never read why.  Not on the way in: libwebsockets would lose its place among the
 * frames that it has read, and give up. */
static int socket_close(struct studio_connection *self,
                        enum lws_close_status status, const char *why)
{
    socket_unlink(self);
    self->end = status;
    self->end_why = why;
    (void)lws_rx_flow_control(self->wsi, 1);
    lws_callback_on_writable(self->wsi);
    return 0;
}

static int socket_write_end(struct studio_connection *self)
{
    unsigned char text[64];

    if (self->is_end_said)
        return 0;
    self->is_end_said = true;
    lws_close_reason(
        self->wsi, self->end, text,
        (size_t)snprintf((char *)text, sizeof text, "%s", self->end_why));
    return -1;
}

static int socket_drop(struct studio_connection *self, size_t length)
{
    self->dropped += length;
    return self->dropped > SOCKET_DROPPED_MAX ? -1 : 0;
}

static int64_t socket_rate_ns(struct lws *wsi)
{
    char text[16];
    int rate = SOCKET_RATE_HIGH;

    const char *asked = lws_get_urlarg_by_name(wsi, "rate=", text, sizeof text);
    if (asked != NULL)
        rate = (int)strtol(asked, NULL, 10);
    rate = rate < SOCKET_RATE_LOW    ? SOCKET_RATE_LOW
           : rate > SOCKET_RATE_HIGH ? SOCKET_RATE_HIGH
                                     : rate;
    return 1000000000 / rate;
}

static int socket_open(struct studio_server *server, struct lws *wsi,
                       struct studio_connection **user)
{
    struct studio_connection *self = NULL;

    *user = NULL;
    for (unsigned i = 0; i < STUDIO_CONNECTIONS && self == NULL; i++)
        if (server->connection[i].wsi == NULL)
            self = &server->connection[i];
    if (self == NULL)
        return -1;
    memset(self, 0, sizeof *self);
    self->wsi = wsi;
    self->server = server;
    self->link = socket_link(server->socket);
    self->up = memory_new(STUDIO_LINE_MAX, 1);
    self->rate_ns = socket_rate_ns(wsi);
    self->count.is_real = server->config->is_real;
    service_frame_init(&self->frame, server->rig, &self->memory);
    *user = self;
    (void)setsockopt(lws_get_socket_fd(wsi), SOL_SOCKET, SO_SNDBUF,
                     &(int){ SOCKET_KERNEL }, sizeof(int));
    return self->link < 0 ? socket_close(self, LWS_CLOSE_STATUS_GOINGAWAY,
                                         "the service is gone")
                          : 0;
}

static void socket_gone(struct studio_connection *self)
{
    socket_unlink(self);
    memory_free(self->up);
    memory_pool_free(&self->memory);
    memset(self, 0, sizeof *self);
}

/* More than a person, or a held button, sends. */
static bool socket_is_flood(struct studio_connection *self)
{
    const int64_t now_ns = studio_now_ns();

    if (now_ns - self->second_ns >= 1000000000) {
        self->second_ns = now_ns;
        self->frames_in_second = 0;
    }
    return ++self->frames_in_second > STUDIO_FRAMES_MAX;
}

/* --- what has come too late -------------------------------------------------- */

/* May what was read be from before the thread stood still? */
static bool socket_is_late(struct studio_server *server)
{
    const int64_t now_ns = studio_now_ns();

    if (now_ns - server->looked_ns > STUDIO_STALL_NS)
        server->stalled_ns = now_ns;
    return server->stalled_ns != 0 &&
           now_ns - server->stalled_ns < STUDIO_STALE_NS;
}

/* A jog that waited here is of a button that is held no longer: it is answered and
 * not passed on.  Of other commands nobody says how soon they must be done. */
static bool socket_refuses(struct studio_connection *self)
{
    char text[160];
    cJSON *line = cJSON_ParseWithLength(self->up, self->up_length);
    const char *command =
        cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(line, "command"));
    const bool is_jog = command != NULL && strcmp(command, "jog") == 0;
    const cJSON *id = cJSON_GetObjectItemCaseSensitive(line, "id");
    cJSON *answer = cJSON_CreateObject();

    if (id != NULL)
        cJSON_AddItemToObject(answer, "id", cJSON_Duplicate(id, false));
    cJSON_AddBoolToObject(answer, "ok", false);
    cJSON_AddStringToObject(answer, "error", "LATE");
    cJSON_AddStringToObject(answer, "text", "the jog has come too late");
    if (is_jog && cJSON_PrintPreallocated(answer, text, sizeof text, false)) {
        const size_t length = strlen(text);
        if (self->down_length + length + 1 <= sizeof self->down) {
            /* Before the rest, which may end within a line. */
            memmove(self->down + length + 1, self->down, self->down_length);
            memcpy(self->down, text, length);
            self->down[length] = '\n';
            self->down_length += length + 1;
        }
    }
    cJSON_Delete(answer);
    cJSON_Delete(line);
    return is_jog;
}

/* A line feed in JSON is white space; here it would end the line. */
static int socket_take(struct studio_connection *self, const char *in,
                       size_t length)
{
    if (self->end != 0)
        return socket_drop(self, length);
    if (lws_frame_is_binary(self->wsi))
        return socket_close(self, LWS_CLOSE_STATUS_UNACCEPTABLE_OPCODE,
                            "lines of JSON are expected");
    if (self->up_length + length + 1 > STUDIO_LINE_MAX)
        return socket_close(self, LWS_CLOSE_STATUS_MESSAGE_TOO_LARGE,
                            "at most 262143 bytes are expected");
    for (size_t i = 0; i < length; i++)
        self->up[self->up_length++] = in[i] == '\n' ? ' ' : in[i];
    if (!lws_is_final_fragment(self->wsi) ||
        lws_remaining_packet_payload(self->wsi) > 0)
        return 0;
    if (socket_is_flood(self))
        return socket_close(self, LWS_CLOSE_STATUS_POLICY_VIOLATION,
                            "at most 200 frames a second are expected");
    if (socket_is_late(self->server) && socket_refuses(self)) {
        self->up_length = 0;
        lws_callback_on_writable(self->wsi);
        return 0;
    }
    self->up[self->up_length++] = '\n';
    self->up_whole = true;
    (void)lws_rx_flow_control(self->wsi, 0);
    socket_send_up(self);
    return self->link < 0 ? socket_close(self, LWS_CLOSE_STATUS_GOINGAWAY,
                                         "the service is gone")
                          : 0;
}

/* True: a line was sent. */
static bool socket_write_line(struct studio_connection *self)
{
    static unsigned char buffer[LWS_PRE + STUDIO_DOWN_MAX]; /* of one thread */
    const char *end = memchr(self->down, '\n', self->down_length);

    if (end == NULL)
        return false;
    const size_t length = (size_t)(end - self->down);
    memcpy(buffer + LWS_PRE, self->down, length);
    self->down_length -= length + 1;
    memmove(self->down, end + 1, self->down_length);
    (void)lws_write(self->wsi, buffer + LWS_PRE, length, LWS_WRITE_TEXT);
    return true;
}

static void socket_write_frame(struct studio_connection *self, int64_t now_ns)
{
    static unsigned char buffer[LWS_PRE + BYTES_MAX]; /* of one thread */

    self->count.number++;
    const size_t length = bytes_of_frame(self->server->rig, &self->frame,
                                         &self->count, buffer + LWS_PRE);
    self->frame.ticks = 0;
    self->sent_ns = now_ns;
    (void)lws_write(self->wsi, buffer + LWS_PRE, length, LWS_WRITE_BINARY);
}

/* A tick of the 4 ms timer more or less does not count. */
static bool socket_is_due(const struct studio_connection *self, int64_t now_ns)
{
    return self->frame.ticks > 0 &&
           now_ns - self->sent_ns >= self->rate_ns - 3000000;
}

static bool socket_has_more(const struct studio_connection *self,
                            int64_t now_ns)
{
    return memchr(self->down, '\n', self->down_length) != NULL ||
           socket_is_due(self, now_ns) || self->link < 0;
}

/* One write per call, as libwebsockets requires; lines first. */
static int socket_write(struct studio_connection *self)
{
    const int64_t now_ns = studio_now_ns();

    if (self->end != 0)
        return socket_write_end(self);
    if (!socket_write_line(self)) {
        if (self->link < 0)
            return socket_close(self, LWS_CLOSE_STATUS_GOINGAWAY,
                                "the service is gone");
        if (socket_is_due(self, now_ns))
            socket_write_frame(self, now_ns);
    }
    if (socket_has_more(self, now_ns))
        lws_callback_on_writable(self->wsi);
    return 0;
}

int studio_socket(struct lws *wsi, enum lws_callback_reasons reason, void *user,
                  void *in, size_t length)
{
    struct studio_server *server = lws_context_user(lws_get_context(wsi));
    struct studio_connection **self = user;

    switch (reason) {
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION: {
        const unsigned refusal = studio_refusal(server, wsi);
        if (refusal == 0)
            return 0;
        (void)lws_return_http_status(wsi, refusal, NULL);
        return -1;
    }
    case LWS_CALLBACK_ESTABLISHED:
        return socket_open(server, wsi, self);
    case LWS_CALLBACK_CLOSED:
        if (self != NULL && *self != NULL)
            socket_gone(*self);
        return 0;
    case LWS_CALLBACK_RECEIVE:
        return socket_take(*self, in, length);
    case LWS_CALLBACK_SERVER_WRITEABLE:
        return socket_write(*self);
    default:
        return 0;
    }
}

/* --- both -------------------------------------------------------------------- */

static void socket_look(struct studio_connection *self,
                        const struct service_frame *fresh, int64_t now_ns)
{
    if (self->end != 0)
        return;
    if (fresh->ticks > 0) {
        self->count.joined += self->frame.ticks > 0;
        service_frame_join(&self->frame, fresh);
    }
    if (self->link >= 0)
        socket_send_up(self);
    socket_receive_down(self);
    if (socket_has_more(self, now_ns))
        lws_callback_on_writable(self->wsi);
}

void studio_socket_look(struct studio_server *server, int64_t now_ns)
{
    (void)socket_is_late(server);
    server->looked_ns = now_ns;
    server->frame.ticks = 0;
    (void)service_frames_take(server->frames, &server->frame);
    for (unsigned i = 0; i < STUDIO_CONNECTIONS; i++)
        if (server->connection[i].wsi != NULL)
            socket_look(&server->connection[i], &server->frame, now_ns);
}
