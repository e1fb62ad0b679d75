/* tests/firmware/control/test_homing_counter.c - axes whose drive's 32-bit counter ends
 * within their range: homing refuses with the counts, and what is not homed stops with
 * that reason.  The simulated encoders count from 0 where they are switched on. */
#include <string.h>
#include <unistd.h>

#include "tests/firmware/control/homing_bench.h"

static const char cia402[] =
    "buses: {line: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "axes:\n  axis:\n    unit: mm\n"
    "    limits: {position: [-2000, 2000], velocity: 1000, acceleration: "
    "5000}\n"
    "    following_error: {floor: 50 mm, time: 100 ms}\n"
    "    homing: {by: here, position: %s mm}\n"
    "    drive: {kind: cia402, bus: line, node: 5, counts: %s per mm}\n";
static const char modbus[] =
    "tick: 20 ms\n"
    "buses: {line: {kind: modbus-tcp, host: 127.0.0.1}}\n"
    "axes:\n  axis:\n    unit: mm\n"
    "    limits: {position: [-2000, 2000], velocity: 1000, acceleration: "
    "5000}\n"
    "    following_error: {floor: 50 mm, time: 100 ms}\n"
    "    homing: {by: here, position: %s mm}\n"
    "    drive: {kind: modbus, bus: line, node: 1, map: leadshine-el7,\n"
    "      unsupervised: yes, counts: %s per mm}\n";

static void tick(void)
{
    const int64_t now_ns = sim.world.now_ns + rig.period_ns;
    sim_world_run(&sim.world, now_ns);
    machine_tick(&machine, now_ns);
}

static void up(const char *text, const char *home_at, const char *counts)
{
    char path[] = "/tmp/slew-counter-XXXXXX", message[YAML_MESSAGE_MAX];
    const int file = mkstemp(path);
    assert_true(file >= 0);
    (void)dprintf(file, text, home_at, counts);
    close(file);
    if (rig_load(&disk_files, path, &rig, message) < 0)
        fail_msg("%s", message);
    unlink(path);
    homing_build(home_at);
    homing_enable(home_at);
}

static void homed(void)
{
    assert_int_equal(homing_start(&machine.homing, 1), MOTION_OK);
    for (int i = 0; homing_is_running(&machine.homing); i++) {
        assert_true(i < 10000);
        tick();
    }
}

/* The ends are 2^31 counts from -2000 mm and from 2000 mm at 10^6 per mm, to a count. */
static void homing_refuses_where_the_counter_would_end(void **state)
{
    static const struct {
        const char *home_at, *counts, *end; /* NULL: it is homed */
    } rows[] = {
        { "0", "1000000", NULL },
        { "-147.483647", "1000000", NULL },
        { "-147.483648", "1000000", "2147483648" },
        { "147.483648", "1000000", NULL },
        { "147.483649", "1000000", "-2147483649" },
        { "-2000", "1000000", "4000000000" },
        { "147.483647", "-1000000", NULL },
        { "147.483649", "-1000000", "2147483649" },
        { "-147.483649", "-1000000", "-2147483649" },
        { "2000", "100", NULL },
    };
    static const char *const kinds[] = { cia402, modbus };
    for (size_t i = 0; i < 2 * ARRAY_LEN(rows); i++) {
        const char *end = rows[i / 2].end;
        char text[HOMING_TEXT_MAX], want[HOMING_TEXT_MAX];
        up(kinds[i % 2], rows[i / 2].home_at, rows[i / 2].counts);
        homed();
        assert_int_equal(machine.controller.axis[0].homed, end == NULL);
        assert_int_equal(machine.homing.state,
                         end == NULL ? HOMING_DONE : HOMING_FAILED);
        if (end != NULL) {
            snprintf(want, sizeof want,
                     "the drive's counter ends within the axis's range: it "
                     "counts from -2147483648 to 2147483647, an end would be "
                     "at %s",
                     end);
            assert_string_equal(homing_failure(&machine.homing, text), want);
        }
        assert_int_equal(machine.controller.fault.fault, CONTROLLER_FAULT_NONE);
        assert_int_equal(machine.controller.state, CONTROLLER_READY);
        (void)down(state);
    }
}

/* Jogged before it is homed, its range does not count yet. */
static void beyond_the_counter_the_reason_is_the_counter(void **state)
{
    for (int direction = -1; direction <= 1; direction += 2) {
        const struct controller *controller = &machine.controller;
        const struct controller_jog_goal goal = { .pos_q32 =
                                                      direction * 2400 * UNIT,
                                                  .vel_q32 = 1000 * UNIT };
        up(cia402, "0", "1000000");
        assert_int_equal(
            controller_jog(&machine.controller, &machine.jog, &goal), 0);
        for (int n = 0; n < 10000 && controller->state != CONTROLLER_FAULT; n++)
            tick();
        if (controller->fault.fault != CONTROLLER_FAULT_COUNTER)
            fail_msg("%s", controller_fault_text(controller->fault.fault));
        assert_int_equal(controller->fault.axis, 0);
        (void)down(state);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(homing_refuses_where_the_counter_would_end),
        cmocka_unit_test(beyond_the_counter_the_reason_is_the_counter),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
