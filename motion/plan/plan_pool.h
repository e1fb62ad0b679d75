/* motion/plan/plan_pool.h - memory that is freed all together.
 *
 * What plans takes from the pool of its caller, or has one of its own for what only
 * the planning needs, and frees nothing by itself: whoever declared a pool frees it,
 * once, on every way out. */
#ifndef MOTION_PLAN_PLAN_POOL_H
#define MOTION_PLAN_PLAN_POOL_H

#include <stddef.h>

#include "motion/core/err.h"

MOTION_C_BEGIN

/* All 0: empty. */
struct plan_pool {
    struct plan_pool_block *last;
};

/* Room for so many things of a size, all 0; NULL without memory. */
void *plan_pool_take(struct plan_pool *pool, size_t count, size_t size);
/* Free all that was taken; the pool is empty then. */
void plan_pool_free(struct plan_pool *pool);

MOTION_C_END

#endif
