/* motion/plan/shaper/shaper_fit.h - frequency and damping of a recorded vibration.
 *
 * After a step, or after any move that has ended, a flexible axis swings by
 * itself:
 *     x(t) = c + exp(-z w t) (a cos(w sqrt(1 - z^2) t) + b sin(...))
 * and whatever made it swing is in a and b alone, so that the time of the step
 * need not be known.  c, a and b are linear: for every w and z they are solved
 * for, and w and z alone are searched (variable projection), from the highest
 * peak of the periodogram on, by the simplex method.
 * Sources: G. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973); J. Nelder,
 * R. Mead, Computer J. 7 (1965). */
#ifndef MOTION_PLAN_SHAPER_SHAPER_FIT_H
#define MOTION_PLAN_SHAPER_SHAPER_FIT_H

#include <stdint.h>

#include "motion/plan/move.h"

#define PLAN_SHAPER_FIT_ROWS_MIN 16
#define PLAN_SHAPER_FIT_ROWS_MAX 200000

struct plan_shaper_fit {
    double frequency_hz; /* undamped */
    double damping;      /* ratio */
    double amplitude;    /* at from_s, in the unit of x */
    double settled;      /* c */
    double rms;          /* of what the model leaves */
    double explained;    /* 1 - (rms / rms of x - c)^2 */
    double from_s;       /* the first row that was used */
    uint32_t rows;       /* that were used */
    /* Of what the model leaves, where that swings as well; 0: nothing does. */
    double second_hz, second_damping, second_amplitude;
};

/* Rising times and what was measured, `count` of each.  Rows up to the last one
 * that is about as far from the settled value as any, before the first swing to
 * the other side, are left out: until then the axis was driven.  MOTION_E_ARG with a sentence where there are too few
 * rows, less than one and a half periods, less than four rows a period, no
 * vibration that stands out (`explained` below a half), or none at all (damping
 * 0.95 or more); MOTION_E_FULL. */
int plan_shaper_fit(const double t_s[], const double x[], uint32_t count,
                    struct plan_shaper_fit *fit, struct plan_error *error);

#endif
