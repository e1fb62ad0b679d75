/* motion/plan/camera/plan_frames.h - a camera that looks along its path, with the
 * horizon of the path's own frame (motion/path/frame.h). */
#ifndef MOTION_PLAN_CAMERA_PLAN_FRAMES_H
#define MOTION_PLAN_CAMERA_PLAN_FRAMES_H

#include "motion/number/quat.h"
#include "motion/path/frame.h"
#include "motion/plan/path/plan_space.h"

/* A frame, and where it is. */
struct plan_frames_row {
    int64_t distance_q32;
    struct motion_vec pos;
    struct motion_frame frame;
};

struct plan_frames {
    const struct plan_space *space;
    struct motion_dir up, forward; /* of the world, for the first frame */
    bool frenet;
    /* filled in; on the heap */
    struct plan_frames_row *row; /* from 0 to the length */
    uint32_t rows;
    int64_t twist_turn; /* of the last frame, when closed; spread evenly */
};

/* MOTION_E_STATE for a Frenet frame that does not exist somewhere;
 * MOTION_E_TOLERANCE where the path bends too sharply for a frame to be carried
 * on; MOTION_E_WORK beyond 2^20 rows; MOTION_E_FULL. */
int plan_frames_init(struct plan_frames *self);
void plan_frames_free(struct plan_frames *self);

/* The rotation whose x, y, z axes are right, up and backwards, at a distance on
 * the path. */
int plan_frames_at(const struct plan_frames *self, int64_t distance_q32,
                   struct motion_quat *q);

#endif
