/* tests/hal/drive/modbus/test_modbus_stream.c - what a streamed Modbus drive is
 * told, and which rigs are refused for what it cannot be told. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "firmware/control/jog.h"
#include "firmware/host/rig/modbus_budget.h"
#include "firmware/host/rig/modbus_stream.h"
#include "sim/device/modbus/servo.h"
#include "tests/firmware/linux/machine/machine_bench.h"
#include "tests/support/kind/drives.h"

#define RIG_PATH "build/test_modbus_stream.yaml"

static struct rig rig;

struct stream_row {
    const char *map, *counts;
    double vel, acc, stop, floor; /* deg, s */
    const char *want;             /* what is said; NULL: nothing */
};

static void load(const struct stream_row *row)
{
    FILE *file = fopen(RIG_PATH, "w");

    assert_non_null(file);
    fprintf(file,
            "title: stream\ntick: 1 ms\n"
            "buses:\n  line: {kind: modbus-tcp, host: localhost}\n"
            "axes:\n  pan:\n    unit: deg\n"
            "    limits: {position: [0 deg, 60 deg], velocity: %g deg/s, "
            "acceleration: %g deg/s2}\n"
            "    stop: {acceleration: %g deg/s2}\n"
            "    following_error: {floor: %g deg}\n"
            "    drive: {kind: modbus, bus: line, node: 1, map: %s, counts: "
            "%s, unsupervised: yes}\n",
            row->vel, row->acc, row->stop, row->floor, row->map, row->counts);
    fclose(file);
    bench_load(RIG_PATH, &rig);
    (void)unlink(RIG_PATH);
}

/* ---- what is refused ---- */

/* By hand: 1 rpm of 10000 counts on 36000 per rev are 10000 / 60 / 100 = 1.667
 * deg/s; the gentlest ramp, 1000 rpm in 32.767 s, 50.86 deg/s2.  3000 rpm of
 * 10000 counts on 7200000 per rev are 25 deg/s; the steepest ramp, 1000 rpm in
 * 1 ms, on 10^9 per rev 60 deg/s2. */
static const struct stream_row rows[] = {
    { "leadshine-el7", "131072 per rev", 30, 10, 10, 1, NULL },
    { "leadshine-el7", "36000 per rev", 30, 10, 20, 1, NULL },
    { "leadshine-el7", "36000 per rev", 30, 10, 10, 1,
      "t.yaml:6:3: axis pan would run in steps of 1.67 deg/s, one of its "
      "drive's speed, with ramps of 50.9 deg/s2, the gentlest that its map can "
      "say: at its stop acceleration of 10 that takes 1.67 / 10 = 167 ms and "
      "1.67^2 / 10 = 0.278 deg, expected at most 40 ms: a stop acceleration of "
      "17, if the motor has it, or mode: point-to-point, would fit\n" },
    { "leadshine-cs2rs", "7200000 per rev", 26, 10, 10, 1,
      "t.yaml:6:3: axis pan runs at up to 26 deg/s, which the speed of its "
      "drive's map cannot say, expected at most 25: such a velocity, or mode: "
      "point-to-point, would fit\n" },
    { "leadshine-cs2rs", "7200000 per rev", 25, 10, 10, 1, NULL },
    { "leadshine-el7", "1000000000 per rev", 0.1, 61, 61, 1,
      "t.yaml:6:3: axis pan accelerates at up to 61 deg/s2, and the steepest "
      "ramp that its drive's map can say is 60, expected more: a lower "
      "acceleration, or mode: point-to-point, would fit\n" },
    /* 16384 counts: 1 rpm is 2.73 deg/s */
    { "lexium-32", "36000 per rev", 30, 10, 10, 1,
      "deg/s2, for the drive's own are taken for steep: at its stop "
      "acceleration of 10 that takes 2.73 / 10 = 273 ms and 2.73^2 / 10 = "
      "0.746 deg, expected at most 40 ms: a stop acceleration of 68.3, if the "
      "motor has it, or mode: point-to-point, would fit\n" },
    { "leadshine-el7", "131072 per rev", 30, 10, 10, 0.001,
      "expected at most its following error of 0.001: a floor of " },
};

/* Its sentences, a line each. */
static void capture(char *text, size_t size, const struct stream_row *row)
{
    struct messages messages = { .text = NULL };
    const bool fits = modbus_budget_check(&rig, "t.yaml", &messages);
    enum message_kind kind;
    const char *line;
    size_t used = 0;

    text[0] = '\0';
    for (size_t at = 0; (line = messages_next(&messages, &at, &kind)) != NULL;)
        used += (size_t)snprintf(text + used, size - used, "%s\n", line);
    messages_free(&messages);
    if (fits != (row->want == NULL))
        fail_msg("%s, %s: %s", row->map, row->counts, text);
}

static void what_cannot_be_streamed_is_refused_with_its_numbers(void **state)
{
    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(rows); i++) {
        char text[1024];

        load(&rows[i]);
        capture(text, sizeof text, &rows[i]);
        if (rows[i].want != NULL && strstr(text, rows[i].want) == NULL)
            fail_msg("row %u\ngot  %swant %s", i, text, rows[i].want);
    }
}

/* ---- what goes to the drive ---- */

/* Half as much again as the stop, never less, whatever the line's cycle is; at
 * most what one step of the register makes more. */
static void ramps_are_those_of_the_stop(void **state)
{
    static const struct stream_row drives[] = {
        { "leadshine-el7", "131072 per rev", 30, 10, 20, 1, NULL },
        { "leadshine-cs2rs", "-500000 per rev", 30, 10, 60, 1, NULL },
        { "oriental-az", "36000 per rev", 90, 300, 300, 1, NULL },
    };

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(drives); i++) {
        double counts;

        load(&drives[i]);
        bench_build_ready(&rig);
        const struct sim_modbus_servo *servo =
            SERVO_OF(sim_modbus_servo, &sim, 0);
        ticks(100);
        counts = fabs(strtod(drives[i].counts, NULL)) / 360;
        if ((double)servo->acc < 1.499 * drives[i].stop * counts ||
            (double)servo->acc > 1.51 * drives[i].stop * counts ||
            servo->dec != servo->acc)
            fail_msg("%s: %" PRId64 " and %" PRId64 " counts/s2 for a stop of "
                     "%.0f",
                     drives[i].map, servo->acc, servo->dec,
                     drives[i].stop * counts);
    }
}

/* A target is never where the drive, braking by the ramp that it was told,
 * would leave the range: at every tick of a jog to its end. */
static void a_drive_left_alone_stops_inside_the_range(void **state)
{
    static const struct stream_row drives[] = {
        { "leadshine-el7", "131072 per rev", 30, 10, 10, 1, NULL },
        { "oriental-az", "36000 per rev", 30, 10, 40, 1, NULL },
    };

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(drives); i++) {
        const double counts = strtod(drives[i].counts, NULL) / 360;
        static struct controller_jog jog;
        double most = 0;

        load(&drives[i]);
        bench_build_ready(&rig);
        const struct controller_jog_goal goal = {
            .pos_q32 = rig.axis[0].limit.pos_max_q32,
            .vel_q32 = rig.axis[0].limit.vel_q32
        };
        assert_int_equal(controller_jog(&machine.controller, &jog, &goal), 0);
        for (int n = 0; n < 12000; n++) {
            tick();
            most = fmax(
                most,
                ldexp((double)SERVO_OF(sim_modbus_servo, &sim, 0)->target_q16,
                      -16) /
                    counts);
        }
        assert_int_equal(machine.controller.state, CONTROLLER_READY);
        if (most < 59.99 || most > 60.01)
            fail_msg("%s: as far as %.4f", drives[i].map, most);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_cannot_be_streamed_is_refused_with_its_numbers),
        cmocka_unit_test(ramps_are_those_of_the_stop),
        cmocka_unit_test(a_drive_left_alone_stops_inside_the_range),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
