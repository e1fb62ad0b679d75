/* sim/util.h - what every file of the simulation needs. */
#ifndef SIM_UTIL_H
#define SIM_UTIL_H

#include <stddef.h>
#include <stdint.h>

#define CONTAINER_OF(pointer, type, field)                                     \
    ((type *)(void *)((char *)(pointer)-offsetof(type, field)))
#define CONTAINER_OF_CONST(pointer, type, field)                               \
    ((const type *)(const void *)((const char *)(pointer)-offsetof(type,       \
                                                                   field)))
#define ARRAY_LEN(a) (sizeof(a) / sizeof(a)[0])

/* xorshift64*, Vigna 2016: *seed is not 0, before and afterwards. */
static inline uint64_t sim_random(uint64_t *seed)
{
    *seed ^= *seed >> 12;
    *seed ^= *seed << 25;
    *seed ^= *seed >> 27;
    return *seed * UINT64_C(2685821657736338717);
}

/* The simulation runs on a PC, where the compiler has 128 bits. */
__extension__ typedef __int128 sim_i128;

#endif
