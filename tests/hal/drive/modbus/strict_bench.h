/* tests/hal/drive/modbus/strict_bench.h - our Modbus driver by a map of ours,
 * on a strict servo (strict_modbus.h) at the other end of a simulated line, in
 * virtual time. */
#ifndef TESTS_HAL_DRIVE_MODBUS_STRICT_BENCH_H
#define TESTS_HAL_DRIVE_MODBUS_STRICT_BENCH_H

#include <stdio.h>
#include <string.h>

#include "firmware/host/device/modbus_map_load.h"
#include "firmware/linux/base/disk.h"
#include "hal/drive/modbus/drive.h"
#include "hal/modbus/master.h"
#include "hal/modbus/rtu_slave.h"
#include "sim/bus/modbus.h"
#include "tests/hal/drive/modbus/strict_modbus.h"
#include "tests/support/check.h"

#define MS            INT64_C(1000000)
#define STRICT_UNIT   3
#define STRICT_COUNTS 10000 /* per unit */
#define UNIT_Q32      (INT64_C(1) << 32)

struct strict_bench {
    struct modbus_map map;
    struct sim_world world;
    struct sim_modbus_line wire;
    struct strict_modbus servo;
    struct modbus_rtu_slave rtu;
    struct sim_modbus_faulty faulty;
    struct sim_modbus_seat device_seat, seat;
    struct modbus_master master;
    struct modbus_bus bus;
    struct drive_modbus drive;
    struct hal_drive_feedback feedback;
    struct hal_drive_target target;
    double from; /* where the streamed move begins; NAN: stands */
    int64_t from_ns;
    bool streams, asks_off; /* as the controller does after a fault */
};

static const char *const strict_map[] = {
    [STRICT_LEXIUM] = "lexium-32",
    [STRICT_EL7] = "leadshine-el7",
    [STRICT_ASDA] = "delta-asda",
    [STRICT_AZ] = "oriental-az",
};

static inline void strict_bench_load(struct strict_bench *bench,
                                     enum strict_modbus_kind kind)
{
    char path[128], message[YAML_MESSAGE_MAX];

    memset(bench, 0, sizeof *bench);
    snprintf(path, sizeof path, "hal/maps/%s.yaml", strict_map[kind]);
    if (modbus_map_load(&disk_files, path, &bench->map, message) < 0)
        fail_msg("%s", message);
}

static inline struct drive_modbus_config
strict_bench_config(const struct strict_bench *bench,
                    const struct modbus_rtu_time *time)
{
    unsigned n;

    return (struct drive_modbus_config){
        .map = &bench->map,
        .unit = STRICT_UNIT,
        .counts_num = STRICT_COUNTS,
        .counts_den = 1,
        .vel_max_q32 = 10 * UNIT_Q32,
        .acc_q32 = INT64_C(100) << 32,
        .cycle_ns = modbus_map_cycle_ns(&bench->map, time, true, &n),
    };
}

/* Begin after strict_bench_load, with what the test has changed in the map. */
static inline void strict_bench_begin(struct strict_bench *bench,
                                      enum strict_modbus_kind kind)
{
    const struct modbus_master_config line = { .line = bench->map.line,
                                               .timeout_ns =
                                                   bench->map.timeout_ns };
    struct drive_modbus_config config;

    sim_world_init(&bench->world, 1000 * MS);
    assert_int_equal(
        sim_modbus_line_init(&bench->wire, &bench->world, &bench->map.line), 0);
    strict_modbus_init(&bench->servo, &bench->world, kind, 12345);
    assert_int_equal(modbus_rtu_slave_init(&bench->rtu, &bench->servo.slave,
                                           STRICT_UNIT, &bench->map.line,
                                           bench->map.turnaround_ns),
                     0);
    sim_modbus_faulty_init(&bench->faulty, &bench->rtu.station, 4711);
    assert_int_equal(sim_modbus_seat_init(&bench->device_seat, &bench->wire,
                                          &bench->faulty.station),
                     0);
    assert_int_equal(modbus_master_init(&bench->master, &line), 0);
    assert_int_equal(sim_modbus_seat_init(&bench->seat, &bench->wire,
                                          &bench->master.station),
                     0);
    assert_int_equal(modbus_bus_init(&bench->bus, &bench->master.modbus, 2), 0);
    config = strict_bench_config(bench, &bench->master.time);
    assert_int_equal(drive_modbus_init(&bench->drive, &bench->bus, &config), 0);
}

static inline void strict_bench_init(struct strict_bench *bench,
                                     enum strict_modbus_kind kind)
{
    strict_bench_load(bench, kind);
    strict_bench_begin(bench, kind);
}

/* 8 units in 4 s, at most 3.75 units/s: a quintic. */
static inline void strict_bench_aim(struct strict_bench *bench)
{
    const double t = (double)(bench->world.now_ns - bench->from_ns) * 1e-9;
    const double u = t < 4 ? t / 4 : 1;

    if (bench->from_ns == 0)
        return;
    bench->target.pos_q32 =
        (int64_t)((bench->from + 8 * u * u * u * (10 - 15 * u + 6 * u * u)) *
                  (double)UNIT_Q32);
    bench->target.vel_q32 =
        (int64_t)(60 * u * u * (1 - 2 * u + u * u) * (double)UNIT_Q32);
    bench->target.acc_q32 =
        (int64_t)(30 * u * (1 - 3 * u + 2 * u * u) * 0x1p32);
}

static inline bool strict_bench_is_down(const struct strict_bench *bench)
{
    return bench->feedback.state == HAL_DRIVE_FAULT ||
           bench->feedback.state == HAL_DRIVE_OFFLINE;
}

/* As the controller: set points while there is no fault, then OFF. */
static inline void strict_bench_act(struct strict_bench *bench)
{
    struct hal_drive *drive = &bench->drive.drive;

    hal_drive_feedback(drive, &bench->feedback);
    if (bench->asks_off && strict_bench_is_down(bench))
        hal_drive_request(drive, HAL_DRIVE_REQUEST_OFF);
    if (!bench->streams)
        return;
    strict_bench_aim(bench);
    (void)hal_drive_set_target(drive, &bench->target);
}

static inline void strict_bench_tick(struct strict_bench *bench)
{
    const int64_t now_ns = bench->world.now_ns + MS;

    sim_world_run(&bench->world, now_ns);
    (void)hal_fieldbus_begin(&bench->bus.fieldbus, now_ns);
    strict_bench_act(bench);
    hal_fieldbus_end(&bench->bus.fieldbus, now_ns);
}

static inline void strict_bench_run(struct strict_bench *bench, int64_t dur_ns)
{
    const int64_t end_ns = bench->world.now_ns + dur_ns;

    while (bench->world.now_ns < end_ns)
        strict_bench_tick(bench);
}

static inline void strict_bench_until(struct strict_bench *bench,
                                      enum hal_drive_state state)
{
    for (int i = 0; i < 10000 && bench->feedback.state != state; i++)
        strict_bench_tick(bench);
    if (bench->feedback.state != state)
        fail_msg("%s: still %s: %s", bench->map.title,
                 hal_drive_state_text(bench->feedback.state),
                 bench->feedback.fault_text);
}

static inline void strict_bench_enable(struct strict_bench *bench)
{
    strict_bench_until(bench, HAL_DRIVE_OFF);
    hal_drive_request(&bench->drive.drive, HAL_DRIVE_REQUEST_ENABLE);
    strict_bench_until(bench, HAL_DRIVE_ENABLED);
    bench->target =
        (struct hal_drive_target){ .pos_q32 = bench->feedback.pos_q32 };
    bench->from = (double)bench->feedback.pos_q32 / (double)UNIT_Q32;
    bench->asks_off = true;
}

enum strict_motion { STRICT_STREAMED, STRICT_GOING, STRICT_HOMING };

/* 20 units away, at 2 units/s. */
static inline void strict_bench_home(struct strict_bench *bench,
                                     int64_t timeout_ns)
{
    const struct hal_drive_home home = { .timeout_ns = timeout_ns };

    strict_bench_enable(bench);
    bench->servo.speed = 2 * STRICT_COUNTS;
    bench->servo.ramp = 20 * STRICT_COUNTS;
    assert_int_equal(hal_drive_set_mode(&bench->drive.drive, HAL_DRIVE_HOMING),
                     MOTION_OK);
    assert_int_equal(hal_drive_home(&bench->drive.drive, &home), MOTION_OK);
    strict_bench_run(bench, 600 * MS);
    assert_true(bench->servo.homing);
}

/* 2 s into a streamed move, or 0.6 s into one of 20 units at 2 units/s. */
static inline void strict_bench_go(struct strict_bench *bench, bool streamed)
{
    const struct hal_drive_go there = { .pos_q32 = 21 * UNIT_Q32,
                                        .vel_q32 = 2 * UNIT_Q32,
                                        .acc_q32 = INT64_C(20) << 32,
                                        .dec_q32 = INT64_C(20) << 32 };

    strict_bench_enable(bench);
    if (streamed) {
        bench->streams = true;
        strict_bench_run(bench, 200 * MS);
        bench->from_ns = bench->world.now_ns;
        strict_bench_run(bench, 2000 * MS);
    } else {
        bench->servo.speed = 2 * STRICT_COUNTS;
        bench->servo.ramp = 20 * STRICT_COUNTS;
        assert_int_equal(
            hal_drive_set_mode(&bench->drive.drive, HAL_DRIVE_PROFILE_POSITION),
            MOTION_OK);
        assert_int_equal(hal_drive_go(&bench->drive.drive, &there), MOTION_OK);
        strict_bench_run(bench, 600 * MS);
    }
}

static inline void strict_bench_move(struct strict_bench *bench,
                                     enum strict_motion motion)
{
    if (motion == STRICT_HOMING)
        strict_bench_home(bench, 60000 * MS);
    else
        strict_bench_go(bench, motion == STRICT_STREAMED);
    if (bench->feedback.state != HAL_DRIVE_ENABLED)
        fail_msg("%s: %s", bench->map.title, bench->feedback.fault_text);
    assert_true(strict_modbus_moves(&bench->servo));
    assert_true(bench->servo.torque);
}

#endif
