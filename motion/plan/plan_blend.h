/* motion/plan/plan_blend.h - poses that are blended, moves on top of moves, and
 * cross-fades (motion/curve/pose.h).
 *
 *     blend   base + sum w_i(t) (pose_i - base)
 *     layer   the axes of another move are added
 *     fade    from + w(t) (to - from), `to` being another move */
#ifndef MOTION_PLAN_PLAN_BLEND_H
#define MOTION_PLAN_PLAN_BLEND_H

#include "motion/curve/pose.h"
#include "motion/plan/move.h"

#define PLAN_WEIGHTS_MAX MOTION_POSE_TERMS
#define PLAN_LAYERS_MAX  16

/* How much there is of a pose over time. */
struct plan_weight {
    struct plan_axis curve; /* positions are ratios; keys on the heap */
    int64_t *offset_q32;    /* of the blend's axes, pose - base; on the heap */
};

struct plan_blend {
    uint32_t *axis; /* of the move; this and what follows on the heap */
    uint32_t axes;
    int64_t *base_q32; /* of the blend's axes */
    struct plan_weight *weight;
    uint32_t weights;
    struct plan_place place;
};

/* The blend's axes into track[blend->axis[..]], which must be empty; they
 * belong to the caller.  On an error the code, *error, and empty tracks. */
int plan_blend_tracks(const struct plan_blend *blend,
                      struct motion_track track[], struct plan_error *error);
void plan_blend_free(struct plan_blend *blend);

/* Another move, whose axes have to do with axes of this one.  It has no layers,
 * fade or warp of its own. */
struct plan_other {
    struct plan_move *move;  /* on the heap */
    uint32_t *of;            /* its axis i is this axis of the move; the same */
    char file[128];          /* where it was written, if in another file */
    struct plan_axis weight; /* fade: ratios; keys on the heap */
    struct plan_place place;
};

/* How far at most a fade is from what it should be, unit. */
#define PLAN_FADE_TOLERANCE_Q32 ((int64_t)1 << 5)

/* Add the other's tracks, or fade to them: track[other->of[i]] becomes the sum,
 * or the fade, with `with[i]`.  MOTION_E_FULL, MOTION_E_RANGE, MOTION_E_TOLERANCE;
 * *error then, and the tracks as they were or already changed. */
int plan_layer_tracks(const struct plan_other *layer,
                      const struct motion_track with[],
                      struct motion_track track[], struct plan_error *error);
int plan_fade_tracks(const struct plan_other *fade,
                     const struct motion_track with[],
                     struct motion_track track[], struct plan_error *error);

#endif
