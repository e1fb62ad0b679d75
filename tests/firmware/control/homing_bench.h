/* tests/firmware/control/homing_bench.h - an axis of a rig file on the simulated
 * machine, to be homed. */
#ifndef TESTS_FIRMWARE_CONTROL_HOMING_BENCH_H
#define TESTS_FIRMWARE_CONTROL_HOMING_BENCH_H

#include <stdlib.h>

#include "firmware/host/job/job.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/machine/kind.h"
#include "motion/core/fixed.h"
#include "tests/support/check.h"

#define UNIT MOTION_FIXED_ONE_Q32
#define UM   (UNIT / 1000)

static struct rig rig;
static struct machine_sim sim;
static struct machine machine;

/* A period of the machine, with what the test does to it meanwhile. */
static void tick(void);

/* One axis of a rig file, the first of it. */
static inline void read_axis(const char *path, unsigned axis)
{
    char message[YAML_MESSAGE_MAX];
    if (rig_load(&disk_files, path, &rig, message) < 0)
        fail_msg("%s", message);
    rig.axis[0] = rig.axis[axis];
    rig.axis_count = 1;
}

/* A failure begins with `who`. */
static inline void homing_build(const char *who)
{
    char message[YAML_MESSAGE_MAX];
    struct machine_ports ports;
    if (machine_sim_init(&sim, &rig, false, &ports, message) < 0 ||
        machine_init(&machine, &rig, &ports, message) < 0)
        fail_msg("%s%s", who, message);
}

static inline void homing_enable(const char *who)
{
    tick();
    assert_int_equal(controller_enable(&machine.controller), MOTION_OK);
    for (int i = 0; machine.controller.state != CONTROLLER_READY; i++) {
        if (i > 10000)
            fail_msg("%snever ready", who);
        tick();
    }
}

static inline struct sim_plant *plant(void)
{
    return &machine_kinds[rig.axis[0].kind]->sim_servo(&sim, 0)->plant;
}

/* Of the axis when it met a stop, unit/s. */
static inline double met(void)
{
    return (double)plant()->met_q24 / (1 << 24) *
           (double)rig.axis[0].counts_den /
           (double)llabs(rig.axis[0].counts_num);
}

static inline int down(void **state)
{
    (void)state;
    machine_free(&machine);
    machine_sim_free(&sim);
    rig_free(&rig);
    return 0;
}

#endif
