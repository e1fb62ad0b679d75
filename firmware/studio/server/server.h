/* firmware/studio/server/server.h - the page of a rig, its files and its
 * machine, over HTTP and a WebSocket; docs/STUDIO.md, "the server", is its
 * reference.
 *
 * libwebsockets in a thread of its own, which is not real-time.  Of the service
 * it uses the frames that the tick makes, and its socket: every browser is one
 * client of it, as any other program. */
#ifndef FIRMWARE_STUDIO_SERVER_SERVER_H
#define FIRMWARE_STUDIO_SERVER_SERVER_H

#include <stdbool.h>

#include "firmware/host/rig/rig.h"
#include "firmware/linux/service/frames.h"

#define STUDIO_PORT 8787

struct studio_config {
    const char *rig_path, *move_path; /* move NULL: none */
    const char *address;              /* NULL: 127.0.0.1 */
    unsigned port;
    const char *token; /* what a browser must bring */
    bool is_real;
    bool edits_rig; /* the page may write the file of the rig */
};

struct studio_server;

/* Listens, and answers from then on.  NULL with a line on stderr.  All but the
 * address outlives it; signals are blocked by the caller. */
struct studio_server *studio_server_start(const struct studio_config *config,
                                          const struct rig *rig,
                                          const char *socket,
                                          struct service_frames *frames);
/* Closes every connection, waits for the thread; NULL is nothing. */
void studio_server_stop(struct studio_server *server);

#endif
