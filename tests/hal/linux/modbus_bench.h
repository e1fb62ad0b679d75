/* tests/hal/linux/modbus_bench.h - one drive by a register map on a simulated
 * line, the maker's where it is one of theirs, and a tick that moves it all
 * on. */
#ifndef TESTS_HAL_LINUX_MODBUS_BENCH_H
#define TESTS_HAL_LINUX_MODBUS_BENCH_H

#include <stdio.h>
#include <string.h>

#include "firmware/host/device/modbus_map_load.h"
#include "firmware/linux/base/disk.h"
#include "hal/drive/modbus/drive.h"
#include "hal/modbus/master.h"
#include "sim/device/modbus/makers.h"
#include "tests/support/check.h"

#define MS           INT64_C(1000000)
#define BENCH_UNIT   3
#define BENCH_COUNTS 10000 /* per unit */
#define UNIT_Q32     (INT64_C(1) << 32)

struct modbus_bench {
    struct modbus_map map;
    const struct sim_modbus_maker *maker; /* NULL: made from the map */
    struct sim_world world;
    struct sim_modbus_line wire;
    struct sim_modbus_servo servo;
    struct modbus_master master;
    struct sim_modbus_seat seat;
    struct modbus_bus bus;
    struct drive_modbus drive;
    struct hal_drive_feedback feedback;
    struct hal_drive_target target;
    bool streams;
    int64_t period_ns, cycle_ns;
    enum hal_fieldbus_health bus_health;
};

static inline void modbus_bench_load(struct modbus_bench *bench,
                                     const char *name)
{
    char path[128], message[YAML_MESSAGE_MAX];

    memset(bench, 0, sizeof *bench);
    bench->maker = sim_modbus_maker_find(name);
    snprintf(path, sizeof path, "%s/%s.yaml",
             strchr(name, '/') == NULL ? "hal/maps" : "tests/data", name);
    if (modbus_map_load(&disk_files, path, &bench->map, message) < 0)
        fail_msg("%s", message);
}

static inline void modbus_bench_servo(struct modbus_bench *bench)
{
    const struct sim_modbus_servo_config config = {
        .maker = bench->maker,
        .map = &bench->map,
        .unit = BENCH_UNIT,
        .line = bench->map.line,
        .turnaround_ns = bench->map.turnaround_ns,
        .plant = { .omega_mrad_s = 157080,
                   .zeta_permille = 900,
                   .vel_max_counts_s = 40 * BENCH_COUNTS,
                   .acc_max_counts_s2 = 4000 * BENCH_COUNTS },
        .start_counts = 12345,
        .enable_ns = 80 * MS,
    };

    sim_world_init(&bench->world, 1000 * MS);
    assert_int_equal(
        sim_modbus_line_init(&bench->wire, &bench->world, &bench->map.line), 0);
    assert_int_equal(sim_modbus_servo_init(&bench->servo, &bench->world,
                                           &bench->wire, &config),
                     0);
}

/* After modbus_bench_load, with what the test has changed in the map. */
static inline void modbus_bench_init(struct modbus_bench *bench)
{
    const struct modbus_master_config line = { .line = bench->map.line,
                                               .timeout_ns =
                                                   bench->map.timeout_ns };
    struct drive_modbus_config config = {
        .map = &bench->map,
        .unit = BENCH_UNIT,
        .counts_num = BENCH_COUNTS,
        .counts_den = 1,
        .vel_max_q32 = 10 * UNIT_Q32,
        .acc_q32 = INT64_C(100) << 32,
    };
    unsigned n;

    bench->period_ns = MS;
    modbus_bench_servo(bench);
    assert_int_equal(modbus_master_init(&bench->master, &line), 0);
    assert_int_equal(sim_modbus_seat_init(&bench->seat, &bench->wire,
                                          &bench->master.station),
                     0);
    assert_int_equal(modbus_bus_init(&bench->bus, &bench->master.modbus, 2), 0);
    bench->cycle_ns =
        modbus_map_cycle_ns(&bench->map, &bench->master.time, true, &n);
    config.cycle_ns = bench->cycle_ns;
    assert_int_equal(drive_modbus_init(&bench->drive, &bench->bus, &config), 0);
}

static inline void modbus_bench_tick(struct modbus_bench *bench)
{
    struct hal_drive *drive = &bench->drive.drive;
    const int64_t now_ns = bench->world.now_ns + bench->period_ns;

    sim_world_run(&bench->world, now_ns);
    bench->bus_health = hal_fieldbus_begin(&bench->bus.fieldbus, now_ns);
    hal_drive_feedback(drive, &bench->feedback);
    if (bench->streams)
        (void)hal_drive_set_target(drive, &bench->target);
    hal_fieldbus_end(&bench->bus.fieldbus, now_ns);
}

static inline void modbus_bench_run(struct modbus_bench *bench, int64_t dur_ns)
{
    const int64_t end_ns = bench->world.now_ns + dur_ns;

    while (bench->world.now_ns < end_ns)
        modbus_bench_tick(bench);
}

static inline void modbus_bench_until(struct modbus_bench *bench,
                                      enum hal_drive_state state)
{
    for (int i = 0; i < 20000 && bench->feedback.state != state; i++)
        modbus_bench_tick(bench);
    if (bench->feedback.state != state)
        fail_msg("still %s: %s", hal_drive_state_text(bench->feedback.state),
                 bench->feedback.fault_text);
}

static inline void modbus_bench_enable(struct modbus_bench *bench)
{
    modbus_bench_until(bench, HAL_DRIVE_OFF);
    hal_drive_request(&bench->drive.drive, HAL_DRIVE_REQUEST_ENABLE);
    modbus_bench_until(bench, HAL_DRIVE_ENABLED);
    bench->target =
        (struct hal_drive_target){ .pos_q32 = bench->feedback.pos_q32 };
    bench->streams = true;
}

#endif
