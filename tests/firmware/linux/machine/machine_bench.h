/* tests/firmware/linux/machine/machine_bench.h - a rig on simulated ports, in
 * virtual time, tick by tick. */
#ifndef TESTS_FIRMWARE_LINUX_MACHINE_MACHINE_BENCH_H
#define TESTS_FIRMWARE_LINUX_MACHINE_MACHINE_BENCH_H

#include "firmware/host/job/job.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/commands/planning.h"
#include "firmware/linux/machine/machine_sim.h"
#include "tests/support/check.h"

static struct machine_sim sim;
static struct machine machine;
static int64_t now_ns;

static inline void bench_load(const char *path, struct rig *rig)
{
    char message[YAML_MESSAGE_MAX];

    if (rig_load(&disk_files, path, rig, message) < 0)
        fail_msg("%s", message);
}

static inline void bench_build(const struct rig *rig)
{
    struct machine_ports ports;
    char message[YAML_MESSAGE_MAX];

    if (machine_sim_init(&sim, rig, false, &ports, message) < 0 ||
        machine_init(&machine, rig, &ports, message) < 0)
        fail_msg("%s", message);
    now_ns = hal_clock_now_ns(ports.clock);
}

static inline void tick(void)
{
    now_ns += machine.rig->period_ns;
    (void)hal_clock_wait_until(machine.ports.clock, now_ns);
    machine_tick(&machine, now_ns);
}

static inline void ticks(unsigned count)
{
    while (count-- > 0)
        tick();
}

static inline void until(enum controller_state state)
{
    for (int i = 0; i < 10000 && machine.controller.state != state; i++)
        tick();
    if (machine.controller.state != state)
        fail_msg("%s", controller_state_text(machine.controller.state));
}

static inline void bench_build_ready(const struct rig *rig)
{
    bench_build(rig);
    tick();
    assert_int_equal(controller_enable(&machine.controller), 0);
    until(CONTROLLER_READY);
}

/* A group of tests of one job: its setup calls job_setup, its teardown is
 * job_teardown; each test begins with a machine of its own. */
static struct job job;

static inline int job_setup(const char *directory)
{
    return planning_open(&job, &directory, 1, false) == STATUS_OK ? 0 : -1;
}

static inline int job_teardown(void **state)
{
    (void)state;
    job_free(&job);
    return 0;
}

static inline int begin(void **state)
{
    (void)state;
    bench_build(&job.rig);
    return 0;
}

#endif
