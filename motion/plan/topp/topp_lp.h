/* motion/plan/topp/topp_lp.h - linear programs in two or three variables.
 *
 * Maximise c x subject to a x <= b for many rows and low <= x <= high, by
 * Seidel's incremental method: rows are taken one after the other, and one that
 * the best point so far violates is put to equality, which leaves a program in
 * one variable less.  Rows that were violated are taken first from then on; the
 * caller may put those that count in a similar program to the front.
 * Source: R. Seidel, Small-dimensional linear programming and convex hulls made
 * easy, Discrete Comput. Geom. 6 (1991).  Double; no heap. */
#ifndef MOTION_PLAN_TOPP_TOPP_LP_H
#define MOTION_PLAN_TOPP_TOPP_LP_H

#include <stdbool.h>

#define TOPP_LP_ROWS_MAX 768

struct topp_lp_row {
    double a[3], b; /* a x <= b */
    unsigned id;    /* of the caller */
};

/* What is left of a program when one variable was put to what a row says. */
struct topp_lp_part {
    unsigned count;
    struct topp_lp_row row[TOPP_LP_ROWS_MAX + 4];
    double low[2], high[2], c[2];
};

struct topp_lp {
    unsigned count; /* rows */
    struct topp_lp_row row[TOPP_LP_ROWS_MAX];
    double low[3], high[3];
    struct topp_lp_part plane, line; /* for topp_lp_solve */
};

/* The best x for the objective c over `size` variables, 2 or 3; false when no x
 * meets all rows within 2e-8. */
bool topp_lp_solve(struct topp_lp *lp, unsigned size, const double c[3],
                   double x[3]);

#endif
