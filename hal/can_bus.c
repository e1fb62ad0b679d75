/* hal/can_bus.c - see can_bus.h. */
#include "hal/can_bus.h"

#include <string.h>

#include "hal/container_of.h"

int can_bus_send(struct can_bus_node *node, const struct hal_can_frame *frame)
{
    struct can_bus *bus = node->bus;
    const int err = hal_can_send(bus->can, frame);

    if (err == MOTION_OK) {
        bus->stats.sent++;
    } else {
        bus->refused = true;
        bus->stats.send_refused++;
    }
    return err;
}

static void can_bus_flush(struct can_bus *bus)
{
    if (hal_can_flush(bus->can) == MOTION_OK)
        return;
    bus->refused = true;
    bus->stats.send_refused++;
}

static void can_bus_receive(struct can_bus *bus,
                            const struct hal_can_frame *frame, int64_t now_ns)
{
    for (unsigned i = 0; i < bus->node_count; i++) {
        switch (bus->node[i]->ops->receive(bus->node[i], frame, now_ns)) {
        case CAN_BUS_TAKEN:
            bus->stats.received++;
            return;
        case CAN_BUS_MALFORMED:
            bus->stats.malformed++;
            return;
        case CAN_BUS_FOREIGN:
            bus->stats.foreign++;
            bus->foreign = true;
            return;
        case CAN_BUS_NOT_MINE:
            break;
        }
    }
    bus->stats.unexpected++;
}

static void can_bus_drain(struct can_bus *bus, int64_t now_ns)
{
    struct hal_can_frame frame;

    for (unsigned i = 0; i < CAN_BUS_DRAIN_MAX; i++) {
        const int got = hal_can_recv(bus->can, &frame);

        bus->lost = bus->lost || got < 0;
        if (got <= 0)
            return;
        can_bus_receive(bus, &frame, now_ns);
    }
}

/* What begin() says of the bus, and the marks it is made from wiped. */
static int can_bus_verdict(struct can_bus *bus)
{
    const int state = hal_can_state(bus->can);
    const bool foreign = bus->foreign;
    const bool gone =
        bus->lost || state == HAL_CAN_BUS_OFF || state == HAL_CAN_DOWN;

    bus->lost = false;
    bus->foreign = false;
    if (gone)
        return MOTION_E_IO;
    if (foreign)
        return MOTION_E_PROTOCOL;
    if (bus->refused_cycles >= CAN_BUS_REFUSED_MAX)
        return MOTION_E_FULL;
    return state == HAL_CAN_PASSIVE ? MOTION_E_LIMIT : MOTION_OK;
}

static int can_bus_begin(struct hal_fieldbus *fieldbus, int64_t now_ns)
{
    struct can_bus *bus = CONTAINER_OF(fieldbus, struct can_bus, fieldbus);

    bus->refused_cycles = bus->refused ? bus->refused_cycles + 1 : 0;
    bus->refused = false;
    can_bus_drain(bus, now_ns);
    for (unsigned i = 0; i < bus->node_count; i++)
        bus->node[i]->ops->step(bus->node[i], now_ns);
    can_bus_flush(bus);
    return can_bus_verdict(bus);
}

static int can_bus_end(struct hal_fieldbus *fieldbus, int64_t now_ns)
{
    struct can_bus *bus = CONTAINER_OF(fieldbus, struct can_bus, fieldbus);
    const int state = hal_can_state(bus->can);

    for (unsigned i = 0; i < bus->node_count; i++)
        bus->node[i]->ops->emit(bus->node[i], now_ns);
    can_bus_flush(bus);
    return state == HAL_CAN_BUS_OFF || state == HAL_CAN_DOWN ? MOTION_E_IO
                                                             : MOTION_OK;
}

static const struct hal_fieldbus_ops can_bus_ops = {
    .begin = can_bus_begin,
    .end = can_bus_end,
};

void can_bus_init(struct can_bus *bus, struct hal_can *can)
{
    memset(bus, 0, sizeof *bus);
    bus->fieldbus.ops = &can_bus_ops;
    bus->can = can;
}

int can_bus_add(struct can_bus *bus, struct can_bus_node *node)
{
    if (bus->node_count >= CAN_BUS_NODES_MAX)
        return MOTION_E_FULL;
    node->bus = bus;
    bus->node[bus->node_count++] = node;
    return MOTION_OK;
}
