/* tests/hal/drive/modbus/test_drive_modbus.c - the driver by every map on the
 * simulated servo of that name, and what it does when something is wrong. */
#include "tests/hal/linux/modbus_bench.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>

static const char *const maps[] = { "leadshine-el7", "leadshine-cs2rs",
                                    "oriental-az",   "delta-asda",
                                    "lexium-32",     "maps/floats" };

static struct modbus_bench bench;

static double units(int64_t q32)
{
    return (double)q32 / 4294967296.0;
}

/* Who moved it is gone, and what it still asked for has been answered. */
static void take_over(void)
{
    struct drive_modbus_config config = bench.drive.config;
    struct hal_modbus_reply reply;

    sim_world_run(&bench.world, bench.world.now_ns + 200 * MS);
    while (hal_modbus_collect(&bench.master.modbus, &reply) == 1)
        ;
    bench.streams = false;
    assert_int_equal(modbus_bus_init(&bench.bus, &bench.master.modbus, 2), 0);
    assert_int_equal(drive_modbus_init(&bench.drive, &bench.bus, &config), 0);
}

/* From rest to rest by `displacement` units in `dur` s: a quintic. */
static void quintic(double from, double displacement, double dur, double t,
                    struct hal_drive_target *target)
{
    const double u = t < dur ? t / dur : 1;
    const double p = u * u * u * (10 - 15 * u + 6 * u * u);
    const double v = 30 * u * u * (1 - 2 * u + u * u) / dur;
    const double a = 60 * u * (1 - 3 * u + 2 * u * u) / (dur * dur);

    target->pos_q32 = (int64_t)((from + displacement * p) * 4294967296.0);
    target->vel_q32 = (int64_t)(displacement * v * 4294967296.0);
    target->acc_q32 = (int64_t)(displacement * a * 0x1p32);
}

/* ---- every map ---- */

static void every_map_starts_enables_and_lets_go(void **state)
{
    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(maps); i++) {
        modbus_bench_load(&bench, maps[i]);
        modbus_bench_init(&bench);
        assert_int_equal(bench.feedback.state, HAL_DRIVE_OFFLINE);
        modbus_bench_enable(&bench);
        assert_true(bench.servo.enabled);
        assert_true(fabs(units(bench.feedback.pos_q32) - 1.2345) < 1e-6);
        hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_OFF);
        modbus_bench_until(&bench, HAL_DRIVE_OFF);
        assert_false(bench.servo.enabled);
    }
}

/* Standing, one that cannot say that it has torque is as one that has none. */
static void every_map_that_is_taken_over_is_switched_off(void **state)
{
    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(maps); i++) {
        const struct modbus_map *map = &bench.map;

        modbus_bench_load(&bench, maps[i]);
        modbus_bench_init(&bench);
        modbus_bench_enable(&bench);
        assert_int_equal(bench.drive.found.count, 0);
        take_over();
        modbus_bench_until(&bench, HAL_DRIVE_OFF);
        assert_false(bench.servo.enabled);
        assert_int_equal(
            bench.drive.found.count,
            map->status[MODBUS_STATUS_enabled].item != MODBUS_MAP_NO_ITEM ||
                map->status[MODBUS_STATUS_torque].item != MODBUS_MAP_NO_ITEM);
    }
}

/* 8 units in 4 s, at most 3.75 unit/s: the drive follows by its own ramps. */
static double stream_a_move(const char *name, double *end_off)
{
    double worst = 0;

    modbus_bench_load(&bench, name);
    modbus_bench_init(&bench);
    modbus_bench_enable(&bench);
    modbus_bench_run(&bench, 500 * MS);
    const double from = units(bench.target.pos_q32);
    for (unsigned tick = 0; tick < 5000; tick++) {
        const double t = tick * 1e-3;

        quintic(from, 8, 4, t, &bench.target);
        modbus_bench_tick(&bench);
        assert_int_equal(bench.feedback.state, HAL_DRIVE_ENABLED);
        const double actual =
            (double)sim_modbus_servo_counts(&bench.servo) / BENCH_COUNTS;
        const double off = fabs(units(bench.target.pos_q32) - actual);
        if (off > worst)
            worst = off;
        *end_off = off;
    }
    return worst;
}

static void every_map_follows_a_streamed_move(void **state)
{
    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(maps); i++) {
        double end_off;
        const double worst = stream_a_move(maps[i], &end_off);
        const double cycle_s = (double)bench.cycle_ns * 1e-9;

        printf("%-16s a set point every %5.1f ms: off at most %.3f unit "
               "(%.1f ms of its speed), %.4f at the end, %" PRIu64
               " set points\n",
               maps[i], 1e3 * cycle_s, worst, 1e3 * worst / 3.75, end_off,
               bench.drive.streams);
        /* what it runs in two cycles, and the servo's own lag */
        if (worst > 3.75 * (2 * cycle_s + 0.03) || end_off > 0.002)
            fail_msg("%s", maps[i]);
        assert_true((double)bench.drive.streams >= 0.85 * 5.5 / cycle_s);
    }
}

static void every_map_goes_point_to_point(void **state)
{
    const struct hal_drive_go go = { .pos_q32 = 5 * UNIT_Q32,
                                     .vel_q32 = 4 * UNIT_Q32 };

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(maps); i++) {
        unsigned ticks = 0;

        modbus_bench_load(&bench, maps[i]);
        modbus_bench_init(&bench);
        modbus_bench_enable(&bench);
        assert_int_equal(hal_drive_go(&bench.drive.drive, &go), MOTION_E_STATE);
        assert_int_equal(
            hal_drive_set_mode(&bench.drive.drive, HAL_DRIVE_PROFILE_POSITION),
            MOTION_OK);
        assert_int_equal(hal_drive_go(&bench.drive.drive, &go), MOTION_OK);
        do
            modbus_bench_tick(&bench);
        while (!bench.feedback.arrived && ++ticks < 10000);
        if (!bench.feedback.arrived ||
            llabs(sim_modbus_servo_counts(&bench.servo) - 50000) > 8)
            fail_msg("%s: at %" PRId64, maps[i],
                     sim_modbus_servo_counts(&bench.servo));
        assert_int_equal(bench.servo.targets, 1);
    }
}

static void going_bench(const char *name, const struct hal_drive_go *go)
{
    modbus_bench_load(&bench, name);
    modbus_bench_init(&bench);
    modbus_bench_enable(&bench);
    assert_int_equal(
        hal_drive_set_mode(&bench.drive.drive, HAL_DRIVE_PROFILE_POSITION),
        MOTION_OK);
    assert_int_equal(hal_drive_go(&bench.drive.drive, go), MOTION_OK);
    modbus_bench_run(&bench, 600 * MS);
}

/* 8 units at 2 units/s: on its way after 0.6 s. */
static void a_halt_ends_a_go_and_the_next_one_starts(void **state)
{
    const struct hal_drive_go there = { .pos_q32 = 8 * UNIT_Q32,
                                        .vel_q32 = 2 * UNIT_Q32,
                                        .acc_q32 = INT64_C(20) << 32,
                                        .dec_q32 = INT64_C(20) << 32 };

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(maps); i++) {
        going_bench(maps[i], &there);
        if (bench.map.sequence[MODBUS_SEQUENCE_halt].count == 0) {
            assert_string_equal(maps[i], "lexium-32");
            assert_int_equal(hal_drive_halt(&bench.drive.drive),
                             MOTION_E_EMPTY);
            continue;
        }
        if (bench.feedback.arrived) { /* no speed in its registers */
            assert_string_equal(maps[i], "delta-asda");
            continue;
        }
        assert_int_equal(hal_drive_halt(&bench.drive.drive), MOTION_OK);
        modbus_bench_run(&bench, 1000 * MS);
        assert_int_equal(bench.feedback.state, HAL_DRIVE_ENABLED);
        assert_int_equal(bench.feedback.vel_q32, 0);
        assert_false(bench.feedback.arrived);
        assert_true(units(bench.feedback.pos_q32) < 6);
        assert_int_equal(hal_drive_go(&bench.drive.drive, &there), MOTION_OK);
        modbus_bench_run(&bench, 7000 * MS);
        assert_true(bench.feedback.arrived);
        assert_true(fabs(units(bench.feedback.pos_q32) - 8) < 0.001);
    }
}

static void every_map_that_can_goes_home(void **state)
{
    const struct hal_drive_home home = { .pos_q32 = 3 * UNIT_Q32,
                                         .timeout_ns = 5000 * MS };

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(maps); i++) {
        modbus_bench_load(&bench, maps[i]);
        modbus_bench_init(&bench);
        modbus_bench_enable(&bench);
        if (bench.map.sequence[MODBUS_SEQUENCE_home].count == 0)
            continue;
        assert_int_equal(
            hal_drive_set_mode(&bench.drive.drive, HAL_DRIVE_HOMING),
            MOTION_OK);
        assert_int_equal(hal_drive_home(&bench.drive.drive, &home), MOTION_OK);
        modbus_bench_run(&bench, 2000 * MS);
        assert_int_equal(bench.feedback.homing, HAL_DRIVE_HOMING_DONE);
        assert_int_equal(bench.feedback.pos_q32, home.pos_q32);
        assert_int_equal(sim_modbus_servo_counts(&bench.servo), 0);
    }
}

/* No drive is home within a millisecond. */
static void a_homing_that_takes_too_long_is_a_fault(void **state)
{
    const struct hal_drive_home home = { .timeout_ns = MS };

    (void)state;
    modbus_bench_load(&bench, "leadshine-el7");
    modbus_bench_init(&bench);
    modbus_bench_enable(&bench);
    assert_int_equal(hal_drive_set_mode(&bench.drive.drive, HAL_DRIVE_HOMING),
                     MOTION_OK);
    assert_int_equal(hal_drive_home(&bench.drive.drive, &home), MOTION_OK);
    modbus_bench_until(&bench, HAL_DRIVE_FAULT);
    assert_string_equal(bench.feedback.fault_text, "not at home in time");
    assert_int_equal(bench.feedback.homing, HAL_DRIVE_HOMING_FAILED);
}

/* Coils and discrete inputs; addresses of bits are not those of registers. */
static void a_servo_may_have_its_switches_in_bits(void **state)
{
    const struct hal_drive_go there = { .pos_q32 = 8 * UNIT_Q32,
                                        .vel_q32 = 4 * UNIT_Q32,
                                        .acc_q32 = INT64_C(20) << 32,
                                        .dec_q32 = INT64_C(20) << 32 };

    (void)state;
    going_bench("maps/coils", &there);
    assert_int_equal(bench.drive.fast_count, 2); /* inputs, registers */
    assert_int_equal(bench.drive.fast[0].count, 41);
    assert_false(bench.feedback.arrived);
    modbus_bench_run(&bench, 4000 * MS);
    assert_true(bench.feedback.arrived);
    assert_true(fabs(units(bench.feedback.pos_q32) - 8) < 0.001);
    sim_modbus_servo_inject(&bench.servo, SIM_MODBUS_SERVO_ALARM);
    modbus_bench_until(&bench, HAL_DRIVE_FAULT);
    modbus_bench_run(&bench, 500 * MS);
    assert_string_equal(bench.feedback.fault_text,
                        "alarm 0x0007, motor too hot");
    hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_RESET);
    modbus_bench_until(&bench, HAL_DRIVE_OFF);
}

/* ---- faults ---- */

static void moving_bench(const char *name)
{
    modbus_bench_load(&bench, name);
    modbus_bench_init(&bench);
    modbus_bench_enable(&bench);
    for (unsigned tick = 0; tick < 2000; tick++) {
        quintic(1.2345, 8, 4, tick * 1e-3, &bench.target);
        modbus_bench_tick(&bench);
    }
    assert_int_equal(bench.feedback.state, HAL_DRIVE_ENABLED);
}

/* All but "acknowledged" and "busy": it has no function any more by which it is
 * read, or by which set points are written. */
static void an_exception_latches(void **state)
{
    static const struct {
        uint32_t functions;
        const char *text;
    } rows[] = {
        { 1u << 6 | 1u << 16, "a read was refused: " },
        { 1u << 3 | 1u << 4, "a set point was refused: " },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        moving_bench("leadshine-el7");
        bench.servo.slave.functions = rows[i].functions;
        const int64_t since_ns = bench.world.now_ns;
        modbus_bench_until(&bench, HAL_DRIVE_FAULT);
        assert_true(bench.world.now_ns - since_ns < 50 * MS);
        if (strstr(bench.feedback.fault_text, rows[i].text) == NULL)
            fail_msg("%s: %s", rows[i].text, bench.feedback.fault_text);
    }
}

static void an_alarm_is_told_in_words_and_reset(void **state)
{
    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(maps); i++) {
        moving_bench(maps[i]);
        sim_modbus_servo_inject(&bench.servo, SIM_MODBUS_SERVO_ALARM);
        modbus_bench_until(&bench, HAL_DRIVE_FAULT);
        modbus_bench_run(&bench, 500 * MS);
        assert_int_equal(bench.feedback.fault_code, bench.map.alarms[0].code);
        if (strstr(bench.feedback.fault_text, bench.map.alarms[0].text) == NULL)
            fail_msg("%s: %s", maps[i], bench.feedback.fault_text);
        hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_OFF);
        hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_RESET);
        modbus_bench_until(&bench, HAL_DRIVE_OFF);
        assert_false(bench.servo.enabled); /* nothing enables by itself */
        modbus_bench_enable(&bench);
    }
}

static void a_mute_drive_is_lost_and_found(void **state)
{
    int64_t since_ns;

    (void)state;
    moving_bench("leadshine-el7");
    sim_modbus_servo_inject(&bench.servo, SIM_MODBUS_SERVO_OFF);
    since_ns = bench.world.now_ns;
    modbus_bench_until(&bench, HAL_DRIVE_OFFLINE);
    /* three time-outs and the silence after each */
    assert_true(bench.world.now_ns - since_ns < 600 * MS);
    assert_string_equal(bench.feedback.fault_text,
                        "lost; trying to switch it off: no answer in time");
    sim_modbus_servo_inject(&bench.servo, SIM_MODBUS_SERVO_CLEAR);
    modbus_bench_run(&bench, 2000 * MS);
    assert_int_equal(bench.feedback.state, HAL_DRIVE_OFFLINE);
    assert_string_equal(bench.feedback.fault_text,
                        "lost, then switched off: no answer in time");
    hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_RESET);
    modbus_bench_until(&bench, HAL_DRIVE_OFF);
}

/* Whatever is on its way, one or two missing answers are left out; the third in a
 * row is a drive that is lost, as without a gateway, and none that has a fault. */
static void what_a_gateway_misses_is_a_missing_answer(void **state)
{
    struct hal_modbus_stats stats;

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(maps); i++) {
        struct sim_modbus_direction *from = &bench.servo.faulty.from;

        moving_bench(maps[i]);
        for (unsigned n = 1; n <= 2; n++) {
            from->fault = SIM_MODBUS_GATEWAY;
            from->times = n;
            modbus_bench_run(&bench, 150 * MS);
            if (bench.feedback.state != HAL_DRIVE_ENABLED)
                fail_msg("%s, %u: %s", maps[i], n, bench.feedback.fault_text);
            assert_int_equal(from->spoilt, n * (n + 1) / 2);
        }
        from->times = 0;
        from->fault = SIM_MODBUS_GATEWAY;
        modbus_bench_until(&bench, HAL_DRIVE_OFFLINE);
        if (strstr(bench.feedback.fault_text,
                   "lost; trying to switch it off: gateway ") == NULL)
            fail_msg("%s: %s", maps[i], bench.feedback.fault_text);
        assert_true(from->spoilt < 3 + 3 + 2); /* two are under way at most */
        hal_modbus_stats(&bench.master.modbus, &stats);
        assert_int_equal(stats.exceptions, 0);
        assert_true(stats.timeouts >= 6);
        from->fault = SIM_MODBUS_GOOD;
        modbus_bench_run(&bench, 4000 * MS);
        assert_false(bench.servo.enabled);
    }
}

/* A gateway's exception while the drive is looked for is no other drive. */
static void a_drive_behind_a_gateway_is_waited_for(void **state)
{
    (void)state;
    modbus_bench_load(&bench, "leadshine-el7");
    modbus_bench_init(&bench);
    bench.servo.faulty.from.fault = SIM_MODBUS_GATEWAY;
    modbus_bench_run(&bench, 3000 * MS);
    assert_int_equal(bench.feedback.state, HAL_DRIVE_OFFLINE);
    bench.servo.faulty.from.fault = SIM_MODBUS_GOOD;
    modbus_bench_until(&bench, HAL_DRIVE_OFF);
}

static void a_drive_that_comes_later_is_found(void **state)
{
    (void)state;
    modbus_bench_load(&bench, "oriental-az");
    modbus_bench_init(&bench);
    sim_modbus_servo_inject(&bench.servo, SIM_MODBUS_SERVO_OFF);
    modbus_bench_run(&bench, 3000 * MS);
    assert_int_equal(bench.feedback.state, HAL_DRIVE_OFFLINE);
    sim_modbus_servo_inject(&bench.servo, SIM_MODBUS_SERVO_CLEAR);
    modbus_bench_until(&bench, HAL_DRIVE_OFF);
}

static void the_wrong_drive_is_refused(void **state)
{
    (void)state;
    modbus_bench_load(&bench, "leadshine-el7");
    modbus_bench_init(&bench);
    bench.servo.reg[0x0003] = 0;
    modbus_bench_until(&bench, HAL_DRIVE_FAULT);
    assert_string_equal(bench.feedback.fault_text,
                        "drive is not in PR mode (Pr0.01 = 6, then restart)");
    assert_false(bench.servo.enabled);
}

/* One answer in twenty is bad: it is left out, the move goes on. */
static void single_bad_answers_do_not_stop_a_move(void **state)
{
    (void)state;
    for (int fault = SIM_MODBUS_MUTE; fault < SIM_MODBUS_FAULTS; fault++) {
        moving_bench("leadshine-el7");
        for (unsigned tick = 2000; tick < 4500; tick++) {
            if (tick % 600 == 0) {
                bench.servo.faulty.from.fault = (enum sim_modbus_fault)fault;
                bench.servo.faulty.from.times = 1;
            }
            quintic(1.2345, 8, 4, tick * 1e-3, &bench.target);
            modbus_bench_tick(&bench);
            if (bench.feedback.state != HAL_DRIVE_ENABLED)
                fail_msg("kind %d: %s", fault, bench.feedback.fault_text);
        }
        modbus_bench_run(&bench, 500 * MS);
        assert_true(fabs(units(bench.feedback.pos_q32) - 9.2345) < 0.002);
    }
}

static void a_position_that_cannot_be_is_left_out(void **state)
{
    const int64_t there = bench.feedback.pos_q32;
    struct modbus_node *node = &bench.drive.node;
    struct hal_modbus_reply lie = { .err = MOTION_OK, .count = 2 };

    (void)state;
    (void)there;
    moving_bench("leadshine-el7");
    const int64_t before_q32 = bench.feedback.pos_q32;
    lie.value[0] = 0x0800; /* far away */
    lie.answer_ns = bench.world.now_ns;
    for (unsigned i = 0; i < bench.drive.fast_count; i++)
        if (bench.drive.fast[i].at == 0x602C)
            node->ops->reply(node, (uint16_t)(6 + i), &lie); /* JOB_FAST */
    hal_drive_feedback(&bench.drive.drive, &bench.feedback);
    assert_int_equal(bench.feedback.pos_q32, before_q32);
    assert_int_equal(bench.feedback.state, HAL_DRIVE_ENABLED);
    for (unsigned i = 0; i < bench.drive.fast_count; i++)
        if (bench.drive.fast[i].at == 0x602C)
            node->ops->reply(node, (uint16_t)(6 + i), &lie);
    hal_drive_feedback(&bench.drive.drive, &bench.feedback);
    assert_int_equal(bench.feedback.state, HAL_DRIVE_FAULT);
}

/* The drive hears this position. */
static void say_position(uint16_t high, uint16_t low)
{
    const struct modbus_map_item *item = &bench.map.item[bench.map.position];
    struct modbus_node *node = &bench.drive.node;

    for (unsigned i = 0; i < bench.drive.fast_count; i++) {
        const struct modbus_map_block *block = &bench.drive.fast[i];
        struct hal_modbus_reply lie = { .err = MOTION_OK,
                                        .count = block->count,
                                        .answer_ns = bench.world.now_ns };

        if (block->read != item->read)
            continue;
        lie.value[item->at - block->at] = low; /* CDAB */
        lie.value[item->at - block->at + 1] = high;
        node->ops->reply(node, (uint16_t)(6 + i), &lie); /* JOB_FAST */
    }
    hal_drive_feedback(&bench.drive.drive, &bench.feedback);
}

static void a_position_that_is_no_number_is_not_believed(void **state)
{
    static const struct {
        uint16_t high, low;
    } rows[] = {
        { 0x7FC0, 0 },      { 0xFFC0, 0 }, /* NaN */
        { 0x7F80, 1 },                     /* a signalling one */
        { 0x7F80, 0 },      { 0xFF80, 0 }, /* infinite */
        { 0x4F00, 0 },      { 0xCF00, 1 }, /* 2^31, below -2^31 */
        { 0x7F7F, 0xFFFF },
    };

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(rows); i++) {
        moving_bench("maps/floats");
        const int64_t before_q32 = bench.feedback.pos_q32;

        assert_true(llabs(before_q32 - bench.target.pos_q32) < UNIT_Q32);
        say_position(rows[i].high, rows[i].low);
        assert_int_equal(bench.feedback.pos_q32, before_q32);
        assert_int_equal(bench.feedback.state, HAL_DRIVE_ENABLED);
        say_position(rows[i].high, rows[i].low);
        assert_int_equal(bench.feedback.state, HAL_DRIVE_FAULT);
        assert_string_equal(bench.feedback.fault_text,
                            "lost; trying to switch it off: "
                            "its position is no number");
    }
}

/* A NaN is not the 0 that was written. */
static void a_parameter_that_is_no_number_is_refused(void **state)
{
    static struct drive_modbus_parameter parameter;

    (void)state;
    modbus_bench_load(&bench, "maps/floats");
    modbus_bench_init(&bench);
    while (strcmp(bench.map.item[parameter.item].name, "current") != 0)
        parameter.item++;
    bench.drive.config.parameter = &parameter;
    bench.drive.config.parameter_count = 1;
    for (unsigned tick = 0; tick < 2000; tick++) {
        bench.servo.reg[0x22] = 0; /* CDAB */
        bench.servo.reg[0x23] = 0x7FC0;
        modbus_bench_tick(&bench);
    }
    assert_int_equal(bench.feedback.state, HAL_DRIVE_FAULT);
    assert_string_equal(bench.feedback.fault_text,
                        "current reads back no number");
}

static void the_first_set_point_must_be_where_the_axis_is(void **state)
{
    (void)state;
    modbus_bench_load(&bench, "leadshine-el7");
    modbus_bench_init(&bench);
    modbus_bench_enable(&bench);
    bench.target.pos_q32 += 2 * UNIT_Q32;
    assert_int_equal(hal_drive_set_target(&bench.drive.drive, &bench.target),
                     MOTION_E_AWAY);
    modbus_bench_until(&bench, HAL_DRIVE_FAULT);
    modbus_bench_run(&bench, 500 * MS);
    assert_int_equal(sim_modbus_servo_counts(&bench.servo), 12345);
}

static void a_quick_stop_is_the_drives_own(void **state)
{
    (void)state;
    moving_bench("oriental-az");
    hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_QUICK_STOP);
    bench.streams = false;
    modbus_bench_tick(&bench);
    modbus_bench_tick(&bench);
    assert_int_equal(bench.feedback.state, HAL_DRIVE_QUICK_STOP);
    modbus_bench_run(&bench, 1000 * MS);
    assert_int_equal(bench.feedback.vel_q32, 0);
    assert_true(bench.servo.enabled);
    hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_OFF);
    modbus_bench_until(&bench, HAL_DRIVE_OFF);
    assert_false(bench.servo.enabled);
}

/* Lexium: it hears nothing for 500 ms. */
static void the_drives_own_watchdog_stops_it(void **state)
{
    (void)state;
    moving_bench("lexium-32");
    bench.wire.cut = true;
    modbus_bench_run(&bench, 600 * MS);
    assert_false(bench.servo.enabled);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_map_starts_enables_and_lets_go),
        cmocka_unit_test(every_map_that_is_taken_over_is_switched_off),
        cmocka_unit_test(every_map_follows_a_streamed_move),
        cmocka_unit_test(every_map_goes_point_to_point),
        cmocka_unit_test(a_halt_ends_a_go_and_the_next_one_starts),
        cmocka_unit_test(every_map_that_can_goes_home),
        cmocka_unit_test(a_servo_may_have_its_switches_in_bits),
        cmocka_unit_test(a_homing_that_takes_too_long_is_a_fault),
        cmocka_unit_test(an_exception_latches),
        cmocka_unit_test(an_alarm_is_told_in_words_and_reset),
        cmocka_unit_test(a_mute_drive_is_lost_and_found),
        cmocka_unit_test(what_a_gateway_misses_is_a_missing_answer),
        cmocka_unit_test(a_drive_behind_a_gateway_is_waited_for),
        cmocka_unit_test(a_drive_that_comes_later_is_found),
        cmocka_unit_test(the_wrong_drive_is_refused),
        cmocka_unit_test(single_bad_answers_do_not_stop_a_move),
        cmocka_unit_test(a_position_that_cannot_be_is_left_out),
        cmocka_unit_test(a_position_that_is_no_number_is_not_believed),
        cmocka_unit_test(a_parameter_that_is_no_number_is_refused),
        cmocka_unit_test(the_first_set_point_must_be_where_the_axis_is),
        cmocka_unit_test(a_quick_stop_is_the_drives_own),
        cmocka_unit_test(the_drives_own_watchdog_stops_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
