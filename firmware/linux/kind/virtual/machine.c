/* firmware/linux/kind/virtual/machine.c - the drive of a virtual axis, which is
 * the same in a simulation and in a real run: see
 * firmware/linux/machine/kind.h. */
#include "firmware/linux/machine/kind.h"
#include "motion/core/err.h"

static int virtual_init(struct machine *machine, unsigned i)
{
    struct drive_virtual *drive = machine->drive[i];

    machine->axis[i] = &drive->drive;
    drive_virtual_init(drive, &machine->virtual_bus,
                       machine->rig->axis[i].sim.start_q32);
    return MOTION_OK;
}

static int virtual_sim_init(struct machine_sim *sim, const struct rig *rig,
                            unsigned i)
{
    (void)sim;
    (void)rig;
    (void)i;
    return MOTION_OK;
}

const struct machine_kind machine_kind_virtual = {
    .drive_size = sizeof(struct drive_virtual),
    .init = virtual_init,
    .sim_init = virtual_sim_init,
};
