/* tests/motion/plan/rig/test_plan_rig.c - rigs in jets against motion/kinematics,
 * which computes in integers by other formulas, and derivatives against
 * differences. */
#include "motion/plan/rig/plan_rig.h"

#include "motion/plan/path/plan_space.h"
#include "motion/plan/plan_track.h"
#include "tests/motion/kinematics/rig_random.h"

#define RIGS  450
#define RAILS 8

/* Rails that climb and turn, with lengths of about 4 m. */
static struct plan_space rails[RAILS];

static int open_rails(void **state)
{
    (void)state;
    seed_from("open_rails");
    for (int n = 0; n < RAILS; n++) {
        struct plan_point point[6] = { { .q32 = { 0 } } };
        const struct plan_points points = {
            .axes = 3,
            .curve = n & 1 ? PLAN_CURVE_C4 : PLAN_CURVE_C2,
            .spacing = MOTION_SPLINE_CHORDAL,
            .point = point,
            .count = 2 + (uint32_t)n * 4 / (RAILS - 1),
        };
        struct plan_error error;
        for (uint32_t i = 0; i < points.count; i++) {
            point[i].q32[0] = q32_of(800.0 * i + uniform(-200, 200));
            point[i].q32[1] = q32_of(uniform(-600, 600));
            point[i].q32[2] = q32_of(uniform(800, 1200));
        }
        assert_int_equal(plan_space_init(&rails[n], &points, &error),
                         MOTION_OK);
    }
    return 0;
}

static int close_rails(void **state)
{
    (void)state;
    for (int n = 0; n < RAILS; n++)
        plan_space_free(&rails[n]);
    return 0;
}

static void random_rail(struct motion_carrier *carrier)
{
    carrier->kind = &motion_carrier_rail;
    carrier->as.rail =
        (struct motion_rail){ .table = &rails[draw() % RAILS].table,
                              .is_turning = draw() & 1,
                              .axis = random_map(0) };
    carrier->as.rail.axis.offset_q32 = q32_of(uniform(100, 500));
}

static void random_rig(struct motion_rig *rig, unsigned kind)
{
    *rig = (struct motion_rig){ .carrier.kind = NULL };
    random_head(rig, 60);
    if (kind < 3)
        random_linear(&rig->carrier, kind + 1);
    else if (kind == 3)
        random_arc(&rig->carrier);
    else if (kind == 4)
        random_gantry(&rig->carrier);
    else if (kind == 5)
        random_rail(&rig->carrier);
    else
        random_jib(&rig->carrier, (enum motion_jib_mount)(kind - 6));
}
#define KINDS 9

/* Positions that a jib can have, too. */
static void random_axes(const struct motion_rig *rig, struct plan_jet axis[])
{
    for (uint32_t i = 0; i < motion_rig_axes(rig); i++)
        axis[i] = (struct plan_jet){ uniform(0, 45), uniform(-50, 50),
                                     uniform(-50, 50) };
}

static double near_to(struct plan_jet_vec a, struct motion_vec b)
{
    double most = 0;

    for (int i = 0; i < 3; i++)
        most = fmax(most, fabs(a.x[i].p - number_of(b.x[i])));
    return most;
}

static void a_camera_is_where_the_integers_have_it(void **state)
{
    double worst = 0;

    (void)state;
    seed_from("a_camera_is_where_the_integers_have_it");
    for (unsigned n = 0; n < RIGS; n++) {
        struct plan_rig rig = { .table.is_given = false };
        struct motion_track track[MOTION_RIG_AXES_MAX];
        struct plan_jet axis[MOTION_RIG_AXES_MAX];
        int64_t q32[MOTION_RIG_AXES_MAX];
        struct plan_rig_camera got;
        struct motion_camera want;
        random_rig(&rig.rig, n % KINDS);
        const uint32_t axes = motion_rig_axes(&rig.rig);
        random_axes(&rig.rig, axis);
        for (uint32_t i = 0; i < axes; i++) {
            struct plan_rig_axis *to = i + MOTION_HEAD_AXES < axes
                                           ? &rig.carrier[i]
                                           : &rig.head[i + 3 - axes];
            *to = (struct plan_rig_axis){ true, i };
            q32[i] = q32_of(axis[i].p);
            plan_track_init(&track[i], q32[i]);
        }
        assert_int_equal(motion_rig_camera(&rig.rig, q32, &want), MOTION_OK);
        plan_rig_camera_at(&rig, track, 0, &got);
        worst = fmax(worst, near_to(got.pupil, want.pupil));
        const struct motion_dir back = { { 0, 0, -((int64_t)1 << 62) } };
        worst = fmax(worst, 1000 * near_to(got.frame.forward,
                                           motion_vec_from_dir(motion_quat_turn(
                                               want.q, back))));
    }
    print_message("worst: %.2g\n", worst);
    assert_true(worst < 1e-6);
}

/* The camera in integers that stands as the answer says. */
static void a_subject_is_in_the_middle_of_what_the_integers_see(void **state)
{
    double worst = 0;
    unsigned seen = 0;

    (void)state;
    seed_from("a_subject_is_in_the_middle_of_what_the_integers_see");
    for (unsigned n = 0; n < RIGS; n++) {
        struct motion_rig rig;
        struct plan_jet axis[MOTION_RIG_AXES_MAX];
        int64_t q32[MOTION_RIG_AXES_MAX];
        struct plan_jet_vec pivot;
        struct plan_rig_frame mount;
        struct plan_rig_aim aim;
        struct motion_camera camera;
        const double point[3] = { uniform(-9000, 9000), uniform(-9000, 9000),
                                  uniform(-9000, 9000) };
        random_rig(&rig, n % KINDS);
        const uint32_t axes = motion_rig_axes(&rig);
        random_axes(&rig, axis);
        for (uint32_t i = 0; i < axes; i++)
            q32[i] = q32_of(axis[i].p);
        plan_rig_mount(&rig.carrier, axis, &pivot, &mount);
        const struct plan_jet roll =
            plan_jet_scale(plan_rig_coordinate(&rig.head.axis[2],
                                               plan_jet_of(axis[axes - 1].p)),
                           1 / DEG);
        if (plan_rig_look(&rig.head.nodal, &mount,
                          plan_jet_vec_sub(plan_jet_vec_of(point), pivot), roll,
                          &aim) != MOTION_OK)
            continue;
        seen++;
        assert_true(fabs(aim.tilt.p) * DEG <= 90);
        for (int i = 0; i < 2; i++)
            q32[axes - 3 + (uint32_t)i] =
                q32_of(plan_rig_position(
                           &rig.head.axis[i],
                           plan_jet_scale(i == 0 ? aim.pan : aim.tilt, DEG))
                           .p);
        assert_int_equal(motion_rig_camera(&rig, q32, &camera), MOTION_OK);
        const struct motion_dir back = { { 0, 0, -((int64_t)1 << 62) } };
        const struct motion_vec view =
            motion_vec_from_dir(motion_quat_turn(camera.q, back));
        const struct motion_vec at = motion_vec_add(
            camera.pupil, motion_vec_scale(view, real_of(aim.distance.p)));
        worst =
            fmax(worst, near_to(plan_jet_vec_of(point), at) / aim.distance.p);
    }
    print_message("%u seen, worst: %.2g\n", seen, worst);
    assert_true(seen > RIGS * 9 / 10);
    assert_true(worst < 1e-10);
}

/* Everything a subject's view has, at t of axes p + v t + a t^2 / 2. */
static void look_at(const struct motion_rig *rig, const struct plan_jet axis[],
                    double t, struct plan_rig_aim *aim)
{
    const double point[3] = { 5000, 6000, 7000 };
    struct plan_jet now[MOTION_RIG_AXES_MAX];
    struct plan_jet_vec pivot;
    struct plan_rig_frame mount;

    for (uint32_t i = 0; i < motion_rig_axes(rig); i++)
        now[i] =
            (struct plan_jet){ axis[i].p + t * (axis[i].v + t / 2 * axis[i].a),
                               axis[i].v + t * axis[i].a, axis[i].a };
    plan_rig_mount(&rig->carrier, now, &pivot, &mount);
    assert_int_equal(
        plan_rig_look(&rig->head.nodal, &mount,
                      plan_jet_vec_sub(plan_jet_vec_of(point), pivot),
                      plan_jet_scale(now[motion_rig_axes(rig) - 1], 1 / DEG),
                      aim),
        MOTION_OK);
}

static void compare(struct plan_jet low, struct plan_jet mid,
                    struct plan_jet high, double h, double *worst)
{
    const double scale = 1 + fabs(mid.v) + fabs(mid.a);

    *worst = fmax(*worst, fabs((high.p - low.p) / (2 * h) - mid.v) / scale);
    *worst = fmax(*worst, fabs((high.v - low.v) / (2 * h) - mid.a) / scale);
}

static void derivatives_are_those_of_differences(void **state)
{
    const double h = 1e-4;
    double worst = 0;

    (void)state;
    seed_from("derivatives_are_those_of_differences");
    for (unsigned n = 0; n < RIGS; n++) {
        struct motion_rig rig;
        struct plan_jet axis[MOTION_RIG_AXES_MAX];
        struct plan_rig_aim aim[3];
        random_rig(&rig, n % KINDS);
        random_axes(&rig, axis);
        for (int i = 0; i < 3; i++)
            look_at(&rig, axis, (i - 1) * h, &aim[i]);
        compare(aim[0].tilt, aim[1].tilt, aim[2].tilt, h, &worst);
        compare(aim[0].distance, aim[1].distance, aim[2].distance, h, &worst);
        if (fabs(aim[0].pan.p - aim[2].pan.p) < 1)
            compare(aim[0].pan, aim[1].pan, aim[2].pan, h, &worst);
    }
    print_message("worst: %.2g\n", worst);
    assert_true(worst < 1e-5);
}

static void what_has_no_direction_is_refused(void **state)
{
    const struct motion_nodal none = { 0, 0, 0 }, wide = { 0, q32_of(50), 0 };
    const double x[3] = { 1, 0, 0 }, y[3] = { 0, 1, 0 }, z[3] = { 0, 0, 1 };
    const struct plan_rig_frame level = { plan_jet_vec_of(x),
                                          plan_jet_vec_of(y),
                                          plan_jet_vec_of(z) };
    const double above[3] = { 0, 0, 900 }, near[3] = { 30, 0, 0 },
                 here[3] = { 0, 0, 0 };
    struct plan_rig_aim aim;

    (void)state;
    assert_int_equal(plan_rig_look(&none, &level, plan_jet_vec_of(above),
                                   plan_jet_of(0), &aim),
                     MOTION_E_SINGULAR);
    assert_int_equal(plan_rig_look(&none, &level, plan_jet_vec_of(here),
                                   plan_jet_of(0), &aim),
                     MOTION_E_SINGULAR);
    assert_int_equal(plan_rig_look(&wide, &level, plan_jet_vec_of(near),
                                   plan_jet_of(0), &aim),
                     MOTION_E_UNREACHABLE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_camera_is_where_the_integers_have_it),
        cmocka_unit_test(a_subject_is_in_the_middle_of_what_the_integers_see),
        cmocka_unit_test(derivatives_are_those_of_differences),
        cmocka_unit_test(what_has_no_direction_is_refused),
    };
    return cmocka_run_group_tests(tests, open_rails, close_rails);
}
