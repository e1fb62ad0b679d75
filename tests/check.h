/* tests/check.h - what every test file needs: cmocka, sizes, seeded numbers. */
#ifndef TESTS_CHECK_H
#define TESTS_CHECK_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#define ARRAY_LEN(a) (sizeof(a) / sizeof(a)[0])

/* xorshift64*: the same numbers everywhere.  Print the seed when a property
 * fails. */
static inline uint64_t check_random(uint64_t *seed)
{
    *seed ^= *seed >> 12;
    *seed ^= *seed << 25;
    *seed ^= *seed >> 27;
    return *seed * UINT64_C(2685821657736338717);
}

/* Evenly in low .. high, both included. */
static inline int64_t check_random_in(uint64_t *seed, int64_t low, int64_t high)
{
    const uint64_t span = (uint64_t)high - (uint64_t)low + 1;
    const uint64_t r = check_random(seed);
    return (int64_t)((uint64_t)low + (span ? r % span : r));
}

#endif
