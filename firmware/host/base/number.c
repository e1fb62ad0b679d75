/* firmware/host/base/number.c - see number.h. */
#include "firmware/host/base/number.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"

static const uint64_t number_power10[] = {
    1,
    10,
    100,
    1000,
    10000,
    100000,
    1000000,
    10000000,
    100000000,
    1000000000,
    10000000000,
    100000000000,
    1000000000000,
    10000000000000,
    100000000000000,
    1000000000000000,
    10000000000000000,
    100000000000000000,
    1000000000000000000,
};

static unsigned number_put_unsigned(char *text, uint64_t value)
{
    char reversed[20];
    unsigned count = 0;
    do {
        reversed[count++] = (char)('0' + value % 10);
        value /= 10;
    } while (value != 0);
    for (unsigned i = 0; i < count; i++)
        text[i] = reversed[count - 1 - i];
    return count;
}

/* `digits` decimals with leading zeros. */
static unsigned number_put_padded(char *text, uint64_t value, unsigned digits)
{
    for (unsigned i = digits; i > 0; i--) {
        text[i - 1] = (char)('0' + value % 10);
        value /= 10;
    }
    return digits;
}

static uint64_t number_mask(unsigned bits)
{
    return (UINT64_C(1) << bits) - 1;
}

unsigned number_integer(char text[NUMBER_MAX], int64_t value)
{
    unsigned n = 0;
    if (value < 0)
        text[n++] = '-';
    n += number_put_unsigned(text + n, motion_fixed_abs(value));
    text[n] = 0;
    return n;
}

unsigned number_exact(char text[NUMBER_MAX], int64_t value, unsigned bits)
{
    uint64_t magnitude = motion_fixed_abs(value);
    uint64_t fraction = magnitude & number_mask(bits);
    unsigned n = 0;
    if (value < 0)
        text[n++] = '-';
    n += number_put_unsigned(text + n, magnitude >> bits);
    if (fraction != 0)
        text[n++] = '.';
    /* fraction < 2^32, so fraction * 10 < 2^36; each round clears one of the
     * low bits for good, hence at most `bits` rounds. */
    while (fraction != 0) {
        fraction *= 10;
        text[n++] = (char)('0' + (fraction >> bits));
        fraction &= number_mask(bits);
    }
    text[n] = 0;
    return n;
}

unsigned number_fixed(char text[NUMBER_MAX], int64_t value, unsigned bits,
                      unsigned digits)
{
    uint64_t magnitude = motion_fixed_abs(value);
    uint64_t whole = magnitude >> bits;
    uint64_t scale = number_power10[digits];
    int64_t part = 0;
    unsigned n = 0;
    /* a share of 10^18 or less: it fits */
    (void)motion_fixed_mulshift((int64_t)(magnitude & number_mask(bits)),
                                (int64_t)scale, bits, &part);
    if ((uint64_t)part == scale) {
        part = 0;
        whole++;
    }
    if (value < 0 && (whole != 0 || part != 0))
        text[n++] = '-';
    n += number_put_unsigned(text + n, whole);
    if (digits > 0) {
        text[n++] = '.';
        n += number_put_padded(text + n, (uint64_t)part, digits);
    }
    text[n] = 0;
    return n;
}

unsigned number_short(char text[NUMBER_MAX], int64_t value, unsigned bits)
{
    double magnitude = fabs(number_double(value, bits));
    unsigned digits = 0;
    for (double edge = 1000; digits < 6 && magnitude < edge; edge /= 10)
        digits++;
    if (value == 0)
        digits = 0;
    unsigned n = number_fixed(text, value, bits, digits);
    if (digits == 0)
        return n;
    while (text[n - 1] == '0')
        n--;
    if (text[n - 1] == '.')
        n--;
    text[n] = 0;
    return n;
}

unsigned number_seconds(char text[NUMBER_MAX], int64_t t_ns_q12)
{
    uint64_t ms = (motion_fixed_abs(t_ns_q12) / 4096 + 500000) / 1000000;
    unsigned n = 0;
    if (t_ns_q12 < 0 && ms != 0)
        text[n++] = '-';
    n += number_put_unsigned(text + n, ms / 1000);
    text[n++] = '.';
    n += number_put_padded(text + n, ms % 1000, 3);
    text[n] = 0;
    return n;
}

/* A decimal as it was written: +-whole.part, part as `digits` digits. */
struct number_decimal {
    bool negative;
    uint64_t whole, part;
    unsigned digits;
    bool lost; /* decimals beyond the 18 kept were not all zero */
};

static bool number_is_digit(char c)
{
    return c >= '0' && c <= '9';
}

static int number_scan(const char *text, struct number_decimal *number,
                       const char **end)
{
    const char *at = text;
    *number = (struct number_decimal){ .negative = *at == '-' };
    if (*at == '-' || *at == '+')
        at++;
    if (!number_is_digit(*at) && !(*at == '.' && number_is_digit(at[1])))
        return MOTION_E_ARG;
    for (; number_is_digit(*at); at++) {
        if (number->whole > (UINT64_C(1) << 60) / 10)
            return MOTION_E_RANGE;
        number->whole = number->whole * 10 + (uint64_t)(*at - '0');
    }
    if (*at == '.')
        at++;
    for (; number_is_digit(*at); at++) {
        if (number->digits == 18) {
            number->lost |= *at != '0';
            continue;
        }
        number->part = number->part * 10 + (uint64_t)(*at - '0');
        number->digits++;
    }
    if (end != NULL)
        *end = at;
    return MOTION_OK;
}

int number_parse(const char *text, unsigned bits, int64_t *value,
                 const char **end)
{
    struct number_decimal number;
    int64_t part;
    int err = number_scan(text, &number, end);
    if (err < 0)
        return err;
    if (number.whole > (uint64_t)INT64_MAX >> bits)
        return MOTION_E_RANGE;
    err = motion_fixed_muldiv((int64_t)number.part, INT64_C(1) << bits,
                              (int64_t)number_power10[number.digits], &part);
    if (err < 0)
        return err;
    err = motion_fixed_add((int64_t)(number.whole << bits), part, value);
    if (err == MOTION_OK && number.negative)
        *value = -*value;
    return err;
}

int number_parse_decimal(const char *text, unsigned digits, int64_t *value,
                         const char **end)
{
    struct number_decimal number;
    int err = number_scan(text, &number, end);
    if (err < 0)
        return err;
    uint64_t part = number.part;
    if (number.digits > digits) {
        uint64_t extra = number_power10[number.digits - digits];
        if (number.lost || part % extra != 0)
            return MOTION_E_RANGE;
        part /= extra;
    } else {
        part *= number_power10[digits - number.digits];
    }
    uint64_t capacity = (uint64_t)INT64_MAX / number_power10[digits];
    if (number.whole >= capacity)
        return MOTION_E_RANGE;
    *value = (int64_t)(number.whole * number_power10[digits] + part);
    if (number.negative)
        *value = -*value;
    return MOTION_OK;
}

const char *number_word(uint64_t count, const char *one, const char *more)
{
    return count == 1 ? one : more;
}

double number_double(int64_t value, unsigned bits)
{
    return (double)value * (1 / (double)(UINT64_C(1) << bits));
}

const char *number_unit(char text[NUMBER_UNIT_MAX], enum units_axis unit,
                        unsigned order)
{
    static const char *const suffix[] = { "", "/s", "/s2", "/s3" };
    snprintf(text, NUMBER_UNIT_MAX, "%s%s", units_axis_text(unit),
             suffix[order]);
    return text;
}

int64_t number_percent(int64_t value, int64_t limit)
{
    if (limit == 0)
        return 0;
    double share = fabs((double)value) / fabs((double)limit);
    return (int64_t)ceil(100 * share - 1e-6);
}
