/* sim/physics/matrix.h - small symmetric matrices: Cholesky factors and
 * vibration modes.  Matrices are dense, n x n, row after row.  Source: Golub &
 * Van Loan, Matrix Computations, 4th ed. (2013): 4.2.5 (Cholesky), 8.5.2
 * (Jacobi), 8.7.2 (the symmetric-definite problem). */
#ifndef SIM_PHYSICS_MATRIX_H
#define SIM_PHYSICS_MATRIX_H

#include <stdbool.h>

/* The lower factor in the place of the lower triangle (what is above stays).
 * False when the matrix is not positive definite. */
bool sim_cholesky(double *matrix, int n);

/* x of L L' x = x, with the factor of sim_cholesky. */
void sim_cholesky_solve(const double *factor, int n, double *x);

/* Modes of mass x'' + stiffness x = 0, lowest first: frequency[i] in Hz (0 for
 * a motion without stiffness) and the shape in row i of shapes, largest value
 * 1 in size.  Both matrices are spoilt.  False when mass is not positive
 * definite or the iteration does not end. */
bool sim_modes(double *mass, double *stiffness, int n, double *frequency_hz,
               double *shapes);

#endif
