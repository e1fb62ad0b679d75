/* hal/can/cycle.h - a CAN port through the cycles of the master that owns it:
 * what was refused, lost or said by another master, and what that makes of the
 * bus.
 *
 * Of begin(): can_cycle_begin, frames in until there are none, frames out,
 * can_cycle_health.  Of end(): can_cycle_flush after what was sent. */
#ifndef HAL_CAN_CYCLE_H
#define HAL_CAN_CYCLE_H

#include "hal/can.h"
#include "hal/fieldbus.h"

/* Frames taken in by one begin(): more than a full 1 Mbit/s bus carries in
 * 5 ms; the rest waits in the port. */
#define CAN_CYCLE_DRAIN_MAX 128
/* Cycles in a row with a refused send that are a fault. */
#define CAN_CYCLE_REFUSED_MAX 3

struct can_cycle {
    struct hal_can *can;
    bool refused, foreign, lost; /* seen since health was told */
    uint32_t foreign_id;         /* of the last cycle with such, its first */
    unsigned refused_cycles;     /* in a row */
    unsigned drained;            /* frames taken in, this cycle */
    uint64_t send_refused;       /* not taken by the port, ever */
};

void can_cycle_init(struct can_cycle *self, struct hal_can *can);
void can_cycle_begin(struct can_cycle *self);
/* The next frame that came; false: no more in this cycle. */
bool can_cycle_recv(struct can_cycle *self, struct hal_can_frame *frame);
/* Errors of hal_can_send, hal_can_flush. */
int can_cycle_send(struct can_cycle *self, const struct hal_can_frame *frame);
int can_cycle_flush(struct can_cycle *self);
/* Another master has sent this frame. */
void can_cycle_foreign(struct can_cycle *self,
                       const struct hal_can_frame *frame);
/* Return what begin() says of the bus, and wipe the marks it is made from. */
enum hal_fieldbus_health can_cycle_health(struct can_cycle *self);

#endif
