/* motion/plan/camera/plan_stencil.h - two derivatives from seven places in a row
 * (Fornberg, Mathematics of Computation 51, 1988):
 *
 *     central   60 h f'  = -f-3 + 9 f-2 - 45 f-1 + 45 f1 - 9 f2 + f3
 *               180 h2 f'' = 2 f-3 - 27 f-2 + 270 f-1 - 490 f0 + ..
 *     forward   60 h f'  = -147 f0 + 360 f1 - 450 f2 + 400 f3 - 225 f4 + 72 f5
 *                          - 10 f6
 *               180 h2 f'' = 812 f0 - 3132 f1 + 5265 f2 - 5080 f3 + 2970 f4
 *                          - 972 f5 + 137 f6
 *
 * Backward is forward with a negative h.  They stay between two borders, so that
 * the two sides of one are told apart. */
#ifndef MOTION_PLAN_CAMERA_PLAN_STENCIL_H
#define MOTION_PLAN_CAMERA_PLAN_STENCIL_H

#include <stdint.h>

#include "motion/number/quat.h"
#include "motion/plan/rig/plan_rig.h"

#define PLAN_STENCIL_NODES 7

/* Rows: forward, central. */
extern const int64_t plan_stencil_first[2][PLAN_STENCIL_NODES];  /* over 60 */
extern const int64_t plan_stencil_second[2][PLAN_STENCIL_NODES]; /* over 180 */

/* Where the places are: from, from + step .. */
struct plan_stencil {
    int central;
    int64_t from, step;
};

/* About `at`, low <= at <= high, where there is room for it. */
struct plan_stencil plan_stencil_at(int64_t low, int64_t high, int64_t step,
                                    int64_t at);

/* The frame of a rotation (right, up and backwards of the camera, in space) from
 * its turns at these places; derivatives by what `h`, the step, is counted in. */
void plan_stencil_frame(const struct plan_stencil *stencil,
                        const struct motion_quat turn[PLAN_STENCIL_NODES],
                        double h, struct plan_rig_frame *frame);

#endif
