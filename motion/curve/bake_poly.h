/* motion/curve/bake_poly.h - polynomials of high degree as quintics, with a
 * bound.
 *
 * A track's segments have degree 5 at most.  A longer polynomial is cut into
 * pieces; on each the quintic that has its p, v, a at both ends misses it by
 *     p  max|f''''''| h^6 / 46080          h: length of the piece
 *     v  max|f''''''| h^5 sqrt(5) / 30000
 *     a  max|f''''''| h^4 / 1920
 * (Hermite's remainder; Birkhoff & Priver 1967), and the maximum is bounded by
 * the Taylor coefficients at the middle of the piece: proved, where bake.h,
 * which takes any motion, measures. */
#ifndef MOTION_CURVE_BAKE_POLY_H
#define MOTION_CURVE_BAKE_POLY_H

#include <stdint.h>

#include "motion/core/track.h"
#include "motion/number/real.h"

#define MOTION_BAKE_POLY_DEGREE 25  /* a quintic of a quintic */
#define MOTION_BAKE_POLY_PIECES 256 /* most per polynomial */

/* base + sum c[k] u^k, units, u = 0 .. 1 over the duration.
 *
 * Where that is one polynomial of another, its powers cancel each other near
 * u = 1 (of degree 25 they are up to 10^9 times the sum): `chain` has the two,
 * by which p, v and a at the borders of the pieces are computed instead. */
struct motion_bake_poly {
    int64_t base_q32;
    int degree;
    struct motion_real c[MOTION_BAKE_POLY_DEGREE + 1];
    const struct motion_bake_poly_chain *chain; /* NULL: there is none */
};

/* outer(inner(u)); both without a chain of their own.  A first or second
 * derivative (the latter halved) that is below what rounding left in the
 * polynomial, noise[0] and noise[1], is zero: what rests is at rest. */
struct motion_bake_poly_chain {
    struct motion_bake_poly inner, outer;
    struct motion_real inner_noise[2], outer_noise[2];
};

/* What a piece may miss, in unit, unit/s, unit/s2. */
struct motion_bake_poly_tolerance {
    struct motion_real pos, vel, acc;
};

/* Append `poly` over `dur`; the track must end where it starts (what is left
 * between them is absorbed).  Where it ends is rounded to the format of the
 * last segment, or is `*end_q32` when that is not NULL.  Raises *bound, when
 * not NULL, to what position misses at most, 2^-32 for rounding included.
 * Pieces are powers of two of the duration; none is shorter than 1/256 of it,
 * then *bound tells.  Errors as motion_track_append_*; the track is unchanged
 * then.  Plan-time. */
int motion_bake_poly_append(struct motion_track *track, int64_t dur_ns_q12,
                            const struct motion_bake_poly *poly,
                            const int64_t *end_q32,
                            const struct motion_bake_poly_tolerance *tolerance,
                            struct motion_real *bound);

/* The polynomial between two values of u, in its own u = 0 .. 1. */
void motion_bake_poly_part(const struct motion_bake_poly *poly,
                           struct motion_real from, struct motion_real to,
                           struct motion_bake_poly *part);

#endif
