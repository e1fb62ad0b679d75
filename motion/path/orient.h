/* motion/path/orient.h - a rotation through keys, at rest at both ends.
 *
 * A curve of rotations R over a parameter, and the parameter over what is keyed
 * (a time, or a distance along a path).  In the span from t_i to t_i+1, with
 * x = (t - t_i) / (t_i+1 - t_i), the parameter is the quintic
 *
 *     u(x) = a x + (10 - 6a - 4b) x^3 + (8a + 7b - 15) x^4 + (6 - 3a - 3b) x^5
 *
 * from 0 to 1 whose slopes at the ends are a and b and whose second derivatives
 * there are 0 (Biagiotti & Melchiorri, 2.1.5).  It never goes back for slopes
 * in 0 .. 2.  So position, velocity and acceleration of the parameter continue
 * at every key, and at rest at the first and last one the rotation is at rest.
 *
 *   SLERP  R is the great arc from key to key, and every key is a rest: a = b =
 *          0, and speed and acceleration are continuous.
 *   SQUAD  R as in motion/number/quat.h.  The speed of the parameter at a key is
 *          the harmonic mean of those of its two spans, so that keys need not be
 *          evenly spaced; between even ones it is constant.  Acceleration steps
 *          at the inner keys.
 *   C2     R is the spline of rotspline.h, with constant speed at its ends; the
 *          parameter is the time itself but in the first and last span, in which
 *          it starts and stops.  Speed and acceleration are continuous.
 *
 * From key to key it turns the shorter way.  Plan-time. */
#ifndef MOTION_PATH_ORIENT_H
#define MOTION_PATH_ORIENT_H

#include "motion/path/rotspline.h"

enum motion_orient_curve {
    MOTION_ORIENT_SLERP,
    MOTION_ORIENT_SQUAD,
    MOTION_ORIENT_C2,
};

struct motion_orient_key {
    int64_t t; /* increasing: a time or a distance, in any unit */
    struct motion_quat q;
    /* filled in, of the span that starts here */
    struct motion_quat from, to, from_inner, to_inner; /* SQUAD */
    struct motion_real first, last;                    /* a, b */
};

/* It points at the caller's keys. */
struct motion_orient {
    enum motion_orient_curve curve;
    struct motion_orient_key *key;
    uint32_t count;
    struct motion_rotkey *rotkey; /* C2: as many, filled in */
    struct motion_rotspline spline;
};

/* Fill in what is derived from curve, key, count and rotkey.  MOTION_E_EMPTY
 * below one key, MOTION_E_ORDER when t does not increase, MOTION_E_RANGE for a
 * span beyond int64, MOTION_E_ARG for a curve that does not exist,
 * MOTION_E_DIVERGED as motion_rotspline_plan. */
int motion_orient_plan(struct motion_orient *orient);

/* The rotation at t; before the first and after the last key that key.
 * MOTION_E_RANGE where SQUAD's control points are half a turn apart, so that no
 * arc between them is the shorter one. */
int motion_orient_at(const struct motion_orient *orient, int64_t t,
                     struct motion_quat *q);

#endif
