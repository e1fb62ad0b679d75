/* motion/spline.h - curves through keys that need not be evenly spaced.
 *
 *   hermite      cubic through keys with given velocities            C1
 *   catmull-rom  velocity from the parabola through three keys       C1
 *                (non-uniform Catmull-Rom, Overhauser, Barry-Goldman)
 *   cardinal     velocity mu (p[i+1]-p[i-1]) / (t[i+1]-t[i-1]);      C1
 *                mu 0..2, mu = 1 first-order on uneven keys (tension
 *                tau = mu/2 in the other convention)
 *   quintic      velocity and acceleration from that parabola, a     C2
 *                quintic between: acceleration does not step
 *
 * C1 curves step in acceleration at every key, which is infinite jerk: plan
 * checks say so on an axis with a jerk limit.  A tangent is in unit/s and is
 * multiplied by the span's own duration.
 * Source: Barry & Goldman, SIGGRAPH 1988; Farin, Curves and Surfaces, 8.5. */
#ifndef MOTION_SPLINE_H
#define MOTION_SPLINE_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/track.h"

struct motion_key {
    int64_t t_ns_q12; /* increasing; the first is where the track starts */
    int64_t pos_q32;
    int64_t vel_q32; /* used where has_vel, or filled in by tangents */
    int64_t acc_q16;
    bool has_vel, has_acc;
};

/* How the first and last key get a velocity that was not given. */
enum motion_spline_end {
    MOTION_SPLINE_REST,      /* velocity and acceleration zero (clamped) */
    MOTION_SPLINE_ONE_SIDED, /* from the parabola through the three keys at that
                                end (cardinal: mu times the chord) */
    MOTION_SPLINE_NATURAL,   /* the cubic's acceleration is zero at the end key:
                                (3 chord - neighbour's velocity) / 2 */
};

/* Fill in vel_q32 (and acc_q16) of the keys that do not have one; keys that do
 * are kept, and has_vel and has_acc stay as they are: they say what was given.
 * A tangent is within 0.9 units of 2^-32 unit/s of what its rule says exactly,
 * an acceleration within 1 of 2^-16 unit/s2.
 * Two keys have no parabola: their chord is taken; one key rests.
 * Returns MOTION_E_EMPTY below one key, MOTION_E_ORDER when times do not
 * increase, MOTION_E_RANGE when a span is longer than a segment may be or a
 * chord or tangent leaves its format, MOTION_E_ARG for mu outside 0 .. 2 or an
 * end rule that does not exist; what was filled in until then is of no use.
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

/* Append one segment per span: straight lines; cubic Hermite from p, v; or
 * quintic from p, v, a.  Only differences of key times count.  The track must
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

#endif
