/* motion/plan/camera/plan_view.c - see plan_view.h.
 *
 * Derivatives are taken from seven places along the path (plan_stencil.h), which
 * stay between two breaks (plan_view_border.c), so that the two sides of one are
 * told apart.
 *
 * The head's way over the vertical and past half turns depends on how it came
 * there: it is walked once, in even steps along the path, longer ones where it
 * turns slowly, and a place between two goes on from the one before it. */
#include "motion/plan/camera/plan_view.h"

#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/number/trig.h"
#include "motion/plan/camera/plan_stencil.h"
#include "motion/plan/plan_error.h"

/* Steps of the walk along the path, at least, and per piece of its curve: a
 * view may turn a quarter turn in each.  So many places of a derivative are in
 * one of them: the stencil is short beside a piece, as third derivatives may
 * step where two join. */
#define VIEW_ROWS       2048
#define VIEW_PIECE_ROWS 8
#define VIEW_ROW_STEPS  32
/* So many rows are one step at most where the head turns little, in 2^-64 of a
 * turn, from one to the other. */
#define VIEW_SKIPPED 32
#define VIEW_LITTLE  (INT64_C(1) << 59)
/* And so many at least from one break to the next, where a target goes over to
 * another, say. */
#define VIEW_STRETCH_STEPS 64

/* "the camera <what>" */
static int plan_view_fail(const struct plan_view *self, int code,
                          struct plan_place place, const char *what)
{
    return plan_error_set(self->error, code, place, "the camera %s", what);
}

int plan_view_no_memory(const struct plan_view *self)
{
    return plan_view_fail(self, MOTION_E_FULL, self->camera->place,
                          "has no memory");
}
/* --- what is looked at ---------------------------------------------------- */

/* One unit ahead of the path along its tangent: looking there is looking along
 * the path. */
static int view_beyond(const void *context, int64_t distance_q32,
                       struct motion_vec *pos, struct motion_dir *tangent)
{
    struct motion_dir along;
    int err = plan_space_at(context, distance_q32, pos, &along);

    if (err < 0)
        return err;
    *pos = motion_vec_add(*pos, motion_vec_from_dir(along));
    if (tangent != NULL)
        *tangent = along;
    return MOTION_OK;
}

static int64_t view_distance(const struct plan_view *self,
                             const struct plan_distance *distance)
{
    const struct plan_space *space = self->space;
    int64_t result = 0;

    if (motion_real_round(
            plan_speed_law_distance(distance, space->table.length), 32,
            &result) < 0 ||
        result > space->length_q32)
        return space->length_q32;
    return result;
}

static int view_dwells(struct plan_view *self)
{
    const struct plan_camera *camera = self->camera;

    self->dwell = calloc(camera->dwells, sizeof *self->dwell);
    if (self->dwell == NULL)
        return plan_view_no_memory(self);
    for (uint32_t i = 0; i < camera->dwells; i++) {
        const struct plan_dwell *from = &camera->dwell[i];
        struct motion_dwell *to = &self->dwell[i];
        for (int k = 0; k < PLAN_SPACE_AXES; k++)
            to->point_q32[k] = from->point_q32[k];
        to->from_q32 = view_distance(self, &from->from);
        to->to_q32 = view_distance(self, &from->to);
        if (to->to_q32 < to->from_q32 ||
            (i > 0 && to->from_q32 <= to[-1].to_q32))
            return plan_view_fail(
                self, MOTION_E_ORDER, from->place,
                to->to_q32 < to->from_q32
                    ? "ends a dwell before it begins"
                    : "begins a dwell before the one before it "
                      "has ended");
    }
    self->target.dwell = self->dwell;
    self->target.dwells = camera->dwells;
    self->target.ease = camera->ease;
    return MOTION_OK;
}

static int view_target(struct plan_view *self)
{
    static const enum motion_target_kind kind[] = {
        [PLAN_LOOK_AT] = MOTION_TARGET_FIXED,
        [PLAN_LOOK_AHEAD] = MOTION_TARGET_AHEAD,
        [PLAN_LOOK_PATH] = MOTION_TARGET_PATH,
        [PLAN_LOOK_DWELL] = MOTION_TARGET_DWELL,
        [PLAN_LOOK_LEVEL] = MOTION_TARGET_PATH,
    };
    const struct plan_camera *camera = self->camera;
    int err = MOTION_OK;

    self->target = (struct motion_target){
        .kind = kind[camera->look],
        .ahead_q32 = camera->ahead_q32,
        .end = camera->end,
        .path = &self->other,
    };
    for (int i = 0; i < PLAN_SPACE_AXES; i++)
        self->target.point_q32[i] = camera->point_q32[i];
    self->other = self->path;
    if (camera->look == PLAN_LOOK_LEVEL)
        self->other.at = view_beyond;
    if (camera->look == PLAN_LOOK_DWELL)
        return view_dwells(self);
    if (camera->look != PLAN_LOOK_PATH)
        return err;
    err = plan_space_init(&self->other_space, &camera->points, self->error);
    self->other =
        (struct motion_lookat_path){ plan_space_at, &self->other_space,
                                     self->other_space.length_q32 };
    return err;
}

/* --- what turns ----------------------------------------------------------- */

int plan_camera_mount(const struct plan_camera *camera,
                      struct motion_quat *mount)
{
    struct motion_dir axis[3] = { { { 0 } }, camera->up, { { 0 } } };
    struct motion_dir forward;
    int err = motion_dir_perpendicular(camera->forward, camera->up, &forward);

    if (err < 0)
        return err;
    axis[0] = motion_dir_cross(forward, camera->up);
    axis[2] = motion_dir_neg(forward);
    return motion_quat_from_axes(axis, mount);
}

static int view_mount(struct plan_view *self)
{
    const struct plan_camera *camera = self->camera;
    struct motion_quat mount = MOTION_QUAT_ONE;
    int err = plan_camera_mount(camera, &mount);

    if (err < 0)
        return plan_view_fail(self, err, camera->place,
                              "has parallel forward and up");
    self->from_mount = motion_quat_inverse(mount);
    return MOTION_OK;
}

static bool view_is_framed(const struct plan_view *self)
{
    return self->camera->look == PLAN_LOOK_MINIMISING ||
           self->camera->look == PLAN_LOOK_FRENET;
}

/* The rotation at a distance, from the mount; goes on from *state. */
static int view_turn(const struct plan_view *self,
                     struct motion_lookat_state *state, int64_t distance_q32,
                     struct motion_quat *q)
{
    struct motion_view view;
    int err;

    if (self->camera->look == PLAN_LOOK_KEYS)
        return motion_orient_at(&self->turning.orient, distance_q32, q);
    if (view_is_framed(self)) {
        err = plan_frames_at(&self->frames, distance_q32, q);
    } else {
        err = motion_lookat_at(&self->lookat, state, &self->target, &self->path,
                               distance_q32, 0, &view);
        if (err == MOTION_OK)
            *q = motion_view_quat(&view);
    }
    if (err == MOTION_OK)
        *q = motion_quat_mul(self->from_mount, *q);
    return err;
}

/* An error of the walk, as a sentence. */
int plan_view_refuse(const struct plan_view *self, int err)
{
    const struct plan_place place = self->camera->look_place;

    if (self->camera->look == PLAN_LOOK_KEYS)
        return plan_turning_refuse(self->camera, err, self->error);
    if (err == MOTION_E_RANGE)
        return plan_view_fail(self, err, place,
                              "comes to the point that it looks at");
    if (err == MOTION_E_STATE)
        return plan_view_fail(
            self, err, place,
            "has no Frenet frame where the path is straight, "
            "and one that flips where it bends the other way");
    return plan_view_fail(self, err, place, motion_err_text(err));
}

static int64_t view_row_at(const struct plan_view *self, uint32_t i)
{
    int64_t at = 0;

    (void)motion_fixed_muldiv(self->path.length_q32, i, self->rows, &at);
    return at;
}

/* Whether nothing between two rows can have been missed: the head turned little,
 * and is away from the vertical, near which pan may turn fast. */
static bool view_is_near(const struct motion_head *a,
                         const struct motion_head *b)
{
    const int64_t tilt = b->turn[MOTION_HEAD_TILT];

    for (int axis = 0; axis < MOTION_HEAD_AXES; axis++) {
        const int64_t turned = motion_trig_diff(a->turn[axis], b->turn[axis]);
        if (turned > VIEW_LITTLE || turned < -VIEW_LITTLE)
            return false;
    }
    return tilt < MOTION_TRIG_QUARTER_TURN - VIEW_LITTLE &&
           tilt > VIEW_LITTLE - MOTION_TRIG_QUARTER_TURN;
}

/* From one row to another. */
static int view_go_on(const struct plan_view *self, uint32_t to,
                      struct plan_view_row *row)
{
    struct motion_quat q = MOTION_QUAT_ONE;
    const int err = view_turn(self, &row->state, view_row_at(self, to), &q);

    return err < 0 ? err : motion_head_follow(&row->head, q);
}

/* What looks at a place skips rows where it turns slowly; they are as the one
 * before them. */
static int view_walk(struct plan_view *self)
{
    const bool skips =
        !view_is_framed(self) && self->camera->look != PLAN_LOOK_KEYS;
    struct plan_view_row now = { .head = self->turning.start };
    uint32_t stride = 1, at = 0;
    int err;

    self->row = calloc((size_t)self->rows + 1, sizeof *self->row);
    if (self->row == NULL)
        return plan_view_no_memory(self);
    err = view_go_on(self, 0, &now);
    self->row[0] = now;
    while (err == MOTION_OK && at < self->rows) {
        struct plan_view_row next = now;
        if (stride > self->rows - at)
            stride = 1;
        err = view_go_on(self, at + stride, &next);
        if (stride > 1 &&
            !(err == MOTION_OK && view_is_near(&now.head, &next.head))) {
            stride = 1;
            err = MOTION_OK;
            continue;
        }
        for (uint32_t i = 1; i < stride; i++)
            self->row[at + i] = now;
        at += stride;
        if (skips && stride < VIEW_SKIPPED &&
            view_is_near(&now.head, &next.head))
            stride *= 2;
        self->row[at] = now = next;
    }
    return err < 0 ? plan_view_refuse(self, err) : MOTION_OK;
}

int plan_view_init(struct plan_view *self, const struct plan_camera *camera,
                   const struct plan_space *space, struct plan_error *error)
{
    int err;

    *self = (struct plan_view){
        .camera = camera,
        .space = space,
        .error = error,
        .path = { plan_space_at, space, space->length_q32 },
        .lookat = { .up = camera->up,
                    .ahead = camera->forward,
                    .pole = MOTION_POLE_CARRY },
        .frames = { .space = space,
                    .up = camera->up,
                    .forward = camera->forward,
                    .frenet = camera->look == PLAN_LOOK_FRENET },
        .rows = VIEW_PIECE_ROWS * space->curve.pieces,
    };
    self->rows = self->rows > VIEW_ROWS ? self->rows : VIEW_ROWS;
    self->step_q32 = space->length_q32 / self->rows / VIEW_ROW_STEPS;
    err = view_mount(self);
    if (err == MOTION_OK && self->step_q32 == 0)
        err = plan_view_fail(self, MOTION_E_RANGE, camera->place,
                             "is on a path that is too short");
    if (err == MOTION_OK && view_is_framed(self)) {
        err = plan_frames_init(&self->frames);
        err = err < 0 ? plan_view_refuse(self, err) : err;
    } else if (err == MOTION_OK && camera->look == PLAN_LOOK_KEYS) {
        err = plan_turning_init(&self->turning, camera, space, error);
    } else if (err == MOTION_OK) {
        err = view_target(self);
    }
    if (err == MOTION_OK)
        err = plan_view_borders(self);
    return err < 0 ? err : view_walk(self);
}

void plan_view_free(struct plan_view *self)
{
    plan_space_free(&self->other_space);
    plan_frames_free(&self->frames);
    plan_turning_free(&self->turning);
    free(self->dwell);
    free(self->row);
    free(self->border_q32);
    free(self->break_q32);
    *self = (struct plan_view){ .row = NULL };
}

/* --- angles and their derivatives ----------------------------------------- */

/* The rotation at a distance from the mount, by the path it came there, and the
 * row before it. */
static int view_quat(const struct plan_view *self, int64_t distance_q32,
                     struct motion_quat *q, const struct plan_view_row **row)
{
    struct motion_lookat_state state;
    int64_t i = 0;

    (void)motion_fixed_muldiv(distance_q32, self->rows, self->path.length_q32,
                              &i);
    if (i > 0 && view_row_at(self, (uint32_t)i) > distance_q32)
        i--; /* the quotient was rounded up */
    *row = &self->row[i];
    state = self->row[i].state;
    return view_turn(self, &state, distance_q32, q);
}

/* The head there. */
static int view_head(const struct plan_view *self, int64_t distance_q32,
                     struct motion_head *head)
{
    const struct plan_view_row *row = self->row;
    struct motion_quat q = MOTION_QUAT_ONE;
    int err = view_quat(self, distance_q32, &q, &row);

    *head = row->head;
    return err < 0 ? err : motion_head_follow(head, q);
}

/* *distance_q32 moved between the breaks of a stretch. */
static struct plan_stencil view_stencil_at(const struct plan_view *self,
                                           uint32_t stretch,
                                           int64_t *distance_q32)
{
    const int64_t low =
        self->break_q32[stretch] + (stretch > 0 ? self->margin_q32 : 0);
    const int64_t high = self->break_q32[stretch + 1] -
                         (stretch + 2 < self->breaks ? self->margin_q32 : 0);
    const int64_t widest = (high - low) / VIEW_STRETCH_STEPS;
    const int64_t step = widest < self->step_q32 ? widest : self->step_q32;
    const int64_t at = *distance_q32 < low    ? low
                       : *distance_q32 > high ? high
                                              : *distance_q32;

    *distance_q32 = at;
    return plan_stencil_at(low, high, step, at);
}

static struct motion_real view_deg(struct motion_real turns)
{
    return motion_real_mul(turns, motion_real_int(360));
}

/* sum weight angle / divisor, degrees */
static struct motion_real view_sum(const int64_t weight[], const int64_t turn[],
                                   int64_t divisor)
{
    struct motion_real sum = motion_real_zero();

    for (int i = 0; i < PLAN_STENCIL_NODES; i++)
        sum = motion_real_add(sum,
                              motion_real_mul(motion_real_from_q(turn[i], 64),
                                              motion_real_int(weight[i])));
    return motion_real_div(view_deg(sum), motion_real_int(divisor));
}

/* P', P'' of each axis at a distance.  Backward is forward in a mirror. */
static int view_differences(const struct plan_view *self,
                            const struct plan_stencil *stencil,
                            int64_t distance_q32,
                            const struct motion_head *head,
                            struct motion_bake_point jet[])
{
    const struct motion_real h = motion_real_from_q(stencil->step, 32);
    const int row = stencil->central;
    int64_t turn[MOTION_HEAD_AXES][PLAN_STENCIL_NODES];
    int err = MOTION_OK;

    for (int i = 0; i < PLAN_STENCIL_NODES && err == MOTION_OK; i++) {
        const int64_t at = stencil->from + i * stencil->step;
        struct motion_head node = *head;
        if (at != distance_q32)
            err = view_head(self, at, &node);
        for (int axis = 0; axis < MOTION_HEAD_AXES && err == MOTION_OK; axis++)
            turn[axis][i] = motion_trig_diff(node.turn[axis], head->turn[axis]);
    }
    for (int axis = 0; axis < MOTION_HEAD_AXES && err == MOTION_OK; axis++) {
        jet[axis].vel = motion_real_div(
            view_sum(plan_stencil_first[row], turn[axis], 60), h);
        jet[axis].acc =
            motion_real_div(view_sum(plan_stencil_second[row], turn[axis], 180),
                            motion_real_sqr(h));
    }
    return err;
}

int plan_view_jet(const struct plan_view *self, uint32_t stretch,
                  int64_t *distance_q32,
                  struct motion_bake_point jet[MOTION_HEAD_AXES])
{
    const struct plan_stencil stencil =
        view_stencil_at(self, stretch, distance_q32);
    struct motion_head head;
    int err = view_head(self, *distance_q32, &head);

    if (err < 0)
        return err;
    const int64_t tilt = head.turn[MOTION_HEAD_TILT];
    const bool is_over =
        tilt > MOTION_TRIG_QUARTER_TURN || tilt < -MOTION_TRIG_QUARTER_TURN;
    if (!plan_view_rates(self, *distance_q32, is_over, jet))
        err = view_differences(self, &stencil, *distance_q32, &head, jet);
    for (int axis = 0; axis < MOTION_HEAD_AXES; axis++)
        jet[axis].pos =
            view_deg(motion_real_add(motion_real_int(head.whole[axis]),
                                     motion_real_from_q(head.turn[axis], 64)));
    return err;
}

int plan_view_frame(const struct plan_view *self, uint32_t stretch,
                    int64_t *distance_q32, struct plan_rig_frame *frame)
{
    const struct plan_stencil stencil =
        view_stencil_at(self, stretch, distance_q32);
    const struct motion_quat mount = motion_quat_inverse(self->from_mount);
    struct motion_quat turn[PLAN_STENCIL_NODES];
    const struct plan_view_row *row = self->row;
    int err = MOTION_OK;

    for (int i = 0; i < PLAN_STENCIL_NODES && err == MOTION_OK; i++) {
        turn[i] = MOTION_QUAT_ONE;
        err = view_quat(self, stencil.from + i * stencil.step, &turn[i], &row);
        turn[i] = motion_quat_mul(mount, turn[i]);
    }
    if (err == MOTION_OK)
        plan_stencil_frame(&stencil, turn, ldexp((double)stencil.step, -32),
                           frame);
    return err;
}
