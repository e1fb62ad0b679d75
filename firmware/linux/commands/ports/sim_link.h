/* firmware/linux/commands/ports/sim_link.h - fixed names for the pseudo-terminals of
 * slew sim, which Linux numbers as they come. */
#ifndef FIRMWARE_LINUX_COMMANDS_PORTS_SIM_LINK_H
#define FIRMWARE_LINUX_COMMANDS_PORTS_SIM_LINK_H

#include "firmware/linux/commands/command.h"
#include "firmware/linux/machine/sim_server.h"

/* Make the symbolic links that --link asks for: PATH, or BUS=PATH,BUS=PATH.  One that
 * is there is replaced, anything else refused. */
enum status sim_link_make(const char *text, const struct sim_server *server);
/* Remove those that still lead to a terminal of this server. */
void sim_link_remove(const char *text, const struct sim_server *server);

#endif
