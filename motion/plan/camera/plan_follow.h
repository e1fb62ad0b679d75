/* motion/plan/camera/plan_follow.h - a head and a lens that follow a subject while the
 * axes of the rig move, whatever drives these.
 *
 * Pan and tilt keep the subject in the middle of the picture, focus is its
 * distance from the entrance pupil, and zoom keeps its size:
 *
 *     focal(t) = focal_at distance(t) / distance(t_at)
 *
 * All are functions of the tracks that the other axes have, with derivatives
 * (plan_rig.h), and are baked. */
#ifndef MOTION_PLAN_CAMERA_PLAN_FOLLOW_H
#define MOTION_PLAN_CAMERA_PLAN_FOLLOW_H

#include "motion/plan/camera/plan_camera.h"

/* Tolerance of the baking of a lens's axes: unit * 2^-14. */
#define PLAN_FOLLOW_LENS_Q32 ((int64_t)1 << 18)

/* Plan pan, tilt, roll and lens of camera->following.rig into their tracks,
 * which must be empty; those of the other axes are there.  Bounds as
 * plan_camera_tracks has them; of the lens the worst in lens_bound_q32.  On an
 * error the code and *error, which names the time, and empty tracks. */
int plan_follow_tracks(const struct plan_camera *camera,
                       struct motion_track track[],
                       int64_t bound_q32[MOTION_HEAD_AXES],
                       int64_t *lens_bound_q32, struct plan_error *error);

/* Where the subject is at a time, for pictures and reports: false when the
 * camera has none that is a point, or without memory. */
bool plan_follow_subject(const struct plan_camera *camera,
                         const struct motion_track track[], int64_t t_ns_q12,
                         struct plan_jet_vec *subject);

#endif
