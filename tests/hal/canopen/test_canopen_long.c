/* tests/hal/canopen/test_canopen_long.c - long SDO transfers, client against
 * server, on a good line and on a bad one.
 *
 * Client (hal/canopen_*) and server (sim/cia402_*) were written apart from each
 * other; a hand on the line between them loses, repeats, delays, cuts and
 * changes frames. */
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "tests/hal/canopen/canopen_bench.h"

#include "hal/canopen/canopen.h"
#include "sim/device/cia402/servo.h"
#include "tests/support/can_behind.h"

#define NODE  5
#define NOTES 0x2002
#define HELD  256

/* What may happen to a frame on its way to the client. */
enum corrupt {
    CORRUPT_NONE,
    CORRUPT_LOSE,
    CORRUPT_REPEAT,
    CORRUPT_SHORT,
    CORRUPT_NODE,    /* another node's */
    CORRUPT_OBJECT,  /* another index */
    CORRUPT_COMMAND, /* another kind of answer */
    CORRUPT_ABORT,   /* the server gives up */
    CORRUPT_DELAY,   /* this one and all after it */
    CORRUPTIONS,
};

/* A port with a hand on it. */
struct line {
    struct can_behind port;
    uint64_t seed;
    unsigned one_in; /* so many frames are left alone for one that is not; 0:
                        all are */
    struct hal_can_frame held[HELD];
    unsigned head, count;
    int64_t now_ns, until_ns; /* frames are held back until then */
    unsigned done[CORRUPTIONS];
};

static void line_hold(struct line *line, const struct hal_can_frame *frame)
{
    assert_true(line->count < HELD);
    line->held[(line->head + line->count++) % HELD] = *frame;
}

static void line_corrupt(struct line *line, struct hal_can_frame *frame)
{
    enum corrupt corrupt = CORRUPT_NONE;

    if (line->one_in > 0 && check_random(&line->seed) % line->one_in == 0)
        corrupt =
            (enum corrupt)check_random_in(&line->seed, 1, CORRUPTIONS - 1);
    line->done[corrupt]++;
    switch (corrupt) {
    case CORRUPT_LOSE:
        return;
    case CORRUPT_REPEAT:
        line_hold(line, frame);
        break;
    case CORRUPT_SHORT:
        frame->len = (uint8_t)check_random_in(&line->seed, 0, 7);
        break;
    case CORRUPT_NODE:
        frame->id = 0x580 + NODE + 1;
        break;
    case CORRUPT_OBJECT: /* of the answers that name one */
        if (frame->data[0] >> 5 == 0)
            return;
        frame->data[1] ^= 0x10;
        break;
    case CORRUPT_COMMAND: /* bits 7-5 */
        frame->data[0] ^= (uint8_t)(check_random_in(&line->seed, 1, 7) << 5);
        break;
    case CORRUPT_ABORT:
        frame->data[0] = 0x80;
        frame->data[1] = (uint8_t)NOTES;
        frame->data[2] = NOTES >> 8;
        frame->data[3] = 0;
        break;
    case CORRUPT_DELAY:
        line->until_ns =
            line->now_ns + check_random_in(&line->seed, 1, 400) * MS;
        break;
    case CORRUPT_NONE:
    case CORRUPTIONS:
        break;
    }
    line_hold(line, frame);
}

static int line_recv(struct hal_can *can, struct hal_can_frame *frame)
{
    struct line *line = CONTAINER_OF(can, struct line, port.can);

    while (line->count < HELD / 2 && hal_can_recv(line->port.inner, frame) == 1)
        line_corrupt(line, frame);
    if (line->count == 0 || line->now_ns < line->until_ns)
        return 0;
    *frame = line->held[line->head];
    line->head = (line->head + 1) % HELD;
    line->count--;
    return 1;
}

static const struct hal_can_ops line_ops = {
    .send = can_behind_send,
    .flush = can_behind_flush,
    .recv = line_recv,
    .state = can_behind_state,
    .stats = can_behind_stats,
};

/* ---- the bench ---- */

struct bench {
    struct sim_world world;
    struct sim_can_bus bus;
    struct sim_can_port port;
    struct sim_cia402 servo;
    struct line line;
    struct canopen master;
    struct canopen_node node;
};

static int bench_setup(void **state)
{
    static struct bench b;
    static const struct canopen_node_ops none = { .step = NULL };
    const struct sim_cia402_config servo = {
        .node_id = NODE,
        .plant = CANOPEN_BENCH_PLANT,
        .loop_ns = 250000,
    };
    const struct canopen_config config = { .node_id = 127, .sdo_gap_ns = 1 };

    memset(&b, 0, sizeof b);
    canopen_bench_wire(&b.world, &b.bus, &b.port);
    assert_int_equal(sim_cia402_init(&b.servo, &b.bus, &servo), 0);
    b.line =
        (struct line){ .port = { { &line_ops }, &b.port.can }, .seed = 77 };
    assert_int_equal(canopen_init(&b.master, &b.line.port.can, &config), 0);
    b.node = (struct canopen_node){ .ops = &none, .id = NODE };
    assert_int_equal(canopen_add(&b.master, &b.node), 0);
    *state = &b;
    return 0;
}

static void cycle(struct bench *b)
{
    b->line.now_ns = b->world.now_ns + MS;
    canopen_bench_cycle(&b->world, &b->master);
}

static int outcome(struct bench *b)
{
    int err = MOTION_E_AGAIN;

    for (unsigned i = 0; err == MOTION_E_AGAIN; i++) {
        assert_true(i < 20000);
        cycle(b);
        err = canopen_sdo_take(&b->node, NULL, NULL);
    }
    return err;
}

static int put(struct bench *b, const uint8_t *from, uint32_t length,
               bool block)
{
    cycle(b);
    assert_int_equal(canopen_sdo_write_bytes(&b->node, b->world.now_ns, NOTES,
                                             0, from, length, block),
                     MOTION_OK);
    return outcome(b);
}

static int get(struct bench *b, uint8_t *into, uint32_t capacity, bool block)
{
    cycle(b);
    assert_int_equal(canopen_sdo_read_bytes(&b->node, b->world.now_ns, NOTES, 0,
                                            into, capacity, block),
                     MOTION_OK);
    return outcome(b);
}

/* ---- a good line ---- */

static void every_length_goes_both_ways(void **state)
{
    struct bench *b = *state;
    uint8_t from[SIM_CIA402_NOTES], into[SIM_CIA402_NOTES + 1];
    uint64_t seed = 3;

    for (uint32_t length = 1; length <= SIM_CIA402_NOTES;
         length += length < 40     ? 1
                   : length < 1000 ? 61
                                   : 1)
        for (unsigned kind = 0; kind < 4; kind++) {
            for (uint32_t i = 0; i < length; i++)
                from[i] = (uint8_t)check_random(&seed);
            memset(into, 0xEE, sizeof into);
            if (put(b, from, length, kind & 1) != MOTION_OK ||
                get(b, into, length, kind & 2) != MOTION_OK ||
                b->node.sdo.length != length ||
                memcmp(from, into, length) != 0 || into[length] != 0xEE)
                fail_msg("%" PRIu32 " bytes, kind %u: abort %08" PRIX32, length,
                         kind, b->node.sdo.abort_code);
        }
    assert_int_equal(b->master.stats.sdo_timeouts, 0);
    assert_int_equal(b->master.stats.unexpected, 0);
}

static void a_room_too_small_is_not_overrun(void **state)
{
    struct bench *b = *state;
    uint8_t from[100] = { 1 }, into[100];

    assert_int_equal(put(b, from, sizeof from, false), MOTION_OK);
    for (unsigned block = 0; block < 2; block++)
        for (uint32_t capacity = 1; capacity < 100; capacity += 7) {
            memset(into, 0xEE, sizeof into);
            assert_int_equal(get(b, into, capacity, block), MOTION_E_REFUSED);
            assert_int_equal(b->node.sdo.abort_code, CANOPEN_ABORT_MEMORY);
            for (uint32_t i = capacity; i < sizeof into; i++)
                assert_int_equal(into[i], 0xEE);
        }
    assert_int_equal(get(b, into, 100, true), MOTION_OK);
}

static void a_number_is_read_and_written_the_long_way_too(void **state)
{
    struct bench *b = *state;
    uint8_t into[8];

    cycle(b);
    assert_int_equal(canopen_sdo_read_bytes(&b->node, b->world.now_ns, 0x1000,
                                            0, into, sizeof into, false),
                     MOTION_OK);
    assert_int_equal(outcome(b), MOTION_OK);
    assert_int_equal(b->node.sdo.length, 4);
    assert_memory_equal(into, "\x92\x01\x02\x00", 4);
    assert_int_equal(canopen_sdo_write_bytes(&b->node, b->world.now_ns, 0x1017,
                                             0, (const uint8_t *)"\x64\x00", 2,
                                             false),
                     MOTION_OK);
    assert_int_equal(outcome(b), MOTION_OK);
    cycle(b);
    assert_int_equal(canopen_sdo_read_bytes(&b->node, b->world.now_ns, 0x1000,
                                            0, into, sizeof into, true),
                     MOTION_OK);
    assert_int_equal(outcome(b), MOTION_E_REFUSED); /* not by blocks */
    assert_int_equal(b->node.sdo.abort_code, CANOPEN_ABORT_COMMAND);
}

static void a_drop_in_the_middle_frees_the_server(void **state)
{
    struct bench *b = *state;
    uint8_t bytes[500] = { 9 };

    for (unsigned block = 0; block < 2; block++)
        for (unsigned after = 1; after < 40; after++) {
            cycle(b);
            assert_int_equal(canopen_sdo_write_bytes(&b->node, b->world.now_ns,
                                                     NOTES, 0, bytes, 500,
                                                     block),
                             MOTION_OK);
            for (unsigned i = 0; i < after; i++)
                cycle(b);
            canopen_sdo_drop(&b->node);
            assert_int_equal(put(b, bytes, 8, block), MOTION_OK);
        }
}

/* ---- a bad line ---- */

/* The line is good again.  Where the server believes a transfer to be open that
 * the client has left, the first request may be all it takes to end it. */
static void mend(struct bench *b)
{
    uint8_t into[SIM_CIA402_NOTES];

    b->line.one_in = 0;
    b->line.until_ns = 0;
    for (unsigned i = 0; i < 5; i++)
        cycle(b);
    (void)get(b, into, sizeof into, false);
}

struct tally {
    unsigned good, refused;
};

/* Reads `length` bytes that must be those of `from`, or be refused. */
static void read_on_a_bad_line(struct bench *b, const uint8_t *from,
                               uint32_t length, bool block, struct tally *tally)
{
    uint8_t into[400];

    if (get(b, into, length, block) != MOTION_OK) {
        tally->refused++;
        return;
    }
    tally->good++;
    if (b->node.sdo.length != length || memcmp(from, into, length) != 0)
        fail_msg("%u frames corrupted: a wrong value",
                 b->line.done[CORRUPT_LOSE]);
}

static unsigned corruptions(const struct bench *b)
{
    unsigned sum = 0;

    for (unsigned i = 1; i < CORRUPTIONS; i++)
        sum += b->line.done[i];
    return sum;
}

/* What the client accepts is what the server has, to the byte, whatever
 * happens in between; and when the line is good again it works at once. */
static void a_bad_line_never_gives_a_wrong_value(void **state)
{
    struct bench *b = *state;
    uint8_t from[400];
    struct tally tally = { 0 };

    while (corruptions(b) < 100000) {
        const uint32_t length =
            (uint32_t)check_random_in(&b->line.seed, 1, sizeof from);
        const bool block = check_random(&b->line.seed) & 1;

        for (uint32_t i = 0; i < length; i++)
            from[i] = (uint8_t)check_random(&b->line.seed);
        assert_int_equal(put(b, from, length, block), MOTION_OK);
        b->line.one_in = 1 + (unsigned)(check_random(&b->line.seed) % 40);
        for (unsigned i = 0; i < 40; i++)
            read_on_a_bad_line(b, from, length, block, &tally);
        mend(b);
    }
    print_message("%u frames corrupted, %u values right, %u refused\n",
                  corruptions(b), tally.good, tally.refused);
    assert_true(tally.good > 1000);
    for (unsigned i = 1; i < CORRUPTIONS; i++)
        assert_true(b->line.done[i] > 1000);
}

/* Writing: the object is the old one or the new one, never a mixture. */
static void a_write_is_whole_or_not_at_all(void **state)
{
    struct bench *b = *state;
    uint8_t from[200], before[200], into[200];

    memset(before, 0, sizeof before);
    assert_int_equal(put(b, before, sizeof before, false), MOTION_OK);
    for (unsigned round = 0; round < 1500; round++) {
        const bool block = round & 1;
        int err;

        for (unsigned i = 0; i < sizeof from; i++)
            from[i] = (uint8_t)check_random(&b->line.seed);
        b->line.one_in = 10;
        err = put(b, from, sizeof from, block);
        mend(b);
        assert_int_equal(get(b, into, sizeof into, block), MOTION_OK);
        if (memcmp(into, from, sizeof from) == 0)
            memcpy(before, from, sizeof from);
        else if (err == MOTION_OK || memcmp(into, before, sizeof from) != 0)
            fail_msg("round %u: %d", round, err);
    }
}

#define RUN(test) cmocka_unit_test_setup(test, bench_setup)

int main(void)
{
    const struct CMUnitTest tests[] = {
        RUN(every_length_goes_both_ways),
        RUN(a_room_too_small_is_not_overrun),
        RUN(a_number_is_read_and_written_the_long_way_too),
        RUN(a_drop_in_the_middle_frees_the_server),
        RUN(a_bad_line_never_gives_a_wrong_value),
        RUN(a_write_is_whole_or_not_at_all),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
