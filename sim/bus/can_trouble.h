/* sim/bus/can_trouble.h - stands between a device and its port on a simulated
 * CAN bus, and spoils what goes through it in one direction, what the device
 * sends or what it is sent: some frames never come, or twice, all come late, some
 * more than others, some have other data.
 *
 * The frames that reach the wire are sound: noise on it is the bus's own
 * (can.h). */
#ifndef SIM_BUS_CAN_TROUBLE_H
#define SIM_BUS_CAN_TROUBLE_H

#include <stdbool.h>
#include <stdint.h>

#include "sim/bus/can.h"
#include "sim/bus/impairment.h"

/* Late frames under way; one more is lost. */
#define SIM_CAN_TROUBLE_HELD 64

struct sim_can_trouble {
    struct sim_member member;
    struct sim_can_port *port;
    bool incoming; /* what the device is sent */
    bool drops;    /* data frames with drop_id */
    uint32_t drop_id;
    struct sim_impairment impairment;
    unsigned spoil; /* so many more frames with data get other data */
    uint64_t seed;  /* != 0: which, which bits */
    uint64_t dropped, spoilt, doubled;

    /* Private from here on. */
    struct hal_can_frame held[SIM_CAN_TROUBLE_HELD];
    int64_t held_ns[SIM_CAN_TROUBLE_HELD];
    unsigned head, count;
};

/* Clears it, puts it in front of the port and adds it to the bus's world; it
 * does nothing before a field above says so.  MOTION_OK. */
int sim_can_trouble_init(struct sim_can_trouble *self,
                         struct sim_can_port *port, bool incoming,
                         uint64_t seed);

/* For the port: the frame that is to go on now, spoilt perhaps.  False: it does
 * not. */
bool sim_can_trouble_pass(struct sim_can_trouble *self,
                          struct hal_can_frame *frame);

#endif
