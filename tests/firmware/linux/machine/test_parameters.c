/* tests/firmware/linux/machine/test_parameters.c - what a rig sets its drives
 * to: judged by the data sheet, written at start-up, read back. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "firmware/linux/base/disk.h"
#include "sim/device/cia402/servo.h"
#include "sim/device/modbus/servo.h"
#include "tests/firmware/linux/machine/two_drives.h"

#include "firmware/linux/machine/machine.h"
#include "firmware/linux/machine/machine_sim.h"
#include "motion/core/err.h"
#include "sim/device/cia402/parts.h"
#include "tests/support/kind/drives.h"

static struct rig rig;
static struct machine machine;
static struct machine_sim sim;
static char message[YAML_MESSAGE_MAX];

static int load(const char *of_slide, const char *of_turn)
{
    char path[96];

    two_drives_put(of_slide, 0, of_turn);
    snprintf(path, sizeof path, "%s", run_path("rig.yaml"));
    return rig_load(&disk_files, path, &rig, message);
}

static int bench(void **state)
{
    if (run_open(state) < 0 || two_drives_put_sheet() < 0)
        return -1;
    run_put("poor.eds", "[1000]\nDataType=7\nAccessType=ro\n");
    return 0;
}

/* ---- the data sheet ---- */

/* That of the simulated servo without one section. */
static void put_eds_without(const char *section)
{
    static char text[1 << 18];
    char path[96], head[32];
    char *from, *to;
    FILE *file;

    snprintf(path, sizeof path, "%s", run_path("servo.eds"));
    file = fopen(path, "rb");
    assert_non_null(file);
    text[fread(text, 1, sizeof text - 1, file)] = '\0';
    fclose(file);
    snprintf(head, sizeof head, "\n[%s]", section);
    from = strstr(text, head);
    if (from == NULL)
        fail_msg("no section %s", section);
    to = from == NULL ? NULL : strstr(from + 2, "\n[");
    assert_non_null(to);
    memmove(from, to, strlen(to) + 1);
    run_put("less.eds", text);
}

/* Each is missed by who uses it, and by nobody else. */
static void what_is_used_of_a_drive_must_be_there(void **state)
{
    static const struct {
        const char *section, *use, *want;
    } row[] = {
        { "60C1sub1", ", mode: ip",
          "60C1:1 not there (target position of IP)" },
        { "60FF", ", mode: csv, bandwidth: 5 Hz",
          "60FF:0 not there (target velocity)" },
        { "1401sub1", ", mode: csv, bandwidth: 5 Hz",
          "1401:1 not there (speeds in a second PDO)" },
        { "100C", ", guarding: 20 ms", "100C:0 not there (its guard time)" },
        { "605D", ", options: {halt: 1}",
          "605D:0 not there (what a halt does)" },
        { "6098", "}\n    homing: {by: drive, method: 17",
          "6098:0 not there (homing method)" },
        { "6099sub2", "}\n    homing: {by: drive, method: 17",
          "6099:2 not there (speed at the switch)" },
    };
    static const char *const always[] = { "6065", "6085", "6064", "1016sub1" };
    static const char *const never[] = { "60B8", "607Dsub1", "60FD", "6091sub1",
                                         "60B2" };
    char of_slide[160];

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        put_eds_without(row[i].section);
        if (load(", eds: less.eds", "") < 0)
            fail_msg("%s", message);
        snprintf(of_slide, sizeof of_slide, ", eds: less.eds%s", row[i].use);
        assert_int_equal(load(of_slide, ""), -1);
        if (strstr(message, row[i].want) == NULL ||
            strstr(message, "rig.yaml:9:73: eds") == NULL)
            fail_msg("%s", message);
        snprintf(of_slide, sizeof of_slide, ", eds: servo.eds%s", row[i].use);
        if (load(of_slide, "") < 0)
            fail_msg("%s", message);
    }
    for (size_t i = 0; i < ARRAY_LEN(always); i++) {
        put_eds_without(always[i]);
        assert_int_equal(load(", eds: less.eds", ""), -1);
    }
    for (size_t i = 0; i < ARRAY_LEN(never); i++) {
        put_eds_without(never[i]);
        if (load(", eds: less.eds", "") < 0)
            fail_msg("%s", message);
    }
}

/* What its quirks spare is not missed; what they need is. */
static void what_quirks_spare_need_not_be_there(void **state)
{
    (void)state;
    put_eds_without("1016sub1");
    assert_int_equal(load(", eds: less.eds", ""), -1);
    if (load(", eds: less.eds, quirks: ingenia", "") < 0)
        fail_msg("%s", message);
    put_eds_without("100C");
    assert_int_equal(load(", eds: less.eds, quirks: ingenia", ""), -1);
    assert_non_null(strstr(message, "100C:0 not there"));
    put_eds_without("60C1sub1");
    assert_int_equal(load(", eds: less.eds, quirks: pilz-prbt", ""), -1);
    if (load(", eds: less.eds, quirks: pilz-prbt, mode: csp", "") < 0)
        fail_msg("%s", message);
}

/* ---- the file ---- */

static void parameters_are_read_with_their_sizes(void **state)
{
    (void)state;
    if (load(", eds: servo.eds, parameters: {6065: 20000, 607D:1: -2000, "
             "0x6066: 0x10, following_time: 0}",
             "") == 0)
        fail_msg("0x6066 and its name were taken both");
    assert_non_null(strstr(message, "is there already"));
    if (load(", eds: servo.eds, parameters: {6065: 20000, 607D:1: -2000, "
             "0x6066: 0x10}",
             ", parameters: {mode: 6}") < 0)
        fail_msg("%s", message);
    assert_int_equal(rig.axis[0].parameter_count, 3);
    assert_int_equal(rig.axis[0].object[0].index, 0x6065);
    assert_int_equal(rig.axis[0].object[0].size, 4);
    assert_int_equal(rig.axis[0].object[0].value, 20000);
    assert_int_equal(rig.axis[0].object[1].sub, 1);
    assert_int_equal((int32_t)rig.axis[0].object[1].value, -2000);
    assert_int_equal(rig.axis[0].object[2].size, 2);
    assert_int_equal(rig.axis[0].object[2].value, 16);
    assert_int_equal(rig.axis[1].parameter_count, 1);
    assert_int_equal(rig.axis[1].item[0].value, 6);
    assert_string_equal(rig.map[0].item[rig.axis[1].item[0].item].name, "mode");
}

static void what_cannot_be_set_is_refused_with_its_place(void **state)
{
    static const struct {
        const char *slide, *turn, *want;
    } row[] = {
        { ", eds: nowhere.eds", "", "rig.yaml:9:73: eds cannot be read" },
        { ", eds: poor.eds", "", "will not do: 1016:1 not there" },
        { ", eds: servo.eds, parameters: {6065: -1}", "",
          "-1 is outside of 6065:0, expected 0 .. 4294967295" },
        { ", eds: servo.eds, parameters: {1019: 241}", "",
          "241 is outside of 1019:0, expected 0 .. 240" },
        { ", eds: servo.eds, parameters: {6041: 1}", "",
          "cannot be written: it is read-only in the data sheet" },
        { ", eds: servo.eds, parameters: {9999: 1}", "",
          "not an object of this drive, says its data sheet" },
        { ", eds: servo.eds, parameters: {2000: 1}", "",
          "cannot be read back" },
        { ", eds: servo.eds, parameters: {6065: soon}", "",
          "'soon' is not a value" },
        { ", eds: servo.eds, parameters: {6065: 5 u16}", "",
          "is u32, not u16" },
        { ", parameters: {6065: 5 u64}", "", "has no such type" },
        { ", parameters: {2345: 5}", "", "has no known type" },
        { ", parameters: {nonsense: 5}", "", "is not an object of this drive" },
        { ", parameters: {6060: 3}", "", "is set by slew itself" },
        { ", parameters: {1600:1: 3}", "", "is set by slew itself" },
        { ", parameters: [6065]", "", "parameters" },
        { ", parameters: {6065: [1]}", "", "6065" },
        { "", ", parameters: {mood: 6}", "unknown register 'mood'" },
        { "", ", parameters: {mode: 65536}", "65535" },
        { "", ", parameters: {position: 1}", "is what the drive says" },
        { "", ", eds: servo.eds", "unknown key 'eds'" },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        assert_int_equal(load(row[i].slide, row[i].turn), -1);
        if (strstr(message, row[i].want) == NULL ||
            strstr(message, "rig.yaml:") == NULL ||
            strstr(message, ", expected ") == NULL)
            fail_msg("%zu: \"%s\" is not in: %s", i, row[i].want, message);
    }
    assert_int_equal(load(", parameters: {2345: 5 u16}", ""), 0);
    assert_int_equal(rig.axis[0].object[0].size, 2);
}

static void more_parameters_than_there_is_room_for_are_refused(void **state)
{
    char text[1024] = ", parameters: {";

    (void)state;
    for (unsigned i = 0; i <= RIG_PARAMETERS_MAX; i++)
        snprintf(text + strlen(text), sizeof text - strlen(text),
                 "%s%04X: 1 u8", i > 0 ? ", " : "", 0x2000 + i);
    strcat(text, "}");
    assert_int_equal(load(text, ""), -1);
    assert_non_null(strstr(message, "is one of more than 32"));
}

static void check_refuses_the_rig(void **state)
{
    (void)state;
    assert_int_equal(load(", eds: poor.eds", ""), -1);
    run_put("move.yaml",
            "axes:\n  slide: {keys: [[0 s, 0 mm], [2 s, 10 mm]]}\n");
    run("check", run_slew()->directory);
    run_expect(STATUS_INPUT);
    run_complains("will not do");
}

/* ---- the drives ---- */

static void start(void)
{
    struct machine_ports ports = { 0 };

    if (machine_sim_init(&sim, &rig, false, &ports, message) < 0 ||
        machine_init(&machine, &rig, &ports, message) < 0)
        fail_msg("%s", message);
}

static void pass(int64_t dur_ns)
{
    struct hal_clock *clock = machine.ports.clock;
    const int64_t end_ns = hal_clock_now_ns(clock) + dur_ns;

    for (int64_t now_ns = hal_clock_now_ns(clock); now_ns < end_ns;
         now_ns += rig.period_ns) {
        (void)hal_clock_wait_until(clock, now_ns);
        machine_tick(&machine, now_ns);
    }
}

static void expect_state(unsigned axis, enum hal_drive_state state,
                         const char *text)
{
    struct hal_drive_feedback feedback;

    hal_drive_feedback(machine.axis[axis], &feedback);
    if (feedback.state != state || strstr(feedback.fault_text, text) == NULL)
        fail_msg("axis %u is %s: %s", axis,
                 hal_drive_state_text(feedback.state), feedback.fault_text);
}

/* What the simulated drive itself has there. */
static uint32_t object_in_drive(uint16_t index, uint8_t sub)
{
    uint32_t abort_code;
    const int row = cia402_od_find(index, sub, &abort_code);

    assert_true(row >= 0);
    return SERVO_OF(sim_cia402, &sim, 0)->value[row];
}

static void parameters_reach_the_drives(void **state)
{
    (void)state;
    assert_int_equal(load(", parameters: {6065: 20000, 6066: 7, 605A: 3}",
                          ", parameters: {mode: 6, di1: 131}"),
                     0);
    start();
    pass(INT64_C(3000000000));
    expect_state(0, HAL_DRIVE_OFF, "");
    expect_state(1, HAL_DRIVE_OFF, "");
    assert_int_equal(object_in_drive(0x6065, 0), 20000);
    assert_int_equal(object_in_drive(0x6066, 0), 7);
    assert_int_equal(object_in_drive(0x605A, 0), 3);
    for (unsigned i = 0; i < rig.axis[1].parameter_count; i++) {
        const struct modbus_map_item *item =
            &rig.map[0].item[rig.axis[1].item[i].item];

        assert_int_equal(SERVO_OF(sim_modbus_servo, &sim, 1)->reg[item->at],
                         rig.axis[1].item[i].value);
    }
}

static void what_reads_back_otherwise_is_a_fault_that_says_so(void **state)
{
    (void)state;
    assert_int_equal(load("", ""), 0);
    /* 1010:1 answers 1 whatever was written; the position is where it is */
    rig.axis[0].object[0] =
        (struct drive_cia402_parameter){ 0x1010, 1, 4, 0x65766173 };
    rig.axis[0].parameter_count = 1;
    rig.axis[1].item[0] =
        (struct drive_modbus_parameter){ rig.map[0].position, 4321 };
    rig.axis[1].parameter_count = 1;
    rig.axis[1].sim.device = 1; /* "map": its position takes a write */
    start();
    pass(INT64_C(3000000000));
    expect_state(0, HAL_DRIVE_FAULT,
                 "0x1010:01 reads back 0x00000001 instead of 0x65766173");
    expect_state(1, HAL_DRIVE_FAULT, "position reads back 0 instead of 4321");
}

static void what_the_drive_refuses_is_a_fault_that_says_why(void **state)
{
    (void)state;
    assert_int_equal(load(", parameters: {2345: 1 u8}", ""), 0);
    rig.map[0].item[1].at = 0x7777; /* an address that the drive has not */
    rig.axis[1].item[0] = (struct drive_modbus_parameter){ 1, 1 };
    rig.axis[1].parameter_count = 1;
    start();
    SERVO_OF(sim_modbus_servo, &sim, 1)->known[0x7777 / 8] = 0;
    pass(INT64_C(3000000000));
    expect_state(0, HAL_DRIVE_FAULT, "0x2345:00 refused: no such object");
    expect_state(1, HAL_DRIVE_FAULT, "not written: illegal data address");
}

#define parameter_test(name)                                                   \
    cmocka_unit_test_setup_teardown(name, bench, run_close)

int main(void)
{
    const struct CMUnitTest tests[] = {
        parameter_test(what_is_used_of_a_drive_must_be_there),
        parameter_test(what_quirks_spare_need_not_be_there),
        parameter_test(parameters_are_read_with_their_sizes),
        parameter_test(what_cannot_be_set_is_refused_with_its_place),
        parameter_test(more_parameters_than_there_is_room_for_are_refused),
        parameter_test(check_refuses_the_rig),
        parameter_test(parameters_reach_the_drives),
        parameter_test(what_reads_back_otherwise_is_a_fault_that_says_so),
        parameter_test(what_the_drive_refuses_is_a_fault_that_says_why),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
