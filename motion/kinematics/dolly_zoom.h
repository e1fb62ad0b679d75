/* motion/kinematics/dolly_zoom.h - a subject of constant size while the camera
 * comes nearer: focal length in proportion to distance.
 *
 *     focal = focal_at distance / distance_at
 *
 * distance_at being that of the subject at `subject_at` with the slide at
 * `slide_at`; both from the entrance pupil, the head tracking with roll at 0.
 * The camera is a rig on a single linear axis (rig.h: errors, before); its axes
 * are slide, pan, tilt, roll.  Plan-time. */
#ifndef MOTION_KINEMATICS_DOLLY_ZOOM_H
#define MOTION_KINEMATICS_DOLLY_ZOOM_H

#include "motion/kinematics/rig.h"

#define MOTION_DOLLY_ZOOM_AXES 4

struct motion_dolly_zoom {
    const struct motion_rig *camera;
    int64_t focal_at_q32; /* > 0, mm */
    int64_t slide_at_q32;
    struct motion_vec subject_at;
    int64_t focal_min_q32, focal_max_q32;
};

/* Focal length and pan, tilt for axis_q32[0], the slide; writes pan, tilt and
 * roll 0.  MOTION_E_RANGE when the focal length does not fit; limits are asked
 * about below. */
int motion_dolly_zoom_focal(const struct motion_dolly_zoom *zoom,
                            struct motion_vec subject,
                            const int64_t *before_q32,
                            int64_t axis_q32[MOTION_DOLLY_ZOOM_AXES],
                            int64_t *focal_q32, struct motion_real *distance);

/* MOTION_E_UNREACHABLE for a focal length that the lens does not have. */
int motion_dolly_zoom_check(const struct motion_dolly_zoom *zoom,
                            int64_t focal_q32);

/* The axes with which the focal length is this one, of the two the slide
 * nearest to `before`, without it the lower one. */
int motion_dolly_zoom_slide(const struct motion_dolly_zoom *zoom,
                            int64_t focal_q32, struct motion_vec subject,
                            const int64_t *before_q32,
                            int64_t axis_q32[MOTION_DOLLY_ZOOM_AXES],
                            struct motion_real *distance);

#endif
