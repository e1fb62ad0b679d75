/* motion/core/track_internal.h - what the files of track.h share. */
#ifndef MOTION_CORE_TRACK_INTERNAL_H
#define MOTION_CORE_TRACK_INTERNAL_H

#include <stdint.h>

#include "motion/core/fixed.h"
#include "motion/core/track.h"

/* A positive number with 63 good bits and an exponent: mantissa / 2^exponent,
 * mantissa >= 2^63. */
struct track_ratio {
    uint64_t mantissa;
    int exponent;
};

struct track_ratio track_ratio_mul(struct track_ratio a, struct track_ratio b);
/* 1 s / duration of the segment, from its inverse. */
struct track_ratio track_ratio_per_second(const struct motion_segment *segment);

/* a * ratio * 2^shift to nearest, saturating at `limit_bits` bits: returns
 * MOTION_E_RANGE and writes nothing when |result| >= 2^limit_bits. */
int track_ratio_apply(struct motion_u128 a, struct track_ratio ratio, int shift,
                      unsigned limit_bits, struct motion_u128 *result);

/* a 2^bits, 1 <= bits <= 63. */
static inline struct motion_u128 track_shifted(int64_t a, unsigned bits)
{
    return (struct motion_u128){ (uint64_t)(a >> (64 - bits)),
                                 (uint64_t)a << bits };
}

/* Velocity, acceleration and jerk at the end, the left-hand limits. */
void track_segment_end(const struct motion_segment *segment,
                       struct motion_state *state);

/* u = dt / dur as Q0.63 without a division.  dt << normalise < 2^64, inverse <
 * 2^64; the product of the low words is dropped and two are rounded down, so u
 * is at most 4 units of 2^-63 too small and never reaches 1. */
static inline uint64_t track_fraction_q63(const struct motion_segment *segment,
                                          uint64_t dt)
{
    uint32_t n = segment->normalise; /* 3..63 */
    uint32_t ih = (uint32_t)(segment->inverse >> 32);
    uint32_t il = (uint32_t)segment->inverse;
    uint32_t hi = (uint32_t)(dt >> 32), lo = (uint32_t)dt;

    if (n < 32) {
        hi = hi << n | lo >> (32 - n);
        lo = lo << n;
    } else {
        hi = lo << (n - 32);
        lo = 0;
    }
    return (uint64_t)hi * ih + ((uint64_t)hi * il >> 32) +
           ((uint64_t)lo * ih >> 32);
}

/* Position and derivatives at dt from the segment's start, 0 <= dt < dur.
 * (In this order all arguments are in registers on ARM.) */
void track_segment_sample(const struct motion_segment *segment,
                          struct motion_sample *sample, uint64_t dt);

/* Derivative of any order from 1 on, to the second, at dt from the segment's
 * start; exact as motion_segment_state; saturates. */
int64_t track_segment_derivative(const struct motion_segment *segment,
                                 int order, int64_t dt_ns_q12);

/* motion_segment_extremes, and, where they are asked for, motion_segment_peak of
 * acceleration and jerk, by the same roots. */
void track_segment_extremes(const struct motion_segment *segment,
                            struct motion_extreme extreme[MOTION_JERK + 1],
                            int64_t peak[MOTION_JERK + 1]);

/* The summary, where the track has one that is of its segments; else NULL. */
static inline const struct motion_track_summary *
track_summary(const struct motion_track *track)
{
    const struct motion_track_summary *summary = track->summary;

    return summary != NULL && track->outline == NULL && track->count > 0 &&
                   summary->count == track->count &&
                   summary->segment == track->segment
               ? summary
               : NULL;
}

/* The segment that holds t, 0 <= t < end. */
uint32_t track_find(const struct motion_track *track, int64_t t_ns_q12);
/* The same, and the cursor goes there: its neighbours are tried, then all are
 * searched (an index that has wrapped is beyond the count).  NULL: it is not in
 * the window. */
const struct motion_segment *track_seek(const struct motion_track *track,
                                        struct motion_cursor *cursor,
                                        int64_t t_ns_q12);

#endif
