/* hal/modbus/bus.h - the drives on one Modbus line, as a fieldbus.
 *
 * Every tick takes the replies in (begin) and fills the line's mailbox again
 * (end), asking one node after the other.  At most `depth` requests are under
 * way: enough that the line need not wait for a tick, not so many that set
 * points grow old in the mailbox.
 *
 * begin() says MOTION_E_IO while the line is down, and once for a connection
 * that broke and came back between two ticks, of which a reply tells. */
#ifndef HAL_MODBUS_BUS_H
#define HAL_MODBUS_BUS_H

#include <stdbool.h>

#include "hal/fieldbus.h"
#include "hal/modbus.h"

MOTION_C_BEGIN

struct modbus_node;

struct modbus_node_ops {
    /* Once per tick, after the replies. */
    void (*step)(struct modbus_node *node, int64_t now_ns);
    /* The next request; the unit is filled in.  *cookie comes back with the
     * reply.  false: nothing to ask now. */
    bool (*next_request)(struct modbus_node *node, int64_t now_ns,
                         struct hal_modbus_request *request, uint16_t *cookie);
    /* One that hal_modbus_is_missing has MOTION_E_TIMEOUT, and its exception. */
    void (*reply)(struct modbus_node *node, uint16_t cookie,
                  const struct hal_modbus_reply *reply);
    /* Port or connection broke, also when it is there again already. */
    void (*down)(struct modbus_node *node);
};

struct modbus_node {
    const struct modbus_node_ops *ops;
    uint8_t unit;
    struct modbus_node *next; /* on the line, in the order of adding */
};

struct modbus_bus {
    struct hal_fieldbus fieldbus;
    struct hal_modbus *line;
    unsigned depth;
    struct modbus_node *first, *last, *turn; /* turn: asked next */
    unsigned node_count;
    struct {
        struct modbus_node *node;
        uint16_t cookie;
    } flight[HAL_MODBUS_MAILBOX]; /* by tag */
    uint32_t sent, returned;      /* tags */
    bool broke;                   /* since the last tick */
};

/* depth 2 .. HAL_MODBUS_MAILBOX, else MOTION_E_ARG. */
int modbus_bus_init(struct modbus_bus *bus, struct hal_modbus *line,
                    unsigned depth);
/* The node is the caller's.  MOTION_E_ARG: the unit is taken or none. */
int modbus_bus_add(struct modbus_bus *bus, struct modbus_node *node);

MOTION_C_END

#endif
