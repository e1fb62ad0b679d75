/* motion/plan/compose.c - see compose.h. */
#include "motion/plan/compose.h"

#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/camera/plan_camera.h"
#include "motion/plan/camera/plan_carry.h"
#include "motion/plan/camera/plan_follow.h"
#include "motion/plan/camera/plan_tool.h"
#include "motion/plan/path/plan_joints.h"
#include "motion/plan/plan_blend.h"
#include "motion/plan/plan_couple.h"
#include "motion/plan/plan_duration.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/plan_roll.h"
#include "motion/plan/plan_track.h"
#include "motion/plan/plan_warp.h"
#include "motion/plan/shaper/plan_shape.h"
#include "motion/plan/shoot/plan_shoot.h"

const char *plan_driver_name(enum plan_driver driver)
{
    static const char *const names[] = {
#define COMPOSE_DRIVER_NAME(name, word) [name] = word,
        PLAN_DRIVER_LIST(COMPOSE_DRIVER_NAME)
#undef COMPOSE_DRIVER_NAME
    };
    return names[driver];
}

struct compose {
    const struct plan_move *move;
    struct motion_track *track;
    struct plan_outcome *outcome;
    const struct plan_progress *progress;
    struct plan_error *error;
    const struct plan_memo *former;
    struct plan_memo *memo;
};

static int compose_memo(const struct compose *self)
{
    struct plan_memo *memo = self->memo;

    if (memo == NULL || self->move->axis_count == 0)
        return MOTION_OK;
    memo->axis = calloc(self->move->axis_count, sizeof *memo->axis);
    if (memo->axis == NULL)
        return plan_error_set(self->error, MOTION_E_FULL,
                              (struct plan_place){ 0 },
                              "no memory for what was planned before");
    memo->axes = self->move->axis_count;
    return MOTION_OK;
}

static int compose_keys(const struct compose *self)
{
    int err = compose_memo(self);

    for (uint32_t i = 0; i < self->move->axis_count && err == MOTION_OK; i++) {
        const struct plan_axis *axis = &self->move->axis[i];
        if (axis->driver != PLAN_BY_KEYS)
            continue;
        plan_progress_tell(self->progress, "planning", axis->name, i,
                           self->move->axis_count);
        err = plan_axis_track_again(axis, self->former, self->memo, i,
                                    &self->track[i], self->error);
        self->error->axis = i;
    }
    return err;
}

/* Their keys get times that nobody wrote. */
static int compose_joints(const struct compose *self)
{
    if (self->move->joints == NULL || self->move->joints->axes == 0)
        return MOTION_OK;
    plan_progress_tell(self->progress, "planning", "timing", 0, 0);
    self->outcome->is_bent = true;
    return plan_joints_tracks(self->move, self->track, self->error);
}

/* Its axes are coordinates, or follow those of a head or a tool. */
static int compose_drive(const struct compose *self)
{
    const struct plan_path *path = self->move->path;
    struct plan_outcome *outcome = self->outcome;

    if (path->carrier == NULL)
        return plan_path_tracks(path, &outcome->drive, self->track,
                                self->error);
    return path->carrier->arm.arm.count > 0
               ? plan_tool_tracks(path, &outcome->drive, self->track,
                                  &outcome->carrier_bound_q32, self->error)
               : plan_carry_tracks(path, &outcome->drive, self->track,
                                   &outcome->carrier_bound_q32, self->error);
}

/* The law is the distance along the path until something bends its time. */
static int compose_path(const struct compose *self)
{
    struct plan_outcome *outcome = self->outcome;
    struct motion_track *distance = &outcome->distance;
    int err;

    if (self->move->path == NULL)
        return MOTION_OK;
    plan_progress_tell(self->progress, "planning", "path", 0, 0);
    err = compose_drive(self);
    if (err < 0)
        return err;
    outcome->has_path = true;
    *distance = outcome->drive.law;
    distance->segment =
        malloc((size_t)distance->count * sizeof *distance->segment);
    if (distance->segment == NULL) {
        plan_track_init(distance, 0);
        return plan_error_set(self->error, MOTION_E_FULL,
                              self->move->path->place,
                              "no memory for the path");
    }
    distance->capacity = distance->count;
    for (uint32_t i = 0; i < distance->count; i++)
        distance->segment[i] = outcome->drive.law.segment[i];
    return MOTION_OK;
}

static int compose_camera(const struct compose *self)
{
    const struct plan_camera *camera = self->move->camera;
    struct plan_outcome *outcome = self->outcome;

    if (camera == NULL)
        return MOTION_OK;
    if (!outcome->has_path && plan_camera_is_on_path(camera))
        return plan_error_set(self->error, MOTION_E_ARG, camera->place,
                              "the camera has no path");
    outcome->has_camera = true;
    if (camera->following.rig != NULL && camera->look != PLAN_LOOK_KEYS)
        return plan_follow_tracks(camera, self->track,
                                  outcome->camera_bound_q32,
                                  &outcome->lens_bound_q32, self->error);
    return plan_camera_tracks(camera, &outcome->drive, self->track,
                              outcome->camera_bound_q32, self->progress,
                              self->error);
}

static int compose_blend(const struct compose *self)
{
    return self->move->blend == NULL
               ? MOTION_OK
               : plan_blend_tracks(self->move->blend, self->track, self->error);
}

static void compose_drop(const struct compose *self)
{
    for (uint32_t i = 0; i < self->move->axis_count; i++)
        plan_track_free(&self->track[i]);
    plan_outcome_free(self->outcome);
}

/* What drives the axes. */
static int compose_base(const struct compose *self)
{
    int err;

    *self->outcome = (struct plan_outcome){ .warp_bound = motion_real_zero() };
    *self->error = (struct plan_error){ .axis = PLAN_AXES_MAX };
    for (uint32_t i = 0; i < self->move->axis_count; i++)
        plan_track_init(&self->track[i], 0);
    err = compose_keys(self);
    if (err == MOTION_OK)
        err = compose_joints(self);
    if (err == MOTION_OK)
        err = compose_path(self);
    if (err == MOTION_OK)
        err = compose_blend(self);
    return err == MOTION_OK ? compose_camera(self) : err;
}

/* A sentence about another move tells whose it is. */
static int compose_other_fail(const struct compose *self,
                              const struct plan_other *other,
                              const struct plan_error *inner)
{
    if (other->file[0] == 0) {
        *self->error = *inner;
        self->error->axis = PLAN_AXES_MAX;
        return inner->code;
    }
    return plan_error_set(self->error, inner->code, other->place,
                          "%.100s:%u:%u: %s", other->file, inner->place.line,
                          inner->place.column, inner->text);
}

/* Another move's tracks, for as long as it takes to mix them in. */
struct compose_guest {
    struct plan_outcome outcome;
    struct plan_error error;
    struct motion_track track[]; /* of its axes */
};

static int
compose_other(const struct compose *self, const struct plan_other *other,
              int (*mix)(const struct plan_other *, const struct motion_track[],
                         struct motion_track[], struct plan_error *))
{
    struct compose_guest *guest = calloc(
        1, sizeof *guest + other->move->axis_count * sizeof guest->track[0]);
    int err;

    self->outcome->is_bent = true;
    if (guest == NULL)
        return plan_error_set(self->error, MOTION_E_FULL, other->place,
                              "no memory for another move");
    const struct compose inner = { .move = other->move,
                                   .track = guest->track,
                                   .outcome = &guest->outcome,
                                   .progress = self->progress,
                                   .error = &guest->error };
    err = compose_base(&inner);
    if (err == MOTION_OK)
        err = mix(other, guest->track, self->track, self->error);
    else
        err = compose_other_fail(self, other, &guest->error);
    compose_drop(&inner);
    free(guest);
    return err;
}

static int compose_others(const struct compose *self)
{
    const struct plan_move *move = self->move;
    int err = MOTION_OK;

    for (uint32_t i = 0; i < move->layers && err == MOTION_OK; i++)
        err = compose_other(self, &move->layer[i], plan_layer_tracks);
    if (err == MOTION_OK && move->fade != NULL)
        err = compose_other(self, move->fade, plan_fade_tracks);
    return err;
}

/* Of every axis, and of the distance along the path. */
static int compose_bend(const struct compose *self,
                        const struct plan_axis *axis)
{
    struct plan_outcome *outcome = self->outcome;
    int err;

    outcome->is_bent = true;
    err = plan_warp_track(axis, &outcome->warp, self->error);
    for (uint32_t i = 0; i < self->move->axis_count && err == MOTION_OK; i++) {
        plan_progress_tell(self->progress, "planning", "warp", i,
                           self->move->axis_count);
        err = plan_warp_apply(&outcome->warp, axis, &self->track[i],
                              &outcome->warp_bound, self->error);
    }
    if (err == MOTION_OK && outcome->has_path)
        err = plan_warp_apply(&outcome->warp, axis, &outcome->distance,
                              &outcome->warp_bound, self->error);
    return err;
}

static int64_t compose_end(const struct compose *self)
{
    int64_t end_ns_q12 = 0;

    for (uint32_t i = 0; i < self->move->axis_count; i++)
        if (self->track[i].end_ns_q12 > end_ns_q12)
            end_ns_q12 = self->track[i].end_ns_q12;
    return end_ns_q12;
}

/* By the warp of the file, or by the one that its frames make. */
static int compose_warp(const struct compose *self)
{
    const struct plan_shoot *shoot = self->move->shoot;
    struct plan_axis frames;
    int err;

    if (shoot == NULL)
        return self->move->warp == NULL ? MOTION_OK
                                        : compose_bend(self, self->move->warp);
    err = plan_shoot_warp(shoot, compose_end(self), &frames, self->error);
    if (err < 0)
        return err;
    err = compose_bend(self, &frames);
    plan_axis_free(&frames);
    return err;
}

/* A key that is fixed in time has none but its own. */
static int compose_fixed(const struct compose *self, int64_t end_ns_q12)
{
    const struct plan_move *move = self->move;

    for (uint32_t a = 0; a < move->axis_count; a++)
        for (uint32_t i = 0; i < move->axis[a].key_count; i++)
            if ((move->axis[a].key[i].fixed & PLAN_FIXED_TIME) != 0)
                return plan_error_set(
                    self->error, MOTION_E_ARG, move->axis[a].key[i].place,
                    "key %u of axis %s is fixed in time, and a duration of "
                    "%.6g s would move it: as written the move takes %.6g s",
                    i + 1, move->axis[a].name,
                    (double)move->duration_ns_q12 / (double)MOTION_FIXED_S_Q12,
                    (double)end_ns_q12 / (double)MOTION_FIXED_S_Q12);
    return MOTION_OK;
}

/* All of it in the time that the move is to take. */
static int compose_duration(const struct compose *self)
{
    struct plan_outcome *outcome = self->outcome;
    const int64_t to = self->move->duration_ns_q12, from = compose_end(self);
    int err = MOTION_OK;

    if (to == 0 || from == to)
        return MOTION_OK;
    if (from == 0)
        return plan_error_set(self->error, MOTION_E_ARG,
                              self->move->duration_place,
                              "the move stands still, and has no duration");
    err = compose_fixed(self, from);
    if (err < 0)
        return err;
    outcome->is_bent = true;
    outcome->written_ns_q12 = from;
    outcome->played_ns_q12 = to;
    for (uint32_t i = 0; i < self->move->axis_count && err == MOTION_OK; i++)
        err = plan_duration_apply(&self->track[i], from, to);
    if (err == MOTION_OK && outcome->has_path)
        err = plan_duration_apply(&outcome->distance, from, to);
    return err == MOTION_OK
               ? err
               : plan_error_set(self->error, err, self->move->duration_place,
                                "the move takes %.6g s as written, and "
                                "%.6g s are beyond the range of its formats",
                                (double)from / (double)MOTION_FIXED_S_Q12,
                                (double)to / (double)MOTION_FIXED_S_Q12);
}

/* The path begins when its axes are up to speed. */
static int compose_roll(const struct compose *self)
{
    const int64_t before = self->move->pre_roll_ns_q12,
                  after = self->move->post_roll_ns_q12;
    struct plan_outcome *outcome = self->outcome;
    int err = MOTION_OK;

    if (before == 0 && after == 0)
        return MOTION_OK;
    outcome->is_bent = true;
    outcome->lag_ns_q12 = before;
    outcome->tail_ns_q12 = after;
    for (uint32_t i = 0; i < self->move->axis_count && err == MOTION_OK; i++) {
        err = plan_roll_track(&self->track[i], before, after);
        self->error->axis = i;
    }
    if (err == MOTION_OK && outcome->has_path)
        err = plan_shape_delay(&outcome->distance, before);
    return err == MOTION_OK
               ? err
               : plan_error_set(self->error, err, self->move->axis[0].place,
                                "with pre-roll and post-roll the move leaves "
                                "the range of its formats (%s)",
                                motion_err_text(err));
}

int plan_compose(const struct plan_move *move, struct motion_track track[],
                 struct plan_outcome *outcome,
                 const struct plan_progress *progress, struct plan_error *error)
{
    return plan_compose_again(move, NULL, NULL, track, outcome, progress,
                              error);
}

int plan_compose_again(const struct plan_move *move,
                       const struct plan_memo *former, struct plan_memo *memo,
                       struct motion_track track[],
                       struct plan_outcome *outcome,
                       const struct plan_progress *progress,
                       struct plan_error *error)
{
    const struct compose self = { move,  track,  outcome, progress,
                                  error, former, memo };
    int err = compose_base(&self);

    if (err == MOTION_OK)
        err = compose_others(&self);
    if (err == MOTION_OK)
        err = compose_warp(&self);
    if (err == MOTION_OK)
        err = compose_duration(&self);
    if (err == MOTION_OK)
        err = compose_roll(&self);
    if (err == MOTION_OK)
        err = plan_couple_tracks(move, track, error);
    plan_progress_end(progress);
    if (err < 0)
        compose_drop(&self);
    return err;
}

void plan_outcome_free(struct plan_outcome *outcome)
{
    plan_drive_free(&outcome->drive);
    plan_track_free(&outcome->distance);
    plan_track_free(&outcome->warp);
    *outcome = (struct plan_outcome){ .has_path = false };
}

int64_t plan_outcome_time(const struct plan_outcome *outcome, int64_t t_ns_q12)
{
    int64_t t = t_ns_q12 - outcome->lag_ns_q12;

    if (outcome->played_ns_q12 != 0 &&
        motion_fixed_muldiv(t, outcome->written_ns_q12, outcome->played_ns_q12,
                            &t) < 0)
        t = t < 0 ? 0 : outcome->written_ns_q12;
    return outcome->warp.count == 0 ? t : plan_warp_time(&outcome->warp, t);
}

int plan_move_reserve(struct plan_move *move, uint32_t axes)
{
    move->axis = calloc(axes, sizeof *move->axis);
    return move->axis == NULL && axes > 0 ? MOTION_E_FULL : MOTION_OK;
}

static void compose_free_base(struct plan_move *move)
{
    for (uint32_t i = 0; i < move->axis_count; i++)
        plan_axis_free(&move->axis[i]);
    free(move->axis);
    free(move->joints);
    plan_path_free(move->path);
    plan_camera_free(move->camera);
    plan_blend_free(move->blend);
}

static void compose_free_other(struct plan_other *other)
{
    if (other->move != NULL)
        compose_free_base(other->move);
    free(other->move);
    plan_axis_free(&other->weight);
    free(other->of);
}

void plan_move_free(struct plan_move *move)
{
    compose_free_base(move);
    for (uint32_t i = 0; i < move->layers; i++)
        compose_free_other(&move->layer[i]);
    free(move->layer);
    if (move->fade != NULL)
        compose_free_other(move->fade);
    free(move->fade);
    if (move->warp != NULL)
        plan_axis_free(move->warp);
    free(move->warp);
    free(move->shoot);
    free(move->event);
    for (uint32_t i = 0; i < move->couplings; i++)
        plan_axis_free(&move->coupling[i].cam);
    free(move->coupling);
    *move = (struct plan_move){ .axis_count = 0 };
}
