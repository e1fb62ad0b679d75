/* sim/physics/matrix.c - see matrix.h. */
#include "sim/physics/matrix.h"

#include <math.h>
#include <stddef.h>

bool sim_cholesky(double *matrix, int n)
{
    for (int i = 0; i < n; i++) {
        double *const row = matrix + (ptrdiff_t)i * n;

        for (int j = 0; j <= i; j++) {
            const double *const other = matrix + (ptrdiff_t)j * n;
            double sum = row[j];
            for (int k = 0; k < j; k++)
                sum -= row[k] * other[k];
            if (i != j)
                row[j] = sum / other[j];
            else if (sum > 0 && isfinite(sum))
                row[i] = sqrt(sum);
            else
                return false;
        }
    }
    return true;
}

/* L x = x, then L' x = x. */
void sim_cholesky_solve(const double *factor, int n, double *x)
{
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++)
            x[i] -= factor[i * n + k] * x[k];
        x[i] /= factor[i * n + i];
    }
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++)
            x[i] -= factor[k * n + i] * x[k];
        x[i] /= factor[i * n + i];
    }
}
