/* tests/test_conform_drive.c - the claims of conform_drive.h on every drive,
 * each with its simulated device. */
#include "tests/conform_drive.h"

#include <string.h>

#include "hal/drive_odrive.h"
#include "motion/fixed.h"
#include "sim/sim_odrive.h"

#define MS  INT64_C(1000000)
#define S   INT64_C(1000000000)
#define ONE MOTION_FIXED_ONE_Q32

/* One unit is a tenth of a turn: 20 units/s are 2 turns/s. */
#define TURNS_NUM 1
#define TURNS_DEN 10

static struct sim_world world;
static struct sim_can_bus wire;
static struct sim_can_port port, witness; /* somebody who acknowledges */

static void wire_up(const struct conform_drive *b, uint32_t bit_rate)
{
    sim_world_init(&world, b->now_ns);
    assert_int_equal(sim_can_bus_init(&wire, &world, bit_rate), 0);
    assert_int_equal(sim_can_port_init(&port, &wire), 0);
    assert_int_equal(sim_can_port_init(&witness, &wire), 0);
}

/* Counts of the plant, 24 fraction bits, to units. */
static int64_t units_of(int64_t pos_q24, int64_t counts, int64_t units)
{
    int64_t pos_q32 = 0;

    assert_int_equal(
        motion_fixed_muldiv(pos_q24, units * 256, counts, &pos_q32), 0);
    return pos_q32;
}

static const struct sim_plant_config turns_plant = {
    .omega_mrad_s = 400000,
    .zeta_permille = 1000,
    .vel_max_counts_s = 10 * 65536,
    .acc_max_counts_s2 = 1000 * 65536,
};

static const struct drive_turns_config turns_config = {
    .turns_num = TURNS_NUM,
    .turns_den = TURNS_DEN,
    .period_ns = 1 * MS,
    .latency_ns = 200000,
    .answer_ns = 130000,
    .stop_acc_q16 = 200 << 16,
};

/* ---- ODrive ------------------------------------------------------------- */

static struct sim_odrive odrive_device;
static struct drive_odrive odrive;
static struct can_bus can_bus;
static bool odrive_is_05;

static struct hal_drive *odrive_setup(struct conform_drive *b)
{
    const struct sim_odrive_config device = {
        .node = 3,
        .is_05 = odrive_is_05,
        .plant = turns_plant,
        .start_counts = 123456,
        .boot_ns = 50 * MS,
        .enable_watchdog = 190,
        .watchdog_timeout = 191,
    };
    struct drive_odrive_config config = { .node = 3, .turns = turns_config };

    if (!odrive_is_05) {
        config.enable_watchdog = 190;
        config.watchdog_timeout = 191;
        config.watchdog_ns = 100 * MS;
    }
    wire_up(b, 1000000);
    assert_int_equal(sim_odrive_init(&odrive_device, &wire, &device), 0);
    can_bus_init(&can_bus, &port.can);
    assert_int_equal(drive_odrive_init(&odrive, &can_bus, &config), 0);
    return &odrive.turns.drive;
}

static void can_bus_tick(struct conform_drive *b)
{
    sim_world_run(&world, b->now_ns);
    assert_int_equal(hal_fieldbus_begin(&can_bus.fieldbus, b->now_ns), 0);
}

static void can_bus_tock(struct conform_drive *b)
{
    assert_int_equal(hal_fieldbus_end(&can_bus.fieldbus, b->now_ns), 0);
}

static int64_t odrive_ruler_q32(struct conform_drive *b)
{
    (void)b;
    return units_of(sim_odrive_pos_q24(&odrive_device), SIM_ODRIVE_COUNTS,
                    TURNS_DEN / TURNS_NUM);
}

static void odrive_trouble(struct conform_drive *b,
                           enum conform_drive_trouble trouble)
{
    static const enum sim_odrive_fault fault[] = {
        [CONFORM_DRIVE_TRIP] = SIM_ODRIVE_OVERCURRENT,
        [CONFORM_DRIVE_LASTING_TRIP] = SIM_ODRIVE_ENCODER,
        [CONFORM_DRIVE_SILENT] = SIM_ODRIVE_SILENT,
        [CONFORM_DRIVE_HEAL] = SIM_ODRIVE_CLEAR,
    };

    (void)b;
    sim_odrive_inject(&odrive_device, fault[trouble]);
}

static struct conform_drive odrive_bench = {
    .setup = odrive_setup,
    .begin = can_bus_tick,
    .end = can_bus_tock,
    .ruler_q32 = odrive_ruler_q32,
    .trouble = odrive_trouble,
    .tick_ns = 1 * MS,
    .start_ns = 1 * S,
    .enable_ns = 300 * MS,
    .trip_ns = 110 * MS,
    .silent_ns = 60 * MS,
    .follow_q32 = ONE / 8,
    .report_q32 = ONE / 200,
    .stand_q32 = ONE / 1000,
    .beyond_q32 = INT64_C(400000) * ONE,
    .lasts = true,
};

static int all_odrives(void)
{
    int failed;

    odrive_bench.name = "drive_odrive, firmware 0.6";
    odrive_is_05 = false;
    failed = conform_drive(&odrive_bench);
    odrive_bench.name = "drive_odrive, firmware 0.5";
    odrive_is_05 = true;
    return failed + conform_drive(&odrive_bench);
}

int main(void)
{
    return all_odrives();
}
