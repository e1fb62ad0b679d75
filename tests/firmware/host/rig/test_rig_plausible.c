/* tests/firmware/host/rig/test_rig_plausible.c - numbers of a rig that each may
 * be, and cannot be meant together: refused at their place, or said once.
 *
 * Each row changes one value of a rig about which nothing is said, to the last
 * value that is right and to the first that is not. */
#define _POSIX_C_SOURCE 200809L /* glob */
#include <glob.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/rig/rig.h"
#include "firmware/linux/base/disk.h"
#include "tests/support/check.h"

#define SAID_MAX 4096

static const char base[] =
    "tick: 10 ms\n"
    "heartbeat: 100 ms\n"
    "buses:\n"
    "  net: {kind: modbus-tcp, host: 10.0.0.5, timeout: 1 s}\n"
    "  can0: {kind: canopen, bit_rate: 1 Mbit/s}\n"
    "axes:\n"
    "  lift:\n"
    "    unit: mm\n"
    "    limits: {position: [-600, 600], velocity: 60, acceleration: 50, "
    "jerk: 500}\n"
    "    stop: {acceleration: 200, jerk: 4000}\n"
    "    following_error: {floor: 12, time: 200 ms}\n"
    "    drive: {kind: modbus, bus: net, node: 1, map: leadshine-cs2rs, "
    "counts: 2000 per mm, unsupervised: yes}\n"
    "  pan:\n"
    "    unit: deg\n"
    "    limits: {position: [-90, 90], velocity: 45, acceleration: 90}\n"
    "    following_error: {floor: 1, time: 20 ms}\n"
    "    drive: {kind: cia402, bus: can0, node: 1, counts: 1048576 per rev}\n"
    "    homing: {by: switch, speed: 20, distance: 180}\n";

static const struct {
    const char *name, *from, *to;
    const char *refused; /* "line:column: ..." */
    const char *said;    /* the only sentence, from its line on; NULL: none */
} rows[] = {
    { "as it is", "tick", "tick", NULL, NULL },

    { "a floor of half the range", "floor: 12,", "floor: 600,", NULL, NULL },
    { "a floor of more than half the range", "floor: 12,", "floor: 600.1,",
      NULL,
      "7:3: lift may be off its set point by 600.1 mm at its speed of 60 "
      "mm/s, more than half of its range of 1200 mm: following_error is "
      "as a rule 1 % of it, and 20 ms" },
    { "a floor of the range", "floor: 12,", "floor: 1200,", NULL,
      "7:3: lift may be off its set point by 1200 mm at its speed of 60 mm/s" },
    { "a floor of the range and a count", "floor: 12,", "floor: 1200.0005,",
      NULL,
      "7:3: lift has a following_error of 1200.0005 mm, which an axis that is "
      "1200 mm long never exceeds: nothing watches it, expected less, as a "
      "rule 1 % of that: 12 mm" },
    { "a time of half the range", "time: 200 ms", "time: 10 s", NULL, NULL },
    { "a time of more", "time: 20 ms", "time: 2001 ms", NULL,
      "13:3: pan may be off its set point by 90.04 deg at its speed of 45 "
      "deg/s, more than half of its range of 180 deg" },

    { "a hundred times the acceleration", "acceleration: 200",
      "acceleration: 5000", NULL, NULL },
    { "more than a hundred times", "acceleration: 200", "acceleration: 5001",
      NULL,
      "7:3: lift stops with 5001 mm/s2, 100 times its limit of 50: a motor has "
      "2 to 10 times it as a rule" },
    { "a hundred thousand times", "acceleration: 200", "acceleration: 5e6",
      NULL, "7:3: lift stops with 5e+06 mm/s2, 1e+05 times its limit of 50" },
    { "a million times", "acceleration: 200", "acceleration: 5e7",
      "10:26: acceleration is 1e+06 times the axis's own limit, a step of its "
      "speed, expected what the motor can do, as a rule 2 to 10 times the "
      "limit",
      NULL },
    { "ten thousand times the jerk", "jerk: 4000", "jerk: 5e6", NULL, NULL },
    { "more than that", "jerk: 4000", "jerk: 5001000", NULL,
      "7:3: lift stops with a jerk of 5.001e+06 mm/s3, 1e+04 times its limit "
      "of 500: that is a blow to what it carries" },
    { "ten million times", "jerk: 500}", "jerk: 0.01}", NULL,
      "7:3: lift stops with a jerk of 4000 mm/s3, 4e+05 times its limit of "
      "0.01" },
    { "more than ten million times", "jerk: 500}", "jerk: 0.0001}",
      "10:37: jerk is 4e+07 times the axis's own limit, a step of its "
      "acceleration",
      NULL },

    { "a jerk that is felt",
      "jerk: 500}\n    stop: {acceleration: 200, jerk: "
      "4000",
      "jerk: 4999}\n    stop: {acceleration: 200, jerk: 5000", NULL, NULL },
    { "a jerk that limits nothing",
      "jerk: 500}\n    stop: {acceleration: 200, jerk: 4000",
      "jerk: 5000}\n    stop: {acceleration: 200, jerk: 5000", NULL,
      "7:3: lift has a jerk of 5000 mm/s3, which is its whole acceleration of "
      "50 mm/s2 within one tick of 10 ms: it limits nothing, as less than 5000 "
      "would" },
    { "a speed that takes two ticks", "velocity: 45", "velocity: 9000", NULL,
      "13:3: pan may be off its set point by 180 deg at its speed of 9000 "
      "deg/s" },
    { "a speed that passes the range in a tick",
      "velocity: 60, acceleration: 50, jerk: 500}\n    stop: {acceleration: "
      "200, jerk: 4000}\n    following_error: {floor: 12, time: 200 ms}",
      "velocity: 120000, acceleration: 50, jerk: 500}\n    stop: "
      "{acceleration: 200, jerk: 4000}\n    following_error: {floor: 12, time: "
      "1 ms}",
      NULL,
      "7:3: lift passes its whole range of 1200 mm within one tick of 10 ms at "
      "its speed of 1.2e+05 mm/s" },

    { "a count above the floor, which the register map judges",
      "counts: 2000 per mm", "counts: {num: 1, den: 13}", NULL, NULL },
    { "a count above the range", "counts: 2000 per mm",
      "counts: {num: -1, den: 1201}", NULL,
      "7:3: lift has one count for every 1201 mm of its range of 1200 mm, "
      "expected more, as a rule 100 and more for the following error" },
    { "a count of the floor", "counts: 1048576 per rev",
      "counts: {num: 1, den: 1}", NULL, NULL },
    { "a count above it", "counts: 1048576 per rev", "counts: {num: 5, den: 6}",
      NULL,
      "13:3: pan has one count for every 1.2 deg, and its following_error "
      "allows 1 deg, which is a fault at rest, expected more counts, as a rule "
      "100 and more for it" },
    { "a quick stop that 0x6085 can say", "counts: 1048576 per rev",
      "counts: {num: 23860929, den: 1}", NULL, NULL },
    { "one that it cannot", "counts: 1048576 per rev}",
      "counts: {num: 23860929, den: 1}}\n    stop: {acceleration: 181}", NULL,
      "13:3: pan stops with 4.319e+09 counts/s2, and 0x6085 of its drive says "
      "at most 4294967295: its quick stop is left as the drive has it" },

    { "a homing speed that rests in the range", "speed: 20", "speed: 45", NULL,
      NULL },
    { "one that does not", "acceleration: 90}", "acceleration: 1}", NULL,
      "13:3: pan needs 200 deg to rest from its homing speed of 20 deg/s, and "
      "its range is 180 deg: a speed of 1.897 would be right for it" },

    { "a heartbeat that is slow", "heartbeat: 100 ms", "heartbeat: 500 ms",
      NULL, NULL },
    { "one that is slower", "heartbeat: 100 ms", "heartbeat: 501 ms", NULL,
      "13:3: pan is known to be lost by its heartbeat after 1.503 s, three of "
      "them: they come as a rule every 100 ms or less" },
    { "an answer that is slow", "timeout: 1 s", "timeout: 2 s", NULL, NULL },
    { "one that is slower", "timeout: 1 s", "timeout: 5 s", NULL,
      "7:3: lift is known to be lost after 15 s, three answers that do not "
      "come on bus net: they take 1 s at most as a rule [times]" },
};

/* ---- loading ---- */

static char path[] = "/tmp/test_rig_plausible_XXXXXX";

/* "line:column: text\n" for each. */
static void note(void *context, struct plan_place place, const char *text)
{
    char *said = context;
    const size_t used = strlen(said);

    snprintf(said + used, SAID_MAX - used, "%u:%u: %s\n", place.line,
             place.column, text);
}

static void write_changed(const char *name, const char *from, const char *to)
{
    const char *at = strstr(base, from);
    FILE *file = fopen(path, "w");

    assert_non_null(file);
    if (at == NULL)
        fail_msg("%s: the base has no '%s'", name, from);
    assert_true(fprintf(file, "%.*s%s%s", (int)(at - base), base, to,
                        at + strlen(from)) > 0);
    assert_int_equal(fclose(file), 0);
}

static void what_cannot_be_meant_is_refused_or_said(void **state)
{
    static struct rig rig;

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        char message[YAML_MESSAGE_MAX] = "", said[SAID_MAX] = "";

        write_changed(rows[i].name, rows[i].from, rows[i].to);
        const int err = rig_load(&disk_files, path, &rig, message);
        if ((err < 0) != (rows[i].refused != NULL) ||
            (err < 0 && strstr(message, rows[i].refused) == NULL))
            fail_msg("%s: %s", rows[i].name, err < 0 ? message : "accepted");
        if (err == 0)
            rig_plausible(&rig, note, said);
        const char *end = strchr(said, '\n');
        if (rows[i].said == NULL
                ? said[0] != '\0'
                : end == NULL || end[1] != '\0' ||
                      strncmp(said, rows[i].said, strlen(rows[i].said)) != 0)
            fail_msg("%s: said %s", rows[i].name, said);
        rig_free(&rig);
    }
}

/* The word behind a sentence, in the axis that it is about, ends it; another does
 * not. */
static void what_is_acknowledged_is_not_said(void **state)
{
    static struct rig rig;
    char text[4096], said[SAID_MAX], word[32];
    unsigned silenced = 0;

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        if (rows[i].said == NULL)
            continue;
        const bool is_pan = strstr(rows[i].said, " pan ") != NULL;
        for (int other = 0; other < 2; other++) {
            char message[YAML_MESSAGE_MAX] = "";
            said[0] = '\0';
            write_changed(rows[i].name, rows[i].from, rows[i].to);
            if (rig_load(&disk_files, path, &rig, message) < 0)
                fail_msg("%s", message);
            rig_plausible(&rig, note, said);
            rig_free(&rig);
            assert_int_equal(sscanf(strrchr(said, '[') + 1, "%31[a-z_]", word),
                             1);
            FILE *file = fopen(path, "r");
            assert_non_null(file);
            text[fread(text, 1, sizeof text - 1, file)] = '\0';
            (void)fclose(file);
            char *at = strstr(text, is_pan ? "    unit: deg" : "    unit: mm");
            file = fopen(path, "w");
            assert_non_null(file);
            fprintf(file, "%.*s    acknowledged: [%s]\n%s", (int)(at - text),
                    text,
                    other == 0                   ? word
                    : strcmp(word, "times") == 0 ? "stop"
                                                 : "times",
                    at);
            (void)fclose(file);
            said[0] = '\0';
            if (rig_load(&disk_files, path, &rig, message) < 0)
                fail_msg("%s", message);
            rig_plausible(&rig, note, said);
            rig_free(&rig);
            if ((said[0] == '\0') != (other == 0))
                fail_msg("%s: [%s] said '%s'", rows[i].name, word, said);
            silenced += other == 0;
        }
    }
    assert_true(silenced > 8);
}

/* A simulation may do without. */
static void real_drives_are_not_moved_unwatched(void **state)
{
    static const struct {
        const char *from, *to, *refused;
    } cases[] = {
        { "floor: 1,", "floor: 180,", NULL },
        { "floor: 1,", "floor: 180.0001,",
          "RIG:13:3: pan has a following_error of 180.0001 deg, which an axis "
          "that is 180 deg long never exceeds: nothing watches it, "
          "expected less, as a rule 1 % of that: 1.8 deg" },
        { "floor: 12,", "floor: 1e6,",
          "RIG:7:3: lift has a following_error of 1000000 mm" },
        { "counts: 1048576 per rev", "counts: {num: 5, den: 6}",
          "RIG:13:3: pan has one count for every 1.2 deg" },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(cases); i++) {
        static struct rig rig;
        char message[YAML_MESSAGE_MAX] = "";

        write_changed(cases[i].to, cases[i].from, cases[i].to);
        assert_int_equal(rig_load(&disk_files, path, &rig, message), 0);
        const int err = rig_may_move_drives(&rig, "RIG", message);
        assert_int_equal(err, cases[i].refused == NULL ? 0 : -1);
        if (err < 0 &&
            strncmp(message, cases[i].refused, strlen(cases[i].refused)) != 0)
            fail_msg("%s", message);
        rig_free(&rig);
    }
}

static void nothing_is_said_of_the_examples(void **state)
{
    static const char *const where[] = { "examples/*/*rig*.yaml",
                                         "tests/data/*/*rig*.yaml",
                                         "tests/wrong/base/rig.yaml" };
    unsigned count = 0;

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(where); i++) {
        glob_t found;
        assert_int_equal(glob(where[i], 0, NULL, &found), 0);
        for (size_t k = 0; k < found.gl_pathc; k++) {
            static struct rig rig;
            char message[YAML_MESSAGE_MAX], said[SAID_MAX] = "";

            if (strstr(found.gl_pathv[k], "/bad/") != NULL)
                continue;
            if (rig_load(&disk_files, found.gl_pathv[k], &rig, message) < 0)
                fail_msg("%s", message);
            rig_plausible(&rig, note, said);
            if (said[0] != '\0')
                fail_msg("%s: %s", found.gl_pathv[k], said);
            rig_free(&rig);
            count++;
        }
        globfree(&found);
    }
    assert_true(count > 20);
}

/* Two motors on one bridge; x1 and x2 of kinematics, and whether they are one gantry. */
static void rails_that_may_rack_their_bridge_are_said(void **state)
{
#define AXIS(name, unit)                                                       \
    "  " name ":\n    unit: " unit "\n"                                        \
    "    limits: {position: [-90, 900], velocity: 90, acceleration: 90}\n"     \
    "    following_error: {floor: 1, time: 20 ms}\n"                           \
    "    drive: {kind: virtual}\n"
#define BRIDGE(x1, x2, more, rest)                                             \
    "axes:\n" AXIS("left", "mm") more AXIS("right", "mm")                      \
        AXIS("trolley", "mm") AXIS("column", "mm") AXIS("pan", "deg") AXIS(    \
            "tilt",                                                            \
            "deg") "kinematics:\n"                                             \
                   "  gantry: {rails: [1000, -1000], x1: {axis: " x1           \
                   "}, x2: {axis: " x2                                         \
                   "}, y: {axis: trolley}, z: {axis: column}}\n"               \
                   "  head: {pan: {axis: pan}, tilt: {axis: tilt}}\n" rest
    static const struct {
        const char *name, *text, *said;
    } cases[] = {
        { "two rails", BRIDGE("left", "right", "", ""),
          "2:3: left and right carry one bridge, and homing, jogs and the way "
          "to a move may rack it: they move as one with gantry: {bridge: "
          "{rails: [left, right], racking: ...}} [racking]\n" },
        { "a gantry",
          BRIDGE("left", "right", "",
                 "gantry: {bridge: {rails: [right, left], racking: 1 mm}}\n"),
          "" },
        { "a gantry of others",
          BRIDGE("left", "right", "",
                 "gantry: {bridge: {rails: [trolley, column], racking: 1}}\n"),
          "2:3: left and right carry one bridge" },
        { "acknowledged",
          BRIDGE("left", "right", "    acknowledged: [racking]\n", ""), "" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(cases); i++) {
        static struct rig rig;
        char message[YAML_MESSAGE_MAX], said[SAID_MAX] = "";
        FILE *file = fopen(path, "w");
        assert_non_null(file);
        fputs(cases[i].text, file);
        fclose(file);
        if (rig_load(&disk_files, path, &rig, message) < 0)
            fail_msg("%s: %s", cases[i].name, message);
        rig_plausible(&rig, note, said);
        if (strncmp(said, cases[i].said, strlen(cases[i].said)) != 0 ||
            (said[0] != '\0') != (cases[i].said[0] != '\0'))
            fail_msg("%s: %s", cases[i].name, said);
        rig_free(&rig);
    }
}

/* Both axes have one place where slew takes the bridge to be square. */
static void rails_of_a_gantry_agree_with_the_kinematics(void **state)
{
    static const char text[] =
        BRIDGE("left, offset: 3 mm", "right", "",
               "gantry: {bridge: {rails: [left, right], racking: 1 mm}}\n");
    static struct rig rig;
    char message[YAML_MESSAGE_MAX];
    (void)state;
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
    assert_int_equal(rig_load(&disk_files, path, &rig, message), -1);
    assert_non_null(strstr(message, "different offset or reversed"));
}

static int make(void **state)
{
    const int file = mkstemp(path);

    (void)state;
    return file < 0 ? -1 : close(file);
}

static int clean(void **state)
{
    (void)state;
    return unlink(path);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_cannot_be_meant_is_refused_or_said),
        cmocka_unit_test(what_is_acknowledged_is_not_said),
        cmocka_unit_test(real_drives_are_not_moved_unwatched),
        cmocka_unit_test(nothing_is_said_of_the_examples),
        cmocka_unit_test(rails_that_may_rack_their_bridge_are_said),
        cmocka_unit_test(rails_of_a_gantry_agree_with_the_kinematics),
    };

    return cmocka_run_group_tests(tests, make, clean);
}
