/* firmware/studio/server/server.c - see server.h. */
#define _GNU_SOURCE
#include "firmware/studio/server/server.h"

#include <stdio.h>
#include <time.h>

#include "firmware/host/base/memory.h"
#include "firmware/linux/base/error.h"
#include "firmware/studio/server/parts.h"

#define SERVER_LOOK_US 4000   /* while somebody is connected */
#define SERVER_IDLE_US 100000 /* and while nobody is */

int64_t studio_now_ns(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static const struct lws_protocols server_protocols[] = {
    { "http", studio_http, sizeof(struct studio_request), 4096, 0, NULL, 0 },
    { "slew", studio_socket, sizeof(struct studio_connection *), 16384, 0, NULL,
      0 },
    { NULL, NULL, 0, 0, 0, NULL, 0 },
};

static bool server_is_watched(const struct studio_server *server)
{
    for (unsigned i = 0; i < STUDIO_CONNECTIONS; i++)
        if (server->connection[i].wsi != NULL)
            return true;
    return false;
}

static void server_look(lws_sorted_usec_list_t *timer)
{
    struct studio_server *server =
        lws_container_of(timer, struct studio_server, timer);
    const bool watched = server_is_watched(server);

    /* Also while nobody looks on, so that a frame is never an old one. */
    studio_socket_look(server, studio_now_ns());
    lws_sul_schedule(server->context, 0, timer, server_look,
                     watched ? SERVER_LOOK_US : SERVER_IDLE_US);
}

static void *server_run(void *context)
{
    struct studio_server *server = context;

    lws_sul_schedule(server->context, 0, &server->timer, server_look, 1);
    while (!atomic_load(&server->end) && lws_service(server->context, 0) >= 0)
        continue;
    return NULL;
}

static void server_say(int level, const char *line)
{
    (void)level;
    fputs(line, stderr);
}

static bool server_listen(struct studio_server *server)
{
    struct lws_context_creation_info info = {
        .port = CONTEXT_PORT_NO_LISTEN,
        .gid = -1,
        .uid = -1,
        .options = LWS_SERVER_OPTION_EXPLICIT_VHOSTS |
                   LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND,
        .user = server,
        .max_http_header_data = 8192,
        .max_http_header_pool = 32,
        .fd_limit_per_thread = 256,
        .timeout_secs = 15,
        .keepalive_timeout = 15,
    };
    struct lws_context_creation_info host = {
        .port = (int)server->config->port,
        .iface = server->address,
        .protocols = server_protocols,
        .vhost_name = "slew",
        .options = LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND,
        .timeout_secs = 15,
        .keepalive_timeout = 15,
    };

    lws_set_log_level(LLL_ERR, server_say);
    server->context = lws_create_context(&info);
    if (server->context == NULL)
        return false;
    server->vhost = lws_create_vhost(server->context, &host);
    return server->vhost != NULL;
}

struct studio_server *studio_server_start(const struct studio_config *config,
                                          const struct rig *rig,
                                          const char *socket,
                                          struct service_frames *frames)
{
    struct studio_server *server = memory_new(1, sizeof *server);

    server->config = config;
    server->address = config->address == NULL ? "127.0.0.1" : config->address;
    server->rig = rig;
    server->socket = socket;
    server->frames = frames;
    server->looked_ns = studio_now_ns();
    service_frame_init(&server->frame, rig, &server->memory);
    if (!server_listen(server)) {
        error_say("the page: cannot listen at %s port %u, expected an address "
                  "of this machine and a port that nobody has",
                  server->address, config->port);
    } else if (pthread_create(&server->thread, NULL, server_run, server) != 0) {
        error_say("the page: no thread for its server");
    } else {
        (void)pthread_setname_np(server->thread, "slew-page");
        return server;
    }
    if (server->context != NULL)
        lws_context_destroy(server->context);
    memory_pool_free(&server->memory);
    memory_free(server);
    return NULL;
}

void studio_server_stop(struct studio_server *server)
{
    if (server == NULL)
        return;
    atomic_store(&server->end, true);
    lws_cancel_service(server->context);
    (void)pthread_join(server->thread, NULL);
    lws_context_destroy(server->context);
    memory_pool_free(&server->memory);
    memory_free(server);
}
