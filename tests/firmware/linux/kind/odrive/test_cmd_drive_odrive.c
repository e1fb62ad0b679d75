/* tests/firmware/linux/kind/odrive/test_cmd_drive_odrive.c - slew drive on an
 * ODrive: what it says of it, what it writes and what it refuses to write, how a
 * fault is cleared. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "firmware/linux/base/disk.h"
#include "sim/device/odrive/servo.h"
#include "tests/support/kind/drives.h"
#include "tests/support/run_slew.h"

#include <math.h>

#include "firmware/host/device/endpoints.h"
#include "firmware/host/kind/odrive/quantity.h"
#include "firmware/linux/tools/reset.h"
#include "motion/core/err.h"

#define RIG "examples/odrive"

/* Of the slider; simulated. */
static struct session *opened(const char *axis)
{
    static struct session session;
    char message[YAML_MESSAGE_MAX];
    const struct session_config config = { .target = RIG, .who = axis };

    if (session_open(&session, &config, message) < 0)
        fail_msg("%s", message);
    return &session;
}

static struct session *opened_05(void)
{
    static struct session session;
    char message[YAML_MESSAGE_MAX];

    run_put("rig.yaml",
            "buses:\n"
            "  can0: {kind: can, bit_rate: 1 Mbit/s}\n"
            "axes:\n"
            "  slider:\n"
            "    unit: mm\n"
            "    limits: {position: [0, 900], velocity: 250, acceleration: "
            "400}\n"
            "    following_error: {floor: 2}\n"
            "    drive: {kind: odrive, bus: can0, node: 9, turns: 0.125 per "
            "mm, unsupervised: yes}\n");
    const struct session_config config = { .target = run_path("rig.yaml"),
                                           .who = "slider" };

    if (session_open(&session, &config, message) < 0)
        fail_msg("%s", message);
    return &session;
}

/* ---- values ---- */

static void values_are_read_as_their_type_says(void **state)
{
    static const struct {
        enum quantity_type type;
        const char *text;
        uint32_t raw;
        int64_t value;
    } row[] = {
        { QUANTITY_BOOL, "true", 1, 1 },
        { QUANTITY_BOOL, "0", 0, 0 },
        { QUANTITY_U8, "255", 255, 255 },
        { QUANTITY_I8, "-128", 0xFFFFFF80, -128 },
        { QUANTITY_I16, "-0x10", 0xFFFFFFF0, -16 },
        { QUANTITY_U32, "4294967295", UINT32_MAX, UINT32_MAX },
        { QUANTITY_I32, "-2147483648", 0x80000000, INT32_MIN },
        { QUANTITY_F32, "-0.5", 0xBF000000, 0xBF000000 },
    };
    static const struct {
        enum quantity_type type;
        const char *text;
    } bad[] = { { QUANTITY_BOOL, "2" },        { QUANTITY_BOOL, "yes" },
                { QUANTITY_U8, "256" },        { QUANTITY_U8, "-1" },
                { QUANTITY_I8, "128" },        { QUANTITY_U16, "" },
                { QUANTITY_U32, "0.5" },       { QUANTITY_U32, "4294967296" },
                { QUANTITY_F32, "nan" },       { QUANTITY_F32, "1e99" },
                { QUANTITY_F32, "0.5 Nm" },    { QUANTITY_F32, "" },
                { QUANTITY_I32, "2147483648" } };
    char message[QUANTITY_MESSAGE_MAX];
    uint32_t raw;

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        const struct quantity quantity = { .type = row[i].type };

        if (quantity_parse(&quantity, row[i].text, &raw, message) < 0)
            fail_msg("%s", message);
        assert_int_equal(raw, row[i].raw);
        assert_int_equal(quantity_value(row[i].type, raw), row[i].value);
    }
    for (size_t i = 0; i < ARRAY_LEN(bad); i++) {
        const struct quantity quantity = { .type = bad[i].type };

        if (quantity_parse(&quantity, bad[i].text, &raw, message) == 0)
            fail_msg("%s was taken", bad[i].text);
        assert_non_null(strstr(message, "is not a value, expected"));
    }
}

static void no_name_stands_for_two(void **state)
{
    const struct quantity *list[2];
    unsigned count[2];

    (void)state;
    list[0] = quantity_of_odrive(false, &count[0]);
    list[1] = quantity_of_odrive(true, &count[1]);
    for (unsigned i = 0; i < 2; i++)
        for (unsigned k = 0; k < count[i]; k++)
            assert_ptr_equal(quantity_find(list[i][k].name, list[i], count[i]),
                             &list[i][k]);
    assert_ptr_equal(quantity_find("Bus_Voltage", list[0], count[0]),
                     quantity_find("bus voltage", list[0], count[0]));
    assert_null(quantity_find("bus volt", list[0], count[0]));
}

/* ---- info, get ---- */

static void an_odrive_says_who_and_how_it_is(void **state)
{
    (void)state;
    run("drive", "info", RIG, "slider");
    run_expect(0);
    run_says("0.6.9, hardware 4.4 variant 58");
    run_says("idle");
    run_says("12.5  turns    100 mm");
    run_says("FET temperature");
    run("drive", "info", RIG, "slider", "--json");
    run_expect(0);
    run_says("\"ok\":\ttrue");
    run_says("\"value\":\t31.5");
}

static void firmware_05_is_asked_for_what_it_has(void **state)
{
    struct session *session = opened_05();
    struct turn_client_state seen;
    unsigned count = 0;

    (void)state;
    assert_int_equal(turn_client_hello(&session->turn), MOTION_OK);
    assert_true(session->turn.is_05);
    (void)quantity_of_odrive(true, &count);
    assert_true(count > 0);
    sim_servo_inject(&SERVO_OF(sim_odrive, &session->bench.sim, 0)->base,
                     SIM_SERVO_TRIP);
    assert_int_equal(turn_client_state(&session->turn, &seen), MOTION_OK);
    assert_int_equal(seen.error, 0);
    assert_true(seen.is_fault);
    session_close(session);
    run("drive", "info", run_path("rig.yaml"), "slider");
    run_expect(0);
    run_says("0.5, as it does not answer");
    run_says("encoder error");
    run("drive", "get", run_path("rig.yaml"), "slider", "axis0.error");
    run_expect(2);
    run("drive", "get", run_path("rig.yaml"), "slider", "190", "--type", "u8");
    run_expect(2);
    run_complains("firmware 0.5 has no endpoints");
}

/* ---- endpoints ---- */

static void endpoints_have_names_types_and_a_firmware(void **state)
{
    char path[256];

    (void)state;
    run("drive", "get", RIG, "slider", "axis0.config.watchdog_timeout");
    run_expect(0);
    run_says("191");
    run("drive", "set", RIG, "slider", "axis0.config.watchdog_timeout=0.25");
    run_expect(0);
    run_says("0.25");
    run("drive", "set", RIG, "slider", "axis0.config.enable_watchdog", "true");
    run_expect(0);
    run("drive", "set", RIG, "slider", "191", "0.125", "--type", "f32");
    run_expect(0);
    run_says("0.125");
    run_put("other.json",
            "{\"fw_version\": \"0.6.10\", \"endpoints\": {\"axis0.config."
            "watchdog_timeout\": {\"id\": 191, \"type\": \"float\"}}}");
    snprintf(path, sizeof path, "%s", run_path("other.json"));
    run("drive", "get", RIG, "slider", "axis0.config.watchdog_timeout",
        "--endpoints", path);
    run_expect(2);
    run_complains("those of firmware 0.6.10, the drive has 0.6.9");
    run_put("other.json",
            "{\"fw_version\": \"0.6.9\", \"endpoints\": {\"a.b\": {\"id\": "
            "7, \"type\": \"uint64\"}, \"a.c\": {\"id\": 0, \"type\": "
            "\"bool\"}, \"a.d\": {\"id\": 191, \"type\": \"float\", "
            "\"access\": \"r\"}}}");
    run("drive", "get", RIG, "slider", "a.b", "--endpoints", path);
    run_expect(2);
    run_complains("not a number of 32 bits or fewer");
    run("drive", "get", RIG, "slider", "a.c", "--endpoints", path);
    run_expect(2);
    run_complains("'a.c' is no endpoint");
    run("drive", "set", RIG, "slider", "a.d", "1", "--endpoints", path);
    run_expect(2);
    run_complains("for reading only");
}

static void versions_of_lists_are_numbers(void **state)
{
    static const struct {
        const char *text;
        bool fits;
    } row[] = { { "0.6.9", true }, { "0.6.9-1", true }, { "0.6", false },
                { "0.6.", false }, { "", false },       { "0.6.256", false },
                { "a.b.c", false } };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        char json[64];
        uint8_t version[3];
        struct cJSON *list;

        snprintf(json, sizeof json, "{\"fw_version\": \"%s\"}", row[i].text);
        run_put("list.json", json);
        list = endpoints_open(&disk_files, run_path("list.json"));
        assert_non_null(list);
        assert_int_equal(endpoints_version(list, version), row[i].fits);
        endpoints_close(list);
    }
    assert_null(endpoints_open(&disk_files, run_path("none.json")));
}

/* ---- set ---- */

static void what_moves_or_is_only_said_is_not_written(void **state)
{
    (void)state;
    run("drive", "set", RIG, "slider", "position", "1");
    run_expect(2);
    run_complains("for reading only");
    run("drive", "store", RIG, "slider");
    run_expect(2);
    run_complains("save_configuration");
}

static void with_torque_nothing_is_written(void **state)
{
    struct session *session = opened("slider");

    (void)state;
    assert_int_equal(turn_client_hello(&session->turn), MOTION_OK);
    assert_int_equal(session_is_enabled(session), 0);
    SERVO_OF(sim_odrive, &session->bench.sim, 0)->axis_state = 8;
    assert_int_equal(session_is_enabled(session), 1);
    session_close(session);
}

/* ---- reset ---- */

static void faults_are_said_and_cleared(void **state)
{
    struct session *session = opened("slider");
    struct reset reset;

    (void)state;
    sim_servo_inject(&SERVO_OF(sim_odrive, &session->bench.sim, 0)->base,
                     SIM_SERVO_TRIP);
    assert_int_equal(reset_drive(session, &reset), MOTION_OK);
    assert_true(reset.was_fault);
    assert_false(reset.is_fault);
    assert_string_equal(reset.reason, "error 0x00001000: current limit");
    assert_string_equal(reset.state, "idle");
    session_close(session);
}

static void a_fault_that_lasts_is_said_to_last(void **state)
{
    struct session *session = opened("slider");
    struct reset reset;

    (void)state;
    sim_servo_inject(&SERVO_OF(sim_odrive, &session->bench.sim, 0)->base,
                     SIM_SERVO_ENCODER);
    assert_int_equal(reset_drive(session, &reset), MOTION_OK);
    assert_true(reset.was_fault && reset.is_fault);
    assert_string_equal(reset.reason, "error 0x00000008: missing estimate");
    session_close(session);

    session = opened_05();
    sim_servo_inject(&SERVO_OF(sim_odrive, &session->bench.sim, 0)->base,
                     SIM_SERVO_ENCODER);
    assert_int_equal(reset_drive(session, &reset), MOTION_OK);
    assert_true(reset.was_fault && reset.is_fault);
    assert_string_equal(
        reset.reason, "error 0x00000100: encoder failed, error of its encoder");
    session_close(session);
}

static void a_drive_that_is_silent_is_said_to_be(void **state)
{
    (void)state;
    run("drive", "info", RIG, "5", "--bus", "can0");
    run_expect(1);
    run_complains("node 5 does not answer");
    run("drive", "info", RIG, "63", "--bus", "can0");
    run_expect(2);
    run_complains("expected 0 .. 62");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_are_read_as_their_type_says),
        cmocka_unit_test(no_name_stands_for_two),
        cmocka_unit_test(an_odrive_says_who_and_how_it_is),
        cmocka_unit_test(firmware_05_is_asked_for_what_it_has),
        cmocka_unit_test(endpoints_have_names_types_and_a_firmware),
        cmocka_unit_test(versions_of_lists_are_numbers),
        cmocka_unit_test(what_moves_or_is_only_said_is_not_written),
        cmocka_unit_test(with_torque_nothing_is_written),
        cmocka_unit_test(faults_are_said_and_cleared),
        cmocka_unit_test(a_fault_that_lasts_is_said_to_last),
        cmocka_unit_test(a_drive_that_is_silent_is_said_to_be),
    };

    return cmocka_run_group_tests_name("drive_odrive", tests, run_open,
                                       run_close);
}
