/* firmware/linux/tools/client_text.h - why a node on a CAN bus gave no answer. */
#ifndef FIRMWARE_LINUX_TOOLS_CLIENT_TEXT_H
#define FIRMWARE_LINUX_TOOLS_CLIENT_TEXT_H

#include <stddef.h>
#include <stdint.h>

#include "hal/can.h"

/* "node 5 does not answer" (MOTION_E_TIMEOUT), "the bus is gone: ..."
 * (MOTION_E_IO), or what the code says. */
void client_text(struct hal_can *can, uint8_t node, int err, char *text,
                 size_t size);

#endif
