/* sim/device/cia402/guard.c - node guarding, life guarding, TIME.  Source: CiA
 * 301
 * 7.2.8.2.2, 7.2.6. */
#include "sim/device/cia402/parts.h"

void cia402_guard_start(struct sim_cia402 *self)
{
    self->guard_toggle = 0;
}

/* A node with a heartbeat does not answer. */
void cia402_guard_requested(struct sim_cia402 *self)
{
    const int64_t life_ns = INT64_C(1000000) * self->value[CIA402_GUARD_TIME] *
                            self->value[CIA402_LIFE_FACTOR];
    const uint8_t answer = (uint8_t)(self->guard_toggle | self->nmt_state);

    if (self->value[CIA402_PRODUCER] != 0)
        return;
    cia402_com_send(self, 0x700u + self->config.node_id, &answer, 1);
    self->guard_toggle ^= 0x80;
    if (self->master_lost) {
        self->master_lost = false;
        cia402_com_error_gone(self, CIA402_ERROR_COM);
    }
    cia402_timer_stop(self, SIM_CIA402_GUARD);
    if (life_ns > 0)
        cia402_timer_set(self, SIM_CIA402_GUARD, cia402_now_ns(self) + life_ns);
}

void cia402_guard_time(struct sim_cia402 *self,
                       const struct hal_can_frame *frame)
{
    const uint8_t *data = frame->data;

    if (frame->len != 6 || !(self->value[CIA402_TIME_COB] >> 31))
        return;
    self->time_ms = (data[0] | (uint32_t)data[1] << 8 |
                     (uint32_t)data[2] << 16 | (uint32_t)data[3] << 24) &
                    0x0FFFFFFF;
    self->time_days = (uint16_t)(data[4] | data[5] << 8);
}
