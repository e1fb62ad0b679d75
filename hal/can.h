/* hal/can.h - a CAN port: send and receive frames, never block.
 *
 * Implementations: sim/sim_can.c (simulated bus).  A port is not shared between
 * threads. */
#ifndef HAL_CAN_H
#define HAL_CAN_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/err.h"

#define HAL_CAN_DATA_MAX 8

struct hal_can_frame {
    uint32_t id; /* 11 bits; 29 bits when `extended` */
    bool extended, remote;
    uint8_t len; /* 0..8 */
    uint8_t data[HAL_CAN_DATA_MAX];
    int64_t t_ns; /* when it was received: end of frame, on the clock of
                             hal_clock; 0 when sending */
};

/* State of the controller's error counters (ISO 11898-1). */
enum hal_can_state {
    HAL_CAN_ACTIVE,
    HAL_CAN_WARNING, /* a counter >= 96 */
    HAL_CAN_PASSIVE, /* >= 128 */
    HAL_CAN_BUS_OFF,
    HAL_CAN_DOWN, /* interface not up */
};

struct hal_can_stats {
    uint64_t sent, received; /* frames */
    uint64_t dropped;        /* received but no room to keep them */
    uint64_t refused;        /* sends refused with MOTION_E_FULL */
    uint64_t busy_ns; /* time the wire was in use, all nodes; 0: unknown */
};

struct hal_can;

struct hal_can_ops {
    /* Queue one frame.  MOTION_OK, MOTION_E_FULL (transmit queue full, nothing
     * queued), MOTION_E_IO (bus-off or interface down), MOTION_E_ARG. */
    int (*send)(struct hal_can *can, const struct hal_can_frame *frame);
    /* Oldest received frame.  1 when there was one, 0 when not, MOTION_E_IO. */
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

#endif
