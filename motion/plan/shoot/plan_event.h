/* motion/plan/shoot/plan_event.h - what a move triggers, and when: a shutter, a lamp.
 *
 * An event is a rule in a file: at a time, every so many seconds, where an axis
 * passes a position, at a distance along the path.  Planning turns the rules of
 * one line into shots: times on the path, increasing, known before anything
 * moves.  Hold, override and stop act on the path's time and so on the shots.
 * Off-line only: uses the heap. */
#ifndef MOTION_PLAN_SHOOT_PLAN_EVENT_H
#define MOTION_PLAN_SHOOT_PLAN_EVENT_H

#include "motion/plan/compose.h"

#define PLAN_EVENTS_MAX 1000    /* rules of a move */
#define PLAN_SHOTS_MAX  1000000 /* of one line */

enum plan_event_of {
    PLAN_EVENT_OF_TIME, /* as played, also where there is a warp; lag added */
    PLAN_EVENT_OF_PATH, /* distance along it */
    PLAN_EVENT_OF_AXIS, /* each time that it passes, in either direction */
};

/* Times in 2^-12 ns, distances and positions in Q32.32.
 *   once    at `at`
 *   every   time, path: from `at` on, as far as `to` (or the end), both
 *           included; axis: at + k every, for every whole k */
struct plan_event {
    uint32_t line; /* as the caller numbers them */
    enum plan_event_of of;
    uint32_t axis;         /* of the move */
    bool has_at, has_to;   /* without: 0, where the axis starts; the end */
    int64_t at, every, to; /* every > 0, or 0: once */
    struct plan_place place;
};

struct plan_shots {
    int64_t *t_ns_q12; /* rising; equal where two rules meet */
    uint32_t *event;   /* index of the rule */
    uint32_t count;
};

/* The shots of a line.  Both arrays are on the heap: plan_shots_free.  On an
 * error its code and *error with a sentence, nothing allocated: MOTION_E_RANGE
 * for a rule that would never fire in this move, MOTION_E_FULL for too many
 * shots or no memory. */
int plan_shots_make(const struct plan_move *move,
                    const struct motion_track track[],
                    const struct plan_outcome *outcome, uint32_t line,
                    struct plan_shots *shots, struct plan_error *error);
void plan_shots_free(struct plan_shots *shots);

#endif
