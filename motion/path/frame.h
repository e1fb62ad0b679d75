/* motion/path/frame.h - frames that travel along a curve in space.
 *
 *   frenet               tangent T, normal N, binormal B = T x N, curvature
 *                        and torsion; none of N, B, torsion exists where the
 *                        curve is straight, and N flips at an inflection
 *   rotation-minimising  T and a reference r that turns about T as little as it
 *                        can: the frame for a camera or a tool.  By double
 *                        reflection
 *
 * A point comes with its derivatives with respect to any parameter, in any
 * constant unit of it: directions, curvature and torsion do not depend on it (B
 * is along P' x P'', not along P''; T = P' holds for arc length only).
 * Source: W. Wang, B. Juettler, D. Zheng, Y. Liu, Computation of rotation
 * minimizing frames, ACM Transactions on Graphics 27(1), 2008.  Plan-time. */
#ifndef MOTION_PATH_FRAME_H
#define MOTION_PATH_FRAME_H

#include <stdint.h>

#include "motion/number/vec.h"

struct motion_curve_point {
    struct motion_vec pos, d1, d2, d3;
};

/* --- Frenet -------------------------------------------------------------- */

/* Below a curvature of 2^-40 per unit, and where P' and P'' are parallel within
 * 2^-40 so that nothing is left of their cross product, the curve is flat. */
#define MOTION_FRENET_OK   0
#define MOTION_FRENET_FLAT 1

struct motion_frenet {
    struct motion_dir t, n, b;
    struct motion_real curvature; /* 1/unit, >= 0 */
    struct motion_real torsion;   /* 1/unit, positive for a right-hand screw */
};

/* Needs derivatives to the third.  MOTION_FRENET_OK; MOTION_FRENET_FLAT: t is
 * right, curvature, torsion, n and b are zero; MOTION_E_RANGE: P' is zero. */
int motion_frame_frenet(const struct motion_curve_point *point,
                        struct motion_frenet *frenet);

/* --- rotation-minimising ------------------------------------------------- */

/* Right-handed: t, r, s = t x r. */
struct motion_frame {
    struct motion_dir t, r, s;
};

/* The frame at t whose r is as near as can be to `hint`; MOTION_E_ARG when the
 * hint is parallel to t. */
int motion_frame_start(struct motion_dir t, struct motion_dir hint,
                       struct motion_frame *frame);

/* One step: the frame `from` at a point, carried over the chord to a point with
 * tangent `t`.  The twist error of a step shrinks with the fifth power of its
 * length.  MOTION_E_RANGE when the tangent reverses. */
int motion_frame_step(const struct motion_frame *from, struct motion_vec chord,
                      struct motion_dir t, struct motion_frame *to);

/* r of `b` as seen from `a`, about their common tangent. */
int64_t motion_frame_twist(const struct motion_frame *a,
                           const struct motion_frame *b);
/* Turn r and s about t. */
void motion_frame_turn(struct motion_frame *frame, int64_t angle_turn);

#endif
