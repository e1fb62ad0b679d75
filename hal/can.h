/* hal/can.h - a CAN port: send and receive frames, never block.
 *
 * Classic frames (11 or 29 bits of identifier, up to 8 bytes, remote frames)
 * and, where the port can, CAN FD frames.  Nothing here waits: a frame that
 * cannot be queued now is refused, and the caller has a newer one next cycle.
 *
 * A port may gather what is sent and put it on its way with flush, so that a
 * cycle costs one call of the system; nothing may be relied on to go out before
 * that.  After bus-off or an interface that was down a port comes back when the
 * world outside brings it back; whoever must not go on as if nothing had
 * happened latches the error (firmware/control/controller.h does).
 *
 * Implementations: hal/linux/socketcan.c (Linux), sim/bus/can.c (simulated
 * bus); tests/conform/conform_can.c is what both keep to.  A port is not shared
 * between threads.  Source: ISO 11898-1. */
#ifndef HAL_CAN_H
#define HAL_CAN_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/err.h"

MOTION_C_BEGIN

#define HAL_CAN_DATA_MAX    8
#define HAL_CAN_FD_DATA_MAX 64

struct hal_can_frame {
    uint32_t id; /* 11 bits; 29 bits when `extended` */
    bool extended, remote;
    bool fd;       /* FD format; never remote */
    bool switched; /* FD: data at the faster bit rate (BRS) */
    uint8_t len;   /* 0..8; FD also 12, 16, 20, 24, 32, 48, 64 */
    uint8_t data[HAL_CAN_FD_DATA_MAX];
    int64_t t_ns; /* when it was received: end of frame, on the clock of
                     hal_clock; 0: not known.  Not looked at when sending */
};

/* State of the controller's error counters (ISO 11898-1 12.1). */
enum hal_can_state {
    HAL_CAN_ACTIVE,
    HAL_CAN_WARNING, /* a counter >= 96 */
    HAL_CAN_PASSIVE, /* >= 128 */
    HAL_CAN_BUS_OFF,
    HAL_CAN_DOWN, /* interface not up, or not there any more */
};
/* "error-passive" ...; never NULL. */
const char *hal_can_state_text(enum hal_can_state state);

struct hal_can_stats {
    uint64_t sent, received; /* frames */
    uint64_t dropped;        /* received but no room to keep them */
    uint64_t refused;        /* refused with MOTION_E_FULL */
    uint64_t errors;         /* errors on the wire that were seen */
    uint64_t warnings, passives, bus_offs; /* entries, from a better state */
    uint16_t tx_errors, rx_errors; /* counters of the controller, last known */
    uint64_t busy_ns; /* time the wire was in use, all nodes; 0: unknown */
};

struct hal_can;

struct hal_can_ops {
    /* Take one frame to be sent, in the order of the calls.  MOTION_OK,
     * MOTION_E_FULL (no room: not taken), MOTION_E_IO (bus-off or interface
     * down: not taken), MOTION_E_ARG (no frame of this port). */
    int (*send)(struct hal_can *can, const struct hal_can_frame *frame);
    /* Put on its way all that was taken.  MOTION_OK; MOTION_E_FULL or
     * MOTION_E_IO when some had to be thrown away: never kept for later. */
    int (*flush)(struct hal_can *can);
    /* Oldest received frame.  1 when there was one, 0 when not, MOTION_E_IO
     * while the port is off the bus and nothing is left to read. */
    int (*recv)(struct hal_can *can, struct hal_can_frame *frame);
    int (*state)(struct hal_can *can); /* enum hal_can_state */
    void (*stats)(struct hal_can *can, struct hal_can_stats *stats);
};

struct hal_can {
    const struct hal_can_ops *ops;
};

static inline int hal_can_send(struct hal_can *can,
                               const struct hal_can_frame *frame)
{
    return can->ops->send(can, frame);
}

static inline int hal_can_flush(struct hal_can *can)
{
    return can->ops->flush(can);
}

static inline int hal_can_recv(struct hal_can *can, struct hal_can_frame *frame)
{
    return can->ops->recv(can, frame);
}

static inline int hal_can_state(struct hal_can *can)
{
    return can->ops->state(can);
}

static inline void hal_can_stats(struct hal_can *can,
                                 struct hal_can_stats *stats)
{
    can->ops->stats(can, stats);
}

/* Can this frame be on a wire at all?  `fd`: one that carries FD frames. */
bool hal_can_is_legal(const struct hal_can_frame *frame, bool fd);

MOTION_C_END

#endif
