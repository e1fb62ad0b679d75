/* motion/kinematics/rig.h - a camera rig: from its axes to the camera, and back.
 *
 * A rig is a carrier (carrier.h) and a head on it (pan_tilt.h).  Its axes are the
 * carrier's in their order, then pan, tilt, roll; arrays of positions hold
 * motion_rig_axes of them.  `before` holds the axes before, from which the answer
 * continues (nearest, whole turns included), or is NULL for the upright answer.
 * Errors are those of carrier.h and pan_tilt.h; axes are unchanged then unless
 * said otherwise.  Plan-time. */
#ifndef MOTION_KINEMATICS_RIG_H
#define MOTION_KINEMATICS_RIG_H

#include "motion/kinematics/carrier.h"
#include "motion/kinematics/pan_tilt.h"

#define MOTION_RIG_AXES_MAX (MOTION_CARRIER_AXES_MAX + MOTION_HEAD_AXES)

struct motion_rig {
    struct motion_carrier carrier;
    struct motion_pan_tilt head;
};

uint32_t motion_rig_axes(const struct motion_rig *rig);

/* Where the camera is. */
int motion_rig_camera(const struct motion_rig *rig, const int64_t *axis_q32,
                      struct motion_camera *camera);

/* The axes that put the camera there. */
int motion_rig_pose(const struct motion_rig *rig,
                    const struct motion_camera *camera,
                    const int64_t *before_q32, int64_t *axis_q32);

/* The camera with its pupil here that sees the subject in the middle of the
 * picture, its horizon level: right = unit(view x z), up = right x view.
 * MOTION_E_SINGULAR when the view is vertical, or the subject in the pupil. */
int motion_rig_level_view(struct motion_vec pupil, struct motion_vec subject,
                          struct motion_camera *camera);

/* Pan and tilt, written into axis_q32, that keep the subject in the middle; the
 * carrier's axes and roll are those in axis_q32.  distance: from the pupil. */
int motion_rig_track(const struct motion_rig *rig, struct motion_vec subject,
                     const int64_t *before_q32, int64_t *axis_q32,
                     struct motion_real *distance);

/* Of a subject from the pupil, anywhere in the picture or outside; and its part
 * along the view, which is what a lens focuses on, negative behind. */
void motion_camera_distance(const struct motion_camera *camera,
                            struct motion_vec subject,
                            struct motion_real *distance,
                            struct motion_real *depth);

#endif
