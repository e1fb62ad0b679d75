/* firmware/linux/commands/run/run_service.h - slew run where a service has the
 * rig: the move is sent there and played by it.
 *
 * Only what a service can do: a service of real drives for --real, one of
 * simulated drives without. */
#ifndef FIRMWARE_LINUX_COMMANDS_RUN_RUN_SERVICE_H
#define FIRMWARE_LINUX_COMMANDS_RUN_RUN_SERVICE_H

#include <stdbool.h>

#include "firmware/host/base/status.h"
#include "firmware/linux/commands/options.h"

/* False: there is no service that this run is for, so it is done without.  True:
 * *status is how it has ended. */
bool run_service(const struct options *options, enum status *status);

#endif
