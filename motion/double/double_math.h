/* motion/double/double_math.h - elementary functions in double, the same bits on
 * every machine.
 *
 * Those of C libraries differ in their last bit, so that a plan and a simulation
 * would depend on where they were made: on a PC, in a browser, with which glibc.
 * These use only
 * what IEEE 754 rounds correctly: + - * / and square roots, powers of two,
 * and no multiply-add (-ffp-contract=off).  Errors are relative to the result, a
 * few 2^-53, unless said otherwise; arguments are finite.
 *
 * Source: J.-M. Muller, Elementary Functions (2016), 11.1 for the reductions;
 * the series are Taylor's, cut where a term is below 2^-56. */
#ifndef MOTION_DOUBLE_DOUBLE_MATH_H
#define MOTION_DOUBLE_DOUBLE_MATH_H

#define DOUBLE_PI     3.14159265358979323846
#define DOUBLE_RADIAN 0.017453292519943295769 /* of a degree */

/* Natural, of x > 0. */
double double_log(double x);
/* 0 below -745, infinite above 709. */
double double_exp(double x);
/* x^n, n >= 0. */
double double_power(double x, unsigned n);
double double_cbrt(double x);
/* |x| < 2^20; error 2^-51 absolute. */
double double_sin(double x);
double double_cos(double x);
void double_sincos(double x, double *sine, double *cosine);
double double_atan(double x);
/* -1 .. 1. */
double double_acos(double x);
/* |x| < 1. */
double double_atanh(double x);
/* sinh(k) / k and (cosh(k) - 1) / k^2 with k^2 = z; sin(k) / k and
 * (1 - cos(k)) / k^2 with k^2 = -z where z < 0, down to k = 2^20. */
void double_sinch(double z, double *sinch, double *cosh1);
/* The square root of x^2 + y^2, where neither square is out of range. */
double double_hypot(double x, double y);

#endif
