/* firmware/studio/server/parts.h - what the files of the server share. */
#ifndef FIRMWARE_STUDIO_SERVER_PARTS_H
#define FIRMWARE_STUDIO_SERVER_PARTS_H

#include <libwebsockets.h>
#include <pthread.h>
#include <stdatomic.h>

#include "firmware/studio/server/bytes.h"
#include "firmware/studio/server/document.h"
#include "firmware/studio/server/errand.h"
#include "firmware/studio/server/server.h"

#define STUDIO_CONNECTIONS 16     /* of WebSockets */
#define STUDIO_LINE_MAX    262144 /* of the service, with its LF */
#define STUDIO_DOWN_MAX    131072 /* of lines on their way to a browser */
#define STUDIO_FRAMES_MAX  200    /* text frames a second, up */
/* The thread stood still for so long that a page has ended its jog by itself; what
 * had come meanwhile is worked off in less than the second one. */
#define STUDIO_STALL_NS INT64_C(500000000)
#define STUDIO_STALE_NS INT64_C(250000000)

/* One HTTP request; zeroed by libwebsockets. */
struct studio_request {
    char *body; /* of an answer (with `gave`), or what a PUT brings */
    const char *gives;
    size_t length, done, capacity;
    struct errand *errand; /* that it waits for; NULL: none */
    bool is_put, is_rig;
    bool closes;            /* the connection, once it was answered */
    char tag[DOCUMENT_TAG]; /* If-Match */
    char take[TAKES_NAME];  /* that a PUT brings; "": another document */
};

/* One WebSocket. */
struct studio_connection {
    struct lws *wsi; /* NULL: nobody */
    struct studio_server *server;
    int link; /* the socket of the service; -1: it is gone */
    char *up; /* a line on its way to the service; with room for all of it */
    size_t up_length, up_done;
    bool up_whole; /* the line is complete */
    char down[STUDIO_DOWN_MAX];
    size_t down_length;
    struct memory_pool memory;
    struct service_frame frame; /* what was not sent yet */
    struct bytes_count count;
    int64_t rate_ns, sent_ns; /* between frames; the last one */
    int64_t second_ns;        /* of the text frames that are counted */
    unsigned frames_in_second;
    enum lws_close_status end; /* 0: it goes on */
    const char *end_why;
    bool is_end_said;
    size_t dropped; /* bytes since then */
};

struct studio_server {
    const struct studio_config *config;
    const char *address;
    const struct rig *rig;
    const char *socket;
    struct service_frames *frames;
    struct lws_context *context;
    struct lws_vhost *vhost;
    pthread_t thread;
    _Atomic bool end;
    lws_sorted_usec_list_t timer;
    int64_t looked_ns;  /* when studio_socket_look ran */
    int64_t stalled_ns; /* when the thread was last found to have stood still */
    struct memory_pool memory;
    struct service_frame frame;
    struct studio_connection connection[STUDIO_CONNECTIONS];
};

/* http.c */
int studio_http(struct lws *wsi, enum lws_callback_reasons reason, void *user,
                void *in, size_t length);
/* 0, or the HTTP status with which the request is refused. */
unsigned studio_refusal(const struct studio_server *server, struct lws *wsi);

/* socket.c */
int studio_socket(struct lws *wsi, enum lws_callback_reasons reason, void *user,
                  void *in, size_t length);
/* What has come from the tick and from the service. */
void studio_socket_look(struct studio_server *server, int64_t now_ns);
int64_t studio_now_ns(void);

#endif
