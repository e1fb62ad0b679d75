/* motion/double/double_math.c - see double_math.h. */
#include "motion/double/double_math.h"

#include <math.h>
#include <stdbool.h>

/* In two parts: a multiple of the first by up to 2^20 is exact. */
#define LN2_HIGH 0x1.62e42feep-1
#define LN2_LOW  0x1.a39ef35793c76p-33
/* A quarter turn, in three. */
#define QUARTER_HIGH 0x1.921fb544p+0
#define QUARTER_MID  0x1.0b4611a6p-34
#define QUARTER_LOW  0x1.3198a2e037073p-69

/* 2 atanh(s), |s| <= 0.1716: the last term is s^23 / 23. */
static double math_atanh_twice(double s)
{
    const double z = s * s;
    double sum = 1. / 23;

    for (int n = 21; n >= 1; n -= 2)
        sum = 1. / n + z * sum;
    return 2 * s * sum;
}

/* x = 2^e m with m next to 1, and ln m = 2 atanh((m - 1) / (m + 1)). */
double double_log(double x)
{
    int e;
    double m = frexp(x, &e);

    if (m < 0x1.6a09e667f3bcdp-1) {
        m *= 2;
        e--;
    }
    return e * LN2_HIGH + (e * LN2_LOW + math_atanh_twice((m - 1) / (m + 1)));
}

double double_exp(double x)
{
    if (x < -745)
        return 0;
    if (x > 709)
        return INFINITY;
    const double n = floor(x / (LN2_HIGH + LN2_LOW) + 0.5);
    const double r = (x - n * LN2_HIGH) - n * LN2_LOW;
    double sum = 1;

    for (int k = 14; k >= 1; k--)
        sum = 1 + r * sum / k;
    return ldexp(sum, (int)n);
}

double double_power(double x, unsigned n)
{
    double power = 1;

    for (; n > 0; n >>= 1) {
        if (n & 1)
            power *= x;
        x *= x;
    }
    return power;
}

/* Newton's method from within 10 %: the error is squared each time. */
double double_cbrt(double x)
{
    int e;
    double m = frexp(fabs(x), &e);

    if (m == 0)
        return x;
    for (; e % 3 != 0; e++)
        m /= 2; /* 1/8 .. 1 */
    double y = 0.45 + m * (0.95 - 0.4 * m);
    for (int i = 0; i < 5; i++)
        y -= (y - m / (y * y)) / 3;
    return ldexp(x < 0 ? -y : y, e / 3);
}

/* Both of r, |r| <= pi / 4. */
static void math_sincos_small(double r, double *s, double *c)
{
    const double z = r * r;
    double sine = 1, cosine = 1;

    for (int n = 18; n >= 2; n -= 2) {
        sine = 1 - z * sine / (n * (n + 1));
        cosine = 1 - z * cosine / (n * (n - 1));
    }
    *s = r * sine;
    *c = cosine;
}

void double_sincos(double x, double *s, double *c)
{
    const double n = floor(x / QUARTER_HIGH + 0.5);
    double sine, cosine;

    math_sincos_small(((x - n * QUARTER_HIGH) - n * QUARTER_MID) -
                          n * QUARTER_LOW,
                      &sine, &cosine);
    const double quarter = n - 4 * floor(n / 4); /* 0 .. 3 */
    const bool odd = quarter == 1 || quarter == 3;
    *s = odd ? cosine : sine;
    *c = odd ? sine : cosine;
    if (quarter >= 2)
        *s = -*s;
    if (quarter == 1 || quarter == 2)
        *c = -*c;
}

double double_sin(double x)
{
    double s, c;

    double_sincos(x, &s, &c);
    return s;
}

double double_cos(double x)
{
    double s, c;

    double_sincos(x, &s, &c);
    return c;
}

/* Halved twice, atan(x) = 2 atan(x / (1 + sqrt(1 + x^2))), it is at most 0.199:
 * the last term is x^23 / 23. */
double double_atan(double x)
{
    const double size = fabs(x);
    double y = size > 1 ? 1 / size : size;

    for (int i = 0; i < 2; i++)
        y /= 1 + sqrt(1 + y * y);
    const double z = y * y;
    double sum = 1. / 23;
    for (int n = 21; n >= 1; n -= 2)
        sum = 1. / n - z * sum;
    sum *= 4 * y;
    if (size > 1)
        sum = DOUBLE_PI / 2 - sum;
    return x < 0 ? -sum : sum;
}

/* tan(a / 2) = sqrt((1 - cos a) / (1 + cos a)) */
double double_acos(double x)
{
    return x > -1 ? 2 * double_atan(sqrt((1 - x) / (1 + x))) : DOUBLE_PI;
}

double double_atanh(double x)
{
    return fabs(x) <= 0.1715 ? math_atanh_twice(x) / 2
                             : double_log((1 + x) / (1 - x)) / 2;
}

/* By their series up to |z| = 1, where the last term is 1 / 19!. */
void double_sinch(double z, double *sinch, double *cosh1)
{
    if (fabs(z) <= 1) {
        double s = 1, c = 1;
        for (int n = 18; n >= 2; n -= 2) {
            s = 1 + z * s / (n * (n + 1));
            c = 1 + z * c / ((n + 1) * (n + 2));
        }
        *sinch = s;
        *cosh1 = c / 2;
        return;
    }
    const double k = sqrt(fabs(z));
    double s, c, half;
    if (z > 0) {
        const double e = double_exp(k / 2);
        half = (e - 1 / e) / 2;
        s = (e * e - 1 / (e * e)) / 2;
    } else {
        double_sincos(k, &s, &c);
        half = double_sin(k / 2);
    }
    *sinch = s / k;
    *cosh1 = 2 * half * half / fabs(z);
}

double double_hypot(double x, double y)
{
    return sqrt(x * x + y * y);
}
