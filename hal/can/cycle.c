/* hal/can/cycle.c - see cycle.h. */
#include "hal/can/cycle.h"

void can_cycle_init(struct can_cycle *self, struct hal_can *can)
{
    *self = (struct can_cycle){ .can = can };
}

void can_cycle_begin(struct can_cycle *self)
{
    self->refused_cycles = self->refused ? self->refused_cycles + 1 : 0;
    self->refused = false;
    self->drained = 0;
}

bool can_cycle_recv(struct can_cycle *self, struct hal_can_frame *frame)
{
    int got;

    if (self->drained == CAN_CYCLE_DRAIN_MAX)
        return false;
    self->drained++;
    got = hal_can_recv(self->can, frame);
    self->lost = self->lost || got < 0;
    return got > 0;
}

static int can_cycle_note(struct can_cycle *self, int err)
{
    if (err != MOTION_OK) {
        self->refused = true;
        self->send_refused++;
    }
    return err;
}

int can_cycle_send(struct can_cycle *self, const struct hal_can_frame *frame)
{
    return can_cycle_note(self, hal_can_send(self->can, frame));
}

int can_cycle_flush(struct can_cycle *self)
{
    return can_cycle_note(self, hal_can_flush(self->can));
}

void can_cycle_foreign(struct can_cycle *self,
                       const struct hal_can_frame *frame)
{
    if (!self->foreign)
        self->foreign_id = frame->id;
    self->foreign = true;
}

/* The worst first. */
enum hal_fieldbus_health can_cycle_health(struct can_cycle *self)
{
    const int state = hal_can_state(self->can);
    const bool lost = self->lost, foreign = self->foreign;

    self->lost = false;
    self->foreign = false;
    if (state == HAL_CAN_BUS_OFF)
        return HAL_FIELDBUS_BUS_OFF;
    if (state == HAL_CAN_DOWN || lost)
        return HAL_FIELDBUS_DOWN;
    if (foreign)
        return HAL_FIELDBUS_FOREIGN;
    if (self->refused_cycles >= CAN_CYCLE_REFUSED_MAX)
        return HAL_FIELDBUS_FULL;
    return state == HAL_CAN_PASSIVE ? HAL_FIELDBUS_PASSIVE : HAL_FIELDBUS_GOOD;
}
