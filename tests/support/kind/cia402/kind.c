/* tests/support/kind/cia402/kind.c - a CiA 402 drive; see tests/support/kind/kind.h. */
#include "tests/support/kind/kind.h"
#include "sim/device/cia402/servo.h"

static bool cia402_has_torque(const void *servo)
{
    return ((const struct sim_cia402 *)servo)->motion != 0;
}

static void cia402_trouble(void *servo, enum kind_trouble trouble)
{
    static const enum sim_cia402_fault fault[] = {
        [KIND_SILENT] = SIM_CIA402_SILENT,
        [KIND_BLOCKED] = SIM_CIA402_BLOCKED,
        [KIND_HEALED] = SIM_CIA402_CLEAR,
    };
    sim_cia402_inject(servo, fault[trouble]);
}

const struct kind_test kind_test_cia402 = {
    .has_torque = cia402_has_torque,
    .trouble = cia402_trouble,
};
