/* motion/curve/spline_internal.h - what the files of spline.h share. */
#ifndef MOTION_CURVE_SPLINE_INTERNAL_H
#define MOTION_CURVE_SPLINE_INTERNAL_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/fixed.h"
#include "motion/core/track.h"
#include "motion/curve/spline.h"
#include "motion/curve/times.h"
#include "motion/number/real.h"

#define SPLINE_DEGREE MOTION_TRACK_DEGREE

/* One span in u = 0 .. 1, without its start: c[k] of u^k in units, k >= 1. */
struct spline_poly {
    int degree;
    struct motion_real c[SPLINE_DEGREE + 1];
};

/* A chord: seconds, units per second. */
struct spline_chord {
    struct motion_real dur, vel;
};

/* A key that nobody filled in is all zero bits; zero has its own exponent. */
static inline struct motion_real spline_read(struct motion_real a)
{
    return a.m ? a : motion_real_zero();
}

/* b - a of two positions, in units. */
struct motion_real spline_displacement(int64_t a_q32, int64_t b_q32);
/* From key[0] to key[1], in seconds. */
struct motion_real spline_span(const struct motion_key *key);
/* From key[0] to key[1]. */
struct spline_chord spline_chord(const struct motion_key *key);

/* Times increase and spans are not too long; see spline.h for the codes. */
int spline_order(const struct motion_key *key, uint32_t count);
/* |a| < 2^bits, else MOTION_E_RANGE. */
int spline_within(struct motion_real a, int bits);
/* The filled in velocities (and accelerations) fit their formats. */
int spline_velocities_within(const struct motion_key *key, uint32_t count);

/* The end velocities of a list of two or more keys by chords and parabolas. */
struct motion_real spline_parabola_end(struct spline_chord outer,
                                       struct spline_chord inner);

/* Polynomials of D units in T seconds. */
struct spline_poly spline_cubic(struct motion_real displacement,
                                struct motion_real dur, struct motion_real vel0,
                                struct motion_real vel1);
struct spline_poly spline_quintic(struct motion_real displacement,
                                  struct motion_real dur,
                                  const struct motion_real vel[2],
                                  const struct motion_real acc[2]);

/* Append; ends at end_pos to the bit. */
int spline_emit(struct motion_track *track, int64_t dur_ns_q12,
                const struct spline_poly *poly, int64_t end_pos_q32,
                uint64_t end_frac);

/* base + displacement as Q64.64, two's complement; |displacement| < 2^31. */
struct motion_u128 spline_fixed(int64_t base_q32,
                                struct motion_real displacement);
/* From where the track ends to such a position. */
struct motion_real spline_fixed_displacement(const struct motion_track *track,
                                             struct motion_u128 to);

/* One span of a list, for spline_each. */
typedef int spline_append_span(struct motion_track *track,
                               const struct motion_key *key, const void *with);

/* Append all spans; see motion_spline_append_* for what it promises. */
int spline_each(struct motion_track *track, const struct motion_key *key,
                uint32_t count, spline_append_span *append, const void *with,
                uint32_t *failed);

#endif
