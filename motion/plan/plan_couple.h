/* motion/plan/plan_couple.h - electronic gearing and cams in a move: an axis
 * whose place follows from the place of another one, its master.
 *
 *     gear  p = offset + m numerator / denominator
 *     cam   p = C(m), a curve through pairs of places
 *
 * What comes out is a track as any other, so that limits, override, hold and
 * reverse are those of the move; it is applied last, to the master as it is
 * played.  Names are those of PLCopen Motion Control, MC_GearIn and MC_CamIn.
 * Off-line. */
#ifndef MOTION_PLAN_PLAN_COUPLE_H
#define MOTION_PLAN_PLAN_COUPLE_H

#include "motion/plan/move.h"

#define PLAN_RATIO_MAX INT64_C(1000000) /* of either part of a gear's ratio */

struct plan_coupling {
    uint32_t axis, master; /* of the move; the master has no master */
    /* A cam: its keys, where a millisecond from low_q32 on is a unit of the
     * master.  A gear has none. */
    struct plan_axis cam;
    int64_t low_q32;
    /* A gear, in the axis's unit per the master's: the numerator not 0, +-MAX;
     * the denominator 1 .. MAX. */
    int64_t numerator, denominator;
    int64_t offset_q32; /* where the axis is when the master is at 0 */
    struct plan_place place;
};

/* Time of a cam's key where the master is so far from low_q32, both Q32.32:
 * MOTION_OK or MOTION_E_RANGE. */
int plan_couple_time(int64_t apart_q32, int64_t *t_ns_q12);

/* The axes of the move in track[], each by the track of its master.
 * MOTION_E_LIMIT where a master leaves its cam; on an error a sentence. */
int plan_couple_tracks(const struct plan_move *move,
                       struct motion_track track[], struct plan_error *error);

#endif
