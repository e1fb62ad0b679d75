/* tests/support/kind/modbus/kind.c - a Modbus servo; see tests/support/kind/kind.h. */
#include "tests/support/kind/kind.h"
#include "sim/device/modbus/servo.h"

static bool modbus_has_torque(const void *servo)
{
    return ((const struct sim_modbus_servo *)servo)->enabled;
}

static void modbus_trouble(void *servo, enum kind_trouble trouble)
{
    static const enum sim_modbus_servo_fault fault[] = {
        [KIND_SILENT] = SIM_MODBUS_SERVO_OFF,
        [KIND_BLOCKED] = SIM_MODBUS_SERVO_BLOCKED,
        [KIND_HEALED] = SIM_MODBUS_SERVO_CLEAR,
    };
    sim_modbus_servo_inject(servo, fault[trouble]);
}

const struct kind_test kind_test_modbus = {
    .has_torque = modbus_has_torque,
    .trouble = modbus_trouble,
};
