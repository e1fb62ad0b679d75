/* motion/plan/fit/fit.h - other keys, at which a move is inside its limits.
 *
 * Two methods change times, and with them what keys give of velocity,
 * acceleration and handles, never a position:
 *   stretch   all spans by one factor, the smallest that fits
 *   local     the spans that need it, by what each needs
 * one changes positions, within a tolerance, never a time:
 *   smooth    the keys around a violation (fit_smooth.c)
 *
 * A span here is the time between two neighbouring keys of any axis: keys of
 * several axes at one time stay at one time.  A key that is fixed in time keeps
 * it to the bit: stretch can then only lengthen what comes after the last fixed
 * key; local takes time for a span from those between the same fixed keys that
 * have some left.  Where the curve of a span depends on its neighbours, or a key
 * gives a velocity, a longer span changes the others: local goes round until
 * the checker (check.h) finds nothing, at most PLAN_FIT_ROUNDS times, and no
 * span is ever longer than with stretch, which it ends as if all else fails.
 *
 * No duration removes a step of velocity or acceleration, or brings a key back
 * into its range: such moves are refused.  Where only the curve leaves the range,
 * between keys that keep it, the keys at which it turns stand (stand.h).  New times
 * are whole microseconds, or frames.  Off-line only: uses the heap. */
#ifndef MOTION_PLAN_FIT_FIT_H
#define MOTION_PLAN_FIT_FIT_H

#include "motion/plan/move.h"

MOTION_C_BEGIN

#define PLAN_FIT_ORDERS      3 /* velocity, acceleration, jerk: order - 1 */
#define PLAN_FIT_ROUNDS      60
#define PLAN_FIT_STRETCH_MAX 1e4 /* more than that is refused */

/* --- what is needed -------------------------------------------------------- */

/* Time stretched by s divides velocity by s, acceleration by s^2 and jerk by s^3. */
struct plan_fit_need {
    double stretch;      /* by which the time fits: the move's limits are met
                            exactly; below 1 where there is time left */
    unsigned decided_by; /* order, 1 .. 3; 0: nothing moves */
};

/* Of a whole track, whatever made it. */
struct plan_fit_need plan_fit_track_need(const struct motion_track *track,
                                         const struct plan_limit *limit);

/* Of each span between the keys of an axis, need[0 .. key_count - 2], on its
 * track.  Each is what the span needs by itself: exact where the curve of a
 * span depends on its ends alone. */
void plan_fit_span_needs(const struct plan_axis *axis,
                         const struct motion_track *track,
                         const struct plan_limit *limit,
                         struct plan_fit_need need[]);

/* --- repair ---------------------------------------------------------------- */

enum plan_fit_method { PLAN_FIT_STRETCH, PLAN_FIT_LOCAL, PLAN_FIT_SMOOTH };

struct plan_fit_request {
    const struct plan_move *move;   /* all axes by keys, none before time 0 */
    const struct plan_limit *limit; /* of each axis */
    enum plan_fit_method method;
    /* smooth: how far a key of each axis may be moved; 0: not at all.  The first
     * and the last of an axis, and those of fixed value, are not. */
    const int64_t *tolerance_q32;
    bool
        on_frames; /* new times are whole frames of the move's rate, which it has */
};

struct plan_fit {
    uint32_t axis_count;
    struct plan_axis *axis; /* as in the move, with keys of their own */
    uint32_t knots;         /* different times of keys, ascending */
    int64_t *from_ns_q12, *to_ns_q12; /* before, after */
    uint32_t *by_axis; /* of each span, knots - 1: the axis that needed most;
                          PLAN_AXES_MAX: none needed any */
    unsigned rounds;   /* how often all axes were planned */
};

/* What a move has beside plain keys, which none of these can change: "a path", "an
 * axis with cycles ..."; NULL: nothing. */
const char *plan_fit_more(const struct plan_move *move);

/* MOTION_OK, also when nothing had to change; to be freed with plan_fit_free.
 * On an error nothing is left allocated, and *error has a sentence:
 * MOTION_E_ARG for a move that has more than keys (a path, a camera, layers,
 * cycles ...), MOTION_E_LIMIT where time does not help or a fixed key is in the
 * way, MOTION_E_FULL without memory, or what planning said. */
int plan_fit_solve(const struct plan_fit_request *request, struct plan_fit *fit,
                   struct plan_error *error);
void plan_fit_free(struct plan_fit *fit);

MOTION_C_END

#endif
