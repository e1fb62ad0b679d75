/* tests/conform/test_conform_drive.c - the claims of conform_drive.h on every
 * drive, each with its simulated device. */
#include "tests/conform/conform_drive.h"

#include <string.h>

#include "hal/drive/cia402/drive.h"
#include "motion/core/fixed.h"
#include "sim/device/cia402/servo.h"
#include "tests/hal/linux/modbus_bench.h"
#include "tests/support/kind/kind.h"

#define S   INT64_C(1000000000)
#define ONE MOTION_FIXED_ONE_Q32

static struct sim_world world;
static struct sim_can_bus wire;
static struct sim_can_port port, witness; /* somebody who acknowledges */

static void wire_up(struct conform_drive *b, uint32_t bit_rate)
{
    b->world = &world;
    sim_world_init(&world, b->now_ns);
    assert_int_equal(sim_can_bus_init(&wire, &world, bit_rate), 0);
    sim_can_port_init(&port, &wire);
    sim_can_port_init(&witness, &wire);
}

/* Counts of the plant, 24 fraction bits, to units. */
static int64_t units_of(int64_t pos_q24, int64_t counts, int64_t units)
{
    int64_t pos_q32 = 0;

    assert_int_equal(
        motion_fixed_muldiv(pos_q24, units * 256, counts, &pos_q32), 0);
    return pos_q32;
}

/* ---- drives that count turns ------------------------------------------- */

static struct can_bus can_bus;
static const struct kind_turn *turn;
static enum kind_turn_how turn_how;

static struct hal_drive *turn_setup(struct conform_drive *b)
{
    wire_up(b, 1000000);
    can_bus_init(&can_bus, &port.can);
    b->fieldbus = &can_bus.fieldbus;
    return turn->init(&wire, &can_bus, turn_how);
}

static int64_t turn_ruler_q32(struct conform_drive *b)
{
    (void)b;
    return units_of(sim_servo_pos_q24(turn->servo), turn->counts,
                    KIND_TURN_UNITS);
}

static void turn_trouble(struct conform_drive *b,
                         enum conform_drive_trouble trouble)
{
    static const enum sim_servo_fault fault[] = {
        [CONFORM_DRIVE_TRIP] = SIM_SERVO_TRIP,
        [CONFORM_DRIVE_LASTING_TRIP] = SIM_SERVO_ENCODER,
        [CONFORM_DRIVE_SILENT] = SIM_SERVO_SILENT,
        [CONFORM_DRIVE_HEAL] = SIM_SERVO_CLEAR,
    };

    (void)b;
    sim_servo_inject(turn->servo, fault[trouble]);
}

static int conform_turn(const struct kind_turn_conform *claim)
{
    struct conform_drive bench = {
        .name = claim->text,
        .setup = turn_setup,
        .ruler_q32 = turn_ruler_q32,
        .trouble = turn_trouble,
        .tick_ns = 1 * MS,
        .start_ns = 1 * S,
        .enable_ns = claim->enable_ns,
        .trip_ns = claim->trip_ns,
        .silent_ns = 60 * MS,
        .follow_q32 = ONE / 20,
        .report_q32 = ONE / 200,
        .stand_q32 = ONE / 1000,
        .beyond_q32 = INT64_C(400000) * ONE,
        .lasts = true,
    };

    turn_how = claim->how;
    return conform_drive(&bench);
}

/* Two ways of being set up, or one. */
static int conform_turns(void)
{
    int failed = 0;

    for (unsigned i = 0; i < RIG_DRIVE_KINDS; i++) {
        turn = kind_tests[i]->turn;
        for (unsigned k = 0;
             turn != NULL && k < 2 && turn->conform[k].text != NULL; k++)
            failed += conform_turn(&turn->conform[k]);
    }
    return failed;
}

/* ---- CiA 402 ------------------------------------------------------------ */

#define COUNTS 1000 /* per unit */

static struct sim_cia402 cia402_device;
static struct canopen canopen;
static struct drive_cia402 cia402;

static struct hal_drive *cia402_setup(struct conform_drive *b)
{
    static const struct canopen_config master = {
        .node_id = 127, .sync_period_ns = 1 * MS, .heartbeat_period_ns = 20 * MS
    };
    static const struct drive_cia402_config config = {
        .node_id = 1,
        .counts_num = COUNTS,
        .counts_den = 1,
        .sync_period_ns = 1 * MS,
        .quick_stop_counts_s2 = 200 * COUNTS,
    };
    static const struct sim_cia402_config device = {
        .node_id = 1,
        .plant = { .omega_mrad_s = 400000,
                   .zeta_permille = 1000,
                   .vel_max_counts_s = 100 * COUNTS,
                   .acc_max_counts_s2 = 10000 * COUNTS },
        .start_counts = 54321,
        .loop_ns = 250000,
        .brake_release_ns = 80 * MS,
        .boot_ns = 30 * MS,
    };

    wire_up(b, 1000000);
    assert_int_equal(canopen_init(&canopen, &port.can, &master), 0);
    b->fieldbus = &canopen.fieldbus;
    assert_int_equal(sim_cia402_init(&cia402_device, &wire, &device), 0);
    assert_int_equal(drive_cia402_init(&cia402, &canopen, &config), 0);
    return &cia402.drive;
}

static int64_t cia402_ruler_q32(struct conform_drive *b)
{
    (void)b;
    return units_of(sim_servo_pos_q24(&cia402_device.base), COUNTS, 1);
}

static void cia402_trouble(struct conform_drive *b,
                           enum conform_drive_trouble trouble)
{
    static const enum sim_cia402_fault fault[] = {
        [CONFORM_DRIVE_TRIP] = SIM_CIA402_OVERCURRENT,
        [CONFORM_DRIVE_SILENT] = SIM_CIA402_SILENT,
        [CONFORM_DRIVE_HEAL] = SIM_CIA402_CLEAR,
    };

    (void)b;
    sim_cia402_inject(&cia402_device, fault[trouble]);
}

static struct conform_drive cia402_bench = {
    .name = "drive_cia402",
    .setup = cia402_setup,
    .ruler_q32 = cia402_ruler_q32,
    .trouble = cia402_trouble,
    .tick_ns = 1 * MS,
    .start_ns = 2 * S,
    .enable_ns = 500 * MS,
    .trip_ns = 200 * MS,
    .silent_ns = 100 * MS,
    .follow_q32 = ONE / 20,
    .report_q32 = ONE / 100, /* the ruler steps every 250 us */
    .stand_q32 = ONE / 200,
    .beyond_q32 = INT64_C(3000000) * ONE,
    .homing_method = 35, /* here */
};

/* ---- by a register map -------------------------------------------------- */

static struct modbus_bench modbus;

static struct hal_drive *modbus_setup(struct conform_drive *b)
{
    modbus_bench_load(&modbus, "leadshine-el7");
    modbus_bench_init(&modbus);
    b->world = &modbus.world;
    b->fieldbus = &modbus.bus.fieldbus;
    b->now_ns = modbus.world.now_ns;
    return &modbus.drive.drive;
}

static int64_t modbus_ruler_q32(struct conform_drive *b)
{
    (void)b;
    return units_of(sim_modbus_servo_counts(&modbus.servo) * (1 << 24),
                    BENCH_COUNTS, 1);
}

static void modbus_trouble(struct conform_drive *b,
                           enum conform_drive_trouble trouble)
{
    static const enum sim_modbus_servo_fault fault[] = {
        [CONFORM_DRIVE_TRIP] = SIM_MODBUS_SERVO_ALARM,
        [CONFORM_DRIVE_SILENT] = SIM_MODBUS_SERVO_OFF,
        [CONFORM_DRIVE_HEAL] = SIM_MODBUS_SERVO_CLEAR,
    };

    (void)b;
    sim_modbus_servo_inject(&modbus.servo, fault[trouble]);
}

static struct conform_drive modbus_servo_bench = {
    .name = "drive_modbus",
    .setup = modbus_setup,
    .ruler_q32 = modbus_ruler_q32,
    .trouble = modbus_trouble,
    .tick_ns = 1 * MS,
    .start_ns = 3 * S,
    .enable_ns = 1 * S,
    .trip_ns = 200 * MS,
    .silent_ns = 500 * MS,
    .follow_q32 = ONE,
    .report_q32 = ONE / 4,
    .stand_q32 = ONE / 20,
    .beyond_q32 = INT64_C(300000) * ONE,
};

int main(void)
{
    return conform_turns() + conform_drive(&cia402_bench) +
           conform_drive(&modbus_servo_bench);
}
