/* firmware/linux/kind/turn/machine.h - what the drivers of all drives that count
 * turns are told alike; see firmware/linux/machine/kind.h. */
#ifndef FIRMWARE_LINUX_KIND_TURN_MACHINE_H
#define FIRMWARE_LINUX_KIND_TURN_MACHINE_H

#include "firmware/linux/machine/kind.h"

#define TURN_BOOT_NS     INT64_C(150000000) /* simulated */
#define TURN_SIM_LOOP_NS INT64_C(125000)    /* of the servo's inner loop */

struct drive_turn_config turn_config(const struct machine *machine, unsigned i);

#endif
