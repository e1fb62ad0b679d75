/* motion/plan/rig/plan_arm.c - see plan_arm.h. */
#include "motion/plan/rig/plan_arm.h"

#include <float.h>

#include "motion/core/err.h"
#include "motion/double/double_math.h"

#define ARM_ROWS  6 /* of the Jacobian */
#define ARM_STEPS 30
/* A radian of orientation counts as much as so many units of length. */
#define ARM_LENGTH 500.0
/* What is left of a pose that is met; of the largest pivot, below which joints
 * are not determined. */
#define ARM_NEAR_UNIT 1e-6
#define ARM_NEAR_RAD  1e-9
#define ARM_SINGULAR  1e-9
#define ARM_STEP_MAX  0.3 /* rad, of one step */

static double arm_q32(int64_t a)
{
    return ldexp((double)a, -32);
}

struct plan_jet plan_arm_joint(const struct plan_arm *arm, uint32_t i,
                               struct plan_jet axis)
{
    return plan_jet_scale(plan_rig_coordinate(&arm->map[i], axis),
                          arm->unit[i]);
}

struct plan_jet plan_arm_axis(const struct plan_arm *arm, uint32_t i,
                              struct plan_jet joint)
{
    return plan_rig_position(&arm->map[i],
                             plan_jet_scale(joint, 1 / arm->unit[i]));
}

static double arm_degree(const struct plan_arm *arm, uint32_t i)
{
    return arm->arm.joint[i].is_prismatic ? 1 : DOUBLE_RADIAN;
}

int64_t plan_arm_joint_q32(const struct plan_arm *arm, uint32_t i, double joint)
{
    return llround(ldexp(joint / arm_degree(arm, i), 32));
}

double plan_arm_joint_of_q32(const struct plan_arm *arm, uint32_t i,
                             int64_t joint_q32)
{
    return arm_q32(joint_q32) * arm_degree(arm, i);
}

/* ---- forward ------------------------------------------------------------- */

/* x, y, z of a frame, and its origin. */
struct arm_frame {
    struct plan_jet_vec x[3], origin;
};

static void arm_link(const struct motion_arm_joint *link, struct plan_jet joint,
                     struct arm_frame *frame)
{
    struct plan_jet theta =
        plan_jet_of(arm_q32(link->theta_deg_q32) * DOUBLE_RADIAN);
    struct plan_jet d = plan_jet_of(arm_q32(link->d_q32));

    if (link->is_prismatic)
        d = plan_jet_add(d, joint);
    else
        theta = plan_jet_add(theta, joint);
    plan_jet_vec_swing(&frame->x[0], &frame->x[1], theta);
    frame->origin = plan_jet_vec_add(
        frame->origin,
        plan_jet_vec_add(
            plan_jet_vec_mul(frame->x[2], d),
            plan_jet_vec_mul(frame->x[0], plan_jet_of(arm_q32(link->a_q32)))));
    plan_jet_vec_swing(
        &frame->x[1], &frame->x[2],
        plan_jet_of(arm_q32(link->alpha_deg_q32) * DOUBLE_RADIAN));
}

/* A vector of the flange, in space. */
static struct plan_jet_vec arm_of_flange(const struct arm_frame *flange,
                                         struct motion_vec v)
{
    struct plan_jet_vec sum =
        plan_jet_vec_mul(flange->x[0], plan_jet_of(plan_rig_real(v.x[0])));

    for (int i = 1; i < 3; i++)
        sum = plan_jet_vec_add(
            sum,
            plan_jet_vec_mul(flange->x[i], plan_jet_of(plan_rig_real(v.x[i]))));
    return sum;
}

/* Axis of the tool's frame (right, up, backwards), in that of the flange. */
static struct motion_vec arm_tool_axis(const struct plan_arm *arm, int axis,
                                       int64_t sign)
{
    struct motion_dir dir = { { 0, 0, 0 } };

    dir.q62[axis] = sign * ((int64_t)1 << 62);
    return motion_vec_from_dir(motion_quat_turn(arm->tool.q, dir));
}

/* The axes about which, or along which, the joints move, and a point on each. */
struct arm_joints {
    double axis[MOTION_ARM_JOINTS_MAX][3], origin[MOTION_ARM_JOINTS_MAX][3];
};

static struct arm_frame arm_base(const struct motion_pose *base)
{
    struct arm_frame frame;

    for (int i = 0; i < 3; i++) {
        struct motion_dir dir = { { 0, 0, 0 } };
        dir.q62[i] = (int64_t)1 << 62;
        dir = motion_quat_turn(base->q, dir);
        for (int k = 0; k < 3; k++)
            frame.x[i].x[k] = plan_jet_of(ldexp((double)dir.q62[k], -62));
        frame.origin.x[i] = plan_jet_of(plan_rig_real(base->origin.x[i]));
    }
    return frame;
}

static void arm_forward(const struct plan_arm *arm,
                        const struct plan_jet joint[],
                        struct plan_rig_camera *camera,
                        struct arm_joints *joints)
{
    struct arm_frame frame = arm_base(&arm->base);

    for (uint32_t i = 0; i < arm->arm.count; i++) {
        for (int k = 0; k < 3; k++) {
            joints->axis[i][k] = frame.x[2].x[k].p;
            joints->origin[i][k] = frame.origin.x[k].p;
        }
        arm_link(&arm->arm.joint[i], joint[i], &frame);
    }
    camera->pupil =
        plan_jet_vec_add(frame.origin, arm_of_flange(&frame, arm->tool.pupil));
    camera->frame.forward = arm_of_flange(&frame, arm_tool_axis(arm, 2, -1));
    camera->frame.left = arm_of_flange(&frame, arm_tool_axis(arm, 0, -1));
    camera->frame.up = arm_of_flange(&frame, arm_tool_axis(arm, 1, 1));
}

void plan_arm_camera(const struct plan_arm *arm, const struct plan_jet joint[],
                     struct plan_rig_camera *camera)
{
    struct arm_joints joints;

    arm_forward(arm, joint, camera, &joints);
}

/* ---- rates --------------------------------------------------------------- */

/* sum / 2 over the axes e of a frame of e x f(e): of f = the derivative the
 * angular velocity, of the second one the angular acceleration, of the axes of
 * another frame the turn to it, for small turns. */
typedef double arm_part(const struct plan_jet *jet);

static double arm_p(const struct plan_jet *jet)
{
    return jet->p;
}

static double arm_v(const struct plan_jet *jet)
{
    return jet->v;
}

static double arm_a(const struct plan_jet *jet)
{
    return jet->a;
}

static void arm_turn(const struct plan_rig_frame *from,
                     const struct plan_rig_frame *to, arm_part *part,
                     double turn[3])
{
    const struct plan_jet_vec *const e[3] = { &from->forward, &from->left,
                                              &from->up },
                                     *const f[3] = { &to->forward, &to->left,
                                                     &to->up };

    for (int k = 0; k < 3; k++)
        turn[k] = 0;
    for (int n = 0; n < 3; n++)
        for (int k = 0; k < 3; k++) {
            const int i = (k + 1) % 3, j = (k + 2) % 3;
            turn[k] += (e[n]->x[i].p * part(&f[n]->x[j]) -
                        e[n]->x[j].p * part(&f[n]->x[i])) /
                       2;
        }
}

/* Columns of the Jacobian of the pupil, rotations in lengths, of the joints that
 * are not fixed; returns how many. */
static uint32_t arm_columns(const struct plan_arm *arm,
                            const struct plan_rig_camera *at,
                            const struct arm_joints *joints,
                            double column[][ARM_ROWS])
{
    uint32_t count = 0;

    for (uint32_t i = 0; i < arm->arm.count; i++) {
        const double *z = joints->axis[i];
        const bool slides = arm->arm.joint[i].is_prismatic;
        double off[3];
        if (arm->arm.joint[i].is_fixed)
            continue;
        for (int k = 0; k < 3; k++)
            off[k] = at->pupil.x[k].p - joints->origin[i][k];
        for (int k = 0; k < 3; k++) {
            const int m = (k + 1) % 3, n = (k + 2) % 3;
            column[count][k] = slides ? z[k] : z[m] * off[n] - z[n] * off[m];
            column[count][3 + k] = slides ? 0 : ARM_LENGTH * z[k];
        }
        count++;
    }
    return count;
}

/* x with the least squares of column x - rate, by Gram-Schmidt, which does not
 * square the condition; false where x is not determined. */
static bool arm_solve(uint32_t count, double column[][ARM_ROWS],
                      const double rate[ARM_ROWS], double x[])
{
    double base[MOTION_ARM_JOINTS_MAX][ARM_ROWS],
        r[MOTION_ARM_JOINTS_MAX][MOTION_ARM_JOINTS_MAX] = { { 0 } },
        left[ARM_ROWS];

    for (int k = 0; k < ARM_ROWS; k++)
        left[k] = rate[k];
    for (uint32_t j = 0; j < count; j++) {
        double square = 0, whole = 0;
        for (int k = 0; k < ARM_ROWS; k++) {
            base[j][k] = column[j][k];
            whole += column[j][k] * column[j][k];
        }
        for (int twice = 0; twice < 2; twice++)
            for (uint32_t i = 0; i < j; i++) {
                double along = 0;
                for (int k = 0; k < ARM_ROWS; k++)
                    along += base[i][k] * base[j][k];
                for (int k = 0; k < ARM_ROWS; k++)
                    base[j][k] -= along * base[i][k];
                r[i][j] += along;
            }
        for (int k = 0; k < ARM_ROWS; k++)
            square += base[j][k] * base[j][k];
        if (!(square > ARM_SINGULAR * ARM_SINGULAR * whole))
            return false;
        r[j][j] = sqrt(square);
        x[j] = 0;
        for (int k = 0; k < ARM_ROWS; k++) {
            base[j][k] /= r[j][j];
            x[j] += base[j][k] * left[k];
        }
        for (int k = 0; k < ARM_ROWS; k++)
            left[k] -= x[j] * base[j][k];
    }
    for (uint32_t j = count; j-- > 0;) {
        for (uint32_t i = j + 1; i < count; i++)
            x[j] -= r[j][i] * x[i];
        x[j] /= r[j][j];
    }
    return true;
}

/* ---- the joints for a pose ----------------------------------------------- */

/* From where the tool is to where it is to be. */
static void arm_miss(const struct plan_rig_camera *at,
                     const struct plan_rig_camera *to, double miss[ARM_ROWS])
{
    arm_turn(&at->frame, &to->frame, arm_p, miss + 3);
    for (int k = 0; k < 3; k++) {
        miss[k] = to->pupil.x[k].p - at->pupil.x[k].p;
        miss[3 + k] *= ARM_LENGTH;
    }
}

static double arm_norm(const double v[], int n)
{
    double sum = 0;

    for (int i = 0; i < n; i++)
        sum += v[i] * v[i];
    return sqrt(sum);
}

static bool arm_is_there(const struct plan_rig_camera *at,
                         const struct plan_rig_camera *to,
                         const double miss[ARM_ROWS])
{
    const struct plan_jet same =
        plan_jet_vec_dot(at->frame.forward, to->frame.forward);

    return arm_norm(miss, 3) < ARM_NEAR_UNIT && same.p > 0 &&
           arm_norm(miss + 3, 3) < ARM_NEAR_RAD * ARM_LENGTH;
}

/* x of each joint with which the tool goes at a rate; 0 of those that are
 * fixed. */
static int arm_rates(const struct plan_arm *arm, uint32_t count,
                     double column[][ARM_ROWS], const double rate[ARM_ROWS],
                     double x[])
{
    double moving[MOTION_ARM_JOINTS_MAX];
    uint32_t from = 0;

    if (!arm_solve(count, column, rate, moving))
        return MOTION_E_SINGULAR;
    for (uint32_t i = 0; i < arm->arm.count; i++)
        x[i] = arm->arm.joint[i].is_fixed ? 0 : moving[from++];
    return MOTION_OK;
}

/* A step of Newton's method, no longer than it can be trusted. */
static void arm_step(const struct plan_arm *arm, const double x[],
                     struct plan_jet joint[])
{
    double most = 0;

    for (uint32_t i = 0; i < arm->arm.count; i++)
        if (!arm->arm.joint[i].is_prismatic)
            most = fmax(most, fabs(x[i]));
    const double part = most > ARM_STEP_MAX ? ARM_STEP_MAX / most : 1;
    for (uint32_t i = 0; i < arm->arm.count; i++)
        joint[i].p += part * x[i];
}

static int arm_place(const struct plan_arm *arm,
                     const struct plan_rig_camera *camera,
                     struct plan_jet joint[], double column[][ARM_ROWS],
                     uint32_t *count)
{
    struct plan_rig_camera at;
    struct arm_joints joints;
    double miss[ARM_ROWS], x[MOTION_ARM_JOINTS_MAX], before = DBL_MAX;

    for (int step = 0; step < ARM_STEPS; step++) {
        arm_forward(arm, joint, &at, &joints);
        *count = arm_columns(arm, &at, &joints, column);
        arm_miss(&at, camera, miss);
        const double now = arm_norm(miss, ARM_ROWS);
        /* one more step when it is there: rounding is all that is left */
        if (arm_is_there(&at, camera, miss) && !(now < before / 4))
            return MOTION_OK;
        before = now;
        if (arm_rates(arm, *count, column, miss, x) < 0)
            return MOTION_E_SINGULAR;
        arm_step(arm, x, joint);
    }
    return MOTION_E_UNREACHABLE;
}

/* What of a derivative is left to the joints that are not fixed. */
static void arm_left(const struct plan_rig_camera *to,
                     const struct plan_rig_camera *at, arm_part *part,
                     double rate[ARM_ROWS])
{
    double made[3];

    arm_turn(&to->frame, &to->frame, part, rate + 3);
    arm_turn(&at->frame, &at->frame, part, made);
    for (int k = 0; k < 3; k++) {
        rate[k] = part(&to->pupil.x[k]) - part(&at->pupil.x[k]);
        rate[3 + k] = ARM_LENGTH * (rate[3 + k] - made[k]);
    }
}

int plan_arm_follow(const struct plan_arm *arm,
                    const struct plan_rig_camera *camera,
                    struct plan_jet joint[])
{
    double column[MOTION_ARM_JOINTS_MAX][ARM_ROWS], rate[ARM_ROWS],
        x[MOTION_ARM_JOINTS_MAX];
    struct plan_rig_camera at;
    uint32_t count = 0;

    for (uint32_t i = 0; i < arm->arm.count; i++)
        if (!arm->arm.joint[i].is_fixed)
            joint[i].v = joint[i].a = 0;
    int err = arm_place(arm, camera, joint, column, &count);
    if (err < 0)
        return err;
    plan_arm_camera(arm, joint, &at);
    arm_left(camera, &at, arm_v, rate);
    err = arm_rates(arm, count, column, rate, x);
    if (err < 0)
        return err;
    for (uint32_t i = 0; i < arm->arm.count; i++)
        joint[i].v += x[i];
    plan_arm_camera(arm, joint, &at); /* with q'' = 0 of those */
    arm_left(camera, &at, arm_a, rate);
    err = arm_rates(arm, count, column, rate, x);
    for (uint32_t i = 0; i < arm->arm.count && err == MOTION_OK; i++)
        joint[i].a += x[i];
    return err;
}
