/* tests/firmware/host/exchange/test_import_back.c - moves written for other
 * programs and read again are the same moves. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "firmware/linux/base/disk.h"
#include "firmware/linux/commands/planning.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "tests/firmware/host/exchange/import_bench.h"

static void opened(struct job *job, const char *move)
{
    const char *const path[] = { DATA "rig.yaml", move };

    assert_int_equal(planning_open(job, path, 2, false), STATUS_OK);
}

static struct imported there_and_back(const struct job *job, const char *format,
                                      struct units_fps fps)
{
    const char *path = import_bench_path("there");
    struct import_settings settings = import_bench_settings(0);
    FILE *file = fopen(path, "wb");
    /* what the file says is not said again */
    if (!import_format_find(format)->timed)
        settings.fps = fps;
    for (unsigned i = 0;
         i < job->move.axis_count && !import_format_find(format)->named; i++)
        memcpy(settings.column[settings.column_count++], job->move.axis[i].name,
               PLAN_NAME_MAX);
    if (import_format_find(format)->write(job, &fps, file,
                                          import_bench_message) < 0)
        fail_msg("%s", import_bench_message);
    fclose(file);
    struct imported got = import_bench_read_as(format, path, &settings);
    unlink(path);
    return got;
}

/* A row per sample of the move. */
static void check_samples(const struct job *job, const struct imported *got)
{
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        const struct plan_axis *axis = &got->move.axis[i];
        struct motion_cursor cursor = { 0 };
        assert_string_equal(axis->name, job->move.axis[i].name);
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
                assert_int_equal(acc_q32(key), want.acc_q32);
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
        import_bench_check_move(&got);
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
        assert_string_equal(got->move.axis[i].name, job->move.axis[i].name);
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
    /* not the rig's order, which is pan, tilt, dolly */
    static const char *const names[] = { "dolly", "pan", "tilt" };
    static struct imported move;
    const char *path = import_bench_path("random.yaml");
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    move = (struct imported){ .fps = { 25, 1 } };
    assert_int_equal(plan_move_reserve(&move.move, ARRAY_LEN(names)), 0);
    move.move.axis_count = ARRAY_LEN(names);
    for (size_t i = 0; i < ARRAY_LEN(names); i++)
        random_axis(seed, names[i], i == 0, &move.move.axis[i]);
    assert_int_equal(export_move(&move, "test", file, import_bench_message), 0);
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

/* `check` for each of them. */
static void for_random_jobs(void (*check)(const struct job *job,
                                          uint64_t *seed))
{
    static struct job job;
    uint64_t seed = SEED;
    printf("seed %#llx\n", (unsigned long long)SEED);
    for (int move = 0; move < MOVES; move++) {
        random_job(&seed, &job);
        check(&job, &seed);
        job_free(&job);
    }
}

static void tables_give_it_back(const struct job *job, uint64_t *seed)
{
    static const char *const formats[] = { "kuper", "flair", "raw", "csv" };
    for (size_t f = 0; f < ARRAY_LEN(formats); f++) {
        struct imported got =
            there_and_back(job, formats[f], random_rate(seed));
        check_samples(job, &got);
        move_free(&got.move);
    }
}

static void random_moves_come_back_from_tables_to_the_bit(void **state)
{
    (void)state;
    for_random_jobs(tables_give_it_back);
}

static void anim_gives_it_back(const struct job *job, uint64_t *seed)
{
    struct imported got = there_and_back(job, "maya", random_rate(seed));
    check_curves(job, &got);
    for (unsigned i = 0; i < job->move.axis_count; i++) {
        if (job->move.axis[i].curve != PLAN_CURVE_BEZIER)
            continue;
        assert_int_equal(got.move.axis[i].curve, PLAN_CURVE_BEZIER);
        assert_int_equal(got.move.axis[i].key_count,
                         job->move.axis[i].key_count);
    }
    assert_string_equal(got.note, "");
    move_free(&got.move);
}

static void random_moves_come_back_from_anim_as_the_same_curve(void **state)
{
    (void)state;
    for_random_jobs(anim_gives_it_back);
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

/* --- rates ---------------------------------------------------------------- */

static const char *const rates[] = {
    "23.976", "24",  "24000/1001",  "25",   "29.97", "30000/1001", "30",
    "47.952", "48",  "48000/1001",  "50",   "59.94", "60000/1001", "60",
    "119.88", "120", "120000/1001", "12.5", "1",     "1000",
};

/* Maya has these names for other rates. */
static bool maya_has_another(const char *rate)
{
    return strcmp(rate, "23.976") == 0 || strcmp(rate, "29.97") == 0 ||
           strcmp(rate, "47.952") == 0 || strcmp(rate, "59.94") == 0;
}

static void check_refused(const struct job *job, const char *format,
                          const struct units_fps *fps, const char *why)
{
    FILE *file = tmpfile();
    assert_non_null(file);
    assert_int_equal(
        import_format_find(format)->write(job, fps, file, import_bench_message),
        -1);
    fclose(file);
    if (strstr(import_bench_message, why) == NULL)
        fail_msg("%s, expected \"%s\"", import_bench_message, why);
}

/* A key of a table is at its frame, to the tick. */
static void check_frames(const struct imported *got)
{
    for (unsigned i = 0; i < got->move.axis_count; i++)
        for (uint32_t k = 0; k < got->move.axis[i].key_count; k++)
            assert_int_equal(got->move.axis[i].key[k].key.t_ns_q12,
                             import_frame_ns_q12(&got->fps, k));
}

static void check_rate(const struct job *job, const char *format,
                       const struct units_fps *fps)
{
    const bool has_frames = strncmp(format, "ros-", 4) != 0;
    struct imported got = there_and_back(job, format, *fps);
    assert_int_equal(got.fps.num, has_frames ? fps->num : 0);
    assert_int_equal(got.fps.den, has_frames ? fps->den : 0);
    import_bench_check_move(&got);
    if (!has_frames || strcmp(format, "maya") == 0 ||
        strcmp(format, "blender") == 0) {
        check_curves(job, &got);
    } else {
        check_samples(job, &got);
        check_frames(&got);
    }
    move_free(&got.move);
}

static void every_format_at_every_rate_is_exact_or_refused(void **state)
{
    static struct job job;
    (void)state;
    opened(&job, DATA "cubic.yaml");
    for (const struct import_format *f = import_format; f->name != NULL; f++)
        for (size_t i = 0; i < ARRAY_LEN(rates); i++) {
            char sentence[UNITS_SENTENCE_MAX];
            struct units_fps fps;
            assert_int_equal(units_parse_fps(rates[i], &fps, sentence), 0);
            if (strcmp(f->name, "maya") == 0 && maya_has_another(rates[i]))
                check_refused(&job, f->name, &fps, "/1001 frames a second");
            else if (strcmp(f->name, "maya") == 0 && fps.num == 120000)
                check_refused(&job, f->name, &fps, "no decimal name");
            else
                check_rate(&job, f->name, &fps);
        }
    check_refused(&job, "maya", &(struct units_fps){ 100, 3 }, "no decimal");
    check_refused(&job, "blender", &(struct units_fps){ 100000, 3 },
                  "cannot be said in Blender");
    check_rate(&job, "blender", &(struct units_fps){ 100, 3 });
    job_free(&job);
}

static void drop_frame_is_no_rate(void **state)
{
    static const char *const texts[] = { "29.97df", "29.97 drop", "59.94DF",
                                         "29.97ndf" };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(texts); i++) {
        char sentence[UNITS_SENTENCE_MAX] = "";
        struct units_fps fps;
        assert_int_equal(units_parse_fps(texts[i], &fps, sentence), -1);
        assert_non_null(strstr(sentence, "timecode"));
    }
}

/* --- which axis ------------------------------------------------------------ */

static void expect_names(const char *format, const struct rig *rig,
                         const char *text, const char *want)
{
    const char *path = import_bench_write(text, strlen(text));
    const struct import_settings settings = { .rig = rig,
                                              .fps = { 24, 1 },
                                              .curve = PLAN_CURVE_QUINTIC };
    struct imported got;
    char names[128] = "";
    const int err = import_format_find(format)->read(
        &disk_files, path, &settings, &got, import_bench_message);
    unlink(path);
    if (err == 0) {
        for (unsigned i = 0; i < got.move.axis_count; i++) {
            strcat(names, got.move.axis[i].name);
            strcat(names, " ");
        }
        move_free(&got.move);
    }
    if (strstr(err == 0 ? names : import_bench_message, want) == NULL)
        fail_msg("%s: \"%s\", expected \"%s\"", text,
                 err == 0 ? names : import_bench_message, want);
}

static void an_axis_is_found_by_its_own_name(void **state)
{
    static const char *const names[] = { "Pan", "pan", "Tilt", "t" };
    static struct rig_axis axis[ARRAY_LEN(names)];
    struct rig rig = { .axis = axis, .axis_count = ARRAY_LEN(names) };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(names); i++) {
        snprintf(rig.axis[i].name, sizeof rig.axis[i].name, "%s", names[i]);
        rig.axis[i].unit = UNITS_AXIS_DEG;
    }
    expect_names("kuper", &rig, "Axes = pan, Pan\n1 2\n", "pan Pan ");
    expect_names("kuper", &rig, "Axes = Pan, TILT\n1 2\n", "Pan Tilt ");
    expect_names("kuper", &rig, "Axes = PAN, Tilt\n1 2\n",
                 "'PAN' is the name of two axes");
    expect_names("kuper", &rig, "Axes = t, Tilt\n1 2\n",
                 "'t' is an axis of the rig and a column of times");
    expect_names("csv", &rig, "frame,t_deg,Pan_deg\n0,1,2\n", "t Pan ");
    expect_names("csv", &rig, "frame,pan_deg,Pan_deg\n0,1,2\n", "pan Pan ");
    expect_names("raw", &rig, "1 2 3 4\n",
                 "expected --columns with what each of its 4 columns is, such "
                 "as --columns Pan,pan,Tilt,t");
    rig.axis_count = 1;
    expect_names("raw", &rig, "1\n", "Pan ");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_table_that_was_written_has_the_samples_to_the_bit),
        cmocka_unit_test(cubics_come_back_from_anim_as_the_same_curve),
        cmocka_unit_test(random_moves_come_back_from_tables_to_the_bit),
        cmocka_unit_test(random_moves_come_back_from_anim_as_the_same_curve),
        cmocka_unit_test(every_format_at_every_rate_is_exact_or_refused),
        cmocka_unit_test(drop_frame_is_no_rate),
        cmocka_unit_test(an_axis_is_found_by_its_own_name),
        cmocka_unit_test(random_handles_come_back_from_blender_to_the_bit),
    };
    return cmocka_run_group_tests(tests, import_bench_open, import_bench_close);
}
