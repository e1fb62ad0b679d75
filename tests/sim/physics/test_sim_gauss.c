/* tests/sim/physics/test_sim_gauss.c - order, invariants, refusals; Cholesky
 * and modes. */
#include "sim/physics/gauss.h"

#include "sim/physics/matrix.h"
#include "tests/sim/physics/physics_random.h"

static void swing(void *plant, double t_s, const double *y, double *rate)
{
    (void)plant;
    (void)t_s;
    rate[0] = y[1];
    rate[1] = -sin(y[0]);
}

static void spring(void *plant, double t_s, const double *y, double *rate)
{
    const double *const square = plant;

    (void)t_s;
    rate[0] = y[1];
    rate[1] = -*square * y[0];
}

static double end_of_swing(int steps)
{
    struct sim_gauss gauss;
    double work[SIM_GAUSS_WORK(2)], y[2] = { 1, 0 };

    sim_gauss_init(&gauss, 2, swing, NULL, work);
    for (int i = 0; i < steps; i++)
        assert_true(sim_gauss_step(&gauss, 0, 4.0 / steps, y));
    return y[0];
}

static void it_is_of_order_four(void **state)
{
    const double exact = end_of_swing(4000);
    const double coarse = fabs(end_of_swing(20) - exact);
    const double fine = fabs(end_of_swing(40) - exact);

    (void)state;
    physics_near("order", log2(coarse / fine), 4, 0.1);
}

static void a_spring_keeps_its_energy_over_a_million_steps(void **state)
{
    double square = physics_random(100, 90000);
    struct sim_gauss gauss;
    double work[SIM_GAUSS_WORK(2)], y[2] = { 0.1, 1 };
    const double start = y[1] * y[1] + square * y[0] * y[0];

    (void)state;
    sim_gauss_init(&gauss, 2, spring, &square, work);
    for (int i = 0; i < 1000000; i++) {
        assert_true(sim_gauss_step(&gauss, 0, 1e-3, y));
        physics_near("energy", y[1] * y[1] + square * y[0] * y[0], start,
                     1e-9 * start);
    }
}

static void a_step_that_is_too_long_is_refused(void **state)
{
    double square = 1e8;
    struct sim_gauss gauss;
    double work[SIM_GAUSS_WORK(2)], y[2] = { 1, 0 };

    (void)state;
    sim_gauss_init(&gauss, 2, spring, &square, work);
    assert_false(sim_gauss_step(&gauss, 0, 1e-2, y));
    assert_true(y[0] == 1 && y[1] == 0);
    y[1] = NAN;
    assert_false(sim_gauss_step(&gauss, 0, 1e-5, y));
}

#define N 7

static void random_definite(double *matrix)
{
    double root[N * N];

    for (int i = 0; i < N * N; i++)
        root[i] = physics_random(-1, 1);
    for (int i = 0; i < N; i++) {
        for (int j = 0; j < N; j++) {
            matrix[i * N + j] = i == j ? 0.5 : 0;
            for (int k = 0; k < N; k++)
                matrix[i * N + j] += root[i * N + k] * root[j * N + k];
        }
    }
}

static void cholesky_solves(void **state)
{
    double matrix[N * N], factor[N * N], x[N], b[N];

    (void)state;
    for (int round = 0; round < 100; round++) {
        random_definite(matrix);
        memcpy(factor, matrix, sizeof factor);
        for (int i = 0; i < N; i++)
            x[i] = b[i] = physics_random(-1, 1);
        assert_true(sim_cholesky(factor, N));
        sim_cholesky_solve(factor, N, x);
        for (int i = 0; i < N; i++) {
            double sum = 0;
            for (int j = 0; j < N; j++)
                sum += matrix[i * N + j] * x[j];
            physics_near("A x", sum, b[i], 1e-12);
        }
    }
    matrix[0] = -1;
    assert_false(sim_cholesky(matrix, N));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_is_of_order_four),
        cmocka_unit_test(a_spring_keeps_its_energy_over_a_million_steps),
        cmocka_unit_test(a_step_that_is_too_long_is_refused),
        cmocka_unit_test(cholesky_solves),
    };

    physics_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
