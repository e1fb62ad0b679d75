/* sim/bus/can.c - see can.h. */
#include "sim/bus/can.h"

#include <string.h>

#include "hal/can/bits.h"
#include "sim/bus/can_trouble.h"
#include "sim/util.h"

/* CRC delimiter, ACK slot, ACK delimiter, end of frame: not stuffed. */
#define SIM_CAN_TAIL_BITS         10
#define SIM_CAN_INTERMISSION_BITS 3
/* From the ACK slot on, when the frame is destroyed: CRC delimiter and ACK
 * slot, error flag, error delimiter. */
#define SIM_CAN_ERROR_TAIL_BITS (2 + 6 + 8)
#define SIM_CAN_SUSPEND_BITS    8 /* an error-passive sender waits longer */

#define SIM_CAN_WARNING_AT 96
#define SIM_CAN_PASSIVE_AT 128
#define SIM_CAN_BUS_OFF_AT 256

/* The bits that take part in the arbitration, first on the wire = highest:
 * base id, RTR or SRR, IDE, rest of the id, RTR. */
static uint32_t sim_can_arbitration_key(const struct hal_can_frame *frame)
{
    if (frame->extended)
        return frame->id >> 18 << 21 | 3u << 19 | (frame->id & 0x3FFFF) << 1 |
               (uint32_t)frame->remote;
    return frame->id << 21 | (uint32_t)frame->remote << 20;
}

static void sim_can_queue_push(struct sim_can_queue *queue,
                               const struct hal_can_frame *frame)
{
    queue->frame[(queue->head + queue->count++) % SIM_CAN_QUEUE] = *frame;
}

static void sim_can_queue_pop(struct sim_can_queue *queue)
{
    queue->head = (queue->head + 1) % SIM_CAN_QUEUE;
    queue->count--;
}

static const struct hal_can_frame *
sim_can_queue_head(const struct sim_can_queue *queue)
{
    return &queue->frame[queue->head];
}

static enum hal_can_state sim_can_port_state(const struct sim_can_port *port)
{
    unsigned worst =
        port->tx_errors > port->rx_errors ? port->tx_errors : port->rx_errors;

    if (port->off)
        return HAL_CAN_DOWN;
    if (port->tx_errors >= SIM_CAN_BUS_OFF_AT)
        return HAL_CAN_BUS_OFF;
    if (worst >= SIM_CAN_PASSIVE_AT)
        return HAL_CAN_PASSIVE;
    return worst >= SIM_CAN_WARNING_AT ? HAL_CAN_WARNING : HAL_CAN_ACTIVE;
}

static bool sim_can_port_is_on(const struct sim_can_port *port)
{
    return !port->off && port->tx_errors < SIM_CAN_BUS_OFF_AT;
}

static void sim_can_port_count_state(struct sim_can_port *port,
                                     enum hal_can_state before)
{
    const enum hal_can_state state = sim_can_port_state(port);

    if (state <= before)
        return;
    port->stats.warnings += state == HAL_CAN_WARNING;
    port->stats.passives += state == HAL_CAN_PASSIVE;
    port->stats.bus_offs += state == HAL_CAN_BUS_OFF;
}

/* ---- the wire ---------------------------------------------------------- */

static struct sim_can_instant sim_can_after_bits(const struct sim_can_bus *bus,
                                                 struct sim_can_instant from,
                                                 struct can_bits bits)
{
    const unsigned factor = bus->fd_factor > 0 ? bus->fd_factor : 1;
    /* < 2^10 bits x 1e9 + 1e6 < 2^41; every factor divides 1e9 */
    uint64_t total = bits.slow * UINT64_C(1000000000) +
                     bits.fast * (UINT64_C(1000000000) / factor) + from.part;

    return (struct sim_can_instant){
        .ns = from.ns + (int64_t)(total / bus->bit_rate),
        .part = total % bus->bit_rate,
    };
}

/* There is a frame to send: start as soon as the wire is clear. */
static void sim_can_bus_wake(struct sim_can_bus *bus)
{
    if (bus->phase != SIM_CAN_IDLE)
        return;
    bus->start = bus->clear;
    if (bus->world->now_ns > bus->clear.ns)
        bus->start = (struct sim_can_instant){ .ns = bus->world->now_ns };
    bus->phase = SIM_CAN_STARTING;
    bus->due_ns =
        sim_can_after_bits(bus, bus->start, (struct can_bits){ 1, 0 }).ns;
}

static struct sim_can_port *sim_can_bus_winner(struct sim_can_bus *bus)
{
    struct sim_can_port *winner = NULL;
    uint32_t best = UINT32_MAX;

    for (struct sim_can_port *port = bus->first; port; port = port->next) {
        uint32_t key;

        if (port->tx.count == 0 || !sim_can_port_is_on(port))
            continue;
        key = sim_can_arbitration_key(sim_can_queue_head(&port->tx));
        if (winner && key == best)
            bus->collisions++;
        if (!winner || key < best) {
            winner = port;
            best = key;
        }
    }
    return winner;
}

static bool sim_can_bus_acknowledges(const struct sim_can_bus *bus,
                                     const struct sim_can_port *sender)
{
    for (const struct sim_can_port *port = bus->first; port; port = port->next)
        if (port != sender && sim_can_port_is_on(port))
            return true;
    return false;
}

static bool sim_can_bus_is_hit(struct sim_can_bus *bus)
{
    return bus->noise_q32 > 0 &&
           sim_random(&bus->noise_seed) >> 32 < bus->noise_q32;
}

static void sim_can_bus_arbitrate(struct sim_can_bus *bus)
{
    struct sim_can_port *sender = sim_can_bus_winner(bus);
    struct can_bits bits, gap = { SIM_CAN_INTERMISSION_BITS, 0 };

    if (!sender) { /* pulled off within the first bit */
        bus->phase = SIM_CAN_IDLE;
        bus->due_ns = SIM_WORLD_NEVER;
        return;
    }
    bus->sender = sender;
    bus->unacknowledged = !sim_can_bus_acknowledges(bus, sender);
    bus->destroyed =
        bus->unacknowledged || sender->destroy > 0 || sim_can_bus_is_hit(bus);
    bits = can_bits_of(sim_can_queue_head(&sender->tx));
    bits.slow -= SIM_CAN_INTERMISSION_BITS;
    if (bus->destroyed)
        bits.slow += SIM_CAN_ERROR_TAIL_BITS - SIM_CAN_TAIL_BITS;
    if (bus->destroyed && sim_can_port_state(sender) == HAL_CAN_PASSIVE)
        gap.slow += SIM_CAN_SUSPEND_BITS;
    bus->end = sim_can_after_bits(bus, bus->start, bits);
    bus->clear = sim_can_after_bits(bus, bus->end, gap);
    bus->phase = SIM_CAN_SENDING;
    bus->due_ns = bus->end.ns;
}

static void sim_can_bus_count_busy(struct sim_can_bus *bus)
{
    struct sim_can_instant from = bus->start, to = bus->clear;
    uint64_t part = bus->busy_part + bus->bit_rate + to.part - from.part;

    /* part counts bit_rate-ths of a ns, one whole ns too many */
    bus->busy_ns += (uint64_t)(to.ns - from.ns) + part / bus->bit_rate - 1;
    bus->busy_part = part % bus->bit_rate;
}

void sim_can_port_hand(struct sim_can_port *port,
                       const struct hal_can_frame *frame)
{
    if (!port->on_frame && port->rx.count == SIM_CAN_QUEUE) {
        port->stats.dropped++;
        return;
    }
    port->stats.received++;
    if (port->on_frame)
        port->on_frame(port->context, frame);
    else
        sim_can_queue_push(&port->rx, frame);
}

static void sim_can_port_take(struct sim_can_port *port,
                              const struct hal_can_frame *frame)
{
    struct hal_can_frame got;

    if (port->rx_errors > 0)
        port->rx_errors--;
    if (port->trouble_in == NULL) {
        sim_can_port_hand(port, frame);
        return;
    }
    got = *frame;
    if (sim_can_trouble_pass(port->trouble_in, &got))
        sim_can_port_hand(port, &got);
}

static void sim_can_bus_deliver(struct sim_can_bus *bus)
{
    struct sim_can_port *sender = bus->sender;
    struct hal_can_frame frame = *sim_can_queue_head(&sender->tx);

    frame.t_ns = bus->end.ns;
    sim_can_queue_pop(&sender->tx);
    sender->stats.sent++;
    if (sender->tx_errors > 0)
        sender->tx_errors--;
    bus->frames++;
    for (struct sim_can_port *port = bus->first; port; port = port->next)
        if (port != sender && sim_can_port_is_on(port))
            sim_can_port_take(port, &frame);
}

/* Fault confinement, ISO 11898-1 12.1.4: the sender counts 8, save that a
 * passive one does not count missing acknowledgement; receivers count 1. */
static void sim_can_bus_destroy(struct sim_can_bus *bus)
{
    struct sim_can_port *sender = bus->sender;
    const enum hal_can_state before = sim_can_port_state(sender);

    bus->frames_destroyed++;
    sender->stats.errors++;
    if (sender->destroy > 0)
        sender->destroy--;
    if (!bus->unacknowledged || sender->tx_errors < SIM_CAN_PASSIVE_AT)
        sender->tx_errors += 8;
    if (!sim_can_port_is_on(sender))
        sender->tx.count = 0;
    sim_can_port_count_state(sender, before);
    for (struct sim_can_port *port = bus->first; port; port = port->next)
        if (port != sender && sim_can_port_is_on(port) &&
            port->rx_errors < SIM_CAN_PASSIVE_AT) {
            const enum hal_can_state was = sim_can_port_state(port);
            port->rx_errors++;
            sim_can_port_count_state(port, was);
        }
}

static void sim_can_bus_finish(struct sim_can_bus *bus)
{
    sim_can_bus_count_busy(bus);
    bus->phase = SIM_CAN_IDLE;
    bus->due_ns = SIM_WORLD_NEVER;
    if (!bus->sender) /* plug pulled while sending */
        bus->frames_destroyed++;
    else if (bus->destroyed)
        sim_can_bus_destroy(bus);
    else
        sim_can_bus_deliver(bus);
    bus->sender = NULL;
    for (const struct sim_can_port *port = bus->first; port; port = port->next)
        if (port->tx.count > 0) {
            sim_can_bus_wake(bus);
            break;
        }
}

static int64_t sim_can_bus_due_ns(const struct sim_member *member)
{
    return CONTAINER_OF_CONST(member, struct sim_can_bus, member)->due_ns;
}

static void sim_can_bus_run(struct sim_member *member, int64_t now_ns)
{
    struct sim_can_bus *bus = CONTAINER_OF(member, struct sim_can_bus, member);

    (void)now_ns;
    if (bus->phase == SIM_CAN_STARTING)
        sim_can_bus_arbitrate(bus);
    else
        sim_can_bus_finish(bus);
}

static const struct sim_member_ops sim_can_bus_ops = {
    .due_ns = sim_can_bus_due_ns,
    .run = sim_can_bus_run,
};

int sim_can_bus_init(struct sim_can_bus *bus, struct sim_world *world,
                     uint32_t bit_rate)
{
    if (bit_rate < SIM_CAN_BIT_RATE_MIN || bit_rate > SIM_CAN_BIT_RATE_MAX)
        return MOTION_E_ARG;
    *bus = (struct sim_can_bus){ .member.ops = &sim_can_bus_ops,
                                 .world = world,
                                 .bit_rate = bit_rate,
                                 .due_ns = SIM_WORLD_NEVER,
                                 .clear.ns = world->now_ns };
    return sim_world_add_to(world, &bus->group, &bus->member);
}

int sim_can_bus_set_fd(struct sim_can_bus *bus, unsigned factor)
{
    if (factor != 1 && factor != 2 && factor != 4 && factor != 5 && factor != 8)
        return MOTION_E_ARG;
    bus->fd_factor = factor;
    return MOTION_OK;
}

/* ---- ports ------------------------------------------------------------- */

int sim_can_port_put(struct sim_can_port *port,
                     const struct hal_can_frame *frame)
{
    if (!sim_can_port_is_on(port))
        return MOTION_E_IO;
    if (port->tx.count == SIM_CAN_QUEUE) {
        port->stats.refused++;
        return MOTION_E_FULL;
    }
    sim_can_queue_push(&port->tx, frame);
    sim_can_bus_wake(port->bus);
    return MOTION_OK;
}

static int sim_can_send(struct hal_can *can, const struct hal_can_frame *frame)
{
    struct sim_can_port *port = CONTAINER_OF(can, struct sim_can_port, can);
    struct hal_can_frame sent;

    if (!hal_can_is_legal(frame, port->bus->fd_factor > 0))
        return MOTION_E_ARG;
    if (port->trouble == NULL)
        return sim_can_port_put(port, frame);
    sent = *frame;
    return sim_can_trouble_pass(port->trouble, &sent)
               ? sim_can_port_put(port, &sent)
               : MOTION_OK;
}

static int sim_can_flush(struct hal_can *can)
{
    (void)can;
    return MOTION_OK;
}

static int sim_can_recv(struct hal_can *can, struct hal_can_frame *frame)
{
    struct sim_can_port *port = CONTAINER_OF(can, struct sim_can_port, can);

    if (port->rx.count > 0) {
        *frame = *sim_can_queue_head(&port->rx);
        sim_can_queue_pop(&port->rx);
        return 1;
    }
    return sim_can_port_is_on(port) ? 0 : MOTION_E_IO;
}

static int sim_can_state(struct hal_can *can)
{
    return (int)sim_can_port_state(CONTAINER_OF(can, struct sim_can_port, can));
}

static void sim_can_stats(struct hal_can *can, struct hal_can_stats *stats)
{
    const struct sim_can_port *port =
        CONTAINER_OF(can, struct sim_can_port, can);

    *stats = port->stats;
    stats->busy_ns = port->bus->busy_ns;
    stats->tx_errors = (uint16_t)port->tx_errors;
    stats->rx_errors = (uint16_t)port->rx_errors;
}

static const struct hal_can_ops sim_can_ops = {
    .send = sim_can_send,
    .flush = sim_can_flush,
    .recv = sim_can_recv,
    .state = sim_can_state,
    .stats = sim_can_stats,
};

void sim_can_port_init(struct sim_can_port *port, struct sim_can_bus *bus)
{
    memset(port, 0, sizeof(*port));
    port->can.ops = &sim_can_ops;
    port->bus = bus;
    if (bus->last == NULL)
        bus->first = port;
    else
        bus->last->next = port;
    bus->last = port;
}

static void sim_can_port_flush(struct sim_can_port *port)
{
    port->tx.count = 0;
    port->rx.count = 0;
    if (port->bus->sender == port) /* the frame on the wire ends in an error */
        port->bus->sender = NULL;
}

void sim_can_port_set_off(struct sim_can_port *port, bool off)
{
    if (off && !port->off)
        sim_can_port_flush(port);
    port->off = off;
}

void sim_can_port_restart(struct sim_can_port *port)
{
    sim_can_port_flush(port);
    port->tx_errors = 0;
    port->rx_errors = 0;
    port->off = false;
}
