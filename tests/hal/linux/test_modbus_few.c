/* tests/hal/linux/test_modbus_few.c - libmodbus and a Modbus TCP server that has one
 * connection: it sees late that the last one is gone, closes any other until then,
 * answers late, and closes the one that it has.  Reads the real clock. */
#define _DEFAULT_SOURCE /* usleep */
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "hal/linux/clock.h"
#include "hal/linux/libmodbus.h"
#include "tests/hal/linux/modbus_bank.h"
#include "tests/support/check.h"

#define MS         INT64_C(1000000)
#define TIMEOUT_NS (150 * MS)
#define UNIT       9
#define READS      200

static struct {
    struct modbus_bank bank;
    struct modbus_libmodbus libmodbus;
    struct clock_linux clock;
    pthread_t thread;
    int listener, fd;
    int64_t busy_ns; /* it takes nobody else until then */
    _Atomic bool stop;
    _Atomic int late_every, late_ms; /* one answer in so many */
    _Atomic int close_every,
        close_ms; /* the connection, and none for so long */
    _Atomic unsigned served, closed, refused;
    unsigned left; /* requests until it closes */
} few;

static int64_t now_ns(void)
{
    return hal_clock_now_ns(&few.clock.clock);
}

/* ---- the server ---- */

static void few_close(int64_t for_ns)
{
    (void)close(few.fd);
    few.fd = -1;
    few.busy_ns = now_ns() + for_ns;
}

static void few_answer(uint8_t *request)
{
    uint8_t frame[MODBUS_TCP_FRAME_MAX];
    const unsigned whole = modbus_tcp_whole(request, MODBUS_TCP_HEAD);
    const unsigned length =
        modbus_slave_serve(&few.bank.slave, request + MODBUS_TCP_HEAD,
                           whole - MODBUS_TCP_HEAD, frame + MODBUS_TCP_HEAD);
    const unsigned sealed =
        modbus_tcp_seal(frame, modbus_pdu_get(request), request[6], length);
    const unsigned n = atomic_fetch_add(&few.served, 1) + 1;

    if (few.late_every > 0 && n % (unsigned)few.late_every == 0)
        (void)usleep((useconds_t)few.late_ms * 1000);
    (void)send(few.fd, frame, sealed, MSG_NOSIGNAL);
}

static void few_serve(void)
{
    uint8_t request[MODBUS_TCP_FRAME_MAX];
    const ssize_t got = recv(few.fd, request, MODBUS_TCP_HEAD, MSG_WAITALL);
    const ssize_t rest =
        got == MODBUS_TCP_HEAD
            ? recv(few.fd, request + MODBUS_TCP_HEAD,
                   modbus_tcp_whole(request, MODBUS_TCP_HEAD) - MODBUS_TCP_HEAD,
                   MSG_WAITALL)
            : 0;

    if (rest <= 0) {
        few_close(few.close_ms * MS); /* it sees late that it is gone */
    } else if (few.close_every > 0 && few.left-- == 0) {
        few.left = (unsigned)few.close_every;
        atomic_fetch_add(&few.closed, 1);
        few_close(few.close_ms * MS); /* done or not, without a word */
    } else {
        few_answer(request);
    }
}

static void few_accept(void)
{
    const int fd = accept(few.listener, NULL, NULL);

    if (fd >= 0 && few.fd < 0 && now_ns() >= few.busy_ns) {
        few.fd = fd;
        return;
    }
    atomic_fetch_add(&few.refused, 1);
    (void)close(fd);
}

static void *few_run(void *context)
{
    (void)context;
    while (!atomic_load(&few.stop)) {
        struct pollfd wait[2] = { { .fd = few.listener, .events = POLLIN },
                                  { .fd = few.fd, .events = POLLIN } };

        (void)poll(wait, 2, 2);
        if (wait[0].revents != 0)
            few_accept();
        if (few.fd >= 0 && wait[1].revents != 0)
            few_serve();
    }
    return NULL;
}

static int few_begin(void **state)
{
    struct modbus_line_config config = { .host = "127.0.0.1",
                                         .timeout_ns = TIMEOUT_NS };
    struct sockaddr_in at = { .sin_family = AF_INET,
                              .sin_addr.s_addr = htonl(INADDR_LOOPBACK) };
    socklen_t length = sizeof at;

    (void)state;
    memset(&few, 0, sizeof few);
    (void)clock_linux_init(&few.clock);
    modbus_bank_init(&few.bank);
    few.fd = -1;
    few.listener = socket(AF_INET, SOCK_STREAM, 0);
    assert_int_equal(bind(few.listener, (struct sockaddr *)&at, length), 0);
    assert_int_equal(listen(few.listener, 8), 0);
    (void)getsockname(few.listener, (struct sockaddr *)&at, &length);
    config.port = ntohs(at.sin_port);
    assert_int_equal(pthread_create(&few.thread, NULL, few_run, NULL), 0);
    assert_int_equal(modbus_libmodbus_open(&few.libmodbus, &config), 0);
    return 0;
}

static int few_end(void **state)
{
    (void)state;
    modbus_libmodbus_close(&few.libmodbus);
    atomic_store(&few.stop, true);
    (void)pthread_join(few.thread, NULL);
    (void)close(few.listener);
    return 0;
}

/* ---- the client ---- */

static int few_read(uint16_t address)
{
    const struct hal_modbus_request request = {
        .unit = UNIT, .function = 3, .address = address, .count = 1
    };
    struct hal_modbus_reply reply;

    assert_int_equal(hal_modbus_submit(&few.libmodbus.modbus, &request, 0), 0);
    while (hal_modbus_collect(&few.libmodbus.modbus, &reply) == 0)
        (void)usleep(200);
    if (reply.err == MOTION_OK) /* of this request, of no other */
        assert_int_equal(reply.value[0], few.bank.reg[address]);
    return reply.err;
}

static struct hal_modbus_stats few_stats(void)
{
    struct hal_modbus_stats stats;

    hal_modbus_stats(&few.libmodbus.modbus, &stats);
    return stats;
}

/* How many good answers; none says that the line is gone. */
static unsigned few_reads(unsigned count)
{
    unsigned good = 0;

    for (unsigned i = 0; i < count; i++) {
        const int err = few_read((uint16_t)i);

        if (err != MOTION_OK)
            assert_int_equal(err, MOTION_E_TIMEOUT);
        assert_int_equal(hal_modbus_is_up(&few.libmodbus.modbus), 1);
        good += err == MOTION_OK;
    }
    return good;
}

/* The same connection all the while. */
static void what_is_late_is_dropped_by_its_number(void **state)
{
    (void)state;
    while (few_read(0) != MOTION_OK)
        ;
    const uint64_t before = few_stats().late;
    few.late_ms = (int)(TIMEOUT_NS / MS) + 40;
    few.late_every = 7;
    const unsigned good = few_reads(READS / 2);
    few.late_every = 0;
    (void)usleep((useconds_t)few.late_ms * 1000);
    assert_int_equal(few_read(3), MOTION_OK);
    assert_true(good < READS / 2 && good > READS / 4);
    assert_int_equal(few_stats().late - before, READS / 2 - good);
    assert_int_equal(few_stats().reconnects, 0);
    assert_int_equal(few.refused, 0);
}

/* It closes its connection in the middle of a request, and takes the next one only
 * some time after. */
static void one_that_closes_is_had_again(void **state)
{
    (void)state;
    while (few_read(0) != MOTION_OK)
        ;
    few.close_ms = (int)(TIMEOUT_NS / MS) * 2 / 3;
    few.left = 20;
    few.close_every = 20;
    assert_true(few_reads(READS) >= READS - 3 * READS / 20);
    few.close_every = 0;
    assert_true(few.closed >= 6 && few.refused >= few.closed);
    assert_int_equal(few_stats().failures, 0);
    assert_true(few_stats().reconnects >= few.closed);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(what_is_late_is_dropped_by_its_number,
                                        few_begin, few_end),
        cmocka_unit_test_setup_teardown(one_that_closes_is_had_again, few_begin,
                                        few_end),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
