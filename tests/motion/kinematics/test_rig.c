/* tests/motion/kinematics/test_rig.c - random camera rigs: forward against
 * rotation matrices in double, inverse against forward, branches, poles and
 * refusals. */
#include "motion/number/trig.h"
#include "tests/motion/kinematics/rig_inverse.h"
#include "tests/motion/kinematics/rig_random.h"

#define ROUNDS 300

enum {
    LINEAR_0,
    LINEAR_1,
    LINEAR_2,
    LINEAR_3,
    ARC,
    GANTRY,
    JIB,
    KINDS = JIB + 3
};

static void random_rig(struct motion_rig *rig, int kind, double nodal)
{
    memset(rig, 0, sizeof *rig);
    if (kind <= LINEAR_3)
        random_linear(&rig->carrier, (uint32_t)kind);
    else if (kind == ARC)
        random_arc(&rig->carrier);
    else if (kind == GANTRY)
        random_gantry(&rig->carrier);
    else
        random_jib(&rig->carrier, (enum motion_jib_mount)(kind - JIB));
    random_head(rig, nodal);
}

static int64_t position(const struct motion_axis_map *map, double coordinate)
{
    int64_t axis_q32;

    assert_int_equal(motion_axis_position(map, q32_of(coordinate), &axis_q32),
                     MOTION_OK);
    return axis_q32;
}

/* Axes a rig can have; `wide`: pan and roll over several turns and tilt past
 * 90. */
static void random_axes(const struct motion_rig *rig, bool wide,
                        int64_t *axis_q32)
{
    const uint32_t n = motion_rig_axes(rig) - MOTION_HEAD_AXES;
    const double turn = wide ? 700 : 170, up = wide ? 170 : 85;

    for (uint32_t i = 0; i < n; i++)
        axis_q32[i] = q32_of(uniform(-3000, 3000));
    if (rig->carrier.kind == &motion_carrier_jib) {
        const struct motion_jib *const jib = &rig->carrier.as.jib;
        axis_q32[0] = position(&jib->axis[0], uniform(-400, 400));
        axis_q32[1] = position(&jib->axis[1], uniform(-70, 70));
        axis_q32[2] = position(&jib->axis[2], uniform(0, 1200));
    } else if (rig->carrier.kind == &motion_carrier_gantry) {
        const struct motion_gantry *const gantry = &rig->carrier.as.gantry;
        const double x = uniform(-3000, 3000);
        for (int i = 0; i < 2; i++)
            axis_q32[i] = position(&gantry->axis[i], x);
    }
    axis_q32[n] = position(&rig->head.axis[0], uniform(-turn, turn));
    axis_q32[n + 1] = position(&rig->head.axis[1], uniform(-up, up));
    axis_q32[n + 2] = position(&rig->head.axis[2], uniform(-turn, turn));
}

static double off(const struct motion_vec a, struct motion_vec b)
{
    return number_of(motion_vec_length(motion_vec_sub(a, b)));
}

static void assert_axes(const struct motion_rig *rig, const char *what,
                        const int64_t *got_q32, const int64_t *want_q32,
                        double tolerance)
{
    for (uint32_t i = 0; i < motion_rig_axes(rig); i++) {
        const double error = from_q32(got_q32[i]) - from_q32(want_q32[i]);
        if (!(fabs(error) <= tolerance))
            fail_msg("%s: axis %u is %.9f, not %.9f", what, i,
                     from_q32(got_q32[i]), from_q32(want_q32[i]));
    }
}

/* --- an oracle in double: matrices with the columns forward, left, up --------- */

struct matrix {
    double m[3][3];
};

static struct matrix product(struct matrix a, struct matrix b)
{
    struct matrix c;

    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            c.m[i][j] = 0;
            for (int k = 0; k < 3; k++)
                c.m[i][j] += a.m[i][k] * b.m[k][j];
        }
    return c;
}

/* By the right hand about x, y or z. */
static struct matrix about(int axis, double deg)
{
    const int j = (axis + 1) % 3, k = (axis + 2) % 3;
    const double s = sin(deg / DEG), c = cos(deg / DEG);
    struct matrix r = { { { 0 } } };

    r.m[axis][axis] = 1;
    r.m[j][j] = r.m[k][k] = c;
    r.m[j][k] = -s;
    r.m[k][j] = s;
    return r;
}

/* About any axis: Rodrigues. */
static struct matrix about_dir(struct motion_dir dir, double rad)
{
    const double x = ldexp((double)dir.q62[0], -62),
                 y = ldexp((double)dir.q62[1], -62),
                 z = ldexp((double)dir.q62[2], -62), s = sin(rad),
                 c = 1 - cos(rad);

    return (struct matrix){ {
        { 1 - c * (y * y + z * z), c * x * y - s * z, c * x * z + s * y },
        { c * x * y + s * z, 1 - c * (x * x + z * z), c * y * z - s * x },
        { c * x * z - s * y, c * y * z + s * x, 1 - c * (x * x + y * y) },
    } };
}

static void move(double point[3], struct matrix r, const double v[3])
{
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            point[i] += r.m[i][k] * v[k];
}

/* A quaternion of a camera (right, up, backwards) by its columns. */
static struct matrix matrix_of(struct motion_quat q)
{
    struct matrix r;

    for (int i = 0; i < 3; i++) {
        static const int column[3] = { 2, 0, 1 };
        struct motion_dir axis = { { 0, 0, 0 } };
        axis.q62[column[i]] = (int64_t)1 << 62;
        axis = motion_quat_turn(q, axis);
        for (int k = 0; k < 3; k++)
            r.m[k][i] = ldexp((double)axis.q62[k], -62) * (i == 2 ? 1 : -1);
    }
    return r;
}

static double coordinate(const struct motion_axis_map *map, int64_t axis_q32)
{
    return (map->is_reversed ? -1 : 1) * from_q32(axis_q32) +
           from_q32(map->offset_q32);
}

static void place_linear(const struct motion_linear *linear,
                         const int64_t *axis, double p[3])
{
    for (uint32_t i = 0; i < linear->count; i++)
        for (int k = 0; k < 3; k++)
            p[k] += ldexp((double)linear->direction[i].q62[k], -62) *
                    coordinate(&linear->axis[i], axis[i]);
    for (int k = 0; k < 3; k++)
        p[k] += number_of(linear->origin.x[k]);
}

static void place_arc(const struct motion_arc *arc, const int64_t *axis,
                      double p[3], struct matrix *m)
{
    const double radius = from_q32(arc->radius_q32);
    const struct matrix r =
        about_dir(arc->normal, coordinate(&arc->axis, axis[0]) / radius);
    double start[3];

    for (int k = 0; k < 3; k++) {
        start[k] = radius * ldexp((double)arc->start.q62[k], -62);
        p[k] = number_of(arc->centre.x[k]);
    }
    move(p, r, start);
    if (arc->is_turning)
        *m = product(r, *m);
}

static void place_gantry(const struct motion_gantry *gantry,
                         const int64_t *axis, double p[3], struct matrix *m)
{
    const double x1 = coordinate(&gantry->axis[0], axis[0]),
                 x2 = coordinate(&gantry->axis[1], axis[1]),
                 y1 = from_q32(gantry->at_y_q32[0]),
                 y2 = from_q32(gantry->at_y_q32[1]);
    const double length = hypot(x2 - x1, y2 - y1),
                 along = coordinate(&gantry->axis[2], axis[2]) - y1;

    p[0] = x1 + along * (x2 - x1) / length;
    p[1] = y1 + along * (y2 - y1) / length;
    p[2] = coordinate(&gantry->axis[3], axis[3]);
    *m = product(about(2, -DEG * atan((x2 - x1) / (y2 - y1))), *m);
}

static void place_jib(const struct motion_jib *jib, const int64_t *axis,
                      double p[3], struct matrix *m)
{
    const struct matrix pan = about(2, coordinate(&jib->axis[0], axis[0]));
    const struct matrix boom =
        product(pan, about(1, -coordinate(&jib->axis[1], axis[1])));
    const struct matrix frames[3] = { boom, pan, about(0, 0) };
    const double tip[3] = { from_q32(jib->length_q32) +
                            coordinate(&jib->axis[2], axis[2]) };
    double drop[3];

    for (int k = 0; k < 3; k++) {
        p[k] = number_of(jib->foot.x[k]);
        drop[k] = number_of(jib->drop.x[k]);
    }
    move(p, boom, tip);
    move(p, frames[jib->mount], drop);
    *m = product(frames[jib->mount], *m);
}

/* The pupil and the rotation, by the formulas of carrier.h and pan_tilt.h. */
static struct matrix oracle(const struct motion_rig *rig, const int64_t *axis,
                            double pupil[3])
{
    const struct motion_carrier *const carrier = &rig->carrier;
    const int64_t *const head = axis + motion_rig_axes(rig) - MOTION_HEAD_AXES;
    const double nodal[3] = { from_q32(rig->head.nodal.forward_q32),
                              -from_q32(rig->head.nodal.right_q32),
                              from_q32(rig->head.nodal.up_q32) };
    struct matrix m = matrix_of(carrier->level);

    memset(pupil, 0, 3 * sizeof *pupil);
    if (carrier->kind == &motion_carrier_linear)
        place_linear(&carrier->as.linear, axis, pupil);
    else if (carrier->kind == &motion_carrier_arc)
        place_arc(&carrier->as.arc, axis, pupil, &m);
    else if (carrier->kind == &motion_carrier_gantry)
        place_gantry(&carrier->as.gantry, axis, pupil, &m);
    else
        place_jib(&carrier->as.jib, axis, pupil, &m);
    m = product(m, about(2, coordinate(&rig->head.axis[0], head[0])));
    m = product(m, about(1, -coordinate(&rig->head.axis[1], head[1])));
    m = product(m, about(0, coordinate(&rig->head.axis[2], head[2])));
    move(pupil, m, nodal);
    return m;
}

static double matrix_deviation(struct matrix a, struct matrix b)
{
    double worst = 0;

    for (int i = 0; i < 9; i++)
        worst = fmax(worst, fabs(a.m[i / 3][i % 3] - b.m[i / 3][i % 3]));
    return worst;
}

static void cameras_are_where_the_matrices_say(void **state)
{
    (void)state;
    seed_from(__func__);
    for (int n = 0; n < ROUNDS * KINDS; n++) {
        int64_t axis_q32[MOTION_RIG_AXES_MAX];
        struct motion_camera camera;
        struct motion_rig rig;
        double pupil[3];

        random_rig(&rig, n % KINDS, 150);
        random_axes(&rig, true, axis_q32);
        if (n % KINDS == GANTRY) /* racked */
            axis_q32[1] += q32_of(uniform(-300, 300));
        assert_int_equal(motion_rig_camera(&rig, axis_q32, &camera), MOTION_OK);
        const struct matrix want = oracle(&rig, axis_q32, pupil);
        for (int i = 0; i < 3; i++) {
            if (!(fabs(pupil[i] - number_of(camera.pupil.x[i])) <= 1e-8))
                fail_msg("kind %d: pupil %d is off by %g", n % KINDS, i,
                         pupil[i] - number_of(camera.pupil.x[i]));
        }
        assert_true(matrix_deviation(want, matrix_of(camera.q)) <= 1e-11);
    }
}

/* --- inverse -------------------------------------------------------------- */

/* Are the axes of two or three rails far enough from one line or plane? */
static bool is_stiff(const struct motion_rig *rig)
{
    const struct motion_linear *const l = &rig->carrier.as.linear;
    struct motion_vec d[3], c;

    if (rig->carrier.kind != &motion_carrier_linear || l->count < 2)
        return true;
    for (uint32_t i = 0; i < l->count; i++)
        d[i] = motion_vec_from_dir(l->direction[i]);
    c = motion_vec_cross(d[0], d[1]);
    return fabs(number_of(l->count == 3 ? motion_vec_dot(c, d[2])
                                        : motion_vec_length(c))) > 0.1;
}

/* Axes before: each of the head up to 20 degrees away. */
static void before_of(const struct motion_rig *rig, const int64_t *axis_q32,
                      int64_t *before_q32)
{
    const uint32_t n = motion_rig_axes(rig);

    for (uint32_t i = 0; i < n; i++)
        before_q32[i] = axis_q32[i] + q32_of(uniform(-20, 20));
}

static void poses_lead_back_to_the_axes(void **state)
{
    (void)state;
    seed_from(__func__);
    for (int n = 0; n < ROUNDS * KINDS; n++) {
        int64_t axis_q32[MOTION_RIG_AXES_MAX], before_q32[MOTION_RIG_AXES_MAX],
            got_q32[MOTION_RIG_AXES_MAX];
        struct motion_camera camera, again;
        struct motion_rig rig;
        bool wide = n / KINDS % 2;

        random_rig(&rig, n % KINDS, 150);
        random_axes(&rig, wide, axis_q32);
        before_of(&rig, axis_q32, before_q32);
        assert_int_equal(motion_rig_camera(&rig, axis_q32, &camera), MOTION_OK);
        if (!is_stiff(&rig))
            continue;
        const double level = fabs(cos(
            coordinate(&rig.head.axis[1], axis_q32[motion_rig_axes(&rig) - 2]) /
            DEG));
        assert_int_equal(rig_inverse_pose(&rig, &camera, before_q32, got_q32),
                         MOTION_OK);
        assert_axes(&rig, "continued", got_q32, axis_q32, 2e-8 / level);
        assert_int_equal(motion_rig_camera(&rig, got_q32, &again), MOTION_OK);
        assert_true(off(camera.pupil, again.pupil) < 1e-6);
        if (wide || n % KINDS >= ARC)
            continue;
        assert_int_equal(rig_inverse_pose(&rig, &camera, NULL, got_q32),
                         MOTION_OK);
        assert_axes(&rig, "upright", got_q32, axis_q32, 2e-8 / level);
    }
}

/* A subject somewhere on the view. */
static struct motion_vec seen(const struct motion_camera *camera,
                              double distance)
{
    const struct motion_dir back = { { 0, 0, -((int64_t)1 << 62) } };

    return motion_vec_add(
        camera->pupil,
        motion_vec_scale(motion_vec_from_dir(motion_quat_turn(camera->q, back)),
                         real_of(distance)));
}

static void the_head_tracks_what_it_sees(void **state)
{
    (void)state;
    seed_from(__func__);
    for (int n = 0; n < ROUNDS * KINDS; n++) {
        int64_t axis_q32[MOTION_RIG_AXES_MAX], before_q32[MOTION_RIG_AXES_MAX],
            got_q32[MOTION_RIG_AXES_MAX];
        const double far = uniform(400, 4000);
        double distance;
        struct motion_camera camera;
        struct motion_rig rig;
        const bool wide = n / KINDS % 2;

        random_rig(&rig, n % KINDS, wide ? 60 : 20);
        random_axes(&rig, wide, axis_q32);
        before_of(&rig, axis_q32, before_q32);
        assert_int_equal(motion_rig_camera(&rig, axis_q32, &camera), MOTION_OK);
        const uint32_t pan = motion_rig_axes(&rig) - MOTION_HEAD_AXES;
        const double tilt = coordinate(&rig.head.axis[1], axis_q32[pan + 1]);
        if (fabs(cos(tilt / DEG)) < 0.5)
            continue; /* another answer could be as near */
        memcpy(got_q32, axis_q32, sizeof got_q32);
        got_q32[pan] = got_q32[pan + 1] = 0;
        assert_int_equal(rig_inverse_track(&rig, seen(&camera, far),
                                           wide ? before_q32 : NULL, got_q32,
                                           &distance),
                         MOTION_OK);
        assert_axes(&rig, "tracked", got_q32, axis_q32, 1e-7);
        assert_true(fabs(distance - far) < 1e-6);
    }
}

static void horizons_are_level(void **state)
{
    (void)state;
    seed_from(__func__);
    for (int n = 0; n < ROUNDS; n++) {
        const struct motion_vec pupil = random_point(3000),
                                subject = random_point(3000);
        struct motion_camera camera;

        assert_int_equal(rig_inverse_level_view(pupil, subject, &camera),
                         MOTION_OK);
        const struct matrix m = matrix_of(camera.q);
        assert_true(fabs(m.m[2][1]) < 1e-15); /* left is level */
        assert_true(m.m[2][2] > 0);           /* and up is up */
        assert_true(off(seen(&camera, off(pupil, subject)), subject) < 1e-9);
    }
}

/* --- poles ---------------------------------------------------------------- */

/* A camera on a tripod at the origin that looks along x. */
static void tripod(struct motion_rig *rig)
{
    memset(rig, 0, sizeof *rig);
    rig->carrier.kind = &motion_carrier_linear;
    rig->carrier.as.linear.origin = motion_vec_zero();
    assert_int_equal(motion_mount_level(vec_of(1, 0, 0), vec_of(0, 0, 1),
                                        &rig->carrier.level),
                     MOTION_OK);
}

static void roll_takes_the_rest_at_the_pole(void **state)
{
    int64_t axis_q32[3] = { q32_of(25), q32_of(90), q32_of(10) }, got_q32[3];
    const int64_t before_q32[3] = { q32_of(20), q32_of(85), q32_of(3) };
    struct motion_camera camera;
    struct motion_rig rig;

    (void)state;
    tripod(&rig);
    assert_int_equal(motion_rig_camera(&rig, axis_q32, &camera), MOTION_OK);
    assert_int_equal(rig_inverse_pose(&rig, &camera, before_q32, got_q32),
                     MOTION_OK);
    assert_true(fabs(from_q32(got_q32[0]) - 20) < 1e-9);
    assert_true(fabs(from_q32(got_q32[1]) - 90) < 1e-6);
    assert_true(fabs(from_q32(got_q32[2]) - 15) < 1e-6); /* 10 + 25 - 20 */
}

/* --- refusals ------------------------------------------------------------- */

static int pose_at(const struct motion_rig *rig, double x, double y, double z)
{
    const struct motion_camera camera = { vec_of(x, y, z), MOTION_QUAT_ONE };
    int64_t axis_q32[MOTION_RIG_AXES_MAX];

    return rig_inverse_pose(rig, &camera, NULL, axis_q32);
}

static void linear_axes_reach_their_plane(void **state)
{
    struct motion_rig rig;
    struct motion_linear *const l = &rig.carrier.as.linear;

    (void)state;
    tripod(&rig);
    assert_int_equal(pose_at(&rig, 0, 0, 0), MOTION_OK);
    assert_int_equal(pose_at(&rig, 0, 0.001, 0), MOTION_E_UNREACHABLE);
    l->count = 2;
    l->direction[0] = (struct motion_dir){ { (int64_t)1 << 62, 0, 0 } };
    l->direction[1] = (struct motion_dir){ { 0, (int64_t)1 << 62, 0 } };
    assert_int_equal(pose_at(&rig, 10, 20, 0), MOTION_OK);
    assert_int_equal(pose_at(&rig, 10, 20, 1), MOTION_E_UNREACHABLE);
    l->count = 3;
    l->direction[2] = l->direction[0];
    assert_int_equal(pose_at(&rig, 10, 20, 0), MOTION_E_SINGULAR);
    assert_int_equal(pose_at(&rig, 10, 20, 1), MOTION_E_UNREACHABLE);
    l->count = 4;
    assert_int_equal(pose_at(&rig, 10, 20, 0), MOTION_E_ARG);
}

static void a_rail_reaches_its_circle(void **state)
{
    struct motion_rig rig;
    struct motion_arc *const arc = &rig.carrier.as.arc;

    (void)state;
    tripod(&rig);
    rig.carrier.kind = &motion_carrier_arc;
    arc->centre = motion_vec_zero();
    arc->radius_q32 = q32_of(1000);
    assert_int_equal(motion_arc_plane(arc, vec_of(0, 0, 3), vec_of(0, 0, -1)),
                     MOTION_E_RANGE);
    assert_int_equal(motion_arc_plane(arc, vec_of(0, 0, 3), vec_of(2, 0, 0)),
                     MOTION_OK);
    assert_int_equal(pose_at(&rig, 600, 800, 0), MOTION_OK);
    assert_int_equal(pose_at(&rig, 600, 801, 0), MOTION_E_UNREACHABLE);
    assert_int_equal(pose_at(&rig, 600, 800, -1), MOTION_E_UNREACHABLE);
    arc->radius_q32 = 0;
    assert_int_equal(pose_at(&rig, 0, 0, 0), MOTION_E_ARG);
}

static void a_boom_reaches_what_its_limits_allow(void **state)
{
    const int64_t over_q32[6] = { 0, q32_of(91) }, long_q32[6] = { 0, 0, -1 };
    struct motion_camera camera;
    struct motion_rig rig;
    struct motion_jib *const jib = &rig.carrier.as.jib;

    (void)state;
    for (int mount = 0; mount < 3; mount++) {
        tripod(&rig);
        rig.carrier.kind = &motion_carrier_jib;
        jib->foot = jib->drop = motion_vec_zero();
        jib->mount = (enum motion_jib_mount)mount;
        jib->length_q32 = q32_of(2000);
        jib->extend_max_q32 = q32_of(500);
        assert_int_equal(pose_at(&rig, 0, 2500, 0), MOTION_OK);
        assert_int_equal(pose_at(&rig, 0, 1600, 1200), MOTION_OK);
        assert_int_equal(pose_at(&rig, 0, 2501, 0), MOTION_E_UNREACHABLE);
        assert_int_equal(pose_at(&rig, 0, 1999, 0), MOTION_E_UNREACHABLE);
        assert_int_equal(pose_at(&rig, 0, 0, 2200), MOTION_E_SINGULAR);
        assert_int_equal(pose_at(&rig, 0, 0, 3000), MOTION_E_UNREACHABLE);
        assert_int_equal(motion_rig_camera(&rig, over_q32, &camera),
                         MOTION_E_LIMIT);
        assert_int_equal(motion_rig_camera(&rig, long_q32, &camera),
                         MOTION_E_LIMIT);
    }
}

static void subjects_that_have_no_direction_are_refused(void **state)
{
    int64_t axis_q32[3] = { 0 };
    double distance;
    struct motion_camera camera;
    struct motion_rig rig;

    (void)state;
    tripod(&rig);
    assert_int_equal(
        rig_inverse_track(&rig, motion_vec_zero(), NULL, axis_q32, &distance),
        MOTION_E_SINGULAR);
    assert_int_equal(
        rig_inverse_track(&rig, vec_of(0, 0, 9), NULL, axis_q32, &distance),
        MOTION_E_SINGULAR);
    rig.head.nodal.right_q32 = q32_of(30);
    assert_int_equal(
        rig_inverse_track(&rig, vec_of(0, 0, 9), NULL, axis_q32, &distance),
        MOTION_E_UNREACHABLE);
    assert_int_equal(
        rig_inverse_track(&rig, vec_of(20, 0, 0), NULL, axis_q32, &distance),
        MOTION_E_UNREACHABLE);
    assert_int_equal(
        rig_inverse_level_view(vec_of(1, 2, 3), vec_of(1, 2, 9), &camera),
        MOTION_E_SINGULAR);
    assert_int_equal(
        rig_inverse_level_view(vec_of(1, 2, 3), vec_of(1, 2, 3), &camera),
        MOTION_E_SINGULAR);
}

static void axes_out_of_range_are_refused(void **state)
{
    int64_t axis_q32[3] = { INT64_MAX, INT64_MIN, INT64_MAX };
    struct motion_camera camera;
    struct motion_rig rig;

    (void)state;
    tripod(&rig);
    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        rig.head.axis[i].is_reversed = true;
    assert_int_equal(motion_rig_camera(&rig, axis_q32, &camera),
                     MOTION_E_RANGE);
    rig.carrier.as.linear.count = 1;
    rig.carrier.as.linear.direction[0] =
        (struct motion_dir){ { (int64_t)1 << 62, 0, 0 } };
    assert_int_equal(pose_at(&rig, 1e12, 0, 0), MOTION_E_RANGE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(cameras_are_where_the_matrices_say),
        cmocka_unit_test(poses_lead_back_to_the_axes),
        cmocka_unit_test(the_head_tracks_what_it_sees),
        cmocka_unit_test(horizons_are_level),
        cmocka_unit_test(roll_takes_the_rest_at_the_pole),
        cmocka_unit_test(linear_axes_reach_their_plane),
        cmocka_unit_test(a_rail_reaches_its_circle),
        cmocka_unit_test(a_boom_reaches_what_its_limits_allow),
        cmocka_unit_test(subjects_that_have_no_direction_are_refused),
        cmocka_unit_test(axes_out_of_range_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
