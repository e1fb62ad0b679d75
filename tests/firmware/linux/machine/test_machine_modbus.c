/* tests/firmware/linux/machine/test_machine_modbus.c - a rig with a Modbus
 * axis: read, judged, built on the simulated line, and what happens when that
 * goes wrong. */
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/device/modbus_map_load.h"
#include "firmware/host/rig/modbus_budget.h"
#include "firmware/linux/base/disk.h"
#include "sim/device/modbus/servo.h"
#include "tests/firmware/linux/machine/machine_bench.h"
#include "tests/support/kind/drives.h"

#define MS  INT64_C(1000000)
#define PAN 2 /* the axis on Modbus */

static struct rig rig;

static void load(void)
{
    bench_load("examples/modbus/rig.yaml", &rig);
}

static void build_ready(void)
{
    load();
    bench_build_ready(&rig);
}

static void the_example_is_read_as_written(void **state)
{
    (void)state;
    load();
    assert_int_equal(rig.bus[2].kind, RIG_MODBUS_RTU);
    assert_int_equal(rig.bus[2].modbus.line.baud, 115200);
    assert_int_equal(rig.bus[2].modbus.line.parity, MODBUS_PARITY_NONE);
    assert_int_equal(rig.bus[2].modbus.line.stop_bits, 2);
    assert_string_equal(rig.bus[2].modbus.device, "/dev/ttyUSB0");
    assert_int_equal(rig.axis[PAN].kind, RIG_MODBUS);
    assert_true(rig.axis[PAN].unsupervised);
    assert_string_equal(rig.map[rig.axis[PAN].map].title,
                        "Leadshine EL7-RS / iSV2-RS");
    /* 25 + 8 characters write, 8 + 11 and 8 + 9 read: 69 of 11 bits, six
     * silences of 1.75 ms, three turn-arounds of 2 ms */
    assert_in_range(modbus_budget_cycle_ns(&rig, 2), 23088000, 23090000);
}

/* Each fault: latched, the group off, nothing by itself, and back by reset. */
static void faults_latch_as_on_can(void **state)
{
    static const struct {
        enum sim_modbus_servo_fault servo;
        enum controller_fault fault;
        int64_t most_ms;
    } rows[] = {
        { SIM_MODBUS_SERVO_ALARM, CONTROLLER_FAULT_DRIVE, 60 },
        { SIM_MODBUS_SERVO_OFF, CONTROLLER_FAULT_OFFLINE, 600 },
    };

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(rows); i++) {
        build_ready();
        const int64_t since_ns = now_ns;
        sim_modbus_servo_inject(SERVO_OF(sim_modbus_servo, &sim, PAN),
                                rows[i].servo);
        until(CONTROLLER_FAULT);
        if (machine.controller.fault.fault != rows[i].fault &&
            machine.controller.fault.fault != CONTROLLER_FAULT_STALE)
            fail_msg("row %u: %s", i,
                     controller_fault_text(machine.controller.fault.fault));
        assert_int_equal(machine.controller.fault.axis, PAN);
        assert_in_range(now_ns - since_ns, 1, rows[i].most_ms * MS);
        sim_modbus_servo_inject(SERVO_OF(sim_modbus_servo, &sim, PAN),
                                SIM_MODBUS_SERVO_CLEAR);
        for (int n = 0; n < 2000; n++)
            tick();
        assert_int_equal(machine.controller.state, CONTROLLER_FAULT);
        assert_int_equal(controller_reset(&machine.controller), 0);
        until(CONTROLLER_OFF);
        assert_int_equal(controller_enable(&machine.controller), 0);
        until(CONTROLLER_READY);
    }
}

/* A servo thinks before it answers: the wire is not busy meanwhile. */
static void a_wire_is_busy_with_its_frames_only(void **state)
{
    struct hal_modbus_stats stats;

    (void)state;
    build_ready();
    const int64_t before_ns = now_ns, busy_ns = machine_busy_ns(&machine, 2);
    for (int n = 0; n < 1000; n++)
        tick();
    hal_modbus_stats(machine.ports.modbus[2], &stats);
    assert_int_equal(machine_busy_ns(&machine, 2), stats.ideal_ns);
    assert_true(stats.busy_ns > stats.ideal_ns);
    assert_in_range(machine_busy_ns(&machine, 2) - busy_ns, 1,
                    now_ns - before_ns);
}

static void one_bad_answer_is_no_fault(void **state)
{
    (void)state;
    for (int fault = SIM_MODBUS_MUTE; fault < SIM_MODBUS_FAULTS; fault++) {
        build_ready();
        SERVO_OF(sim_modbus_servo, &sim, PAN)->faulty.from.fault =
            (enum sim_modbus_fault)fault;
        SERVO_OF(sim_modbus_servo, &sim, PAN)->faulty.from.times = 1;
        for (int n = 0; n < 600; n++)
            tick();
        if (machine.controller.state != CONTROLLER_READY)
            fail_msg("kind %d: %s", fault,
                     controller_fault_text(machine.controller.fault.fault));
        assert_int_equal(
            SERVO_OF(sim_modbus_servo, &sim, PAN)->faulty.from.spoilt, 1);
    }
}

static void too_few_set_points_are_refused(void **state)
{
    struct messages messages = { .text = NULL };

    (void)state;
    load();
    assert_true(modbus_budget_check(&rig, "rig.yaml", &messages));
    rig.bus[2].modbus.line.baud = 9600; /* 95 ms */
    rig.axis[PAN].following_floor_q32 /= 4;
    assert_false(modbus_budget_check(&rig, "rig.yaml", &messages));
    messages_free(&messages);
}

/* ---- what is refused in the files ---- */

static void expect_refused(const char *name, const char *text, const char *want,
                           bool is_map)
{
    char path[] = "build/test_machine_modbus.yaml", message[YAML_MESSAGE_MAX];
    static struct modbus_map map;
    FILE *file = fopen(path, "w");

    assert_non_null(file);
    fputs(text, file);
    fclose(file);
    const int err = is_map ? modbus_map_load(&disk_files, path, &map, message)
                           : rig_load(&disk_files, path, &rig, message);
    (void)unlink(path);
    if (err == 0)
        fail_msg("%s was taken", name);
    if (strstr(message, want) == NULL)
        fail_msg("%s: %s", name, message);
}

#define AXES                                                                   \
    "axes:\n"                                                                  \
    "  pan:\n"                                                                 \
    "    unit: deg\n"                                                          \
    "    limits: {position: [-90, 90], velocity: 30, acceleration: 10}\n"      \
    "    following_error: {floor: 1}\n"

static const struct {
    const char *name, *text, *want;
} bad_rigs[] = {
    { "no device", "buses:\n  l: {kind: modbus-rtu, baud: 9600}\n" AXES,
      ":2:6: l lacks device or baud" },
    { "odd baud",
      "buses:\n  l: {kind: modbus-rtu, device: /dev/x, baud: 250000}\n" AXES,
      "baud '250000' is not a baud rate" },
    { "host on RTU",
      "buses:\n  l: {kind: modbus-rtu, device: /dev/x, baud: 9600, host: "
      "a}\n" AXES,
      "which has neither host nor port" },
    { "baud on TCP",
      "buses:\n  l: {kind: modbus-tcp, host: a, baud: 9600}\n" AXES,
      "which has no device" },
    { "echo on TCP",
      "buses:\n  l: {kind: modbus-tcp, host: a, echo: yes}\n" AXES,
      "framing, gap, rs485, rts_delay or echo" },
    { "framing on TCP",
      "buses:\n  l: {kind: modbus-tcp, host: a, framing: ascii}\n" AXES,
      "which has no device" },
    { "a framing that is none",
      "buses:\n  l: {kind: modbus-rtu, device: /dev/x, baud: 9600, framing: "
      "asci}\n" AXES,
      "unknown framing 'asci'" },
    { "RTU with 7 bits",
      "buses:\n  l: {kind: modbus-rtu, device: /dev/x, baud: 9600, data_bits: "
      "7}\n" AXES,
      "has data_bits: 7, but framing: rtu needs 8" },
    { "ASCII by RTS",
      "buses:\n  l: {kind: modbus-rtu, device: /dev/x, baud: 9600, framing: "
      "ascii, rs485: rts-up}\n" AXES,
      "around which RTS is not switched" },
    { "a board on ASCII",
      "buses:\n  l: {kind: modbus-rtu, device: /dev/x, baud: 9600, framing: "
      "ascii}\n" AXES "    drive: {kind: slew-mcu, bus: l, node: 1, axis: 0}\n",
      "l is a modbus-rtu bus with framing: ascii, not one for" },
    { "kind", "buses:\n  l: {kind: modbus, host: a}\n" AXES,
      "unknown kind 'modbus'" },
    { "no such map",
      "buses:\n  l: {kind: modbus-tcp, host: a}\n" AXES
      "    drive: {kind: modbus, bus: l, node: 1, map: none, counts: 1}\n",
      "map 'none' is not a register map that can be read" },
    { "unsupervised",
      "buses:\n  l: {kind: modbus-tcp, host: a}\n" AXES
      "    drive: {kind: modbus, bus: l, node: 1, map: leadshine-el7, counts: "
      "1}\n",
      "expected unsupervised: yes" },
    { "drive of another bus",
      "buses:\n  l: {kind: modbus-tcp, host: a}\n" AXES
      "    drive: {kind: cia402, bus: l, node: 1, counts: 1}\n",
      "l is a modbus-tcp bus, not one for this kind of drive" },
};

#define MAP_HEAD "title: a\nresolution: 1000\n"
#define MAP_ITEMS                                                              \
    "items:\n"                                                                 \
    "  position: {at: 1, type: i32, poll: fast}\n"                             \
    "  state: {at: 3, type: u16, poll: fast}\n"
#define MAP_STATUS "status: {moving: {item: state, mask: 1}}\n"
#define MAP_MOVE   "move: {at: 16, fields: [{type: i32, value: position}]}\n"

static const struct {
    const char *name, *text, *want;
} bad_maps[] = {
    { "no position", MAP_HEAD "items: {a: {at: 1, type: u16}}\n" MAP_STATUS,
      ":3:8: items has no position" },
    { "address", MAP_HEAD "items: {a: {at: 0x10000, type: u16}}\n",
      "at '0x10000' is not in 0 .. 65535" },
    { "address word", MAP_HEAD "items: {a: {at: 4x, type: u16}}\n",
      "at '4x' is not a whole number" },
    { "write of two", MAP_HEAD "items: {a: {at: 1, type: i32, write: 6}}\n",
      "6 writes one register, the item has two" },
    { "unknown item",
      MAP_HEAD MAP_ITEMS "status: {moving: {item: stat, mask: "
                         "1}}\n",
      "did you mean 'state'" },
    { "never",
      MAP_HEAD MAP_ITEMS
      "status: {moving: {item: state, mask: 1, equals: 2}}\n",
      "can never be" },
    { "no group",
      MAP_HEAD MAP_ITEMS MAP_STATUS "sequences: {stop: [{delay: 1 ms}]}\n",
      "neither move nor stream" },
    { "no enable",
      MAP_HEAD MAP_ITEMS MAP_STATUS MAP_MOVE
      "sequences: {stop: [{delay: 1 ms}]}\n",
      "lacks one of the sequences" },
    { "two in a step",
      MAP_HEAD MAP_ITEMS MAP_STATUS MAP_MOVE
      "sequences: {stop: [{write: state, delay: 1 ms}]}\n",
      "is not one of write, check, until and delay" },
    { "value too large",
      MAP_HEAD MAP_ITEMS MAP_STATUS MAP_MOVE
      "sequences: {stop: [{write: state, value: 65536}]}\n",
      "value '65536' is not in 0 .. 65535" },
    { "const too large",
      MAP_HEAD MAP_ITEMS MAP_STATUS
      "move: {at: 1, fields: [{type: u16, const: -1}]}\n",
      "const '-1' is not in 0 .. 65535" },
    { "a unit",
      MAP_HEAD MAP_ITEMS MAP_STATUS
      "move: {at: 1, fields: [{type: u16, value: velocity, unit: "
      "ms_per_1000rpm}]}\n",
      "is no unit of a velocity" },
};

/* tests/proofs/check_schema.py has them too. */
static const struct {
    const char *name, *want;
} bad_map_files[] = {
    { "address", ":5:15: at '0x10000' is not in 0 .. 65535" },
    { "bit_function", "is read by function 3, which is for registers" },
    { "bounds_reversed", "has a min or max that its type cannot say" },
    { "condition_empty", ":6:18: moving has neither mask nor equals" },
    { "apart_one", ":6:9: apart has 1 item" },
    { "apart_shared", "has two items that share address 0x0002" },
    { "apart_unknown", "did you mean 'state'" },
    { "apart_word", ":6:8: apart is a" },
    { "condition_float", ":6:25: item is an f32, which has no bits" },
    { "const_and_value", "const stands beside value" },
    { "const_float", "const '16777217' is not in -16777216 .. 16777216" },
    { "const_range", "const '65536' is not in 0 .. 65535" },
    { "field_bit", "is a bit, groups have registers" },
    { "field_empty", "has neither value nor const" },
    { "field_unit", "ms_per_1000rpm is no unit of a velocity" },
    { "group_too_long", "has 18 registers, more than one request may have" },
    { "key", ":12:1: unknown key 'alarm'" },
    { "never", "can never be: equals has bits outside the mask" },
    { "no_enable", "lacks one of the sequences enable, disable and stop" },
    { "no_group", "has neither move nor stream" },
    { "no_position", "has no position with poll: fast" },
    { "no_target", "has no field with value: position" },
    { "order_word", "unknown order 'BACD'" },
    { "pair_beyond", "ends beyond address 0xFFFF" },
    { "position_slow", "has no position with poll: fast" },
    { "scale_name",
      "scale is for an item named temperature, bus_voltage or current" },
    { "scale_polled",
      "scale is for a register without poll, which is read where it is "
      "monitored" },
    { "scale_unit", "scale '1 V' is a voltage, expected" },
    { "status_not_polled", "moving uses an item without poll: fast" },
    { "step_two", "is not one of write, check, until and delay" },
    { "step_value", "value belongs to a write or a check" },
    { "step_value_range", "value '65536' is not in 0 .. 65535" },
    { "stream_go_waits", "stream_go waits, it may only write" },
    { "too_many_reads", "has items that need more than 6 reads in one cycle" },
    { "unknown_item", "did you mean 'state'" },
    { "until_unknown", "is not among the status of this map" },
    { "write_of_two", "6 writes one register, the item has two" },
};

static void what_is_wrong_in_a_map_file_is_told(void **state)
{
    static struct modbus_map map;
    char path[96], message[YAML_MESSAGE_MAX];

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(bad_map_files); i++) {
        snprintf(path, sizeof path, "tests/data/bad/map_%s.yaml",
                 bad_map_files[i].name);
        if (modbus_map_load(&disk_files, path, &map, message) == 0)
            fail_msg("%s was taken", path);
        if (strstr(message, bad_map_files[i].want) == NULL)
            fail_msg("%s", message);
    }
}

static void what_is_wrong_in_a_file_is_told(void **state)
{
    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(bad_rigs); i++)
        expect_refused(bad_rigs[i].name, bad_rigs[i].text, bad_rigs[i].want,
                       false);
    for (unsigned i = 0; i < ARRAY_LEN(bad_maps); i++)
        expect_refused(bad_maps[i].name, bad_maps[i].text, bad_maps[i].want,
                       true);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_example_is_read_as_written),
        cmocka_unit_test(faults_latch_as_on_can),
        cmocka_unit_test(a_wire_is_busy_with_its_frames_only),
        cmocka_unit_test(one_bad_answer_is_no_fault),
        cmocka_unit_test(too_few_set_points_are_refused),
        cmocka_unit_test(what_is_wrong_in_a_file_is_told),
        cmocka_unit_test(what_is_wrong_in_a_map_file_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
