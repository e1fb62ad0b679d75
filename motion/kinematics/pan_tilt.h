/* motion/kinematics/pan_tilt.h - a camera on a head with pan, tilt and roll.
 *
 *     R = M Rz(pan) Ry(-tilt) Rx(roll)      columns forward, left, up
 *     pupil = pivot + R (forward, -right, up) of the nodal offset
 *
 * M is the mount's; pan is positive to the left, tilt upwards, roll clockwise as
 * the camera sees it.  The pupil is the entrance pupil: rays to the subject meet
 * there, and distances are counted from it.
 *
 * Angles as in motion/path/head.h.  Source: the geometry.  Plan-time. */
#ifndef MOTION_KINEMATICS_PAN_TILT_H
#define MOTION_KINEMATICS_PAN_TILT_H

#include "motion/kinematics/mount.h"
#include "motion/path/head.h"

/* Of the entrance pupil from the pivot, with the camera at rest. */
struct motion_nodal {
    int64_t forward_q32, right_q32, up_q32;
};

struct motion_pan_tilt {
    struct motion_axis_map axis[MOTION_HEAD_AXES]; /* pan, tilt, roll */
    struct motion_nodal nodal;
};

struct motion_camera {
    struct motion_vec pupil;
    struct motion_quat q;
};

/* Where the camera is.  MOTION_E_RANGE for an angle that does not fit. */
int motion_pan_tilt_camera(const struct motion_pan_tilt *head,
                           const struct motion_mount *mount,
                           const int64_t axis_q32[MOTION_HEAD_AXES],
                           struct motion_camera *camera);

/* From the pivot to the pupil of a camera with rotation q. */
struct motion_vec motion_pan_tilt_nodal(const struct motion_pan_tilt *head,
                                        struct motion_quat q);

#endif
