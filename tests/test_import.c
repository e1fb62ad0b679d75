/* tests/test_import.c - moves of other programs: what is read, what is refused,
 * and that writing and reading give the same move. */
#define _XOPEN_SOURCE 700 /* mkdtemp */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "firmware/linux/exchange/import.h"
#include "motion/err.h"
#include "motion/fixed.h"
#include "tests/check.h"

#define SEED       UINT64_C(0x2545F4914F6CDD1D)
#define DATA       "tests/data/import/"
#define RIG_FILE   DATA "rig.yaml"
#define CUBIC_FILE DATA "cubic.yaml"
#define KUPER_FILE DATA "kuper.txt"
#define FLAIR_FILE DATA "flair.txt"

static char directory[64];
static struct rig rig;
static char message[RIG_MESSAGE_MAX];

static int open_bench(void **state)
{
    (void)state;
    snprintf(directory, sizeof directory, "/tmp/slew-test-XXXXXX");
    if (mkdtemp(directory) == NULL)
        return -1;
    return rig_load(DATA "rig.yaml", &rig, message);
}

static int close_bench(void **state)
{
    (void)state;
    return rmdir(directory); /* every test has removed what it wrote */
}

static const char *in_directory(const char *name)
{
    static char path[4][128];
    static unsigned next;
    next = (next + 1) % 4;
    snprintf(path[next], sizeof path[next], "%s/%s", directory, name);
    return path[next];
}

static const char *write_file(const char *data, size_t length)
{
    const char *path = in_directory("in");
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, length, file), length);
    fclose(file);
    return path;
}

static size_t read_file(const char *path, char *data, size_t room)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    size_t length = fread(data, 1, room, file);
    fclose(file);
    return length;
}

static struct import_wish wish_of(uint64_t fps)
{
    return (struct import_wish){ .rig = &rig,
                                 .fps = { fps, fps > 0 },
                                 .curve = PLAN_CURVE_QUINTIC };
}

static struct imported imported_from(const char *format, const char *path,
                                     const struct import_wish *wish)
{
    struct imported imported;
    if (import_format_find(format)->read(path, wish, &imported, message) < 0)
        fail_msg("%s", message);
    return imported;
}

/* Through move.yaml: the same keys, to the bit. */
static int64_t vel_q32(const struct motion_key *key)
{
    int64_t value = 0;
    assert_int_equal(motion_real_round(key->vel, 32, &value), 0);
    return value;
}

static int64_t acc_q16(const struct motion_key *key)
{
    int64_t value = 0;
    assert_int_equal(motion_real_round(key->acc, 16, &value), 0);
    return value;
}

static void check_move_file(const struct imported *imported)
{
    const char *path = in_directory("move.yaml");
    struct plan_move back;
    FILE *file = fopen(path, "wb");
    assert_int_equal(export_move(imported, "test", file, message), 0);
    fclose(file);
    if (move_load(path, &rig, &back, message) < 0)
        fail_msg("%s", message);
    unlink(path);
    assert_int_equal(back.axis_count, imported->move.axis_count);
    for (uint32_t i = 0; i < back.axis_count; i++) {
        const struct plan_axis *a = &back.axis[i], *b = &imported->move.axis[i];
        assert_string_equal(a->name, b->name);
        assert_int_equal(a->curve, b->curve);
        assert_int_equal(a->key_count, b->key_count);
        for (uint32_t k = 0; k < a->key_count; k++) {
            assert_int_equal(a->key[k].key.t_ns_q12, b->key[k].key.t_ns_q12);
            assert_int_equal(a->key[k].key.pos_q32, b->key[k].key.pos_q32);
            assert_int_equal(a->key[k].key.has_vel, b->key[k].key.has_vel);
            assert_int_equal(vel_q32(&a->key[k].key), vel_q32(&b->key[k].key));
            assert_int_equal(acc_q16(&a->key[k].key), acc_q16(&b->key[k].key));
        }
    }
    move_free(&back);
}

/* --- good files --- */

static int64_t q32(double value)
{
    return (int64_t)(value * 4294967296.0 + (value < 0 ? -0.5 : 0.5));
}

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
        struct import_wish wish = wish_of(rows[i].fps);
        struct imported got =
            imported_from(rows[i].format, rows[i].path, &wish);
        const struct plan_axis *tilt = &got.move.axis[1];
        assert_string_equal(got.move.axis[0].name, "pan");
        assert_string_equal(tilt->name, "tilt");
        assert_int_equal(tilt->key_count, rows[i].rows);
        assert_int_equal(tilt->key[0].key.t_ns_q12, 0);
        assert_int_equal(tilt->key[1].key.t_ns_q12, rows[i].ns * 4096);
        assert_int_equal(tilt->key[1].key.pos_q32, q32(rows[i].tilt));
        assert_string_equal(got.note, "");
        check_move_file(&got);
        move_free(&got.move);
    }
}

static void csv_keeps_velocity_and_acceleration(void **state)
{
    struct import_wish wish = wish_of(0);
    (void)state;
    struct imported got = imported_from("csv", DATA "table.csv", &wish);
    const struct motion_key *key = &got.move.axis[0].key[1].key;
    assert_int_equal(got.move.axis[0].curve, PLAN_CURVE_QUINTIC);
    assert_true(key->has_vel && key->has_acc);
    assert_int_equal(vel_q32(key), q32(2.5));
    assert_int_equal(acc_q16(key), -32768);
    assert_false(got.move.axis[1].key[1].key.has_vel);
    move_free(&got.move);
}

static void columns_go_where_the_user_says(void **state)
{
    struct import_wish wish = wish_of(25);
    (void)state;
    assert_int_equal(import_wish_columns(&wish, "-,dolly", message), 0);
    struct imported got = imported_from("kuper", DATA "kuper.txt", &wish);
    assert_int_equal(got.move.axis_count, 1);
    assert_string_equal(got.move.axis[0].name, "dolly");
    assert_int_equal(got.move.axis[0].key[0].key.pos_q32, q32(6.1465));
    move_free(&got.move);
}

static void tangents_become_velocities_and_losses_are_said(void **state)
{
    struct import_wish wish = wish_of(0);
    (void)state;
    struct imported got = imported_from("maya", DATA "tangents.anim", &wish);
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
    check_move_file(&got);
    move_free(&got.move);
}

#define ANIM_HEAD "animVersion 1.1;\ntimeUnit film;\nendTime %s;\n"
#define ANIM_CURVE                                                             \
    "anim a.b pan pan 0 0 0;\nanimData {\noutput angular;\nweighted %d;\n"     \
    "preInfinity %s;\npostInfinity %s;\nkeys {\n%s}\n}\n"

static struct imported anim_of(const char *end, int weighted,
                               const char *infinity, const char *keys)
{
    struct import_wish wish = wish_of(0);
    char text[1024];
    const int length = snprintf(text, sizeof text, ANIM_HEAD ANIM_CURVE, end,
                                weighted, infinity, infinity, keys);
    struct imported got =
        imported_from("maya", write_file(text, (size_t)length), &wish);
    unlink(in_directory("in"));
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
    check_move_file(&got);
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
    struct import_wish wish = wish_of(0);
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        char text[256];
        const int length =
            snprintf(text, sizeof text,
                     "animVersion 1.1;\ntimeUnit %s;\nanim a pan;\nanimData {\n"
                     "output angular;\nkeys {\n0 1 flat flat 1 1 0;\n}\n}\n",
                     rows[i].text);
        struct imported got =
            imported_from("maya", write_file(text, (size_t)length), &wish);
        assert_int_equal(got.fps.num, rows[i].num);
        assert_int_equal(got.fps.den, rows[i].den);
        move_free(&got.move);
    }
    unlink(in_directory("in"));
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
        check_move_file(&got);
        move_free(&got.move);
    }
    struct imported got = anim_of("36", 0, "cycle", keys);
    assert_int_equal(got.move.axis[0].bezier.after.mode, MOTION_FCURVE_ONCE);
    assert_string_equal(got.note,
                        "1 infinities that begin where the file ends");
    move_free(&got.move);
}

/* --- there and back --- */

static void opened(struct job *job, const char *move)
{
    struct options options = { .path = { DATA "rig.yaml", move },
                               .path_count = 2 };
    assert_int_equal(job_open(job, &options), STATUS_OK);
}

static struct imported there_and_back(const struct job *job, const char *format,
                                      struct units_fps fps)
{
    const char *path = in_directory("there");
    struct import_wish wish = wish_of(0);
    FILE *file = fopen(path, "wb");
    wish.fps = fps;
    /* raw has no names */
    for (unsigned i = 0; i < job->move.axis_count && format[0] == 'r'; i++)
        memcpy(wish.column[wish.column_count++], job->move.axis[i].name,
               PLAN_NAME_MAX);
    if (import_format_find(format)->write(job, &fps, file, message) < 0)
        fail_msg("%s", message);
    fclose(file);
    struct imported got = imported_from(format, path, &wish);
    unlink(path);
    return got;
}

/* A row per sample of the move. */
static void check_samples(const struct job *job, const struct imported *got)
{
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        const struct plan_axis *axis = &got->move.axis[i];
        struct motion_cursor cursor = { 0 };
        assert_true(axis->key[axis->key_count - 1].key.t_ns_q12 >=
                    job->end_ns_q12);
        for (uint32_t k = 0; k < axis->key_count; k++) {
            const struct motion_key *key = &axis->key[k].key;
            struct motion_sample want;
            motion_track_sample(&job->track[i], &cursor, key->t_ns_q12, &want);
            assert_int_equal(key->pos_q32, want.pos_q32);
            if (key->has_vel)
                assert_int_equal(vel_q32(key), want.vel_q32);
            if (key->has_acc)
                assert_int_equal(acc_q16(key), want.acc_q16);
        }
    }
}

static void a_table_that_was_written_has_the_samples_to_the_bit(void **state)
{
    static const char *const formats[] = { "kuper", "flair", "raw", "csv" };
    static const struct units_fps rates[] = { { 24, 1 }, { 24000, 1001 } };
    static struct job job;
    (void)state;
    opened(&job, DATA "cubic.yaml");
    for (size_t f = 0; f < 2 * ARRAY_LEN(formats); f++) {
        struct imported got =
            there_and_back(&job, formats[f / 2], rates[f % 2]);
        check_samples(&job, &got);
        check_move_file(&got);
        move_free(&got.move);
    }
    job_free(&job);
}

/* Half of what a curve was baked to, twice: 2^-33 of its range. */
static int64_t baked_q32(const struct motion_track *track)
{
    struct motion_extreme extreme;
    motion_track_extreme(track, MOTION_POS, &extreme);
    return (extreme.max - extreme.min) >> 33;
}

/* The same positions, within 1e-8 unit and what baking adds. */
static void check_curves(const struct job *job, const struct imported *got)
{
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        struct motion_cursor a = { 0 }, b = { 0 };
        struct motion_track track;
        struct plan_error error;
        const int64_t within = 43 + baked_q32(&job->track[i]);
        if (plan_axis_track(&got->move.axis[i], &track, &error) != 0)
            fail_msg("axis %u: %s", i, error.text);
        for (int k = 0; k <= 1000; k++) {
            int64_t t = job->track[i].end_ns_q12 / 1000 * k;
            struct motion_sample x, y;
            motion_track_sample(&job->track[i], &a, t, &x);
            motion_track_sample(&track, &b, t, &y);
            if (llabs(x.pos_q32 - y.pos_q32) > within)
                fail_msg("axis %u at %d: off by %lld", i, k,
                         (long long)(x.pos_q32 - y.pos_q32));
        }
        plan_track_free(&track);
    }
}

static void cubics_come_back_from_anim_as_the_same_curve(void **state)
{
    static struct job job;
    (void)state;
    opened(&job, DATA "cubic.yaml");
    struct imported got =
        there_and_back(&job, "maya", (struct units_fps){ 25, 1 });
    check_curves(&job, &got);
    assert_string_equal(got.note, "");
    move_free(&got.move);
    job_free(&job);
}

/* --- random moves, there and back --- */

#define MOVES    60
#define KEYS_MAX 8
#define END_S    40

static struct plan_handle random_handle(uint64_t *seed, int64_t span, bool left)
{
    /* one of two long handles could make the curve vertical */
    const int64_t most = left ? 50 : check_random_in(seed, 0, 7) ? 80 : 130;
    return (struct plan_handle){
        .kind = (uint8_t)(check_random_in(seed, 0, 2)
                              ? MOTION_FCURVE_FREE
                              : check_random_in(seed, 0, 4)),
        .dt_ns_q12 = (left ? -1 : 1) *
                     (check_random_in(seed, 0, 3)
                          ? span / 100 * check_random_in(seed, 10, most)
                          : span / 3),
        .dp_q32 = check_random_in(seed, q32(-15), q32(15)),
    };
}

static void random_infinity(uint64_t *seed, struct plan_bezier *bezier)
{
    static const uint8_t modes[] = { MOTION_FCURVE_ONCE,
                                     MOTION_FCURVE_REPEAT_OFFSET,
                                     MOTION_FCURVE_MIRROR };
    bezier->before.mode = modes[check_random_in(seed, 0, 2)];
    bezier->after.mode = modes[check_random_in(seed, 0, 2)];
    bezier->extrapolation = (uint8_t)check_random_in(seed, 0, 1);
    bezier->has_end = bezier->after.mode != MOTION_FCURVE_ONCE ||
                      bezier->extrapolation != MOTION_FCURVE_HOLD;
    if (bezier->has_end)
        bezier->end_ns_q12 = END_S * MOTION_FIXED_S_Q12;
}

static void random_handles(uint64_t *seed, struct plan_axis *axis)
{
    axis->bezier.key = calloc(axis->key_count, sizeof *axis->bezier.key);
    assert_non_null(axis->bezier.key);
    for (uint32_t k = 0; k < axis->key_count; k++) {
        const struct plan_key *at = &axis->key[k];
        const struct plan_key *before = k > 0 ? at - 1 : at;
        const struct plan_key *after = k + 1 < axis->key_count ? at + 1 : at;
        struct plan_bezier_key *key = &axis->bezier.key[k];
        key->left =
            random_handle(seed,
                          k > 0 ? at->key.t_ns_q12 - before->key.t_ns_q12
                                : MOTION_FIXED_S_Q12,
                          true);
        key->right =
            random_handle(seed,
                          after != at ? after->key.t_ns_q12 - at->key.t_ns_q12
                                      : MOTION_FIXED_S_Q12,
                          false);
        key->interpolation = check_random_in(seed, 0, 4) ? MOTION_FCURVE_BEZIER
                                                         : MOTION_FCURVE_LINEAR;
    }
    random_infinity(seed, &axis->bezier);
}

/* The first axis starts at 0: Maya's time counts from the first key. */
static void random_axis(uint64_t *seed, const char *name, bool first,
                        struct plan_axis *axis)
{
    static const enum plan_curve curves[] = {
        PLAN_CURVE_LINEAR, PLAN_CURVE_HERMITE, PLAN_CURVE_CATMULL_ROM,
        PLAN_CURVE_C2,     PLAN_CURVE_BEZIER,  PLAN_CURVE_BEZIER,
    };
    int64_t t = first ? 0 : check_random_in(seed, 0, 2 * MOTION_FIXED_S_Q12);
    snprintf(axis->name, sizeof axis->name, "%s", name);
    axis->curve = curves[check_random_in(seed, 0, ARRAY_LEN(curves) - 1)];
    axis->key_count = (uint32_t)check_random_in(seed, 2, KEYS_MAX);
    axis->key = calloc(axis->key_count, sizeof *axis->key);
    assert_non_null(axis->key);
    for (uint32_t k = 0; k < axis->key_count; k++) {
        struct motion_key *key = &axis->key[k].key;
        key->t_ns_q12 = t;
        key->pos_q32 = check_random_in(seed, 0, q32(55));
        key->has_vel = axis->curve == PLAN_CURVE_HERMITE;
        if (key->has_vel)
            key->vel = motion_real_from_q(
                check_random_in(seed, q32(-20), q32(20)), 32);
        t += check_random_in(seed, MOTION_FIXED_S_Q12 / 4,
                             4 * MOTION_FIXED_S_Q12);
    }
    if (axis->curve == PLAN_CURVE_BEZIER)
        random_handles(seed, axis);
}

static void random_job(uint64_t *seed, struct job *job)
{
    static const char *const names[] = { "pan", "tilt", "dolly" };
    static struct imported move;
    const char *path = in_directory("random.yaml");
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    move = (struct imported){ .fps = { 25, 1 } };
    move.move.axis_count = ARRAY_LEN(names);
    for (size_t i = 0; i < ARRAY_LEN(names); i++)
        random_axis(seed, names[i], i == 0, &move.move.axis[i]);
    assert_int_equal(export_move(&move, "test", file, message), 0);
    fclose(file);
    opened(job, path);
    unlink(path);
    move_free(&move.move);
}

static struct units_fps random_rate(uint64_t *seed)
{
    static const struct units_fps rates[] = {
        { 24, 1 }, { 25, 1 }, { 25, 2 }, { 24000, 1001 }, { 30000, 1001 },
    };
    return rates[check_random_in(seed, 0, ARRAY_LEN(rates) - 1)];
}

static void random_moves_come_back_from_tables_to_the_bit(void **state)
{
    static const char *const formats[] = { "kuper", "flair", "raw", "csv" };
    static struct job job;
    uint64_t seed = SEED;
    (void)state;
    printf("seed %#llx\n", (unsigned long long)SEED);
    for (int move = 0; move < MOVES; move++) {
        random_job(&seed, &job);
        for (size_t f = 0; f < ARRAY_LEN(formats); f++) {
            struct imported got =
                there_and_back(&job, formats[f], random_rate(&seed));
            check_samples(&job, &got);
            move_free(&got.move);
        }
        job_free(&job);
    }
}

static void random_moves_come_back_from_anim_as_the_same_curve(void **state)
{
    static struct job job;
    uint64_t seed = SEED;
    (void)state;
    printf("seed %#llx\n", (unsigned long long)SEED);
    for (int move = 0; move < MOVES; move++) {
        random_job(&seed, &job);
        struct imported got = there_and_back(&job, "maya", random_rate(&seed));
        check_curves(&job, &got);
        for (unsigned i = 0; i < job.move.axis_count; i++) {
            if (job.move.axis[i].curve != PLAN_CURVE_BEZIER)
                continue;
            assert_int_equal(got.move.axis[i].curve, PLAN_CURVE_BEZIER);
            assert_int_equal(got.move.axis[i].key_count,
                             job.move.axis[i].key_count);
        }
        assert_string_equal(got.note, "");
        move_free(&got.move);
        job_free(&job);
    }
}

/* ALIGNED ones are computed for other frames than the move's, 1/24 s. */
static void check_same_handle(const struct plan_handle *a,
                              const struct plan_handle *b, bool film)
{
    assert_int_equal(a->kind, b->kind);
    if (a->kind != MOTION_FCURVE_FREE &&
        !(film && a->kind == MOTION_FCURVE_ALIGNED))
        return;
    assert_int_equal(a->dt_ns_q12, b->dt_ns_q12);
    assert_int_equal(a->dp_q32, b->dp_q32);
}

static void check_same_keys(const struct plan_axis *a,
                            const struct plan_axis *b, bool film)
{
    assert_int_equal(a->key_count, b->key_count);
    for (uint32_t k = 0; k < a->key_count; k++) {
        assert_int_equal(a->key[k].key.t_ns_q12, b->key[k].key.t_ns_q12);
        assert_int_equal(a->key[k].key.pos_q32, b->key[k].key.pos_q32);
        check_same_handle(&a->bezier.key[k].left, &b->bezier.key[k].left, film);
        check_same_handle(&a->bezier.key[k].right, &b->bezier.key[k].right,
                          film);
        assert_int_equal(a->bezier.key[k].interpolation,
                         b->bezier.key[k].interpolation);
    }
    assert_int_equal(a->bezier.extrapolation, b->bezier.extrapolation);
    assert_int_equal(a->bezier.before.mode, b->bezier.before.mode);
    assert_int_equal(a->bezier.after.mode, b->bezier.after.mode);
}

static void random_handles_come_back_from_blender_to_the_bit(void **state)
{
    static struct job job;
    uint64_t seed = SEED;
    unsigned whole = 0;
    (void)state;
    printf("seed %#llx\n", (unsigned long long)SEED);
    for (int move = 0; move < MOVES; move++) {
        random_job(&seed, &job);
        const struct units_fps rate = random_rate(&seed);
        struct imported got = there_and_back(&job, "blender", rate);
        check_curves(&job, &got);
        for (unsigned i = 0; i < job.move.axis_count; i++) {
            if (job.move.axis[i].curve != PLAN_CURVE_BEZIER)
                continue;
            check_same_keys(&job.move.axis[i], &got.move.axis[i],
                            rate.num == 24);
            whole++;
        }
        move_free(&got.move);
        job_free(&job);
    }
    assert_true(whole > MOVES / 2);
}

/* --- bad files --- */

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
    { "kuper", "Axes = pan\n1\n", ":1:1: the file does not say how many", 0 },
    { "kuper", "pan, tilt\n1 2\n", ":1:1: the first line does not name", 24 },
    { "kuper", "Axes = pan, yaw\n1 2\n", ":1:13: 'yaw' is no axis", 24 },
    { "kuper", "Axes = pan, Pan\n1 2\n", ":1:13: axis pan is there for", 24 },
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
    { "raw", "1 2\n", ":1:4: the row ends after 2 of 3", 24 },
    { "csv", "t,pan\n0,1\n0,2\n", ":3:1: the time is not later", 0 },
    { "csv", "t,pan\n0,1\n1,\n", ":3:3: '' is not a number", 0 },
    { "csv", "t,t_ns,pan\n0,1\n", ":1:3: there is a second column", 0 },
    { "csv", "pan\n1\n", "expected --fps", 0 },
    { "csv", "t,pan\n0,1\n2e6,2\n", ":3:1: the time is more than", 0 },
    { "maya", "keys\n", ":1:1: the file does not begin", 0 },
    { "maya", "animVersion 1.1;\n", "no curves with axes", 0 },
    { "maya", "animVersion 1.1;\nanimData {\n", "without a line 'anim'", 0 },
    { "maya", "animVersion 1.1;\ntimeUnit lunar;\n", ":2:10: 'lunar'", 0 },
    { "maya", "animVersion 1.1;\nlinearUnit yd;\n", ":2:12: 'yd'", 0 },
    { "maya", ANIM "}\n}\n", "the curve has no keys", 0 },
    { "maya", ANIM "0 1 flat flat 1 1 0;\n", "ends within keys", 0 },
    { "maya", ANIM "0 1 flat flat 1 1 0;\n}\n", "ends within animData", 0 },
    { "maya", ANIM "0 1 flat step 1 1 0;\n}\n}\n", "cannot jump", 0 },
    { "maya", ANIM "0 1 flat curly 1 1 0;\n}\n}\n", ":7:10: 'curly'", 0 },
    { "maya", ANIM "0 1 flat flat 1 1 0 7;\n}\n}\n", ":7:21: '7'", 0 },
    { "maya", ANIM "0 1 flat fixed 1 1 0 90 1;\n}\n}\n", "steeper", 0 },
    { "maya", ANIM "1 1 flat flat 1 1 0;\n1 1 flat flat 1 1 0;\n}\n}\n",
      ":8:1: '1'", 0 },
    { "maya", ANIM "0 1 flat flat\n}\n}\n", "a value is missing", 0 },
    { "maya", ANIM_WEIGHTED "0 1 flat fixed 1 1 0 91 1;\n}\n}\n",
      ":8:22: '91' is not expected, expected an angle", 0 },
    { "maya", ANIM_WEIGHTED "0 1 flat fixed 1 1 0 9 -1;\n}\n}\n",
      ":8:24: '-1' is not expected, expected a weight", 0 },
    { "maya", ANIM_WEIGHTED "0 1 flat fixed 1 1 0 9 1e99;\n}\n}\n",
      ":8:22: '9' is not expected, the tangent reaches", 0 },
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
        struct import_wish wish = wish_of(bad[i].fps);
        struct imported got;
        const char *path = write_file(bad[i].text, strlen(bad[i].text));
        int err =
            import_format_find(bad[i].format)->read(path, &wish, &got, message);
        if (err >= 0 || strstr(message, bad[i].want) == NULL ||
            strncmp(message, path, strlen(path)) != 0)
            fail_msg("row %zu: \"%s\", expected \"%s\"", i,
                     err < 0 ? message : "accepted", bad[i].want);
    }
    unlink(in_directory("in"));
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
    struct import_wish wish = wish_of(good[i].fps);
    struct imported got;
    const char *path = write_file(data, length);
    message[0] = 0;
    if (import_format_find(good[i].format)->read(path, &wish, &got, message) >=
        0) {
        assert_true(got.move.axis_count > 0);
        move_free(&got.move);
        return;
    }
    assert_int_equal(strncmp(message, path, strlen(path)), 0);
    assert_null(strchr(message, '\n'));
    assert_int_equal(got.move.axis_count, 0);
}

static void truncated_files_are_a_move_or_an_error(void **state)
{
    static char data[1 << 16];
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(good); i++) {
        size_t length = read_file(good[i].path, data, sizeof data);
        for (size_t n = 0; n <= length; n++)
            check_any(i, data, n);
    }
    unlink(in_directory("in"));
}

static void flipped_bytes_are_a_move_or_an_error(void **state)
{
    static char data[1 << 16];
    uint64_t seed = SEED;
    (void)state;
    printf("seed %#llx\n", (unsigned long long)SEED);
    for (size_t i = 0; i < ARRAY_LEN(good); i++) {
        size_t length = read_file(good[i].path, data, sizeof data);
        for (int round = 0; round < 1500; round++) {
            size_t at = (size_t)check_random_in(&seed, 0, (int64_t)length - 1);
            char was = data[at];
            data[at] = (char)check_random(&seed);
            check_any(i, data, length);
            data[at] = was;
        }
    }
    unlink(in_directory("in"));
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
    snprintf(out, sizeof out, "%s", in_directory("out.yaml"));
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
    snprintf(out, sizeof out, "%s", in_directory("out.txt"));
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
        cmocka_unit_test(tables_are_read_row_by_frame),
        cmocka_unit_test(csv_keeps_velocity_and_acceleration),
        cmocka_unit_test(columns_go_where_the_user_says),
        cmocka_unit_test(tangents_become_velocities_and_losses_are_said),
        cmocka_unit_test(weighted_and_broken_tangents_become_handles),
        cmocka_unit_test(broadcast_rates_are_what_they_are_in_maya),
        cmocka_unit_test(infinities_play_until_the_file_ends),
        cmocka_unit_test(a_table_that_was_written_has_the_samples_to_the_bit),
        cmocka_unit_test(cubics_come_back_from_anim_as_the_same_curve),
        cmocka_unit_test(random_moves_come_back_from_tables_to_the_bit),
        cmocka_unit_test(random_moves_come_back_from_anim_as_the_same_curve),
        cmocka_unit_test(random_handles_come_back_from_blender_to_the_bit),
        cmocka_unit_test(bad_files_are_refused_where_they_are_bad),
        cmocka_unit_test(truncated_files_are_a_move_or_an_error),
        cmocka_unit_test(flipped_bytes_are_a_move_or_an_error),
        cmocka_unit_test(a_refused_import_writes_nothing),
        cmocka_unit_test(exporting_takes_a_rig_and_a_move_or_a_directory),
    };
    return cmocka_run_group_tests(tests, open_bench, close_bench);
}
