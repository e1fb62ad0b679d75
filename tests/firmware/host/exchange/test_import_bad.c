/* tests/firmware/host/exchange/test_import_bad.c - files of other programs that
 * are corrupted, and the commands: a move or one sentence, never half of one. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "firmware/linux/base/disk.h"
#include "firmware/linux/commands/command.h"
#include "motion/core/err.h"
#include "tests/firmware/host/exchange/import_bench.h"

#define RIG_FILE   DATA "rig.yaml"
#define CUBIC_FILE DATA "cubic.yaml"
#define KUPER_FILE DATA "kuper.txt"
#define FLAIR_FILE DATA "flair.txt"

#define ANIM                                                                   \
    "animVersion 1.1;\ntimeUnit film;\nanim a.b pan pan 0 0 0;\nanimData {\n"  \
    "output angular;\nkeys {\n"
#define ANIM_WEIGHTED                                                          \
    "animVersion 1.1;\ntimeUnit film;\nanim a.b pan pan 0 0 0;\nanimData {\n"  \
    "output angular;\nweighted 1;\nkeys {\n"
static const struct {
    const char *format, *text, *want;
    uint64_t fps;
} bad[] = {
    { "kuper", "", ":1:1: the file is empty", 24 },
    { "kuper", "Axes = pan\n", "there are no rows", 24 },
    { "kuper", "Axes = pan\n1\n", ":1:1: the file gives no frame rate", 0 },
    { "kuper", "pan, tilt\n1 2\n", ":1:1: the first line does not name", 24 },
    { "kuper", "Axes = pan, yaw\n1 2\n", ":1:13: 'yaw' is not an axis", 24 },
    { "kuper", "Axes = pan, Pan\n1 2\n", ":1:13: axis pan appears twice", 24 },
    { "kuper", "Axes =\n1 2\n", "no columns with axes", 24 },
    { "kuper", "Axes = pan, tilt\n1 2\n3\n", ":3:2: the row ends after 1", 24 },
    { "kuper", "Axes = pan\n1\n2 3\n", ":3:3: the row has more", 24 },
    { "kuper", "Axes = pan\n1\n2.x\n", ":3:1: '2.x' is not a number", 24 },
    { "kuper", "Axes = pan\n1\nnan\n", ":3:1: 'nan' is not a number", 24 },
    { "kuper", "Axes = pan\n1\n  1e99\n", ":3:3: ", 24 },
    { "kuper", "Axes = pan\n1\n99999999999\n", ":3:1: ", 24 },
    { "kuper", "Axes = pan\n1\n2\001\n", ":3:2: byte 0x01", 24 },
    { "kuper", "Axes = pan\n1\n\xff\n", ":3:1: byte 0xFF", 24 },
    { "kuper", "Axes = frame, pan\n1 1\n1 2\n", ":3:1: the time is not", 24 },
    { "flair", "DATA_TYPE x\nPOINTS 2\nFRAME PAN\n1 1\n2 2\n", "expected --fps",
      0 },
    { "flair", "DATA_TYPE x\nPOINTS 3 SPEED 25\nFRAME PAN\n1 1\n2 2\n",
      "ends after 2 rows, expected the 3", 0 },
    { "flair", "DATA_TYPE x\nPOINTS 1.5 SPEED 25\nFRAME PAN\n1 1\n",
      ":2:8: the number of points", 0 },
    { "flair", "DATA_TYPE x\nPOINTS 2 SPEED zero\nFRAME PAN\n1 1\n",
      ":2:16: ", 0 },
    { "flair", "DATA_TYPE x\nPOINTS\n", ":2:1: there is no value", 0 },
    { "flair", "POINTS 2\n", ":1:1: the first line does not begin", 0 },
    { "raw", "1 2\n", ":1:1: the file has 2 columns and --columns 3", 24 },
    { "raw", "1 2 3 4\n", ":1:1: the file has 4 columns and --columns 3", 24 },
    { "raw", "1 2 3\n1 2\n", ":2:4: the row ends after 2 of 3", 24 },
    { "raw", "1,5 2,5 3\n", ":1:1: the file has 5 columns", 24 },
    { "csv", "t,pan,\n0,1,\n1,2,3\n", ":3:5: column 3 has no name", 0 },
    { "csv", ",pan\n0,1\n", ":2:1: column 1 has no name", 24 },
    { "csv", "t;pan\n0,5;1\n",
      ":2:1: '0,5' is not a number, expected one; "
      "--decimal comma",
      0 },
    { "csv", "t,pan\n0,\"1,5\"\n",
      ":2:3: '1,5' is not a number, expected one; "
      "--decimal comma",
      0 },
    { "csv", "t,pan\n0,\"1\n", ":2:3: the quote is not closed", 0 },
    { "csv", "t,pan\n0,\"1\"2\n", ":2:6: there is something behind", 0 },
    { "csv", "t,pan (mm)\n0,1\n", ":1:3: 'mm' is no unit of axis pan", 0 },
    { "csv", "t,pan_deg_s\n0,1\n", "no columns with axes", 0 },
    { "csv", "t,tilt,pan_deg_s\n0,1,2\n", ":1:8: 'pan_deg_s' is of axis pan",
      0 },
    { "csv", "frame,t,pan\n0,0,1\n",
      ":1:7: 't' is a second column of times "
      "beside 'frame'",
      24 },
    { "csv", "t,pan\n0,1\n0,2\n", ":3:1: the time is not later", 0 },
    { "csv", "t,pan\n0,1\n1,\n", ":3:3: '' is not a number", 0 },
    { "csv", "t,t_ns,pan\n0,1\n",
      ":1:3: 't_ns' is a second column of times beside 't'", 0 },
    { "csv", "pan\n1\n", "expected --fps", 0 },
    { "csv", "t,pan\n0,1\n2e6,2\n", ":3:1: the time is more than", 0 },
    { "maya", "keys\n", ":1:1: the file does not begin", 0 },
    { "maya", "animVersion 1.1;\n", "no curves with axes", 0 },
    { "maya", "animVersion 1.1;\nanimData {\n", "without a line 'anim'", 0 },
    { "maya", "animVersion 1.1;\ntimeUnit lunar;\n", ":2:10: 'lunar'", 0 },
    { "maya", "animVersion 1.1;\nlinearUnit yd;\n", ":2:12: 'yd'", 0 },
    { "maya", ANIM "}\n}\n", "the curve has no keys", 0 },
    { "maya",
      ANIM "0 1 flat flat 1 1 0;\n}\nkeys {\n1 1 flat flat 1 1 0;\n}\n}\n",
      ":9:5: the curve has keys already", 0 },
    { "maya", ANIM "0 1 flat flat 1 1 0;\n", "ends within keys", 0 },
    { "maya", ANIM "0 1 flat flat 1 1 0;\n}\n", "ends within animData", 0 },
    { "maya", ANIM "0 1 flat step 1 1 0;\n}\n}\n", "cannot jump", 0 },
    { "maya", ANIM "0 1 flat curly 1 1 0;\n}\n}\n", ":7:10: 'curly'", 0 },
    { "maya", ANIM "0 1 flat flat 1 1 0 7;\n}\n}\n", ":7:21: '7'", 0 },
    { "maya", ANIM "0 1 flat fixed 1 1 0 90 1;\n}\n}\n", "steeper", 0 },
    { "maya", ANIM "1 1 flat flat 1 1 0;\n1 1 flat flat 1 1 0;\n}\n}\n",
      ":8:1: '1'", 0 },
    { "maya", ANIM "0 1 flat flat\n}\n}\n",
      ":8:1: '}' is not valid here, the "
      "statement ends and a value is missing",
      0 },
    { "maya", "animVersion 1.1\ntimeUnit pal;\n",
      ":2:1: 'timeUnit' is not valid "
      "here, expected ;",
      0 },
    { "maya", ANIM "0 1 flat flat 1 1 0\n1 1 flat flat 1 1 0;\n}\n}\n",
      ":8:1: '1' is not valid here, expected ;", 0 },
    { "maya", ANIM "{ 0 1 flat flat 1 1 0; }", "expected a key", 0 },
    { "maya",
      "animVersion 1.1;\nanim a pan;\nanimData {\noutput unitless;\nkeys {\n0 "
      "1 flat "
      "flat 1 1 0; }\npreInfinity constant",
      "ends within a statement", 0 },
    { "maya", ANIM_WEIGHTED "0 1 flat fixed 1 1 0 91 1;\n}\n}\n",
      ":8:22: '91' is not valid here, expected an angle", 0 },
    { "maya", ANIM_WEIGHTED "0 1 flat fixed 1 1 0 9 -1;\n}\n}\n",
      ":8:24: '-1' is not valid here, expected a weight", 0 },
    { "maya", ANIM_WEIGHTED "0 1 flat fixed 1 1 0 9 1e99;\n}\n}\n",
      ":8:22: '9' is not valid here, the tangent reaches", 0 },
    { "maya",
      "animVersion 1.1;\nanim a pan;\nanimData {\npostInfinity "
      "spiral;\n",
      ":4:14: 'spiral'", 0 },
    { "maya",
      "animVersion 1.1;\nendTime soon;\nanim a pan;\nanimData {\n"
      "output angular;\nkeys {\n0 1 flat flat 1 1 0;\n}\n}\n",
      ":2:9: 'soon'", 0 },
    { "maya",
      "animVersion 1.1;\nanim a pan;\nanimData {\noutput angular;\nkeys {\n"
      "-40000000 1 flat flat 1 1 0;\n40000000 1 flat flat 1 1 0;\n"
      "}\n}\n",
      "longer than 26 days", 0 },
};

static void bad_files_are_refused_where_they_are_bad(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(bad); i++) {
        struct import_settings settings =
            import_bench_named(bad[i].format, bad[i].fps);
        struct imported got;
        const char *path = import_bench_write(bad[i].text, strlen(bad[i].text));
        int err = import_format_find(bad[i].format)
                      ->read(&disk_files, path, &settings, &got,
                             import_bench_message);
        if (err >= 0 || strstr(import_bench_message, bad[i].want) == NULL ||
            strncmp(import_bench_message, path, strlen(path)) != 0)
            fail_msg("row %zu: \"%s\", expected \"%s\"", i,
                     err < 0 ? import_bench_message : "accepted", bad[i].want);
    }
    unlink(import_bench_path("in"));
}

static const struct {
    const char *format, *path;
    uint64_t fps;
} good[] = {
    { "kuper", DATA "kuper.txt", 24 },   { "flair", DATA "flair.txt", 24 },
    { "raw", DATA "raw.txt", 24 },       { "csv", DATA "table.csv", 24 },
    { "maya", DATA "tangents.anim", 0 },
};

/* Either a move or one sentence about that file. */
static void check_any(size_t i, const char *data, size_t length)
{
    struct import_settings settings =
        import_bench_named(good[i].format, good[i].fps);
    struct imported got;
    const char *path = import_bench_write(data, length);
    import_bench_message[0] = 0;
    if (import_format_find(good[i].format)
            ->read(&disk_files, path, &settings, &got, import_bench_message) >=
        0) {
        assert_true(got.move.axis_count > 0);
        move_free(&got.move);
        return;
    }
    assert_int_equal(strncmp(import_bench_message, path, strlen(path)), 0);
    assert_null(strchr(import_bench_message, '\n'));
    assert_int_equal(got.move.axis_count, 0);
}

static void truncated_files_are_a_move_or_an_error(void **state)
{
    static char data[1 << 16];
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(good); i++) {
        size_t length = import_bench_read(good[i].path, data, sizeof data);
        for (size_t n = 0; n <= length; n++)
            check_any(i, data, n);
    }
    unlink(import_bench_path("in"));
}

static void flipped_bytes_are_a_move_or_an_error(void **state)
{
    static char data[1 << 16];
    uint64_t seed = SEED;
    (void)state;
    printf("seed %#llx\n", (unsigned long long)SEED);
    for (size_t i = 0; i < ARRAY_LEN(good); i++) {
        size_t length = import_bench_read(good[i].path, data, sizeof data);
        for (int round = 0; round < 1500; round++) {
            size_t at = (size_t)check_random_in(&seed, 0, (int64_t)length - 1);
            char was = data[at];
            data[at] = (char)check_random(&seed);
            check_any(i, data, length);
            data[at] = was;
        }
    }
    unlink(import_bench_path("in"));
}

/* --- the commands --- */

static int slew(int argc, char *argv[])
{
    int status;
    fflush(NULL);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        if (freopen("/dev/null", "w", stdout) == NULL ||
            freopen("/dev/null", "w", stderr) == NULL)
            abort();
        exit((int)command_main(argc, argv));
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    return WEXITSTATUS(status);
}

static void a_refused_import_writes_nothing(void **state)
{
    char out[128], kuper[] = KUPER_FILE, flair[] = FLAIR_FILE,
                   rig_file[] = RIG_FILE;
    char *argv[] = { "slew",   "import", "kuper", flair,   "--rig",
                     rig_file, "--fps",  "24",    "--out", out };
    (void)state;
    snprintf(out, sizeof out, "%s", import_bench_path("out.yaml"));
    assert_int_equal(slew(10, argv), STATUS_INPUT);
    assert_int_equal(access(out, F_OK), -1);
    argv[3] = kuper;
    assert_int_equal(slew(10, argv), STATUS_OK);
    char *check[] = { "slew", "plan", rig_file, out };
    assert_int_equal(slew(4, check), STATUS_OK);
    argv[2] = "cuper";
    assert_int_equal(slew(10, argv), STATUS_INPUT);
    unlink(out);
}

static void exporting_takes_a_rig_and_a_move_or_a_directory(void **state)
{
    char out[128],
        *argv[] = { "slew", "export",           "kuper", "--fps", "24", "--out",
                    out,    "examples/gallery", NULL };
    (void)state;
    snprintf(out, sizeof out, "%s", import_bench_path("out.txt"));
    assert_int_equal(slew(8, argv), STATUS_OK);
    unlink(out);
    argv[7] = RIG_FILE;
    argv[8] = CUBIC_FILE;
    assert_int_equal(slew(9, argv), STATUS_OK);
    unlink(out);
    argv[2] = "nothing";
    assert_int_equal(slew(9, argv), STATUS_INPUT);
    assert_int_equal(access(out, F_OK), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bad_files_are_refused_where_they_are_bad),
        cmocka_unit_test(truncated_files_are_a_move_or_an_error),
        cmocka_unit_test(flipped_bytes_are_a_move_or_an_error),
        cmocka_unit_test(a_refused_import_writes_nothing),
        cmocka_unit_test(exporting_takes_a_rig_and_a_move_or_a_directory),
    };
    return cmocka_run_group_tests(tests, import_bench_open, import_bench_close);
}
