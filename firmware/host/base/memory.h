/* firmware/host/base/memory.h - the heap, for the parts that are not
 * real-time.
 *
 * Nothing here is called while a bus is live. */
#ifndef FIRMWARE_HOST_BASE_MEMORY_H
#define FIRMWARE_HOST_BASE_MEMORY_H

#include <stddef.h>

/* `count` things of `size` bytes; the first call takes NULL.  New bytes are
 * not initialised. */
void *memory_resize(void *old, size_t count, size_t size);
/* Zeroed. */
void *memory_new(size_t count, size_t size);
void memory_free(void *block);

/* What is taken from a pool is given back all at once.  All zero: empty. */
struct memory_pool {
    struct memory_block *last;
};
/* Zeroed. */
void *memory_pool_new(struct memory_pool *pool, size_t count, size_t size);
/* Room for one more than the `count` in the array: itself, or a larger one with
 * a copy of them; NULL: none yet. */
void *memory_pool_more(struct memory_pool *pool, void *array, size_t count,
                       size_t size);
void memory_pool_free(struct memory_pool *pool);
/* Calls each(of, ...) for all bytes of a block, its link to the one before too:
 * from the last block on. */
void memory_pool_each(const struct memory_pool *pool,
                      void (*each)(void *of, void *at, size_t size), void *of);

/* Memory has run out.  Defined by the program, which ends; slew says so and has
 * status 3. */
void memory_fail(void) __attribute__((noreturn));

#endif
