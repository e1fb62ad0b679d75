/* motion/plan/compose.c - see compose.h. */
#include "motion/plan/compose.h"

#include <stdlib.h>

#include "motion/err.h"
#include "motion/plan/plan_camera.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/plan_room.h"

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
    struct plan_error *error;
};

static int compose_keys(const struct compose *self)
{
    int err = MOTION_OK;

    for (uint32_t i = 0; i < self->move->axis_count && err == MOTION_OK; i++) {
        const struct plan_axis *axis = &self->move->axis[i];
        if (axis->driver != PLAN_BY_KEYS)
            continue;
        err = plan_axis_track(axis, &self->track[i], self->error);
        self->error->axis = i;
    }
    return err;
}

/* The law is the distance along the path until something bends its time. */
static int compose_path(const struct compose *self)
{
    struct plan_outcome *outcome = self->outcome;
    struct motion_track *distance = &outcome->distance;
    int err;

    if (self->move->path == NULL)
        return MOTION_OK;
    err = plan_path_tracks(self->move->path, &outcome->drive, self->track,
                           self->error);
    if (err < 0)
        return err;
    outcome->has_path = true;
    *distance = outcome->drive.law;
    distance->segment =
        malloc((size_t)distance->count * sizeof *distance->segment);
    if (distance->segment == NULL) {
        plan_room_init(distance, 0);
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
    if (!outcome->has_path)
        return plan_error_set(self->error, MOTION_E_ARG, camera->place,
                              "the camera has no path");
    outcome->has_camera = true;
    return plan_camera_tracks(camera, &outcome->drive, self->track,
                              outcome->camera_bound_q32, self->error);
}

int plan_compose(const struct plan_move *move, struct motion_track track[],
                 struct plan_outcome *outcome, struct plan_error *error)
{
    const struct compose self = { move, track, outcome, error };
    int err;

    *outcome = (struct plan_outcome){ .has_path = false };
    *error = (struct plan_error){ .axis = PLAN_AXES_MAX };
    for (uint32_t i = 0; i < move->axis_count; i++)
        plan_room_init(&track[i], 0);
    err = compose_keys(&self);
    if (err == MOTION_OK)
        err = compose_path(&self);
    if (err == MOTION_OK)
        err = compose_camera(&self);
    if (err < 0) {
        for (uint32_t i = 0; i < move->axis_count; i++)
            plan_track_free(&track[i]);
        plan_outcome_free(outcome);
    }
    return err;
}

void plan_outcome_free(struct plan_outcome *outcome)
{
    plan_drive_free(&outcome->drive);
    plan_track_free(&outcome->distance);
    *outcome = (struct plan_outcome){ .has_path = false };
}

void plan_move_free(struct plan_move *move)
{
    for (uint32_t i = 0; i < move->axis_count; i++)
        free(move->axis[i].key);
    plan_path_free(move->path);
    plan_camera_free(move->camera);
    *move = (struct plan_move){ .axis_count = 0 };
}
