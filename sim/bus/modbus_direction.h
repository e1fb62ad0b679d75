/* sim/bus/modbus_direction.h - what goes wrong with frames of Modbus in one direction, a
 * device's answers or the requests to it: spoilt, late, lost, twice.
 *
 * A lost segment of TCP is sent again, and what follows on its connection waits
 * for it. */
#ifndef SIM_BUS_MODBUS_DIRECTION_H
#define SIM_BUS_MODBUS_DIRECTION_H

#include <stdbool.h>
#include <stdint.h>

#include "sim/bus/impairment.h"

enum sim_modbus_fault {
    SIM_MODBUS_GOOD,
    SIM_MODBUS_LATE,      /* late_ns more */
    SIM_MODBUS_MUTE,      /* no frame */
    SIM_MODBUS_EXCEPTION, /* answers "device busy" whatever was asked */
    SIM_MODBUS_WRONG_CRC,
    SIM_MODBUS_OTHER_UNIT, /* a sound frame of somebody else */
    SIM_MODBUS_HALF,       /* stops in the middle */
    SIM_MODBUS_TWICE,      /* the frame twice without silence between */
    SIM_MODBUS_NOISE,      /* random bytes instead */
    SIM_MODBUS_FLIP, /* a burst of wrong bits, 16 at most: a CRC-16 sees all of
                        them, of longer ones all but 1 in 65536 */
    SIM_MODBUS_GATEWAY, /* a gateway says that it has no path, or no answer */
    SIM_MODBUS_STRAYS, /* up to 3 bytes in front of the frame, up to 5 behind */
    SIM_MODBUS_FAULTS, /* how many */
};

#define SIM_MODBUS_DIRECTION_FRAME 513 /* of RTU, ASCII or TCP */
#define SIM_MODBUS_DIRECTION_HELD  8   /* late frames; one more is lost */

struct sim_modbus_held {
    uint8_t frame[SIM_MODBUS_DIRECTION_FRAME];
    unsigned length;
    uint32_t tag; /* of its connection: late frames of one stay in order */
    int64_t due_ns;
};

struct sim_modbus_direction {
    enum sim_modbus_fault fault; /* from the next frame on */
    unsigned times;              /* so many frames; 0: all */
    uint64_t share_q32;          /* so many in 2^32; 0: all */
    int64_t late_ns;             /* SIM_MODBUS_LATE */
    struct sim_impairment impairment;
    bool resends; /* what is lost comes 200 ms later, lost again 600 ms .. */
    uint64_t spoilt, lost, doubled;

    /* Private from here on. */
    struct sim_modbus_held held[SIM_MODBUS_DIRECTION_HELD];
    unsigned count;
};

/* What happens to the next frame. */
enum sim_modbus_fault
sim_modbus_direction_draw(struct sim_modbus_direction *self, uint64_t *seed);
/* True: the frame, which `fault` has spoilt already, goes on now.  again_ns: its
 * second one is so much later than it. */
bool sim_modbus_direction_pass(struct sim_modbus_direction *self,
                               enum sim_modbus_fault fault, uint64_t *seed,
                               const struct sim_modbus_held *frame,
                               int64_t now_ns, int64_t again_ns);
/* When the next late frame goes on; INT64_MAX: there is none. */
int64_t sim_modbus_direction_due_ns(const struct sim_modbus_direction *self);
/* It, if it is due. */
bool sim_modbus_direction_take(struct sim_modbus_direction *self,
                               int64_t now_ns, struct sim_modbus_held *frame);
/* Their connection is gone: what is late never comes. */
void sim_modbus_direction_forget(struct sim_modbus_direction *self);

#endif
