/* firmware/control/couple.h - electronic gearing and cams: an axis that goes
 * where a curve over the position of another axis says.
 *
 * The curve is a track that is read by the master's place in the place of time:
 * one unit of the master is one second of it.  A gear is a straight line.  The
 * follower is told its place, speed and acceleration in the same tick as the
 * master, by the chain rule
 *     p = C(m)    v = C'(m) m'    a = C''(m) m'^2 + C'(m) m''
 * so there is nothing to catch up.
 *
 * A jog of the master takes its followers with it: within limits that leave
 * them inside their own, and no further than the curve goes, where it comes to
 * rest.  A hold of such a jog ends it, a fault is the drives' quick stop.  In a
 * move a follower has a track of its own, which its planner made of the curve
 * and the master's (motion/curve/time_warp.h): hold, reverse, override and stop are
 * those of any move.  Coupled axes are not homed, and a move whose tracks do not
 * agree with their curves does not begin.  Coupling ends with torque, and with a
 * fault. */
#ifndef FIRMWARE_CONTROL_COUPLE_H
#define FIRMWARE_CONTROL_COUPLE_H

#include <stdint.h>

#include "motion/core/clock_warp.h"
#include "motion/core/track.h"

struct controller;

struct controller_cam {
    unsigned master;
    const struct motion_track *track; /* the follower's, by (m - low) */
    int64_t low_q32, high_q32;        /* of the master, low < high */
    /* by controller_cam_init: of the follower's unit per the master's, its
     * square and its cube, the largest there are */
    int64_t slope_q32, second_q32, third_q32;
};

/* Fills in the rest.  MOTION_E_ARG: no range, or a track that is not as long;
 * MOTION_E_DISCONTINUITY: its slope steps.  Not on the tick. */
int controller_cam_init(struct controller_cam *cam);
/* Its time at a place of the master, which is within it but for rounding. */
int64_t controller_cam_ns_q12(const struct controller_cam *cam, int64_t m_q32);

/* In READY, or while the master is jogged: the axis follows from now on; the cam
 * must outlive that.  Of a master that moves the curve has to begin with a
 * stretch on which the axis stands (gear.h), else MOTION_E_AWAY; its jog is
 * planned anew by what the curve leaves of its limits and its range, and where it
 * is faster than these now, that is MOTION_E_LIMIT.  MOTION_E_STATE; MOTION_E_ARG:
 * the master is the axis itself, is coupled to another, or either goes by a profile
 * of its drive's; MOTION_E_UNHOMED; MOTION_E_LIMIT: the curve leaves the range of the
 * axis, or the master stands outside of it; MOTION_E_AWAY: the axis does not stand
 * where the curve is. */
int controller_couple(struct controller *controller, unsigned axis,
                      const struct controller_cam *cam);
/* In READY, else MOTION_E_STATE. */
int controller_uncouple(struct controller *controller, unsigned axis);

#endif
