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

/* The stuffed part of a frame as it is being written on the wire. */
struct can_bits_wire {
    unsigned crc, bits, run;
    unsigned last;
};

static void can_bits_wire_stuff(struct can_bits_wire *wire, unsigned bit)
{
    wire->run = bit == wire->last ? wire->run + 1 : 1;
    wire->last = bit;
    wire->bits++;
    if (wire->run == 5) { /* the stuff bit starts the next run */
        wire->bits++;
        wire->last = !bit;
        wire->run = 1;
    }
}

static void can_bits_wire_put(struct can_bits_wire *wire, uint32_t value,
                              unsigned count)
{
    while (count-- > 0) {
        unsigned bit = value >> count & 1;
        unsigned invert = bit ^ (wire->crc >> 14 & 1);

        wire->crc =
            (wire->crc << 1 & 0x7FFF) ^ (invert ? CAN_BITS_CRC_POLY : 0);
        can_bits_wire_stuff(wire, bit);
    }
}

/* Start of frame to the last bit before DLC (classic) or BRS (FD). */
static void can_bits_wire_put_head(struct can_bits_wire *wire,
                                   const struct hal_can_frame *frame)
{
    can_bits_wire_put(wire, 0, 1); /* start of frame */
    if (frame->extended) {
        can_bits_wire_put(wire, frame->id >> 18, 11);
        can_bits_wire_put(wire, 3, 2); /* SRR, IDE */
        can_bits_wire_put(wire, frame->id & 0x3FFFF, 18);
        can_bits_wire_put(wire, frame->remote, 1);
    } else {
        can_bits_wire_put(wire, frame->id, 11);
        can_bits_wire_put(wire, frame->remote, 1);
        can_bits_wire_put(wire, 0, 1); /* IDE */
    }
    if (frame->fd)
        can_bits_wire_put(wire, 2, 2); /* FDF, res */
    else                               /* r1, r0; the base format's r1 is IDE */
        can_bits_wire_put(wire, 0, frame->extended ? 2 : 1);
}

static void can_bits_wire_put_data(struct can_bits_wire *wire,
                                   const struct hal_can_frame *frame)
{
    for (unsigned i = 0; !frame->remote && i < frame->len; i++)
        can_bits_wire_put(wire, frame->data[i], 8);
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
    struct can_bits_wire wire = { .last = 2 }; /* neither 0 nor 1 */
    struct can_bits bits;

    can_bits_wire_put_head(&wire, frame);
    can_bits_wire_put(&wire, frame->switched, 1);
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
    struct can_bits_wire wire = { .last = 2 };
    unsigned crc;

    if (frame->fd)
        return can_bits_of_fd(frame);
    can_bits_wire_put_head(&wire, frame);
    can_bits_wire_put(&wire, frame->len, 4);
    can_bits_wire_put_data(&wire, frame);
    crc = wire.crc;
    can_bits_wire_put(&wire, crc, 15);
    return (struct can_bits){ wire.bits + CAN_BITS_UNSTUFFED_BITS, 0 };
}
