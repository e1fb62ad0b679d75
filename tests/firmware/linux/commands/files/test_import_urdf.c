/* tests/firmware/linux/commands/files/test_import_urdf.c - limits of a robot
 * description and of MoveIt, and the geometry of an arm, in the text of a rig file. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include <math.h>

#include "firmware/host/rig/rig.h"
#include "firmware/linux/base/disk.h"
#include "motion/plan/rig/plan_arm.h"
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
    { ROBOT("<joint type=\"revolute\"/>"),
      "arm.urdf:3:1: the joint has no name" },
    { ROBOT(JOINT("base", "screw", "")),
      "arm.urdf:3:1: joint 'base' has an unknown type" },
    { ROBOT(JOINT("base", "revolute", "lower=\"0x3\"")),
      "arm.urdf:3:36: expected a number, and not '0x3'" },
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
    { ROBOT(JOINT("base", "revolute", "lower=\"${-pi}\"")),
      "expected a number, and not '${-pi}'; what is a template for xacro is to "
      "be expanded by it" },
    { ROBOT("<joint name=\"base\" type=\"revolute\"><axis xyz=\"0 0\"/>"
            "</joint>"),
      "arm.urdf:3:36: expected three numbers, and not '0 0'" },
    { ROBOT("<joint name=\"base\" type=\"revolute\"><axis xyz=\"0 0 0\"/>"
            "</joint>"),
      "arm.urdf:3:36: the axis has no direction" },
    { ROBOT("<joint name=\"base\" type=\"revolute\"><parent/></joint>"),
      "arm.urdf:3:36: expected link, a name" },
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

/* ---- joint_limits.yaml of MoveIt ---- */

#define LIMITS(joints) "joint_limits:\n" joints

static const struct {
    const char *file, *want, *table;
} moveit[] = {
    { LIMITS("  base: {has_velocity_limits: true, max_velocity: 2.5}\n"),
      "{position: [-1, 1], velocity: 2.5 rad/s, acceleration: 3} # the first\n",
      "limits of 1 axis" },
    { LIMITS("  base:\n    max_acceleration: 1e1\n"
             "    has_acceleration_limits: true\n    has_jerk_limits: yes\n"
             "    max_jerk: 50\n"),
      "{position: [-1, 1], velocity: 2, jerk: 50 rad/s3, acceleration: "
      "1e1 rad/s2} # the first\n",
      "limits of 1 axis" },
    { LIMITS("  lift: {has_position_limits: true, min_position: -0.25, "
             "max_position: 0.5}\n"),
      "{position: [-0.25 m, 0.5 m], velocity: 2, acceleration: 3}\n",
      "limits of 1 axis" },
    { LIMITS("  lift: {max_velocity: 7, has_velocity_limits: false}\n"), RIG,
      "not read: max_velocity (1, line 2)" },
    { LIMITS("  base: {max_velocity: 7}\n  spin: {max_velocity: 7}\n"), RIG,
      "not read: max_velocity (2, line 2)" },
    { "default_velocity_scaling_factor: 0.1\n" LIMITS(
          "  base: {angle_wraparound: true}\n  far: {max_jerk: 2}\n"),
      RIG,
      "joint far is no axis of the rig\nnot read: "
      "default_velocity_scaling_factor (1, line 1), angle_wraparound (1, line "
      "3), max_jerk (1, line 4)" },
    { "/**:\n  ros__parameters:\n    robot_description_planning:\n      "
      "joint_limits:\n        spin: {has_velocity_limits: true, max_velocity: "
      "9}\n",
      "{position: [-1, 1], velocity: 9 rad/s, acceleration: 3}\n",
      "limits of 1 axis" },
};

static void limits_of_moveit_are_replaced(void **state)
{
    static char text[1 << 14];
    char limits[256];

    (void)state;
    snprintf(limits, sizeof limits, "%s", run_path("joint_limits.yaml"));
    for (size_t i = 0; i < sizeof moveit / sizeof *moveit; i++) {
        run_write(limits, moveit[i].file);
        if (run("import", "urdf", limits, "--rig", rig, "--out", out) != 0)
            fail_msg("%zu: %s", i, run_slew()->err);
        expect_in(run_slew()->out, moveit[i].table);
        run_read(out, text, sizeof text);
        expect_in(text, moveit[i].want);
    }
    /* behind a description they count where they say something */
    run_write(robot, ROBOT(JOINT("base", "revolute",
                                 "lower=\"-2\" upper=\"2\" velocity=\"1.7\"")));
    run_write(limits, moveit[0].file);
    if (run("import", "urdf", robot, limits, "--rig", rig, "--out", out) != 0)
        fail_msg("%s", run_slew()->err);
    run_read(out, text, sizeof text);
    expect_in(text, "{position: [-2 rad, 2 rad], velocity: 2.5 rad/s, ");
}

static const struct {
    const char *file, *want;
} moveit_wrong[] = {
    { "joints: {}\nmore: 1\n",
      "joint_limits.yaml:1:1: the file has no limits of joints" },
    { "[1]\n", "joint_limits.yaml:1:1: the file has no limits of joints" },
    { LIMITS("  base: 3\n"), "joint_limits.yaml:2:9: base " },
    { LIMITS("  base: {has_velocity_limits: true, max_velocity: fast}\n"),
      "joint_limits.yaml:2:51: max_velocity is 'fast', expected a number" },
    { LIMITS("  base: {has_velocity_limits: maybe, max_velocity: 1}\n"),
      "joint_limits.yaml:2:31: unknown has_velocity_limits 'maybe'" },
    { LIMITS("  base: {has_jerk_limits: true, max_jerk: -1}\n"),
      "joint_limits.yaml:2:9: joint 'base' has the jerk -1, expected one above "
      "zero" },
    { LIMITS("  base: {has_position_limits: true, min_position: 1, "
             "max_position: 0}\n"),
      "joint_limits.yaml:2:9: joint 'base' goes from lower 1 to upper 0" },
    { LIMITS("  far: {max_velocity: 1}\n"),
      "joint_limits.yaml: none of its joints is an axis of the rig" },
};

static void what_is_wrong_in_moveits_is_said(void **state)
{
    char limits[256];

    (void)state;
    snprintf(limits, sizeof limits, "%s", run_path("joint_limits.yaml"));
    for (size_t i = 0; i < sizeof moveit_wrong / sizeof *moveit_wrong; i++) {
        run_write(limits, moveit_wrong[i].file);
        assert_int_equal(
            run("import", "urdf", limits, "--rig", rig, "--out", out), 2);
        expect_in(run_slew()->err, moveit_wrong[i].want);
    }
}

/* ---- the arm ---- */

#define CHAIN_MAX 12
#define CHAINS    60
#define PLACES    20

/* A description, with numbers as they were written. */
struct link {
    int kind; /* 0: turns, 1: slides, 2: fixed */
    double xyz[3], rpy[3], axis[3];
};

static struct link chain[CHAIN_MAX];
static unsigned links, joints;

/* Written with so many digits, and what that is. */
static double rounded(double value, int digits)
{
    char text[40];

    snprintf(text, sizeof text, "%.*f", digits, value);
    return strtod(text, NULL);
}

/* Right angles, as people write them, or any. */
static void draw_link(struct link *link, bool is_right, int digits)
{
    for (int i = 0; i < 3; i++) {
        link->xyz[i] = rounded(
            (double)check_random_in(check_stream(), -500, 500) / 1000, 4);
        link->rpy[i] =
            is_right
                ? rounded((double)check_random_in(check_stream(), -2, 2) *
                              (acos(-1) / 2),
                          digits)
                : (double)check_random_in(check_stream(), -3000, 3000) / 1000;
        link->axis[i] =
            is_right ? 0
                     : (double)check_random_in(check_stream(), -100, 100) / 100;
        if (is_right && check_random_in(check_stream(), 0, 1) == 1)
            link->xyz[i] = 0;
    }
    if (is_right)
        link->axis[check_random_in(check_stream(), 0, 2)] =
            check_random_in(check_stream(), 0, 1) == 1 ? 1 : -1;
    else
        link->axis[2] += 1.5;
}

static void draw_chain(bool is_right)
{
    const int digits = (int)check_random_in(check_stream(), 4, 12);

    links = (unsigned)check_random_in(check_stream(), 1, CHAIN_MAX);
    joints = 0;
    for (unsigned i = 0; i < links; i++) {
        draw_link(&chain[i], is_right, digits);
        chain[i].kind = (int)check_random_in(check_stream(), 0, 9);
        chain[i].kind = chain[i].kind < 6 ? 0 : chain[i].kind < 8 ? 1 : 2;
        if (i == 0)
            chain[i].kind = 0;
        if (joints == 8)
            chain[i].kind = 2;
        joints += chain[i].kind != 2;
    }
}

static void write_chain(const char *tip)
{
    static char text[1 << 14];
    static const char *const type[] = { "revolute", "prismatic", "fixed" };
    size_t used = (size_t)snprintf(text, sizeof text, "<robot name=\"a\">\n");

    for (unsigned i = 0; i < links; i++) {
        const struct link *l = &chain[i];
        char child[32];
        snprintf(child, sizeof child, "l%u", i + 1);
        used += (size_t)snprintf(
            text + used, sizeof text - used,
            "<joint name=\"j%u\" type=\"%s\"><origin xyz=\"%.17g %.17g "
            "%.17g\" rpy=\"%.17g %.17g %.17g\"/><parent link=\"l%u\"/><child "
            "link=\"%s\"/><axis xyz=\"%.17g %.17g %.17g\"/></joint>\n",
            i, type[l->kind], l->xyz[0], l->xyz[1], l->xyz[2], l->rpy[0],
            l->rpy[1], l->rpy[2], i, i + 1 == links ? tip : child, l->axis[0],
            l->axis[1], l->axis[2]);
    }
    snprintf(text + used, sizeof text - used, "</robot>\n");
    run_write(robot, text);
    used = (size_t)snprintf(text, sizeof text,
                            "buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}"
                            "\naxes:\n");
    for (unsigned i = 0; i < links; i++)
        if (chain[i].kind != 2)
            used += (size_t)snprintf(
                text + used, sizeof text - used,
                "  j%u:\n    unit: %s\n    limits: {position: [-9, 9], "
                "velocity: 2, acceleration: 3}\n    following_error: {floor: "
                "1}\n    drive: {kind: cia402, bus: can0, node: %u, counts: "
                "{num: 1000, den: 1}}\n",
                i,
                chain[i].kind == 1 ? "mm"
                : i % 2 == 0       ? "rad"
                                   : "deg",
                i + 1);
    run_write(rig, text);
}

/* t = t x m, rotations and a column of places in mm. */
static void multiply(double t[3][4], const double m[3][4])
{
    double product[3][4];

    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 4; c++) {
            product[r][c] = c == 3 ? t[r][3] : 0;
            for (int k = 0; k < 3; k++)
                product[r][c] += t[r][k] * m[k][c];
        }
    memcpy(t, product, sizeof product);
}

/* wiki.ros.org/urdf: R = Rz(yaw) Ry(pitch) Rx(roll); a turn about the axis by
 * Rodrigues' formula. */
static void place_tip(const double by[], double t[3][4])
{
    static const double one[3][4] = { { 1, 0, 0, 0 },
                                      { 0, 1, 0, 0 },
                                      { 0, 0, 1, 0 } };

    memcpy(t, one, sizeof one);
    for (unsigned i = 0, j = 0; i < links; i++) {
        const struct link *l = &chain[i];
        const double sr = sin(l->rpy[0]), cr = cos(l->rpy[0]),
                     sp = sin(l->rpy[1]), cp = cos(l->rpy[1]),
                     sy = sin(l->rpy[2]), cy = cos(l->rpy[2]);
        const double origin[3][4] = {
            { cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr,
              1000 * l->xyz[0] },
            { sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr,
              1000 * l->xyz[1] },
            { -sp, cp * sr, cp * cr, 1000 * l->xyz[2] },
        };
        const double size =
            sqrt(l->axis[0] * l->axis[0] + l->axis[1] * l->axis[1] +
                 l->axis[2] * l->axis[2]);
        const double x = l->axis[0] / size, y = l->axis[1] / size,
                     z = l->axis[2] / size;
        multiply(t, origin);
        if (l->kind == 2)
            continue;
        const double q = by[j++], s = l->kind == 0 ? sin(q) : 0,
                     c = l->kind == 0 ? cos(q) : 1, v = 1 - c,
                     d = l->kind == 1 ? q : 0;
        const double motion[3][4] = {
            { x * x * v + c, x * y * v - z * s, x * z * v + y * s, d * x },
            { x * y * v + z * s, y * y * v + c, y * z * v - x * s, d * y },
            { x * z * v - y * s, y * z * v + x * s, z * z * v + c, d * z },
        };
        multiply(t, motion);
    }
}

/* Right angles of few digits are taken as such: 5e-5 of the reach, docs/FILES.md. */
static double within_mm(bool is_right)
{
    double reach = 0;

    for (unsigned i = 0; i < links; i++)
        reach += 1000 * hypot(hypot(chain[i].xyz[0], chain[i].xyz[1]),
                              chain[i].xyz[2]) +
                 (chain[i].kind == 1 ? 1000 : 0);
    return fmax(0.06, is_right ? 5e-5 * reach : 0);
}

static void expect_near(double got, double want, double within)
{
    if (!(fabs(got - want) <= within))
        fail_msg("expected %.9g, got %.9g", want, got);
}

/* The rig that was written has its tool where the description has it. */
static void expect_arm(double within)
{
    static struct rig got;
    char message[YAML_MESSAGE_MAX];

    if (rig_load(&disk_files, out, &got, message) < 0)
        fail_msg("%s", message);
    const struct plan_arm *arm = &got.kinematics->arm;
    assert_int_equal(arm->arm.count, joints);
    for (int n = 0; n < PLACES; n++) {
        double by[CHAIN_MAX], t[3][4];
        struct plan_jet jet[MOTION_ARM_JOINTS_MAX];
        struct plan_rig_camera camera;
        for (unsigned i = 0; i < joints; i++) {
            const bool slides = arm->arm.joint[i].is_prismatic;
            by[i] = (double)check_random_in(check_stream(), -3000, 3000) /
                    (slides ? 10 : 1000);
            jet[i] = plan_jet_of(by[i]);
        }
        place_tip(by, t);
        plan_arm_camera(arm, jet, &camera);
        for (int k = 0; k < 3; k++) {
            expect_near(camera.pupil.x[k].p, t[k][3], within);
            expect_near(camera.frame.forward.x[k].p, t[k][2], 1e-4);
            expect_near(camera.frame.up.x[k].p, t[k][1], 1e-4);
        }
    }
    rig_free(&got);
}

static void an_arm_is_where_the_description_has_it(void **state)
{
    (void)state;
    seed_from("arms of random chains");
    for (unsigned n = 0; n < CHAINS; n++) {
        draw_chain(n % 3 != 0);
        write_chain("tool0");
        if (run("import", "urdf", robot, "--rig", rig, "--out", out) != 0)
            fail_msg("%s", run_slew()->err);
        expect_in(run_slew()->out, "\nkinematics: an arm of ");
        expect_arm(within_mm(n % 3 != 0));
    }
}

#define PART(name, type, parent, child, more)                                  \
    "<joint name=\"" name "\" type=\"" type "\"><parent link=\"" parent        \
    "\"/><child link=\"" child "\"/>" more "</joint>\n"

static const struct {
    const char *robot, *want;
} arms[] = {
    { ROBOT(PART("base", "revolute", "a", "b", "")
                PART("spin", "revolute", "b", "c", "")),
      "an arm of 2 joints from a to c" },
    { ROBOT(PART("base", "revolute", "a", "b", "")
                PART("f", "fixed", "b", "flange", "")
                    PART("g", "fixed", "flange", "cam", "")),
      "an arm of 1 joint from a to cam" },
    { ROBOT(PART("base", "revolute", "a", "b", "")
                PART("f", "fixed", "b", "tool0", "")
                    PART("g", "fixed", "tool0", "cam", "")),
      "an arm of 1 joint from a to tool0" },
    { ROBOT(PART("base", "revolute", "a", "b", "") PART(
          "f", "fixed", "b", "one", "") PART("g", "fixed", "b", "tool0", "")),
      "an arm of 1 joint from a to tool0" },
    { ROBOT(PART("base", "revolute", "a", "b", "") PART(
          "f", "fixed", "b", "one", "") PART("g", "fixed", "b", "two", "")),
      "an arm of 1 joint from a to b" },
    { ROBOT(PART("base", "revolute", "a", "b", "")
                PART("spin", "revolute", "a", "c", "")),
      "no kinematics: the joints are on several branches: joint 'base' carries "
      "1 of 2" },
    { ROBOT(PART("base", "revolute", "a", "b", "")
                PART("arm", "revolute", "b", "c", "")
                    PART("spin", "revolute", "c", "d", "")),
      "no kinematics: joint 'arm' moves and is no axis of the rig" },
    { ROBOT(PART("base", "revolute", "a", "b", "")
                PART("spin", "revolute", "b", "c", "<mimic joint=\"base\"/>")),
      "no kinematics: joint 'spin' follows another joint" },
    { ROBOT(PART("base", "revolute", "a", "b", "")
                PART("spin", "revolute", "b", "c",
                     "<origin xyz=\"1 1 0\" rpy=\"0.0000001 0 0\"/>"
                     "<axis xyz=\"0 0 1\"/>")),
      "an arm of 2 joints from a to c" },
    { ROBOT(PART("base", "revolute", "a", "b", "<axis xyz=\"1 0 0\"/>")
                PART("spin", "revolute", "b", "c",
                     "<origin xyz=\"1 1 0\" rpy=\"0 0 0.002\"/>")
                    PART("g", "fixed", "c", "cam", "<origin xyz=\"0 50 0\"/>")),
      "kinematics: an arm of 2 joints from a to cam" },
    { ROBOT(PART("base", "revolute", "a", "b", "<axis xyz=\"1 0 0\"/>")
                PART("spin", "revolute", "b", "c",
                     "<origin xyz=\"1 900 0\" rpy=\"0 0 0.0001\"/>")),
      "no kinematics: the axes of joints 'base' and 'spin' are nearly "
      "parallel" },
    { ROBOT(PART("float", "floating", "w", "a", "")
                PART("base", "revolute", "a", "b", "")),
      "no kinematics: joint 'float' is of several axes" },
    { ROBOT(JOINT("base", "revolute", "velocity=\"1\" effort=\"3\"")),
      "not read: effort (1, line 3)\nno kinematics: joint 'base' does not say "
      "its parent and its child" },
    { ROBOT(PART("base", "revolute", "a", "b", "")
                PART("spin", "revolute", "b", "a", "")),
      "rig: " }, /* links that go round end */
};

static void an_arm_is_named_or_why_there_is_none(void **state)
{
    (void)state;
    run_write(rig, RIG);
    for (size_t i = 0; i < sizeof arms / sizeof *arms; i++) {
        run_write(robot, arms[i].robot);
        if (run("import", "urdf", robot, "--rig", rig, "--out", out) != 0)
            fail_msg("%zu: %s", i, run_slew()->err);
        expect_in(run_slew()->out, arms[i].want);
    }
    /* what it has is written once */
    run_write(robot, arms[0].robot);
    (void)run("import", "urdf", robot, "--rig", rig, "--out", out);
    assert_int_equal(run("import", "urdf", robot, "--rig", out, "--out", out),
                     0);
    expect_in(run_slew()->out,
              "no kinematics: the rig has its own, which stays as it is");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(limits_are_replaced_where_they_stand),
        cmocka_unit_test(what_is_wrong_is_said_and_nothing_is_written),
        cmocka_unit_test(limits_of_moveit_are_replaced),
        cmocka_unit_test(what_is_wrong_in_moveits_is_said),
        cmocka_unit_test(an_arm_is_where_the_description_has_it),
        cmocka_unit_test(an_arm_is_named_or_why_there_is_none),
    };
    return cmocka_run_group_tests(tests, open_all, run_close);
}
