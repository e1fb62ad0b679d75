/* motion/plan/camera/plan_keyed.c - see plan_keyed.h. */
#include "motion/plan/camera/plan_keyed.h"

#include <math.h>

#include "motion/core/err.h"
#include "motion/double/double_math.h"
#include "motion/plan/plan_track.h"

void plan_keyed_init(struct plan_keyed *self)
{
    plan_track_init(&self->roll, 0);
    for (int i = 0; i < PLAN_SPACE_AXES; i++)
        plan_track_init(&self->subject[i], 0);
}

int plan_keyed_open(struct plan_keyed *self, const struct plan_camera *camera,
                    struct plan_error *error)
{
    const int subject = camera->look == PLAN_LOOK_SUBJECT ? PLAN_SPACE_AXES : 0;
    int err = MOTION_OK;

    if (camera->roll != NULL)
        err = plan_axis_track(camera->roll, &self->roll, error);
    for (int i = 0; i < subject && err == MOTION_OK; i++)
        err = plan_axis_track(&camera->following.subject[i], &self->subject[i],
                              error);
    error->axis = PLAN_AXES_MAX;
    return err;
}

void plan_keyed_free(struct plan_keyed *self)
{
    for (int i = 0; i < PLAN_SPACE_AXES; i++)
        plan_track_free(&self->subject[i]);
    plan_track_free(&self->roll);
}

struct plan_jet_vec plan_keyed_subject(const struct plan_keyed *self,
                                       const struct plan_camera *camera,
                                       int64_t t_ns_q12, int side)
{
    struct plan_jet_vec at;

    for (int i = 0; i < PLAN_SPACE_AXES; i++)
        at.x[i] = camera->look == PLAN_LOOK_SUBJECT
                      ? plan_rig_track(&self->subject[i], t_ns_q12, side)
                      : plan_jet_of(ldexp((double)camera->point_q32[i], -32));
    return at;
}

struct plan_jet plan_keyed_roll(const struct plan_keyed *self, int64_t t_ns_q12,
                                int side)
{
    return plan_jet_scale(plan_rig_track(&self->roll, t_ns_q12, side),
                          DOUBLE_RADIAN);
}
