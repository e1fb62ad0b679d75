/* tests/firmware/host/rig/test_rig_load.c - rig.yaml and move.yaml: what is read,
 * what is refused, and where the refusal points.
 *
 * test_rig_load --fields prints the readers' tables, for
 * tests/proofs/check_schema.py.  Takes long. */
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/rig/rig.h"
#include "firmware/host/yaml/yaml_shapes.h"
#include "firmware/linux/base/disk.h"
#include "tests/support/check.h"

#define GOOD_RIG  "examples/dolly/rig.yaml"
#define GOOD_MOVE "examples/dolly/move.yaml"
#define GANTRY    "examples/flyby/rig.yaml"

#define Q32(a) ((int64_t)((a)*4294967296.0))
#define MS(a)  ((int64_t)(a)*1000000)

static struct rig rig, gantry;

/* ---- files made by the tests ---- */

static char scratch[] = "/tmp/test_rig_load_XXXXXX";

static int make_scratch(void **state)
{
    const int file = mkstemp(scratch);
    char message[YAML_MESSAGE_MAX];
    (void)state;
    if (file < 0)
        return -1;
    close(file);
    return rig_load(&disk_files, GANTRY, &gantry, message) < 0
               ? -1
               : rig_load(&disk_files, GOOD_RIG, &rig, message);
}

static int remove_scratch(void **state)
{
    (void)state;
    return remove(scratch);
}

static void write_scratch(const char *text, size_t length)
{
    FILE *file = fopen(scratch, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, length, file), length);
    fclose(file);
}

/* ---- loading either kind ---- */

/* FLIGHT: a move for the gantry. */
enum kind { RIG, MOVE, FLIGHT };

static int load(enum kind kind, const char *path, char *message)
{
    static struct rig other;
    struct plan_move move;
    int err;

    memset(message, 'X', YAML_MESSAGE_MAX);
    if (kind == RIG)
        return rig_load(&disk_files, path, &other, message);
    err = move_load(&disk_files, path, kind == MOVE ? &rig : &gantry, &move,
                    message);
    if (err == 0)
        move_free(&move);
    else
        assert_int_equal(move.axis_count, 0);
    return err;
}

/* Past a number from 1 and the separator after it; NULL when they are not
 * there. */
static const char *skip_number(const char *text, const char *separator)
{
    char *end;

    if (text == NULL || strtoul(text, &end, 10) == 0 ||
        strncmp(end, separator, strlen(separator)) != 0)
        return NULL;
    return end + strlen(separator);
}

/* "path:line:column: what, expected ...", one printable line. */
static bool is_well_formed(const char *path, const char *message)
{
    const size_t length = strnlen(message, YAML_MESSAGE_MAX);
    const char *what;

    if (length >= YAML_MESSAGE_MAX || strncmp(message, path, strlen(path)) != 0)
        return false;
    what = skip_number(message + strlen(path) + 1, ":");
    what = skip_number(what, ": ");
    if (what == NULL || strstr(what, ", expected ") == NULL)
        return false;
    for (size_t i = 0; i < length; i++)
        if ((unsigned char)message[i] < 0x20 || message[i] == 0x7F)
            return false;
    return true;
}

static void expect_refusal(enum kind kind, const char *path, unsigned line,
                           unsigned column, const char *what)
{
    char message[YAML_MESSAGE_MAX], want[YAML_MESSAGE_MAX];

    snprintf(want, sizeof(want), "%s:%u:%u: %s", path, line, column, what);
    if (load(kind, path, message) != -1)
        fail_msg("%s: accepted", path);
    if (!is_well_formed(path, message) ||
        strncmp(message, want, strlen(want)) != 0)
        fail_msg("got  %s\nwant %s", message, want);
}

static void expect_text(enum kind kind, const char *text, const char *wrong)
{
    char message[YAML_MESSAGE_MAX];
    int err;

    write_scratch(text, strlen(text));
    err = load(kind, scratch, message);
    if (wrong == NULL && err < 0)
        fail_msg("%s", message);
    if (wrong != NULL && (err == 0 || !is_well_formed(scratch, message) ||
                          strstr(message, wrong) == NULL))
        fail_msg("got %s\nwant %s", err == 0 ? "accepted" : message, wrong);
}

/* ---- good files ---- */

static void the_example_rig_is_read_as_written(void **state)
{
    const struct rig_axis *focus = &rig.axis[1], *dolly = &rig.axis[0];

    (void)state;
    assert_string_equal(rig.title, "Dolly, remote head and focus motor");
    assert_int_equal(rig.period_ns, MS(1));
    assert_int_equal(rig.heartbeat_ns, MS(100));
    assert_int_equal(rig.watchdog_ns, MS(100));
    assert_int_equal(rig.bus_count, 2);
    assert_string_equal(rig.bus[1].name, "can1");
    assert_int_equal(rig.bus[1].bit_rate, 1000000);
    assert_int_equal(rig.bus[1].node_id, 127);
    assert_string_equal(rig.bus[1].interface, "can1");
    assert_int_equal(rig.axis_count, 4);
    assert_int_equal(rig_axis_index(&rig, "tilt"), 3);
    assert_int_equal(rig_axis_index(&rig, "til"), -1);
    assert_string_equal(units_axis_text(dolly->unit), "mm");
    assert_int_equal(dolly->limit.pos_max_q32, Q32(2400));
    assert_int_equal(dolly->limit.vel_q32, Q32(300));
    assert_int_equal(dolly->limit.acc_q32, Q32(100));
    assert_int_equal(dolly->limit.jerk_q32, Q32(180));
    assert_int_equal(dolly->stop_acc_q32, Q32(400));
    assert_int_equal(dolly->stop_jerk_q32, Q32(4000));
    assert_int_equal(dolly->following_floor_q32, Q32(2));
    assert_int_equal(dolly->following_k_ns, MS(20));
    assert_int_equal(dolly->sim.omega_mrad_s, 157080);
    assert_int_equal(dolly->sim.zeta_permille, 900);
    assert_int_equal(dolly->sim.start_q32, Q32(120));
    assert_int_equal(dolly->sim.vel_max_q32, Q32(450));
    assert_int_equal(dolly->sim.acc_max_q32, Q32(800));
    assert_int_equal(focus->bus, 0);
    assert_int_equal(focus->node_id, 2);
    assert_int_equal(focus->counts_num, -16384);
    assert_int_equal(focus->counts_den, 45);
    assert_int_equal(rig.axis[2].place.line, 43);
    assert_int_equal(rig.axis[2].place.column, 3);
}

static void the_example_move_is_read_as_written(void **state)
{
    char message[YAML_MESSAGE_MAX];
    struct plan_move move;

    (void)state;
    assert_int_equal(move_load(&disk_files, GOOD_MOVE, &rig, &move, message),
                     0);
    assert_string_equal(move.title, "Past the window seat");
    assert_int_equal(move.axis_count, 4);
    assert_string_equal(move.axis[1].name, "pan");
    assert_int_equal(move.axis[1].curve, PLAN_CURVE_QUINTIC);
    assert_int_equal(move.axis[1].first, MOTION_SPLINE_REST);
    assert_int_equal(move.axis[1].key_count, 7);
    assert_int_equal(move.axis[1].key[1].key.t_ns_q12, MS(4100) * 4096);
    assert_int_equal(move.axis[1].key[1].key.pos_q32, Q32(-47));
    assert_false(move.axis[1].key[1].key.has_vel);
    assert_int_equal(move.axis[2].k1_q32, 1503238554); /* 0.35 */
    assert_int_equal(move.axis[3].key[0].key.t_ns_q12, MS(1500) * 4096);
    assert_int_equal(move.axis[3].key[3].key.pos_q32, Q32(262));
    assert_int_equal(move.axis[3].key[0].place.column, 9);
    move_free(&move);
    assert_int_equal(move.axis_count, 0);
}

static void the_example_move_is_where_the_rig_can_be(void **state)
{
    char message[YAML_MESSAGE_MAX];
    struct plan_move move;

    (void)state;
    assert_int_equal(move_load(&disk_files, GOOD_MOVE, &rig, &move, message),
                     0);
    for (uint32_t i = 0; i < move.axis_count; i++) {
        const struct plan_limit *limit =
            &rig.axis[rig_axis_index(&rig, move.axis[i].name)].limit;
        for (uint32_t k = 0; k < move.axis[i].key_count; k++) {
            const int64_t pos_q32 = move.axis[i].key[k].key.pos_q32;
            assert_true(pos_q32 >= limit->pos_min_q32);
            assert_true(pos_q32 <= limit->pos_max_q32);
        }
    }
    move_free(&move);
}

static void what_is_left_out_has_the_documented_value(void **state)
{
    static const char text[] =
        "buses: {b: {kind: canopen, bit_rate: 125000}}\n"
        "axes:\n"
        "  x:\n"
        "    unit: count\n"
        "    limits: {position: [5, 9], velocity: 4, acceleration: 8}\n"
        "    following_error: {floor: 1}\n"
        "    drive: {kind: cia402, bus: b, node: 1, counts: {num: -3}}\n";
    char message[YAML_MESSAGE_MAX];
    struct rig other = { .bus_count = 0 };

    (void)state;
    write_scratch(text, strlen(text));
    if (rig_load(&disk_files, scratch, &other, message) < 0)
        fail_msg("%s", message);
    assert_string_equal(other.title, "");
    assert_int_equal(other.period_ns, MS(1));
    assert_int_equal(other.heartbeat_ns, MS(100));
    assert_int_equal(other.watchdog_ns, MS(100));
    assert_int_equal(other.axis[0].limit.jerk_q32, 0);
    assert_int_equal(other.axis[0].stop_acc_q32, Q32(8));
    assert_int_equal(other.axis[0].stop_jerk_q32, 0);
    assert_int_equal(other.axis[0].following_k_ns, MS(20));
    assert_int_equal(other.axis[0].counts_num, -3);
    assert_int_equal(other.axis[0].counts_den, 1);
    assert_int_equal(other.axis[0].sim.start_q32, Q32(5));
    assert_int_equal(other.axis[0].sim.vel_max_q32, Q32(6));
    assert_int_equal(other.axis[0].sim.acc_max_q32, Q32(16));
    assert_int_equal(other.axis[0].sim.omega_mrad_s, 157080);
    assert_int_equal(other.axis[0].sim.zeta_permille, 900);
    rig_free(&other);
}

static void keys_have_a_short_and_a_long_form(void **state)
{
    static const char text[] =
        "axes:\n"
        "  dolly:\n"
        "    ends: {first: natural, last: one-sided}\n"
        "    keys:\n"
        "    - [0, 1, 2, 3]\n"
        "    - {a: 3 mm/s2, v: 2 mm/s, p: 1 mm, t: 1 s}\n"
        "    - t: 2 s\n"
        "      p: 0.1 cm\n"
        "  pan: {curve: cardinal, mu: 50 %, keys: [[0, 1 rev]]}\n";
    char message[YAML_MESSAGE_MAX];
    struct plan_move move;

    (void)state;
    write_scratch(text, strlen(text));
    if (move_load(&disk_files, scratch, &rig, &move, message) < 0)
        fail_msg("%s", message);
    for (int k = 0; k < 3; k++) {
        const struct motion_key *key = &move.axis[0].key[k].key;
        assert_int_equal(key->t_ns_q12, MS(1000 * k) * 4096);
        assert_int_equal(key->pos_q32, Q32(1));
        assert_int_equal(key->has_vel, k < 2);
        assert_int_equal(key->vel.m, motion_real_int(k < 2 ? 2 : 0).m);
        assert_int_equal(key->has_acc, k < 2);
        assert_int_equal(key->acc.m, motion_real_int(k < 2 ? 3 : 0).m);
    }
    assert_int_equal(move.axis[0].first, MOTION_SPLINE_NATURAL);
    assert_int_equal(move.axis[0].last, MOTION_SPLINE_ONE_SIDED);
    assert_int_equal(move.axis[0].curve, PLAN_CURVE_QUINTIC);
    assert_int_equal(move.axis[0].mu_q32, Q32(1));
    assert_int_equal(move.axis[0].k1_q32, 1431655765); /* 1/3 */
    assert_int_equal(move.axis[0].k2_q32, 2863311531); /* 2/3 */
    assert_int_equal(move.axis[1].mu_q32, Q32(0.5));
    assert_int_equal(move.axis[1].key[0].key.pos_q32, Q32(360));
    move_free(&move);
}

static void curves_bring_their_parameters(void **state)
{
    static const char text[] =
        "axes:\n"
        "  dolly:\n"
        "    curve: kochanek-bartels\n"
        "    tcb: [0.5, -25 %, 1]\n"
        "    keys:\n"
        "    - [0, 1]\n"
        "    - {t: 1 s, p: 2 mm, curve: c4, a: 3 mm/s2}\n"
        "    - [2 s, 3 mm, 4 mm/s]\n"
        "  pan:\n"
        "    curve: smoothed\n"
        "    blend: 250 ms\n"
        "    ends: one-sided\n"
        "    keys: [[0, 0], [1, 1]]\n";
    char message[YAML_MESSAGE_MAX];
    struct plan_move move;

    (void)state;
    write_scratch(text, strlen(text));
    if (move_load(&disk_files, scratch, &rig, &move, message) < 0)
        fail_msg("%s", message);
    assert_int_equal(move.axis[0].curve, PLAN_CURVE_KOCHANEK);
    assert_int_equal(move.axis[0].shape.tension_q32, Q32(0.5));
    assert_int_equal(move.axis[0].shape.continuity_q32, Q32(-0.25));
    assert_int_equal(move.axis[0].shape.bias_q32, Q32(1));
    assert_false(move.axis[0].key[0].has_curve);
    assert_true(move.axis[0].key[1].has_curve);
    assert_int_equal(move.axis[0].key[1].curve, PLAN_CURVE_C4);
    assert_int_equal(move.axis[0].key[1].key.acc.m, motion_real_int(3).m);
    assert_true(move.axis[0].key[2].key.has_vel);
    assert_int_equal(move.axis[1].blend_ns_q12, MS(250) * 4096);
    assert_int_equal(move.axis[1].last, MOTION_SPLINE_ONE_SIDED);
    move_free(&move);
}

static void keys_with_handles_are_read_as_written(void **state)
{
    char message[YAML_MESSAGE_MAX];
    struct plan_move move;

    (void)state;
    expect_text(
        MOVE,
        "fps: 24\naxes:\n  dolly:\n    curve: bezier\n"
        "    handles: [vector, auto]\n    interpolation: sine\n"
        "    easing: out\n    smoothing: acceleration\n"
        "    extrapolation: linear\n"
        "    cycles: {after: mirror, after_count: 3, before: repeat}\n"
        "    until: 60 s\n    grid: [frame 1, 10 cm]\n    keys:\n"
        "      - [-1 s, 1]\n"
        "      - {t: 1 s, p: 3, left: [-500 ms, -1 cm], interpolation: back,"
        " easing: in-out, back: 170 %}\n"
        "      - {t: 2 s, p: 4, handles: aligned, left: [-1, 0],"
        " right: [0.25 s, 2], interpolation: elastic, amplitude: 2,"
        " period: 0.5}\n",
        NULL);
    assert_int_equal(move_load(&disk_files, scratch, &rig, &move, message), 0);
    const struct plan_bezier *bezier = &move.axis[0].bezier;
    const struct plan_bezier_key *key = bezier->key;
    assert_int_equal(bezier->smoothing, MOTION_FCURVE_SMOOTH_ACCELERATION);
    assert_int_equal(bezier->extrapolation, MOTION_FCURVE_LINE);
    assert_int_equal(bezier->before.mode, MOTION_FCURVE_REPEAT);
    assert_int_equal(bezier->before.count, 0);
    assert_int_equal(bezier->after.mode, MOTION_FCURVE_MIRROR);
    assert_int_equal(bezier->after.count, 3);
    assert_true(bezier->has_end);
    assert_int_equal(bezier->end_ns_q12, MS(60000) * 4096);
    assert_int_equal(bezier->value_q32, Q32(100));
    assert_int_equal(move.axis[0].key[0].key.t_ns_q12, -MS(1000) * 4096);
    assert_int_equal(key[0].left.kind, MOTION_FCURVE_VECTOR);
    assert_int_equal(key[0].right.kind, MOTION_FCURVE_AUTO);
    assert_int_equal(key[0].interpolation, MOTION_FCURVE_SINE);
    assert_int_equal(key[0].easing, MOTION_FCURVE_OUT);
    assert_int_equal(key[1].left.kind, MOTION_FCURVE_FREE);
    assert_int_equal(key[1].left.dt_ns_q12, -MS(500) * 4096);
    assert_int_equal(key[1].left.dp_q32, Q32(-10));
    assert_int_equal(key[1].interpolation, MOTION_FCURVE_BACK);
    assert_int_equal(key[1].easing, MOTION_FCURVE_IN_OUT);
    assert_int_equal(key[1].back_q32, Q32(1.7));
    assert_int_equal(key[2].right.kind, MOTION_FCURVE_ALIGNED);
    assert_int_equal(key[2].right.dt_ns_q12, MS(250) * 4096);
    assert_int_equal(key[2].amplitude_q32, Q32(2));
    assert_int_equal(key[2].period_ns_q12, MS(500) * 4096);
    move_free(&move);
}

static void keys_may_have_parameters_of_their_span(void **state)
{
    char message[YAML_MESSAGE_MAX];
    struct plan_move move;

    (void)state;
    expect_text(MOVE,
                "axes:\n  dolly:\n    curve: cardinal\n    keys:\n"
                "      - {t: 0, p: 1, mu: 0.5}\n"
                "      - {t: 1, p: 1, curve: sine, ease: [10 %, 0.75]}\n"
                "      - {t: 2, p: 1, curve: rounded, blend: 0.1 s}\n"
                "      - {t: 3, p: 1, curve: kochanek-bartels,"
                " tcb: [1, -0.5, 0]}\n      - [4, 2]\n",
                NULL);
    assert_int_equal(move_load(&disk_files, scratch, &rig, &move, message), 0);
    const struct plan_key *key = move.axis[0].key;
    assert_true(key[0].has_shape && !key[4].has_shape);
    assert_int_equal(key[0].shape.mu_q32, Q32(0.5));
    assert_int_equal(key[1].shape.ease.k2_q32, Q32(0.75));
    assert_int_equal(key[2].shape.blend_ns_q12, MS(100) * 4096);
    assert_int_equal(key[3].shape.tcb.continuity_q32, Q32(-0.5));
    move_free(&move);
    expect_text(MOVE, "axes: {dolly: {keys: [{t: 0, p: 1, mu: 1}, [1, 2]]}}",
                "mu is not used by curve quintic");
}

/* ---- documentation ---- */

/* The indented block of docs/FILES.md after `heading`, into the scratch
 * file. */
static void write_block(const char *heading)
{
    FILE *doc = fopen("docs/FILES.md", "r"), *file = fopen(scratch, "w");
    bool wanted = false, begun = false, done = false;
    char line[1024];

    assert_non_null(doc);
    assert_non_null(file);
    while (fgets(line, sizeof(line), doc) != NULL && !done) {
        wanted = wanted || strcmp(line, heading) == 0;
        const bool code = wanted && strncmp(line, "    ", 4) == 0;
        if (code)
            fputs(line + 4, file);
        done = begun && !code && line[0] != '\n';
        begun = begun || code;
    }
    fclose(doc);
    fclose(file);
}

static void expect_good(const struct rig *of)
{
    char message[YAML_MESSAGE_MAX];
    struct plan_move move;

    if (move_load(&disk_files, scratch, of, &move, message) < 0)
        fail_msg("%s", message);
    move_free(&move);
}

static void the_documentation_shows_files_that_can_be_read(void **state)
{
    char message[YAML_MESSAGE_MAX];
    struct plan_move move;
    struct rig other = { .bus_count = 0 };

    (void)state;
    write_block("## rig.yaml\n");
    if (rig_load(&disk_files, scratch, &other, message) < 0)
        fail_msg("%s", message);
    assert_int_equal(other.axis_count, 1);
    assert_memory_equal(&other.axis[0].limit, &rig.axis[0].limit,
                        sizeof(rig.axis[0].limit));
    rig_free(&other);
    write_block("## move.yaml\n");
    if (move_load(&disk_files, scratch, &rig, &move, message) < 0)
        fail_msg("%s", message);
    assert_int_equal(move.axis_count, 2);
    assert_int_equal(move.axis[0].key[2].key.t_ns_q12, MS(8000) * 4096);
    move_free(&move);
    write_block("### Keys with handles\n");
    if (move_load(&disk_files, scratch, &rig, &move, message) < 0)
        fail_msg("%s", message);
    assert_int_equal(move.axis[0].curve, PLAN_CURVE_BEZIER);
    move_free(&move);
    write_block("### A path\n");
    expect_good(&gantry);
    write_block("### A camera on the path\n");
    expect_good(&gantry);
    write_block("### Poses and their blend\n");
    expect_good(&rig);
    write_block("### On top of a move\n");
    expect_good(&rig);
}

/* ---- what people's editors do ---- */

/* `text` with every line end as `end`, after `start`. */
static void write_with_line_ends(const char *text, const char *start,
                                 const char *end)
{
    FILE *file = fopen(scratch, "wb");

    assert_non_null(file);
    fputs(start, file);
    for (; *text != 0; text++)
        *text == '\n' ? fputs(end, file) : fputc(*text, file);
    fclose(file);
}

static char *read_all(const char *path, size_t *length)
{
    static char text[64 * 1024];
    FILE *file = fopen(path, "rb");

    assert_non_null(file);
    *length = fread(text, 1, sizeof(text) - 1, file);
    fclose(file);
    text[*length] = 0;
    return text;
}

static void expect_same_rig(const struct rig *other)
{
    struct rig same = *other;

    assert_memory_equal(other->bus, rig.bus, rig.bus_count * sizeof *rig.bus);
    assert_memory_equal(other->axis, rig.axis,
                        rig.axis_count * sizeof *rig.axis);
    assert_memory_equal(other->line, rig.line,
                        rig.line_count * sizeof *rig.line);
    same.memory = rig.memory;
    same.bus = rig.bus;
    same.axis = rig.axis;
    same.line = rig.line;
    assert_memory_equal(&same, &rig, sizeof rig); /* no map, no quirks */
}

static void line_ends_and_byte_order_mark_do_not_matter(void **state)
{
    static const struct {
        const char *start, *end;
    } rows[] = { { "", "\n" },
                 { "", "\r\n" },
                 { "", "\r" },
                 { "\xEF\xBB\xBF", "\n" },
                 { "\xEF\xBB\xBF", "\r\n" } };
    char message[YAML_MESSAGE_MAX];
    struct rig other = { .bus_count = 0 };
    size_t length;

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        write_with_line_ends(read_all(GOOD_RIG, &length), rows[i].start,
                             rows[i].end);
        if (rig_load(&disk_files, scratch, &other, message) < 0)
            fail_msg("row %zu: %s", i, message);
        expect_same_rig(&other);
        rig_free(&other);
    }
}

static void line_ends_and_byte_order_mark_do_not_move_places(void **state)
{
    static const char text[] = "axes:\n  dolly:\n    curv: x\n";

    (void)state;
    write_with_line_ends(text, "\xEF\xBB\xBF", "\r\n");
    expect_refusal(MOVE, scratch, 3, 5, "unknown key 'curv'");
    write_with_line_ends("\"x\": 1\n", "\xEF\xBB\xBF", "\n");
    expect_refusal(MOVE, scratch, 1, 1, "unknown key 'x'");
    write_with_line_ends(text, "", "\r");
    expect_refusal(MOVE, scratch, 3, 5, "unknown key 'curv'");
    /* columns are characters, not bytes */
    write_with_line_ends("{\"\xC3\xA4\xE2\x82\xAC\": 1, x: 1}\n", "", "\n");
    expect_refusal(MOVE, scratch, 1, 2, "unknown key '\xC3\xA4\xE2\x82\xAC'");
    write_with_line_ends("{title: \xC3\xA4\xE2\x82\xAC, x: 1}\n", "", "\n");
    expect_refusal(MOVE, scratch, 1, 13, "unknown key 'x'");
}

static void quotes_comments_and_json_are_yaml(void **state)
{
    (void)state;
    expect_text(MOVE, "axes: {dolly: {keys: [[\"0 s\", '1 mm']]}}", NULL);
    expect_text(MOVE,
                "# c\n---\n'axes': # c\n\n  \"dolly\":\n"
                "    keys: # c\n    - ['f1 @ 24', 1] # c\n...\n",
                NULL);
    expect_text(MOVE,
                "{\"title\": \"\\u00e9\", \"axes\": {\"dolly\": {\"curve\": "
                "\"s-curve\", \"ease\": [0.3, 0.7], \"keys\": [[0, 1.5e0], "
                "[1.25, 2]]}}}",
                NULL);
}

/* ---- bad files ---- */

static const struct {
    const char *name;
    unsigned line, column;
    const char *what;
} bad[] = {
    { "move_axes_list.yaml", 2, 7, "axes is a list" },
    { "move_back_unused.yaml", 6, 59,
      "back is not used by interpolation elastic" },
    { "move_coupling_both.yaml", 4, 8, "pan has a gear and a cam" },
    { "move_coupling_cam_curve.yaml", 4, 67, "curve rounded is not for a cam" },
    { "move_coupling_curve.yaml", 4, 61, "curve is not for a gear" },
    { "move_coupling_driven.yaml", 5, 3,
      "coupling 'pan' is driven by the keys in line 3 already" },
    { "move_coupling_half.yaml", 4, 8, "pan has half of a ratio" },
    { "move_coupling_neither.yaml", 4, 8, "pan has neither a gear nor a cam" },
    { "move_coupling_order.yaml", 6, 44, "pair is not above the one before" },
    { "move_coupling_unknown_master.yaml", 4, 17, "unknown" },
    { "move_coupling_zero.yaml", 4, 35, "numerator is 0" },
    { "move_cycles_count.yaml", 5, 42,
      "after_count '-1' is not in 0 .. 4294967295" },
    { "move_cycles_word.yaml", 5, 21, "unknown after 'loop'" },
    { "move_easing_unused.yaml", 6, 60,
      "easing is not used by interpolation linear" },
    { "move_event_without_line.yaml", 4, 12,
      "line is given, and the rig has no gpio line of kind trigger" },
    { "move_grid_zero.yaml", 5, 11, "grid has a number that is not positive" },
    { "move_handle_alone.yaml", 6, 36, "right has 1 item" },
    { "move_handle_computed.yaml", 6, 51,
      "right is given, but a handle of kind auto follows from its neighbours" },
    { "move_handle_missing.yaml", 6, 9,
      "key has no right handle, which kind free needs" },
    { "move_handle_wrong_side.yaml", 6, 35, "left has a time after its key" },
    { "move_handles_unused.yaml", 5, 14,
      "handles is not used by curve quintic" },
    { "move_handles_word.yaml", 5, 14, "unknown handles 'smooth'" },
    { "move_interpolation_word.yaml", 6, 44,
      "unknown interpolation 'bounces'" },
    { "move_left_unused.yaml", 6, 35, "left is not used by curve quintic" },
    { "move_until_zero.yaml", 5, 12,
      "until '0 s' is not after the start of the move" },
    { "move_blend_axis_of_base.yaml", 7, 13,
      "pose has the axis 'focus', which the base 'wide' has not" },
    { "move_blend_axis_twice.yaml", 4, 10,
      "axis 'dolly' is driven by the keys in line 2 already" },
    { "move_blend_base_weighted.yaml", 7, 13,
      "pose 'wide' is the base itself" },
    { "move_blend_unknown_pose.yaml", 7, 13, "unknown pose 'closed'" },
    { "move_blend_weight_unit.yaml", 7, 34, "p '0 mm' is a length" },
    { "move_blend_without_poses.yaml", 2, 3, "blend has no poses" },
    { "move_blend_negative.yaml", 5, 12, "blend '-1 s' is negative" },
    { "move_camera_axis_of_path.yaml", 9, 26,
      "tilt 'z' is driven by the path in line 2 already" },
    { "move_camera_dwell_beyond.yaml", 12, 47,
      "to '120 %' is not on the path" },
    { "move_camera_dwell_without_to.yaml", 12, 9, "dwell has no 'to'" },
    { "move_camera_end_open.yaml", 10, 30,
      "end 'closed' goes with a closed path only" },
    { "move_camera_flat_point.yaml", 10, 14, "at has 2 items" },
    { "move_camera_looks_nowhere.yaml", 10, 16,
      "ease is not used without dwell" },
    { "move_camera_looks_twice.yaml", 10, 9, "look names 2 things to look at" },
    { "move_camera_no_direction.yaml", 11, 7, "up is no direction" },
    { "move_camera_up_is_forward.yaml", 9, 3,
      "camera has parallel forward and up" },
    { "move_camera_without_path.yaml", 2, 3, "camera has no path to go on" },
    { "move_duplicate_axis.yaml", 9, 3,
      "key 'dolly' is already there in line 3" },
    { "move_ease_order.yaml", 5, 17,
      "ease has its second number below the first" },
    { "move_ends_of_another.yaml", 5, 31,
      "last 'natural' is not among those of curve akima" },
    { "move_ends_word.yaml", 5, 11, "unknown ends 'clamped'" },
    { "move_fade_twice.yaml", 5, 9, "move is given beside axes" },
    { "move_fade_without_weight.yaml", 4, 3, "fade has no 'weight'" },
    { "move_frame_rate_word.yaml", 7, 10,
      "t 'frame 72 @ film' is not a number" },
    { "move_frame_rate_zero.yaml", 1, 6, "fps '0' is not a frame rate" },
    { "move_frame_without_rate.yaml", 6, 10,
      "t 'frame 72' has no frame rate and the file gives none (fps)" },
    { "move_infinite.yaml", 7, 15, "p 'inf mm' is infinite" },
    { "move_key_alone.yaml", 7, 9, "key has 1 item" },
    { "move_key_curve.yaml", 6, 36, "unknown curve 'linar'" },
    { "move_key_velocity_unused.yaml", 6, 47, "v is not used by curve linear" },
    { "move_key_missing_p.yaml", 8, 9, "key has no 'p'" },
    { "move_key_of_five.yaml", 7, 9, "key has 5 items" },
    { "move_key_scalar.yaml", 7, 9, "key is a single value" },
    { "move_key_unknown.yaml", 8, 29, "unknown key 'w'" },
    { "move_layer_axis.yaml", 4, 12,
      "layer has the axis 'pan', which nothing else drives" },
    { "move_layer_empty.yaml", 4, 5, "layer moves nothing" },
    { "move_mu_range.yaml", 5, 9, "mu '2.5' is out of range" },
    { "move_mu_unused.yaml", 5, 9, "mu is not used by curve quintic" },
    { "move_nan.yaml", 7, 15, "p 'NaN' is not a number" },
    { "move_negative_time.yaml", 6, 10,
      "t '-1 s' is before the start of the move" },
    { "move_no_axes.yaml", 2, 7, "axes is empty" },
    { "move_no_keys.yaml", 5, 11, "keys has 0 items" },
    { "move_nothing.yaml", 1, 1, "the move moves nothing" },
    { "move_path_axis_twice.yaml", 4, 16,
      "axes 'z' is driven by the keys in line 2 already" },
    { "move_path_backwards.yaml", 7, 37, "to '-200 mm/s' goes backwards" },
    { "move_path_closed.yaml", 4, 11,
      "closed is not possible with curve b-spline" },
    { "move_path_corner_missing.yaml", 5, 5,
      "points come without a corner, which curve smoothed needs" },
    { "move_path_drawn_half.yaml", 9, 15,
      "distance does not go from [0 s, 0 %] to 100 %" },
    { "move_path_law_without_time.yaml", 9, 7,
      "part has no 'time', which speed law ramp needs" },
    { "move_path_mixed_units.yaml", 2, 16,
      "axes has the axis 'pan' in deg beside one in mm" },
    { "move_path_no_speed.yaml", 2, 3, "path has no 'speed'" },
    { "move_path_one_point.yaml", 3, 11, "points has 1 item" },
    { "move_path_point_of_two.yaml", 7, 7, "point has 2 items" },
    { "move_path_point_twice.yaml", 7, 7,
      "point is the same as the one before it (line 6)" },
    { "move_path_to_unused.yaml", 7, 40,
      "to is not used by speed law quintic" },
    { "move_path_unknown_axis.yaml", 2, 16, "unknown axis 'zz'" },
    { "move_path_unknown_law.yaml", 7, 16, "unknown law 'quintik'" },
    { "move_poses_unused.yaml", 1, 1,
      "the move has poses, but no blend of them" },
    { "move_tcb_range.yaml", 5, 21, "tcb '1.5' is out of range" },
    { "move_tcb_two.yaml", 5, 10, "tcb has 2 items" },
    { "move_time_too_large.yaml", 7, 10, "t '1000 h' is too large" },
    { "move_outside.yaml", 2, 1,
      "this is outside of what the file began with" },
    { "move_times_decrease.yaml", 8, 13,
      "t '2.5 s' is not later than the key before it (line 7)" },
    { "move_times_equal.yaml", 7, 10,
      "t '0 s' is not later than the key before it (line 6)" },
    { "move_too_large.yaml", 7, 15, "p '1e400' is too large" },
    { "move_unknown_axis.yaml", 3, 3, "unknown axis 'doly'" },
    { "move_unknown_curve.yaml", 4, 12, "unknown curve 'quintik'" },
    { "move_velocity_needed.yaml", 6, 9,
      "key has no velocity, which curve hermite needs" },
    { "move_velocity_unused.yaml", 8, 32, "v is not used by curve linear" },
    { "move_warp_before_start.yaml", 4, 16,
      "p '-1 s' is before the start of the move" },
    { "move_warp_position.yaml", 4, 28, "p '400 mm' is a length" },
    { "move_weight.yaml", 7, 15, "p '330 kg' has the unknown unit 'kg'" },
    { "move_wrong_unit.yaml", 7, 15, "p '330 deg' is an angle" },
    { "rig_alias.yaml", 8, 17, "alias 'speed' is not read" },
    { "rig_anchor.yaml", 5, 11, "anchor 'u' is not read" },
    { "rig_angle_on_mm.yaml", 7, 24, "position '45 deg' is an angle" },
    { "rig_axis_name.yaml", 4, 3, "'my dolly' is not a name" },
    { "rig_bandwidth.yaml", 12, 22, "bandwidth '2 kHz' is out of range" },
    { "rig_shaper_frequency.yaml", 12, 36,
      "frequency '2 kHz' is out of range" },
    { "rig_shaper_damping.yaml", 12, 13, "shaper cannot be made" },
    { "rig_shaper_kind.yaml", 12, 20, "unknown kind 'zvdd'" },
    { "rig_shaper_unused.yaml", 12, 52, "residual is not used by kind zvd" },
    { "rig_binary.yaml", 1, 1, "character U+0000 is not printable" },
    { "rig_bit_rate.yaml", 2, 35,
      "bit_rate '300 kbit/s' is not one of CANopen's" },
    { "rig_bus_kind.yaml", 2, 16, "unknown kind 'canbus'" },
    { "rig_cia402_bandwidth_unused.yaml", 17, 18,
      "bandwidth is given without mode: csv" },
    { "rig_cia402_guarding.yaml", 17, 17, "guarding '51 ms' is out of range" },
    { "rig_cia402_times_sdo.yaml", 17, 20, "sdo '9 ms' is out of range" },
    { "rig_cia402_times_boot.yaml", 17, 21, "boot '121 s' is out of range" },
    { "rig_cia402_unsupervised.yaml", 17, 21, "unknown unsupervised 'maybe'" },
    { "rig_cia402_mode.yaml", 17, 13, "unknown mode 'pp'" },
    { "rig_cia402_nmt_reset.yaml", 17, 18,
      "unknown nmt_reset 'start', expected none, communication or node" },
    { "rig_cia402_no_bandwidth.yaml", 13, 7,
      "drive has mode: csv but no bandwidth, expected both, such as "
      "bandwidth: 5 Hz" },
    { "rig_cia402_option.yaml", 17, 23, "halt '9' is not in -128 .. 8" },
    { "rig_cia402_quick_stop.yaml", 17, 29,
      "quick_stop is 0, with which the axis would coast, expected a code that "
      "brakes, such as 2" },
    { "rig_cia402_revolution.yaml", 17, 19,
      "revolution '-10 mm' is not above zero" },
    { "rig_cia402_scale.yaml", 17, 29, "num '0' is not in 1 .. 4294967295" },
    { "rig_cia402_torque.yaml", 17, 15, "torque '4' is out of range" },
    /* 3 x 1100 / 100 */
    { "rig_cia402_torque_stop.yaml", 5, 5,
      "dolly takes more torque at its stop acceleration than the 16 bits of "
      "its "
      "drive's torque feed-forward (0x60B2) can say, 32.767 times the rated "
      "one" },
    { "rig_colon.yaml", 8, 20, "':' where no key can be" },
    { "rig_comment_only.yaml", 1, 1, "the file is empty" },
    { "rig_control_escape.yaml", 1, 8, "the value holds the character U+001B" },
    { "rig_counts_overflow.yaml", 12, 55,
      "counts gives more than 2147483647 counts at the end of the axis" },
    { "rig_counts_unit.yaml", 12, 55, "counts '4096 per deg' is an angle" },
    { "rig_counts_word.yaml", 12, 55,
      "counts '4096 / mm' has no 'per' after the number" },
    { "rig_counts_zero.yaml", 12, 55, "counts '0 per mm' is zero" },
    { "rig_data_bit_rate.yaml", 2, 56,
      "data_bit_rate '3 Mbit/s' does not fit a bit_rate of 1000 kbit/s" },
    { "rig_decimal_comma.yaml", 8, 17,
      "velocity '0,3 m/s' has a comma in the number (a decimal point is "
      "expected)" },
    { "rig_directive.yaml", 1, 1, "directives (%) are not read" },
    { "rig_duplicate_key.yaml", 9, 7,
      "key 'velocity' is already there in line 8" },
    { "rig_empty.yaml", 1, 1, "the file is empty" },
    { "rig_flow_open.yaml", 8, 15, "the list is not closed before this" },
    { "rig_indentation.yaml", 8, 6,
      "this does not line up with the keys above" },
    { "rig_infinite.yaml", 8, 17, "velocity '-.inf' is infinite" },
    { "rig_interface.yaml", 2, 58, "interface 'can/0' cannot be one" },
    { "rig_latin1.yaml", 1, 11, "byte \\xe9 is not UTF-8 text" },
    { "rig_length_as_speed.yaml", 8, 17, "velocity '300 mm' is a length" },
    { "rig_list_for_map.yaml", 11, 22, "following_error is a list" },
    { "rig_line_axis_missing.yaml", 14, 8,
      "low of kind limit-negative names no axis" },
    { "rig_line_axis_unknown.yaml", 14, 49,
      "axis 'pan' is not an axis of this rig" },
    { "rig_line_axis_unused.yaml", 14, 42,
      "axis is not for a line of kind e-stop" },
    { "rig_line_kind.yaml", 14, 16, "unknown kind 'estop'" },
    { "rig_line_lamp_bias.yaml", 14, 40, "bias is not for an output" },
    { "rig_line_missing.yaml", 14, 9, "stop has no 'line'" },
    { "rig_homing_above_limit.yaml", 12, 31,
      "speed '301 mm/s' is above the axis's limit" },
    { "rig_homing_away.yaml", 12, 60,
      "direction leads away from the input, limit-positive" },
    { "rig_homing_by.yaml", 12, 18, "unknown by 'swich'" },
    { "rig_homing_go_outside.yaml", 12, 28, "go is outside the axis's limits" },
    { "rig_homing_method_missing.yaml", 12, 13,
      "homing by drive has no 'method'" },
    { "rig_homing_method_zero.yaml", 12, 33,
      "method 0 is no homing (by: none)" },
    { "rig_no_buses.yaml", 6, 32,
      "bus is none, as the rig has no 'buses', expected the name of a bus" },
    { "rig_virtual_bus.yaml", 6, 28, "unknown key 'bus', expected kind" },
    { "rig_virtual_homing.yaml", 7, 13,
      "homing is not for a virtual axis, which is at its last set point" },
    { "rig_virtual_line.yaml", 8, 28,
      "axis master is a virtual axis, which has no switches" },
    { "rig_payload_slanted.yaml", 10, 74, "direction is not level" },
    { "rig_payload_wall.yaml", 10, 9, "lamp of kind pendulum has no wall" },
    { "rig_virtual_payload.yaml", 8, 32,
      "axis master is a virtual axis, which carries nothing" },
    { "rig_virtual_sim.yaml", 7, 11,
      "unknown key 'bandwidth', expected start" },
    { "rig_homing_moteus.yaml", 12, 18,
      "by drive is not for a moteus, which has no homing" },
    { "rig_homing_odrive_method.yaml", 12, 33,
      "method is not for an odrive, which is set up for homing" },
    { "rig_homing_odrive_slow.yaml", 12, 31, "slow is not for an odrive" },
    { "rig_homing_no_line.yaml", 4, 3,
      "pan is homed by its home switch, expected a gpio line" },
    { "rig_homing_slow_above.yaml", 12, 48,
      "slow '51 mm/s' is above the speed of the search" },
    { "rig_homing_unused.yaml", 12, 34, "distance is not for homing by here" },
    { "rig_line_width.yaml", 14, 43, "width '0 ms' is out of range" },
    { "rig_line_lead.yaml", 14, 42, "lead '2001 ms' is out of range" },
    { "rig_line_rest_unused.yaml", 14, 40,
      "rest is not for a line of kind lamp" },
    { "rig_line_sim_reversed.yaml", 14, 52, "sim ends before it begins" },
    { "rig_line_sim_unused.yaml", 14, 41, "sim is for a switch of an axis" },
    { "rig_line_nine_triggers.yaml", 22, 14,
      "kind is the 9th trigger, 8 are allowed" },
    { "rig_line_release.yaml", 14, 45, "release '11 s' is out of range" },
    { "rig_line_switch_twice.yaml", 15, 50,
      "axis dolly has low as its limit-negative already" },
    { "rig_homing_hard_stop_unrated.yaml", 13, 18,
      "by hard-stop has a drive without rated_torque, expected rated_torque in "
      "the axis's drive, of which torque is a share" },
    { "rig_homing_hard_stop_modbus.yaml", 13, 18,
      "by hard-stop is not for a modbus drive, which reports no torque" },
    { "rig_rated_torque.yaml", 12, 81, "rated_torque '0' is out of range" },
    { "rig_torque_constant.yaml", 12, 103,
      "torque_constant '1200' is out of range" },
    { "rig_homing_hard_stop_torque.yaml", 13, 13,
      "homing by hard-stop has no 'torque', which the stop is known by" },
    { "rig_homing_torque_of_switch.yaml", 13, 52,
      "torque is not for homing by switch" },
    { "rig_line_three_estops.yaml", 16, 17,
      "kind is a third e-stop, where one has at most two channels" },
    { "rig_line_discrepancy.yaml", 15, 71,
      "discrepancy is for the second line of kind e-stop" },
    { "rig_map_for_value.yaml", 8, 17, "velocity is a map" },
    { "rig_merge_key.yaml", 5, 5, "merge keys (<<) are not read" },
    { "rig_missing_axes.yaml", 1, 1, "the rig has no 'axes'" },
    { "rig_missing_unit.yaml", 5, 5, "dolly has no 'unit'" },
    { "rig_monitor_cold.yaml", 12, 108,
      "temperature '-5 degC' is out of range" },
    { "rig_monitor_current_zero.yaml", 12, 104,
      "current '0 A' is out of range" },
    { "rig_monitor_hot.yaml", 12, 108,
      "temperature '301 degC' is out of range" },
    { "rig_monitor_key.yaml", 12, 95, "unknown key 'heat'" },
    { "rig_monitor_moteus.yaml", 12, 12,
      "drive monitors a voltage beyond the 63.5 V that its drive can say" },
    { "rig_monitor_no_object.yaml", 12, 91,
      "temperature is not reported by this drive" },
    { "rig_monitor_no_such.yaml", 12, 86,
      "object is not an object of this drive" },
    { "rig_monitor_object.yaml", 12, 103, "object is for a cia402 drive" },
    { "rig_monitor_scale.yaml", 12, 85, "scale is given without object" },
    { "rig_monitor_unit.yaml", 12, 108, "temperature '80 V' is a voltage" },
    { "rig_monitor_voltage_one.yaml", 12, 104, "voltage is a single value" },
    { "rig_monitor_voltage_order.yaml", 12, 111,
      "voltage ends where it begins or before" },
    { "rig_moteus_without_fd.yaml", 12, 32,
      "bus can0 is a can bus without FD frames, not one for this kind of "
      "drive" },
    { "rig_move.yaml", 1, 1, "unknown key 'fps'" },
    { "rig_nan.yaml", 8, 17, "velocity '.nan' is not a number" },
    { "rig_negative_limit.yaml", 8, 17,
      "velocity '-300 mm/s' is not above zero" },
    { "rig_no_value.yaml", 8, 16, "velocity has no value" },
    { "rig_node_ours.yaml", 12, 44, "node 127 is our own on bus can0" },
    { "rig_node_range.yaml", 12, 44, "node '128' is not in 1 .. 127" },
    { "rig_node_text.yaml", 12, 44, "node 'one' is not a whole number" },
    { "rig_node_twice.yaml", 17, 44,
      "node 7 on bus can0 is axis dolly's already, as in line 12" },
    { "rig_nul.yaml", 8, 18, "character U+0000 is not printable" },
    { "rig_odrive_endpoints.yaml", 12, 77,
      "endpoints 'none.json' is no JSON file that can be read" },
    { "rig_odrive_no_watchdog.yaml", 12, 77,
      "endpoints 'endpoints.json' does not have the endpoints "
      "axis0.config.enable_watchdog and axis0.config.watchdog_timeout" },
    { "rig_odrive_node.yaml", 12, 44, "node '63' is not in 0 .. 62" },
    { "rig_odrive_unwatched.yaml", 12, 12,
      "drive has a watchdog that slew does not set" },
    { "rig_odrive_with_fd.yaml", 12, 32,
      "bus can0 is a can bus with FD frames, not one for this kind of drive" },
    { "rig_quote_open.yaml", 5, 11, "the quotation is not closed" },
    { "rig_range_of_three.yaml", 7, 17, "position has 3 items" },
    { "rig_range_reversed.yaml", 7, 27,
      "position ends where it begins or before" },
    { "rig_scalar.yaml", 1, 1, "the rig is a single value" },
    { "rig_sim_device.yaml", 17, 19, "device is only for a modbus drive" },
    { "rig_sim_load_inertia.yaml", 17, 27, "inertia '0' is out of range" },
    { "rig_sim_load_static.yaml", 17, 83, "static_friction is below friction" },
    { "rig_sim_load_stribeck.yaml", 17, 17,
      "load has static_friction above friction, but no stribeck" },
    { "rig_sim_load_stops.yaml", 17, 17,
      "load has stops inside the axis's position limits" },
    { "rig_sim_loops_below.yaml", 17, 18, "loops has velocity below position" },
    { "rig_sim_loops_current.yaml", 17, 18,
      "loops has current below velocity" },
    { "rig_sim_loops_fast.yaml", 17, 45, "velocity '1001 Hz' is out of range" },
    { "rig_sim_loops_multiple.yaml", 17, 18,
      "loops has a position_period that is no multiple of velocity_period" },
    { "rig_sim_loops_period.yaml", 17, 68,
      "current_period '19 us' is out of range" },
    { "rig_sim_loops_reset.yaml", 17, 64, "reset_time is below 1 ms" },
    { "rig_sim_loops_slow.yaml", 17, 18,
      "loops has a position_period above a tenth of 1 / position" },
    { "rig_sim_loops_sampled.yaml", 17, 18,
      "loops has a velocity_period above a tenth of 1 / velocity" },
    { "rig_sim_motor_empty.yaml", 17, 18, "motor has neither stall nor rated" },
    { "rig_sim_motor_rated.yaml", 17, 18,
      "motor has one of rated and thermal_time" },
    { "rig_sim_motor_stall.yaml", 17, 18,
      "motor has one of stall and no_load_speed" },
    { "rig_sim_motor_steep.yaml", 17, 18,
      "motor has a stall above no_load_speed in 1 ms" },
    { "rig_sim_motor_warning.yaml", 17, 65, "warning '1.1' is out of range" },
    { "rig_sim_load_efficiency.yaml", 17, 74,
      "efficiency '0.04' is out of range" },
    { "rig_sim_load_pitch.yaml", 17, 61,
      "transmission has one of pitch and pitch_error" },
    { "rig_sim_load_pitch_error.yaml", 17, 61,
      "transmission has a pitch_error above pitch / 13" },
    { "rig_sim_load_second.yaml", 17, 55, "second has no 'frequency'" },
    { "rig_sim_home_switch.yaml", 17, 31,
      "home_switch ends where it begins or before" },
    { "rig_start_outside.yaml", 12, 18, "start is outside the axis's limits" },
    { "rig_stop_below.yaml", 11, 26,
      "acceleration is below the axis's own limit" },
    { "rig_stop_jerk.yaml", 10, 18,
      "jerk is given, but the axis has none among its limits" },
    { "rig_sync_counter.yaml", 2, 59, "sync_counter '1' is not in 2 .. 240" },
    { "rig_tab_indentation.yaml", 8, 1, "tab in the indentation" },
    { "rig_tag.yaml", 5, 11, "tags (!) are not read" },
    { "rig_tick_fraction.yaml", 1, 7,
      "tick '0.5001 ms' is not a whole number of us" },
    { "rig_tick_range.yaml", 1, 7, "tick '1 s' is out of range" },
    { "rig_title_long.yaml", 1, 8, "title is longer than 127 bytes" },
    { "rig_too_large.yaml", 8, 17, "velocity '1e400' is too large" },
    { "rig_too_many_digits.yaml", 8, 17,
      "velocity '0.1234567890123456789 mm/s' has more than 18 digits" },
    { "rig_turns_digits.yaml", 12, 54, "turns has too many digits" },
    { "rig_turns_overflow.yaml", 12, 54,
      "turns gives more than 32767 turns at the end of the axis" },
    { "rig_two_documents.yaml", 3, 1, "a second document starts here" },
    { "rig_unknown_bus.yaml", 12, 32, "unknown bus 'can1'" },
    { "rig_unknown_key.yaml", 8, 7, "unknown key 'velocty'" },
    { "rig_unknown_unit_word.yaml", 5, 11, "unknown unit 'furlong'" },
    { "rig_utf16.yaml", 1, 1, "byte \\xff is not UTF-8 text" },
    { "rig_guardian.yaml", 2, 11,
      "unknown guardian 'maybe', expected warn or stop" },
    { "rig_watchdog.yaml", 2, 11, "watchdog '15 ms' is out of range" },
    { "rig_wrong_unit.yaml", 8, 17,
      "velocity '800 kg' has the unknown unit 'kg'" },
    { "rig_zero_limit.yaml", 9, 21,
      "acceleration '1e-10 mm/s2' is not above zero" },
};

static enum kind bad_kind(const char *name)
{
    if (strncmp(name, "rig_", 4) == 0)
        return RIG;
    return strncmp(name, "move_path_", 10) == 0 ||
                   strncmp(name, "move_camera_", 12) == 0
               ? FLIGHT
               : MOVE;
}

static void bad_files_get_one_line_that_points_at_the_place(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(bad); i++) {
        char path[128];
        snprintf(path, sizeof(path), "tests/data/bad/%s", bad[i].name);
        expect_refusal(bad_kind(bad[i].name), path, bad[i].line, bad[i].column,
                       bad[i].what);
    }
}

static void what_cannot_be_read_is_said(void **state)
{
    (void)state;
    expect_refusal(RIG, "no/such/file", 1, 1,
                   "the file cannot be read (No such file or directory)");
    expect_refusal(MOVE, "tests", 1, 1,
                   "the file cannot be read (Is a directory)");
}

static void a_path_with_anything_in_it_is_one_line(void **state)
{
    char path[1200], message[YAML_MESSAGE_MAX];

    (void)state;
    memset(path, 'p', sizeof(path) - 1);
    path[sizeof(path) - 1] = 0;
    assert_int_equal(load(RIG, path, message), -1);
    assert_int_equal(strncmp(message, "...ppp", 6), 0);
    assert_non_null(strstr(message, "ppp:1:1: the file cannot be read ("));
    assert_int_equal(load(RIG, "a\nb\x1b[31m", message), -1);
    assert_non_null(strstr(message, "a\\x0ab\\x1b[31m:1:1: "));
}

/* ---- big files ---- */

/* `head`, then `item` `count` times. */
static void write_repeated(const char *head, const char *item, size_t count)
{
    FILE *file = fopen(scratch, "wb");

    assert_non_null(file);
    fputs(head, file);
    for (size_t i = 0; i < count; i++)
        fputs(item, file);
    fclose(file);
}

static void big_files_are_refused_at_a_bound(void **state)
{
    (void)state;
    write_repeated("title: ", "x", 10 * 1024 * 1024);
    expect_refusal(RIG, scratch, 1, 1048577, "the line is longer than 1048576");
    write_repeated("title: |\n", " x\n", 6 * 1024 * 1024);
    expect_refusal(RIG, scratch, 1, 1, "the file is larger than 16 MiB");
    write_repeated("", "[", 100000);
    expect_refusal(RIG, scratch, 1, 17, "maps and lists are nested more than");
    write_repeated("", "{a: ", 17);
    expect_refusal(RIG, scratch, 1, 65, "maps and lists are nested more than");
    write_repeated("- \n", "- \n", 5 * 1024 * 1024);
    expect_refusal(MOVE, scratch, 4194304, 2, "more than 4194304 values");
    write_repeated("axes:\n dolly:\n  keys:\n", "  - [0,0]\n", 1000001);
    expect_refusal(MOVE, scratch, 4, 3, "keys has 1000001 items");
}

static void a_map_has_a_bound(void **state)
{
    char text[8192] = "axes:\n";

    (void)state;
    for (int i = 0; i < 257; i++)
        snprintf(text + strlen(text), sizeof(text) - strlen(text), "  k%d: 1\n",
                 i);
    write_scratch(text, strlen(text));
    expect_refusal(MOVE, scratch, 258, 3, "more than 256 keys in one map");
}

static void names_and_buses_have_a_bound(void **state)
{
    char text[4096] = "axes: {}\nbuses:\n";

    (void)state;
    for (int i = 0; i < RIG_BUSES_MAX + 1; i++)
        snprintf(text + strlen(text), sizeof(text) - strlen(text),
                 "  k%d: {kind: canopen, bit_rate: 10000}\n", i);
    write_scratch(text, strlen(text));
    expect_refusal(RIG, scratch, 3, 3, "buses has more than 32 entries");
    expect_text(RIG,
                "axes: 1\nbuses: {a23456789012345678901234567890ab: {kind: "
                "canopen, bit_rate: 10000}}",
                "is not a name");
    expect_text(RIG,
                "axes: 1\nbuses: {a23456789012345678901234567890a: {kind: "
                "canopen, bit_rate: 10000}}",
                ":1:7: axes is a single value");
}

static void a_long_list_of_names_is_cut(void **state)
{
    FILE *file = fopen(scratch, "w");
    char message[YAML_MESSAGE_MAX];
    struct plan_move move;
    struct rig other = { .bus_count = 0 };

    (void)state;
    assert_non_null(file);
    fputs("buses: {b: {kind: canopen, bit_rate: 10000}}\naxes:\n", file);
    for (int i = 1; i <= 16; i++)
        fprintf(file,
                "  an_axis_with_a_rather_long_name%d: {unit: mm, "
                "following_error: {floor: 1}, limits: {position: [0, 1], "
                "velocity: 1, acceleration: 1}, "
                "drive: {kind: cia402, bus: b, node: %d, counts: 1}}\n",
                i % 10, i);
    fclose(file);
    /* 11 to 16 are 1 to 6 again */
    assert_int_equal(rig_load(&disk_files, scratch, &other, message), -1);
    rig_free(&other);
    assert_non_null(strstr(message, ":13:3: key 'an_axis_with_a_rather_long_"
                                    "name1' is already there in line 3"));
    static struct rig_axis many[16];
    other = (struct rig){ .axis = many, .axis_count = ARRAY_LEN(many) };
    for (size_t i = 0; i < ARRAY_LEN(many); i++)
        snprintf(many[i].name, PLAN_NAME_MAX, "an_axis_with_a_rather_long_na%c",
                 'a' + (char)i);
    assert_int_equal(move_load(&disk_files, GOOD_MOVE, &other, &move, message),
                     -1);
    assert_true(is_well_formed(GOOD_MOVE, message));
    assert_non_null(strstr(message, "long_nak ..."));
}

static void a_hundred_thousand_keys_are_read(void **state)
{
    FILE *file = fopen(scratch, "wb");
    char message[YAML_MESSAGE_MAX];
    struct plan_move move;

    (void)state;
    assert_non_null(file);
    fputs("axes: {dolly: {keys: [\n", file);
    for (int i = 0; i < 100000; i++)
        fprintf(file, "[%d ms, %d um],\n", i, i);
    fputs("]}}\n", file);
    fclose(file);
    if (move_load(&disk_files, scratch, &rig, &move, message) < 0)
        fail_msg("%s", message);
    assert_int_equal(move.axis[0].key_count, 100000);
    assert_int_equal(move.axis[0].key[99999].key.t_ns_q12, MS(99999) * 4096);
    move_free(&move);
}

/* ---- broken files ---- */

/* Read or refused with one line; which is not judged. */
static void expect_answer(enum kind kind, const char *text, size_t length,
                          size_t run)
{
    char message[YAML_MESSAGE_MAX];

    write_scratch(text, length);
    if (load(kind, scratch, message) < 0 && !is_well_formed(scratch, message))
        fail_msg("run %zu: %.*s", run, YAML_MESSAGE_MAX, message);
}

static const struct {
    enum kind kind;
    const char *path;
} good[] = {
    { RIG, GOOD_RIG },
    { MOVE, GOOD_MOVE },
    { FLIGHT, "examples/flyby/move.yaml" },
    { MOVE, "examples/poses/move.yaml" },
};

static void every_truncation_gets_an_answer(void **state)
{
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(good); k++) {
        size_t length;
        const char *text = read_all(good[k].path, &length);
        for (size_t i = 0; i < length; i++)
            expect_answer(good[k].kind, text, i, i);
    }
}

/* A few bytes of a good file changed to any, or to those YAML cares for. */
static void flip(char *text, size_t length)
{
    static const char special[] = "\t\n\r []{}:,-'\"#&*!|>%@`?~<.0\\";
    const size_t count = draw() % 3 + 1;

    for (size_t i = 0; i < count; i++)
        text[draw() % length] = draw() % 2 == 0
                                    ? (char)draw()
                                    : special[draw() % (sizeof(special) - 1)];
}

static void random_flips_get_an_answer(void **state)
{
    (void)state;
    seed_from("random flips");
    for (size_t i = 0; i < 4000; i++) {
        const size_t k = i % ARRAY_LEN(good);
        size_t length;
        char *text = read_all(good[k].path, &length);
        flip(text, length);
        expect_answer(good[k].kind, text, length, i);
    }
}

/* ---- tables for tests/proofs/check_schema.py ---- */

static void print_shapes(const char *file,
                         const struct yaml_shape *const shape[])
{
    for (; *shape != NULL; shape++)
        for (unsigned i = 0; i < (*shape)->count; i++)
            printf("key %s %s %s %s\n", file, (*shape)->name,
                   (*shape)->field[i].name,
                   (*shape)->field[i].presence == YAML_REQUIRED ? "required"
                                                                : "optional");
}

static void print_words(const char *file, const struct yaml_words *words)
{
    for (; words->name != NULL; words++)
        for (unsigned i = 0; i < words->count; i++)
            printf("word %s %s %s\n", file, words->name, words->spelling[i]);
}

static int print_fields(void)
{
    print_shapes("rig", rig_shapes);
    print_shapes("move", move_shapes);
    print_shapes("faults", fault_shapes);
    print_shapes("map", map_shapes);
    print_shapes("quirks", quirk_shapes);
    print_words("rig", rig_words);
    print_words("move", move_words);
    print_words("faults", fault_words);
    print_words("map", map_words);
    print_words("quirks", quirk_words);
    return 0;
}

int main(int argc, char *argv[])
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_example_rig_is_read_as_written),
        cmocka_unit_test(the_example_move_is_read_as_written),
        cmocka_unit_test(the_example_move_is_where_the_rig_can_be),
        cmocka_unit_test(what_is_left_out_has_the_documented_value),
        cmocka_unit_test(keys_have_a_short_and_a_long_form),
        cmocka_unit_test(curves_bring_their_parameters),
        cmocka_unit_test(keys_with_handles_are_read_as_written),
        cmocka_unit_test(keys_may_have_parameters_of_their_span),
        cmocka_unit_test(the_documentation_shows_files_that_can_be_read),
        cmocka_unit_test(line_ends_and_byte_order_mark_do_not_matter),
        cmocka_unit_test(line_ends_and_byte_order_mark_do_not_move_places),
        cmocka_unit_test(quotes_comments_and_json_are_yaml),
        cmocka_unit_test(bad_files_get_one_line_that_points_at_the_place),
        cmocka_unit_test(what_cannot_be_read_is_said),
        cmocka_unit_test(a_path_with_anything_in_it_is_one_line),
        cmocka_unit_test(big_files_are_refused_at_a_bound),
        cmocka_unit_test(a_map_has_a_bound),
        cmocka_unit_test(names_and_buses_have_a_bound),
        cmocka_unit_test(a_long_list_of_names_is_cut),
        cmocka_unit_test(a_hundred_thousand_keys_are_read),
        cmocka_unit_test(every_truncation_gets_an_answer),
        cmocka_unit_test(random_flips_get_an_answer),
    };

    if (argc > 1 && strcmp(argv[1], "--fields") == 0)
        return print_fields();
    return cmocka_run_group_tests(tests, make_scratch, remove_scratch);
}
