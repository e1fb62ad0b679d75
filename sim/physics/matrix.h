/* sim/physics/matrix.h - the Cholesky factor of a small symmetric matrix: dense,
 * n x n, row after row.  Source: Golub & Van Loan, Matrix Computations, 4th ed.
 * (2013), 4.2.5. */
#ifndef SIM_PHYSICS_MATRIX_H
#define SIM_PHYSICS_MATRIX_H

#include <stdbool.h>

/* The lower factor in the place of the lower triangle (what is above stays).
 * False when the matrix is not positive definite. */
bool sim_cholesky(double *matrix, int n);

/* x of L L' x = x, with the factor of sim_cholesky. */
void sim_cholesky_solve(const double *factor, int n, double *x);

#endif
