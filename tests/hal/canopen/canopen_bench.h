/* tests/hal/canopen/canopen_bench.h - a simulated wire for a CANopen master and
 * the servos that it is tried on. */
#ifndef TESTS_HAL_CANOPEN_CANOPEN_BENCH_H
#define TESTS_HAL_CANOPEN_CANOPEN_BENCH_H

#include "tests/support/check.h"

#include "hal/canopen/canopen.h"
#include "hal/canopen/lss.h"
#include "sim/bus/can.h"
#include "sim/world.h"

#define MS INT64_C(1000000)

/* A master with a cycle of 1 ms. */
#define CANOPEN_BENCH_MASTER                                                   \
    {                                                                          \
        .node_id = 127, .sync_period_ns = 1 * MS,                              \
        .heartbeat_period_ns = 20 * MS,                                        \
    }

/* A servo's motor: 2000 units/s, 20000 units/s2, of 1000 counts each. */
#define CANOPEN_BENCH_PLANT                                                    \
    {                                                                          \
        .omega_mrad_s = 200000, .zeta_permille = 1000,                         \
        .vel_max_counts_s = 2000000, .acc_max_counts_s2 = 20000000,            \
    }

/* What every CiA 402 drive's config begins with: 1000 counts a unit. */
#define CANOPEN_BENCH_COUNTS                                                   \
    .counts_num = 1000, .counts_den = 1, .sync_period_ns = 1 * MS

/* 1 Mbit/s, and the master's port on it, at 1 s. */
static inline void canopen_bench_wire(struct sim_world *world,
                                      struct sim_can_bus *bus,
                                      struct sim_can_port *port)
{
    sim_world_init(world, 1000 * MS);
    assert_int_equal(sim_can_bus_init(bus, world, 1000000), 0);
    sim_can_port_init(port, bus);
}

/* One cycle of a master that nobody gives set points to. */
static inline void canopen_bench_cycle(struct sim_world *world,
                                       struct canopen *master)
{
    sim_world_run(world, world->now_ns + MS);
    (void)hal_fieldbus_begin(&master->fieldbus, world->now_ns);
    hal_fieldbus_end(&master->fieldbus, world->now_ns);
}

struct bench; /* a test's own */

/* What became of what LSS was asked; `cycle` is the bench's own. */
static inline int canopen_bench_outcome(struct bench *bench,
                                        void (*cycle)(struct bench *bench),
                                        struct canopen_lss *lss)
{
    int err = MOTION_E_AGAIN;

    for (unsigned i = 0; err == MOTION_E_AGAIN; i++) {
        assert_true(i < 5000);
        cycle(bench);
        err = canopen_lss_take(lss);
    }
    return err;
}

#endif
