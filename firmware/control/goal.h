/* firmware/control/goal.h - axes whose drives go by a profile of their own.
 *
 * Such an axis has a track like every other: what the drive's profile should
 * be.  It takes part in the plan, the check and the clock; but the drive is not
 * told of it tick by tick.  It gets a goal for every motion from rest to rest:
 *
 *   IDLE --due, when the path's time comes to it--> ASKED --taken--> RUNNING
 *     ^                                                                 |  |
 *     |---- arrived: the drive says so, and the axis is there ----------'  |
 *     '---- it stands: the same goal is due again <-- HALTING <--hold, stop'
 *
 * A goal is not due before the one before it has been reached, so no key is
 * left out; and the move is not over before the last one has been.  Hold and
 * stop end the motion by the drive's own ramp (hal_drive_halt), which is no
 * gentler than to bring it to rest in a second, where the axis's limit allows
 * that; nothing is sent while the clock is to stand; a resume sends the same
 * goal again.  A drive that has no halt runs on to its goal in a hold; a stop
 * is its quick stop, and a fault.  A drive is under way until it has halted or
 * arrived, also when another goal has taken the place of what it was sent for
 * (is_left).
 *
 * What stands in the place of the following error: a motion may take an eighth
 * more than its own time, at the rate of the clock when it was sent, and
 * `late_ns`; after that it is a fault.  Its own time is that of the track, or
 * what a trapezoid of the speed and acceleration that were sent takes from
 * where the drive is, when that is longer.  A drive that stands may be off the
 * place by the floor of the following error.  A fault while a drive is on its way is
 * a quick stop of the drives, as for one that homes. */
#ifndef FIRMWARE_CONTROL_GOAL_H
#define FIRMWARE_CONTROL_GOAL_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/track.h"

struct controller_goal {
    int64_t start_ns_q12, end_ns_q12; /* path time of the motion */
    int64_t pos_q32;                  /* its end */
    int64_t vel_q32, acc_q32;         /* the most on it, > 0 */
};

enum controller_leg_state {
    CONTROLLER_LEG_IDLE,
    CONTROLLER_LEG_REQUESTED, /* the drive cannot take it yet */
    CONTROLLER_LEG_RUNNING,
    CONTROLLER_LEG_HALTING,
};

/* Where an axis is among its goals. */
struct controller_leg {
    const struct controller_goal *goal; /* the caller's; NULL: none */
    unsigned count, at;                 /* at: under way, or next */
    enum controller_leg_state state;
    bool stops;   /* an end of the motion was asked for */
    bool is_left; /* IDLE, ASKED: the drive is still on its way to a goal whose
                     place these have taken */
    int64_t left_ns_q12; /* path time that the motion may still take */
    int64_t rate_q30;    /* of the clock when it was sent */
    int64_t late_ns;     /* since that was over */
};

/* The motions of a track from rest to rest, as goals.  Writes at most `capacity`, the
 * first ones; returns how many there are.  A whole track, no window; not for
 * the tick. */
unsigned controller_goals_of(const struct motion_track *track,
                             struct controller_goal goal[], unsigned capacity);

#endif
