/* tests/hal/drive/moteus/test_drive_moteus.c - what drive_moteus sends and how it
 * takes what it hears, frame by frame.  What is expected was built with mjbots'
 * own Python package (Controller.make_position and others) and is theirs on the
 * wire. */
#include "tests/hal/drive/turn/turn_bench.h"

#include "hal/drive/moteus/drive.h"
#include "hal/support/float32.h"

static struct drive_moteus drive;

static const struct drive_moteus_config base = {
    .id = 1,
    .turn = TURNS_BENCH_CONFIG,
};

static void bench_of(const struct drive_moteus_config *config)
{
    turn_bench_init(&drive.turn.drive);
    assert_int_equal(drive_moteus_init(&drive, &bus, config), 0);
}

/* Mode; position 1.25, velocity -0.5, torque 0.1; 24 V, 31 C, fault. */
#define ANSWER(mode, fault)                                                    \
    "100#2100" mode "2F010000A03F000000BFCDCCCC3D230D301F" fault "5050"
/* The questions of every cycle, then filled up. */
#define QUESTIONS "11001F01130D"

static void found(void)
{
    bench_of(&base);
    cycle();
    hear(ANSWER("00", "00"));
    assert_int_equal(seen.state, HAL_DRIVE_OFF);
    fake_can_wipe(&fake);
}

static void enabled(void)
{
    found();
    hal_drive_request(&drive.turn.drive, HAL_DRIVE_REQUEST_ENABLE);
    cycle();
    hear(ANSWER("0A", "00"));
    assert_int_equal(seen.state, HAL_DRIVE_ENABLED);
    fake_can_wipe(&fake);
}

static void it_asks_until_it_is_answered(void **state)
{
    (void)state;
    bench_of(&base);
    cycle();
    expect("8001#" QUESTIONS);
    for (int i = 0; i < 19; i++)
        cycle();
    expect(NULL); /* every 20 ms until then */
    cycle();
    expect("8001#" QUESTIONS);
    hear(ANSWER("00", "00"));
    assert_int_equal(seen.state, HAL_DRIVE_OFF);
    assert_int_equal(seen.pos_q32, ONE + ONE / 4);
    assert_int_equal(seen.vel_q32, -ONE / 2);
    assert_true(seen.torque_known);
    assert_int_equal(seen.torque_permille, 100);
    assert_int_equal(drive.turn.readings.value[HAL_READING_VOLTAGE].milli,
                     24000);
    assert_int_equal(drive.turn.readings.value[HAL_READING_TEMPERATURE].milli,
                     31000);
}

static void set_points_are_as_mjbots_builds_them(void **state)
{
    const struct hal_drive_target target = { .pos_q32 = ONE + ONE / 4,
                                             .vel_q32 = -ONE / 2,
                                             .torque_permille = 100 };

    (void)state;
    enabled();
    aim(ANSWER("0A", "00"), &target);
    /* watchdog 100 ms, no limits, as 16 bits */
    expect("8001#01000A0F200000A03F000000BFCDCCCC3D"
           "07276400FFFFFFFF" QUESTIONS "50");
    /* and without a new one it stands */
    hear(ANSWER("0A", "00"));
    expect("8001#01000A0F200000A03F0000000000000000"
           "07276400FFFFFFFF" QUESTIONS "50");
}

/* What the drive has been told to be at, dated by itself: on at the velocity of
 * the set point, and no farther when no more come. */
static void the_demand_goes_on_at_its_velocity(void **state)
{
    const struct hal_drive_target target = { .pos_q32 = ONE + ONE / 4,
                                             .vel_q32 = 2 * ONE };

    (void)state;
    enabled();
    aim(ANSWER("0A", "00"), &target);
    fake_can_put_at(&fake, ANSWER("0A", "00"), now_ns - 100000);
    cycle();
    /* measured 0.9 ms after the tick, in force 0.5 ms after it */
    assert_true(seen.demand_known);
    assert_in_range(seen.demand_q32 - target.pos_q32, 2 * ONE * 4 / 10000 - 9,
                    2 * ONE * 4 / 10000 + 9);
    for (int i = 0; i < 5000; i++) {
        fake_can_wipe(&fake);
        hear(ANSWER("0A", "00"));
    }
    assert_true(seen.demand_known);
    assert_int_equal(seen.demand_q32, target.pos_q32);
}

static void off_is_mode_0_until_it_says_so(void **state)
{
    (void)state;
    enabled();
    hal_drive_request(&drive.turn.drive, HAL_DRIVE_REQUEST_OFF);
    hear(ANSWER("0A", "00"));
    expect("8001#010000" QUESTIONS "505050");
    hear(ANSWER("0A", "00"));
    expect("8001#010000" QUESTIONS "505050");
    hear(ANSWER("00", "00"));
    assert_int_equal(seen.state, HAL_DRIVE_OFF);
    expect("8001#" QUESTIONS);
}

static void a_go_has_limits(void **state)
{
    const struct hal_drive_go go = { .pos_q32 = 2 * ONE,
                                     .vel_q32 = 10 * ONE,
                                     .acc_q32 = INT64_C(40) << 32 };

    (void)state;
    enabled();
    /* it says -0.5 turns/s: that is not standing */
    assert_int_equal(
        hal_drive_set_mode(&drive.turn.drive, HAL_DRIVE_PROFILE_POSITION),
        MOTION_E_STATE);
    hear("100#21000A2F010000A03F00000000CDCCCC3D230D301F005050");
    fake_can_wipe(&fake);
    assert_int_equal(
        hal_drive_set_mode(&drive.turn.drive, HAL_DRIVE_PROFILE_POSITION), 0);
    begin();
    assert_int_equal(hal_drive_go(&drive.turn.drive, &go), 0);
    end();
    expect("8001#01000A0F2000000040000000000000000005276400"
           "0E280000204100002042" QUESTIONS "110B"
           "505050505050505050");
    for (int i = 0; i < 4; i++) /* complete, but that was the one before */
        hear("100#21000A2F010000A03F00000000CDCCCC3D230D301F00210B005050"
             "5050505050");
    assert_false(seen.arrived);
    hear("100#21000A2F010000004000000000CDCCCC3D230D301F00210B01505050"
         "50505050");
    assert_true(seen.arrived);
}

static void faults_in_words(void **state)
{
    static const struct {
        const char *answer, *text;
        uint16_t code;
    } rows[] = {
        { ANSWER("01", "21"),
          "moteus fault 33: motor driver, perhaps under-voltage", 33 },
        { ANSWER("01", "23"), "moteus fault 35: encoder", 35 },
        { ANSWER("01", "00"), "moteus fault 0: unknown fault", 1 },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        enabled();
        hear(rows[i].answer);
        assert_int_equal(seen.state, HAL_DRIVE_FAULT);
        assert_string_equal(seen.fault_text, rows[i].text);
        assert_int_equal(seen.fault_code, rows[i].code);
        fake_can_wipe(&fake);
        hear(rows[i].answer);
        expect("8001#" QUESTIONS); /* nothing clears it by itself */
        hal_drive_request(&drive.turn.drive, HAL_DRIVE_REQUEST_RESET);
        hear(rows[i].answer);
        expect("8001#010000" QUESTIONS "505050");
        hear(ANSWER("00", "00"));
        assert_int_equal(seen.state, HAL_DRIVE_OFF);
    }
}

/* By its watchdog it brakes: mode 0 would let it go.  Where it does not come to
 * rest it is let go all the same. */
static void its_watchdog_brakes_first(void **state)
{
    static const char stands[] =
        "100#21000B2F010000A03F00000000CDCCCC3D230D301F005050";

    (void)state;
    for (int rests = 0; rests < 2; rests++) {
        enabled();
        hear(ANSWER("0B", "00"));
        assert_int_equal(seen.state, HAL_DRIVE_FAULT);
        assert_int_equal(seen.fault_code, 11);
        assert_string_equal(seen.fault_text, "its watchdog ran out (mode 11)");
        for (int i = 0; i < 200; i++) {
            fake_can_wipe(&fake);
            hear(ANSWER("0B", "00"));
            expect("8001#" QUESTIONS);
        }
        for (int i = 0; i < (rests ? 50 : 3000); i++) {
            fake_can_wipe(&fake);
            hear(rests ? stands : ANSWER("0B", "00"));
        }
        expect("8001#010000" QUESTIONS "505050");
    }
}

/* Limited power (96 ...) is no fault while the mode is position. */
static void a_limit_is_no_fault(void **state)
{
    (void)state;
    enabled();
    hear(ANSWER("0A", "63"));
    assert_int_equal(seen.state, HAL_DRIVE_ENABLED);
}

static void answers_that_are_none_are_not_believed(void **state)
{
    static const char *const bad[] = {
        /* NaN, infinite */
        "100#2100002F010000C07F000000BFCDCCCC3D230D301F005050",
        "100#2100002F010000A03F000080FFCDCCCC3D230D301F005050",
        "100#210000505050505050505050",   /* half of it */
        "100#2100002F010000A03F000000BF", /* cut off (FD: 16) */
        "100#0100002F010000A03F000000BFCDCCCC3D230D301F005050", /* a write */
        /* 1e30 turns; 1e30 turns/s */
        "100#2100002F01CAF24971000000BFCDCCCC3D230D301F005050",
        "100#2100002F010000A03FCAF24971CDCCCC3D230D301F005050",
        "100#210000230D301F00", /* not where it is */
        "100#2F8180808080",
        "100#31010121000050505050505050505050", /* an error */
        "100#20FF0050505050505050505050505050", /* 255 values */
    };

    (void)state;
    found();
    for (size_t i = 0; i < ARRAY_LEN(bad); i++) {
        struct hal_can_frame frame = fake_can_parse(bad[i]);

        frame.fd = true;
        fake_can_put_frame(&fake, &frame);
        cycle();
        assert_int_equal(bus.stats.malformed, i + 1);
    }
    assert_int_equal(seen.pos_q32, ONE + ONE / 4);
    assert_int_equal(seen.state, HAL_DRIVE_OFF);
}

static void it_says_what_it_waits_for(void **state)
{
    static const char nan[] =
        "its position is no number (NaN): is its encoder ready?";
    const char *const is_nan =
        "100#2100002F010000C07F000000BFCDCCCC3D230D301F005050";

    (void)state;
    bench_of(&base);
    cycle();
    cycle();
    assert_string_equal(seen.fault_text, "no answer yet");
    hear(is_nan);
    cycle();
    assert_int_equal(seen.state, HAL_DRIVE_OFFLINE);
    assert_string_equal(seen.fault_text, nan);
    hear(ANSWER("01", "21")); /* in fault since before */
    cycle();
    assert_int_equal(seen.state, HAL_DRIVE_FAULT);
    assert_non_null(strstr(seen.fault_text, "moteus fault 33"));
    found();
    assert_string_equal(seen.fault_text, "");
    for (int i = 0; i < 200 && seen.state == HAL_DRIVE_OFF; i++)
        hear(is_nan);
    assert_int_equal(seen.state, HAL_DRIVE_OFFLINE);
    assert_non_null(strstr(seen.fault_text, "is no number (NaN)"));
}

static void whoever_else_commands_is_noticed(void **state)
{
    (void)state;
    found();
    hear("8201#01000A0F2000000040000000");
    assert_int_equal(bus_health, HAL_FIELDBUS_FOREIGN);
    hear("8201#11001F01130D5050505050505050"); /* only asks */
    assert_int_equal(bus_health, HAL_FIELDBUS_GOOD);
    hear("8202#01000A0F2000000040000000"); /* somebody else's drive */
    assert_int_equal(bus_health, HAL_FIELDBUS_GOOD);
}

static void who_is_there(void **state)
{
    struct hal_can_frame frame;
    uint8_t id = 0, mode = 0;

    (void)state;
    fake_can_init(&fake);
    moteus_frame_hello(&frame, 7);
    assert_int_equal(hal_can_send(&fake.can, &frame), 0);
    expect("8007#1100");
    frame = fake_can_parse("700#21000B");
    frame.fd = true;
    assert_true(moteus_frame_is_hello(&frame, &id, &mode));
    assert_int_equal(id, 7);
    assert_int_equal(mode, 11);
    frame = fake_can_parse("701#21000B");
    frame.fd = true;
    assert_false(moteus_frame_is_hello(&frame, &id, &mode));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_asks_until_it_is_answered),
        cmocka_unit_test(it_says_what_it_waits_for),
        cmocka_unit_test(set_points_are_as_mjbots_builds_them),
        cmocka_unit_test(the_demand_goes_on_at_its_velocity),
        cmocka_unit_test(off_is_mode_0_until_it_says_so),
        cmocka_unit_test(a_go_has_limits),
        cmocka_unit_test(faults_in_words),
        cmocka_unit_test(its_watchdog_brakes_first),
        cmocka_unit_test(a_limit_is_no_fault),
        cmocka_unit_test(answers_that_are_none_are_not_believed),
        cmocka_unit_test(whoever_else_commands_is_noticed),
        cmocka_unit_test(who_is_there),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
