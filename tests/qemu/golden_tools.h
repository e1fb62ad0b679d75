/* tests/qemu/golden_tools.h - what every golden image needs: a seeded generator
 * (xorshift), a hash (FNV-1a, by words) of everything a producer gives out, and
 * the line that reports it. */
#ifndef TESTS_QEMU_GOLDEN_TOOLS_H
#define TESTS_QEMU_GOLDEN_TOOLS_H

#include <stdint.h>

#include "motion/core/track.h"
#include "motion/curve/bake.h"
#include "motion/number/real.h"

/* A new producer: seeds the generator and clears the hash. */
void golden_start(uint64_t seed);
/* One line: hash, name and, where there are any, a count of segments. */
void golden_report(const char *name, uint32_t segments);

/* One call per statement: C leaves the order within an expression or an
 * initialiser to the compiler. */
uint64_t golden_random(void);
int64_t golden_any(void);                      /* any 64 bits */
int64_t golden_signed(unsigned bits);          /* -2^bits .. 2^bits */
int64_t golden_below(int64_t below);           /* 0 .. below - 1, no division */
struct motion_real golden_real(unsigned bits); /* of a Q32.32 of so many bits */

void golden_add(int64_t value);
void golden_add_real(struct motion_real a);
void golden_add_bound(const struct motion_bake_bound *bound);
/* All that sampling reads, and the state at the end. */
void golden_add_segments(const struct motion_track *track);
/* `count` samples at random times; no more than 2^16. */
void golden_add_random_samples(const struct motion_track *track,
                               uint32_t count);
void golden_add_state(const struct motion_state *state);

#endif
