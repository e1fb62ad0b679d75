/* tests/motion/plan/topp/test_topp_poly.c - bounds of polynomials are above them
 * everywhere and near to their maximum. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "motion/plan/topp/topp_poly.h"

#define POINTS 4000

static double value(unsigned degree, const double c[], double x)
{
    double sum = 0;

    for (unsigned n = degree + 1; n-- > 0;)
        sum = sum * x + c[n];
    return sum;
}

/* The largest of 4001 values; between them it may be this much larger. */
static double sampled(unsigned degree, const double c[], double *between)
{
    double most = -INFINITY, bend = 0;

    for (int i = 0; i <= POINTS; i++)
        most = fmax(most, value(degree, c, (double)i / POINTS));
    for (unsigned n = 2; n <= degree; n++)
        bend += fabs(c[n]) * n * (n - 1);
    *between = bend / (8. * POINTS * POINTS);
    return most;
}

static double random_unit(uint64_t *seed) /* -1 .. 1 */
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (double)(int32_t)(*seed >> 32) / 2147483648.;
}

static void a_bound_is_above_and_near(void **state)
{
    uint64_t seed = 5;

    (void)state;
    for (unsigned i = 0; i < 2000; i++) {
        const unsigned degree = i % (TOPP_POLY_MAX - 1);
        /* What is above degree 12 is as small as on a fine grid. */
        double c[TOPP_POLY_MAX], between, by = 1;
        for (unsigned n = 0; n <= degree; n++, by *= n > 6 ? 0.02 : 1)
            c[n] = by * random_unit(&seed);
        c[0] += i % 2 ? 3 : 0;
        const double want = sampled(degree, c, &between);
        const double got = topp_poly_top(degree, c, -100);
        if (!(got >= want - 1e-14 &&
              got <= want + between + 1e-7 * (1 + fabs(want))))
            fail_msg("%u: %.12g, sampled %.12g and %.2g", i, got, want,
                     between);
        assert_true(topp_poly_top(degree, c, want + 1) == want + 1);
    }
}

/* Half a thousandth wide. */
static void a_narrow_peak_is_seen(void **state)
{
    /* 1 - 1e6 (x - 1/16)^2 */
    const double c[3] = { 1 - 1e6 / 256, 1e6 / 8, -1e6 };
    const double got = topp_poly_top(2, c, 0);

    (void)state;
    assert_true(got >= 1 && got <= 1 + 1e-3);
}

static void bernstein_ends_are_values_and_shifts_agree(void **state)
{
    double c[4] = { 1, -2, 3, 0.5 }, b[4];

    (void)state;
    topp_poly_bernstein(3, c, b);
    assert_true(b[0] == 1 && fabs(b[3] - 2.5) < 1e-15);
    assert_true(fabs(b[1] - (1 - 2. / 3)) < 1e-15);
    const double at = value(3, c, 0.7);
    topp_poly_shift(3, c, 0.3);
    assert_true(fabs(value(3, c, 0.4) - at) < 1e-15);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_bound_is_above_and_near),
        cmocka_unit_test(a_narrow_peak_is_seen),
        cmocka_unit_test(bernstein_ends_are_values_and_shifts_agree),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
