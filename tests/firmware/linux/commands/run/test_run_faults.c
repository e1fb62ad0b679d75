/* tests/firmware/linux/commands/run/test_run_faults.c - slew run --faults: every
 * kind of fault happens when it is to, is told, and ends as it must; what is
 * drawn at random comes from the seed. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "tests/support/run_slew.h"

#define RIG_START                                                              \
    "buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}\n"                     \
    "axes:\n"
#define RIG_AXIS(name, node)                                                   \
    "  " name ": {unit: mm, limits: {position: [0 mm, 600 mm],\n"              \
    "    velocity: 200 mm/s, acceleration: 400 mm/s2, jerk: 4000 mm/s3},\n"    \
    "    stop: {acceleration: 1600 mm/s2, jerk: 24000 mm/s3},\n"               \
    "    following_error: {floor: 2 mm, time: 20 ms},\n"                       \
    "    drive: {kind: cia402, bus: can0, " node ", counts: 4096 per mm},\n"   \
    "    sim: {start: 10 mm}}\n"
static const char rig[] = RIG_START RIG_AXIS("a", "node: 1") RIG_AXIS(
    "b", "node: 2") "gpio: {stop: {kind: e-stop, line: GPIO5, active: low}}\n";
static const char two_axes[] = RIG_START RIG_AXIS("a", "node: 1, axis: 1")
    RIG_AXIS("b", "node: 1, axis: 2, pdo: {rx: 0x405, tx: 0x385}");
static const char move[] = "axes:\n"
                           "  a: {curve: s-curve, keys: [[0 s, 10 mm], "
                           "[4 s, 300 mm]]}\n"
                           "  b: {curve: s-curve, keys: [[0 s, 10 mm], "
                           "[4 s, 300 mm]]}\n";

static int setup(void **state)
{
    if (run_open(state) < 0)
        return -1;
    run_put("rig.yaml", rig);
    run_put("move.yaml", move);
    return 0;
}

/* The run with these faults; its status. */
static int run_faults(const char *entries, const char *csv)
{
    char text[512];

    snprintf(text, sizeof text, "seed: 3\nfaults: [%s]\n", entries);
    run_put("faults.yaml", text);
    return run("run", "--faults", run_path("faults.yaml"), "--telemetry",
               run_path(csv), run_path("rig.yaml"), run_path("move.yaml"));
}

/* What the report says, and how it ends. */
static const struct {
    const char *entry;
    int status;
    const char *says;
} rows[] = {
    { "{fault: heartbeat_lost, axis: a, at: 1 s}", 1,
      "not on the bus any more" },
    { "{fault: heartbeat_lost, axis: a, at: 1 s, for: 150 ms}", 0, "done" },
    { "{fault: drive_fault, axis: b, at: 1 s, code: 0x3210}", 1, "0x3210" },
    { "{fault: drive_fault, axis: a, position: 100 mm}", 1, "reports a fault" },
    { "{fault: reboot, axis: a, at: 1 s}", 1, "a: the drive" },
    { "{fault: stuck_encoder, axis: a, at: 1 s}", 1, "a: the axis does not" },
    { "{fault: stuck_encoder, axis: a, at: 1 s, for: 5 ms}", 0, "done" },
    { "{fault: encoder_jump, axis: a, at: 1 s, by: 9 mm}", 1,
      "a: the axis does not" },
    { "{fault: encoder_jump, axis: a, at: 1 s, by: 1 mm}", 0, "done" },
    { "{fault: stuck_switch, line: stop, level: active, at: 1 s}", 1,
      "e-stop" },
    { "{fault: stuck_switch, line: stop, level: open, at: 1 s}", 1, "e-stop" },
    { "{fault: stuck_switch, line: stop, level: inactive, at: 1 s}", 0,
      "done" },
    /* the way to 256 errors goes past 128 */
    { "{fault: bus_off, bus: can0, at: 1 s}", 1, "error-passive" },
    { "{fault: bus_errors, bus: can0, count: 3, at: 1 s}", 0, "done" },
    { "{fault: bus_errors, bus: can0, count: 20, at: 1 s}", 1,
      "error-passive" },
    { "{fault: interface_down, bus: can0, at: 1 s}", 1, "the bus is down" },
    { "{fault: other_master, bus: can0, at: 1 s}", 1,
      "bus can0: frames that only a master sends, COB-ID 0x000 (NMT)" },
    { "{fault: babble, bus: can0, at: 1 s}", 1, "fault: " },
    { "{fault: cut_cable, axis: b, at: 1 s}", 1,
      "b: the drive is not on the bus" },
    { "{fault: cut_cable, bus: can0, at: 1 s}", 1, "error-passive" },
    { "{fault: noise, bus: can0, rate: 1 %, at: 1 s}", 0, "done" },
    { "{fault: brown_out, axis: a, at: 1 s}", 1, "a: " },
    { "{fault: slow_drive, axis: a, delay: 20 ms, at: 1 s}", 1, "a: " },
    { "{fault: wrong_answer, axis: a, count: 3, at: 1 s}", 1, "a: " },
    { "{fault: friction_step, axis: a, by: 20 mm/s2, at: 1 s}", 0, "done" },
    { "{fault: obstacle, axis: a, at: 1 s}", 1, "a: the axis does not" },
    { "{fault: obstacle, axis: a, at: 1 s, for: 5 ms}", 0, "done" },
    { "{fault: runaway, axis: a, at: 1 s}", 1, "a: " },
    { "{fault: reboot, axis: a, event: hold}", 0, "not reached: reboot of a" },
};

static void every_fault_happens_and_is_told(void **state)
{
    unsigned wrong = 0;

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const int status = run_faults(rows[i].entry, "t.csv");
        const char *end = strstr(run_slew()->out, "set points:");
        if (status == rows[i].status && end != NULL &&
            strstr(run_slew()->out, rows[i].says) != NULL &&
            strstr(end, "script: ") != NULL)
            continue;
        wrong++;
        print_error("%s: status %d, expected %d and \"%s\":\n%s%s",
                    rows[i].entry, status, rows[i].status, rows[i].says,
                    end != NULL ? end : "", run_slew()->err);
    }
    assert_int_equal(wrong, 0);
}

/* A servo on Modbus, whose map has a watchdog. */
#define MODBUS_RIG(bus)                                                        \
    "buses: {net: " bus "}\n"                                                  \
    "tick: 5 ms\naxes:\n"                                                      \
    "  a: {unit: mm, limits: {position: [0 mm, 600 mm],\n"                     \
    "    velocity: 100 mm/s, acceleration: 100 mm/s2, jerk: 1000 mm/s3},\n"    \
    "    stop: {acceleration: 400 mm/s2, jerk: 4000 mm/s3},\n"                 \
    "    following_error: {floor: 20 mm, time: 100 ms},\n"                     \
    "    drive: {kind: modbus, bus: net, node: 5, map: lexium-32,\n"           \
    "      counts: 4096 per mm},\n"                                            \
    "    sim: {start: 10 mm}}\n"
static const char modbus_move[] =
    "axes:\n"
    "  a: {curve: s-curve, keys: [[0 s, 10 mm], [6 s, 60 mm]]}\n";

/* On a serial line and on TCP; NULL: refused, as `says` says. */
static const struct {
    const char *entry;
    const char *rtu, *tcp;
} modbus_rows[] = {
    { "{fault: slow_drive, axis: a, delay: 300 ms, at: 1 s}", "a: ", "a: " },
    { "{fault: slow_drive, axis: a, delay: 300 ms, direction: to, at: 1 s}",
      "a: ", "a: " },
    { "{fault: jitter, axis: a, delay: 10 ms, at: 1 s}", "done", "done" },
    { "{fault: jitter, axis: a, delay: 10 ms, direction: to, at: 1 s}", "done",
      "done" },
    { "{fault: loss, axis: a, rate: 100 %, at: 1 s}", "a: ", "a: " },
    { "{fault: loss, axis: a, rate: 100 %, direction: to, at: 1 s}",
      "a: ", "a: " },
    { "{fault: loss, axis: a, rate: 3 %, at: 1 s, for: 500 ms}", "done",
      "done" },
    /* of 30 seeds all are done at 1 %, none at 50 %, and at 20 % some */
    { "{fault: duplication, axis: a, rate: 1 %, at: 1 s}", "done", "done" },
    { "{fault: duplication, axis: a, rate: 50 %, at: 1 s}", "a: ", "a: " },
    { "{fault: duplication, axis: a, rate: 5 %, direction: to, at: 1 s}",
      "done", "done" },
    { "{fault: wrong_answer, axis: a, count: 30, direction: to, at: 1 s}",
      "a: ", "a: " },
    { "{fault: noise, bus: net, rate: 100 %, direction: to, at: 1 s}",
      "a: ", "a: " },
    { "{fault: noise, bus: net, rate: 100 %, direction: from, at: 1 s}",
      "a: ", "a: " },
    { "{fault: echo, bus: net, at: 1 s}", "done", "bus is no Modbus RTU line" },
    { "{fault: collision, bus: net, at: 1 s}",
      "a: ", "bus is no Modbus RTU line" },
    { "{fault: babble, bus: net, at: 1 s}",
      "a: ", "bus is no CAN bus or Modbus RTU line" },
    { "{fault: turn_around, bus: net, delay: 50 ms, at: 1 s}",
      "a: ", "bus is no Modbus RTU line" },
    { "{fault: turn_around, bus: net, delay: 0.2 ms, at: 1 s}", "done",
      "bus is no Modbus RTU line" },
    { "{fault: half_open, bus: net, at: 1 s}",
      "bus is no Modbus TCP connection", "a: " },
    { "{fault: hang_up, bus: net, at: 1 s}", "bus is no Modbus TCP connection",
      "the bus is down" },
    { "{fault: hang_up, bus: net, at: 1 s, for: 100 ms}",
      "bus is no Modbus TCP connection", "done" },
};

static unsigned modbus_wrong(const char *entry, const char *says)
{
    const int want = strcmp(says, "done") == 0    ? 0
                     : strstr(says, "bus is no ") ? 2
                                                  : 1;
    const int status = run_faults(entry, "t.csv");
    char said[64];

    snprintf(said, sizeof said, want == 1 ? "fault: %s" : "%s", says);
    if (strcmp(says, "the bus is down") == 0)
        snprintf(said, sizeof said, "%s", says);
    if (status == want &&
        strstr(want == 2 ? run_slew()->err : run_slew()->out, said) != NULL)
        return 0;
    print_error("%s: status %d, expected %d and \"%s\":\n%s%s", entry, status,
                want, said, run_slew()->out, run_slew()->err);
    return 1;
}

static void modbus_lines_and_connections_fail(void **state)
{
    unsigned wrong = 0;

    (void)state;
    run_put("move.yaml", modbus_move);
    run_put("rig.yaml",
            MODBUS_RIG("{kind: modbus-rtu, device: /dev/ttyS9, baud: 115200}"));
    for (size_t i = 0; i < ARRAY_LEN(modbus_rows); i++)
        wrong += modbus_wrong(modbus_rows[i].entry, modbus_rows[i].rtu);
    run_put("rig.yaml", MODBUS_RIG("{kind: modbus-tcp, host: 127.0.0.1}"));
    for (size_t i = 0; i < ARRAY_LEN(modbus_rows); i++)
        wrong += modbus_wrong(modbus_rows[i].entry, modbus_rows[i].tcp);
    assert_int_equal(wrong, 0);
    run_put("rig.yaml", rig);
    run_put("move.yaml", move);
}

static void what_happens_to_the_line_of_a_board_is_seen(void **state)
{
    (void)state;
    run_put("move.yaml", modbus_move);
    run_put("rig.yaml",
            "tick: 10 ms\n"
            "buses:\n"
            "  net: {kind: modbus-rtu, device: /dev/ttyS9, baud: 115200}\n"
            "axes:\n"
            "  a:\n"
            "    unit: mm\n"
            "    limits: {position: [0, 500], velocity: 200, acceleration: "
            "400}\n"
            "    following_error: {floor: 20 mm, time: 300 ms}\n"
            "    drive: {kind: slew-mcu, bus: net, node: 1, axis: 0}\n"
            "    sim: {start: 10 mm}\n");
    assert_int_equal(
        run_faults("{fault: cut_cable, bus: net, at: 9 s}", "t.csv"), 0);
    assert_int_equal(
        run_faults("{fault: cut_cable, bus: net, at: 1 s}", "t.csv"), 1);
    assert_non_null(strstr(run_slew()->out, "the board does not answer"));
    assert_int_equal(
        run_faults("{fault: noise, bus: net, rate: 50 %, at: 1 s}", "t.csv"),
        2);
    assert_non_null(strstr(run_slew()->err, "bus has a board"));
    run_put("rig.yaml", rig);
    run_put("move.yaml", move);
}

/* The same line, whether the rig says so or not: the run is done, and says it
 * where the rig does not. */
static void an_echo_is_said(void **state)
{
    const char *const says = "echoes: the adapter receives what it sends";

    (void)state;
    run_put("move.yaml", modbus_move);
    run_put("rig.yaml",
            MODBUS_RIG("{kind: modbus-rtu, device: /dev/ttyS9, baud: 115200}"));
    assert_int_equal(run_faults("{fault: echo, bus: net, at: 1 s}", "t.csv"),
                     0);
    assert_non_null(strstr(run_slew()->out, says));
    run_put("rig.yaml", MODBUS_RIG("{kind: modbus-rtu, device: /dev/ttyS9, "
                                   "baud: 115200, echo: yes}"));
    assert_int_equal(
        run_faults("{fault: jitter, axis: a, delay: 1 ms, at: 1 s}", "t.csv"),
        0);
    assert_null(strstr(run_slew()->out, "echo"));
    run_put("rig.yaml", rig);
    run_put("move.yaml", move);
}

/* What a node of two axes says goes through one port, whichever axis is named;
 * what it hears, each axis hears by itself. */
static void a_node_of_two_axes_is_one_drive(void **state)
{
    static const char *const entries[] = {
        "{fault: loss, axis: b, rate: 100 %, at: 1 s}",
        "{fault: loss, axis: a, rate: 100 %, at: 1 s}",
        "{fault: loss, axis: b, rate: 100 %, direction: to, at: 1 s}",
        "{fault: loss, axis: a, rate: 100 %, direction: to, at: 1 s}",
        "{fault: slow_drive, axis: b, delay: 20 ms, at: 1 s}",
        "{fault: slow_drive, axis: b, delay: 20 ms, direction: to, at: 1 s}",
        "{fault: heartbeat_lost, axis: b, at: 1 s}",
        "{fault: wrong_answer, axis: b, count: 9, at: 1 s}",
    };
    unsigned wrong = 0;

    (void)state;
    run_put("rig.yaml", two_axes);
    assert_int_equal(
        run_faults("{fault: loss, axis: b, rate: 1 %, at: 1 s, for: 5 ms}",
                   "t.csv"),
        0);
    for (size_t i = 0; i < ARRAY_LEN(entries); i++)
        if (run_faults(entries[i], "t.csv") != 1) {
            print_error("%s: %s", entries[i], run_slew()->out);
            wrong++;
        }
    assert_int_equal(wrong, 0);
    run_put("rig.yaml", rig);
}

/* Same seed, same bytes: everything at once that is drawn at random. */
static void the_same_script_gives_the_same_bytes(void **state)
{
    static const char entries[] =
        "{fault: noise, bus: can0, rate: 3 %, at: 0 s, for: 2 s}, "
        "{fault: wrong_answer, axis: b, at: 2.5 s}, "
        "{fault: friction_step, axis: a, by: 20 mm/s2, at: 1 s}";
    static char first[RUN_OUT_MAX], second[RUN_OUT_MAX];

    (void)state;
    (void)run_faults(entries, "first.csv");
    (void)run_faults(entries, "second.csv");
    run_read(run_path("first.csv"), first, sizeof first);
    run_read(run_path("second.csv"), second, sizeof second);
    assert_true(strlen(first) > 1000000);
    assert_string_equal(first, second);
    assert_non_null(strstr(first, "b.statusword,faults\n"));
    assert_non_null(strstr(first, ",1\n")); /* noise alone */
    assert_non_null(strstr(first, ",5\n")); /* and friction */
}

/* To the tick: 1 s after the move's first. */
static void a_fault_begins_when_it_is_said_to(void **state)
{
    static char text[RUN_OUT_MAX];
    long long move_ns = -1, fault_ns = -1, t_ns;
    char phase[16];

    (void)state;
    assert_int_equal(run_faults("{fault: reboot, axis: a, at: 1 s}", "t.csv"),
                     1);
    run_read(run_path("t.csv"), text, sizeof text);
    for (char *line = strtok(text, "\n"); line; line = strtok(NULL, "\n")) {
        const char *last = strrchr(line, ',');
        if (sscanf(line, "%lld,%15[^,]", &t_ns, phase) != 2)
            continue;
        if (move_ns < 0 && strcmp(phase, "move") == 0)
            move_ns = t_ns;
        if (fault_ns < 0 && strcmp(last, ",1") == 0)
            fault_ns = t_ns;
    }
    assert_true(move_ns > 0);
    assert_int_equal(fault_ns - move_ns, 1000000000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_fault_happens_and_is_told),
        cmocka_unit_test(modbus_lines_and_connections_fail),
        cmocka_unit_test(what_happens_to_the_line_of_a_board_is_seen),
        cmocka_unit_test(an_echo_is_said),
        cmocka_unit_test(a_node_of_two_axes_is_one_drive),
        cmocka_unit_test(the_same_script_gives_the_same_bytes),
        cmocka_unit_test(a_fault_begins_when_it_is_said_to),
    };

    return cmocka_run_group_tests(tests, setup, run_close);
}
