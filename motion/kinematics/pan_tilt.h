/* motion/kinematics/pan_tilt.h - a camera on a head with pan, tilt and roll.
 *
 *     R = M Rz(pan) Ry(-tilt) Rx(roll)      columns forward, left, up
 *     pupil = pivot + R (forward, -right, up) of the nodal offset
 *
 * M is the mount's; pan is positive to the left, tilt upwards, roll clockwise as
 * the camera sees it.  The pupil is the entrance pupil: rays to the subject meet
 * there, and distances are counted from it.
 *
 * Two sets of angles do for every rotation, (pan, tilt, roll) and (pan + 180,
 * 180 - tilt, roll + 180), and each runs on over whole turns.  With axes
 * `before` the nearest answer is taken (least sum of squares); with NULL the
 * upright one, tilt in -90 .. 90, pan and roll in -180 .. 180 degrees before
 * direction and offset.  Where pan is not determined it keeps its value.
 * Source: the geometry; angles as in motion/path/head.h.  Plan-time. */
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

/* The axes for a camera with rotation q.  MOTION_E_RANGE beyond 2^22 turns. */
int motion_pan_tilt_rotation(const struct motion_pan_tilt *head,
                             struct motion_quat level, struct motion_quat q,
                             const int64_t before_q32[MOTION_HEAD_AXES],
                             int64_t axis_q32[MOTION_HEAD_AXES]);

/* Pan and tilt with which the view meets the subject; roll is
 * axis_q32[MOTION_HEAD_ROLL].  MOTION_E_UNREACHABLE when the subject is nearer
 * than the pupil goes round, MOTION_E_SINGULAR when it is in the pupil, or on
 * the pan axis and there is nothing before; MOTION_E_RANGE. */
int motion_pan_tilt_track(const struct motion_pan_tilt *head,
                          const struct motion_mount *mount,
                          struct motion_vec subject,
                          const int64_t before_q32[MOTION_HEAD_AXES],
                          int64_t axis_q32[MOTION_HEAD_AXES],
                          struct motion_real *distance);

/* Of the pivot from a subject that is tracked at a distance from the pupil. */
struct motion_real motion_pan_tilt_reach(const struct motion_pan_tilt *head,
                                         struct motion_real distance);
/* The other way round; MOTION_E_UNREACHABLE, MOTION_E_SINGULAR as above. */
int motion_pan_tilt_distance(const struct motion_pan_tilt *head,
                             struct motion_real reach,
                             struct motion_real *distance);

#endif
