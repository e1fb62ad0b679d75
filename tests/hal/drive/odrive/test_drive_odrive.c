/* tests/hal/drive/odrive/test_drive_odrive.c - what drive_odrive sends and how it
 * takes what it hears, frame by frame.  The frames were built with Python's
 * struct from ODrive's tables and read back with ODrive's DBC. */
#include "tests/hal/drive/turn/turn_bench.h"

#include "hal/drive/odrive/drive.h"
#include "hal/support/float32.h"

static struct drive_odrive drive;

static const struct drive_odrive_config base = {
    .node = 1,
    .turn = TURNS_BENCH_CONFIG,
};

static void bench_of(const struct drive_odrive_config *config)
{
    turn_bench_init(&drive.turn.drive);
    assert_int_equal(drive_odrive_init(&drive, &bus, config), 0);
}

/* Nothing of the family is asked: config says it. */
static void found(enum drive_odrive_family family)
{
    struct drive_odrive_config config = base;

    config.family = family;
    bench_of(&config);
    hear("021#0000000001000000");
    cycle();
    cycle();
    fake_can_put(&fake, "029#0000A03F00000000");
    for (int i = 0; i < 4 && seen.state != HAL_DRIVE_OFF; i++)
        cycle();
    assert_int_equal(seen.state, HAL_DRIVE_OFF);
    assert_int_equal(seen.pos_q32, ONE + ONE / 4);
    fake_can_wipe(&fake);
}

static void enabled(enum drive_odrive_family family)
{
    found(family);
    hal_drive_request(&drive.turn.drive, HAL_DRIVE_REQUEST_ENABLE);
    cycle();
    hear("021#0000000008000000");
    assert_int_equal(seen.state, HAL_DRIVE_ENABLED);
    fake_can_wipe(&fake);
}

static void it_asks_for_the_version_and_the_position(void **state)
{
    (void)state;
    bench_of(&base);
    cycle();
    expect(NULL); /* nobody there: nothing is said */
    hear("021#0000000001000000");
    expect("029#R");
    cycle();
    expect("020#R");
    expect("029#R");
    hear("020#02040A3A00060900");
    assert_int_equal(drive.family, DRIVE_ODRIVE_06);
}

/* It says what it waits for from the first cycle on, and that a position is none. */
static void it_says_what_it_waits_for(void **state)
{
    struct drive_odrive_config config = base;

    (void)state;
    bench_of(&base);
    cycle();
    assert_int_equal(seen.state, HAL_DRIVE_OFFLINE);
    cycle();
    assert_string_equal(seen.fault_text, "no heartbeat yet");
    hear("021#0000000001000000");
    cycle();
    assert_string_equal(seen.fault_text, "its version is not known yet");
    hear("020#02040A3A00060900");
    for (int i = 0; i < 3; i++)
        cycle();
    assert_string_equal(seen.fault_text, "no position yet");
    hear("029#0000C07F00000000");
    cycle();
    cycle();
    assert_string_equal(
        seen.fault_text,
        "its position is no number (NaN): is its encoder ready?");
    hear("029#0000A03F00000000");
    cycle();
    cycle();
    assert_int_equal(seen.state, HAL_DRIVE_OFF);
    assert_string_equal(seen.fault_text, "");
    for (int i = 0; i < 200 && seen.state == HAL_DRIVE_OFF; i++) {
        fake_can_put(&fake, "021#0000000001000000");
        hear("029#0000A03F0000C07F");
    }
    assert_int_equal(seen.state, HAL_DRIVE_OFFLINE);
    assert_non_null(strstr(seen.fault_text, "no number (NaN)"));
    config.watchdog_timeout = 6;
    config.enable_watchdog = 7;
    config.watchdog_ns = 100 * MS;
    config.family = DRIVE_ODRIVE_06;
    bench_of(&config);
    hear("021#0000000001000000");
    for (int i = 0; i < 4; i++)
        cycle();
    assert_string_equal(seen.fault_text, "its watchdog is not confirmed yet");
}

static void silence_about_the_version_is_0_5(void **state)
{
    (void)state;
    bench_of(&base);
    hear("021#0000000001000000");
    for (int i = 0; i < 250; i++) {
        if (i % 90 == 0)
            fake_can_put(&fake, "021#0000000001000000");
        hear("029#0000A03F00000000");
    }
    assert_int_equal(drive.family, DRIVE_ODRIVE_05);
    assert_int_equal(seen.state, HAL_DRIVE_OFF);
}

static void arming_gives_the_position_before_the_state(void **state)
{
    (void)state;
    found(DRIVE_ODRIVE_06);
    hal_drive_request(&drive.turn.drive, HAL_DRIVE_REQUEST_ENABLE);
    cycle();
    expect("02B#0300000001000000");
    expect("02C#0000A03F00000000");
    expect("027#08000000");
    expect("029#R");
    expect("02C#0000A03F00000000"); /* and every cycle */
    expect(NULL);
    assert_int_equal(seen.state, HAL_DRIVE_ENABLING);
}

static void expect_target(int64_t pos_q32, int64_t vel_q32, int32_t permille,
                          const char *want)
{
    const struct hal_drive_target target = { .pos_q32 = pos_q32,
                                             .vel_q32 = vel_q32,
                                             .torque_permille = permille };

    aim("029#0000A03F00000000", &target);
    expect(want);
}

static void set_points_have_speed_and_torque(void **state)
{
    (void)state;
    enabled(DRIVE_ODRIVE_06);
    expect_target(ONE + ONE / 4, -ONE / 2, 100, "02C#0000A03F0CFE6400");
    expect_target(ONE + ONE / 4, 20 * ONE, -500, "02C#0000A03F204E0CFE");
    /* held at the ends of 16 bits, not wrapped to the other sign */
    expect_target(ONE + ONE / 4, 40 * ONE, 40000, "02C#0000A03FFF7FFF7F");
    expect_target(ONE + ONE / 4, -40 * ONE, -40000, "02C#0000A03F00800080");
}

static void without_a_new_set_point_it_stands(void **state)
{
    (void)state;
    enabled(DRIVE_ODRIVE_06);
    expect_target(ONE + ONE / 4, ONE, 100, "02C#0000A03FE8036400");
    hear("029#0000A03F00000000");
    expect("02C#0000A03F00000000");
}

static void a_cycle_with_a_position_asks_for_none(void **state)
{
    (void)state;
    found(DRIVE_ODRIVE_06);
    cycle();
    expect("029#R");
    hear("029#000020C000000000");
    expect(NULL);
    assert_int_equal(seen.pos_q32, -5 * ONE / 2);
}

static void found_with_torque(enum drive_odrive_family family,
                              int64_t torque_constant_q32)
{
    struct drive_odrive_config config = base;

    config.family = family;
    config.reads_torque = true;
    config.torque_constant_q32 = torque_constant_q32;
    bench_of(&config);
    hear("021#0000000001000000");
    for (int i = 0; i < 4 && seen.state != HAL_DRIVE_OFF; i++)
        hear("029#0000A03F00000000");
    assert_int_equal(seen.state, HAL_DRIVE_OFF);
    fake_can_wipe(&fake);
}

/* How many of 100 cycles ask so; each hears where it is, and `answer`. */
static unsigned asked(const char *question, const char *answer)
{
    unsigned count = 0;

    for (int i = 0; i < 100; i++) {
        fake_can_put(&fake, "029#0000A03F00000000");
        if (i % 50 == 0)
            fake_can_put(&fake, "021#0000000001000000");
        if (answer != NULL)
            fake_can_put(&fake, answer);
        cycle();
        for (; fake.out_at < fake.out_count; fake.out_at++) {
            assert_true(fake.out[fake.out_at].remote);
            count += fake.out[fake.out_at].id == strtoul(question, NULL, 16);
        }
    }
    return count;
}

/* Of Nm the second number, which is what there is; -0.25 of a rated 1 Nm. */
static void torque_is_asked_for_every_10_ms(void **state)
{
    (void)state;
    found_with_torque(DRIVE_ODRIVE_06, 0);
    assert_false(seen.torque_known);
    assert_int_equal(asked("03C", "03C#0000803F000080BE"), 10);
    assert_true(seen.torque_known);
    assert_int_equal(seen.torque_permille, -250);
    assert_int_equal(asked("034", NULL), 0);
    found(DRIVE_ODRIVE_06); /* whose config does not say so */
    hear("03C#0000803F000080BE");
    assert_false(seen.torque_known);
}

/* 0.5: -3 A by 0.125 Nm/A; what a 0.6 says by 0x1C is a voltage there. */
static void a_0_5_says_its_current(void **state)
{
    (void)state;
    found_with_torque(DRIVE_ODRIVE_05, ONE / 8);
    assert_int_equal(asked("034", "034#00004040000040C0"), 10);
    assert_int_equal(seen.torque_permille, -375);
    hear("03C#0000803F0000803F");
    assert_int_equal(seen.torque_permille, -375);
    found_with_torque(DRIVE_ODRIVE_05, 0);
    (void)asked("034", "034#00004040000040C0");
    assert_false(seen.torque_known);
}

static void torque_that_is_old_or_no_number_is_not_known(void **state)
{
    (void)state;
    found_with_torque(DRIVE_ODRIVE_06, 0);
    hear("03C#0000803F0000803F");
    assert_int_equal(seen.torque_permille, 1000);
    for (int i = 0; i < 29; i++)
        hear("029#0000A03F00000000");
    assert_true(seen.torque_known);
    for (int i = 0; i < 3; i++)
        hear("029#0000A03F00000000");
    assert_false(seen.torque_known);
    assert_int_equal(seen.torque_permille, 0);
    hear("03C#0000803F0000803F");
    hear("03C#0000803F0000C07F"); /* NaN */
    assert_false(seen.torque_known);
    hear("03C#0000803FCAF24971"); /* 1e30 Nm */
    assert_false(seen.torque_known);
}

static void a_number_that_is_none_is_not_believed(void **state)
{
    (void)state;
    found(DRIVE_ODRIVE_06);
    hear("029#0000C07F00000000"); /* NaN */
    hear("029#0000807F00000000"); /* infinite */
    hear("029#0000A03F0000C0FF");
    hear("029#0000A03F");
    hear("029#CAF2497100000000"); /* 1e30 turns */
    hear("029#0000A03FCAF249F1");
    assert_int_equal(seen.pos_q32, ONE + ONE / 4);
    assert_int_equal(bus.stats.malformed, 6);
}

static void errors_of_0_6_in_words(void **state)
{
    (void)state;
    enabled(DRIVE_ODRIVE_06);
    hear("021#0000000101030000");
    assert_int_equal(seen.state, HAL_DRIVE_FAULT);
    assert_int_equal(seen.fault_code, 25);
    assert_string_equal(seen.fault_text,
                        "ODrive error 0x01000000: watchdog expired");
}

static void errors_of_0_5_in_words(void **state)
{
    (void)state;
    enabled(DRIVE_ODRIVE_05);
    hear("021#0008000001000080");
    assert_int_equal(seen.state, HAL_DRIVE_FAULT);
    assert_int_equal(seen.fault_code, 12);
    assert_string_equal(seen.fault_text,
                        "ODrive error 0x00000800: watchdog expired");
    enabled(DRIVE_ODRIVE_05);
    hear("021#0000000008010000"); /* the axis says 0, its motor does not */
    assert_int_equal(seen.state, HAL_DRIVE_FAULT);
    assert_string_equal(seen.fault_text, "ODrive: error of its motor");
}

/* No error, but idle: why is asked for. */
static void who_disarms_itself_is_asked_why(void **state)
{
    (void)state;
    enabled(DRIVE_ODRIVE_06);
    hear("021#0000000001030000");
    assert_int_equal(seen.state, HAL_DRIVE_FAULT);
    assert_string_equal(seen.fault_text, "switched itself off");
    assert_true(seen.fault_code_awaited);
    expect("023#R");
    for (int i = 0; i < 100; i++) { /* the answer was lost */
        fake_can_wipe(&fake);
        hear("029#0000A03F00000000");
    }
    expect("023#R");
    hear("023#0000000000100000");
    begin();
    assert_false(seen.fault_code_awaited);
    assert_string_equal(seen.fault_text,
                        "ODrive error 0x00001000: current limit");
}

static void reset_clears_by_the_family(void **state)
{
    (void)state;
    enabled(DRIVE_ODRIVE_06);
    hear("021#0000000101030000");
    fake_can_wipe(&fake);
    hal_drive_request(&drive.turn.drive, HAL_DRIVE_REQUEST_RESET);
    cycle();
    expect("038#00");
    enabled(DRIVE_ODRIVE_05);
    hear("021#0008000001000080");
    fake_can_wipe(&fake);
    hal_drive_request(&drive.turn.drive, HAL_DRIVE_REQUEST_RESET);
    cycle();
    expect("038#");
}

static void a_drive_that_stays_on_is_stopped_hard(void **state)
{
    bool estop = false;

    (void)state;
    enabled(DRIVE_ODRIVE_06);
    hal_drive_request(&drive.turn.drive, HAL_DRIVE_REQUEST_OFF);
    cycle();
    expect("027#01000000");
    for (int i = 0; i < 1100; i++) {
        fake_can_wipe(&fake);
        hear("029#0000A03F00000000");
        if (i % 90 == 0)
            hear("021#0000000008000000");
        for (unsigned k = 0; k < fake.out_count; k++)
            estop = estop || fake.out[k].id == 0x022;
    }
    assert_true(estop);
    assert_int_equal(seen.state, HAL_DRIVE_FAULT);
    assert_string_equal(seen.fault_text, "does not switch off");
}

static void a_go_sends_limits_mode_and_place(void **state)
{
    const struct hal_drive_go go = { .pos_q32 = 2 * ONE,
                                     .vel_q32 = 10 * ONE,
                                     .acc_q32 = INT64_C(40) << 32,
                                     .dec_q32 = INT64_C(30) << 32 };

    (void)state;
    enabled(DRIVE_ODRIVE_06);
    assert_int_equal(
        hal_drive_set_mode(&drive.turn.drive, HAL_DRIVE_PROFILE_POSITION), 0);
    hear("029#0000A03F00000000");
    fake_can_wipe(&fake);
    begin();
    assert_int_equal(hal_drive_go(&drive.turn.drive, &go), 0);
    end();
    expect("029#R");
    expect("031#00002041");
    expect("032#000020420000F041");
    expect("02B#0300000005000000");
    expect("02C#0000004000000000");
    hear("029#0000A03F00000000");
    expect(NULL); /* told once */
    hear("021#0000000008000000");
    assert_false(seen.arrived);
    for (int i = 0; i < 10; i++)
        hear("029#0000004000000000");
    fake_can_put(&fake, "021#0000000008000100");
    hear("029#0000004000000000");
    assert_true(seen.arrived);
}

/* Its endpoints are 0x0123 and 0x0124. */
static void watched(enum drive_odrive_family family, int64_t watchdog_ns)
{
    struct drive_odrive_config config = base;

    config.family = family;
    config.enable_watchdog = 0x0123;
    config.watchdog_timeout = 0x0124;
    config.watchdog_ns = watchdog_ns;
    bench_of(&config);
}

static void the_watchdog_is_set_and_read_back(void **state)
{
    (void)state;
    watched(DRIVE_ODRIVE_06, 500 * MS);
    hear("021#0000000001000000");
    cycle();
    fake_can_wipe(&fake);
    cycle();
    expect("024#012401000000003F");
    expect("024#0024010000000000");
    hear("025#000001000000003F"); /* about something else */
    hear("025#0024010000000040"); /* not what was written */
    assert_int_equal(drive.parameter, 0);
    hear("025#002401000000003F");
    assert_int_equal(drive.parameter, 1);
    fake_can_wipe(&fake);
    cycle();
    expect("029#R");
    hear("025#00230100017F3D00"); /* only the first byte is the answer */
    assert_int_equal(drive.parameter, 2);
}

static void a_watchdog_that_cannot_be_set_is_a_fault(void **state)
{
    (void)state;
    watched(DRIVE_ODRIVE_06, 100 * MS);
    for (int i = 0; i < 500; i++)
        hear("021#0000000001000000");
    assert_int_equal(seen.state, HAL_DRIVE_FAULT);
    assert_string_equal(seen.fault_text, "its watchdog could not be set");
    watched(DRIVE_ODRIVE_05, 100 * MS);
    for (int i = 0; i < 5; i++)
        hear("021#0000000001000000");
    assert_int_equal(seen.state, HAL_DRIVE_FAULT);
}

static void homing(void)
{
    const struct hal_drive_home home = { .pos_q32 = 3 * ONE,
                                         .timeout_ns = 5000 * MS };

    enabled(DRIVE_ODRIVE_06);
    assert_int_equal(hal_drive_set_mode(&drive.turn.drive, HAL_DRIVE_HOMING),
                     0);
    assert_int_equal(hal_drive_home(&drive.turn.drive, &home), 0);
    hear("029#0000A03F00000000");
    expect("027#0B000000");
    expect(NULL); /* and no set point */
    hear("021#000000000B010000");
    assert_int_equal(seen.homing, HAL_DRIVE_HOMING_RUNNING);
    assert_int_equal(seen.state, HAL_DRIVE_ENABLED);
}

/* Then the drive counts from 0, and we from 3. */
static void homing_ends_armed_at_the_home_point(void **state)
{
    (void)state;
    homing();
    fake_can_put(&fake, "029#0000000000000000");
    hear("021#0000000001000000");
    for (int i = 0; i < 3; i++)
        hear("029#0000000000000000");
    fake_can_wipe(&fake);
    hear("021#0000000008000000");
    assert_int_equal(seen.homing, HAL_DRIVE_HOMING_DONE);
    hear("029#0000803F00000000");
    assert_int_equal(seen.state, HAL_DRIVE_ENABLED);
    assert_int_equal(seen.pos_q32, 4 * ONE);
}

static void homing_that_fails_is_a_fault(void **state)
{
    (void)state;
    homing();
    hear("021#00000000010C0000");
    assert_int_equal(seen.homing, HAL_DRIVE_HOMING_FAILED);
    assert_int_equal(seen.state, HAL_DRIVE_FAULT);
    assert_string_equal(seen.fault_text,
                        "homing failed: homing without end stop (12)");
    homing();
    for (int i = 0; i < 5100; i++) {
        fake_can_wipe(&fake);
        if (i % 50 == 0)
            fake_can_put(&fake, "021#000000000B010000");
        hear("029#0000000000000000");
    }
    assert_int_equal(seen.state, HAL_DRIVE_FAULT);
    assert_string_equal(seen.fault_text, "homing took too long");
}

/* In so many cycles, of a drive that says that it is there. */
static bool is_made_idle(int cycles)
{
    bool idle = false;

    fake_can_wipe(&fake);
    for (int i = 0; i < cycles; i++) {
        hear("029#0000000000000000");
        for (; fake.out_at < fake.out_count; fake.out_at++)
            idle = idle || (fake.out[fake.out_at].id == 0x027 &&
                            fake.out[fake.out_at].data[0] == 1);
    }
    return idle;
}

/* Off, and a quick stop, end a homing by closed loop and a ramp: 1 turn/s, of
 * which a tick takes a tenth; not before its end is torque taken, by a quick stop
 * not before it is asked for. */
static void a_homing_can_be_broken_off(void **state)
{
    static const enum hal_drive_request requests[] = {
        HAL_DRIVE_REQUEST_OFF, HAL_DRIVE_REQUEST_QUICK_STOP
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(requests); i++) {
        homing();
        hear("029#000000000000803F");
        fake_can_wipe(&fake);
        hal_drive_request(&drive.turn.drive, requests[i]);
        hear("029#000000000000803F");
        assert_int_equal(seen.state, HAL_DRIVE_QUICK_STOP);
        expect("02B#0300000001000000");
        expect("02C#7012033AE8030000"); /* 0.0005 turns on, 1.000 turns/s */
        expect("027#08000000");
        expect("02C#EE0DBE3A84030000"); /* 0.00145, 0.900 */
        fake_can_wipe(&fake);
        hear("021#0000000008000000");
        expect("029#R");
        expect("02C#99BB163B20030000"); /* 0.0023, 0.800 */
        expect("02B#0300000001000000"); /* it restores the mode of before */
        assert_false(is_made_idle(7));
        assert_int_equal(is_made_idle(50),
                         requests[i] == HAL_DRIVE_REQUEST_OFF);
        hal_drive_request(&drive.turn.drive, HAL_DRIVE_REQUEST_OFF);
        assert_true(is_made_idle(151));
        hear("021#0000000001020000");
        assert_int_equal(seen.state, HAL_DRIVE_OFF);
        assert_int_equal(seen.homing, HAL_DRIVE_HOMING_FAILED);
    }
}

static void orders_from_somebody_else_are_noticed(void **state)
{
    static const char *const orders[] = { "02C#0000A03F00000000",
                                          "027#01000000",
                                          "02D#0000000000000000", "022#" };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(orders); i++) {
        found(DRIVE_ODRIVE_06);
        hear(orders[i]);
        assert_int_equal(bus_health, HAL_FIELDBUS_FOREIGN);
        cycle();
        assert_int_equal(bus_health, HAL_FIELDBUS_GOOD);
    }
    hear("04C#0000A03F00000000"); /* to another node: not ours to judge */
    assert_int_equal(bus_health, HAL_FIELDBUS_GOOD);
    hear("029#R");
    assert_int_equal(bus_health, HAL_FIELDBUS_GOOD);
}

/* As hal/fieldbus.h has it: error-passive is less than either. */
static void the_worst_of_the_bus_is_said(void **state)
{
    (void)state;
    found(DRIVE_ODRIVE_06);
    fake.state = HAL_CAN_PASSIVE;
    cycle();
    assert_int_equal(bus_health, HAL_FIELDBUS_PASSIVE);
    hear("022#");
    assert_int_equal(bus_health, HAL_FIELDBUS_FOREIGN);
    fake.refuse = 4;
    for (int i = 0; i < 3; i++) {
        cycle();
        assert_int_equal(bus_health, HAL_FIELDBUS_PASSIVE);
    }
    cycle();
    assert_int_equal(bus_health, HAL_FIELDBUS_FULL);
    fake.state = HAL_CAN_DOWN;
    cycle();
    assert_int_equal(bus_health, HAL_FIELDBUS_DOWN);
    fake.state = HAL_CAN_ACTIVE;
    cycle();
    assert_int_equal(bus_health, HAL_FIELDBUS_GOOD);
}

static void configs_that_cannot_be(void **state)
{
    static const struct {
        int64_t num, den, period_ns;
        uint8_t node;
    } rows[] = {
        { 0, 1, MS, 1 },   { 1, 0, MS, 1 },         { 1, -1, MS, 1 },
        { 1, 1, 0, 1 },    { 1, 1, 21 * MS, 1 },    { 1, 1, MS, 0x3F },
        { 1, 1, 1000, 1 }, { INT64_MIN, 1, MS, 1 },
    };

    (void)state;
    fake_can_init(&fake);
    can_bus_init(&bus, &fake.can);
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct drive_odrive_config config = base;

        config.node = rows[i].node;
        config.turn.turns_num = rows[i].num;
        config.turn.turns_den = rows[i].den;
        config.turn.period_ns = rows[i].period_ns;
        assert_true(drive_odrive_init(&drive, &bus, &config) < 0);
    }
    assert_null(bus.first);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_asks_for_the_version_and_the_position),
        cmocka_unit_test(it_says_what_it_waits_for),
        cmocka_unit_test(silence_about_the_version_is_0_5),
        cmocka_unit_test(arming_gives_the_position_before_the_state),
        cmocka_unit_test(set_points_have_speed_and_torque),
        cmocka_unit_test(torque_is_asked_for_every_10_ms),
        cmocka_unit_test(a_0_5_says_its_current),
        cmocka_unit_test(torque_that_is_old_or_no_number_is_not_known),
        cmocka_unit_test(without_a_new_set_point_it_stands),
        cmocka_unit_test(a_cycle_with_a_position_asks_for_none),
        cmocka_unit_test(a_number_that_is_none_is_not_believed),
        cmocka_unit_test(errors_of_0_6_in_words),
        cmocka_unit_test(errors_of_0_5_in_words),
        cmocka_unit_test(who_disarms_itself_is_asked_why),
        cmocka_unit_test(reset_clears_by_the_family),
        cmocka_unit_test(a_drive_that_stays_on_is_stopped_hard),
        cmocka_unit_test(a_go_sends_limits_mode_and_place),
        cmocka_unit_test(the_watchdog_is_set_and_read_back),
        cmocka_unit_test(a_watchdog_that_cannot_be_set_is_a_fault),
        cmocka_unit_test(homing_ends_armed_at_the_home_point),
        cmocka_unit_test(homing_that_fails_is_a_fault),
        cmocka_unit_test(a_homing_can_be_broken_off),
        cmocka_unit_test(orders_from_somebody_else_are_noticed),
        cmocka_unit_test(the_worst_of_the_bus_is_said),
        cmocka_unit_test(configs_that_cannot_be),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
