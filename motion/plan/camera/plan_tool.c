/* motion/plan/camera/plan_tool.c - see plan_tool.h. */
#include "motion/plan/camera/plan_tool.h"

#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/camera/plan_along.h"
#include "motion/plan/rig/plan_arm.h"

/* A joint that turns by more from row to row has gone to another branch. */
#define TOOL_JUMP 0.7 /* rad */
/* A view so near to the vertical has no horizon. */
#define TOOL_POLE 1e-6

struct tool_row {
    double joint[MOTION_ARM_JOINTS_MAX];
};

struct tool {
    const struct plan_path *path;
    const struct plan_arm *arm;
    struct plan_along along;
    struct tool_row *row; /* rows + 1 */
};

static const char *tool_refusal(int err)
{
    switch (err) {
    case MOTION_E_UNREACHABLE:
        return "the path is out of reach of the arm";
    case MOTION_E_LIMIT:
        return "the arm has no answer within the limits of its joints near "
               "the joints that `near` gives";
    case MOTION_E_SINGULAR:
        return "the joints are not determined: the arm is stretched out, or "
               "two of its axes are in line, or the view is vertical";
    case MOTION_E_DISCONTINUITY:
        return "the arm would have to turn over into another branch";
    case MOTION_E_TOLERANCE:
        return "the joints would have to be too fast to be planned: go "
               "slower, or stay away from where the arm is stretched out or "
               "two axes are in line";
    default:
        return NULL;
    }
}

/* ---- where the tool is to be --------------------------------------------- */

static struct plan_jet_vec tool_dir(struct motion_dir dir)
{
    double x[3];

    for (int i = 0; i < 3; i++)
        x[i] = ldexp((double)dir.q62[i], -62);
    return plan_jet_vec_of(x);
}

static struct plan_jet_vec tool_cross(struct plan_jet_vec a,
                                      struct plan_jet_vec b)
{
    struct plan_jet_vec c;

    for (int k = 0; k < 3; k++) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        c.x[k] = plan_jet_sub(plan_jet_mul(a.x[i], b.x[j]),
                              plan_jet_mul(a.x[j], b.x[i]));
    }
    return c;
}

/* Of length 1; false for a vector shorter than `least`. */
static bool tool_unit(struct plan_jet_vec *v, double least)
{
    const struct plan_jet square = plan_jet_vec_dot(*v, *v);

    if (!(square.p > least * least))
        return false;
    *v = plan_jet_vec_mul(*v, plan_jet_invert(plan_jet_sqrt(square)));
    return true;
}

/* Looking along `forward`, with its horizon level. */
static bool tool_level(struct plan_jet_vec forward, double least,
                       struct plan_rig_frame *frame)
{
    static const double up[3] = { 0, 0, 1 };

    frame->forward = forward;
    if (!tool_unit(&frame->forward, least))
        return false;
    frame->left = tool_cross(plan_jet_vec_of(up), frame->forward);
    if (!tool_unit(&frame->left, TOOL_POLE))
        return false;
    frame->up = tool_cross(frame->forward, frame->left);
    return true;
}

static int tool_pose(const struct tool *self, int64_t t, int side,
                     struct plan_rig_camera *camera)
{
    const struct plan_tool *tool = &self->path->tool;
    double at[3];

    for (int i = 0; i < PLAN_SPACE_AXES; i++) {
        camera->pupil.x[i] = plan_rig_track(&self->along.place[i], t, side);
        at[i] = ldexp((double)tool->at_q32[i], -32);
    }
    if (tool->looks)
        return tool_level(plan_jet_vec_sub(plan_jet_vec_of(at), camera->pupil),
                          ldexp((double)MOTION_KINEMATICS_NEAR_Q32, -32),
                          &camera->frame)
                   ? MOTION_OK
                   : MOTION_E_SINGULAR;
    camera->frame.forward = tool_dir(tool->forward);
    camera->frame.up = tool_dir(tool->up);
    camera->frame.left = tool_cross(camera->frame.up, camera->frame.forward);
    return MOTION_OK;
}

/* ---- joints -------------------------------------------------------------- */

/* The flange when the tool is there: its rotation by columns, in integers. */
static int tool_flange(const struct tool *self,
                       const struct plan_rig_camera *camera,
                       struct motion_pose *flange)
{
    const struct plan_rig_frame *frame = &camera->frame;
    struct motion_vec x[3], pupil;
    struct motion_dir dir[3];
    struct motion_quat q = MOTION_QUAT_ONE;
    int err = MOTION_OK;

    for (int i = 0; i < 3; i++) { /* right, up, backwards */
        x[0].x[i] = plan_rig_from_double(-frame->left.x[i].p);
        x[1].x[i] = plan_rig_from_double(frame->up.x[i].p);
        x[2].x[i] = plan_rig_from_double(-frame->forward.x[i].p);
        pupil.x[i] = plan_rig_from_double(camera->pupil.x[i].p);
    }
    for (int i = 0; i < 3 && err == MOTION_OK; i++)
        err = motion_vec_unit(x[i], &dir[i]);
    if (err == MOTION_OK)
        err = motion_quat_from_axes(dir, &q);
    if (err < 0)
        return err;
    flange->q = motion_quat_mul(q, motion_quat_inverse(self->arm->tool.q));
    flange->origin = motion_vec_sub(
        pupil, motion_mount_turn(flange->q, self->arm->tool.pupil));
    return MOTION_OK;
}

/* The joints of the start, by the branch that was asked for. */
static int tool_first(const struct tool *self, double joint[])
{
    int64_t near_q32[MOTION_ARM_JOINTS_MAX], found_q32[MOTION_ARM_JOINTS_MAX];
    struct plan_rig_camera camera;
    struct motion_pose flange;
    int err = tool_pose(self, 0, MOTION_BAKE_RIGHT, &camera);

    if (err == MOTION_OK)
        err = tool_flange(self, &camera, &flange);
    for (uint32_t i = 0; i < self->arm->arm.count; i++)
        near_q32[i] = plan_arm_joint_q32(
            self->arm, i,
            plan_arm_joint(
                self->arm, i,
                plan_jet_of(ldexp((double)self->path->tool.near_q32[i], -32)))
                .p);
    if (err == MOTION_OK)
        err = motion_arm_inverse(&self->arm->arm, &flange, near_q32, found_q32);
    for (uint32_t i = 0; i < self->arm->arm.count && err == MOTION_OK; i++)
        joint[i] = plan_arm_joint_of_q32(self->arm, i, found_q32[i]);
    return err;
}

static int tool_find(const struct tool *self, int64_t t, int side,
                     const double before[], struct plan_jet joint[])
{
    struct plan_rig_camera camera;
    int err = tool_pose(self, t, side, &camera);

    for (uint32_t i = 0; i < self->arm->arm.count; i++)
        joint[i] = plan_jet_of(before[i]);
    if (err == MOTION_OK)
        err = plan_arm_follow(self->arm, &camera, joint);
    for (uint32_t i = 0; i < self->arm->arm.count && err == MOTION_OK; i++)
        if (!self->arm->arm.joint[i].is_prismatic &&
            fabs(joint[i].p - before[i]) > TOOL_JUMP)
            err = MOTION_E_DISCONTINUITY;
    return err;
}

static int tool_begin(void *context)
{
    struct tool *self = context;

    self->row = calloc((size_t)self->along.rows + 1, sizeof *self->row);
    return self->row != NULL ? tool_first(self, self->row[0].joint)
                             : MOTION_E_FULL;
}

static int tool_row(void *context, uint32_t row, int64_t t)
{
    struct tool *self = context;
    struct plan_jet joint[MOTION_ARM_JOINTS_MAX];
    const int err = tool_find(self, t, MOTION_BAKE_LEFT,
                              self->row[row > 0 ? row - 1 : 0].joint, joint);

    for (uint32_t k = 0; k < self->arm->arm.count && err == MOTION_OK; k++)
        self->row[row].joint[k] = joint[k].p;
    return err;
}

static int tool_at(void *context, int64_t t, enum motion_bake_side side,
                   struct motion_bake_point point[])
{
    struct tool *self = context;
    struct plan_jet joint[MOTION_ARM_JOINTS_MAX];
    const int err = tool_find(
        self, t, side, self->row[plan_along_row(&self->along, t)].joint, joint);

    for (uint32_t i = 0; i < self->arm->arm.count && err == MOTION_OK; i++)
        point[i] = plan_bake_point(plan_arm_axis(self->arm, i, joint[i]));
    return err;
}

int plan_tool_tracks(const struct plan_path *path, struct plan_drive *drive,
                     struct motion_track track[], int64_t *bound_q32,
                     struct plan_error *error)
{
    struct motion_track *list[MOTION_ARM_JOINTS_MAX];
    struct tool self = {
        .path = path,
        .arm = &path->carrier->arm,
        .along = { .path = path,
                   .error = error,
                   .context = &self,
                   .begin = tool_begin,
                   .row = tool_row,
                   .at = tool_at,
                   .refusal = tool_refusal },
    };

    for (uint32_t i = 0; i < self.arm->arm.count; i++)
        list[i] = &track[self.arm->axis[i].axis];
    const int err = plan_along_tracks(&self.along, drive, list,
                                      self.arm->arm.count, bound_q32);
    free(self.row);
    return err;
}
