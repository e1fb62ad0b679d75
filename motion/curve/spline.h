/* motion/curve/spline.h - curves through keys that need not be evenly spaced.
 *
 *   linear       straight lines, or with corners rounded by parabolas or
 *                quintics, which leave out the inner keys            C0, C1, C2
 *   hermite      cubic through keys with given velocities            C1
 *   catmull-rom  velocity from the parabola through three keys       C1
 *                (non-uniform Catmull-Rom, Overhauser, Barry-Goldman)
 *   cardinal     velocity mu (p[i+1]-p[i-1]) / (t[i+1]-t[i-1]);      C1
 *                mu 0..2, mu = 1 first-order on uneven keys (tension
 *                tau = mu/2 in the other convention)
 *   kochanek     tension, continuity and bias at every key           C1 (C0)
 *   monotone     PCHIP: never beyond the keys                        C1
 *   akima        velocities from the four nearest chords: hardly     C1
 *                swings; with motion_spline_limit_overshoot not at all
 *   c2           cubic, all velocities solved for at once            C2
 *   quintic      velocity and acceleration from the parabola, a      C2
 *                quintic between: acceleration does not step
 *   c4           quintic, all velocities and accelerations solved    C4
 *   constraints  of every key p, and any of v and a: the polynomial  C0 .. C2
 *                of lowest degree on every span
 *   bspline      keys attract; the curve passes by the inner ones    C2
 *   lagrange     one polynomial through all keys: swings             all
 *
 * C1 curves step in acceleration at every key, which is infinite jerk: plan
 * checks say so on an axis with a jerk limit.  A tangent is in unit/s and is
 * multiplied by the span's own duration.  Coefficients are computed in
 * motion/number/real.h and rounded once, to the format of their segment.
 * Source: Barry & Goldman, SIGGRAPH 1988; Farin, Curves and Surfaces, 8.5. */
#ifndef MOTION_CURVE_SPLINE_H
#define MOTION_CURVE_SPLINE_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/track.h"
#include "motion/number/real.h"

MOTION_C_BEGIN

struct motion_key {
    int64_t t_ns_q12; /* increasing; the first is where the track starts */
    int64_t pos_q32;
    struct motion_real vel; /* unit/s, where has_vel or filled in */
    struct motion_real acc; /* unit/s2 */
    bool has_vel, has_acc;
};

/* How the first and last key get a velocity that was not given. */
enum motion_spline_end {
    MOTION_SPLINE_REST,       /* velocity and acceleration zero (clamped) */
    MOTION_SPLINE_ONE_SIDED,  /* from the parabola through the three keys at
                                 that end (cardinal: mu times the chord) */
    MOTION_SPLINE_NATURAL,    /* the cubic's acceleration is zero at the end
                                 key: (3 chord - neighbour's velocity) / 2 */
    MOTION_SPLINE_NOT_A_KNOT, /* c2, c4: the first spans (two; three) are one
                                 polynomial */
    MOTION_SPLINE_PERIODIC,   /* c2: the last key is the first again; for both
                                 ends */
};

/* The functions that fill in vel (and acc) of the keys that do not have one:
 * keys that do are kept, and has_vel and has_acc stay as they are; they say
 * what was given.  A value is within 2^-50 of the largest term of its rule.
 * Two keys have no parabola: their chord is taken; one key rests.
 * Return MOTION_E_EMPTY below one key, MOTION_E_ORDER when times do not
 * increase, MOTION_E_RANGE when a span is longer than a segment may be or a
 * velocity (2^31 unit/s) or acceleration (2^47 unit/s2) leaves its range,
 * MOTION_E_ARG for a parameter out of range or an end rule that the curve does
 * not have; what was filled in until then is of no use.
 * Plan-time; linear in count. */
int motion_spline_tangents_parabola(struct motion_key *key, uint32_t count,
                                    enum motion_spline_end first,
                                    enum motion_spline_end last);
int motion_spline_tangents_cardinal(struct motion_key *key, uint32_t count,
                                    int64_t mu_q32,
                                    enum motion_spline_end first,
                                    enum motion_spline_end last);
/* Second derivative of the same parabolas, for the quintic.  At the ends: zero
 * for REST and NATURAL, the parabola's for ONE_SIDED. */
int motion_spline_accelerations(struct motion_key *key, uint32_t count,
                                enum motion_spline_end first,
                                enum motion_spline_end last);
/* Ends REST or ONE_SIDED. */
int motion_spline_monotone(struct motion_key *key, uint32_t count,
                           enum motion_spline_end first,
                           enum motion_spline_end last);
int motion_spline_akima(struct motion_key *key, uint32_t count,
                        enum motion_spline_end first,
                        enum motion_spline_end last);
/* Reduce velocities that were not given until every cubic stays between its two
 * keys (Fritsch & Carlson 1980: |v| <= 3 |chord|, and zero where chords turn).
 * Given ones are kept and may overshoot. */
int motion_spline_limit_overshoot(struct motion_key *key, uint32_t count);

/* For the curves that solve: what the caller lends, one per key. */
struct motion_spline_work {
    struct motion_real slot[4];
};

/* Velocities of the cubic with continuous acceleration.  An end with has_vel
 * keeps that velocity, one with has_acc (and no velocity) that acceleration,
 * others follow the rule: all but ONE_SIDED.  PERIODIC needs equal positions at
 * both ends.  An inner key with has_vel parts the curve in two there. */
int motion_spline_c2(struct motion_key *key, uint32_t count,
                     enum motion_spline_end first, enum motion_spline_end last,
                     struct motion_spline_work *work);
/* Velocities and accelerations of the quintic with continuous fourth
 * derivative.  Ends: what is given there, and with REST zero for the rest of
 * it; or NOT_A_KNOT: with it at both ends six keys or fewer have one
 * polynomial, with it at one end four keys are needed (MOTION_E_ARG).  At an
 * inner key every given value replaces the continuity of the highest
 * derivatives. */
int motion_spline_c4(struct motion_key *key, uint32_t count,
                     enum motion_spline_end first, enum motion_spline_end last,
                     struct motion_spline_work *work);

/* Append one segment per span: straight lines; cubic Hermite from p, v; quintic
 * from p, v, a; or the polynomial of lowest degree through what has_vel and
 * has_acc say is given.  Only differences of key times count.  The track must
 * end at key[0].pos, to the bit, else MOTION_E_ARG; MOTION_E_EMPTY below one
 * key; other errors as motion_track_append_*.  On an error the track is as
 * before and *failed, when not NULL, is the span (0: from key 0 to key 1). */
int motion_spline_append_linear(struct motion_track *track,
                                const struct motion_key *key, uint32_t count,
                                uint32_t *failed);
int motion_spline_append_cubic(struct motion_track *track,
                               const struct motion_key *key, uint32_t count,
                               uint32_t *failed);
int motion_spline_append_quintic(struct motion_track *track,
                                 const struct motion_key *key, uint32_t count,
                                 uint32_t *failed);
int motion_spline_append_constraints(struct motion_track *track,
                                     const struct motion_key *key,
                                     uint32_t count, uint32_t *failed);

/* Kochanek-Bartels: each -1 .. 1 (MOTION_E_ARG), all 0 is cardinal with mu 1;
 * with a continuity that is not 0 velocity steps at the keys.  Ends: REST,
 * ONE_SIDED ((1 - tension) times the chord) or NATURAL. */
struct motion_spline_kochanek {
    int64_t tension_q32, continuity_q32, bias_q32;
};
int motion_spline_append_kochanek(struct motion_track *track,
                                  const struct motion_key *key, uint32_t count,
                                  const struct motion_spline_kochanek *shape,
                                  enum motion_spline_end first,
                                  enum motion_spline_end last,
                                  uint32_t *failed);

/* Straight lines whose corners are rounded for `blend` around the time of the
 * key, at most from the middle of one span to the middle of the next: with
 * constant acceleration, or, `smooth`, with a quintic whose acceleration does
 * not step.  The curve passes the inner key at blend/8 times the change of
 * speed (smooth: 3/32).  Ends: REST speeds up from the first key within a
 * blend, at most half the span; ONE_SIDED starts at full speed.  At most two
 * segments per key.  Errors as above. */
int motion_spline_append_blended(struct motion_track *track,
                                 const struct motion_key *key, uint32_t count,
                                 int64_t blend_ns_q12, bool smooth,
                                 enum motion_spline_end first,
                                 enum motion_spline_end last, uint32_t *failed);

/* Cubic B-spline with the keys as control points and their times as knots
 * (evenly spaced: the uniform one).  The curve starts and ends in the first and
 * last key: NATURAL with acceleration zero there, REST with velocity zero; an
 * end with has_vel has that velocity instead.  One segment per span. */
int motion_spline_append_bspline(struct motion_track *track,
                                 const struct motion_key *key, uint32_t count,
                                 enum motion_spline_end first,
                                 enum motion_spline_end last, uint32_t *failed);
/* The same without ends: from the time of the second key to that of the last
 * but one; 4 keys or more (MOTION_E_ARG).  `*start` is where it starts, which
 * the track must have been initialised with. */
int motion_spline_bspline_start(const struct motion_key *key, uint32_t count,
                                int64_t *start_pos_q32);
int motion_spline_append_bspline_open(struct motion_track *track,
                                      const struct motion_key *key,
                                      uint32_t count, uint32_t *failed);

/* One polynomial through all keys, at most MOTION_SPLINE_LAGRANGE_KEYS
 * (MOTION_E_FULL).  Up to six keys it is a segment per span; above, every span
 * is baked in quintics until they miss position, velocity and acceleration by
 * at most 1e-10, 1e-8 and 1e-7 of their sizes (bake.h), or 256 pieces.  *bound,
 * when not NULL, is how far at most the position misses, in units. */
#define MOTION_SPLINE_LAGRANGE_KEYS 16
int motion_spline_append_lagrange(struct motion_track *track,
                                  const struct motion_key *key, uint32_t count,
                                  struct motion_real *bound, uint32_t *failed);

/* Its velocities at the first and the last key, of 2 keys or more. */
int motion_spline_lagrange_velocities(const struct motion_key *key,
                                      uint32_t count, struct motion_real *first,
                                      struct motion_real *last);

/* Times for points in space: pos_q32[axis][i].  Spans of time go as the
 * distance between points to the power 0, 1/2 (no loops or cusps within a span)
 * or 1, and end at `dur` after 0.  Writes t_ns_q12[count].  MOTION_E_EMPTY
 * below two points, MOTION_E_ORDER where two neighbours are equal and spacing
 * is not uniform, MOTION_E_ARG for a duration that is not positive or too short
 * for the points, or no axis.  Source: Lee, CAD 21 (1989); Yuksel et al., CAD
 * 43 (2011). */
enum motion_spline_spacing {
    MOTION_SPLINE_UNIFORM,
    MOTION_SPLINE_CENTRIPETAL,
    MOTION_SPLINE_CHORDAL,
};
int motion_spline_space(const int64_t *const pos_q32[], uint32_t axes,
                        uint32_t count, enum motion_spline_spacing spacing,
                        int64_t dur_ns_q12, int64_t t_ns_q12[]);

MOTION_C_END

#endif
