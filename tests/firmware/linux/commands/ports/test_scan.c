/* tests/firmware/linux/commands/ports/test_scan.c - slew scan: who is found on
 * simulated buses, and when nothing may be asked. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "tests/support/run_slew.h"

#include <cjson/cJSON.h>

#include "firmware/linux/tools/scan.h"
#include "hal/modbus/pdu.h"
#include "motion/core/err.h"
#include "sim/device/cia402/servo.h"

#define MS INT64_C(1000000)

/* ---- a CAN bus of our own ---- */

static struct sim_world world;
static struct sim_can_bus wire;
static struct sim_can_port ours, theirs;
static struct sim_cia402 servo[3];
static struct rig_bus bus;
static struct hal_can *can;
static struct hal_modbus *slow_line;
static struct bench bench;
static struct scan scan;
static const struct scan_config config = { .listen_ns = 400 * MS,
                                           .first = 1,
                                           .last = 247 };

static int can_bench(void **state)
{
    (void)state;
    sim_world_init(&world, INT64_C(1000000000));
    scan = (struct scan){ .count = 0 };
    memset(&bench, 0, sizeof bench);
    bus = (struct rig_bus){ .kind = RIG_CANOPEN, .name = "can0" };
    bench.rig.bus = &bus;
    bench.rig.bus_count = 1;
    bench.ports.clock = &world.clock;
    if (sim_can_bus_init(&wire, &world, 1000000) < 0)
        return -1;
    sim_can_port_init(&ours, &wire);
    sim_can_port_init(&theirs, &wire);
    can = &ours.can;
    bench.ports.can = &can;
    return 0;
}

static void add_axis(unsigned i, uint8_t node, uint32_t serial, uint8_t axis,
                     struct sim_cia402 *with)
{
    const struct sim_cia402_config drive = {
        .node_id = node,
        .axis = axis,
        .with = with,
        .serial = serial,
        .plant = { .omega_mrad_s = 157080,
                   .zeta_permille = 900,
                   .vel_max_counts_s = 100000,
                   .acc_max_counts_s2 = 100000 },
        .loop_ns = INT64_C(250000),
        .boot_ns = MS,
    };
    assert_int_equal(sim_cia402_init(&servo[i], &wire, &drive), 0);
}

static void add_servo(unsigned i, uint8_t node, uint32_t serial)
{
    add_axis(i, node, serial, 0, NULL);
}

/* Somebody sends; what it was is received before the scan begins to ask. */
static void say(uint32_t id, uint8_t len, const char *data)
{
    struct hal_can_frame frame = { .id = id, .len = len };

    memcpy(frame.data, data, len);
    assert_int_equal(hal_can_send(&theirs.can, &frame), 0);
    assert_int_equal(hal_can_flush(&theirs.can), 0);
    sim_world_run(&world, world.now_ns + MS);
}

static uint64_t sent(void)
{
    struct hal_can_stats stats;

    hal_can_stats(&ours.can, &stats);
    return stats.sent;
}

static void run_can(void)
{
    assert_int_equal(scan_can(&scan, &bench, &config), MOTION_OK);
}

static void every_node_is_found_with_its_identity(void **state)
{
    (void)state;
    add_servo(0, 1, 11);
    add_servo(1, 127, 22);
    run_can();
    assert_int_equal(scan.count, 2);
    assert_int_equal(scan.found[0].id, 1);
    assert_int_equal(scan.found[0].identity.serial, 11);
    assert_int_equal(scan.found[1].id, 127);
    assert_int_equal(scan.found[1].identity.serial, 22);
    assert_string_equal(scan.found[0].name, "slew servo");
    assert_string_equal(scan.found[0].state,
                        "pre-operational, switch on disabled");
    assert_string_equal(scan.found[0].fits, "kind: cia402");
    assert_int_equal(scan.notes, 0);
}

static void every_axis_of_a_node_is_a_row(void **state)
{
    (void)state;
    add_servo(0, 5, 11);
    add_axis(1, 5, 11, 1, &servo[0]);
    add_axis(2, 5, 11, 7, &servo[0]);
    run_can();
    assert_int_equal(scan.count, 3);
    for (unsigned i = 0; i < 3; i++) {
        static const char *const fits[] = { "kind: cia402, axis: 1",
                                            "kind: cia402, axis: 2",
                                            "kind: cia402, axis: 8" };

        assert_int_equal(scan.found[i].id, 5);
        assert_int_equal(scan.found[i].identity.serial, 11);
        assert_string_equal(scan.found[i].name, "slew servo");
        assert_string_equal(scan.found[i].state,
                            "pre-operational, switch on disabled");
        assert_string_equal(scan.found[i].fits, fits[i]);
    }
    assert_int_equal(scan.found[2].axis, 8);
}

static void one_without_number_is_found_too(void **state)
{
    (void)state;
    add_servo(0, 5, 0);
    add_servo(1, 255, 4711);
    run_can();
    assert_int_equal(scan.count, 2);
    assert_int_equal(scan.found[0].id, 5);
    assert_string_equal(scan.found[1].kind, "CANopen, no number");
    assert_int_equal(scan.found[1].identity.serial, 4711);
    assert_string_equal(scan.found[1].fits, "slew drive lss can0 node N");
}

static void nobody_is_nobody(void **state)
{
    (void)state;
    run_can();
    assert_int_equal(scan.count, 0);
    assert_true(sent() > 127);
}

static void a_heartbeat_alone_is_a_node_that_does_not_answer(void **state)
{
    (void)state;
    say(0x70A, 1, "\x05");
    run_can();
    assert_int_equal(scan.count, 1);
    assert_int_equal(scan.found[0].id, 10);
    assert_string_equal(scan.found[0].state, "operational");
    assert_non_null(strstr(scan.found[0].fits, "no answer"));
}

static void beside_another_master_nothing_is_asked(void **state)
{
    (void)state;
    add_servo(0, 3, 0);
    say(0x080, 0, "");
    say(0x703, 1, "\x7F");
    run_can();
    assert_int_equal(sent(), 0);
    assert_int_equal(scan.count, 1);
    assert_int_equal(scan.found[0].id, 3);
    assert_int_equal(scan.notes, 1);
    assert_non_null(strstr(scan.note[0], "another master"));
}

static void beside_an_odrive_nothing_is_asked(void **state)
{
    (void)state;
    for (unsigned i = 0; i < 2; i++) {
        say(0x601, 8, "\0\0\0\0\x01\0\0\0"); /* node 48, idle */
        say(0x021, 8, "\0\0\0\0\x08\0\1\0"); /* node 1, closed loop */
    }
    run_can();
    assert_int_equal(sent(), 0);
    assert_int_equal(scan.count, 2);
    assert_string_equal(scan.found[0].kind, "ODrive");
    assert_int_equal(scan.found[0].id, 1);
    assert_string_equal(scan.found[0].state, "closed loop control");
    assert_int_equal(scan.found[1].id, 48);
    assert_non_null(strstr(scan.note[0], "ODrives"));
}

/* Its trajectory is done from the start, and the controller may have an error. */
static void beside_an_odrive_of_firmware_0_5_nothing_is_asked(void **state)
{
    (void)state;
    for (unsigned i = 0; i < 2; i++) {
        say(0x601, 8, "\0\0\0\0\x01\0\0\x80"); /* node 48, idle */
        say(0x021, 8, "\0\2\0\0\x01\1\1\x81"); /* node 1, in fault */
    }
    run_can();
    assert_int_equal(sent(), 0);
    assert_int_equal(scan.count, 2);
    assert_int_equal(scan.found[0].id, 1);
    assert_int_equal(scan.found[1].id, 48);
    assert_string_equal(scan.found[1].kind, "ODrive");
}

static void what_only_resembles_an_odrive_is_none(void **state)
{
    (void)state;
    say(0x181, 8, "\0\0\0\0\x08\0\1\0"); /* TPDO1 of node 1, which beats */
    say(0x181, 8, "\0\0\0\0\x08\0\1\0");
    say(0x701, 1, "\x05");
    say(0x1A1, 8, "\0\0\0\0\x08\0\1\0"); /* once is not enough */
    say(0x041, 8, "\0\0\0\0\x0F\0\1\0"); /* no such state */
    say(0x041, 8, "\0\0\0\0\x0F\0\1\0");
    say(0x061, 8, "\0\0\0\0\x01\0\0\x40"); /* no such bit */
    say(0x061, 8, "\0\0\0\0\x01\0\0\x40");
    run_can();
    assert_int_equal(scan.count, 1);
    assert_string_equal(scan.found[0].kind, "CANopen");
    assert_true(sent() > 127);
}

/* ---- a Modbus line of our own ---- */

struct fake_line {
    struct hal_modbus modbus;
    struct hal_modbus_request requested;
    struct hal_modbus_stats stats;
    uint32_t tag;
    bool pending;
    unsigned questions;
    const char *identity; /* of unit 3, as bytes after the function code */
    unsigned identity_length;
};
static struct fake_line line;

static int fake_submit(struct hal_modbus *modbus,
                       const struct hal_modbus_request *request, uint32_t tag)
{
    (void)modbus;
    assert_true(modbus_pdu_is_request(request));
    /* only what reads */
    assert_true(request->function == 3 || request->function == 4 ||
                request->function == 0x11 || request->function == 0x2B);
    line.requested = *request;
    line.tag = tag;
    line.pending = true;
    line.questions++;
    return MOTION_OK;
}

static void fake_say(struct hal_modbus_reply *reply, const char *bytes,
                     unsigned length)
{
    uint8_t pdu[MODBUS_PDU_MAX] = { line.requested.function };

    memcpy(pdu + 1, bytes, length);
    modbus_pdu_take_answer(&line.requested, pdu, 1 + length, reply);
}

static int fake_collect(struct hal_modbus *modbus,
                        struct hal_modbus_reply *reply)
{
    const uint8_t function = line.requested.function;

    (void)modbus;
    if (!line.pending)
        return 0;
    line.pending = false;
    *reply =
        (struct hal_modbus_reply){ .tag = line.tag, .err = MOTION_E_TIMEOUT };
    if (line.requested.unit == 3 && function == 3) {
        reply->err = MOTION_OK;
        reply->count = 1;
        reply->value[0] = 6; /* by which leadshine-el7 is recognised */
    } else if (line.requested.unit == 3 && function == 0x2B) {
        fake_say(reply, line.identity, line.identity_length);
    } else if (line.requested.unit == 4 && function == 4) {
        reply->err = MOTION_OK;
    } else if (line.requested.unit == 4 && function == 0x11) {
        fake_say(reply, "\6\1Hello", 7);
    } else if (line.requested.unit == 3 || line.requested.unit == 4) {
        reply->err = MOTION_E_REFUSED;
        reply->exception = 1;
    } else if (line.requested.unit == 9) {
        reply->err = MOTION_E_PROTOCOL;
    }
    return 1;
}

static int fake_is_up(struct hal_modbus *modbus)
{
    (void)modbus;
    return 1;
}

static void fake_stats(struct hal_modbus *modbus,
                       struct hal_modbus_stats *stats)
{
    (void)modbus;
    *stats = line.stats;
}

static const struct hal_modbus_ops fake_ops = { .submit = fake_submit,
                                                .collect = fake_collect,
                                                .is_up = fake_is_up,
                                                .stats = fake_stats };

static int line_bench(void **state)
{
    if (can_bench(state) < 0)
        return -1;
    line = (struct fake_line){ .modbus.ops = &fake_ops };
    line.identity = "\x0E\1\1\0\0\2\0\3Abc\1\2X9";
    line.identity_length = 15;
    can = NULL;
    slow_line = &line.modbus;
    bench.ports.modbus = &slow_line;
    bench.rig.bus[0].kind = RIG_MODBUS_RTU;
    bench.rig.bus[0].modbus.line =
        (struct modbus_rtu_line){ .baud = 9600, .stop_bits = 1 };
    return 0;
}

static void units_are_found_by_any_answer(void **state)
{
    (void)state;
    assert_int_equal(scan_modbus(&scan, &bench, &config), MOTION_OK);
    assert_int_equal(scan.count, 2);
    assert_int_equal(scan.found[0].id, 3);
    assert_string_equal(scan.found[0].name, "Abc X9");
    assert_string_equal(scan.found[0].line, "9600 8E1");
    assert_string_equal(scan.found[0].fits,
                        "kind: modbus, map: leadshine-el7 (perhaps)");
    assert_int_equal(scan.found[1].id, 4);
    assert_string_equal(scan.found[1].name, "Hello");
    assert_string_equal(scan.found[1].fits, "kind: modbus, if a map fits");
    assert_int_equal(scan.notes, 1);
    assert_non_null(strstr(scan.note[0], "unit 9"));
}

static void only_the_units_named_are_asked(void **state)
{
    const struct scan_config few = { .first = 10, .last = 12 };

    (void)state;
    assert_int_equal(scan_modbus(&scan, &bench, &few), MOTION_OK);
    assert_int_equal(line.questions, 3);
    assert_int_equal(scan.count, 0);
}

static void what_its_requests_met_is_noted(void **state)
{
    const struct scan_config few = { .first = 3, .last = 3 };

    (void)state;
    line.stats.echoes = 12;
    line.stats.stray = 1;
    assert_int_equal(scan_modbus(&scan, &bench, &few), MOTION_OK);
    assert_int_equal(scan.notes, 2);
    assert_non_null(strstr(scan.note[0], "9600 8E1: 1 stray byte: "));
    assert_non_null(strstr(scan.note[1], "9600 8E1: 12 echoes: "));
    assert_non_null(strstr(scan.note[1], "expected echo: yes"));
}

/* An identification that says that it is longer than it is. */
static void a_broken_identification_is_cut(void **state)
{
    static const char whole[] = "\x0E\1\1\0\0\3\0\3Abc\1\2X9\2\xFFzz";
    const struct scan_config few = { .first = 3, .last = 3 };

    (void)state;
    line.identity = whole;
    for (unsigned n = 0; n < sizeof whole; n++) {
        scan.count = 0;
        line.identity_length = n;
        assert_int_equal(scan_modbus(&scan, &bench, &few), MOTION_OK);
        assert_int_equal(scan.count, 1);
        assert_string_equal(scan.found[0].name, n >= 15   ? "Abc X9"
                                                : n >= 11 ? "Abc"
                                                          : "");
    }
}

/* ---- the command ---- */

static void the_command_finds_the_drives_of_a_rig(void **state)
{
    (void)state;
    run("scan", "--json", "--units", "1-10", "examples/modbus");
    run_expect(STATUS_OK);
    cJSON *report = cJSON_Parse(run_slew()->out);
    assert_non_null(report);
    const cJSON *found = cJSON_GetObjectItem(report, "found");
    assert_int_equal(cJSON_GetArraySize(found), 4);
    assert_string_equal(
        cJSON_GetObjectItem(cJSON_GetArrayItem(found, 0), "kind")->valuestring,
        "CANopen");
    assert_string_equal(
        cJSON_GetObjectItem(cJSON_GetArrayItem(found, 3), "kind")->valuestring,
        "Modbus");
    cJSON_Delete(report);
    run("scan", "examples/odrive");
    run_expect(STATUS_OK);
    run_says("kind: odrive");
    run_says("idle");
    run_says("2 found");
    run("scan", "--bus", "can1", "examples/modbus");
    run_expect(STATUS_OK);
    run_says("1 found");
    run("scan", "--bus", "line1", "--units", "9", "examples/modbus");
    run_expect(STATUS_REFUSED);
    run_says("0 found");
}

static void wrong_arguments_are_refused(void **state)
{
    static const char *const bad[][2] = {
        { "--units", "0" },       { "--units", "5-3" },
        { "--units", "1-248" },   { "--units", "a" },
        { "--baud", "9600,17" },  { "--baud", "" },
        { "--parity", "mark" },   { "--bus", "nowhere" },
        { "--interface", "a=b" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(bad); i++) {
        run("scan", bad[i][0], bad[i][1], "examples/modbus");
        run_expect(STATUS_INPUT);
    }
    run("scan", "/dev/null.yaml");
    run_expect(STATUS_INPUT);
    run("scan", "host:99999");
    run_expect(STATUS_INPUT);
}

/* A real one, that belongs to somebody else. */
static void a_port_that_is_denied_says_who_may_use_it(void **state)
{
    const int master = posix_openpt(O_RDWR | O_NOCTTY);
    char port[64], want[256];
    (void)state;
    assert_true(master >= 0);
    assert_int_equal(grantpt(master), 0);
    assert_int_equal(unlockpt(master), 0);
    snprintf(port, sizeof port, "%s", ptsname(master));
    assert_int_equal(chmod(port, 0), 0); /* to its owner too */
    run_slew()->as_nobody = true;
    run("scan", "--units", "1", port);
    run_slew()->as_nobody = false;
    close(master);
    run_expect(STATUS_INPUT);
    snprintf(want, sizeof want,
             "bus %s: serial port %s: Permission denied, expected a user with "
             "access to it, such as one in the group dialout\n",
             port, port);
    assert_string_equal(run_slew()->err, want);
}

#define can_test(name)  cmocka_unit_test_setup(name, can_bench)
#define line_test(name) cmocka_unit_test_setup(name, line_bench)

int main(void)
{
    const struct CMUnitTest tests[] = {
        can_test(every_node_is_found_with_its_identity),
        can_test(every_axis_of_a_node_is_a_row),
        can_test(one_without_number_is_found_too),
        can_test(nobody_is_nobody),
        can_test(a_heartbeat_alone_is_a_node_that_does_not_answer),
        can_test(beside_another_master_nothing_is_asked),
        can_test(beside_an_odrive_nothing_is_asked),
        can_test(beside_an_odrive_of_firmware_0_5_nothing_is_asked),
        can_test(what_only_resembles_an_odrive_is_none),
        line_test(units_are_found_by_any_answer),
        line_test(only_the_units_named_are_asked),
        line_test(what_its_requests_met_is_noted),
        line_test(a_broken_identification_is_cut),
        cmocka_unit_test(the_command_finds_the_drives_of_a_rig),
        cmocka_unit_test(wrong_arguments_are_refused),
        cmocka_unit_test(a_port_that_is_denied_says_who_may_use_it),
    };

    return cmocka_run_group_tests(tests, run_open, run_close);
}
