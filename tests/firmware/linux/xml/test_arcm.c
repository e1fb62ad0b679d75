/* tests/firmware/linux/xml/test_arcm.c - arc moves of Dragonframe: every point and
 * control point as the file has it, to the last digit that slew keeps. */
#include "firmware/linux/xml/arcm.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "firmware/linux/base/disk.h"
#include "motion/core/fixed.h"
#include "tests/firmware/host/exchange/import_bench.h"

#define SCENE(axes)                                                            \
    "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"                             \
    "<scen:scene xmlns:scen=\"http://caliri.com/motion/scene\">\n" axes        \
    "</scen:scene>\n"
#define AXIS(name, inside)                                                     \
    "<scen:axis name=\"" name "\" " inside "</scen:axis>\n"
#define AT(x, y) "<scen:points x=\"" x "\" y=\"" y "\"/>"
#define BY(x, y) "<scen:controlPoints x=\"" x "\" y=\"" y "\"/>"
#define TWO      AT("1", "0") AT("25", "10") BY("9", "0") BY("17", "10")
#define TEXT_MAX (1 << 18)
#define KEYS_MAX 40
#define MOVES    200

static int read_text(const char *text, uint64_t fps, struct imported *got)
{
    const struct import_settings settings = import_bench_settings(fps);
    const char *path = import_bench_write(text, strlen(text));
    const int err = arcm_format.read(&disk_files, path, &settings, got,
                                     import_bench_message);

    unlink(path);
    return err;
}

/* ---- what is right ---- */

struct curve {
    unsigned count;
    double x[KEYS_MAX], y[KEYS_MAX];
    double right[KEYS_MAX][2], left[KEYS_MAX][2];
};

static double between(uint64_t *state, double from, double to)
{
    return from +
           (to - from) * ldexp((double)check_random_in(state, 0, 1 << 30), -30);
}

static void draw_curve(uint64_t *state, struct curve *curve)
{
    curve->count = (unsigned)check_random_in(state, 1, KEYS_MAX);
    for (unsigned i = 0; i < curve->count; i++) {
        curve->x[i] = i == 0 ? between(state, -100, 100)
                             : curve->x[i - 1] + between(state, 0.5, 60);
        curve->y[i] = between(state, -50, 50);
    }
    for (unsigned i = 0; i + 1 < curve->count; i++) {
        const double span = curve->x[i + 1] - curve->x[i];
        curve->right[i][0] = curve->x[i] + span * between(state, 0.01, 0.9);
        curve->right[i][1] = between(state, -50, 50);
        curve->left[i + 1][0] =
            curve->x[i + 1] - span * between(state, 0.01, 0.9);
        curve->left[i + 1][1] = between(state, -50, 50);
    }
}

static size_t put(char *text, const char *what, double x, double y)
{
    return (size_t)sprintf(text, "<scen:%s y=\"%.17g\" x=\"%.17g\" />", what, y,
                           x);
}

/* In the order of an add-on for Blender that writes them. */
static size_t write_curve(char *text, const char *name, const char *unit,
                          const struct curve *curve)
{
    size_t used = (size_t)sprintf(text, "<scen:axis name=\"%s\" units=\"%s\">",
                                  name, unit);

    for (unsigned i = 0; i < curve->count; i++)
        used += put(text + used, "points", curve->x[i], curve->y[i]);
    for (unsigned i = 0; i < curve->count; i++) {
        if (i > 0)
            used += put(text + used, "controlPoints", curve->left[i][0],
                        curve->left[i][1]);
        if (i + 1 < curve->count)
            used += put(text + used, "controlPoints", curve->right[i][0],
                        curve->right[i][1]);
    }
    return used + (size_t)sprintf(text + used, "</scen:axis>\n");
}

static void expect_near(int64_t got, double want, double within)
{
    if (fabs((double)got - want) > within)
        fail_msg("expected %.3f, got %lld", want, (long long)got);
}

static void expect_curve(const struct plan_axis *axis,
                         const struct curve *curve, double first, double scale)
{
    const double frame = (double)MOTION_FIXED_S_Q12 / 24, one = ldexp(1, 32);
    const struct plan_bezier_key *bezier = axis->bezier.key;

    assert_int_equal(axis->curve, PLAN_CURVE_BEZIER);
    assert_int_equal(axis->key_count, curve->count);
    for (unsigned i = 0; i < curve->count; i++) {
        const double *right = curve->right[i], *left = curve->left[i];
        expect_near(axis->key[i].key.t_ns_q12, (curve->x[i] - first) * frame,
                    4);
        expect_near(axis->key[i].key.pos_q32, curve->y[i] * scale * one, 2);
        if (i + 1 < curve->count) {
            expect_near(bezier[i].right.dt_ns_q12,
                        (right[0] - curve->x[i]) * frame, 4);
            expect_near(bezier[i].right.dp_q32,
                        (right[1] - curve->y[i]) * scale * one, 3);
        }
        if (i == 0)
            continue;
        expect_near(bezier[i].left.dt_ns_q12, (left[0] - curve->x[i]) * frame,
                    4);
        expect_near(bezier[i].left.dp_q32,
                    (left[1] - curve->y[i]) * scale * one, 3);
    }
}

static void every_point_is_kept(void **state)
{
    static struct curve pan, dolly;
    static struct imported got;
    static char text[TEXT_MAX];
    uint64_t seed = SEED;

    (void)state;
    for (int n = 0; n < MOVES; n++) {
        draw_curve(&seed, &pan);
        draw_curve(&seed, &dolly);
        const double first = fmin(pan.x[0], dolly.x[0]);
        size_t used = (size_t)sprintf(text, "<scen:scene>");
        used += write_curve(text + used, "pan", "deg", &pan);
        used += write_curve(text + used, "dolly", "cm", &dolly);
        sprintf(text + used, "</scen:scene>");
        if (read_text(text, 24, &got) < 0)
            fail_msg("%s", import_bench_message);
        assert_string_equal(got.note, "");
        expect_curve(&got.move.axis[0], &pan, first, 1);
        expect_curve(&got.move.axis[1], &dolly, first, 10);
        move_free(&got.move);
    }
}

static const struct {
    const char *text, *note;
} odd[] = {
    { SCENE(AXIS("pan", ">" TWO)), "" },
    { SCENE(AXIS("PAN",
                 "base=\"0.0\" integral=\"false\" stepsPerUnit=\"44\">" TWO)),
      "" },
    { SCENE(AXIS("pan", "base=\"2\">" TWO)),
      "1 axis has a base, the first '2' in line 3" },
    { SCENE(AXIS("pan", "integral=\"true\">" TWO)),
      "1 axis is an integral, the first 'true' in line 3" },
    { SCENE(AXIS("pan", "ease=\"0.3\">" TWO "<scen:hold/>")),
      "1 unknown element, the first 'hold' in line 3; 1 unknown attribute, the "
      "first 'ease' in line 3" },
    { SCENE("<scen:dmx><scen:axis name=\"x\"/></scen:dmx>\n" AXIS("pan",
                                                                  ">" TWO)),
      "2 unknown elements, the first 'dmx' in line 3" },
    { SCENE(AXIS("pan",
                 ">" AT("1", "0") AT("25", "10") BY("0", "0") BY("80", "10"))),
      "2 control points beyond" },
    { SCENE(AXIS("pan",
                 ">" AT("1", "0") AT("25", "10") BY("26", "0") BY("-5", "10"))),
      "2 control points beyond the points beside (shortened)" },
    { SCENE(AXIS("pan", "><scen:points x=\"1\" y=\"2\" type=\"5\"/>")),
      "1 point has a type, the first '5' in line 3" },
};

static void what_has_no_place_is_said(void **state)
{
    static struct imported got;

    (void)state;
    for (size_t i = 0; i < sizeof odd / sizeof *odd; i++) {
        if (read_text(odd[i].text, 24, &got) < 0)
            fail_msg("%zu: %s", i, import_bench_message);
        if (odd[i].note[0] == 0 ? got.note[0] != 0
                                : strstr(got.note, odd[i].note) == NULL)
            fail_msg("%zu: expected \"%s\", got \"%s\"", i, odd[i].note,
                     got.note);
        move_free(&got.move);
    }
}

/* Control points in their points make a straight line in whatever time. */
static void no_handles_are_a_line(void **state)
{
    static struct imported got;

    (void)state;
    assert_int_equal(
        read_text(SCENE(AXIS("pan", ">" AT("1", "3") AT("31", "-6") BY("1", "3")
                                        BY("31", "-6"))),
                  30, &got),
        0);
    const struct plan_bezier_key *key = got.move.axis[0].bezier.key;
    assert_int_equal(key[0].right.dt_ns_q12, MOTION_FIXED_S_Q12 / 3);
    assert_int_equal(key[0].right.dp_q32, -(INT64_C(3) << 32));
    assert_int_equal(key[1].left.dt_ns_q12, -(MOTION_FIXED_S_Q12 / 3));
    assert_int_equal(key[1].left.dp_q32, INT64_C(3) << 32);
    assert_string_equal(got.first, "1");
    import_bench_check_move(&got);
    move_free(&got.move);
}

/* ---- what is wrong ---- */

static const struct {
    const char *text, *want;
    uint64_t fps;
} wrong[] = {
    { SCENE(AXIS("pan", ">" TWO)), ":1:1: the file gives no frame rate", 0 },
    { "<scene><axis", ":1:8: unclosed token", 24 },
    { "<robot/>", ":1:1: is no arc move, expected <scen:scene>", 24 },
    { SCENE(""), ":1:1: the scene has no axis", 24 },
    { SCENE(AXIS("", ">" TWO)), ":3:1: the axis has no name", 24 },
    { SCENE(AXIS("crane", ">" TWO)), ":3:1: 'crane' is not an axis of the rig",
      24 },
    { SCENE(AXIS("pan", ">" TWO) AXIS("Pan", ">" TWO)),
      ":4:1: axis pan appears twice", 24 },
    { SCENE(AXIS("pan", "units=\"mm\">" TWO)),
      ":3:1: 'mm' is no unit of axis pan, whose unit is deg", 24 },
    { SCENE(AXIS("pan", "units=\"parsec\">" TWO)),
      ":3:1: 'parsec' is no unit of axis pan", 24 },
    { SCENE(AXIS("pan", "/><scen:axis name=\"tilt\">")),
      ":3:1: the axis has no points", 24 },
    { SCENE(AXIS("pan", ">" AT("1", "0") AT("25", "10"))),
      ":3:1: the axis has 2 points and 0 control points, expected 2", 24 },
    { SCENE(AXIS("pan", ">" TWO BY("1", "2"))),
      ":3:1: the axis has 2 points and 3 control points, expected 2", 24 },
    { SCENE(AXIS("pan", ">" BY("1", "2") AT("1", "2"))),
      ":3:1: the axis has 1 point and 1 control point, expected 0", 24 },
    { SCENE(AXIS("pan", "><scen:points y=\"2\"/>")),
      ":3:24: points has no x, expected x, a frame, and y", 24 },
    { SCENE(AXIS("pan", ">" AT("1", "0x2"))),
      ":3:24: expected a number, and not '0x2'", 24 },
    { SCENE(AXIS("pan", ">" AT("1", "1 2"))),
      ":3:24: expected a number, and not '1 2'", 24 },
    { SCENE(AXIS("pan", ">" AT("nan", "1"))),
      ":3:24: expected a number, and not 'nan'", 24 },
    { SCENE(AXIS("pan",
                 ">" AT("9", "0") AT("9", "10") BY("9", "0") BY("9", "10"))),
      "the point is not later than the one before it", 24 },
    { SCENE(AXIS("pan", ">" AT("1", "9e9"))), "is too large", 24 },
};

static void what_is_wrong_is_said(void **state)
{
    static struct imported got;

    (void)state;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        assert_int_equal(read_text(wrong[i].text, wrong[i].fps, &got), -1);
        if (strstr(import_bench_message, wrong[i].want) == NULL)
            fail_msg("%zu: expected \"%s\" in \"%s\"", i, wrong[i].want,
                     import_bench_message);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_point_is_kept),
        cmocka_unit_test(what_has_no_place_is_said),
        cmocka_unit_test(no_handles_are_a_line),
        cmocka_unit_test(what_is_wrong_is_said),
    };
    return cmocka_run_group_tests(tests, import_bench_open, import_bench_close);
}
