/* tests/firmware/host/recording/test_record.c - rows to MCAP and back, also
 * from files that were cut or damaged anywhere. */
#define _XOPEN_SOURCE 700 /* mkdtemp */
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/recording/mcap_reader.h"
#include "firmware/host/recording/record_read.h"
#include "firmware/linux/base/disk.h"
#include "tests/support/check.h"

#define SEED   UINT64_C(0xD1B54A32D192ED03)
#define EPOCH  INT64_C(1795467600500000000)
#define ROWS   5000
#define CUTS   20
#define SECOND INT64_C(1000000000)

static char directory[64], path[96];

static int make_directory(void **state)
{
    (void)state;
    snprintf(directory, sizeof directory, "/tmp/slew-test-XXXXXX");
    if (mkdtemp(directory) == NULL)
        return -1;
    snprintf(path, sizeof path, "%s/run.mcap", directory);
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
};
static struct rig_bus rig_buses[] = { { .name = "can0" }, { .name = "can1" } };
static const struct rig rig = {
    .axis = rig_axes,
    .axis_count = ARRAY_LEN(rig_axes),
    .line = rig_lines,
    .line_count = ARRAY_LEN(rig_lines),
    .bus = rig_buses,
    .bus_count = ARRAY_LEN(rig_buses),
};

/* Row i is the same each time it is made. */
static struct telemetry_row any_row(int i)
{
    static struct telemetry_axis axis[2];
    static struct telemetry_shot shot[1];
    static uint32_t bus_warnings[2];
    uint64_t seed = SEED + (uint64_t)i * 977;
    const int64_t most = INT64_C(1) << 50;
    for (int a = 0; a < 2; a++) {
        for (size_t f = 0; f < TELEMETRY_FIELDS; f++)
            telemetry_set(&axis[a], f, check_random_in(&seed, -most, most));
        axis[a].statusword = (uint16_t)check_random(&seed);
        axis[a].events = (struct hal_drive_events){ .emergency_code = 0 };
        if (a == 1 && i >= 700)
            axis[a].events.count[0] = 2;
        axis[a].warning = (struct warning){
            .number = a == 0 && i >= 650 ? 2 : 1,
            .kind = WARNING_FOLLOWING,
            .value_q32 = (int64_t)3 << 30,
            .limit_q32 = (int64_t)1 << 32,
        };
    }
    bus_warnings[0] = 7; /* from before */
    bus_warnings[1] = i >= 720 ? 1 : 0;
    shot[0] = (struct telemetry_shot){ .number = i % 97 == 0 ? (uint32_t)i : 0,
                                       .t_ns = i % 97 == 0 ? 1000 * i : 0 };
    return (struct telemetry_row){
        .t_ns = SECOND / 1000 * i,
        .late_ns = check_random_in(&seed, 0, 1000000),
        .number = (uint32_t)i,
        .rate = { .s_ns_q12 = check_random_in(&seed, 0, most),
                  .rate_q30 = (int64_t)1 << 29 },
        .phase = (enum telemetry_phase)(i / 1000),
        .state = i % 6,
        .axis = axis,
        .bus_warnings = bus_warnings,
        .shot = shot,
        .shot_count = 1,
    };
}

static const char *const plan[][2] = { { "epoch_ns", "1795467600500000000" },
                                       { "title", "A \"test\"" } };
static const char *const end[][2] = { { "end", "done" } };

static void begin(struct record *record, FILE *file)
{
    *record = (struct record){ .rig = NULL };
    record_init(record, file, &rig, EPOCH, "test");
    record_attach(record, "rig.yaml", "title: \xC3\xA9\n", 10);
    record_plan(record, plan, ARRAY_LEN(plan));
}

/* All but one, which was lost; without the end when not `whole`. */
static void write_rows(int count, bool whole, int left_out)
{
    static struct record record;
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    begin(&record, file);
    for (int i = 0; i < count; i++) {
        struct telemetry_row row = any_row(i);
        if (i != left_out)
            record_write(&record, &row);
    }
    if (whole)
        assert_true(record_end(&record, end, ARRAY_LEN(end)));
    assert_int_equal(record.rows_lost, 0);
    record_free(&record);
    assert_int_equal(fclose(file), 0);
}

/* Half of the last decimal, and half a step of the format. */
static void assert_near(int64_t got, int64_t want, size_t f)
{
    double decimal = 0.51, step = 1;
    for (unsigned i = 0; i < telemetry_field[f].digits; i++)
        decimal /= 10;
    for (unsigned i = 0; i < telemetry_field[f].bits; i++)
        step /= 2;
    const double apart = (double)(got - want) * step;
    if (apart > decimal + step || apart < -decimal - step)
        fail_msg("%s: %" PRId64 " is not %" PRId64, telemetry_field[f].name,
                 got, want);
}

struct seen {
    int rows, notes;
    bool other_rig;
    char note[8][RECORD_TEXT_MAX];
};

static void compare(void *context, const struct telemetry_row *row)
{
    struct seen *seen = context;
    const struct telemetry_row want = any_row((int)row->number);
    seen->rows++;
    assert_int_equal(row->t_ns, want.t_ns);
    assert_int_equal(row->late_ns, want.late_ns);
    assert_int_equal(row->rate.s_ns_q12, want.rate.s_ns_q12);
    assert_int_equal(row->rate.rate_q30, want.rate.rate_q30);
    assert_int_equal(row->phase, want.phase);
    assert_int_equal(row->state, want.state);
    for (int a = 0; a < 2; a++) {
        const struct telemetry_axis *got = &row->axis[seen->other_rig ^ a];
        for (size_t f = 0; f < TELEMETRY_FIELDS; f++)
            assert_near(telemetry_get(got, f), telemetry_get(&want.axis[a], f),
                        f);
        assert_int_equal(got->statusword, want.axis[a].statusword);
    }
    assert_int_equal(row->shot[0].number, want.shot[0].number);
    assert_int_equal(row->shot[0].t_ns, want.shot[0].t_ns);
}

static void take_note(void *context, int64_t t_ns, enum record_level level,
                      const char *text)
{
    struct seen *seen = context;
    assert_in_range(t_ns, 0, ROWS * SECOND / 1000);
    assert_true(level == RECORD_INFO || level == RECORD_WARNING);
    if (seen->notes < 8)
        snprintf(seen->note[seen->notes], RECORD_TEXT_MAX, "%s", text);
    seen->notes++;
}

static struct record_file read_file(struct seen *seen, const struct rig *wanted)
{
    struct record_file file;
    char message[YAML_MESSAGE_MAX] = "";
    const struct record_taker taker = { compare, take_note, seen };
    if (record_read(&file, &disk_files, path, wanted, &taker, message) < 0)
        fail_msg("%s", message);
    return file;
}

static void rows_read_back_as_they_were_written(void **state)
{
    static struct seen seen;
    (void)state;
    write_rows(ROWS, true, -1);
    struct record_file file = read_file(&seen, NULL);
    assert_int_equal(seen.rows, ROWS);
    assert_int_equal(file.rows, ROWS);
    assert_int_equal(file.rows_missing, 0);
    assert_int_equal(file.damaged, 0);
    assert_true(file.ended);
    assert_string_equal(record_value(file.end, file.end_count, "end"), "done");
    assert_string_equal(record_value(file.plan, file.plan_count, "title"),
                        "A \"test\"");
    assert_int_equal(file.rig.axis_count, 2);
    assert_string_equal(file.rig.axis[1].name, "pan");
    assert_int_equal(file.rig.axis[1].unit, UNITS_AXIS_DEG);
    /* five phases, the warnings of dolly and of can1 that came meanwhile, and the two
     * events of pan */
    assert_int_equal(seen.notes, 8);
    assert_string_equal(seen.note[0], "enabling drives");
    assert_string_equal(seen.note[1],
                        "dolly: following error over half of its limit, 0.75 "
                        "of 1 mm");
    assert_string_equal(seen.note[2], "pan: warning 2");
    assert_string_equal(seen.note[3], "bus can1: error-warning");
    record_file_free(&file);
}

static void axes_are_found_by_name(void **state)
{
    struct rig_axis axes[] = { rig_axes[1], rig_axes[0] };
    struct rig other = rig;
    static struct seen seen = { .other_rig = true };
    struct record_file file;
    char message[YAML_MESSAGE_MAX] = "";
    (void)state;
    other.axis = axes;
    write_rows(100, true, -1);
    file = read_file(&seen, &other);
    assert_int_equal(seen.rows, 100);
    record_file_free(&file);
    axes[0].unit = UNITS_AXIS_RAD;
    assert_int_equal(
        record_read(&file, &disk_files, path, &other, NULL, message), -1);
    assert_non_null(strstr(message, "'pan' in deg is not one of this rig"));
    record_file_free(&file);
}

static void rows_that_were_lost_are_counted(void **state)
{
    static struct seen seen;
    (void)state;
    write_rows(ROWS, true, 1234);
    struct record_file file = read_file(&seen, NULL);
    assert_int_equal(file.rows, ROWS - 1);
    assert_int_equal(file.rows_missing, 1);
    record_file_free(&file);
}

static void attachments_come_back(void **state)
{
    size_t length;
    (void)state;
    write_rows(10, false, -1);
    char *text = record_attachment(&disk_files, path, "rig.yaml", &length);
    assert_non_null(text);
    assert_int_equal(length, 10);
    assert_memory_equal(text, "title: \xC3\xA9\n", 10);
    memory_free(text);
    assert_null(record_attachment(&disk_files, path, "other", &length));
}

static long length_of_file(void)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(fseek(file, 0, SEEK_END), 0);
    const long length = ftell(file);
    fclose(file);
    return length;
}

/* Rows come a second at a time, so what a cut costs is less than two. */
static void a_cut_anywhere_leaves_all_chunks_before_it(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    write_rows(ROWS, true, -1);
    const long whole = length_of_file();
    for (int i = CUTS - 1; i >= 0; i--) { /* from the end on */
        static struct seen seen;
        const long cut = 4096 + (whole - 4096) / CUTS * i +
                         check_random_in(&seed, 0, (whole - 4096) / CUTS - 1);
        assert_int_equal(truncate(path, cut), 0);
        seen = (struct seen){ .rows = 0 };
        struct record_file file = read_file(&seen, NULL);
        const double share = (double)cut / (double)whole;
        assert_int_equal(file.rows_missing, 0);
        if (seen.rows < (int)(share * ROWS) - 1300 || seen.rows > ROWS)
            fail_msg("seed %d: %d rows of a share of %f", i, seen.rows, share);
        record_file_free(&file);
    }
}

static void put_byte(long at, int change)
{
    FILE *file = fopen(path, "r+b");
    assert_non_null(file);
    assert_int_equal(fseek(file, at, SEEK_SET), 0);
    const int old = fgetc(file);
    assert_int_equal(fseek(file, at, SEEK_SET), 0);
    fputc(old ^ change, file);
    assert_int_equal(fclose(file), 0);
}

/* In the bytes of a chunk; all other chunks are there. */
static void a_damaged_chunk_costs_its_rows(void **state)
{
    static struct seen seen;
    (void)state;
    write_rows(ROWS, true, -1);
    put_byte(length_of_file() / 2, 0x40);
    struct record_file file = read_file(&seen, NULL);
    assert_int_equal(file.damaged, 1);
    assert_in_range(file.rows_missing, 400, 1100);
    assert_int_equal(file.rows + file.rows_missing, ROWS);
    record_file_free(&file);
}

static void take_any_row(void *context, const struct telemetry_row *row)
{
    (void)context;
    (void)row;
}

/* One sentence or rows; the sanitizers watch. */
static void any_bytes_changed_do_no_harm(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    for (int i = 0; i < 300; i++) {
        struct record_file file;
        char message[YAML_MESSAGE_MAX] = "";
        const struct record_taker taker = { .row = take_any_row };
        write_rows(20, true, -1);
        const long length = length_of_file();
        for (int k = 0; k < 1 + i % 5; k++)
            put_byte(check_random_in(&seed, 0, length - 1),
                     (int)check_random_in(&seed, 1, 255));
        if (record_read(&file, &disk_files, path, NULL, &taker, message) < 0) {
            assert_memory_equal(message, path, strlen(path));
            assert_null(strchr(message, '\n'));
        }
        record_file_free(&file);
    }
}

static void other_files_are_refused(void **state)
{
    static const char *const text[] = { "", "t_ns,phase\n", MCAP_MAGIC,
                                        "\x89MCAP1\r\n" };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(text); i++) {
        struct record_file file;
        char message[YAML_MESSAGE_MAX] = "";
        FILE *to = fopen(path, "wb");
        fputs(text[i], to);
        assert_int_equal(fclose(to), 0);
        assert_int_equal(
            record_read(&file, &disk_files, path, NULL, NULL, message), -1);
        assert_non_null(strstr(message, "not a"));
        record_file_free(&file);
    }
}

/* A file that was killed reads back; a full disk costs every row. */
static void what_cannot_be_written_is_counted(void **state)
{
    static struct record record;
    static struct seen seen;
    char buffer[ROWS_BUFFER];
    (void)state;
    write_rows(ROWS, false, -1);
    const long whole = length_of_file();
    FILE *file = fopen("/dev/full", "wb");
    assert_non_null(file);
    setvbuf(file, buffer, _IOFBF, sizeof buffer);
    begin(&record, file);
    for (int i = 0; i < ROWS; i++) {
        struct telemetry_row row = any_row(i);
        record_write(&record, &row);
    }
    assert_false(record_end(&record, end, ARRAY_LEN(end)));
    assert_int_equal(record.rows_lost, ROWS);
    record_free(&record);
    fclose(file);
    assert_int_equal(truncate(path, whole), 0);
    struct record_file read = read_file(&seen, NULL);
    assert_false(read.ended);
    record_file_free(&read);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rows_read_back_as_they_were_written),
        cmocka_unit_test(axes_are_found_by_name),
        cmocka_unit_test(rows_that_were_lost_are_counted),
        cmocka_unit_test(attachments_come_back),
        cmocka_unit_test(a_cut_anywhere_leaves_all_chunks_before_it),
        cmocka_unit_test(a_damaged_chunk_costs_its_rows),
        cmocka_unit_test(any_bytes_changed_do_no_harm),
        cmocka_unit_test(other_files_are_refused),
        cmocka_unit_test(what_cannot_be_written_is_counted),
    };
    return cmocka_run_group_tests(tests, make_directory, remove_directory);
}
