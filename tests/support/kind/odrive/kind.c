/* tests/support/kind/odrive/kind.c - an ODrive; see tests/support/kind/kind.h. */
#include "tests/support/kind/kind.h"
#include "hal/drive/odrive/drive.h"
#include "sim/device/odrive/servo.h"
#include "tests/support/check.h"

#define MS   INT64_C(1000000)
#define NODE 3

/* ---- by itself ---- */

static struct sim_odrive device;
static struct drive_odrive driver;

static struct hal_drive *odrive_init(struct sim_can_bus *wire,
                                     struct can_bus *bus,
                                     enum kind_turn_how how)
{
    struct sim_odrive_config at = { .node = NODE,
                                    .is_05 = how == KIND_OLD,
                                    .plant = kind_turn_plant,
                                    .start_counts = 123456,
                                    .home_counts = 40000,
                                    .boot_ns = 50 * MS };
    struct drive_odrive_config config = { .node = NODE,
                                          .turn = kind_turn_config };

    if (how != KIND_PLAIN) {
        at.enable_watchdog = 190;
        at.watchdog_timeout = 191;
    }
    if (how == KIND_WATCHED) {
        config.enable_watchdog = 190;
        config.watchdog_timeout = 191;
        config.watchdog_ns = 100 * MS;
    }
    assert_int_equal(sim_odrive_init(&device, wire, &at), 0);
    assert_int_equal(drive_odrive_init(&driver, bus, &config), 0);
    return &driver.turn.drive;
}

static void odrive_restart(struct can_bus *bus)
{
    const struct drive_odrive_config config = driver.config;

    assert_int_equal(drive_odrive_init(&driver, bus, &config), 0);
}

static bool odrive_is_on(void)
{
    return device.axis_state != 1; /* idle */
}

static bool odrive_has_values(uint32_t id)
{
    return id >> 5 == NODE;
}

static const struct kind_turn odrive_turn = {
    .text = "ODrive",
    .init = odrive_init,
    .restart = odrive_restart,
    .servo = &device.base,
    .counts = SIM_ODRIVE_COUNTS,
    .has_torque = odrive_is_on,
    .has_values = odrive_has_values,
    .conform = { { "drive_odrive, firmware 0.6", KIND_WATCHED, 300 * MS,
                   110 * MS },
                 { "drive_odrive, firmware 0.5", KIND_OLD, 300 * MS,
                   110 * MS } },
};

/* ---- in a machine ---- */

static bool odrive_has_torque(const void *servo)
{
    return ((const struct sim_odrive *)servo)->axis_state != 1; /* idle */
}

static void odrive_trouble(void *servo, enum kind_trouble trouble)
{
    static const enum sim_servo_fault fault[] = {
        [KIND_SILENT] = SIM_SERVO_SILENT,
        [KIND_BLOCKED] = SIM_SERVO_BLOCKED,
        [KIND_HEALED] = SIM_SERVO_CLEAR,
    };
    sim_servo_inject(&((struct sim_odrive *)servo)->base, fault[trouble]);
}

const struct kind_test kind_test_odrive = {
    .has_torque = odrive_has_torque,
    .trouble = odrive_trouble,
    .turn = &odrive_turn,
};
