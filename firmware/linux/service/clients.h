/* firmware/linux/service/clients.h - who is connected to the socket of a
 * service: lines in, lines out.
 *
 * Nothing here waits for a client.  What it sends is read into a bounded
 * buffer, and no further while its answers are not taken; what it does not
 * take, of the stream, is left out and counted; an answer that does not fit is
 * the end of it. */
#ifndef FIRMWARE_LINUX_SERVICE_CLIENTS_H
#define FIRMWARE_LINUX_SERVICE_CLIENTS_H

#include <cjson/cJSON.h>
#include <poll.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define SERVICE_CLIENTS  64     /* at one time; others are told so and closed */
#define SERVICE_LINE_MAX 262144 /* bytes of a line, with its LF */
#define SERVICE_OUT      65536
#define SERVICE_ID_MAX   64 /* bytes of an id as JSON, with the 0 */

struct service_client {
    int file;        /* -1: nobody */
    uint64_t number; /* of its kind ever */
    char *in;        /* on the heap */
    size_t in_length, in_size;
    size_t line; /* bytes at the front that are the present line */
    char out[SERVICE_OUT];
    size_t out_length;
    bool over; /* closed once its answers were sent, or could not be */
    int64_t stream_ns, stream_due_ns; /* 0: it has no stream */
    uint64_t dropped;                 /* of the stream */
};

struct service_clients {
    int listener;
    uint64_t count; /* ever */
    uint64_t refused;
    struct service_client client[SERVICE_CLIENTS];
};

/* Makes the socket, for `mode` (0600: its owner).  0, or -1 with a line on
 * stderr: another service has it, too. */
int service_clients_open(struct service_clients *clients, const char *path,
                         unsigned mode);
void service_clients_close(struct service_clients *clients, const char *path);

/* Takes in and gives out what there is, waiting at most timeout_ms for it.
 * `gone` is told of each client that is gone. */
void service_clients_step(
    struct service_clients *clients, int timeout_ms,
    void (*came)(void *context, struct service_client *client),
    void (*gone)(void *context, struct service_client *client), void *context);

/* The next whole line, without its LF and with a 0, until the next call; NULL:
 * there is none.  Empty lines are left out. */
char *service_client_line(struct service_client *client);
/* Frees the object.  False: it did not fit; the client is over. */
bool service_client_answer(struct service_client *client, cJSON *object);
/* The same for what may be left out: then it is counted. */
void service_client_tell(struct service_client *client, cJSON *object);

#endif
