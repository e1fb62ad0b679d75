/* motion/plan/camera/plan_orient.h - a head that turns through keyed orientations, in
 * time or along a path.  The keys and what they mean: plan_camera.h. */
#ifndef MOTION_PLAN_CAMERA_PLAN_ORIENT_H
#define MOTION_PLAN_CAMERA_PLAN_ORIENT_H

#include "motion/plan/camera/plan_camera.h"
#include "motion/plan/path/plan_space.h"

/* The keys as rotations from the mount; on the heap. */
struct plan_turning {
    struct motion_orient orient;
    struct motion_head start; /* angles that the first key gives, if any */
};

/* Distances of `space`; NULL where the keys are times.  On an error the code
 * and *error; plan_turning_free in either case. */
int plan_turning_init(struct plan_turning *turning,
                      const struct plan_camera *camera,
                      const struct plan_space *space, struct plan_error *error);
void plan_turning_free(struct plan_turning *turning);

/* An error of motion_orient_plan or motion_orient_at as a sentence; returns the
 * code. */
int plan_turning_refuse(const struct plan_camera *camera, int err,
                        struct plan_error *error);

/* Plan pan, tilt and roll of keys that are times into empty tracks;
 * bound_q32[axis] in degrees. */
int plan_orient_tracks(const struct plan_camera *camera,
                       struct motion_track *list[MOTION_HEAD_AXES],
                       int64_t bound_q32[MOTION_HEAD_AXES],
                       const struct plan_progress *progress,
                       struct plan_error *error);

#endif
