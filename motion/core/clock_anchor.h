/* motion/core/clock_anchor.h - the state of a track near a place where it was
 * evaluated, and how far on an axis stays inside its limits from there; for
 * clock_walk.c. */
#ifndef MOTION_CORE_CLOCK_ANCHOR_H
#define MOTION_CORE_CLOCK_ANCHOR_H

#include "motion/core/clock_walk.h"

/* A state of the track, where the derivatives beyond it are known: */
struct clock_place {
    struct motion_state state;
    bool is_whole; /* fourth and fifth count */
    int64_t fourth_q32, fifth_q32;
    int64_t left_s_q30; /* path time to the end of the segment */
};

/* At path time s on segment `index` (count: after the end). */
void clock_anchor_place(struct motion_clock_anchor *anchor,
                        const struct motion_track *track, uint32_t index,
                        int64_t s_ns_q12, struct clock_place *place);

/* Are all limits kept for `ns` from here on, at every time?  By bounds: with r
 * <= R, |r'| <= D on the way, sigma = R h <= left of path time and |f'''| <= F3,
 * |f''| <= F2, |f''''| <= F4 within it,
 *
 *   p''''  = f'''' r^4 + 6 f''' r^2 r' + f'' (3 r'^2 + 4 r r'')
 *   p''''' = f''''' r^5 + 10 f'''' r^3 r' + f''' (15 r r'^2 + 10 r^2 r'')
 *            + 10 f'' r' r''
 *
 * (r''' = 0 within a piece).  The second is at most what R, D, F2, F3 and F4
 * make of it, so that p'''' changes by that times h at most, p''' by that of its
 * integral, and so p'' and p'.  All rounded up.
 *   axis  p', p'', p''' at `now`, on `place` */
bool clock_anchor_stays(const struct clock_place *place,
                        const struct motion_clock_rate *now,
                        const struct motion_state *axis,
                        const struct motion_clock_limit *limit, int64_t ns);

#endif
