/* motion/kinematics/turntable.h - a subject on a turntable before a camera.
 *
 * The table turns about +z through its centre, anticlockwise from above; the
 * frame of the table has its origin there, and the axes of space at 0.  Axes are
 * the table, then those of the camera's rig (rig.h), whose errors, `before` and
 * units are the same here.  Plan-time. */
#ifndef MOTION_KINEMATICS_TURNTABLE_H
#define MOTION_KINEMATICS_TURNTABLE_H

#include "motion/kinematics/rig.h"

struct motion_turntable {
    const struct motion_rig *camera;
    struct motion_vec centre;
    struct motion_vec subject; /* in the frame of the table */
    struct motion_axis_map axis;
};

/* The camera in the frame of the table. */
int motion_turntable_camera(const struct motion_turntable *table,
                            const int64_t *axis_q32,
                            struct motion_camera *camera);

/* The axes with which the pupil is at an azimuth (degrees, atan2(y, x) in the
 * frame of the table), and, when `radius_q32` is not NULL, at that horizontal
 * distance from the table's axis, while the head tracks the subject as it turns.
 * The radius takes a camera on a single linear axis, of whose two places the one
 * nearest to `before` is taken, without it the lower one; else the carrier's axes
 * are those in axis_q32, and so is roll always.  axis_q32 is only whole with
 * MOTION_OK.  MOTION_E_SINGULAR when the pupil is on the table's axis,
 * MOTION_E_WORK when the head's nodal offset is so large beside the distances
 * that no answer is found. */
int motion_turntable_relative(const struct motion_turntable *table,
                              int64_t azimuth_q32, const int64_t *radius_q32,
                              const int64_t *before_q32, int64_t *axis_q32,
                              struct motion_real *distance);

#endif
