/* tests/motion/vectors_demand.h - rows of kinematics.json and the demands that
 * they make on a rig. */
#ifndef TESTS_MOTION_VECTORS_DEMAND_H
#define TESTS_MOTION_VECTORS_DEMAND_H

#include "motion/core/err.h"
#include "tests/motion/vectors_rig.h"

/* The numbers of one row, by the names of their columns; false when there is
 * none. */
struct sheet {
    const cJSON *names, *values;
};
bool vectors_sheet_get(const struct sheet *sheet, const char *name, double *to);
bool vectors_sheet_pupil(const struct sheet *sheet, struct motion_vec *point);
bool vectors_sheet_subject(const struct sheet *sheet, struct motion_vec *point);
bool vectors_sheet_quat(const struct sheet *sheet, struct motion_quat *q);
/* The axes that have a column; the others keep their position. */
void vectors_sheet_axes(const struct sheet *sheet,
                        const struct vectors_rig *rig, const char *prefix,
                        int64_t *axis_q32);

struct answer {
    int64_t axis_q32[RIG_AXES_MAX];
    struct motion_camera camera; /* or the flange */
    double distance, depth;
    int64_t focal_q32;
};

/* MOTION_OK, why not, or MALFORMED when a column is missing. */
#define MALFORMED MOTION_E_EMPTY
typedef int vectors_demand(const struct vectors_rig *rig,
                           const struct sheet *in, const int64_t *before_q32,
                           struct answer *got);
vectors_demand vectors_rig_forward, vectors_rig_tool;

/* NULL when there is none of that name. */
vectors_demand *vectors_demand_named(const char *name);

/* The camera, or an arm's flange. */
int vectors_rig_camera(const struct vectors_rig *rig, const int64_t *axis_q32,
                       struct motion_camera *camera);

#endif
