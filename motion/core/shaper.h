/* motion/core/shaper.h - an input shaper on the tick: a set point as the
 * weighted mean of a track at a few earlier times.
 *
 *     shaped(t) = sum A[i] track(t - d[i]),   A[i] > 0,   sum A[i] = 1
 *
 * A shaper cancels the vibration of a flexible axis (plan/shaper.h designs it
 * from frequency and damping).  It is evaluated absolutely: the track is
 * sampled at every t - d[i], so there is no history to fill, a jump in time
 * costs nothing, and two runs agree to the bit.  With one impulse it is a delay,
 * by which an axis without a shaper keeps its lag aligned with one that has.
 *
 * Velocity, acceleration and jerk of the result are means of those of the
 * track: a track inside its limits stays inside them.
 * Source: N. Singer, W. Seering, Preshaping Command Inputs to Reduce System
 * Vibration, J. Dyn. Sys. Meas. Control 112 (1990). */
#ifndef MOTION_CORE_SHAPER_H
#define MOTION_CORE_SHAPER_H

#include <stdint.h>

#include "motion/core/track.h"

MOTION_C_BEGIN

#define MOTION_SHAPER_IMPULSES_MAX 4
#define MOTION_SHAPER_ONE_Q62      ((uint64_t)1 << 62)
#define MOTION_SHAPER_DELAY_MAX_NS_Q12                                         \
    MOTION_TRACK_SEGMENT_MAX_NS_Q12 /* 3.2 days */

struct motion_shaper {
    uint32_t count;                                     /* 1 .. 4 */
    uint64_t amplitude_q62[MOTION_SHAPER_IMPULSES_MAX]; /* add up to 1 */
    int64_t delay_ns_q12[MOTION_SHAPER_IMPULSES_MAX];   /* 0 .., increasing */
};

/* Where the last samples were found; zero-initialised they start at the
 * front. */
struct motion_shaper_cursor {
    struct motion_cursor impulse[MOTION_SHAPER_IMPULSES_MAX];
};

/* MOTION_E_ARG for a count that is none of 1 .. 4, an amplitude of 0,
 * amplitudes that do not add up to exactly 1, a first delay below 0, delays
 * that do not increase, or one above the MAX; nothing is written then. */
int motion_shaper_init(struct motion_shaper *shaper, uint32_t count,
                       const uint64_t amplitude_q62[],
                       const int64_t delay_ns_q12[]);

/* Tick: p, v, a at `t`, as many samples of the track as there are impulses.
 * Each of p, v and a is the exact mean of the samples, rounded once to the
 * nearest unit of 2^-32, ties away from zero.  So where all impulses see one
 * position (before the start, in a dwell, and from the end of the track plus
 * the last delay on) the answer is that position to the bit.
 * A track that is a window must reach back by the last delay. */
void motion_shaper_sample(const struct motion_shaper *shaper,
                          const struct motion_track *track,
                          struct motion_shaper_cursor *cursor, int64_t t_ns_q12,
                          struct motion_sample *sample);

MOTION_C_END

#endif
