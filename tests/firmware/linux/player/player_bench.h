/* tests/firmware/linux/player/player_bench.h - a rig and its move on the
 * simulated machine, ready to be run in virtual time, for tests of what a run
 * does to it.
 *
 * What a test makes happen, it does in `before`: it is called before every wait
 * of the player's clock. */
#ifndef TESTS_FIRMWARE_LINUX_PLAYER_PLAYER_BENCH_H
#define TESTS_FIRMWARE_LINUX_PLAYER_PLAYER_BENCH_H

#include <string.h>

#include "firmware/linux/commands/planning.h"
#include "firmware/linux/machine/machine_sim.h"
#include "firmware/linux/player/player.h"
#include "tests/support/check.h"

static struct player_bench {
    struct hal_clock clock; /* passes on to the world's */
    struct job job;
    struct machine_sim sim;
    struct machine machine;
    struct player player;
    struct report report;
    volatile sig_atomic_t interrupts;
} bench;

/* Until when the wait lasts, t_ns or later. */
static int64_t before_wait(int64_t t_ns);

static int64_t bench_now_ns(struct hal_clock *clock)
{
    (void)clock;
    return bench.sim.world.now_ns;
}

static int bench_wait_until(struct hal_clock *clock, int64_t t_ns)
{
    (void)clock;
    return hal_clock_wait_until(&bench.sim.world.clock, before_wait(t_ns));
}

static const struct hal_clock_ops bench_clock_ops = {
    .now_ns = bench_now_ns,
    .wait_until = bench_wait_until,
};

/* As planning_open: a directory, or a rig and a move. */
static void bench_open(const char *const path[], int count, bool any)
{
    char message[YAML_MESSAGE_MAX] = "";
    struct machine_ports ports;

    memset(&bench, 0, sizeof bench);
    assert_int_equal(planning_open(&bench.job, path, count, any), STATUS_OK);
    if (machine_sim_init(&bench.sim, &bench.job.rig, false, &ports, message) <
        0)
        fail_msg("%s", message);
    bench.clock.ops = &bench_clock_ops;
    ports.clock = &bench.clock;
    report_init(&bench.report, &bench.job);
    if (machine_init(&bench.machine, &bench.job.rig, &ports, message) < 0)
        fail_msg("%s", message);
}

/* With the report and what else observes it. */
static void bench_play(const struct player_config *config,
                       struct player_observer observer)
{
    observer.report = &bench.report;
    player_init(&bench.player, &bench.machine, &bench.job, config, &observer);
    assert_int_equal(player_run(&bench.player, &bench.interrupts), 0);
}

static void bench_free(void)
{
    player_free(&bench.player);
    report_free(&bench.report);
    machine_free(&bench.machine);
    machine_sim_free(&bench.sim);
    job_free(&bench.job);
}

#endif
