/* motion/kinematics/rig.h - a camera rig: from its axes to the camera.
 *
 * A rig is a carrier (carrier.h) and a head on it (pan_tilt.h).  Its axes are the
 * carrier's in their order, then pan, tilt, roll; arrays of positions hold
 * motion_rig_axes of them.  Errors are those of carrier.h and pan_tilt.h.
 * Plan-time. */
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

#endif
