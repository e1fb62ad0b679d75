/* firmware/host/base/memory.c - see memory.h. */
#include "firmware/host/base/memory.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include "firmware/host/base/status.h"

void memory_fail(void)
{
    fputs("slew: out of memory\n", stderr);
    exit(STATUS_SYSTEM);
}

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
