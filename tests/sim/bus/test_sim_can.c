/* tests/sim/bus/test_sim_can.c - bit counts, arbitration, bus time, errors. */
#include "hal/can/bits.h"
#include "sim/bus/can_trouble.h"
#include "tests/sim/bus/sim_bus.h"

struct fixture {
    struct sim_world world;
    struct sim_can_bus bus;
    struct sim_can_port port[4];
};

static struct fixture *fixture_new(uint32_t bit_rate, unsigned ports)
{
    struct fixture *f = calloc(1, sizeof(*f));

    assert_non_null(f);
    sim_world_init(&f->world, 0);
    assert_int_equal(sim_can_bus_init(&f->bus, &f->world, bit_rate), 0);
    for (unsigned i = 0; i < ports; i++)
        sim_can_port_init(&f->port[i], &f->bus);
    return f;
}

static int put(struct fixture *f, unsigned port, const char *text)
{
    struct hal_can_frame frame = frame_of(text);

    return hal_can_send(&f->port[port].can, &frame);
}

static void expect(struct fixture *f, unsigned port, const char *text)
{
    struct hal_can_frame frame;

    assert_int_equal(hal_can_recv(&f->port[port].can, &frame), 1);
    assert_string_equal(text_of(&frame), text);
}

static void expect_nothing(struct fixture *f, unsigned port)
{
    struct hal_can_frame frame;

    assert_int_equal(hal_can_recv(&f->port[port].can, &frame), 0);
}

/* ---- arbitration ------------------------------------------------------- */

static void fd_data_go_at_the_faster_rate(void **state)
{
    struct fixture *f = fixture_new(1000000, 2);
    struct hal_can_frame frame = {
        .id = 0x555, .fd = true, .switched = true, .len = 16
    };
    struct can_bits bits;

    (void)state;
    assert_int_equal(hal_can_send(&f->port[0].can, &frame), MOTION_E_ARG);
    assert_int_equal(sim_can_bus_set_fd(&f->bus, 3), MOTION_E_ARG);
    assert_int_equal(sim_can_bus_set_fd(&f->bus, 5), MOTION_OK);
    memset(frame.data, 0x55, sizeof frame.data);
    bits = can_bits_of(&frame);
    assert_int_equal(hal_can_send(&f->port[0].can, &frame), MOTION_OK);
    sim_world_run(&f->world, 10 * MS);
    assert_int_equal(hal_can_recv(&f->port[1].can, &frame), 1);
    assert_true(frame.fd && frame.switched && frame.len == 16);
    assert_int_equal(frame.data[15], 0x55);
    assert_int_equal(frame.t_ns, (bits.slow - 3) * 1000 + bits.fast * 200);
    free(f);
}

static void the_lowest_identifier_goes_first(void **state)
{
    struct fixture *f = fixture_new(1000000, 4);

    (void)state;
    put(f, 0, "701#05");
    put(f, 1, "181#0102");
    put(f, 2, "080#");
    sim_world_run(&f->world, 10 * MS);
    expect(f, 3, "080#");
    expect(f, 3, "181#0102");
    expect(f, 3, "701#05");
    expect_nothing(f, 3);
    assert_int_equal(f->bus.frames, 3);
    free(f);
}

static void base_beats_extended_and_data_beats_remote(void **state)
{
    struct fixture *f = fixture_new(1000000, 4);

    (void)state;
    put(f, 0, "04000000#01"); /* base 0x100 */
    put(f, 1, "100#R");
    put(f, 2, "100#01");
    sim_world_run(&f->world, 10 * MS);
    expect(f, 3, "100#01");
    expect(f, 3, "100#R");
    expect(f, 3, "04000000#01");
    free(f);
}

static void a_port_keeps_the_order_of_its_own_frames(void **state)
{
    struct fixture *f = fixture_new(1000000, 2);

    (void)state;
    put(f, 0, "701#01");
    put(f, 0, "081#02");
    sim_world_run(&f->world, 10 * MS);
    expect(f, 1, "701#01");
    expect(f, 1, "081#02");
    free(f);
}

static void a_frame_on_the_wire_is_not_interrupted(void **state)
{
    struct fixture *f = fixture_new(1000000, 3);

    (void)state;
    put(f, 0, "701#01");
    sim_world_run(&f->world, 20000);
    put(f, 1, "080#");
    sim_world_run(&f->world, 10 * MS);
    expect(f, 2, "701#01");
    expect(f, 2, "080#");
    free(f);
}

static void within_the_first_bit_a_better_one_still_wins(void **state)
{
    struct fixture *f = fixture_new(500000, 3);

    (void)state;
    put(f, 0, "701#01");
    sim_world_run(&f->world, 1999); /* a bit is 2000 ns */
    put(f, 1, "080#");
    sim_world_run(&f->world, 10 * MS);
    expect(f, 2, "080#");
    expect(f, 2, "701#01");
    free(f);
}

static void two_senders_of_one_identifier_are_counted(void **state)
{
    struct fixture *f = fixture_new(1000000, 3);

    (void)state;
    put(f, 0, "080#");
    put(f, 1, "080#");
    sim_world_run(&f->world, 10 * MS);
    assert_int_equal(f->bus.collisions, 1);
    assert_int_equal(f->bus.frames, 2);
    free(f);
}

/* ---- time -------------------------------------------------------------- */

/* The last 3 bits are intermission: the frame is there before them. */
static void a_frame_arrives_when_its_bits_are_over(void **state)
{
    struct fixture *f = fixture_new(500000, 2);
    struct hal_can_frame frame;

    (void)state;
    sim_world_run(&f->world, 7 * MS);
    put(f, 0, "701#05"); /* 58 bits */
    sim_world_run(&f->world, 7 * MS + 55 * 2000 - 1);
    expect_nothing(f, 1);
    sim_world_run(&f->world, 7 * MS + 55 * 2000);
    assert_int_equal(hal_can_recv(&f->port[1].can, &frame), 1);
    assert_int_equal(frame.t_ns, 7 * MS + 55 * 2000);
    free(f);
}

static void frames_follow_each_other_after_three_bits(void **state)
{
    struct fixture *f = fixture_new(1000000, 2);
    struct hal_can_frame frame;

    (void)state;
    put(f, 0, "080#");   /* 51 bits */
    put(f, 0, "701#05"); /* 58 bits */
    sim_world_run(&f->world, MS);
    assert_int_equal(hal_can_recv(&f->port[1].can, &frame), 1);
    assert_int_equal(frame.t_ns, 48000);
    assert_int_equal(hal_can_recv(&f->port[1].can, &frame), 1);
    assert_int_equal(frame.t_ns, 51000 + 55000);
    free(f);
}

/* 1 kHz: SYNC, two RPDOs, two TPDOs: 51 + 2 x 104 + 2 x 101 bits. */
static void a_known_schedule_loads_the_bus_to_the_nanosecond(void **state)
{
    static const char *const cycle[] = { "080#", "201#0F0010270000",
                                         "201#0F0010270000", "181#371210270000",
                                         "181#371210270000" };
    static const struct {
        uint32_t bit_rate;
        uint64_t busy_ns; /* 100 cycles of 461 bits */
    } rows[] = {
        { 1000000, 46100000 }, { 800000, 57625000 }, { 500000, 92200000 },
        { 300000, 153666666 }, /* 3333.33... ns per bit */
        { 83333, 553202212 },  /* 46100e9 / 83333 = 553202212.8 */
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct fixture *f = fixture_new(rows[i].bit_rate, 2);
        struct hal_can_stats stats;

        for (int64_t k = 0; k < 100; k++) {
            for (size_t j = 0; j < ARRAY_LEN(cycle); j++)
                assert_int_equal(put(f, 0, cycle[j]), MOTION_OK);
            sim_world_run(&f->world, (k + 1) * 10 * MS);
        }
        hal_can_stats(&f->port[0].can, &stats);
        if (stats.busy_ns != rows[i].busy_ns)
            fail_msg("%" PRIu32 " bit/s: %" PRIu64 " ns", rows[i].bit_rate,
                     stats.busy_ns);
        assert_int_equal(stats.sent, 500);
        free(f);
    }
}

/* 5000 frames without a gap at 3 1/3 us per bit: the last ends where the sum
 * of their bits says, not where 5000 roundings would. */
static void back_to_back_frames_do_not_drift(void **state)
{
    struct fixture *f = fixture_new(300000, 2);
    struct hal_can_frame frame, last = { 0 };
    int64_t sent = 0;

    (void)state;
    while (sent < 5000) {
        while (sent < 5000 && put(f, 0, "080#") == MOTION_OK)
            sent++;
        sim_world_run(&f->world, f->world.now_ns + MS);
        while (hal_can_recv(&f->port[1].can, &frame) == 1)
            last = frame;
    }
    sim_world_run(&f->world, f->world.now_ns + 100 * MS);
    while (hal_can_recv(&f->port[1].can, &frame) == 1)
        last = frame;
    assert_int_equal(f->bus.frames, 5000);
    assert_int_equal(last.t_ns, (5000 * 51 - 3) * INT64_C(10000) / 3);
    free(f);
}

/* ---- queues, errors ---------------------------------------------------- */

static void a_full_queue_refuses_and_queues_nothing(void **state)
{
    struct fixture *f = fixture_new(1000000, 2);
    struct hal_can_stats stats;

    (void)state;
    for (unsigned i = 0; i < SIM_CAN_QUEUE; i++)
        assert_int_equal(put(f, 0, "080#"), MOTION_OK);
    assert_int_equal(put(f, 0, "080#"), MOTION_E_FULL);
    sim_world_run(&f->world, 100 * MS);
    hal_can_stats(&f->port[0].can, &stats);
    assert_int_equal(stats.refused, 1);
    assert_int_equal(stats.sent, SIM_CAN_QUEUE);
    free(f);
}

static void a_receiver_that_does_not_read_drops(void **state)
{
    struct fixture *f = fixture_new(1000000, 2);
    struct hal_can_stats stats;

    (void)state;
    for (unsigned i = 0; i < SIM_CAN_QUEUE + 5; i++) {
        put(f, 0, "080#");
        sim_world_run(&f->world, f->world.now_ns + MS);
    }
    hal_can_stats(&f->port[1].can, &stats);
    assert_int_equal(stats.received, SIM_CAN_QUEUE);
    assert_int_equal(stats.dropped, 5);
    free(f);
}

static void impossible_frames_are_refused(void **state)
{
    struct fixture *f = fixture_new(1000000, 2);
    struct hal_can_frame frame = { .len = 9 };

    (void)state;
    assert_int_equal(hal_can_send(&f->port[0].can, &frame), MOTION_E_ARG);
    frame = (struct hal_can_frame){ .id = 0x800 };
    assert_int_equal(hal_can_send(&f->port[0].can, &frame), MOTION_E_ARG);
    frame = (struct hal_can_frame){ .id = 0x20000000, .extended = true };
    assert_int_equal(hal_can_send(&f->port[0].can, &frame), MOTION_E_ARG);
    assert_int_equal(f->port[0].tx.count, 0);
    free(f);
}

static void alone_on_the_bus_a_sender_gets_error_passive(void **state)
{
    struct fixture *f = fixture_new(1000000, 2);
    struct hal_can *can = &f->port[0].can;
    struct hal_can_stats stats;

    (void)state;
    sim_can_port_set_off(&f->port[1], true);
    put(f, 0, "080#");
    sim_world_run(&f->world, 800000); /* some 14 tries of 57 bits */
    assert_int_equal(hal_can_state(can), HAL_CAN_WARNING);
    sim_world_run(&f->world, 100 * MS);
    assert_int_equal(hal_can_state(can), HAL_CAN_PASSIVE);
    assert_int_equal(f->port[0].tx_errors, 128);
    assert_int_equal(f->bus.frames, 0);

    sim_can_port_set_off(&f->port[1], false); /* somebody comes */
    sim_world_run(&f->world, 200 * MS);
    expect(f, 1, "080#");
    assert_int_equal(hal_can_state(can), HAL_CAN_WARNING);
    hal_can_stats(can, &stats);
    assert_int_equal(stats.warnings, 1); /* not for the better */
    assert_int_equal(stats.passives, 1);
    free(f);
}

static void destroyed_frames_are_tried_again(void **state)
{
    struct fixture *f = fixture_new(1000000, 2);

    (void)state;
    f->port[0].destroy = 3;
    put(f, 0, "080#");
    sim_world_run(&f->world, 10 * MS);
    expect(f, 1, "080#");
    assert_int_equal(f->bus.frames_destroyed, 3);
    assert_int_equal(f->port[0].tx_errors, 3 * 8 - 1);
    assert_int_equal(f->port[1].rx_errors, 3 - 1);
    free(f);
}

static void enough_errors_take_a_sender_off_the_bus(void **state)
{
    struct fixture *f = fixture_new(1000000, 2);
    struct hal_can *can = &f->port[0].can;

    (void)state;
    f->port[0].destroy = 32;
    put(f, 0, "080#");
    sim_world_run(&f->world, 100 * MS);
    assert_int_equal(hal_can_state(can), HAL_CAN_BUS_OFF);
    assert_int_equal(put(f, 0, "080#"), MOTION_E_IO);

    sim_can_port_restart(&f->port[0]);
    assert_int_equal(hal_can_state(can), HAL_CAN_ACTIVE);
    assert_int_equal(put(f, 0, "080#"), MOTION_OK);
    sim_world_run(&f->world, 200 * MS);
    expect(f, 1, "080#");
    free(f);
}

static void a_pulled_plug_ends_everything_at_once(void **state)
{
    struct fixture *f = fixture_new(1000000, 3);
    struct hal_can_frame frame;

    (void)state;
    put(f, 0, "080#");
    put(f, 0, "081#");
    sim_world_run(&f->world, 20000);
    sim_can_port_set_off(&f->port[0], true);
    sim_world_run(&f->world, 10 * MS);
    expect_nothing(f, 1);
    assert_int_equal(put(f, 0, "080#"), MOTION_E_IO);
    assert_int_equal(hal_can_recv(&f->port[0].can, &frame), MOTION_E_IO);
    assert_int_equal(hal_can_state(&f->port[0].can), HAL_CAN_DOWN);
    put(f, 1, "082#"); /* the others go on */
    sim_world_run(&f->world, 20 * MS);
    expect(f, 2, "082#");
    free(f);
}

static void odd_rates_are_refused(void **state)
{
    struct sim_world world;
    struct sim_can_bus bus;

    (void)state;
    sim_world_init(&world, 0);
    assert_int_equal(sim_can_bus_init(&bus, &world, 9999), MOTION_E_ARG);
    assert_int_equal(sim_can_bus_init(&bus, &world, 1000001), MOTION_E_ARG);
    assert_null(world.first);
    assert_int_equal(sim_can_bus_init(&bus, &world, 10000), MOTION_OK);
}

/* ---- what spoils them -------------------------------------------------- */

/* Binomial: at 5 % 10000 frames meet 526 errors in the mean; five standard
 * deviations are 120. */
static void noise_destroys_its_share_and_nothing_is_lost(void **state)
{
    struct fixture *f = fixture_new(1000000, 2);

    (void)state;
    f->bus.noise_q32 = (UINT64_C(1) << 32) / 20;
    f->bus.noise_seed = 7;
    for (int i = 0; i < 10000; i++) {
        assert_int_equal(put(f, 0, "181#01"), MOTION_OK);
        sim_world_run(&f->world, f->world.now_ns + 2 * MS);
        expect(f, 1, "181#01");
    }
    assert_int_equal(f->bus.frames, 10000);
    assert_true(f->bus.frames_destroyed > 406 && f->bus.frames_destroyed < 646);
    free(f);
}

static void a_dropped_identifier_never_comes_and_others_do(void **state)
{
    struct fixture *f = fixture_new(1000000, 2);
    struct sim_can_trouble trouble;

    (void)state;
    assert_int_equal(sim_can_trouble_init(&trouble, &f->port[0], false, 1),
                     MOTION_OK);
    trouble.drops = true;
    trouble.drop_id = 0x701;
    assert_int_equal(put(f, 0, "701#05"), MOTION_OK);
    assert_int_equal(put(f, 0, "181#01"), MOTION_OK);
    sim_world_run(&f->world, 10 * MS);
    expect(f, 1, "181#01");
    expect_nothing(f, 1);
    assert_int_equal(trouble.dropped, 1);
    free(f);
}

static void late_frames_keep_their_order(void **state)
{
    struct fixture *f = fixture_new(1000000, 2);
    struct sim_can_trouble trouble;
    struct hal_can_frame frame;

    (void)state;
    assert_int_equal(sim_can_trouble_init(&trouble, &f->port[0], false, 1),
                     MOTION_OK);
    trouble.impairment.delay_ns = 5 * MS;
    assert_int_equal(put(f, 0, "181#01"), MOTION_OK);
    sim_world_run(&f->world, 1 * MS);
    trouble.impairment.delay_ns =
        0; /* the second must not overtake the first */
    assert_int_equal(put(f, 0, "181#02"), MOTION_OK);
    sim_world_run(&f->world, 5 * MS);
    expect_nothing(f, 1);
    sim_world_run(&f->world, 10 * MS);
    assert_int_equal(hal_can_recv(&f->port[1].can, &frame), 1);
    assert_int_equal(frame.data[0], 1);
    assert_true(frame.t_ns > 5 * MS && frame.t_ns < 6 * MS);
    expect(f, 1, "181#02");
    free(f);
}

static void spoilt_data_are_other_data_and_come_in_time(void **state)
{
    struct fixture *f = fixture_new(1000000, 2);
    struct sim_can_trouble trouble;
    struct hal_can_frame frame;

    (void)state;
    assert_int_equal(sim_can_trouble_init(&trouble, &f->port[0], false, 9),
                     MOTION_OK);
    trouble.spoil = 100;
    for (int i = 0; i < 100; i++) {
        assert_int_equal(put(f, 0, "181#1122334455667788"), MOTION_OK);
        sim_world_run(&f->world, f->world.now_ns + MS);
        assert_int_equal(hal_can_recv(&f->port[1].can, &frame), 1);
        assert_string_not_equal(text_of(&frame), "181#1122334455667788");
    }
    assert_int_equal(put(f, 0, "181#1122334455667788"), MOTION_OK);
    sim_world_run(&f->world, f->world.now_ns + MS);
    expect(f, 1, "181#1122334455667788");
    free(f);
}

static unsigned received(struct fixture *f, unsigned port)
{
    struct hal_can_frame frame;
    unsigned count = 0;

    while (hal_can_recv(&f->port[port].can, &frame) == 1)
        count++;
    return count;
}

/* 10000 frames each way with that trouble in one direction of port 0: how many
 * come out of it, and how many come in.  Five deviations of 10 % are 150. */
static void ten_thousand(bool incoming, uint64_t loss_q32, uint64_t double_q32,
                         unsigned *out, unsigned *in)
{
    struct fixture *f = fixture_new(1000000, 2);
    struct sim_can_trouble trouble;

    assert_int_equal(sim_can_trouble_init(&trouble, &f->port[0], incoming, 20),
                     MOTION_OK);
    trouble.impairment.loss_q32 = loss_q32;
    trouble.impairment.duplication_q32 = double_q32;
    *out = *in = 0;
    for (int i = 0; i < 10000; i++) {
        assert_int_equal(put(f, 0, "181#01"), MOTION_OK);
        assert_int_equal(put(f, 1, "201#01"), MOTION_OK);
        sim_world_run(&f->world, f->world.now_ns + MS);
        *in += received(f, 0);
        *out += received(f, 1);
    }
    free(f);
}

static void frames_are_lost_and_doubled_in_one_direction(void **state)
{
    const uint64_t tenth = (UINT64_C(1) << 32) / 10;
    unsigned out, in;

    (void)state;
    ten_thousand(false, tenth, 0, &out, &in);
    assert_int_equal(in, 10000);
    assert_in_range(out, 8850, 9150);
    ten_thousand(true, tenth, 0, &out, &in);
    assert_int_equal(out, 10000);
    assert_in_range(in, 8850, 9150);
    ten_thousand(false, 0, tenth, &out, &in);
    assert_int_equal(in, 10000);
    assert_in_range(out, 10850, 11150);
    ten_thousand(true, 0, tenth, &out, &in);
    assert_int_equal(out, 10000);
    assert_in_range(in, 10850, 11150);
    ten_thousand(true, UINT64_C(1) << 32, 0, &out, &in);
    assert_int_equal(in, 0);
}

/* Of 2 ms each way: some are hardly late, some by almost 2 ms, none overtakes. */
static void jitter_is_within_its_bound_and_in_order(void **state)
{
    (void)state;
    for (int incoming = 0; incoming <= 1; incoming++) {
        struct fixture *f = fixture_new(1000000, 2);
        struct sim_can_trouble trouble;
        const unsigned from = incoming ? 1 : 0, to = incoming ? 0 : 1;
        int64_t least = INT64_MAX, most = 0;
        assert_int_equal(
            sim_can_trouble_init(&trouble, &f->port[0], incoming == 1, 3),
            MOTION_OK);
        trouble.impairment.jitter_ns = 2 * MS;
        for (uint8_t i = 0; i < 250; i++) {
            struct hal_can_frame frame = { .id = 0x181, .len = 1 };
            const int64_t sent_ns = f->world.now_ns;
            frame.data[0] = i;
            assert_int_equal(hal_can_send(&f->port[from].can, &frame),
                             MOTION_OK);
            sim_world_run(&f->world, sent_ns + 3 * MS);
            assert_int_equal(hal_can_recv(&f->port[to].can, &frame), 1);
            assert_int_equal(frame.data[0], i);
            least = frame.t_ns - sent_ns < least ? frame.t_ns - sent_ns : least;
            most = frame.t_ns - sent_ns > most ? frame.t_ns - sent_ns : most;
        }
        /* and 56 us on the wire */
        assert_true(least < MS / 5 && most > 2 * MS - MS / 5);
        assert_true(most < 2 * MS + MS / 10);
        for (uint8_t i = 0; i < 20; i++) {
            struct hal_can_frame frame = { .id = 0x181, .len = 1 };
            frame.data[0] = i;
            assert_int_equal(hal_can_send(&f->port[from].can, &frame),
                             MOTION_OK);
            sim_world_run(&f->world, f->world.now_ns + MS / 5);
        }
        sim_world_run(&f->world, f->world.now_ns + 3 * MS);
        for (uint8_t i = 0; i < 20; i++) {
            struct hal_can_frame frame;
            assert_int_equal(hal_can_recv(&f->port[to].can, &frame), 1);
            assert_int_equal(frame.data[0], i);
        }
        free(f);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fd_data_go_at_the_faster_rate),
        cmocka_unit_test(the_lowest_identifier_goes_first),
        cmocka_unit_test(base_beats_extended_and_data_beats_remote),
        cmocka_unit_test(a_port_keeps_the_order_of_its_own_frames),
        cmocka_unit_test(a_frame_on_the_wire_is_not_interrupted),
        cmocka_unit_test(within_the_first_bit_a_better_one_still_wins),
        cmocka_unit_test(two_senders_of_one_identifier_are_counted),
        cmocka_unit_test(a_frame_arrives_when_its_bits_are_over),
        cmocka_unit_test(frames_follow_each_other_after_three_bits),
        cmocka_unit_test(a_known_schedule_loads_the_bus_to_the_nanosecond),
        cmocka_unit_test(back_to_back_frames_do_not_drift),
        cmocka_unit_test(a_full_queue_refuses_and_queues_nothing),
        cmocka_unit_test(a_receiver_that_does_not_read_drops),
        cmocka_unit_test(impossible_frames_are_refused),
        cmocka_unit_test(alone_on_the_bus_a_sender_gets_error_passive),
        cmocka_unit_test(destroyed_frames_are_tried_again),
        cmocka_unit_test(enough_errors_take_a_sender_off_the_bus),
        cmocka_unit_test(a_pulled_plug_ends_everything_at_once),
        cmocka_unit_test(noise_destroys_its_share_and_nothing_is_lost),
        cmocka_unit_test(a_dropped_identifier_never_comes_and_others_do),
        cmocka_unit_test(late_frames_keep_their_order),
        cmocka_unit_test(spoilt_data_are_other_data_and_come_in_time),
        cmocka_unit_test(frames_are_lost_and_doubled_in_one_direction),
        cmocka_unit_test(jitter_is_within_its_bound_and_in_order),
        cmocka_unit_test(odd_rates_are_refused),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
