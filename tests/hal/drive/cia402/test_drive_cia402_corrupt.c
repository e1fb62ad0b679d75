/* tests/hal/drive/cia402/test_drive_cia402_corrupt.c - the CiA 402 driver on a
 * line that corrupts what its drive says: start-up list, PDOs, heartbeats, EMCY,
 * one as the other.
 *
 * CORRUPTIONS=100000 in the environment for so many; make corrupt does. */
#include <inttypes.h>
#include <string.h>

#include "hal/drive/cia402/drive.h"
#include "motion/core/fixed.h"
#include "sim/device/cia402/parts.h"
#include "sim/device/cia402/servo.h"

#include "tests/hal/canopen/canopen_bench.h"
#include "tests/support/can_corrupt.h"

#define ONE   MOTION_FIXED_ONE_Q32
#define NODE  5
#define START 654321
#define SAID  8192 /* positions that the servo has sent */

struct bench {
    struct sim_world world;
    struct sim_can_bus bus;
    struct sim_can_port port;
    struct sim_cia402 servo;
    struct can_corrupt corrupt;
    struct canopen master;
    struct drive_cia402 drive;
    struct hal_drive_feedback seen;
    int64_t seen_ns, now_ns;
    int32_t said[SAID];
    unsigned said_count;
    unsigned enabled, offs, faults; /* ticks, transitions */
};

static void heard(void *context, const struct hal_can_frame *frame)
{
    struct bench *b = context;
    int32_t counts;

    if (frame->id != 0x180 + NODE || frame->len < 6)
        return;
    memcpy(&counts, frame->data + 2, sizeof counts);
    b->said[b->said_count++ % SAID] = counts;
}

static void bench_of(struct bench *b, uint64_t seed)
{
    static const struct canopen_config master = CANOPEN_BENCH_MASTER;
    static const struct drive_cia402_config drive = {
        .node_id = NODE,
        CANOPEN_BENCH_COUNTS,
        .following_error_counts = 5000,
        .quick_stop_counts_s2 = 2000000,
    };
    static const struct sim_cia402_config servo = {
        .node_id = NODE,
        .plant = CANOPEN_BENCH_PLANT,
        .start_counts = START,
        .loop_ns = 250000,
        .brake_release_ns = 5 * MS,
        .boot_ns = 30 * MS,
    };

    memset(b, 0, sizeof *b);
    b->now_ns = 1000 * MS;
    canopen_bench_wire(&b->world, &b->bus, &b->port);
    can_corrupt_init(&b->corrupt, &b->port.can, seed);
    b->corrupt.heard = heard;
    b->corrupt.context = b;
    assert_int_equal(canopen_init(&b->master, &b->corrupt.port.can, &master),
                     0);
    assert_int_equal(sim_cia402_init(&b->servo, &b->bus, &servo), 0);
    assert_int_equal(drive_cia402_init(&b->drive, &b->master, &drive), 0);
}

/* A servo that has torque has it with its own watchdog and mode as they must
 * be. */
static void check_configuration(struct bench *b)
{
    static const struct {
        enum cia402_row row;
        uint32_t want;
    } wants[] = {
        { CIA402_ABORT_OPTION, 3 },
        { CIA402_MODE, 8 },
        { CIA402_FOLLOWING_WINDOW, 5000 },
        { CIA402_QUICK_STOP_DECELERATION, 2000000 },
        { CIA402_INTERPOLATION_TIME, 1 },
        { CIA402_RMAP1_2, 0x607A0020 },
        { CIA402_TMAP1_2, 0x60640020 },
    };

    if (b->servo.power != CIA402_POWER_ENABLED)
        return;
    for (size_t i = 0; i < ARRAY_LEN(wants); i++)
        if (b->servo.value[wants[i].row] != wants[i].want)
            fail_msg("%s, and row %zu is 0x%" PRIX32 " (%u corrupted)",
                     hal_drive_state_text(b->seen.state), i,
                     b->servo.value[wants[i].row],
                     can_corrupt_count(&b->corrupt));
}

/* A position that is reported is one that the servo has sent. */
static void check_position(const struct bench *b)
{
    int64_t counts = 0;

    if (b->seen.t_ns == 0)
        return;
    assert_true(b->seen.t_ns <= b->now_ns);
    assert_int_equal(motion_fixed_muldiv(b->seen.pos_q32, 1000, ONE, &counts),
                     0);
    for (unsigned i = 0; i < SAID && i < b->said_count; i++)
        if (b->said[(b->said_count - 1 - i) % SAID] == counts)
            return;
    fail_msg("%" PRId64 " was never sent (%u corrupted)", counts,
             can_corrupt_count(&b->corrupt));
}

static void tick(struct bench *b)
{
    const struct hal_drive_target target = { .pos_q32 =
                                                 b->seen.pos_q32 + ONE / 20 };

    b->corrupt.now_ns = b->now_ns;
    sim_world_run(&b->world, b->now_ns);
    (void)hal_fieldbus_begin(&b->master.fieldbus, b->now_ns);
    hal_drive_feedback(&b->drive.drive, &b->seen);
    assert_non_null(memchr(b->seen.fault_text, 0, sizeof b->seen.fault_text));
    if (b->seen.t_ns != b->seen_ns)
        check_position(b);
    b->seen_ns = b->seen.t_ns;
    check_configuration(b);
    (void)hal_drive_set_target(&b->drive.drive, &target);
    hal_fieldbus_end(&b->master.fieldbus, b->now_ns);
    b->now_ns += MS;
}

/* As a person would, again and again. */
static void drive_on(struct bench *b)
{
    const enum hal_drive_state state = b->seen.state;

    if (state == HAL_DRIVE_FAULT || state == HAL_DRIVE_OFFLINE)
        hal_drive_request(&b->drive.drive, HAL_DRIVE_REQUEST_RESET);
    else
        hal_drive_request(&b->drive.drive, HAL_DRIVE_REQUEST_ENABLE);
    b->enabled += state == HAL_DRIVE_ENABLED;
    b->faults += state == HAL_DRIVE_FAULT;
    b->offs += state == HAL_DRIVE_OFF;
}

/* Without a request nothing gets torque, whatever is on the line. */
static void check_stays_off(struct bench *b, unsigned ticks)
{
    hal_drive_request(&b->drive.drive, HAL_DRIVE_REQUEST_OFF);
    for (unsigned i = 0; i < ticks; i++) {
        tick(b);
        assert_true(i < 200 || (b->seen.state != HAL_DRIVE_ENABLED &&
                                b->seen.state != HAL_DRIVE_ENABLING));
    }
}

static void check_recovers(struct bench *b)
{
    can_corrupt_mend(&b->corrupt);
    for (unsigned i = 0; i < 100; i++)
        tick(b);
    for (unsigned i = 0; i < 12000; i++) {
        tick(b);
        if (i % 500 == 0)
            drive_on(b);
        if (b->seen.state == HAL_DRIVE_ENABLED && i > 1000)
            return;
    }
    fail_msg("kind %d at %u: a good line, and still %s: %s",
             b->corrupt.corrupt_kind, b->corrupt.corrupt_at,
             hal_drive_state_text(b->seen.state), b->seen.fault_text);
}

static void nothing_wrong_is_believed_and_a_good_line_goes_on(void **state)
{
    static struct bench bench;
    struct bench *b = &bench;
    const unsigned wanted = can_corrupt_wanted(20000);

    (void)state;
    bench_of(b, 77);
    while (can_corrupt_count(&b->corrupt) < wanted) {
        b->corrupt.one_in = 1 + (unsigned)(check_random(&b->corrupt.seed) % 60);
        for (unsigned i = 0; i < 3000; i++) {
            tick(b);
            if (i % 50 == 0)
                drive_on(b);
            if (i == 1500 && b->corrupt.seed % 4 == 0)
                sim_cia402_inject(&b->servo, b->corrupt.seed % 8 == 0
                                                 ? SIM_CIA402_REBOOT
                                                 : SIM_CIA402_OVERCURRENT);
        }
        check_stays_off(b, 400);
        check_recovers(b);
    }
    can_corrupt_print(&b->corrupt);
    print_message("%" PRId64 " s; looked at while enabled %u, off %u, in "
                  "fault %u times\n",
                  b->now_ns / (1000 * MS), b->enabled, b->offs, b->faults);
    assert_true(b->enabled > 50 && b->offs > 20 && b->faults > 50);
    for (unsigned i = 1; i < CAN_CORRUPT_KINDS; i++)
        assert_true(b->corrupt.done[i] > wanted / 20);
}

/* Every frame of the start-up in turn, by every kind of corruption. */
static void every_step_of_the_start_up_may_be_harmed(void **state)
{
    static struct bench bench;
    struct bench *b = &bench;
    unsigned steps = 0;

    (void)state;
    for (unsigned kind = 1; kind < CAN_CORRUPT_KINDS; kind++)
        for (unsigned at = 0; at < 200; at++) {
            bench_of(b, 1 + at);
            b->corrupt.corrupt_at = at + 1;
            b->corrupt.corrupt_kind = (enum can_corrupt_kind)kind;
            for (unsigned i = 0; i < 3000 && b->seen.state != HAL_DRIVE_OFF;
                 i++)
                tick(b);
            steps += b->corrupt.done[kind];
            check_recovers(b);
        }
    print_message("%u frames of the start-up corrupted\n", steps);
    assert_true(steps > 500);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_step_of_the_start_up_may_be_harmed),
        cmocka_unit_test(nothing_wrong_is_believed_and_a_good_line_goes_on),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
