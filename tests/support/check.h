/* tests/support/check.h - what every test file needs: cmocka, sizes, seeded
 * numbers. */
#ifndef TESTS_SUPPORT_CHECK_H
#define TESTS_SUPPORT_CHECK_H

#include <inttypes.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#ifndef ARRAY_LEN /* sim/util.h has it too */
#define ARRAY_LEN(a) (sizeof(a) / sizeof(a)[0])
#endif

/* Are addresses checked?  gcc defines a name of its own, clang has a feature;
 * then memory is not locked, what was freed is kept, and all is slower. */
#ifdef __SANITIZE_ADDRESS__
#define CHECK_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define CHECK_SANITIZED 1
#endif
#endif

/* How often a sweep goes round: `all` with EVERY=1 (make nightly), else a part. */
static inline int check_many(int all, int part)
{
    return getenv("EVERY") != NULL ? all : part;
}

/* How many cases of `all` a sweep over arithmetic has.  What its numbers claim is claimed
 * of all of them without sanitizers; with these, which make each some ten times as
 * long, a quarter serve what these look for.  EVERY=1 (make nightly): all. */
static inline int check_cases(int all)
{
#ifdef CHECK_SANITIZED
    return check_many(all, (all + 3) / 4);
#else
    return all;
#endif
}

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

/* --- one stream of numbers for a test that states a property -------------- */

static inline uint64_t *check_stream(void)
{
    static uint64_t seed = 1;
    return &seed;
}

/* Start it anew, from SEED of the environment when given, and print the seed
 * with the property's name. */
static inline void seed_from(const char *what)
{
    const char *given = getenv("SEED");
    uint64_t *seed = check_stream();
    *seed = given ? strtoull(given, NULL, 0) : UINT64_C(0x9E3779B97F4A7C15);
    print_message("%s: SEED=%#" PRIx64 "\n", what, *seed);
}

static inline uint64_t draw(void)
{
    return check_random(check_stream());
}

/* 0 .. limit - 1; limit 1 .. 2^31 - 1. */
static inline uint32_t draw_below(uint32_t limit)
{
    return (uint32_t)(draw() >> 33) % limit;
}

/* 0 up to, not including, 1. */
static inline long double draw_unit(void)
{
    return (long double)(draw() >> 11) / 9007199254740992.0L;
}

#endif
