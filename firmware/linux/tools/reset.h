/* firmware/linux/tools/reset.h - why is a drive in fault, and clear that.
 * Afterwards it is off, whatever it was before. */
#ifndef FIRMWARE_LINUX_TOOLS_RESET_H
#define FIRMWARE_LINUX_TOOLS_RESET_H

#include "firmware/linux/tools/session.h"

#define RESET_TEXT_MAX TURN_CLIENT_REASON_MAX

struct reset {
    bool was_fault, is_fault;
    char reason[RESET_TEXT_MAX]; /* "" without a fault */
    char state[48];              /* afterwards */
};

/* A drive that is not in fault is left as it is.  Errors of the bus;
 * MOTION_E_EMPTY: a Modbus drive whose map does not say how a fault shows, or
 * without a map. */
int reset_drive(struct session *session, struct reset *reset);

#endif
