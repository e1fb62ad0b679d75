/* motion/core/clock_walk.h - does a ramp of the clock keep an axis inside its
 * limits?  Goes along the ramp from look to look and says so.
 *
 * A look is a time of the clock at which p', p'', p''' (clock_warp.h) are
 * compared with the limits.  Looks are `step_ns` apart, with one at every border
 * of pieces of the ramp and, at both sides, of segments of the track, at the
 * time at which the clock is there (found by halving).  Where bounds show that
 * no limit is passed on the way the next look is as many steps away as they
 * reach (clock_anchor.h): what they prove holds at every time in between, the
 * rest is judged at its steps.  So the verdict is the one of a look at every
 * step, at a fraction of its price.
 *
 * As rounding count 2^-28 of a limit and 4 units, and what 2^-28 in r' and r''
 * makes of f' and f'': a track at its limit fits.  A ramp that leaves the window
 * of a track does not.  No division. */
#ifndef MOTION_CORE_CLOCK_WALK_H
#define MOTION_CORE_CLOCK_WALK_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/clock_warp.h"
#include "motion/core/track.h"

/* Limits that a warped axis must keep; jerk 0: not limited. */
struct motion_clock_limit {
    int64_t vel_q32;
    int64_t acc_q32;
    int64_t jerk_q32;
};

/* Where the track was evaluated in full, and then its two derivatives more. */
struct motion_clock_anchor {
    bool is_set, is_whole;
    uint32_t index; /* of the segment */
    int64_t s_ns_q12;
    struct motion_state state;
    int64_t fourth_q32, fifth_q32;
};

struct motion_clock_walk {
    const struct motion_clock_warp *warp;
    const struct motion_track *track;
    const struct motion_clock_limit *limit;
    int64_t step_ns;
    /* since the ramp began: the last look, and the one before */
    int64_t at_ns, before_ns;
    bool is_bounded; /* by bounds, the limits are kept everywhere in between */
    bool is_open;    /* the caller's: the ramp ends with an r' of its own, and
                        what follows it is none of this walk's */
    /* its own: */
    int64_t next_ns;
    bool next_is_bounded;
    int64_t stride;  /* steps for which bounds are tried first */
    unsigned pause;  /* looks before they are tried again, */
    unsigned failed; /* after so many times in vain */
    uint32_t index;
    struct motion_clock_rate rate; /* at at_ns */
    struct motion_clock_anchor anchor;
};

/* warp, track and limit stay the caller's.  step_ns > 0. */
void motion_clock_walk_begin(struct motion_clock_walk *walk,
                             const struct motion_clock_warp *warp,
                             const struct motion_track *track,
                             const struct motion_clock_limit *limit,
                             int64_t step_ns);

/* On to the next look, the first of which is at the ramp's begin: 1; 0 where the
 * last one was at or after its end; MOTION_E_LIMIT where a limit is passed or
 * the window left, at at_ns or on the way there.
 *   *looks  how many may be made, five for a border; is reduced by those that
 *           were, and a ramp that they do not suffice for passes its limits */
int motion_clock_walk_next(struct motion_clock_walk *walk, int64_t *looks);

/* The whole of it. */
bool motion_clock_warp_fits(const struct motion_clock_warp *warp,
                            const struct motion_track *track,
                            const struct motion_clock_limit *limit,
                            int64_t step_ns, int64_t *looks);

#endif
