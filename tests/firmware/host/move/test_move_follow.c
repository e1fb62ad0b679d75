/* tests/firmware/host/move/test_move_follow.c - cameras on the kinematics of a
 * rig, from the file to the tracks.
 *
 * Judged by motion/kinematics, in integers: at many times the axes give a
 * camera, and the subject is in the middle of what it sees. */
#include "motion/kinematics/rig.h"
#include "motion/plan/camera/plan_camera.h"
#include "tests/firmware/host/move/move_file.h"
#include "tests/motion/kinematics/rig_random.h"

#define SLIDER "examples/slider/rig.yaml"
#define ZOOM   "examples/dollyzoom/rig.yaml"
#define JIB    "examples/jib/rig.yaml"
#define TABLE  "examples/product/rig.yaml"
#define RAIL   "examples/timelapse/rig.yaml"
#define GANTRY "examples/orbit/rig.yaml"
#define POINTS "tests/data/rail/rig.yaml"
#define TEXT   4000
#define TIMES  997

/* Axes of the rig at a time, in the order of motion/kinematics/rig.h. */
static void axes_at(const struct move_file *file, double t_s, int64_t q32[])
{
    const struct plan_rig *rig = file->rig.kinematics;
    const uint32_t axes = motion_rig_axes(&rig->rig);

    for (uint32_t i = 0; i < axes; i++) {
        const struct plan_rig_axis *axis = i + MOTION_HEAD_AXES < axes
                                               ? &rig->carrier[i]
                                               : &rig->head[i + 3 - axes];
        q32[i] = axis->is_given
                     ? q32_of(move_file_pos(
                           file, file->rig.axis[axis->axis].name, t_s))
                     : 0;
    }
}

/* Degrees from the middle of the picture, and the distance. */
static double off_middle(const struct move_file *file, double t_s,
                         const double subject[3], double *far)
{
    const struct motion_dir back = { { 0, 0, -((int64_t)1 << 62) } };
    int64_t q32[MOTION_RIG_AXES_MAX];
    struct motion_camera camera;
    double view[3], to[3], dot = 0, cross = 0;

    axes_at(file, t_s, q32);
    assert_int_equal(
        motion_rig_camera(&file->rig.kinematics->rig, q32, &camera), MOTION_OK);
    const struct motion_dir forward = motion_quat_turn(camera.q, back);
    *far = 0;
    for (int i = 0; i < 3; i++) {
        view[i] = ldexp((double)forward.q62[i], -62);
        to[i] = subject[i] - number_of(camera.pupil.x[i]);
        dot += view[i] * to[i];
        *far += to[i] * to[i];
    }
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        cross += pow(view[j] * to[k] - view[k] * to[j], 2);
    }
    *far = sqrt(*far);
    return atan2(sqrt(cross), dot) * DEG;
}

static double end_of(const struct move_file *file, const char *axis)
{
    return (double)move_file_track(file, axis)->end_ns_q12 /
           (double)MOVE_FILE_S;
}

/* Keys at random for an axis; returns the text's end. */
static char *random_keys(char *at, const struct rig_axis *axis, int keys)
{
    static const char *const curve[] = { "quintic", "c2",     "s-curve",
                                         "linear",  "akima",  "monotone",
                                         "sine",    "rounded" };
    const double low = fmax(from_q32(axis->limit.pos_min_q32), -40),
                 high = fmin(from_q32(axis->limit.pos_max_q32), 900);

    at += sprintf(at, "  %s:\n    curve: %s\n    keys:\n", axis->name,
                  curve[draw() % 8]);
    for (int i = 0; i < keys; i++)
        at += sprintf(at, "      - [%.3f, %.4f]\n", 1.7 * i + uniform(0, 0.5),
                      low + (high - low) * (0.3 + uniform(0, 0.4)));
    return at;
}

static void random_move(const struct rig *rig, char *text, double subject[3])
{
    const struct plan_rig *kin = rig->kinematics;
    char *at = text + sprintf(text, "axes:\n");

    for (int i = 0; i < MOTION_CARRIER_AXES_MAX; i++)
        if (kin->carrier[i].is_given)
            at = random_keys(at, &rig->axis[kin->carrier[i].axis],
                             (int)(2 + draw() % 5));
    for (int i = 0; i < 3; i++)
        subject[i] = uniform(1000, 9000);
    sprintf(at, "camera:\n  look: {at: [%.6f, %.6f, %.6f]}\n%s", subject[0],
            subject[1], subject[2],
            kin->lens[PLAN_LENS_FOCUS].is_given ? "  focus: yes\n" : "");
}

static void a_subject_stays_in_the_middle(void **state)
{
    static const char *const rigs[] = {
        SLIDER, ZOOM, JIB, RAIL, GANTRY, POINTS
    };
    static struct move_file file;
    double worst = 0, off_focus = 0, bound = 0;

    (void)state;
    seed_from("a_subject_stays_in_the_middle");
    for (int n = 0; n < 60; n++) {
        const char *const path = rigs[n % 6];
        char text[TEXT], message[YAML_MESSAGE_MAX];
        struct rig rig = { .bus_count = 0 };
        double subject[3], far;
        assert_int_equal(rig_load(&disk_files, path, &rig, message), 0);
        random_move(&rig, text, subject);
        rig_free(&rig);
        move_file_need(&file, path, text);
        const double end = end_of(&file, "pan");
        for (int i = 0; i <= TIMES; i++) {
            const double t = end * i / TIMES;
            worst = fmax(worst, off_middle(&file, t, subject, &far));
            if (file.move.camera->following.has_lens[PLAN_LENS_FOCUS])
                off_focus = fmax(off_focus,
                                 fabs(move_file_pos(&file, "focus", t) - far));
        }
        for (int i = 0; i < 2; i++)
            bound = fmax(bound, from_q32(file.outcome.camera_bound_q32[i]));
        move_file_close(&file);
    }
    print_message("worst: %.2g deg, bound %.2g deg, focus %.2g mm\n", worst,
                  bound, off_focus);
    assert_true(bound <= 1e-5);
    assert_true(worst < 1.5e-5); /* pan and tilt together */
    assert_true(off_focus < 1e-4);
}

#define CAMERA "camera:\n  look: {at: [700 mm, 1500 mm, 1250 mm]}\n"
#define SLIDE  "axes: {slide: {keys: [[0, 0], [8, 1200]]}}\n"

static void a_moving_subject_is_followed_by_a_still_rig(void **state)
{
    static struct move_file file;
    const double first[3] = { 2000, 4000, 1500 }, last[3] = { -500, 3000, 900 };
    double far;

    (void)state;
    move_file_need(&file, SLIDER,
                   "axes: {slide: {keys: [[0, 300]]}}\n"
                   "camera: {look: {subject: {curve: s-curve, keys: [[0, "
                   "[2000, 4000, 1500]], [5, [-500, 3000, 900]]]}}, focus: "
                   "yes}\n");
    assert_true(off_middle(&file, 0, first, &far) < 1.5e-5);
    assert_true(off_middle(&file, 5, last, &far) < 1.5e-5);
    assert_true(fabs(move_file_pos(&file, "focus", 5) - far) < 1e-4);
    assert_true(fabs(end_of(&file, "pan") - 5) < 1e-9);
    move_file_close(&file);
}

static void zoom_keeps_the_size(void **state)
{
    static struct move_file file;
    const double subject[3] = { 5000, 300, 1600 };
    double far, at_three;

    (void)state;
    move_file_need(&file, ZOOM,
                   "axes: {dolly: {keys: [[0, 0], [9, 3500]]}}\n"
                   "camera: {look: {at: [5000, 300, 1600]}, zoom: {focal: 60 "
                   "mm, at: 3 s}}\n");
    (void)off_middle(&file, 3, subject, &at_three);
    assert_true(fabs(move_file_pos(&file, "zoom", 3) - 60) < 1e-4);
    for (int i = 0; i <= TIMES; i++) {
        const double t = 9.0 * i / TIMES;
        (void)off_middle(&file, t, subject, &far);
        if (fabs(move_file_pos(&file, "zoom", t) - 60 * far / at_three) > 1e-4)
            fail_msg("%.3f s: %.6f mm", t, move_file_pos(&file, "zoom", t));
    }
    move_file_close(&file);
}

/* Once round and on: pan and table count turns. */
static void pan_goes_on_over_half_turns(void **state)
{
    static struct move_file file;
    double last = 0;

    (void)state;
    move_file_need(&file, SLIDER,
                   "axes: {slide: {keys: [[0, 500]]}}\n"
                   "camera: {look: {subject: {keys: [[0, [500, 3000, 1100]], "
                   "[1, [-2500, 0, 1100]], [2, [500, -3000, 1100]], [3, [3500, "
                   "0, 1100]], [4, [500, 3000, 1100]]]}}}\n");
    for (int i = 0; i <= TIMES; i++) {
        const double pan = move_file_pos(&file, "pan", 4.0 * i / TIMES);
        assert_true(fabs(pan - last) < 10);
        last = pan;
    }
    assert_true(fabs(last - 360) < 1e-3);
    move_file_close(&file);
}

static const struct {
    const char *rig, *text, *want;
} wrong[] = {
    { SLIDER, CAMERA,
      "2:3: camera is carried by the axis 'slide', which the move does not "
      "drive" },
    { SLIDER, SLIDE "camera: {look: {along: level}}\n",
      "2:16: look has along, which is not used with the rig's kinematics" },
    { SLIDER,
      SLIDE "camera: {axes: {pan: pan, tilt: tilt}, look: {at: [1, 2, "
            "3]}}\n",
      "2:9: camera has axes, which are those of the head" },
    { SLIDER, SLIDE "camera: {forward: [1, 0, 0], look: {at: [1, 2, 3]}}\n",
      "2:19: forward is of the head in the rig's kinematics" },
    { SLIDER, SLIDE "camera: {look: {at: [1, 2, 3]}, roll: {keys: [[0, 1]]}}\n",
      "2:39: roll has no axis: the head in the rig's kinematics does not "
      "roll" },
    { SLIDER, SLIDE "camera: {look: {table: [1, 2, 3]}}\n",
      "2:24: table is on a turntable, and the rig's kinematics have none" },
    { SLIDER, SLIDE "camera: {look: {at: [1, 2, 3]}, zoom: {focal: 3}}\n",
      "2:39: zoom has no axis under lens" },
    { SLIDER,
      SLIDE "camera: {look: {subject: {curve: hermite, keys: [[0, [1, "
            "2, 3]]]}}}\n",
      "2:34: curve 'hermite' has keys with velocities or handles" },
    { SLIDER,
      SLIDE "camera: {look: {subject: {keys: [[1, [1, 2, 3]], [1, [1, "
            "2, 4]]]}}}\n",
      "is not later than the one before" },
    { SLIDER,
      "axes: {slide: {keys: [[0, 5]]}}\ncamera: {look: {at: [1, 2, 3]}}\n",
      "2:9: the camera follows nothing: neither its rig nor its subject "
      "moves" },
    { "examples/flyby/rig.yaml",
      "camera: {axes: {pan: pan, tilt: tilt}, look: {subject: {keys: [[0, [1, "
      "2, 3]]]}}}\n",
      "1:9: camera has no path to go on" },
    /* the slide passes below it, within the nodal offset and exactly */
    { SLIDER, SLIDE "camera: {look: {at: [600, 0, 1140]}}\n",
      "the subject is nearer than the entrance pupil goes round the head" },
    { RAIL,
      "axes: {rail: {keys: [[0, 0], [8, 1200]]}}\n"
      "camera: {look: {at: [0, -3000, 2000]}}\n",
      "2:16: at 0.000 s the subject is in the camera or on the axis of pan" },
    { JIB,
      "axes: {extend: {keys: [[0, 0]]}, boom_pan: {keys: [[0, 0], [9, 10]]}, "
      "boom_tilt: {keys: [[0, 0], "
      "[10, 100]]}}\ncamera: {look: {at: [5000, 0, 1000]}}\n",
      "s the boom is beyond its extension, or beyond the vertical" },
    { JIB,
      "axes: {extend: {keys: [[0, 0]]}, boom_pan: {keys: [[0, 0], [9, 10]]}, "
      "boom_tilt: {keys: [[0, "
      "0]]}}\ncamera: {look: {keys: [{t: 0, angles: [0, 0, 0]}, {t: 1, angles: "
      "[1, 0, 0]}]}}\n",
      "camera has keys of look on a head whose mount turns" },
};

static void what_cannot_be_followed_is_refused(void **state)
{
    static struct move_file file;
    unsigned others = 0;

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(wrong); i++)
        if (move_file_open(&file, wrong[i].rig, wrong[i].text) == 0 ||
            strstr(file.message, wrong[i].want) == NULL) {
            print_error("got  %s\nwant %s\n", file.message, wrong[i].want);
            others++;
        }
    assert_int_equal(others, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_subject_stays_in_the_middle),
        cmocka_unit_test(a_moving_subject_is_followed_by_a_still_rig),
        cmocka_unit_test(zoom_keeps_the_size),
        cmocka_unit_test(pan_goes_on_over_half_turns),
        cmocka_unit_test(what_cannot_be_followed_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
