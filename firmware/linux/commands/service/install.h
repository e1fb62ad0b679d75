/* firmware/linux/commands/service/install.h - a rig's service as a unit of
 * systemd.
 *
 * What is done is printed, a line per step, before it is done; with --dry-run
 * the lines and the texts of the files are all.  With --root the files are
 * written under that directory and nothing is run. */
#ifndef FIRMWARE_LINUX_COMMANDS_SERVICE_INSTALL_H
#define FIRMWARE_LINUX_COMMANDS_SERVICE_INSTALL_H

#include "firmware/host/base/status.h"
#include "firmware/linux/commands/options.h"

/* `rig` is a file that is there. */
enum status service_install(const struct options *options, const char *rig);
enum status service_remove(const struct options *options, const char *rig);

#endif
