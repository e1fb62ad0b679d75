/* firmware/linux/service/service.h - a rig as a service: its tick, its socket
 * and its planner, until it is told to end. */
#ifndef FIRMWARE_LINUX_SERVICE_SERVICE_H
#define FIRMWARE_LINUX_SERVICE_SERVICE_H

#include <stdbool.h>

#include "firmware/host/base/status.h"
#include "firmware/linux/service/planner.h"

struct rig;
struct service_frames;

/* What looks on from beside the service, in a thread of its own. */
struct service_beside {
    /* Once the tick runs.  0, or -1 with a line on stderr. */
    int (*start)(void *context, const struct rig *rig, const char *socket,
                 struct service_frames *frames);
    void (*stop)(void *context); /* also where it was not started */
    void *context;
};

struct service_config {
    const char *command;   /* for messages: "studio" of slew studio */
    const char *rig_path;  /* a file */
    const char *socket;    /* NULL: by the rig, place.h */
    const char *interface; /* others than the rig's; NULL: those */
    bool real;             /* else simulated, on the clock */
    bool group;            /* those of its group may connect, too */
    int cpu;               /* the tick's; -1: any */
    const struct service_beside *beside; /* NULL: nothing */
    const char *recordings;         /* a directory; NULL: nothing is recorded */
    bool records;                   /* from its first tick on */
    struct service_plan_limit plan; /* what a client's move may take */
    const char *clock; /* a stream of timecode that clients may follow, wherever
                          it is; NULL: none */
};

/* Runs until SIGTERM or SIGINT: axes stop along their path, then torque off.
 * The second time they stop by the drives' own quick stop.  STATUS_OK once every
 * drive has said that it has no torque, STATUS_REFUSED when one has not; what
 * keeps it from beginning is said on stderr. */
enum status service_run(const struct service_config *config);

#endif
