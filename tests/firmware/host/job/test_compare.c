/* tests/firmware/host/job/test_compare.c - the same keys under several curves,
 * and the gallery. */
#define _XOPEN_SOURCE 700 /* mkdtemp */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "firmware/host/job/compare.h"
#include "firmware/linux/commands/command.h"
#include "motion/core/err.h"
#include "tests/support/check.h"
#include "tests/support/fake_job.h"

#define KEYS 5

static struct plan_key keys[KEYS];
static struct plan_axis axis = { .name = "pan",
                                 .k1_q32 = INT64_C(1) << 30,
                                 .k2_q32 = INT64_C(3) << 30,
                                 .mu_q32 = INT64_C(1) << 32,
                                 .key = keys,
                                 .key_count = KEYS };

static int make_keys(void **state)
{
    static const double t[KEYS] = { 0, 1.5, 1.75, 4, 5 };
    static const double pos[KEYS] = { 3, 10, -2, -2, 8 };
    (void)state;
    for (int i = 0; i < KEYS; i++)
        keys[i] = (struct plan_key){ .key.t_ns_q12 = fake_ns_q12(t[i]),
                                     .key.pos_q32 = fake_q32(pos[i]) };
    return 0;
}

/* Whatever kinds there are, those that are added later too. */
static void every_curve_goes_through_the_keys_or_says_why(void **state)
{
    (void)state;
    for (unsigned i = 0; i < compare_spellings; i++) {
        struct plan_axis planned = { .key = NULL };
        struct motion_track track;
        struct plan_error error;
        int err =
            compare_plan(&axis, (enum plan_curve)i, &planned, &track, &error);
        if (err < 0) {
            assert_true(error.text[0] != 0);
            assert_null(planned.key);
            continue;
        }
        assert_string_equal(planned.name, compare_spelling[i]);
        assert_int_equal(track.end_ns_q12, keys[KEYS - 1].key.t_ns_q12);
        free(planned.key);
        plan_track_free(&track);
    }
}

static struct motion_sample sampled(enum plan_curve curve, double t)
{
    struct plan_axis planned = { .key = NULL };
    struct motion_track track;
    struct plan_error error;
    struct motion_cursor cursor = { 0 };
    struct motion_sample sample;
    assert_int_equal(compare_plan(&axis, curve, &planned, &track, &error), 0);
    motion_track_sample(&track, &cursor, fake_ns_q12(t), &sample);
    free(planned.key);
    plan_track_free(&track);
    return sample;
}

static void what_a_curve_needs_is_zero_where_no_key_gives_it(void **state)
{
    make_keys(state);
    keys[1].key.has_vel = true;
    keys[1].key.vel = motion_real_int(7);
    assert_int_equal(sampled(PLAN_CURVE_HERMITE, 1.5).vel_q32, fake_q32(7));
    assert_int_equal(sampled(PLAN_CURVE_HERMITE, 4).vel_q32, 0);
    make_keys(state);
}

static void what_a_curve_does_not_take_is_left_out(void **state)
{
    make_keys(state);
    keys[1].key.has_vel = true;
    keys[1].key.vel = motion_real_int(7);
    assert_int_equal(sampled(PLAN_CURVE_LINEAR, 0.75).pos_q32, fake_q32(6.5));
    assert_int_equal(sampled(PLAN_CURVE_CATMULL_ROM, 1.5).vel_q32, fake_q32(7));
    assert_true(keys[1].key.has_vel); /* the keys themselves stay */
    make_keys(state);
}

static void names_are_those_of_files(void **state)
{
    static const struct {
        const char *text;
        int want;
    } rows[] = {
        { "linear", 1 },   { "linear,quintic,linear", 3 },
        { "s-curve", 1 },  { "", -1 },
        { "linear,", -1 }, { ",linear", -1 },
        { "lin", -1 },     { "linear quintic", -1 },
        { "Linear", -1 },
    };
    enum plan_curve *curve = NULL;
    struct messages messages = { .text = NULL };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        assert_int_equal(compare_parse("", rows[i].text, &curve, &messages),
                         rows[i].want);
        assert_int_equal(curve == NULL, rows[i].want < 0);
        memory_free(curve);
        assert_int_equal(messages.text == NULL, rows[i].want > 0);
        messages_free(&messages);
    }
    assert_int_equal(compare_parse("", "all", &curve, &messages),
                     (int)compare_spellings);
    memory_free(curve);
    assert_int_equal(compare_parse("", "quintic,linear", &curve, &messages), 2);
    assert_int_equal(curve[0], PLAN_CURVE_QUINTIC);
    assert_int_equal(curve[1], PLAN_CURVE_LINEAR);
    memory_free(curve);
}

static void read_file(const char *path, char *text, size_t size)
{
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    size_t length = fread(text, 1, size - 1, file);
    text[length] = 0;
    fclose(file);
}

/* In a process of its own, as a user would: cairo counts its surfaces. */
static void make_gallery(char *out)
{
    char *argv[] = { "slew", "gallery", "--out", out, "examples/gallery" };
    int status;
    fflush(NULL);
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0)
        exit((int)command_main(5, argv));
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_int_equal(status, 0);
}

static void the_gallery_has_every_curve_and_the_same_bytes_again(void **state)
{
    static char page[2][1 << 16], picture[2][1 << 18];
    char folder[] = "/tmp/slew-test-XXXXXX", path[128], out[64], word[64];
    (void)state;
    assert_non_null(mkdtemp(folder));
    snprintf(out, sizeof out, "%s/page.md", folder);
    for (int i = 0; i < 2; i++) {
        make_gallery(out);
        read_file(out, page[i], sizeof page[i]);
        snprintf(path, sizeof path, "%s/gallery/quintic.svg", folder);
        read_file(path, picture[i], sizeof picture[i]);
    }
    assert_true(strcmp(page[0], page[1]) == 0);
    assert_true(strcmp(picture[0], picture[1]) == 0);
    for (unsigned i = 0; i < compare_spellings; i++) {
        snprintf(word, sizeof word, "\n## %s\n", compare_spelling[i]);
        assert_non_null(strstr(page[0], word));
        snprintf(path, sizeof path, "%s/gallery/%s.svg", folder,
                 compare_spelling[i]);
        unlink(path);
    }
    snprintf(path, sizeof path, "%s/gallery", folder);
    unlink(out);
    assert_int_equal(rmdir(path), 0);
    assert_int_equal(rmdir(folder), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_curve_goes_through_the_keys_or_says_why),
        cmocka_unit_test(what_a_curve_needs_is_zero_where_no_key_gives_it),
        cmocka_unit_test(what_a_curve_does_not_take_is_left_out),
        cmocka_unit_test(names_are_those_of_files),
        cmocka_unit_test(the_gallery_has_every_curve_and_the_same_bytes_again),
    };
    return cmocka_run_group_tests(tests, make_keys, NULL);
}
