/* sim/bus/modbus_faulty.c - a station that spoils its answers; see
 * modbus.h. */
#include <string.h>

#include "sim/bus/modbus.h"
#include "sim/util.h"

#define DEVICE_BUSY 0x06

static uint32_t sim_modbus_random(uint64_t *seed)
{
    return (uint32_t)(sim_random(seed) >> 32);
}

static void sim_modbus_flip_bit(uint8_t *frame, uint32_t at)
{
    frame[at / 8] = (uint8_t)(frame[at / 8] ^ 1u << at % 8);
}

/* A burst of up to 16 bits, which a CRC-16 is sure to see. */
static unsigned sim_modbus_flip(uint64_t *seed, uint8_t *frame, unsigned length)
{
    const uint32_t first = sim_modbus_random(seed) % (8 * length - 15);
    const uint32_t random = sim_modbus_random(seed);
    const uint32_t pattern = (random >> 16 & 0xFFFF >> (random & 15)) | 1;

    for (unsigned bit = 0; bit < 16; bit++)
        if ((pattern >> bit & 1) != 0)
            sim_modbus_flip_bit(frame, first + bit);
    return length;
}

static unsigned sim_modbus_noise(uint64_t *seed, uint8_t *frame)
{
    const unsigned length = 1 + sim_modbus_random(seed) % MODBUS_RTU_FRAME_MAX;

    for (unsigned i = 0; i < length; i++)
        frame[i] = (uint8_t)sim_modbus_random(seed);
    return length;
}

static unsigned sim_modbus_twice(uint8_t *frame, unsigned length)
{
    const unsigned again = 2 * length <= MODBUS_RTU_FRAME_MAX
                               ? length
                               : MODBUS_RTU_FRAME_MAX - length;

    memmove(frame + length, frame, again);
    return length + again;
}

unsigned sim_modbus_spoil(enum sim_modbus_fault fault, uint64_t *seed,
                          uint8_t frame[MODBUS_RTU_FRAME_MAX], unsigned length)
{
    if (length < 4)
        return length;
    switch (fault) {
    case SIM_MODBUS_EXCEPTION:
        return modbus_rtu_seal(
            frame, frame[0],
            modbus_pdu_put_exception(frame[1], DEVICE_BUSY, frame + 1));
    case SIM_MODBUS_WRONG_CRC:
        frame[length - 1] ^= 0x01;
        return length;
    case SIM_MODBUS_OTHER_UNIT:
        return modbus_rtu_seal(frame, (uint8_t)(frame[0] % 247 + 1),
                               length - 3);
    case SIM_MODBUS_HALF:
        return 1 + sim_modbus_random(seed) % (length - 1);
    case SIM_MODBUS_TWICE:
        return sim_modbus_twice(frame, length);
    case SIM_MODBUS_NOISE:
        return sim_modbus_noise(seed, frame);
    case SIM_MODBUS_FLIP:
        return sim_modbus_flip(seed, frame, length);
    default:
        return length;
    }
}

static struct sim_modbus_faulty *
sim_modbus_faulty_of(const struct modbus_station *station)
{
    return CONTAINER_OF(station, struct sim_modbus_faulty, station);
}

static void sim_modbus_faulty_recv(struct modbus_station *station,
                                   const uint8_t *bytes, unsigned length,
                                   int64_t now_ns)
{
    struct modbus_station *behind = sim_modbus_faulty_of(station)->behind;

    behind->ops->recv(behind, bytes, length, now_ns);
}

static int64_t sim_modbus_faulty_due_ns(const struct modbus_station *station)
{
    const struct sim_modbus_faulty *self = sim_modbus_faulty_of(station);
    const int64_t behind_ns = self->behind->ops->due_ns(self->behind);

    if (self->held_length > 0 && self->held_ns < behind_ns)
        return self->held_ns;
    return behind_ns;
}

static bool sim_modbus_faulty_hits(struct sim_modbus_faulty *self)
{
    if (self->fault == SIM_MODBUS_GOOD ||
        (self->share_q32 > 0 &&
         sim_random(&self->seed) >> 32 >= self->share_q32))
        return false;
    self->spoilt++;
    return true;
}

static void sim_modbus_faulty_count(struct sim_modbus_faulty *self)
{
    if (self->times > 0 && --self->times == 0)
        self->fault = SIM_MODBUS_GOOD;
}

static unsigned sim_modbus_faulty_apply(struct sim_modbus_faulty *self,
                                        int64_t now_ns, uint8_t *frame,
                                        unsigned length)
{
    const enum sim_modbus_fault fault = self->fault;

    if (!sim_modbus_faulty_hits(self))
        return length;
    sim_modbus_faulty_count(self);
    if (fault != SIM_MODBUS_LATE && fault != SIM_MODBUS_MUTE)
        return sim_modbus_spoil(fault, &self->seed, frame, length);
    if (fault == SIM_MODBUS_LATE) {
        memcpy(self->held, frame, length);
        self->held_length = length;
        self->held_ns = now_ns + self->late_ns;
    }
    self->behind->ops->sent(self->behind, now_ns);
    return 0;
}

static unsigned sim_modbus_faulty_poll(struct modbus_station *station,
                                       int64_t now_ns,
                                       uint8_t frame[MODBUS_RTU_FRAME_MAX])
{
    struct sim_modbus_faulty *self = sim_modbus_faulty_of(station);
    unsigned length;

    if (self->held_length > 0 && now_ns >= self->held_ns) {
        length = self->held_length;
        memcpy(frame, self->held, length);
        self->held_length = 0;
        return length;
    }
    length = self->behind->ops->poll(self->behind, now_ns, frame);
    return length == 0 ? 0
                       : sim_modbus_faulty_apply(self, now_ns, frame, length);
}

static void sim_modbus_faulty_sent(struct modbus_station *station,
                                   int64_t now_ns)
{
    struct modbus_station *behind = sim_modbus_faulty_of(station)->behind;

    behind->ops->sent(behind, now_ns);
}

static const struct modbus_station_ops sim_modbus_faulty_ops = {
    .recv = sim_modbus_faulty_recv,
    .due_ns = sim_modbus_faulty_due_ns,
    .poll = sim_modbus_faulty_poll,
    .sent = sim_modbus_faulty_sent,
};

void sim_modbus_faulty_init(struct sim_modbus_faulty *self,
                            struct modbus_station *behind, uint64_t seed)
{
    *self = (struct sim_modbus_faulty){ .station.ops = &sim_modbus_faulty_ops,
                                        .behind = behind,
                                        .seed = seed };
}
