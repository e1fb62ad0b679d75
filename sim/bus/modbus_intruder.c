/* sim/bus/modbus_intruder.c - see modbus.h. */
#include "sim/bus/modbus.h"

#include <string.h>

#include "sim/util.h"

#define INTRUDER_FRAME 8

static struct sim_modbus_intruder *
intruder_of(const struct modbus_station *station)
{
    return CONTAINER_OF(station, struct sim_modbus_intruder, station);
}

static void intruder_recv(struct modbus_station *station, const uint8_t *bytes,
                          unsigned length, int64_t now_ns)
{
    (void)station;
    (void)bytes;
    (void)length;
    (void)now_ns;
}

static int64_t intruder_due_ns(const struct modbus_station *station)
{
    const struct sim_modbus_intruder *self = intruder_of(station);

    return self->on ? self->next_ns : MODBUS_STATION_NEVER;
}

/* "Give me two registers from 0 on", or bytes without sense. */
static unsigned intruder_poll(struct modbus_station *station, int64_t now_ns,
                              uint8_t frame[MODBUS_FRAME_MAX])
{
    static const uint8_t ask[] = { 0x03, 0, 0, 0, 2 };
    struct sim_modbus_intruder *self = intruder_of(station);

    if (now_ns < intruder_due_ns(station))
        return 0;
    if (self->unit > 0) {
        memcpy(frame + 1, ask, sizeof ask);
        return modbus_rtu_seal(frame, self->unit, sizeof ask);
    }
    for (unsigned i = 0; i < INTRUDER_FRAME; i++)
        frame[i] = (uint8_t)(sim_random(&self->seed) >> 56);
    return INTRUDER_FRAME;
}

static void intruder_sent(struct modbus_station *station, int64_t now_ns)
{
    struct sim_modbus_intruder *self = intruder_of(station);

    self->next_ns = now_ns;
    if (self->pause_ns > 0)
        self->next_ns +=
            (int64_t)(sim_random(&self->seed) % (uint64_t)self->pause_ns);
}

static const struct modbus_station_ops intruder_ops = {
    .recv = intruder_recv,
    .due_ns = intruder_due_ns,
    .poll = intruder_poll,
    .sent = intruder_sent,
};

int sim_modbus_intruder_init(struct sim_modbus_intruder *self,
                             struct sim_modbus_line *line, uint64_t seed)
{
    *self = (struct sim_modbus_intruder){ .station.ops = &intruder_ops,
                                          .seed = seed };
    return sim_modbus_seat_init(&self->seat, line, &self->station);
}
