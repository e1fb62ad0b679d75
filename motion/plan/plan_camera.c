/* motion/plan/plan_camera.c - see plan_camera.h.
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
 * The baker is told where derivatives step: at the borders of the drive, where a
 * dwell begins or ends, where what is looked at comes to a point of its own
 * curve, and at the keys of the roll. */
#include "motion/plan/plan_camera.h"

#include <stdlib.h>

#include "motion/err.h"
#include "motion/fixed.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/plan_room.h"
#include "motion/plan/plan_view.h"

/* Segments, about 1 ms: what turns faster than that has no head. */
#define CAMERA_SHORTEST (MOTION_FIXED_S_Q12 >> 10)

struct camera {
    const struct plan_camera *camera;
    const struct plan_drive *drive;
    struct plan_error *error;
    struct plan_view view;
    struct motion_track roll;
    int64_t *border_ns_q12;
    uint32_t borders;
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
    const struct motion_real zero = motion_real_zero();
    const struct camera *self = context;
    const struct motion_bake_point s =
        camera_track_at(&self->drive->law, t, side);
    const struct motion_bake_point roll = camera_roll_at(self, t, side);
    struct motion_bake_point jet[MOTION_HEAD_AXES] = { { zero, zero, zero } };
    int64_t distance = 0;
    int err = motion_real_round(s.pos, 32, &distance);

    distance = distance < 0 ? 0 : distance;
    if (distance > self->drive->space.length_q32)
        distance = self->drive->space.length_q32;
    if (err == MOTION_OK)
        err = plan_view_jet(&self->view, distance, jet);
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
                        self->view.other_space.curve.pieces +
                        2 * (size_t)camera->dwells + keys + 4;

    self->border_ns_q12 = malloc(room * sizeof *self->border_ns_q12);
    if (self->border_ns_q12 == NULL)
        return plan_view_no_memory(&self->view);
    for (uint32_t i = 0; i < drive->borders; i++)
        self->border_ns_q12[self->borders++] = drive->border_ns_q12[i];
    if (camera->look == PLAN_LOOK_AHEAD)
        camera_border_knots(self, &drive->space, camera->ahead_q32);
    if (camera->look == PLAN_LOOK_PATH)
        camera_border_knots(self, &self->view.other_space, 0);
    for (uint32_t i = 0; i < camera->dwells && self->view.dwell != NULL; i++) {
        camera_border_at(self, self->view.dwell[i].from_q32);
        camera_border_at(self, self->view.dwell[i].to_q32);
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
        .shortest_ns_q12 = CAMERA_SHORTEST,
    };
    struct motion_bake_report report;
    int err = camera_begin(self, list);

    if (err < 0)
        return plan_view_refuse(&self->view, err);
    do
        err = motion_bake(&job, list, &report);
    while (err == MOTION_E_FULL && camera_grow(list) == MOTION_OK);
    if (err == MOTION_E_LIMIT)
        return plan_view_fail(
            &self->view, err, self->camera->look_place,
            "would have to turn at once somewhere: it passes too "
            "close to what it looks at");
    if (err < 0)
        return plan_view_refuse(&self->view, err);
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
    plan_view_free(&self->view);
    plan_track_free(&self->roll);
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
    err = plan_view_init(&self.view, camera, &drive->space, error);
    if (err == MOTION_OK)
        err = camera_roll(&self);
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
        plan_axis_free(camera->roll);
    free(camera->roll);
    free(camera);
}
