/* motion/plan/camera/plan_keyed.h - what of a camera has keys of its own: a subject
 * that moves, and a roll on top. */
#ifndef MOTION_PLAN_CAMERA_PLAN_KEYED_H
#define MOTION_PLAN_CAMERA_PLAN_KEYED_H

#include "motion/plan/camera/plan_camera.h"

struct plan_keyed {
    struct motion_track subject[PLAN_SPACE_AXES], roll; /* empty: not keyed */
};

void plan_keyed_init(struct plan_keyed *self);
/* Plan what is keyed, after plan_keyed_init; plan_keyed_free in either case. */
int plan_keyed_open(struct plan_keyed *self, const struct plan_camera *camera,
                    struct plan_error *error);
void plan_keyed_free(struct plan_keyed *self);

/* Where the subject, or else the point that is looked at, is; the roll in rad. */
struct plan_jet_vec plan_keyed_subject(const struct plan_keyed *self,
                                       const struct plan_camera *camera,
                                       int64_t t_ns_q12, int side);
struct plan_jet plan_keyed_roll(const struct plan_keyed *self, int64_t t_ns_q12,
                                int side);

#endif
