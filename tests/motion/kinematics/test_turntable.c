/* tests/motion/kinematics/test_turntable.c - random cameras before a turning
 * subject: where the pupil is seen from the table, and back to the axes. */
#include "motion/kinematics/turntable.h"
#include "tests/motion/kinematics/rig_random.h"

#define ROUNDS 4000

struct scene {
    struct motion_rig camera;
    struct motion_turntable table;
};

/* A camera some two metres from the middle of the table. */
static void random_scene(struct scene *scene, uint32_t sliders, double nodal)
{
    struct motion_linear *const linear = &scene->camera.carrier.as.linear;

    memset(scene, 0, sizeof *scene);
    random_linear(&scene->camera.carrier, sliders);
    linear->origin =
        vec_of(uniform(1500, 2500), uniform(-500, 500), uniform(-500, 500));
    if (sliders > 0) /* along x and y, mostly */
        while (fabs(ldexp((double)linear->direction[0].q62[2], -62)) > 0.5)
            linear->direction[0] = random_dir();
    linear->axis[0] = (struct motion_axis_map){ .offset_q32 = 0 };
    random_head(&scene->camera, nodal);
    /* upright, so that no subject is near a pole */
    assert_int_equal(motion_mount_level(vec_of(-1, 0, 0), vec_of(0, 0, 1),
                                        &scene->camera.carrier.level),
                     MOTION_OK);
    scene->table.camera = &scene->camera;
    scene->table.centre = random_point(50);
    scene->table.subject = random_point(100);
    scene->table.axis = random_map(60);
}

/* From the pupil in the frame of the table to azimuth and radius. */
static double azimuth_of(const struct motion_camera *camera)
{
    return DEG *
           atan2(number_of(camera->pupil.x[1]), number_of(camera->pupil.x[0]));
}

static double radius_of(const struct motion_camera *camera)
{
    return hypot(number_of(camera->pupil.x[0]), number_of(camera->pupil.x[1]));
}

static double round_the_circle(double deg)
{
    return remainder(deg, 360);
}

/* The subject, as the camera sees it in the frame of the table, is in the middle
 * of the picture. */
static void assert_in_the_middle(const struct scene *scene,
                                 const struct motion_camera *camera,
                                 struct motion_real want)
{
    struct motion_real distance, depth;

    motion_camera_distance(camera, scene->table.subject, &distance, &depth);
    assert_true(fabs(number_of(distance) - number_of(want)) < 1e-6);
    assert_true(number_of(depth) > 0 &&
                fabs(number_of(distance) - number_of(depth)) < 1e-9);
}

static void demands_are_met(void **state)
{
    (void)state;
    seed_from(__func__);
    for (int n = 0; n < ROUNDS; n++) {
        const uint32_t sliders = n % 2 ? 1 : 0;
        const double azimuth = uniform(-700, 700);
        int64_t axis_q32[MOTION_RIG_AXES_MAX + 1] = { 0 }, radius_q32 = 0,
                                               before_q32[MOTION_RIG_AXES_MAX +
                                                          1];
        struct motion_real distance;
        struct motion_camera camera;
        struct scene scene;

        random_scene(&scene, sliders, n % 4 < 2 ? 0 : 120);
        radius_q32 = q32_of(uniform(1400, 3000));
        for (uint32_t i = 0; i < sliders + 4; i++)
            before_q32[i] = q32_of(uniform(-500, 500));
        int err = motion_turntable_relative(
            &scene.table, q32_of(azimuth), sliders > 0 ? &radius_q32 : NULL,
            n % 8 < 4 ? before_q32 : NULL, axis_q32, &distance);
        if (err == MOTION_E_UNREACHABLE && sliders > 0)
            continue; /* the slider passes the axis farther off */
        assert_int_equal(err, MOTION_OK);
        assert_int_equal(
            motion_turntable_camera(&scene.table, axis_q32, &camera),
            MOTION_OK);
        assert_true(fabs(round_the_circle(azimuth_of(&camera) - azimuth)) <
                    1e-7);
        if (sliders > 0)
            assert_true(fabs(radius_of(&camera) - from_q32(radius_q32)) < 1e-6);
        assert_in_the_middle(&scene, &camera, distance);
    }
}

/* The same axes again when they are known within some degrees and mm. */
static void axes_continue_over_whole_turns(void **state)
{
    unsigned checked = 0;

    (void)state;
    seed_from(__func__);
    for (int n = 0; n < ROUNDS; n++) {
        int64_t axis_q32[MOTION_RIG_AXES_MAX +
                         1] = { 0 },
                         before_q32[MOTION_RIG_AXES_MAX + 1],
                         got_q32[MOTION_RIG_AXES_MAX + 1] = { 0 };
        struct motion_real distance;
        struct motion_camera camera;
        struct scene scene;

        random_scene(&scene, 1, n % 2 ? 0 : 60);
        const double far = uniform(1400, 3000);
        const int64_t radius_q32 = q32_of(far);
        if (motion_turntable_relative(&scene.table, q32_of(uniform(0, 360)),
                                      &radius_q32, NULL, axis_q32,
                                      &distance) < 0)
            continue;
        axis_q32[0] += q32_of(360 * floor(uniform(-3, 4)));
        assert_int_equal(
            motion_turntable_camera(&scene.table, axis_q32, &camera),
            MOTION_OK);
        for (int i = 0; i < 5; i++)
            before_q32[i] = axis_q32[i] + q32_of(uniform(-20, 20));
        got_q32[4] = axis_q32[4];
        assert_int_equal(motion_turntable_relative(
                             &scene.table, q32_of(azimuth_of(&camera)),
                             &radius_q32, before_q32, got_q32, &distance),
                         MOTION_OK);
        if (fabs(from_q32(got_q32[1] - axis_q32[1])) > 1) {
            /* the other place of the slider was nearer */
            assert_true(llabs(got_q32[1] - before_q32[1]) <
                        llabs(axis_q32[1] - before_q32[1]) + q32_of(30));
            continue;
        }
        for (int i = 0; i < 5; i++) {
            if (!(fabs(from_q32(got_q32[i] - axis_q32[i])) < 1e-5))
                fail_msg("round %d: axis %d is %.9f, not %.9f", n, i,
                         from_q32(got_q32[i]), from_q32(axis_q32[i]));
        }
        checked++;
    }
    assert_true(checked > ROUNDS / 2);
}

static void wrong_demands_are_refused(void **state)
{
    int64_t axis_q32[MOTION_RIG_AXES_MAX + 1] = { 0 };
    const int64_t near_q32 = q32_of(1), minus_q32 = -1;
    struct motion_linear *linear;
    struct motion_real distance;
    struct scene scene;

    (void)state;
    seed_from(__func__);
    random_scene(&scene, 1, 0);
    linear = &scene.camera.carrier.as.linear;
    scene.table.centre = motion_vec_zero();
    linear->direction[0] = (struct motion_dir){ { 0, (int64_t)1 << 62, 0 } };
    assert_int_equal(motion_turntable_relative(&scene.table, 0, &near_q32, NULL,
                                               axis_q32, &distance),
                     MOTION_E_UNREACHABLE);
    assert_int_equal(motion_turntable_relative(&scene.table, 0, &minus_q32,
                                               NULL, axis_q32, &distance),
                     MOTION_E_UNREACHABLE);
    linear->direction[0] = (struct motion_dir){ { 0, 0, (int64_t)1 << 62 } };
    assert_int_equal(motion_turntable_relative(&scene.table, 0, &near_q32, NULL,
                                               axis_q32, &distance),
                     MOTION_E_UNREACHABLE);
    linear->count = 2;
    assert_int_equal(motion_turntable_relative(&scene.table, 0, &near_q32, NULL,
                                               axis_q32, &distance),
                     MOTION_E_ARG);
    linear->count = 0;
    linear->origin = vec_of(0, 0, 500);
    assert_int_equal(motion_turntable_relative(&scene.table, 0, NULL, NULL,
                                               axis_q32, &distance),
                     MOTION_E_SINGULAR);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(demands_are_met),
        cmocka_unit_test(axes_continue_over_whole_turns),
        cmocka_unit_test(wrong_demands_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
