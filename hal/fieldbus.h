/* hal/fieldbus.h - one cycle of one bus.
 *
 * The loop calls, per tick:  begin (take in what came, SYNC)  ->  controller
 * ->  end (send the set points).  Implementations: hal/canopen/canopen.c, hal/can/bus.c,
 * hal/modbus/bus.c. */
#ifndef HAL_FIELDBUS_H
#define HAL_FIELDBUS_H

#include <stdint.h>

#include "motion/core/err.h"

struct hal_fieldbus;

struct hal_fieldbus_ops {
    /* MOTION_OK, or the worst of: MOTION_E_IO when the bus itself is gone
     * (bus-off, interface down); MOTION_E_PROTOCOL when another master speaks
     * on it; MOTION_E_FULL when sends were refused three cycles in a row;
     * MOTION_E_LIMIT when the port is error-passive: still on the bus, but
     * hardly.  They did all they could. */
    int (*begin)(struct hal_fieldbus *bus, int64_t now_ns);
    int (*end)(struct hal_fieldbus *bus, int64_t now_ns);
};

struct hal_fieldbus {
    const struct hal_fieldbus_ops *ops;
};

static inline int hal_fieldbus_begin(struct hal_fieldbus *bus, int64_t now_ns)
{
    return bus->ops->begin(bus, now_ns);
}

static inline int hal_fieldbus_end(struct hal_fieldbus *bus, int64_t now_ns)
{
    return bus->ops->end(bus, now_ns);
}

#endif
