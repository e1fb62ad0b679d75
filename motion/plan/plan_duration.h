/* motion/plan/plan_duration.h - a move played in another time than it was
 * written for: f(t from / to), where `from` is how long it takes.
 *
 * The segments of a track keep their coefficients, which are those of the
 * normalised time, and begin at times that are scaled and rounded to 2^-12 ns:
 * every position is reached to the bit, at another time. */
#ifndef MOTION_PLAN_PLAN_DURATION_H
#define MOTION_PLAN_PLAN_DURATION_H

#include "motion/core/track.h"

/* MOTION_OK, or MOTION_E_RANGE where a segment would be shorter than the formats
 * allow; the track is of no use then.  0 < from, to. */
int plan_duration_apply(struct motion_track *track, int64_t from_ns_q12,
                        int64_t to_ns_q12);

#endif
