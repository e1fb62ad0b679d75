/* tests/firmware/linux/commands/drive/test_cmd_drive.c - slew drive: what it says of
 * a drive, what it writes and what it refuses to write, how a fault is
 * cleared. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "firmware/linux/base/disk.h"
#include "sim/device/cia402/servo.h"
#include "sim/device/modbus/servo.h"
#include "tests/firmware/linux/machine/two_drives.h"

#include <cjson/cJSON.h>

#include "firmware/host/device/object.h"
#include "firmware/linux/tools/lss.h"
#include "firmware/linux/tools/reset.h"
#include "motion/core/err.h"
#include "tests/support/kind/drives.h"

static char rig[96], eds[96];

static int bench(void **state)
{
    if (run_open(state) < 0 || two_drives_put_sheet() < 0)
        return -1;
    two_drives_put("", 10, "");
    snprintf(rig, sizeof rig, "%s", run_path("rig.yaml"));
    snprintf(eds, sizeof eds, "%s", run_path("servo.eds"));
    return 0;
}

static struct session *opened(const char *axis)
{
    static struct session session;
    char message[YAML_MESSAGE_MAX];
    const struct session_config config = { .target = rig, .who = axis };

    if (session_open(&session, &config, message) < 0)
        fail_msg("%s", message);
    return &session;
}

static int64_t json_value(unsigned row)
{
    cJSON *report = cJSON_Parse(run_slew()->out);
    assert_non_null(report);
    const cJSON *values = cJSON_GetObjectItem(report, "values");
    const cJSON *value =
        cJSON_GetObjectItem(cJSON_GetArrayItem(values, (int)row), "value");
    assert_true(cJSON_IsNumber(value));
    const int64_t number = (int64_t)value->valuedouble;
    cJSON_Delete(report);
    return number;
}

/* ---- objects ---- */

static void objects_are_found_by_number_and_by_name(void **state)
{
    static const struct {
        const char *text;
        uint16_t index;
        uint8_t sub, type;
    } row[] = {
        { "6041", 0x6041, 0, OBJECT_U16 },
        { "0x607d:2", 0x607D, 2, OBJECT_I32 },
        { "607Dsub1", 0x607D, 1, OBJECT_I32 },
        { "1600:A", 0x1600, 10, OBJECT_UNKNOWN },
        { "statusword", 0x6041, 0, OBJECT_U16 },
        { "following_error-Window", 0x6065, 0, OBJECT_U32 },
        { "2345:FF", 0x2345, 255, OBJECT_UNKNOWN },
    };
    static const char *const bad[] = { "604",     "60411", "6041:",  "6041:100",
                                       "6041sub", "",      "status", "6041:0x1",
                                       "0x",      "-6041" };
    char message[OBJECT_MESSAGE_MAX];
    struct object object;

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        if (object_find(row[i].text, NULL, &object, message) < 0)
            fail_msg("%s: %s", row[i].text, message);
        assert_int_equal(object.index, row[i].index);
        assert_int_equal(object.sub, row[i].sub);
        assert_int_equal(object.type, row[i].type);
    }
    for (size_t i = 0; i < ARRAY_LEN(bad); i++) {
        assert_int_equal(object_find(bad[i], NULL, &object, message), -1);
        assert_non_null(strstr(message, "is not an object of this drive"));
    }
    assert_int_equal(object_find("statuswort", NULL, &object, message), -1);
    assert_non_null(strstr(message, "did you mean 'Statusword'"));
}

static void the_list_of_objects_is_in_order_and_has_no_name_twice(void **state)
{
    (void)state;
    for (unsigned i = 0; i < object_list_count; i++)
        for (unsigned k = 0; k < i; k++) {
            assert_false(object_list[i].index == object_list[k].index &&
                         object_list[i].sub == object_list[k].sub);
            assert_string_not_equal(object_list[i].name, object_list[k].name);
        }
}

static void values_are_signed_as_their_type_says(void **state)
{
    (void)state;
    assert_int_equal(object_value(OBJECT_I8, 1, 0xFF), -1);
    assert_int_equal(object_value(OBJECT_I16, 2, 0x8000), INT16_MIN);
    assert_int_equal(object_value(OBJECT_I32, 4, 0x80000000u), INT32_MIN);
    assert_int_equal(object_value(OBJECT_U8, 1, 0xFF), 255);
    assert_int_equal(object_value(OBJECT_U32, 4, 0xFFFFFFFFu), UINT32_MAX);
    assert_int_equal(object_value(OBJECT_UNKNOWN, 2, 0xFFFF), 65535);
    assert_int_equal(object_value(OBJECT_UNKNOWN, 0, 0), 0);
    /* a drive that sends more than its type has */
    assert_int_equal(object_value(OBJECT_I8, 4, 0x000000FE), -2);
}

static void limits_of_the_data_sheet_are_kept(void **state)
{
    static struct eds sheet;
    char message[EDS_MESSAGE_MAX], path[96];
    struct object object;
    int64_t value;

    (void)state;
    run_put("limits.eds",
            "[6086]\nParameterName=Profile type\nDataType=3\nAccessType=rw\n"
            "LowLimit=0xFFFE\nHighLimit=3\n"
            "[2000]\nParameterName=Fixed\nDataType=5\nAccessType=ro\n"
            "[2001]\nParameterName=Same\nDataType=5\nAccessType=rw\n"
            "[2002]\nParameterName=same\nDataType=5\nAccessType=rw\n");
    snprintf(path, sizeof path, "%s", run_path("limits.eds"));
    assert_int_equal(eds_load(&disk_files, path, &sheet, message), 0);
    assert_int_equal(object_find("profile_type", &sheet, &object, message), 0);
    assert_int_equal(object_parse(&object, "-2", &value, message), 0);
    assert_int_equal(value, -2);
    assert_int_equal(object_parse(&object, "0x3", &value, message), 0);
    assert_int_equal(object_parse(&object, "4", &value, message), -1);
    assert_non_null(strstr(message, "expected -2 .. 3"));
    assert_int_equal(object_parse(&object, "-3", &value, message), -1);
    assert_int_equal(object_parse(&object, "1.5", &value, message), -1);
    assert_int_equal(object_parse(&object, "", &value, message), -1);
    assert_int_equal(
        object_parse(&object, "99999999999999999999", &value, message), -1);
    assert_int_equal(object_find("2000", &sheet, &object, message), 0);
    assert_int_equal(object_parse(&object, "1", &value, message), -1);
    assert_non_null(strstr(message, "cannot be written"));
    assert_int_equal(object_find("SAME", &sheet, &object, message), -1);
    assert_non_null(strstr(message, "is the name of 2 objects"));
    eds_free(&sheet);
}

/* ---- get, set ---- */

static void info_says_who_it_is(void **state)
{
    (void)state;
    run("drive", "info", rig, "slide");
    run_expect(STATUS_OK);
    run_says("slide (node 3 on can0)");
    run_says("slew servo");
    run_says("CiA 402, servo drive");
    run_says("switch on disabled");
    run_says("10 mm");
    run_says("it has what slew needs");
    run("drive", "info", rig, "turn");
    run_expect(STATUS_OK);
    run_says("unit 7 on line");
    run_says("position");
    run("drive", "info", eds);
    run_expect(STATUS_OK);
    run_says("this drive will do");
}

static void get_reads_by_number_and_by_name_with_unit(void **state)
{
    (void)state;
    run("drive", "get", "--json", "--eds", eds, rig, "slide", "6064",
        "DEVICE_TYPE", "1018:2");
    run_expect(STATUS_OK);
    assert_int_equal(json_value(0), 40960);
    assert_int_equal(json_value(1), 0x20192);
    assert_int_equal(json_value(2), 402);
    run_says("\"unit\":\t\"counts\"");
    run("drive", "get", rig, "slide", "6064", "2F00");
    run_expect(STATUS_REFUSED);
    run_says("no such object (0x06020000)");
    run_says("40960");
    run("drive", "get", "--json", rig, "turn", "position", "0x602C");
    run_expect(STATUS_OK);
    assert_int_equal(json_value(0), 0);
    run("drive", "get", rig, "turn", "0x7777");
    run_expect(STATUS_REFUSED);
    run_says("illegal data address (exception 2)");
}

static void what_is_not_there_is_said(void **state)
{
    (void)state;
    run("drive", "get", rig, "nobody", "6041");
    run_expect(STATUS_INPUT);
    run_complains("'nobody' is neither an axis of the rig nor a node number");
    run("drive", "get", rig, "--bus", "can0", "9", "6041");
    run_expect(STATUS_REFUSED);
    run_says("node 9 does not answer");
    run("drive", "get", rig, "--bus", "line", "9", "0x1000");
    run_expect(STATUS_REFUSED);
    run_says("unit 9 does not answer");
    run("drive", "get", rig, "9", "6041");
    run_expect(STATUS_INPUT);
    run_complains("--bus NAME");
    run("drive", "get", "nosuchcan", "9", "6041");
    run_expect(STATUS_INPUT);
    run_complains("neither a rig nor a CAN interface");
    run("drive", "get", "127.0.0.1:0", "9", "6041");
    run_expect(STATUS_INPUT);
    run("drive", "look", rig, "slide");
    run_expect(STATUS_INPUT);
    run_complains("expected info, get, set, store, reset or lss");
    run("drive", "set", rig, "slide", "6065");
    run_expect(STATUS_INPUT);
    run("drive", "get", rig, "slide");
    run_expect(STATUS_INPUT);
    run("drive", "get", "--baud", "12345", "/dev/null", "1", "0");
    run_expect(STATUS_INPUT);
    run_complains("--baud");
}

static void set_writes_and_reads_back(void **state)
{
    (void)state;
    run("drive", "set", "--json", rig, "slide", "6065", "20000");
    run_expect(STATUS_OK);
    assert_int_equal(json_value(0), 20000);
    run("drive", "set", "--json", rig, "slide", "607D:1=-2000");
    run_expect(STATUS_OK);
    assert_int_equal(json_value(0), -2000);
    run("drive", "set", "--store", rig, "slide", "6065", "20000");
    run_expect(STATUS_OK);
    run("drive", "set", rig, "slide", "6041", "1");
    run_expect(STATUS_REFUSED);
    run_complains("read-only object (0x06010002)");
    run("drive", "set", "--eds", eds, rig, "slide", "6041", "1");
    run_expect(STATUS_INPUT);
    run_complains("cannot be written: it is read-only in the data sheet");
    run("drive", "set", rig, "slide", "6066", "70000");
    run_expect(STATUS_INPUT);
    run_complains("expected 0 .. 65535");
    run("drive", "set", rig, "slide", "6040", "15");
    run_expect(STATUS_INPUT);
    run_complains("moves drives");
    run("drive", "store", rig, "slide");
    run_expect(STATUS_OK);
    run_says("stored");
    run("drive", "set", rig, "turn", "mode", "7");
    run_expect(STATUS_INPUT);
    run_complains("--yes");
    run("drive", "set", "--yes", rig, "turn", "mode", "6");
    run_expect(STATUS_OK);
    run("drive", "set", "--yes", rig, "turn", "mode", "70000");
    run_expect(STATUS_INPUT);
    run_complains("0 .. 65535");
}

static void enable(struct session *session)
{
    static const uint16_t word[] = { 0x06, 0x07, 0x0F };
    uint32_t status = 0;

    assert_int_equal(
        canopen_client_write_number(&session->can, 0x6060, 0, 1, 8), 0);
    for (unsigned i = 0; i < 3; i++) {
        assert_int_equal(
            canopen_client_write_number(&session->can, 0x6040, 0, 2, word[i]),
            0);
        canopen_client_wait(&session->can, INT64_C(200000000));
    }
    assert_int_equal(
        canopen_client_read_number(&session->can, 0x6041, 0, &status, NULL), 0);
    assert_int_equal(status & 0x6F, 0x27);
}

static void a_drive_with_torque_is_known_as_such(void **state)
{
    struct session *session = opened("slide");

    (void)state;
    assert_int_equal(session_is_enabled(session), 0);
    enable(session);
    assert_int_equal(session_is_enabled(session), 1);
    session_close(session);
}

static void stored_values_outlive_power_off(void **state)
{
    struct session *session = opened("slide");
    struct sim_cia402 *servo = SERVO_OF(sim_cia402, &session->bench.sim, 0);
    uint32_t value = 0;

    (void)state;
    assert_int_equal(
        canopen_client_write_number(&session->can, 0x6065, 0, 4, 1111), 0);
    assert_int_equal(
        canopen_client_write_number(&session->can, 0x1010, 1, 4, 1),
        MOTION_E_REFUSED);
    assert_int_equal(session->can.abort_code, 0x08000020);
    assert_int_equal(
        canopen_client_write_number(&session->can, 0x1010, 1, 4, 0x65766173),
        0);
    assert_int_equal(
        canopen_client_write_number(&session->can, 0x6065, 0, 4, 2222), 0);
    sim_cia402_inject(servo, SIM_CIA402_REBOOT);
    canopen_client_wait(&session->can, INT64_C(400000000));
    assert_int_equal(
        canopen_client_read_number(&session->can, 0x6065, 0, &value, NULL), 0);
    assert_int_equal(value, 1111);
    session_close(session);
}

/* ---- reset ---- */

static void a_fault_is_explained_and_cleared_and_leaves_it_off(void **state)
{
    struct session *session = opened("slide");
    struct sim_cia402 *servo = SERVO_OF(sim_cia402, &session->bench.sim, 0);
    struct reset reset;

    (void)state;
    assert_int_equal(reset_drive(session, &reset), MOTION_OK);
    assert_false(reset.was_fault);
    assert_string_equal(reset.reason, "");
    enable(session);
    sim_cia402_inject(servo, SIM_CIA402_OVERCURRENT);
    canopen_client_wait(&session->can, INT64_C(200000000));
    assert_int_equal(reset_drive(session, &reset), MOTION_OK);
    assert_true(reset.was_fault);
    assert_false(reset.is_fault);
    assert_string_equal(reset.reason, "error 0x2310: current, output side");
    assert_string_equal(reset.state, "switch on disabled");
    assert_int_equal(session_is_enabled(session), 0);
    sim_cia402_inject(servo, SIM_CIA402_SILENT);
    assert_int_equal(reset_drive(session, &reset), MOTION_E_TIMEOUT);
    session_close(session);
}

static void an_alarm_is_explained_and_cleared(void **state)
{
    struct session *session = opened("turn");
    struct sim_modbus_servo *servo =
        SERVO_OF(sim_modbus_servo, &session->bench.sim, 0);
    struct reset reset;

    (void)state;
    assert_int_equal(reset_drive(session, &reset), MOTION_OK);
    assert_false(reset.was_fault);
    sim_modbus_servo_inject(servo, SIM_MODBUS_SERVO_ALARM);
    assert_int_equal(reset_drive(session, &reset), MOTION_OK);
    assert_true(reset.was_fault);
    assert_false(reset.is_fault);
    assert_non_null(strstr(reset.reason, session->map->alarms[0].text));
    sim_modbus_servo_inject(servo, SIM_MODBUS_SERVO_OFF);
    assert_int_equal(reset_drive(session, &reset), MOTION_E_TIMEOUT);
    session_close(session);
}

static void reset_without_a_fault_writes_nothing(void **state)
{
    (void)state;
    run("drive", "reset", rig, "slide");
    run_expect(STATUS_OK);
    run_says("no fault, switch on disabled; nothing was written");
    run("drive", "reset", "--json", rig, "turn");
    run_expect(STATUS_OK);
    run_says("\"was_fault\":\tfalse");
}

/* ---- LSS ---- */

static void a_device_without_number_gets_one(void **state)
{
    static struct sim_world world;
    static struct sim_can_bus wire;
    static struct sim_can_port port;
    static struct sim_cia402 servo;
    static struct canopen_client client;
    const struct sim_cia402_config config = {
        .node_id = 255,
        .serial = 4711,
        .plant = { .omega_mrad_s = 157080,
                   .zeta_permille = 900,
                   .vel_max_counts_s = 100000,
                   .acc_max_counts_s2 = 100000 },
        .loop_ns = INT64_C(250000),
        .boot_ns = INT64_C(1000000),
    };
    struct canopen_identity found = { 0 }, other = { 0, 402, 0x10000, 1 };
    uint32_t value = 0;

    (void)state;
    sim_world_init(&world, INT64_C(1000000000));
    assert_int_equal(sim_can_bus_init(&wire, &world, 1000000), 0);
    sim_can_port_init(&port, &wire);
    assert_int_equal(sim_cia402_init(&servo, &wire, &config), 0);
    canopen_client_init(&client, &port.can, &world.clock, 0);
    canopen_client_wait(&client, INT64_C(10000000));
    assert_int_equal(lss_select(&client, &other, &found), MOTION_E_TIMEOUT);
    assert_int_equal(lss_select(&client, NULL, &found), MOTION_OK);
    assert_int_equal(found.product, 402);
    assert_int_equal(found.serial, 4711);
    assert_int_equal(lss_bit_rate(&client, 123), MOTION_E_ARG);
    assert_int_equal(lss_node(&client, 42), MOTION_OK);
    assert_int_equal(lss_store(&client), MOTION_OK);
    lss_release(&client);
    canopen_client_wait(&client, INT64_C(100000000));
    assert_int_equal(canopen_client_node(&client, 42), 0);
    assert_int_equal(
        canopen_client_read_number(&client, 0x1000, 0, &value, NULL), 0);
    assert_int_equal(lss_select(&client, NULL, &found), MOTION_E_TIMEOUT);
    assert_int_equal(lss_select(&client, &found, &found), MOTION_OK);
    lss_release(&client);
}

static void identities_are_four_numbers(void **state)
{
    struct canopen_identity identity;

    (void)state;
    assert_true(lss_identity("0x2E,402,0x10000,7", &identity));
    assert_int_equal(identity.vendor, 0x2E);
    assert_int_equal(identity.serial, 7);
    assert_false(lss_identity("1,2,3", &identity));
    assert_false(lss_identity("1,2,3,4,5", &identity));
    assert_false(lss_identity("1,2,3,x", &identity));
    assert_false(lss_identity("1,2,3,0x100000000", &identity));
    assert_false(lss_identity("", &identity));
    run("drive", "lss", rig, "--bus", "can0", "scan");
    run_expect(STATUS_REFUSED);
    run_complains("no device without node number");
    run("drive", "lss", rig, "--bus", "can0", "--json", "scan", "--identity",
        "0,402,0x10000,3");
    run_expect(STATUS_OK);
    run_says("\"serial\":\t3");
    run("drive", "lss", rig, "--bus", "can0", "node", "5", "--identity",
        "0,402,0x10000,3", "--store");
    run_expect(STATUS_OK);
    run_says("node 5 now, and it answers");
    run_says("stored");
    run("drive", "lss", rig, "--bus", "can0", "rate", "7", "--identity",
        "0,402,0x10000,3");
    run_expect(STATUS_INPUT);
    run("drive", "lss", rig, "--bus", "line", "scan");
    run_expect(STATUS_INPUT);
    run_complains("is no CAN bus");
    run("drive", "lss", rig, "--bus", "can0", "node", "200");
    run_expect(STATUS_INPUT);
}

#define drive_test(name) cmocka_unit_test_setup_teardown(name, bench, run_close)

int main(void)
{
    const struct CMUnitTest tests[] = {
        drive_test(objects_are_found_by_number_and_by_name),
        drive_test(the_list_of_objects_is_in_order_and_has_no_name_twice),
        drive_test(values_are_signed_as_their_type_says),
        drive_test(limits_of_the_data_sheet_are_kept),
        drive_test(info_says_who_it_is),
        drive_test(get_reads_by_number_and_by_name_with_unit),
        drive_test(what_is_not_there_is_said),
        drive_test(set_writes_and_reads_back),
        drive_test(a_drive_with_torque_is_known_as_such),
        drive_test(stored_values_outlive_power_off),
        drive_test(a_fault_is_explained_and_cleared_and_leaves_it_off),
        drive_test(an_alarm_is_explained_and_cleared),
        drive_test(reset_without_a_fault_writes_nothing),
        drive_test(a_device_without_number_gets_one),
        drive_test(identities_are_four_numbers),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
