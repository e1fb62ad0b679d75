/* motion/plan/camera/plan_tool_look.h - how the tool of an arm is turned on its
 * path, with derivatives: as a rotation, which unlike pan and tilt has no pole.
 *
 *     AT, SUBJECT     the view is the way to it, the horizon level
 *     KEYS by time    motion/path/orient.h, derivatives from a stencil in time
 *     all others      plan_view.h, by the distance along the path
 *
 * A keyed roll turns it about its view on top of that. */
#ifndef MOTION_PLAN_CAMERA_PLAN_TOOL_LOOK_H
#define MOTION_PLAN_CAMERA_PLAN_TOOL_LOOK_H

#include "motion/plan/camera/plan_along.h"
#include "motion/plan/camera/plan_camera.h"
#include "motion/plan/camera/plan_keyed.h"
#include "motion/plan/camera/plan_view.h"

/* It points into itself: not to be moved. */
struct plan_tool_look {
    const struct plan_tool *tool;
    const struct plan_drive *drive;
    struct plan_error *error;
    struct plan_keyed keyed;
    struct plan_turning turning; /* KEYS by time, */
    struct motion_quat mount;    /* and what they are turned from */
    bool is_view;                /* by the distance */
    struct plan_view view;
    int64_t *time_ns_q12; /* when a derivative may step; on the heap */
    uint32_t times;
    int64_t *break_ns_q12; /* when the law comes to view.break_q32 */
};

/* On the path as it is driven; tells `along` where something may step.  On an
 * error the code and *error; plan_tool_look_free in either case. */
int plan_tool_look_init(struct plan_tool_look *self,
                        const struct plan_tool *tool,
                        const struct plan_drive *drive,
                        struct plan_along *along);
void plan_tool_look_free(struct plan_tool_look *self);

/* The frame at a time, of a tool whose point is there.  MOTION_E_SINGULAR where
 * the view is vertical or has no direction; else as plan_view_frame. */
int plan_tool_look_frame(const struct plan_tool_look *self, int64_t t_ns_q12,
                         int side, struct plan_jet_vec point,
                         struct plan_rig_frame *frame);

#endif
