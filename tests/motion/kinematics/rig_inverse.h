/* tests/motion/kinematics/rig_inverse.h - the axes for a camera and for a subject, put
 * together of what plans are made of: carrier.h, head.h and plan_rig.h.
 *
 * Arrays hold motion_rig_axes of the rig.  `before` holds the axes before, from
 * which the nearest answer continues, whole turns included; NULL: the upright
 * one.  Errors are those of the pieces. */
#ifndef TESTS_MOTION_KINEMATICS_RIG_INVERSE_H
#define TESTS_MOTION_KINEMATICS_RIG_INVERSE_H

#include "motion/plan/rig/plan_rig.h"

/* The axes that put the camera there. */
int rig_inverse_pose(const struct motion_rig *rig,
                     const struct motion_camera *camera,
                     const int64_t *before_q32, int64_t *axis_q32);

/* The camera there that sees the subject in the middle, its horizon level.
 * MOTION_E_SINGULAR when the view is vertical, or the subject in the pupil. */
int rig_inverse_level_view(struct motion_vec pupil, struct motion_vec subject,
                           struct motion_camera *camera);

/* Pan and tilt that keep the subject in the middle, and its distance from the
 * pupil; the carrier's axes and roll are those in axis_q32.  Of the answers that
 * there are plan_rig_look gives the upright one with the subject before the pivot;
 * it gives the others for a mount that stands on its head, and for a head that
 * looks backwards. */
int rig_inverse_track(const struct motion_rig *rig, struct motion_vec subject,
                      const int64_t *before_q32, int64_t *axis_q32,
                      double *distance);

#endif
