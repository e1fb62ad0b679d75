/* hal/linux/libmodbus_port.c - connection and transactions, on the line's own
 * thread; see libmodbus.h. */
#define _GNU_SOURCE /* TIOCEXCL, FIONREAD */
#include "hal/linux/libmodbus_port.h"

#include <errno.h>
#include <modbus.h>
#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "hal/linux/libmodbus_rs485.h"
#include "hal/modbus/tcp.h"

#define MS          INT64_C(1000000)
#define NS_PER_S    INT64_C(1000000000)
#define DRAIN_TIMES 20 /* a line that is never silent */

/* While a line is taken over. */
#define HURRIED_SILENT_NS  (20 * MS)
#define HURRIED_TIMEOUT_NS (100 * MS)

static int64_t modbus_libmodbus_now_ns(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * NS_PER_S + now.tv_nsec;
}

static void modbus_libmodbus_sleep_until(int64_t t_ns)
{
    const struct timespec until = { .tv_sec = (time_t)(t_ns / NS_PER_S),
                                    .tv_nsec = (long)(t_ns % NS_PER_S) };

    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL) ==
           EINTR)
        ;
}

bool modbus_libmodbus_is_rtu(const struct modbus_libmodbus *self)
{
    return self->config.device[0] != '\0';
}

/* ---- the connection ---- */

static modbus_t *modbus_libmodbus_new(const struct modbus_libmodbus *self)
{
    static const char parity[] = { [MODBUS_PARITY_EVEN] = 'E',
                                   [MODBUS_PARITY_ODD] = 'O',
                                   [MODBUS_PARITY_NONE] = 'N' };
    const struct modbus_rtu_line *line = &self->config.line;
    char service[8];

    if (modbus_libmodbus_is_rtu(self))
        return modbus_new_rtu(self->config.device, (int)line->baud,
                              parity[line->parity], 8, line->stop_bits);
    snprintf(service, sizeof service, "%u", self->config.port);
    return modbus_new_tcp_pi(self->config.host, service);
}

static void modbus_libmodbus_drop(struct modbus_libmodbus *self)
{
    if (self->context == NULL)
        return;
    modbus_close(self->context);
    modbus_free(self->context);
    self->context = NULL;
}

void modbus_libmodbus_down(struct modbus_libmodbus *self)
{
    modbus_libmodbus_drop(self);
    atomic_store(&self->up, false);
}

/* We break it off, to be sure of the next answer: the line stays up unless it
 * cannot be had again. */
static void modbus_libmodbus_anew(struct modbus_libmodbus *self)
{
    modbus_libmodbus_drop(self);
    self->retry_ns = 0;
    modbus_libmodbus_up(self);
}

/* Read away what is there until nothing has come for `silent_ns`. */
static void modbus_libmodbus_drain(struct modbus_libmodbus *self,
                                   int64_t silent_ns)
{
    const int fd = modbus_get_socket(self->context);
    struct pollfd wait = { .fd = fd, .events = POLLIN };
    const int64_t end_ns = modbus_libmodbus_now_ns() + DRAIN_TIMES * silent_ns;
    uint8_t waste[256];

    while (poll(&wait, 1, (int)((silent_ns + MS - 1) / MS)) > 0 &&
           modbus_libmodbus_now_ns() < end_ns) {
        const ssize_t got = read(fd, waste, sizeof waste);

        if (got <= 0)
            return; /* the next transaction will say what is the matter */
        atomic_fetch_add(&self->stray, (uint64_t)got);
    }
    self->free_ns = modbus_libmodbus_now_ns();
}

static int64_t modbus_libmodbus_hurry(const struct modbus_libmodbus *self,
                                      int64_t dur_ns, int64_t hurried_ns)
{
    return self->hurried > 0 && hurried_ns < dur_ns ? hurried_ns : dur_ns;
}

/* After a transaction.  The first good answer is followed by silence where it may
 * belong to a request that failed before. */
static void modbus_libmodbus_hurried(struct modbus_libmodbus *self,
                                     bool is_good)
{
    if (self->hurried == 0)
        return;
    if (!is_good) {
        self->hurried--;
        return;
    }
    if (self->hurried < MODBUS_LIBMODBUS_HURRIED)
        modbus_libmodbus_drain(self, self->config.timeout_ns);
    self->hurried = 0;
}

static void modbus_libmodbus_connected(struct modbus_libmodbus *self)
{
    if (self->was_up)
        atomic_fetch_add(&self->reconnects, 1);
    self->was_up = true;
    if (modbus_libmodbus_is_rtu(self)) {
        (void)ioctl(modbus_get_socket(self->context), TIOCEXCL);
        modbus_libmodbus_drain(self, self->hurried > 0 ? HURRIED_SILENT_NS
                                                       : self->time.gap_ns);
    }
    atomic_store(&self->up, true);
}

void modbus_libmodbus_up(struct modbus_libmodbus *self)
{
    const int64_t now_ns = modbus_libmodbus_now_ns();
    const int64_t timeout_us = self->config.timeout_ns / 1000;

    if (self->context != NULL || now_ns < self->retry_ns)
        return;
    self->retry_ns = now_ns + MODBUS_LIBMODBUS_RETRY_NS;
    self->context = modbus_libmodbus_new(self);
    if (self->context == NULL) {
        modbus_libmodbus_down(self);
        return;
    }
    modbus_set_error_recovery(self->context, MODBUS_ERROR_RECOVERY_NONE);
    modbus_set_response_timeout(self->context, (uint32_t)(timeout_us / 1000000),
                                (uint32_t)(timeout_us % 1000000));
    if (modbus_connect(self->context) == 0 &&
        modbus_rs485_apply(self->context, &self->config) == 0)
        modbus_libmodbus_connected(self);
    else
        modbus_libmodbus_down(self);
}

/* ---- one transaction ---- */

static int modbus_libmodbus_err(int code)
{
    switch (code) {
    case ETIMEDOUT:
        return MOTION_E_TIMEOUT;
    case EMBBADCRC:
    case EMBBADDATA:
    case EMBBADEXC:
    case EMBBADSLAVE:
        return MOTION_E_PROTOCOL;
    default:
        return MOTION_E_IO;
    }
}

static int modbus_libmodbus_send_rtu(struct modbus_libmodbus *self,
                                     const uint8_t *pdu, unsigned length,
                                     uint8_t unit)
{
    uint8_t raw[1 + MODBUS_PDU_MAX];

    raw[0] = unit;
    memcpy(raw + 1, pdu, length);
    if (modbus_set_slave(self->context, unit) < 0)
        return -1;
    return modbus_send_raw_request(self->context, raw, (int)length + 1);
}

/* Not through libmodbus: its raw requests have no transaction numbers. */
static int modbus_libmodbus_send_tcp(struct modbus_libmodbus *self,
                                     const struct hal_modbus_request *request)
{
    uint8_t frame[MODBUS_TCP_FRAME_MAX];
    const int fd = modbus_get_socket(self->context);
    const int length =
        modbus_tcp_put_request(request, ++self->transaction, frame);

    return send(fd, frame, (size_t)length, MSG_NOSIGNAL) == length ? 0 : -1;
}

/* libmodbus cannot tell how long answers to 2B are: RTU ends with silence,
 * which adapters that gather bytes stretch; TCP says its length. */
#define OPEN_SILENT_MS 30

static bool modbus_libmodbus_is_more(const struct modbus_libmodbus *self,
                                     const uint8_t *frame, unsigned length)
{
    const unsigned whole = modbus_libmodbus_is_rtu(self)
                               ? MODBUS_RTU_FRAME_MAX
                               : modbus_tcp_whole(frame, length);

    return length < MODBUS_RTU_FRAME_MAX && (whole == 0 || length < whole);
}

static int modbus_libmodbus_receive_open(struct modbus_libmodbus *self,
                                         uint8_t *frame)
{
    struct pollfd wait = { .fd = modbus_get_socket(self->context),
                           .events = POLLIN };
    int wait_ms = (int)(self->config.timeout_ns / MS) + 1;
    unsigned length = 0;

    if (modbus_libmodbus_is_rtu(self))
        wait_ms += (int)(modbus_rtu_chars_ns(&self->time, 16) / MS);
    while (modbus_libmodbus_is_more(self, frame, length) &&
           poll(&wait, 1, wait_ms) > 0) {
        const ssize_t got =
            read(wait.fd, frame + length, MODBUS_RTU_FRAME_MAX - length);

        if (got <= 0) {
            errno = EIO;
            return -1;
        }
        length += (unsigned)got;
        wait_ms = OPEN_SILENT_MS;
    }
    errno = ETIMEDOUT;
    return length == 0 ? -1 : (int)length;
}

/* libmodbus says 0 for a frame of another unit. */
static void modbus_libmodbus_receive(struct modbus_libmodbus *self,
                                     const struct hal_modbus_request *request,
                                     struct hal_modbus_reply *reply)
{
    uint8_t frame[MODBUS_TCP_MAX_ADU_LENGTH];
    const int got = request->function == HAL_MODBUS_IDENTIFY
                        ? modbus_libmodbus_receive_open(self, frame)
                        : modbus_receive_confirmation(self->context, frame);

    if (got <= 0)
        reply->err = got < 0 ? modbus_libmodbus_err(errno) : MOTION_E_PROTOCOL;
    else if (modbus_libmodbus_is_rtu(self))
        modbus_rtu_take_answer(request, frame, (unsigned)got, reply);
    else
        modbus_tcp_take_answer(request, self->transaction, frame, (unsigned)got,
                               reply);
    reply->done_ns = modbus_libmodbus_now_ns();
    reply->answer_ns = reply->done_ns;
    if (got > 0 && modbus_libmodbus_is_rtu(self))
        reply->answer_ns -= modbus_rtu_chars_ns(&self->time, (unsigned)got);
    if (reply->answer_ns < reply->sent_ns)
        reply->answer_ns = reply->sent_ns;
}

static void modbus_libmodbus_patience(struct modbus_libmodbus *self,
                                      unsigned length)
{
    int64_t wait_us = modbus_libmodbus_hurry(self, self->config.timeout_ns,
                                             HURRIED_TIMEOUT_NS) /
                      1000;

    if (modbus_libmodbus_is_rtu(self))
        wait_us +=
            modbus_rtu_chars_ns(&self->time, length + MODBUS_RTU_FRAME_MAX) /
            1000;
    modbus_set_response_timeout(self->context, (uint32_t)(wait_us / 1000000),
                                (uint32_t)(wait_us % 1000000));
    modbus_set_byte_timeout(self->context, 0, 0);
}

static void modbus_libmodbus_broadcast(struct modbus_libmodbus *self,
                                       unsigned length,
                                       struct hal_modbus_reply *reply)
{
    reply->err = MOTION_OK;
    reply->answer_ns = reply->sent_ns +
                       modbus_rtu_chars_ns(&self->time, length + 3) +
                       self->config.broadcast_ns;
    modbus_libmodbus_sleep_until(reply->answer_ns);
    reply->done_ns = reply->answer_ns;
}

static void modbus_libmodbus_exchange(struct modbus_libmodbus *self,
                                      const struct hal_modbus_request *request,
                                      struct hal_modbus_reply *reply)
{
    uint8_t pdu[MODBUS_PDU_MAX];
    const unsigned length = (unsigned)modbus_pdu_put_request(request, pdu);

    modbus_libmodbus_patience(self, length);
    reply->sent_ns = modbus_libmodbus_now_ns();
    if ((modbus_libmodbus_is_rtu(self)
             ? modbus_libmodbus_send_rtu(self, pdu, length, request->unit)
             : modbus_libmodbus_send_tcp(self, request)) < 0)
        reply->err = MOTION_E_IO;
    else if (request->unit == HAL_MODBUS_BROADCAST)
        modbus_libmodbus_broadcast(self, length, reply);
    else
        modbus_libmodbus_receive(self, request, reply);
}

/* Has anything come that nobody asked for?  An answer of old must not be there
 * when the next request goes out. */
static void modbus_libmodbus_clear(struct modbus_libmodbus *self)
{
    int waiting = 0;

    if (ioctl(modbus_get_socket(self->context), FIONREAD, &waiting) < 0 ||
        waiting <= 0)
        return;
    if (modbus_libmodbus_is_rtu(self)) {
        modbus_libmodbus_drain(
            self, modbus_libmodbus_hurry(self, self->config.drain_ns,
                                         HURRIED_SILENT_NS));
        return;
    }
    atomic_fetch_add(&self->stray, (uint64_t)waiting);
    modbus_libmodbus_anew(self);
}

/* A reply that is neither an answer nor a refusal leaves doubt about what is
 * still to come. */
void modbus_libmodbus_recover(struct modbus_libmodbus *self, int err)
{
    const bool is_good = err == MOTION_OK || err == MOTION_E_REFUSED;
    const int64_t drain_ns =
        modbus_libmodbus_hurry(self, self->config.drain_ns, HURRIED_SILENT_NS);

    if (self->context == NULL)
        return;
    modbus_libmodbus_hurried(self, is_good);
    if (is_good)
        return;
    if (modbus_libmodbus_is_rtu(self) && err != MOTION_E_IO) {
        modbus_libmodbus_drain(self, drain_ns);
        return;
    }
    if (err == MOTION_E_IO)
        modbus_libmodbus_down(self);
    else
        modbus_libmodbus_anew(self);
}

void modbus_libmodbus_transact(struct modbus_libmodbus *self,
                               struct modbus_libmodbus_box *box)
{
    struct hal_modbus_reply *reply = &box->reply;

    modbus_libmodbus_sleep_until(self->free_ns);
    modbus_libmodbus_up(self);
    if (self->context != NULL)
        modbus_libmodbus_clear(self);
    reply->err = MOTION_E_IO;
    reply->sent_ns = reply->answer_ns = modbus_libmodbus_now_ns();
    if (self->context != NULL)
        modbus_libmodbus_exchange(self, &box->request, reply);
    reply->done_ns = modbus_libmodbus_now_ns();
    self->free_ns = reply->done_ns;
    if (modbus_libmodbus_is_rtu(self)) {
        self->free_ns += self->time.gap_ns;
        reply->done_ns += self->time.gap_ns;
    }
}
