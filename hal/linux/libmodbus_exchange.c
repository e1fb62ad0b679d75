/* hal/linux/libmodbus_exchange.c - a request and its answer, on the line's own
 * thread; see libmodbus.h. */
#define _GNU_SOURCE /* FIONREAD */
#include <errno.h>
#include <modbus.h>
#include <poll.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include "hal/linux/libmodbus_port.h"

#define MS INT64_C(1000000)

/* Steps of transaction numbers are odd, so that all have their turn, and long, so that
 * a number with a wrong bit is not the next one. */
#define TCP_STRIDE 0x9E37

/* Adapters that gather bytes hand on the rest of an answer so much later. */
#define GATHER_NS (30 * MS)

/* Wait until then, or not at all where that has passed.  True: there is something to
 * read. */
static bool exchange_wait(const struct modbus_libmodbus *self, int64_t end_ns)
{
    struct pollfd wait = { .fd = modbus_get_socket(self->context),
                           .events = POLLIN };
    const int64_t rest_ns = end_ns - modbus_libmodbus_now_ns();

    return poll(&wait, 1, rest_ns > 0 ? (int)((rest_ns + MS - 1) / MS) : 0) > 0;
}

/* ---- a serial line ---- */

/* libmodbus has no ASCII. */
static int exchange_send_serial(struct modbus_libmodbus *self,
                                const struct hal_modbus_request *request)
{
    const bool is_ascii = self->time.is_ascii;
    uint8_t frame[MODBUS_FRAME_MAX];
    const unsigned length = /* submit has looked at it */
        (unsigned)modbus_serial_put_request(is_ascii, request, frame);

    modbus_listener_begin(&self->listener, is_ascii, request, frame, length,
                          modbus_echo_expects(&self->echo));
    if (is_ascii)
        return write(modbus_get_socket(self->context), frame, length) ==
                       (ssize_t)length
                   ? MOTION_OK
                   : MOTION_E_IO;
    if (modbus_set_slave(self->context, request->unit) < 0 ||
        modbus_send_raw_request(self->context, frame, (int)length - 2) < 0)
        return MOTION_E_IO;
    return MOTION_OK;
}

/* False: the port is gone. */
static bool exchange_hear(struct modbus_libmodbus *self)
{
    uint8_t bytes[MODBUS_FRAME_MAX];
    const ssize_t got =
        read(modbus_get_socket(self->context), bytes, sizeof bytes);

    if (got > 0)
        modbus_listener_take(&self->listener, bytes, (unsigned)got);
    return got > 0 || (got < 0 && (errno == EAGAIN || errno == EINTR));
}

static int64_t exchange_patience_ns(const struct modbus_libmodbus *self,
                                    const struct hal_modbus_request *request)
{
    const unsigned chars =
        self->listener.sent_length +
        modbus_rtu_frame_chars(&self->time, modbus_pdu_answer_length(request));

    return modbus_rtu_chars_ns(&self->time, chars) +
           modbus_libmodbus_hurry(self, self->config.timeout_ns,
                                  HURRIED_TIMEOUT_NS);
}

static void exchange_count(struct modbus_libmodbus *self)
{
    atomic_fetch_add(&self->stray, self->listener.strays);
    atomic_fetch_add(&self->echoes, self->listener.echoes);
}

/* The answer, where it is among what comes; what is behind it is left to the next
 * transaction. */
static void exchange_listen(struct modbus_libmodbus *self,
                            struct hal_modbus_reply *reply)
{
    int64_t end_ns =
        reply->sent_ns + exchange_patience_ns(self, self->listener.request);
    const int64_t limit_ns = end_ns + GATHER_NS;
    unsigned length = 0;

    while (length == 0 && exchange_wait(self, end_ns)) {
        if (!exchange_hear(self)) {
            reply->err = MOTION_E_IO;
            return;
        }
        length = modbus_listener_find(
            &self->listener, modbus_libmodbus_now_ns() > limit_ns, reply);
        end_ns = limit_ns;
    }
    if (length == 0)
        length = modbus_listener_find(&self->listener, true, reply);
    reply->answer_ns = modbus_libmodbus_now_ns();
    if (length == 0)
        return;
    modbus_echo_note(&self->echo, &self->listener);
    self->listener.strays += self->listener.length;
    reply->answer_ns -=
        modbus_rtu_chars_ns(&self->time, self->listener.length + length);
}

static void exchange_broadcast(struct modbus_libmodbus *self,
                               struct hal_modbus_reply *reply)
{
    reply->err = MOTION_OK;
    reply->answer_ns =
        reply->sent_ns +
        modbus_rtu_chars_ns(&self->time, self->listener.sent_length) +
        self->config.broadcast_ns;
    modbus_libmodbus_sleep_until(reply->answer_ns);
}

/* Read away bytes that nobody has asked for. */
static void exchange_clear(struct modbus_libmodbus *self)
{
    int waiting = 0;

    if (ioctl(modbus_get_socket(self->context), FIONREAD, &waiting) == 0 &&
        waiting > 0)
        modbus_libmodbus_drain(self, self->time.gap_ns);
}

static void exchange_serial(struct modbus_libmodbus *self,
                            const struct hal_modbus_request *request,
                            struct hal_modbus_reply *reply)
{
    if (self->context == NULL)
        return;
    exchange_clear(self);
    reply->sent_ns = modbus_libmodbus_now_ns();
    reply->err = exchange_send_serial(self, request);
    if (reply->err < 0)
        return;
    if (request->unit == HAL_MODBUS_BROADCAST)
        exchange_broadcast(self, reply);
    else
        exchange_listen(self, reply);
    exchange_count(self);
}

/* ---- TCP ---- */

/* Send without libmodbus, whose raw requests have no transaction numbers. */
static bool exchange_send_tcp(struct modbus_libmodbus *self,
                              const struct hal_modbus_request *request)
{
    uint8_t frame[MODBUS_TCP_FRAME_MAX];
    const int length =
        modbus_tcp_put_request(request, self->transaction, frame);

    return send(modbus_get_socket(self->context), frame, (size_t)length,
                MSG_NOSIGNAL) == length;
}

/* False: the connection is gone. */
static bool exchange_receive(struct modbus_libmodbus *self,
                             const struct hal_modbus_request *request,
                             int64_t end_ns, struct hal_modbus_reply *reply)
{
    reply->err = MOTION_E_TIMEOUT;
    while (!modbus_tcp_find(&self->stream, request, self->transaction, reply) &&
           exchange_wait(self, end_ns))
        if (!modbus_libmodbus_read(self))
            return false;
    return true;
}

/* Never send again what was under way when a connection closed: it may have been
 * done. */
static void exchange_tcp(struct modbus_libmodbus *self,
                         const struct hal_modbus_request *request,
                         struct hal_modbus_reply *reply)
{
    const int64_t end_ns = modbus_libmodbus_now_ns() + self->config.timeout_ns;

    self->transaction = (uint16_t)(self->transaction + TCP_STRIDE);
    reply->err = modbus_libmodbus_ready(self, request, end_ns);
    if (reply->err < 0)
        return;
    reply->sent_ns = modbus_libmodbus_now_ns();
    if (!exchange_send_tcp(self, request) ||
        !exchange_receive(self, request,
                          reply->sent_ns + self->config.timeout_ns, reply)) {
        modbus_libmodbus_broke(self);
        reply->err = modbus_libmodbus_ready(self, request, end_ns);
        if (reply->err == MOTION_OK)
            reply->err = MOTION_E_TIMEOUT;
    }
    reply->answer_ns = modbus_libmodbus_now_ns();
    atomic_fetch_add(&self->stray, self->stream.strays);
    atomic_fetch_add(&self->late, self->stream.late);
    self->stream.strays = self->stream.late = 0;
}

/* ---- one transaction ---- */

void modbus_libmodbus_transact(struct modbus_libmodbus *self,
                               struct modbus_libmodbus_box *box)
{
    struct hal_modbus_reply *reply = &box->reply;

    modbus_libmodbus_sleep_until(self->free_ns);
    modbus_libmodbus_up(self);
    reply->err = MOTION_E_IO;
    reply->sent_ns = reply->answer_ns = modbus_libmodbus_now_ns();
    self->since_ns = reply->sent_ns;
    if (modbus_libmodbus_is_rtu(self))
        exchange_serial(self, &box->request, reply);
    else
        exchange_tcp(self, &box->request, reply);
    if (reply->answer_ns < reply->sent_ns)
        reply->answer_ns = reply->sent_ns;
    reply->done_ns = modbus_libmodbus_now_ns();
    self->free_ns = reply->done_ns;
    if (modbus_libmodbus_is_rtu(self)) {
        self->free_ns += self->time.gap_ns;
        reply->done_ns += self->time.gap_ns;
    }
}
