/* motion/path/rotspline.h - a rotation with continuous angular velocity and
 * acceleration through keys at any times.
 *
 * Between two keys the body turns by q(t) = q_i exp(r(t)), the rotation vector
 * r a cubic from 0 to log(q_i* q_i+1), the shorter way.  The angular velocities
 * at the inner keys are those that leave no step in the angular acceleration: a
 * block tridiagonal system, linear up to a small term that is iterated.
 * Velocities and accelerations are seen from the body, rad/s and rad/s^2.
 * Source: the relations of r', r'' and the angular velocity are those of F. L.
 * Markley & J. L. Crassidis, Fundamentals of Spacecraft Attitude Determination
 * and Control (2014), 3.1; the cubic is Hermite's.  Plan-time. */
#ifndef MOTION_PATH_ROTSPLINE_H
#define MOTION_PATH_ROTSPLINE_H

#include "motion/number/quat.h"

/* The angular velocity at the first and last key. */
enum motion_rotspline_end {
    MOTION_ROTSPLINE_CHORD, /* constant speed to the neighbour */
    MOTION_ROTSPLINE_REST,  /* zero */
    MOTION_ROTSPLINE_GIVEN, /* as in the key */
};

/* What planning keeps per span and per row of its system. */
struct motion_rotwork {
    struct motion_real to_rate[2], from_rate[2], extra[3];
    struct motion_vec left[3], inverse[3], row[3], right;
};

struct motion_rotkey {
    int64_t t_ns_q12; /* increasing */
    struct motion_quat q;
    struct motion_vec rate; /* used where the end is GIVEN, filled in else */
    /* of the span that starts here, filled in */
    struct motion_vec chord;    /* its rotation vector */
    struct motion_vec end_rate; /* r' at its end */
    struct motion_real dur_s;
    struct motion_rotwork work;
};

struct motion_rotspline {
    struct motion_rotkey *key;
    uint32_t count;
};

/* Fill in the keys (t and q are read and kept) and point at them.  Linear in
 * count.  Returns MOTION_OK; MOTION_E_EMPTY below one key, MOTION_E_ORDER when
 * times do not increase, MOTION_E_ARG for an end rule that does not exist,
 * MOTION_E_DIVERGED when the iteration does not settle.
 *   rounds   0: iterate until the rates are right to 2^-44, at most 200 times;
 *            a settled acceleration does not step.  Else stop after so many and
 *            say MOTION_OK: near half turns per span a round may gain less than
 *            a factor of two, and SciPy's RotationSpline stops after 10; its
 *            curves are met with rounds = 10. */
int motion_rotspline_plan(struct motion_rotspline *spline,
                          struct motion_rotkey *key, uint32_t count,
                          enum motion_rotspline_end first,
                          enum motion_rotspline_end last, uint32_t rounds);

/* The rotation at the part u = 0 .. 1 of the span that starts at a key. */
struct motion_quat motion_rotspline_within(const struct motion_rotkey *span,
                                           int64_t u_q62);

#endif
