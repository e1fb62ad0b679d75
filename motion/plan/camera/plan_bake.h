/* motion/plan/camera/plan_bake.h - tracks that follow from other tracks: borders where
 * one of these has some, and the baking. */
#ifndef MOTION_PLAN_CAMERA_PLAN_BAKE_H
#define MOTION_PLAN_CAMERA_PLAN_BAKE_H

#include "motion/curve/bake.h"
#include "motion/plan/rig/jet.h"

struct plan_bake {
    struct motion_bake_source source;
    uint32_t axes; /* 1 .. MOTION_BAKE_AXES */
    int64_t tolerance_q32;
    int64_t *border_ns_q12; /* on the heap; plan_bake_free */
    uint32_t borders;
};

/* Where any of these tracks begins a segment or ends, and at `times` others, none
 * twice, from 0 on: MOTION_OK or MOTION_E_FULL. */
int plan_bake_borders(struct plan_bake *bake,
                      const struct motion_track *const cause[], uint32_t causes,
                      const int64_t time_ns_q12[], uint32_t times);
void plan_bake_free(struct plan_bake *bake);

/* Bake from 0 to the last border into tracks that are empty.  Errors of the
 * source and of motion_bake; *report is all zero where nothing lasts. */
int plan_bake_tracks(const struct plan_bake *bake, struct motion_track *list[],
                     struct motion_bake_report *report);
uint32_t plan_bake_looks(const struct plan_bake *bake); /* at most */

/* p, v, a as the baker has them, finite. */
struct motion_bake_point plan_bake_point(struct plan_jet jet);
/* The larger of *bound_q32 and the bound of one axis into *bound_q32. */
void plan_bake_bound(const struct motion_bake_report *report, uint32_t axis,
                     int64_t *bound_q32);

#endif
