/* motion/plan/shaper/plan_shape.h - a planned move behind its axes' input shapers.
 *
 * What a shaper does to a track (core/shaper.h) is a sum of the track at a few
 * earlier times, and so a track again: polynomials where the track has them, with
 * a border wherever one of the copies has one.  Done here, before anything is
 * judged, the set points that run are the ones that are checked, plotted and
 * compiled; every one of their derivatives is a mean of the track's, so limits
 * that held still hold, and a move ends at its last key to the bit.
 *
 * Axes that move together stay together: a shaper with the impulses A[i] at t[i]
 * lets a ramp lag by sum A[i] t[i], and every axis of the move is delayed to the
 * largest lag of all.  Events of time and of the path come later by as much.
 *
 * A warp of the clock (override, hold) stretches the impulses too: they fit the
 * vibration at the planned speed.
 * Source: N. Singer, W. Seering, Preshaping Command Inputs to Reduce System
 * Vibration, J. Dyn. Sys. Meas. Control 112 (1990). */
#ifndef MOTION_PLAN_SHAPER_PLAN_SHAPE_H
#define MOTION_PLAN_SHAPER_PLAN_SHAPE_H

#include "motion/plan/compose.h"
#include "motion/plan/shaper/shaper.h"

/* What the shapers of a move cost, s. */
struct plan_shape_cost {
    double lag_s;    /* everything comes so much later */
    double longer_s; /* and the move is so much longer */
};

/* One track delayed and summed, in its place; an empty one is left alone.
 * MOTION_E_FULL without memory, MOTION_E_RANGE beyond the formats; the track is
 * unchanged then. */
int plan_shape_track(const struct motion_shaper *shaper,
                     struct motion_track *track);

/* All tracks of a move, and the distance along its path; shaper[i] of axis i,
 * NULL where it has none.  outcome->lag and tail grow by what is printed as
 * *cost.  Nothing is done where no axis has a shaper.  On an error its code and
 * a sentence; the tracks are still to be freed. */
int plan_shape_move(const struct plan_shaper *const shaper[], uint32_t axes,
                    struct motion_track track[], struct plan_outcome *outcome,
                    struct plan_shape_cost *cost, struct plan_error *error);

/* The track begins `wait_ns_q12` later, and stands until then where it starts.
 * Errors as above. */
int plan_shape_delay(struct motion_track *track, int64_t wait_ns_q12);

#endif
