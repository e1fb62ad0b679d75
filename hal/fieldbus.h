/* hal/fieldbus.h - one cycle of one bus.
 *
 * The loop calls, per tick:  begin (take in what came, SYNC)  ->  controller
 * ->  end (send the set points).  Implementations: hal/canopen/canopen.c, hal/can/bus.c,
 * hal/modbus/bus.c. */
#ifndef HAL_FIELDBUS_H
#define HAL_FIELDBUS_H

#include <stdint.h>

#include "motion/core/err.h"

MOTION_C_BEGIN

/* How a bus is; the greater the worse. */
enum hal_fieldbus_health {
    HAL_FIELDBUS_GOOD,
    HAL_FIELDBUS_PASSIVE, /* error-passive: still on the bus, but hardly */
    HAL_FIELDBUS_FULL,    /* refused to send three cycles in a row */
    HAL_FIELDBUS_FOREIGN, /* another master speaks on it */
    HAL_FIELDBUS_BUS_OFF,
    HAL_FIELDBUS_DOWN, /* interface not up, or not there any more */
};
/* "error-passive" ...; never NULL. */
const char *hal_fieldbus_health_text(enum hal_fieldbus_health health);

/* The worst of several buses, and which one it is, counted from 0 by whoever
 * has them. */
struct hal_fieldbus_worst {
    enum hal_fieldbus_health health;
    unsigned bus;
};

struct hal_fieldbus;

/* They did all they could.  What end could not send, the next begin tells. */
struct hal_fieldbus_ops {
    enum hal_fieldbus_health (*begin)(struct hal_fieldbus *bus, int64_t now_ns);
    void (*end)(struct hal_fieldbus *bus, int64_t now_ns);
};

struct hal_fieldbus {
    const struct hal_fieldbus_ops *ops;
};

static inline enum hal_fieldbus_health
hal_fieldbus_begin(struct hal_fieldbus *bus, int64_t now_ns)
{
    return bus->ops->begin(bus, now_ns);
}

static inline void hal_fieldbus_end(struct hal_fieldbus *bus, int64_t now_ns)
{
    bus->ops->end(bus, now_ns);
}

MOTION_C_END

#endif
