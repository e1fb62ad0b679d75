/* motion/plan/plan_blend.c - see plan_blend.h. */
#include "motion/plan/plan_blend.h"

#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/plan_track.h"

/* --- blend ---------------------------------------------------------------- */

struct blend {
    const struct plan_blend *blend;
    struct motion_track weight[PLAN_WEIGHTS_MAX];
    struct plan_error *error;
};

/* Weights that change the axis. */
static int blend_axis(const struct blend *self, uint32_t i,
                      struct motion_track *track)
{
    const struct plan_blend *blend = self->blend;
    struct motion_pose_term term[PLAN_WEIGHTS_MAX];
    uint32_t terms = 0;
    int err;

    for (uint32_t k = 0; k < blend->weights; k++)
        if (blend->weight[k].offset_q32[i] != 0)
            term[terms++] =
                (struct motion_pose_term){ &self->weight[k],
                                           blend->weight[k].offset_q32[i] };
    plan_track_init(track, blend->base_q32[i]);
    do
        err = motion_pose_sum(track, blend->base_q32[i], term, terms);
    while (err == MOTION_E_FULL && plan_track_grow(track) == MOTION_OK);
    if (err == MOTION_OK) {
        plan_track_trim(track);
        return MOTION_OK;
    }
    return plan_error_set(self->error, err, blend->place,
                          "the blend cannot be planned (%s)",
                          motion_err_text(err));
}

int plan_blend_tracks(const struct plan_blend *blend,
                      struct motion_track track[], struct plan_error *error)
{
    struct blend self = { .blend = blend, .error = error };
    int err = MOTION_OK;

    for (uint32_t k = 0; k < PLAN_WEIGHTS_MAX; k++)
        plan_track_init(&self.weight[k], 0);
    for (uint32_t k = 0; k < blend->weights && err == MOTION_OK; k++)
        err = plan_axis_track(&blend->weight[k].curve, &self.weight[k], error);
    error->axis = PLAN_AXES_MAX;
    for (uint32_t i = 0; i < blend->axes && err == MOTION_OK; i++)
        err = blend_axis(&self, i, &track[blend->axis[i]]);
    for (uint32_t k = 0; k < blend->weights; k++)
        plan_track_free(&self.weight[k]);
    for (uint32_t i = 0; i < blend->axes && err < 0; i++)
        plan_track_free(&track[blend->axis[i]]);
    return err;
}

void plan_blend_free(struct plan_blend *blend)
{
    if (blend == NULL)
        return;
    for (uint32_t k = 0; k < blend->weights; k++) {
        plan_axis_free(&blend->weight[k].curve);
        free(blend->weight[k].offset_q32);
    }
    free(blend->weight);
    free(blend->axis);
    free(blend->base_q32);
    free(blend);
}

/* --- layers and fades ----------------------------------------------------- */

/* The result takes the track's place. */
static void blend_replace(struct motion_track *track,
                          struct motion_track *result)
{
    plan_track_free(track);
    *track = *result;
    plan_track_trim(track);
}

static int blend_refuse(const struct plan_other *other, const char *what,
                        int err, struct motion_track *result,
                        struct plan_error *error)
{
    plan_track_free(result);
    return plan_error_set(error, err, other->place,
                          "the %s cannot be planned (%s)", what,
                          motion_err_text(err));
}

int plan_layer_tracks(const struct plan_other *layer,
                      const struct motion_track with[],
                      struct motion_track track[], struct plan_error *error)
{
    for (uint32_t i = 0; i < layer->move->axis_count; i++) {
        struct motion_track *to = &track[layer->of[i]], sum;
        int err;
        plan_track_init(&sum, 0);
        do
            err = motion_pose_add(&sum, to, &with[i]);
        while (err == MOTION_E_FULL && plan_track_grow(&sum) == MOTION_OK);
        if (err < 0)
            return blend_refuse(layer, "layer", err, &sum, error);
        blend_replace(to, &sum);
    }
    return MOTION_OK;
}

static int blend_fade(const struct plan_other *fade,
                      const struct motion_track *weight,
                      const struct motion_track with[],
                      struct motion_track track[], struct plan_error *error)
{
    for (uint32_t i = 0; i < fade->move->axis_count; i++) {
        struct motion_track *to = &track[fade->of[i]], mixed;
        int err;
        plan_track_init(&mixed, 0);
        do
            err = motion_pose_fade(&mixed, to, &with[i], weight,
                                   PLAN_FADE_TOLERANCE_Q32, NULL);
        while (err == MOTION_E_FULL && plan_track_grow(&mixed) == MOTION_OK);
        if (err < 0)
            return blend_refuse(fade, "fade", err, &mixed, error);
        blend_replace(to, &mixed);
    }
    return MOTION_OK;
}

int plan_fade_tracks(const struct plan_other *fade,
                     const struct motion_track with[],
                     struct motion_track track[], struct plan_error *error)
{
    struct motion_track weight;
    int err = plan_axis_track(&fade->weight, &weight, error);

    error->axis = PLAN_AXES_MAX;
    if (err == MOTION_OK)
        err = blend_fade(fade, &weight, with, track, error);
    plan_track_free(&weight);
    return err;
}
