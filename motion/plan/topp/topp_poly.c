/* motion/plan/topp/topp_poly.c - see topp_poly.h. */
#include "motion/plan/topp/topp_poly.h"

#include <math.h>

/* A bound that is so near to a value that is taken is not improved on; so often
 * is an interval halved at most. */
#define POLY_NEAR     1e-8
#define POLY_HALVINGS 16

void topp_poly_shift(unsigned degree, double coef[], double x)
{
    for (unsigned i = 0; i < degree; i++)
        for (unsigned n = degree; n-- > i;)
            coef[n] += x * coef[n + 1];
}

/* b_i = sum over k <= i of binomial(i, k) / binomial(n, k) c_k. */
void topp_poly_bernstein(unsigned degree, const double c[], double b[])
{
    for (unsigned i = 0; i <= degree; i++) {
        double by = 1;
        b[i] = 0;
        for (unsigned k = 0; k <= i; k++) {
            b[i] += by * c[k];
            if (k < i)
                by *= (double)(i - k) / (degree - k);
        }
    }
}

void topp_poly_add_product(unsigned a_degree, const double a[],
                           unsigned b_degree, const double b[],
                           double product[])
{
    for (unsigned i = 0; i <= a_degree; i++)
        for (unsigned k = 0; k <= b_degree; k++)
            product[i + k] += a[i] * b[k];
}

/* Halves by de Casteljau: `b` becomes the second. */
static void poly_halve(unsigned degree, double b[], double first[])
{
    for (unsigned i = 0; i <= degree; i++) {
        first[i] = b[0];
        for (unsigned k = 0; k + i < degree; k++)
            b[k] = (b[k] + b[k + 1]) / 2;
    }
}

/* The parts that are not yet bounded wait on a stack, the last half of each
 * halving; its depth is that of the halvings. */
static double poly_climb(unsigned degree, const double b[], double most)
{
    double part[POLY_HALVINGS + 1][TOPP_POLY_BERNSTEIN + 1];
    unsigned depth[POLY_HALVINGS + 1] = { 0 }, count = 1;

    for (unsigned i = 0; i <= degree; i++)
        part[0][i] = b[i];
    while (count > 0) {
        double *now = part[count - 1], top = now[0];
        const unsigned at = depth[count - 1];
        const double taken = fmax(most, fmax(now[0], now[degree]));
        for (unsigned i = 1; i <= degree; i++)
            top = fmax(top, now[i]);
        if (top <= most) {
            count--;
        } else if (top <= taken + POLY_NEAR * fabs(taken) ||
                   at == POLY_HALVINGS) {
            most = top;
            count--;
        } else {
            poly_halve(degree, now, part[count]);
            depth[count - 1] = depth[count] = at + 1;
            count++;
        }
    }
    return most;
}

double topp_poly_top(unsigned degree, const double c[], double most)
{
    const unsigned kept =
        degree < TOPP_POLY_BERNSTEIN ? degree : TOPP_POLY_BERNSTEIN;
    double b[TOPP_POLY_BERNSTEIN + 1], rest = 0;

    for (unsigned n = kept + 1; n <= degree; n++)
        rest += fabs(c[n]);
    topp_poly_bernstein(kept, c, b);
    for (unsigned i = 0; i <= kept; i++)
        b[i] += rest;
    return poly_climb(kept, b, most);
}
