/* tests/hal/linux/libmodbus_bench.h - libmodbus on a device that is nothing but
 * registers, behind a pseudo-terminal or a socket, on the real clock.  It
 * answers as it should until `faulty` is told otherwise. */
#ifndef TESTS_HAL_LINUX_LIBMODBUS_BENCH_H
#define TESTS_HAL_LINUX_LIBMODBUS_BENCH_H

#include <string.h>

#include "firmware/linux/machine/modbus_host.h"
#include "hal/linux/clock.h"
#include "hal/linux/libmodbus.h"
#include "hal/modbus/rtu_slave.h"
#include "sim/bus/modbus.h"
#include "tests/hal/linux/modbus_bank.h"
#include "tests/support/check.h"

#define MS   INT64_C(1000000)
#define UNIT 9

#define PATIENCE 20000 /* looks, 1 ms each: for ever, for what is asked here */

struct libmodbus_bench {
    struct sim_world world;
    struct sim_modbus_line wire;
    struct sim_modbus_seat seat;
    struct modbus_bank bank;
    struct modbus_rtu_slave slave;
    struct sim_modbus_faulty faulty;
    struct modbus_host host;
    struct modbus_libmodbus libmodbus;
    struct clock_linux clock;
    bool has_host, is_open; /* what is to be ended */
};

static inline int64_t libmodbus_bench_now_ns(struct libmodbus_bench *bench)
{
    return hal_clock_now_ns(&bench->clock.clock);
}

/* A look later. */
static inline void libmodbus_bench_pass(struct libmodbus_bench *bench)
{
    (void)hal_clock_wait_until(&bench->clock.clock,
                               libmodbus_bench_now_ns(bench) + MS);
}

static inline void libmodbus_bench_clear(struct libmodbus_bench *bench)
{
    memset(bench, 0, sizeof *bench);
    (void)clock_linux_init(&bench->clock);
}

/* The device alone, which answers so long after a request. */
static inline void libmodbus_bench_device(struct libmodbus_bench *bench,
                                          const struct modbus_rtu_line *line,
                                          int64_t response_ns)
{
    libmodbus_bench_clear(bench);
    modbus_bank_init(&bench->bank);
    sim_world_init(&bench->world, libmodbus_bench_now_ns(bench));
    modbus_host_init(&bench->host, &bench->world);
    bench->has_host = true;
    assert_int_equal(sim_modbus_line_init(&bench->wire, &bench->world, line),
                     0);
    assert_int_equal(modbus_rtu_slave_init(&bench->slave, &bench->bank.slave,
                                           UNIT, line, response_ns),
                     0);
    sim_modbus_faulty_init(&bench->faulty, &bench->slave.station, 4711);
    assert_int_equal(sim_modbus_seat_init(&bench->seat, &bench->wire,
                                          &bench->faulty.station),
                     0);
}

static inline void libmodbus_bench_open(struct libmodbus_bench *bench,
                                        const struct modbus_line_config *config)
{
    assert_int_equal(modbus_libmodbus_open(&bench->libmodbus, config), 0);
    bench->is_open = true;
}

/* The device behind a pseudo-terminal, and libmodbus on that. */
static inline void libmodbus_bench_pty(struct libmodbus_bench *bench,
                                       struct modbus_line_config config,
                                       int64_t response_ns)
{
    libmodbus_bench_device(bench, &config.line, response_ns);
    assert_int_equal(modbus_host_pty(&bench->host, &bench->wire), 0);
    memcpy(config.device, bench->host.path, sizeof bench->host.path);
    assert_int_equal(modbus_host_start(&bench->host), 0);
    libmodbus_bench_open(bench, &config);
}

/* Of a teardown: wherever the test has failed. */
static inline void libmodbus_bench_end(struct libmodbus_bench *bench)
{
    if (bench->is_open)
        modbus_libmodbus_close(&bench->libmodbus);
    if (bench->has_host)
        modbus_host_stop(&bench->host);
    bench->is_open = bench->has_host = false;
}

static inline struct hal_modbus_reply
libmodbus_bench_ask(struct libmodbus_bench *bench,
                    const struct hal_modbus_request *request)
{
    struct hal_modbus_reply reply = { .err = MOTION_E_AGAIN };

    assert_int_equal(hal_modbus_submit(&bench->libmodbus.modbus, request, 0),
                     0);
    for (unsigned i = 0; i < PATIENCE; i++) {
        if (hal_modbus_collect(&bench->libmodbus.modbus, &reply) == 1)
            return reply;
        libmodbus_bench_pass(bench);
    }
    fail_msg("no reply");
    return reply;
}

/* One register. */
static inline struct hal_modbus_reply
libmodbus_bench_read(struct libmodbus_bench *bench, uint16_t address)
{
    const struct hal_modbus_request request = {
        .unit = UNIT, .function = 3, .address = address, .count = 1
    };

    return libmodbus_bench_ask(bench, &request);
}

#endif
