/* motion/path/arclen.h - how long a curve in space is, and where on it a length
 * is.
 *
 * A curve is a list of pieces, smooth inside; piece k runs over border[k] ..
 * border[k+1] of the parameter u and is evaluated at x = u - border[k].  Its
 * length is the integral of the speed |P'|, by rules to choose from:
 *
 *   rectangle   value at the left of every panel              error ~ h
 *   trapezoid   panels' ends                                        ~ h^2
 *   simpson     ends and middles                                    ~ h^4
 *   gauss       8 Gauss-Legendre points in a panel                  ~ h^16
 *   chords      straight lines between the panels' ends, the        ~ h^2
 *               chord table of the textbooks; always too short
 *   adaptive    gauss, panels as long as the error allows
 *
 * All but adaptive take equal panels and compare with half as many: that
 * difference is the error they report, and symmetry can make it zero (one chord
 * and two of an S are equally long, half of its length).  Adaptive never looks
 * at the same place for both, and does not halve.
 *
 * A table holds lengths at the adaptive panels.  The inverse finds the panel,
 * then solves s(u) = s with Newton's method between the panel's ends: no
 * interpolation, so a constant speed is constant.  Errors are lengths along the
 * curve: where the speed is zero (a cusp, a rest at a key) that is what counts,
 * and u itself is not well defined.
 *
 * Computed in motion/number/real.h, relative rounding about 2^-54.
 * Plan-time. */
#ifndef MOTION_PATH_ARCLEN_H
#define MOTION_PATH_ARCLEN_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/number/real.h"

#define MOTION_ARCLEN_AXES 8

struct motion_arclen_point {
    struct motion_real pos[MOTION_ARCLEN_AXES]; /* unit */
    struct motion_real d1[MOTION_ARCLEN_AXES];  /* dP/du */
    struct motion_real d2[MOTION_ARCLEN_AXES];  /* d2P/du2 */
};

struct motion_arclen_curve {
    uint32_t axes;                    /* 1 .. MOTION_ARCLEN_AXES */
    uint32_t pieces;                  /* at least 1 */
    const struct motion_real *border; /* pieces + 1, increasing */
    /* Of the first `axes` axes at x, 0 <= x <= width of the piece, seen from
     * inside the piece: order 0: pos; 1: d1; 2: all three.  What is not asked
     * for may be filled in, too. */
    void (*at)(const void *context, uint32_t piece, struct motion_real x,
               int order, struct motion_arclen_point *point);
    const void *context;
};

/* Polynomials in x: coef[(piece * axes + axis) * (degree + 1) + power]. */
struct motion_arclen_poly {
    const struct motion_real *coef;
    uint32_t degree;
    uint32_t axes;
};

/* For `at`, with a motion_arclen_poly as context. */
void motion_arclen_poly_at(const void *context, uint32_t piece,
                           struct motion_real x, int order,
                           struct motion_arclen_point *point);

/* |P'| */
struct motion_real motion_arclen_speed(const struct motion_arclen_curve *curve,
                                       uint32_t piece, struct motion_real x);

/* MOTION_E_EMPTY without a piece, MOTION_E_ARG for axes out of range,
 * MOTION_E_ORDER when borders do not increase. */
int motion_arclen_check(const struct motion_arclen_curve *curve);

enum motion_arclen_rule {
    MOTION_ARCLEN_RECTANGLE,
    MOTION_ARCLEN_TRAPEZOID,
    MOTION_ARCLEN_SIMPSON,
    MOTION_ARCLEN_GAUSS,
    MOTION_ARCLEN_CHORDS,
    MOTION_ARCLEN_ADAPTIVE,
};

struct motion_arclen_measure {
    struct motion_real length, error;
    uint32_t evaluations; /* of the curve, those for the error included */
};

/* Length of the whole curve with `panels` (even, 2 .. 2^20) per piece; adaptive
 * does not use them.  Errors of motion_arclen_check, MOTION_E_ARG. */
int motion_arclen_measure(const struct motion_arclen_curve *curve,
                          enum motion_arclen_rule rule, uint32_t panels,
                          struct motion_arclen_measure *result);

/* Where a panel starts; the last row is the end of the curve.  `guess`: with u
 * the share of the panel's length, guess[0] u + .. + guess[4] u^5 is about the
 * share of its x; where a search for a length begins. */
struct motion_arclen_row {
    struct motion_real x, s;
    struct motion_real guess[5];
    uint32_t piece;
};

struct motion_arclen_table {
    const struct motion_arclen_curve *curve;
    struct motion_arclen_row *row;
    uint32_t count, capacity;
    struct motion_real length;
    struct motion_real error; /* of any length in the table */
    uint32_t evaluations;
};

/* Fill `row`; a smooth piece takes 4 rows, a cusp about 60.  `tolerance` is of
 * the length; zero: 2^-40.  Errors of motion_arclen_check; MOTION_E_ARG for a
 * negative tolerance; MOTION_E_FULL. */
int motion_arclen_build(struct motion_arclen_table *table,
                        const struct motion_arclen_curve *curve,
                        struct motion_real tolerance,
                        struct motion_arclen_row *row, uint32_t capacity);

struct motion_arclen_place {
    uint32_t piece;
    struct motion_real x;
    struct motion_real error; /* of length, table's included: P is nearer than
                                 this to the point meant */
    uint32_t evaluations;
};

/* Where length s is; s below zero and beyond the end are the ends.  At a
 * border, the piece that starts there. */
void motion_arclen_find(const struct motion_arclen_table *table,
                        struct motion_real s,
                        struct motion_arclen_place *place);
/* The same, not leaving a piece: s before it is its start, after it its end. */
void motion_arclen_find_in(const struct motion_arclen_table *table,
                           uint32_t piece, struct motion_real s,
                           struct motion_arclen_place *place);

/* Length where a piece starts; of piece `pieces`, the whole length. */
struct motion_real motion_arclen_border(const struct motion_arclen_table *table,
                                        uint32_t piece);

/* Position along the curve as a function of length: P, the unit tangent T =
 * dP/ds in d1, the curvature vector dT/ds in d2.  Where P' is zero T is the
 * limit from inside the piece, from P'', and the curvature, which is infinite
 * unless the curve is straight there, is given as zero. */
void motion_arclen_by_length(const struct motion_arclen_curve *curve,
                             uint32_t piece, struct motion_real x,
                             struct motion_arclen_point *point);

#endif
