/* tests/hal/canopen/test_canopen_lss_corrupt.c - LSS on a line that corrupts what
 * devices answer: a device that is found is one that is there, a number that
 * was set and stored is the one the device has.
 *
 * CORRUPTIONS=100000 in the environment for so many; make corrupt does. */
#include <string.h>

#include "hal/canopen/lss.h"
#include "sim/device/cia402/parts.h"
#include "sim/device/cia402/servo.h"

#include "tests/hal/canopen/canopen_bench.h"
#include "tests/support/can_corrupt.h"

#define DEVICES 2
#define NO_NODE 255

struct bench {
    struct sim_world world;
    struct sim_can_bus bus;
    struct sim_can_port port;
    struct sim_cia402 device[DEVICES];
    struct can_corrupt corrupt;
    struct canopen master;
    struct canopen_lss lss;
};

static void bench_of(struct bench *b, const struct can_corrupt *before)
{
    const struct canopen_config master = { .node_id = 127 };
    struct sim_cia402_config device = {
        .node_id = NO_NODE,
        .plant = CANOPEN_BENCH_PLANT,
        .loop_ns = 1000000,
    };

    memset(b, 0, sizeof *b);
    canopen_bench_wire(&b->world, &b->bus, &b->port);
    can_corrupt_init(&b->corrupt, &b->port.can, before->seed);
    memcpy(b->corrupt.done, before->done, sizeof before->done);
    b->corrupt.late_ns = 25 * MS;
    assert_int_equal(canopen_init(&b->master, &b->corrupt.port.can, &master),
                     0);
    canopen_lss_init(&b->lss, &b->master);
    b->master.lss = &b->lss;
    for (unsigned i = 0; i < DEVICES; i++) {
        device.serial = (uint32_t)check_random(&b->corrupt.seed) | 1;
        assert_int_equal(sim_cia402_init(&b->device[i], &b->bus, &device), 0);
    }
}

static void cycle(struct bench *b)
{
    b->corrupt.now_ns = b->world.now_ns + MS;
    canopen_bench_cycle(&b->world, &b->master);
}

static int outcome(struct bench *b)
{
    return canopen_bench_outcome(b, cycle, &b->lss);
}

#define NOW (b->world.now_ns)

/* Everybody out of the configuration state, and what is still on its way gone:
 * a person would do that before trying again. */
static void let_go(struct bench *b)
{
    assert_int_equal(canopen_lss_switch_all(&b->lss, false), MOTION_OK);
    for (unsigned i = 0; i < 60; i++)
        cycle(b);
}

static struct sim_cia402 *found(struct bench *b)
{
    for (unsigned i = 0; i < DEVICES; i++)
        if (b->device[i].config.serial == b->lss.found.serial)
            return &b->device[i];
    return NULL;
}

static bool scan(struct bench *b)
{
    assert_int_equal(canopen_lss_scan(&b->lss, NOW), MOTION_OK);
    if (outcome(b) != MOTION_OK)
        return false;
    if (found(b) == NULL || b->lss.found.vendor != 0 ||
        b->lss.found.product != 402 || b->lss.found.revision != 0x00010000)
        fail_msg("found a device that is not there, %u corrupted",
                 can_corrupt_count(&b->corrupt));
    return true;
}

/* Find, number, store; as far as the line lets us. */
static bool commission(struct bench *b, uint8_t id)
{
    struct sim_cia402 *device;

    if (!scan(b))
        return false;
    device = found(b);
    assert_int_equal(canopen_lss_set_node(&b->lss, NOW, id), MOTION_OK);
    if (outcome(b) != MOTION_OK)
        return false;
    assert_int_equal(device->lss.node_next, id);
    assert_int_equal(canopen_lss_store(&b->lss, NOW), MOTION_OK);
    if (outcome(b) != MOTION_OK)
        return false;
    assert_int_equal(device->lss.node_stored, id);
    assert_int_equal(canopen_lss_request_identity(&b->lss, NOW, 3), MOTION_OK);
    if (outcome(b) != MOTION_OK)
        return false;
    assert_int_equal(b->lss.value, device->config.serial);
    return true;
}

/* One that has been given a number does not answer scans any more. */
static bool all_wait(const struct bench *b)
{
    for (unsigned i = 0; i < DEVICES; i++)
        if (b->device[i].lss.node_next != 0)
            return false;
    return true;
}

static void nothing_wrong_is_believed_and_a_good_line_goes_on(void **state)
{
    static struct bench bench;
    struct bench *b = &bench;
    const unsigned wanted = can_corrupt_wanted(4000);
    struct can_corrupt before = { .seed = 5 };
    unsigned good = 0, refused = 0;

    (void)state;
    while (can_corrupt_count(&before) < wanted) {
        bench_of(b, &before);
        b->corrupt.one_in =
            2 + (unsigned)(check_random(&b->corrupt.seed) % 200);
        for (uint8_t id = 1; id < 12 && all_wait(b); id++) {
            if (commission(b, id))
                good++;
            else
                refused++;
            let_go(b);
        }
        can_corrupt_mend(&b->corrupt);
        let_go(b);
        if (!commission(b, 99))
            fail_msg("a good line, and no device is found");
        before = b->corrupt;
    }
    can_corrupt_print(&before);
    print_message("%u devices numbered, %u times refused\n", good, refused);
    assert_true(good > 10 && refused > 10);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_wrong_is_believed_and_a_good_line_goes_on),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
