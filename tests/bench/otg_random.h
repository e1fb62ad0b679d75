/* tests/bench/otg_random.h - problems for the planner, from a seed.
 *
 * Kinds, shares and ranges follow the usual families of point-to-point
 * problems; a length of 1 there is 2^10 units here, so that the smallest moves
 * (1e-6) still have 22 bits.  Integers only: the same problems on a PC and on
 * a microcontroller.  Every start but those of START_VIOLATES and every goal
 * is one that a motion inside the limits can have. */
#ifndef BENCH_OTG_RANDOM_H
#define BENCH_OTG_RANDOM_H

#include <stdint.h>

#include "motion/otg.h"

#define OTG_RANDOM_LENGTH_BITS 10

#define OTG_RANDOM_KIND_LIST(X)                                                \
    X(REST, "rest", 3)                                                         \
    X(MOVING_START, "moving_start", 3)                                         \
    X(FULL_STATE, "full_state", 6)                                             \
    X(ASYMMETRIC, "asymmetric", 3)                                             \
    X(START_VIOLATES, "start_violates", 2)                                     \
    X(TINY, "tiny", 1)                                                         \
    X(LONG, "long", 1)                                                         \
    X(RATIO, "ratio", 1)                                                       \
    X(ROUND, "round", 2)

enum otg_random_kind {
#define OTG_RANDOM_KIND_ENUM(name, text, share) OTG_RANDOM_##name,
    OTG_RANDOM_KIND_LIST(OTG_RANDOM_KIND_ENUM)
#undef OTG_RANDOM_KIND_ENUM
        OTG_RANDOM_KINDS
};

const char *otg_random_name(enum otg_random_kind kind);

/* The kind of problem `row` of a set: every run of 22 has them in their
 * shares. */
enum otg_random_kind otg_random_kind(uint32_t row);

/* The next problem; `seed` (not zero) moves on. */
void otg_random_move(uint64_t *seed, enum otg_random_kind kind,
                     struct motion_otg_move *move);

/* One move for several axes that can be brought to arrive together: kinds as
 * above without START_VIOLATES, TINY and LONG. */
void otg_random_moves(uint64_t *seed, uint32_t row, int axes,
                      struct motion_otg_move move[]);

#endif
