/* hal/can/can.c - see can.h. */
#include "hal/can.h"

#define BASE_ID_MAX     UINT32_C(0x7FF)
#define EXTENDED_ID_MAX UINT32_C(0x1FFFFFFF)

const char *hal_can_state_text(enum hal_can_state state)
{
    static const char *const text[] = {
        [HAL_CAN_ACTIVE] = "error-active",
        [HAL_CAN_WARNING] = "error-warning",
        [HAL_CAN_PASSIVE] = "error-passive",
        [HAL_CAN_BUS_OFF] = "bus-off",
        [HAL_CAN_DOWN] = "interface down",
    };

    return (unsigned)state < sizeof text / sizeof text[0] ? text[state]
                                                          : "unknown state";
}

/* The lengths that a DLC of 0..15 can say. */
static bool can_is_fd_length(unsigned len)
{
    if (len <= HAL_CAN_DATA_MAX)
        return true;
    if (len <= 24)
        return (len & 3) == 0;
    return len == 32 || len == 48 || len == HAL_CAN_FD_DATA_MAX;
}

bool hal_can_is_legal(const struct hal_can_frame *frame, bool fd)
{
    if (frame->id > (frame->extended ? EXTENDED_ID_MAX : BASE_ID_MAX))
        return false;
    if (!frame->fd)
        return frame->len <= HAL_CAN_DATA_MAX && !frame->switched;
    return fd && !frame->remote && can_is_fd_length(frame->len);
}
