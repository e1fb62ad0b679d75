/* firmware/linux/service/clients.c - see clients.h. */
#define _GNU_SOURCE /* accept4 */
#include "firmware/linux/service/clients.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "firmware/host/base/memory.h"
#include "firmware/linux/base/error.h"

#define CLIENTS_ACCEPTS 64 /* in one step */
#define CLIENTS_READ    4096

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

/* A socket that nobody listens on any more was left by one that was killed. */
static bool clients_is_served(const struct sockaddr_un *address)
{
    const int file = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    const bool served =
        file >= 0 &&
        connect(file, (const struct sockaddr *)address, sizeof *address) == 0;
    if (file >= 0)
        close(file);
    return served;
}

int service_clients_open(struct service_clients *clients, const char *path,
                         unsigned mode)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    struct stat status;
    clients->listener = -1;
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++)
        clients->client[i].file = -1;
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
    memory_free(client->in);
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
}

/* --- coming --- */

static struct service_client *clients_seat(struct service_clients *clients)
{
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++)
        if (clients->client[i].file < 0)
            return &clients->client[i];
    return NULL;
}

static void clients_refuse(struct service_clients *clients, int file)
{
    static const char said[] =
        "{\"ok\":false,\"error\":\"clients\",\"text\":\"too many clients are "
        "connected\"}\n";
    (void)send(file, said, sizeof said - 1, MSG_NOSIGNAL | MSG_DONTWAIT);
    close(file);
    clients->refused++;
}

static void clients_accept(struct service_clients *clients,
                           void (*came)(void *context,
                                        struct service_client *client),
                           void *context)
{
    for (unsigned i = 0; i < CLIENTS_ACCEPTS; i++) {
        const int file = accept4(clients->listener, NULL, NULL,
                                 SOCK_CLOEXEC | SOCK_NONBLOCK);
        struct service_client *client = clients_seat(clients);
        if (file < 0)
            return;
        if (client == NULL) {
            clients_refuse(clients, file);
            continue;
        }
        client->file = file;
        client->number = ++clients->count;
        came(context, client);
    }
}

/* --- in and out --- */

static bool client_is_full(const struct service_client *client)
{
    return client->out_length > SERVICE_OUT / 2;
}

/* The line that was given out last makes room. */
static void client_forget_line(struct service_client *client)
{
    if (client->line == 0)
        return;
    client->in_length -= client->line;
    memmove(client->in, client->in + client->line, client->in_length);
    client->line = 0;
}

static bool client_has_line(const struct service_client *client)
{
    return client->in_length > client->line &&
           memchr(client->in + client->line, '\n',
                  client->in_length - client->line) != NULL;
}

static void client_read(struct service_client *client)
{
    if (client->over || client_has_line(client))
        return;
    client_forget_line(client);
    if (client->in_length + CLIENTS_READ > client->in_size) {
        client->in_size += client->in_size + CLIENTS_READ;
        client->in = memory_resize(client->in, client->in_size, 1);
    }
    const ssize_t got = recv(client->file, client->in + client->in_length,
                             client->in_size - client->in_length, MSG_DONTWAIT);
    if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) {
        client->over = true;
        client->out_length = 0; /* nobody is there to take it */
        return;
    }
    client->in_length += got > 0 ? (size_t)got : 0;
    if (client->in_length >= SERVICE_LINE_MAX && !client_has_line(client)) {
        cJSON *error = cJSON_CreateObject();
        cJSON_AddBoolToObject(error, "ok", false);
        cJSON_AddStringToObject(error, "error", "line");
        cJSON_AddStringToObject(error, "text", "the line is too long");
        (void)service_client_answer(client, error);
        client->in_length = 0;
        client->over = true;
    }
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

/* What is to be waited for: nothing of a client that has not taken its answers
 * but that it takes them. */
static short client_events(const struct service_client *client)
{
    const bool reads =
        !client->over && !client_is_full(client) && !client_has_line(client);
    return (short)((reads ? POLLIN : 0) |
                   (client->out_length > 0 ? POLLOUT : 0));
}

void service_clients_step(
    struct service_clients *clients, int timeout_ms,
    void (*came)(void *context, struct service_client *client),
    void (*gone)(void *context, struct service_client *client), void *context)
{
    struct pollfd look[SERVICE_CLIENTS + 1];
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++) {
        struct service_client *client = &clients->client[i];
        look[i] = (struct pollfd){ .fd = client->file };
        if (client->file >= 0)
            look[i].events = client_events(client);
    }
    look[SERVICE_CLIENTS] =
        (struct pollfd){ .fd = clients->listener, .events = POLLIN };
    if (poll(look, SERVICE_CLIENTS + 1, timeout_ms) < 0)
        return;
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++) {
        struct service_client *client = &clients->client[i];
        if (client->file < 0)
            continue;
        if ((look[i].revents & (POLLIN | POLLHUP | POLLERR)) != 0)
            client_read(client);
        client_write(client);
        if (client->over) {
            gone(context, client);
            client_close(client);
        }
    }
    if (look[SERVICE_CLIENTS].revents != 0)
        clients_accept(clients, came, context);
}

/* --- lines --- */

char *service_client_line(struct service_client *client)
{
    if (client->file < 0 || client->over || client_is_full(client))
        return NULL;
    for (;;) {
        client_forget_line(client);
        char *end = client->in_length == 0
                        ? NULL
                        : memchr(client->in, '\n', client->in_length);
        if (end == NULL)
            return NULL;
        client->line = (size_t)(end - client->in) + 1;
        *end = '\0';
        if (end > client->in && end[-1] == '\r')
            end[-1] = '\0';
        if (client->in[0] != '\0')
            return client->in;
    }
}

/* The object as a line of the buffer; false: it does not fit. */
static bool client_put(struct service_client *client, cJSON *object,
                       size_t least)
{
    const size_t room = SERVICE_OUT - client->out_length;
    char *to = client->out + client->out_length;
    bool fits = room > least && cJSON_PrintPreallocated(
                                    object, to, (int)(room - 1), false) != 0;
    cJSON_Delete(object);
    if (!fits)
        return false;
    const size_t length = strlen(to);
    to[length] = '\n';
    client->out_length += length + 1;
    return true;
}

bool service_client_answer(struct service_client *client, cJSON *object)
{
    if (client_put(client, object, 64))
        return true;
    client->over = true;
    return false;
}

/* Half of the buffer stays for answers. */
void service_client_tell(struct service_client *client, cJSON *object)
{
    if (client_is_full(client) || client->over) {
        cJSON_Delete(object);
        client->dropped++;
    } else if (!client_put(client, object, 64)) {
        client->dropped++;
    }
}
