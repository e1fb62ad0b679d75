/* tests/hal/drive/cia402/test_drive_cia402_axes.c - several axes behind one
 * CANopen node, as CiA 301 7.5.2.1 and CiA 402-2 have them: strict servos that
 * share a node's id, its SDO channel and its NMT state, with a third on a node
 * of its own. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/control/controller.h"
#include "firmware/control/jog.h"
#include "hal/drive/cia402/drive.h"
#include "motion/core/fixed.h"
#include "tests/hal/canopen/canopen_bench.h"
#include "tests/hal/drive/cia402/quirk_servo.h"

#define ONE   MOTION_FIXED_ONE_Q32
#define KEY   QUIRK_KEY
#define AXES  3
#define THIRD 2 /* on node 2 */

static struct bench {
    struct sim_world world;
    struct sim_can_bus bus;
    struct sim_can_port port;
    struct quirk_kind kind[AXES];
    struct quirk_servo servo[AXES];
    struct canopen master;
    struct drive_cia402_config config[AXES];
    struct drive_cia402 drive[AXES];
    struct controller controller;
    struct controller_axis_config axis_config[AXES];
    struct controller_axis axis[AXES];
    struct controller_jog jog[AXES];
    unsigned count;
    char text[AXES][64]; /* its first sentence */
} bench;

/* As the second axis's objects are in the device: they make it the later
 * one. */
static const struct drive_cia402_parameter more[] = {
    { 0x6883, 0, 4, 100000 }, { 0x6884, 0, 4, 100001 },
    { 0x6881, 0, 4, 10002 },  { 0x6899, 1, 4, 10003 },
    { 0x6899, 2, 4, 1004 },   { 0x689A, 0, 4, 100005 },
    { 0x6881, 0, 4, 10006 },  { 0x6881, 0, 4, 10007 },
    { 0x6881, 0, 4, 10008 },  { 0x6881, 0, 4, 10009 },
    { 0x6881, 0, 4, 10010 },  { 0x6881, 0, 4, 10011 },
    { 0x6881, 0, 4, 10012 },  { 0x6881, 0, 4, 10013 },
    { 0x6881, 0, 4, 10014 },  { 0x6881, 0, 4, 10015 },
    { 0x6881, 0, 4, 10016 },  { 0x6881, 0, 4, 10017 },
    { 0x6881, 0, 4, 10018 },  { 0x6881, 0, 4, 10019 },
};

/* Two axes on node 1, one on node 2. */
static void bench_plan(struct bench *b)
{
    memset(b, 0, sizeof *b);
    b->count = AXES;
    for (unsigned i = 0; i < AXES; i++) {
        b->kind[i].axes = i == THIRD ? 0 : 2;
        b->kind[i].axis = i == 1;
        b->config[i] = (struct drive_cia402_config){
            CANOPEN_BENCH_COUNTS,    .node_id = i == THIRD ? 2 : 1,
            .axis = i == 1,          .following_error_counts = 5000,
            .following_error_ms = 2, .quick_stop_counts_s2 = 2000000,
        };
    }
    b->config[1].pdo = (struct drive_cia402_pdos){ .rpdo_id = { 0x401 },
                                                   .tpdo_id = { 0x381 } };
    b->config[1].parameter = more;
    b->config[1].parameter_count = ARRAY_LEN(more);
}

static void bench_controller(struct bench *b)
{
    struct hal_drive *drive[AXES];
    struct controller_config config = {
        .period_ns = MS,
        .axis_count = b->count,
        .axis = b->axis_config,
        .enable_timeout_ns = 12000 * MS,
    };

    for (unsigned i = 0; i < b->count; i++) {
        drive[i] = &b->drive[i].drive;
        b->axis_config[i] = (struct controller_axis_config){
            .pos_min_q32 = -1000 * ONE,
            .pos_max_q32 = 1000 * ONE,
            .limit = { 100 * ONE, 1000 * ONE, 0 },
            .stop = { 100 * ONE, 2000 * ONE, 0 },
            .following_floor_q32 = 2 * ONE,
        };
    }
    assert_int_equal(
        controller_init(&b->controller, &config, b->axis, drive, NULL), 0);
}

static void bench_build(struct bench *b)
{
    static const struct canopen_config master = CANOPEN_BENCH_MASTER;

    canopen_bench_wire(&b->world, &b->bus, &b->port);
    assert_int_equal(canopen_init(&b->master, &b->port.can, &master), 0);
    for (unsigned i = 0; i < AXES; i++)
        assert_int_equal(quirk_servo_init(&b->servo[i], &b->bus,
                                          i == THIRD ? 2 : 1, &b->kind[i]),
                         0);
    for (unsigned i = 0; i < b->count; i++)
        assert_int_equal(
            drive_cia402_init(&b->drive[i], &b->master, &b->config[i]), 0);
    bench_controller(b);
}

static void tick(struct bench *b)
{
    struct hal_fieldbus_worst worst = { HAL_FIELDBUS_GOOD, 0 };
    struct hal_drive_feedback seen;

    sim_world_run(&b->world, b->world.now_ns + MS);
    worst.health = hal_fieldbus_begin(&b->master.fieldbus, b->world.now_ns);
    controller_step(&b->controller, b->world.now_ns, worst);
    hal_fieldbus_end(&b->master.fieldbus, b->world.now_ns);
    for (unsigned i = 0; i < b->count; i++) {
        controller_jog_step(&b->controller, &b->jog[i]);
        hal_drive_feedback(&b->drive[i].drive, &seen);
        if (b->text[i][0] == 0 && b->drive[i].phase == DRIVE_CIA402_LOST)
            memcpy(b->text[i], seen.fault_text, sizeof b->text[i]);
        if (b->text[i][0] == 0 && seen.state == HAL_DRIVE_FAULT)
            memcpy(b->text[i], seen.fault_text, sizeof b->text[i]);
    }
}

static void ticks(struct bench *b, unsigned count)
{
    while (count-- > 0)
        tick(b);
}

static bool all_found(struct bench *b)
{
    for (unsigned i = 0; i < b->count; i++)
        if (b->drive[i].state != HAL_DRIVE_OFF)
            return false;
    return true;
}

static void found(struct bench *b)
{
    for (unsigned n = 0; n < 10000 && !all_found(b); n++)
        tick(b);
    for (unsigned i = 0; i < b->count; i++)
        if (b->drive[i].state != HAL_DRIVE_OFF)
            fail_msg("axis %u: %s", i, b->drive[i].fault_text);
}

static bool until(struct bench *b, enum controller_state state, unsigned most)
{
    while (most-- > 0 && b->controller.state != state)
        tick(b);
    return b->controller.state == state;
}

static void enabled(struct bench *b)
{
    assert_int_equal(controller_enable(&b->controller), MOTION_OK);
    if (!until(b, CONTROLLER_READY, 20000))
        fail_msg("not enabled: %s %s", b->text[0], b->text[1]);
}

static void jog(struct bench *b, unsigned i, int64_t by)
{
    const struct controller_jog_goal goal = {
        .axis = i,
        .pos_q32 = b->controller.axis[i].target.pos_q32 + by * ONE,
        .vel_q32 = 100 * ONE,
    };

    assert_int_equal(controller_jog(&b->controller, &b->jog[i], &goal),
                     MOTION_OK);
}

/* One after the other: each goes its own way, and the others stand. */
static void moves(struct bench *b)
{
    for (unsigned i = 0; i < b->count; i++) {
        double from[AXES];

        for (unsigned k = 0; k < AXES; k++)
            from[k] = b->servo[k].pos;
        jog(b, i, 20 + 10 * (int64_t)i);
        assert_true(until(b, CONTROLLER_READY, 3000));
        ticks(b, 10);
        for (unsigned k = 0; k < b->count; k++) {
            const struct quirk_servo *servo =
                &b->servo[b->config[k].axis + (b->config[k].node_id == 2) * 2];
            const double by = k == i ? 20000 + 10000 * (double)i : 0;

            if (b->count == AXES && fabs(servo->pos - from[k] - by) > 10)
                fail_msg("axis %u went %g counts, not %g", k,
                         servo->pos - from[k], by);
        }
    }
}

static bool any_torque(const struct bench *b)
{
    for (unsigned i = 0; i < AXES; i++)
        if (b->servo[i].energised)
            return true;
    return false;
}

static void no_torque(struct bench *b, unsigned most)
{
    while (most-- > 0 && any_torque(b))
        tick(b);
    assert_false(any_torque(b));
}

static void obeyed(const struct bench *b)
{
    for (unsigned i = 0; i < AXES; i++) {
        assert_int_equal(b->servo[i].crowded, 0);
        assert_false(b->servo[i].started_unset);
        assert_false(b->servo[i].coasted);
    }
    assert_int_equal(b->master.stats.malformed, 0);
    assert_int_equal(b->master.stats.foreign_master, 0);
}

/* ---- claims -------------------------------------------------------------- */

static void each_axis_of_a_node_goes_its_own_way(void **state)
{
    struct bench *b = &bench;

    (void)state;
    bench_plan(b);
    bench_build(b);
    found(b);
    assert_int_equal(quirk_get(&b->servo[1], KEY(0x1400, 1)), 0x401);
    assert_int_equal(quirk_get(&b->servo[1], KEY(0x1600, 1)), 0x68400010);
    assert_int_equal(quirk_get(&b->servo[1], KEY(0x1600, 2)), 0x687A0020);
    assert_int_equal(quirk_get(&b->servo[1], KEY(0x6007, 0)), 3);
    assert_int_equal(quirk_get(&b->servo[1], KEY(0x6083, 0)), 100000);
    assert_int_equal(quirk_get(&b->servo[0], KEY(0x6083, 0)), 200000);
    enabled(b);
    moves(b);
    assert_int_equal(controller_off(&b->controller), MOTION_OK);
    no_torque(b, 200);
    enabled(b);
    moves(b);
    obeyed(b);
    sim_world_run(&b->world, b->world.now_ns + 1500 * MS); /* the host died */
    assert_false(any_torque(b));
}

/* Neither axis waits for more than its sibling's transfer and the gap between
 * two, whoever was added first. */
static void the_sdo_channel_is_shared_fairly(void **state)
{
    struct bench *b = &bench;

    (void)state;
    bench_plan(b);
    b->count = 2;
    bench_build(b);
    while (b->drive[0].node.sdo_served_ns < 0 ||
           b->drive[1].node.sdo_served_ns < 0)
        tick(b);
    for (unsigned n = 0; n < 150; n++) {
        tick(b);
        for (unsigned i = 0; i < 2; i++)
            if (b->world.now_ns - b->drive[i].node.sdo_served_ns > 6 * MS)
                fail_msg("axis %u waits at tick %u", i, n);
    }
    found(b);
    obeyed(b);
}

/* A drive that takes 15 ms to answer has one question at a time. */
static void a_slow_device_is_asked_one_thing_at_a_time(void **state)
{
    struct bench *b = &bench;

    (void)state;
    bench_plan(b);
    b->kind[0].sdo_ns = b->kind[1].sdo_ns = 15 * MS;
    bench_build(b);
    found(b);
    enabled(b);
    moves(b);
    obeyed(b);
}

/* Both at once: the emergencies follow each other, and each axis has its own
 * code. */
static void each_axis_tells_its_own_fault(void **state)
{
    struct bench *b = &bench;

    (void)state;
    bench_plan(b);
    bench_build(b);
    found(b);
    enabled(b);
    quirk_servo_fault(&b->servo[0], 0x2310);
    quirk_servo_fault(&b->servo[1], 0x8611);
    assert_true(until(b, CONTROLLER_FAULT, 100));
    no_torque(b, 1000);
    ticks(b, 100);
    assert_int_equal(b->drive[0].fault_code, 0x2310);
    assert_int_equal(b->drive[1].fault_code, 0x8611);
    assert_true(b->drive[THIRD].fault_code == 0);
}

/* An emergency of a node of two names no axis: 0x603F + 0x800 n does, when it is
 * answered. */
static void a_record_is_completed_by_the_answer(void **state)
{
    struct bench *b = &bench;
    const struct controller_fault_record *fault = &b->controller.fault;

    (void)state;
    for (unsigned i = 0; i < 4; i++) {
        const unsigned axis = i & 1;
        int64_t seen_ns;

        bench_plan(b);
        b->kind[0].sdo_ns = b->kind[1].sdo_ns = i < 2 ? 0 : 25 * MS;
        bench_build(b);
        found(b);
        enabled(b);
        jog(b, !axis, 50);
        ticks(b, 200);
        quirk_servo_fault(&b->servo[axis], 0x7305);
        while (fault->fault == CONTROLLER_FAULT_NONE)
            tick(b);
        seen_ns = b->world.now_ns;
        assert_int_equal(fault->drive_code, 0);
        assert_false(fault->is_whole);
        ticks(b, 100);
        assert_int_equal(fault->axis, axis);
        assert_int_equal(fault->drive_code, 0x7305);
        assert_string_equal(fault->reason,
                            "drive fault 0x7305: sensor or encoder");
        assert_true(fault->is_whole);
        assert_int_equal(fault->t_ns, seen_ns);
    }
}

/* The second alone, by identifiers that the drive has. */
static void an_axis_alone_takes_the_drives_own_identifiers(void **state)
{
    struct bench *b = &bench;
    const double from = 123456;

    (void)state;
    bench_plan(b);
    b->count = 1;
    b->config[0] = b->config[1];
    b->config[0].pdo = (struct drive_cia402_pdos){ .number = 0 };
    b->kind[1].initial[0].key = KEY(0x1400, 1);
    b->kind[1].initial[1].key = KEY(0x1800, 1);
    b->kind[1].initial[1].value = 0x40000685;
    b->kind[1].initial[0].value = 0x684;
    bench_build(b);
    found(b);
    assert_int_equal(b->drive[0].node.rpdo_id[0], 0x684);
    assert_int_equal(b->drive[0].node.tpdo_id[0], 0x685);
    enabled(b);
    moves(b);
    assert_true(fabs(b->servo[1].pos - from - 20000) < 10);
    assert_true(fabs(b->servo[0].pos - from) < 1);
    assert_false(b->servo[0].energised);
    assert_int_equal(b->servo[1].crowded, 0);
}

/* Neither from the rig nor in the drive, or another's. */
static void without_free_identifiers_it_is_refused(void **state)
{
    static const struct {
        uint32_t rx, tx;
        const char *says;
    } rows[] = {
        { 0x80000000, 0x684,
          "0x1440:01 is 0x80000000, not free: needs pdo: rx" },
        { 0x684, 0xC0000000,
          "0x1840:01 is 0xC0000000, not free: needs pdo: tx" },
        { 0x202, 0x684, "0x1440:01 is 0x00000202, not free" }, /* node 2 */
        { 0x201, 0x684, "0x1440:01 is 0x00000201, not free" }, /* axis 1 */
        { 0x684, 0x482, "0x1840:01 is 0x00000482, not free" },
        { 0x684, 0x684, "0x1840:01 is 0x00000684, not free" },
        { 0x684, 0x20000700, "0x1840:01 is 0x20000700, not free" },
        { 0x685, 0x701, "0x1840:01 is 0x00000701, not free" },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct bench *b = &bench;

        bench_plan(b);
        b->config[1].pdo = (struct drive_cia402_pdos){ .number = 0 };
        b->kind[1].initial[0].key = KEY(0x1400, 1);
        b->kind[1].initial[0].value = rows[i].rx;
        b->kind[1].initial[1].key = KEY(0x1800, 1);
        b->kind[1].initial[1].value = rows[i].tx;
        bench_build(b);
        ticks(b, 3000);
        if (strstr(b->text[1], rows[i].says) == NULL)
            fail_msg("%zu: \"%s\"", i, b->text[1]);
        assert_string_equal(b->text[0], "axis 2 of node 1 could not be set up");
        assert_int_equal(b->drive[THIRD].state, HAL_DRIVE_OFF);
        assert_false(any_torque(b));
    }
}

/* And with their words: what an axis lacks is named as the drive has it. */
static void what_an_axis_lacks_is_named_by_its_own_object(void **state)
{
    struct bench *b = &bench;

    (void)state;
    bench_plan(b);
    b->kind[1].missing[0] = KEY(0x6007, 0);
    bench_build(b);
    ticks(b, 3000);
    assert_string_equal(
        b->text[1], "0x6807:00 refused (06020000): needs unsupervised: yes");
    bench_plan(b);
    b->kind[0].axes = 1; /* there is no second */
    b->kind[1].axis = 7;
    bench_build(b);
    ticks(b, 3000);
    assert_non_null(strstr(b->text[1], "0x6840:00 refused"));
}

/* A fault of one stops all; whose it is its own 0x603F says, the emergency does
 * not. */
static void a_fault_of_one_axis_stops_the_group(void **state)
{
    struct bench *b = &bench;

    (void)state;
    for (unsigned i = 0; i < 2; i++) {
        bench_plan(b);
        bench_build(b);
        found(b);
        enabled(b);
        jog(b, !i, 50);
        ticks(b, 200);
        quirk_servo_fault(&b->servo[i], 0x2310);
        assert_true(until(b, CONTROLLER_FAULT, 1000));
        no_torque(b, 1000);
        ticks(b, 100);
        assert_int_equal(b->drive[i].fault_code, 0x2310);
        assert_int_equal(b->drive[!i].fault_code, 0);
        ticks(b, 500);
        assert_false(any_torque(b));
        assert_int_equal(controller_reset(&b->controller), MOTION_OK);
        assert_true(until(b, CONTROLLER_OFF, 20000));
        enabled(b);
        moves(b);
        obeyed(b);
    }
}

static void lose_power(struct bench *b)
{
    for (unsigned i = 0; i < 2; i++) {
        b->servo[i].event_done = false;
        b->kind[i].event = QUIRK_REBOOTS;
        b->kind[i].event_ns = 0;
    }
    tick(b);
    tick(b);
    for (unsigned i = 0; i < 2; i++)
        b->kind[i].event = QUIRK_NOTHING;
}

/* It forgets all, for each axis: nothing moves again but by request, after each
 * was set up anew. */
static void a_restart_of_the_node_restarts_each_axis(void **state)
{
    struct bench *b = &bench;

    (void)state;
    bench_plan(b);
    bench_build(b);
    found(b);
    enabled(b);
    for (unsigned n = 0; n < 2; n++) {
        lose_power(b);
        assert_true(until(b, CONTROLLER_FAULT, 1000));
        ticks(b, 1000);
        assert_false(any_torque(b));
        assert_int_equal(b->drive[0].phase, DRIVE_CIA402_LOST);
        assert_int_equal(b->drive[1].phase, DRIVE_CIA402_LOST);
        assert_int_equal(controller_reset(&b->controller), MOTION_OK);
        assert_true(until(b, CONTROLLER_OFF, 20000));
        assert_int_equal(quirk_get(&b->servo[1], KEY(0x1600, 2)), 0x687A0020);
        ticks(b, 100);
        assert_false(any_torque(b));
        enabled(b);
        moves(b);
    }
    assert_false(b->servo[0].started_unset || b->servo[1].started_unset);
}

/* One axis is lost alone: the node starts anew when it is reset, and with it
 * the other axis, which is set up again. */
static void one_that_starts_anew_takes_its_sibling_along(void **state)
{
    struct bench *b = &bench;

    (void)state;
    bench_plan(b);
    bench_build(b);
    found(b);
    enabled(b);
    b->servo[1].muted = true; /* no TPDO */
    assert_true(until(b, CONTROLLER_FAULT, 1000));
    no_torque(b, 1000);
    assert_int_equal(b->drive[1].phase, DRIVE_CIA402_LOST);
    assert_int_equal(b->drive[0].phase, DRIVE_CIA402_RUN);
    b->servo[1].muted = false;
    assert_int_equal(controller_reset(&b->controller), MOTION_OK);
    ticks(b, 20);
    assert_int_equal(b->drive[0].phase, DRIVE_CIA402_START_UP);
    assert_true(until(b, CONTROLLER_OFF, 20000));
    enabled(b);
    moves(b);
    obeyed(b);
}

static void a_place_is_taken_once(void **state)
{
    struct bench *b = &bench;
    struct drive_cia402 another;
    struct drive_cia402_config config;

    (void)state;
    bench_plan(b);
    bench_build(b);
    config = b->config[1];
    config.pdo.rpdo_id[0] = config.pdo.tpdo_id[0] = 0;
    assert_int_equal(drive_cia402_init(&another, &b->master, &config),
                     MOTION_E_ARG);
    config.axis = 2;
    config.pdo.rpdo_id[0] = 0x401; /* axis 1's */
    assert_int_equal(drive_cia402_init(&another, &b->master, &config),
                     MOTION_E_ARG);
    config.pdo.rpdo_id[0] = 0x302; /* node 2's */
    assert_int_equal(drive_cia402_init(&another, &b->master, &config),
                     MOTION_E_ARG);
    config.pdo.rpdo_id[0] = 0;
    config.axis = DRIVE_CIA402_AXES;
    assert_int_equal(drive_cia402_init(&another, &b->master, &config),
                     MOTION_E_ARG);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_axis_of_a_node_goes_its_own_way),
        cmocka_unit_test(the_sdo_channel_is_shared_fairly),
        cmocka_unit_test(a_slow_device_is_asked_one_thing_at_a_time),
        cmocka_unit_test(each_axis_tells_its_own_fault),
        cmocka_unit_test(a_record_is_completed_by_the_answer),
        cmocka_unit_test(an_axis_alone_takes_the_drives_own_identifiers),
        cmocka_unit_test(without_free_identifiers_it_is_refused),
        cmocka_unit_test(what_an_axis_lacks_is_named_by_its_own_object),
        cmocka_unit_test(a_fault_of_one_axis_stops_the_group),
        cmocka_unit_test(a_restart_of_the_node_restarts_each_axis),
        cmocka_unit_test(one_that_starts_anew_takes_its_sibling_along),
        cmocka_unit_test(a_place_is_taken_once),
    };

    return cmocka_run_group_tests_name("axes of a node", tests, NULL, NULL);
}
