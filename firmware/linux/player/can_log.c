/* firmware/linux/player/can_log.c - see can_log.h. */
#include "firmware/linux/player/can_log.h"

#include <inttypes.h>
#include <string.h>
#include <time.h>

#include "hal/support/container_of.h"

#define NS_PER_S INT64_C(1000000000)

/* ---- the ring ---- */

static void can_log_put(struct can_log_port *port,
                        const struct hal_can_frame *frame)
{
    struct can_log *log = port->log;
    const uint64_t put = atomic_load_explicit(&log->put, memory_order_relaxed);
    struct can_log_row *row = &log->row[put % CAN_LOG_FRAMES];

    if (put - atomic_load_explicit(&log->taken, memory_order_acquire) ==
        CAN_LOG_FRAMES) {
        log->dropped++;
        return;
    }
    row->bus = port->bus;
    row->frame = *frame;
    if (frame->t_ns == 0)
        row->frame.t_ns = hal_clock_now_ns(log->clock);
    atomic_store_explicit(&log->put, put + 1, memory_order_release);
}

/* ---- the port in between ---- */

static struct can_log_port *can_log_port_of(struct hal_can *can)
{
    return CONTAINER_OF(can, struct can_log_port, can);
}

static int can_log_send(struct hal_can *can, const struct hal_can_frame *frame)
{
    struct can_log_port *port = can_log_port_of(can);
    struct hal_can_frame sent = *frame;
    const int err = hal_can_send(port->inner, frame);

    sent.t_ns = 0;
    if (err == MOTION_OK)
        can_log_put(port, &sent);
    return err;
}

static int can_log_flush(struct hal_can *can)
{
    return hal_can_flush(can_log_port_of(can)->inner);
}

static int can_log_recv(struct hal_can *can, struct hal_can_frame *frame)
{
    struct can_log_port *port = can_log_port_of(can);
    const int got = hal_can_recv(port->inner, frame);

    if (got == 1)
        can_log_put(port, frame);
    return got;
}

static int can_log_state(struct hal_can *can)
{
    return hal_can_state(can_log_port_of(can)->inner);
}

static void can_log_stats(struct hal_can *can, struct hal_can_stats *stats)
{
    hal_can_stats(can_log_port_of(can)->inner, stats);
}

static const struct hal_can_ops can_log_ops = {
    .send = can_log_send,
    .flush = can_log_flush,
    .recv = can_log_recv,
    .state = can_log_state,
    .stats = can_log_stats,
};

void can_log_free(struct can_log *log)
{
    memory_pool_free(&log->memory);
}

void can_log_init(struct can_log *log, FILE *file, const struct rig *rig,
                  bool realtime, struct machine_ports *ports)
{
    struct timespec wall;

    can_log_free(log);
    memset(log, 0, sizeof *log);
    log->port =
        memory_pool_new(&log->memory, rig->bus_count, sizeof *log->port);
    atomic_init(&log->put, 0);
    atomic_init(&log->taken, 0);
    rows_init(&log->rows, file);
    log->rig = rig;
    log->clock = ports->clock;
    clock_gettime(CLOCK_REALTIME, &wall); /* cannot fail for this clock */
    if (realtime)
        log->epoch_ns = wall.tv_sec * NS_PER_S + wall.tv_nsec -
                        hal_clock_now_ns(ports->clock);
    for (unsigned i = 0; i < rig->bus_count; i++) {
        if (ports->can[i] == NULL)
            continue;
        log->port[i] = (struct can_log_port){ .can.ops = &can_log_ops,
                                              .inner = ports->can[i],
                                              .log = log,
                                              .bus = (uint8_t)i };
        ports->can[i] = &log->port[i].can;
    }
}

uint64_t can_log_waiting(const struct can_log *log)
{
    const uint64_t taken =
        atomic_load_explicit(&log->taken, memory_order_acquire);

    return atomic_load_explicit(&log->put, memory_order_acquire) - taken;
}

/* ---- writing ---- */

/* What stands after the #. */
static int can_log_head(char *text, size_t size,
                        const struct hal_can_frame *frame)
{
    if (frame->remote && frame->len > 0)
        return snprintf(text, size, "#R%u", frame->len);
    if (frame->remote)
        return snprintf(text, size, "#R");
    if (frame->fd) /* flags: 1 is BRS */
        return snprintf(text, size, "##%u", (unsigned)frame->switched);
    return snprintf(text, size, "#");
}

void can_log_line(char line[CAN_LOG_LINE_MAX], int64_t t_ns, const char *bus,
                  const struct hal_can_frame *frame)
{
    int at = snprintf(line, CAN_LOG_LINE_MAX, "(%010" PRId64 ".%06" PRId64 ") ",
                      t_ns / NS_PER_S, t_ns % NS_PER_S / 1000);

    at += snprintf(line + at, CAN_LOG_LINE_MAX - (size_t)at,
                   frame->extended ? "%.31s %08" PRIX32 : "%.31s %03" PRIX32,
                   bus, frame->id);
    at += can_log_head(line + at, CAN_LOG_LINE_MAX - (size_t)at, frame);
    for (unsigned i = 0; !frame->remote && i < frame->len; i++)
        at += snprintf(line + at, CAN_LOG_LINE_MAX - (size_t)at, "%02X",
                       frame->data[i]);
    snprintf(line + at, CAN_LOG_LINE_MAX - (size_t)at, "\n");
}

void can_log_drain(struct can_log *log)
{
    const uint64_t put = atomic_load_explicit(&log->put, memory_order_acquire);
    uint64_t taken = atomic_load_explicit(&log->taken, memory_order_relaxed);
    char line[CAN_LOG_LINE_MAX];

    for (; taken < put; taken++) {
        const struct can_log_row *row = &log->row[taken % CAN_LOG_FRAMES];
        const struct rig_bus *bus = &log->rig->bus[row->bus];

        can_log_line(line, row->frame.t_ns + log->epoch_ns,
                     bus->interface[0] != '\0' ? bus->interface : bus->name,
                     &row->frame);
        rows_put(&log->rows, line, strlen(line), row->frame.t_ns);
        atomic_store_explicit(&log->taken, taken + 1, memory_order_release);
    }
}
