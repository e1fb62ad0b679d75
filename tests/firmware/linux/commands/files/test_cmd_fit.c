/* tests/firmware/linux/commands/files/test_cmd_fit.c - slew fit as a user meets it,
 * and what slew check says would help. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "tests/support/check.h"
#include "tests/support/run_slew.h"

#include <cjson/cJSON.h>
#include <math.h>

#define RIG                                                                    \
    "buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}\n"                     \
    "axes:\n"                                                                  \
    "  dolly:\n"                                                               \
    "    unit: mm\n"                                                           \
    "    limits: {position: [0 mm, 1000 mm], velocity: 100 mm/s,\n"            \
    "             acceleration: 400 mm/s2, jerk: 4000 mm/s3}\n"                \
    "    following_error: {floor: 2 mm, time: 20 ms}\n"                        \
    "    drive: {kind: cia402, bus: can0, node: 1, counts: 4096 per mm}\n"     \
    "  pan:\n"                                                                 \
    "    unit: deg\n"                                                          \
    "    limits: {position: [-90 deg, 90 deg], velocity: 30 deg/s,\n"          \
    "             acceleration: 60 deg/s2, jerk: 500 deg/s3}\n"                \
    "    following_error: {floor: 0.5 deg, time: 20 ms}\n"                     \
    "    drive: {kind: cia402, bus: can0, node: 2, counts: 1048576 per rev}\n" \
    "  lift:\n"                                                                \
    "    unit: mm\n"                                                           \
    "    limits: {position: [-90 mm, 90 mm], velocity: 60 mm/s,\n"             \
    "             acceleration: 100 mm/s2, jerk: 900 mm/s3}\n"                 \
    "    following_error: {floor: 2 mm, time: 20 ms}\n"                        \
    "    drive: {kind: cia402, bus: can0, node: 3, counts: 4096 per mm}\n"

/* The dolly is too fast between its keys 2 and 3 alone. */
#define MOVE                                                                   \
    "title: Über den Tisch  # the café\n"                                    \
    "axes:\n"                                                                  \
    "  dolly:                 # runs by\n"                                     \
    "    curve: s-curve\n"                                                     \
    "    keys:\n"                                                              \
    "      - [0 s, 0 mm]      # start\n"                                       \
    "      - [ 2 s , 50 mm ]\n"                                                \
    "      - {p: 350 mm, \"t\": '3 s'}   # at the table\n"                     \
    "      - [5.5 s, 400 mm]  # end\n"                                         \
    "  pan: {curve: quintic, keys: [[0 s, 0 deg], [2 s, 10 deg, 5 deg/s], "    \
    "{t: 5.5 s, p: 20 deg}]} # « é »\n"

static char rig[256], move[256], other[256];

static int open_all(void **state)
{
    if (run_open(state) < 0)
        return -1;
    snprintf(rig, sizeof rig, "%s", run_path("rig.yaml"));
    snprintf(move, sizeof move, "%s", run_path("move.yaml"));
    snprintf(other, sizeof other, "%s", run_path("other.yaml"));
    run_write(rig, RIG);
    return 0;
}

static const char *text_of(const char *path)
{
    static char text[1 << 16];

    run_read(path, text, sizeof text);
    return text;
}

static void expect_in(const char *text, const char *want)
{
    if (strstr(text, want) == NULL)
        fail_msg("expected \"%s\" in \"%s\"", want, text);
}

static double duration_of(const char *path)
{
    assert_int_equal(run("check", "--json", rig, path), 0);
    cJSON *report = cJSON_Parse(run_slew()->out);
    const double duration = cJSON_GetNumberValue(
        cJSON_GetObjectItemCaseSensitive(report, "duration_s"));
    cJSON_Delete(report);
    return duration;
}

static void check_says_what_would_help(void **state)
{
    (void)state;
    run_write(move, MOVE);
    assert_int_equal(run("check", rig, move), 1);
    /* v = 300 mm in 1 s, peak 1.5 of the mean for the s-curve by thirds */
    expect_in(run_slew()->out, "Fits in 24.75");
    expect_in(run_slew()->out,
              "dolly alone needs 3.5 s more between keys 2 and 3\n");
    /* to the next whole millisecond */
    assert_int_equal(run("check", "--override", "200", rig, move), 1);
    expect_in(run_slew()->out, "Fits in 49.501 s, at 200 % speed.\n");
    assert_int_equal(run("check", "--json", rig, move), 1);
    cJSON *report = cJSON_Parse(run_slew()->out);
    const cJSON *fit = cJSON_GetObjectItemCaseSensitive(report, "fit");
    const cJSON *span =
        cJSON_GetArrayItem(cJSON_GetObjectItemCaseSensitive(fit, "spans"), 0);
    assert_true(
        cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(fit, "cured_by_time")));
    assert_true(fabs(cJSON_GetNumberValue(
                         cJSON_GetObjectItemCaseSensitive(span, "more_s")) -
                     3.5) < 1e-3);
    cJSON_Delete(report);
}

/* A shoot says itself when a frame is played: what it needs is its own times, and with
 * them the move fits, in the time that was said. */
static void check_says_what_a_shoot_needs(void **state)
{
    static const char *const modes[] = { "stop", "go-motion", "continuous" };
    static const char *const shapers[] = {
        "", "    shaper: {kind: ei2, frequency: 2 Hz, damping: 3 %}\n"
    };
    char text[4096];

    (void)state;
    for (size_t i = 0; i < 2 * ARRAY_LEN(modes); i++) {
        double end_s = 0, move_s = 0.3, exposure_s = 0.1;
        snprintf(text, sizeof text,
                 RIG "%s"
                     "gpio: {camera: {kind: trigger, line: GPIO5}}\n",
                 shapers[i % 2]);
        run_write(rig, text);
        for (int again = 0; again < 2; again++) {
            snprintf(text, sizeof text,
                     "axes: {lift: {keys: [[0 s, -80 mm], [2 s, -10 mm], [3 s, "
                     "80 mm]]}}\n"
                     "shoot: {mode: %s, line: camera, frames: 7, exposure: "
                     "%.3f s, move: %.3f s}\n",
                     modes[i / 2], exposure_s, move_s);
            run_write(move, text);
            assert_int_equal(run("check", rig, move), again ? 0 : 1);
            if (again)
                break;
            const char *says = strstr(run_slew()->out, "Fits in ");
            assert_non_null(says);
            const int read = sscanf(says,
                                    "Fits in %lf s, if shoot has a move of %lf "
                                    "s and an exposure of %lf s.\n",
                                    &end_s, &move_s, &exposure_s);
            assert_int_equal(read, i / 2 == 0 ? 2 : 3);
            assert_int_equal(run("check", "--json", rig, move), 1);
            snprintf(text, sizeof text, "\"move_s\":\t%.15g,", move_s);
            expect_in(run_slew()->out, text);
        }
        const double took_s = duration_of(move);
        if (!(took_s <= end_s && took_s > end_s - 0.1))
            fail_msg("%s: %.3f s, it was said to be %.3f s", modes[i / 2],
                     took_s, end_s);
    }
    run_write(rig, RIG);
}

/* A shaper smooths a fast move more than the slower one that it becomes: what is
 * said is what fits then, and of the spans as they are written. */
static void with_a_shaper_check_says_what_fit_finds(void **state)
{
    double end_s, more_s;

    (void)state;
    run_write(rig, RIG "    shaper: {kind: ei2, frequency: 2 Hz}\n");
    run_write(move, "axes: {lift: {curve: s-curve, keys: [[0 s, 0 mm], [0.3 s, "
                    "80 mm], [9 s, 80 mm], [9.3 s, 0 mm]]}}\n");
    assert_int_equal(run("check", rig, move), 1);
    assert_int_equal(
        sscanf(strstr(run_slew()->out, "Fits in "),
               "Fits in %lf s; slew fit finds the times.\n"
               "  lift alone needs %lf s more between keys 1 and 2",
               &end_s, &more_s),
        2);
    assert_int_equal(run("fit", "--method", "stretch", rig, move), 0);
    const double found_s = duration_of(move);
    if (!(found_s <= end_s && found_s > end_s - 0.0021))
        fail_msg("%.4f s are said, %.4f s found", end_s, found_s);
    /* 80 mm by thirds: 1.5 D / T is 60 mm/s in 2 s, 9 D / T^2 is 100 mm/s2 in
     * 2.683 s, 54 D / T^3 is 900 mm/s3 in 1.687 s */
    if (fabs(more_s - (sqrt(7.2) - 0.3)) > 1e-3)
        fail_msg("%.4f s more", more_s);
    run_write(rig, RIG);
}

/* A shaper takes what a roll lacks into the shot, which stays as it was: 15 mm/s from
 * rest need 1.5 v / T of 100 mm/s2 and 6 v / T^2 of 900 mm/s3. */
static void with_a_shaper_a_roll_alone_gets_longer(void **state)
{
    (void)state;
    run_write(rig, RIG "    shaper: {kind: ei2, frequency: 2 Hz}\n");
    run_write(move, "pre_roll: 50 ms\npost_roll: 50 ms\naxes: {lift: {curve: "
                    "linear, keys: [[0 s, -75 mm], [10 s, 75 mm]]}}\n");
    assert_int_equal(run("check", rig, move), 1);
    expect_in(run_slew()->out, "Needs a pre_roll of 0.317 s and a post_roll of "
                               "0.317 s; slew fit writes them.\n");
    assert_null(strstr(run_slew()->out, "Fits in"));
    assert_int_equal(run("fit", rig, move), 0);
    expect_in(text_of(move), "pre_roll: 0.316228");
    assert_null(strstr(text_of(move), "duration"));
    assert_int_equal(run("check", rig, move), 0);
    run_write(rig, RIG);
}

/* It is not said that times are found which a fixed key may forbid. */
static void check_does_not_promise_what_is_fixed(void **state)
{
    (void)state;
    run_write(move, "axes:\n  dolly: {keys: [[0 s, 0 mm], {t: 1 s, p: 300 mm, "
                    "fixed: time}, [9 s, 400 mm]]}\n");
    assert_int_equal(run("check", rig, move), 1);
    expect_in(run_slew()->out,
              "; slew fit finds the times, if keys that are fixed allow it.\n");
    assert_int_equal(run("fit", rig, move), 1);
}

/* Comments, blanks, quotes and order stay; only times, and the velocity that
 * goes with them, are others. */
static void the_text_keeps_all_but_the_times(void **state)
{
    (void)state;
    run_write(move, MOVE);
    assert_int_equal(run("fit", rig, move), 0);
    const char *text = text_of(move);
    expect_in(text, "title: Über den Tisch  # the café\n");
    expect_in(text, "      - [0 s, 0 mm]      # start\n");
    expect_in(text, "      - [ 2 s , 50 mm ]\n");
    expect_in(text, "      - {p: 350 mm, \"t\": '6.5 s'}   # at the table\n"
                    "      - [9 s, 400 mm]  # end\n");
    expect_in(text,
              "  pan: {curve: quintic, keys: [[0 s, 0 deg], [2 s, 10 deg,");
    expect_in(text, "p: 20 deg}]} # « é »\n");
    assert_true(fabs(duration_of(move) - 9) < 0.01);
    assert_int_equal(run("fit", rig, move), 0);
    expect_in(run_slew()->out, "nothing is changed");
}

static void stretch_lengthens_all_of_it(void **state)
{
    (void)state;
    run_write(move, MOVE);
    assert_int_equal(run("fit", "--method", "stretch", rig, move), 0);
    expect_in(run_slew()->out, "fits in 24.75");
    expect_in(text_of(move), "[ 9 s , 50 mm ]");
    expect_in(text_of(move), "10 deg, 1.11"); /* 5 deg/s, 4.5 times slower */
    assert_true(fabs(duration_of(move) - 24.75) < 1e-3);
}

static void a_dry_run_and_another_file_leave_the_move_as_it_is(void **state)
{
    (void)state;
    run_write(move, MOVE);
    assert_int_equal(run("fit", "--dry-run", rig, move), 0);
    expect_in(run_slew()->out, "Nothing is written");
    assert_string_equal(text_of(move), MOVE);
    assert_int_equal(run("fit", "--output", other, rig, move), 0);
    assert_string_equal(text_of(move), MOVE);
    assert_true(fabs(duration_of(other) - 9) < 0.01);
    /* what fits is copied, too */
    assert_int_equal(run("fit", "--output", move, rig, other), 0);
    char *text = strdup(text_of(other));
    assert_string_equal(text_of(move), text);
    free(text);
}

static void a_fixed_key_stays_or_is_refused(void **state)
{
    (void)state;
    run_write(move, "axes:\n  dolly:\n    curve: s-curve\n    keys:\n"
                    "    - [0 s, 0 mm]\n    - [1 s, 200 mm]\n"
                    "    - {t: 9.123456789 s, p: 250 mm, fixed: time}\n"
                    "    - [10 s, 400 mm]\n");
    assert_int_equal(run("fit", rig, move), 0);
    expect_in(text_of(move), "{t: 9.123456789 s, p: 250 mm, fixed: time}");
    expect_in(text_of(move), "[3 s, 200 mm]");
    expect_in(text_of(move), "[11.373457 s, 400 mm]"); /* 2.25 s for 150 mm */
    assert_int_equal(run("check", rig, move), 0);
    run_write(move, "axes:\n  dolly:\n    curve: s-curve\n    keys:\n"
                    "    - [0 s, 0 mm]\n    - [2 s, 10 mm]\n"
                    "    - {t: 3 s, p: 250 mm, fixed: both}\n");
    assert_int_equal(run("fit", rig, move), 1);
    expect_in(run_slew()->err, "move.yaml:7:7: key 3 of axis dolly is fixed");
    expect_in(text_of(move), "[2 s, 10 mm]");
}

/* Without a limit of jerk, which a cubic breaks where it comes to rest. */
static void handles_go_with_the_time(void **state)
{
    static const char free_rig[] =
        "buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
        "axes:\n"
        "  dolly:\n"
        "    unit: mm\n"
        "    limits: {position: [0 mm, 1000 mm], velocity: 100 mm/s,\n"
        "             acceleration: 400 mm/s2}\n"
        "    following_error: {floor: 2 mm, time: 20 ms}\n"
        "    drive: {kind: cia402, bus: can0, node: 1, counts: 4096 per mm}\n";

    (void)state;
    run_write(other, free_rig);
    run_write(move, "axes:\n  dolly:\n    curve: bezier\n    handles: free\n"
                    "    keys:\n"
                    "    - {t: 0 s, p: 0 mm, left: [-0.1 s, 0 mm],\n"
                    "       right: [0.5 s, 0 mm]}\n"
                    "    - {t: 1 s, p: 100 mm, left: [ -0.5 s , 0 mm],\n"
                    "       right: [0.1 s, 0 mm]} # here\n");
    assert_int_equal(run("fit", other, move), 0);
    assert_int_equal(run("check", other, move), 0);
    const char *at = strstr(text_of(move), "right: [");
    assert_non_null(at);
    const double right = strtod(at + 8, NULL);
    at = strstr(at, "- {t: ");
    assert_non_null(at);
    const double end = strtod(at + 6, NULL);
    assert_true(end > 1.4 && fabs(right - end / 2) < 1e-6);
    expect_in(at, "right: [");
    expect_in(at, "mm]} # here\n");
}

static void json_lists_every_key_that_changed(void **state)
{
    (void)state;
    run_write(move, MOVE);
    assert_int_equal(run("fit", "--json", rig, move), 0);
    cJSON *report = cJSON_Parse(run_slew()->out);
    const cJSON *keys = cJSON_GetObjectItemCaseSensitive(report, "keys");
    assert_int_equal(cJSON_GetArraySize(keys), 3);
    const cJSON *key = cJSON_GetArrayItem(keys, 0);
    assert_true(cJSON_GetNumberValue(
                    cJSON_GetObjectItemCaseSensitive(key, "key")) == 3);
    assert_true(cJSON_GetNumberValue(
                    cJSON_GetObjectItemCaseSensitive(key, "line")) == 8);
    assert_true(cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(report, "ok")));
    cJSON_Delete(report);
}

static void windows_lines_and_a_mark_stay(void **state)
{
    static const char text[] =
        "\xEF\xBB\xBF# first\r\naxes: # é\r\n  dolly: {curve: s-curve, keys: "
        "[[0 s, 0 mm], [1 s, 300 mm]]} # ü\r\n";

    (void)state;
    run_write(move, text);
    assert_int_equal(run("fit", rig, move), 0);
    expect_in(text_of(move), "\xEF\xBB\xBF# first\r\naxes: # é\r\n  dolly: "
                             "{curve: s-curve, keys: [[0 s, 0 mm], [4.5");
    expect_in(text_of(move), " s, 300 mm]]} # ü\r\n");
}

/* --- more than keys ---------------------------------------------------------- */

#define PATH                                                                   \
    "title: Along a path\n"                                                    \
    "# as fast as it goes\n"                                                   \
    "path:\n"                                                                  \
    "  axes: [dolly, lift]  # both\n"                                          \
    "  curve: c2\n"                                                            \
    "  points: [[%d mm, 0 mm], [%d mm, %d mm], [%d mm, 20 mm]]\n"              \
    "  speed:\n"                                                               \
    "    - {law: ramp, time: %d ms, to: %d mm/s}  # up\n"                      \
    "    - {law: constant}\n"                                                  \
    "    - {law: ramp, time: %d ms, to: 0}        # and down\n"

static int drawn(uint64_t *seed, int low, int high)
{
    return (int)check_random_in(seed, low, high);
}

static const char *path_move(unsigned n)
{
    static char text[1024];
    uint64_t seed = n + 1;

    snprintf(text, sizeof text, PATH, drawn(&seed, 0, 99),
             drawn(&seed, 300, 499), drawn(&seed, -20, 19),
             drawn(&seed, 700, 899), drawn(&seed, 200, 599),
             drawn(&seed, 100, 599), drawn(&seed, 200, 599));
    return text;
}

/* What stands before the value, and after it, is as it was. */
static void expect_comments(const char *text)
{
    expect_in(text, "title: Along a path\n");
    expect_in(text, "# as fast as it goes\n");
    expect_in(text, "  axes: [dolly, lift]  # both\n");
    expect_in(text, "}  # up\n");
    expect_in(text, "}        # and down\n");
}

static void paths_are_slowed_until_they_fit(void **state)
{
    static const char *const method[] = { "speed", "stretch" };
    unsigned done = 0;

    (void)state;
    for (unsigned n = 0; n < 30; n++) {
        for (unsigned m = 0; m < 2; m++) {
            run_write(move, path_move(n));
            if (run("check", rig, move) != 1)
                continue;
            const int before = run("fit", "--method", method[m], rig, move);
            if (before != 0)
                fail_msg("case %u, %s: %s", n, method[m], run_slew()->err);
            expect_comments(text_of(move));
            if (m == 1)
                expect_in(text_of(move), "# as fast as it goes\nduration: ");
            else
                assert_null(strstr(text_of(move), "duration"));
            assert_int_equal(run("check", rig, move), 0);
            assert_int_equal(run("fit", rig, move), 0);
            expect_in(run_slew()->out, "nothing is changed");
            done++;
        }
    }
    assert_true(done > 40);
}

static void a_duration_is_kept_or_refused_with_the_arithmetic(void **state)
{
    (void)state;
    run_write(move, "duration: 40 s # slow\n" MOVE);
    assert_true(fabs(duration_of(move) - 40) < 1e-9);
    run_write(move, "duration: 6 s # fast\n" MOVE);
    assert_int_equal(run("check", rig, move), 1);
    expect_in(run_slew()->out,
              "Line 1 requires 6.000 s: 0.9167 times the pace of the 5.500 s "
              "that are written, and 4.125 times the fastest that the limits "
              "allow, 24.75");
    assert_int_equal(run("fit", rig, move), 0);
    expect_in(run_slew()->out, "fits in 24.75");
    expect_in(text_of(move), "duration: 24.75");
    expect_in(text_of(move), " s # fast\n");
    expect_in(text_of(move), "      - [ 2 s , 50 mm ]\n");
    assert_int_equal(run("check", rig, move), 0);
}

/* Only positions change, by no more than is allowed. */
static void smooth_moves_keys_within_the_tolerance(void **state)
{
    (void)state;
    run_write(move, "axes:\n"
                    "  pan:\n"
                    "    keys:\n"
                    "      - [0 s, 0 deg]\n"
                    "      - [1 s, 2 deg]\n"
                    "      - [2 s, 7 deg]    # shaken\n"
                    "      - [2.1 s, 8.2 deg]\n"
                    "      - {t: 2.2 s, p: 7.9 deg}\n"
                    "      - {t: 3 s, p: 13 deg, fixed: value}\n"
                    "      - [5 s, 17 deg]\n");
    assert_int_equal(run("check", rig, move), 1);
    assert_int_equal(
        run("fit", "--method", "smooth", "--tolerance", "1 mm", rig, move), 2);
    assert_int_equal(run("fit", "--method", "smooth", "--tolerance",
                         "1 mm, 0.01 deg", rig, move),
                     2);
    assert_int_equal(
        run("fit", "--method", "smooth", "--tolerance", "0.01 deg", rig, move),
        1);
    expect_in(run_slew()->err,
              "keys of axis pan moved by no more than the tolerance leave ");
    expect_in(run_slew()->err, ": a larger tolerance or a longer time would");
    assert_int_equal(
        run("fit", "--method", "smooth", "--tolerance", "1 deg", rig, move), 0);
    expect_in(text_of(move), "deg]    # shaken\n");
    expect_in(text_of(move), "{t: 3 s, p: 13 deg, fixed: value}\n");
    expect_in(text_of(move), "      - [0 s, 0 deg]\n");
    expect_in(text_of(move), "      - [2.1 s, ");
    assert_int_equal(run("check", rig, move), 0);
}

/* A larger tolerance is no advice where no key of the span may be moved. */
static void smooth_says_which_keys_stay(void **state)
{
    (void)state;
    run_write(move, "axes:\n"
                    "  pan:\n"
                    "    keys:\n"
                    "      - [0 s, 0 deg]\n"
                    "      - [0.2 s, 30 deg]\n");
    assert_int_equal(
        run("fit", "--method", "smooth", "--tolerance", "50 deg", rig, move),
        1);
    expect_in(run_slew()->err,
              "between keys 1 and 2, which stay (the first, the last, fixed "
              "ones): a longer time would help");
}

static void a_picture_shows_before_and_after(void **state)
{
    static char svg[256];

    (void)state;
    snprintf(svg, sizeof svg, "%s", run_path("both.svg"));
    run_write(move, MOVE);
    assert_int_equal(run("fit", "--dry-run", "--plot", svg, rig, move), 0);
    assert_string_equal(text_of(move), MOVE);
    expect_in(text_of(svg), "<svg");
    assert_int_equal(
        run("fit", "--dry-run", "--plot", "/nowhere/both.svg", rig, move), 3);
    assert_null(strstr(run_slew()->out, "picture"));
    assert_int_equal(run("fit", "--plot", "both.pdf", rig, move), 2);
}

/* A shot at speed: the rolls alone are too short, then the shot is too fast as
 * well. */
static void rolls_are_lengthened_until_they_fit(void **state)
{
    (void)state;
    run_write(move, "pre_roll: 0.1 s # short\n"
                    "axes:\n"
                    "  dolly: {curve: linear, keys: [[0, 300], [8, 700]]}\n"
                    "post_roll: 2 s\n");
    assert_int_equal(run("check", rig, move), 1);
    expect_in(run_slew()->out, "Needs a pre_roll of 0.274 s; slew fit writes");
    assert_int_equal(run("fit", rig, move), 0);
    expect_in(text_of(move), "pre_roll: 0.273862 s # short\n");
    expect_in(text_of(move), "post_roll: 2 s\n");
    assert_null(strstr(text_of(move), "duration"));
    assert_true(fabs(duration_of(move) - 10.273862) < 1e-9);
    run_write(move, "pre_roll: 100 ms\n"
                    "axes:\n"
                    "  dolly: {curve: linear, keys: [[0, 300], [2, 700]]}\n"
                    "post_roll: 2 s\n");
    assert_int_equal(run("fit", rig, move), 0);
    expect_in(text_of(move), "duration: 4.");
    assert_true(duration_of(move) > 6.3 && duration_of(move) < 6.6);
}

static void rolls_and_a_shoot_are_not_given_together(void **state)
{
    (void)state;
    run_write(move, "pre_roll: 1 s\n"
                    "axes: {dolly: {keys: [[0, 300], [8, 700]]}}\n"
                    "shoot: {mode: stop, line: shutter, frames: 3, exposure: 1 "
                    "s, move: 1 s}\n");
    assert_int_equal(run("check", rig, move), 2);
    expect_in(run_slew()->err, "shoot is given beside a pre_roll");
    run_write(move, "post_roll: 0.1 ms\n"
                    "axes: {dolly: {keys: [[0, 300], [8, 700]]}}\n");
    assert_int_equal(run("check", rig, move), 2);
    expect_in(run_slew()->err, ":1:12: post_roll '0.1 ms' is out of range");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(paths_are_slowed_until_they_fit),
        cmocka_unit_test(a_duration_is_kept_or_refused_with_the_arithmetic),
        cmocka_unit_test(smooth_moves_keys_within_the_tolerance),
        cmocka_unit_test(smooth_says_which_keys_stay),
        cmocka_unit_test(a_picture_shows_before_and_after),
        cmocka_unit_test(check_says_what_would_help),
        cmocka_unit_test(rolls_are_lengthened_until_they_fit),
        cmocka_unit_test(rolls_and_a_shoot_are_not_given_together),
        cmocka_unit_test(check_says_what_a_shoot_needs),
        cmocka_unit_test(with_a_shaper_check_says_what_fit_finds),
        cmocka_unit_test(with_a_shaper_a_roll_alone_gets_longer),
        cmocka_unit_test(check_does_not_promise_what_is_fixed),
        cmocka_unit_test(the_text_keeps_all_but_the_times),
        cmocka_unit_test(stretch_lengthens_all_of_it),
        cmocka_unit_test(a_dry_run_and_another_file_leave_the_move_as_it_is),
        cmocka_unit_test(a_fixed_key_stays_or_is_refused),
        cmocka_unit_test(handles_go_with_the_time),
        cmocka_unit_test(json_lists_every_key_that_changed),
        cmocka_unit_test(windows_lines_and_a_mark_stay),
    };
    return cmocka_run_group_tests(tests, open_all, run_close);
}
