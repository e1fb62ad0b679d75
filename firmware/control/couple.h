/* firmware/control/couple.h - electronic gearing and cams: an axis that goes
 * where a curve over the position of another axis says.
 *
 * The curve is a track that is read by the master's place in the place of time:
 * one unit of the master is one second of it, or 2^-shift s where it goes further than
 * a minute of that.  A gear is a straight line.  The
 * follower is told its place, speed and acceleration in the same tick as the
 * master, by the chain rule
 *     p = C(m) + o    v = C'(m) m'    a = C''(m) m'^2 + C'(m) m''
 * so there is nothing to catch up.  o is how far beside its curve, or the start of
 * its track, the follower stood when the master began to move, window_q32 at most:
 * nothing jumps.
 *
 * Whatever moves the master, a jog or a move, takes along the followers that have
 * no track of their own: within limits that leave them inside theirs, and no
 * further than their curves go.  Those limits of the master are what its jogs are
 * planned by, its moves are judged by at their start, and changes of rate are
 * judged by; so hold, resume, reverse, override and stop are those of any motion,
 * and so is the stop after a fault.
 *
 * In a move a follower may have a track of its own, which its planner made of the
 * curve and the master's (motion/curve/time_warp.h).  Such a move begins only where
 * that is on the curve from its start to its end, between its keys too (see
 * couple_judge.c).  A track of the follower alone does not begin.  Coupled axes are
 * not homed.  Coupling ends with torque, and with a fault. */
#ifndef FIRMWARE_CONTROL_COUPLE_H
#define FIRMWARE_CONTROL_COUPLE_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/clock_warp.h"
#include "motion/core/track.h"

struct controller;
struct controller_axis_config;

struct controller_cam {
    unsigned master;
    const struct motion_track *track; /* the follower's, by (m - low) */
    int64_t low_q32, high_q32;        /* of the master, low < high */
    uint8_t shift;                    /* controller_cam_shift, 0 .. 13 */
    /* by controller_cam_init, the largest there are: C' by the master's unit, C'' and
     * C''' by the track's time */
    int64_t slope_q32, second_q32, third_q32;
    /* so far beside its curve may a follower stand, and be led by a track of its own:
     * 2^-20 of its unit, and 2^-30 of how far the curve goes */
    int64_t window_q32;
    int64_t offset_q32; /* o, the controller's while it is coupled */
};

/* The least with which that is no longer than a minute, or 13. */
uint8_t controller_cam_shift(int64_t low_q32, int64_t high_q32);
/* Fills in the rest.  MOTION_E_ARG: no range, or a track that is not as long.  Not
 * on the tick. */
int controller_cam_init(struct controller_cam *cam);
/* Its time at a place of the master, which is within it but for rounding. */
int64_t controller_cam_ns_q12(const struct controller_cam *cam, int64_t m_q32);
/* The curve where the master is at this place. */
void controller_cam_at(const struct controller_cam *cam,
                       struct motion_cursor *cursor, int64_t m_q32,
                       struct motion_sample *curve);

/* In READY, or while the master is jogged: the axis follows from now on; the cam
 * must outlive that.  Of a master that moves the curve has to begin with a
 * stretch on which the axis stands (gear.h), else MOTION_E_AWAY; its jog is
 * planned anew by what the curve leaves of its limits and its range, and where it
 * is faster than these now, that is MOTION_E_LIMIT.  MOTION_E_STATE; MOTION_E_ARG:
 * the master is the axis itself, is coupled to another, the cam has a follower, or
 * either goes by a profile of its drive's, or is a rail of a gantry; MOTION_E_UNHOMED; MOTION_E_LIMIT: the curve
 * leaves the range of the axis, or the master stands outside of it;
 * MOTION_E_DISCONTINUITY: its slope, or of an axis with a limit of jerk its curvature,
 * steps by more than a hundredth of what the limits let happen in a period;
 * MOTION_E_AWAY: the axis does not stand where the curve is. */
int controller_couple(struct controller *controller, unsigned axis,
                      struct controller_cam *cam);
/* In READY, else MOTION_E_STATE. */
int controller_uncouple(struct controller *controller, unsigned axis);

/* Which derivative of a track of a master, played at 100 %, takes a follower that has
 * none of its own beyond its limits: its peak and the most that it may be.
 * MOTION_POS: none.  Not on the tick. */
enum motion_quantity controller_cam_over(
    const struct controller_cam *cam, const struct controller_axis_config *own,
    const struct controller_axis_config *master,
    const struct motion_track *track, int64_t *peak_q32, int64_t *most_q32);

/* Where a move leaves a coupling, if it does. */
struct controller_couple_off {
    int64_t t_ns_q12; /* of the move, where the follower is off by most, */
    int64_t off_q32;  /* or where the master leaves the curve: 0 */
    int64_t m_q32;    /* the master there */
};
/* Is a follower's track on its curve over the track of its master, from start to end?
 * Whole tracks, no windows.  Not on the tick. */
bool controller_couple_judge(const struct controller_cam *cam,
                             const struct motion_track *own,
                             const struct motion_track *master,
                             struct controller_couple_off *off);

/* What a controller calls once an axis was coupled; what couples none (a board) has
 * none of it. */
struct controller_couple_ops {
    /* On the tick: tell followers where they are. */
    void (*follow)(struct controller *controller);
};
struct controller_couplings {
    const struct controller_couple_ops *ops;
    /* Lower what a master may do (`stop`: its stop limits) to what its followers
     * without a track of their own can keep.  Divides. */
    void (*reduce)(const struct controller *controller, unsigned master,
                   bool stop, struct motion_clock_limit *limit);
    /* May these tracks begin at this time?  MOTION_OK, MOTION_E_STATE, MOTION_E_AWAY
     * or MOTION_E_LIMIT and *axis, the follower. */
    int (*admit)(struct controller *controller,
                 const struct motion_track *const track[], int64_t at_ns_q12,
                 int *axis);
};

#endif
