/* hal/can/bus.h - a CAN bus with drives that are not CANopen.
 *
 * One object per CAN port.  It owns the port and hands every frame to the first
 * of its nodes that understands it; what the frames mean is the drives' business
 * (those on hal/drive/turn/drive.h), of whatever kind and mixed.  Nobody sends
 * a SYNC: a drive takes a set point when it comes.
 *
 * Cycle: begin() drains the port and lets every node take a step (ask for
 * positions, switch on and off); end() lets every node send its set point.  A
 * frame the port refuses is not kept: the next cycle has a newer one.
 * Freestanding, no heap, no division. */
#ifndef HAL_CAN_BUS_H
#define HAL_CAN_BUS_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/can/cycle.h"
#include "hal/fieldbus.h"

MOTION_C_BEGIN

enum can_bus_take {
    CAN_BUS_NOT_MINE,
    CAN_BUS_TAKEN,
    CAN_BUS_MALFORMED, /* mine, but it cannot mean anything */
    CAN_BUS_FOREIGN,   /* only we may send this: there is another master */
};

struct can_bus_node;

/* All are needed. */
struct can_bus_node_ops {
    enum can_bus_take (*receive)(struct can_bus_node *node,
                                 const struct hal_can_frame *frame,
                                 int64_t now_ns);
    void (*step)(struct can_bus_node *node, int64_t now_ns); /* of begin() */
    void (*emit)(struct can_bus_node *node, int64_t now_ns); /* of end() */
};

struct can_bus;

struct can_bus_node {
    const struct can_bus_node_ops *ops;
    struct can_bus *bus;
    struct can_bus_node *next; /* on the bus, in the order of adding */
};

struct can_bus_stats {
    uint64_t sent, received; /* frames, of our nodes */
    uint64_t unexpected;     /* for nobody */
    uint64_t malformed, foreign;
};

struct can_bus {
    struct hal_fieldbus fieldbus;
    struct can_cycle cycle; /* of the port */
    struct can_bus_node *first, *last;
    struct can_bus_stats stats;
};

void can_bus_init(struct can_bus *bus, struct hal_can *can);
/* The node is the caller's, once on one bus. */
void can_bus_add(struct can_bus *bus, struct can_bus_node *node);
/* For nodes, from step and emit.  Errors of hal_can_send. */
int can_bus_send(struct can_bus_node *node, const struct hal_can_frame *frame);

MOTION_C_END

#endif
