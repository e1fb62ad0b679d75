/* hal/linux/libmodbus_port.c - the port and its connection, on the line's own
 * thread; see libmodbus.h. */
#define _GNU_SOURCE /* TIOCEXCL */
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

#define MS          INT64_C(1000000)
#define NS_PER_S    INT64_C(1000000000)
#define DRAIN_TIMES 20 /* a line that is never silent */

/* A server that has closed a connection is asked for the next one after AGAIN, and
 * uses it when it has not closed that one within ADMIT: one with few of them does
 * not take another before it has seen that the last is gone. */
#define TCP_AGAIN_NS (10 * MS)
#define TCP_ADMIT_NS (20 * MS)
#define TCP_TRIES    3 /* time-outs that it may take; and without a byte */

int64_t modbus_libmodbus_now_ns(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * NS_PER_S + now.tv_nsec;
}

void modbus_libmodbus_sleep_until(int64_t t_ns)
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

int64_t modbus_libmodbus_hurry(const struct modbus_libmodbus *self,
                               int64_t dur_ns, int64_t hurried_ns)
{
    return self->hurried > 0 && hurried_ns < dur_ns ? hurried_ns : dur_ns;
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
                              parity[line->parity],
                              (int)modbus_rtu_data_bits(line), line->stop_bits);
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

/* Its connection is gone, and may be had again before that is said. */
static bool modbus_libmodbus_is_patient(const struct modbus_libmodbus *self)
{
    return !modbus_libmodbus_is_rtu(self) && self->was_up &&
           self->broke_ns != 0 &&
           modbus_libmodbus_now_ns() - self->broke_ns <
               TCP_TRIES * self->config.timeout_ns;
}

void modbus_libmodbus_drain(struct modbus_libmodbus *self, int64_t silent_ns)
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

static void modbus_libmodbus_connected(struct modbus_libmodbus *self)
{
    if (self->was_up)
        atomic_fetch_add(&self->reconnects, 1);
    self->was_up = true;
    self->stream.length = 0;
    self->silent = 0;
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
    if (self->context != NULL) {
        modbus_set_error_recovery(self->context, MODBUS_ERROR_RECOVERY_NONE);
        modbus_set_response_timeout(self->context,
                                    (uint32_t)(timeout_us / 1000000),
                                    (uint32_t)(timeout_us % 1000000));
        if (modbus_connect(self->context) == 0 &&
            modbus_rs485_apply(self->context, &self->config) == 0) {
            modbus_libmodbus_connected(self);
            return;
        }
    }
    modbus_libmodbus_drop(self);
    if (!modbus_libmodbus_is_patient(self))
        atomic_store(&self->up, false);
}

/* ---- TCP: a connection that closes ---- */

bool modbus_libmodbus_read(struct modbus_libmodbus *self)
{
    unsigned room;
    uint8_t *at = modbus_tcp_room(&self->stream, &room);
    const ssize_t got =
        recv(modbus_get_socket(self->context), at, room, MSG_DONTWAIT);

    if (got <= 0)
        return got < 0 && (errno == EAGAIN || errno == EINTR);
    self->stream.length += (unsigned)got;
    self->silent = 0;
    return true;
}

void modbus_libmodbus_broke(struct modbus_libmodbus *self)
{
    if (self->context == NULL)
        return;
    if (self->broke_ns == 0)
        self->broke_ns = self->since_ns;
    modbus_libmodbus_drop(self);
}

/* Read away what has come of before, so that an end of the connection is seen. */
static bool modbus_libmodbus_is_open(struct modbus_libmodbus *self,
                                     const struct hal_modbus_request *request)
{
    struct pollfd wait = { .events = POLLIN };
    struct hal_modbus_reply nobodys = { 0 };

    while (self->context != NULL) {
        wait.fd = modbus_get_socket(self->context);
        if (poll(&wait, 1, 0) <= 0)
            return true;
        if (!modbus_libmodbus_read(self))
            modbus_libmodbus_broke(self);
        (void)modbus_tcp_find(&self->stream, request, self->transaction,
                              &nobodys);
    }
    return false;
}

static void modbus_libmodbus_again(struct modbus_libmodbus *self)
{
    struct pollfd wait = { .events = POLLIN };

    modbus_libmodbus_sleep_until(modbus_libmodbus_now_ns() + TCP_AGAIN_NS);
    self->retry_ns = 0;
    modbus_libmodbus_up(self);
    if (self->context == NULL)
        return;
    wait.fd = modbus_get_socket(self->context);
    (void)poll(&wait, 1, (int)(TCP_ADMIT_NS / MS));
}

int modbus_libmodbus_ready(struct modbus_libmodbus *self,
                           const struct hal_modbus_request *request,
                           int64_t end_ns)
{
    while (!modbus_libmodbus_is_open(self, request)) {
        if (!modbus_libmodbus_is_patient(self)) {
            modbus_libmodbus_down(self);
            return MOTION_E_IO;
        }
        if (modbus_libmodbus_now_ns() >= end_ns)
            return MOTION_E_TIMEOUT;
        modbus_libmodbus_again(self);
    }
    return MOTION_OK;
}

/* A connection whose other end is gone without a word says nothing for ever. */
static void modbus_libmodbus_judge(struct modbus_libmodbus *self, int err)
{
    if (err == MOTION_OK || err == MOTION_E_REFUSED)
        self->broke_ns = 0;
    if (err != MOTION_E_TIMEOUT) {
        self->silent = 0;
    } else if (self->context != NULL && ++self->silent == TCP_TRIES) {
        modbus_libmodbus_broke(self);
        self->retry_ns = 0;
        modbus_libmodbus_up(self);
    }
}

/* ---- after a transaction ---- */

/* The first good answer of a line that is taken over is followed by silence where
 * it may belong to a request that failed before. */
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

/* A reply that is neither an answer nor a refusal leaves doubt about what is
 * still to come; on TCP it has a number. */
void modbus_libmodbus_recover(struct modbus_libmodbus *self, int err)
{
    const bool is_good = err == MOTION_OK || err == MOTION_E_REFUSED;
    const int64_t drain_ns =
        modbus_libmodbus_hurry(self, self->config.drain_ns, HURRIED_SILENT_NS);

    if (!modbus_libmodbus_is_rtu(self)) {
        modbus_libmodbus_judge(self, err);
        return;
    }
    if (self->context == NULL)
        return;
    modbus_libmodbus_hurried(self, is_good);
    if (err == MOTION_E_IO)
        modbus_libmodbus_down(self);
    else if (!is_good)
        modbus_libmodbus_drain(self, drain_ns);
}
