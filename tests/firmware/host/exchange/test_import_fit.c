/* tests/firmware/host/exchange/test_import_fit.c - a move of a rig that was
 * written for another program and is read again keeps inside the limits of that
 * rig, or the curve that would is named. */
#include "firmware/host/exchange/import_fit.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/commands/planning.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "motion/core/fixed.h"
#include "tests/support/check.h"

#define DOLLY "examples/dolly"

static struct job job;
static char message[YAML_MESSAGE_MAX];

/* In the place of the one that is open. */
static int open_example(const char *path)
{
    job_free(&job);
    return planning_open(&job, &path, 1, false) == STATUS_OK ? 0 : -1;
}

static int open_dolly(void **state)
{
    (void)state;
    return open_example(DOLLY);
}

static int open_turntable(void **state)
{
    (void)state;
    return open_example("examples/turntable");
}

static int open_there_and_back(void **state)
{
    (void)state;
    return open_example("tests/data/there_and_back");
}

static int close_dolly(void **state)
{
    (void)state;
    job_free(&job);
    return 0;
}

static struct imported there_and_back(const struct import_format *format,
                                      const struct units_fps *fps,
                                      struct import_settings *settings)
{
    char path[] = "/tmp/import_fit_XXXXXX";
    const int descriptor = mkstemp(path);
    struct imported got;
    assert_true(descriptor >= 0);
    FILE *file = fdopen(descriptor, "wb");
    assert_non_null(file);
    if (!format->timed)
        settings->fps = *fps;
    for (unsigned i = 0; i < job.move.axis_count && !format->named; i++)
        memcpy(settings->column[settings->column_count++],
               job.move.axis[i].name, PLAN_NAME_MAX);
    assert_int_equal(format->write(&job, fps, file, message), 0);
    fclose(file);
    if (format->read(&disk_files, path, settings, &got, message) < 0)
        fail_msg("%s", message);
    unlink(path);
    return got;
}

static bool is_inside(const struct plan_axis *axis)
{
    struct plan_limit limit =
        job.rig.axis[rig_axis_index(&job.rig, axis->name)].limit;
    struct motion_track track;
    struct plan_violation found;
    struct plan_error error;
    limit.period_ns = job.rig.period_ns;
    assert_int_equal(plan_axis_track(axis, &track, &error), 0);
    const uint32_t count = plan_check_track(&track, &limit, &found, 1);
    plan_track_free(&track);
    return count == 0;
}

static struct import_fit fit_of(const struct import_settings *settings,
                                bool sampled, struct plan_axis *axis)
{
    struct import_fit fit;
    struct plan_error error;
    assert_int_equal(import_fit(settings, sampled, axis, &fit, &error), 0);
    return fit;
}

static struct import_settings settings_of(void)
{
    return (struct import_settings){ .rig = &job.rig,
                                     .curve = PLAN_CURVE_QUINTIC };
}

/* Times and positions of an axis, to see that they stay. */
static int64_t sum_of(const struct plan_axis *axis)
{
    uint64_t sum = axis->key_count;
    for (uint32_t k = 0; k < axis->key_count; k++)
        sum = sum * 31 + (uint64_t)axis->key[k].key.pos_q32 +
              7 * (uint64_t)axis->key[k].key.t_ns_q12;
    return (int64_t)sum;
}

static const struct units_fps rates[] = {
    { 24, 1 }, { 24000, 1001 }, { 25, 1 }, { 60, 1 }, { 120, 1 },
};

static void tables_take_a_curve_inside_the_limits(void **state)
{
    unsigned changed = 0, axes = 0;
    (void)state;
    for (const struct import_format *f = import_format; f->name != NULL; f++)
        for (size_t i = 0; i < ARRAY_LEN(rates) && f->sampled; i++) {
            struct import_settings settings = settings_of();
            struct imported got = there_and_back(f, &rates[i], &settings);
            for (uint32_t a = 0; a < got.move.axis_count; a++) {
                struct plan_axis *axis = &got.move.axis[a];
                const int64_t sum = sum_of(axis);
                const struct import_fit fit = fit_of(&settings, true, axis);
                assert_int_equal(sum_of(axis), sum);
                assert_true(fit.passes || fit.changed);
                assert_true(is_inside(axis));
                changed += fit.changed;
                axes++;
            }
            move_free(&got.move);
        }
    print_message("%u of %u axes took another curve\n", changed, axes);
    assert_true(changed > axes / 4 && changed < axes);
}

static void a_curve_that_was_said_stays(void **state)
{
    struct import_settings settings = settings_of();
    char text[IMPORT_FIT_MAX];
    (void)state;
    settings.has_curve = true;
    struct imported got =
        there_and_back(import_format_find("kuper"), &rates[0], &settings);
    struct plan_axis *dolly = &got.move.axis[0];
    const struct import_fit fit = fit_of(&settings, true, dolly);
    assert_true(!fit.passes && !fit.changed && fit.has_other);
    assert_int_equal(dolly->curve, PLAN_CURVE_QUINTIC);
    import_fit_text(&fit, &job.rig, dolly, text);
    assert_string_equal(text, "dolly: quintic breaks a limit: jerk, -568 "
                              "mm/s3 at 0.042 s; --curve c4 would pass");
    move_free(&got.move);
}

/* What is drawn stays where it passes, and where nothing was said. */
static void tangents_stay_unless_a_curve_is_said(void **state)
{
    static const char *const formats[] = { "maya", "blender" };
    (void)state;
    for (size_t i = 0; i < 2 * ARRAY_LEN(formats); i++) {
        struct import_settings settings = settings_of();
        unsigned inside = 0, changed = 0;
        settings.curve = PLAN_CURVE_C4;
        settings.has_curve = i % 2;
        struct imported got = there_and_back(import_format_find(formats[i / 2]),
                                             &rates[0], &settings);
        for (uint32_t a = 0; a < got.move.axis_count; a++) {
            struct plan_axis *axis = &got.move.axis[a];
            const enum plan_curve before = axis->curve;
            const struct import_fit fit = fit_of(&settings, false, axis);
            assert_true(fit.passes || fit.changed || fit.has_other);
            assert_int_equal(axis->curve, fit.changed ? PLAN_CURVE_C4 : before);
            inside += is_inside(axis);
            changed += fit.changed;
        }
        assert_int_equal(changed, i % 2 ? 2 : 0);
        assert_int_equal(inside, i % 2 ? 4 : 2);
        move_free(&got.move);
    }
}

/* Cycles are the handles' alone: no other curve has them. */
static void cycles_are_not_dropped(void **state)
{
    struct import_settings settings = settings_of();
    char text[IMPORT_FIT_MAX];
    (void)state;
    settings.curve = PLAN_CURVE_C4;
    settings.has_curve = true;
    struct imported got =
        there_and_back(import_format_find("blender"), &rates[0], &settings);
    struct plan_axis *dolly = &got.move.axis[0];
    dolly->bezier.after.mode = MOTION_FCURVE_REPEAT_OFFSET;
    dolly->bezier.after.count = 2;
    const struct import_fit fit = fit_of(&settings, false, dolly);
    assert_true(!fit.passes && !fit.changed && !fit.has_other);
    import_fit_text(&fit, &job.rig, dolly, text);
    assert_non_null(strstr(text, "so does every curve"));
    assert_int_equal(dolly->curve, PLAN_CURVE_BEZIER);
    move_free(&got.move);
}

/* The keys of the move from which it leaves a place, through every format. */
static void a_drive_s_own_profile_keeps_where_it_rests(void **state)
{
    static const int64_t want_deg[] = { 0, 90, 180, 270 };
    (void)state;
    for (const struct import_format *f = import_format; f->name != NULL; f++) {
        struct import_settings settings = settings_of();
        struct imported got = there_and_back(f, &rates[2], &settings);
        struct plan_axis *axis = &got.move.axis[0];
        const struct import_fit fit = fit_of(&settings, f->sampled, axis);
        char text[IMPORT_FIT_MAX];
        assert_true(fit.passes);
        assert_true(fit.kept == 4 && fit.of > 10 && axis->key_count == 4);
        for (int k = 0; k < 4; k++) {
            const int64_t off =
                axis->key[k].key.pos_q32 - want_deg[k] * MOTION_FIXED_ONE_Q32;
            assert_in_range(off + 100, 0, 200);
        }
        /* 3 s, 6 s: where the move itself leaves; its end */
        assert_in_range(axis->key[1].key.t_ns_q12, 3 * MOTION_FIXED_S_Q12 - 9,
                        3 * MOTION_FIXED_S_Q12 + 9);
        assert_in_range(axis->key[3].key.t_ns_q12, 8 * MOTION_FIXED_S_Q12 - 9,
                        9 * MOTION_FIXED_S_Q12);
        import_fit_text(&fit, settings.rig, axis, text);
        assert_non_null(strstr(text, "its drive goes from key to key"));
        move_free(&got.move);
    }
}

static void one_that_turns_without_a_rest_is_refused(void **state)
{
    struct import_settings settings = settings_of();
    struct import_fit fit;
    struct plan_error error;
    struct plan_key key[3] = { { .key = { .t_ns_q12 = 0 } } };
    struct plan_axis axis = { .name = "table", .key = key, .key_count = 3 };
    (void)state;
    for (int k = 0; k < 3; k++)
        key[k].key = (struct motion_key){
            .t_ns_q12 = k * MOTION_FIXED_S_Q12,
            .pos_q32 = k == 1 ? 30 * MOTION_FIXED_ONE_Q32 : 0,
        };
    key[1].place = (struct plan_place){ 7, 3 };
    assert_true(import_fit(&settings, true, &axis, &fit, &error) < 0);
    assert_non_null(strstr(error.text, "turns back here without resting"));
    assert_int_equal(error.place.line, 7);
}

/* At its limits, so that every curve through the samples is over one. */
static void what_more_time_cures_is_said(void **state)
{
    struct import_settings settings = settings_of();
    struct imported got =
        there_and_back(import_format_find("kuper"), &rates[2], &settings);
    struct plan_axis *axis = &got.move.axis[0];
    const struct import_fit fit = fit_of(&settings, true, axis);
    char text[IMPORT_FIT_MAX];
    (void)state;
    assert_true(!fit.passes && fit.changed && fit.needs_time);
    import_fit_text(&fit, settings.rig, axis, text);
    assert_non_null(strstr(text, "slew fit cures"));
    move_free(&got.move);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tables_take_a_curve_inside_the_limits),
        cmocka_unit_test(a_curve_that_was_said_stays),
        cmocka_unit_test(tangents_stay_unless_a_curve_is_said),
        cmocka_unit_test(cycles_are_not_dropped),
        cmocka_unit_test_setup(a_drive_s_own_profile_keeps_where_it_rests,
                               open_turntable),
        cmocka_unit_test_setup(one_that_turns_without_a_rest_is_refused,
                               open_turntable),
        cmocka_unit_test_setup(what_more_time_cures_is_said,
                               open_there_and_back),
    };
    return cmocka_run_group_tests(tests, open_dolly, close_dolly);
}
