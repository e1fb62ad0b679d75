/* motion/plan/topp/topp_divide.h - a path divided where it must stop, for limits of
 * jerk; see topp_jerk.h.  Off-line: double and heap. */
#ifndef MOTION_PLAN_TOPP_TOPP_DIVIDE_H
#define MOTION_PLAN_TOPP_TOPP_DIVIDE_H

#include <stdbool.h>

#include "motion/plan/topp/topp.h"

/* What happens at a border of two pieces. */
enum topp_border {
    TOPP_BORDER_SMOOTH,
    TOPP_BORDER_BENDS, /* q'' steps: a stop, unless the path is straight */
    TOPP_BORDER_STOP,
};

/* A copy of the path with borders at all ends of caps too.  MOTION_E_FULL
 * without memory. */
int topp_divide_path(const struct plan_topp_request *request,
                     struct plan_topp_path *path);

/* What happens at every border, pieces + 1 of them, the first and the last of
 * which are stops; NULL without memory. */
enum topp_border *topp_divide_borders(const struct plan_topp_request *request);

/* All axes stand all along a piece. */
bool topp_divide_is_still(const struct plan_topp_path *path, uint32_t piece);

#endif
