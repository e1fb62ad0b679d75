/* motion/plan/topp/topp_poly.h - polynomials by the powers of one variable,
 * coefficient 0 first, and what bounds them from 0 to 1.
 *
 * A polynomial is at most the largest of its Bernstein coefficients, and halving
 * the interval brings that nearer by four (Farouki, see topp.h).  Powers above
 * TOPP_POLY_BERNSTEIN are added by their size. */
#ifndef MOTION_PLAN_TOPP_TOPP_POLY_H
#define MOTION_PLAN_TOPP_TOPP_POLY_H

#define TOPP_POLY_MAX       52 /* coefficients */
#define TOPP_POLY_BERNSTEIN 12 /* degree */

/* About x instead of 0. */
void topp_poly_shift(unsigned degree, double coef[], double x);

/* Coefficients of powers over 0 .. 1 to those of Bernstein polynomials. */
void topp_poly_bernstein(unsigned degree, const double c[], double b[]);

/* product += a b, which has a_degree + b_degree + 1 coefficients. */
void topp_poly_add_product(unsigned a_degree, const double a[],
                           unsigned b_degree, const double b[],
                           double product[]);

/* The larger of `most` and an upper bound over 0 .. 1, near to the maximum;
 * degree < TOPP_POLY_MAX. */
double topp_poly_top(unsigned degree, const double c[], double most);

#endif
