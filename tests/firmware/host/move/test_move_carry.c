/* tests/firmware/host/move/test_move_carry.c - a head on a path through space:
 * where the axes put it by motion/kinematics, in integers, is where the path is
 * at that time. */
#include "motion/plan/camera/plan_camera.h"
#include "tests/firmware/host/move/move_file.h"
#include "tests/motion/kinematics/rig_random.h"

#define SLIDER "examples/slider/rig.yaml"
#define JIB    "examples/jib/rig.yaml"
#define RAIL   "examples/timelapse/rig.yaml"
#define GANTRY "examples/orbit/rig.yaml"
#define TIMES  997

/* mm between the pivot and the path. */
static double off_path(const struct move_file *file, double t_s)
{
    const struct motion_carrier *carrier = &file->rig.kinematics->rig.carrier;
    const int64_t t = (int64_t)(t_s * (double)MOVE_FILE_S);
    int64_t axis_q32[MOTION_CARRIER_AXES_MAX] = { 0 };
    struct motion_mount mount;
    struct motion_state distance;
    struct motion_vec at;
    double sum = 0;

    for (int i = 0; i < MOTION_CARRIER_AXES_MAX; i++) {
        const struct plan_rig_axis *axis = &file->rig.kinematics->carrier[i];
        if (axis->is_given)
            axis_q32[i] =
                move_file_at(file, file->rig.axis[axis->axis].name, t).pos_q32;
    }
    assert_int_equal(carrier->kind->place(carrier, axis_q32, &mount),
                     MOTION_OK);
    motion_track_state(&file->outcome.distance, t, &distance);
    assert_int_equal(
        plan_space_at(&file->outcome.drive.space, distance.pos_q32, &at, NULL),
        MOTION_OK);
    for (int i = 0; i < 3; i++)
        sum += pow(number_of(mount.pivot.x[i]) - number_of(at.x[i]), 2);
    return sqrt(sum);
}

static double worst_of(const struct move_file *file, double end_s)
{
    double worst = 0;

    for (int i = 0; i <= TIMES; i++)
        worst = fmax(worst, off_path(file, end_s * i / TIMES));
    return worst;
}

/* Five points in a shell before the jib, or in a box. */
static void random_path(const char *rig, char *text)
{
    static const char *const curve[] = { "c2", "quintic", "akima",
                                         "catmull-rom", "b-spline" };
    char *at =
        text + sprintf(text, "path:\n  axes: head\n  curve: %s\n  points:\n",
                       curve[draw() % 5]);

    for (int i = 0; i < 5; i++) {
        const double pan = uniform(-0.3, 0.3) + 0.5 * i,
                     tilt = uniform(-0.2, 0.5), far = uniform(3000, 3600);
        const double point[2][3] = {
            { far * cos(pan) * cos(tilt), far * sin(pan) * cos(tilt),
              950 + far * sin(tilt) },
            { uniform(100, 5900), uniform(-1700, 1700), uniform(600, 2400) },
        };
        const double *p = point[strcmp(rig, GANTRY) == 0];
        at += sprintf(at, "    - [%.6f, %.6f, %.6f]\n", p[0], p[1], p[2]);
    }
    sprintf(at, "  speed: {law: quintic, time: 20 s}\n");
}

static void a_head_is_where_its_path_is(void **state)
{
    static struct move_file file;
    double worst = 0;
    unsigned gone = 0;

    (void)state;
    seed_from("a_head_is_where_its_path_is");
    for (int n = 0; n < 40; n++) {
        const char *const rig = n % 2 == 0 ? JIB : GANTRY;
        char text[2000];
        random_path(rig, text);
        if (move_file_open(&file, rig, text) < 0) {
            if (strstr(file.message, "the path is out of reach") == NULL)
                fail_msg("%s\n%s", file.message, text);
            continue;
        }
        gone++;
        worst = fmax(worst, worst_of(&file, 20));
        move_file_close(&file);
    }
    print_message("%u of 40 paths, worst: %.2g mm\n", gone, worst);
    assert_true(gone >= 30);
    assert_true(worst < 2e-4); /* 1e-6 deg of a boom of 4 m, and mm */
}

static void rails_go_along_paths_that_are_theirs(void **state)
{
    static struct move_file file;

    (void)state;
    move_file_need(&file, SLIDER,
                   "path:\n  axes: head\n  curve: linear\n  points: [[100, 0, "
                   "1100], [1100, 0, 1100]]\n  speed: {law: quintic, time: 6 "
                   "s}\ncamera: {look: {at: [600, 2000, 1500]}, focus: yes}\n");
    assert_true(worst_of(&file, 6) < 1e-5);
    assert_true(fabs(move_file_pos(&file, "slide", 6) - 1100) < 1e-6);
    assert_true(fabs(move_file_pos(&file, "slide", 3) - 600) < 1e-5);
    move_file_close(&file);
}

static const struct {
    const char *rig, *path, *want;
} wrong[] = {
    { SLIDER, "[[100, 0, 1100], [1100, 1, 1100]]",
      "s the path is out of reach of what carries the head" },
    { JIB, "[[3000, 0, 1000], [9000, 0, 1000]]",
      "s the path is out of reach of what carries the head" },
    { RAIL, "[[100, 0, 1100], [1100, 0, 1100]]",
      "at 0.000 s the path is out of reach of what carries the head" },
    { "examples/flyby/rig.yaml", "[[100, 0, 1100], [1100, 0, 1100]]",
      "1:14: axes is 'head', which a rig without kinematics lacks" },
};

static void what_is_out_of_reach_is_refused(void **state)
{
    static struct move_file file;
    unsigned others = 0;

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(wrong); i++) {
        char text[400];
        sprintf(text,
                "path: {axes: head, curve: linear, points: %s, speed: {law: "
                "quintic, time: 6 s}}\n",
                wrong[i].path);
        if (move_file_open(&file, wrong[i].rig, text) == 0 ||
            strstr(file.message, wrong[i].want) == NULL) {
            print_error("got  %s\nwant %s\n", file.message, wrong[i].want);
            others++;
        }
    }
    assert_int_equal(others, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_head_is_where_its_path_is),
        cmocka_unit_test(rails_go_along_paths_that_are_theirs),
        cmocka_unit_test(what_is_out_of_reach_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
