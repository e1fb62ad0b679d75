/* firmware/host/base/memory.h - the heap, for the parts that are not
 * real-time.
 *
 * Running out ends the program with a sentence and status 3.  Nothing here is
 * called while a bus is live. */
#ifndef FIRMWARE_HOST_BASE_MEMORY_H
#define FIRMWARE_HOST_BASE_MEMORY_H

#include <stddef.h>

/* `count` things of `size` bytes; the first call takes NULL.  New bytes are
 * not initialised. */
void *memory_resize(void *old, size_t count, size_t size);
/* Zeroed. */
void *memory_new(size_t count, size_t size);
void memory_free(void *block);
void memory_fail(void) __attribute__((noreturn));

#endif
