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

static bool can_cycle_is_off(const struct can_cycle *self)
{
    const int state = hal_can_state(self->can);

    return state == HAL_CAN_BUS_OFF || state == HAL_CAN_DOWN;
}

/* The worst first. */
int can_cycle_verdict(struct can_cycle *self)
{
    const bool gone = self->lost || can_cycle_is_off(self);
    const bool foreign = self->foreign;

    self->lost = false;
    self->foreign = false;
    if (gone)
        return MOTION_E_IO;
    if (foreign)
        return MOTION_E_PROTOCOL;
    if (self->refused_cycles >= CAN_CYCLE_REFUSED_MAX)
        return MOTION_E_FULL;
    return hal_can_state(self->can) == HAL_CAN_PASSIVE ? MOTION_E_LIMIT
                                                       : MOTION_OK;
}

int can_cycle_end(struct can_cycle *self)
{
    (void)can_cycle_flush(self);
    return can_cycle_is_off(self) ? MOTION_E_IO : MOTION_OK;
}
