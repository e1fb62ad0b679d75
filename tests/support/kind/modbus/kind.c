/* tests/support/kind/modbus/kind.c - a Modbus servo; see tests/support/kind/kind.h. */
#include "tests/support/kind/kind.h"

static bool modbus_has_torque(const union machine_sim_drive *servo)
{
    return servo->modbus.enabled;
}

static void modbus_trouble(union machine_sim_drive *servo,
                           enum kind_trouble trouble)
{
    static const enum sim_modbus_servo_fault fault[] = {
        [KIND_SILENT] = SIM_MODBUS_SERVO_OFF,
        [KIND_BLOCKED] = SIM_MODBUS_SERVO_BLOCKED,
        [KIND_HEALED] = SIM_MODBUS_SERVO_CLEAR,
    };
    sim_modbus_servo_inject(&servo->modbus, fault[trouble]);
}

const struct kind_test kind_test_modbus = {
    .has_torque = modbus_has_torque,
    .trouble = modbus_trouble,
};
