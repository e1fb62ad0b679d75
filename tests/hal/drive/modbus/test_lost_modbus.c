/* tests/hal/drive/modbus/test_lost_modbus.c - whatever goes wrong, a strict
 * Modbus servo has no torque in the end, and lost none in motion; in virtual
 * time. */
#include "motion/core/fixed.h"
#include "tests/hal/drive/modbus/strict_bench.h"

static struct strict_bench bench;

/* ---- what goes wrong ---- */

static void late(void)
{
    bench.faulty.from.fault = SIM_MODBUS_LATE;
    bench.faulty.from.late_ns = 300 * MS;
}

static void deaf(void)
{
    bench.wire.cut = true;
}

static void mute(void)
{
    bench.faulty.from.fault = SIM_MODBUS_MUTE;
}

static void other_unit(void)
{
    bench.faulty.from.fault = SIM_MODBUS_OTHER_UNIT;
}

static void wrong_crc(void)
{
    bench.faulty.from.fault = SIM_MODBUS_WRONG_CRC;
}

static void noise(void)
{
    bench.faulty.from.fault = SIM_MODBUS_NOISE;
}

static void position_jumps(void)
{
    bench.servo.lies = true;
}

static void alarm_of_its_own(void)
{
    strict_modbus_alarm(&bench.servo);
}

static void refuses_motion(void)
{
    const struct hal_drive_go other = { .pos_q32 = 20 * UNIT_Q32,
                                        .vel_q32 = UNIT_Q32 };

    bench.servo.refuses_motion = true;
    if (!bench.streams)
        assert_int_equal(hal_drive_go(&bench.drive.drive, &other), MOTION_OK);
}

static void refuses_to_go_off(void)
{
    bench.servo.refuses_off = true;
    position_jumps();
}

static void quick_stop_then_off(void)
{
    hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_QUICK_STOP);
    strict_bench_tick(&bench);
    hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_OFF);
}

static void quick_stop_to_rest_then_off(void)
{
    hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_QUICK_STOP);
    strict_bench_run(&bench, 1500 * MS);
    assert_true(bench.servo.torque);
    assert_false(strict_modbus_moves(&bench.servo));
    hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_OFF);
}

static void off(void)
{
    hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_OFF);
}

static void rebooted_unheard(void)
{
    deaf();
    strict_modbus_reboot(&bench.servo);
    bench.servo.energised = 0;
}

static void heal(void)
{
    bench.faulty.from.fault = SIM_MODBUS_GOOD;
    bench.wire.cut = false;
    bench.servo.refuses_off = false;
}

enum {
    STAYS = 1 << 0,      /* it never ends */
    LOSES = 1 << 1,      /* OFFLINE, or FAULT and LOST */
    REQUESTED = 1 << 2,  /* ends in OFF */
    NOT_HOMING = 1 << 3, /* which has no set points, and may jump */
};

static const struct {
    const char *name;
    void (*begin)(void);
    unsigned how;
} troubles[] = {
    { "late", late, LOSES },
    { "late for ever", late, LOSES | STAYS },
    { "mute for 1 s", mute, LOSES },
    { "mute for ever", mute, LOSES | STAYS },
    { "deaf and mute for 1 s", deaf, LOSES },
    { "wrong unit", other_unit, LOSES },
    { "wrong unit for ever", other_unit, LOSES | STAYS },
    { "wrong CRC for ever", wrong_crc, LOSES | STAYS },
    { "noise for ever", noise, LOSES | STAYS },
    { "rebooted meanwhile", rebooted_unheard, LOSES },
    { "position jumps", position_jumps, LOSES | STAYS | NOT_HOMING },
    { "refuses to go off for 1 s", refuses_to_go_off, LOSES | NOT_HOMING },
    { "exception on a set point", refuses_motion, STAYS | NOT_HOMING },
    { "alarm", alarm_of_its_own, STAYS },
    { "quick stop, then off", quick_stop_then_off, REQUESTED },
    { "quick stop to rest, then off", quick_stop_to_rest_then_off, REQUESTED },
};

/* ---- what must hold ---- */

static const char *const motion_text[] = { "streamed", "point to point",
                                           "homing" };

static void complain(const char *trouble, enum strict_motion motion,
                     const char *what)
{
    fail_msg("%s, %s, %s: %s; %s: %s", bench.map.title, motion_text[motion],
             trouble, what, hal_drive_state_text(bench.feedback.state),
             bench.feedback.fault_text);
}

static void expect_dark(const char *trouble, enum strict_motion motion,
                        unsigned how)
{
    const bool lost = bench.drive.phase == DRIVE_MODBUS_LOST;
    const char *text = bench.feedback.fault_text;

    if (bench.servo.torque || bench.servo.enabling)
        complain(trouble, motion, "torque");
    if (bench.servo.cuts > 0)
        complain(trouble, motion, "torque was taken in motion");
    if (bench.servo.fell)
        complain(trouble, motion, "its brake is open");
    if ((how & REQUESTED) != 0 ? bench.feedback.state != HAL_DRIVE_OFF
                               : !strict_bench_is_down(&bench))
        complain(trouble, motion, "the state");
    if (lost != ((how & LOSES) != 0))
        complain(trouble, motion, "lost, or not");
    if (lost && strstr(text, "lost, then switched off: ") != text &&
        (strstr(text, "lost; trying to switch it off: ") != text ||
         (how & STAYS) == 0))
        complain(trouble, motion, "the text");
}

static void run_trouble(enum strict_modbus_kind kind, enum strict_motion motion,
                        unsigned i)
{
    strict_bench_init(&bench, kind);
    strict_bench_move(&bench, motion);
    troubles[i].begin();
    if ((troubles[i].how & STAYS) != 0) {
        strict_bench_run(&bench, 6000 * MS);
    } else {
        strict_bench_run(&bench, 1000 * MS);
        heal();
        strict_bench_run(&bench, 4000 * MS);
    }
    expect_dark(troubles[i].name, motion, troubles[i].how);
    /* and it stays so, whatever comes of it */
    bench.servo.energised = bench.servo.set_points = 0;
    heal();
    strict_bench_run(&bench, 5000 * MS);
    if (bench.servo.energised > 0 || bench.servo.set_points > 0 ||
        bench.servo.torque)
        complain(troubles[i].name, motion, "it came to life again");
}

static void no_strict_servo_keeps_its_torque(void **state)
{
    (void)state;
    for (unsigned kind = 0; kind < ARRAY_LEN(strict_map); kind++)
        for (unsigned i = 0; i < ARRAY_LEN(troubles); i++) {
            run_trouble((enum strict_modbus_kind)kind, STRICT_STREAMED, i);
            run_trouble((enum strict_modbus_kind)kind, STRICT_GOING, i);
            if ((troubles[i].how & NOT_HOMING) == 0)
                run_trouble((enum strict_modbus_kind)kind, STRICT_HOMING, i);
        }
}

/* It has no torque, and has said so: what is written to it as it is lost gives it
 * none, also where `stop` would. */
static void one_that_is_lost_while_off_gets_no_torque(void **state)
{
    (void)state;
    for (unsigned kind = 0; kind < ARRAY_LEN(strict_map); kind++) {
        strict_bench_init(&bench, (enum strict_modbus_kind)kind);
        strict_bench_enable(&bench);
        hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_OFF);
        strict_bench_until(&bench, HAL_DRIVE_OFF);
        strict_bench_run(&bench, 100 * MS);
        bench.servo.energised = 0;
        mute();
        strict_bench_run(&bench, 3000 * MS);
        assert_int_equal(bench.drive.phase, DRIVE_MODBUS_LOST);
        heal();
        strict_bench_run(&bench, 3000 * MS);
        assert_int_equal(bench.servo.energised, 0);
        assert_false(bench.servo.torque);
    }
}

/* Whatever moves it, it comes to rest first, as it can be stopped. */
static void off_in_motion_stops_first(void **state)
{
    (void)state;
    for (unsigned i = 0; i < 3 * ARRAY_LEN(strict_map); i++) {
        const enum strict_motion motion = (enum strict_motion)(i % 3);

        strict_bench_init(&bench, (enum strict_modbus_kind)(i / 3));
        strict_bench_move(&bench, motion);
        off();
        strict_bench_run(&bench, 2000 * MS);
        assert_false(bench.servo.homed);
        expect_dark("off", motion, REQUESTED);
    }
}

/* The set points rest, and in the same tick it is to be off: the servo, which has
 * them a cycle later, is on its way still. */
static void off_where_the_set_points_rest_waits_for_the_servo(void **state)
{
    (void)state;
    for (unsigned kind = 0; kind < ARRAY_LEN(strict_map); kind++) {
        strict_bench_init(&bench, (enum strict_modbus_kind)kind);
        strict_bench_move(&bench, STRICT_STREAMED);
        bench.from = (double)bench.target.pos_q32 / (double)UNIT_Q32;
        bench.from_ns = 0;
        bench.target.vel_q32 = bench.target.acc_q32 = 0;
        strict_bench_tick(&bench);
        assert_true(strict_modbus_moves(&bench.servo));
        off();
        strict_bench_run(&bench, 2000 * MS);
        expect_dark("rest, then off", STRICT_STREAMED, REQUESTED);
    }
}

/* And what is asked for then does not soften it. */
static void torque_off_is_at_once(void **state)
{
    (void)state;
    for (unsigned i = 0; i < 3 * ARRAY_LEN(strict_map); i++) {
        strict_bench_init(&bench, (enum strict_modbus_kind)(i / 3));
        strict_bench_move(&bench, (enum strict_motion)(i % 3));
        bench.streams = false;
        hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_TORQUE_OFF);
        off();
        strict_bench_run(&bench, 100 * MS);
        assert_false(bench.servo.torque);
        assert_int_equal(bench.servo.cuts, 1);
        strict_bench_until(&bench, HAL_DRIVE_OFF);
    }
}

static void a_homing_that_takes_too_long_stops_first(void **state)
{
    (void)state;
    for (unsigned kind = 0; kind < ARRAY_LEN(strict_map); kind++) {
        strict_bench_init(&bench, (enum strict_modbus_kind)kind);
        strict_bench_home(&bench, 800 * MS);
        strict_bench_until(&bench, HAL_DRIVE_FAULT);
        assert_string_equal(bench.feedback.fault_text, "not at home in time");
        strict_bench_run(&bench, 2000 * MS);
        expect_dark("too long", STRICT_HOMING, 0);
    }
}

/* In the middle of what the halt does.  A map without one halts nothing. */
static void off_after_a_halt_stops_first(void **state)
{
    (void)state;
    for (unsigned kind = 0; kind < ARRAY_LEN(strict_map); kind++) {
        strict_bench_init(&bench, (enum strict_modbus_kind)kind);
        strict_bench_move(&bench, STRICT_HOMING);
        assert_int_equal(hal_drive_halt(&bench.drive.drive),
                         kind == STRICT_LEXIUM ? MOTION_E_EMPTY : MOTION_OK);
        strict_bench_run(&bench, 30 * MS);
        off();
        strict_bench_run(&bench, 2000 * MS);
        expect_dark("halt, then off", STRICT_HOMING, REQUESTED);
    }
}

/* Who moved it is gone, killed or hung; another looks for it. */
static void take_over(void)
{
    struct drive_modbus_config config = bench.drive.config;
    struct hal_modbus_reply reply;

    sim_world_run(&bench.world, bench.world.now_ns + 200 * MS);
    while (hal_modbus_collect(&bench.master.modbus, &reply) == 1)
        ;
    bench.streams = bench.asks_off = false;
    assert_int_equal(modbus_bus_init(&bench.bus, &bench.master.modbus, 2), 0);
    assert_int_equal(drive_modbus_init(&bench.drive, &bench.bus, &config), 0);
}

static void one_that_is_taken_over_stops_first(void **state)
{
    (void)state;
    for (unsigned i = 0; i < 3 * ARRAY_LEN(strict_map); i++) {
        const enum strict_motion motion = (enum strict_motion)(i % 3);

        strict_bench_init(&bench, (enum strict_modbus_kind)(i / 3));
        strict_bench_move(&bench, motion);
        take_over();
        strict_bench_run(&bench, 3000 * MS);
        expect_dark("taken over", motion, REQUESTED);
        /* streamed it stands meanwhile, and that one cannot say more */
        assert_int_equal(bench.drive.found.count,
                         bench.servo.kind != STRICT_EL7 ||
                             motion != STRICT_STREAMED);
        assert_false(bench.drive.found.goes_on);
        if (motion != STRICT_STREAMED) /* 2 units/s */
            assert_in_range(motion_fixed_abs(bench.drive.found.vel_q32),
                            UNIT_Q32, 3 * UNIT_Q32);
    }
}

/* It does not know of `init` yet: its bus access is another master's. */
static void one_that_obeys_only_after_init_is_stopped_first(void **state)
{
    (void)state;
    for (unsigned i = 0; i < 3; i++) {
        strict_bench_init(&bench, STRICT_LEXIUM);
        strict_bench_move(&bench, (enum strict_motion)i);
        bench.servo.reg[282] = bench.servo.reg[283] = 0;
        take_over();
        strict_bench_run(&bench, 3000 * MS);
        expect_dark("taken over", (enum strict_motion)i, REQUESTED);
    }
}

/* `stop` may be what gives one torque that has none. */
static void one_that_is_found_without_torque_gets_none(void **state)
{
    (void)state;
    for (unsigned kind = 0; kind < ARRAY_LEN(strict_map); kind++) {
        strict_bench_init(&bench, (enum strict_modbus_kind)kind);
        strict_bench_until(&bench, HAL_DRIVE_OFF);
        strict_bench_run(&bench, 1000 * MS);
        assert_int_equal(bench.servo.energised, 0);
        assert_int_equal(bench.drive.found.count, 0);
    }
}

/* A drive that has come back is given torque by nothing but a request. */
static void a_reset_finds_it_again(void **state)
{
    (void)state;
    for (unsigned kind = 0; kind < ARRAY_LEN(strict_map); kind++) {
        strict_bench_init(&bench, (enum strict_modbus_kind)kind);
        strict_bench_move(&bench, STRICT_STREAMED);
        deaf();
        strict_bench_until(&bench, HAL_DRIVE_OFFLINE);
        hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_RESET);
        bench.asks_off = bench.streams = false;
        strict_bench_run(&bench, 2000 * MS);
        assert_int_equal(bench.feedback.state, HAL_DRIVE_OFFLINE);
        heal();
        strict_bench_run(&bench, 2000 * MS);
        assert_false(bench.servo.torque);
        if (kind == STRICT_LEXIUM) /* its watchdog has tripped */
            hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_RESET);
        strict_bench_until(&bench, HAL_DRIVE_OFF);
        assert_false(bench.servo.torque);
        strict_bench_run(&bench, 1000 * MS);
        strict_bench_enable(&bench);
        assert_true(bench.servo.torque);
    }
}

/* Others are on the line: what it costs them while one is mute. */
static void a_lost_drive_leaves_most_of_the_line(void **state)
{
    uint64_t before;

    (void)state;
    strict_bench_init(&bench, STRICT_EL7);
    strict_bench_move(&bench, STRICT_STREAMED);
    deaf();
    strict_bench_until(&bench, HAL_DRIVE_OFFLINE);
    before = bench.master.stats.transactions;
    strict_bench_run(&bench, 10000 * MS);
    printf("%u requests in 10 s\n",
           (unsigned)(bench.master.stats.transactions - before));
    assert_in_range(bench.master.stats.transactions - before, 20, 60);
}

static void a_drive_that_fails_identify_is_left_alone(void **state)
{
    (void)state;
    strict_bench_init(&bench, STRICT_EL7);
    bench.servo.reg[0x0003] = 0;
    bench.servo.reg[0x0401] = 0x83;
    bench.servo.torque = true;
    strict_bench_run(&bench, 5000 * MS);
    assert_int_equal(bench.feedback.state, HAL_DRIVE_FAULT);
    assert_int_equal(bench.servo.reg[0x0401], 0x83);
}

/* ---- single makers ---- */

static void asda_streams_without_a_write_to_its_eeprom(void **state)
{
    (void)state;
    strict_bench_init(&bench, STRICT_ASDA);
    strict_bench_move(&bench, STRICT_STREAMED);
    strict_bench_run(&bench, 3000 * MS);
    assert_true(bench.servo.set_points > 20);
    assert_int_equal(bench.servo.eeprom, 0);
}

/* P2-30 kept another value: nothing is switched on. */
static void asda_that_would_store_is_refused(void **state)
{
    (void)state;
    strict_bench_init(&bench, STRICT_ASDA);
    for (unsigned i = 0; i < bench.map.item_count; i++)
        if (strcmp(bench.map.item[i].name, "storage") == 0)
            bench.map.item[i].at = 0x0300; /* one that this drive lacks */
    strict_bench_until(&bench, HAL_DRIVE_FAULT);
    strict_bench_run(&bench, 1000 * MS);
    assert_int_equal(bench.servo.energised, 0);
}

static void az_without_c_on_is_refused(void **state)
{
    (void)state;
    strict_bench_init(&bench, STRICT_AZ);
    bench.servo.reg[0x1205] = 0x40; /* M2 */
    strict_bench_until(&bench, HAL_DRIVE_FAULT);
    strict_bench_run(&bench, 1000 * MS);
    assert_string_equal(bench.feedback.fault_text,
                        "r_in2 reads 0x0040, expected 0x0002");
    assert_int_equal(bench.servo.energised, 0);
}

/* From every state of a CiA 402 machine Disable voltage leads to no torque. */
static void lexium_goes_off_from_every_state(void **state)
{
    static const enum strict_modbus_power power[] = {
        STRICT_OPERATION_ENABLED,
        STRICT_QUICK_STOP_ACTIVE,
        STRICT_FAULT_REACTION,
        STRICT_FAULT,
    };

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(power); i++) {
        strict_bench_init(&bench, STRICT_LEXIUM);
        strict_bench_enable(&bench);
        bench.servo.power = power[i];
        bench.servo.torque = power[i] != STRICT_FAULT;
        bench.servo.alarm = power[i] >= STRICT_FAULT_REACTION;
        hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_OFF);
        strict_bench_run(&bench, 3000 * MS);
        assert_false(bench.servo.torque);
        hal_drive_request(&bench.drive.drive, HAL_DRIVE_REQUEST_RESET);
        strict_bench_until(&bench, HAL_DRIVE_OFF);
        assert_int_equal(bench.servo.power, STRICT_SWITCH_ON_DISABLED);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_strict_servo_keeps_its_torque),
        cmocka_unit_test(one_that_is_lost_while_off_gets_no_torque),
        cmocka_unit_test(off_in_motion_stops_first),
        cmocka_unit_test(off_where_the_set_points_rest_waits_for_the_servo),
        cmocka_unit_test(torque_off_is_at_once),
        cmocka_unit_test(a_homing_that_takes_too_long_stops_first),
        cmocka_unit_test(off_after_a_halt_stops_first),
        cmocka_unit_test(one_that_is_taken_over_stops_first),
        cmocka_unit_test(one_that_obeys_only_after_init_is_stopped_first),
        cmocka_unit_test(one_that_is_found_without_torque_gets_none),
        cmocka_unit_test(a_reset_finds_it_again),
        cmocka_unit_test(a_lost_drive_leaves_most_of_the_line),
        cmocka_unit_test(a_drive_that_fails_identify_is_left_alone),
        cmocka_unit_test(asda_streams_without_a_write_to_its_eeprom),
        cmocka_unit_test(asda_that_would_store_is_refused),
        cmocka_unit_test(az_without_c_on_is_refused),
        cmocka_unit_test(lexium_goes_off_from_every_state),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
