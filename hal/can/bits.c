/* hal/can/bits.c - see bits.h.
 *
 * Classic and FD frames begin alike; an FD frame with BRS sends everything from
 * ESI to the end of its CRC at the faster rate.  Its CRC is stuffed by rule, a
 * bit before it and after every four, and not by what it holds. */
#include "hal/can/bits.h"

#define CAN_BITS_CRC_POLY 0x4599u /* ISO 11898-1 10.4.2.6 */

/* CRC delimiter, ACK slot, ACK delimiter, end of frame, intermission: these
 * are not stuffed. */
#define CAN_BITS_UNSTUFFED_BITS (1 + 1 + 1 + 7 + 3)

/* Stuff count, CRC, and the bits stuffed into them: 4 + 17 + 6, 4 + 21 + 7. */
#define CAN_BITS_FD_CRC_SHORT_BITS 27
#define CAN_BITS_FD_CRC_LONG_BITS  32
#define CAN_BITS_FD_SHORT_MAX      16 /* bytes */

/* What the last bits on the wire were: bit 2 is the last of them, bits 1 and 0
 * how many before it were equal. */
#define CAN_BITS_NONE_YET 8

/* Four bits at a time, by the state before them and their value: the state
 * after them, and 0x10 when a bit is stuffed among them, which is one at most;
 * and what the four highest bits of a CRC, shifted out, leave in it.  Both are
 * can_bits_wire_put_bit four times, which tests/hal/can/test_bits.c proves by
 * a count of its own. */
static const uint8_t can_bits_stuffed[][16] = {
    { 0x14, 0x04, 0x00, 0x05, 0x01, 0x04, 0x00, 0x06, 0x02, 0x04, 0x00, 0x05,
      0x01, 0x04, 0x00, 0x07 },
    { 0x10, 0x15, 0x00, 0x05, 0x01, 0x04, 0x00, 0x06, 0x02, 0x04, 0x00, 0x05,
      0x01, 0x04, 0x00, 0x07 },
    { 0x11, 0x14, 0x10, 0x16, 0x01, 0x04, 0x00, 0x06, 0x02, 0x04, 0x00, 0x05,
      0x01, 0x04, 0x00, 0x07 },
    { 0x12, 0x14, 0x10, 0x15, 0x11, 0x14, 0x10, 0x17, 0x02, 0x04, 0x00, 0x05,
      0x01, 0x04, 0x00, 0x07 },
    { 0x03, 0x04, 0x00, 0x05, 0x01, 0x04, 0x00, 0x06, 0x02, 0x04, 0x00, 0x05,
      0x01, 0x04, 0x00, 0x10 },
    { 0x03, 0x04, 0x00, 0x05, 0x01, 0x04, 0x00, 0x06, 0x02, 0x04, 0x00, 0x05,
      0x01, 0x04, 0x11, 0x14 },
    { 0x03, 0x04, 0x00, 0x05, 0x01, 0x04, 0x00, 0x06, 0x02, 0x04, 0x00, 0x05,
      0x12, 0x14, 0x10, 0x15 },
    { 0x03, 0x04, 0x00, 0x05, 0x01, 0x04, 0x00, 0x06, 0x13, 0x14, 0x10, 0x15,
      0x11, 0x14, 0x10, 0x16 },
    { 0x03, 0x04, 0x00, 0x05, 0x01, 0x04, 0x00, 0x06, 0x02, 0x04, 0x00, 0x05,
      0x01, 0x04, 0x00, 0x07 },
};
static const uint16_t can_bits_crc[16] = { 0x0000, 0x4599, 0x4EAB, 0x0B32,
                                           0x58CF, 0x1D56, 0x1664, 0x53FD,
                                           0x7407, 0x319E, 0x3AAC, 0x7F35,
                                           0x2CC8, 0x6951, 0x6263, 0x27FA };

/* The stuffed part of a frame as it is being written on the wire. */
struct can_bits_wire {
    unsigned crc, bits;
    unsigned state;
};

static void can_bits_wire_put_bit(struct can_bits_wire *wire, unsigned bit)
{
    const bool goes_on = wire->state >> 2 == bit;

    wire->crc = (wire->crc << 1 & 0x7FFF) ^
                (bit != wire->crc >> 14 ? CAN_BITS_CRC_POLY : 0);
    wire->bits++;
    if (!goes_on)
        wire->state = bit << 2;
    else if ((wire->state & 3) < 3)
        wire->state++;
    else { /* the fifth: the bit stuffed after it starts the next run */
        wire->bits++;
        wire->state = (bit ^ 1U) << 2;
    }
}

static void can_bits_wire_put(struct can_bits_wire *wire, uint64_t value,
                              unsigned count)
{
    while (count % 4 > 0)
        can_bits_wire_put_bit(wire, value >> --count & 1);
    struct can_bits_wire at = *wire; /* in registers */
    at.bits += count;
    while (count > 0) {
        const unsigned four = value >> (count -= 4) & 0xF;
        const unsigned stuffed = can_bits_stuffed[at.state][four];

        at.crc = (at.crc << 4 & 0x7FFF) ^ can_bits_crc[at.crc >> 11 ^ four];
        at.bits += stuffed >> 4;
        at.state = stuffed & 0xF;
    }
    *wire = at;
}

/* Start of frame to the last bit before DLC (classic) or BRS (FD), and the
 * `count` bits after it. */
static void can_bits_wire_put_head(struct can_bits_wire *wire,
                                   const struct hal_can_frame *frame,
                                   unsigned after, unsigned count)
{
    uint64_t head = frame->id & 0x7FF;
    unsigned length = 1 + 11; /* start of frame is 0 */

    if (frame->extended) { /* with SRR and IDE */
        head =
            (uint64_t)(frame->id >> 18 << 2 | 3) << 18 | (frame->id & 0x3FFFF);
        length += 2 + 18;
    }
    head = head << 1 | frame->remote;
    length++;
    if (!frame->extended) { /* IDE */
        head <<= 1;
        length++;
    }
    if (frame->fd) { /* FDF, res */
        head = head << 2 | 2;
        length += 2;
    } else { /* r1, r0; the base format's r1 is IDE */
        head <<= frame->extended ? 2 : 1;
        length += frame->extended ? 2 : 1;
    }
    can_bits_wire_put(wire, head << count | after, length + count);
}

static void can_bits_wire_put_data(struct can_bits_wire *wire,
                                   const struct hal_can_frame *frame)
{
    unsigned at = 0;

    while (!frame->remote && at < frame->len) {
        const unsigned left = frame->len - at, count = left < 8 ? left : 8;
        uint64_t value = 0;

        for (unsigned i = 0; i < count; i++)
            value = value << 8 | frame->data[at + i];
        can_bits_wire_put(wire, value, 8 * count);
        at += count;
    }
}

static unsigned can_bits_dlc(unsigned len)
{
    static const uint8_t longer[] = { 12, 16, 20, 24, 32, 48, 64 };
    unsigned dlc = 9;

    if (len <= HAL_CAN_DATA_MAX)
        return len;
    while (longer[dlc - 9] < len)
        dlc++;
    return dlc;
}

static struct can_bits can_bits_of_fd(const struct hal_can_frame *frame)
{
    struct can_bits_wire wire = { .state = CAN_BITS_NONE_YET };
    struct can_bits bits;

    can_bits_wire_put_head(&wire, frame, frame->switched, 1);
    bits.slow = wire.bits + CAN_BITS_UNSTUFFED_BITS;
    wire.bits = 0;
    can_bits_wire_put(&wire, 0, 1); /* ESI */
    can_bits_wire_put(&wire, can_bits_dlc(frame->len), 4);
    can_bits_wire_put_data(&wire, frame);
    bits.fast = wire.bits + (frame->len <= CAN_BITS_FD_SHORT_MAX
                                 ? CAN_BITS_FD_CRC_SHORT_BITS
                                 : CAN_BITS_FD_CRC_LONG_BITS);
    if (frame->switched)
        return bits;
    return (struct can_bits){ bits.slow + bits.fast, 0 };
}

struct can_bits can_bits_of(const struct hal_can_frame *frame)
{
    struct can_bits_wire wire = { .state = CAN_BITS_NONE_YET };

    if (frame->fd)
        return can_bits_of_fd(frame);
    can_bits_wire_put_head(&wire, frame, frame->len, 4);
    can_bits_wire_put_data(&wire, frame);
    /* with one bit more, unlike the last: it is stuffed nowhere and makes whole
     * fours */
    can_bits_wire_put(&wire, wire.crc << 1 | (~wire.crc & 1), 16);
    return (struct can_bits){ wire.bits - 1 + CAN_BITS_UNSTUFFED_BITS, 0 };
}
