/* tests/firmware/linux/machine/test_machine_sizes.c - the smallest rig and the
 * largest, simulated, and those beyond. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include <cjson/cJSON.h>
#include <math.h>

#include "firmware/host/rig/rig.h"
#include "tests/support/run_slew.h"

#define TEXT_MAX (1 << 16)

static void add(char text[TEXT_MAX], const char *format, ...)
    __attribute__((format(printf, 2, 3)));

static void add(char text[TEXT_MAX], const char *format, ...)
{
    const size_t length = strlen(text);
    va_list arguments;

    va_start(arguments, format);
    vsnprintf(text + length, TEXT_MAX - length, format, arguments);
    va_end(arguments);
}

/* CiA 402 on all buses but the last quarter, where there are ODrives; the last
 * axis has to be homed. */
static void put_rig(unsigned buses, unsigned axes)
{
    static char text[TEXT_MAX];
    const unsigned first_odrive = buses - buses / 4;

    strcpy(text, "watchdog: 100 ms\nheartbeat: 20 ms\nbuses:\n");
    for (unsigned i = 0; i < buses; i++)
        add(text, "  b%u: {kind: %s, bit_rate: 1 Mbit/s}\n", i,
            i < first_odrive ? "canopen" : "can");
    add(text, "axes:\n");
    for (unsigned i = 0; i < axes; i++) {
        add(text,
            "  a%u:\n"
            "    unit: mm\n"
            "    limits: {position: [-100, 100], velocity: 100, acceleration: "
            "1000}\n"
            "    following_error: {floor: 5}\n",
            i);
        if (i % buses < first_odrive)
            add(text,
                "    drive: {kind: cia402, bus: b%u, node: %u, counts: 1000 "
                "per mm}\n",
                i % buses, i / buses + 1);
        else
            add(text,
                "    drive: {kind: odrive, bus: b%u, node: %u, turns: 0.1 per "
                "mm, unsupervised: true}\n",
                i % buses, i / buses);
        if (i + 1 == axes)
            add(text, "    homing: {by: here}\n");
    }
    run_put("rig.yaml", text);
}

/* Axis i goes to 1 + i / 10 mm. */
static void put_move(unsigned axes)
{
    static char text[TEXT_MAX];

    strcpy(text, "axes:\n");
    for (unsigned i = 0; i < axes; i++)
        add(text,
            "  a%u: {curve: quintic, keys: [[0, 0], [0.5 s, %u.%u mm]]}\n", i,
            1 + i / 10, i % 10);
    run_put("move.yaml", text);
}

static void expect_end(const cJSON *report, unsigned buses, unsigned axes)
{
    const cJSON *list = cJSON_GetObjectItem(report, "axes");
    const cJSON *load = cJSON_GetObjectItem(report, "buses");

    assert_int_equal(cJSON_GetArraySize(list), axes);
    assert_int_equal(cJSON_GetArraySize(load), buses);
    for (unsigned i = 0; i < axes; i++) {
        const cJSON *axis = cJSON_GetArrayItem(list, (int)i);
        const cJSON *error = cJSON_GetObjectItem(axis, "end_error");

        if (!(fabs(cJSON_GetNumberValue(error)) < 0.01))
            fail_msg("axis %u: end error %g", i, cJSON_GetNumberValue(error));
    }
    for (unsigned i = 0; i < buses; i++)
        assert_true(cJSON_GetNumberValue(cJSON_GetObjectItem(
                        cJSON_GetArrayItem(load, (int)i), "load")) > 0);
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(
                         report, "torque_not_confirmed_off")),
                     0);
}

/* The last row: where the demand of every axis ended. */
static void expect_rows(unsigned axes)
{
    static char line[TEXT_MAX], heading[TEXT_MAX];
    FILE *file = fopen(run_path("rows.csv"), "rb");
    unsigned commas = 0;

    assert_non_null(file);
    assert_non_null(fgets(heading, sizeof heading, file));
    for (const char *at = heading; *at != 0; at++)
        commas += *at == ',';
    assert_int_equal(commas, 3 + 8 * axes);
    while (fgets(line, sizeof line, file) != NULL)
        ;
    fclose(file);
    const char *at = line;
    for (unsigned column = 0; column < 4 + 8 * axes; column++) {
        if (column >= 4 && (column - 4) % 8 == 0) {
            const unsigned i = (column - 4) / 8;
            const double want = 1 + i / 10 + 0.1 * (i % 10);

            if (!(fabs(strtod(at, NULL) - want) < 0.01))
                fail_msg("axis %u: %.10s, expected %g", i, at, want);
        }
        at = strchr(at, ',');
        at = at == NULL ? "" : at + 1;
    }
}

static void moves(unsigned buses, unsigned axes)
{
    put_rig(buses, axes);
    put_move(axes);
    run("run", "--json", "--telemetry", run_path("rows.csv"), "--can-log",
        run_path("frames.log"), run_path("rig.yaml"), run_path("move.yaml"));
    run_expect(STATUS_OK);
    cJSON *report = cJSON_Parse(run_slew()->out);
    assert_non_null(report);
    expect_end(report, buses, axes);
    cJSON_Delete(report);
    expect_rows(axes);
}

static void one_axis_on_one_bus_moves(void **state)
{
    (void)state;
    moves(1, 1);
}

static void sixty_four_axes_on_thirty_two_buses_move(void **state)
{
    (void)state;
    moves(RIG_BUSES_MAX, RIG_AXES_MAX);
}

static void sixty_four_axes_are_homed_monitored_and_switched_off(void **state)
{
    (void)state;
    put_rig(RIG_BUSES_MAX, RIG_AXES_MAX);
    run("home", run_path("rig.yaml"));
    run_expect(STATUS_OK);
    run_says("a63");
    run("monitor", "--once", run_path("rig.yaml"));
    run_expect(STATUS_OK);
    run_says("a63");
    run("off", run_path("rig.yaml"));
    run_expect(STATUS_OK);
    run_says("a63");
}

static void more_than_that_is_refused(void **state)
{
    (void)state;
    put_rig(RIG_BUSES_MAX, RIG_AXES_MAX + 1);
    run("off", run_path("rig.yaml"));
    run_expect(STATUS_INPUT);
    run_complains(
        "axes has more than 64 entries, expected a map of 1 .. 64 axes by "
        "name");
    put_rig(RIG_BUSES_MAX + 1, 1);
    run("off", run_path("rig.yaml"));
    run_expect(STATUS_INPUT);
    run_complains(
        "buses has more than 32 entries, expected a map of 1 .. 32 buses "
        "by name");
    put_rig(1, 0);
    run("off", run_path("rig.yaml"));
    run_expect(STATUS_INPUT);
    run_complains("axes has no value");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_axis_on_one_bus_moves),
        cmocka_unit_test(sixty_four_axes_on_thirty_two_buses_move),
        cmocka_unit_test(sixty_four_axes_are_homed_monitored_and_switched_off),
        cmocka_unit_test(more_than_that_is_refused),
    };
    return cmocka_run_group_tests(tests, run_open, run_close);
}
