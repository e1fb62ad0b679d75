/* tests/firmware/host/move/test_move_orient.c - heads that turn through keyed
 * orientations, from the file to the tracks.
 *
 * Judged by forward kinematics in doubles: pan about up, tilt about right, roll
 * about the view, against rotations by Rodrigues' formula. */
#include "tests/firmware/host/move/move_file.h"

#define RIG "examples/flyby/rig.yaml"
#define DEG (acos(-1) / 180)

#define HEAD                                                                   \
    "camera:\n  axes: {pan: pan, tilt: tilt, roll: roll}\n  look:\n    "       \
    "keys:\n"
#define KEYS "camera:\n  axes: {pan: pan, tilt: tilt}\n  look:\n    keys:\n"

#define PATH                                                                   \
    "path:\n  axes: [x, y, z]\n"                                               \
    "  points: [[0, 0, 0], [1000, 0, 0], [2000, 0, 0]]\n"                      \
    "  speed: {law: quintic, time: 10 s}\n"

static void turn(double v[3], const double axis[3], double angle)
{
    const double c = cos(angle), s = sin(angle);
    const double dot = v[0] * axis[0] + v[1] * axis[1] + v[2] * axis[2];
    const double cross[3] = { axis[1] * v[2] - axis[2] * v[1],
                              axis[2] * v[0] - axis[0] * v[2],
                              axis[0] * v[1] - axis[1] * v[0] };

    for (int i = 0; i < 3; i++)
        v[i] = v[i] * c + cross[i] * s + axis[i] * dot * (1 - c);
}

struct seen {
    double view[3], right[3], up[3];
};

static const struct seen forward = { { 1, 0, 0 }, { 0, -1, 0 }, { 0, 0, 1 } };

static struct seen look(const struct move_file *file, double t_s)
{
    static const double z[3] = { 0, 0, 1 };
    struct seen s = forward;
    const double pan = move_file_pos(file, "pan", t_s) * DEG;
    const double tilt = move_file_pos(file, "tilt", t_s) * DEG;
    const double roll = move_file_pos(file, "roll", t_s) * DEG;

    turn(s.view, z, pan);
    turn(s.right, z, pan);
    turn(s.view, s.right, tilt);
    turn(s.up, s.right, tilt);
    turn(s.right, s.view, roll);
    turn(s.up, s.view, roll);
    return s;
}

static double apart(const double a[3], const double b[3])
{
    return hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]);
}

/* The larger angle between two of the directions, degrees. */
static double between(const struct seen *a, const struct seen *b)
{
    return fmax(fmax(apart(a->view, b->view), apart(a->right, b->right)),
                apart(a->up, b->up)) /
           DEG;
}

/* The whole frame about one axis. */
static struct seen turned(struct seen s, const double axis[3], double angle)
{
    turn(s.view, axis, angle);
    turn(s.right, axis, angle);
    turn(s.up, axis, angle);
    return s;
}

static double eased(double x)
{
    return x * x * x * (10 + x * (6 * x - 15));
}

static double bound(const struct move_file *file)
{
    double sum = 0;

    for (int i = 0; i < 3; i++)
        sum += ldexp((double)file->outcome.camera_bound_q32[i], -32);
    assert_true(sum > 0 && sum <= 3e-5);
    return sum + 1e-9;
}

/* From forward about an oblique axis: all three angles move. */
static void a_great_arc_is_followed_within_the_bound(void **state)
{
    static struct move_file file;
    const double n = sqrt(0.3 * 0.3 + 0.5 * 0.5 + 0.8 * 0.8);
    const double axis[3] = { 0.3 / n, -0.5 / n, 0.8 / n };
    const struct seen end = turned(forward, axis, 70 * DEG);
    char text[600];
    double worst = 0;
    (void)state;
    snprintf(text, sizeof text,
             HEAD "      - {t: 1 s, forward: [1, 0, 0]}\n"
                  "      - {t: 5 s, forward: [%.9f, %.9f, %.9f],"
                  " up: [%.9f, %.9f, %.9f]}\n"
                  "    curve: slerp\n",
             end.view[0], end.view[1], end.view[2], end.up[0], end.up[1],
             end.up[2]);
    move_file_need(&file, RIG, text);
    for (int i = 0; i <= 5000; i++) {
        const double t = i / 1000.0, x = t < 1 ? 0 : (t - 1) / 4;
        const struct seen want = turned(forward, axis, 70 * DEG * eased(x));
        const struct seen got = look(&file, t);
        worst = fmax(worst, between(&got, &want));
    }
    print_message("within %.1e of %.1e deg\n", worst, bound(&file));
    /* the file's plain numbers have steps of 2^-32 */
    assert_true(worst < bound(&file) + 1e-7);
    move_file_close(&file);
}

/* One axis alone is its angle over time, whole turns included. */
static void angles_of_one_axis_are_its_eased_keys(void **state)
{
    static struct move_file file;
    (void)state;
    move_file_need(&file, RIG,
                   KEYS "      - {t: 0 s, angles: [200 deg, 10 deg]}\n"
                        "      - {t: 4 s, angles: [110 deg, 10 deg]}\n"
                        "      - {t: 8 s, angles: [250 deg, 10 deg]}\n"
                        "    curve: slerp\n"
                        "  forward: [0, 1, 0]\n");
    for (int i = 0; i <= 2; i++) {
        static const double want[3] = { 200, 110, 250 };
        assert_true(fabs(move_file_pos(&file, "pan", 4 * i) - want[i]) < 2e-5);
        assert_true(fabs(move_file_pos(&file, "tilt", 4 * i) - 10) < 2e-5);
    }
    move_file_close(&file);
    move_file_need(&file, RIG,
                   KEYS "      - {t: 0 s, angles: [-350 deg, 0 deg]}\n"
                        "      - {t: 4 s, angles: [80 deg, 0 deg]}\n"
                        "    curve: slerp\n");
    for (int i = 0; i <= 400; i++) /* the shorter way, from where it stands */
        assert_true(fabs(move_file_pos(&file, "pan", i / 100.0) + 350 -
                         70 * eased(i / 400.0)) < 2e-5);
    move_file_close(&file);
}

/* All ways to write an orientation are one. */
static void a_quaternion_a_direction_and_angles_agree(void **state)
{
    static struct move_file file;
    (void)state;
    /* pan 90: forward is +y, and the mount's frame turned about z */
    move_file_need(&file, RIG,
                   HEAD
                   "      - {t: 0 s, angles: [90 deg, 0 deg, 0 deg]}\n"
                   "      - {t: 2 s, forward: [0, 5, 0]}\n"
                   "      - {t: 4 s, forward: [0, 1, 0], up: [0, 0.5, 0.5]}\n"
                   "      - {t: 6 s, quaternion: [2, 2, 0, 0]}\n");
    for (int i = 0; i <= 60; i++) {
        const struct seen want = { { 0, 1, 0 }, { 1, 0, 0 }, { 0, 0, 1 } };
        const struct seen got = look(&file, i / 10.0);
        assert_true(between(&got, &want) < 1e-6);
    }
    move_file_close(&file);
}

/* Places on the path: the angle follows the distance. */
static void keys_along_a_path_follow_its_distance(void **state)
{
    static struct move_file file;
    double worst = 0;
    (void)state;
    move_file_need(&file, RIG,
                   PATH KEYS "      - {at: 500 mm, angles: [0 deg, 0 deg]}\n"
                             "      - {at: 75 %, angles: [0 deg, 40 deg]}\n"
                             "    curve: slerp\n");
    for (int i = 0; i <= 1000; i++) {
        const double x = move_file_pos(&file, "x", i / 100.0);
        const double part = fmin(1, fmax(0, (x - 500) / 1000));
        worst = fmax(worst, fabs(move_file_pos(&file, "tilt", i / 100.0) -
                                 40 * eased(part)));
    }
    print_message("within %.1e deg\n", worst);
    assert_true(worst < 2e-5);
    move_file_close(&file);
}

/* The default curve has no step that a limit of jerk would forbid. */
static void c2_keys_keep_limits_and_have_no_steps(void **state)
{
    static const char *const axes[] = { "pan", "tilt", "roll" };
    static struct move_file file;
    (void)state;
    move_file_need(&file, RIG,
                   HEAD "      - {t: 0 s, angles: [0 deg, 0 deg, 0 deg]}\n"
                        "      - {t: 3 s, angles: [40 deg, 15 deg, -5 deg]}\n"
                        "      - {t: 5 s, angles: [60 deg, -10 deg, 4 deg]}\n"
                        "      - {t: 9 s, angles: [20 deg, 5 deg, 0 deg]}\n");
    for (int i = 0; i < 3; i++) {
        const struct plan_limit limit = {
            -((int64_t)1 << 60), (int64_t)1 << 60,   (int64_t)60 << 32,
            (int64_t)60 << 32,   (int64_t)300 << 32, 0
        };
        struct plan_violation found;
        if (plan_check_track(move_file_track(&file, axes[i]), &limit, &found,
                             1) != 0)
            fail_msg("%s: %d at %g s", axes[i], found.kind,
                     (double)found.t_ns_q12 / (double)MOVE_FILE_S);
    }
    move_file_close(&file);
}

/* Straight through the vertical in one plane: only the tilt moves. */
static void straight_up_is_passed_by_tilting_on(void **state)
{
    static struct move_file file;
    (void)state;
    move_file_need(&file, RIG,
                   HEAD
                   "      - {t: 0 s, angles: [30 deg, 60 deg, 0 deg]}\n"
                   "      - {t: 3 s, forward: [0, 0, 1], up: [-0.866025404,"
                   " -0.5, 0]}\n"
                   "      - {t: 6 s, angles: [30 deg, 120 deg, 0 deg]}\n");
    for (int i = 0; i <= 600; i++) {
        assert_true(fabs(move_file_pos(&file, "pan", i / 100.0) - 30) < 1e-4);
        assert_true(fabs(move_file_pos(&file, "roll", i / 100.0)) < 1e-4);
    }
    assert_true(fabs(move_file_pos(&file, "tilt", 3) - 90) < 1e-4);
    assert_true(fabs(move_file_pos(&file, "tilt", 6) - 120) < 1e-4);
    move_file_close(&file);
}

static void what_cannot_be_turned_is_refused(void **state)
{
    static const struct {
        const char *text, *message;
    } rows[] = {
        { KEYS "      - {t: 0 s, angles: [0 deg, 0 deg]}\n",
          "5:7: keys has 1 item" },
        { KEYS "      - {t: 0 s}\n      - {t: 1 s}\n",
          "5:9: orientation gives not just one of angles, quaternion and "
          "forward" },
        { KEYS "      - {t: 0 s, angles: [0, 0], forward: [1, 0, 0]}\n"
               "      - {t: 1 s}\n",
          "5:9: orientation gives not just one of angles" },
        { KEYS "      - {t: 0 s, angels: [0, 0]}\n      - {t: 1 s}\n",
          "5:18: unknown key 'angels'" },
        { KEYS "      - {angles: [0, 0]}\n      - {t: 1 s}\n",
          "5:9: orientation gives not just one of t and at" },
        { KEYS "      - {at: 5 %, angles: [0, 0]}\n      - {t: 1 s}\n",
          "is a place on a path, and the move has none" },
        { KEYS "      - {t: -1 s, angles: [0, 0]}\n      - {t: 1 s}\n",
          "t '-1 s' is before the start of the move" },
        { KEYS "      - {t: 1 s, angles: [0, 0]}\n"
               "      - {t: 1 s, angles: [1, 0]}\n",
          "6:9: orientation 2 is not later than the one before it" },
        { KEYS "      - {t: 1 s, angles: [0, 0]}\n"
               "      - {t: 1.0005 s, angles: [1, 0]}\n",
          "6:9: orientation 2 is less than 1 ms after the one before" },
        { KEYS "      - {t: 1 s, angles: [0, 0]}\n"
               "      - {t: 300000 s, angles: [1, 0]}\n",
          "6:9: orientation 2 is later than the longest segment lasts" },
        { KEYS "      - {t: 0 s, quaternion: [0, 0, 0, 0]}\n      - {t: 1 s}\n",
          "quaternion is no rotation" },
        { KEYS "      - {t: 0 s, quaternion: [1, 0, 0]}\n      - {t: 1 s}\n",
          "quaternion has 3 items" },
        { KEYS "      - {t: 0 s, forward: [0, 0, 1]}\n      - {t: 1 s}\n",
          "5:9: orientation has parallel forward and up" },
        { KEYS "      - {t: 0 s, angles: [0, 0], up: [0, 0, 1]}\n"
               "      - {t: 1 s}\n",
          "orientation gives up without forward" },
        { KEYS "      - {t: 0 s, angles: [2000000 deg, 0]}\n      - {t: 1 s}\n",
          "is beyond 1000000 deg" },
        { KEYS "      - {t: 0 s, angles: [0, 0]}\n"
               "      - {t: 4 s, angles: [20 deg, 0 deg, 5 deg]}\n",
          "2:3: the camera rolls by 5 deg at 4.000 s, but has no roll axis" },
        { KEYS "      - {t: 0 s, angles: [0, 0]}\n"
               "      - {t: 4 s, angles: [20 deg, 0 deg]}\n    curve: c4\n",
          "curve 'c4'" },
        { KEYS "      - {t: 0 s, angles: [0, 0]}\n"
               "      - {t: 4 s, angles: [20 deg, 0 deg]}\n"
               "    at: [0, 0, 0]\n",
          "look names 2 things to look at" },
        { KEYS "      - {t: 0 s, angles: [0, 0]}\n"
               "      - {t: 4 s, angles: [20 deg, 0 deg]}\n"
               "  roll: {keys: [[0 s, 0 deg], [1 s, 1 deg]]}\n",
          "roll is not used with keys of look, which roll" },
        { "camera:\n  axes: {pan: pan, tilt: tilt}\n  look: {at: [0, 0, 0]}\n",
          "camera has no path to go on" },
        { PATH KEYS "      - {at: 10 %, angles: [0, 0]}\n"
                    "      - {at: 100 mm, angles: [1 deg, 0]}\n",
          "10:9: orientation 2 is not further along the path than the one "
          "before it" },
        { PATH KEYS "      - {at: 10 %, angles: [0, 0]}\n"
                    "      - {at: 2001 mm, angles: [1 deg, 0]}\n",
          "10:9: orientation 2 is beyond the end of the path" },
        { PATH KEYS "      - {at: 10 %, angles: [0, 0]}\n"
                    "      - {t: 2 s, angles: [1 deg, 0]}\n",
          "10:9: orientation gives t, and the first one at" },
        /* 0.001 deg beside straight up */
        { HEAD "      - {t: 0 s, angles: [0, 60 deg, 0]}\n"
               "      - {t: 4 s, forward: [-0.00001, 0.00001, 1],"
               " up: [-1, 0, 0]}\n"
               "      - {t: 8 s, angles: [180 deg, 60 deg, 0]}\n",
          "the camera turns past straight up or down faster than pan and roll "
          "can follow" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        move_file_refuse(RIG, rows[i].text, rows[i].message);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_great_arc_is_followed_within_the_bound),
        cmocka_unit_test(angles_of_one_axis_are_its_eased_keys),
        cmocka_unit_test(a_quaternion_a_direction_and_angles_agree),
        cmocka_unit_test(keys_along_a_path_follow_its_distance),
        cmocka_unit_test(c2_keys_keep_limits_and_have_no_steps),
        cmocka_unit_test(straight_up_is_passed_by_tilting_on),
        cmocka_unit_test(what_cannot_be_turned_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
