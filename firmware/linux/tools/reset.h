/* firmware/linux/tools/reset.h - why is a drive in fault, and clear that.
 * Afterwards it is off, whatever it was before. */
#ifndef FIRMWARE_LINUX_TOOLS_RESET_H
#define FIRMWARE_LINUX_TOOLS_RESET_H

#include "firmware/linux/tools/talk.h"

#define RESET_TEXT_MAX ASK_TURNS_REASON_MAX

struct reset {
    bool was_fault, is_fault;
    char reason[RESET_TEXT_MAX]; /* "" without a fault */
    char state[48];              /* afterwards */
};

/* A drive that is not in fault is left as it is.  Errors of the bus;
 * MOTION_E_EMPTY: a Modbus drive whose map does not say how a fault shows, or
 * without a map. */
int reset_drive(struct talk *talk, struct reset *reset);

#endif
