/* tests/support/kind/moteus/kind.c - a moteus; see tests/support/kind/kind.h. */
#include "tests/support/kind/kind.h"
#include "hal/drive/moteus/drive.h"
#include "sim/device/moteus/servo.h"
#include "tests/support/check.h"

#define MS INT64_C(1000000)
#define ID 5

/* ---- by itself ---- */

static struct sim_moteus device;
static struct drive_moteus driver;

static struct hal_drive *moteus_init(struct sim_can_bus *wire,
                                     struct can_bus *bus,
                                     enum kind_turn_how how)
{
    const struct sim_moteus_config at = { .id = ID,
                                          .plant = kind_turn_plant,
                                          .start_counts = -54321,
                                          .boot_ns = 50 * MS };
    const struct drive_moteus_config config = { .id = ID,
                                                .switched = true,
                                                .turn = kind_turn_config };

    (void)how;
    assert_int_equal(sim_can_bus_set_fd(wire, 5), 0);
    assert_int_equal(sim_moteus_init(&device, wire, &at), 0);
    assert_int_equal(drive_moteus_init(&driver, bus, &config), 0);
    return &driver.turn.drive;
}

static void moteus_restart(struct can_bus *bus)
{
    const struct drive_moteus_config config = driver.config;

    assert_int_equal(drive_moteus_init(&driver, bus, &config), 0);
}

/* Whatever is not off: also what its watchdog leaves. */
static bool moteus_is_on(void)
{
    return device.mode > MOTEUS_MODE_FAULT;
}

static bool moteus_has_values(uint32_t id)
{
    return (id >> 8 & 0x7F) == ID;
}

static const struct kind_turn moteus_turn = {
    .text = "moteus",
    .init = moteus_init,
    .restart = moteus_restart,
    .servo = &device.base,
    .counts = SIM_MOTEUS_COUNTS,
    .has_torque = moteus_is_on,
    .has_values = moteus_has_values,
    .conform = { { "drive_moteus", KIND_PLAIN, 20 * MS, 3 * MS } },
};

/* ---- in a machine ---- */

static bool moteus_has_torque(const void *servo)
{
    return ((const struct sim_moteus *)servo)->mode > 1; /* stopped, fault */
}

static void moteus_trouble(void *servo, enum kind_trouble trouble)
{
    static const enum sim_servo_fault fault[] = {
        [KIND_SILENT] = SIM_SERVO_SILENT,
        [KIND_BLOCKED] = SIM_SERVO_BLOCKED,
        [KIND_HEALED] = SIM_SERVO_CLEAR,
    };
    sim_servo_inject(&((struct sim_moteus *)servo)->base, fault[trouble]);
}

const struct kind_test kind_test_moteus = {
    .has_torque = moteus_has_torque,
    .trouble = moteus_trouble,
    .turn = &moteus_turn,
};
