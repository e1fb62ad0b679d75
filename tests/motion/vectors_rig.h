/* tests/motion/vectors_rig.h - a rig of a vectors file: read, its axes by name. */
#ifndef TESTS_MOTION_VECTORS_RIG_H
#define TESTS_MOTION_VECTORS_RIG_H

#include "motion/kinematics/arm.h"
#include "motion/plan/path/plan_space.h"
#include "motion/plan/rig/plan_rig.h"
#include "tests/motion/vectors_json.h"

#define RIG_AXES_MAX (MOTION_RIG_AXES_MAX + 1)

enum rig_sort { RIG_CAMERA, RIG_TABLE, RIG_ARM };

/* A lens that keeps a subject's size as a slide comes nearer. */
struct vectors_zoom {
    int64_t focal_at_q32, slide_at_q32;
    struct motion_vec subject_at;
    int64_t focal_min_q32, focal_max_q32;
};

struct vectors_rig {
    enum rig_sort sort;
    struct motion_rig camera;   /* on the floor, or before the table */
    struct plan_rig table;      /* of which the centre counts */
    struct motion_vec on_table; /* the subject */
    struct motion_arm arm;
    struct motion_arm_tool tool;
    struct vectors_zoom zoom;
    struct plan_space rail; /* of the camera's carrier, if that is one */
    bool has_zoom, has_tool;
    int axes;
    char name[RIG_AXES_MAX][16];
    bool is_length[RIG_AXES_MAX]; /* mm, else deg */
};

/* False when something is not known or malformed.  `rig` must stay where it
 * is; to be freed in both cases. */
bool vectors_rig_read(const cJSON *item, struct vectors_rig *rig);
void vectors_rig_free(struct vectors_rig *rig);

static inline int64_t vectors_q32(double a)
{
    return (int64_t)llrint(ldexp(a, 32));
}

#endif
