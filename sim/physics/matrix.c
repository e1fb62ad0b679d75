/* sim/physics/matrix.c - see matrix.h. */
#include "sim/physics/matrix.h"

#include <float.h>
#include <math.h>
#include <stddef.h>

#define SWEEPS_MAX 60
#define TWO_PI     6.283185307179586

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

/* x of L x = x. */
static void sim_forward(const double *factor, int n, double *x, int stride)
{
    for (int i = 0; i < n; i++) {
        for (int k = 0; k < i; k++)
            x[(ptrdiff_t)i * stride] -=
                factor[i * n + k] * x[(ptrdiff_t)k * stride];
        x[(ptrdiff_t)i * stride] /= factor[i * n + i];
    }
}

/* x of L' x = x. */
static void sim_backward(const double *factor, int n, double *x)
{
    for (int i = n - 1; i >= 0; i--) {
        for (int k = i + 1; k < n; k++)
            x[i] -= factor[k * n + i] * x[k];
        x[i] /= factor[i * n + i];
    }
}

void sim_cholesky_solve(const double *factor, int n, double *x)
{
    sim_forward(factor, n, x, 1);
    sim_backward(factor, n, x);
}

/* Turn rows and columns p and q so that [p][q] becomes 0; the same turn on the
 * rows of vectors. */
static void sim_jacobi_turn(double *matrix, int n, int p, int q,
                            double *vectors)
{
    const double theta =
        (matrix[q * n + q] - matrix[p * n + p]) / (2 * matrix[p * n + q]);
    const double tangent =
        (theta >= 0 ? 1 : -1) / (fabs(theta) + sqrt(theta * theta + 1));
    const double cosine = 1 / sqrt(tangent * tangent + 1);
    const double sine = tangent * cosine;

    for (int k = 0; k < n; k++) {
        const double a = matrix[k * n + p], b = matrix[k * n + q];
        matrix[k * n + p] = cosine * a - sine * b;
        matrix[k * n + q] = sine * a + cosine * b;
    }
    for (int k = 0; k < n; k++) {
        const double a = matrix[p * n + k], b = matrix[q * n + k];
        const double u = vectors[p * n + k], v = vectors[q * n + k];
        matrix[p * n + k] = cosine * a - sine * b;
        matrix[q * n + k] = sine * a + cosine * b;
        vectors[p * n + k] = cosine * u - sine * v;
        vectors[q * n + k] = sine * u + cosine * v;
    }
}

static bool sim_jacobi(double *matrix, int n, double *vectors)
{
    double scale = 0;

    for (int i = 0; i < n * n; i++) {
        vectors[i] = i % (n + 1) == 0 ? 1 : 0;
        scale = fmax(scale, fabs(matrix[i]));
    }
    for (int sweep = 0; sweep < SWEEPS_MAX; sweep++) {
        bool turned = false;
        for (int p = 0; p < n; p++) {
            for (int q = p + 1; q < n; q++) {
                if (fabs(matrix[p * n + q]) <= scale * DBL_EPSILON / 16)
                    continue;
                sim_jacobi_turn(matrix, n, p, q, vectors);
                turned = true;
            }
        }
        if (!turned)
            return true;
    }
    return false;
}

static void sim_modes_swap(double *frequency_hz, double *shapes, int n, int i,
                           int j)
{
    const double frequency = frequency_hz[i];

    frequency_hz[i] = frequency_hz[j];
    frequency_hz[j] = frequency;
    for (int k = 0; k < n; k++) {
        const double value = shapes[i * n + k];
        shapes[i * n + k] = shapes[j * n + k];
        shapes[j * n + k] = value;
    }
}

static void sim_modes_scale(double *shape, int n)
{
    double largest = 0;

    for (int k = 0; k < n; k++)
        largest = fmax(largest, fabs(shape[k]));
    for (int k = 0; k < n; k++)
        shape[k] /= largest;
}

bool sim_modes(double *mass, double *stiffness, int n, double *frequency_hz,
               double *shapes)
{
    double largest = 0;

    if (!sim_cholesky(mass, n))
        return false;
    /* L^-1 K L^-T: the columns, then the rows. */
    for (int k = 0; k < n; k++)
        sim_forward(mass, n, stiffness + k, n);
    for (int k = 0; k < n; k++)
        sim_forward(mass, n, stiffness + (ptrdiff_t)k * n, 1);
    if (!sim_jacobi(stiffness, n, shapes))
        return false;
    for (int i = 0; i < n; i++)
        largest = fmax(largest, stiffness[i * n + i]);
    for (int i = 0; i < n; i++) {
        const double square = stiffness[i * n + i];
        frequency_hz[i] = square > largest * 1e-12 ? sqrt(square) / TWO_PI : 0;
        sim_backward(mass, n, shapes + (ptrdiff_t)i * n);
        sim_modes_scale(shapes + (ptrdiff_t)i * n, n);
        for (int j = i; j > 0 && frequency_hz[j - 1] > frequency_hz[j]; j--)
            sim_modes_swap(frequency_hz, shapes, n, j - 1, j);
    }
    return true;
}
