/* tests/motion/otg/otg_oracle_parts.h - between the files of the oracle; see
 * otg_oracle.h.
 *
 * In a phase of n times 2^-12 ns from P, V, A to A', with x from 0 to 1,
 *
 *   position       P + 3 V n x + 3 A n^2 x^2 + (A' - A) n^2 x^3
 *   velocity       V + 2 A n x + (A' - A) n x^2
 *   acceleration   A + (A' - A) x
 *   jerk           (A' - A) / n
 *
 * in the units of motion/otg/otg.h, b = acc_bits; where that is below 53,
 * accelerations are lifted to it first, so that all below are whole numbers.  A
 * second is 2^21 5^9 times 2^-12 ns; so in the public formats one is
 *
 *   2^-32 unit      2^(11 + b) 3 5^18 of P
 *   2^-32 unit/s    2^(b - 10) 5^9 of V
 *   2^-32 unit/s2   2^(b - 32) of A
 *   2^-32 unit/s3   2^(b - 53) / 5^9 of A per 2^-12 ns */
#ifndef TESTS_MOTION_OTG_OTG_ORACLE_PARTS_H
#define TESTS_MOTION_OTG_OTG_ORACLE_PARTS_H

#include "tests/motion/otg/otg_oracle.h"
#include "tests/support/big.h"

enum oracle_order { ORACLE_POS, ORACLE_VEL, ORACLE_ACC, ORACLE_JERK };

/* num / den in the public format; den > 0. */
struct oracle_bound {
    struct big num, den;
};

struct oracle {
    const struct motion_otg_move *move;
    const struct motion_otg_plan *plan;
    struct big unit[4]; /* as above; the jerk's times 5^9 */
    unsigned lift;
    /* the phase */
    int i;
    int64_t t0, n, a, to; /* t0 in 2^-12 ns from the start of the move */
    struct big pos, vel;
    /* What the accelerations' last unit leaves of the velocity at the goal: it
     * is no part of the motion, which from the last trimmed corner on is the
     * one that ends there. */
    struct big rest;
    int first_trim, last_trim;
    /* Velocity above ([1]) and below ([0]) may be as far out as `peak`: since
     * the start while `outside`, and from phase `late` on. */
    bool outside[2];
    int let_go[2], late[2];
    struct oracle_bound peak[2];
};

/* Of phase 0; oracle_step goes to the next, oracle_phase reads it. */
void oracle_init(struct oracle *g, const struct motion_otg_move *move,
                 const struct motion_otg_plan *plan);
void oracle_phase(struct oracle *g);
void oracle_step(struct oracle *g);

/* What the last unit of the trimmed corners makes, W of motion/otg/otg.h: V at
 * most this, P at most this times 3 and the duration. */
void oracle_trim(const struct oracle *g, struct big *weight);

/* The polynomials above; the jerk's is times n 5^9. */
void oracle_poly(const struct oracle *g, enum oracle_order order,
                 struct big_poly *f);

void oracle_bound_of(struct oracle_bound *b, int64_t value);
/* The bound on the velocity in this phase. */
void oracle_vel_bound(const struct oracle *g, int up, struct oracle_bound *b);
/* An acceleration of the plan, lifted. */
void oracle_acc(const struct oracle *g, struct big *to, int64_t acc);
/* The jerk that brings the move to its end. */
int64_t oracle_closing_jerk(const struct motion_otg_limit *limit);

/* The first of the last phases in which the acceleration, turned by `sign`, is
 * below zero. */
int oracle_late(const struct motion_otg_plan *plan, int sign);

/* Find out what start and goal make unavoidable. */
void oracle_open(struct oracle *g);

#endif
