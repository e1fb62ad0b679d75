/* motion/number/elementary.h - powers of two and sines of motion_real, in
 * integers.
 *
 * Series of motion_real operations, the same bits on every machine; errors are
 * relative to the result unless said otherwise.  Plan-time. */
#ifndef MOTION_NUMBER_ELEMENTARY_H
#define MOTION_NUMBER_ELEMENTARY_H

#include "motion/number/real.h"

/* ln 2, pi; within 2^-61 of themselves. */
struct motion_real motion_elementary_ln2(void);
struct motion_real motion_elementary_pi(void);

/* 2^a, |a| <= 20000; within 2^-54. */
struct motion_real motion_elementary_exp2(struct motion_real a);

/* Sine and cosine of a quarter turns, |a| < 2^40; absolute error 2^-58 and what
 * a itself does not resolve. */
void motion_elementary_sincos(struct motion_real quarters,
                              struct motion_real *sine,
                              struct motion_real *cosine);

/* The angle, in quarter turns, -1 .. 1, whose sine is a; beyond +-1 as at +-1.
 * Absolute error 2^-57. */
struct motion_real motion_elementary_asin(struct motion_real a);

#endif
