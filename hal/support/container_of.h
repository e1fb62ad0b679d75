/* hal/support/container_of.h - from an embedded interface to the struct around
 * it. */
#ifndef HAL_SUPPORT_CONTAINER_OF_H
#define HAL_SUPPORT_CONTAINER_OF_H

#include <stddef.h>

#ifndef CONTAINER_OF
#define CONTAINER_OF(pointer, type, member)                                    \
    ((type *)(void *)((char *)(pointer)-offsetof(type, member)))
#endif

#endif
