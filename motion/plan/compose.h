/* motion/plan/compose.h - a whole move: every axis's track, whatever drives it.
 *
 *     keys, path, camera, blend   each axis is driven by one of them
 *     layers                      are added
 *     fade                        goes over to another move
 *     warp                        bends the time of all of it
 *     duration                    plays all of it in that time
 *     pre-roll, post-roll         bring what begins or ends in motion up to speed
 *                                 before, and to rest after it
 *     couplings                   gears and cams, on what comes of all that
 *
 * Off-line only: uses the heap. */
#ifndef MOTION_PLAN_COMPOSE_H
#define MOTION_PLAN_COMPOSE_H

#include "motion/number/real.h"
#include "motion/plan/move.h"
#include "motion/plan/path/plan_path.h"
#include "motion/plan/plan_memo.h"
#include "motion/plan/plan_progress.h"

MOTION_C_BEGIN

/* What came out beside the tracks. */
struct plan_outcome {
    bool has_path;
    struct plan_drive drive;      /* with has_path */
    struct motion_track distance; /* along the path, as played: its velocity is
                                     the path speed.  On the heap */
    bool has_camera;
    int64_t camera_bound_q32[3]; /* pan, tilt, roll, degrees */
    int64_t carrier_bound_q32;   /* of the axes that carry a head on a path */
    int64_t lens_bound_q32;      /* of focus and zoom, the worse */
    bool is_bent;                /* keys are not where they were written: there
                                 are layers, a fade, a warp or a duration */
    int64_t written_ns_q12;      /* how long it takes without the duration */
    int64_t played_ns_q12;       /* and with it; both 0: there is none */
    struct motion_track warp;    /* on the heap; empty: time is as written */
    struct motion_real warp_bound; /* of the worst axis, unit */
    int64_t lag_ns_q12;            /* all of it comes so much later, and ends so
                                      much later than that (plan_roll.h,
                                      plan_shape.h) */
    int64_t tail_ns_q12;
};

/* Plan the axes of `move` into track[0 .. axis_count - 1], which need not be
 * initialised and are to be freed with plan_track_free.  *outcome is to be
 * freed with plan_outcome_free and points into itself.  On an error the code,
 * *error with a sentence (and the axis, where it is about one), all tracks and
 * the outcome empty.  `progress` is told how far it is, and may be NULL. */
int plan_compose(const struct plan_move *move, struct motion_track track[],
                 struct plan_outcome *outcome,
                 const struct plan_progress *progress,
                 struct plan_error *error);
/* The same, with what a former plan of the move left (NULL: nothing) and what
 * this one leaves (NULL: nothing; else zeroed, to be freed with plan_memo_free):
 * spans that did not change are taken over (plan_memo.h). */
int plan_compose_again(const struct plan_move *move,
                       const struct plan_memo *former, struct plan_memo *memo,
                       struct motion_track track[],
                       struct plan_outcome *outcome,
                       const struct plan_progress *progress,
                       struct plan_error *error);
void plan_outcome_free(struct plan_outcome *outcome);

/* The time as the move was written, at a time as it is played; 2^-12 ns.
 * Before the start while it waits for the lag. */
int64_t plan_outcome_time(const struct plan_outcome *outcome, int64_t t_ns_q12);

/* Room for so many axes, zeroed, in a move that has none yet: MOTION_OK or
 * MOTION_E_FULL. */
int plan_move_reserve(struct plan_move *move, uint32_t axes);

/* Everything that the move holds on the heap; zero afterwards. */
void plan_move_free(struct plan_move *move);

MOTION_C_END

#endif
