/* tests/motion/plan/topp/topp_rig.h - paths of cubics with limits, for tests. */
#ifndef TESTS_MOTION_PLAN_TOPP_TOPP_RIG_H
#define TESTS_MOTION_PLAN_TOPP_TOPP_RIG_H

#include <stdint.h>

#include "motion/plan/topp/topp.h"

#define TOPP_RIG_AXES_MAX   12
#define TOPP_RIG_PIECES_MAX 12
#define TOPP_RIG_CAPS_MAX   20

/* A path of cubics, and a request for it, which points into it. */
struct topp_rig {
    double border[TOPP_RIG_PIECES_MAX + 1];
    double coef[TOPP_RIG_PIECES_MAX * TOPP_RIG_AXES_MAX * 4];
    struct plan_topp_limit limit[TOPP_RIG_AXES_MAX];
    double jerk[TOPP_RIG_AXES_MAX];
    struct plan_topp_cap cap[TOPP_RIG_CAPS_MAX];
    struct plan_topp_request request;
};

/* All powers 0, pieces 1 wide, all limits 1. */
void topp_rig_init(struct topp_rig *rig, unsigned axes, uint32_t pieces);

/* The four powers of a piece. */
double *topp_rig_powers(struct topp_rig *rig, uint32_t piece, unsigned axis);

/* One axis, `distance` in all, over so many pieces. */
void topp_rig_straight(struct topp_rig *rig, double distance, uint32_t pieces);

/* Keys that are smooth, cusps, repeated or on a straight line. */
void topp_rig_random(struct topp_rig *rig, uint64_t from);

/* A C2 path in all axes, natural at both ends. */
void topp_rig_random_smooth(struct topp_rig *rig, uint64_t from);

#endif
