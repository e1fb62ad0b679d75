/* tests/firmware/host/recording/test_telemetry.c - rows to CSV and back. */
#define _XOPEN_SOURCE 700 /* mkdtemp */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/recording/telemetry.h"
#include "firmware/linux/base/disk.h"
#include "motion/core/fixed.h"
#include "tests/support/check.h"

#define SEED UINT64_C(0x9E3779B97F4A7C15)

static char directory[64], path[96];

static int make_directory(void **state)
{
    (void)state;
    snprintf(directory, sizeof directory, "/tmp/slew-test-XXXXXX");
    if (mkdtemp(directory) == NULL)
        return -1;
    snprintf(path, sizeof path, "%s/run.csv", directory);
    return 0;
}

static int remove_directory(void **state)
{
    (void)state;
    unlink(path);
    return rmdir(directory);
}

static struct rig_axis rig_axes[] = {
    { .name = "dolly", .unit = UNITS_AXIS_MM },
    { .name = "pan", .unit = UNITS_AXIS_DEG },
};
static struct rig_line rig_lines[] = {
    { .name = "stop", .kind = RIG_LINE_ESTOP },
    { .name = "camera", .kind = RIG_LINE_TRIGGER },
    { .name = "flash", .kind = RIG_LINE_TRIGGER },
};
static const struct rig rig = {
    .axis = rig_axes,
    .axis_count = ARRAY_LEN(rig_axes),
    .line = rig_lines,
    .line_count = ARRAY_LEN(rig_lines),
};

static struct telemetry_axis any_axis(uint64_t *seed)
{
    const int64_t most = INT64_C(1) << 50;
    return (struct telemetry_axis){
        .demand = { check_random_in(seed, -most, most),
                    check_random_in(seed, -most, most),
                    check_random_in(seed, -most, most),
                    check_random_in(seed, -most, most) },
        .actual_q32 = check_random_in(seed, -most, most),
        .actual_vel_q32 = check_random_in(seed, -most, most),
        .following_q32 = check_random_in(seed, -most, most),
        .statusword = (uint16_t)check_random(seed),
    };
}

static struct telemetry_row any_row(uint64_t *seed, int i)
{
    static struct telemetry_axis axis[2];
    static struct telemetry_shot shot[2];
    for (int a = 0; a < 2; a++)
        axis[a] = any_axis(seed);
    shot[0] = (struct telemetry_shot){ .number = (uint32_t)check_random(seed),
                                       .t_ns = INT64_C(999999) * i };
    shot[1] = (struct telemetry_shot){ .number = (uint32_t)i, .t_ns = i };
    return (struct telemetry_row){
        .t_ns = INT64_C(1000000) * i,
        .rate.s_ns_q12 = INT64_C(4096000000) * i,
        .phase = (enum telemetry_phase)(i % TELEMETRY_PHASES),
        .state = i % 6,
        .axis = axis,
        .shot = shot,
        .shot_count = 2,
        .faults = (uint64_t)(i % 5),
    };
}

static void write_rows(int count)
{
    struct telemetry telemetry;
    uint64_t seed = SEED;
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    telemetry_init(&telemetry, file, &rig, true);
    for (int i = 0; i < count; i++) {
        struct telemetry_row row = any_row(&seed, i);
        telemetry_write(&telemetry, &row);
    }
    assert_int_equal(fclose(file), 0);
}

static void write_text(const char *text)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

/* Half of the last decimal, and half a step of the format. */
static void assert_near(int64_t got, int64_t want, unsigned bits,
                        double decimal)
{
    double apart = (double)(got - want) / (double)(INT64_C(1) << bits);
    if (apart > 0.51 * decimal + 1e-9 || apart < -0.51 * decimal - 1e-9)
        fail_msg("%" PRId64 " is not %" PRId64, got, want);
}

static void compare(void *context, const struct telemetry_row *row)
{
    static uint64_t seed;
    int *count = context;
    if (*count == 0)
        seed = SEED;
    struct telemetry_row want = any_row(&seed, *count);
    assert_int_equal(row->t_ns, want.t_ns);
    assert_int_equal(row->rate.s_ns_q12, want.rate.s_ns_q12);
    assert_int_equal(row->phase, want.phase);
    for (int a = 0; a < 2; a++) {
        const struct telemetry_axis *x = &row->axis[a], *y = &want.axis[a];
        assert_near(x->demand.pos_q32, y->demand.pos_q32, 32, 1e-7);
        assert_near(x->demand.vel_q32, y->demand.vel_q32, 32, 1e-6);
        assert_near(x->demand.acc_q32, y->demand.acc_q32, 16, 1e-4);
        assert_near(x->demand.jerk_q32, y->demand.jerk_q32, 16, 1e-3);
        assert_near(x->actual_q32, y->actual_q32, 32, 1e-7);
        assert_near(x->actual_vel_q32, y->actual_vel_q32, 32, 1e-6);
        assert_near(x->following_q32, y->following_q32, 32, 1e-7);
        assert_int_equal(x->statusword, y->statusword);
    }
    assert_int_equal(row->faults, want.faults);
    assert_memory_equal(row->shot, want.shot,
                        want.shot_count * sizeof want.shot[0]);
    (*count)++;
}

static void rows_read_back_as_they_were_written(void **state)
{
    (void)state;
    char message[YAML_MESSAGE_MAX] = "";
    int count = 0;
    write_rows(1000);
    assert_int_equal(
        telemetry_read(&disk_files, path, &rig, compare, &count, message), 0);
    assert_int_equal(count, 1000);
}

static void the_heading_names_axes_and_units(void **state)
{
    (void)state;
    char line[1024];
    write_rows(0);
    FILE *file = fopen(path, "rb");
    assert_non_null(fgets(line, sizeof line, file));
    fclose(file);
    assert_string_equal(line,
                        "t_ns,phase,state,path_ns,"
                        "dolly.demand_mm,dolly.demand_mm_s,dolly.demand_mm_s2,"
                        "dolly.demand_mm_s3,dolly.actual_mm,dolly.actual_mm_s,"
                        "dolly.following_mm,dolly.statusword,"
                        "pan.demand_deg,pan.demand_deg_s,pan.demand_deg_s2,"
                        "pan.demand_deg_s3,pan.actual_deg,pan.actual_deg_s,"
                        "pan.following_deg,pan.statusword,"
                        "camera.shot,camera.shot_ns,"
                        "flash.shot,flash.shot_ns,faults\n");
}

static void ignore_row(void *context, const struct telemetry_row *row)
{
    (void)context;
    (void)row;
}

static void
files_that_are_no_telemetry_get_one_line_with_its_place(void **state)
{
#define HEAD "t_ns,phase,state,path_ns"
    static const struct {
        const char *text, *want;
    } rows[] = {
        { "", ":1: not the heading" },
        { "hello\n", ":1: not the heading" },
        { HEAD ",crane.demand_mm\n", ":1: 'crane', expected an axis of this" },
        { HEAD ",dolly.demand_deg\n", ":1: 'demand_deg', expected a column" },
        { HEAD ",dolly\n", ":1: 'dolly', expected a column of an axis" },
        { HEAD ",dolly.demand_mm\n0,move,moving,0,nan\n",
          ":2: 'nan', expected a number" },
        { HEAD ",dolly.demand_mm\n0,move,moving,0\n", ":2: the line ends" },
        { HEAD ",dolly.demand_mm\n0,move,moving,0,1,2\n",
          ":2: more cells than columns" },
        { HEAD "\n0,flying,moving,0\n", ":2: 'flying', expected a phase" },
        { HEAD "\n1e400,move,moving,0\n", ":2: '1e400', expected a number" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        char message[YAML_MESSAGE_MAX] = "";
        write_text(rows[i].text);
        assert_int_equal(
            telemetry_read(&disk_files, path, &rig, ignore_row, NULL, message),
            -1);
        if (strstr(message, rows[i].want) == NULL ||
            strncmp(message, path, strlen(path)) != 0 ||
            strchr(message, '\n') != NULL)
            fail_msg("%s gave: %s", rows[i].text, message);
    }
}

static void a_missing_file_is_named(void **state)
{
    (void)state;
    char message[YAML_MESSAGE_MAX] = "";
    assert_int_equal(telemetry_read(&disk_files, "/nowhere/run.csv", &rig,
                                    ignore_row, NULL, message),
                     -1);
    assert_non_null(strstr(message, "/nowhere/run.csv: No such file"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rows_read_back_as_they_were_written),
        cmocka_unit_test(the_heading_names_axes_and_units),
        cmocka_unit_test(
            files_that_are_no_telemetry_get_one_line_with_its_place),
        cmocka_unit_test(a_missing_file_is_named),
    };
    return cmocka_run_group_tests(tests, make_directory, remove_directory);
}
