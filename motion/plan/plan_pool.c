/* motion/plan/plan_pool.c - see plan_pool.h. */
#include "motion/plan/plan_pool.h"

#include <stdint.h>
#include <stdlib.h>

struct plan_pool_block {
    struct plan_pool_block *before;
    max_align_t room[];
};

void *plan_pool_take(struct plan_pool *pool, size_t count, size_t size)
{
    struct plan_pool_block *block;

    if (count > (SIZE_MAX - sizeof *block) / size)
        return NULL;
    block = calloc(1, sizeof *block + count * size);
    if (block == NULL)
        return NULL;
    block->before = pool->last;
    pool->last = block;
    return block->room;
}

void plan_pool_free(struct plan_pool *pool)
{
    while (pool->last != NULL) {
        struct plan_pool_block *before = pool->last->before;
        free(pool->last);
        pool->last = before;
    }
}
