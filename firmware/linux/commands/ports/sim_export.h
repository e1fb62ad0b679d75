/* firmware/linux/commands/ports/sim_export.h - slew sim export: a rig's servos as a
 * functional mock-up unit. */
#ifndef FIRMWARE_LINUX_COMMANDS_PORTS_SIM_EXPORT_H
#define FIRMWARE_LINUX_COMMANDS_PORTS_SIM_EXPORT_H

#include "firmware/host/base/status.h"
#include "firmware/linux/commands/options.h"

enum status sim_export(const struct options *options);

#endif
