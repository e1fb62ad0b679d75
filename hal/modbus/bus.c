/* hal/modbus/bus.c - see bus.h. */
#include "hal/modbus/bus.h"

#include "hal/support/container_of.h"

static struct modbus_bus *modbus_bus_of(struct hal_fieldbus *fieldbus)
{
    return CONTAINER_OF(fieldbus, struct modbus_bus, fieldbus);
}

/* Nobody on a line tells what a gateway says from a drive that is silent. */
static void modbus_bus_take(struct modbus_bus *bus,
                            struct hal_modbus_reply *reply)
{
    const unsigned slot = reply->tag & (HAL_MODBUS_MAILBOX - 1);
    struct modbus_node *node = bus->flight[slot].node;

    bus->returned++;
    bus->broke = bus->broke || reply->err == MOTION_E_IO;
    if (hal_modbus_is_missing(reply))
        reply->err = MOTION_E_TIMEOUT;
    node->ops->reply(node, bus->flight[slot].cookie, reply);
}

static void modbus_bus_tell(struct modbus_bus *bus)
{
    for (struct modbus_node *node = bus->first; node; node = node->next)
        node->ops->down(node);
}

static enum hal_fieldbus_health modbus_bus_begin(struct hal_fieldbus *fieldbus,
                                                 int64_t now_ns)
{
    struct modbus_bus *bus = modbus_bus_of(fieldbus);
    struct hal_modbus_reply reply;

    bus->broke = hal_modbus_is_up(bus->line) == 0;
    for (unsigned i = 0;
         i < HAL_MODBUS_MAILBOX && hal_modbus_collect(bus->line, &reply) == 1;
         i++)
        modbus_bus_take(bus, &reply);
    if (bus->broke)
        modbus_bus_tell(bus);
    for (struct modbus_node *node = bus->first; node; node = node->next)
        node->ops->step(node, now_ns);
    return bus->broke ? HAL_FIELDBUS_DOWN : HAL_FIELDBUS_GOOD;
}

/* true: one more is under way. */
static bool modbus_bus_request(struct modbus_bus *bus, struct modbus_node *node,
                               int64_t now_ns)
{
    struct hal_modbus_request request = { .unit = node->unit };
    const unsigned slot = bus->sent & (HAL_MODBUS_MAILBOX - 1);
    uint16_t cookie = 0;

    if (!node->ops->next_request(node, now_ns, &request, &cookie) ||
        hal_modbus_submit(bus->line, &request, bus->sent) != MOTION_OK)
        return false;
    bus->flight[slot].node = node;
    bus->flight[slot].cookie = cookie;
    bus->sent++;
    return true;
}

static void modbus_bus_end(struct hal_fieldbus *fieldbus, int64_t now_ns)
{
    struct modbus_bus *bus = modbus_bus_of(fieldbus);
    unsigned idle = 0;

    while (idle < bus->node_count && bus->sent - bus->returned < bus->depth) {
        struct modbus_node *node = bus->turn;

        bus->turn = node->next != NULL ? node->next : bus->first;
        idle = modbus_bus_request(bus, node, now_ns) ? 0 : idle + 1;
    }
}

static const struct hal_fieldbus_ops modbus_bus_ops = {
    .begin = modbus_bus_begin,
    .end = modbus_bus_end,
};

int modbus_bus_init(struct modbus_bus *bus, struct hal_modbus *line,
                    unsigned depth)
{
    *bus = (struct modbus_bus){ .fieldbus.ops = &modbus_bus_ops,
                                .line = line,
                                .depth = depth };
    return depth >= 2 && depth <= HAL_MODBUS_MAILBOX ? MOTION_OK : MOTION_E_ARG;
}

int modbus_bus_add(struct modbus_bus *bus, struct modbus_node *node)
{
    if (node->unit == HAL_MODBUS_BROADCAST)
        return MOTION_E_ARG;
    for (const struct modbus_node *other = bus->first; other;
         other = other->next)
        if (other->unit == node->unit)
            return MOTION_E_ARG;
    node->next = NULL;
    if (bus->last == NULL)
        bus->first = bus->turn = node;
    else
        bus->last->next = node;
    bus->last = node;
    bus->node_count++;
    return MOTION_OK;
}
