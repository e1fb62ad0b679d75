/* hal/linux/socketcan.h - a CAN port on a Linux interface: can0, vcan0, slcan0.
 *
 * One raw socket, never blocking.  What is sent is gathered and goes to the
 * kernel in one sendmmsg at flush; what came is fetched by the batch in one
 * recvmmsg.  A frame that the kernel does not take at flush (ENOBUFS, EAGAIN)
 * is thrown away and counted: the next cycle has a newer one.  The kernel's own
 * queue is kept short (queue_frames) for the same reason: what waits there when
 * the bus breaks goes out, old, when it comes back.
 *
 * Error frames are asked for and change the state; they are not handed on.  In
 * bus-off the kernel takes frames and throws them away, so only the state
 * tells.  Interface down: state HAL_CAN_DOWN, and ACTIVE again once it is up,
 * with nothing left of what was received before.  Interface gone (USB
 * unplugged): the same, a new socket is made when one of that name is back.
 *
 * Time stamps are the kernel's (the card's where it has a clock), turned into
 * CLOCK_MONOTONIC.  The interface has to be configured before; the sentence of
 * an open that fails names the command.  No rights are needed.
 *
 * Source: Linux Documentation/networking/can.rst. */
#ifndef HAL_LINUX_SOCKETCAN_H
#define HAL_LINUX_SOCKETCAN_H

#include <sys/socket.h>

#include "hal/linux/socketcan_frame.h"
#include "hal/linux/socketcan_link.h"

#define CAN_SOCKETCAN_BATCH       64 /* frames per system call */
#define CAN_SOCKETCAN_FILTERS     32
#define CAN_SOCKETCAN_MESSAGE_MAX 256

/* Frames whose id equals `id` in the bits of `mask` are received. */
struct can_socketcan_filter {
    uint32_t id, mask;
    bool extended;
};

struct can_socketcan_config {
    const char *interface;
    uint32_t bit_rate;     /* that it must have; 0: any.  vcan has none */
    bool fd;               /* FD frames too; the interface must take them */
    unsigned queue_frames; /* that may wait in the kernel, 16..1024; 0: 64 */
    /* NULL: everything is received */
    const struct can_socketcan_filter *filter;
    unsigned filter_count; /* at most CAN_SOCKETCAN_FILTERS */
};

/* Control messages of one frame: SCM_TIMESTAMPING and SO_RXQ_OVFL. */
struct can_socketcan_control {
    char bytes[CMSG_SPACE(6 * sizeof(int64_t)) + CMSG_SPACE(sizeof(uint32_t))];
};

/* Visible so that it can be static; use the functions. */
struct can_socketcan {
    struct hal_can can;
    struct can_socketcan_config config; /* pointers are not kept */
    struct can_socketcan_filter filter[CAN_SOCKETCAN_FILTERS];
    char interface[CAN_LINK_NAME_MAX];
    int socket_fd; /* -1: the interface is not there */
    enum hal_can_state state;
    struct hal_can_stats stats;
    uint32_t overflow; /* frames the kernel has lost, as last told */
    struct can_stamp stamp;
    int64_t retry_ns; /* when to look for the interface again */

    struct canfd_frame tx[CAN_SOCKETCAN_BATCH];
    uint8_t tx_bytes[CAN_SOCKETCAN_BATCH];
    unsigned tx_count;
    struct hal_can_frame rx[CAN_SOCKETCAN_BATCH];
    unsigned rx_at, rx_count;
};

/* MOTION_OK; else the code, and a sentence that says what to do.  Then the port
 * is &self->can until close. */
int can_socketcan_open(struct can_socketcan *self,
                       const struct can_socketcan_config *config,
                       char message[CAN_SOCKETCAN_MESSAGE_MAX]);
void can_socketcan_close(struct can_socketcan *self);
/* For poll(): readable when frames are there.  -1: no interface now. */
int can_socketcan_fd(const struct can_socketcan *self);

#endif
