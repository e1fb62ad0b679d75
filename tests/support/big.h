/* tests/support/big.h - whole numbers of any size a test needs, and polynomials
 * in them: what a judge computes with when nothing may be rounded. */
#ifndef TESTS_SUPPORT_BIG_H
#define TESTS_SUPPORT_BIG_H

#include <stdbool.h>
#include <stdint.h>

#define BIG_LIMBS 1021 /* 65,000 bits; a test that needs more is stopped */

struct big {
    int sign; /* -1, 0, 1 */
    int count;
    uint64_t limb[BIG_LIMBS]; /* the lowest first; the highest is not zero */
};

void big_set(struct big *to, int64_t value);
/* Two's complement of 128 bits. */
void big_set_wide(struct big *to, uint64_t high, uint64_t low);
void big_copy(struct big *to, const struct big *a);
/* `to` may be one of the operands. */
void big_add(struct big *to, const struct big *a, const struct big *b);
void big_sub(struct big *to, const struct big *a, const struct big *b);
void big_mul(struct big *to, const struct big *a, const struct big *b);
void big_mul_int(struct big *to, const struct big *a, int64_t b);
void big_shl(struct big *to, const struct big *a, unsigned bits);
int big_cmp(const struct big *a, const struct big *b);

#define BIG_DEGREE 10

struct big_poly {
    int degree; /* the coefficient of x^degree may be zero */
    struct big c[BIG_DEGREE + 1];
};

/* Is f(x) >= 0 for every x from 0 to 1, the border included?  Halves the
 * interval until Bernstein coefficients tell (a polynomial lies within their
 * hull); where f comes as close to zero as halving cannot tell, counts the
 * roots of f' at which f is negative by Sturm sequences (Tarski's queries;
 * Basu, Pollack & Roy, Algorithms in Real Algebraic Geometry, 2.2), which
 * decides every case.  Degree 5 at most. */
bool big_poly_is_not_negative(const struct big_poly *f);

/* How often the Sturm sequences were needed. */
extern long big_poly_counted;

#endif
