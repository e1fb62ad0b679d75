/* tests/firmware/host/exchange/test_import_columns.c - which column of a table, curve
 * of an animation or joint of a robot is which axis: one way to count, whatever the
 * format, nothing shifted and nothing dropped; and the numbers that come of it. */
#include "firmware/linux/base/disk.h"
#include "tests/firmware/host/exchange/import_bench.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "motion/core/fixed.h"

/* Three things to be named, of which the second rows are 10, 20 and 30; with times in
 * front where the format has them. */
#define ANIM_OF(node, value)                                                   \
    "anim t.t t " node " 0 1 0; animData { input time; output unitless; "      \
    "weighted 0; keys { 0 0 flat flat 1 1 0; 24 " value                        \
    " flat flat 1 1 0; } }\n"
#define BLENDER_KEY(t, v)                                                      \
    "{\"t\": " t ", \"v\": " v ", \"lt\": " t ", \"lv\": " v ", \"rt\": " t    \
    ", \"rv\": " v ", \"hl\": \"AUTO\", \"hr\": \"AUTO\", \"interp\": "        \
    "\"BEZIER\", \"easing\": \"AUTO\", \"amplitude\": 0, \"period\": 0, "      \
    "\"back\": 0}"
#define BLENDER_OF(name, value)                                                \
    "{\"name\": \"" name "\", \"unit\": \"own\", \"extrapolation\": "          \
    "\"CONSTANT\", \"auto_smoothing\": \"NONE\", \"cycles\": null, \"keys\": " \
    "[" BLENDER_KEY("0", "0") ", " BLENDER_KEY("24", value) "]}"

static const struct {
    const char *format, *text;
    bool has_time;
} files[] = {
    { "csv", "frame,a,b,c\n1,0,0,0\n25,10,20,30\n", true },
    { "csv", "t;a;b;c\n5;0;0;0\n6;10;20;30\n", true },
    { "csv", "a\tb\tc\ttimecode\n0\t0\t0\t01:00:00:00\n10\t20\t30\t01:00:01:00",
      true },
    { "csv", "a,b,c\n0,0,0\n10,20,30\n", false },
    { "kuper", "Axes = frame, a, b, c\r\n1 0 0 0\r\n25 10 20 30\r\n", true },
    { "kuper", "Axes = a b c\n0 0 0\n10 20 30\n", false },
    { "flair",
      "DATA_TYPE X\nPOINTS 2 SPEED 24\nFRAME a b c\n100 0 0 0\n124 10 20 30\n",
      true },
    { "flair", "DATA_TYPE X\nPOINTS 2 SPEED 24\na b c\n0 0 0\n10 20 30\n",
      false },
    { "raw", "0 0 0\n10 20 30\n", false },
    { "maya",
      "animVersion 1.1; timeUnit film;\n" ANIM_OF("a", "10") ANIM_OF("b", "20")
          ANIM_OF("c", "30"),
      false },
    { "blender",
      "{\"format\": \"slew-blender-1\", \"fps\": 24, \"fps_base\": 1, "
      "\"frame_start\": 0, \"frame_end\": 24, \"curves\": [" BLENDER_OF(
          "a", "10") ", " BLENDER_OF("b", "20") ", " BLENDER_OF("c", "30") "]}",
      false },
    { "ros-yaml",
      "joint_names: [a, b, c]\npoints:\n"
      "- {positions: [0, 0, 0], time_from_start: {sec: 0, nanosec: 0}}\n"
      "- {positions: [0.174532925199433, 0.349065850398866, 0.03], "
      "time_from_start: {sec: 1, nanosec: 0}}\n---\n",
      false },
};

/* What --columns says, with T for the name of the times where there are some: which
 * axis takes which of the three. */
static const struct {
    const char *said;
    int pan, tilt, dolly; /* 10, 20, 30; 0: not there */
    const char *refused;  /* NULL: read */
} said[] = {
    { "T,pan,tilt,dolly", 10, 20, 30, NULL },
    { "-,pan,tilt,dolly", 10, 20, 30, NULL },
    { "T,-,tilt,dolly", 0, 20, 30, NULL },
    { "-,pan,-,dolly", 10, 0, 30, NULL },
    { "T,-,pan,-", 20, 0, 0, NULL },
    { "T,tilt,pan,dolly", 20, 10, 30, NULL },
    { "T,pan,tilt", 0, 0, 0, "expected a name for each" },
    { "T,pan", 0, 0, 0, "expected a name for each" },
    { "T,pan,tilt,dolly,-", 0, 0, 0, "expected a name for each" },
    { "T,pan,tilt,dolly,pan", 0, 0, 0, "expected a name for each" },
    { "T,pan,-,pan", 0, 0, 0, "axis pan appears twice" },
    { "T,-,-,-", 0, 0, 0, "with axes" },
    { "T,pan,yaw,dolly", 0, 0, 0, "'yaw' is not an axis of the rig" },
};

/* "T,..." with the file's word for times, or without it and its comma where the file
 * has none; where they stand last, at the end. */
static void columns_of(char to[128], size_t file, const char *text)
{
    const char *times = strstr(files[file].text, "timecode") != NULL
                            ? "timecode"
                        : strstr(files[file].text, "t;") != NULL ? "t"
                                                                 : "frame";
    const bool is_last = strcmp(times, "timecode") == 0;
    const char first[2] = { text[0], 0 };

    if (!files[file].has_time)
        snprintf(to, 128, "%s", text + 2);
    else if (is_last)
        snprintf(to, 128, "%s,%s", text + 2, text[0] == 'T' ? times : first);
    else
        snprintf(to, 128, "%s%s", text[0] == 'T' ? times : first, text + 1);
}

static void check_axis(const struct imported *got, const char *name, int want,
                       const char *what)
{
    for (unsigned i = 0; i < got->move.axis_count; i++) {
        const struct plan_axis *axis = &got->move.axis[i];
        if (strcmp(axis->name, name) != 0)
            continue;
        const double is =
            (double)axis->key[1].key.pos_q32 / MOTION_FIXED_ONE_Q32;
        if (axis->key_count != 2 || fabs(is - want) > 1e-9 ||
            axis->key[0].key.t_ns_q12 != 0 ||
            (axis->key[1].key.t_ns_q12 != MOTION_FIXED_S_Q12 &&
             axis->key[1].key.t_ns_q12 != import_frame_ns_q12(&got->fps, 1)))
            fail_msg("%s: %s is %g, expected %d", what, name, is, want);
        return;
    }
    if (want != 0)
        fail_msg("%s: %s is not there", what, name);
}

static void every_format_counts_alike(void **state)
{
    (void)state;
    for (size_t f = 0; f < ARRAY_LEN(files); f++)
        for (size_t i = 0; i < ARRAY_LEN(said); i++) {
            struct import_settings settings = import_bench_settings(24);
            const char *path =
                import_bench_write(files[f].text, strlen(files[f].text));
            char columns[128], what[256];
            struct imported got;
            columns_of(columns, f, said[i].said);
            snprintf(what, sizeof what, "%s --columns %s of %.12s",
                     files[f].format, columns, files[f].text);
            assert_int_equal(import_settings_columns(&settings, columns,
                                                     import_bench_message),
                             0);
            const int err = import_format_find(files[f].format)
                                ->read(&disk_files, path, &settings, &got,
                                       import_bench_message);
            unlink(path);
            if ((err < 0) != (said[i].refused != NULL) ||
                (err < 0 &&
                 strstr(import_bench_message, said[i].refused) == NULL))
                fail_msg("%s: %s", what,
                         err < 0 ? import_bench_message : "read");
            if (err < 0)
                continue;
            assert_int_equal(
                import_adjust(&settings, &got, import_bench_message), 0);
            check_axis(&got, "pan", said[i].pan, what);
            check_axis(&got, "tilt", said[i].tilt, what);
            check_axis(&got, "dolly", said[i].dolly, what);
            move_free(&got.move);
        }
}

static void a_number_that_does_not_fit_is_mended_by_what_is_said(void **state)
{
    (void)state;
    for (size_t f = 0; f < ARRAY_LEN(files); f++) {
        struct import_settings settings = import_bench_settings(24);
        struct imported got;
        if (!files[f].has_time)
            continue;
        const char *path =
            import_bench_write(files[f].text, strlen(files[f].text));
        assert_int_equal(import_settings_columns(&settings, "pan,tilt,dolly",
                                                 import_bench_message),
                         0);
        assert_int_equal(import_format_find(files[f].format)
                             ->read(&disk_files, path, &settings, &got,
                                    import_bench_message),
                         -1);
        const char *proposed =
            strstr(import_bench_message, "such as --columns ");
        if (proposed == NULL)
            fail_msg("%s", import_bench_message);
        settings = import_bench_settings(24);
        assert_int_equal(import_settings_columns(
                             &settings, proposed + strlen("such as --columns "),
                             import_bench_message),
                         0);
        if (import_format_find(files[f].format)
                ->read(&disk_files, path, &settings, &got,
                       import_bench_message) < 0)
            fail_msg("%s", import_bench_message);
        check_axis(&got, "pan", 10, files[f].format);
        check_axis(&got, "dolly", 30, files[f].format);
        move_free(&got.move);
        unlink(path);
    }
}

/* --- what names say --------------------------------------------------------- */

static const struct {
    const char *text;
    bool comma;
    double pan, dolly, t; /* of the second row; -1: not there */
} csv[] = {
    { "t,pan,dolly\n0,1,2\n1,10,30\n", false, 10, 30, 1 },
    { "T,PAN,Dolly\n0,1,2\n1,10,30\n", false, 10, 30, 1 },
    { "\xEF\xBB\xBFt,pan,dolly\r\n0,1,2\r\n1,10,30\r\n", false, 10, 30, 1 },
    { "\"t\",\"pan\",\"dolly\"\n\"0\",\"1\",\"2\"\n\"1\",\"10\",\"30\"\n",
      false, 10, 30, 1 },
    { "sep=;\r\nt;pan\r\n0;1\r\n1;10\r\n", false, 10, -1, 1 },
    { "time_s;pan_deg;dolly_mm\n0;0;0\n0,5;10,25;30,5\n", true, 10.25, 30.5,
      0.5 },
    { "t,pan\n0,0\n\"0,5\",\"10,25\"\n", true, 10.25, -1, 0.5 },
    { "t ; pan ; \n0;1;\n 1 ; 10 ; \n;;\n", false, 10, -1, 1 },
    { "# a comment\n\nt,pan,,\n0,1,,\n\n1,10,,,,\n,,,\n", false, 10, -1, 1 },
    { "time (ms),pan [rad],dolly (m)\n0,0,0\n500,3.14159265358979,0.03\n",
      false, 180, 30, 0.5 },
    { "t_ns,pan_rev,dolly_in\n0,0,0\n1000000000,0.25,2\n", false, 90, 50.8, 1 },
    { "frame,pan (\xC2\xB0)\n1001,0\n1013,10\n", false, 10, -1, 0.5 },
    { "time_min,dolly_cm\n0,0\n0.25,3\n", false, -1, 30, 15 },
    { "t,pan_deg,pan_deg_s\n0,0,0\n1,10,5\n", false, 10, -1, 1 },
    { "t,pan_rad_s,pan_rad\n0,0,0\n1,1,3.14159265358979\n", false, 180, -1, 1 },
    { "t,\"pan\"\"\"\n", false, -1, -1, -1 },
};

static void a_name_says_axis_and_unit(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(csv); i++) {
        struct import_settings settings = import_bench_settings(24);
        const char *path = import_bench_write(csv[i].text, strlen(csv[i].text));
        struct imported got;
        double pan = -1, dolly = -1, t = -1;
        settings.has_comma = csv[i].comma;
        if (import_format_find("csv")->read(&disk_files, path, &settings, &got,
                                            import_bench_message) == 0) {
            for (unsigned k = 0; k < got.move.axis_count; k++) {
                const struct motion_key *key = &got.move.axis[k].key[1].key;
                const bool is_pan = got.move.axis[k].name[0] == 'p';
                *(is_pan ? &pan : &dolly) =
                    (double)key->pos_q32 / MOTION_FIXED_ONE_Q32;
                t = (double)key->t_ns_q12 / (double)MOTION_FIXED_S_Q12;
            }
            move_free(&got.move);
        }
        unlink(path);
        if (fabs(pan - csv[i].pan) > 1e-8 ||
            fabs(dolly - csv[i].dolly) > 1e-8 || fabs(t - csv[i].t) > 1e-12)
            fail_msg("%zu: %g %g at %g: %s", i, pan, dolly, t,
                     pan < 0 ? import_bench_message : "");
    }
}

static void utf_16_is_read(void **state)
{
    static const char text[] = "t\tpan\r\n0\t1\r\n1\t10\r\n";
    char wide[2 * sizeof text];
    (void)state;
    for (int big = 0; big < 2; big++) {
        struct import_settings settings = import_bench_settings(24);
        size_t used = 0;
        wide[used++] = big ? '\xFE' : '\xFF';
        wide[used++] = big ? '\xFF' : '\xFE';
        for (size_t i = 0; i + 1 < sizeof text; i++) {
            wide[used++] = big ? 0 : text[i];
            wide[used++] = big ? text[i] : 0;
        }
        const char *path = import_bench_write(wide, used);
        struct imported got = import_bench_read_as("csv", path, &settings);
        unlink(path);
        check_axis(&got, "pan", 10, "UTF-16");
        move_free(&got.move);
    }
}

/* --- times ------------------------------------------------------------------- */

static const struct {
    const char *format, *text;
    uint64_t num, den;
    const char *want[3];
} timed[] = {
    { "csv",
      "frame,pan\n1,0\n2,1\n3,2\n",
      24,
      1,
      { "frame 0", "frame 1", "frame 2" } },
    { "csv",
      "frame,pan\n1001,0\n1002.5,1\n1003.25,2\n",
      24000,
      1001,
      { "frame 0", "frame 1.5", "frame 2.25" } },
    { "csv",
      "t,pan\n0,0\n0.042,1\n0.083,2\n",
      24,
      1,
      { "frame 0", "frame 1", "frame 2" } },
    { "csv",
      "t,pan\n12.3333,0\n12.3750,1\n12.4167,2\n",
      24,
      1,
      { "frame 0", "frame 1", "frame 2" } },
    { "csv",
      "t,pan\n0,0\n0.0333667,1\n0.0667333,2\n",
      30000,
      1001,
      { "frame 0", "frame 1", "frame 2" } },
    { "csv",
      "t,pan\n0,0\n0.05,1\n0.1,2\n",
      24,
      1,
      { "frame 0", "frame 1.2", "frame 2.4" } },
    { "csv", "t,pan\n0,0\n0.1,1\n0.2,2\n", 0, 0, { "0 s", "0.1 s", "0.2 s" } },
    { "kuper",
      "Axes = frame pan\n7 0\n8 1\n10 2\n",
      25,
      1,
      { "frame 0", "frame 1", "frame 3" } },
    { "maya",
      "animVersion 1.1; timeUnit film; anim t t pan 0 1 0; animData { "
      "output "
      "angular; keys { 1 0 flat flat 1 1 0; 2 1 flat flat 1 1 0; 30.5 2 "
      "flat "
      "flat 1 1 0; } }",
      0,
      0,
      { "frame 0", "frame 1", "frame 29.5" } },
};

static void times_that_are_frames_are_written_as_frames(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(timed); i++) {
        struct import_settings settings = import_bench_settings(0);
        settings.fps = (struct units_fps){ timed[i].num, timed[i].den };
        const char *path =
            import_bench_write(timed[i].text, strlen(timed[i].text));
        struct imported got =
            import_bench_read_as(timed[i].format, path, &settings);
        char text[1024];
        unlink(path);
        assert_int_equal(import_adjust(&settings, &got, import_bench_message),
                         0);
        path = import_bench_path("move.yaml");
        FILE *file = fopen(path, "wb");
        assert_int_equal(export_move(&got, "test", file, import_bench_message),
                         0);
        fclose(file);
        text[import_bench_read(path, text, sizeof text - 1)] = 0;
        unlink(path);
        for (int k = 0; k < 3; k++) {
            char want[64];
            snprintf(want, sizeof want, "[%s, %d", timed[i].want[k], k);
            if (strstr(text, want) == NULL)
                fail_msg("%zu: no %s in %s", i, want, text);
        }
        import_bench_check_move(&got);
        move_free(&got.move);
    }
}

/* --- scale, offset, turns ------------------------------------------------------ */

static double adjusted(const char *scale, const char *offset, bool unwrap,
                       const char *text, unsigned key)
{
    struct import_settings settings = import_bench_settings(24);
    const char *path = import_bench_write(text, strlen(text));
    struct imported got;
    double value = (double)NAN;

    settings.scale = scale;
    settings.offset = offset;
    settings.unwrap = unwrap;
    got = import_bench_read_as("csv", path, &settings);
    unlink(path);
    if (import_adjust(&settings, &got, import_bench_message) == 0)
        value = (double)got.move.axis[0].key[key].key.pos_q32 /
                MOTION_FIXED_ONE_Q32;
    move_free(&got.move);
    return value;
}

static void positions_are_scaled_moved_and_unwrapped(void **state)
{
    static const struct {
        const char *scale, *offset;
        bool unwrap;
        const char *text;
        unsigned key;
        double want; /* NAN: refused */
    } rows[] = {
        { "10", NULL, false, "pan\n1.5\n", 0, 15 },
        { "-1", "180", false, "pan\n1.5\n", 0, 178.5 },
        { "360/8192", NULL, false, "pan\n2048\n", 0, 90 },
        { "pan=2, dolly=3", NULL, false, "dolly\n7\n", 0, 21 },
        { "pan=2", NULL, false, "dolly\n7\n", 0, 7 },
        { NULL, "dolly=1 in,pan=1 rad", false, "dolly\n7\n", 0, 32.4 },
        { NULL, "-0.5", false, "dolly\n7\n", 0, 6.5 },
        { "1e-3", NULL, false, "dolly\n7\n", 0, 0.007 },
        { "0", NULL, false, "dolly\n7\n", 0, (double)NAN },
        { "1/0", NULL, false, "dolly\n7\n", 0, (double)NAN },
        { "ten", NULL, false, "dolly\n7\n", 0, (double)NAN },
        { "yaw=1", NULL, false, "dolly\n7\n", 0, (double)NAN },
        { NULL, "pan=2 mm", false, "pan\n7\n", 0, (double)NAN },
        { "1e9", NULL, false, "dolly\n7\n", 0, (double)NAN },
        { NULL, NULL, true, "pan\n179\n-179\n-177\n", 1, 181 },
        { NULL, NULL, true, "pan\n179\n-179\n-177\n", 2, 183 },
        { NULL, NULL, true, "pan\n-170\n170\n-170\n", 1, -190 },
        { NULL, NULL, true, "pan\n-170\n170\n-170\n", 2, -170 },
        { NULL, NULL, true, "pan\n0\n180\n0\n", 1, 180 },
        { NULL, NULL, true, "pan\n0\n730\n", 1, 10 },
        { NULL, NULL, true, "dolly\n0\n360\n", 1, 360 },
        { NULL, NULL, false, "pan\n179\n-179\n", 1, -179 },
        { "2", "1", true, "pan\n179\n-179\n", 1, 363 },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const double is = adjusted(rows[i].scale, rows[i].offset,
                                   rows[i].unwrap, rows[i].text, rows[i].key);
        if (isnan(rows[i].want) != isnan(is) || fabs(is - rows[i].want) > 1e-9)
            fail_msg("%zu: %.12g, expected %g (%s)", i, is, rows[i].want,
                     import_bench_message);
    }
}

static void scale_takes_velocities_and_handles_along(void **state)
{
    static const char table[] =
        "t,pan,pan_deg_s,pan_deg_s2\n0,0,0,0\n1,5,2,-4\n";
    static const char anim[] =
        "animVersion 1.1; timeUnit film; anim t t pan 0 1 0; animData { output "
        "angular; weighted 1; keys { 0 0 flat fixed 1 1 0 45 "
        "16.970562748477140586; 24 5 flat flat 1 1 0; } }";
    struct import_settings settings = import_bench_settings(0);
    (void)state;
    settings.scale = "-3";
    settings.offset = "1";
    struct imported got = import_bench_read_as(
        "csv", import_bench_write(table, strlen(table)), &settings);
    assert_int_equal(import_adjust(&settings, &got, import_bench_message), 0);
    const struct motion_key *key = &got.move.axis[0].key[1].key;
    assert_int_equal(key->pos_q32, q32(-14));
    assert_int_equal(vel_q32(key), q32(-6));
    assert_int_equal(acc_q32(key), q32(12));
    move_free(&got.move);
    got = import_bench_read_as("maya", import_bench_write(anim, strlen(anim)),
                               &settings);
    assert_int_equal(import_adjust(&settings, &got, import_bench_message), 0);
    assert_int_equal(got.move.axis[0].key[1].key.pos_q32, q32(-14));
    assert_in_range(got.move.axis[0].bezier.key[0].right.dp_q32 - q32(-12) + 4,
                    0, 8);
    move_free(&got.move);
    unlink(import_bench_path("in"));
}

/* --- statements of .anim -------------------------------------------------------- */

/* The same file with every blank between tokens a line end, and with none where a mark
 * stands: nothing is read differently. */
static void lines_make_no_difference_to_anim(void **state)
{
    static char data[1 << 16], other[1 << 17];
    (void)state;
    const size_t length =
        import_bench_read(DATA "tangents.anim", data, sizeof data - 1);
    data[length] = 0;
    for (char *at = data; (at = strpbrk(at, "#/")) != NULL;)
        memset(at, ' ', strcspn(at, "\r\n")); /* comments end with lines */
    struct import_settings settings = import_bench_settings(0);
    struct imported want =
        import_bench_read_as("maya", DATA "tangents.anim", &settings);
    for (int way = 0; way < 4; way++) {
        size_t used = 0;
        for (size_t i = 0; i < length; i++) {
            const bool is_mark = strchr("{};", data[i]) != NULL;
            const bool is_blank = strchr(" \t\r\n", data[i]) != NULL;
            if (way == 0)
                other[used++] = is_blank ? '\n' : data[i];
            else if (way == 1)
                other[used++] = is_blank ? ' ' : data[i];
            else if (way == 2 && is_mark)
                used += (size_t)snprintf(other + used, 16, "\r%c\r", data[i]);
            else if (way == 3 && is_mark)
                used +=
                    (size_t)snprintf(other + used, 32, " %c // ;}{\n", data[i]);
            else
                other[used++] = data[i];
        }
        const char *path = import_bench_write(other, used);
        struct imported got = import_bench_read_as("maya", path, &settings);
        unlink(path);
        assert_int_equal(got.fps.num, want.fps.num);
        assert_int_equal(got.move.axis_count, want.move.axis_count);
        for (uint32_t i = 0; i < got.move.axis_count; i++) {
            const struct plan_axis *a = &got.move.axis[i],
                                   *b = &want.move.axis[i];
            assert_int_equal(a->key_count, b->key_count);
            assert_int_equal(a->curve, b->curve);
            for (uint32_t k = 0; k < a->key_count; k++) {
                assert_int_equal(a->key[k].key.pos_q32, b->key[k].key.pos_q32);
                assert_int_equal(a->key[k].key.t_ns_q12,
                                 b->key[k].key.t_ns_q12);
                assert_int_equal(vel_q32(&a->key[k].key),
                                 vel_q32(&b->key[k].key));
            }
        }
        move_free(&got.move);
    }
    move_free(&want.move);
}

static void what_anim_has_and_nobody_knows_is_said(void **state)
{
    static const char text[] =
        "animVersion 1.1; mayaVersion 2015; mayaSceneFile C:/A b/c;\n"
        "timeUnit pal; layerMode 3;\n"
        "anim node 0 1 0;\nanim t t pan 0 1 0;\nanimData { output angular; "
        "colour 1 2 3; keys { 0 0 flat flat 1 1 0; } };\n";
    struct import_settings settings = import_bench_settings(0);
    (void)state;
    struct imported got = import_bench_read_as(
        "maya", import_bench_write(text, strlen(text)), &settings);
    assert_string_equal(got.note,
                        "2 statements of a kind that is not known, the "
                        "first 'layerMode' in line 2");
    assert_int_equal(got.fps.num, 25);
    move_free(&got.move);
    unlink(import_bench_path("in"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_format_counts_alike),
        cmocka_unit_test(a_number_that_does_not_fit_is_mended_by_what_is_said),
        cmocka_unit_test(a_name_says_axis_and_unit),
        cmocka_unit_test(utf_16_is_read),
        cmocka_unit_test(times_that_are_frames_are_written_as_frames),
        cmocka_unit_test(positions_are_scaled_moved_and_unwrapped),
        cmocka_unit_test(scale_takes_velocities_and_handles_along),
        cmocka_unit_test(lines_make_no_difference_to_anim),
        cmocka_unit_test(what_anim_has_and_nobody_knows_is_said),
    };
    return cmocka_run_group_tests(tests, import_bench_open, import_bench_close);
}
