/* motion/plan/camera/plan_tool_look.c - see plan_tool_look.h. */
#include "motion/plan/camera/plan_tool_look.h"

#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/path/path.h"
#include "motion/plan/camera/plan_stencil.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/plan_track.h"

/* A view so near to the vertical has no horizon. */
#define LOOK_POLE 1e-6
/* Steps of the stencil in a span from key to key, and its longest. */
#define LOOK_STEPS    64
#define LOOK_STEP_MAX (MOTION_FIXED_S_Q12 >> 10)

/* ---- directions ---------------------------------------------------------- */

static struct plan_jet_vec look_dir(struct motion_dir dir)
{
    double x[3];

    for (int i = 0; i < 3; i++)
        x[i] = ldexp((double)dir.q62[i], -62);
    return plan_jet_vec_of(x);
}

static struct plan_jet_vec look_cross(struct plan_jet_vec a,
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
static bool look_unit(struct plan_jet_vec *v, double least)
{
    const struct plan_jet square = plan_jet_vec_dot(*v, *v);

    if (!(square.p > least * least))
        return false;
    *v = plan_jet_vec_mul(*v, plan_jet_invert(plan_jet_sqrt(square)));
    return true;
}

/* Along `forward`, with its horizon level. */
static int look_level(struct plan_jet_vec forward, struct plan_rig_frame *frame)
{
    static const double up[3] = { 0, 0, 1 };

    frame->forward = forward;
    if (!look_unit(&frame->forward,
                   ldexp((double)MOTION_KINEMATICS_NEAR_Q32, -32)))
        return MOTION_E_SINGULAR;
    frame->left = look_cross(plan_jet_vec_of(up), frame->forward);
    if (!look_unit(&frame->left, LOOK_POLE))
        return MOTION_E_SINGULAR;
    frame->up = look_cross(frame->forward, frame->left);
    return MOTION_OK;
}

/* Clockwise, as it is seen along the view. */
static void look_roll(struct plan_jet roll, struct plan_rig_frame *frame)
{
    const struct plan_jet s = plan_jet_sin(roll), c = plan_jet_cos(roll);
    const struct plan_jet_vec left = frame->left, up = frame->up;

    frame->left =
        plan_jet_vec_add(plan_jet_vec_mul(left, c), plan_jet_vec_mul(up, s));
    frame->up =
        plan_jet_vec_sub(plan_jet_vec_mul(up, c), plan_jet_vec_mul(left, s));
}

/* ---- what turns it ------------------------------------------------------- */

/* From key to key; before the first and after the last it stands. */
static int look_keys(const struct plan_tool_look *self, int64_t t, int side,
                     struct plan_rig_frame *frame)
{
    const struct motion_orient *orient = &self->turning.orient;
    const int64_t first = orient->key[0].t,
                  last = orient->key[orient->count - 1].t;
    struct motion_quat turn[PLAN_STENCIL_NODES];
    struct plan_stencil stencil = { 0, t, 0 };
    double h = 1; /* s */
    int err = MOTION_OK;

    if (side > 0 ? t >= first && t < last : t > first && t <= last) {
        const uint32_t span =
            motion_bake_span(self->time_ns_q12, orient->count - 1, t,
                             side > 0 ? MOTION_BAKE_RIGHT : MOTION_BAKE_LEFT);
        const int64_t low = orient->key[span].t, high = orient->key[span + 1].t;
        const int64_t step = (high - low) / LOOK_STEPS;
        stencil = plan_stencil_at(
            low, high, step < LOOK_STEP_MAX ? step : LOOK_STEP_MAX, t);
        h = (double)stencil.step / (double)MOTION_FIXED_S_Q12;
    }
    for (int i = 0; i < PLAN_STENCIL_NODES && err == MOTION_OK; i++) {
        turn[i] = MOTION_QUAT_ONE;
        err =
            motion_orient_at(orient, stencil.from + i * stencil.step, &turn[i]);
        turn[i] = motion_quat_mul(self->mount, turn[i]);
    }
    if (err == MOTION_OK)
        plan_stencil_frame(&stencil, turn, h, frame);
    return err;
}

/* By distance, to by time: the chain rule, and a Taylor step from where it was
 * looked, which is beside a break. */
static void look_by_time(struct plan_jet_vec *v, struct plan_jet s, double off)
{
    for (int i = 0; i < 3; i++) {
        const struct plan_jet by = v->x[i];
        v->x[i] = (struct plan_jet){ by.p + by.v * off, by.v * s.v,
                                     by.a * s.v * s.v + by.v * s.a };
    }
}

static int look_view(const struct plan_tool_look *self, int64_t t, int side,
                     struct plan_rig_frame *frame)
{
    const struct plan_jet s = plan_rig_track(&self->drive->law, t, side);
    const uint32_t stretch =
        motion_bake_span(self->break_ns_q12, self->view.breaks - 1, t,
                         side > 0 ? MOTION_BAKE_RIGHT : MOTION_BAKE_LEFT);
    int64_t distance_q32 = llround(ldexp(s.p, 32));
    int err = plan_view_frame(&self->view, stretch, &distance_q32, frame);
    const double off = s.p - ldexp((double)distance_q32, -32);

    if (err < 0)
        return err;
    look_by_time(&frame->forward, s, off);
    look_by_time(&frame->left, s, off);
    look_by_time(&frame->up, s, off);
    return MOTION_OK;
}

int plan_tool_look_frame(const struct plan_tool_look *self, int64_t t_ns_q12,
                         int side, struct plan_jet_vec point,
                         struct plan_rig_frame *frame)
{
    const struct plan_tool *tool = self->tool;
    int err = MOTION_OK;

    if (tool->look == NULL) {
        frame->forward = look_dir(tool->forward);
        frame->up = look_dir(tool->up);
        frame->left = look_cross(frame->up, frame->forward);
        return MOTION_OK;
    }
    if (self->is_view)
        err = look_view(self, t_ns_q12, side, frame);
    else if (tool->look->look == PLAN_LOOK_KEYS)
        err = look_keys(self, t_ns_q12, side, frame);
    else
        err = look_level(
            plan_jet_vec_sub(
                plan_keyed_subject(&self->keyed, tool->look, t_ns_q12, side),
                point),
            frame);
    if (err == MOTION_OK && tool->look->roll != NULL)
        look_roll(plan_keyed_roll(&self->keyed, t_ns_q12, side), frame);
    return err;
}

/* ---- up and down --------------------------------------------------------- */

static int look_no_memory(const struct plan_tool_look *self)
{
    return plan_error_set(self->error, MOTION_E_FULL, self->tool->look->place,
                          "the tool has no memory");
}

static int look_times(struct plan_tool_look *self, uint32_t count)
{
    self->time_ns_q12 = calloc(count > 0 ? count : 1, sizeof(int64_t));
    return self->time_ns_q12 == NULL ? look_no_memory(self) : MOTION_OK;
}

static int look_open_view(struct plan_tool_look *self)
{
    const struct plan_view *view = &self->view;
    const struct motion_track *law = &self->drive->law;
    int err = plan_view_init(&self->view, self->tool->look, &self->drive->space,
                             self->error);

    if (err == MOTION_OK)
        err = look_times(self, view->borders);
    if (err < 0)
        return err;
    self->break_ns_q12 = calloc(view->breaks, sizeof *self->break_ns_q12);
    if (self->break_ns_q12 == NULL)
        return look_no_memory(self);
    for (uint32_t i = 0; i < view->breaks; i++)
        self->break_ns_q12[i] =
            motion_path_when(law, motion_real_from_q(view->break_q32[i], 32));
    for (uint32_t i = 1; i + 1 < view->borders; i++)
        self->time_ns_q12[self->times++] =
            motion_path_when(law, motion_real_from_q(view->border_q32[i], 32));
    return MOTION_OK;
}

static int look_open_keys(struct plan_tool_look *self)
{
    const struct motion_orient *orient = &self->turning.orient;
    int err = plan_camera_mount(self->tool->look, &self->mount);

    if (err == MOTION_OK)
        err = plan_turning_init(&self->turning, self->tool->look, NULL,
                                self->error);
    if (err == MOTION_OK)
        err = look_times(self, orient->count);
    for (uint32_t i = 0; i < orient->count && err == MOTION_OK; i++)
        self->time_ns_q12[self->times++] = orient->key[i].t;
    return err;
}

int plan_tool_look_init(struct plan_tool_look *self,
                        const struct plan_tool *tool,
                        const struct plan_drive *drive,
                        struct plan_along *along)
{
    const struct plan_camera *look = tool->look;
    int err;

    *self = (struct plan_tool_look){ .tool = tool,
                                     .drive = drive,
                                     .error = along->error };
    plan_keyed_init(&self->keyed);
    if (look == NULL)
        return MOTION_OK;
    self->is_view =
        look->look == PLAN_LOOK_KEYS
            ? look->orient.is_along
            : look->look != PLAN_LOOK_AT && look->look != PLAN_LOOK_SUBJECT;
    err = plan_keyed_open(&self->keyed, look, self->error);
    if (err == MOTION_OK && self->is_view)
        err = look_open_view(self);
    else if (err == MOTION_OK && look->look == PLAN_LOOK_KEYS)
        err = look_open_keys(self);
    if (err < 0)
        return err;
    for (int i = 0; i < PLAN_SPACE_AXES; i++)
        plan_along_cause(along, &self->keyed.subject[i]);
    plan_along_cause(along, &self->keyed.roll);
    along->time_ns_q12 = self->time_ns_q12;
    along->times = self->times;
    return MOTION_OK;
}

void plan_tool_look_free(struct plan_tool_look *self)
{
    plan_keyed_free(&self->keyed);
    plan_turning_free(&self->turning);
    if (self->is_view)
        plan_view_free(&self->view);
    free(self->time_ns_q12);
    free(self->break_ns_q12);
    *self = (struct plan_tool_look){ .time_ns_q12 = NULL };
}
