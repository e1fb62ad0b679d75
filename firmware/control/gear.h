/* firmware/control/gear.h - an electronic gear that is engaged while its master
 * moves: the follower, which stands, is taken along within a distance of the
 * master.
 *
 *   follower           /  slope: ratio
 *                   .-'
 *   f ------------''
 *     low       m0   m0 + over    high     master ->
 *
 * It is a cam (couple.h): its place f up to m0, from there to m0 + over a curve
 * whose slope goes from 0 to the ratio, and a straight line.  With x = (m - m0) /
 * over and r the ratio
 *     C = f + r over (x^3 - x^4 / 2)   C' = r (3 x^2 - 2 x^3)
 *     |C''| <= 1.5 r / over            |C'''| <= 6 r / over^2
 * so that a master that runs at v takes the follower's acceleration 1.5 r v^2 /
 * over and its jerk 6 r v^3 / over^2.  As its place is by where the master is,
 * whatever the master does meanwhile, slowing down, resting, turning round, is
 * followed in the same tick.  (PLCopen Motion Control, Part 1, MC_GearInPos: over
 * is its MasterStartDistance; the follower's sync position follows.)
 *
 * Where the master runs the other way the picture is turned about m0. */
#ifndef FIRMWARE_CONTROL_GEAR_H
#define FIRMWARE_CONTROL_GEAR_H

#include "firmware/control/couple.h"

#define CONTROLLER_GEAR_SEGMENTS 3

struct controller_gear {
    int64_t ratio_q32; /* of the follower's unit per the master's; not 0 */
    int64_t place_q32; /* f */
    int64_t begin_q32; /* m0, of the master */
    int64_t over_q32;  /* > 0 */
    int64_t low_q32, high_q32; /* low < m0, m0 +- over < high */
    bool is_backwards;         /* the master runs towards low */
};

/* Its curve, for cam->track with room for that many segments; the cam's range and
 * slopes (its master is the caller's).  MOTION_E_ARG, MOTION_E_RANGE. */
int controller_gear_cam(const struct controller_gear *gear,
                        struct motion_track *track, struct controller_cam *cam);

#endif
