/* tests/hal/modbus/test_modbus_corrupt.c - libmodbus on real pseudo-terminals and
 * on real TCP connections whose other end answers badly, many of them at a
 * time.
 *
 * CORRUPTIONS=100000 in the environment for so many bad answers of each; make corrupt
 * does.  Reads the real clock. */
#define _XOPEN_SOURCE 700 /* posix_openpt */
#include <arpa/inet.h>
#include <fcntl.h>
#include <inttypes.h>
#include <netinet/in.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "hal/linux/libmodbus.h"
#include "hal/modbus/tcp.h"
#include "sim/bus/modbus.h"

#include "tests/support/can_corrupt.h"
#include "tests/support/check.h"

#define MS     INT64_C(1000000)
#define UNIT   9
#define LINES  200 /* select() of libmodbus takes 1024 descriptors */
#define PRESET 1500
#define TRIES  40  /* of a good answer, until the line must be right again */
#define PAUSE  100 /* looks, 200 us each, before the next of them */

/* A terminal waits for the time-out and the longest frame, 45 ms, and after a
 * failure for silence.  An answer that comes later than that is taken for the
 * next one's, for RTU has no numbers: it is to be late by design, not because
 * this machine has other things to do.  Where it has, the device sees it, and a
 * few wrong values are its own: those that went out later than half the silence
 * after they were asked for, and those to a request that is not the last one
 * any more. */
#define TIMEOUT_NS (20 * MS)
#define DRAIN_NS   (400 * MS)

enum corrupt {
    CORRUPT_NONE,
    CORRUPT_SPLIT, /* in pieces: still good */
    CORRUPT_TWICE, /* begins with a good one */
    CORRUPT_LATE,
    CORRUPT_MUTE,
    CORRUPT_EXCEPTION,
    CORRUPT_UNIT,
    CORRUPT_HALF,
    CORRUPT_NOISE,
    CORRUPT_FLIP,     /* RTU: up to 16 bits; TCP: of the head */
    CORRUPT_CHECK,    /* RTU: CRC; TCP: another transaction */
    CORRUPT_LENGTH,   /* TCP: of the head; RTU: a byte more */
    CORRUPT_FUNCTION, /* of another request */
    CORRUPT_CLOSE,    /* TCP: in the middle; RTU: as half */
    CORRUPTIONS,
};

struct line {
    struct modbus_libmodbus libmodbus;
    bool open, tcp, waits;
    pthread_t device;
    int fd; /* of the terminal; listens */
    uint64_t seed;
    _Atomic int corrupt;
    _Atomic bool stop, stalled;
    _Atomic uint16_t address;     /* asked for last */
    _Atomic int64_t requested_ns; /* when */
    uint16_t answering; /* the device's: the address it was asked for */
    uint16_t tries;
    unsigned pause;
    enum corrupt requested;
};

static struct line line[LINES];

struct tally {
    unsigned corrupted, right, refused, stalls, kind[CORRUPTIONS];
};

static uint16_t value_at(uint16_t address)
{
    return (uint16_t)(address * 40503u + 7);
}

static void rest_ns(int64_t dur_ns)
{
    const struct timespec time = { dur_ns / 1000000000, dur_ns % 1000000000 };

    (void)nanosleep(&time, NULL);
}

/* ---- the device: answers to reads of one register ---- */

static int64_t now_ns(void)
{
    struct timespec time;

    (void)clock_gettime(CLOCK_MONOTONIC, &time);
    return (int64_t)time.tv_sec * 1000000000 + time.tv_nsec;
}

static void note_stall(struct line *self)
{
    if (now_ns() - atomic_load(&self->requested_ns) > DRAIN_NS / 2 ||
        self->answering != atomic_load(&self->address))
        atomic_store(&self->stalled, true);
}

/* What is not taken was for somebody who has left.  A stall is noted before
 * anybody can have read what it made late, and once more for one in between. */
static void put(struct line *self, int fd, const uint8_t *bytes, size_t length)
{
    note_stall(self);
    if (self->tcp)
        (void)send(fd, bytes, length, MSG_NOSIGNAL);
    else
        (void)!write(fd, bytes, length);
    note_stall(self);
}

static unsigned answer_rtu(const uint8_t *request, uint8_t *frame)
{
    const struct hal_modbus_request query = { .function = 3, .count = 1 };
    const uint16_t value = value_at(modbus_pdu_get(request + 2));

    return modbus_rtu_seal(frame, UNIT,
                           modbus_pdu_put_answer(&query, &value, frame + 1));
}

static unsigned answer_tcp(const uint8_t *request, uint8_t *frame)
{
    const struct hal_modbus_request query = { .function = 3, .count = 1 };
    const uint16_t value = value_at(modbus_pdu_get(request + 8));
    const unsigned length =
        modbus_pdu_put_answer(&query, &value, frame + MODBUS_TCP_HEAD);

    return modbus_tcp_seal(frame, modbus_pdu_get(request), UNIT, length);
}

static unsigned spoil_rtu(struct line *self, enum corrupt corrupt,
                          uint8_t *frame, unsigned length)
{
    static const enum sim_modbus_fault fault[CORRUPTIONS] = {
        [CORRUPT_TWICE] = SIM_MODBUS_TWICE,
        [CORRUPT_EXCEPTION] = SIM_MODBUS_EXCEPTION,
        [CORRUPT_UNIT] = SIM_MODBUS_OTHER_UNIT,
        [CORRUPT_HALF] = SIM_MODBUS_HALF,
        [CORRUPT_NOISE] = SIM_MODBUS_NOISE,
        [CORRUPT_FLIP] = SIM_MODBUS_FLIP,
        [CORRUPT_CHECK] = SIM_MODBUS_WRONG_CRC,
        [CORRUPT_CLOSE] = SIM_MODBUS_HALF,
    };

    if (corrupt == CORRUPT_FUNCTION) {
        frame[1] = 4;
        return modbus_rtu_seal(frame, UNIT, length - 3);
    }
    if (corrupt == CORRUPT_LENGTH) {
        frame[2]++;
        return modbus_rtu_seal(frame, UNIT, length - 2);
    }
    return sim_modbus_spoil(fault[corrupt], &self->seed, frame, length);
}

static unsigned spoil_tcp(struct line *self, enum corrupt corrupt,
                          uint8_t *frame, unsigned length)
{
    switch (corrupt) {
    case CORRUPT_TWICE:
        memcpy(frame + length, frame, length);
        return 2 * length;
    case CORRUPT_EXCEPTION:
        return modbus_tcp_seal(
            frame, modbus_pdu_get(frame), UNIT,
            modbus_pdu_put_exception(3, 6, frame + MODBUS_TCP_HEAD));
    case CORRUPT_UNIT:
        frame[6]++;
        return length;
    case CORRUPT_HALF:
    case CORRUPT_CLOSE:
        return (unsigned)check_random_in(&self->seed, 1, length - 1);
    case CORRUPT_NOISE:
        length =
            (unsigned)check_random_in(&self->seed, 1, MODBUS_TCP_FRAME_MAX);
        for (unsigned i = 0; i < length; i++)
            frame[i] = (uint8_t)check_random(&self->seed);
        return length;
    case CORRUPT_FLIP: /* of transaction, protocol, length, unit or function */
        frame[check_random_in(&self->seed, 0, 7)] ^=
            (uint8_t)(1u << check_random_in(&self->seed, 0, 7));
        return length;
    case CORRUPT_CHECK:
        modbus_pdu_set(frame, (uint16_t)(modbus_pdu_get(frame) - 1));
        return length;
    case CORRUPT_LENGTH:
        modbus_pdu_set(frame + 4, (uint16_t)check_random_in(&self->seed, 0, 9));
        return length;
    case CORRUPT_FUNCTION:
        frame[MODBUS_TCP_HEAD] = 4;
        return length;
    default:
        return length;
    }
}

/* False: this connection is to be closed. */
static bool answer(struct line *self, int fd, const uint8_t *request)
{
    const enum corrupt corrupt = (enum corrupt)atomic_load(&self->corrupt);
    uint8_t frame[2 * MODBUS_TCP_FRAME_MAX];
    unsigned length =
        self->tcp ? answer_tcp(request, frame) : answer_rtu(request, frame);

    if (corrupt == CORRUPT_MUTE)
        return true;
    if (corrupt == CORRUPT_LATE)
        rest_ns(check_random_in(&self->seed, 55, 75) * MS);
    if (corrupt == CORRUPT_SPLIT) {
        const size_t first =
            (size_t)check_random_in(&self->seed, 1, length - 1);
        put(self, fd, frame, first);
        rest_ns(MS);
        put(self, fd, frame + first, length - first);
        return true;
    }
    length = self->tcp ? spoil_tcp(self, corrupt, frame, length)
                       : spoil_rtu(self, corrupt, frame, length);
    put(self, fd, frame, length);
    return corrupt != CORRUPT_CLOSE;
}

/* Requests on one terminal or connection, until it is closed. */
static void serve(struct line *self, int fd)
{
    const size_t whole = self->tcp ? 12 : 8;
    uint8_t request[64];
    size_t have = 0;

    while (!atomic_load(&self->stop)) {
        struct pollfd wait = { .fd = fd, .events = POLLIN };
        if (poll(&wait, 1, 50) <= 0)
            continue;
        const ssize_t got = read(fd, request + have, whole - have);
        if (got <= 0 && self->tcp)
            return;
        if (got <= 0) { /* nobody has the terminal open yet */
            rest_ns(MS);
            continue;
        }
        have += (size_t)got;
        if (have < whole)
            continue;
        have = 0;
        self->answering = modbus_pdu_get(request + (self->tcp ? 8 : 2));
        const bool goes_on = answer(self, fd, request);
        if (!goes_on && self->tcp)
            return;
    }
}

static void *device_run(void *context)
{
    struct line *self = context;

    if (!self->tcp)
        serve(self, self->fd);
    while (!atomic_load(&self->stop)) {
        struct pollfd wait = { .fd = self->fd, .events = POLLIN };
        if (poll(&wait, 1, 50) <= 0)
            continue;
        const int fd = accept(self->fd, NULL, NULL);
        if (fd < 0)
            continue;
        serve(self, fd);
        close(fd);
    }
    return NULL;
}

static void open_terminal(struct line *self, struct modbus_line_config *config)
{
    self->fd = posix_openpt(O_RDWR | O_NOCTTY);
    assert_true(self->fd >= 0 && grantpt(self->fd) == 0 &&
                unlockpt(self->fd) == 0);
    snprintf(config->device, sizeof config->device, "%s", ptsname(self->fd));
    config->line = (struct modbus_rtu_line){ .baud = 115200,
                                             .parity = MODBUS_PARITY_NONE,
                                             .stop_bits = 1 };
}

static void open_socket(struct line *self, struct modbus_line_config *config)
{
    struct sockaddr_in at = { .sin_family = AF_INET,
                              .sin_addr.s_addr = htonl(INADDR_LOOPBACK) };
    socklen_t size = sizeof at;

    self->fd = socket(AF_INET, SOCK_STREAM, 0);
    assert_true(self->fd >= 0 &&
                bind(self->fd, (struct sockaddr *)&at, sizeof at) == 0 &&
                listen(self->fd, 4) == 0 &&
                getsockname(self->fd, (struct sockaddr *)&at, &size) == 0);
    snprintf(config->host, sizeof config->host, "127.0.0.1");
    config->port = ntohs(at.sin_port);
}

static void open_line(struct line *self, unsigned number, bool tcp)
{
    struct modbus_line_config config = { .timeout_ns = TIMEOUT_NS,
                                         .drain_ns = DRAIN_NS };

    memset(self, 0, sizeof *self);
    self->tcp = tcp;
    self->seed = 4711 + number;
    if (tcp)
        open_socket(self, &config);
    else
        open_terminal(self, &config);
    assert_int_equal(pthread_create(&self->device, NULL, device_run, self), 0);
    assert_int_equal(modbus_libmodbus_open(&self->libmodbus, &config), 0);
    self->open = true;
}

static void close_line(struct line *self)
{
    modbus_libmodbus_close(&self->libmodbus);
    atomic_store(&self->stop, true);
    pthread_join(self->device, NULL);
    close(self->fd);
    self->open = false;
}

static int close_lines(void **state)
{
    (void)state;
    for (unsigned i = 0; i < LINES; i++)
        if (line[i].open)
            close_line(&line[i]);
    return 0;
}

/* ---- the master ---- */

/* Seven of eight answers are corrupted; then a good one, again until it is
 * right. */
static void query(struct line *self, uint64_t *seed)
{
    const uint16_t address = ++self->address;
    const struct hal_modbus_request request = {
        .unit = UNIT, .function = 3, .address = address, .count = 1
    };

    self->requested =
        self->tries > 0 || address % 8 == 0
            ? CORRUPT_NONE
            : (enum corrupt)check_random_in(seed, 1, CORRUPTIONS - 1);
    atomic_store(&self->corrupt, self->requested);
    atomic_store(&self->requested_ns, now_ns());
    assert_int_equal(
        hal_modbus_submit(&self->libmodbus.modbus, &request, address), 0);
    self->waits = true;
}

static void judge(struct line *self, const struct hal_modbus_reply *reply,
                  struct tally *tally)
{
    self->waits = false;
    const bool wrong =
        reply->err == MOTION_OK &&
        (reply->count != 1 || reply->value[0] != value_at(self->address));
    if (wrong && !self->tcp && atomic_exchange(&self->stalled, false))
        tally->stalls++; /* this machine kept the answer, not the line */
    else if (wrong)
        fail_msg("a wrong value after %u, kind %d", tally->corrupted,
                 (int)self->requested);
    if (self->requested == CORRUPT_NONE) {
        self->tries = reply->err == MOTION_OK ? 0 : (uint16_t)(self->tries + 1);
        self->pause = reply->err == MOTION_OK ? 0 : PAUSE;
        if (self->tries > TRIES)
            fail_msg("not recovered: %s", motion_err_text(reply->err));
        return;
    }
    tally->corrupted++;
    tally->kind[self->requested]++;
    tally->right += reply->err == MOTION_OK;
    tally->refused += reply->err != MOTION_OK;
}

static void run(bool tcp)
{
    const unsigned wanted = can_corrupt_wanted(PRESET);
    struct tally tally = { 0 };
    struct hal_modbus_reply reply;
    uint64_t seed = 1;

    for (unsigned i = 0; i < LINES; i++)
        open_line(&line[i], i, tcp);
    while (tally.corrupted < wanted) {
        for (unsigned i = 0; i < LINES; i++) {
            if (line[i].pause > 0)
                line[i].pause--;
            else if (!line[i].waits)
                query(&line[i], &seed);
            else if (hal_modbus_collect(&line[i].libmodbus.modbus, &reply) == 1)
                judge(&line[i], &reply, &tally);
        }
        rest_ns(MS / 5);
    }
    print_message("%u answers corrupted, %u right all the same, %u refused\n",
                  tally.corrupted, tally.right, tally.refused);
    for (unsigned i = 1; i < CORRUPTIONS; i++)
        assert_true(tally.kind[i] > wanted / (2 * CORRUPTIONS));
    assert_true(tally.stalls <= wanted / 1000);
    assert_true(tally.refused > wanted / 2);
    assert_true(tally.right > wanted / (2 * CORRUPTIONS)); /* those in pieces */
}

static void terminals_believe_nothing_wrong_and_go_on(void **state)
{
    (void)state;
    run(false);
}

static void connections_believe_nothing_wrong_and_go_on(void **state)
{
    (void)state;
    run(true);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(terminals_believe_nothing_wrong_and_go_on,
                                  close_lines),
        cmocka_unit_test_teardown(connections_believe_nothing_wrong_and_go_on,
                                  close_lines),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
