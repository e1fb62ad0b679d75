/* tests/hal/linux/test_modbus_libmodbus.c - libmodbus on a real pseudo-terminal
 * whose other end answers badly, and on TCP whose server goes away.
 *
 * What is judged is what was answered and how often, not how soon: the machine
 * may pause all of this at any time.  Reads the real clock. */
#define _GNU_SOURCE /* RUSAGE_THREAD, sched_setaffinity */
#include "tests/hal/linux/libmodbus_bench.h"

#include <inttypes.h>
#include <stdio.h>
#include <sys/resource.h>

#include "tests/support/one_processor.h"
#include "tests/support/pause_watch.h"

/* Long beside what is no pause, and what is late is so within the silence, also
 * where the machine makes it 200 ms later. */
#define TIMEOUT_NS    (100 * MS)
#define DRAIN_NS      (60 * MS)
#define LONG_DRAIN_NS (250 * MS)

#define PAUSES 40 /* of the machine, at most, that spoil an answer */

#define RESPONSE_NS 100000 /* of the device */

static const struct modbus_rtu_line line = { .baud = 115200,
                                             .parity = MODBUS_PARITY_NONE,
                                             .stop_bits = 1 };

static struct libmodbus_bench bench;

static void pty_begin(int64_t drain_ns)
{
    const struct modbus_line_config config = { .line = line,
                                               .timeout_ns = TIMEOUT_NS,
                                               .drain_ns = drain_ns };

    libmodbus_bench_pty(&bench, config, RESPONSE_NS);
}

static struct pause_watch watch;
static bool watches;

static int down(void **state)
{
    (void)state;
    if (watches)
        pause_watch_end(&watch);
    watches = false;
    libmodbus_bench_end(&bench);
    return 0;
}

/* A pause makes answers late that are not late by design; the device is paused
 * too, so that they come when the silence is over, and are the next one's.
 * Only one that was seen to be there, since there were `before`, excuses a
 * wrong value.  A good answer that was refused is asked for again: were it lost
 * for another reason than a busy machine it would be so after every bad one, and
 * these are more than may be excused. */
static bool is_excused(int err, unsigned before, unsigned *excused)
{
    return (err != MOTION_OK || pause_watch_count(&watch) != before) &&
           ++*excused <= PAUSES;
}

/* False: not right, for a pause. */
static bool read_right(uint16_t address, bool spoilt, unsigned before,
                       unsigned *excused, bool *refused)
{
    const struct hal_modbus_reply reply = libmodbus_bench_read(&bench, address);
    const bool wrong =
        reply.err == MOTION_OK && reply.value[0] != bench.bank.reg[address];

    *refused = reply.err != MOTION_OK;
    if (!wrong && (spoilt || !*refused))
        return true;
    if (!is_excused(reply.err, before, excused))
        fail_msg("read %u, kind %d: %s, register %04X", address,
                 bench.faulty.from.fault, motion_err_text(reply.err),
                 reply.value[0]);
    return false;
}

/* Every kind of bad answer, several times; after each a good one.  Registers
 * all differ, so an answer to another request is seen.  The device's thread
 * reads `fault` when it answers, that is after the request was submitted. */
static void no_bad_answer_is_believed_on_a_terminal(void **state)
{
    unsigned wrong = 0, excused = 0;
    bool refused;

    (void)state;
    pty_begin(LONG_DRAIN_NS);
    pause_watch_start(&watch);
    watches = true;
    for (uint16_t i = 0; i < 120; i = (uint16_t)(i + 2)) {
        const unsigned before = atomic_load(&watch.pauses);

        bench.faulty.from.late_ns = TIMEOUT_NS + (5 + i % 40) * MS;
        bench.faulty.from.fault = (enum sim_modbus_fault)(
            SIM_MODBUS_LATE + i / 2 % (SIM_MODBUS_FAULTS - 1));
        (void)read_right(i, true, before, &excused, &refused);
        wrong += refused;
        bench.faulty.from.fault = SIM_MODBUS_GOOD;
        while (
            !read_right((uint16_t)(i + 1), false, before, &excused, &refused))
            ;
    }
    printf("%u of 60 refused, %u spoilt by a pause\n", wrong, excused);
    assert_true(wrong >= 45); /* a frame twice begins with a good one */
}

/* An answer is late by more than the first time-out, but not by the line's: it is
 * taken for that of the second request, which is the same one, and never for that
 * of the third.  That the first one cost little is judged by a time-out that is no
 * pause of the machine. */
static void a_line_that_is_taken_over_costs_no_time_out(void **state)
{
    const int64_t long_ns = 3000 * MS;
    const struct modbus_line_config config = { .line = line,
                                               .timeout_ns = long_ns,
                                               .drain_ns = long_ns,
                                               .takes_over = true };
    struct hal_modbus_reply first, second, third;

    (void)state;
    libmodbus_bench_pty(&bench, config, RESPONSE_NS);
    bench.faulty.from.late_ns = 200 * MS;
    bench.faulty.from.fault = SIM_MODBUS_LATE;
    first = libmodbus_bench_read(&bench, 3);
    assert_int_equal(first.err, MOTION_E_TIMEOUT);
    assert_true(first.done_ns - first.sent_ns < long_ns);
    bench.faulty.from.fault = SIM_MODBUS_GOOD;
    do
        second = libmodbus_bench_read(&bench, 3);
    while (second.err != MOTION_OK);
    assert_int_equal(second.value[0], bench.bank.reg[3]);
    assert_true(second.sent_ns - first.done_ns < long_ns);
    third = libmodbus_bench_read(&bench, 4);
    assert_int_equal(third.err, MOTION_OK);
    assert_int_equal(third.value[0], bench.bank.reg[4]);
    assert_true(third.sent_ns - second.done_ns >= long_ns);
}

/* Without a failure it is a line as any other from the first answer on. */
static void a_line_that_was_left_silent_is_taken_over_at_once(void **state)
{
    const int64_t long_ns = 3000 * MS;
    const struct modbus_line_config config = { .line = line,
                                               .timeout_ns = long_ns,
                                               .drain_ns = long_ns,
                                               .takes_over = true };
    struct hal_modbus_reply first, second;

    (void)state;
    libmodbus_bench_pty(&bench, config, RESPONSE_NS);
    first = libmodbus_bench_read(&bench, 3);
    assert_int_equal(first.err, MOTION_OK);
    bench.faulty.from.late_ns = 200 * MS;
    bench.faulty.from.fault = SIM_MODBUS_LATE;
    second = libmodbus_bench_read(&bench, 4);
    assert_int_equal(second.err, MOTION_OK);
    assert_int_equal(second.value[0], bench.bank.reg[4]);
    assert_true(second.sent_ns - first.done_ns < long_ns);
}

/* How often this thread went to sleep by itself: not how often, nor for how
 * long, it was not run. */
static long sleeps(void)
{
    struct rusage usage;

    assert_int_equal(getrusage(RUSAGE_THREAD, &usage), 0);
    return usage.ru_nvcsw;
}

/* The line is stuck in time-outs and drains all the while. */
static void the_tick_is_never_blocked(void **state)
{
    const struct hal_modbus_request request = {
        .unit = UNIT, .function = 3, .address = 0, .count = 1
    };
    struct hal_modbus_reply reply;
    unsigned refused = 0, timeouts = 0, blocked = 0;
    int64_t worst_ns = 0;

    (void)state;
    pty_begin(DRAIN_NS);
    bench.faulty.from.fault = SIM_MODBUS_MUTE;
    for (unsigned tick = 0; tick < 1500; tick++) {
        const long before = sleeps();
        const int64_t since_ns = libmodbus_bench_now_ns(&bench);

        while (hal_modbus_collect(&bench.libmodbus.modbus, &reply) == 1)
            timeouts += reply.err == MOTION_E_TIMEOUT;
        while (hal_modbus_submit(&bench.libmodbus.modbus, &request, 0) ==
               MOTION_OK)
            ;
        refused++;
        const int64_t took_ns = libmodbus_bench_now_ns(&bench) - since_ns;

        if (took_ns > worst_ns)
            worst_ns = took_ns;
        blocked += sleeps() != before;
        libmodbus_bench_pass(&bench);
    }
    printf("1500 ticks on a dead line, %u time-outs: worst tick %" PRId64
           " us, %u ticks slept\n",
           timeouts, worst_ns / 1000, blocked);
    assert_true(timeouts > 5 && refused == 1500);
    /* one that is stopped by a signal counts as asleep */
    assert_true(blocked <= 3);
}

/* A connection that is closed and not had again: answers are missing for three
 * time-outs, then it is gone. */
static void expect_gone(void)
{
    const int64_t since_ns = libmodbus_bench_now_ns(&bench);
    const int64_t timeout_ns = bench.libmodbus.config.timeout_ns;
    unsigned missing = 0;
    int err;

    while ((err = libmodbus_bench_read(&bench, 4).err) == MOTION_E_TIMEOUT) {
        assert_int_equal(hal_modbus_is_up(&bench.libmodbus.modbus), 1);
        missing++;
    }
    assert_int_equal(err, MOTION_E_IO);
    assert_int_equal(hal_modbus_is_up(&bench.libmodbus.modbus), 0);
    assert_true(missing >= 1 && missing <= 3);
    assert_true(libmodbus_bench_now_ns(&bench) - since_ns >= 3 * timeout_ns);
}

/* The server hangs up; the driver connects anew and goes on. */
static void a_server_that_went_away_is_found_again(void **state)
{
    const struct in_addr loopback = { htonl(INADDR_LOOPBACK) };
    struct modbus_line_config config = { .host = "127.0.0.1",
                                         .timeout_ns = 2000 * MS };
    struct hal_modbus_stats stats;
    unsigned tries = 0;

    (void)state;
    libmodbus_bench_device(&bench, &line, RESPONSE_NS);
    assert_int_equal(modbus_host_tcp(&bench.host, loopback, 0), 0);
    config.port = bench.host.port;
    bench.host.slave[UNIT] = &bench.bank.slave;
    assert_int_equal(modbus_host_start(&bench.host), 0);
    libmodbus_bench_open(&bench, &config);
    assert_int_equal(libmodbus_bench_read(&bench, 3).err, MOTION_OK);
    modbus_host_stop(&bench.host);
    expect_gone();
    modbus_host_init(&bench.host, &bench.world);
    assert_int_equal(modbus_host_tcp(&bench.host, loopback, config.port), 0);
    bench.host.slave[UNIT] = &bench.bank.slave;
    assert_int_equal(modbus_host_start(&bench.host), 0);
    while (libmodbus_bench_read(&bench, 5).err != MOTION_OK) {
        assert_true(++tries < PATIENCE);
        libmodbus_bench_pass(&bench);
    }
    hal_modbus_stats(&bench.libmodbus.modbus, &stats);
    assert_true(stats.reconnects >= 1);
}

/* An adapter that hears itself: what it has sent comes back before the answer.  A
 * write to a device that is not there is answered by nobody, though the answer
 * would look like the echo. */
static void an_echo_is_no_answer_on_a_terminal(void **state)
{
    const struct hal_modbus_request write = {
        .unit = UNIT + 1, .function = 6, .count = 1, .value = { 7 }
    };
    struct hal_modbus_stats stats;

    (void)state;
    pty_begin(DRAIN_NS);
    pthread_mutex_lock(&bench.host.lock);
    bench.wire.echo = true;
    pthread_mutex_unlock(&bench.host.lock);
    for (uint16_t i = 0; i < 8; i++) {
        const struct hal_modbus_reply reply = libmodbus_bench_read(&bench, i);

        assert_int_equal(reply.err, MOTION_OK);
        assert_int_equal(reply.value[0], bench.bank.reg[i]);
    }
    assert_int_equal(libmodbus_bench_ask(&bench, &write).err, MOTION_E_TIMEOUT);
    hal_modbus_stats(&bench.libmodbus.modbus, &stats);
    assert_int_equal(stats.echoes, 9);
    assert_int_equal(stats.stray, 0);
}

static struct sim_modbus_faulty server; /* what its frames meet */

static void tcp_begin(void)
{
    const struct in_addr loopback = { htonl(INADDR_LOOPBACK) };
    struct modbus_line_config config = { .host = "127.0.0.1",
                                         .timeout_ns = 400 * MS };

    libmodbus_bench_device(&bench, &line, RESPONSE_NS);
    bench.host.wire = &bench.wire;
    bench.host.slave[UNIT] = &bench.bank.slave;
    sim_modbus_faulty_init(&server, NULL, 4711);
    bench.host.faulty[UNIT] = &server;
    assert_int_equal(modbus_host_tcp(&bench.host, loopback, 0), 0);
    config.port = bench.host.port;
    assert_int_equal(modbus_host_start(&bench.host), 0);
    libmodbus_bench_open(&bench, &config);
    assert_int_equal(libmodbus_bench_read(&bench, 3).err, MOTION_OK);
}

/* What the server does from now on. */
static void tcp_fault(struct sim_modbus_direction from,
                      struct sim_modbus_direction to)
{
    pthread_mutex_lock(&bench.host.lock);
    server.from = from;
    server.to = to;
    pthread_mutex_unlock(&bench.host.lock);
}

static int tcp_read(uint16_t address)
{
    const struct hal_modbus_reply reply = libmodbus_bench_read(&bench, address);

    if (reply.err == MOTION_OK)
        assert_int_equal(reply.value[0], bench.bank.reg[address]);
    return reply.err;
}

static uint64_t tcp_reconnects(void)
{
    struct hal_modbus_stats stats;

    hal_modbus_stats(&bench.libmodbus.modbus, &stats);
    return stats.reconnects;
}

/* In either direction: late, later than the time-out, lost, spoilt, for another
 * unit, twice.  The driver keeps its connection, and is right again. */
static void tcp_frames_are_spoilt_and_recovered_from(void **state)
{
    const struct sim_modbus_direction good = { 0 };
    static const struct {
        struct sim_modbus_direction way;
        int err; /* of an answer, of a request */
        int err_to;
    } rows[] = {
        { { .impairment.delay_ns = 30 * MS }, MOTION_OK, MOTION_OK },
        { { .impairment.delay_ns = 30 * MS, .impairment.jitter_ns = 20 * MS },
          MOTION_OK,
          MOTION_OK },
        { { .impairment.delay_ns = 900 * MS },
          MOTION_E_TIMEOUT,
          MOTION_E_TIMEOUT },
        { { .impairment.loss_q32 = UINT64_C(1) << 32, .resends = true },
          MOTION_E_TIMEOUT,
          MOTION_E_TIMEOUT },
        { { .fault = SIM_MODBUS_FLIP }, MOTION_E_TIMEOUT, MOTION_E_TIMEOUT },
        { { .fault = SIM_MODBUS_OTHER_UNIT },
          MOTION_E_PROTOCOL,
          MOTION_E_PROTOCOL },
        { { .fault = SIM_MODBUS_MUTE }, MOTION_E_TIMEOUT, MOTION_E_TIMEOUT },
    };

    (void)state;
    tcp_begin();
    const uint64_t before = tcp_reconnects();
    for (unsigned i = 0; i < 2 * ARRAY_LEN(rows); i++) {
        const bool to = i >= ARRAY_LEN(rows);
        const unsigned row = i % ARRAY_LEN(rows);
        const int want = to ? rows[row].err_to : rows[row].err;

        tcp_fault(to ? good : rows[row].way, to ? rows[row].way : good);
        const int err = tcp_read(7);
        if (err != want)
            fail_msg("row %u, %s: %s", row, to ? "to" : "from",
                     motion_err_text(err));
        tcp_fault(good, good);
        assert_int_equal(tcp_read((uint16_t)(8 + i)), MOTION_OK);
    }
    const struct sim_modbus_direction twice = { .impairment.duplication_q32 =
                                                    UINT64_C(1) << 32 };
    for (uint16_t i = 0; i < 6; i++) { /* the second one is no answer */
        tcp_fault(twice, good);
        assert_int_equal(tcp_read(i), MOTION_OK);
    }
    assert_int_equal(tcp_reconnects(), before);
}

/* Its other end is gone without a word: three time-outs, and a new connection. */
static void a_half_open_connection_is_made_anew(void **state)
{
    (void)state;
    tcp_begin();
    const uint64_t before = tcp_reconnects();
    pthread_mutex_lock(&bench.host.lock);
    bench.wire.deaf = true;
    pthread_mutex_unlock(&bench.host.lock);
    for (unsigned i = 0; i < 20; i++) /* the server has looked */
        libmodbus_bench_pass(&bench);
    for (unsigned i = 0; i < 3; i++) {
        assert_int_equal(tcp_reconnects(), before);
        assert_int_equal(tcp_read(7), MOTION_E_TIMEOUT);
    }
    assert_int_equal(tcp_read(8), MOTION_OK);
    assert_int_equal(tcp_reconnects(), before + 1);
}

/* It ends every connection: said after three time-outs, and over when it takes one
 * again. */
static void a_server_that_hangs_up_is_said(void **state)
{
    unsigned tries = 0;

    (void)state;
    tcp_begin();
    pthread_mutex_lock(&bench.host.lock);
    bench.wire.closed = true;
    pthread_mutex_unlock(&bench.host.lock);
    for (unsigned i = 0; i < 20; i++)
        libmodbus_bench_pass(&bench);
    expect_gone();
    pthread_mutex_lock(&bench.host.lock);
    bench.wire.closed = false;
    pthread_mutex_unlock(&bench.host.lock);
    while (tcp_read(8) != MOTION_OK) {
        assert_true(++tries < PATIENCE);
        libmodbus_bench_pass(&bench);
    }
}

static void what_cannot_be_opened_says_so(void **state)
{
    struct modbus_line_config config = { .device = "/dev/null/none",
                                         .line = line };
    struct modbus_line_config bad = config;

    (void)state;
    libmodbus_bench_clear(&bench);
    bad.line.baud = 250000; /* libmodbus would take 9600 */
    assert_int_equal(modbus_libmodbus_open(&bench.libmodbus, &bad),
                     MOTION_E_ARG);
    libmodbus_bench_open(&bench, &config);
    assert_int_equal(libmodbus_bench_read(&bench, 0).err, MOTION_E_IO);
    assert_int_equal(hal_modbus_is_up(&bench.libmodbus.modbus), 0);
}

int main(void)
{
#define RUN(test) cmocka_unit_test_teardown(test, down)
    const struct CMUnitTest tests[] = {
        RUN(no_bad_answer_is_believed_on_a_terminal),
        RUN(a_line_that_is_taken_over_costs_no_time_out),
        RUN(a_line_that_was_left_silent_is_taken_over_at_once),
        RUN(the_tick_is_never_blocked),
        RUN(a_server_that_went_away_is_found_again),
        RUN(an_echo_is_no_answer_on_a_terminal),
        RUN(tcp_frames_are_spoilt_and_recovered_from),
        RUN(a_half_open_connection_is_made_anew),
        RUN(a_server_that_hangs_up_is_said),
        RUN(what_cannot_be_opened_says_so),
    };
    one_processor();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
