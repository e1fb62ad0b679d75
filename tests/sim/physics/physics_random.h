/* tests/sim/physics/physics_random.h - random parameters, from a seed that is
 * printed. */
#ifndef TESTS_SIM_PHYSICS_PHYSICS_RANDOM_H
#define TESTS_SIM_PHYSICS_PHYSICS_RANDOM_H

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static uint64_t physics_seed;

static inline void physics_begin(void)
{
    const char *const given = getenv("SEED");

    physics_seed = given != NULL ? strtoull(given, NULL, 10) : 20240607;
    printf("SEED=%llu\n", (unsigned long long)physics_seed);
}

/* Uniform in low .. high. */
static inline double physics_random(double low, double high)
{
    physics_seed = physics_seed * 6364136223846793005u + 1442695040888963407u;
    return low +
           (high - low) * (double)(physics_seed >> 11) / 9007199254740992.0;
}

static inline void physics_near(const char *what, double got, double want,
                                double tolerance)
{
    if (!(fabs(got - want) <= tolerance))
        fail_msg("%s: got %.12g, want %.12g within %g", what, got, want,
                 tolerance);
}

#endif
