/* motion/plan/camera/plan_view.h - which way the head of a camera turns at a distance
 * along its path, with derivatives. */
#ifndef MOTION_PLAN_CAMERA_PLAN_VIEW_H
#define MOTION_PLAN_CAMERA_PLAN_VIEW_H

#include "motion/curve/bake.h"
#include "motion/plan/camera/plan_camera.h"
#include "motion/plan/camera/plan_frames.h"
#include "motion/plan/camera/plan_orient.h"

/* Where the walk along the path is at the start of a step. */
struct plan_view_row {
    struct motion_lookat_state state;
    struct motion_head head;
};

/* It points into itself: not to be moved. */
struct plan_view {
    const struct plan_camera *camera;
    const struct plan_space *space; /* of the path */
    struct plan_error *error;
    struct motion_lookat_path path;
    struct plan_space other_space;   /* PATH */
    struct motion_lookat_path other; /* PATH and LEVEL */
    struct motion_dwell *dwell;      /* as many as the camera has */
    struct motion_target target;
    struct motion_lookat lookat;
    struct motion_quat from_mount; /* inverse of the mount's rotation */
    struct plan_frames frames;
    struct plan_turning turning; /* KEYS */
    struct plan_view_row *row;   /* rows + 1 */
    uint32_t rows;
    int64_t step_q32; /* of the derivatives */
    /* Distances in order, the path's ends included: where a derivative may
     * step, and of these the breaks, whose two sides are told apart. */
    int64_t *border_q32, *break_q32;
    uint32_t borders, breaks;
    int64_t margin_q32; /* beside a break */
};

/* Walk along the path.  On an error the code and *error; plan_view_free in
 * either case. */
int plan_view_init(struct plan_view *self, const struct plan_camera *camera,
                   const struct plan_space *space, struct plan_error *error);
void plan_view_free(struct plan_view *self);

/* Pan, tilt and roll in degrees in pos, and their first and second derivative
 * by distance in vel and acc, between the breaks `stretch` and `stretch` + 1;
 * at the nearest place to *distance_q32 that is there, which is put into it.
 * An error of the walk, for plan_view_refuse. */
int plan_view_jet(const struct plan_view *self, uint32_t stretch,
                  int64_t *distance_q32,
                  struct motion_bake_point jet[MOTION_HEAD_AXES]);

/* The same of the camera's frame in space instead of its angles: no pole. */
int plan_view_frame(const struct plan_view *self, uint32_t stretch,
                    int64_t *distance_q32, struct plan_rig_frame *frame);

/* First and second derivatives alone, from those of the path, where it has them
 * and they do not step: false elsewhere.  `is_over`: the head has tilted over
 * the top.  plan_view_rates.c */
bool plan_view_rates(const struct plan_view *self, int64_t distance_q32,
                     bool is_over,
                     struct motion_bake_point jet[MOTION_HEAD_AXES]);

/* Fill in borders and breaks: part of plan_view_init.  plan_view_border.c */
int plan_view_borders(struct plan_view *view);

/* Sentences: what an error of the walk means; no memory.  They return the
 * code. */
int plan_view_refuse(const struct plan_view *self, int err);
int plan_view_no_memory(const struct plan_view *self);

#endif
