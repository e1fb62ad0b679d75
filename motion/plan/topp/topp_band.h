/* motion/plan/topp/topp_band.h - a symmetric system with five diagonals, by
 * Cholesky's L D L'.  Source: Golub & Van Loan, Matrix Computations (2013), 4.3.
 * Off-line: double. */
#ifndef MOTION_PLAN_TOPP_TOPP_BAND_H
#define MOTION_PLAN_TOPP_TOPP_BAND_H

#include <stdbool.h>
#include <stdint.h>

/* m x = -gradient, n of them; m[i][k] is row i, column i - k, and is lost.  False
 * when the matrix is not positive. */
bool topp_band_solve(uint32_t n, double (*m)[3], const double gradient[],
                     double x[]);

#endif
