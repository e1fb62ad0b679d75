/* firmware/linux/service/clients.h - who is connected to the socket of a
 * service: lines in, lines out, and a stop at once.
 *
 *   reader   reads every seat in turn, a little of each.  A stop is counted in
 *            the mailbox and answered as its line is complete; any other line
 *            goes into the queue of its seat, or is refused where that is full
 *   server   takes lines out of the queues, one of each seat in its turn, and
 *            answers them
 *
 * The reader is a thread of its own that does nothing else: whatever the server
 * is about, whatever waits before a stop in its own seat or another, and whether
 * or not its client reads answers, a stop is never behind it.  It takes no memory
 * and no lock but one that lends its rank to whoever has it.  Nothing waits for
 * a client: of what it does not take, streams and answers to what was refused are
 * left out and counted, and its next requests wait. */
#ifndef FIRMWARE_LINUX_SERVICE_CLIENTS_H
#define FIRMWARE_LINUX_SERVICE_CLIENTS_H

#include <cjson/cJSON.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/linux/service/line.h"

#define SERVICE_CLIENTS     64 /* at one time; others are told so and closed */
#define SERVICE_LINE_MAX    262144 /* bytes of a line, with its LF */
#define SERVICE_LINE_VALUES 4096 /* in it, one within another or side by side */
#define SERVICE_QUEUE       64   /* lines of a seat that wait */
#define SERVICE_ROOM        (SERVICE_LINE_MAX + SERVICE_QUEUE) /* for them */
#define SERVICE_SPARE       4    /* rooms for who comes next */
#define SERVICE_PIECE       2048 /* bytes that a seat is read at one time */
#define SERVICE_OUT         65536

struct mailbox;

/* A line that waits in the room of its seat. */
struct service_line {
    size_t length;  /* without its LF */
    uint32_t stops; /* that were counted before it came */
};

/* One that was taken out. */
struct service_asked {
    bool is_there;
    cJSON *object; /* what it says; NULL: no JSON */
    uint32_t stops;
};

struct service_client {
    uint64_t number; /* of its kind ever */

    /* the reader's */
    struct service_line_scan scan;
    char piece[SERVICE_PIECE]; /* that came, as far as it was not looked at */
    size_t piece_length, piece_at;
    size_t length; /* of the line that is coming */
    bool spills;   /* it does not fit, and is not kept */

    /* under the lock */
    int file;     /* -1: nobody */
    bool over;    /* to be closed */
    bool is_deaf; /* it has hung up, and is over once it is read to its end */
    struct service_line queue[SERVICE_QUEUE];
    unsigned first, count;
    char *room;  /* their texts, each with a 0; then the line that is coming */
    size_t used; /* by those that wait */
    char out[SERVICE_OUT];
    size_t out_length;
    uint64_t dropped; /* lines to it that did not fit */

    /* the server's */
    bool is_here;                     /* it has been greeted */
    struct service_asked head, next;  /* the one whose turn it is */
    char id[SERVICE_ID_MAX];          /* of the head, as JSON; "": none */
    int64_t stream_ns, stream_due_ns; /* 0: it has no stream */
};

struct service_clients {
    int listener;
    struct mailbox *mailbox; /* where stops are counted */
    pthread_mutex_t lock;
    int bell;   /* an eventfd: there is something for the server */
    bool rings; /* it is to be told so */
    char *spare[SERVICE_SPARE];
    uint64_t count; /* ever */
    uint64_t refused;
    int64_t busy_ns; /* the reader's: it began to read */
    pthread_t thread;
    bool runs;
    _Atomic bool ends;
    struct service_client client[SERVICE_CLIENTS];
};

/* Makes the socket, for `mode` (0600: its owner).  0, or -1 with a line on
 * stderr: another service has it, too. */
int service_clients_open(struct service_clients *clients, const char *path,
                         unsigned mode);
void service_clients_close(struct service_clients *clients, const char *path);

/* --- the reader --- */

/* One look at every seat, and at who knocks, waiting at most timeout_ms for
 * something to come.  True: there is more. */
bool service_clients_look(struct service_clients *clients, int timeout_ms);
/* In a thread of its own, until the end; ahead of what is not real-time where
 * that is allowed.  0, or an errno. */
int service_clients_start(struct service_clients *clients);
void service_clients_stop(struct service_clients *clients);

/* --- the server --- */

/* Until something has come, at most timeout_ms. */
void service_clients_wait(struct service_clients *clients, int timeout_ms);
/* Sends what there is to send; `came` and `gone` are told of who is new and who
 * has left. */
void service_clients_serve(
    struct service_clients *clients,
    void (*came)(void *context, struct service_client *client),
    void (*gone)(void *context, struct service_client *client), void *context);
/* The next line of a client into client->head, where there is none, or into
 * client->next; false: there is no more, or it does not take its answers. */
bool service_client_next(struct service_clients *clients,
                         struct service_client *client);
/* The head has been done; `next` is in its place. */
void service_client_forget(struct service_client *client);
/* Frees the object.  An answer that does not fit is the end of its client. */
void service_client_answer(struct service_clients *clients,
                           struct service_client *client, cJSON *object);
/* A line that may be left out: then it is counted. */
void service_client_tell(struct service_clients *clients,
                         struct service_client *client, const char *text);

#endif
