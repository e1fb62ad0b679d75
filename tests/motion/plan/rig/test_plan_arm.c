/* tests/motion/plan/rig/test_plan_arm.c - arms in jets against motion/kinematics,
 * which computes in integers by other formulas, and the joints for a pose against
 * those that made it. */
#include "motion/plan/rig/plan_arm.h"

#include "tests/motion/kinematics/rig_random.h"

#define ARMS 400

static void random_arm(struct plan_arm *arm, uint32_t count)
{
    *arm = (struct plan_arm){ .arm.count = count };
    for (uint32_t i = 0; i < count; i++) {
        struct motion_arm_joint *joint = &arm->arm.joint[i];
        joint->is_prismatic = draw() % 5 == 0;
        joint->a_q32 = q32_of(uniform(-400, 400));
        joint->d_q32 = q32_of(uniform(-200, 200));
        joint->alpha_deg_q32 = q32_of(uniform(-100, 100));
        joint->theta_deg_q32 = q32_of(uniform(-180, 180));
        arm->unit[i] = joint->is_prismatic || draw() % 2 ? 1 : 1 / DEG;
        arm->map[i] = random_map(arm->unit[i] < 1 ? 50 : 1);
    }
    arm->base = (struct motion_pose){ motion_vec_zero(), MOTION_QUAT_ONE };
    arm->tool.pupil = random_point(150);
    while (motion_mount_level(random_point(1), random_point(1), &arm->tool.q) <
           0)
        continue;
}

static void random_joints(const struct plan_arm *arm, struct plan_jet joint[])
{
    for (uint32_t i = 0; i < arm->arm.count; i++) {
        const double by = arm->arm.joint[i].is_prismatic ? 200 : 1.5;
        joint[i] = (struct plan_jet){ uniform(-by, by), uniform(-by, by),
                                      uniform(-by, by) };
    }
}

static double off(struct plan_jet_vec a, struct motion_vec b)
{
    double most = 0;

    for (int i = 0; i < 3; i++)
        most = fmax(most, fabs(a.x[i].p - number_of(b.x[i])));
    return most;
}

static struct motion_vec turned(struct motion_quat q, int axis, int64_t sign)
{
    struct motion_dir dir = { { 0, 0, 0 } };

    dir.q62[axis] = sign * ((int64_t)1 << 62);
    return motion_vec_from_dir(motion_quat_turn(q, dir));
}

static void a_tool_is_where_the_integers_have_it(void **state)
{
    double place = 0, turn = 0, map = 0;

    (void)state;
    seed_from("a_tool_is_where_the_integers_have_it");
    for (unsigned n = 0; n < ARMS; n++) {
        struct plan_arm arm;
        struct plan_jet joint[MOTION_ARM_JOINTS_MAX];
        int64_t q32[MOTION_ARM_JOINTS_MAX];
        struct plan_rig_camera got;
        struct motion_camera want;
        random_arm(&arm, 1 + n % MOTION_ARM_JOINTS_MAX);
        random_joints(&arm, joint);
        for (uint32_t i = 0; i < arm.arm.count; i++) {
            q32[i] = plan_arm_joint_q32(&arm, i, joint[i].p);
            const struct plan_jet back =
                plan_arm_joint(&arm, i, plan_arm_axis(&arm, i, joint[i]));
            map = fmax(
                map,
                fabs(back.p - joint[i].p) + fabs(back.v - joint[i].v) +
                    fabs(plan_arm_joint_of_q32(&arm, i, q32[i]) - joint[i].p));
        }
        assert_int_equal(motion_arm_camera(&arm.arm, &arm.tool, q32, &want),
                         MOTION_OK);
        plan_arm_camera(&arm, joint, &got);
        place = fmax(place, off(got.pupil, want.pupil));
        turn = fmax(turn, off(got.frame.forward, turned(want.q, 2, -1)));
        turn = fmax(turn, off(got.frame.left, turned(want.q, 0, -1)));
        turn = fmax(turn, off(got.frame.up, turned(want.q, 1, 1)));
    }
    print_message("worst: %.2g mm, %.2g\n", place, turn);
    assert_true(place < 1e-5 && turn < 1e-8 && map < 1e-9);
}

/* From joints that are a little off, also of arms with fewer than six. */
static void joints_are_found_again_with_their_rates(void **state)
{
    double p = 0, v = 0, a = 0;
    unsigned found = 0, refused = 0;

    (void)state;
    seed_from("joints_are_found_again_with_their_rates");
    for (unsigned n = 0; n < ARMS; n++) {
        struct plan_arm arm;
        struct plan_jet was[MOTION_ARM_JOINTS_MAX], is[MOTION_ARM_JOINTS_MAX];
        struct plan_rig_camera camera;
        random_arm(&arm, 3 + n % 4);
        random_joints(&arm, was);
        plan_arm_camera(&arm, was, &camera);
        for (uint32_t i = 0; i < arm.arm.count; i++)
            is[i] = plan_jet_of(was[i].p + uniform(-1e-3, 1e-3));
        if (plan_arm_follow(&arm, &camera, is) < 0) {
            refused++; /* too near to where joints are not determined */
            continue;
        }
        found++;
        for (uint32_t i = 0; i < arm.arm.count; i++) {
            p = fmax(p, fabs(is[i].p - was[i].p));
            v = fmax(v, fabs(is[i].v - was[i].v));
            a = fmax(a, fabs(is[i].a - was[i].a));
        }
    }
    print_message("%u found, %u refused, worst: %.2g %.2g %.2g\n", found,
                  refused, p, v, a);
    assert_true(found > ARMS * 95 / 100);
    assert_true(p < 1e-5 && v < 1e-4 && a < 1e-2);
}

static double off_jet(struct plan_jet_vec a, struct plan_jet_vec b)
{
    double most = 0;

    for (int i = 0; i < 3; i++)
        most = fmax(most, fabs(a.x[i].p - b.x[i].p) / 1e3 +
                              fabs(a.x[i].v - b.x[i].v) / 1e3 +
                              fabs(a.x[i].a - b.x[i].a) / 1e5);
    return most;
}

/* Of arms with seven and eight joints all but six go as they like, and the tool
 * is where it is to be, with its rates, all the same. */
static void fixed_joints_go_their_own_way(void **state)
{
    unsigned found = 0;
    double off = 0;

    (void)state;
    seed_from("fixed_joints_go_their_own_way");
    for (unsigned n = 0; n < ARMS; n++) {
        struct plan_arm arm;
        struct plan_jet was[MOTION_ARM_JOINTS_MAX], is[MOTION_ARM_JOINTS_MAX];
        struct plan_rig_camera want, got;
        random_arm(&arm, 7 + n % 2);
        random_joints(&arm, was);
        plan_arm_camera(&arm, was, &want);
        const uint32_t first = (uint32_t)(draw() % 7);
        for (uint32_t i = 0; i < arm.arm.count; i++) {
            arm.arm.joint[i].is_fixed = i == first || i == 7;
            is[i] = arm.arm.joint[i].is_fixed
                        ? (struct plan_jet){ was[i].p + uniform(-1e-2, 1e-2),
                                             uniform(-1, 1), uniform(-1, 1) }
                        : plan_jet_of(was[i].p);
            was[i] = is[i];
        }
        if (plan_arm_follow(&arm, &want, is) < 0)
            continue;
        found++;
        assert_memory_equal(&is[first], &was[first], sizeof is[first]);
        plan_arm_camera(&arm, is, &got);
        off = fmax(off, off_jet(got.pupil, want.pupil));
        off = fmax(off, off_jet(got.frame.forward, want.frame.forward));
        off = fmax(off, off_jet(got.frame.up, want.frame.up));
    }
    print_message("%u found, worst: %.2g\n", found, off);
    assert_true(found > ARMS * 9 / 10);
    assert_true(off < 1e-6);
}

static void a_pose_out_of_reach_is_refused(void **state)
{
    struct plan_arm arm;
    struct plan_jet joint[MOTION_ARM_JOINTS_MAX];
    struct plan_rig_camera camera;

    (void)state;
    seed_from("a_pose_out_of_reach_is_refused");
    random_arm(&arm, 6);
    for (int i = 0; i < 6; i++)
        arm.arm.joint[i].is_prismatic = false;
    random_joints(&arm, joint);
    plan_arm_camera(&arm, joint, &camera);
    camera.pupil.x[0].p += 9000;
    const int err = plan_arm_follow(&arm, &camera, joint);
    assert_true(err == MOTION_E_UNREACHABLE || err == MOTION_E_SINGULAR);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_tool_is_where_the_integers_have_it),
        cmocka_unit_test(joints_are_found_again_with_their_rates),
        cmocka_unit_test(fixed_joints_go_their_own_way),
        cmocka_unit_test(a_pose_out_of_reach_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
