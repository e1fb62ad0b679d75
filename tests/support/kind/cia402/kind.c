/* tests/support/kind/cia402/kind.c - a CiA 402 drive; see tests/support/kind/kind.h. */
#include "tests/support/kind/kind.h"

static bool cia402_has_torque(const union machine_sim_drive *servo)
{
    return servo->cia402.motion != 0;
}

static void cia402_trouble(union machine_sim_drive *servo,
                           enum kind_trouble trouble)
{
    static const enum sim_cia402_fault fault[] = {
        [KIND_SILENT] = SIM_CIA402_SILENT,
        [KIND_BLOCKED] = SIM_CIA402_BLOCKED,
        [KIND_HEALED] = SIM_CIA402_CLEAR,
    };
    sim_cia402_inject(&servo->cia402, fault[trouble]);
}

const struct kind_test kind_test_cia402 = {
    .has_torque = cia402_has_torque,
    .trouble = cia402_trouble,
};
