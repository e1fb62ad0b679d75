/* motion/path/path.h - a curve in space driven by a speed law: P(U(S(t))).
 *
 *     S   a distance-time function: a track of one axis, from 0 to the length,
 *         never going back (speed_law.h, ease.h, or drawn by the user)
 *     U   the curve's parameter at a length (arclen.h)
 *     P   the curve
 *
 * By the chain rule, with T = dP/ds and K = dT/ds: v = T s', a = K s'^2 + T
 * s''.  Baked to one track per axis (bake.h), with borders where the law has
 * them and where it comes to the curve's own.
 *
 * At a point where the curve turns back (a cusp) or rests (P' = 0, not
 * straight) the curvature is infinite: it can be driven only where the law
 * rests there too, else the baking ends with MOTION_E_TOLERANCE.  Plan-time. */
#ifndef MOTION_PATH_PATH_H
#define MOTION_PATH_PATH_H

#include <stdint.h>

#include "motion/core/track.h"
#include "motion/curve/bake.h"
#include "motion/path/arclen.h"

struct motion_path {
    const struct motion_arclen_table *table;
    const struct motion_track *distance;
    /* Room: knot for pieces + 1 times, border for pieces + 1 and the segments
     * of the law together. */
    int64_t *knot_ns_q12, *border_ns_q12;
    uint32_t borders;             /* filled in */
    struct motion_real law_error; /* of `distance`, from motion_speed_append;
                                     zero after init */
    uint32_t evaluations; /* of the baking at most; 0, after init: any number */
    int64_t last_ns_q12;  /* where the baking looked last */
};

/* Check the law and find when it comes to the borders of the curve.
 * MOTION_E_EMPTY without a law; MOTION_E_ARG when it does not go from 0 to the
 * curve's length (2^-30 unit, and 2^-48 of it); MOTION_E_ORDER when it goes
 * back. */
int motion_path_init(struct motion_path *path,
                     const struct motion_arclen_table *table,
                     const struct motion_track *distance,
                     int64_t knot_storage_ns_q12[],
                     int64_t border_storage_ns_q12[]);

/* The first time at which a law has come to length s; where that is a border of
 * its own up to rounding, the border. */
int64_t motion_path_when(const struct motion_track *law, struct motion_real s);

/* What is asked of the baking; see bake.h. */
struct motion_path_tolerance {
    struct motion_real pos, vel, acc;
};

/* Append the drive to the tracks, one per axis of the curve.  They must end
 * where the curve starts.  The bound holds the table's error and the law's too.
 * Errors of motion_bake. */
int motion_path_bake(struct motion_path *path,
                     const struct motion_path_tolerance *tolerance,
                     struct motion_track *track[],
                     struct motion_bake_report *report);

/* --- curves made of tracks ------------------------------------------------ */

/* Tracks (of splines over any parameter, taken as seconds), all with the same
 * segment borders. */
struct motion_path_tracks {
    const struct motion_track *const *track;
    uint32_t axes;
    struct motion_real *coef; /* room: MOTION_TRACK_DEGREE + 1 for each axis of
                                 each segment */
    struct motion_arclen_poly poly; /* filled in; the curve's context */
};

/* The curve through them; `border` has room for segments + 1.  MOTION_E_EMPTY,
 * MOTION_E_ARG when the borders are not the same. */
int motion_path_from_tracks(struct motion_arclen_curve *curve,
                            struct motion_path_tracks *tracks,
                            struct motion_real border[]);

#endif
