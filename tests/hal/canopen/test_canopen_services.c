/* tests/hal/canopen/test_canopen_services.c - LSS, node guarding, TIME, SYNC
 * with counter: the master against simulated devices, written apart from it. */
#include <string.h>

#include "tests/hal/canopen/canopen_bench.h"

#include "hal/canopen/lss.h"
#include "sim/device/cia402/servo.h"

#define DEVICES 4
#define NO_NODE 255

struct bench {
    struct sim_world world;
    struct sim_can_bus bus;
    struct sim_can_port port, tap;
    struct sim_cia402 device[DEVICES];
    unsigned devices;
    struct canopen master;
    struct canopen_lss lss;
    struct canopen_node node;
    unsigned lost, boots;
};

static struct bench bench;

static void on_lost(struct canopen_node *node, int64_t now_ns)
{
    (void)node;
    (void)now_ns;
    bench.lost++;
}

static void on_boot(struct canopen_node *node, int64_t now_ns)
{
    (void)node;
    (void)now_ns;
    bench.boots++;
}

static const struct canopen_node_ops ops = { .heartbeat_lost = on_lost,
                                             .boot_up = on_boot };

static struct bench *fresh(const struct canopen_config *more)
{
    struct canopen_config config = *more;

    memset(&bench, 0, sizeof bench);
    config.node_id = 127;
    canopen_bench_wire(&bench.world, &bench.bus, &bench.port);
    sim_can_port_init(&bench.tap, &bench.bus);
    assert_int_equal(canopen_init(&bench.master, &bench.port.can, &config), 0);
    canopen_lss_init(&bench.lss, &bench.master);
    return &bench;
}

static void plug(struct bench *b, uint8_t node, uint32_t serial)
{
    const struct sim_cia402_config config = {
        .node_id = node,
        .serial = serial,
        .plant = CANOPEN_BENCH_PLANT,
        .loop_ns = 1000000,
    };

    assert_int_equal(
        sim_cia402_init(&b->device[b->devices++], &b->bus, &config), 0);
}

static void watch(struct bench *b, uint8_t id)
{
    b->node = (struct canopen_node){ .ops = &ops, .id = id };
    assert_int_equal(canopen_add(&b->master, &b->node), 0);
}

static void cycle(struct bench *b)
{
    canopen_bench_cycle(&b->world, &b->master);
}

static void cycles(struct bench *b, unsigned count)
{
    while (count-- > 0)
        cycle(b);
}

static int outcome(struct bench *b)
{
    return canopen_bench_outcome(b, cycle, &b->lss);
}

#define OK(call)                                                               \
    do {                                                                       \
        assert_int_equal((call), MOTION_OK);                                   \
        assert_int_equal(outcome(b), MOTION_OK);                               \
    } while (0)
#define NOW (b->world.now_ns)

/* Three devices out of the box: one scan after the other finds them all, by
 * identities that differ in one bit, in the highest and in the lowest. */
static void devices_without_a_number_are_found_and_numbered(void **state)
{
    static const uint32_t serial[] = { 0x00000001, 0x80000001, 0xFFFFFFFF };
    struct bench *b = fresh(&(struct canopen_config){ 0 });
    uint8_t seen = 0;

    (void)state;
    for (unsigned i = 0; i < 3; i++)
        plug(b, NO_NODE, serial[i]);
    plug(b, 9, 9); /* one that has a number keeps out of it */
    cycles(b, 5);
    for (uint8_t id = 11; id < 14; id++) {
        OK(canopen_lss_scan(&b->lss, NOW));
        assert_int_equal(b->lss.found.vendor, 0);
        assert_int_equal(b->lss.found.product, 402);
        assert_int_equal(b->lss.found.revision, 0x00010000);
        for (unsigned i = 0; i < 3; i++)
            if (b->lss.found.serial == serial[i])
                seen |= (uint8_t)(1u << i);
        OK(canopen_lss_request_identity(&b->lss, NOW, 3));
        assert_int_equal(b->lss.value, b->lss.found.serial);
        OK(canopen_lss_set_node(&b->lss, NOW, id));
        OK(canopen_lss_store(&b->lss, NOW));
        assert_int_equal(canopen_lss_switch_all(&b->lss, false), MOTION_OK);
        cycles(b, 10);
    }
    assert_int_equal(seen, 7);
    assert_int_equal(canopen_lss_scan(&b->lss, NOW), MOTION_OK);
    assert_int_equal(outcome(b), MOTION_E_TIMEOUT); /* nobody is left */
    for (unsigned i = 0; i < 3; i++) {
        sim_cia402_inject(&b->device[i], SIM_CIA402_REBOOT);
        assert_in_range(b->device[i].config.node_id, 11, 13);
    }
    assert_int_equal(b->device[3].config.node_id, 9);
}

static void one_device_is_renumbered_by_its_identity(void **state)
{
    struct bench *b = fresh(&(struct canopen_config){ 0 });
    struct canopen_identity identity = { 0, 402, 0x00010000, 78 };

    (void)state;
    plug(b, 5, 77);
    plug(b, 6, 78);
    watch(b, 21);
    cycles(b, 5);
    OK(canopen_lss_switch(&b->lss, NOW, &identity));
    OK(canopen_lss_request_node(&b->lss, NOW));
    assert_int_equal(b->lss.value, 6);
    OK(canopen_lss_set_node(&b->lss, NOW, 21));
    assert_int_equal(b->device[1].config.node_id, 6); /* not yet */
    assert_int_equal(canopen_lss_switch_all(&b->lss, false), MOTION_OK);
    assert_int_equal(
        canopen_nmt(&b->master, CANOPEN_NMT_RESET_COMMUNICATION, 6), MOTION_OK);
    cycles(b, 10);
    assert_int_equal(b->device[1].config.node_id, 21);
    assert_int_equal(b->boots, 1);
    assert_int_equal(b->device[0].config.node_id, 5);
    /* not stored: the next power-on brings nothing back but what LSS gave */
    identity.serial = 79;
    assert_int_equal(canopen_lss_switch(&b->lss, NOW, &identity), MOTION_OK);
    assert_int_equal(outcome(b), MOTION_E_TIMEOUT);
}

static void refusals_and_wrong_questions_are_told_apart(void **state)
{
    struct bench *b = fresh(&(struct canopen_config){ 0 });

    (void)state;
    plug(b, 5, 77);
    cycles(b, 5);
    assert_int_equal(canopen_lss_take(&b->lss), MOTION_E_STATE);
    assert_int_equal(canopen_lss_set_node(&b->lss, NOW, 0), MOTION_E_ARG);
    assert_int_equal(canopen_lss_set_node(&b->lss, NOW, 128), MOTION_E_ARG);
    assert_int_equal(canopen_lss_request_identity(&b->lss, NOW, 4),
                     MOTION_E_ARG);
    assert_int_equal(canopen_lss_request_node(&b->lss, NOW), MOTION_OK);
    assert_int_equal(canopen_lss_request_node(&b->lss, NOW), MOTION_E_STATE);
    assert_int_equal(outcome(b), MOTION_E_TIMEOUT); /* nobody is configuring */
    assert_int_equal(canopen_lss_switch_all(&b->lss, true), MOTION_OK);
    assert_int_equal(canopen_lss_set_bit_rate(&b->lss, NOW, CANOPEN_LSS_500K),
                     MOTION_OK);
    assert_int_equal(outcome(b), MOTION_E_REFUSED);
    assert_int_equal(b->lss.error, 1);
}

/* ---- node guarding ---- */

static void put_u16(struct bench *b, uint16_t index, uint8_t size,
                    uint32_t value)
{
    assert_int_equal(canopen_sdo_write(&b->node, NOW, index, 0, size, value),
                     MOTION_OK);
    cycles(b, 5);
    assert_int_equal(canopen_sdo_take(&b->node, NULL, NULL), MOTION_OK);
}

static void a_node_is_guarded_and_guards_its_life(void **state)
{
    struct bench *b = fresh(&(struct canopen_config){ .sdo_gap_ns = 1 });

    (void)state;
    plug(b, 5, 77);
    watch(b, 5);
    cycles(b, 5);
    put_u16(b, 0x100C, 2, 10);
    put_u16(b, 0x100D, 1, 3);
    b->node.guard_period_ns = 10 * MS;
    cycles(b, 15); /* an answer, before silence can be too long */
    b->node.heartbeat_timeout_ns = 30 * MS;
    cycles(b, 500);
    assert_int_equal(b->node.nmt_state, CANOPEN_NMT_PRE_OPERATIONAL_STATE);
    assert_int_equal(b->lost, 0);
    assert_int_equal(b->master.stats.malformed, 0);
    assert_int_equal(canopen_nmt(&b->master, CANOPEN_NMT_START, 5), MOTION_OK);
    cycles(b, 20);
    assert_int_equal(b->node.nmt_state, CANOPEN_NMT_OPERATIONAL);
    /* silent: noticed after the life time, once */
    sim_cia402_inject(&b->device[0], SIM_CIA402_SILENT);
    cycles(b, 25);
    assert_int_equal(b->lost, 0);
    cycles(b, 100);
    assert_int_equal(b->lost, 1);
    sim_cia402_inject(&b->device[0], SIM_CIA402_CLEAR);
    cycles(b, 100);
    assert_true(b->node.heartbeat_heard);
    /* we are silent: the node notices, 0x8130 */
    const uint64_t before = b->master.stats.emcy_received;
    b->node.guard_period_ns = 0;
    b->node.heartbeat_timeout_ns = 0;
    cycles(b, 100);
    assert_int_equal(b->master.stats.emcy_received, before + 1);
}

static void an_answer_that_does_not_toggle_does_not_count(void **state)
{
    struct bench *b = fresh(&(struct canopen_config){ 0 });
    const struct hal_can_frame frame = { .id = 0x705,
                                         .len = 1,
                                         .data = { 0x7F } };

    (void)state;
    watch(b, 5);
    b->node.guard_period_ns = 10 * MS;
    b->node.heartbeat_timeout_ns = 30 * MS;
    for (unsigned i = 0; i < 10; i++) { /* a stuck device */
        assert_int_equal(hal_can_send(&b->tap.can, &frame), MOTION_OK);
        cycles(b, 10);
    }
    assert_true(b->lost >= 1);
    assert_true(b->master.stats.malformed >= 4);
}

/* ---- TIME and SYNC ---- */

static void time_goes_out_and_is_taken(void **state)
{
    struct bench *b = fresh(&(struct canopen_config){ 0 });

    (void)state;
    plug(b, 5, 77);
    cycles(b, 5);
    assert_int_equal(canopen_time(&b->master, 86399999, 15300), MOTION_OK);
    cycles(b, 5);
    assert_int_equal(b->device[0].time_ms, 86399999);
    assert_int_equal(b->device[0].time_days, 15300);
    assert_int_equal(canopen_time(&b->master, 86400000, 0), MOTION_E_ARG);
}

static void sync_counts_from_one_to_the_overflow(void **state)
{
    struct bench *b = fresh(
        &(struct canopen_config){ .sync_period_ns = MS, .sync_overflow = 3 });
    struct hal_can_frame frame;
    struct canopen other;
    unsigned syncs = 0;

    (void)state;
    cycles(b, 10);
    while (hal_can_recv(&b->tap.can, &frame) == 1)
        if (frame.id == 0x80) {
            assert_int_equal(frame.len, 1);
            assert_int_equal(frame.data[0], syncs++ % 3 + 1);
        }
    assert_true(syncs >= 9);
    assert_int_equal(canopen_init(&other, &b->port.can,
                                  &(struct canopen_config){
                                      .node_id = 1, .sync_overflow = 1 }),
                     MOTION_E_ARG);
    assert_int_equal(canopen_init(&other, &b->port.can,
                                  &(struct canopen_config){
                                      .node_id = 1, .sync_overflow = 241 }),
                     MOTION_E_ARG);
}

static void a_sync_of_the_wrong_length_is_reported(void **state)
{
    struct bench *b = fresh(
        &(struct canopen_config){ .sync_period_ns = MS, .sync_overflow = 3 });

    (void)state;
    plug(b, 5, 77);
    watch(b, 5);
    cycles(b, 20);
    assert_true(b->master.stats.emcy_received > 0); /* 0x1019 is 0 there */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(devices_without_a_number_are_found_and_numbered),
        cmocka_unit_test(one_device_is_renumbered_by_its_identity),
        cmocka_unit_test(refusals_and_wrong_questions_are_told_apart),
        cmocka_unit_test(a_node_is_guarded_and_guards_its_life),
        cmocka_unit_test(an_answer_that_does_not_toggle_does_not_count),
        cmocka_unit_test(time_goes_out_and_is_taken),
        cmocka_unit_test(sync_counts_from_one_to_the_overflow),
        cmocka_unit_test(a_sync_of_the_wrong_length_is_reported),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
