/* tests/firmware/linux/commands/files/test_import_urdf.c - limits of a robot
 * description, in the text of a rig file. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "tests/support/check.h"
#include "tests/support/run_slew.h"

#define AXIS(name, unit, node, more)                                           \
    "  " name ":\n    unit: " unit "\n"                                        \
    "    limits: {position: [-1, 1], velocity: 2, acceleration: 3}" more "\n"  \
    "    following_error: {floor: 1}\n"                                        \
    "    drive: {kind: cia402, bus: can0, node: " node                         \
    ", counts: {num: 1000, den: 1}}\n"
#define RIG                                                                    \
    "buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}\n"                     \
    "axes:\n" AXIS("base", "deg", "1", " # the first")                         \
        AXIS("lift", "mm", "2", "") AXIS("spin", "rad", "3", "")

#define ROBOT(joints)                                                          \
    "<?xml version=\"1.0\"?>\n<robot name=\"arm\">\n" joints "</robot>\n"
#define JOINT(name, type, limit)                                               \
    "<joint name=\"" name "\" type=\"" type "\"><limit " limit "/></joint>\n"

static char rig[256], robot[256], out[256];

static int open_all(void **state)
{
    if (run_open(state) < 0)
        return -1;
    snprintf(rig, sizeof rig, "%s", run_path("rig.yaml"));
    snprintf(robot, sizeof robot, "%s", run_path("arm.urdf"));
    snprintf(out, sizeof out, "%s", run_path("new.yaml"));
    run_write(rig, RIG);
    return 0;
}

static void expect_in(const char *text, const char *want)
{
    if (strstr(text, want) == NULL)
        fail_msg("expected \"%s\" in \"%s\"", want, text);
}

static void limits_are_replaced_where_they_stand(void **state)
{
    static char text[1 << 14];

    (void)state;
    run_write(robot,
              ROBOT(JOINT("base", "revolute",
                          "lower=\"-2.967\" upper=\" 2.967 \" velocity=\"1.7\"")
                        JOINT("spin", "continuous", "velocity=\"4e-1\"")
                            JOINT("lift", "prismatic",
                                  "lower=\"0\" upper=\"0.31\" "
                                  "velocity=\"0.2\"")
                                JOINT("tool", "fixed", "velocity=\"no\"")
                                    JOINT("other", "revolute", "")));
    if (run("import", "urdf", robot, "--rig", rig, "--out", out) != 0)
        fail_msg("%s", run_slew()->err);
    expect_in(run_slew()->out, "joint other is no axis of the rig");
    expect_in(run_slew()->out, "limits of 3 axes");
    run_read(out, text, sizeof text);
    expect_in(text, "{position: [-2.967 rad, 2.967 rad], velocity: 1.7 rad/s, "
                    "acceleration: 3} # the first\n");
    expect_in(text, "{position: [0 m, 0.31 m], velocity: 0.2 m/s, "
                    "acceleration: 3}\n");
    expect_in(text, "{position: [-1, 1], velocity: 4e-1 rad/s, "
                    "acceleration: 3}\n");
    run_read(rig, text, sizeof text);
    assert_string_equal(text, RIG); /* as it was */
}

static const struct {
    const char *robot, *want;
} wrong[] = {
    { "<robot><joint", "arm.urdf:1:8: unclosed token" },
    { "<a/>", "arm.urdf:1:1: is no robot description" },
    { "<robot/>", "arm.urdf:1:1: the robot has no joint that moves" },
    { ROBOT("<joint type=\"revolute\"/>"), "arm.urdf:3:1: joint has no name" },
    { ROBOT(JOINT("base", "screw", "")),
      "arm.urdf:3:1: joint has an unknown type" },
    { ROBOT(JOINT("base", "revolute", "lower=\"0x3\"")),
      "arm.urdf:3:36: expected a number, in rad or m, and not '0x3'" },
    { ROBOT(JOINT("base", "revolute", "") JOINT("base", "revolute", "")),
      "arm.urdf:4:1: there is a second joint 'base'" },
    { ROBOT(JOINT("lift", "revolute", "")),
      "arm.urdf:3:1: joint 'lift' turns, and the axis of the rig is in mm" },
    { ROBOT(JOINT("far", "revolute", "")),
      "arm.urdf: none of its joints is an axis of the rig; the first is "
      "'far'" },
    { ROBOT(JOINT("base", "revolute", "lower=\"3\" upper=\"2\"")),
      "arm.urdf:3:1: joint 'base' goes from lower 3 to upper 2, expected lower "
      "below upper" },
    { ROBOT(JOINT("base", "revolute", "velocity=\"0\"")),
      "arm.urdf:3:1: joint 'base' has the velocity 0, expected one above "
      "zero" },
};

static void what_is_wrong_is_said_and_nothing_is_written(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        run_write(robot, wrong[i].robot);
        remove(out);
        assert_int_equal(
            run("import", "urdf", robot, "--rig", rig, "--out", out), 2);
        expect_in(run_slew()->err, wrong[i].want);
        assert_int_not_equal(access(out, F_OK), 0);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(limits_are_replaced_where_they_stand),
        cmocka_unit_test(what_is_wrong_is_said_and_nothing_is_written),
    };
    return cmocka_run_group_tests(tests, open_all, run_close);
}
