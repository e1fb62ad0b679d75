/* sim/bus/modbus_faulty.c - a station that spoils its answers; see
 * modbus.h. */
#include <string.h>

#include "hal/modbus/serial.h"
#include "sim/bus/modbus.h"
#include "sim/util.h"

#define DEVICE_BUSY  0x06
#define GATEWAY_PATH 0x0A /* and 0x0B, of its target */

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
    const unsigned again =
        2 * length <= MODBUS_FRAME_MAX ? length : MODBUS_FRAME_MAX - length;

    memmove(frame + length, frame, again);
    return length + again;
}

/* It begins and ends like one, and has no CRC. */
static bool sim_modbus_is_ascii(const uint8_t *frame, unsigned length)
{
    return length > 9 && frame[0] == ':' && frame[length - 1] == '\n' &&
           !modbus_rtu_is_sealed(frame, length);
}

/* Make a sound frame with another unit, or with an exception in place of its PDU. */
static unsigned sim_modbus_rewrite(uint8_t *frame, unsigned length,
                                   uint8_t exception)
{
    const bool is_ascii = sim_modbus_is_ascii(frame, length);
    uint8_t bytes[MODBUS_RTU_FRAME_MAX];
    const unsigned count = modbus_serial_open(is_ascii, frame, length, bytes);
    unsigned pdu = count > 1 ? count - 1 : 0;

    if (pdu == 0)
        return length;
    if (exception != 0)
        pdu = modbus_pdu_put_exception(bytes[1], exception, bytes + 1);
    memcpy(frame + 1, bytes + 1, pdu);
    return modbus_serial_seal(
        is_ascii, frame,
        exception != 0 ? bytes[0] : (uint8_t)(bytes[0] % 247 + 1), pdu);
}

/* Spoil a digit of the check. */
static unsigned sim_modbus_wrong_check(uint8_t *frame, unsigned length)
{
    if (sim_modbus_is_ascii(frame, length))
        frame[length - 3] = frame[length - 3] == '0' ? '1' : '0';
    else
        frame[length - 1] ^= 0x01;
    return length;
}

static unsigned sim_modbus_strays(uint64_t *seed, uint8_t *frame,
                                  unsigned length)
{
    const unsigned before = sim_modbus_random(seed) % 4;
    const unsigned behind = sim_modbus_random(seed) % 6;

    if (before + length + behind > MODBUS_FRAME_MAX)
        return length;
    memmove(frame + before, frame, length);
    for (unsigned i = 0; i < before; i++)
        frame[i] = (uint8_t)sim_modbus_random(seed);
    for (unsigned i = 0; i < behind; i++)
        frame[before + length + i] = (uint8_t)sim_modbus_random(seed);
    return before + length + behind;
}

unsigned sim_modbus_spoil(enum sim_modbus_fault fault, uint64_t *seed,
                          uint8_t frame[MODBUS_FRAME_MAX], unsigned length)
{
    if (length < 4)
        return length;
    switch (fault) {
    case SIM_MODBUS_EXCEPTION:
        return sim_modbus_rewrite(frame, length, DEVICE_BUSY);
    case SIM_MODBUS_GATEWAY:
        return sim_modbus_rewrite(
            frame, length,
            (uint8_t)(GATEWAY_PATH + sim_modbus_random(seed) % 2));
    case SIM_MODBUS_WRONG_CRC:
        return sim_modbus_wrong_check(frame, length);
    case SIM_MODBUS_OTHER_UNIT:
        return sim_modbus_rewrite(frame, length, 0);
    case SIM_MODBUS_HALF:
        return 1 + sim_modbus_random(seed) % (length - 1);
    case SIM_MODBUS_TWICE:
        return sim_modbus_twice(frame, length);
    case SIM_MODBUS_NOISE:
        return sim_modbus_noise(seed, frame);
    case SIM_MODBUS_STRAYS:
        return sim_modbus_strays(seed, frame, length);
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

/* True: the bytes, spoilt perhaps, go on now. */
static bool sim_modbus_faulty_pass(struct sim_modbus_faulty *self,
                                   struct sim_modbus_direction *direction,
                                   struct sim_modbus_held *frame,
                                   int64_t now_ns)
{
    const enum sim_modbus_fault fault =
        sim_modbus_direction_draw(direction, &self->seed);
    int64_t again_ns = 0;

    frame->length =
        sim_modbus_spoil(fault, &self->seed, frame->frame, frame->length);
    if (self->time != NULL)
        again_ns =
            modbus_rtu_chars_ns(self->time, frame->length) + self->time->gap_ns;
    return sim_modbus_direction_pass(direction, fault, &self->seed, frame,
                                     now_ns, again_ns);
}

static void sim_modbus_faulty_hand(struct sim_modbus_faulty *self,
                                   const struct sim_modbus_held *frame,
                                   int64_t now_ns)
{
    self->behind->ops->recv(self->behind, frame->frame, frame->length, now_ns);
}

static void sim_modbus_faulty_recv(struct modbus_station *station,
                                   const uint8_t *bytes, unsigned length,
                                   int64_t now_ns)
{
    struct sim_modbus_faulty *self = sim_modbus_faulty_of(station);
    struct sim_modbus_held frame = { .length = length };

    if (length > MODBUS_FRAME_MAX) { /* more than a frame: as it is */
        self->behind->ops->recv(self->behind, bytes, length, now_ns);
        return;
    }
    memcpy(frame.frame, bytes, length);
    if (sim_modbus_faulty_pass(self, &self->to, &frame, now_ns))
        sim_modbus_faulty_hand(self, &frame, now_ns);
}

static int64_t sim_modbus_faulty_due_ns(const struct modbus_station *station)
{
    const struct sim_modbus_faulty *self = sim_modbus_faulty_of(station);
    const int64_t behind_ns = self->behind->ops->due_ns(self->behind);
    const int64_t from_ns = sim_modbus_direction_due_ns(&self->from);
    const int64_t to_ns = sim_modbus_direction_due_ns(&self->to);
    const int64_t held_ns = from_ns < to_ns ? from_ns : to_ns;

    return held_ns < behind_ns ? held_ns : behind_ns;
}

static unsigned sim_modbus_faulty_poll(struct modbus_station *station,
                                       int64_t now_ns,
                                       uint8_t bytes[MODBUS_FRAME_MAX])
{
    struct sim_modbus_faulty *self = sim_modbus_faulty_of(station);
    struct sim_modbus_held frame = { .length = 0 };

    while (sim_modbus_direction_take(&self->to, now_ns, &frame))
        sim_modbus_faulty_hand(self, &frame, now_ns);
    if (!sim_modbus_direction_take(&self->from, now_ns, &frame)) {
        frame.length =
            self->behind->ops->poll(self->behind, now_ns, frame.frame);
        if (frame.length == 0)
            return 0;
        if (!sim_modbus_faulty_pass(self, &self->from, &frame, now_ns)) {
            self->behind->ops->sent(self->behind, now_ns);
            return 0;
        }
    }
    memcpy(bytes, frame.frame, frame.length);
    return frame.length;
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
