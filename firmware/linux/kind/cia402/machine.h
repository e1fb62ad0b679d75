/* firmware/linux/kind/cia402/machine.h - private to machine.c and sim.c. */
#ifndef FIRMWARE_LINUX_KIND_CIA402_MACHINE_H
#define FIRMWARE_LINUX_KIND_CIA402_MACHINE_H

#include "firmware/linux/machine/kind.h"

#define CIA402_SIM_LOOP_NS INT64_C(250000) /* of the servo's inner loop */

int cia402_sim_init(struct machine_sim *sim, const struct rig *rig, unsigned i);
struct sim_servo *cia402_sim_servo(struct machine_sim *sim, unsigned i);
int64_t cia402_sim_counts_q24(const struct machine_sim *sim, unsigned i);

#endif
