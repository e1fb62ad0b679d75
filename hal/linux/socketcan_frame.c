/* hal/linux/socketcan_frame.c - see socketcan_frame.h. */
#include "hal/linux/socketcan_frame.h"

#include <string.h>

#include <linux/can/error.h>

#define STAMP_AGE_MAX_NS   INT64_C(1000000000)
#define STAMP_JUMP_NS      INT64_C(10000000) /* the card's clock was set anew */
#define STAMP_DRIFT_SHIFT  10     /* follows a drift with 1/1024 per frame */
#define ERROR_HAS_COUNTERS 0x200u /* CAN_ERR_CNT of newer kernels */

/* ---- frames ---- */

size_t can_frame_encode(const struct hal_can_frame *frame,
                        struct canfd_frame *out)
{
    *out = (struct canfd_frame){ .can_id = frame->id, .len = frame->len };
    if (frame->extended)
        out->can_id |= CAN_EFF_FLAG;
    if (frame->remote)
        out->can_id |= CAN_RTR_FLAG;
    else
        memcpy(out->data, frame->data, frame->len);
    if (!frame->fd)
        return CAN_MTU;
    out->flags = frame->switched ? CANFD_BRS : 0;
    return CANFD_MTU;
}

bool can_frame_is_error(const struct canfd_frame *in)
{
    return (in->can_id & CAN_ERR_FLAG) != 0;
}

bool can_frame_decode(const struct canfd_frame *in, size_t bytes,
                      struct hal_can_frame *frame)
{
    if ((bytes != CAN_MTU && bytes != CANFD_MTU) || can_frame_is_error(in) ||
        in->len > HAL_CAN_FD_DATA_MAX)
        return false;
    *frame = (struct hal_can_frame){
        .extended = (in->can_id & CAN_EFF_FLAG) != 0,
        .remote = (in->can_id & CAN_RTR_FLAG) != 0,
        .fd = bytes == CANFD_MTU,
        .len = in->len,
    };
    frame->id = in->can_id & (frame->extended ? CAN_EFF_MASK : CAN_SFF_MASK);
    frame->switched = frame->fd && (in->flags & CANFD_BRS) != 0;
    if (!hal_can_is_legal(frame, true))
        return false;
    if (!frame->remote)
        memcpy(frame->data, in->data, in->len);
    return true;
}

/* ---- errors ---- */

static enum hal_can_state can_frame_controller(uint8_t status,
                                               enum hal_can_state state)
{
    if (status & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE))
        return HAL_CAN_PASSIVE;
    if (status & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING))
        return HAL_CAN_WARNING;
    return status & CAN_ERR_CRTL_ACTIVE ? HAL_CAN_ACTIVE : state;
}

enum hal_can_state can_frame_error(const struct canfd_frame *in,
                                   enum hal_can_state state,
                                   struct hal_can_stats *stats)
{
    const uint32_t what = in->can_id;
    enum hal_can_state next = state;

    if (what & CAN_ERR_RESTARTED)
        next = HAL_CAN_ACTIVE;
    if (what & CAN_ERR_CRTL) {
        next = can_frame_controller(in->data[1], next);
        if (in->data[1] & (CAN_ERR_CRTL_RX_OVERFLOW | CAN_ERR_CRTL_TX_OVERFLOW))
            stats->dropped++;
    }
    if (what & CAN_ERR_BUSOFF)
        next = HAL_CAN_BUS_OFF;
    if (what & ERROR_HAS_COUNTERS) {
        stats->tx_errors = in->data[6];
        stats->rx_errors = in->data[7];
    }
    if (what & (CAN_ERR_TX_TIMEOUT | CAN_ERR_PROT | CAN_ERR_ACK |
                CAN_ERR_BUSERROR | CAN_ERR_TRX))
        stats->errors++;
    if (next > state) {
        stats->warnings += next == HAL_CAN_WARNING;
        stats->passives += next == HAL_CAN_PASSIVE;
        stats->bus_offs += next == HAL_CAN_BUS_OFF;
    }
    return next;
}

/* ---- time stamps ---- */

static void can_stamp_learn(struct can_stamp *stamp, int64_t apart_ns)
{
    const int64_t slower_ns = apart_ns - stamp->apart_ns;

    if (!stamp->known || slower_ns < 0 || slower_ns > STAMP_JUMP_NS)
        stamp->apart_ns = apart_ns;
    else
        stamp->apart_ns += slower_ns >> STAMP_DRIFT_SHIFT;
    stamp->known = true;
}

int64_t can_stamp_monotonic(struct can_stamp *stamp, int64_t software_ns,
                            int64_t hardware_ns, int64_t now_real_ns,
                            int64_t now_ns)
{
    int64_t t_ns = now_ns - (now_real_ns - software_ns);

    if (software_ns == 0 || t_ns > now_ns || t_ns < now_ns - STAMP_AGE_MAX_NS)
        return now_ns; /* none, or the wall clock has been set meanwhile */
    if (hardware_ns == 0)
        return t_ns;
    can_stamp_learn(stamp, t_ns - hardware_ns);
    hardware_ns += stamp->apart_ns;
    return hardware_ns < t_ns ? hardware_ns : t_ns;
}
