/* tests/test_drive_turns_harm.c - the ODrive and the moteus driver on a line that
 * harms what their drives say.
 *
 * HARMS=100000 in the environment for so many; make harm does. */
#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "hal/drive_moteus.h"
#include "hal/drive_odrive.h"
#include "motion/fixed.h"
#include "sim/sim_moteus.h"
#include "sim/sim_odrive.h"

#include "tests/can_harm.h"
#include "tests/check.h"

#define MS   INT64_C(1000000)
#define ONE  MOTION_FIXED_ONE_Q32
#define SAID 8192 /* positions that the drive has sent */

/* Its frames have the identifiers of a CANopen TPDO1, of which can_harm makes
 * none up that could be believed. */
#define ODRIVE_NODE 12
#define MOTEUS_ID   5

static struct sim_world world;
static struct sim_can_bus wire;
static struct sim_can_port port, witness;
static struct can_harm harm;
static struct can_bus bus;
static struct drive_odrive odrive;
static struct drive_moteus moteus;
static struct sim_odrive odrive_device;
static struct sim_moteus moteus_device;

/* The one that is looked at. */
static struct hal_drive *drive;
static bool is_moteus;
static struct hal_drive_feedback seen;
static int64_t seen_ns, now_ns;
static int64_t said[SAID];
static unsigned said_count, enabled, offs, faults;

static void note(const uint8_t *at)
{
    float turns;

    memcpy(&turns, at, sizeof turns);
    said[said_count++ % SAID] = llround((double)turns * 4294967296.0);
}

static void heard(void *context, const struct hal_can_frame *frame)
{
    (void)context;
    if (!is_moteus && frame->id == ODRIVE_NODE * 32 + 9 && frame->len == 8)
        note(frame->data);
    if (is_moteus && frame->id == MOTEUS_ID << 8 && frame->len >= 20)
        note(frame->data + 5); /* mode: 3 bytes; head: 2 */
}

static const struct drive_turns_config turns = {
    .turns_num = 1, .turns_den = 1, .period_ns = MS, .stop_acc_q16 = 100 << 16
};
static const struct sim_plant_config plant = {
    .omega_mrad_s = 400000,
    .zeta_permille = 1000,
    .vel_max_counts_s = 100 * 65536,
    .acc_max_counts_s2 = 10000 * 65536,
};

static void odrive_init(void)
{
    const struct sim_odrive_config device = { .node = ODRIVE_NODE,
                                              .plant = plant,
                                              .start_counts = 123456,
                                              .heartbeat_ns = 20 * MS,
                                              .boot_ns = 30 * MS,
                                              .enable_watchdog = 190,
                                              .watchdog_timeout = 191 };
    const struct drive_odrive_config config = { .node = ODRIVE_NODE,
                                                .turns = turns,
                                                .heartbeat_ns = 20 * MS,
                                                .enable_watchdog = 190,
                                                .watchdog_timeout = 191,
                                                .watchdog_ns = 100 * MS };

    assert_int_equal(sim_odrive_init(&odrive_device, &wire, &device), 0);
    assert_int_equal(drive_odrive_init(&odrive, &bus, &config), 0);
    drive = &odrive.turns.drive;
}

static void moteus_init(void)
{
    const struct sim_moteus_config device = { .id = MOTEUS_ID,
                                              .plant = plant,
                                              .start_counts = -54321,
                                              .boot_ns = 30 * MS };
    const struct drive_moteus_config config = { .id = MOTEUS_ID,
                                                .switched = true,
                                                .turns = turns };

    assert_int_equal(sim_can_bus_set_fd(&wire, 5), 0);
    assert_int_equal(sim_moteus_init(&moteus_device, &wire, &device), 0);
    assert_int_equal(drive_moteus_init(&moteus, &bus, &config), 0);
    drive = &moteus.turns.drive;
}

static void bench_of(bool moteus_bench, uint64_t seed)
{
    is_moteus = moteus_bench;
    memset(&seen, 0, sizeof seen);
    seen_ns = 0;
    said_count = enabled = offs = faults = 0;
    now_ns = 1000 * MS;
    sim_world_init(&world, now_ns);
    assert_int_equal(sim_can_bus_init(&wire, &world, 1000000), 0);
    assert_int_equal(sim_can_port_init(&port, &wire), 0);
    assert_int_equal(sim_can_port_init(&witness, &wire), 0);
    can_harm_init(&harm, &port.can, seed);
    harm.heard = heard;
    can_bus_init(&bus, &harm.can);
    if (is_moteus)
        moteus_init();
    else
        odrive_init();
}

static bool has_torque(void)
{
    return is_moteus ? moteus_device.mode == 10 : odrive_device.axis_state != 1;
}

/* Torque only with the watchdog as it was to be. */
static void check_watchdog(void)
{
    const float watchdog_s =
        is_moteus ? moteus_device.command[7] : odrive_device.watchdog_s;

    if (has_torque())
        assert_true((is_moteus || odrive_device.watchdog_on) &&
                    watchdog_s > 0.099f && watchdog_s < 0.101f);
}

/* A position that is reported is one that the drive has sent. */
static void check_position(void)
{
    assert_true(seen.t_ns <= now_ns);
    for (unsigned i = 0; i < SAID && i < said_count; i++)
        if (said[(said_count - 1 - i) % SAID] == seen.pos_q32)
            return;
    fail_msg("%.9f was never sent (%u harmed)",
             (double)seen.pos_q32 / (double)ONE, can_harm_count(&harm));
}

static void tick(void)
{
    const struct hal_drive_target target = { .pos_q32 =
                                                 seen.pos_q32 + ONE / 200 };

    harm.now_ns = now_ns;
    sim_world_run(&world, now_ns);
    (void)hal_fieldbus_begin(&bus.fieldbus, now_ns);
    hal_drive_feedback(drive, &seen);
    assert_non_null(memchr(seen.fault_text, 0, sizeof seen.fault_text));
    if (seen.t_ns != seen_ns)
        check_position();
    seen_ns = seen.t_ns;
    check_watchdog();
    (void)hal_drive_set_target(drive, &target);
    (void)hal_fieldbus_end(&bus.fieldbus, now_ns);
    now_ns += MS;
}

/* As a person would, again and again. */
static void drive_on(void)
{
    if (seen.state == HAL_DRIVE_FAULT || seen.state == HAL_DRIVE_OFFLINE)
        hal_drive_request(drive, HAL_DRIVE_REQUEST_RESET);
    else
        hal_drive_request(drive, HAL_DRIVE_REQUEST_ENABLE);
    enabled += seen.state == HAL_DRIVE_ENABLED;
    faults += seen.state == HAL_DRIVE_FAULT;
    offs += seen.state == HAL_DRIVE_OFF;
}

/* Off is off, whatever is on the line. */
static void check_stays_off(void)
{
    hal_drive_request(drive, HAL_DRIVE_REQUEST_OFF);
    for (unsigned i = 0; i < 600; i++) {
        tick();
        assert_true(i < 200 || (seen.state != HAL_DRIVE_ENABLED &&
                                seen.state != HAL_DRIVE_ENABLING));
    }
    assert_false(has_torque());
}

static void check_recovers(void)
{
    can_harm_mend(&harm);
    for (unsigned i = 0; i < 100; i++)
        tick();
    for (unsigned i = 0; i < 12000; i++) {
        tick();
        if (i % 500 == 0)
            drive_on();
        if (seen.state == HAL_DRIVE_ENABLED && i > 1000)
            return;
    }
    fail_msg("a good line, and still %s: %s", hal_drive_state_text(seen.state),
             seen.fault_text);
}

static void trip(void)
{
    if (is_moteus)
        sim_moteus_inject(&moteus_device, (harm.seed & 8) != 0
                                              ? SIM_MOTEUS_REBOOT
                                              : SIM_MOTEUS_DRIVER);
    else
        sim_odrive_inject(&odrive_device, (harm.seed & 8) != 0
                                              ? SIM_ODRIVE_REBOOT
                                              : SIM_ODRIVE_OVERCURRENT);
}

static void harm_it(bool moteus_bench)
{
    const unsigned wanted = can_harm_wanted(20000);

    bench_of(moteus_bench, 77);
    while (can_harm_count(&harm) < wanted) {
        harm.one_in = 1 + (unsigned)(check_random(&harm.seed) % 60);
        for (unsigned i = 0; i < 3000; i++) {
            tick();
            if (i % 50 == 0)
                drive_on();
            if (i == 1500 && harm.seed % 4 == 0)
                trip();
        }
        check_stays_off();
        check_recovers();
    }
    can_harm_print(&harm);
    print_message("%" PRId64 " s; looked at while enabled %u, off %u, in "
                  "fault %u times\n",
                  now_ns / (1000 * MS), enabled, offs, faults);
    assert_true(enabled > 50 && offs > 5 && faults > 5);
}

static void nothing_wrong_from_an_odrive_is_believed(void **state)
{
    (void)state;
    harm_it(false);
}

static void nothing_wrong_from_a_moteus_is_believed(void **state)
{
    (void)state;
    harm_it(true);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(nothing_wrong_from_an_odrive_is_believed),
        cmocka_unit_test(nothing_wrong_from_a_moteus_is_believed),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
