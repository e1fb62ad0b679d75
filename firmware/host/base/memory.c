/* firmware/host/base/memory.c - see memory.h. */
#include "firmware/host/base/memory.h"

#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

void *memory_resize(void *old, size_t count, size_t size)
{
    void *block = count > SIZE_MAX / size ? NULL : realloc(old, count * size);
    if (block == NULL)
        memory_fail();
    return block;
}

void *memory_new(size_t count, size_t size)
{
    void *block = calloc(count, size);
    if (block == NULL)
        memory_fail();
    return block;
}

void memory_free(void *block)
{
    free(block);
}

struct memory_block {
    struct memory_block *before;
    size_t size; /* of all of it */
    max_align_t data[];
};

void *memory_pool_new(struct memory_pool *pool, size_t count, size_t size)
{
    if (size > 0 && count > (SIZE_MAX - sizeof(struct memory_block)) / size)
        memory_fail();
    const size_t whole = sizeof(struct memory_block) + count * size;
    struct memory_block *block = memory_new(1, whole);
    block->before = pool->last;
    block->size = whole;
    pool->last = block;
    return block->data;
}

/* Full at every power of two. */
void *memory_pool_more(struct memory_pool *pool, void *array, size_t count,
                       size_t size)
{
    if ((count & (count - 1)) != 0)
        return array;
    void *larger = memory_pool_new(pool, count == 0 ? 1 : 2 * count, size);
    if (count > 0)
        memcpy(larger, array, count * size);
    return larger;
}

void memory_pool_free(struct memory_pool *pool)
{
    while (pool->last != NULL) {
        struct memory_block *block = pool->last;
        pool->last = block->before;
        memory_free(block);
    }
}

void memory_pool_each(const struct memory_pool *pool,
                      void (*each)(void *of, void *at, size_t size), void *of)
{
    for (struct memory_block *block = pool->last; block != NULL;
         block = block->before)
        each(of, block, block->size);
}
