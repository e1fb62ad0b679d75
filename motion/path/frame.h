/* motion/path/frame.h - frames that travel along a curve in space.
 *
 *   frenet               tangent T, normal N, binormal B = T x N, curvature
 *                        and torsion; none of N, B, torsion exists where the
 *                        curve is straight, and N flips at an inflection
 *   rotation-minimising  T and a reference r that turns about T as little as it
 *                        can: the frame for a camera or a tool.  By double
 *                        reflection; a closed curve gets the twist that is left
 *                        at its end spread evenly
 *
 * Curves plug in as a function that gives the point and its derivatives with
 * respect to any parameter, in any constant unit of it: directions, curvature
 * and torsion do not depend on it (B is along P' x P'', not along P''; T = P'
 * holds for arc length only).
 * Source: W. Wang, B. Juettler, D. Zheng, Y. Liu, Computation of rotation
 * minimizing frames, ACM Transactions on Graphics 27(1), 2008.  Plan-time. */
#ifndef MOTION_PATH_FRAME_H
#define MOTION_PATH_FRAME_H

#include <stdint.h>

#include "motion/number/vec.h"

struct motion_curve_point {
    struct motion_vec pos, d1, d2, d3;
};

struct motion_curve {
    /* Point at parameter u, first <= u <= last, and its derivatives up to
     * `order`, 0 .. 3; what lies above may be left alone. MOTION_OK or an
     * error, which is handed on. */
    int (*at)(const void *context, int64_t u, int order,
              struct motion_curve_point *point);
    const void *context;
    int64_t first, last;
};

/* Where P' is zero the direction in which the curve leaves the point (AFTER) or
 * has come to it (BEFORE), from P'' or P'''. */
enum motion_frame_side { MOTION_FRAME_AFTER, MOTION_FRAME_BEFORE };

/* Unit tangent; MOTION_E_RANGE where all three derivatives are zero. */
int motion_frame_tangent(const struct motion_curve_point *point,
                         enum motion_frame_side side,
                         struct motion_dir *tangent);

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

/* Double reflection over exactly these parameters (in any order): frame[0] is
 * given at u[0], the others are filled in.  Fourth order: halving the distances
 * divides the error by 16. */
int motion_frame_table(const struct motion_curve *curve, const int64_t *u,
                       uint32_t count, struct motion_frame *frame);

/* The rotation-minimising frame itself: carry `frame` from u = from to u = to
 * (> from) by steps that halve until one step and two agree within `tolerance`
 * radian (2^-62 .. 1; scaled Q2.62), the difference then taken out by
 * extrapolation, so that the error of a step is well below the tolerance.
 * A step is at most 1/256 of the curve: what turns and turns back within that
 * is not seen, so carry a curve of many pieces piece by piece.
 * MOTION_E_WORK after 2^20 steps, MOTION_E_ARG for a tolerance out of range or
 * parameters outside the curve. */
int motion_frame_carry(const struct motion_curve *curve, int64_t from,
                       int64_t to, int64_t tolerance_q62,
                       struct motion_frame *frame);

/* r of `b` as seen from `a`, about their common tangent. */
int64_t motion_frame_twist(const struct motion_frame *a,
                           const struct motion_frame *b);
/* Turn r and s about t. */
void motion_frame_turn(struct motion_frame *frame, int64_t angle_turn);

/* Closed curves: the last frame stands where the first does, but twisted.  Turn
 * frame i back by its share, weight[i] / weight[count-1] (weights increase from
 * 0; arc length gives an even twist; NULL: i), so that the last becomes the
 * first.  Returns MOTION_OK and the twist that was there (may be NULL),
 * MOTION_E_EMPTY below two frames, MOTION_E_ARG for a last weight of 0, or when
 * the tangents of first and last differ by over 2^-16. */
int motion_frame_close(struct motion_frame *frame, const uint64_t *weight,
                       uint32_t count, int64_t *twist_turn);

#endif
