/* motion/plan/topp/topp_divide.h - a path divided where caps begin and end, and where
 * limits of jerk make it stop; see topp_jerk.h.  Off-line: double and heap. */
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

/* The request with borders of its path at all ends of caps too, to which these are moved where
 * they are within a millionth of the path; path and caps are copies, in the pool.  MOTION_E_FULL without memory. */
int topp_divide(const struct plan_topp_request *request, struct plan_pool *pool,
                struct plan_topp_request *divided);

/* What happens at every border, pieces + 1 of them, the first and the last of
 * which are stops; NULL without memory. */
enum topp_border *topp_divide_borders(const struct plan_topp_request *request,
                                      struct plan_pool *pool);

/* All axes stand all along a piece. */
bool topp_divide_is_still(const struct plan_topp_path *path, uint32_t piece);

#endif
