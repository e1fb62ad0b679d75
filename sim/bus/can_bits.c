/* sim/bus/can_bits.c - how long a CAN frame is on the wire.  See can.h.
 *
 * Classic and FD frames begin alike; an FD frame with BRS sends everything from
 * ESI to the end of its CRC at the faster rate.  Its CRC is stuffed by rule, a
 * bit before it and after every four, and not by what it holds. */
#include "sim/bus/can.h"

#define SIM_CAN_CRC_POLY 0x4599u /* ISO 11898-1 10.4.2.6 */

/* CRC delimiter, ACK slot, ACK delimiter, end of frame, intermission: these
 * are not stuffed. */
#define SIM_CAN_UNSTUFFED_BITS (1 + 1 + 1 + 7 + 3)

/* Stuff count, CRC, and the bits stuffed into them: 4 + 17 + 6, 4 + 21 + 7. */
#define SIM_CAN_FD_CRC_SHORT_BITS 27
#define SIM_CAN_FD_CRC_LONG_BITS  32
#define SIM_CAN_FD_SHORT_MAX      16 /* bytes */

/* The stuffed part of a frame as it is being written on the wire. */
struct sim_can_wire {
    unsigned crc, bits, run;
    unsigned last;
};

static void sim_can_wire_stuff(struct sim_can_wire *wire, unsigned bit)
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

static void sim_can_wire_put(struct sim_can_wire *wire, uint32_t value,
                             unsigned count)
{
    while (count-- > 0) {
        unsigned bit = value >> count & 1;
        unsigned invert = bit ^ (wire->crc >> 14 & 1);

        wire->crc = (wire->crc << 1 & 0x7FFF) ^ (invert ? SIM_CAN_CRC_POLY : 0);
        sim_can_wire_stuff(wire, bit);
    }
}

/* Start of frame to the last bit before DLC (classic) or BRS (FD). */
static void sim_can_wire_put_head(struct sim_can_wire *wire,
                                  const struct hal_can_frame *frame)
{
    sim_can_wire_put(wire, 0, 1); /* start of frame */
    if (frame->extended) {
        sim_can_wire_put(wire, frame->id >> 18, 11);
        sim_can_wire_put(wire, 3, 2); /* SRR, IDE */
        sim_can_wire_put(wire, frame->id & 0x3FFFF, 18);
        sim_can_wire_put(wire, frame->remote, 1);
    } else {
        sim_can_wire_put(wire, frame->id, 11);
        sim_can_wire_put(wire, frame->remote, 1);
        sim_can_wire_put(wire, 0, 1); /* IDE */
    }
    if (frame->fd)
        sim_can_wire_put(wire, 2, 2); /* FDF, res */
    else                              /* r1, r0; the base format's r1 is IDE */
        sim_can_wire_put(wire, 0, frame->extended ? 2 : 1);
}

static void sim_can_wire_put_data(struct sim_can_wire *wire,
                                  const struct hal_can_frame *frame)
{
    for (unsigned i = 0; !frame->remote && i < frame->len; i++)
        sim_can_wire_put(wire, frame->data[i], 8);
}

static unsigned sim_can_dlc(unsigned len)
{
    static const uint8_t longer[] = { 12, 16, 20, 24, 32, 48, 64 };
    unsigned dlc = 9;

    if (len <= HAL_CAN_DATA_MAX)
        return len;
    while (longer[dlc - 9] < len)
        dlc++;
    return dlc;
}

static struct sim_can_bits sim_can_bits_fd(const struct hal_can_frame *frame)
{
    struct sim_can_wire wire = { .last = 2 }; /* neither 0 nor 1 */
    struct sim_can_bits bits;

    sim_can_wire_put_head(&wire, frame);
    sim_can_wire_put(&wire, frame->switched, 1);
    bits.slow = wire.bits + SIM_CAN_UNSTUFFED_BITS;
    wire.bits = 0;
    sim_can_wire_put(&wire, 0, 1); /* ESI */
    sim_can_wire_put(&wire, sim_can_dlc(frame->len), 4);
    sim_can_wire_put_data(&wire, frame);
    bits.fast = wire.bits + (frame->len <= SIM_CAN_FD_SHORT_MAX
                                 ? SIM_CAN_FD_CRC_SHORT_BITS
                                 : SIM_CAN_FD_CRC_LONG_BITS);
    if (frame->switched)
        return bits;
    return (struct sim_can_bits){ bits.slow + bits.fast, 0 };
}

struct sim_can_bits sim_can_frame_bits(const struct hal_can_frame *frame)
{
    struct sim_can_wire wire = { .last = 2 };
    unsigned crc;

    if (frame->fd)
        return sim_can_bits_fd(frame);
    sim_can_wire_put_head(&wire, frame);
    sim_can_wire_put(&wire, frame->len, 4);
    sim_can_wire_put_data(&wire, frame);
    crc = wire.crc;
    sim_can_wire_put(&wire, crc, 15);
    return (struct sim_can_bits){ wire.bits + SIM_CAN_UNSTUFFED_BITS, 0 };
}
