/* tests/firmware/host/exchange/test_import.c - moves of other programs: what is
 * read. */
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "tests/firmware/host/exchange/import_bench.h"

static void tables_are_read_row_by_frame(void **state)
{
    static const struct {
        const char *format, *path;
        uint64_t fps;
        int64_t ns; /* of the second row */
        unsigned rows;
        double tilt; /* of the second row */
    } rows[] = {
        { "kuper", DATA "kuper.txt", 25, 40000000, 4, 5.0420 },
        { "flair", DATA "flair.txt", 0, 40000000, 4, 5.0420 },
        { "flair", DATA "flair.txt", 50, 20000000, 4, 5.0420 },
        { "raw", DATA "raw.txt", 20, 50000000, 3, 5.0420 },
        { "csv", DATA "table.csv", 0, 250000000, 3, 2 },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct import_settings settings =
            import_bench_named(rows[i].format, rows[i].fps);
        struct imported got =
            import_bench_read_as(rows[i].format, rows[i].path, &settings);
        const struct plan_axis *tilt = &got.move.axis[1];
        assert_string_equal(got.move.axis[0].name, "pan");
        assert_string_equal(tilt->name, "tilt");
        assert_int_equal(tilt->key_count, rows[i].rows);
        assert_int_equal(tilt->key[0].key.t_ns_q12, 0);
        assert_int_equal(tilt->key[1].key.t_ns_q12, rows[i].ns * 4096);
        assert_int_equal(tilt->key[1].key.pos_q32, q32(rows[i].tilt));
        assert_string_equal(got.note, "");
        import_bench_check_move(&got);
        move_free(&got.move);
    }
}

static void csv_keeps_velocity_and_acceleration(void **state)
{
    struct import_settings settings = import_bench_settings(0);
    (void)state;
    struct imported got =
        import_bench_read_as("csv", DATA "table.csv", &settings);
    const struct motion_key *key = &got.move.axis[0].key[1].key;
    assert_int_equal(got.move.axis[0].curve, PLAN_CURVE_QUINTIC);
    assert_true(key->has_vel && key->has_acc);
    assert_int_equal(vel_q32(key), q32(2.5));
    assert_int_equal(acc_q32(key), -(INT64_C(1) << 31));
    assert_false(got.move.axis[1].key[1].key.has_vel);
    move_free(&got.move);
}

static void columns_go_where_the_user_says(void **state)
{
    struct import_settings settings = import_bench_settings(25);
    (void)state;
    assert_int_equal(
        import_settings_columns(&settings, "-,dolly", import_bench_message), 0);
    struct imported got =
        import_bench_read_as("kuper", DATA "kuper.txt", &settings);
    assert_int_equal(got.move.axis_count, 1);
    assert_string_equal(got.move.axis[0].name, "dolly");
    assert_int_equal(got.move.axis[0].key[0].key.pos_q32, q32(6.1465));
    move_free(&got.move);
}

static void tangents_become_velocities_and_losses_are_said(void **state)
{
    struct import_settings settings = import_bench_settings(0);
    (void)state;
    struct imported got =
        import_bench_read_as("maya", DATA "tangents.anim", &settings);
    const struct plan_key *key = got.move.axis[0].key;
    assert_int_equal(got.move.axis[0].curve, PLAN_CURVE_HERMITE);
    assert_int_equal(key[0].key.t_ns_q12, 0);
    assert_int_equal(key[1].key.t_ns_q12, MOTION_FIXED_S_Q12 / 2);
    assert_int_equal(vel_q32(&key[0].key), 0);
    /* 45 degrees: one degree a frame */
    assert_in_range(vel_q32(&key[1].key) - q32(24) + 2, 0, 4);
    /* from 13 to 49: -5 degrees in 1.5 s */
    assert_in_range(vel_q32(&key[2].key) - q32(-5 / 1.5) + 2, 0, 4);
    assert_string_equal(got.note, "1 automatic tangents (by slew's rule)");
    /* the second curve is linear, in centimetres */
    assert_int_equal(got.move.axis[1].curve, PLAN_CURVE_LINEAR);
    assert_int_equal(got.move.axis[1].key[1].key.pos_q32, q32(225));
    import_bench_check_move(&got);
    move_free(&got.move);
}

#define ANIM_HEAD "animVersion 1.1;\ntimeUnit film;\nendTime %s;\n"
#define ANIM_CURVE                                                             \
    "anim a.b pan pan 0 0 0;\nanimData {\noutput angular;\nweighted %d;\n"     \
    "preInfinity %s;\npostInfinity %s;\nkeys {\n%s}\n}\n"

static struct imported anim_of(const char *end, int weighted,
                               const char *infinity, const char *keys)
{
    struct import_settings settings = import_bench_settings(0);
    char text[1024];
    const int length = snprintf(text, sizeof text, ANIM_HEAD ANIM_CURVE, end,
                                weighted, infinity, infinity, keys);
    struct imported got = import_bench_read_as(
        "maya", import_bench_write(text, (size_t)length), &settings);
    unlink(import_bench_path("in"));
    return got;
}

static void check_handle(const struct plan_handle *handle, double frames,
                         double rise)
{
    assert_int_equal(handle->kind, MOTION_FCURVE_FREE);
    const int64_t dt = (int64_t)(frames * (double)MOTION_FIXED_S_Q12 / 24);
    assert_in_range(handle->dt_ns_q12 - dt + 4, 0, 8);
    assert_in_range(handle->dp_q32 - q32(rise) + 2, 0, 4);
}

static void weighted_and_broken_tangents_become_handles(void **state)
{
    (void)state;
    /* 12 sqrt 2 long at 45 deg: 12 by 12, a third of it is 4 by 4 */
    struct imported got =
        anim_of("24", 1, "constant",
                "0 1 fixed fixed 1 1 0 0 1 45 16.970562748477140586;\n"
                "24 11 fixed flat 1 1 0 -90 3;\n");
    const struct plan_bezier_key *key = got.move.axis[0].bezier.key;
    assert_int_equal(got.move.axis[0].curve, PLAN_CURVE_BEZIER);
    check_handle(&key[0].right, 4, 4);
    check_handle(&key[1].left, 0, 1);
    assert_string_equal(got.note, "");
    import_bench_check_move(&got);
    move_free(&got.move);

    /* up at 2 units a frame, down at 1; without weights a third of the span */
    got = anim_of("60", 0, "constant",
                  "0 1 flat flat 1 1 0;\n"
                  "24 11 fixed fixed 1 1 0 63.434948822922010648 9 -45 9;\n"
                  "36 0 linear linear 1 1 0;\n");
    key = got.move.axis[0].bezier.key;
    assert_int_equal(got.move.axis[0].curve, PLAN_CURVE_BEZIER);
    check_handle(&key[0].right, 8, 0);
    check_handle(&key[1].left, -8, -16);
    check_handle(&key[1].right, 4, -4);
    check_handle(&key[2].left, -4, 11.0 / 3);
    check_handle(&key[2].right, 4, 0);
    assert_false(got.move.axis[0].bezier.has_end);
    move_free(&got.move);

    got = anim_of("24", 1, "constant",
                  "0 1 flat fixed 1 1 0 0 99;\n24 11 flat flat 1 1 0;\n");
    assert_string_equal(got.note, "1 tangents beyond the next key (shortened)");
    move_free(&got.move);
}

static void broadcast_rates_are_what_they_are_in_maya(void **state)
{
    static const struct {
        const char *text;
        uint64_t num, den;
    } rows[] = {
        { "23.976fps", 24000, 1001 }, { "29.97df", 30000, 1001 },
        { "59.94fps", 60000, 1001 },  { "12fps", 12, 1 },
        { "12.5fps", 25, 2 },         { "palf", 50, 1 },
    };
    struct import_settings settings = import_bench_settings(0);
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        char text[256];
        const int length =
            snprintf(text, sizeof text,
                     "animVersion 1.1;\ntimeUnit %s;\nanim a pan;\nanimData {\n"
                     "output angular;\nkeys {\n0 1 flat flat 1 1 0;\n}\n}\n",
                     rows[i].text);
        struct imported got = import_bench_read_as(
            "maya", import_bench_write(text, (size_t)length), &settings);
        assert_int_equal(got.fps.num, rows[i].num);
        assert_int_equal(got.fps.den, rows[i].den);
        move_free(&got.move);
    }
    unlink(import_bench_path("in"));
}

static void infinities_play_until_the_file_ends(void **state)
{
    static const struct {
        const char *word;
        int mode, extrapolation;
    } rows[] = {
        { "linear", MOTION_FCURVE_ONCE, MOTION_FCURVE_LINE },
        { "cycle", MOTION_FCURVE_REPEAT, MOTION_FCURVE_HOLD },
        { "cycleRelative", MOTION_FCURVE_REPEAT_OFFSET, MOTION_FCURVE_HOLD },
        { "oscillate", MOTION_FCURVE_MIRROR, MOTION_FCURVE_HOLD },
    };
    const char *keys = "12 1 flat flat 1 1 0;\n36 2 fixed fixed 1 1 0 45 1 45 "
                       "1;\n";
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct imported got = anim_of("60", 0, rows[i].word, keys);
        const struct plan_bezier *bezier = &got.move.axis[0].bezier;
        assert_int_equal(got.move.axis[0].curve, PLAN_CURVE_BEZIER);
        assert_int_equal(bezier->before.mode, rows[i].mode);
        assert_int_equal(bezier->after.mode, rows[i].mode);
        assert_int_equal(bezier->after.count, 0);
        assert_int_equal(bezier->extrapolation, rows[i].extrapolation);
        assert_true(bezier->has_end);
        assert_int_equal(bezier->end_ns_q12, 2 * MOTION_FIXED_S_Q12);
        check_handle(&bezier->key[1].right, 8, i == 0 ? 8 : 0);
        assert_string_equal(got.note, "");
        import_bench_check_move(&got);
        move_free(&got.move);
    }
    struct imported got = anim_of("36", 0, "cycle", keys);
    assert_int_equal(got.move.axis[0].bezier.after.mode, MOTION_FCURVE_ONCE);
    assert_string_equal(got.note,
                        "1 infinities that begin where the file ends");
    move_free(&got.move);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tables_are_read_row_by_frame),
        cmocka_unit_test(csv_keeps_velocity_and_acceleration),
        cmocka_unit_test(columns_go_where_the_user_says),
        cmocka_unit_test(tangents_become_velocities_and_losses_are_said),
        cmocka_unit_test(weighted_and_broken_tangents_become_handles),
        cmocka_unit_test(broadcast_rates_are_what_they_are_in_maya),
        cmocka_unit_test(infinities_play_until_the_file_ends),
    };
    return cmocka_run_group_tests(tests, import_bench_open, import_bench_close);
}
