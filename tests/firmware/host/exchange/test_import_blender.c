/* tests/firmware/host/exchange/test_import_blender.c - actions from Blender, as
 * the script of examples/blender writes them, and back.  Blender itself: make
 * peers-blender. */
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/exchange/import.h"
#include "firmware/linux/base/disk.h"
#include "motion/core/fixed.h"
#include "tests/support/check.h"

#define KEY(t, v, more)                                                        \
    "{\"t\":" #t ",\"v\":" #v ",\"lt\":" #t ",\"lv\":" #v ",\"rt\":" #t        \
    ",\"rv\":" #v ",\"hl\":\"AUTO\",\"hr\":\"AUTO\",\"interp\":\"BEZIER\","    \
    "\"easing\":\"AUTO\",\"amplitude\":0.5,\"period\":2,\"back\":1.5" more "}"
#define HEAD                                                                   \
    "{\"format\":\"slew-blender-1\",\"fps\":24,\"fps_base\":1.001,"            \
    "\"frame_start\":1,\"frame_end\":97,\"lost\":[\"a driver\"],"
#define CURVE(unit, keys)                                                      \
    HEAD "\"curves\":[{\"name\":\"location[0]\",\"unit\":\"" unit              \
         "\",\"extrapolation\":\"CONSTANT\",\"auto_smoothing\":\"NONE\","      \
         "\"cycles\":{\"mode_before\":\"NONE\",\"mode_after\":\"MIRROR\","     \
         "\"count_before\":0,\"count_after\":3},\n\"keys\":[" keys "]}]}"

static char path[] = "/tmp/test_import_blender.XXXXXX";
static char message[YAML_MESSAGE_MAX];
static struct rig rig;
static struct import_settings settings = { .rig = &rig };
static struct imported got;

static int read_text(const char *text)
{
    FILE *file = fopen(path, "wb");

    assert_non_null(file);
    fputs(text, file);
    fclose(file);
    message[0] = '\0';
    return import_blender(&disk_files, path, &settings, &got, message);
}

static int make_file(void **state)
{
    int fd = mkstemp(path);

    (void)state;
    if (fd < 0 || close(fd) < 0)
        return -1;
    strcpy(settings.column[0], "dolly");
    settings.column_count = 1;
    return rig_load(&disk_files, "examples/dolly/rig.yaml", &rig, message);
}

static int remove_file(void **state)
{
    (void)state;
    return remove(path);
}

static void an_action_is_read_in_the_axis_units(void **state)
{
    (void)state;
    if (read_text(CURVE(
            "m", KEY(1, 1, "") "," KEY(25, 1.5, "") "," KEY(49, 0, ""))) != 0)
        fail_msg("%s", message);
    const struct plan_axis *axis = &got.move.axis[0];
    assert_string_equal(axis->name, "dolly");
    assert_int_equal(axis->curve, PLAN_CURVE_BEZIER);
    assert_int_equal(axis->key_count, 3);
    /* 24 frames of 1001/24000 s after the scene's first, metres on mm */
    assert_int_equal(axis->key[1].key.t_ns_q12, INT64_C(1001000000) * 4096);
    assert_int_equal(axis->key[1].key.pos_q32, INT64_C(1500) << 32);
    assert_int_equal(axis->bezier.key[1].left.kind, MOTION_FCURVE_AUTO);
    assert_int_equal(axis->bezier.after.mode, MOTION_FCURVE_MIRROR);
    assert_int_equal(axis->bezier.after.count, 3);
    /* cycles go on to the scene's last frame */
    assert_true(axis->bezier.has_end);
    assert_int_equal(axis->bezier.end_ns_q12, INT64_C(4004000000) * 4096);
    assert_int_equal(got.fps.num, 24000);
    assert_int_equal(got.fps.den, 1001);
    assert_string_equal(got.note, "1 in Blender, the first: a driver");
    move_free(&got.move);
}

static void free_handles_become_offsets(void **state)
{
    (void)state;
    assert_int_equal(
        read_text(CURVE(
            "mm", "{\"t\":1,\"v\":10,\"lt\":0,\"lv\":9,\"rt\":7,\"rv\":14.5,"
                  "\"hl\":\"VECTOR\",\"hr\":\"FREE\",\"interp\":\"ELASTIC\","
                  "\"easing\":\"EASE_IN_OUT\",\"amplitude\":0.5,\"period\":12,"
                  "\"back\":1.5}")),
        0);
    const struct plan_bezier_key *key = &got.move.axis[0].bezier.key[0];
    assert_int_equal(key->right.kind, MOTION_FCURVE_FREE);
    assert_int_equal(key->right.dt_ns_q12, INT64_C(250250000) * 4096);
    assert_int_equal(key->right.dp_q32, INT64_C(9) << 31);
    assert_int_equal(key->left.dp_q32, 0);
    assert_int_equal(key->interpolation, MOTION_FCURVE_ELASTIC);
    assert_int_equal(key->easing, MOTION_FCURVE_IN_OUT);
    assert_int_equal(key->amplitude_q32, INT64_C(1) << 31);
    assert_int_equal(key->period_ns_q12, INT64_C(500500000) * 4096);
    assert_int_equal(key->back_q32, 0);
    move_free(&got.move);
}

static void what_is_wrong_is_said_with_its_place(void **state)
{
    static const struct {
        const char *text, *says;
    } rows[] = {
        { "{\n \"format\": }]", ":2:1" },
        { "[]", ":1:1: the action is a list" },
        { HEAD "\"curves\":[]}", "curves has 0 items" },
        { CURVE("m", ""), ":2:8: keys has 0 items" },
        { CURVE("deg", KEY(0, 1, "")), "unit 'deg' does not fit axis dolly" },
        { CURVE("m", KEY(0, 1, "") "," KEY(0, 2, "")),
          ":2:147: key is not later than the one before it" },
        { CURVE("m", KEY(0, "1 m", "")), "v '1 m' is not a number" },
        { CURVE("m", KEY(0, 1e300, "")), "v '1e300m' is too large" },
        { CURVE("m", KEY(1e18, 1, "")), "t 'f1e+18' is too large" },
        { CURVE("m", "7"), "key is a single value" },
        { CURVE("m", KEY(0, 1, ",\"x\":1")), "unknown key 'x'" },
        { CURVE("km", KEY(0, 1, "")), "unknown unit 'km'" },
        { "{\"format\":\"slew-blender-9\"}",
          "unknown format 'slew-blender-9'" },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const int rc = read_text(rows[i].text);

        if (rc != -1 || !strstr(message, rows[i].says) ||
            got.move.axis_count != 0)
            fail_msg("%s: %d, \"%s\"", rows[i].says, rc, message);
    }
    assert_int_equal(
        import_blender(&disk_files, "/nowhere", &settings, &got, message), -1);
    assert_non_null(strstr(message, "/nowhere:1:1: the file cannot be read"));
}

static void names_find_their_axes(void **state)
{
    (void)state;
    settings.column_count = 0;
    assert_int_equal(read_text(CURVE("m", KEY(0, 1, ""))), -1);
    assert_non_null(strstr(message, "'x' is not an axis of the rig"));
    settings.column_count = 1;
}

/* --- round trip ----------------------------------------------------------- */

static uint64_t seed = UINT64_C(0x5EED5EED5EED);

static int64_t pick(int64_t low, int64_t high)
{
    return check_random_in(&seed, low, high);
}

static void draw_handle(struct plan_handle *handle, int sign)
{
    *handle = (struct plan_handle){ .kind = (uint8_t)pick(0, 4) };
    if (handle->kind > MOTION_FCURVE_ALIGNED)
        return;
    handle->dt_ns_q12 = sign * pick(0, INT64_C(1) << 44);
    handle->dp_q32 = pick(-(INT64_C(1) << 42), INT64_C(1) << 42);
}

static void draw_key(struct plan_bezier_key *key)
{
    draw_handle(&key->left, -1);
    draw_handle(&key->right, 1);
    key->interpolation = (uint8_t)pick(0, 12);
    key->easing = key->interpolation >= MOTION_FCURVE_SINE
                      ? (uint8_t)pick(0, 3)
                      : MOTION_FCURVE_BY_KIND;
    key->back_q32 = 0;
    key->amplitude_q32 = key->period_ns_q12 = 0;
    if (key->interpolation == MOTION_FCURVE_BACK)
        key->back_q32 = pick(0, INT64_C(3) << 32);
    if (key->interpolation == MOTION_FCURVE_ELASTIC) {
        key->amplitude_q32 = pick(0, INT64_C(1) << 42);
        key->period_ns_q12 = pick(0, INT64_C(1) << 42);
    }
}

static unsigned dolly; /* index in the rig */

static void draw_job(struct job *job)
{
    struct plan_axis *axis;

    job->rig = rig;
    assert_int_equal(plan_move_reserve(&job->move, 1), 0);
    axis = job->move.axis;
    job->rig_axis = &dolly;
    dolly = (unsigned)rig_axis_index(&rig, "dolly");
    job->move.axis_count = 1;
    strcpy(axis->name, "dolly");
    axis->curve = PLAN_CURVE_BEZIER;
    axis->key_count = (uint32_t)pick(1, 40);
    axis->key = calloc(axis->key_count, sizeof *axis->key);
    axis->bezier.key = calloc(axis->key_count, sizeof *axis->bezier.key);
    axis->bezier.extrapolation = (uint8_t)pick(0, 1);
    axis->bezier.smoothing = (uint8_t)pick(0, 1);
    axis->bezier.after.mode = (uint8_t)pick(0, 3);
    axis->bezier.after.count = (uint32_t)pick(1, 5);
    assert_non_null(axis->key);
    assert_non_null(axis->bezier.key);
    for (uint32_t i = 0; i < axis->key_count; i++) {
        axis->key[i].key.t_ns_q12 =
            i == 0 ? pick(-(INT64_C(1) << 45), INT64_C(1) << 45)
                   : axis->key[i - 1].key.t_ns_q12 + pick(1, INT64_C(1) << 45);
        axis->key[i].key.pos_q32 = pick(-(INT64_C(1) << 52), INT64_C(1) << 52);
        draw_key(&axis->bezier.key[i]);
    }
    job->end_ns_q12 = INT64_C(1) << 52;
}

static bool same_handle(const struct plan_handle *a,
                        const struct plan_handle *b)
{
    return a->kind == b->kind && a->dt_ns_q12 == b->dt_ns_q12 &&
           a->dp_q32 == b->dp_q32;
}

static bool same_easing(const struct plan_bezier_key *a,
                        const struct plan_bezier_key *b)
{
    return a->interpolation == b->interpolation && a->easing == b->easing &&
           a->back_q32 == b->back_q32 && a->amplitude_q32 == b->amplitude_q32 &&
           a->period_ns_q12 == b->period_ns_q12;
}

static void same_key(uint32_t i, const struct plan_axis *a,
                     const struct plan_axis *b)
{
    const struct plan_bezier_key *p = &a->bezier.key[i], *q = &b->bezier.key[i];

    if (a->key[i].key.t_ns_q12 != b->key[i].key.t_ns_q12 ||
        a->key[i].key.pos_q32 != b->key[i].key.pos_q32 ||
        !same_handle(&p->left, &q->left) ||
        !same_handle(&p->right, &q->right) || !same_easing(p, q))
        fail_msg("key %u comes back as another", i + 1);
}

static void same_axis(const struct plan_axis *a, const struct plan_axis *b)
{
    assert_int_equal(a->key_count, b->key_count);
    assert_int_equal(a->bezier.extrapolation, b->bezier.extrapolation);
    assert_int_equal(a->bezier.smoothing, b->bezier.smoothing);
    assert_int_equal(a->bezier.after.mode, b->bezier.after.mode);
    if (a->bezier.after.mode != MOTION_FCURVE_ONCE)
        assert_int_equal(a->bezier.after.count, b->bezier.after.count);
    for (uint32_t i = 0; i < a->key_count; i++)
        same_key(i, a, b);
}

/* As JSON, and then as move.yaml, to the bit. */
static void what_is_written_is_read_to_the_bit(void **state)
{
    static const struct units_fps rates[] = {
        { 24, 1 }, { 25, 1 }, { 24000, 1001 }, { 30, 1 }
    };
    static struct job job;
    struct plan_move back;

    (void)state;
    for (int round = 0; round < 200; round++) {
        const struct units_fps *fps = &rates[round % 4];
        FILE *file = fopen(path, "wb");

        memset(&job, 0, sizeof job);
        draw_job(&job);
        /* the frames that its ALIGNED handles were drawn with */
        job.move.axis[0].bezier.frame_ns_q12 = import_frame_ns_q12(fps, 1);
        assert_non_null(file);
        if (export_blender(&job, fps, file, message) < 0)
            fail_msg("%s", message);
        fclose(file);
        if (import_blender(&disk_files, path, &settings, &got, message) < 0)
            fail_msg("round %d: %s", round, message);
        same_axis(&job.move.axis[0], &got.move.axis[0]);
        file = fopen(path, "wb");
        assert_non_null(file);
        assert_int_equal(export_move(&got, "blender", file, message), 0);
        fclose(file);
        if (move_load(&disk_files, path, &rig, &back, message) < 0)
            fail_msg("round %d: %s", round, message);
        same_axis(&job.move.axis[0], &back.axis[0]);
        move_free(&back);
        move_free(&got.move);
        move_free(&job.move);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_action_is_read_in_the_axis_units),
        cmocka_unit_test(free_handles_become_offsets),
        cmocka_unit_test(what_is_wrong_is_said_with_its_place),
        cmocka_unit_test(names_find_their_axes),
        cmocka_unit_test(what_is_written_is_read_to_the_bit),
    };

    return cmocka_run_group_tests(tests, make_file, remove_file);
}
