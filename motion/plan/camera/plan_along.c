/* motion/plan/camera/plan_along.c - see plan_along.h. */
#include "motion/plan/camera/plan_along.h"

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/plan_track.h"

/* Steps of the walk, at least, and per border. */
#define ALONG_ROWS        2048
#define ALONG_BORDER_ROWS 4

static int64_t along_end(const struct plan_along *self)
{
    return self->bake.border_ns_q12[self->bake.borders - 1];
}

uint32_t plan_along_row(const struct plan_along *self, int64_t t_ns_q12)
{
    int64_t row = 0;

    (void)motion_fixed_muldiv(t_ns_q12, self->rows, along_end(self), &row);
    return (uint32_t)row;
}

void plan_along_cause(struct plan_along *self, const struct motion_track *track)
{
    self->cause[self->causes++] = track;
}

static int along_refuse(const struct plan_along *self, int err, int64_t t)
{
    const char *what = self->refusal(err);

    if (what == NULL && err == MOTION_E_WORK)
        what = "the path takes too much work to plan: give it a larger "
               "tolerance";
    return plan_error_set(self->error, err, self->path->place, "at %.3f s %s",
                          (double)t / (double)MOTION_FIXED_S_Q12,
                          what != NULL ? what : motion_err_text(err));
}

static int along_walk(struct plan_along *self)
{
    self->rows = ALONG_BORDER_ROWS * self->bake.borders;
    self->rows = self->rows > ALONG_ROWS ? self->rows : ALONG_ROWS;
    int err = self->begin(self->context);

    if (err < 0)
        return along_refuse(self, err, 0);
    for (uint32_t i = 0; i <= self->rows; i++) {
        int64_t t = 0;
        (void)motion_fixed_muldiv(along_end(self), i, self->rows, &t);
        err = self->row(self->context, i, t);
        if (err < 0)
            return along_refuse(self, err, t);
    }
    return MOTION_OK;
}

/* A source of the baker. */
static int along_at(void *context, int64_t t, enum motion_bake_side side,
                    struct motion_bake_point point[])
{
    struct plan_along *self = context;

    self->last_ns_q12 = t;
    return self->at(self->context, t, side, point);
}

static int along_bake(struct plan_along *self,
                      struct motion_track *const track[], int64_t *bound_q32)
{
    struct motion_track *list[MOTION_BAKE_AXES];
    struct motion_bake_report report;

    self->bake.source = (struct motion_bake_source){ along_at, self };
    self->bake.tolerance_q32 = self->path->tolerance_q32;
    for (uint32_t i = 0; i < self->bake.axes; i++)
        list[i] = track[i];
    int err = plan_bake_tracks(&self->bake, list, &report);
    if (err < 0)
        err = along_refuse(self, err, self->last_ns_q12);
    for (uint32_t i = 0; i < self->bake.axes; i++) {
        plan_bake_bound(&report, i, bound_q32);
        if (err < 0)
            plan_track_free(list[i]);
        else
            plan_track_trim(list[i]);
    }
    return err;
}

int plan_along_tracks(struct plan_along *self, struct plan_drive *drive,
                      struct motion_track *const list[], uint32_t axes,
                      int64_t *bound_q32)
{
    int err = plan_path_places(self->path, drive, self->place, self->error);

    self->bake.axes = axes;
    for (int i = 0; i < PLAN_SPACE_AXES; i++)
        plan_along_cause(self, &self->place[i]);
    if (err == MOTION_OK && self->open != NULL)
        err = self->open(self->context, drive);
    if (err == MOTION_OK &&
        plan_bake_borders(&self->bake, self->cause, self->causes,
                          self->time_ns_q12, self->times) < 0)
        err = along_refuse(self, MOTION_E_FULL, 0);
    if (err == MOTION_OK)
        err = along_walk(self);
    if (err == MOTION_OK)
        err = along_bake(self, list, bound_q32);
    if (err < 0)
        plan_drive_free(drive);
    for (int i = 0; i < PLAN_SPACE_AXES; i++)
        plan_track_free(&self->place[i]);
    plan_bake_free(&self->bake);
    return err;
}
