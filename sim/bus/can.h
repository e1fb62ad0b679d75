/* sim/bus/can.h - a simulated CAN bus with bit time and arbitration.
 *
 * Every port has a transmit queue (first in, first out, as a controller with
 * one mailbox).  A frame put on an idle wire starts at once; whoever else has
 * a frame within that first bit time takes part in the arbitration, as on a
 * real wire.  Afterwards the next frames start 3 bits (intermission) after the
 * last.  The frame with the lowest identifier among the queue heads wins (base
 * format beats extended with the same base, data beats remote), takes its
 * length in bits, stuff bits counted from the frame's own bits and CRC, and
 * arrives at every other port at the end of its end-of-frame field.
 *
 * CAN FD: the bus carries FD frames when it is given a data bit rate; every
 * port on it then understands them.
 *
 * Errors: a frame that no other port acknowledges is destroyed after the ACK
 * slot and tried again for ever; its sender becomes error-passive and stays so
 * (the counter stops at 128 for ACK errors).  Frames can be destroyed on
 * purpose, up to bus-off, and at random: noise.
 *
 * Frames that a port has sent go out by themselves: flush does nothing.
 *
 * Source: ISO 11898-1 10.4 to 10.8 (frame format, stuffing, arbitration), 12
 * (fault confinement). */
#ifndef SIM_BUS_CAN_H
#define SIM_BUS_CAN_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/can.h"
#include "sim/world.h"

#define SIM_CAN_QUEUE 64

#define SIM_CAN_BIT_RATE_MIN 10000
#define SIM_CAN_BIT_RATE_MAX 1000000

/* An instant on the wire: ns and a part of one, in units of 1 / bit_rate, so
 * that no rounding adds up at rates whose bit time is not whole. */
struct sim_can_instant {
    int64_t ns;
    uint64_t part; /* < bit_rate */
};

struct sim_can_queue {
    unsigned head, count;
    struct hal_can_frame frame[SIM_CAN_QUEUE];
};

struct sim_can_trouble;

struct sim_can_port {
    struct hal_can can;
    struct sim_can_bus *bus;
    struct sim_can_port *next;     /* on the bus, in the order of adding */
    unsigned tx_errors, rx_errors; /* TEC and REC */
    bool off;                      /* off the bus: sim_can_port_set_off */
    unsigned destroy; /* so many of its next frames meet an error frame */
    struct hal_can_stats stats;
    /* what spoils the frames that it sends, and those that it gets; NULL:
     * nothing */
    struct sim_can_trouble *trouble, *trouble_in;
    /* Called at the end of a frame for this port, instead of queueing, when not
     * NULL: devices react at once, as hardware does.  May send. */
    void (*on_frame)(void *context, const struct hal_can_frame *frame);
    void *context;
    struct sim_can_queue tx, rx; /* last: what is looked at is close together */
};

enum sim_can_phase {
    SIM_CAN_IDLE,
    SIM_CAN_STARTING, /* in the first bit: who wins is not yet decided */
    SIM_CAN_SENDING,
};

struct sim_can_bus {
    struct sim_member member;
    struct sim_group group; /* the devices on it join it */
    struct sim_world *world;
    uint32_t bit_rate;  /* bit/s */
    unsigned fd_factor; /* data rate of FD frames over bit_rate; 0: no FD */
    struct sim_can_port *first, *last;
    enum sim_can_phase phase;
    int64_t due_ns;
    struct sim_can_instant start, end; /* of the frame on the wire */
    struct sim_can_instant clear;      /* nothing may start before */
    struct sim_can_port *sender;
    bool destroyed, unacknowledged; /* what will become of the frame */
    /* Time the wire was in use, intermission and destroyed frames included;
     * counted at the end of each frame. */
    uint64_t busy_ns, busy_part;
    uint64_t frames, frames_destroyed;
    /* Of all frames so many in 2^32 are destroyed, 0 .. 2^32; drawn from
     * noise_seed, which is not 0 then. */
    uint64_t noise_q32, noise_seed;
    uint64_t collisions; /* two heads with one identifier: the first wins */
};

/* MOTION_E_ARG: bit rate outside SIM_CAN_BIT_RATE_MIN .. _MAX. */
int sim_can_bus_init(struct sim_can_bus *bus, struct sim_world *world,
                     uint32_t bit_rate);
/* From now on FD frames too, their data at `factor` times the bit rate.
 * MOTION_E_ARG: not 1, 2, 4, 5 or 8. */
int sim_can_bus_set_fd(struct sim_can_bus *bus, unsigned factor);
/* A port for a master or a device. */
void sim_can_port_init(struct sim_can_port *port, struct sim_can_bus *bus);

/* Pull the plug (sends fail with MOTION_E_IO, state is HAL_CAN_DOWN, queued
 * frames are gone, nothing is acknowledged) or put it in again. */
void sim_can_port_set_off(struct sim_can_port *port, bool off);
/* After bus-off: counters zero, queues empty, back on the wire. */
void sim_can_port_restart(struct sim_can_port *port);
/* As hal_can_send, and as a frame comes in, past what spoils the port's frames.
 */
int sim_can_port_put(struct sim_can_port *port,
                     const struct hal_can_frame *frame);
void sim_can_port_hand(struct sim_can_port *port,
                       const struct hal_can_frame *frame);

#endif
