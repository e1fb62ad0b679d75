/* firmware/linux/machine/kind.h - what a kind of drive does for the machine; see
 * firmware/host/rig/kind.h. */
#ifndef FIRMWARE_LINUX_MACHINE_KIND_H
#define FIRMWARE_LINUX_MACHINE_KIND_H

#include "firmware/linux/machine/machine_sim.h"

struct modbus_device;

struct machine_kind {
    /* Of its driver, machine->drive[i], and of its simulated drive,
     * sim->servo[i]: all zero at first.  0: sim_init takes its own. */
    size_t drive_size, sim_size;
    /* Makes the driver of axis i of the rig, machine->axis[i].  Its errors. */
    int (*init)(struct machine *machine, unsigned i);
    /* Feedback older than this is stale; NULL: of more than a tick or two. */
    int64_t (*age_ns)(const struct rig *rig, const struct rig_axis *axis);
    /* So long it may make no step while it is enabled; NULL: any that
     * boots in time does. */
    int64_t (*patience_ns)(const struct rig *rig, const struct rig_axis *axis);
    /* What its driver reads for rig_axis.monitor; NULL: nothing. */
    struct hal_readings *(*readings)(struct machine *machine, unsigned i);
    /* As it is on the wire; NULL: it has none. */
    uint16_t (*statusword)(const struct machine *machine, unsigned i);
    /* Makes the simulated drive of axis i on its bus.  Its errors. */
    int (*sim_init)(struct machine_sim *sim, const struct rig *rig, unsigned i);
    /* The same as what all servos on a CAN bus are; NULL: it is on another. */
    struct sim_servo *(*sim_servo)(struct machine_sim *sim, unsigned i);
    int64_t sim_loop_ns; /* of that servo; 0: it is on another */
    int64_t (*sim_counts_q24)(const struct machine_sim *sim, unsigned i);
    /* Makes it where other masters reach it; NULL: it is a servo with a map, or
     * on CAN. */
    int (*serve)(struct modbus_device *device, const struct rig *rig,
                 unsigned i);
};

#define MACHINE_KIND_ROW(NAME, name, word)                                     \
    extern const struct machine_kind machine_kind_##name;
RIG_KIND_LIST(MACHINE_KIND_ROW)
/* By enum rig_drive_kind. */
extern const struct machine_kind *const machine_kinds[RIG_DRIVE_KINDS];

#endif
