/* tests/motion/path/lookat_point.h - one look from a place at a point, both whole
 * 2^-32 of the unit. */
#ifndef TESTS_MOTION_PATH_LOOKAT_POINT_H
#define TESTS_MOTION_PATH_LOOKAT_POINT_H

#include "motion/core/err.h"
#include "motion/path/lookat.h"

static inline int lookat_stand(const void *context, int64_t distance_q32,
                               struct motion_vec *pos,
                               struct motion_dir *tangent)
{
    (void)distance_q32;
    *pos = *(const struct motion_vec *)context;
    if (tangent != NULL)
        *tangent = (struct motion_dir){ { (int64_t)1 << 62, 0, 0 } };
    return MOTION_OK;
}

static inline int lookat_point(const struct motion_lookat *lookat,
                               struct motion_lookat_state *state,
                               struct motion_vec pos, struct motion_vec point,
                               int64_t tilt_turn, struct motion_view *view)
{
    const struct motion_lookat_path path = { lookat_stand, &pos, 1 };
    struct motion_target target = { .kind = MOTION_TARGET_FIXED };

    for (int i = 0; i < 3; i++)
        (void)motion_real_round(point.x[i], 32, &target.point_q32[i]);
    return motion_lookat_at(lookat, state, &target, &path, 0, tilt_turn, view);
}

#endif
