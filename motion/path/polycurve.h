/* motion/path/polycurve.h - a curve in space made of polynomials, as a
 * motion_curve.
 *
 * Piece i runs over [border[i], border[i+1]] of the parameter and there, with
 * w = (u - border[i]) / (border[i+1] - border[i]), P = sum coef[i][k] w^k.
 * Derivatives are with respect to w; they are the next piece's at a border.
 * Plan-time. */
#ifndef MOTION_PATH_POLYCURVE_H
#define MOTION_PATH_POLYCURVE_H

#include "motion/path/frame.h"

struct motion_polycurve {
    const int64_t *border;         /* pieces + 1, increasing */
    const struct motion_vec *coef; /* pieces x (degree + 1) */
    uint32_t pieces;
    uint32_t degree;
};

/* The curve over all pieces; it points at `poly`.  MOTION_E_EMPTY without a
 * piece, MOTION_E_ORDER when borders do not increase. */
int motion_polycurve_init(struct motion_curve *curve,
                          const struct motion_polycurve *poly);

#endif
