/* motion/number/trig.h - angles and their functions, in integers.
 *
 * An angle is a fraction of a turn, `*_turn`, an int64 in units of 2^-64 turn:
 * -2^63 is half a turn, and overflow is exactly what a turn does, so the
 * difference of two angles, taken modulo 2^64, is the shorter way from one to
 * the other (motion_trig_diff).  Angles that count turns (axes) are degrees in
 * Q32.32.  Errors are absolute: 2^-59 of sine or radian.  Plan-time: divide. */
#ifndef MOTION_NUMBER_TRIG_H
#define MOTION_NUMBER_TRIG_H

#include <stdint.h>

#include "motion/number/real.h"

#define MOTION_TRIG_HALF_TURN    INT64_MIN
#define MOTION_TRIG_QUARTER_TURN ((int64_t)1 << 62)

/* a - b and a + b, round the circle. */
static inline int64_t motion_trig_diff(int64_t a_turn, int64_t b_turn)
{
    return (int64_t)((uint64_t)a_turn - (uint64_t)b_turn);
}
static inline int64_t motion_trig_sum(int64_t a_turn, int64_t b_turn)
{
    return (int64_t)((uint64_t)a_turn + (uint64_t)b_turn);
}

/* Sine and cosine, Q2.62. */
void motion_trig_sincos(int64_t angle_turn, int64_t *sin_q62, int64_t *cos_q62);

/* The angle of the point (x, y), both in the same format, whatever it is;
 * 0 at the origin. */
int64_t motion_trig_atan2(int64_t y, int64_t x);
/* The same for numbers of any size. */
int64_t motion_trig_atan2_real(struct motion_real y, struct motion_real x);

/* floor(sqrt(x^2 + y^2)), exact. */
uint64_t motion_trig_hypot(int64_t x, int64_t y);

/* An angle from -1/2 (inclusive) to 1/2 turn as degrees, Q32.32; and the angle
 * of any number of degrees (exact division rounded to nearest). */
int64_t motion_trig_deg_q32(int64_t angle_turn);
int64_t motion_trig_from_deg_q32(int64_t deg_q32);
/* In radian; and back, for |rad| < 2^40, where a quarter of the mantissa is
 * left for the fraction of a turn. */
struct motion_real motion_trig_rad(int64_t angle_turn);
int64_t motion_trig_from_rad(struct motion_real rad);

#endif
