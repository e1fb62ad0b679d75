/* hal/linux/socketcan_setup.c - opening a port: is the interface what was asked
 * for, and a socket with the right options.  See socketcan.h. */
#define _GNU_SOURCE /* SO_RCVBUFFORCE and its kin */
#include "hal/linux/socketcan_setup.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/net_tstamp.h>

#define QUEUE_DEFAULT 64
#define QUEUE_MIN     16
#define QUEUE_MAX     1024
/* What a queued frame is charged with: the kernel's buffer of 512 bytes and its
 * head of 256.  The kernel doubles what is asked for. */
#define QUEUE_BYTES   (768 / 2)
#define RECEIVE_BYTES (1 << 20)

static int setup_fail(char message[CAN_SOCKETCAN_MESSAGE_MAX], int err,
                      const char *format, ...)
    __attribute__((format(printf, 3, 4)));
static int setup_fail(char message[CAN_SOCKETCAN_MESSAGE_MAX], int err,
                      const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    vsnprintf(message, CAN_SOCKETCAN_MESSAGE_MAX, format, arguments);
    va_end(arguments);
    return err;
}

/* ---- the interface ---- */

/* Not up, or at another rate: the sentence is the remedy. */
static int setup_check_hardware(const struct can_socketcan_config *config,
                                const struct can_link *link,
                                char message[CAN_SOCKETCAN_MESSAGE_MAX])
{
    const char *name = config->interface;
    const bool hardware = strcmp(link->kind, "can") == 0;
    const unsigned rate = config->bit_rate != 0 ? config->bit_rate : 1000000;

    if (!link->up && hardware)
        return setup_fail(message, MOTION_E_IO,
                          "interface %s is down; bring it up with: ip link set "
                          "%s up txqueuelen 128 type can bitrate %u restart-ms "
                          "0",
                          name, name, rate);
    if (!link->up)
        return setup_fail(message, MOTION_E_IO,
                          "interface %s is down; bring it up with: ip link set "
                          "%s up",
                          name, name);
    if (config->bit_rate != 0 && link->bit_rate != 0 &&
        link->bit_rate != config->bit_rate)
        return setup_fail(message, MOTION_E_ARG,
                          "interface %s runs at %u bit/s, expected %u; change "
                          "it with: ip link set %s down; ip link set %s up "
                          "type can bitrate %u",
                          name, link->bit_rate, config->bit_rate, name, name,
                          config->bit_rate);
    if (hardware && link->restart_ms != 0)
        return setup_fail(message, MOTION_E_ARG,
                          "interface %s would come back from bus-off by itself "
                          "(restart-ms %u); switch that off with: ip link set "
                          "%s down; ip link set %s up type can restart-ms 0",
                          name, link->restart_ms, name, name);
    return MOTION_OK;
}

static int setup_check(const struct can_socketcan_config *config,
                       struct can_link *link,
                       char message[CAN_SOCKETCAN_MESSAGE_MAX])
{
    const char *name = config->interface;
    int err = can_link_read(name, link);

    if (err == MOTION_E_EMPTY || err == MOTION_E_ARG)
        return setup_fail(message, err, "there is no interface %s", name);
    if (err < 0)
        return setup_fail(
            message, err,
            "the kernel does not report the state of interface %s", name);
    if (!link->is_can)
        return setup_fail(message, MOTION_E_ARG,
                          "interface %s is not a CAN interface", name);
    err = setup_check_hardware(config, link, message);
    if (err < 0)
        return err;
    if (config->fd && !link->fd)
        return setup_fail(message, MOTION_E_ARG,
                          "interface %s takes no FD frames; switch them on "
                          "with: ip link set %s down; ip link set %s up mtu 72 "
                          "type can dbitrate RATE fd on",
                          name, name, name);
    if (link->state == HAL_CAN_BUS_OFF)
        return setup_fail(message, MOTION_E_IO,
                          "interface %s is in bus-off; when the wiring is good "
                          "again: ip link set %s type can restart",
                          name, name);
    if (link->tx_queue < config->queue_frames)
        return setup_fail(message, MOTION_E_ARG,
                          "interface %s queues only %u frames, expected %u at "
                          "least; set it with: ip link set %s txqueuelen 128",
                          name, link->tx_queue, config->queue_frames, name);
    return MOTION_OK;
}

/* ---- the socket ---- */

static int setup_option(int socket_fd, int level, int option, const void *value,
                        socklen_t size)
{
    return setsockopt(socket_fd, level, option, value, size);
}

static int setup_filters(int socket_fd, const struct can_socketcan *self)
{
    struct can_filter filter[CAN_SOCKETCAN_FILTERS];

    if (self->config.filter_count == 0)
        return 0; /* the kernel's own: everything */
    for (unsigned i = 0; i < self->config.filter_count; i++) {
        const struct can_socketcan_filter *from = &self->filter[i];

        filter[i].can_id = from->id | (from->extended ? CAN_EFF_FLAG : 0);
        filter[i].can_mask = from->mask | CAN_EFF_FLAG;
    }
    return setup_option(
        socket_fd, SOL_CAN_RAW, CAN_RAW_FILTER, filter,
        (socklen_t)(self->config.filter_count * sizeof filter[0]));
}

/* Time stamps, counts of lost frames and large buffers are wished for, not
 * needed. */
static void setup_wishes(int socket_fd, const struct can_socketcan *self)
{
    const int on = 1, receive = RECEIVE_BYTES;
    const int send = (int)self->config.queue_frames * QUEUE_BYTES;
    const int stamps =
        SOF_TIMESTAMPING_RX_SOFTWARE | SOF_TIMESTAMPING_SOFTWARE |
        SOF_TIMESTAMPING_RX_HARDWARE | SOF_TIMESTAMPING_RAW_HARDWARE;

    (void)setup_option(socket_fd, SOL_SOCKET, SO_TIMESTAMPING, &stamps,
                       sizeof stamps);
    (void)setup_option(socket_fd, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on);
    if (setup_option(socket_fd, SOL_SOCKET, SO_RCVBUFFORCE, &receive,
                     sizeof receive) < 0)
        (void)setup_option(socket_fd, SOL_SOCKET, SO_RCVBUF, &receive,
                           sizeof receive);
    (void)setup_option(socket_fd, SOL_SOCKET, SO_SNDBUF, &send, sizeof send);
}

/* Bus errors are left out: a broken wire makes thousands a second. */
static int setup_needs(int socket_fd, const struct can_socketcan *self)
{
    const can_err_mask_t errors = CAN_ERR_TX_TIMEOUT | CAN_ERR_CRTL |
                                  CAN_ERR_TRX | CAN_ERR_BUSOFF |
                                  CAN_ERR_RESTARTED;
    const int fd_frames = self->config.fd;

    if (setup_option(socket_fd, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors,
                     sizeof errors) < 0 ||
        setup_option(socket_fd, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &fd_frames,
                     sizeof fd_frames) < 0)
        return -1;
    return setup_filters(socket_fd, self);
}

int can_socketcan_socket(const struct can_socketcan *self, unsigned index)
{
    const struct sockaddr_can address = { .can_family = AF_CAN,
                                          .can_ifindex = (int)index };
    const int socket_fd =
        socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);

    if (socket_fd < 0)
        return -1;
    setup_wishes(socket_fd, self);
    if (setup_needs(socket_fd, self) < 0 ||
        bind(socket_fd, (const struct sockaddr *)&address, sizeof address) <
            0) {
        const int error = errno;

        close(socket_fd);
        errno = error;
        return -1;
    }
    return socket_fd;
}

/* ---- open and close ---- */

static int setup_take_config(struct can_socketcan *self,
                             const struct can_socketcan_config *config,
                             char message[CAN_SOCKETCAN_MESSAGE_MAX])
{
    *self = (struct can_socketcan){ .can.ops = &can_socketcan_ops,
                                    .config = *config,
                                    .socket_fd = -1 };
    if (self->config.queue_frames == 0)
        self->config.queue_frames = QUEUE_DEFAULT;
    if (config->filter_count > CAN_SOCKETCAN_FILTERS ||
        self->config.queue_frames < QUEUE_MIN ||
        self->config.queue_frames > QUEUE_MAX)
        return setup_fail(message, MOTION_E_ARG,
                          "%u filters and a queue of %u frames, expected at "
                          "most %d and %d to %d",
                          config->filter_count, self->config.queue_frames,
                          CAN_SOCKETCAN_FILTERS, QUEUE_MIN, QUEUE_MAX);
    for (unsigned i = 0; i < config->filter_count; i++)
        self->filter[i] = config->filter[i];
    return MOTION_OK;
}

int can_socketcan_open(struct can_socketcan *self,
                       const struct can_socketcan_config *config,
                       char message[CAN_SOCKETCAN_MESSAGE_MAX])
{
    struct can_link link = { 0 };
    int err = setup_take_config(self, config, message);

    if (err == MOTION_OK)
        err = setup_check(&self->config, &link, message);
    if (err < 0)
        return err;
    memcpy(self->interface, config->interface, strlen(config->interface) + 1);
    self->config.interface = NULL; /* kept in `interface` */
    self->config.filter = NULL;
    self->socket_fd = can_socketcan_socket(self, link.index);
    if (self->socket_fd < 0)
        return setup_fail(message, MOTION_E_IO, "interface %s: %s",
                          config->interface, strerror(errno));
    self->state = link.state;
    return MOTION_OK;
}

void can_socketcan_close(struct can_socketcan *self)
{
    if (self->socket_fd >= 0)
        close(self->socket_fd);
    self->socket_fd = -1;
}

int can_socketcan_fd(const struct can_socketcan *self)
{
    return self->socket_fd;
}
