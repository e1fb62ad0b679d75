/* firmware/host/base/decimal.h - decimal numbers as they are written, scaled to
 * binary fixed point exactly and rounded once, without a double in between. */
#ifndef FIRMWARE_HOST_BASE_DECIMAL_H
#define FIRMWARE_HOST_BASE_DECIMAL_H

#include <stdbool.h>
#include <stdint.h>

/* -mantissa x 10^exp10 or +mantissa x 10^exp10; at most 18 digits. */
struct decimal {
    bool negative;
    uint64_t mantissa; /* < 10^18 */
    int exp10;
};

/* num / den x 10^exp10; num < 2^37 (rev on an axis in rad), den < 2^53
 * (arcsec/min on an axis in rad). */
struct decimal_ratio {
    uint64_t num, den;
    int exp10;
};

bool decimal_is_digit(char letter);

/* [ + | - ] digits [ . digits ] [ e [ + | - ] digits ] at *at, which is set
 * behind it.  NULL, or what is wrong: "is not a number". */
const char *decimal_read(struct decimal *self, const char **at);

/* self x ratio x 2^frac, to nearest, ties away from zero; what is below half
 * is 0.  MOTION_E_RANGE beyond 2^63 - 1. */
int decimal_scale(const struct decimal *self, const struct decimal_ratio *ratio,
                  unsigned frac, int64_t *result);

/* *a *= b if the product is below 2^63; else false and *a as before. */
bool decimal_mul_whole(uint64_t *a, uint64_t b);

/* The greatest common divisor, to reduce a quotient. */
uint64_t decimal_gcd(uint64_t a, uint64_t b);

#endif
