/* motion/otg_internal.h - between the files of the planner; see otg.h. */
#ifndef MOTION_OTG_INTERNAL_H
#define MOTION_OTG_INTERNAL_H

#include "motion/otg.h"
#include "motion/otg_math.h"
#include "motion/otg_solve.h"

/* What one unit of the public formats is in a plan's own units. */
struct otg_units {
    struct real vel;  /* q32 unit/s, in 3 steps / tick */
    struct real acc;  /* q16 unit/s2, in 6 steps / tick^2 */
    struct real jerk; /* q16 unit/s3, in 6 steps / tick^3 */
};

void motion_otg_units(const struct motion_otg_plan *plan,
                      struct otg_units *units);

/* Length of a tick in seconds; 1 / it. */
struct real motion_otg_tick_s(int tick_shift);
struct real motion_otg_ticks_per_s(int tick_shift);

/* n * factor, cut towards zero: 128 bits of product, then shifted.  Rises with
 * n, and never makes it larger; beyond 2^126 it stays there. */
struct wide motion_otg_scaled(int64_t n, struct real factor);

static inline struct wide motion_otg_wide_in(struct motion_otg_wide a)
{
    return (struct wide){ a.hi, a.lo };
}

static inline struct motion_otg_wide motion_otg_wide_out(struct wide a)
{
    return (struct motion_otg_wide){ a.hi, a.lo };
}

/* Bring the start (a, then v) inside the limits; adds 0..2 phases to `shape`
 * and moves v0, a0 and d on. */
void motion_otg_brake(struct otg_problem *q, struct otg_shape *shape);
/* The same for an acceleration alone. */
void motion_otg_brake_acc(struct otg_problem *q, struct otg_shape *shape);

/* By how much limits are drawn in: 2^-vel, 2^-acc, 2^-jerk. */
struct otg_draw {
    int vel, acc, jerk;
};

#define OTG_TRIES 48

/* The i-th try, counted from 0; `wanted` from motion_otg_wanted_bits. */
struct otg_draw motion_otg_draw(int wanted, int i);
int motion_otg_wanted_bits(int64_t dur_ns_q12);

/* The problem in reals, its limits drawn in. */
void motion_otg_problem_init(const struct motion_otg_move *move,
                             struct otg_draw draw, struct otg_problem *q);

/* Position goal: brake both ends inside, solve the middle; t zero for the
 * fastest, else exactly t seconds or MOTION_E_LIMIT and *next. */
int motion_otg_propose(struct otg_problem q, struct real t,
                       struct otg_shape *shape, struct real *next);

/* Turn a problem, and phases [from, count) of its answer that start at a0,
 * backwards in time. */
struct otg_problem motion_otg_reversed(const struct otg_problem *q);
void motion_otg_shape_reverse(struct otg_shape *shape, int from,
                              struct real a0);

/* From start to goal, in steps. */
struct wide motion_otg_way(const struct motion_otg_plan *plan,
                           const struct motion_otg_move *move);

/* Highest and lowest speed: the limits, or beyond them what a move cannot do
 * without because of where it starts or ends. */
struct otg_range {
    struct real vx, vn;
};
void motion_otg_allowed(const struct motion_otg_move *move, int64_t dur_ns_q12,
                        struct otg_range *range);

/* Round `shape` to whole ticks and spread what is left at the end; `ticks` is
 * the total in 2^-12 ns that must result, 0 for any.  MOTION_E_RANGE when it
 * does not fit. */
int motion_otg_quantise(const struct motion_otg_move *move,
                        const struct otg_problem *problem,
                        const struct otg_shape *shape, int64_t dur_ns_q12,
                        struct motion_otg_plan *plan);

/* Make a plan of `move` a hair longer, by lengthening its longest phase; it has
 * then passed the check, or the error says that it could not. */
int motion_otg_stretch(const struct motion_otg_move *move, int64_t dur_ns_q12,
                       struct motion_otg_plan *plan);

#endif
