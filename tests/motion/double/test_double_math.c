/* tests/motion/plan/test_double_math.c - elementary functions, beside those of the
 * C library in long double. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "motion/double/double_math.h"

#define STEPS 20011

/* Of `want`, in 2^-53. */
static void near(const char *what, double x, double got, long double want,
                 double most)
{
    const double off = (double)(fabsl(got - want) / fabsl(want) * 0x1p53L);

    if (!(got == want || off <= most))
        fail_msg("%s(%a): %a is off by %.2f", what, x, got, off);
}

static double log_between(double low, double high, int i)
{
    return exp(log(low) + (log(high) - log(low)) * i / STEPS);
}

static void logarithms_and_powers(void **state)
{
    (void)state;
    for (int i = 0; i <= STEPS; i++) {
        const double x = log_between(1e-300, 1e300, i);
        const double y = 0.5 + 1.5 * i / STEPS, z = -700 + 1400. * i / STEPS;
        near("log", x, double_log(x), logl(x), 2.5);
        near("cbrt", x, double_cbrt(x), cbrtl(x), 3);
        near("cbrt", -x, double_cbrt(-x), -cbrtl(x), 3);
        near("log", y, double_log(y), logl(y), 4);
        near("exp", z, double_exp(z), expl(z), 3);
        near("power", y, double_power(y, 5), powl(y, 5), 6);
    }
    assert_true(double_log(1) == 0 && double_cbrt(0) == 0);
    assert_true(double_exp(0) == 1 && double_exp(-1e9) == 0);
    assert_true(isinf(double_exp(1e9)) && double_power(3, 0) == 1);
}

static void angles(void **state)
{
    (void)state;
    for (int i = 0; i <= STEPS; i++) {
        const double x = log_between(1e-6, 1e6, i);
        const double u = -1 + 2. * i / STEPS;
        near("atan", x, double_atan(x), atanl(x), 6);
        near("atan", -x, double_atan(-x), -atanl(x), 6);
        near("acos", u, double_acos(u), acosl(u), 8);
        if (fabs(double_sin(x) - (double)sinl(x)) > 0x1p-51 ||
            fabs(double_cos(-x) - (double)cosl(x)) > 0x1p-51)
            fail_msg("sine or cosine of %a", x);
        if (i > 0 && i < STEPS)
            near("atanh", u, double_atanh(u), atanhl(u), 6);
    }
    assert_true(double_atan(0) == 0 && double_sin(0) == 0);
    near("atan", INFINITY, double_atan(INFINITY), acosl(0), 1);
    near("hypot", 3, double_hypot(3, -4), 5, 0);
}

/* What rounding k^2 takes from them grows with k. */
static void cosh_and_cos_divided(void **state)
{
    (void)state;
    for (int i = 0; i <= STEPS; i++) {
        const double z = log_between(1e-9, 1e4, i), k = sqrt(z);
        const long double kl = sqrtl(z), half = sinhl(kl / 2);
        double s, c;
        double_sinch(z, &s, &c);
        near("sinch", z, s, sinhl(kl) / kl, 8 + k);
        near("cosh1", z, c, 2 * half * half / z, 8 + k);
        double_sinch(-z, &s, &c);
        if (fabs(s * k - (double)sinl(kl)) > 0x1p-50 * (1 + k) ||
            fabs(c * z - (double)(1 - cosl(kl))) > 0x1p-50 * (1 + k))
            fail_msg("at %a", -z);
    }
}

/* What a machine with other rounding or another C library would not give. */
static void the_bits_are_these(void **state)
{
    uint64_t sum = 0;

    (void)state;
    for (int i = 1; i <= 1000; i++) {
        const double x = i / 512.;
        const double all[] = { double_log(x),      double_exp(x),
                               double_cbrt(x),     double_sin(x),
                               double_cos(x),      double_atan(x),
                               double_atanh(x / 2) };
        for (unsigned k = 0; k < sizeof all / sizeof *all; k++) {
            uint64_t bits;
            memcpy(&bits, &all[k], sizeof bits);
            sum = (sum ^ bits) * 0x9E3779B97F4A7C15u;
            sum ^= sum >> 29;
        }
    }
    if (sum != UINT64_C(0x74ea5e96c7de10ef))
        fail_msg("%016llx", (unsigned long long)sum);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(logarithms_and_powers),
        cmocka_unit_test(angles),
        cmocka_unit_test(cosh_and_cos_divided),
        cmocka_unit_test(the_bits_are_these),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
