/* motion/otg_internal.h - between the files of the planner; see otg.h. */
#ifndef MOTION_OTG_INTERNAL_H
#define MOTION_OTG_INTERNAL_H

#include "motion/otg.h"
#include "motion/otg_border.h"
#include "motion/otg_math.h"
#include "motion/otg_solve.h"

/* Not inlined into a caller whose stack other, deeper calls need. */
#define OTG_OWN_FRAME __attribute__((noinline))

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
/* Whether it (or the goal, backwards in time) is inside, with room to let go
 * of its acceleration; true means that there is nothing to brake. */
bool motion_otg_is_start_inside(const struct otg_problem *q);
bool motion_otg_is_goal_inside(const struct otg_problem *q);
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

/* Count lengths such that `jerk` is 1. */
void motion_otg_in_jerk(struct otg_problem *q, struct num jerk);
/* And back: the accelerations of phases [from, count) times jerk. */
void motion_otg_shape_scale(struct otg_shape *shape, int from, struct num jerk);

/* Between otg_solve.c and otg_timed.c, for problems in unit jerk. */
bool motion_otg_is_reached(const struct otg_problem *q, struct num t,
                           struct num miss);
struct otg_lens {
    bool exists;
    struct num valley; /* x is -valley at its late end */
};
struct otg_lens motion_otg_lens_of(const struct otg_problem *q);
/* A border of the lens; returns x at its start. */
struct num motion_otg_lens_border(const struct otg_problem *q, int sign,
                                  struct otg_border *b);
/* Duration of the fastest motion outside the lens (`sign` 0), or of where the
 * displacement is last passed on the border with that sign. */
struct num motion_otg_next_time(const struct otg_problem *q, int sign);

/* Ticks per second. */
struct num motion_otg_per_second(int tick_shift);
/* a * 2^e, to 2^-28. */
struct num motion_otg_wide_num(struct wide a, int32_t e);
/* A duration in seconds. */
struct num motion_otg_seconds(int64_t dur_ns_q12);

/* Position goal: brake both ends inside, solve the middle; t zero for the
 * fastest, else exactly t seconds or MOTION_E_LIMIT and *next. */
int motion_otg_propose(struct otg_problem q, struct num t,
                       struct otg_shape *shape, struct num *next);

/* Backwards in time. */
void motion_otg_reverse(struct otg_problem *q);

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

/* Jerks in a plan's own units of acceleration per tick, and where they hold. */
struct otg_rates {
    struct num j, j2, per_j, per_j2;
    int brake, turn;
};

/* Ticks for the acceleration to move by `step` units in phase i, up. */
int64_t motion_otg_ramp_ticks(const struct otg_rates *rates, int i,
                              int64_t step);

/* What a plan misses, wanted - run, in unit/s, unit, and with a wanted duration
 * in ticks. */
struct otg_miss {
    struct num vel, way;
    int64_t ticks;
    bool is_timed;
};

/* Move the plan, its phases still those of the shape, by one Newton step. */
void motion_otg_polish(struct motion_otg_plan *plan,
                       const struct otg_knobs *knobs,
                       const struct otg_rates *rates,
                       const struct otg_miss *miss);

/* Round `shape` to whole ticks and spread what is left at the end; `ticks` is
 * the total in 2^-12 ns that must result, 0 for any.  MOTION_E_RANGE when it
 * does not fit. */
int motion_otg_quantise(const struct motion_otg_move *move,
                        const struct otg_problem *problem,
                        const struct otg_shape *shape, int64_t dur_ns_q12,
                        struct motion_otg_plan *plan);

/* How long the fastest motion takes, to 2^-27; move->dur_ns_q12 is not looked
 * at.  Errors as motion_otg_make. */
int motion_otg_least(const struct motion_otg_move *move, int64_t *dur_ns_q12,
                     enum motion_otg_field *field);

/* Make a plan of `move` a hair longer, by lengthening its longest phase; it has
 * then passed the check, or the error says that it could not. */
int motion_otg_stretch(const struct motion_otg_move *move, int64_t dur_ns_q12,
                       struct motion_otg_plan *plan);

#endif
