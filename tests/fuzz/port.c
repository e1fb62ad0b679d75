/* tests/fuzz/port.c - see fuzz_port.h. */
#include <string.h>

#include "hal/support/container_of.h"
#include "tests/fuzz/fuzz_port.h"

static int fuzz_port_send(struct hal_can *can,
                          const struct hal_can_frame *frame)
{
    fuzz_claim(
        hal_can_is_legal(frame, CONTAINER_OF(can, struct fuzz_port, can)->fd),
        "what is sent is a frame");
    return MOTION_OK;
}

static int fuzz_port_flush(struct hal_can *can)
{
    (void)can;
    return MOTION_OK;
}

/* With FD, every frame may have up to 64 bytes. */
static void fuzz_port_widen(struct fuzz_port *port, struct hal_can_frame *frame)
{
    static const uint8_t length[] = { 8, 12, 16, 20, 24, 32, 48, 64 };
    const uint8_t shape = fuzz_u8(&port->bytes);

    if ((shape & 8) == 0)
        return;
    frame->fd = true;
    frame->remote = false;
    frame->len = length[shape & 7];
    (void)fuzz_take(&port->bytes, frame->data, frame->len);
}

static int fuzz_port_recv(struct hal_can *can, struct hal_can_frame *frame)
{
    struct fuzz_port *port = CONTAINER_OF(can, struct fuzz_port, can);

    if (port->turn == 0 || port->bytes.left == 0)
        return 0;
    port->turn--;
    *frame = fuzz_frame(&port->bytes);
    if (port->fd)
        fuzz_port_widen(port, frame);
    return 1;
}

static int fuzz_port_state(struct hal_can *can)
{
    (void)can;
    return HAL_CAN_ACTIVE;
}

static void fuzz_port_stats(struct hal_can *can, struct hal_can_stats *stats)
{
    (void)can;
    memset(stats, 0, sizeof *stats);
}

static const struct hal_can_ops fuzz_port_ops = {
    .send = fuzz_port_send,
    .flush = fuzz_port_flush,
    .recv = fuzz_port_recv,
    .state = fuzz_port_state,
    .stats = fuzz_port_stats,
};

void fuzz_port_init(struct fuzz_port *port)
{
    memset(port, 0, sizeof *port);
    port->can.ops = &fuzz_port_ops;
}
