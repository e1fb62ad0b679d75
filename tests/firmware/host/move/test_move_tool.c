/* tests/firmware/host/move/test_move_tool.c - the tool of an arm on a path through
 * space: where the joints put it by motion/kinematics, in integers, is where the
 * path is at that time, turned as the file says. */
#include "motion/kinematics/arm.h"
#include "tests/firmware/host/move/move_file.h"
#include "tests/motion/kinematics/rig_random.h"

#define ARM   "examples/arm/rig.yaml"
#define TIMES 499
#define START "near: [0, -90, 90, 180, 90, 0]"

static struct motion_camera camera_at(const struct move_file *file, int64_t t)
{
    const struct plan_arm *arm = &file->rig.kinematics->arm;
    int64_t q32[MOTION_ARM_JOINTS_MAX];
    struct motion_camera camera;

    for (uint32_t i = 0; i < arm->arm.count; i++)
        q32[i] = move_file_at(file, file->rig.axis[arm->axis[i].axis].name, t)
                     .pos_q32;
    assert_int_equal(motion_arm_camera(&arm->arm, &arm->tool, q32, &camera),
                     MOTION_OK);
    return camera;
}

/* x right, y up, z backwards of the camera. */
static void axis_of(const struct motion_camera *camera, int axis, double v[3])
{
    struct motion_dir dir = { { 0, 0, 0 } };

    dir.q62[axis] = (int64_t)1 << 62;
    dir = motion_quat_turn(camera->q, dir);
    for (int i = 0; i < 3; i++)
        v[i] = ldexp((double)dir.q62[i], -62);
}

struct off {
    double path, view, level;
};

/* With `at`: the angle between the view and the way to it; level is how far right
 * is from horizontal, both in rad. */
static void compare(const struct move_file *file, const double at[3],
                    struct off *off)
{
    const int64_t end = file->outcome.distance.end_ns_q12;

    for (int n = 0; n <= TIMES; n++) {
        const int64_t t = end / TIMES * n;
        const struct motion_camera camera = camera_at(file, t);
        struct motion_state distance;
        struct motion_vec place;
        double sum = 0, dot = 0, far = 0, right[3], back[3];
        motion_track_state(&file->outcome.distance, t, &distance);
        assert_int_equal(plan_space_at(&file->outcome.drive.space,
                                       distance.pos_q32, &place, NULL),
                         MOTION_OK);
        axis_of(&camera, 0, right);
        axis_of(&camera, 2, back);
        for (int i = 0; i < 3; i++) {
            const double to = at[i] - number_of(camera.pupil.x[i]);
            sum += pow(number_of(camera.pupil.x[i]) - number_of(place.x[i]), 2);
            dot -= to * back[i];
            far += to * to;
        }
        off->path = fmax(off->path, sqrt(sum));
        off->view = fmax(off->view, sqrt(fmax(0, 1 - dot * dot / far)));
        off->level = fmax(off->level, fabs(right[2]));
        assert_true(dot > 0);
    }
}

static void the_tool_is_on_the_path_and_looks_at_its_point(void **state)
{
    static struct move_file file;
    struct off off = { 0, 0, 0 };
    double bound = 0;

    (void)state;
    seed_from("the_tool_is_on_the_path_and_looks_at_its_point");
    for (int n = 0; n < 8; n++) {
        const double at[3] = { uniform(800, 1500), uniform(-200, 200),
                               uniform(0, 200) };
        char text[2000], *to = text;
        to += sprintf(to, "path:\n  axes: tool\n  points:\n");
        for (int i = 0; i < 4; i++)
            to += sprintf(to, "    - [%.6f, %.6f, %.6f]\n", uniform(330, 450),
                          -240 + 150 * i + uniform(-40, 40), uniform(330, 520));
        sprintf(to,
                "  speed: {law: quintic, time: 9}\n"
                "  tool: {look: [%.6f, %.6f, %.6f], " START "}\n",
                at[0], at[1], at[2]);
        move_file_need(&file, ARM, text);
        compare(&file, at, &off);
        bound = fmax(bound, from_q32(file.outcome.carrier_bound_q32));
        move_file_close(&file);
    }
    print_message("worst: %.2g mm, view %.2g rad, level %.2g rad, bound %.2g\n",
                  off.path, off.view, off.level, bound);
    assert_true(bound <= 1e-6);
    assert_true(off.path < 1e-4);
    assert_true(off.view < 1e-7 && off.level < 1e-7);
}

#define PATH(tool)                                                             \
    "path:\n  axes: tool\n  points: [[420, -200, 300], [450, 200, 350]]\n"     \
    "  speed: {law: quintic, time: 9}\n" tool

/* Straight down, with the top of its picture to the right. */
static void directions_are_kept(void **state)
{
    static struct move_file file;
    double up[3], back[3];

    (void)state;
    move_file_need(
        &file, ARM,
        PATH("  tool: {forward: [0, 0, -1], up: [0, -2, 5], " START "}\n"));
    for (int i = 0; i <= 9; i++) {
        const struct motion_camera camera =
            camera_at(&file, i * (int64_t)MOVE_FILE_S);
        axis_of(&camera, 1, up);
        axis_of(&camera, 2, back);
        assert_true(fabs(back[2] - 1) < 1e-8 && fabs(up[1] + 1) < 1e-8);
    }
    move_file_close(&file);
}

/* Elbow above or below: the joints near which it starts choose. */
static void the_branch_is_the_one_that_was_asked_for(void **state)
{
    static struct move_file file;
    double elbow[2];

    (void)state;
    for (int i = 0; i < 2; i++) {
        move_file_need(&file, ARM,
                       i == 0 ? PATH("  tool: {forward: [0, 0, -1], up: [0, 1, "
                                     "0], near: [0, -180, 90, 0, 0, 0]}\n")
                              : PATH("  tool: {forward: [0, 0, -1], up: [0, 1, "
                                     "0], near: [0, -100, -90, 0, 0, 0]}\n"));
        elbow[i] = move_file_pos(&file, "elbow", 0);
        assert_true(fabs(move_file_pos(&file, "elbow", 9) - elbow[i]) < 90);
        move_file_close(&file);
    }
    print_message("elbow %.3f and %.3f deg\n", elbow[0], elbow[1]);
    assert_true(elbow[0] > 20 && elbow[1] < -20);
}

static void what_cannot_be_is_refused(void **state)
{
    (void)state;
    move_file_refuse(ARM, PATH(""), "2:3: path has no 'tool'");
    move_file_refuse(ARM, PATH("  tool: {up: [0, 0, 1]}\n"),
                     "tool has no look, and no forward");
    move_file_refuse(ARM, PATH("  tool: {forward: [0, 0, 1]}\n"),
                     "tool has forward and up in one line");
    move_file_refuse(ARM, PATH("  tool: {look: [0, 0, 1], near: [0, 0]}\n"),
                     "near has 2 items");
    move_file_refuse(ARM, PATH("  tool: {look: [9 m, 0, 0], up: [0, 0, 1]}\n"),
                     "tool has up beside look");
    move_file_refuse(ARM,
                     "path:\n  axes: tool\n  points: [[420, -200, 300], [3 m, "
                     "200, 350]]\n  tool: {look: [9 m, 0, 0], " START
                     "}\n  speed: {law: quintic, time: 9}\n",
                     "s the path is out of reach of the arm");
    move_file_refuse(ARM,
                     "path:\n  axes: head\n  points: [[1, 2, 3], [4, 5, 6]]\n"
                     "  speed: {law: quintic, time: 9}\n",
                     "axes is 'head', and the rig has an arm");
    move_file_refuse("examples/slider/rig.yaml", PATH(""),
                     "axes is 'tool', and the rig has no arm");
    move_file_refuse(ARM,
                     "axes: {base: {keys: [[0, 0], [1, 1]]}}\n"
                     "camera: {look: {at: [1, 2, 3]}}\n",
                     "camera is for a head, and the rig has an arm");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_tool_is_on_the_path_and_looks_at_its_point),
        cmocka_unit_test(directions_are_kept),
        cmocka_unit_test(the_branch_is_the_one_that_was_asked_for),
        cmocka_unit_test(what_cannot_be_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
