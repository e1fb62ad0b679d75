/* tests/otg_oracle_parts.h - between the files of the oracle; see otg_oracle.h.
 *
 * A tick is 2^(tick_shift - 21) / 5^9 s, a step 2^-pos_shift unit, so that
 *
 *   dP/dt   5^9  2^-(pos_shift +   tick_shift - 53)  is in 2^-32 unit/s
 *   d2P/dt2 5^18 2^-(pos_shift + 2 tick_shift - 58)  is in 2^-16 unit/s2
 *   d3P/dt3 5^27 2^-(pos_shift + 3 tick_shift - 79)  is in 2^-16 unit/s3
 *
 * In a phase of n ticks, with x from 0 to 1 and y = t0 + n x,
 *
 *   N^5 P       = N^5 (P0 + 3 V n x + 3 A n^2 x^2 + (A' - A) n^2 x^3)
 *                 + e3 N^2 y^3 + e4 N y^4 + e5 y^5
 *   N^5 dP/dt   = N^5 (3 V + 6 A n x + 3 (A' - A) n x^2)
 *                 + 3 e3 N^2 y^2 + 4 e4 N y^3 + 5 e5 y^4
 *   N^5 d2P/dt2 = N^5 (6 A + 6 (A' - A) x)
 *                 + 6 e3 N^2 y + 12 e4 N y^2 + 20 e5 y^3
 *   N^5 d3P/dt3 = N^5 6 (A' - A) / n + 6 e3 N^2 + 24 e4 N y + 60 e5 y^2 */
#ifndef TESTS_OTG_ORACLE_PARTS_H
#define TESTS_OTG_ORACLE_PARTS_H

#include "tests/big.h"
#include "tests/otg_oracle.h"

enum oracle_order { ORACLE_POS, ORACLE_VEL, ORACLE_ACC, ORACLE_JERK };

/* num / den in the public format; den > 0. */
struct oracle_bound {
    struct big num, den;
};

struct oracle {
    const struct motion_otg_move *move;
    const struct motion_otg_plan *plan;
    struct big total[6]; /* N^k */
    struct big bend[3];  /* e3 N^2, e4 N, e5 */
    struct big five[4];  /* 5^(9 k) */
    /* the phase */
    int i;
    int64_t t0, n, a, to;
    struct big pos, vel;
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

/* What P / x^k is multiplied by to be in the public format: 5^(9 order) times
 * 2^-scale. */
int oracle_scale(const struct motion_otg_plan *plan, enum oracle_order order);

/* The polynomials above; the jerk's is times n. */
void oracle_poly(const struct oracle *g, enum oracle_order order,
                 struct big_poly *f);

void oracle_bound_of(struct oracle_bound *b, int64_t value);
/* The bound on the velocity in this phase. */
void oracle_vel_bound(const struct oracle *g, int up, struct oracle_bound *b);
/* The jerk that brings the move to its end. */
int64_t oracle_closing_jerk(const struct motion_otg_limit *limit);

void oracle_wide(struct big *to, struct motion_otg_wide a);

/* Find out what start and goal make unavoidable. */
void oracle_open(struct oracle *g);

#endif
