/* tests/motion/kinematics/test_dolly_zoom.c - focal length over distance stays,
 * and a focal length leads back to the slide. */
#include "motion/kinematics/dolly_zoom.h"
#include "tests/motion/kinematics/rig_random.h"

#define ROUNDS 1000

struct scene {
    struct motion_rig camera;
    struct motion_dolly_zoom zoom;
};

static void random_scene(struct scene *scene, double nodal)
{
    memset(scene, 0, sizeof *scene);
    random_linear(&scene->camera.carrier, 1);
    random_head(&scene->camera, nodal);
    scene->zoom = (struct motion_dolly_zoom){
        .camera = &scene->camera,
        .focal_at_q32 = q32_of(uniform(20, 80)),
        .slide_at_q32 = q32_of(uniform(-2000, 2000)),
        .subject_at = random_point(4000),
        .focal_min_q32 = q32_of(18),
        .focal_max_q32 = q32_of(120),
    };
}

static void the_subject_keeps_its_size(void **state)
{
    unsigned checked = 0;

    (void)state;
    seed_from(__func__);
    for (int n = 0; n < ROUNDS; n++) {
        int64_t at_q32[4] = { 0 }, axis_q32[4] = { 0, 0, 0, 99 }, before_q32[4],
                got_q32[4] = { 0, 0, 0, 99 }, focal_q32;
        struct motion_real at, distance, depth, again;
        struct motion_camera camera;
        struct scene scene;

        random_scene(&scene, 100);
        const struct motion_vec subject = random_point(4000);
        at_q32[0] = scene.zoom.slide_at_q32;
        axis_q32[0] = q32_of(uniform(-3000, 3000));
        if (motion_rig_track(&scene.camera, scene.zoom.subject_at, NULL, at_q32,
                             &at) < 0 ||
            motion_dolly_zoom_focal(&scene.zoom, subject, NULL, axis_q32,
                                    &focal_q32, &distance) < 0)
            continue; /* nearer than the pupil goes round */
        assert_int_equal(motion_rig_camera(&scene.camera, axis_q32, &camera),
                         MOTION_OK);
        motion_camera_distance(&camera, subject, &again, &depth);
        assert_true(fabs(number_of(again) - number_of(distance)) < 1e-6);
        assert_true(number_of(again) - number_of(depth) < 1e-9);
        const double size = from_q32(scene.zoom.focal_at_q32) / number_of(at);
        assert_true(fabs(from_q32(focal_q32) - size * number_of(distance)) <
                    1e-8);

        for (int i = 0; i < 4; i++)
            before_q32[i] = axis_q32[i] + q32_of(uniform(-20, 20));
        if (motion_dolly_zoom_slide(&scene.zoom, focal_q32, subject, before_q32,
                                    got_q32, &distance) < 0)
            fail_msg("round %d: no way back", n);
        assert_true(axis_q32[3] == 0 && got_q32[3] == 0); /* roll */
        assert_true(fabs(number_of(distance) - number_of(again)) < 1e-6);
        /* where the slide passes the subject a rounding of the focal length is
         * a tenth of a millimetre */
        if (fabs(from_q32(got_q32[0] - axis_q32[0])) > 0.1) {
            /* the other place of the slide was nearer */
            assert_true(llabs(got_q32[0] - before_q32[0]) <
                        llabs(axis_q32[0] - before_q32[0]));
            continue;
        }
        checked++;
    }
    assert_true(checked > ROUNDS / 2);
}

static void both_places_of_the_slide_are_found(void **state)
{
    int64_t axis_q32[4] = { 0 };
    struct motion_real distance;
    struct scene scene;

    (void)state;
    seed_from(__func__);
    random_scene(&scene, 0);
    scene.camera.carrier.as.linear = (struct motion_linear){
        .origin = motion_vec_zero(),
        .count = 1,
        .direction = { { { (int64_t)1 << 62, 0, 0 } } },
    };
    scene.zoom.slide_at_q32 = 0;
    scene.zoom.subject_at = vec_of(0, 500, 0);
    scene.zoom.focal_at_q32 = q32_of(50);
    /* half as far again: 1300 = hypot(500, 1200) */
    for (int i = 0; i < 3; i++) {
        const int64_t before_q32[4] = { q32_of(i == 1 ? 100 : -100) };
        assert_int_equal(motion_dolly_zoom_slide(
                             &scene.zoom, q32_of(130), scene.zoom.subject_at,
                             i == 2 ? NULL : before_q32, axis_q32, &distance),
                         MOTION_OK);
        assert_true(fabs(from_q32(axis_q32[0]) - (i == 1 ? 1200 : -1200)) <
                    1e-6);
        assert_true(fabs(number_of(distance) - 1300) < 1e-6);
    }
    assert_int_equal(motion_dolly_zoom_slide(&scene.zoom, q32_of(49),
                                             scene.zoom.subject_at, NULL,
                                             axis_q32, &distance),
                     MOTION_E_UNREACHABLE);
    assert_int_equal(motion_dolly_zoom_slide(&scene.zoom, -1,
                                             scene.zoom.subject_at, NULL,
                                             axis_q32, &distance),
                     MOTION_E_UNREACHABLE);
}

static void a_lens_has_limits(void **state)
{
    static const struct {
        double focal;
        int want;
    } rows[] = {
        { 17.999, MOTION_E_UNREACHABLE },
        { 18, MOTION_OK },
        { 120, MOTION_OK },
        { 120.001, MOTION_E_UNREACHABLE },
    };
    struct scene scene;

    (void)state;
    seed_from(__func__);
    random_scene(&scene, 0);
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        assert_int_equal(
            motion_dolly_zoom_check(&scene.zoom, q32_of(rows[i].focal)),
            rows[i].want);
}

static void other_cameras_have_no_dolly_zoom(void **state)
{
    int64_t axis_q32[4] = { 0 }, focal_q32;
    struct motion_real distance;
    struct scene scene;

    (void)state;
    seed_from(__func__);
    random_scene(&scene, 0);
    scene.camera.carrier.as.linear.count = 0;
    assert_int_equal(motion_dolly_zoom_focal(&scene.zoom, vec_of(1, 2, 3), NULL,
                                             axis_q32, &focal_q32, &distance),
                     MOTION_E_ARG);
    scene.camera.carrier.as.linear.count = 1;
    scene.zoom.focal_at_q32 = 0;
    assert_int_equal(motion_dolly_zoom_slide(&scene.zoom, q32_of(30),
                                             vec_of(1, 2, 3), NULL, axis_q32,
                                             &distance),
                     MOTION_E_ARG);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_subject_keeps_its_size),
        cmocka_unit_test(both_places_of_the_slide_are_found),
        cmocka_unit_test(a_lens_has_limits),
        cmocka_unit_test(other_cameras_have_no_dolly_zoom),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
