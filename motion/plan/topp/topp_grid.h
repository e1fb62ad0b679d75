/* motion/plan/topp/topp_grid.h - where the intervals of topp_barrier.h go.
 * Off-line: double and heap. */
#ifndef MOTION_PLAN_TOPP_TOPP_GRID_H
#define MOTION_PLAN_TOPP_TOPP_GRID_H

#include "motion/plan/topp/topp_barrier.h"

/* Each interval lies in one piece of the path. */
struct topp_grid {
    uint32_t intervals;
    uint32_t *piece; /* of each interval */
    double *w;       /* intervals + 1, from 0 to 1 */
};

/* Make a grid in the pool, of about so many intervals, at least so many in each piece,
 * even in w.
 * MOTION_E_FULL without memory, as the next. */
int topp_grid_even(const struct topp_chain *chain, double intervals,
                   double per_piece, struct plan_pool *pool,
                   struct topp_grid *grid);
/* Denser where the barrier's z takes its time. */
int topp_grid_by_time(const struct topp_barrier *barrier, double intervals,
                      double per_piece, struct plan_pool *pool,
                      struct topp_grid *grid);

/* Time that the barrier's z takes on interval i. */
double topp_grid_time(const struct topp_barrier *barrier, uint32_t i);

#endif
