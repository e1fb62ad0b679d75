/* motion/plan/camera/plan_tool.c - see plan_tool.h. */
#include "motion/plan/camera/plan_tool.h"

#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/camera/plan_along.h"
#include "motion/plan/camera/plan_tool_look.h"
#include "motion/plan/rig/plan_arm.h"

/* A joint that turns by more from row to row has gone to another branch. */
#define TOOL_JUMP       0.7 /* rad */
#define TOOL_CIRCLE_Q32 ((int64_t)360 << 32)

struct tool_row {
    double joint[MOTION_ARM_JOINTS_MAX];
};

struct tool {
    const struct plan_path *path;
    const struct plan_arm *arm;
    const struct motion_track *track; /* of the move: of the joints with keys */
    struct plan_along along;
    struct plan_tool_look look;
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
    case MOTION_E_RANGE:
        return "the tool comes to the point that it looks at";
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

/* What the path does not drive, it follows. */
static int tool_open(void *context, const struct plan_drive *drive)
{
    struct tool *self = context;

    for (uint32_t i = 0; i < self->arm->arm.count; i++)
        if (self->arm->arm.joint[i].is_fixed)
            plan_along_cause(&self->along,
                             &self->track[self->arm->axis[i].axis]);
    return plan_tool_look_init(&self->look, &self->path->tool, drive,
                               &self->along);
}

static int tool_pose(const struct tool *self, int64_t t, int side,
                     struct plan_rig_camera *camera)
{
    for (int i = 0; i < PLAN_SPACE_AXES; i++)
        camera->pupil.x[i] = plan_rig_track(&self->along.place[i], t, side);
    return plan_tool_look_frame(&self->look, t, side, camera->pupil,
                                &camera->frame);
}

/* Joint i with its keys. */
static struct plan_jet tool_keyed(const struct tool *self, uint32_t i,
                                  int64_t t, int side)
{
    return plan_arm_joint(
        self->arm, i,
        plan_rig_track(&self->track[self->arm->axis[i].axis], t, side));
}

/* ---- joints -------------------------------------------------------------- */

/* The flange, from the base, when the tool is there: its rotation by columns, in
 * integers. */
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
    q = motion_quat_mul(q, motion_quat_inverse(self->arm->tool.q));
    pupil = motion_vec_sub(pupil, motion_mount_turn(q, self->arm->tool.pupil));
    const struct motion_pose *base = &self->arm->base;
    const struct motion_quat back = motion_quat_inverse(base->q);
    flange->q = motion_quat_mul(back, q);
    flange->origin =
        motion_mount_turn(back, motion_vec_sub(pupil, base->origin));
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
    for (uint32_t i = 0; i < self->arm->arm.count; i++) {
        const struct plan_jet near =
            self->arm->arm.joint[i].is_fixed
                ? tool_keyed(self, i, 0, MOTION_BAKE_RIGHT)
                : plan_arm_joint(
                      self->arm, i,
                      plan_jet_of(
                          ldexp((double)self->path->tool.near_q32[i], -32)));
        near_q32[i] = plan_arm_joint_q32(self->arm, i, near.p);
    }
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
        joint[i] = self->arm->arm.joint[i].is_fixed
                       ? tool_keyed(self, i, t, side)
                       : plan_jet_of(before[i]);
    if (err == MOTION_OK)
        err = plan_arm_follow(self->arm, &camera, joint);
    for (uint32_t i = 0; i < self->arm->arm.count && err == MOTION_OK; i++)
        if (!self->arm->arm.joint[i].is_prismatic &&
            !self->arm->arm.joint[i].is_fixed &&
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

/* Whole turns with which low .. high, radian, fits the limits of a joint, the
 * fewest; 0 where none do. */
static double tool_turns(const struct plan_arm *arm, uint32_t i, double low,
                         double high)
{
    const struct motion_arm_joint *joint = &arm->arm.joint[i];
    const double turn = plan_arm_joint_of_q32(arm, i, TOOL_CIRCLE_Q32),
                 min = plan_arm_joint_of_q32(arm, i, joint->low_q32),
                 max = plan_arm_joint_of_q32(arm, i, joint->high_q32);
    const double least = ceil((min - low) / turn),
                 most = floor((max - high) / turn);

    if (joint->is_prismatic || joint->is_fixed || !joint->is_limited ||
        least > most)
        return 0;
    return turn * (least > 0 ? least : most < 0 ? most : 0);
}

/* All rows by the whole turns with which the joints stay within their limits. */
static void tool_fit(struct tool *self)
{
    for (uint32_t i = 0; i < self->arm->arm.count; i++) {
        double low = self->row[0].joint[i], high = low;
        for (uint32_t n = 1; n <= self->along.rows; n++) {
            low = fmin(low, self->row[n].joint[i]);
            high = fmax(high, self->row[n].joint[i]);
        }
        const double turns = tool_turns(self->arm, i, low, high);
        for (uint32_t n = 0; n <= self->along.rows; n++)
            self->row[n].joint[i] += turns;
    }
}

static int tool_row(void *context, uint32_t row, int64_t t)
{
    struct tool *self = context;
    struct plan_jet joint[MOTION_ARM_JOINTS_MAX];
    const int err = tool_find(self, t, MOTION_BAKE_LEFT,
                              self->row[row > 0 ? row - 1 : 0].joint, joint);

    for (uint32_t k = 0; k < self->arm->arm.count && err == MOTION_OK; k++)
        self->row[row].joint[k] = joint[k].p;
    if (err == MOTION_OK && row == self->along.rows)
        tool_fit(self);
    return err;
}

static int tool_at(void *context, int64_t t, enum motion_bake_side side,
                   struct motion_bake_point point[])
{
    struct tool *self = context;
    struct plan_jet joint[MOTION_ARM_JOINTS_MAX];
    uint32_t n = 0;
    const int err = tool_find(
        self, t, side, self->row[plan_along_row(&self->along, t)].joint, joint);

    for (uint32_t i = 0; i < self->arm->arm.count && err == MOTION_OK; i++)
        if (!self->arm->arm.joint[i].is_fixed)
            point[n++] = plan_bake_point(plan_arm_axis(self->arm, i, joint[i]));
    return err;
}

int plan_tool_tracks(const struct plan_path *path, struct plan_drive *drive,
                     struct motion_track track[], int64_t *bound_q32,
                     struct plan_error *error)
{
    struct motion_track *list[MOTION_ARM_JOINTS_MAX];
    uint32_t axes = 0;
    struct tool self = {
        .path = path,
        .arm = &path->carrier->arm,
        .track = track,
        .along = { .path = path,
                   .error = error,
                   .context = &self,
                   .open = tool_open,
                   .begin = tool_begin,
                   .row = tool_row,
                   .at = tool_at,
                   .refusal = tool_refusal },
    };

    for (uint32_t i = 0; i < self.arm->arm.count; i++)
        if (!self.arm->arm.joint[i].is_fixed)
            list[axes++] = &track[self.arm->axis[i].axis];
    const int err =
        plan_along_tracks(&self.along, drive, list, axes, bound_q32);
    plan_tool_look_free(&self.look);
    free(self.row);
    return err;
}
