/* firmware/linux/commands/run/jog_service.h - slew jog where a service has the
 * rig.
 *
 * Every jog that is sent is for a dead man's time and sent again well before it
 * is over: when this program hangs the axis stops after that time, and when it
 * is gone the service stops it at once. */
#ifndef FIRMWARE_LINUX_COMMANDS_RUN_JOG_SERVICE_H
#define FIRMWARE_LINUX_COMMANDS_RUN_JOG_SERVICE_H

#include "firmware/linux/commands/run/jog_keys.h"
#include "firmware/linux/commands/run/jog_wanted.h"
#include "firmware/linux/commands/run/served.h"

/* Takes control, does it, takes torque off. */
enum status jog_service(struct served *served, const struct rig *rig,
                        const struct jog_wanted *want, struct jog_keys *keys,
                        struct jog_result *result);

#endif
