/* tests/conform/conform_can.c - see conform_can.h. */
#include "tests/conform/conform_can.h"

#include <stdio.h>
#include <string.h>

#define MS    INT64_C(1000000)
#define QUIET (50 * MS) /* long enough for a queue to empty at 1 Mbit/s */

static void drain(struct hal_can *can)
{
    struct hal_can_frame frame;

    while (hal_can_recv(can, &frame) == 1)
        ;
}

/* A claim begins with a quiet bus. */
static struct conform_can *fresh(void **state)
{
    struct conform_can *bus = *state;

    bus->pass(bus, QUIET);
    drain(bus->a);
    drain(bus->b);
    assert_int_equal(hal_can_state(bus->a), HAL_CAN_ACTIVE);
    assert_int_equal(hal_can_state(bus->b), HAL_CAN_ACTIVE);
    return bus;
}

static void put(struct hal_can *can, const struct hal_can_frame *frame)
{
    assert_int_equal(hal_can_send(can, frame), MOTION_OK);
    assert_int_equal(hal_can_flush(can), MOTION_OK);
}

/* The next frame; for ever, for what is on its way. */
static void await(struct conform_can *bus, struct hal_can *can,
                  struct hal_can_frame *frame)
{
    for (int i = 0; hal_can_recv(can, frame) != 1; i++) {
        bus->pass(bus, MS);
        assert_true(i < 20000);
    }
}

static void expect(struct conform_can *bus, struct hal_can *can,
                   const struct hal_can_frame *want)
{
    struct hal_can_frame got;

    await(bus, can, &got);
    assert_int_equal(got.id, want->id);
    assert_int_equal(got.extended, want->extended);
    assert_int_equal(got.remote, want->remote);
    assert_int_equal(got.fd, want->fd);
    assert_int_equal(got.switched, want->switched);
    assert_int_equal(got.len, want->len);
    if (!want->remote)
        assert_memory_equal(got.data, want->data, want->len);
}

static void expect_nothing(struct conform_can *bus, struct hal_can *can)
{
    struct hal_can_frame frame;

    bus->pass(bus, QUIET);
    assert_int_equal(hal_can_recv(can, &frame), 0);
}

static struct hal_can_frame numbered(uint32_t number)
{
    struct hal_can_frame frame = { .id = 0x100 + number % 0x200, .len = 8 };

    for (unsigned i = 0; i < 8; i++)
        frame.data[i] = (uint8_t)(number >> 8 * (i % 4));
    return frame;
}

static void frames_arrive_as_they_were_sent(void **state)
{
    struct conform_can *bus = fresh(state);
    static const uint32_t id[] = { 0, 1, 0x7FF, 0x12345678, 0x1FFFFFFF };
    const unsigned remote_len = bus->remote_empty ? 0 : 5;

    for (unsigned i = 0; i < ARRAY_LEN(id); i++)
        for (unsigned len = 0; len <= 8; len++) {
            struct hal_can_frame frame = { .id = id[i],
                                           .extended =
                                               id[i] > 0x7FF || len == 3,
                                           .remote = len == remote_len,
                                           .len = (uint8_t)len };

            for (unsigned at = 0; at < len; at++)
                frame.data[at] = (uint8_t)(0xA0 + 17 * at);
            put(bus->a, &frame);
            expect(bus, bus->b, &frame);
            put(bus->b, &frame);
            expect(bus, bus->a, &frame);
        }
    expect_nothing(bus, bus->a); /* nobody hears himself */
    expect_nothing(bus, bus->b);
}

static void fd_frames_arrive_or_are_refused(void **state)
{
    struct conform_can *bus = fresh(state);
    static const uint8_t len[] = { 0, 1, 8, 12, 16, 20, 24, 32, 48, 64 };

    for (unsigned i = 0; i < ARRAY_LEN(len); i++) {
        struct hal_can_frame frame = {
            .id = 0x123, .fd = true, .switched = i % 2 == 1, .len = len[i]
        };

        for (unsigned at = 0; at < len[i]; at++)
            frame.data[at] = (uint8_t)(at * 7);
        if (!bus->fd) {
            assert_int_equal(hal_can_send(bus->a, &frame), MOTION_E_ARG);
            continue;
        }
        put(bus->a, &frame);
        expect(bus, bus->b, &frame);
    }
}

static void frames_that_cannot_be_are_refused(void **state)
{
    struct conform_can *bus = fresh(state);
    static const struct hal_can_frame bad[] = {
        { .id = 0x800 },
        { .id = 0x20000000, .extended = true },
        { .id = 1, .len = 9 },
        { .id = 1, .switched = true },
        { .id = 1, .fd = true, .len = 9 },
        { .id = 1, .fd = true, .len = 13 },
        { .id = 1, .fd = true, .len = 63 },
        { .id = 1, .fd = true, .len = 65 },
        { .id = 1, .fd = true, .remote = true },
    };

    for (unsigned i = 0; i < ARRAY_LEN(bad); i++)
        assert_int_equal(hal_can_send(bus->a, &bad[i]), MOTION_E_ARG);
    assert_int_equal(hal_can_flush(bus->a), MOTION_OK);
    expect_nothing(bus, bus->b);
}

static void the_order_is_kept(void **state)
{
    struct conform_can *bus = fresh(state);

    for (unsigned i = 0; i < 40; i++) {
        const struct hal_can_frame frame = numbered(40 - i);

        assert_int_equal(hal_can_send(bus->a, &frame), MOTION_OK);
    }
    assert_int_equal(hal_can_flush(bus->a), MOTION_OK);
    for (unsigned i = 0; i < 40; i++) {
        const struct hal_can_frame frame = numbered(40 - i);

        expect(bus, bus->b, &frame);
    }
    expect_nothing(bus, bus->b);
}

/* Whatever the room is: what was taken arrives, what was refused does not. */
static void a_full_port_refuses_and_keeps_nothing(void **state)
{
    struct conform_can *bus = fresh(state);
    struct hal_can_stats before, after;
    struct hal_can_frame frame;
    unsigned taken = 0;

    hal_can_stats(bus->a, &before);
    for (;; taken++) {
        int err;

        frame = numbered(taken);
        err = hal_can_send(bus->a, &frame);
        if (err == MOTION_E_FULL)
            break;
        assert_int_equal(err, MOTION_OK);
        assert_true(taken < 10000);
    }
    assert_true(taken >= 32);
    assert_int_equal(hal_can_flush(bus->a), MOTION_OK);
    for (unsigned i = 0; i < taken; i++) {
        frame = numbered(i);
        expect(bus, bus->b, &frame);
    }
    expect_nothing(bus, bus->b);
    hal_can_stats(bus->a, &after);
    assert_int_equal(after.refused - before.refused, 1);
    assert_int_equal(after.sent - before.sent, taken);
}

static void bursts_both_ways_are_complete_and_counted(void **state)
{
    struct conform_can *bus = fresh(state);
    struct hal_can_stats a0, b0, a1, b1;
    const unsigned rounds = 40, burst = 20;

    hal_can_stats(bus->a, &a0);
    hal_can_stats(bus->b, &b0);
    for (unsigned round = 0; round < rounds; round++) {
        for (unsigned i = 0; i < burst; i++) {
            const struct hal_can_frame frame = numbered(round * burst + i);

            assert_int_equal(hal_can_send(bus->a, &frame), MOTION_OK);
            assert_int_equal(hal_can_send(bus->b, &frame), MOTION_OK);
        }
        assert_int_equal(hal_can_flush(bus->a), MOTION_OK);
        assert_int_equal(hal_can_flush(bus->b), MOTION_OK);
        bus->pass(bus, 10 * MS);
        for (unsigned i = 0; i < burst; i++) {
            const struct hal_can_frame frame = numbered(round * burst + i);

            expect(bus, bus->a, &frame);
            expect(bus, bus->b, &frame);
        }
    }
    hal_can_stats(bus->a, &a1);
    hal_can_stats(bus->b, &b1);
    assert_int_equal(a1.sent - a0.sent, rounds * burst);
    assert_int_equal(b1.received - b0.received, rounds * burst);
    assert_int_equal(b1.sent - b0.sent, rounds * burst);
    assert_int_equal(a1.received - a0.received, rounds * burst);
    assert_int_equal(a1.dropped + b1.dropped, a0.dropped + b0.dropped);
}

static void frames_carry_the_time_of_their_arrival(void **state)
{
    struct conform_can *bus = fresh(state);

    for (unsigned i = 0; i < 20; i++) {
        struct hal_can_frame frame = numbered(i);
        int64_t sent_ns = bus->now_ns(bus);

        put(bus->a, &frame);
        bus->pass(bus, 5 * MS); /* it waits: that is not its time */
        await(bus, bus->b, &frame);
        assert_true(frame.t_ns >= sent_ns);
        assert_true(frame.t_ns <= bus->now_ns(bus));
        if (strcmp(bus->name, "simulated") == 0)
            assert_true(frame.t_ns - sent_ns < MS);
    }
}

static void down_says_so_and_up_begins_with_nothing_old(void **state)
{
    struct conform_can *bus = fresh(state);
    struct hal_can_frame frame = numbered(1), got;

    assert_int_equal(hal_can_send(bus->a, &frame), MOTION_OK); /* gathered */
    bus->set_down(bus, true);
    (void)hal_can_flush(bus->a);
    bus->pass(bus, QUIET);
    for (int i = 0; i < 8 && hal_can_recv(bus->a, &got) != MOTION_E_IO; i++)
        assert_true(i < 7);
    assert_int_equal(hal_can_state(bus->a), HAL_CAN_DOWN);
    assert_int_equal(hal_can_send(bus->a, &frame), MOTION_E_IO);
    bus->pass(bus, QUIET);
    drain(bus->b);
    bus->set_down(bus, false);
    bus->pass(bus, QUIET);
    (void)hal_can_recv(bus->a, &got);
    assert_int_equal(hal_can_state(bus->a), HAL_CAN_ACTIVE);
    expect_nothing(bus, bus->b);
    expect_nothing(bus, bus->a);
    frame = numbered(2);
    put(bus->a, &frame);
    expect(bus, bus->b, &frame);
    put(bus->b, &frame);
    expect(bus, bus->a, &frame);
}

int conform_can(struct conform_can *bus)
{
    const struct CMUnitTest claims[] = {
        cmocka_unit_test_prestate(frames_arrive_as_they_were_sent, bus),
        cmocka_unit_test_prestate(fd_frames_arrive_or_are_refused, bus),
        cmocka_unit_test_prestate(frames_that_cannot_be_are_refused, bus),
        cmocka_unit_test_prestate(the_order_is_kept, bus),
        cmocka_unit_test_prestate(a_full_port_refuses_and_keeps_nothing, bus),
        cmocka_unit_test_prestate(bursts_both_ways_are_complete_and_counted,
                                  bus),
        cmocka_unit_test_prestate(frames_carry_the_time_of_their_arrival, bus),
        cmocka_unit_test_prestate(down_says_so_and_up_begins_with_nothing_old,
                                  bus),
    };

    return cmocka_run_group_tests_name(bus->name, claims, NULL, NULL);
}
