/* tests/motion/path/frame_walk.h - rotation-minimising frames along a curve that is
 * known, by the steps of motion/path/frame.h. */
#ifndef TESTS_MOTION_PATH_FRAME_WALK_H
#define TESTS_MOTION_PATH_FRAME_WALK_H

#include "motion/core/err.h"
#include "motion/path/frame.h"

struct frame_curve {
    int (*at)(const void *context, int64_t u, int order,
              struct motion_curve_point *point);
    const void *context;
    int64_t first, last;
};

/* Where P' is zero, the direction of P'': that in which the curve leaves, and at
 * its last point the other way round. */
static inline int frame_tangent(const struct frame_curve *curve, int64_t u,
                                struct motion_curve_point *point,
                                struct motion_dir *tangent)
{
    struct motion_real d1, d2;
    int err = curve->at(curve->context, u, 3, point);

    if (err < 0)
        return err;
    d1 = motion_vec_length(point->d1);
    d2 = motion_vec_length(point->d2);
    /* below this part of P'', P' is rounding */
    if (motion_real_cmp(d1, motion_real_scale(d2, -48)) >= 0)
        return motion_vec_unit(point->d1, tangent);
    err = motion_vec_unit(point->d2, tangent);
    if (u == curve->last)
        *tangent = motion_dir_neg(*tangent);
    return err;
}

/* Over exactly these parameters: frame[0] is given at u[0]. */
static inline int frame_table(const struct frame_curve *curve, const int64_t *u,
                              uint32_t count, struct motion_frame *frame)
{
    struct motion_curve_point before, point;
    struct motion_dir t;
    int err = frame_tangent(curve, u[0], &before, &t);

    for (uint32_t i = 1; i < count && err == MOTION_OK; i++) {
        err = frame_tangent(curve, u[i], &point, &t);
        if (err == MOTION_OK)
            err = motion_frame_step(&frame[i - 1],
                                    motion_vec_sub(point.pos, before.pos), t,
                                    &frame[i]);
        before = point;
    }
    return err;
}

#define FRAME_WALK_STEPS 256

/* From one parameter to another: by so many steps and half as many, and what is
 * left of their error, which is of the fourth order, taken out. */
static inline int frame_carry(const struct frame_curve *curve, int64_t from,
                              int64_t to, struct motion_frame *frame)
{
    static struct motion_frame row[2][FRAME_WALK_STEPS + 1];
    static int64_t u[FRAME_WALK_STEPS + 1];
    int err = MOTION_OK;

    for (int fine = 0; fine < 2 && err == MOTION_OK; fine++) {
        const int steps = FRAME_WALK_STEPS / (2 - fine);
        for (int i = 0; i <= steps; i++)
            u[i] = i < steps ? from + (to - from) / steps * i : to;
        row[fine][0] = *frame;
        err = frame_table(curve, u, (uint32_t)steps + 1, row[fine]);
    }
    if (err < 0)
        return err;
    *frame = row[1][FRAME_WALK_STEPS];
    motion_frame_turn(
        frame, motion_frame_twist(&row[0][FRAME_WALK_STEPS / 2], frame) / 15);
    return MOTION_OK;
}

#endif
