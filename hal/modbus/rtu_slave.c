/* hal/modbus/rtu_slave.c - see rtu_slave.h. */
#include "hal/modbus/rtu_slave.h"

#include <stddef.h>

#include "hal/support/container_of.h"

static struct modbus_rtu_slave *
modbus_rtu_slave_of(const struct modbus_station *station)
{
    return CONTAINER_OF(station, struct modbus_rtu_slave, station);
}

/* A new frame while an answer waits: its asker has given up. */
static void modbus_rtu_slave_recv(struct modbus_station *station,
                                  const uint8_t *bytes, unsigned length,
                                  int64_t now_ns)
{
    struct modbus_rtu_slave *self = modbus_rtu_slave_of(station);

    self->answer_length = 0;
    if (!self->sending)
        modbus_receiver_take(&self->receiver, bytes, length, now_ns);
}

static int64_t modbus_rtu_slave_due_ns(const struct modbus_station *station)
{
    const struct modbus_rtu_slave *self = modbus_rtu_slave_of(station);

    if (self->receiver.length > 0)
        return self->receiver.last_ns + self->time.gap_ns;
    return self->answer_length > 0 ? self->answer_ns : MODBUS_STATION_NEVER;
}

static void modbus_rtu_slave_serve(struct modbus_rtu_slave *self,
                                   int64_t now_ns)
{
    const uint8_t *frame = self->receiver.byte;
    const unsigned length = self->receiver.length;
    unsigned answered;

    self->receiver.length = 0;
    if (!modbus_rtu_is_sealed(frame, length) ||
        (frame[0] != self->unit && frame[0] != HAL_MODBUS_BROADCAST)) {
        self->ignored++;
        return;
    }
    self->served++;
    answered = modbus_slave_serve(self->slave, frame + 1, length - 3,
                                  self->answer + 1);
    if (frame[0] == HAL_MODBUS_BROADCAST)
        return;
    self->answer_length = modbus_rtu_seal(self->answer, self->unit, answered);
    self->answer_ns = now_ns + self->turnaround_ns;
}

static unsigned modbus_rtu_slave_poll(struct modbus_station *station,
                                      int64_t now_ns,
                                      uint8_t frame[MODBUS_RTU_FRAME_MAX])
{
    struct modbus_rtu_slave *self = modbus_rtu_slave_of(station);
    unsigned length;

    if (self->receiver.length > 0 && now_ns >= modbus_rtu_slave_due_ns(station))
        modbus_rtu_slave_serve(self, now_ns);
    if (self->receiver.length > 0 || self->answer_length == 0 ||
        now_ns < self->answer_ns)
        return 0;
    length = self->answer_length;
    for (unsigned i = 0; i < length; i++)
        frame[i] = self->answer[i];
    self->answer_length = 0;
    self->sending = true;
    return length;
}

static void modbus_rtu_slave_sent(struct modbus_station *station,
                                  int64_t now_ns)
{
    (void)now_ns;
    modbus_rtu_slave_of(station)->sending = false;
}

static const struct modbus_station_ops modbus_rtu_slave_ops = {
    .recv = modbus_rtu_slave_recv,
    .due_ns = modbus_rtu_slave_due_ns,
    .poll = modbus_rtu_slave_poll,
    .sent = modbus_rtu_slave_sent,
};

int modbus_rtu_slave_init(struct modbus_rtu_slave *self,
                          struct modbus_slave *slave, uint8_t unit,
                          const struct modbus_rtu_line *line,
                          int64_t turnaround_ns)
{
    *self = (struct modbus_rtu_slave){ .station.ops = &modbus_rtu_slave_ops,
                                       .slave = slave,
                                       .unit = unit,
                                       .turnaround_ns = turnaround_ns };
    if (unit < 1 || unit > 247 || turnaround_ns < 0)
        return MOTION_E_ARG;
    return modbus_rtu_time_init(&self->time, line);
}
