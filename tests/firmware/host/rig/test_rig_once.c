/* tests/firmware/host/rig/test_rig_once.c - what a rig may have once.
 *
 * Every row is a whole rig: buses, axes, lines.  What stands there twice, by
 * whatever spelling, is refused at the second place with the line of the first;
 * what only looks alike is taken. */
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/rig/rig.h"
#include "firmware/linux/base/disk.h"
#include "tests/support/check.h"

#define AXIS(name, drive)                                                      \
    "  " name ": {unit: mm, limits: {position: [0, 900], velocity: 50, "       \
    "acceleration: 40}, following_error: {floor: 9, time: 200 ms}, drive: "    \
    "{" drive "}}\n"
#define SERVO(bus, node)                                                       \
    "kind: modbus, bus: " bus ", node: " node                                  \
    ", map: leadshine-cs2rs, counts: 2000 per mm, unsupervised: yes"
#define CIA402(bus, node)                                                      \
    "kind: cia402, bus: " bus ", node: " node ", counts: 2000 per mm"
#define BOARD(node, axis, servo)                                               \
    "kind: slew-mcu, bus: a, node: " node ", axis: " axis ", servo: " servo    \
    ", map: leadshine-cs2rs, counts: 2000 per mm, unsupervised: yes"

#define TWO_SERVERS(first, second)                                             \
    "buses:\n  a: {kind: modbus-tcp, " first                                   \
    "}\n  b: {kind: modbus-tcp, " second                                       \
    "}\naxes:\n" AXIS("x", SERVO("a", "1")) AXIS("y", SERVO("b", "1"))
#define TWO_PORTS(first, second)                                               \
    "buses:\n  a: {kind: modbus-rtu, baud: 115200, device: " first             \
    "}\n  b: {kind: modbus-rtu, baud: 115200, device: " second                 \
    "}\naxes:\n" AXIS("x", SERVO("a", "1")) AXIS("y", SERVO("b", "1"))
#define TWO_CARDS(first, second)                                               \
    "buses:\n  a: {kind: canopen, bit_rate: 1 Mbit/s" first                    \
    "}\n  b: {kind: canopen, bit_rate: 1 Mbit/s" second                        \
    "}\naxes:\n" AXIS("x", CIA402("a", "1")) AXIS("y", CIA402("b", "1"))
#define LINES(text)                                                            \
    "buses:\n  a: {kind: canopen, bit_rate: 1 Mbit/s}\naxes:\n" AXIS(          \
        "x", CIA402("a", "1")) "gpio:\n" text
#define ON_LINE(first, second)                                                 \
    "buses:\n  a: {kind: modbus-rtu, baud: 115200, device: /dev/ttyUSB0}\n"    \
    "axes:\n" AXIS("x", first) AXIS("y", second)

static const struct {
    const char *name, *rig, *says; /* NULL: it may */
} rows[] = {
    { "a server for two buses",
      TWO_SERVERS("host: 10.0.0.5, port: 1502", "host: 10.0.0.5, port: 1502"),
      "3:31: host 10.0.0.5, port 1502 is bus a's already, as in line 2, "
      "expected one bus with all of its axes" },
    { "a port that is the default",
      TWO_SERVERS("host: drives", "port: 502, host: drives"),
      "3:42: host drives, port 502 is bus a's already, as in line 2" },
    { "a name in two cases, with a dot",
      TWO_SERVERS("host: Drives.Local", "host: drives.local."),
      "3:31: host drives.local, port 502 is bus a's already" },
    { "this computer by address and name",
      TWO_SERVERS("host: localhost", "host: 127.0.0.1"),
      "3:31: host localhost, port 502 is bus a's already, as in line 2" },
    { "this computer by IPv6", TWO_SERVERS("host: '::1'", "host: LOCALHOST"),
      "3:31: host localhost, port 502 is bus a's already" },
    { "two ports of a server",
      TWO_SERVERS("host: 10.0.0.5, port: 1502", "host: 10.0.0.5, port: 1503"),
      NULL },
    { "two servers", TWO_SERVERS("host: 10.0.0.5", "host: 10.0.0.6"), NULL },
    { "a serial port for two buses", TWO_PORTS("/dev/ttyUSB0", "/dev/ttyUSB0"),
      "3:47: device /dev/ttyUSB0 is bus a's already, as in line 2, expected "
      "one bus with all of its axes" },
    { "a serial port with other slashes",
      TWO_PORTS("/dev/ttyUSB0", "/dev//./ttyUSB0"),
      "3:47: device /dev/ttyUSB0 is bus a's already" },
    { "two serial ports", TWO_PORTS("/dev/ttyUSB0", "/dev/ttyUSB1"), NULL },
    { "an interface for two buses",
      TWO_CARDS(", interface: can0", ", interface: can0"),
      "3:53: interface can0 is bus a's already, as in line 2, expected one bus "
      "with all of its axes" },
    { "two interfaces", TWO_CARDS(", interface: can0", ", interface: can1"),
      NULL },
    { "interfaces that are not said", TWO_CARDS("", ""), NULL },
    { "an interface for two protocols",
      "buses:\n  a: {kind: canopen, bit_rate: 1 Mbit/s, interface: can0}\n"
      "  b: {kind: can, bit_rate: 1 Mbit/s, interface: can0}\naxes:\n" AXIS(
          "x", CIA402("a", "1"))
          AXIS("y", "kind: odrive, bus: b, node: 1, turns: 1 per mm, "
                    "unsupervised: yes"),
      "3:49: interface can0 is bus a's already, as in line 2" },
    { "a unit for two axes", ON_LINE(SERVO("a", "3"), SERVO("a", "3")),
      "5:158: node 3 on bus a is axis x's already, as in line 4, expected a "
      "unit number, 1 .. 247, of its own on the bus" },
    { "an axis of a board for two axes",
      ON_LINE(BOARD("3", "0", "1"), BOARD("3", "0", "2")),
      "node 3 on bus a is axis x's already, as in line 4" },
    { "a servo behind a board for two axes",
      ON_LINE(BOARD("3", "0", "7"), BOARD("3", "1", "7")),
      "servo 7 of board 3 on bus a is axis x's already, as in line 4, expected "
      "a servo of its own on the board's line" },
    { "the same unit behind two boards",
      ON_LINE(BOARD("3", "0", "7"), BOARD("4", "0", "7")), NULL },
    { "a board that is a servo", ON_LINE(BOARD("3", "0", "7"), SERVO("a", "3")),
      "node 3 on bus a is axis x's already" },
    { "an axis of a node for two axes",
      "buses:\n  a: {kind: canopen, bit_rate: 1 Mbit/s}\naxes:\n" AXIS(
          "x", CIA402("a", "3") ", axis: 2")
          AXIS("y", CIA402("a", "3") ", axis: 2"),
      "node 3, axis 2, on bus a is axis x's already, as in line 4" },
    { "a digital line by its number, twice",
      LINES("  s: {kind: e-stop, chip: gpiochip0, line: 17}\n"
            "  l: {kind: lamp, chip: /dev/gpiochip0, line: 017}\n"),
      "7:47: line 17 of gpiochip0 is line s's already, as in line 6, expected "
      "a line of its own" },
    { "a digital line by its name, twice",
      LINES("  s: {kind: e-stop, line: GPIO17}\n"
            "  l: {kind: trigger, line: GPIO17}\n"),
      "7:28: line GPIO17 is line s's already, as in line 6" },
    { "by its name with and without the chip",
      LINES("  s: {kind: e-stop, line: GPIO17}\n"
            "  l: {kind: lamp, chip: gpiochip0, line: GPIO17}\n"),
      "7:42: line GPIO17 is line s's already, as in line 6" },
    { "one switch for two purposes",
      LINES("  s: {kind: home, axis: x, line: GPIO17}\n"
            "  l: {kind: limit-negative, axis: x, line: GPIO17}\n"),
      "line GPIO17 is line s's already, as in line 6" },
    { "one name on two chips",
      LINES("  s: {kind: e-stop, chip: gpiochip0, line: GPIO17}\n"
            "  l: {kind: lamp, chip: gpiochip1, line: GPIO17}\n"),
      NULL },
    { "one number on two chips",
      LINES("  s: {kind: e-stop, chip: gpiochip0, line: 17}\n"
            "  l: {kind: lamp, chip: gpiochip1, line: 17}\n"),
      NULL },
    { "a register under two names",
      ON_LINE(SERVO("a", "3"),
              "kind: modbus, bus: a, node: 4, map: two.yaml, counts: 2000 per "
              "mm, unsupervised: yes, parameters: {gain: 1, tune: 2}"),
      "register 0x0301 of axis y is gain's already, as in line 5, expected "
      "each register once" },
    { "two registers",
      ON_LINE(SERVO("a", "3"),
              "kind: modbus, bus: a, node: 4, map: two.yaml, counts: 2000 per "
              "mm, unsupervised: yes, parameters: {gain: 1, other: 2}"),
      NULL },
};

static char directory[] = "/tmp/test_rig_once_XXXXXX", path[64], map[64];

static void write_file(const char *name, const char *text)
{
    FILE *file = fopen(name, "w");

    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

static int make(void **state)
{
    (void)state;
    if (mkdtemp(directory) == NULL)
        return -1;
    snprintf(path, sizeof path, "%s/rig.yaml", directory);
    snprintf(map, sizeof map, "%s/two.yaml", directory);
    write_file(map,
               "title: Two names\n"
               "resolution: 1000\n"
               "items:\n"
               "  enable: {at: 1, type: u16}\n"
               "  state: {at: 2, type: u16, poll: fast}\n"
               "  position: {at: 4, type: i32, poll: fast}\n"
               "  gain: {at: 0x300, type: u32}\n"
               "  tune: {at: 0x301, type: u16}\n"
               "  other: {at: 0x302, type: u16}\n"
               "status:\n"
               "  enabled: {item: state, mask: 1}\n"
               "stream: {at: 0x10, fields: [{type: i32, value: position}]}\n"
               "sequences:\n"
               "  enable: [{write: enable, value: 1}]\n"
               "  disable: [{write: enable, value: 0}]\n"
               "  stop: [{write: enable, value: 2}]\n");
    return 0;
}

static int clean(void **state)
{
    (void)state;
    (void)unlink(path);
    (void)unlink(map);
    return rmdir(directory);
}

static void what_stands_twice_is_refused_with_both_places(void **state)
{
    static struct rig rig;
    char message[YAML_MESSAGE_MAX];

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        write_file(path, rows[i].rig);
        const int err = rig_load(&disk_files, path, &rig, message);

        if (rows[i].says == NULL && err < 0)
            fail_msg("%s: %s", rows[i].name, message);
        if (rows[i].says != NULL &&
            (err == 0 || strstr(message, rows[i].says) == NULL))
            fail_msg("%s: got %s\nwant %s", rows[i].name,
                     err == 0 ? "accepted" : message, rows[i].says);
        rig_free(&rig);
    }
}

/* What the command line puts in the place of the file's. */
static void interfaces_of_the_command_line_are_claimed_too(void **state)
{
    static struct rig rig;
    char message[YAML_MESSAGE_MAX];

    (void)state;
    write_file(path, TWO_CARDS("", ", interface: can1"));
    assert_int_equal(rig_load(&disk_files, path, &rig, message), 0);
    assert_int_equal(rig_set_interfaces(&rig, "a=can1", message), -1);
    assert_string_equal(message, "can1 is of bus a and of bus b, expected an "
                                 "interface of its own for each");
    assert_int_equal(rig_set_interfaces(&rig, "a=can1,b=can0", message), 0);
    assert_int_equal(rig_set_interfaces(&rig, "a=can0,b=can1", message), 0);
    rig_free(&rig);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_stands_twice_is_refused_with_both_places),
        cmocka_unit_test(interfaces_of_the_command_line_are_claimed_too),
    };

    return cmocka_run_group_tests(tests, make, clean);
}
