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

/* The angle between two rotations, rad. */
static double between(struct motion_quat a, struct motion_quat b)
{
    struct motion_vec turn;
    struct motion_quat q = motion_quat_mul(motion_quat_inverse(a), b);

    if (q.w < 0)
        q = motion_quat_neg(q);
    assert_int_equal(motion_quat_log(q, &turn), MOTION_OK);
    return number_of(motion_vec_length(turn));
}

#define ARCH(tool)                                                             \
    "path:\n  axes: tool\n"                                                    \
    "  points: [[300, -250, 300], [400, 0, 350], [300, 250, 300]]\n"           \
    "  speed: {law: quintic, time: 8}\n  tool:\n    " START "\n" tool

/* A walker who does not stop when the path does. */
static void a_subject_that_moves_stays_in_the_middle(void **state)
{
    static struct move_file file;
    double worst = 0, rolled = 0;

    (void)state;
    move_file_need(&file, ARM,
                   ARCH("    look: {subject: {curve: linear, keys: "
                        "[[0, [900, -300, 100]], [10, [900, 500, 300]]]}}\n"
                        "    roll: {keys: [[0, 0], [4, 20], [10, 20]]}\n"));
    for (int n = 0; n <= 100; n++) {
        const double t = 0.1 * n;
        const double at[3] = { 900, -300 + 80 * t, 100 + 20 * t };
        const struct motion_camera camera =
            camera_at(&file, (int64_t)llround(t * (double)MOVE_FILE_S));
        double right[3], back[3], to[3], far = 0, dot = 0;
        axis_of(&camera, 0, right);
        axis_of(&camera, 2, back);
        for (int i = 0; i < 3; i++) {
            to[i] = at[i] - number_of(camera.pupil.x[i]);
            far += to[i] * to[i];
            dot -= to[i] * back[i];
        }
        worst = fmax(worst, sqrt(fmax(0, 1 - dot * dot / far)));
        if (n == 40 || n == 100) /* clockwise: its right side is lower */
            rolled = fmax(
                rolled,
                fabs(asin(-right[2] / sqrt(1 - back[2] * back[2])) - 20 / DEG));
    }
    print_message("view %.2g rad, roll %.2g rad\n", worst, rolled);
    assert_true(worst < 1e-7 && rolled < 1e-7);
    move_file_close(&file);
}

#define DOWN  "{t: 0, forward: [0.2, 0, -1], up: [1, 0.3, 0.2]}"
#define ROUND "{t: 4, quaternion: [0.6, 0.05, 0.1, -0.8]}"
#define UP    "{t: 9, angles: [20, -35, 15]}"

/* Through the vertical, where pan and tilt have a pole. */
static void keys_turn_it_by_time(void **state)
{
    static const char *const curve[] = { "c2", "squad", "slerp" };
    static struct move_file file;
    const int64_t wxyz[4] = { 600, 50, 100, -800 };
    struct motion_quat key = MOTION_QUAT_ONE;

    (void)state;
    assert_int_equal(motion_quat_unit(wxyz, &key), MOTION_OK);
    for (int c = 0; c < 3; c++) {
        char text[1000];
        snprintf(text, sizeof text,
                 ARCH("    look: {curve: %s, keys: [" DOWN ", " ROUND ", " UP
                      "]}\n"),
                 curve[c]);
        move_file_need(&file, ARM, text);
        const struct motion_quat first = camera_at(&file, 0).q,
                                 half = camera_at(&file, 2 * MOVE_FILE_S).q,
                                 second = camera_at(&file, 4 * MOVE_FILE_S).q;
        print_message("%s: %.2g rad from its key\n", curve[c],
                      between(second, key));
        assert_true(between(second, key) < 1e-8);
        if (c == 2) { /* half way after half the time */
            assert_true(fabs(between(first, half) - between(half, second)) <
                        1e-8);
            assert_true(
                fabs(2 * between(first, half) - between(first, second)) < 1e-8);
        }
        assert_true(between(camera_at(&file, 9 * MOVE_FILE_S).q,
                            camera_at(&file, 8 * MOVE_FILE_S).q) > 1e-3);
        move_file_close(&file);
    }
}

/* Its view is along the path; between two moments it has turned about that by as
 * much as `level` needs, or by nothing. */
static void it_looks_along_the_path(void **state)
{
    static const char *const along[] = { "level", "rotation-minimising" };
    static struct move_file file;

    (void)state;
    for (int c = 0; c < 2; c++) {
        double view = 0, level = 0, twist = 0, before[3] = { 0, 0, 0 },
               above[3] = { 0, 0, 0 };
        char text[1000];
        snprintf(
            text, sizeof text,
            "path:\n  axes: tool\n"
            "  points: [[300, -250, 300], [400, 0, 400], [380, 250, 330]]\n"
            "  speed: {law: quintic, time: 8}\n"
            "  tool: {" START ", look: {along: %s}}\n",
            along[c]);
        move_file_need(&file, ARM, text);
        for (int n = 0; n <= TIMES; n++) {
            const int64_t t = 8 * MOVE_FILE_S / TIMES * n;
            const struct motion_camera camera = camera_at(&file, t);
            struct motion_state distance;
            struct motion_vec place;
            struct motion_dir tangent;
            double right[3], up[3], back[3], dot = 0, about = 0;
            motion_track_state(&file.outcome.distance, t, &distance);
            assert_int_equal(plan_space_at(&file.outcome.drive.space,
                                           distance.pos_q32, &place, &tangent),
                             MOTION_OK);
            axis_of(&camera, 0, right);
            axis_of(&camera, 1, up);
            axis_of(&camera, 2, back);
            for (int i = 0; i < 3; i++) {
                dot -= back[i] * ldexp((double)tangent.q62[i], -62);
                about += (right[i] - before[i]) * (up[i] + above[i]) / 2;
                before[i] = right[i];
                above[i] = up[i];
            }
            view = fmax(view, sqrt(fmax(0, 1 - dot * dot)));
            level = fmax(level, fabs(right[2]));
            twist += n == 0 ? 0 : about;
        }
        print_message("%s: view %.2g rad, level %.2g, turned %.3g rad\n",
                      along[c], view, level, twist);
        assert_true(view < 1e-7);
        assert_true(c == 0 ? level < 1e-7 : level > 1e-3);
        assert_true(c == 0 ? fabs(twist) > 1e-2 : fabs(twist) < 1e-5);
        move_file_close(&file);
    }
}

/* All the looks that a camera on a path has, at a place or a length of it. */
static void every_look_of_a_path_is_one_of_a_tool(void **state)
{
    static const char *const look[] = {
        "{ahead: 60}",
        "{path: {points: [[900, -300, 100], [800, 300, 200]]}}",
        "{dwell: [{at: [900, -200, 100], from: 0 %, to: 30 %}, "
        "{at: [800, 300, 100], from: 70 %, to: 100 %}]}",
        "{keys: [{at: 0 %, forward: [1, 0, -1]}, "
        "{at: 100 %, forward: [0.6, 0.3, -1]}]}",
    };
    static struct move_file file;

    (void)state;
    for (int i = 0; i < 4; i++) {
        char text[1000];
        snprintf(text, sizeof text, ARCH("    look: %s\n"), look[i]);
        move_file_need(&file, ARM, text);
        assert_true(from_q32(file.outcome.carrier_bound_q32) <= 1e-6);
        move_file_close(&file);
    }
}

#define RAIL "examples/armrail/rig.yaml"

static struct motion_camera on_rail(const struct move_file *file, int64_t t)
{
    struct motion_camera camera = camera_at(file, t);
    const struct motion_pose *base = &file->rig.kinematics->arm.base;

    camera.q = motion_quat_mul(base->q, camera.q);
    camera.pupil =
        motion_vec_add(base->origin, motion_mount_turn(base->q, camera.pupil));
    return camera;
}

/* The rail goes as it is keyed and the six joints make up for it. */
static void a_joint_with_keys_keeps_them(void **state)
{
    static struct move_file file;

    (void)state;
    for (int held = 0; held < 2; held++) {
        double off = 0;
        move_file_need(
            &file, RAIL,
            held ? "axes: {rail: {keys: [[0, 100]]}}\n" ARCH(
                       "    forward: [0, 0, -1]\n    up: [0, 1, 0]\n")
                 : "axes: {rail: {curve: linear, keys: [[0, -200], [8, 200]]}}"
                   "\n" ARCH("    forward: [0, 0, -1]\n    up: [0, 1, 0]\n"));
        for (int n = 0; n <= 8; n++) {
            const int64_t t = n * (int64_t)MOVE_FILE_S;
            const struct motion_camera camera = on_rail(&file, t);
            struct motion_state distance;
            struct motion_vec place;
            assert_true(fabs(move_file_pos(&file, "rail", n) -
                             (held ? 100 : -200 + 50 * n)) < 1e-6);
            motion_track_state(&file.outcome.distance, t, &distance);
            assert_int_equal(plan_space_at(&file.outcome.drive.space,
                                           distance.pos_q32, &place, NULL),
                             MOTION_OK);
            off = fmax(off, number_of(motion_vec_length(
                                motion_vec_sub(camera.pupil, place))));
        }
        print_message("%.2g mm from the path\n", off);
        assert_true(off < 1e-4);
        move_file_close(&file);
    }
}

#define WATCH(tool)                                                            \
    "path:\n  axes: tool\n"                                                    \
    "  points: [[420, -340, 560], [360, -60, 420], [430, 260, 330]]\n"         \
    "  speed: {law: quintic, time: 9}\n  tool: " tool

/* The base turns by 70 deg from 322, and its limit is 360: it starts at -38. */
static void joints_start_where_their_limits_hold(void **state)
{
    static struct move_file file;

    (void)state;
    move_file_need(&file, ARM,
                   WATCH("{look: [760, 40, 60], near: [330, -90, 90, 180, 90, "
                         "0]}\n"));
    print_message("base from %.1f to %.1f deg\n",
                  move_file_pos(&file, "base", 0),
                  move_file_pos(&file, "base", 9));
    assert_true(move_file_pos(&file, "base", 0) < -10);
    assert_true(move_file_pos(&file, "base", 9) > 10);
    move_file_close(&file);
}

/* Also where its length is rounded. */
static void the_whole_of_a_path_is_on_it(void **state)
{
    static struct move_file file;

    (void)state;
    move_file_need(&file, ARM,
                   WATCH("{" START
                         ", look: {keys: [{at: 0 %, forward: [0.6, 0.5, -0.6]}"
                         ", {at: 100 %, forward: [0.8, 0, -0.6]}]}}\n"));
    move_file_close(&file);
}

static void what_cannot_be_is_refused(void **state)
{
    (void)state;
    move_file_refuse(ARM, PATH(""), "2:3: path has no 'tool'");
    move_file_refuse(ARM, PATH("  tool: {up: [0, 0, 1]}\n"),
                     "tool has no look, and no forward");
    move_file_refuse(ARM, PATH("  tool: {forward: [0, 0, 1]}\n"),
                     "tool has parallel forward and up");
    move_file_refuse(ARM, PATH("  tool: {look: [0, 0, 1], near: [0, 0]}\n"),
                     "near has 2 items");
    move_file_refuse(ARM,
                     "path:\n  axes: tool\n  points: [[420, -200, 300], [450, "
                     "200, 350]]\n  speed: fastest\n"
                     "  tool: {look: [9 m, 0, 0]}\n",
                     "speed is 'fastest', which is for a path of axes, and "
                     "this is one of the tool, expected a part of a speed law");
    move_file_refuse(RAIL, PATH("  tool: {look: [9 m, 0, 0]}\n"),
                     "is the tool of an arm with 7 joints, of which a path "
                     "determines 6: give 1 of them keys under axes");
    move_file_refuse(ARM, PATH("  tool: {look: {at: [0, 0, 1], ahead: 5}}\n"),
                     "look names 2 things to look at");
    move_file_refuse(ARM, PATH("  tool: {look: {table: [0, 0, 1]}}\n"),
                     "is on a turntable, and the rig's kinematics have none");
    move_file_refuse(ARM,
                     PATH("  tool: {forward: [0, 0, -1], up: [1, 0, 0], roll: "
                          "{keys: [[0, 0], [1, 1]]}}\n"),
                     "roll is not used without look");
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
        cmocka_unit_test(a_subject_that_moves_stays_in_the_middle),
        cmocka_unit_test(keys_turn_it_by_time),
        cmocka_unit_test(it_looks_along_the_path),
        cmocka_unit_test(every_look_of_a_path_is_one_of_a_tool),
        cmocka_unit_test(a_joint_with_keys_keeps_them),
        cmocka_unit_test(joints_start_where_their_limits_hold),
        cmocka_unit_test(the_whole_of_a_path_is_on_it),
        cmocka_unit_test(what_cannot_be_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
