/* firmware/host/base/decimal.c - see decimal.h. */
#include "firmware/host/base/decimal.h"

#include <stddef.h>
#include <strings.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"

/* 10^18 < 2^60 */
#define DECIMAL_DIGITS_MAX 18
/* Exponents are counted up to here; far beyond every format. */
#define DECIMAL_EXPONENT_MAX 100000

/* ---- reading ---- */

bool decimal_is_digit(char letter)
{
    return letter >= '0' && letter <= '9';
}

/* nan and inf, with a dot as in YAML or without. */
static const char *decimal_check_special(const char *word)
{
    if (*word == '.')
        word++;
    if (strncasecmp(word, "nan", 3) == 0)
        return "is not a number";
    if (strncasecmp(word, "inf", 3) == 0)
        return "is infinite";
    return NULL;
}

/* Digits and the point.  Zeros at either end do not count as digits of the
 * mantissa; `zeros` are those seen since the last other digit. */
static const char *decimal_read_mantissa(struct decimal *self, const char **at)
{
    int digits = 0, zeros = 0, after_point = 0, seen = 0;
    bool point = false;

    for (; decimal_is_digit(**at) || (**at == '.' && !point); ++*at) {
        if (**at == '.') {
            point = true;
            continue;
        }
        seen++;
        after_point += point;
        zeros++;
        if (**at == '0')
            continue;
        digits = digits == 0 ? 1 : digits + zeros;
        if (digits > DECIMAL_DIGITS_MAX)
            return "has more than 18 digits";
        while (zeros-- > 1)
            self->mantissa *= 10;
        self->mantissa = self->mantissa * 10 + (uint64_t)(**at - '0');
        zeros = 0;
    }
    self->exp10 = zeros - after_point;
    return seen == 0 ? "is not a number" : NULL;
}

/* e, sign, digits; without digits the e belongs to the unit. */
static void decimal_read_exponent(struct decimal *self, const char **end)
{
    const char *at = *end;
    bool negative = false;
    int exponent = 0;

    if (*at != 'e' && *at != 'E')
        return;
    at++;
    if (*at == '+' || *at == '-')
        negative = *at++ == '-';
    if (!decimal_is_digit(*at))
        return;
    for (; decimal_is_digit(*at); at++)
        if (exponent < DECIMAL_EXPONENT_MAX)
            exponent = exponent * 10 + (*at - '0');
    self->exp10 += negative ? -exponent : exponent;
    *end = at;
}

const char *decimal_read(struct decimal *self, const char **at)
{
    const char *wrong;

    *self = (struct decimal){ 0 };
    if (**at == '+' || **at == '-')
        self->negative = *(*at)++ == '-';
    wrong = decimal_check_special(*at);
    if (wrong == NULL)
        wrong = decimal_read_mantissa(self, at);
    if (wrong != NULL)
        return wrong;
    decimal_read_exponent(self, at);
    if (**at == ',' && decimal_is_digit((*at)[1]))
        return "has a comma in the number (a decimal point is expected)";
    return NULL;
}

/* ---- exact scaling ---- */

/* *a *= b; MOTION_E_RANGE at 2^127 and above. */
static int decimal_mul(struct motion_u128 *a, uint64_t b)
{
    const struct motion_u128 high = motion_fixed_mul_u64(a->hi, b);
    const struct motion_u128 low = motion_fixed_mul_u64(a->lo, b);
    const struct motion_u128 product = { high.lo + low.hi, low.lo };

    if (high.hi != 0 || product.hi < low.hi || product.hi >> 63 != 0)
        return MOTION_E_RANGE;
    *a = product;
    return MOTION_OK;
}

static int decimal_mul_pow5(struct motion_u128 *a, unsigned exponent)
{
    while (exponent-- > 0)
        if (decimal_mul(a, 5) < 0)
            return MOTION_E_RANGE;
    return MOTION_OK;
}

static int decimal_shift(struct motion_u128 *a, unsigned bits)
{
    while (bits > 0) {
        const unsigned step = bits < 62 ? bits : 62;
        if (decimal_mul(a, (uint64_t)1 << step) < 0)
            return MOTION_E_RANGE;
        bits -= step;
    }
    return MOTION_OK;
}

/* n / d by shift and subtract, for n < 2^127 and d >= 2^64: the quotient is
 * below 2^63, and bit clz(d.hi) of it cannot be set, since d << clz(d.hi) is
 * 2^127 or more. */
static uint64_t decimal_divide_long(struct motion_u128 *n, struct motion_u128 d)
{
    uint64_t quotient = 0;

    for (unsigned bit = motion_fixed_clz_u64(d.hi); bit-- > 0;) {
        const struct motion_u128 part = motion_fixed_shl_u128(d, bit);
        if (motion_fixed_cmp_u128(*n, part) < 0)
            continue;
        *n = motion_fixed_sub_u128(*n, part);
        quotient |= (uint64_t)1 << bit;
    }
    return quotient;
}

/* n / d to nearest, d > 0; MOTION_E_RANGE beyond 2^63 - 1. */
static int decimal_divide(struct motion_u128 n, struct motion_u128 d,
                          uint64_t *result)
{
    struct motion_u128 rest = n;
    uint64_t quotient;

    if (d.hi != 0) {
        quotient = decimal_divide_long(&rest, d);
    } else {
        rest.hi = 0;
        if (motion_fixed_div_u128(n, d.lo, &quotient, &rest.lo) < 0)
            return MOTION_E_RANGE;
    }
    if (motion_fixed_cmp_u128(rest, motion_fixed_sub_u128(d, rest)) >= 0 &&
        quotient < UINT64_MAX)
        quotient++;
    *result = quotient;
    return quotient > (uint64_t)INT64_MAX ? MOTION_E_RANGE : MOTION_OK;
}

/* With e the sum of the decimal exponents, 10^e = 5^e 2^e, so this is n / d,
 *   e >= 0   n = mantissa num 5^e,   d = den
 *   e < 0    n = mantissa num,       d = den 5^-e
 * and 2^(frac + e) belongs to n or, when negative, to d.
 *
 * When d would not fit below 2^127, 2^(frac + e) is not in n (else -e <= 32 and
 * d < 2^52.1 5^32 < 2^127), so n < 2^97 and the value is nearest to 0.
 * When n would not fit, d is small: for e < 0, n < 2^97 2^(frac + e), so
 * frac + e >= 30, hence frac = 32, e >= -2 and d < 2^57; for e >= 0, d < 2^53.
 * Either way n / d > 2^63, which is out of range. */
int decimal_scale(const struct decimal *self, const struct decimal_ratio *ratio,
                  unsigned frac, int64_t *result)
{
    const int exp10 = self->exp10 + ratio->exp10;
    const int exp2 = (int)frac + exp10;
    struct motion_u128 n = { 0, self->mantissa }, d = { 0, ratio->den };
    uint64_t magnitude;

    *result = 0;
    if (self->mantissa == 0)
        return MOTION_OK;
    if ((exp10 < 0 && decimal_mul_pow5(&d, (unsigned)-exp10) < 0) ||
        (exp2 < 0 && decimal_shift(&d, (unsigned)-exp2) < 0))
        return MOTION_OK;
    if (decimal_mul(&n, ratio->num) < 0 ||
        (exp10 > 0 && decimal_mul_pow5(&n, (unsigned)exp10) < 0) ||
        (exp2 > 0 && decimal_shift(&n, (unsigned)exp2) < 0) ||
        decimal_divide(n, d, &magnitude) < 0)
        return MOTION_E_RANGE;
    *result = self->negative ? -(int64_t)magnitude : (int64_t)magnitude;
    return MOTION_OK;
}

bool decimal_mul_whole(uint64_t *a, uint64_t b)
{
    struct motion_u128 product = { 0, *a };

    if (decimal_mul(&product, b) < 0 || product.hi != 0 ||
        product.lo >> 63 != 0)
        return false;
    *a = product.lo;
    return true;
}

uint64_t decimal_gcd(uint64_t a, uint64_t b)
{
    while (b != 0) {
        const uint64_t rest = a % b;
        a = b;
        b = rest;
    }
    return a;
}
