/* firmware/linux/machine/machine_turns.h - drives of a machine that count
 * turns. */
#ifndef FIRMWARE_LINUX_MACHINE_MACHINE_TURNS_H
#define FIRMWARE_LINUX_MACHINE_MACHINE_TURNS_H

#include "firmware/linux/machine/machine.h"

/* Axis i, on its bus.  Errors of drive_odrive_init and drive_moteus_init. */
int machine_init_odrive(struct machine *machine, unsigned i);
int machine_init_moteus(struct machine *machine, unsigned i);

#endif
