/* tests/sim/bus/test_sim_modbus.c - the simulated line: bit time, how much of
 * the line a master uses, and everything that can come instead of an answer. */
#include "sim/bus/modbus.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "hal/modbus/master.h"
#include "hal/modbus/rtu_slave.h"
#include "tests/hal/linux/modbus_bank.h"
#include "tests/support/check.h"
#include "tests/support/rtu_frame.h"

#define MS   INT64_C(1000000)
#define UNIT 9

static struct bench {
    struct sim_world world;
    struct sim_modbus_line wire;
    struct sim_modbus_seat seat[2];
    struct modbus_master master;
    struct modbus_bank bank;
    struct modbus_rtu_slave slave;
    struct sim_modbus_faulty faulty;
} bench;

static void bench_init(const struct modbus_rtu_line *line,
                       int64_t turnaround_ns)
{
    const struct modbus_master_config config = { .line = *line,
                                                 .timeout_ns = 30 * MS,
                                                 .drain_ns = 60 * MS };

    memset(&bench, 0, sizeof bench);
    modbus_bank_init(&bench.bank);
    sim_world_init(&bench.world, 1000 * MS);
    assert_int_equal(sim_modbus_line_init(&bench.wire, &bench.world, line), 0);
    assert_int_equal(modbus_rtu_slave_init(&bench.slave, &bench.bank.slave,
                                           UNIT, line, turnaround_ns),
                     0);
    sim_modbus_faulty_init(&bench.faulty, &bench.slave.station, 4711);
    assert_int_equal(sim_modbus_seat_init(&bench.seat[0], &bench.wire,
                                          &bench.faulty.station),
                     0);
    assert_int_equal(modbus_master_init(&bench.master, &config), 0);
    assert_int_equal(sim_modbus_seat_init(&bench.seat[1], &bench.wire,
                                          &bench.master.station),
                     0);
}

static const struct modbus_rtu_line line_115200 = {
    .baud = 115200, .parity = MODBUS_PARITY_EVEN, .stop_bits = 1
};

static struct hal_modbus_reply
transact(const struct hal_modbus_request *request)
{
    struct hal_modbus_reply reply = { 0 };

    assert_int_equal(hal_modbus_submit(&bench.master.modbus, request, 1), 0);
    for (unsigned i = 0; i < 3000; i++) {
        sim_world_run(&bench.world, bench.world.now_ns + MS);
        if (hal_modbus_collect(&bench.master.modbus, &reply) == 1)
            return reply;
    }
    fail_msg("no reply");
    return reply;
}

/* Request 8 characters of 11 bits, silence, turn-around, answer 9, silence. */
static void a_transaction_takes_its_bits(void **state)
{
    const struct hal_modbus_request request = { .unit = UNIT,
                                                .function = 3,
                                                .count = 2 };
    const int64_t bit_ns_x = 1000000000; /* per 115200 */

    (void)state;
    bench_init(&line_115200, 250000);
    const struct hal_modbus_reply reply = transact(&request);
    const int64_t request_ns = (8 * 11 * bit_ns_x + 115199) / 115200;
    const int64_t answer_ns = (9 * 11 * bit_ns_x + 115199) / 115200;

    assert_int_equal(reply.err, MOTION_OK);
    assert_in_range(reply.answer_ns - reply.sent_ns,
                    request_ns + 1750000 + 250000 - 2,
                    request_ns + 1750000 + 250000 + 2);
    assert_in_range(reply.done_ns - reply.answer_ns, answer_ns + 1750000 - 2,
                    answer_ns + 1750000 + 2);
}

/* ---- how much of the line is used ---- */

static const struct load {
    uint32_t baud;
    enum modbus_parity parity;
    uint8_t stop_bits, function;
    uint16_t count;
    int64_t tick_ns;
} loads[] = {
    { 9600, MODBUS_PARITY_EVEN, 1, 3, 2, MS },
    { 19200, MODBUS_PARITY_NONE, 2, 16, 8, MS },
    { 38400, MODBUS_PARITY_NONE, 2, 3, 125, MS },
    { 115200, MODBUS_PARITY_EVEN, 1, 3, 2, MS },
    { 115200, MODBUS_PARITY_NONE, 1, 6, 1, 4 * MS },
    { 1000000, MODBUS_PARITY_NONE, 1, 3, 10, 2 * MS },
    { 1000000, MODBUS_PARITY_NONE, 1, 16, 8, 20 * MS },
};

/* As a fieldbus does: collect and refill at every tick. */
static unsigned transactions_in(int64_t dur_ns, const struct load *load)
{
    const struct hal_modbus_request request = { .unit = UNIT,
                                                .function = load->function,
                                                .count = load->count };
    const int64_t end_ns = bench.world.now_ns + dur_ns;
    struct hal_modbus_reply reply;
    unsigned good = 0;

    while (bench.world.now_ns < end_ns) {
        while (hal_modbus_submit(&bench.master.modbus, &request, 0) ==
               MOTION_OK)
            ;
        sim_world_run(&bench.world, bench.world.now_ns + load->tick_ns);
        while (hal_modbus_collect(&bench.master.modbus, &reply) == 1)
            good += reply.err == MOTION_OK && reply.done_ns <= end_ns;
    }
    return good;
}

static void a_line_carries_95_percent_of_what_it_allows(void **state)
{
    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(loads); i++) {
        const struct load *load = &loads[i];
        const struct modbus_rtu_line line = { .baud = load->baud,
                                              .parity = load->parity,
                                              .stop_bits = load->stop_bits };
        const struct hal_modbus_request request = { .unit = UNIT,
                                                    .function = load->function,
                                                    .count = load->count };

        bench_init(&line, 0);
        const double allowed = 20e9 / (double)modbus_rtu_transaction_ns(
                                          &bench.master.time, &request);
        const unsigned good = transactions_in(20000 * MS, load);
        printf("%7u baud, function %2u, %3u registers: %7.1f transactions/s "
               "of %7.1f allowed (%.1f %%)\n",
               load->baud, load->function, load->count, good / 20.0,
               allowed / 20, 100 * good / allowed);
        if (good < 0.95 * allowed || good > allowed)
            fail_msg("row %u", i);
    }
}

/* ---- what can come instead of an answer ---- */

static struct hal_modbus_reply read_counter(uint16_t expected)
{
    const struct hal_modbus_request request = {
        .unit = UNIT, .function = 3, .address = 4, .count = 2
    };

    bench.bank.reg[4] = expected;
    bench.bank.reg[5] = (uint16_t)~expected;
    return transact(&request);
}

static void expect_recovered(uint16_t value)
{
    bench.faulty.from.fault = SIM_MODBUS_GOOD;
    const struct hal_modbus_reply reply = read_counter(value);

    assert_int_equal(reply.err, MOTION_OK);
    assert_int_equal(reply.value[0], value);
}

static void every_fault_is_told_and_recovered_from(void **state)
{
    static const struct {
        enum sim_modbus_fault fault;
        int err;
    } rows[] = {
        { SIM_MODBUS_LATE, MOTION_E_TIMEOUT },
        { SIM_MODBUS_MUTE, MOTION_E_TIMEOUT },
        { SIM_MODBUS_EXCEPTION, MOTION_E_REFUSED },
        { SIM_MODBUS_WRONG_CRC, MOTION_E_PROTOCOL },
        { SIM_MODBUS_OTHER_UNIT, MOTION_E_PROTOCOL },
        { SIM_MODBUS_HALF, MOTION_E_PROTOCOL },
        { SIM_MODBUS_TWICE, MOTION_OK },
        { SIM_MODBUS_NOISE, MOTION_E_PROTOCOL },
        { SIM_MODBUS_FLIP, MOTION_E_PROTOCOL },
        { SIM_MODBUS_GATEWAY, MOTION_E_REFUSED },
        { SIM_MODBUS_STRAYS, MOTION_OK },
    };

    (void)state;
    bench_init(&line_115200, 100000);
    bench.faulty.from.late_ns =
        50 * MS; /* beyond the time-out, inside the drain */
    for (unsigned i = 0; i < ARRAY_LEN(rows); i++) {
        bench.faulty.from.fault = rows[i].fault;
        const struct hal_modbus_reply reply = read_counter((uint16_t)(10 * i));
        if (reply.err != rows[i].err)
            fail_msg("fault %d: %s", rows[i].fault, motion_err_text(reply.err));
        expect_recovered((uint16_t)(10 * i + 1));
    }
}

/* The same faults while the mailbox is full: the next request is already there
 * when the late answer comes. */
static void a_late_answer_is_never_the_next_ones(void **state)
{
    struct hal_modbus_reply reply;
    unsigned good = 0;

    (void)state;
    bench_init(&line_115200, 100000);
    for (uint16_t i = 0; i < 400; i++) {
        const struct hal_modbus_request request = {
            .unit = UNIT, .function = 3, .address = i % 64, .count = 1
        };

        bench.faulty.from.fault =
            i % 10 == 3 ? SIM_MODBUS_LATE : SIM_MODBUS_GOOD;
        bench.faulty.from.late_ns = (25 + i % 40) * MS;
        while (hal_modbus_submit(&bench.master.modbus, &request, i % 64) !=
               MOTION_OK) {
            sim_world_run(&bench.world, bench.world.now_ns + MS);
            while (hal_modbus_collect(&bench.master.modbus, &reply) == 1) {
                if (reply.err != MOTION_OK)
                    continue;
                assert_int_equal(reply.value[0], bench.bank.reg[reply.tag]);
                good++;
            }
        }
    }
    assert_true(good > 250);
}

/* Kinds, places and bits at random. */
#define CORRUPTIONS 100000

static void no_corruption_is_taken_for_an_answer(void **state)
{
    uint64_t seed = 20240607;
    unsigned refused = 0, broken = 0, late = 0, good = 0;

    (void)state;
    bench_init(&line_115200, 100000);
    for (unsigned i = 0; i < CORRUPTIONS; i++) {
        bench.faulty.from.fault = (enum sim_modbus_fault)check_random_in(
            &seed, SIM_MODBUS_LATE, SIM_MODBUS_FAULTS - 1);
        bench.faulty.from.late_ns = check_random_in(&seed, 1, 60) * MS;
        const struct hal_modbus_reply reply = read_counter((uint16_t)i);

        if (reply.err == MOTION_OK &&
            (reply.count != 2 || reply.value[0] != (uint16_t)i ||
             reply.value[1] != (uint16_t)~i))
            fail_msg("corruption %u, kind %d: wrong value accepted", i,
                     bench.faulty.from.fault);
        good += reply.err == MOTION_OK;
        refused += reply.err == MOTION_E_REFUSED;
        broken += reply.err == MOTION_E_PROTOCOL;
        late += reply.err == MOTION_E_TIMEOUT;
        if (i % 16 == 15)
            expect_recovered((uint16_t)(i + 1));
    }
    printf("%d corruptions: %u broken, %u exceptions, %u time-outs, %u right "
           "(late within the time-out)\n",
           CORRUPTIONS, broken, refused, late, good);
    /* 5 of the 11 kinds, 2 more */
    assert_true(broken > CORRUPTIONS * 2 / 5 && refused > CORRUPTIONS / 20);
    expect_recovered(1);
}

/* Requests spoilt on their way: the slave must do nothing wrong. */
static void no_corrupted_request_writes(void **state)
{
    uint64_t seed = 99;
    uint8_t frame[MODBUS_FRAME_MAX];
    struct modbus_station *slave;
    int64_t now_ns = 1000 * MS;

    (void)state;
    bench_init(&line_115200, 0);
    slave = &bench.slave.station;
    for (unsigned i = 0; i < CORRUPTIONS; i++) {
        const struct hal_modbus_request request = { .unit = UNIT,
                                                    .function = 6,
                                                    .address = 3,
                                                    .count = 1,
                                                    .value = { 0x5A5A } };
        unsigned length = (unsigned)rtu_frame_put_request(&request, frame);

        length =
            sim_modbus_spoil((enum sim_modbus_fault)check_random_in(
                                 &seed, SIM_MODBUS_WRONG_CRC, SIM_MODBUS_FLIP),
                             &seed, frame, length);
        slave->ops->recv(slave, frame, length, now_ns);
        now_ns += 10 * MS;
        while (slave->ops->poll(slave, now_ns, frame) > 0)
            slave->ops->sent(slave, now_ns);
    }
    assert_int_equal(bench.bank.writes, 0);
    assert_int_equal(bench.slave.served, 0);
}

/* ---- the line itself ---- */

/* Two masters at once. */
static void who_talks_at_once_spoils_both(void **state)
{
    const struct hal_modbus_request request = { .unit = UNIT,
                                                .function = 3,
                                                .count = 2 };
    const struct modbus_master_config config = { .line = line_115200 };
    struct modbus_master second;
    struct sim_modbus_seat seat;

    (void)state;
    bench_init(&line_115200, 0);
    assert_int_equal(modbus_master_init(&second, &config), 0);
    assert_int_equal(sim_modbus_seat_init(&seat, &bench.wire, &second.station),
                     0);
    assert_int_equal(hal_modbus_submit(&second.modbus, &request, 1), 0);
    const struct hal_modbus_reply reply = transact(&request);
    assert_int_not_equal(reply.err, MOTION_OK);
    assert_int_equal(bench.wire.collisions, 1);
    expect_recovered(3);
}

static void a_cut_line_times_out_and_comes_back(void **state)
{
    (void)state;
    bench_init(&line_115200, 0);
    bench.wire.cut = true;
    assert_int_equal(read_counter(1).err, MOTION_E_TIMEOUT);
    bench.wire.cut = false;
    expect_recovered(2);
}

/* Requests that come late, twice or spoilt are answered late, not, or again: no
 * answer is ever another one's. */
static void requests_meet_the_same_faults(void **state)
{
    struct sim_modbus_direction *const to = &bench.faulty.to;

    (void)state;
    bench_init(&line_115200, 100000);
    bench.faulty.time = &bench.wire.time;
    to->fault = SIM_MODBUS_FLIP;
    assert_int_equal(read_counter(1).err, MOTION_E_TIMEOUT);
    assert_int_equal(bench.slave.served, 0);
    to->fault = SIM_MODBUS_OTHER_UNIT;
    assert_int_equal(read_counter(2).err, MOTION_E_TIMEOUT);
    assert_int_equal(bench.slave.served, 0);
    to->fault = SIM_MODBUS_GOOD;
    to->impairment.delay_ns = 20 * MS;
    const struct hal_modbus_reply late = read_counter(3);
    assert_int_equal(late.err, MOTION_OK);
    assert_true(late.answer_ns - late.sent_ns > 20 * MS);
    to->impairment.delay_ns =
        45 * MS; /* answered while the master listens alone */
    assert_int_equal(read_counter(4).err, MOTION_E_TIMEOUT);
    to->impairment.delay_ns = 0;
    expect_recovered(5);
    to->impairment.duplication_q32 = UINT64_C(1) << 32;
    assert_int_equal(read_counter(6).err, MOTION_OK);
    to->impairment.duplication_q32 = 0;
    sim_world_run(&bench.world, bench.world.now_ns + 20 * MS);
    expect_recovered(7);
}

/* The adapter hears its own request in front of every answer.  What it hears is
 * what an answer to a write would be: where nobody answers, the write is not
 * believed. */
static void an_echo_is_no_answer(void **state)
{
    struct hal_modbus_request write = {
        .unit = UNIT, .function = 6, .address = 4, .count = 1, .value = { 77 }
    };

    (void)state;
    bench_init(&line_115200, 100000);
    bench.wire.adapter = &bench.seat[1];
    bench.wire.echo = true;
    assert_int_equal(read_counter(1).err, MOTION_OK);
    assert_int_equal(transact(&write).err, MOTION_OK);
    assert_int_equal(bench.bank.reg[4], 77);
    write.unit++;
    assert_int_equal(transact(&write).err, MOTION_E_TIMEOUT);
    assert_int_equal(bench.master.stats.echoes, 3);
    assert_int_equal(bench.master.stats.stray, 0);
    bench.wire.echo = false;
    expect_recovered(2);
    write.unit = UNIT;
    write.value[0] = 78;
    assert_int_equal(transact(&write).err, MOTION_OK);
    assert_int_equal(bench.bank.reg[4], 78);
}

/* An adapter that holds the line too long cuts the answer's beginning off. */
static void an_answer_before_the_turn_is_cut(void **state)
{
    const int64_t answer_ns = 100000;

    (void)state;
    bench_init(&line_115200, answer_ns);
    bench.wire.adapter = &bench.seat[1];
    /* the slave answers 3.5 characters and its own time after the request */
    bench.wire.turn_ns = bench.wire.time.gap_ns + answer_ns;
    assert_int_equal(read_counter(1).err, MOTION_OK);
    bench.wire.turn_ns += 1000;
    assert_int_equal(read_counter(2).err, MOTION_E_PROTOCOL);
    bench.wire.turn_ns = 10 * MS; /* all of it */
    assert_int_equal(read_counter(3).err, MOTION_E_TIMEOUT);
    bench.wire.turn_ns = 0;
    expect_recovered(4);
}

/* Another master asks the same unit whoever else talks: frames collide, and its
 * answers are never taken for ours. */
static void another_master_collides_with_us(void **state)
{
    struct sim_modbus_intruder intruder;
    unsigned good = 0, failed = 0;

    (void)state;
    bench_init(&line_115200, 100000);
    assert_int_equal(sim_modbus_intruder_init(&intruder, &bench.wire, 4711), 0);
    bench.bank.reg[0] = 0xAAAA;
    bench.bank.reg[1] = 0xBBBB;
    intruder.unit = UNIT;
    intruder.pause_ns = 150 * MS; /* the line is to be silent for 60 ms */
    intruder.on = true;
    for (uint16_t i = 0; i < 400; i++) {
        const struct hal_modbus_reply reply = read_counter(i);

        good += reply.err == MOTION_OK;
        failed += reply.err != MOTION_OK;
        if (reply.err == MOTION_OK)
            assert_int_equal(reply.value[0], i);
    }
    printf("%u answered, %u not, %u collisions\n", good, failed,
           (unsigned)bench.wire.collisions);
    assert_true(good > 200 && failed > 30 && bench.wire.collisions > 20);
    intruder.on = false;
    sim_world_run(&bench.world, bench.world.now_ns + 100 * MS);
    expect_recovered(1);
}

/* Its port says so at once, and again when it is back. */
static void a_port_that_is_gone_fails_at_once(void **state)
{
    (void)state;
    bench_init(&line_115200, 100000);
    bench.master.down = true;
    const int64_t before_ns = bench.world.now_ns;
    assert_int_equal(read_counter(1).err, MOTION_E_IO);
    assert_true(bench.world.now_ns - before_ns <= MS);
    assert_int_equal(hal_modbus_is_up(&bench.master.modbus), 0);
    bench.master.down = false;
    assert_int_equal(hal_modbus_is_up(&bench.master.modbus), 1);
    expect_recovered(2);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_transaction_takes_its_bits),
        cmocka_unit_test(a_line_carries_95_percent_of_what_it_allows),
        cmocka_unit_test(every_fault_is_told_and_recovered_from),
        cmocka_unit_test(a_late_answer_is_never_the_next_ones),
        cmocka_unit_test(no_corruption_is_taken_for_an_answer),
        cmocka_unit_test(no_corrupted_request_writes),
        cmocka_unit_test(who_talks_at_once_spoils_both),
        cmocka_unit_test(a_cut_line_times_out_and_comes_back),
        cmocka_unit_test(requests_meet_the_same_faults),
        cmocka_unit_test(an_echo_is_no_answer),
        cmocka_unit_test(an_answer_before_the_turn_is_cut),
        cmocka_unit_test(another_master_collides_with_us),
        cmocka_unit_test(a_port_that_is_gone_fails_at_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
