/* tests/motion/kinematics/test_arm.c - arms against Denavit-Hartenberg matrices
 * in double, Jacobians against differences, inverses against forward. */
#include "motion/kinematics/arm.h"
#include "tests/motion/kinematics/rig_random.h"

#define ROUNDS 300

/* --- arms ----------------------------------------------------------------- */

/* a, alpha, d, theta; 1 for a prismatic joint */
struct link {
    double a, alpha, d, theta;
    bool slides;
};

static void arm_of(struct motion_arm *arm, const struct link *link,
                   uint32_t count)
{
    memset(arm, 0, sizeof *arm);
    arm->count = count;
    for (uint32_t i = 0; i < count; i++)
        arm->joint[i] = (struct motion_arm_joint){
            .a_q32 = q32_of(link[i].a),
            .d_q32 = q32_of(link[i].d),
            .alpha_deg_q32 = q32_of(link[i].alpha),
            .theta_deg_q32 = q32_of(link[i].theta),
            .is_prismatic = link[i].slides,
        };
}

/* Lengths as published by P. Corke and P. Armstrong, IEEE ICRA 1994; Universal
 * Robots' own table of the UR5; an AdeptOne's proportions. */
static const struct link puma[6] = {
    { 0, 90, 0, 0, false },          { 431.8, 0, 0, 0, false },
    { 20.3, -90, 150.05, 0, false }, { 0, 90, 431.8, 0, false },
    { 0, -90, 0, 0, false },         { 0, 0, 0, 0, false }
};
static const struct link ur5[6] = {
    { 0, 90, 89.159, 0, false }, { -425, 0, 0, 0, false },
    { -392.25, 0, 0, 0, false }, { 0, 90, 109.15, 0, false },
    { 0, -90, 94.65, 0, false }, { 0, 0, 82.3, 0, false }
};
static const struct link scara[4] = { { 425, 0, 877, 0, false },
                                      { 375, 180, 0, 0, false },
                                      { 0, 0, 20, 0, true },
                                      { 0, 0, 10, 0, false } };

static void random_arm(struct motion_arm *arm, uint32_t count)
{
    struct link link[MOTION_ARM_JOINTS_MAX];

    for (uint32_t i = 0; i < count; i++)
        link[i] = (struct link){ uniform(-400, 400), uniform(-180, 180),
                                 uniform(-400, 400), uniform(-180, 180),
                                 draw() % 4 == 0 };
    arm_of(arm, link, count);
}

static void random_joints(int64_t *joint_q32, double most)
{
    for (int i = 0; i < MOTION_ARM_JOINTS_MAX; i++)
        joint_q32[i] = q32_of(uniform(-most, most));
}

/* --- an oracle in double -------------------------------------------------- */

struct frame {
    double m[3][4];
};

static struct frame oracle(const struct motion_arm *arm,
                           const int64_t *joint_q32)
{
    struct frame t = { { { 1 }, { 0, 1 }, { 0, 0, 1 } } };

    for (uint32_t n = 0; n < arm->count; n++) {
        const struct motion_arm_joint *const j = &arm->joint[n];
        const double at = from_q32(joint_q32[n]), a = from_q32(j->a_q32),
                     d = from_q32(j->d_q32) + (j->is_prismatic ? at : 0),
                     theta = (from_q32(j->theta_deg_q32) +
                              (j->is_prismatic ? 0 : at)) /
                             DEG,
                     alpha = from_q32(j->alpha_deg_q32) / DEG;
        const double ct = cos(theta), st = sin(theta), ca = cos(alpha),
                     sa = sin(alpha);
        const double link[4][4] = { { ct, -st * ca, st * sa, a * ct },
                                    { st, ct * ca, -ct * sa, a * st },
                                    { 0, sa, ca, d },
                                    { 0, 0, 0, 1 } };
        struct frame next = { { { 0 } } };

        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 4; k++)
                for (int l = 0; l < 4; l++)
                    next.m[i][k] += t.m[i][l] * link[l][k];
        t = next;
    }
    return t;
}

static double component(struct motion_quat q, int row, int column)
{
    struct motion_dir axis = { { 0, 0, 0 } };

    axis.q62[column] = (int64_t)1 << 62;
    return ldexp((double)motion_quat_turn(q, axis).q62[row], -62);
}

static void flanges_are_where_the_matrices_say(void **state)
{
    (void)state;
    seed_from(__func__);
    for (int n = 0; n < ROUNDS; n++) {
        int64_t joint_q32[MOTION_ARM_JOINTS_MAX];
        struct motion_pose flange;
        struct motion_arm arm;

        random_arm(&arm, 1 + (uint32_t)n % MOTION_ARM_JOINTS_MAX);
        random_joints(joint_q32, 700);
        assert_int_equal(motion_arm_flange(&arm, joint_q32, &flange),
                         MOTION_OK);
        const struct frame want = oracle(&arm, joint_q32);
        for (int i = 0; i < 3; i++) {
            assert_true(fabs(number_of(flange.origin.x[i]) - want.m[i][3]) <
                        1e-8);
            for (int k = 0; k < 3; k++)
                assert_true(fabs(component(flange.q, i, k) - want.m[i][k]) <
                            1e-11);
        }
    }
}

static void the_camera_rides_on_the_flange(void **state)
{
    const struct motion_arm_tool tool = { vec_of(10, -20, 30),
                                          MOTION_QUAT_ONE };
    int64_t joint_q32[MOTION_ARM_JOINTS_MAX];
    struct motion_camera camera;
    struct motion_arm arm;

    (void)state;
    seed_from(__func__);
    arm_of(&arm, ur5, 6);
    random_joints(joint_q32, 300);
    assert_int_equal(motion_arm_camera(&arm, &tool, joint_q32, &camera),
                     MOTION_OK);
    const struct frame t = oracle(&arm, joint_q32);
    for (int i = 0; i < 3; i++) {
        const double want =
            t.m[i][3] + 10 * t.m[i][0] - 20 * t.m[i][1] + 30 * t.m[i][2];
        assert_true(fabs(number_of(camera.pupil.x[i]) - want) < 1e-8);
        assert_true(fabs(component(camera.q, i, 2) - t.m[i][2]) < 1e-11);
    }
}

/* w of column n from the rotation's change: the antisymmetric part of dR R^T. */
static double turning(const struct frame *a, const struct frame *b, int axis)
{
    const int j = (axis + 1) % 3, k = (axis + 2) % 3;
    double sum = 0;

    for (int l = 0; l < 3; l++)
        sum += (b->m[k][l] - a->m[k][l]) * (a->m[j][l] + b->m[j][l]) / 2;
    return sum;
}

static void jacobians_are_derivatives(void **state)
{
    (void)state;
    seed_from(__func__);
    for (int n = 0; n < ROUNDS; n++) {
        int64_t joint_q32[MOTION_ARM_JOINTS_MAX];
        struct motion_arm_jacobian jacobian;
        struct motion_pose flange;
        struct motion_arm arm;

        random_arm(&arm, 6);
        random_joints(joint_q32, 300);
        assert_int_equal(
            motion_arm_jacobian(&arm, joint_q32, &flange, &jacobian),
            MOTION_OK);
        for (uint32_t i = 0; i < arm.count; i++) {
            const double step = 1.0 / 256; /* degrees, or units */
            const double by = 2 * step / (arm.joint[i].is_prismatic ? 1 : DEG);
            int64_t there_q32[MOTION_ARM_JOINTS_MAX];
            memcpy(there_q32, joint_q32, sizeof there_q32);
            there_q32[i] = joint_q32[i] - q32_of(step);
            const struct frame a = oracle(&arm, there_q32);
            there_q32[i] = joint_q32[i] + q32_of(step);
            const struct frame b = oracle(&arm, there_q32);
            for (int k = 0; k < 3; k++) {
                const double v = (b.m[k][3] - a.m[k][3]) / by,
                             w = turning(&a, &b, k) / by;
                assert_true(fabs(number_of(jacobian.column[i][k]) - v) < 1e-4);
                assert_true(fabs(number_of(jacobian.column[i][3 + k]) - w) <
                            1e-7);
            }
        }
    }
}

/* --- inverse -------------------------------------------------------------- */

static void assert_meets(const struct motion_arm *arm,
                         const struct motion_pose *want,
                         const int64_t *joint_q32)
{
    struct motion_pose got;
    struct motion_quat q;

    assert_int_equal(motion_arm_flange(arm, joint_q32, &got), MOTION_OK);
    assert_true(number_of(motion_vec_length(
                    motion_vec_sub(got.origin, want->origin))) < 1e-6);
    q = motion_quat_mul(got.q, motion_quat_inverse(want->q));
    assert_true(hypot(hypot(ldexp((double)q.x, -62), ldexp((double)q.y, -62)),
                      ldexp((double)q.z, -62)) < 2e-9);
}

/* Smallest over largest column of what is left of each after those before: how
 * far the joints are from a singular place. */
static double independence(const struct motion_arm *arm,
                           const int64_t *joint_q32)
{
    struct motion_arm_jacobian jacobian;
    struct motion_pose flange;
    double base[MOTION_ARM_JOINTS_MAX][6], least = 1;

    assert_int_equal(motion_arm_jacobian(arm, joint_q32, &flange, &jacobian),
                     MOTION_OK);
    for (uint32_t i = 0; i < arm->count; i++) {
        double all = 0, rest = 0;
        for (int k = 0; k < 6; k++) {
            base[i][k] = number_of(jacobian.column[i][k]) /
                         (k < 3 && !arm->joint[i].is_prismatic ? 500 : 1);
            all += base[i][k] * base[i][k];
        }
        for (uint32_t j = 0; j < i; j++) {
            double dot = 0;
            for (int k = 0; k < 6; k++)
                dot += base[i][k] * base[j][k];
            for (int k = 0; k < 6; k++)
                base[i][k] -= dot * base[j][k];
        }
        for (int k = 0; k < 6; k++)
            rest += base[i][k] * base[i][k];
        for (int k = 0; k < 6; k++)
            base[i][k] /= sqrt(rest);
        least = fmin(least, sqrt(rest / all));
    }
    return least;
}

/* Where the flange is for those joints, and joints for it, from `start`. */
static void there_and_back(int round, const struct motion_arm *arm,
                           const int64_t *joint_q32, struct motion_pose *flange,
                           const int64_t *start_q32, int64_t *got_q32)
{
    assert_int_equal(motion_arm_flange(arm, joint_q32, flange), MOTION_OK);
    const int err = motion_arm_inverse(arm, flange, start_q32, got_q32);
    if (err != MOTION_OK)
        fail_msg("round %d: %s", round, motion_err_text(err));
}

static void joints_are_found_again(void **state)
{
    static const struct {
        const struct link *link;
        uint32_t count;
    } arms[] = { { puma, 6 }, { ur5, 6 }, { scara, 4 } };
    unsigned checked = 0;

    (void)state;
    seed_from(__func__);
    for (int n = 0; n < 3 * ROUNDS; n++) {
        int64_t joint_q32[MOTION_ARM_JOINTS_MAX],
            start_q32[MOTION_ARM_JOINTS_MAX], got_q32[MOTION_ARM_JOINTS_MAX];
        struct motion_pose flange;
        struct motion_arm arm;

        arm_of(&arm, arms[n % 3].link, arms[n % 3].count);
        random_joints(joint_q32, 500);
        if (independence(&arm, joint_q32) < 0.1)
            continue; /* another branch is near */
        for (uint32_t i = 0; i < arm.count; i++)
            start_q32[i] = joint_q32[i] + q32_of(uniform(-4, 4));
        there_and_back(n, &arm, joint_q32, &flange, start_q32, got_q32);
        for (uint32_t i = 0; i < arm.count; i++) {
            if (!(fabs(from_q32(got_q32[i] - joint_q32[i])) < 2e-8))
                fail_msg("round %d: joint %u is %.9f, not %.9f", n, i + 1,
                         from_q32(got_q32[i]), from_q32(joint_q32[i]));
        }
        checked++;
    }
    assert_true(checked > ROUNDS);
}

/* More than three sliding joints leave a rotation to chance. */
static bool is_able(const struct motion_arm *arm)
{
    int sliding = 0;

    for (uint32_t i = 0; i < arm->count; i++)
        sliding += arm->joint[i].is_prismatic;
    return sliding <= 3;
}

/* From starts that have nothing to do with the pose. */
static void poses_of_any_arm_are_met(void **state)
{
    (void)state;
    seed_from(__func__);
    for (int n = 0; n < ROUNDS / 10; n++) {
        int64_t joint_q32[MOTION_ARM_JOINTS_MAX],
            start_q32[MOTION_ARM_JOINTS_MAX], got_q32[MOTION_ARM_JOINTS_MAX];
        struct motion_pose flange;
        struct motion_arm arm;

        do
            random_arm(&arm, 6 + (uint32_t)n % 3);
        while (!is_able(&arm));
        random_joints(joint_q32, 170);
        random_joints(start_q32, 170);
        there_and_back(n, &arm, joint_q32, &flange, start_q32, got_q32);
        assert_meets(&arm, &flange, got_q32);
    }
}

/* A rail below, say: it stays where it starts, whatever else could be. */
static void fixed_joints_stay(void **state)
{
    unsigned met = 0;

    (void)state;
    seed_from(__func__);
    for (int n = 0; n < ROUNDS / 10; n++) {
        int64_t joint_q32[MOTION_ARM_JOINTS_MAX],
            start_q32[MOTION_ARM_JOINTS_MAX], got_q32[MOTION_ARM_JOINTS_MAX];
        struct motion_pose flange;
        struct motion_arm arm;

        do
            random_arm(&arm, 7 + (uint32_t)n % 2);
        while (!is_able(&arm));
        random_joints(joint_q32, 170);
        random_joints(start_q32, 170);
        for (uint32_t i = 0; i < arm.count - 6; i++) {
            const uint32_t k = i == 0 ? (uint32_t)n % 7 : 7;
            arm.joint[k].is_fixed = true;
            start_q32[k] = joint_q32[k];
        }
        assert_int_equal(motion_arm_flange(&arm, joint_q32, &flange),
                         MOTION_OK);
        if (motion_arm_inverse(&arm, &flange, start_q32, got_q32) < 0)
            continue;
        met++;
        for (uint32_t i = 0; i < arm.count; i++)
            if (arm.joint[i].is_fixed)
                assert_int_equal(got_q32[i], joint_q32[i]);
        assert_meets(&arm, &flange, got_q32);
    }
    print_message("%u of %d poses met\n", met, ROUNDS / 10);
    assert_true(met > ROUNDS / 10 * 9 / 10);
}

static void all_answers_are_found(void **state)
{
    static const struct {
        const struct link *link;
        uint32_t count;
        double joint[6];
        int answers;
    } rows[] = {
        { puma, 6, { 13.8, -8.7, -11.4, 45.8, 53.8, -31.8 }, 8 },
        { ur5, 6, { -28.2, -85.4, 76.3, -66.2, -81.9, 57.2 }, 8 },
        { scara, 4, { -30, 62.2, 92.8, 15.6 }, 2 },
    };

    (void)state;
    for (size_t n = 0; n < ARRAY_LEN(rows); n++) {
        struct motion_arm_answer answer[16];
        int64_t joint_q32[MOTION_ARM_JOINTS_MAX] = { 0 };
        struct motion_pose flange;
        struct motion_arm arm;
        double last = 0;

        arm_of(&arm, rows[n].link, rows[n].count);
        for (uint32_t i = 0; i < arm.count; i++)
            joint_q32[i] = q32_of(rows[n].joint[i]);
        assert_int_equal(motion_arm_flange(&arm, joint_q32, &flange),
                         MOTION_OK);
        assert_int_equal(
            motion_arm_answers(&arm, &flange, joint_q32, 16, answer),
            rows[n].answers);
        for (int k = 0; k < rows[n].answers; k++) {
            double far = 0;
            assert_meets(&arm, &flange, answer[k].joint_q32);
            for (uint32_t i = 0; i < arm.count; i++)
                far += pow(from_q32(answer[k].joint_q32[i] - joint_q32[i]), 2);
            assert_true(k == 0 ? far < 1e-14 : far > last);
            last = far;
        }
        /* no room for more than the two nearest */
        assert_int_equal(
            motion_arm_answers(&arm, &flange, joint_q32, 2, answer), 2);
    }
}

/* The pose that 40 degrees of joint 1 reach, with joint 1 held below or above. */
static void limits_choose_the_branch(void **state)
{
    int64_t joint_q32[MOTION_ARM_JOINTS_MAX] = { q32_of(40),  q32_of(-20),
                                                 q32_of(-30), q32_of(20),
                                                 q32_of(50),  q32_of(10) };
    int64_t got_q32[MOTION_ARM_JOINTS_MAX];
    struct motion_pose flange;
    struct motion_arm arm;

    (void)state;
    arm_of(&arm, puma, 6);
    assert_int_equal(motion_arm_flange(&arm, joint_q32, &flange), MOTION_OK);
    arm.joint[0].is_limited = true;
    arm.joint[0].low_q32 = q32_of(-180);
    arm.joint[0].high_q32 = q32_of(39);
    assert_int_equal(motion_arm_inverse(&arm, &flange, joint_q32, got_q32),
                     MOTION_OK);
    assert_meets(&arm, &flange, got_q32);
    assert_true(got_q32[0] <= arm.joint[0].high_q32);
    arm.joint[0].low_q32 = q32_of(390); /* a whole turn on */
    arm.joint[0].high_q32 = q32_of(405);
    assert_int_equal(motion_arm_inverse(&arm, &flange, joint_q32, got_q32),
                     MOTION_OK);
    assert_true(fabs(from_q32(got_q32[0]) - 400) < 1e-7);
    arm.joint[0].low_q32 = q32_of(41);
    arm.joint[0].high_q32 = q32_of(42);
    assert_int_equal(motion_arm_inverse(&arm, &flange, joint_q32, got_q32),
                     MOTION_E_UNREACHABLE);
    arm.joint[0].high_q32 = q32_of(40);
    assert_int_equal(motion_arm_inverse(&arm, &flange, joint_q32, got_q32),
                     MOTION_E_ARG);
}

static void poses_out_of_reach_are_refused(void **state)
{
    int64_t joint_q32[MOTION_ARM_JOINTS_MAX] = { 0 };
    struct motion_pose flange = { vec_of(5000, 0, 0), MOTION_QUAT_ONE };
    struct motion_arm arm;

    (void)state;
    arm_of(&arm, puma, 6);
    assert_int_equal(motion_arm_inverse(&arm, &flange, joint_q32, joint_q32),
                     MOTION_E_UNREACHABLE);
    arm.count = 0;
    assert_int_equal(motion_arm_inverse(&arm, &flange, joint_q32, joint_q32),
                     MOTION_E_ARG);
    arm.count = MOTION_ARM_JOINTS_MAX + 1;
    assert_int_equal(motion_arm_flange(&arm, joint_q32, &flange), MOTION_E_ARG);
}

/* Joint 5 at 0: joints 4 and 6 turn about one line. */
static void singular_places_are_named(void **state)
{
    int64_t joint_q32[MOTION_ARM_JOINTS_MAX] = { q32_of(10),  q32_of(-20),
                                                 q32_of(-30), q32_of(20),
                                                 0,           q32_of(10) };
    int64_t got_q32[MOTION_ARM_JOINTS_MAX];
    struct motion_pose flange;
    struct motion_arm arm;

    (void)state;
    arm_of(&arm, puma, 6);
    assert_int_equal(motion_arm_flange(&arm, joint_q32, &flange), MOTION_OK);
    assert_int_equal(motion_arm_inverse(&arm, &flange, joint_q32, got_q32),
                     MOTION_E_SINGULAR);
}

/* The ends of every format, which leave no joint to go to but crash nothing. */
static void the_ends_of_the_range_are_survived(void **state)
{
    static const int64_t ends[] = { INT64_MIN, INT64_MAX, -1, 0, 1 };

    (void)state;
    seed_from(__func__);
    for (int n = 0; n < ROUNDS / 10; n++) {
        int64_t joint_q32[MOTION_ARM_JOINTS_MAX];
        struct motion_arm_answer answer;
        struct motion_pose flange;
        struct motion_arm arm;

        random_arm(&arm, 6);
        for (int i = 0; i < MOTION_ARM_JOINTS_MAX; i++) {
            joint_q32[i] = ends[draw() % ARRAY_LEN(ends)];
            arm.joint[i].a_q32 = ends[draw() % ARRAY_LEN(ends)];
            arm.joint[i].d_q32 = ends[draw() % ARRAY_LEN(ends)];
            arm.joint[i].alpha_deg_q32 = ends[draw() % ARRAY_LEN(ends)];
            arm.joint[i].is_limited = draw() & 1;
            arm.joint[i].low_q32 = INT64_MIN;
            arm.joint[i].high_q32 = INT64_MAX;
        }
        assert_int_equal(motion_arm_flange(&arm, joint_q32, &flange),
                         MOTION_OK);
        flange.origin = random_point(1e9);
        (void)motion_arm_answers(&arm, &flange, joint_q32, 1, &answer);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(flanges_are_where_the_matrices_say),
        cmocka_unit_test(the_camera_rides_on_the_flange),
        cmocka_unit_test(jacobians_are_derivatives),
        cmocka_unit_test(joints_are_found_again),
        cmocka_unit_test(poses_of_any_arm_are_met),
        cmocka_unit_test(fixed_joints_stay),
        cmocka_unit_test(all_answers_are_found),
        cmocka_unit_test(limits_choose_the_branch),
        cmocka_unit_test(poses_out_of_reach_are_refused),
        cmocka_unit_test(singular_places_are_named),
        cmocka_unit_test(the_ends_of_the_range_are_survived),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
