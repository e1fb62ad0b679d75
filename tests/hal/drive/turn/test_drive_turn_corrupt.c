/* tests/hal/drive/turn/test_drive_turn_corrupt.c - the drivers of all
 * drives that count turns on a line that corrupts what these say.
 *
 * CORRUPTIONS=100000 in the environment for so many; make corrupt does. */
#include <inttypes.h>
#include <string.h>

#include "motion/core/fixed.h"
#include "tests/support/can_corrupt.h"
#include "tests/support/check.h"
#include "tests/support/kind/kind.h"

#define MS     INT64_C(1000000)
#define ONE    MOTION_FIXED_ONE_Q32
#define WITHIN 1 /* unit: at 10 units/s, 40 ms late */

struct bench {
    struct sim_world world;
    struct sim_can_bus wire;
    struct sim_can_port port, witness;
    struct can_corrupt corrupt;
    struct can_bus bus;
    struct hal_drive *drive;
    struct hal_drive_feedback seen;
    int64_t now_ns;
    const struct kind_turn *turn;
    unsigned enabled, offs, faults;
};

static struct bench bench;
static int64_t ruler_q32(const struct bench *b)
{
    int64_t pos_q32 = 0;

    assert_int_equal(motion_fixed_muldiv(sim_servo_pos_q24(b->turn->servo),
                                         KIND_TURN_UNITS * 256, b->turn->counts,
                                         &pos_q32),
                     0);
    return pos_q32;
}

static void setup(struct bench *b, const struct kind_turn *turn)
{
    memset(b, 0, sizeof *b);
    b->now_ns = 1000 * MS;
    sim_world_init(&b->world, b->now_ns);
    assert_int_equal(sim_can_bus_init(&b->wire, &b->world, 1000000), 0);
    sim_can_port_init(&b->port, &b->wire);
    sim_can_port_init(&b->witness, &b->wire);
    can_corrupt_init(&b->corrupt, &b->port.can, 77);
    can_bus_init(&b->bus, &b->corrupt.port.can);
    b->turn = turn;
    b->corrupt.has_values = turn->has_values;
    b->drive = turn->init(&b->wire, &b->bus, KIND_WATCHED);
}

/* ---- what must hold ---- */

static void check_position(const struct bench *b)
{
    const int64_t off_q32 = b->seen.pos_q32 - ruler_q32(b);

    if (b->seen.t_ns == 0 || b->seen.state == HAL_DRIVE_OFFLINE ||
        b->now_ns - b->seen.t_ns > 50 * MS)
        return;
    assert_true(b->seen.t_ns <= b->now_ns);
    if (off_q32 > WITHIN * ONE || off_q32 < -WITHIN * ONE)
        fail_msg("%s: it says %.3f, and is at %.3f (%u corrupted)",
                 hal_drive_state_text(b->seen.state),
                 (double)b->seen.pos_q32 / (double)ONE,
                 (double)ruler_q32(b) / (double)ONE,
                 can_corrupt_count(&b->corrupt));
}

/* Up and down at 10 units/s, from where it says it is. */
static void tick(struct bench *b)
{
    const int64_t step_q32 =
        b->now_ns / (500 * MS) % 2 ? ONE / 100 : -(ONE / 100);
    const struct hal_drive_target target = { .pos_q32 =
                                                 b->seen.pos_q32 + step_q32 };

    b->corrupt.now_ns = b->now_ns;
    sim_world_run(&b->world, b->now_ns);
    (void)hal_fieldbus_begin(&b->bus.fieldbus, b->now_ns);
    hal_drive_feedback(b->drive, &b->seen);
    assert_non_null(memchr(b->seen.fault_text, 0, sizeof b->seen.fault_text));
    check_position(b);
    (void)hal_drive_set_target(b->drive, &target);
    hal_fieldbus_end(&b->bus.fieldbus, b->now_ns);
    b->now_ns += MS;
}

static void drive_on(struct bench *b)
{
    const enum hal_drive_state state = b->seen.state;

    hal_drive_request(b->drive,
                      state == HAL_DRIVE_FAULT || state == HAL_DRIVE_OFFLINE
                          ? HAL_DRIVE_REQUEST_RESET
                          : HAL_DRIVE_REQUEST_ENABLE);
    b->enabled += state == HAL_DRIVE_ENABLED;
    b->offs += state == HAL_DRIVE_OFF;
    b->faults += state == HAL_DRIVE_FAULT || state == HAL_DRIVE_OFFLINE;
}

/* Without a request nothing gets torque, whatever is on the line. */
static void check_stays_off(struct bench *b)
{
    hal_drive_request(b->drive, HAL_DRIVE_REQUEST_OFF);
    for (unsigned i = 0; i < 800; i++) {
        tick(b);
        assert_true(i < 500 || (b->seen.state != HAL_DRIVE_ENABLED &&
                                b->seen.state != HAL_DRIVE_ENABLING));
    }
}

static void check_recovers(struct bench *b)
{
    can_corrupt_mend(&b->corrupt);
    for (unsigned i = 0; i < 12000; i++) {
        tick(b);
        if (i % 500 == 100)
            drive_on(b);
        if (b->seen.state == HAL_DRIVE_ENABLED && i > 1000)
            return;
    }
    fail_msg("a good line, and still %s: %s",
             hal_drive_state_text(b->seen.state), b->seen.fault_text);
}

static void run(struct bench *b)
{
    const unsigned wanted = can_corrupt_wanted(20000);

    while (can_corrupt_count(&b->corrupt) < wanted) {
        b->corrupt.one_in = 2 + (unsigned)(check_random(&b->corrupt.seed) % 60);
        for (unsigned i = 0; i < 3000; i++) {
            tick(b);
            if (i % 50 == 0)
                drive_on(b);
            if (i == 1500 && b->corrupt.seed % 4 == 0)
                sim_servo_inject(b->turn->servo, SIM_SERVO_TRIP);
        }
        check_stays_off(b);
        check_recovers(b);
    }
    can_corrupt_print(&b->corrupt);
    print_message("%" PRId64 " s; looked at while enabled %u, off %u, in "
                  "fault or lost %u times\n",
                  b->now_ns / (1000 * MS), b->enabled, b->offs, b->faults);
    assert_true(b->enabled > 50 && b->faults > 5);
    for (unsigned i = 1; i < CAN_CORRUPT_KINDS; i++)
        assert_true(b->corrupt.done[i] > wanted / 20);
}

static void none_believes_anything_wrong_and_all_go_on(void **state)
{
    (void)state;
    for (unsigned i = 0; i < RIG_DRIVE_KINDS; i++) {
        if (kind_tests[i]->turn == NULL)
            continue;
        print_message("%s: ", kind_tests[i]->turn->text);
        setup(&bench, kind_tests[i]->turn);
        run(&bench);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(none_believes_anything_wrong_and_all_go_on),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
