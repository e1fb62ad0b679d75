/* sim/can_bits.c - how long a CAN frame is on the wire.  See sim_can.h. */
#include "sim/sim_can.h"

#define SIM_CAN_CRC_POLY 0x4599u /* ISO 11898-1 10.4.2.6 */

/* CRC delimiter, ACK slot, ACK delimiter, end of frame, intermission: these
 * are not stuffed. */
#define SIM_CAN_UNSTUFFED_BITS (1 + 1 + 1 + 7 + 3)

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

static void sim_can_wire_put_id(struct sim_can_wire *wire,
                                const struct hal_can_frame *frame)
{
    sim_can_wire_put(wire, 0, 1); /* start of frame */
    if (frame->extended) {
        sim_can_wire_put(wire, frame->id >> 18, 11);
        sim_can_wire_put(wire, 3, 2); /* SRR, IDE */
        sim_can_wire_put(wire, frame->id & 0x3FFFF, 18);
        sim_can_wire_put(wire, frame->remote, 1);
        sim_can_wire_put(wire, 0, 2); /* r1, r0 */
    } else {
        sim_can_wire_put(wire, frame->id, 11);
        sim_can_wire_put(wire, frame->remote, 1);
        sim_can_wire_put(wire, 0, 2); /* IDE, r0 */
    }
}

/* Start of frame to CRC, stuff bits included. */
static unsigned sim_can_stuffed_bits(const struct hal_can_frame *frame)
{
    struct sim_can_wire wire = { .last = 2 }; /* neither 0 nor 1 */
    unsigned crc;

    sim_can_wire_put_id(&wire, frame);
    sim_can_wire_put(&wire, frame->len, 4);
    for (unsigned i = 0; !frame->remote && i < frame->len; i++)
        sim_can_wire_put(&wire, frame->data[i], 8);
    crc = wire.crc;
    sim_can_wire_put(&wire, crc, 15);
    return wire.bits;
}

unsigned sim_can_frame_bits(const struct hal_can_frame *frame)
{
    return sim_can_stuffed_bits(frame) + SIM_CAN_UNSTUFFED_BITS;
}
