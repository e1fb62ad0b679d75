/* hal/can/bus.c - see bus.h. */
#include "hal/can/bus.h"

#include <string.h>

#include "hal/support/container_of.h"

int can_bus_send(struct can_bus_node *node, const struct hal_can_frame *frame)
{
    struct can_bus *bus = node->bus;
    const int err = can_cycle_send(&bus->cycle, frame);

    if (err == MOTION_OK)
        bus->stats.sent++;
    return err;
}

static void can_bus_receive(struct can_bus *bus,
                            const struct hal_can_frame *frame, int64_t now_ns)
{
    for (struct can_bus_node *node = bus->first; node; node = node->next) {
        switch (node->ops->receive(node, frame, now_ns)) {
        case CAN_BUS_TAKEN:
            bus->stats.received++;
            return;
        case CAN_BUS_MALFORMED:
            bus->stats.malformed++;
            return;
        case CAN_BUS_FOREIGN:
            bus->stats.foreign++;
            can_cycle_foreign(&bus->cycle, frame);
            return;
        case CAN_BUS_NOT_MINE:
            break;
        }
    }
    bus->stats.unexpected++;
}

static enum hal_fieldbus_health can_bus_begin(struct hal_fieldbus *fieldbus,
                                              int64_t now_ns)
{
    struct can_bus *bus = CONTAINER_OF(fieldbus, struct can_bus, fieldbus);
    struct hal_can_frame frame;

    can_cycle_begin(&bus->cycle);
    while (can_cycle_recv(&bus->cycle, &frame))
        can_bus_receive(bus, &frame, now_ns);
    for (struct can_bus_node *node = bus->first; node; node = node->next)
        node->ops->step(node, now_ns);
    (void)can_cycle_flush(&bus->cycle);
    return can_cycle_health(&bus->cycle);
}

static void can_bus_end(struct hal_fieldbus *fieldbus, int64_t now_ns)
{
    struct can_bus *bus = CONTAINER_OF(fieldbus, struct can_bus, fieldbus);

    for (struct can_bus_node *node = bus->first; node; node = node->next)
        node->ops->emit(node, now_ns);
    (void)can_cycle_flush(&bus->cycle);
}

static const struct hal_fieldbus_ops can_bus_ops = {
    .begin = can_bus_begin,
    .end = can_bus_end,
};

void can_bus_init(struct can_bus *bus, struct hal_can *can)
{
    memset(bus, 0, sizeof *bus);
    bus->fieldbus.ops = &can_bus_ops;
    can_cycle_init(&bus->cycle, can);
}

void can_bus_add(struct can_bus *bus, struct can_bus_node *node)
{
    node->bus = bus;
    node->next = NULL;
    if (bus->last == NULL)
        bus->first = node;
    else
        bus->last->next = node;
    bus->last = node;
}
