/* tests/firmware/host/rig/kinematics/test_rig_kinematics.c - kinematics of rig.yaml, right
 * and wrong. */
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/rig/rig.h"
#include "firmware/linux/base/disk.h"
#include "tests/motion/kinematics/rig_random.h"

#define AXIS(name, unit, node)                                                 \
    "  " name ": {unit: " unit ", limits: {position: [-100, 900], velocity: "  \
    "90, acceleration: 90}, following_error: {floor: 1}, drive: {kind: "       \
    "cia402, bus: can0, node: " node ", counts: 1000 per " unit "}}\n"
/* `kinematics:` is line 10. */
static const char axes[] =
    "buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "axes:\n" AXIS("a", "mm", "1") AXIS("b", "mm", "2") AXIS("c", "mm", "3")
        AXIS("d", "mm", "4") AXIS("pan", "deg", "5") AXIS("tilt", "deg", "6")
            AXIS("turn", "deg", "7");
#define HEAD "  head: {pan: {axis: pan}, tilt: {axis: tilt}}\n"

static int load(struct rig *rig, const char *text,
                char message[YAML_MESSAGE_MAX])
{
    char path[] = "/tmp/rig_kinematics_XXXXXX";
    const int file = mkstemp(path);

    if (file < 0 || write(file, axes, strlen(axes)) < 0 ||
        write(file, "kinematics:\n", 12) < 0 ||
        write(file, text, strlen(text)) < 0 || close(file) < 0)
        fail_msg("no file %s", path);
    const int err = rig_load(&disk_files, path, rig, message);
    remove(path);
    if (err < 0)
        memmove(message, message + strlen(path) + 1,
                strlen(message + strlen(path) + 1) + 1);
    return err;
}

static const struct {
    const char *text, *want; /* how the message begins */
} wrong[] = {
    { "  linear: {axes: [{axis: a, direction: [1, 0, 0]}]}\n",
      "11:3: kinematics has no 'head'" },
    { HEAD "  linear: {axes: [{axis: a, direction: [1, 0, 0]}]}\n"
           "  arc: {centre: [0, 0, 0], radius: 1 m, axis: {axis: b}}\n",
      "11:3: kinematics has 2 things that carry the head" },
    { "  head: {pan: {axis: pan}, tilt: {axis: pan}}\n",
      "11:41: axis 'pan' is in the kinematics already" },
    { "  head: {pan: {axis: a}, tilt: {axis: tilt}}\n",
      "11:22: axis 'a' is in mm, not in deg" },
    { "  head: {pan: {axis: pam}, tilt: {axis: tilt}}\n",
      "11:22: unknown axis 'pam'" },
    { "  head: {pan: {axis: pan}, tilt: {axis: tilt}, forward: [0, 0, 2]}\n",
      "11:9: head has parallel forward and up" },
    { "  head: {pan: {axis: pan}, tilt: {axis: tilt}, forward: [0, 0, 0]}\n",
      "11:57: forward has no direction" },
    { HEAD "  linear: {axes: [{axis: a, direction: [1, 1, 0]}, {axis: b, "
           "direction: [-2, -2, 0]}]}\n",
      "12:11: linear has linearly dependent axes" },
    { HEAD "  linear: {axes: [{axis: a, direction: [1, 0, 0]}, {axis: b, "
           "direction: [0, 1, 0]}, {axis: c, direction: [3, -5, 0]}]}\n",
      "12:11: linear has linearly dependent axes" },
    { HEAD "  linear: {axes: [{axis: a}]}\n",
      "12:19: slide has no 'direction'" },
    { HEAD "  linear: {axes: [{axis: a, direction: [1, 0]}]}\n",
      "12:40: direction has 2 items" },
    { HEAD "  arc: {centre: [0, 0, 0], radius: 0 mm, axis: {axis: b}}\n",
      "12:36: radius '0 mm' is not above zero" },
    { HEAD "  arc: {centre: [0, 0, 0], radius: 1 m, start: [0, 0, 1], axis: "
           "{axis: b}}\n",
      "12:8: arc has parallel normal and start" },
    { HEAD "  rail: {points: [[0, 0, 0]], axis: {axis: b}}\n",
      "12:18: points has 1 item" },
    { HEAD "  rail: {points: [[0, 0, 0], [2 m, 0, 0], [2 m, 0, 0]], axis: "
           "{axis: b, offset: 100}}\n",
      "12:9: rail has no curve through its points" },
    { HEAD "  rail: {points: [[0, 0, 0], [900, 0, 0]], axis: {axis: b, offset: "
           "100}}\n",
      "12:9: rail is 900.000 mm long, and the limits of 'b' let it go from "
      "0.000 mm to 1000.000 mm along it" },
    { HEAD "  rail: {points: [[0, 0, 0], [2 m, 0, 0]], axis: {axis: b}}\n",
      "12:9: rail is 2000.000 mm long, and the limits of 'b' let it go from "
      "-100.000 mm" },
    { HEAD "  rail: {points: [[0, 0, 0], [0, 0, 2 m]], axis: {axis: b, offset: "
           "100}}\n",
      "12:9: rail goes straight up" },
    { HEAD "  gantry: {rails: [1 m, 1 m], x1: {axis: a}, x2: {axis: b}, y: "
           "{axis: c}, z: {axis: d}}\n",
      "12:19: rails are at the same place" },
    { HEAD "  jib: {foot: [0, 0, 0], length: 2 m, mount: hanging, pan: {axis: "
           "turn}, tilt: {axis: turn}}\n",
      "12:46: unknown mount 'hanging'" },
    { HEAD "  arm: {joints: [{axis: turn}]}\n",
      "11:3: kinematics has a head beside an arm" },
    { "  arm: {joints: []}\n", "11:17: joints has 0 items" },
    { "  arm: {joints: [{axis: turn}, {axis: a}, {axis: turn}]}\n",
      "11:50: axis 'turn' is in the kinematics already" },
    { "  arm: {joints: [{axis: turn, a: 3 deg}]}\n",
      "11:34: a '3 deg' is an angle" },
    { "  arm: {joints: [{axis: turn}], tool: {view: [0, 1, 0]}}\n",
      "11:39: tool has parallel view and up" },
    { HEAD "  lens: {focus: turn}\n", "12:17: focus 'turn' is in deg" },
};

static void what_makes_no_sense_is_refused(void **state)
{
    unsigned others = 0;

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(wrong); i++) {
        struct rig rig = { .bus_count = 0 };
        char message[YAML_MESSAGE_MAX] = "nothing";
        if (load(&rig, wrong[i].text, message) == 0 ||
            strncmp(message, wrong[i].want, strlen(wrong[i].want)) != 0) {
            print_error("got  %s\nwant %s\n", message, wrong[i].want);
            others++;
        }
        rig_free(&rig);
    }
    assert_int_equal(others, 0);
}

static const struct plan_rig *read_rig(struct rig *rig, const char *text)
{
    char message[YAML_MESSAGE_MAX];

    *rig = (struct rig){ .bus_count = 0 };
    if (load(rig, text, message) < 0)
        fail_msg("%s", message);
    assert_non_null(rig->kinematics);
    return rig->kinematics;
}

static void expect_pupil(const struct plan_rig *rig, const double axis[],
                         double x, double y, double z)
{
    int64_t axis_q32[MOTION_RIG_AXES_MAX] = { 0 };
    struct motion_camera camera;
    const double want[3] = { x, y, z };

    for (uint32_t i = 0; i < motion_rig_axes(&rig->rig); i++)
        axis_q32[i] = q32_of(axis[i]);
    assert_int_equal(motion_rig_camera(&rig->rig, axis_q32, &camera),
                     MOTION_OK);
    for (int i = 0; i < 3; i++)
        if (fabs(number_of(camera.pupil.x[i]) - want[i]) > 1e-6)
            fail_msg("%d: %.9f, not %.9f", i, number_of(camera.pupil.x[i]),
                     want[i]);
}

/* Places by hand. */
static void cameras_are_where_the_file_has_them(void **state)
{
    struct rig rig;
    const struct plan_rig *got;

    (void)state;
    got = read_rig(&rig, HEAD "  linear: {origin: [1, 2, 3], axes: [{axis: b, "
                              "direction: [0, 5, 0], offset: 10, reversed: "
                              "yes}]}\n");
    assert_int_equal(got->carrier[0].axis, 1);
    expect_pupil(got, (const double[]){ 4, 0, 0, 0 }, 1, 8, 3);
    rig_free(&rig);
    got = read_rig(&rig, "  head: {pan: {axis: pan, offset: 90}, tilt: {axis: "
                         "tilt}, nodal: [50, 5, 7]}\n");
    expect_pupil(got, (const double[]){ 0, 0, 0 }, 5, 50, 7);
    rig_free(&rig);
    got = read_rig(&rig, HEAD "  gantry: {rails: [-1 m, 1 m], x1: {axis: a}, "
                              "x2: {axis: b}, y: {axis: c}, z: {axis: d}}\n");
    expect_pupil(got, (const double[]){ 100, 300, 0, 40, 0, 0, 0 }, 199.503719,
                 -4.962810, 40);
    rig_free(&rig);
}

/* A rail along half a circle of 1 m, its points 10 degrees apart, which climbs by
 * 200 mm: the carriage stands where the angle says, and looks inwards. */
static void write_half_circle(char *text, const char *more)
{
    char *at = text + sprintf(text,
                              "  head: {pan: {axis: pan}, tilt: {axis: "
                              "tilt}, forward: [0, 1, 0]}\n"
                              "  rail:\n    axis: {axis: b, offset: "
                              "100}\n    turning: %s\n    points:\n",
                              more);

    for (int i = 0; i <= 18; i++) {
        const double a = i * 10 / DEG;
        at += sprintf(at, "      - [%.9f, %.9f, %.9f]\n", 1000 * sin(a),
                      -1000 * cos(a), 900 + 200 * a / (180 / DEG));
    }
}

#define RAIL_RADIUS 1000
#define RAIL_CLIMB  (200 / (180 / DEG)) /* mm per radian */

static void a_rail_through_points_is_run_along_its_length(void **state)
{
    const double per_rad = hypot(RAIL_RADIUS, RAIL_CLIMB);
    char text[4000];
    double worst = 0, turned = 0;

    (void)state;
    for (int turning = 0; turning < 2; turning++) {
        struct rig rig;
        write_half_circle(text, turning ? "yes" : "no");
        const struct plan_rig *got = read_rig(&rig, text);
        for (int i = 0; i <= 50; i++) {
            const double s = 20.0 * i, a = s / per_rad;
            int64_t axis_q32[MOTION_RIG_AXES_MAX] = { q32_of(s - 100), 0, 0,
                                                      0 };
            const double want[3] = { RAIL_RADIUS * sin(a),
                                     -RAIL_RADIUS * cos(a),
                                     900 + RAIL_CLIMB * a };
            struct motion_camera camera;
            assert_int_equal(motion_rig_camera(&got->rig, axis_q32, &camera),
                             MOTION_OK);
            for (int k = 0; k < 3; k++)
                worst =
                    fmax(worst, fabs(number_of(camera.pupil.x[k]) - want[k]));
            const struct motion_dir view = motion_quat_turn(
                camera.q, (struct motion_dir){ { 0, 0, -((int64_t)1 << 62) } });
            const double angle = turning ? a : 0;
            turned = fmax(turned,
                          fabs(ldexp((double)view.q62[0], -62) + sin(angle)));
            turned = fmax(turned,
                          fabs(ldexp((double)view.q62[1], -62) - cos(angle)));
            turned = fmax(turned, fabs(ldexp((double)view.q62[2], -62)));
        }
        rig_free(&rig);
    }
    print_message("worst: %.2g mm, %.2g\n", worst, turned);
    assert_true(worst < 1e-3); /* ten degrees of a circle as one quintic */
    assert_true(turned < 1e-4);
}

/* Of tests/data/rail: scipy 1.17's quintic spline without knots at the second and
 * third point from either end (make_interp_spline, k = 5) over the distances of the
 * points, its length by quadrature; where the axis is, the place, the turn about the
 * vertical from the start of the rail. */
static const struct {
    double axis, place[3], turned_deg;
} through_points[] = {
    { 0, { 39.151001054, -8.194857765, 900.179315019 }, -0.5262968447 },
    { 460, { 487.454162578, -111.134676042, 901.967800319 }, 0.3339202179 },
    { 1160, { 1182.278839307, -116.164592044, 908.610272347 }, 23.5278103349 },
    { 1960, { 1895.800541774, 227.893987163, 923.996053922 }, 51.4371764612 },
    { 2710, { 2313.259959446, 838.615731313, 940.814663920 }, 83.4218387774 },
    { 3360, { 2421.048714230, 1478.159713550, 949.379072366 }, 95.4861133364 },
    { 4000, { 2569.606011445, 2097.154709160, 947.649271836 }, 75.6471472390 },
};

static void
a_rail_goes_through_its_points_as_a_spline_of_others_does(void **state)
{
    char message[YAML_MESSAGE_MAX];
    struct rig rig = { .bus_count = 0 };

    (void)state;
    if (rig_load(&disk_files, "tests/data/rail/rig.yaml", &rig, message) < 0)
        fail_msg("%s", message);
    for (size_t i = 0; i < ARRAY_LEN(through_points); i++) {
        const double turned = through_points[i].turned_deg / DEG;
        const double view[3] = { -sin(turned), cos(turned), 0 };
        const int64_t axis_q32[MOTION_RIG_AXES_MAX] = { q32_of(
            through_points[i].axis) };
        struct motion_camera camera;
        assert_int_equal(
            motion_rig_camera(&rig.kinematics->rig, axis_q32, &camera),
            MOTION_OK);
        const struct motion_dir got = motion_quat_turn(
            camera.q, (struct motion_dir){ { 0, 0, -((int64_t)1 << 62) } });
        for (int k = 0; k < 3; k++) {
            const double off =
                number_of(camera.pupil.x[k]) - through_points[i].place[k];
            if (fabs(off) > 2e-9 ||
                fabs(ldexp((double)got.q62[k], -62) - view[k]) > 1e-11)
                fail_msg("at %g, %d: off by %.3g mm, view %.12f, not %.12f",
                         through_points[i].axis, k, off,
                         ldexp((double)got.q62[k], -62), view[k]);
        }
    }
    rig_free(&rig);
}

/* From far along the rail, from its place, and without a place before. */
static void the_place_on_a_rail_is_found_again(void **state)
{
    struct rig rig;
    char text[4000];
    double worst = 0;

    (void)state;
    write_half_circle(text, "yes");
    const struct motion_carrier *carrier = &read_rig(&rig, text)->rig.carrier;
    seed_from("the_place_on_a_rail_is_found_again");
    for (int i = 0; i < 60; i++) {
        const int64_t axis_q32 = q32_of(uniform(-100, 900)),
                      before_q32 = q32_of(uniform(-100, 900));
        struct motion_mount mount;
        int64_t found_q32;
        assert_int_equal(carrier->kind->place(carrier, &axis_q32, &mount),
                         MOTION_OK);
        assert_int_equal(carrier->kind->find(carrier, mount.pivot,
                                             i % 3 ? &before_q32 : NULL,
                                             &found_q32),
                         MOTION_OK);
        worst = fmax(worst, fabs(from_q32(found_q32 - axis_q32)));
        mount.pivot.x[2] =
            motion_real_add(mount.pivot.x[2], motion_real_from_q(1 << 20, 32));
        assert_int_equal(
            carrier->kind->find(carrier, mount.pivot, &axis_q32, &found_q32),
            MOTION_E_UNREACHABLE);
    }
    print_message("worst: %.2g mm\n", worst);
    assert_true(worst < 1e-8);
    rig_free(&rig);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_makes_no_sense_is_refused),
        cmocka_unit_test(cameras_are_where_the_file_has_them),
        cmocka_unit_test(a_rail_through_points_is_run_along_its_length),
        cmocka_unit_test(
            a_rail_goes_through_its_points_as_a_spline_of_others_does),
        cmocka_unit_test(the_place_on_a_rail_is_found_again),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
