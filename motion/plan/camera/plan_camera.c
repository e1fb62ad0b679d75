/* motion/plan/camera/plan_camera.c - see plan_camera.h.
 *
 * Which way the head turns is a function of the distance s along the path
 * (plan_view.h), and the law says when it is there:
 *
 *     pan(t) = P(s(t))     v = P' s'     a = P'' s'^2 + P' s''
 *
 * so at rest nothing turns, to the bit, and where only the law has a border the
 * derivatives have no step.  The keyed roll is about the view, the last of the
 * three turns, and is added to the roll.
 *
 * The baker is told where derivatives step: at the borders of the law, where
 * the view has its own (plan_view.h), and at the keys of the roll.  At a break
 * of the view both sides are planned as they are, with the step of speed
 * between them, which plan_check_track finds; a step of the angles themselves
 * is refused. */
#include "motion/plan/camera/plan_camera.h"

#include <math.h>
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/path/path.h"
#include "motion/plan/camera/plan_orient.h"
#include "motion/plan/camera/plan_view.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/plan_track.h"

/* Segments, about 60 us: below a tick, so that the ramp which the stencil makes
 * of a step of acceleration is followed at any speed, and left to the check. */
#define CAMERA_SHORTEST (MOTION_FIXED_S_Q12 >> 14)
/* From so near to so far on either side is looked to say why not. */
#define CAMERA_NEAR  (MOTION_FIXED_S_Q12 >> 16)
#define CAMERA_NEEDS (128 * MOTION_FIXED_S_Q12)
/* Looks of the baker, at most: so many, and per border. */
#define CAMERA_LOOKS        20000
#define CAMERA_BORDER_LOOKS 24
/* Segments from one border to the next for which there is room at once. */
#define CAMERA_CAPACITY 4

/* What the baker saw last. */
struct camera_last {
    int64_t t_ns_q12;
    enum motion_bake_side side;
    struct motion_bake_point point[MOTION_HEAD_AXES];
    bool is_jump; /* and why it was ended */
};

struct camera {
    const struct plan_camera *camera;
    const struct plan_drive *drive;
    struct plan_error *error;
    struct plan_view view;
    struct motion_track roll;
    int64_t *border_ns_q12;
    uint32_t borders;
    int64_t *break_ns_q12; /* when the law comes to view.break_q32 */
    struct camera_last last;
    const struct plan_progress *progress;
    int64_t told_ns_q12; /* the furthest: baking may begin anew */
};

static int camera_roll(struct camera *self)
{
    int err;

    if (self->camera->roll == NULL)
        return MOTION_OK;
    err = plan_axis_track(self->camera->roll, &self->roll, self->error);
    self->error->axis = PLAN_AXES_MAX;
    return err;
}

/* --- over time ------------------------------------------------------------ */

/* The keyed roll; at rest when it has ended. */
static struct motion_bake_point
camera_roll_at(const struct camera *self, int64_t t, enum motion_bake_side side)
{
    const struct motion_real zero = motion_real_zero();
    const struct motion_track *roll = &self->roll;

    if (t < roll->end_ns_q12 ||
        (t == roll->end_ns_q12 && side == MOTION_BAKE_LEFT && roll->count > 0))
        return motion_bake_track(roll, t, side);
    return (struct motion_bake_point){ motion_bake_end(roll), zero, zero };
}

/* The view by time: chain rule, and a Taylor step from where it was looked. */
static int camera_view_at(const struct camera *self, int64_t t,
                          enum motion_bake_side side,
                          struct motion_bake_point point[])
{
    const struct motion_bake_point s =
        motion_bake_track(&self->drive->law, t, side);
    struct motion_bake_point jet[MOTION_HEAD_AXES] = { 0 };
    const uint32_t stretch =
        motion_bake_span(self->break_ns_q12, self->view.breaks - 1, t, side);
    int64_t distance = 0;
    int err = motion_real_round(s.pos, 32, &distance);

    if (err == MOTION_OK)
        err = plan_view_jet(&self->view, stretch, &distance, jet);
    if (err < 0)
        return err;
    const struct motion_real off =
        motion_real_sub(s.pos, motion_real_from_q(distance, 32));
    for (int i = 0; i < MOTION_HEAD_AXES; i++) {
        point[i].pos =
            motion_real_add(jet[i].pos, motion_real_mul(jet[i].vel, off));
        point[i].vel = motion_real_mul(jet[i].vel, s.vel);
        point[i].acc =
            motion_real_add(motion_real_mul(jet[i].acc, motion_real_sqr(s.vel)),
                            motion_real_mul(jet[i].vel, s.acc));
    }
    return MOTION_OK;
}

static void camera_join(struct motion_real *right, struct motion_real left,
                        struct motion_real rounding)
{
    const struct motion_real step =
        motion_real_abs(motion_real_sub(*right, left));

    if (motion_real_lt(step, rounding))
        *right = left;
}

/* The second side of a border: where it steps by less in a second than a 16th
 * of the tolerance, that is rounding of the stencil, and the sides are one. */
static bool camera_cross(struct camera *self, struct motion_bake_point right[])
{
    const struct motion_real most =
        motion_real_from_q(self->camera->tolerance_q32, 32);
    const struct motion_real rounding = motion_real_scale(most, -4);
    bool is_jump = false;

    for (int i = 0; i < MOTION_HEAD_AXES; i++) {
        const struct motion_bake_point *left = &self->last.point[i];
        is_jump |= motion_real_lt(
            most, motion_real_abs(motion_real_sub(right[i].pos, left->pos)));
        camera_join(&right[i].vel, left->vel, rounding);
        camera_join(&right[i].acc, left->acc, rounding);
    }
    return is_jump;
}

/* MOTION_E_DISCONTINUITY when the other side of a border was somewhere else. */
static int camera_see(struct camera *self, int64_t t,
                      enum motion_bake_side side,
                      struct motion_bake_point point[])
{
    struct camera_last *last = &self->last;

    if (last->t_ns_q12 == t && last->side == MOTION_BAKE_LEFT &&
        side == MOTION_BAKE_RIGHT)
        last->is_jump = camera_cross(self, point);
    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        last->point[i] = point[i];
    last->t_ns_q12 = t;
    last->side = side;
    return last->is_jump ? MOTION_E_DISCONTINUITY : MOTION_OK;
}

static void camera_tell(struct camera *self, int64_t t)
{
    const int64_t first = self->border_ns_q12[0];
    const int64_t last = self->border_ns_q12[self->borders - 1];

    if (t - first > self->told_ns_q12)
        self->told_ns_q12 = t - first;
    plan_progress_tell(self->progress, "planning", "camera", self->told_ns_q12,
                       last - first);
}

/* A source for motion_bake. */
static int camera_at(void *context, int64_t t, enum motion_bake_side side,
                     struct motion_bake_point point[])
{
    struct camera *self = context;
    const struct motion_bake_point roll = camera_roll_at(self, t, side);
    struct motion_bake_point *const sum = &point[MOTION_HEAD_ROLL];
    int err = camera_view_at(self, t, side, point);

    camera_tell(self, t);
    if (err < 0)
        return err;
    sum->pos = motion_real_add(sum->pos, roll.pos);
    sum->vel = motion_real_add(sum->vel, roll.vel);
    sum->acc = motion_real_add(sum->acc, roll.acc);
    return camera_see(self, t, side, point);
}

/* --- borders -------------------------------------------------------------- */

static int camera_compare(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;

    return (x > y) - (x < y);
}

/* In order, none twice. */
static void camera_border_sort(struct camera *self)
{
    int64_t *const border = self->border_ns_q12;
    uint32_t kept = 1;

    qsort(border, self->borders, sizeof *border, camera_compare);
    for (uint32_t i = 1; i < self->borders; i++)
        if (border[i] > border[kept - 1])
            border[kept++] = border[i];
    self->borders = kept;
}

static void camera_border_at(struct camera *self, int64_t t_ns_q12)
{
    if (t_ns_q12 < self->drive->law.end_ns_q12)
        self->border_ns_q12[self->borders++] = t_ns_q12;
}

static int camera_borders(struct camera *self)
{
    const struct plan_camera *camera = self->camera;
    const struct plan_view *view = &self->view;
    const struct motion_track *law = &self->drive->law;
    const uint32_t keys = camera->roll != NULL ? camera->roll->key_count : 0;
    const size_t capacity = (size_t)law->count + view->borders + keys + 1;

    self->border_ns_q12 = malloc(capacity * sizeof *self->border_ns_q12);
    self->break_ns_q12 = malloc(view->breaks * sizeof *self->break_ns_q12);
    if (self->border_ns_q12 == NULL || self->break_ns_q12 == NULL)
        return plan_view_no_memory(view);
    for (uint32_t i = 0; i < law->count; i++)
        camera_border_at(self, law->segment[i].start_ns_q12);
    for (uint32_t i = 1; i + 1 < view->borders; i++)
        camera_border_at(
            self,
            motion_path_when(law, motion_real_from_q(view->border_q32[i], 32)));
    for (uint32_t i = 0; i < keys; i++)
        camera_border_at(self, camera->roll->key[i].key.t_ns_q12);
    self->border_ns_q12[self->borders++] = law->end_ns_q12;
    camera_border_sort(self);
    for (uint32_t i = 0; i < view->breaks; i++)
        self->break_ns_q12[i] =
            motion_path_when(law, motion_real_from_q(view->break_q32[i], 32));
    return MOTION_OK;
}

/* --- baking --------------------------------------------------------------- */

/* The tracks begin where the head does. */
static int camera_begin(struct camera *self, struct motion_track *list[])
{
    struct motion_bake_point point[MOTION_HEAD_AXES];
    int err = camera_at(self, 0, MOTION_BAKE_RIGHT, point);

    for (int i = 0; i < MOTION_HEAD_AXES && err == MOTION_OK; i++) {
        int64_t pos_q32 = 0;
        err = motion_real_round(point[i].pos, 32, &pos_q32);
        plan_track_init(list[i], pos_q32);
        plan_track_reserve(list[i], CAMERA_CAPACITY * (size_t)self->borders);
    }
    return err;
}

static int camera_grow(struct motion_track *list[])
{
    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        if (plan_track_grow(list[i]) < 0)
            return MOTION_E_FULL;
    return MOTION_OK;
}

static const char *const camera_axis_word[MOTION_HEAD_AXES] = { "pan", "tilt",
                                                                "roll" };

static double camera_s(int64_t t_ns_q12)
{
    return (double)t_ns_q12 / (double)MOTION_FIXED_S_Q12;
}

static double camera_real(struct motion_real a)
{
    return ldexp((double)a.m, a.e);
}

/* Those that the head has: without roll the rest of what is asked of it is noise. */
static int camera_axes(const struct camera *self)
{
    return self->camera->has_roll ? MOTION_HEAD_AXES : MOTION_HEAD_ROLL;
}

/* The angles themselves step at last.t. */
static int camera_refuse_jump(const struct camera *self)
{
    const struct plan_camera *camera = self->camera;
    struct motion_bake_point left[MOTION_HEAD_AXES], right[MOTION_HEAD_AXES];
    const int64_t t = self->last.t_ns_q12;
    double most = 0;
    int worst = 0;

    if (camera_view_at(self, t, MOTION_BAKE_LEFT, left) < 0 ||
        camera_view_at(self, t, MOTION_BAKE_RIGHT, right) < 0)
        return plan_view_refuse(&self->view, MOTION_E_DISCONTINUITY);
    for (int i = 0; i < camera_axes(self); i++) {
        const double jump =
            camera_real(motion_real_sub(right[i].pos, left[i].pos));
        worst = fabs(jump) > fabs(most) ? i : worst;
        most = fabs(jump) > fabs(most) ? jump : most;
    }
    return plan_error_set(
        self->error, MOTION_E_DISCONTINUITY, camera->look_place,
        "at %.3f s the camera would have to %s by %.3g deg at once, where "
        "the path %s",
        camera_s(t), camera_axis_word[worst], most,
        camera->look == PLAN_LOOK_FRENET && self->view.space->smooth > 0
            ? "bends in another direction from one point on: look along it "
              "rotation-minimising or level, or give it another curve, such "
              "as c2"
            : "has a corner: give it another curve, such as rounded or c2");
}

/* What an axis would have to do at most, and how often its limit that is. */
struct camera_need {
    int axis;
    bool is_acc;
    int64_t t_ns_q12;
    double value, limit, ratio;
};

static void camera_need_more(struct camera_need *need, int axis, bool is_acc,
                             int64_t t, double value, double limit)
{
    const double ratio = fabs(value) / (limit > 0 ? limit : 1);

    if (ratio > need->ratio)
        *need =
            (struct camera_need){ axis, is_acc, t, fabs(value), limit, ratio };
}

static void camera_needs_of(const struct camera *self, bool acc, int64_t t,
                            int axis, double value, struct camera_need *need)
{
    const struct plan_limit *limit = &self->camera->limit[axis];

    camera_need_more(need, axis, acc, t, value,
                     acc ? ldexp((double)limit->acc_q32, -32)
                         : ldexp((double)limit->vel_q32, -32));
}

/* From one time to another: the mean speed, which is at most the largest, and
 * the acceleration there. */
static void camera_needs_between(const struct camera *self, int64_t from,
                                 int64_t to, bool acc, struct camera_need *need)
{
    const double dur_s = camera_s(to - from);
    struct motion_bake_point a[MOTION_HEAD_AXES], b[MOTION_HEAD_AXES];

    if (from < 0 || to > self->drive->law.end_ns_q12 ||
        camera_view_at(self, from, MOTION_BAKE_LEFT, a) < 0 ||
        camera_view_at(self, to, MOTION_BAKE_LEFT, b) < 0)
        return;
    for (int i = 0; i < camera_axes(self); i++)
        camera_needs_of(self, acc, from, i,
                        acc ? camera_real(b[i].acc)
                            : camera_real(motion_real_sub(b[i].pos, a[i].pos)) /
                                  dur_s,
                        need);
}

/* Around the place where the baker gave up, first closely. */
static struct camera_need camera_needs(const struct camera *self, bool acc)
{
    const int64_t t = self->last.t_ns_q12;
    struct camera_need need = { .ratio = 0 };

    camera_needs_between(self, t - CAMERA_NEAR, t + CAMERA_NEAR, acc, &need);
    for (int64_t off = CAMERA_NEAR; off < CAMERA_NEEDS; off += off / 8) {
        camera_needs_between(self, t + off, t + off + off / 8, acc, &need);
        camera_needs_between(self, t - off - off / 8, t - off, acc, &need);
    }
    return need;
}

/* No segment of a millisecond follows it. */
static int camera_refuse_fast(const struct camera *self)
{
    const struct plan_place place = self->camera->look_place;
    struct camera_need need = camera_needs(self, false);

    if (need.ratio <= 1)
        need = camera_needs(self, true);
    if (need.ratio <= 1)
        return plan_error_set(
            self->error, MOTION_E_TOLERANCE, self->camera->place,
            "at %.3f s the camera cannot be kept within its tolerance of "
            "%.3g deg: give a larger one",
            camera_s(self->last.t_ns_q12),
            ldexp((double)self->camera->tolerance_q32, -32));
    return plan_error_set(
        self->error, MOTION_E_LIMIT, place,
        "at %.3f s the camera would have to %s at %.4g deg/%s, and the limit "
        "of that axis is %.4g deg/%s: pass farther from what it looks at, or "
        "slower",
        camera_s(need.t_ns_q12), camera_axis_word[need.axis], need.value,
        need.is_acc ? "s2" : "s", need.limit, need.is_acc ? "s2" : "s");
}

static int camera_refuse(const struct camera *self, int err)
{
    if (err == MOTION_E_WORK)
        return plan_error_set(
            self->error, err, self->camera->place,
            "the camera takes too much work to plan: it came to %.3f s in the "
            "%u evaluations that it may take, so give it a larger "
            "tolerance than %.3g deg or a simpler path",
            camera_s(self->last.t_ns_q12),
            CAMERA_LOOKS + CAMERA_BORDER_LOOKS * self->borders,
            ldexp((double)self->camera->tolerance_q32, -32));
    if (err == MOTION_E_RANGE)
        return plan_error_set(self->error, err, self->camera->look_place,
                              "at %.3f s the camera comes to the point that it "
                              "looks at",
                              camera_s(self->last.t_ns_q12));
    if (err == MOTION_E_DISCONTINUITY)
        return camera_refuse_jump(self);
    if (err == MOTION_E_TOLERANCE)
        return camera_refuse_fast(self);
    return plan_view_refuse(&self->view, err);
}

static int camera_bake(struct camera *self, struct motion_track *list[],
                       int64_t bound_q32[])
{
    const struct motion_bake job = {
        .source = { camera_at, self },
        .axes = MOTION_HEAD_AXES,
        .border_ns_q12 = self->border_ns_q12,
        .borders = self->borders,
        .pos = motion_real_from_q(self->camera->tolerance_q32, 32),
        .vel = motion_real_zero(),
        .acc = motion_real_zero(),
        .shortest_ns_q12 = CAMERA_SHORTEST,
        .evaluations = CAMERA_LOOKS + CAMERA_BORDER_LOOKS * self->borders,
    };
    struct motion_bake_report report;
    int err = camera_begin(self, list);

    if (err < 0)
        return plan_view_refuse(&self->view, err);
    do {
        self->last = (struct camera_last){ .t_ns_q12 = -1 };
        err = motion_bake(&job, list, &report);
    } while (err == MOTION_E_FULL && camera_grow(list) == MOTION_OK);
    if (err < 0)
        return camera_refuse(self, err);
    /* at most the tolerance, so it fits */
    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        (void)motion_real_ceil(report.bound[i].pos, 32, &bound_q32[i]);
    return MOTION_OK;
}

/* A head without a roll axis cannot roll. */
static int camera_check_roll(const struct plan_camera *camera,
                             const struct motion_track *roll,
                             struct plan_error *error)
{
    struct motion_extreme extreme;
    const int64_t most = 4 * camera->tolerance_q32;

    motion_track_extreme(roll, MOTION_POS, &extreme);
    if (extreme.max <= most && extreme.min >= -most)
        return MOTION_OK;
    const bool low = -extreme.min > extreme.max;
    return plan_error_set(
        error, MOTION_E_ARG, camera->place,
        "the camera rolls by %.4g deg at %.3f s, but has no roll axis",
        (double)(low ? extreme.min : extreme.max) /
            (double)MOTION_FIXED_ONE_Q32,
        (double)(low ? extreme.min_ns_q12 : extreme.max_ns_q12) /
            (double)MOTION_FIXED_S_Q12);
}

static void camera_close(struct camera *self)
{
    plan_view_free(&self->view);
    plan_track_free(&self->roll);
    free(self->border_ns_q12);
    free(self->break_ns_q12);
}

static int camera_on_path(struct camera *self, struct motion_track *list[],
                          int64_t bound_q32[])
{
    int err = plan_view_init(&self->view, self->camera, &self->drive->space,
                             self->error);

    if (err == MOTION_OK)
        err = camera_roll(self);
    if (err == MOTION_OK)
        err = camera_borders(self);
    if (err == MOTION_OK)
        err = camera_bake(self, list, bound_q32);
    camera_close(self);
    return err;
}

bool plan_camera_is_on_path(const struct plan_camera *camera)
{
    return camera->look == PLAN_LOOK_KEYS ? camera->orient.is_along
                                          : camera->following.rig == NULL;
}

int plan_camera_tracks(const struct plan_camera *camera,
                       const struct plan_drive *drive,
                       struct motion_track track[],
                       int64_t bound_q32[MOTION_HEAD_AXES],
                       const struct plan_progress *progress,
                       struct plan_error *error)
{
    struct camera self = {
        .camera = camera,
        .drive = drive,
        .error = error,
        .progress = progress,
    };
    struct motion_track spare;
    struct motion_track *list[MOTION_HEAD_AXES] = {
        &track[camera->axis[MOTION_HEAD_PAN]],
        &track[camera->axis[MOTION_HEAD_TILT]],
        camera->has_roll ? &track[camera->axis[MOTION_HEAD_ROLL]] : &spare,
    };
    int err;

    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        plan_track_init(list[i], 0);
    err = plan_camera_is_on_path(camera)
              ? camera_on_path(&self, list, bound_q32)
              : plan_orient_tracks(camera, list, bound_q32, progress, error);
    if (err == MOTION_OK && !camera->has_roll)
        err = camera_check_roll(camera, &spare, error);
    for (int i = 0; i < MOTION_HEAD_AXES; i++) {
        if (err < 0 || list[i] == &spare)
            plan_track_free(list[i]);
        else
            plan_track_trim(list[i]);
    }
    return err;
}

void plan_camera_free(struct plan_camera *camera)
{
    if (camera == NULL)
        return;
    free(camera->points.point);
    free(camera->dwell);
    free(camera->orient.key);
    if (camera->roll != NULL)
        plan_axis_free(camera->roll);
    free(camera->roll);
    for (int i = 0; camera->following.subject != NULL && i < PLAN_SPACE_AXES;
         i++)
        plan_axis_free(&camera->following.subject[i]);
    free(camera->following.subject);
    free(camera->following.rig);
    free(camera);
}
