/* hal/linux/socketcan.c - see socketcan.h.
 *
 *   socketcan_setup.c  checks and sets up
 *   socketcan_frame.c  frames, error frames, time stamps
 *   here                   send, receive, down and up again */
#define _GNU_SOURCE /* sendmmsg, recvmmsg */
#include "hal/linux/socketcan_setup.h"

#include <errno.h>
#include <net/if.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include <linux/errqueue.h>

#include "hal/support/container_of.h"

#define NS_PER_S        INT64_C(1000000000)
#define RETRY_NS        INT64_C(100000000) /* to look for a lost interface */
#define FILL_TRIES      4 /* batches of nothing but error frames */
#define INTERRUPTED_MAX 8

static struct can_socketcan *socketcan_of(struct hal_can *can)
{
    return CONTAINER_OF(can, struct can_socketcan, can);
}

static int64_t socketcan_clock_ns(clockid_t clock)
{
    struct timespec now;

    clock_gettime(clock, &now); /* cannot fail for these clocks */
    return now.tv_sec * NS_PER_S + now.tv_nsec;
}

/* ---- down, gone, and back ---- */

static void socketcan_down(struct can_socketcan *self)
{
    self->state = HAL_CAN_DOWN;
    self->tx_count = 0;
}

static void socketcan_gone(struct can_socketcan *self)
{
    socketcan_down(self);
    can_socketcan_close(self);
    self->retry_ns = socketcan_clock_ns(CLOCK_MONOTONIC) + RETRY_NS;
}

/* What a failed call says about the interface. */
static void socketcan_judge(struct can_socketcan *self, int error)
{
    if (error == ENETDOWN)
        socketcan_down(self);
    else if (error == ENODEV || error == ENXIO)
        socketcan_gone(self);
}

/* What waits in the socket is from before: not read. */
static void socketcan_discard(struct can_socketcan *self)
{
    struct canfd_frame frame;

    for (unsigned i = 0; i < 1u << 16; i++)
        if (recv(self->socket_fd, &frame, sizeof frame, MSG_DONTWAIT) < 0 &&
            (errno == EAGAIN || errno == EWOULDBLOCK))
            break;
    self->rx_at = self->rx_count = 0;
}

static void socketcan_reopen(struct can_socketcan *self)
{
    const int64_t now_ns = socketcan_clock_ns(CLOCK_MONOTONIC);
    struct can_link link;

    if (now_ns < self->retry_ns)
        return;
    self->retry_ns = now_ns + RETRY_NS;
    if (can_link_read(self->interface, &link) == MOTION_OK && link.is_can)
        self->socket_fd = can_socketcan_socket(self, link.index);
}

static bool socketcan_is_running(const struct can_socketcan *self)
{
    struct ifreq request = { 0 };
    const int both = IFF_UP | IFF_RUNNING;

    memcpy(request.ifr_name, self->interface, sizeof self->interface);
    return ioctl(self->socket_fd, SIOCGIFFLAGS, &request) == 0 &&
           (request.ifr_flags & both) == both;
}

static void socketcan_try_up(struct can_socketcan *self)
{
    if (self->socket_fd < 0)
        socketcan_reopen(self);
    if (self->socket_fd < 0 || !socketcan_is_running(self))
        return;
    socketcan_discard(self);
    if (self->socket_fd >= 0)
        self->state = HAL_CAN_ACTIVE;
}

/* ---- sending ---- */

static bool socketcan_is_off(const struct can_socketcan *self)
{
    return self->state == HAL_CAN_BUS_OFF || self->state == HAL_CAN_DOWN;
}

static int socketcan_send(struct hal_can *can,
                          const struct hal_can_frame *frame)
{
    struct can_socketcan *self = socketcan_of(can);

    if (!hal_can_is_legal(frame, self->config.fd))
        return MOTION_E_ARG;
    if (socketcan_is_off(self))
        return MOTION_E_IO;
    if (self->tx_count == CAN_SOCKETCAN_BATCH) {
        self->stats.refused++;
        return MOTION_E_FULL;
    }
    self->tx_bytes[self->tx_count] =
        (uint8_t)can_frame_encode(frame, &self->tx[self->tx_count]);
    self->tx_count++;
    return MOTION_OK;
}

/* How many of the frames from `at` on the kernel takes now. */
static int socketcan_write(struct can_socketcan *self, unsigned at)
{
    struct mmsghdr message[CAN_SOCKETCAN_BATCH];
    struct iovec vector[CAN_SOCKETCAN_BATCH];
    const unsigned count = self->tx_count - at;

    memset(message, 0, count * sizeof message[0]);
    for (unsigned i = 0; i < count; i++) {
        vector[i] = (struct iovec){ &self->tx[at + i], self->tx_bytes[at + i] };
        message[i].msg_hdr.msg_iov = &vector[i];
        message[i].msg_hdr.msg_iovlen = 1;
    }
    return sendmmsg(self->socket_fd, message, count, MSG_DONTWAIT);
}

/* sendmmsg tells of an error only when it is the first frame's: go on until it
 * is, or all are gone. */
static int socketcan_write_all(struct can_socketcan *self, unsigned *sent)
{
    unsigned interrupted = 0;

    while (*sent < self->tx_count) {
        const int got = socketcan_write(self, *sent);

        if (got > 0)
            *sent += (unsigned)got;
        else if (got == 0 || errno != EINTR || ++interrupted > INTERRUPTED_MAX)
            return errno;
    }
    return 0;
}

static int socketcan_flush(struct hal_can *can)
{
    struct can_socketcan *self = socketcan_of(can);
    unsigned sent = 0;
    int error;

    if (self->tx_count == 0)
        return MOTION_OK;
    if (socketcan_is_off(self)) {
        self->tx_count = 0;
        return MOTION_E_IO;
    }
    error = socketcan_write_all(self, &sent);
    self->stats.sent += sent;
    if (error == 0) {
        self->tx_count = 0;
        return MOTION_OK;
    }
    self->stats.refused += self->tx_count - sent;
    self->tx_count = 0;
    socketcan_judge(self, error);
    return error == ENOBUFS || error == EAGAIN ? MOTION_E_FULL : MOTION_E_IO;
}

/* ---- receiving ---- */

struct socketcan_now {
    int64_t ns, real_ns;
};

static int64_t socketcan_ns(const struct timespec *time)
{
    return time->tv_sec * NS_PER_S + time->tv_nsec;
}

/* Time stamp, and the kernel's count of frames lost, from what came with a
 * frame. */
static int64_t socketcan_control(struct can_socketcan *self,
                                 struct msghdr *head,
                                 const struct socketcan_now *now)
{
    struct scm_timestamping stamps = { 0 };
    struct cmsghdr *at;
    uint32_t overflow;

    for (at = CMSG_FIRSTHDR(head); at != NULL; at = CMSG_NXTHDR(head, at)) {
        if (at->cmsg_level != SOL_SOCKET)
            continue;
        if (at->cmsg_type == SCM_TIMESTAMPING) {
            memcpy(&stamps, CMSG_DATA(at), sizeof stamps);
        } else if (at->cmsg_type == SO_RXQ_OVFL) {
            memcpy(&overflow, CMSG_DATA(at), sizeof overflow);
            self->stats.dropped += (uint32_t)(overflow - self->overflow);
            self->overflow = overflow;
        }
    }
    return can_stamp_monotonic(&self->stamp, socketcan_ns(&stamps.ts[0]),
                               socketcan_ns(&stamps.ts[2]), now->real_ns,
                               now->ns);
}

static void socketcan_take(struct can_socketcan *self,
                           const struct canfd_frame *in,
                           struct mmsghdr *message,
                           const struct socketcan_now *now)
{
    struct hal_can_frame *frame = &self->rx[self->rx_count];
    const int64_t t_ns = socketcan_control(self, &message->msg_hdr, now);

    if (can_frame_is_error(in)) {
        self->state = can_frame_error(in, self->state, &self->stats);
    } else if (can_frame_decode(in, message->msg_len, frame)) {
        frame->t_ns = t_ns;
        self->rx_count++;
        self->stats.received++;
    }
}

/* One batch; false: nothing more is there now. */
static bool socketcan_fetch(struct can_socketcan *self)
{
    struct mmsghdr message[CAN_SOCKETCAN_BATCH];
    struct iovec vector[CAN_SOCKETCAN_BATCH];
    struct canfd_frame frame[CAN_SOCKETCAN_BATCH];
    struct can_socketcan_control control[CAN_SOCKETCAN_BATCH];
    struct socketcan_now now;
    int got;

    memset(message, 0, sizeof message);
    memset(control, 0, sizeof control);
    for (unsigned i = 0; i < CAN_SOCKETCAN_BATCH; i++) {
        vector[i] = (struct iovec){ &frame[i], sizeof frame[i] };
        message[i].msg_hdr.msg_iov = &vector[i];
        message[i].msg_hdr.msg_iovlen = 1;
        message[i].msg_hdr.msg_control = control[i].bytes;
        message[i].msg_hdr.msg_controllen = sizeof control[i].bytes;
    }
    got = recvmmsg(self->socket_fd, message, CAN_SOCKETCAN_BATCH, MSG_DONTWAIT,
                   NULL);
    if (got <= 0) {
        socketcan_judge(self, got < 0 ? errno : 0);
        return false;
    }
    now.ns = socketcan_clock_ns(CLOCK_MONOTONIC);
    now.real_ns = socketcan_clock_ns(CLOCK_REALTIME);
    for (int i = 0; i < got; i++)
        socketcan_take(self, &frame[i], &message[i], &now);
    return true;
}

static void socketcan_fill(struct can_socketcan *self)
{
    self->rx_at = self->rx_count = 0;
    if (self->state == HAL_CAN_DOWN)
        socketcan_try_up(self);
    for (unsigned i = 0; i < FILL_TRIES && self->rx_count == 0; i++)
        if (self->socket_fd < 0 || !socketcan_fetch(self))
            return;
}

static int socketcan_recv(struct hal_can *can, struct hal_can_frame *frame)
{
    struct can_socketcan *self = socketcan_of(can);

    if (self->rx_at == self->rx_count)
        socketcan_fill(self);
    if (self->rx_at < self->rx_count) {
        *frame = self->rx[self->rx_at++];
        return 1;
    }
    return socketcan_is_off(self) ? MOTION_E_IO : 0;
}

static int socketcan_state(struct hal_can *can)
{
    return (int)socketcan_of(can)->state;
}

static void socketcan_stats(struct hal_can *can, struct hal_can_stats *stats)
{
    *stats = socketcan_of(can)->stats;
}

const struct hal_can_ops can_socketcan_ops = {
    .send = socketcan_send,
    .flush = socketcan_flush,
    .recv = socketcan_recv,
    .state = socketcan_state,
    .stats = socketcan_stats,
};
