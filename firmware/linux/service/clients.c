/* firmware/linux/service/clients.c - see clients.h. */
#define _GNU_SOURCE /* accept4 */
#include "firmware/linux/service/clients.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "firmware/control/mailbox.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/service/listen.h"
#include "firmware/linux/service/loop.h"

#define CLIENTS_LINES    16     /* lines of a seat in one look */
#define CLIENTS_WAIT_MS  50     /* for something to come, and for the end */
#define CLIENTS_REST_NS  100000 /* between two looks, at least, */
#define CLIENTS_MOST_NS  500000 /* and at most */
#define CLIENTS_PRIORITY (SERVICE_PRIORITY - 1)
#define CLIENTS_STACK    262144
#define CLIENTS_FILES    512 /* of the process: clients, the page's, its own */

/* Whoever holds it runs ahead of what the reader is ahead of. */
static void clients_make_lock(struct service_clients *clients)
{
    pthread_mutexattr_t lock;
    (void)pthread_mutexattr_init(&lock);
    (void)pthread_mutexattr_setprotocol(&lock, PTHREAD_PRIO_INHERIT);
    if (pthread_mutex_init(&clients->lock, &lock) != 0)
        (void)pthread_mutex_init(&clients->lock, NULL);
    (void)pthread_mutexattr_destroy(&lock);
}

/* The server's: what the reader does not take for itself. */
static void clients_make_rooms(struct service_clients *clients)
{
    for (unsigned i = 0; i < SERVICE_SPARE; i++) {
        char *room = clients->spare[i] == NULL ? malloc(SERVICE_ROOM) : NULL;
        if (room == NULL)
            continue;
        (void)pthread_mutex_lock(&clients->lock);
        clients->spare[i] = room;
        (void)pthread_mutex_unlock(&clients->lock);
    }
}

/* poll() of all seats fails where fewer files may be open. */
static bool clients_may_be_many(void)
{
    struct rlimit limit;
    if (getrlimit(RLIMIT_NOFILE, &limit) < 0 || limit.rlim_cur >= CLIENTS_FILES)
        return true;
    limit.rlim_cur = CLIENTS_FILES;
    return limit.rlim_max >= CLIENTS_FILES &&
           setrlimit(RLIMIT_NOFILE, &limit) == 0;
}

int service_clients_open(struct service_clients *clients, const char *path,
                         unsigned mode)
{
    clients->listener = -1;
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++)
        clients->client[i].file = -1;
    if (clients_may_be_many())
        clients->listener = service_listen(path, mode);
    else
        error_say("%s: too few files may be open for its clients, expected "
                  "ulimit -n %d or more",
                  path, CLIENTS_FILES);
    if (clients->listener < 0)
        return -1;
    clients_make_lock(clients);
    clients->bell = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    clients_make_rooms(clients);
    return 0;
}

static void client_close(struct service_client *client)
{
    close(client->file);
    free(client->room);
    service_client_forget(client);
    service_client_forget(client);
    *client = (struct service_client){ .file = -1 };
}

void service_clients_close(struct service_clients *clients, const char *path)
{
    if (clients->listener < 0)
        return;
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++)
        if (clients->client[i].file >= 0)
            client_close(&clients->client[i]);
    for (unsigned i = 0; i < SERVICE_SPARE; i++)
        free(clients->spare[i]);
    service_listen_end(clients->listener, path);
    close(clients->bell);
    (void)pthread_mutex_destroy(&clients->lock);
}

/* --- out, under the lock --- */

/* Streams take a quarter of the buffer, a stop's answer and refusals what there
 * is up to a half; the rest stays for answers to what had a turn. */
#define CLIENT_STREAMS (SERVICE_OUT / 4)
#define CLIENT_AT_ONCE (SERVICE_OUT / 2)

static bool client_is_full(const struct service_client *client)
{
    return client->out_length > CLIENT_AT_ONCE;
}

/* Nobody takes what is said to it.  What it has said itself is read to its end all
 * the same, as there may be a stop in it; only then it is over. */
static void client_deafen(struct service_client *client)
{
    client->is_deaf = true;
    client->out_length = 0;
}

static void client_write(struct service_client *client)
{
    if (client->out_length == 0)
        return;
    const ssize_t sent = send(client->file, client->out, client->out_length,
                              MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && errno != EAGAIN && errno != EINTR)
        client_deafen(client);
    if (sent <= 0 || client->is_deaf)
        return;
    client->out_length -= (size_t)sent;
    memmove(client->out, client->out + sent, client->out_length);
}

/* A line, or nothing of it. */
static bool client_put(struct service_client *client, const char *text)
{
    const size_t length = strlen(text);
    if (length >= SERVICE_OUT - client->out_length)
        return false;
    memcpy(client->out + client->out_length, text, length);
    client->out[client->out_length + length] = '\n';
    client->out_length += length + 1;
    return true;
}

/* Above `room` bytes it is left out, so that what counts more finds its place. */
static void client_tell(struct service_client *client, const char *text,
                        size_t room)
{
    if (client->over || client->is_deaf || client->out_length > room ||
        !client_put(client, text))
        client->dropped++;
}

/* --- the reader: a line --- */

/* What a line without a turn of its own is answered. */
static void client_say(struct service_client *client, const char *error,
                       const char *text)
{
    const char *id = client->scan.id;
    char line[512];
    if (!service_line_id_is_whole(id))
        id = "";
    snprintf(line, sizeof line, "{%s%s%s\"ok\":%s%s%s%s%s%s}",
             id[0] != '\0' ? "\"id\":" : "", id, id[0] != '\0' ? "," : "",
             error == NULL ? "true" : "false",
             error == NULL ? "" : ",\"error\":\"", error == NULL ? "" : error,
             error == NULL ? "" : "\",\"text\":\"", error == NULL ? "" : text,
             error == NULL ? "" : "\"");
    client_tell(client, line, CLIENT_AT_ONCE);
}

/* The line that is in the room behind those that wait is one of them. */
static void client_queue(struct service_clients *clients,
                         struct service_client *client)
{
    if (client->spills || client->count == SERVICE_QUEUE) {
        client_say(client, "FULL",
                   "too many requests of this client wait, expected at most "
                   "64 and 262144 bytes; this one was not done");
        return;
    }
    client->room[client->used + client->length] = '\0';
    client->queue[(client->first + client->count++) % SERVICE_QUEUE] =
        (struct service_line){ client->length, clients->mailbox->stops };
    client->used += client->length + 1;
    clients->rings = true;
}

static void client_line(struct service_clients *clients,
                        struct service_client *client)
{
    const struct service_line_scan *scan = &client->scan;
    if (service_line_is_stop(scan)) {
        mailbox_stop(clients->mailbox);
        client_say(client, NULL, NULL);
        client_write(client);
    } else if (scan->values > SERVICE_LINE_VALUES) {
        client_say(client, "JSON",
                   "the line has too many values, expected at most 4096");
    } else if (scan->any) {
        client_queue(clients, client);
    }
    client->scan = (struct service_line_scan){ .depth = 0 };
    client->length = 0;
    client->spills = false;
}

/* Some lines of what came, at most so many.  Each byte is looked at once. */
static void client_lines(struct service_clients *clients,
                         struct service_client *client)
{
    for (unsigned lines = 0;
         lines < CLIENTS_LINES && client->piece_at < client->piece_length;) {
        const char byte = client->piece[client->piece_at++];
        if (byte == '\n') {
            client_line(clients, client);
            lines++;
            continue;
        }
        service_line_take(&client->scan, byte);
        client->spills |= client->used + client->length + 1 >= SERVICE_ROOM;
        if (!client->spills)
            client->room[client->used + client->length] = byte;
        client->length++;
    }
    if (client->length < SERVICE_LINE_MAX)
        return;
    client->scan.id[0] = '\0';
    client_say(client, "line",
               "the line is too long, expected at most 262144 bytes");
    client_write(client);
    client->over = true;
}

static void client_read(struct service_clients *clients,
                        struct service_client *client, short events)
{
    if (client->piece_at == client->piece_length && events != 0) {
        const ssize_t got = recv(client->file, client->piece,
                                 sizeof client->piece, MSG_DONTWAIT);
        if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) {
            client->over = true;
            client->out_length = 0; /* nobody is there to take it */
        }
        client->piece_at = 0;
        client->piece_length = got > 0 ? (size_t)got : 0;
    }
    if (!client->over)
        client_lines(clients, client);
    clients->rings |= client->over;
}

/* --- the reader: who knocks --- */

static void clients_refuse(struct service_clients *clients, int file)
{
    static const char said[] =
        "{\"ok\":false,\"error\":\"clients\",\"text\":\"too many clients are "
        "connected\"}\n";
    (void)send(file, said, sizeof said - 1, MSG_NOSIGNAL | MSG_DONTWAIT);
    close(file);
    clients->refused++;
}

/* One seat and a room for it; nobody is let in before the server has made one. */
static void clients_accept(struct service_clients *clients)
{
    unsigned seat = 0, spare = 0;
    while (seat < SERVICE_CLIENTS && clients->client[seat].file >= 0)
        seat++;
    while (spare < SERVICE_SPARE && clients->spare[spare] == NULL)
        spare++;
    clients->rings = true;
    if (seat < SERVICE_CLIENTS && spare == SERVICE_SPARE)
        return;
    const int file =
        accept4(clients->listener, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (file < 0)
        return;
    if (seat == SERVICE_CLIENTS) {
        clients_refuse(clients, file);
        return;
    }
    clients->client[seat].file = file;
    clients->client[seat].room = clients->spare[spare];
    clients->client[seat].number = ++clients->count;
    clients->spare[spare] = NULL;
}

static int64_t clients_now_ns(void)
{
    struct timespec now = { 0 };
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

bool service_clients_look(struct service_clients *clients, int timeout_ms)
{
    struct pollfd look[SERVICE_CLIENTS + 1];
    bool more = false;
    (void)pthread_mutex_lock(&clients->lock);
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++) {
        const struct service_client *client = &clients->client[i];
        look[i] = (struct pollfd){ .fd = client->over ? -1 : client->file,
                                   .events = POLLIN };
        more |= client->piece_at < client->piece_length;
    }
    (void)pthread_mutex_unlock(&clients->lock);
    look[SERVICE_CLIENTS] =
        (struct pollfd){ .fd = clients->listener, .events = POLLIN };
    if (poll(look, SERVICE_CLIENTS + 1, more ? 0 : timeout_ms) < 0)
        return false;
    clients->busy_ns = clients_now_ns();
    more = false;
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++) {
        struct service_client *client = &clients->client[i];
        (void)pthread_mutex_lock(&clients->lock);
        /* it may have been closed meanwhile; only the reader fills a seat */
        if (client->file >= 0 && !client->over)
            client_read(clients, client, look[i].revents);
        more |= look[i].revents != 0;
        (void)pthread_mutex_unlock(&clients->lock);
    }
    (void)pthread_mutex_lock(&clients->lock);
    if (look[SERVICE_CLIENTS].revents != 0)
        clients_accept(clients);
    more |= look[SERVICE_CLIENTS].revents != 0;
    if (clients->rings)
        (void)!write(clients->bell, &(uint64_t){ 1 }, sizeof(uint64_t));
    clients->rings = false;
    (void)pthread_mutex_unlock(&clients->lock);
    return more;
}

/* Half of the time is others', whatever clients send. */
static void *clients_main(void *context)
{
    struct service_clients *clients = context;
    while (!atomic_load(&clients->ends)) {
        if (!service_clients_look(clients, CLIENTS_WAIT_MS))
            continue;
        int64_t rest_ns = clients_now_ns() - clients->busy_ns;
        rest_ns = rest_ns < CLIENTS_REST_NS ? CLIENTS_REST_NS : rest_ns;
        rest_ns = rest_ns > CLIENTS_MOST_NS ? CLIENTS_MOST_NS : rest_ns;
        nanosleep(&(struct timespec){ .tv_nsec = rest_ns }, NULL);
    }
    return NULL;
}

static int clients_create(struct service_clients *clients, bool first)
{
    const struct sched_param priority = { .sched_priority = CLIENTS_PRIORITY };
    pthread_attr_t attributes;
    int err = pthread_attr_init(&attributes);
    if (err != 0)
        return err;
    (void)pthread_attr_setstacksize(&attributes, CLIENTS_STACK);
    if (first) {
        (void)pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
        (void)pthread_attr_setschedpolicy(&attributes, SCHED_FIFO);
        (void)pthread_attr_setschedparam(&attributes, &priority);
    }
    err = pthread_create(&clients->thread, &attributes, clients_main, clients);
    if (err == 0)
        (void)pthread_setname_np(clients->thread, "slew-clients");
    (void)pthread_attr_destroy(&attributes);
    return err;
}

int service_clients_start(struct service_clients *clients)
{
    int err = clients_create(clients, true);
    if (err == EPERM)
        err = clients_create(clients, false);
    clients->runs = err == 0;
    return err;
}

void service_clients_stop(struct service_clients *clients)
{
    atomic_store(&clients->ends, true);
    if (clients->runs)
        (void)pthread_join(clients->thread, NULL);
    clients->runs = false;
}

/* --- the server --- */

/* A condition would do, but for the lock that it has inside and whose holder
 * may be behind everything else. */
void service_clients_wait(struct service_clients *clients, int timeout_ms)
{
    struct pollfd look = { .fd = clients->bell, .events = POLLIN };
    uint64_t rung;
    (void)poll(&look, 1, timeout_ms);
    (void)!read(clients->bell, &rung, sizeof rung);
}

void service_clients_serve(
    struct service_clients *clients,
    void (*came)(void *context, struct service_client *client),
    void (*gone)(void *context, struct service_client *client), void *context)
{
    clients_make_rooms(clients);
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++) {
        struct service_client *client = &clients->client[i];
        (void)pthread_mutex_lock(&clients->lock);
        const bool is_there = client->file >= 0;
        if (is_there)
            client_write(client);
        const bool is_over = client->over;
        (void)pthread_mutex_unlock(&clients->lock);
        if (!is_there)
            continue;
        if (!is_over && !client->is_here) {
            client->is_here = true;
            came(context, client);
        }
        if (!is_over)
            continue;
        if (client->is_here)
            gone(context, client);
        (void)pthread_mutex_lock(&clients->lock);
        client_close(client);
        (void)pthread_mutex_unlock(&clients->lock);
    }
}

/* Only the server takes out of a queue, so that what is first stays so. */
static char *client_take(struct service_clients *clients,
                         struct service_client *client, uint32_t *stops)
{
    (void)pthread_mutex_lock(&clients->lock);
    const bool any =
        client->count > 0 && !client->over && !client_is_full(client);
    const struct service_line line =
        client->queue[client->first % SERVICE_QUEUE];
    (void)pthread_mutex_unlock(&clients->lock);
    char *text = any ? malloc(line.length + 1) : NULL;
    if (text == NULL)
        return NULL;
    *stops = line.stops;
    (void)pthread_mutex_lock(&clients->lock);
    memcpy(text, client->room, line.length + 1);
    client->used -= line.length + 1;
    memmove(client->room, client->room + line.length + 1,
            client->used + (client->spills ? 0 : client->length));
    client->first++;
    client->count--;
    (void)pthread_mutex_unlock(&clients->lock);
    return text;
}

bool service_client_next(struct service_clients *clients,
                         struct service_client *client)
{
    struct service_asked *to =
        client->head.is_there ? &client->next : &client->head;
    if (to->is_there)
        return true;
    char *text = client_take(clients, client, &to->stops);
    if (text == NULL)
        return false;
    to->object = cJSON_ParseWithOpts(text, NULL, true);
    to->is_there = true;
    free(text);
    return true;
}

void service_client_forget(struct service_client *client)
{
    cJSON_Delete(client->head.object);
    client->head = client->next;
    client->next = (struct service_asked){ .is_there = false };
}

void service_client_answer(struct service_clients *clients,
                           struct service_client *client, cJSON *object)
{
    char *text = cJSON_PrintUnformatted(object);
    cJSON_Delete(object);
    (void)pthread_mutex_lock(&clients->lock);
    if (text == NULL || (!client->is_deaf && !client_put(client, text))) {
        (void)shutdown(client->file, SHUT_RDWR);
        client_deafen(client);
    }
    client_write(client);
    (void)pthread_mutex_unlock(&clients->lock);
    free(text);
}

void service_client_tell(struct service_clients *clients,
                         struct service_client *client, const char *text)
{
    (void)pthread_mutex_lock(&clients->lock);
    client_tell(client, text, CLIENT_STREAMS);
    client_write(client);
    (void)pthread_mutex_unlock(&clients->lock);
}
