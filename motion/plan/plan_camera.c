/* motion/plan/plan_camera.c - see plan_camera.h.
 *
 * Which way the head turns is a function of the distance s along the path, and
 * the law says when it is there:
 *
 *     pan(t) = P(s(t))     v = P' s'     a = P'' s'^2 + P' s''
 *
 * so at rest nothing turns, to the bit, and where only the law has a border the
 * derivatives have no step.  P' and P'' are taken from 7 places along the path
 * (Fornberg, Mathematics of Computation 51, 1988):
 *
 *     central   60 h f'  = -f-3 + 9 f-2 - 45 f-1 + 45 f1 - 9 f2 + f3
 *               180 h2 f'' = 2 f-3 - 27 f-2 + 270 f-1 - 490 f0 + ..
 *     forward   60 h f'  = -147 f0 + 360 f1 - 450 f2 + 400 f3 - 225 f4 + 72 f5
 *                          - 10 f6
 *               180 h2 f'' = 812 f0 - 3132 f1 + 5265 f2 - 5080 f3 + 2970 f4
 *                          - 972 f5 + 137 f6
 *
 * The head's way over the vertical and past half turns depends on how it came
 * there: it is walked once, in even steps along the path, and a place between
 * two goes on from the one before it.  The keyed roll is about the view, the
 * last of the three turns, and is added to the roll. */
#include "motion/plan/plan_camera.h"

#include <stdlib.h>

#include "motion/err.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/plan_frames.h"
#include "motion/plan/plan_room.h"
#include "motion/trig.h"

/* Steps of the walk along the path: a view may turn a quarter turn in each.
 * Derivatives are taken over an eighth of one. */
#define CAMERA_ROWS  2048
#define CAMERA_NODES 7

enum camera_side { CAMERA_FORWARD, CAMERA_CENTRAL, CAMERA_BACKWARD };

static const int64_t camera_first[2][CAMERA_NODES] = {
    { -147, 360, -450, 400, -225, 72, -10 },
    { -1, 9, -45, 0, 45, -9, 1 },
};
static const int64_t camera_second[2][CAMERA_NODES] = {
    { 812, -3132, 5265, -5080, 2970, -972, 137 },
    { 2, -27, 270, -490, 270, -27, 2 },
};

/* Where the walk is at the start of a step. */
struct camera_row {
    struct motion_lookat_state state;
    struct motion_head head;
};

struct camera {
    const struct plan_camera *camera;
    const struct plan_drive *drive;
    struct plan_error *error;
    struct motion_path path;
    struct plan_space other_space; /* PATH */
    struct motion_path other;      /* PATH and LEVEL */
    struct motion_dwell *dwell;
    struct motion_target target;
    struct motion_lookat lookat;
    struct motion_track roll;
    struct motion_quat from_mount; /* inverse of the mount's rotation */
    struct plan_frames frames;
    struct camera_row *row;
    int64_t step_q32; /* of the derivatives */
    int64_t *border_ns_q12;
    uint32_t borders;
};

static int camera_fail(const struct camera *self, int code,
                       struct plan_place place, const char *what)
{
    return plan_error_set(self->error, code, place, "the camera %s", what);
}

static int camera_no_memory(const struct camera *self)
{
    return camera_fail(self, MOTION_E_FULL, self->camera->place,
                       "has no memory");
}

/* --- what is looked at ---------------------------------------------------- */

/* One unit ahead of the path along its tangent: looking there is looking along
 * the path. */
static int camera_beyond(const void *context, int64_t distance_q32,
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

static int64_t camera_distance(const struct camera *self,
                               const struct plan_distance *distance)
{
    const struct plan_space *space = &self->drive->space;
    int64_t result = 0;

    if (motion_real_round(plan_law_distance(distance, space->table.length), 32,
                          &result) < 0 ||
        result > space->length_q32)
        return space->length_q32;
    return result;
}

static int camera_dwells(struct camera *self)
{
    const struct plan_camera *camera = self->camera;

    self->dwell = calloc(camera->dwells, sizeof *self->dwell);
    if (self->dwell == NULL)
        return camera_no_memory(self);
    for (uint32_t i = 0; i < camera->dwells; i++) {
        const struct plan_dwell *from = &camera->dwell[i];
        struct motion_dwell *to = &self->dwell[i];
        for (int k = 0; k < PLAN_SPACE_AXES; k++)
            to->point_q32[k] = from->point_q32[k];
        to->from_q32 = camera_distance(self, &from->from);
        to->to_q32 = camera_distance(self, &from->to);
        if (to->to_q32 < to->from_q32 ||
            (i > 0 && to->from_q32 <= to[-1].to_q32))
            return camera_fail(self, MOTION_E_ORDER, from->place,
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

static int camera_target(struct camera *self)
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
        self->other.at = camera_beyond;
    if (camera->look == PLAN_LOOK_DWELL)
        return camera_dwells(self);
    if (camera->look != PLAN_LOOK_PATH)
        return err;
    err = plan_space_init(&self->other_space, &camera->points, self->error);
    self->other = (struct motion_path){ plan_space_at, &self->other_space,
                                        self->other_space.length_q32 };
    return err;
}

/* --- what turns ----------------------------------------------------------- */

static int camera_mount(struct camera *self)
{
    const struct plan_camera *camera = self->camera;
    struct motion_dir axis[3] = { { { 0 } }, camera->up, { { 0 } } };
    struct motion_dir forward;
    struct motion_quat mount;
    int err = motion_dir_perpendicular(camera->forward, camera->up, &forward);

    if (err == MOTION_OK) {
        axis[0] = motion_dir_cross(forward, camera->up);
        axis[2] = motion_dir_neg(forward);
        err = motion_quat_from_axes(axis, &mount);
    }
    if (err < 0)
        return camera_fail(self, err, camera->place,
                           "has forward and up in one line");
    self->from_mount = motion_quat_inverse(mount);
    return MOTION_OK;
}

static int camera_roll(struct camera *self)
{
    int err;

    if (self->camera->roll == NULL)
        return MOTION_OK;
    err = plan_axis_track(self->camera->roll, &self->roll, self->error);
    self->error->axis = PLAN_AXES_MAX;
    return err;
}

static bool camera_is_framed(const struct camera *self)
{
    return self->camera->look == PLAN_LOOK_MINIMISING ||
           self->camera->look == PLAN_LOOK_FRENET;
}

/* The rotation at a distance, from the mount; goes on from *state. */
static int camera_turn(const struct camera *self,
                       struct motion_lookat_state *state, int64_t distance_q32,
                       struct motion_quat *q)
{
    struct motion_view view;
    int err;

    if (camera_is_framed(self)) {
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
static int camera_refuse(const struct camera *self, int err)
{
    const struct plan_place place = self->camera->look_place;

    if (err == MOTION_E_RANGE)
        return camera_fail(self, err, place,
                           "comes to the point that it looks at");
    if (err == MOTION_E_STATE)
        return camera_fail(self, err, place,
                           "has no Frenet frame where the path is straight, "
                           "and one that flips where it bends the other way");
    return camera_fail(self, err, place, motion_err_text(err));
}

static int64_t camera_row_at(const struct camera *self, uint32_t i)
{
    int64_t at = 0;

    (void)motion_fixed_muldiv(self->path.length_q32, i, CAMERA_ROWS, &at);
    return at;
}

static int camera_walk(struct camera *self)
{
    struct camera_row now = { .head = { .valid = false } };
    int err = MOTION_OK;

    self->row = calloc(CAMERA_ROWS + 1, sizeof *self->row);
    if (self->row == NULL)
        return camera_no_memory(self);
    for (uint32_t i = 0; i <= CAMERA_ROWS && err == MOTION_OK; i++) {
        struct motion_quat q;
        err = camera_turn(self, &now.state, camera_row_at(self, i), &q);
        if (err == MOTION_OK)
            err = motion_head_follow(&now.head, q);
        self->row[i] = now;
    }
    return err < 0 ? camera_refuse(self, err) : MOTION_OK;
}

static int camera_open(struct camera *self)
{
    const struct plan_camera *camera = self->camera;
    int err = camera_mount(self);

    self->step_q32 = self->path.length_q32 / CAMERA_ROWS / 8;
    if (err == MOTION_OK && self->step_q32 == 0)
        err = camera_fail(self, MOTION_E_RANGE, camera->place,
                          "is on a path that is too short");
    if (err == MOTION_OK)
        err = camera_roll(self);
    self->lookat = (struct motion_lookat){
        .up = camera->up,
        .ahead = camera->forward,
        .pole = MOTION_POLE_CARRY,
    };
    self->frames = (struct plan_frames){
        .space = &self->drive->space,
        .up = camera->up,
        .forward = camera->forward,
        .frenet = camera->look == PLAN_LOOK_FRENET,
    };
    if (err == MOTION_OK && camera_is_framed(self)) {
        err = plan_frames_init(&self->frames);
        err = err < 0 ? camera_refuse(self, err) : err;
    } else if (err == MOTION_OK) {
        err = camera_target(self);
    }
    return err < 0 ? err : camera_walk(self);
}

/* --- angles and their derivatives ----------------------------------------- */

/* The head at a distance, by the way it came there. */
static int camera_head(const struct camera *self, int64_t distance_q32,
                       struct motion_head *head)
{
    struct motion_lookat_state state;
    struct motion_quat q;
    int64_t i = 0;
    int err;

    (void)motion_fixed_muldiv(distance_q32, CAMERA_ROWS, self->path.length_q32,
                              &i);
    if (i > 0 && camera_row_at(self, (uint32_t)i) > distance_q32)
        i--; /* the quotient was rounded up */
    state = self->row[i].state;
    *head = self->row[i].head;
    err = camera_turn(self, &state, distance_q32, &q);
    return err < 0 ? err : motion_head_follow(head, q);
}

static enum camera_side camera_side_at(const struct camera *self,
                                       int64_t distance_q32)
{
    if (distance_q32 < 3 * self->step_q32)
        return CAMERA_FORWARD;
    return self->path.length_q32 - distance_q32 < 3 * self->step_q32
               ? CAMERA_BACKWARD
               : CAMERA_CENTRAL;
}

static struct motion_real camera_deg(struct motion_real turns)
{
    return motion_real_mul(turns, motion_real_int(360));
}

/* sum weight angle / divisor, degrees */
static struct motion_real camera_sum(const int64_t weight[],
                                     const int64_t turn[], int64_t divisor)
{
    struct motion_real sum = motion_real_zero();

    for (int i = 0; i < CAMERA_NODES; i++)
        sum = motion_real_add(sum,
                              motion_real_mul(motion_real_from_q(turn[i], 64),
                                              motion_real_int(weight[i])));
    return motion_real_div(camera_deg(sum), motion_real_int(divisor));
}

/* P, P', P'' of each axis at a distance.  Backward is forward in a mirror. */
static int camera_jet(const struct camera *self, int64_t distance_q32,
                      struct motion_bake_point jet[MOTION_HEAD_AXES])
{
    const enum camera_side side = camera_side_at(self, distance_q32);
    const int64_t step =
        side == CAMERA_BACKWARD ? -self->step_q32 : self->step_q32;
    const int64_t from =
        side == CAMERA_CENTRAL ? distance_q32 - 3 * step : distance_q32;
    const struct motion_real h = motion_real_from_q(step, 32);
    const int row = side == CAMERA_CENTRAL;
    int64_t turn[MOTION_HEAD_AXES][CAMERA_NODES];
    struct motion_head head, node;
    int err = camera_head(self, distance_q32, &head);

    for (int i = 0; i < CAMERA_NODES && err == MOTION_OK; i++) {
        err = camera_head(self, from + i * step, &node);
        for (int axis = 0; axis < MOTION_HEAD_AXES && err == MOTION_OK; axis++)
            turn[axis][i] = motion_trig_diff(node.turn[axis], head.turn[axis]);
    }
    for (int axis = 0; axis < MOTION_HEAD_AXES && err == MOTION_OK; axis++)
        jet[axis] = (struct motion_bake_point){
            camera_deg(
                motion_real_add(motion_real_int(head.whole[axis]),
                                motion_real_from_q(head.turn[axis], 64))),
            motion_real_div(camera_sum(camera_first[row], turn[axis], 60), h),
            motion_real_div(camera_sum(camera_second[row], turn[axis], 180),
                            motion_real_sqr(h)),
        };
    return err;
}

/* The segment of a track for a time, seen from one side. */
static struct motion_bake_point
camera_track_at(const struct motion_track *track, int64_t t,
                enum motion_bake_side side)
{
    uint32_t low = 0, high = track->count;

    while (high - low > 1) {
        const uint32_t middle = low + (high - low) / 2;
        const int64_t start = track->segment[middle].start_ns_q12;
        if (start < t || (start == t && side == MOTION_BAKE_RIGHT))
            low = middle;
        else
            high = middle;
    }
    return motion_bake_segment(&track->segment[low],
                               t - track->segment[low].start_ns_q12);
}

/* The keyed roll; at rest when it has ended. */
static struct motion_bake_point
camera_roll_at(const struct camera *self, int64_t t, enum motion_bake_side side)
{
    const struct motion_real zero = motion_real_zero();
    const struct motion_track *roll = &self->roll;

    if (t < roll->end_ns_q12 ||
        (t == roll->end_ns_q12 && side == MOTION_BAKE_LEFT && roll->count > 0))
        return camera_track_at(roll, t, side);
    return (struct motion_bake_point){ motion_bake_end(roll), zero, zero };
}

/* A source for motion_bake. */
static int camera_at(void *context, int64_t t, enum motion_bake_side side,
                     struct motion_bake_point point[])
{
    const struct camera *self = context;
    const struct motion_bake_point s =
        camera_track_at(&self->drive->law, t, side);
    const struct motion_bake_point roll = camera_roll_at(self, t, side);
    struct motion_bake_point jet[MOTION_HEAD_AXES];
    int64_t distance = 0;
    int err = motion_real_round(s.pos, 32, &distance);

    distance = distance < 0 ? 0 : distance;
    if (distance > self->path.length_q32)
        distance = self->path.length_q32;
    if (err == MOTION_OK)
        err = camera_jet(self, distance, jet);
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
    point[MOTION_HEAD_ROLL].pos =
        motion_real_add(point[MOTION_HEAD_ROLL].pos, roll.pos);
    point[MOTION_HEAD_ROLL].vel =
        motion_real_add(point[MOTION_HEAD_ROLL].vel, roll.vel);
    point[MOTION_HEAD_ROLL].acc =
        motion_real_add(point[MOTION_HEAD_ROLL].acc, roll.acc);
    return MOTION_OK;
}

/* --- borders -------------------------------------------------------------- */

/* The first time at which the law has come to a distance. */
static int64_t camera_when(const struct camera *self, int64_t distance_q32)
{
    const struct motion_track *law = &self->drive->law;
    int64_t low = 0, high = law->end_ns_q12;

    while (high - low > 1) {
        const int64_t middle = low + (high - low) / 2;
        struct motion_state at;
        motion_track_state(law, middle, &at);
        if (at.pos_q32 < distance_q32)
            low = middle;
        else
            high = middle;
    }
    return high;
}

static void camera_border_at(struct camera *self, int64_t distance_q32)
{
    if (distance_q32 > 0 && distance_q32 < self->drive->space.length_q32)
        self->border_ns_q12[self->borders++] = camera_when(self, distance_q32);
}

/* Where the camera is when what it looks at comes to a point of its curve:
 * `shift` less than that, at `num / den` of it. */
static void camera_border_knots(struct camera *self,
                                const struct plan_space *space, int64_t shift)
{
    const int64_t length = self->drive->space.length_q32;

    for (uint32_t i = 0; i <= space->curve.pieces; i++) {
        int64_t at = 0;
        if (motion_real_round(motion_arclen_border(&space->table, i), 32,
                              &at) == MOTION_OK &&
            (space == &self->drive->space ||
             motion_fixed_muldiv(at, length, space->length_q32, &at) ==
                 MOTION_OK))
            camera_border_at(self, at - shift);
    }
}

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

static int camera_borders(struct camera *self)
{
    const struct plan_camera *camera = self->camera;
    const struct plan_drive *drive = self->drive;
    const uint32_t keys = camera->roll != NULL ? camera->roll->key_count : 0;
    const size_t room = (size_t)drive->borders + drive->space.curve.pieces +
                        self->other_space.curve.pieces +
                        2 * (size_t)camera->dwells + keys + 4;

    self->border_ns_q12 = malloc(room * sizeof *self->border_ns_q12);
    if (self->border_ns_q12 == NULL)
        return camera_no_memory(self);
    for (uint32_t i = 0; i < drive->borders; i++)
        self->border_ns_q12[self->borders++] = drive->border_ns_q12[i];
    if (camera->look == PLAN_LOOK_AHEAD)
        camera_border_knots(self, &drive->space, camera->ahead_q32);
    if (camera->look == PLAN_LOOK_PATH)
        camera_border_knots(self, &self->other_space, 0);
    for (uint32_t i = 0; i < camera->dwells; i++) {
        camera_border_at(self, self->dwell[i].from_q32);
        camera_border_at(self, self->dwell[i].to_q32);
    }
    for (uint32_t i = 0; i < keys; i++)
        if (camera->roll->key[i].key.t_ns_q12 < drive->law.end_ns_q12)
            self->border_ns_q12[self->borders++] =
                camera->roll->key[i].key.t_ns_q12;
    camera_border_sort(self);
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
        plan_room_init(list[i], pos_q32);
    }
    return err;
}

static int camera_grow(struct motion_track *list[])
{
    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        if (plan_room_grow(list[i]) < 0)
            return MOTION_E_FULL;
    return MOTION_OK;
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
    };
    struct motion_bake_report report;
    int err = camera_begin(self, list);

    if (err < 0)
        return camera_refuse(self, err);
    do
        err = motion_bake(&job, list, &report);
    while (err == MOTION_E_FULL && camera_grow(list) == MOTION_OK);
    if (err == MOTION_E_LIMIT)
        return camera_fail(
            self, err, self->camera->look_place,
            "would have to turn at once somewhere: it passes too "
            "close to what it looks at");
    if (err < 0)
        return camera_refuse(self, err);
    /* at most the tolerance, so it fits */
    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        (void)motion_real_ceil(report.bound[i].pos, 32, &bound_q32[i]);
    return MOTION_OK;
}

/* A head without a roll axis cannot roll. */
static int camera_check_roll(const struct camera *self,
                             const struct motion_track *roll)
{
    struct motion_extreme extreme;
    const int64_t most = 4 * self->camera->tolerance_q32;

    motion_track_extreme(roll, MOTION_POS, &extreme);
    if (extreme.max <= most && extreme.min >= -most)
        return MOTION_OK;
    const bool low = -extreme.min > extreme.max;
    return plan_error_set(
        self->error, MOTION_E_ARG, self->camera->place,
        "the camera rolls by %.4g deg at %.3f s, but has no roll axis",
        (double)(low ? extreme.min : extreme.max) /
            (double)MOTION_FIXED_ONE_Q32,
        (double)(low ? extreme.min_ns_q12 : extreme.max_ns_q12) /
            (double)MOTION_FIXED_S_Q12);
}

static void camera_close(struct camera *self)
{
    plan_space_free(&self->other_space);
    plan_track_free(&self->roll);
    plan_frames_free(&self->frames);
    free(self->dwell);
    free(self->row);
    free(self->border_ns_q12);
}

int plan_camera_tracks(const struct plan_camera *camera,
                       const struct plan_drive *drive,
                       struct motion_track track[],
                       int64_t bound_q32[MOTION_HEAD_AXES],
                       struct plan_error *error)
{
    struct camera self = {
        .camera = camera,
        .drive = drive,
        .error = error,
        .path = { plan_space_at, &drive->space, drive->space.length_q32 },
    };
    struct motion_track spare;
    struct motion_track *list[MOTION_HEAD_AXES] = {
        &track[camera->axis[MOTION_HEAD_PAN]],
        &track[camera->axis[MOTION_HEAD_TILT]],
        camera->has_roll ? &track[camera->axis[MOTION_HEAD_ROLL]] : &spare,
    };
    int err;

    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        plan_room_init(list[i], 0);
    err = camera_open(&self);
    if (err == MOTION_OK)
        err = camera_borders(&self);
    if (err == MOTION_OK)
        err = camera_bake(&self, list, bound_q32);
    if (err == MOTION_OK && !camera->has_roll)
        err = camera_check_roll(&self, &spare);
    for (int i = 0; i < MOTION_HEAD_AXES; i++) {
        if (err < 0 || list[i] == &spare)
            plan_track_free(list[i]);
        else
            plan_room_trim(list[i]);
    }
    camera_close(&self);
    return err;
}

void plan_camera_free(struct plan_camera *camera)
{
    if (camera == NULL)
        return;
    free(camera->points.point);
    free(camera->dwell);
    if (camera->roll != NULL)
        free(camera->roll->key);
    free(camera->roll);
    free(camera);
}
