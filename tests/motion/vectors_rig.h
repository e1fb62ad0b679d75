/* tests/motion/vectors_rig.h - a rig of a vectors file: read, its axes by name. */
#ifndef TESTS_MOTION_VECTORS_RIG_H
#define TESTS_MOTION_VECTORS_RIG_H

#include "motion/kinematics/arm.h"
#include "motion/kinematics/dolly_zoom.h"
#include "motion/kinematics/turntable.h"
#include "motion/plan/path/plan_space.h"
#include "tests/motion/vectors_json.h"

#define RIG_AXES_MAX (MOTION_RIG_AXES_MAX + 1)

enum rig_sort { RIG_CAMERA, RIG_TABLE, RIG_ARM };

struct vectors_rig {
    enum rig_sort sort;
    struct motion_rig camera; /* on the floor, or before the table */
    struct motion_turntable table;
    struct motion_arm arm;
    struct motion_arm_tool tool;
    struct motion_dolly_zoom zoom;
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
