/* tests/hal/drive/turn/test_drive_turns_harm.c - the ODrive and the moteus
 * driver on a line that harms what their drives say.
 *
 * HARMS=100000 in the environment for so many; make harm does. */
#include <inttypes.h>
#include <string.h>

#include "hal/drive/moteus/drive.h"
#include "hal/drive/odrive/drive.h"
#include "motion/core/fixed.h"
#include "sim/device/moteus/servo.h"
#include "sim/device/odrive/servo.h"

#include "tests/support/can_harm.h"
#include "tests/support/check.h"

#define MS         INT64_C(1000000)
#define ONE        MOTION_FIXED_ONE_Q32
#define UNITS      10 /* per turn */
#define ODRIVE_ID  3
#define MOTEUS_ID  5
#define NODE_SHIFT 5
#define WITHIN     1 /* unit: at 10 units/s, 40 ms late */

struct bench {
    struct sim_world world;
    struct sim_can_bus wire;
    struct sim_can_port port, witness;
    struct can_harm harm;
    struct can_bus bus;
    struct hal_drive *drive;
    struct hal_drive_feedback seen;
    int64_t now_ns;
    int64_t (*ruler_q32)(void);
    void (*trip)(void);
    unsigned enabled, offs, faults;
};

static struct bench bench;
static struct sim_odrive odrive_device;
static struct sim_moteus moteus_device;
static struct drive_odrive odrive;
static struct drive_moteus moteus;

static const struct sim_plant_config plant = {
    .omega_mrad_s = 400000,
    .zeta_permille = 1000,
    .vel_max_counts_s = 10 * 65536,
    .acc_max_counts_s2 = 1000 * 65536,
};

static const struct drive_turns_config turns = {
    .turns_num = 1,
    .turns_den = UNITS,
    .period_ns = MS,
    .latency_ns = 200000,
    .answer_ns = 130000,
    .stop_acc_q32 = INT64_C(200) << 32,
};

static int64_t units_of(int64_t pos_q24, int64_t counts)
{
    int64_t pos_q32 = 0;

    assert_int_equal(
        motion_fixed_muldiv(pos_q24, UNITS * 256, counts, &pos_q32), 0);
    return pos_q32;
}

static void wire_up(struct bench *b)
{
    memset(b, 0, sizeof *b);
    b->now_ns = 1000 * MS;
    sim_world_init(&b->world, b->now_ns);
    assert_int_equal(sim_can_bus_init(&b->wire, &b->world, 1000000), 0);
    sim_can_port_init(&b->port, &b->wire);
    sim_can_port_init(&b->witness, &b->wire);
    can_harm_init(&b->harm, &b->port.can, 77);
    can_bus_init(&b->bus, &b->harm.can);
}

/* ---- ODrive ---- */

static bool odrive_has_values(uint32_t id)
{
    return id >> NODE_SHIFT == ODRIVE_ID;
}

static int64_t odrive_ruler_q32(void)
{
    return units_of(sim_servo_pos_q24(&odrive_device.base), SIM_ODRIVE_COUNTS);
}

static void odrive_trip(void)
{
    sim_servo_inject(&odrive_device.base, SIM_SERVO_TRIP);
}

static void odrive_setup(struct bench *b)
{
    const struct sim_odrive_config device = { .node = ODRIVE_ID,
                                              .plant = plant,
                                              .start_counts = 123456,
                                              .boot_ns = 50 * MS,
                                              .enable_watchdog = 190,
                                              .watchdog_timeout = 191 };
    const struct drive_odrive_config config = { .node = ODRIVE_ID,
                                                .turns = turns,
                                                .enable_watchdog = 190,
                                                .watchdog_timeout = 191,
                                                .watchdog_ns = 100 * MS };

    wire_up(b);
    b->harm.has_values = odrive_has_values;
    b->ruler_q32 = odrive_ruler_q32;
    b->trip = odrive_trip;
    assert_int_equal(sim_odrive_init(&odrive_device, &b->wire, &device), 0);
    assert_int_equal(drive_odrive_init(&odrive, &b->bus, &config), 0);
    b->drive = &odrive.turns.drive;
}

/* ---- moteus ---- */

static bool moteus_has_values(uint32_t id)
{
    return (id >> 8 & 0x7F) == MOTEUS_ID;
}

static int64_t moteus_ruler_q32(void)
{
    return units_of(sim_servo_pos_q24(&moteus_device.base), SIM_MOTEUS_COUNTS);
}

static void moteus_trip(void)
{
    sim_servo_inject(&moteus_device.base, SIM_SERVO_TRIP);
}

static void moteus_setup(struct bench *b)
{
    const struct sim_moteus_config device = { .id = MOTEUS_ID,
                                              .plant = plant,
                                              .start_counts = -54321,
                                              .boot_ns = 50 * MS };
    const struct drive_moteus_config config = { .id = MOTEUS_ID,
                                                .switched = true,
                                                .turns = turns };

    wire_up(b);
    b->harm.has_values = moteus_has_values;
    b->ruler_q32 = moteus_ruler_q32;
    b->trip = moteus_trip;
    assert_int_equal(sim_can_bus_set_fd(&b->wire, 5), 0);
    assert_int_equal(sim_moteus_init(&moteus_device, &b->wire, &device), 0);
    assert_int_equal(drive_moteus_init(&moteus, &b->bus, &config), 0);
    b->drive = &moteus.turns.drive;
}

/* ---- what must hold ---- */

static void check_position(const struct bench *b)
{
    const int64_t off_q32 = b->seen.pos_q32 - b->ruler_q32();

    if (b->seen.t_ns == 0 || b->seen.state == HAL_DRIVE_OFFLINE ||
        b->now_ns - b->seen.t_ns > 50 * MS)
        return;
    assert_true(b->seen.t_ns <= b->now_ns);
    if (off_q32 > WITHIN * ONE || off_q32 < -WITHIN * ONE)
        fail_msg("%s: it says %.3f, and is at %.3f (%u harmed)",
                 hal_drive_state_text(b->seen.state),
                 (double)b->seen.pos_q32 / (double)ONE,
                 (double)b->ruler_q32() / (double)ONE,
                 can_harm_count(&b->harm));
}

/* Up and down at 10 units/s, from where it says it is. */
static void tick(struct bench *b)
{
    const int64_t step_q32 =
        b->now_ns / (500 * MS) % 2 ? ONE / 100 : -(ONE / 100);
    const struct hal_drive_target target = { .pos_q32 =
                                                 b->seen.pos_q32 + step_q32 };

    b->harm.now_ns = b->now_ns;
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
    can_harm_mend(&b->harm);
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
    const unsigned wanted = can_harm_wanted(20000);

    while (can_harm_count(&b->harm) < wanted) {
        b->harm.one_in = 2 + (unsigned)(check_random(&b->harm.seed) % 60);
        for (unsigned i = 0; i < 3000; i++) {
            tick(b);
            if (i % 50 == 0)
                drive_on(b);
            if (i == 1500 && b->harm.seed % 4 == 0)
                b->trip();
        }
        check_stays_off(b);
        check_recovers(b);
    }
    can_harm_print(&b->harm);
    print_message("%" PRId64 " s; looked at while enabled %u, off %u, in "
                  "fault or lost %u times\n",
                  b->now_ns / (1000 * MS), b->enabled, b->offs, b->faults);
    assert_true(b->enabled > 50 && b->faults > 5);
    for (unsigned i = 1; i < CAN_HARM_KINDS; i++)
        assert_true(b->harm.done[i] > wanted / 20);
}

static void an_odrive_believes_nothing_wrong_and_goes_on(void **state)
{
    (void)state;
    odrive_setup(&bench);
    run(&bench);
}

static void a_moteus_believes_nothing_wrong_and_goes_on(void **state)
{
    (void)state;
    moteus_setup(&bench);
    run(&bench);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_odrive_believes_nothing_wrong_and_goes_on),
        cmocka_unit_test(a_moteus_believes_nothing_wrong_and_goes_on),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
