/* tests/bench/otg_random.h - problems for the planner, from a seed.
 *
 * Kinds, shares and ranges follow the usual families of point-to-point
 * problems; a length of 1 there is 2^10 units here, so that the smallest moves
 * (1e-6) still have 22 bits.  Integers only: the same problems on a PC and on
 * a microcontroller.  Every start but those of START_VIOLATES and every goal
 * is one that a motion inside the limits can have. */
#ifndef TESTS_BENCH_OTG_RANDOM_H
#define TESTS_BENCH_OTG_RANDOM_H

#include <stdint.h>

#include "motion/otg/otg.h"

#define OTG_RANDOM_LENGTH_BITS 10

/* The shares of the categories of the reference vectors for one axis: a hundred
 * of otg_position.csv, and ten each for otg_boundary.csv (a limit is touched
 * for an instant, or nearly) and otg_round.csv. */
#define OTG_RANDOM_KIND_LIST(X)                                                \
    X(REST, "rest", 15)                                                        \
    X(MOVING_START, "moving_start", 15)                                        \
    X(FULL_STATE, "full_state", 28)                                            \
    X(ASYMMETRIC, "asymmetric", 15)                                            \
    X(START_VIOLATES, "start_violates", 10)                                    \
    X(TINY, "tiny", 5)                                                         \
    X(LONG, "long", 5)                                                         \
    X(RATIO, "ratio", 7)                                                       \
    X(BOUNDARY, "boundary", 10)                                                \
    X(ROUND, "round", 10)

#define OTG_RANDOM_CYCLE 120 /* their sum */

enum otg_random_kind {
#define OTG_RANDOM_KIND_ENUM(name, text, share) OTG_RANDOM_##name,
    OTG_RANDOM_KIND_LIST(OTG_RANDOM_KIND_ENUM)
#undef OTG_RANDOM_KIND_ENUM
        OTG_RANDOM_KINDS
};

const char *otg_random_name(enum otg_random_kind kind);

/* The kind of problem `row` of a set: every run of OTG_RANDOM_CYCLE has them in
 * their shares, a shorter one nearly. */
enum otg_random_kind otg_random_kind(uint32_t row);

/* The next problem; `seed` (not zero) moves on. */
void otg_random_move(uint64_t *seed, enum otg_random_kind kind,
                     struct motion_otg_move *move);

/* One move for several axes that can be brought to arrive together; of 20 rows
 * 4 rest, 4 moving_start, 6 full_state, 3 asymmetric, and 3 with a kind of its
 * own for every axis, as in otg_sync3.csv. */
void otg_random_moves(uint64_t *seed, uint32_t row, int axes,
                      struct motion_otg_move move[]);

#endif
