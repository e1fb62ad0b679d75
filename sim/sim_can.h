/* sim/sim_can.h - a simulated CAN bus with bit time and arbitration.
 *
 * Every port has a transmit queue (first in, first out, as a controller with
 * one mailbox).  When the wire is free the frame with the lowest identifier
 * among the queue heads wins (base format beats extended with the same base,
 * data beats remote), takes its length in bits, stuff bits counted from the
 * frame's own bits and CRC, and arrives at every other port at its end.
 * Source: ISO 11898-1 10.4 to 10.8 (frame format, stuffing, arbitration). */
#ifndef SIM_SIM_CAN_H
#define SIM_SIM_CAN_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/can.h"
#include "sim/world.h"

#define SIM_CAN_PORTS_MAX 34
#define SIM_CAN_QUEUE     64

/* Bits of a frame on the wire, stuffing and the 3 bits of intermission
 * included. */
unsigned sim_can_frame_bits(const struct hal_can_frame *frame);

struct sim_can_port {
    struct hal_can can;
    struct sim_can_bus *bus;
    struct hal_can_frame tx[SIM_CAN_QUEUE], rx[SIM_CAN_QUEUE];
    unsigned tx_head, tx_count, rx_head, rx_count;
    enum hal_can_state state;
    struct hal_can_stats stats;
    /* Called at the end of a frame for this port, instead of queueing, when not
     * NULL: devices react at once, as hardware does. */
    void (*on_frame)(void *context, const struct hal_can_frame *frame);
    void *context;
};

struct sim_can_bus {
    struct sim_member member;
    struct sim_world *world;
    uint32_t bit_rate; /* bit/s */
    struct sim_can_port *port[SIM_CAN_PORTS_MAX];
    unsigned port_count;
    /* the frame on the wire */
    struct sim_can_port *sender;
    struct hal_can_frame frame;
    int64_t frame_end_ns;
    uint64_t busy_ns, frames;
    uint64_t busy_remainder; /* of bit-time division, so that nothing drifts */
};

int sim_can_bus_init(struct sim_can_bus *bus, struct sim_world *world,
                     uint32_t bit_rate);
/* A port for a master or a device. MOTION_E_FULL. */
int sim_can_port_init(struct sim_can_port *port, struct sim_can_bus *bus);

#endif
