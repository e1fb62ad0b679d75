/* firmware/linux/service/clients.c - see clients.h. */
#define _GNU_SOURCE /* accept4 */
#include "firmware/linux/service/clients.h"

#include <errno.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

#include "firmware/control/mailbox.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/service/loop.h"

#define CLIENTS_READ     2048 /* bytes of a seat in one look */
#define CLIENTS_LINES    16   /* lines of a seat in one look */
#define CLIENTS_KEEP     65536 /* bytes of a buffer that stay for the next line */
#define CLIENTS_WAIT_MS  50    /* for something to come, and for the end */
#define CLIENTS_REST_NS  100000 /* between two looks, at least */
#define CLIENTS_PRIORITY (SERVICE_PRIORITY - 1)
#define CLIENTS_STACK    262144

/* --- the socket --- */

static int clients_fail(struct service_clients *clients, const char *path,
                        const char *what)
{
    error_say("%s: %s", path, what);
    if (clients->listener >= 0)
        close(clients->listener);
    clients->listener = -1;
    return -1;
}

/* A socket that nobody listens on any more was left by one that was killed; one
 * with many who knock (EAGAIN) was not. */
static bool clients_is_served(const struct sockaddr_un *address)
{
    const int file =
        socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    const bool served =
        file >= 0 && (connect(file, (const struct sockaddr *)address,
                              sizeof *address) == 0 ||
                      errno == EAGAIN);
    if (file >= 0)
        close(file);
    return served;
}

/* Whoever holds it runs ahead of what the reader is ahead of. */
static void clients_make_lock(struct service_clients *clients)
{
    pthread_mutexattr_t lock;
    pthread_condattr_t changed;
    (void)pthread_mutexattr_init(&lock);
    (void)pthread_mutexattr_setprotocol(&lock, PTHREAD_PRIO_INHERIT);
    if (pthread_mutex_init(&clients->lock, &lock) != 0)
        (void)pthread_mutex_init(&clients->lock, NULL);
    (void)pthread_mutexattr_destroy(&lock);
    (void)pthread_condattr_init(&changed);
    (void)pthread_condattr_setclock(&changed, CLOCK_MONOTONIC);
    (void)pthread_cond_init(&clients->changed, &changed);
    (void)pthread_condattr_destroy(&changed);
}

int service_clients_open(struct service_clients *clients, const char *path,
                         unsigned mode)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    struct stat status;
    clients->listener = -1;
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++)
        clients->client[i].file = -1;
    clients_make_lock(clients);
    if (strlen(path) >= sizeof address.sun_path)
        return clients_fail(clients, path,
                            "the name of the socket is too long");
    memcpy(address.sun_path, path, strlen(path));
    if (clients_is_served(&address))
        return clients_fail(clients, path,
                            "a service listens there already, expected one "
                            "per rig");
    if (lstat(path, &status) == 0 && !S_ISSOCK(status.st_mode))
        return clients_fail(clients, path, "is there and is no socket");
    (void)unlink(path);
    clients->listener =
        socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (clients->listener < 0)
        return clients_fail(clients, path, strerror(errno));
    const mode_t before = umask(0777 & ~mode);
    const int err = bind(clients->listener, (const struct sockaddr *)&address,
                         sizeof address);
    (void)umask(before);
    if (err < 0 || listen(clients->listener, SERVICE_CLIENTS) < 0)
        return clients_fail(clients, path, strerror(errno));
    return 0;
}

static void client_close(struct service_client *client)
{
    close(client->file);
    free(client->in);
    while (client->count > 0) {
        free(client->queue[client->first++ % SERVICE_QUEUE].text);
        client->count--;
    }
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
    close(clients->listener);
    (void)unlink(path);
    (void)pthread_cond_destroy(&clients->changed);
    (void)pthread_mutex_destroy(&clients->lock);
}

/* --- out, under the lock --- */

static bool client_is_full(const struct service_client *client)
{
    return client->out_length > SERVICE_OUT / 2;
}

static void client_write(struct service_client *client)
{
    if (client->out_length == 0)
        return;
    const ssize_t sent = send(client->file, client->out, client->out_length,
                              MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && errno != EAGAIN && errno != EINTR) {
        client->over = true;
        client->out_length = 0;
    }
    if (sent <= 0)
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

/* Half of the buffer stays for answers. */
static void client_tell(struct service_client *client, const char *text)
{
    if (client->over || client_is_full(client) || !client_put(client, text))
        client->dropped++;
}

/* --- the reader: a line --- */

/* What a line without a turn of its own is answered. */
static void client_say(struct service_client *client, const char *error,
                       const char *text)
{
    char line[512], id[2 * SERVICE_ID_MAX] = "";
    cJSON *own = client_is_full(client) || client->scan.id[0] == '\0'
                     ? NULL
                     : cJSON_Parse(client->scan.id);
    if (own != NULL && !cJSON_PrintPreallocated(own, id, sizeof id - 1, false))
        id[0] = '\0';
    cJSON_Delete(own);
    snprintf(line, sizeof line, "{%s%s%s\"ok\":%s%s%s%s%s%s}",
             id[0] != '\0' ? "\"id\":" : "", id, id[0] != '\0' ? "," : "",
             error == NULL ? "true" : "false",
             error == NULL ? "" : ",\"error\":\"", error == NULL ? "" : error,
             error == NULL ? "" : "\",\"text\":\"", error == NULL ? "" : text,
             error == NULL ? "" : "\"");
    client_tell(client, line);
}

static void client_queue(struct service_clients *clients,
                         struct service_client *client, size_t length)
{
    const bool fits = client->count < SERVICE_QUEUE &&
                      client->queued + length <= SERVICE_QUEUE_BYTES;
    char *text = fits ? malloc(length + 1) : NULL;
    if (text == NULL) {
        client_say(client, "FULL",
                   "too many requests of this client wait, expected at most "
                   "64 and 262144 bytes; this one was not done");
        return;
    }
    memcpy(text, client->in, length);
    text[length] = '\0';
    client->queue[(client->first + client->count++) % SERVICE_QUEUE] =
        (struct service_line){ text, length, clients->mailbox->stops };
    client->queued += length;
    clients->woken = true;
}

/* The first `length` bytes of what came. */
static void client_line(struct service_clients *clients,
                        struct service_client *client, size_t length)
{
    const struct service_line_scan *scan = &client->scan;
    if (service_line_is_stop(scan)) {
        mailbox_stop(clients->mailbox);
        client_say(client, NULL, NULL);
        client_write(client);
    } else if (scan->values > SERVICE_LINE_VALUES) {
        client_say(client, "JSON",
                   "the line has too many values, expected at most 4096");
    } else if (length > 0 && !(length == 1 && client->in[0] == '\r')) {
        client_queue(clients, client, length);
    }
}

/* Some lines of what came, at most so many.  Each byte is looked at once. */
static void client_lines(struct service_clients *clients,
                         struct service_client *client)
{
    for (unsigned lines = 0;
         lines < CLIENTS_LINES && client->looked < client->in_length;) {
        const char byte = client->in[client->looked++];
        if (byte != '\n') {
            service_line_take(&client->scan, byte);
            continue;
        }
        client_line(clients, client, client->looked - 1);
        client->in_length -= client->looked;
        memmove(client->in, client->in + client->looked, client->in_length);
        client->looked = 0;
        client->scan = (struct service_line_scan){ .depth = 0 };
        lines++;
    }
    if (client->looked < SERVICE_LINE_MAX)
        return;
    client->scan.id[0] = '\0';
    client_say(client, "line",
               "the line is too long, expected at most 262144 bytes");
    client_write(client);
    client->over = true;
}

static bool client_has_room(struct service_client *client)
{
    if (client->in_length + CLIENTS_READ <= client->in_size)
        return true;
    const size_t size = 2 * client->in_size + CLIENTS_READ;
    char *larger = realloc(client->in, size);
    if (larger == NULL)
        return false;
    client->in = larger;
    client->in_size = size;
    return true;
}

static void client_read(struct service_clients *clients,
                        struct service_client *client, short events)
{
    if (client->looked == client->in_length && events != 0) {
        if (client->in_length == 0 && client->in_size > CLIENTS_KEEP) {
            free(client->in);
            client->in = NULL;
            client->in_size = 0;
        }
        const ssize_t got =
            client_has_room(client)
                ? recv(client->file, client->in + client->in_length,
                       CLIENTS_READ, MSG_DONTWAIT)
                : 0;
        if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) {
            client->over = true;
            client->out_length = 0; /* nobody is there to take it */
        }
        client->in_length += got > 0 ? (size_t)got : 0;
    }
    if (!client->over)
        client_lines(clients, client);
    clients->woken |= client->over;
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

static void clients_accept(struct service_clients *clients)
{
    const int file =
        accept4(clients->listener, NULL, NULL, SOCK_CLOEXEC | SOCK_NONBLOCK);
    unsigned seat = 0;
    if (file < 0)
        return;
    while (seat < SERVICE_CLIENTS && clients->client[seat].file >= 0)
        seat++;
    if (seat == SERVICE_CLIENTS) {
        clients_refuse(clients, file);
        return;
    }
    clients->client[seat].file = file;
    clients->client[seat].number = ++clients->count;
    clients->woken = true;
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
        more |= client->looked < client->in_length;
    }
    (void)pthread_mutex_unlock(&clients->lock);
    look[SERVICE_CLIENTS] =
        (struct pollfd){ .fd = clients->listener, .events = POLLIN };
    if (poll(look, SERVICE_CLIENTS + 1, more ? 0 : timeout_ms) < 0)
        return false;
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
    if (clients->woken)
        (void)pthread_cond_signal(&clients->changed);
    (void)pthread_mutex_unlock(&clients->lock);
    return more;
}

static int64_t clients_now_ns(void)
{
    struct timespec now = { 0 };
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

/* Half of the time is others', whatever clients send. */
static void *clients_main(void *context)
{
    struct service_clients *clients = context;
    while (!atomic_load(&clients->ends)) {
        int64_t rest_ns = clients_now_ns();
        if (!service_clients_look(clients, CLIENTS_WAIT_MS))
            continue;
        rest_ns = clients_now_ns() - rest_ns;
        if (rest_ns < CLIENTS_REST_NS)
            rest_ns = CLIENTS_REST_NS;
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

void service_clients_wait(struct service_clients *clients, int timeout_ms)
{
    struct timespec until;
    (void)clock_gettime(CLOCK_MONOTONIC, &until);
    until.tv_nsec += timeout_ms * 1000000L;
    until.tv_sec += until.tv_nsec / 1000000000;
    until.tv_nsec %= 1000000000;
    (void)pthread_mutex_lock(&clients->lock);
    while (!clients->woken && timeout_ms > 0 &&
           pthread_cond_timedwait(&clients->changed, &clients->lock, &until) ==
               0)
        continue;
    clients->woken = false;
    (void)pthread_mutex_unlock(&clients->lock);
}

void service_clients_serve(
    struct service_clients *clients,
    void (*came)(void *context, struct service_client *client),
    void (*gone)(void *context, struct service_client *client), void *context)
{
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

bool service_client_next(struct service_clients *clients,
                         struct service_client *client)
{
    struct service_request_line *to =
        client->head.line.text == NULL ? &client->head : &client->next;
    if (to->line.text != NULL)
        return true;
    (void)pthread_mutex_lock(&clients->lock);
    if (client->count > 0 && !client->over && !client_is_full(client)) {
        to->line = client->queue[client->first++ % SERVICE_QUEUE];
        client->count--;
        client->queued -= to->line.length;
    }
    (void)pthread_mutex_unlock(&clients->lock);
    if (to->line.text == NULL)
        return false;
    to->object = cJSON_ParseWithOpts(to->line.text, NULL, true);
    return true;
}

void service_client_forget(struct service_client *client)
{
    cJSON_Delete(client->head.object);
    free(client->head.line.text);
    client->head = client->next;
    client->next = (struct service_request_line){ .object = NULL };
}

void service_client_answer(struct service_clients *clients,
                           struct service_client *client, cJSON *object)
{
    char *text = cJSON_PrintUnformatted(object);
    cJSON_Delete(object);
    (void)pthread_mutex_lock(&clients->lock);
    if (text == NULL || !client_put(client, text))
        client->over = true;
    client_write(client);
    (void)pthread_mutex_unlock(&clients->lock);
    free(text);
}

void service_client_tell(struct service_clients *clients,
                         struct service_client *client, const char *text)
{
    (void)pthread_mutex_lock(&clients->lock);
    client_tell(client, text);
    client_write(client);
    (void)pthread_mutex_unlock(&clients->lock);
}
