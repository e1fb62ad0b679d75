/* tests/test_import_blender.c - actions from Blender, as the script of
 * examples/blender writes them. */
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "firmware/linux/import_blender.h"
#include "motion/err.h"
#include "motion/fixed.h"
#include "tests/check.h"

#define KEY(t, v, more)                                                        \
    "{\"t\":" #t ",\"v\":" #v ",\"lt\":" #t ",\"lv\":" #v ",\"rt\":" #t        \
    ",\"rv\":" #v ",\"hl\":\"AUTO\",\"hr\":\"AUTO\",\"interp\":\"BEZIER\","    \
    "\"easing\":\"AUTO\",\"amplitude\":0.5,\"period\":2,\"back\":1.5" more "}"
#define HEAD "{\"format\":\"slew-blender-1\",\"fps\":24,\"fps_base\":1.001,"
#define CURVE(keys)                                                            \
    HEAD "\"curves\":[{\"name\":\"location[0]\",\"extrapolation\":"            \
         "\"CONSTANT\",\"auto_smoothing\":\"NONE\",\"cycles\":{"               \
         "\"mode_before\":\"NONE\",\"mode_after\":\"MIRROR\","                 \
         "\"count_before\":0,\"count_after\":3},\"keys\":[" keys "]}]}"

static char path[] = "/tmp/test_import_blender.XXXXXX";
static char message[512];
static struct import_blender_curve want = { .name = "location[0]",
                                            .units_per_value = -1000 };

static int read_text(const char *text)
{
    FILE *file = fopen(path, "wb");

    assert_non_null(file);
    fputs(text, file);
    fclose(file);
    message[0] = '\0';
    return import_blender_read(path, &want, 1, message, sizeof message);
}

static int make_file(void **state)
{
    int fd = mkstemp(path);

    (void)state;
    return fd < 0 ? -1 : close(fd);
}

static int remove_file(void **state)
{
    (void)state;
    return remove(path);
}

static void an_action_is_read_in_the_axis_units(void **state)
{
    (void)state;
    assert_int_equal(
        read_text(CURVE(KEY(0, 1, "") "," KEY(24, 1.5, "") "," KEY(48, 0, ""))),
        0);
    const struct motion_fcurve *curve = &want.curve;
    assert_int_equal(curve->count, 3);
    /* 24 frames of 1001/24000 s, 1.5 m on an axis in mm that turns round */
    assert_int_equal(curve->key[1].at.t_ns_q12, INT64_C(1001000000) * 4096);
    assert_int_equal(curve->key[1].at.pos_q32,
                     INT64_C(-1500) * MOTION_FIXED_ONE_Q32);
    assert_int_equal(curve->key[1].amplitude_q32, INT64_C(500) << 32);
    assert_int_equal(curve->key[1].back_q32, MOTION_FIXED_ONE_Q32 * 3 / 2);
    assert_int_equal(curve->after.mode, MOTION_FCURVE_MIRROR);
    assert_int_equal(curve->after.count, 3);
    /* handles are computed, not read: the slope is -0.5 m in 24 frames */
    assert_true(curve->key[1].left.t_ns_q12 < curve->key[1].at.t_ns_q12);
    assert_true(curve->key[1].left.pos_q32 < curve->key[1].at.pos_q32);
    import_blender_free(&want, 1);
    assert_null(want.curve.key);
}

static void what_is_wrong_is_said(void **state)
{
    static const struct {
        const char *text, *says;
    } rows[] = {
        { "{\n \"format\": }", ":2:12: not JSON" },
        { "[]", "format: expected" },
        { HEAD "\"curves\":[]}", "curve 'location[0]': not in the file" },
        { CURVE(""), "keys: expected 1 to" },
        { CURVE(KEY(0, 1, "") "," KEY(0, 2, "")), "key 2: times do not" },
        { CURVE(KEY(0, "1", "")), "key 1: v: expected a number" },
        { CURVE(KEY(0, 1e300, "")), "key 1: v: 1e+300 is out of range" },
        { CURVE(KEY(1e18, 1, "")), "key 1: t: 1e+18 is out of range" },
        { CURVE("7"), "key 1: hl: expected a word" },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const int rc = read_text(rows[i].text);

        if (rc != -1 || !strstr(message, rows[i].says) || want.curve.key)
            fail_msg("%s: %d, \"%s\"", rows[i].says, rc, message);
    }
    assert_int_equal(
        import_blender_read("/nowhere", &want, 1, message, sizeof message), -1);
    assert_string_equal(message, "/nowhere: cannot be read");
}

static void an_unknown_word_is_quoted(void **state)
{
    (void)state;
    assert_int_equal(read_text(HEAD "\"curves\":[{\"name\":\"location[0]\","
                                    "\"extrapolation\":\"UP\\u0007\"}]}"),
                     -1);
    assert_non_null(strstr(message, "extrapolation: 'UP\\x07' is not known"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_action_is_read_in_the_axis_units),
        cmocka_unit_test(what_is_wrong_is_said),
        cmocka_unit_test(an_unknown_word_is_quoted),
    };

    return cmocka_run_group_tests(tests, make_file, remove_file);
}
