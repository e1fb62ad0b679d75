/* firmware/linux/tools/client_text.c - see client_text.h. */
#include "firmware/linux/tools/client_text.h"

#include <stdio.h>

#include "motion/core/err.h"

void client_text(struct hal_can *can, uint8_t node, int err, char *text,
                 size_t size)
{
    if (err == MOTION_E_TIMEOUT)
        snprintf(text, size, "node %u does not answer", node);
    else if (err == MOTION_E_IO)
        snprintf(text, size, "the bus is gone: %s",
                 hal_can_state_text((enum hal_can_state)hal_can_state(can)));
    else
        snprintf(text, size, "%s", motion_err_text(err));
}
