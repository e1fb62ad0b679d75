/* motion/curve/bake.h - what is not a polynomial becomes one: a track within a
 * bound.
 *
 * A speed law over a curve, a rotation, an easing equation, a time warp: each
 * gives p, v, a of its axes at any time.  Baking appends quintics that meet
 * them exactly at their ends, and lets each reach as far as the tolerance
 * allows.
 *
 * The bound is computed for every segment, from the differences e, e', e'' of
 * motion and quintic at three uneven places between the ends:
 *   - between two places e is at most the control polygon of the quintic
 *     through e, e', e'' there, plus what that quintic misses;
 *   - what it misses is h^6 max|p'''''' | / 46080 for places h apart (Hermite's
 *     remainder), which is measured: the quintic from the start to the second
 *     place, over the first.  Twice the h, 64 times the miss, and it is taken
 *     whole.
 * So the bound fails only where the sixth derivative is over 50 times larger in
 * some part of a segment than at the places: when something happens between
 * them that they do not show.  `longest` says how short things may be.
 * Source: Birkhoff & Priver, Hermite interpolation errors for derivatives, J.
 * Math. & Phys. 46 (1967).  Plan-time. */
#ifndef MOTION_CURVE_BAKE_H
#define MOTION_CURVE_BAKE_H

#include <stdint.h>

#include "motion/core/track.h"
#include "motion/number/real.h"

#define MOTION_BAKE_AXES 8

/* Of one axis: unit, unit/s, unit/s2.  Positions are good to 2^-59 of
 * themselves. */
struct motion_bake_point {
    struct motion_real pos, vel, acc;
};

/* Which limit is meant at a border, where v or a may step. */
enum motion_bake_side { MOTION_BAKE_LEFT = -1, MOTION_BAKE_RIGHT = 1 };

/* The motion: fills `axes` points for a time between the first and the last
 * border; an error (negative) ends the baking and is its answer. */
struct motion_bake_source {
    int (*at)(void *context, int64_t t_ns_q12, enum motion_bake_side side,
              struct motion_bake_point point[]);
    void *context;
};

struct motion_bake {
    struct motion_bake_source source;
    uint32_t axes;                /* 1 .. MOTION_BAKE_AXES */
    const int64_t *border_ns_q12; /* increasing; from first to last is baked */
    uint32_t borders;             /* at least 2; put one where v, a or a third
                                     derivative steps */
    /* Largest distance allowed, of all axes; a vel or acc of zero does not
     * matter.  The track rounds: pos below 2^-30 is never reached. */
    struct motion_real pos, vel, acc;
    int64_t longest_ns_q12;  /* segment; 0: from border to border */
    int64_t shortest_ns_q12; /* 0: 1 us */
    uint32_t evaluations;    /* of the source at most; 0: any number */
};

/* The track is within this of the motion everywhere, as motion_track_sample
 * gives it (pos), or as the polynomial is before sampling rounds (vel, acc). */
struct motion_bake_bound {
    struct motion_real pos, vel, acc;
};

struct motion_bake_report {
    struct motion_bake_bound bound[MOTION_BAKE_AXES];
    uint32_t segments;    /* appended to each track */
    uint32_t evaluations; /* of the source */
};

/* Append the motion to the tracks, one per axis, all with the same times.  The
 * motion must start where the tracks end (2^-30 unit; what there is beyond is
 * part of the bound).  MOTION_E_ARG for a bad job or another start,
 * MOTION_E_ORDER for borders that do not increase, MOTION_E_TOLERANCE when
 * that is not met with the shortest segment; MOTION_E_WORK beyond the
 * evaluations allowed; MOTION_E_FULL, MOTION_E_RANGE as motion_track_append_*;
 * all tracks are unchanged then, and of `report`, which may be NULL, the
 * evaluations alone are filled in. */
int motion_bake(const struct motion_bake *job, struct motion_track *track[],
                struct motion_bake_report *report);

/* MOTION_E_ORDER unless borders increase; MOTION_E_RANGE where two are closer
 * than `shortest` or further apart than a segment lasts. */
int motion_bake_check_borders(const int64_t border_ns_q12[], uint32_t borders,
                              int64_t shortest_ns_q12);

/* For sources with one axis that have only polynomials of u in 0..1 over a
 * duration: p, v, a of sum coef[k] u^k, k <= degree, with dur in seconds. */
struct motion_bake_point motion_bake_horner(const struct motion_real coef[],
                                            int degree, struct motion_real u,
                                            struct motion_real dur_s);

/* The powers u .. u^5 of the quintic with d = p1 - p0, v0, v1, a0 / 2, a1 / 2
 * in units of u, in this order. */
void motion_bake_quintic(const struct motion_real w[5],
                         struct motion_real c[5]);

/* What a baker is made of: one quintic from the track's end with v and a of
 * `from` (its pos is where the track is) to `to`, solved in integers of the
 * segment, so that both ends keep 60 bits.  Errors as motion_track_append_*. */
int motion_bake_append(struct motion_track *track, int64_t dur_ns_q12,
                       const struct motion_bake_point *from,
                       const struct motion_bake_point *to);

/* What the track adds to a bound when it is sampled, and the arithmetic of
 * bakers, for a segment that ends at `pos`. */
struct motion_real motion_bake_rounding(const struct motion_segment *segment,
                                        struct motion_real pos);

/* p, v, a of a segment's polynomial at dt from its start, 0 .. dur, before
 * sampling rounds them. */
struct motion_bake_point
motion_bake_segment(const struct motion_segment *segment, int64_t dt_ns_q12);

/* Of `spans` that begin at these times, the one that holds a time seen from one
 * side; before all of them the first. */
uint32_t motion_bake_span(const int64_t start_ns_q12[], uint32_t spans,
                          int64_t t_ns_q12, enum motion_bake_side side);

/* The same of a track that is not empty; and p, v, a there. */
const struct motion_segment *motion_bake_find(const struct motion_track *track,
                                              int64_t t_ns_q12,
                                              enum motion_bake_side side);
struct motion_bake_point motion_bake_track(const struct motion_track *track,
                                           int64_t t_ns_q12,
                                           enum motion_bake_side side);

/* The powers of u = 0 .. 1 of a segment's polynomial, MOTION_TRACK_DEGREE + 1
 * of them. */
void motion_bake_coefficients(const struct motion_segment *segment,
                              struct motion_real coef[]);

/* Where the track ends, its fraction below 2^-32 included. */
struct motion_real motion_bake_end(const struct motion_track *track);

/* A time as seconds. */
struct motion_real motion_bake_seconds(int64_t t_ns_q12);

#endif
