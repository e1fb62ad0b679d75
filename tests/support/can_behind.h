/* tests/support/can_behind.h - a CAN port in front of another: what a test does not
 * change goes through. */
#ifndef TESTS_SUPPORT_CAN_BEHIND_H
#define TESTS_SUPPORT_CAN_BEHIND_H

#include "hal/can.h"
#include "hal/support/container_of.h"

struct can_behind {
    struct hal_can can, *inner;
};

static inline struct hal_can *can_behind_inner(struct hal_can *can)
{
    return CONTAINER_OF(can, struct can_behind, can)->inner;
}

static inline int can_behind_send(struct hal_can *can,
                                  const struct hal_can_frame *frame)
{
    return hal_can_send(can_behind_inner(can), frame);
}

static inline int can_behind_flush(struct hal_can *can)
{
    return hal_can_flush(can_behind_inner(can));
}

static inline int can_behind_state(struct hal_can *can)
{
    return hal_can_state(can_behind_inner(can));
}

static inline void can_behind_stats(struct hal_can *can,
                                    struct hal_can_stats *stats)
{
    hal_can_stats(can_behind_inner(can), stats);
}

#endif
