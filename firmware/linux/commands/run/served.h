/* firmware/linux/commands/run/served.h - a rig that a service has, as the
 * commands use it that would else open its ports themselves.
 *
 * A service of real drives is for --real, one of simulated drives for commands
 * without.  Control is taken for as long as the command lasts. */
#ifndef FIRMWARE_LINUX_COMMANDS_RUN_SERVED_H
#define FIRMWARE_LINUX_COMMANDS_RUN_SERVED_H

#include <signal.h>
#include <stdbool.h>

#include "firmware/host/base/status.h"
#include "firmware/linux/commands/options.h"
#include "firmware/linux/service/place.h"

#define SERVED_PATH_MAX  4096
#define SERVED_LOOK_MS   50 /* between two looks at its state */
#define SERVED_LEASE_S   5
#define SERVED_FAULT_MAX 200

struct served {
    const struct options *options;
    const char *verb; /* "run": in front of what is said */
    const volatile sig_atomic_t *interrupts;
    struct service_link link;
    char rig[SERVED_PATH_MAX];
    cJSON *status; /* as it was last; NULL: never */
    char state[32];
    char fault[SERVED_FAULT_MAX];
    char follow[SERVED_FAULT_MAX]; /* what was said last of a clock */
    bool enabling, homing, starting, torque_off;
    double stops;     /* that clients have asked for, by the last look */
    double own_stops; /* those before control was taken, and ours */
    bool stopped;     /* the operator has asked for it */
    bool leaves;      /* torque is being taken off */
    bool draws;       /* a line in place, which nothing else may break */
};

/* Is there a service that this command is for?  `is_plain`: it does nothing that
 * only a machine of its own can do; then one without --real goes on by itself,
 * as if there were none.  served_close in either case. */
bool served_find(struct served *self, const struct options *options,
                 const char *verb, bool is_plain);
void served_close(struct served *self);
/* May it?  STATUS_REFUSED with a line on stderr where it is not plain (`without`:
 * "--dry-run") or where the rig file has changed since. */
enum status served_allow(const struct served *self, bool is_plain,
                         const char *without);

/* A line for people, none with --json. */
void served_say(const struct served *self, const char *what);

cJSON *served_command(const char *name);
/* One command and its answer: refused, or gone, with a line on stderr; so are
 * warnings that have come meanwhile. */
enum status served_do(struct served *self, cJSON *command);
/* The state as it is now; renews the lease. */
enum status served_look(struct served *self);
/* STATUS_REFUSED with a line on stderr where another client has stopped, by the
 * last look, what this one does. */
enum status served_goes_on(const struct served *self);
/* All axes are homed, by the last look. */
bool served_is_homed(const struct served *self);
/* A pause, then a look; the first Ctrl-C is sent as a stop.  STATUS_REFUSED with
 * a line on stderr at a fault, and after a stop of another client. */
enum status served_step(struct served *self);
/* Until the controller is in that state and homes no more. */
enum status served_wait(struct served *self, const char *state);
/* What, then the same. */
enum status served_then(struct served *self, cJSON *command, const char *state,
                        const char *what);

/* Control; the service must be at rest. */
enum status served_take(struct served *self, double lease_s);
/* Torque for all axes. */
enum status served_enable(struct served *self);
/* The one way out, whatever came of it: torque off, and every drive has said so
 * itself.  `status`, or why it is not. */
enum status served_off(struct served *self, enum status status);

#endif
