/* hal/modbus/rtu_slave.c - see rtu_slave.h. */
#include "hal/modbus/rtu_slave.h"

#include <stddef.h>

#include "hal/modbus/serial.h"
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

/* A frame of RTU ends with silence, one of ASCII with its last characters or where it
 * has too many. */
static bool modbus_rtu_slave_is_whole(const struct modbus_rtu_slave *self)
{
    const struct modbus_receiver *receiver = &self->receiver;

    return receiver->length > 0 &&
           (!self->time.is_ascii || receiver->length > MODBUS_FRAME_MAX ||
            receiver->byte[receiver->length - 1] == '\n');
}

/* Return where the last of the frames that stand there begins. */
static unsigned modbus_rtu_slave_at(const struct modbus_rtu_slave *self,
                                    unsigned length)
{
    unsigned at = self->time.is_ascii ? length : 0;

    while (at > 0 && self->receiver.byte[at - 1] != ':')
        at--;
    return at > 0 ? at - 1 : 0;
}

static int64_t modbus_rtu_slave_due_ns(const struct modbus_station *station)
{
    const struct modbus_rtu_slave *self = modbus_rtu_slave_of(station);

    if (modbus_rtu_slave_is_whole(self))
        return self->receiver.last_ns + self->time.gap_ns;
    return self->answer_length > 0 ? self->answer_ns : MODBUS_STATION_NEVER;
}

static void modbus_rtu_slave_serve(struct modbus_rtu_slave *self,
                                   int64_t now_ns)
{
    const bool is_ascii = self->time.is_ascii;
    const unsigned heard = self->receiver.length;
    const bool is_frame = heard <= MODBUS_FRAME_MAX;
    const unsigned at = is_frame ? modbus_rtu_slave_at(self, heard) : 0;
    uint8_t request[MODBUS_RTU_FRAME_MAX];
    const unsigned length =
        is_frame ? modbus_serial_open(is_ascii, self->receiver.byte + at,
                                      heard - at, request)
                 : 0;
    unsigned answered;

    self->receiver.length = 0;
    if (length == 0 ||
        (request[0] != self->unit && request[0] != HAL_MODBUS_BROADCAST)) {
        self->ignored++;
        return;
    }
    self->served++;
    answered = modbus_slave_serve(self->slave, request + 1, length - 1,
                                  self->answer + 1);
    if (request[0] == HAL_MODBUS_BROADCAST)
        return;
    self->answer_length =
        modbus_serial_seal(is_ascii, self->answer, self->unit, answered);
    self->answer_ns = now_ns + self->turnaround_ns;
}

static unsigned modbus_rtu_slave_poll(struct modbus_station *station,
                                      int64_t now_ns,
                                      uint8_t frame[MODBUS_FRAME_MAX])
{
    struct modbus_rtu_slave *self = modbus_rtu_slave_of(station);
    unsigned length;

    if (modbus_rtu_slave_is_whole(self) &&
        now_ns >= modbus_rtu_slave_due_ns(station))
        modbus_rtu_slave_serve(self, now_ns);
    if (modbus_rtu_slave_is_whole(self) || self->answer_length == 0 ||
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
