/* firmware/linux/service/place.h - where the socket of a rig's service is, and
 * lines to and from it.
 *
 * DIRECTORY/rig-XXXXXXXX.sock, by the checksum of the rig file's full name, so
 * that whoever has the rig finds its service.  The directory is $SLEW_RUN_DIR
 * where that is set; else the first of $RUNTIME_DIRECTORY (which systemd gives a
 * service), /run/slew, $XDG_RUNTIME_DIR/slew and /tmp/slew-UID that fits. */
#ifndef FIRMWARE_LINUX_SERVICE_PLACE_H
#define FIRMWARE_LINUX_SERVICE_PLACE_H

#include <cjson/cJSON.h>
#include <signal.h>
#include <stdbool.h>
#include <stddef.h>

#define SERVICE_PATH_MAX 108 /* as sun_path */

/* Is it a directory that nobody but its owner can put files into, and, where
 * anybody could have made it, is that owner this user? */
bool service_place_is_trusted(const char *directory);

/* Where a new service of the rig listens; its directory is made.  0, or -1 with
 * a line on stderr that begins with "slew COMMAND". */
int service_place_new(const char *rig_path, const char *command,
                      char path[SERVICE_PATH_MAX]);

/* A connection to a service, which waits for each line, at most
 * SERVICE_ANSWER_MS. */
#define SERVICE_ANSWER_MS 5000
struct service_link {
    int file; /* -1: none */
    char *in; /* on the heap */
    size_t length, size, line;
    cJSON *hello; /* what it is, docs/API.md */
    unsigned asked;
    /* Ctrl-C, counted (NULL: nobody counts): what is waited for then is not waited
     * for before a stop is sent, and what is being planned is given up. */
    const volatile sig_atomic_t *interrupts;
    bool stopped; /* that was done */
};

/* To the socket, or (NULL) to the service of that rig.  0; -1: there is none,
 * with a line on stderr where `quiet` is not set. */
int service_link_open(struct service_link *link, const char *socket_path,
                      const char *rig_path, bool quiet);
void service_link_close(struct service_link *link);
/* One line, an LF is added.  -1: the service is gone. */
int service_link_send(struct service_link *link, const char *line);
/* The next line, without its LF, until the next call; NULL: none has come
 * within timeout_ms, or the service is gone (link->file is -1 then). */
const char *service_link_line(struct service_link *link, int timeout_ms);
/* Sends a command, frees it and waits for its answer, by an id of its own, which
 * is the caller's; events meanwhile are handed to `event` (NULL: left out).  NULL:
 * the service is gone, or has said nothing at all for timeout_ms. */
cJSON *service_link_ask(struct service_link *link, cJSON *command,
                        int timeout_ms,
                        void (*event)(void *context, const cJSON *event),
                        void *context);

#endif
