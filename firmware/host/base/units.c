/* firmware/host/base/units.c - see units.h.
 *
 *   text -> number (mantissa x 10^e) and unit (num/den x 10^e, dimension)
 *        -> dimension as wanted? -> one exact quotient -> rounded once */
#include "firmware/host/base/units.h"

#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/quote.h"
#include "firmware/host/base/timecode.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

/* 10^18 < 2^60 */
#define UNITS_DIGITS_MAX 18
/* Exponents are counted up to here; far beyond every format. */
#define UNITS_EXPONENT_MAX 100000
#define UNITS_WORD_MAX     24
#define UNITS_EXPECTED_MAX 160

/* ---- exact scaling ---- */

struct units_number {
    bool negative;
    uint64_t mantissa; /* < 10^18 */
    int exp10;
};

/* num / den x 10^exp10; num < 2^37 (rev on an axis in rad), den < 2^53
 * (arcsec/min on an axis in rad). */
struct units_ratio {
    uint64_t num, den;
    int exp10;
};

/* *a *= b; MOTION_E_RANGE at 2^127 and above. */
static int units_mul(struct motion_u128 *a, uint64_t b)
{
    const struct motion_u128 high = motion_fixed_mul_u64(a->hi, b);
    const struct motion_u128 low = motion_fixed_mul_u64(a->lo, b);
    const struct motion_u128 product = { high.lo + low.hi, low.lo };

    if (high.hi != 0 || product.hi < low.hi || product.hi >> 63 != 0)
        return MOTION_E_RANGE;
    *a = product;
    return MOTION_OK;
}

static int units_mul_pow5(struct motion_u128 *a, unsigned exponent)
{
    while (exponent-- > 0)
        if (units_mul(a, 5) < 0)
            return MOTION_E_RANGE;
    return MOTION_OK;
}

static int units_shift(struct motion_u128 *a, unsigned bits)
{
    while (bits > 0) {
        const unsigned step = bits < 62 ? bits : 62;
        if (units_mul(a, (uint64_t)1 << step) < 0)
            return MOTION_E_RANGE;
        bits -= step;
    }
    return MOTION_OK;
}

/* n / d by shift and subtract, for n < 2^127 and d >= 2^64: the quotient is
 * below 2^63, and bit clz(d.hi) of it cannot be set, since d << clz(d.hi) is
 * 2^127 or more. */
static uint64_t units_divide_long(struct motion_u128 *n, struct motion_u128 d)
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
static int units_divide(struct motion_u128 n, struct motion_u128 d,
                        uint64_t *result)
{
    struct motion_u128 rest = n;
    uint64_t quotient;

    if (d.hi != 0) {
        quotient = units_divide_long(&rest, d);
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

/* number x ratio x 2^frac.
 *
 * With e the sum of the decimal exponents, 10^e = 5^e 2^e, so this is n / d,
 *   e >= 0   n = mantissa num 5^e,   d = den
 *   e < 0    n = mantissa num,       d = den 5^-e
 * and 2^(frac + e) belongs to n or, when negative, to d.
 *
 * When d would not fit below 2^127, 2^(frac + e) is not in n (else -e <= 32 and
 * d < 2^52.1 5^32 < 2^127), so n < 2^97 and the value is nearest to 0.
 * When n would not fit, d is small: for e < 0, n < 2^97 2^(frac + e), so
 * frac + e >= 30, hence frac = 32, e >= -2 and d < 2^57; for e >= 0, d < 2^53.
 * Either way n / d > 2^63, which is out of range. */
static int units_scale(const struct units_number *number,
                       const struct units_ratio *ratio, unsigned frac,
                       int64_t *result)
{
    const int exp10 = number->exp10 + ratio->exp10;
    const int exp2 = (int)frac + exp10;
    struct motion_u128 n = { 0, number->mantissa }, d = { 0, ratio->den };
    uint64_t magnitude;

    *result = 0;
    if (number->mantissa == 0)
        return MOTION_OK;
    if ((exp10 < 0 && units_mul_pow5(&d, (unsigned)-exp10) < 0) ||
        (exp2 < 0 && units_shift(&d, (unsigned)-exp2) < 0))
        return MOTION_OK;
    if (units_mul(&n, ratio->num) < 0 ||
        (exp10 > 0 && units_mul_pow5(&n, (unsigned)exp10) < 0) ||
        (exp2 > 0 && units_shift(&n, (unsigned)exp2) < 0) ||
        units_divide(n, d, &magnitude) < 0)
        return MOTION_E_RANGE;
    *result = number->negative ? -(int64_t)magnitude : (int64_t)magnitude;
    return MOTION_OK;
}

uint64_t units_gcd(uint64_t a, uint64_t b)
{
    while (b != 0) {
        const uint64_t rest = a % b;
        a = b;
        b = rest;
    }
    return a;
}

/* ---- units ---- */

enum units_family {
    UNITS_NUMBER,
    UNITS_LENGTH,
    UNITS_ANGLE,
    UNITS_COUNTS,
    UNITS_DURATION,
    UNITS_HERTZ,
    UNITS_BITS,
    UNITS_FAMILIES,
};

/* What a unit measures: a family, per second to a power. */
struct units_unit {
    const char *spelling;
    enum units_family family;
    unsigned per_s;
    struct units_ratio ratio; /* to mm, deg, count, s, Hz, bit/s, 1 */
};

/* The first of a family is its base. */
static const struct units_unit units_table[] = {
    { "mm", UNITS_LENGTH, 0, { 1, 1, 0 } },
    { "m", UNITS_LENGTH, 0, { 1, 1, 3 } },
    { "cm", UNITS_LENGTH, 0, { 1, 1, 1 } },
    { "um", UNITS_LENGTH, 0, { 1, 1, -3 } },
    { "in", UNITS_LENGTH, 0, { 254, 1, -1 } },
    { "ft", UNITS_LENGTH, 0, { 3048, 1, -1 } },
    { "deg", UNITS_ANGLE, 0, { 1, 1, 0 } },
    { "rev", UNITS_ANGLE, 0, { 360, 1, 0 } },
    { "rad", UNITS_ANGLE, 0, { 22539047091, 393380582, 0 } },
    { "mrad", UNITS_ANGLE, 0, { 22539047091, 393380582, -3 } },
    { "arcmin", UNITS_ANGLE, 0, { 1, 60, 0 } },
    { "arcsec", UNITS_ANGLE, 0, { 1, 3600, 0 } },
    { "rpm", UNITS_ANGLE, 1, { 6, 1, 0 } },
    { "count", UNITS_COUNTS, 0, { 1, 1, 0 } },
    { "kcount", UNITS_COUNTS, 0, { 1000, 1, 0 } },
    { "Mcount", UNITS_COUNTS, 0, { 1000000, 1, 0 } },
    { "s", UNITS_DURATION, 0, { 1, 1, 0 } },
    { "ms", UNITS_DURATION, 0, { 1, 1, -3 } },
    { "us", UNITS_DURATION, 0, { 1, 1, -6 } },
    { "ns", UNITS_DURATION, 0, { 1, 1, -9 } },
    { "min", UNITS_DURATION, 0, { 60, 1, 0 } },
    { "h", UNITS_DURATION, 0, { 3600, 1, 0 } },
    { "Hz", UNITS_HERTZ, 0, { 1, 1, 0 } },
    { "kHz", UNITS_HERTZ, 0, { 1, 1, 3 } },
    { "bit/s", UNITS_BITS, 0, { 1, 1, 0 } },
    { "kbit/s", UNITS_BITS, 0, { 1, 1, 3 } },
    { "Mbit/s", UNITS_BITS, 0, { 1, 1, 6 } },
    { "%", UNITS_NUMBER, 0, { 1, 1, -2 } },
};

/* What may stand after the '/'. */
static const struct {
    const char *spelling;
    unsigned per_s;
    uint64_t seconds;
} units_per[] = {
    { "s", 1, 1 },    { "s2", 2, 1 },        { "s^2", 2, 1 },
    { "s3", 3, 1 },   { "s^3", 3, 1 },       { "s\xC2\xB2", 2, 1 },
    { "min", 1, 60 }, { "s\xC2\xB3", 3, 1 },
};

static const char *const units_meaning[UNITS_FAMILIES][4] = {
    [UNITS_NUMBER] = { "a ratio" },
    [UNITS_LENGTH] = { "a length", "a speed", "an acceleration", "a jerk" },
    [UNITS_ANGLE] = { "an angle", "an angular speed", "an angular acceleration",
                      "an angular jerk" },
    [UNITS_COUNTS] = { "a number of counts", "a speed in counts",
                       "an acceleration in counts", "a jerk in counts" },
    [UNITS_DURATION] = { "a time" },
    [UNITS_HERTZ] = { "a frequency" },
    [UNITS_BITS] = { "a bit rate" },
};

/* How a format is reached from the family's base unit. */
static const struct {
    unsigned frac;
    struct units_ratio base;
    const char
        *largest; /* in the axis's unit, where the family is the axis's */
} units_format[] = {
    [UNITS_POSITION] = { 32, { 1, 1, 0 }, "2147483647" },
    [UNITS_VELOCITY] = { 32, { 1, 1, 0 }, "2147483647" },
    [UNITS_ACCELERATION] = { 32, { 1, 1, 0 }, "2147483647" },
    [UNITS_JERK] = { 32, { 1, 1, 0 }, "2147483647" },
    [UNITS_TIME] = { 12, { 1, 1, 9 }, "26 days" },
    [UNITS_FREQUENCY] = { 0, { 14885392687, 2369083826, 3 }, "1e15" },
    [UNITS_BIT_RATE] = { 0, { 1, 1, 0 }, "1e18" },
    [UNITS_RATIO] = { 32, { 1, 1, 0 }, "2147483647" },
};

const char *const units_axis_words[UNITS_AXIS_WORDS] = {
    [UNITS_AXIS_MM] = "mm",         [UNITS_AXIS_DEG] = "deg",
    [UNITS_AXIS_REV] = "rev",       [UNITS_AXIS_RAD] = "rad",
    [UNITS_AXIS_COUNT] = "count",   [UNITS_AXIS_KCOUNT] = "kcount",
    [UNITS_AXIS_MCOUNT] = "Mcount",
};

const char *units_axis_text(enum units_axis unit)
{
    return units_axis_words[unit];
}

static const struct units_unit *units_find(const char *word, size_t length)
{
    for (size_t i = 0; i < ARRAY_LEN(units_table); i++)
        if (strlen(units_table[i].spelling) == length &&
            memcmp(units_table[i].spelling, word, length) == 0)
            return &units_table[i];
    return NULL;
}

/* The unit a quantity is wanted in: `ratio` is that of a number alone. */
static struct units_unit units_wanted(enum units_quantity quantity,
                                      enum units_axis unit)
{
    struct units_unit wanted = { "", UNITS_NUMBER, 0, { 1, 1, 0 } };

    switch (quantity) {
    case UNITS_POSITION:
    case UNITS_VELOCITY:
    case UNITS_ACCELERATION:
    case UNITS_JERK:
        wanted =
            *units_find(units_axis_words[unit], strlen(units_axis_words[unit]));
        wanted.per_s = (unsigned)(quantity - UNITS_POSITION);
        break;
    case UNITS_TIME:
        wanted.family = UNITS_DURATION;
        break;
    case UNITS_FREQUENCY:
        wanted.family = UNITS_HERTZ;
        break;
    case UNITS_BIT_RATE:
        wanted.family = UNITS_BITS;
        break;
    case UNITS_RATIO:
        break;
    }
    return wanted;
}

/* ---- one value being read ---- */

struct units_text {
    const char *text; /* whole, for sentences */
    const char *at;
    const char *end;
    struct units_unit wanted;
    enum units_quantity quantity;
    const struct units_context *context;
    const char *expected; /* instead of a list of units, when not NULL */
    char *sentence;
};

/* "a speed in mm, m, cm, um, in or ft per s (mm/s)" */
static const char *units_expected(const struct units_text *self,
                                  char expected[UNITS_EXPECTED_MAX])
{
    static const char *const power[] = { "s", "s", "s2", "s3" };
    const struct units_unit *wanted = &self->wanted;
    const char *spelling[ARRAY_LEN(units_table)];
    char list[QUOTE_LIST_MAX];
    unsigned count = 0;

    if (self->expected != NULL)
        return self->expected;
    if (wanted->family == UNITS_NUMBER)
        return "a number such as 0.5 or 50 %";
    for (size_t i = 0; i < ARRAY_LEN(units_table); i++)
        if (units_table[i].family == wanted->family &&
            units_table[i].per_s == 0)
            spelling[count++] = units_table[i].spelling;
    snprintf(expected, UNITS_EXPECTED_MAX, "%s in %.80s",
             units_meaning[wanted->family][wanted->per_s],
             quote_list(list, spelling, count));
    if (wanted->per_s > 0)
        snprintf(expected + strlen(expected),
                 UNITS_EXPECTED_MAX - strlen(expected), " per %s (%s/%s)",
                 power[wanted->per_s], spelling[0], power[wanted->per_s]);
    return expected;
}

/* "'<text>' <what>, expected ..." */
static int units_refuse(const struct units_text *self, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

static int units_refuse(const struct units_text *self, const char *format, ...)
{
    char quote[QUOTE_MAX], what[96], expected[UNITS_EXPECTED_MAX];
    va_list arguments;

    va_start(arguments, format);
    vsnprintf(what, sizeof(what), format, arguments);
    va_end(arguments);
    snprintf(self->sentence, UNITS_SENTENCE_MAX, "%s %s, expected %s",
             quote_text(quote, self->text, strlen(self->text)), what,
             units_expected(self, expected));
    return -1;
}

static void units_skip_blanks(struct units_text *self)
{
    while (self->at < self->end && (*self->at == ' ' || *self->at == '\t'))
        self->at++;
}

static bool units_is_digit(char letter)
{
    return letter >= '0' && letter <= '9';
}

/* ---- numbers ---- */

/* nan and inf, with a dot as in YAML or without. */
static int units_check_special(const struct units_text *self)
{
    const char *word = self->at;

    if (*word == '.')
        word++;
    if (strncasecmp(word, "nan", 3) == 0)
        return units_refuse(self, "is not a number");
    if (strncasecmp(word, "inf", 3) == 0)
        return units_refuse(self, "is infinite");
    return 0;
}

/* Digits and the point.  Zeros at either end do not count as digits of the
 * mantissa; `zeros` are those seen since the last other digit. */
static int units_read_mantissa(struct units_text *self,
                               struct units_number *number)
{
    int digits = 0, zeros = 0, after_point = 0, seen = 0;
    bool point = false;

    for (; units_is_digit(*self->at) || (*self->at == '.' && !point);
         self->at++) {
        if (*self->at == '.') {
            point = true;
            continue;
        }
        seen++;
        after_point += point;
        zeros++;
        if (*self->at == '0')
            continue;
        digits = digits == 0 ? 1 : digits + zeros;
        if (digits > UNITS_DIGITS_MAX)
            return units_refuse(self, "has more than %d digits",
                                UNITS_DIGITS_MAX);
        while (zeros-- > 1)
            number->mantissa *= 10;
        number->mantissa = number->mantissa * 10 + (uint64_t)(*self->at - '0');
        zeros = 0;
    }
    number->exp10 = zeros - after_point;
    if (seen == 0)
        return units_refuse(self, "is not a number");
    return 0;
}

/* e, sign, digits; without digits the e belongs to the unit. */
static void units_read_exponent(struct units_text *self,
                                struct units_number *number)
{
    const char *at = self->at;
    bool negative = false;
    int exponent = 0;

    if (*at != 'e' && *at != 'E')
        return;
    at++;
    if (*at == '+' || *at == '-')
        negative = *at++ == '-';
    if (!units_is_digit(*at))
        return;
    for (; units_is_digit(*at); at++)
        if (exponent < UNITS_EXPONENT_MAX)
            exponent = exponent * 10 + (*at - '0');
    number->exp10 += negative ? -exponent : exponent;
    self->at = at;
}

static int units_read_number(struct units_text *self,
                             struct units_number *number)
{
    *number = (struct units_number){ 0 };
    units_skip_blanks(self);
    if (*self->at == '+' || *self->at == '-')
        number->negative = *self->at++ == '-';
    if (units_check_special(self) < 0 || units_read_mantissa(self, number) < 0)
        return -1;
    units_read_exponent(self, number);
    if (*self->at == ',' && units_is_digit(self->at[1]))
        return units_refuse(self, "has a comma in the number (a decimal point "
                                  "is expected)");
    units_skip_blanks(self);
    return 0;
}

/* ---- unit words ---- */

/* The part after the '/' made part of `unit`. */
static int units_find_per(const char *word, size_t length,
                          struct units_unit *unit)
{
    for (size_t i = 0; i < ARRAY_LEN(units_per); i++) {
        if (strlen(units_per[i].spelling) != length ||
            memcmp(units_per[i].spelling, word, length) != 0)
            continue;
        unit->per_s = units_per[i].per_s;
        unit->ratio.den *= units_per[i].seconds;
        return 0;
    }
    return -1;
}

/* A unit from its word: as a whole, else base / time. */
static int units_find_any(const char *word, size_t length,
                          struct units_unit *unit)
{
    const struct units_unit *found = units_find(word, length);
    const char *slash = memchr(word, '/', length);
    size_t base;

    if (found != NULL) {
        *unit = *found;
        return 0;
    }
    if (slash == NULL)
        return -1;
    base = (size_t)(slash - word);
    found = units_find(word, base);
    if (found == NULL || found->per_s != 0 ||
        units_meaning[found->family][1] == NULL)
        return -1;
    *unit = *found;
    return units_find_per(slash + 1, length - base - 1, unit);
}

/* The rest of the text as a unit; nothing left: the wanted one. */
static int units_read_unit(struct units_text *self, struct units_unit *unit)
{
    char quote[QUOTE_MAX];
    size_t length;

    while (self->end > self->at && self->end[-1] == ' ')
        self->end--;
    length = (size_t)(self->end - self->at);
    *unit = self->wanted;
    if (length == 0)
        return 0;
    if (units_find_any(self->at, length, unit) < 0)
        return units_refuse(
            self, "has the unknown unit %s",
            quote_text(quote, self->at,
                       length < UNITS_WORD_MAX ? length : UNITS_WORD_MAX));
    if (unit->family != self->wanted.family ||
        unit->per_s != self->wanted.per_s)
        return units_refuse(self, "is %s",
                            units_meaning[unit->family][unit->per_s]);
    return 0;
}

/* ---- values ---- */

/* number x ratio in `wanted`'s unit (or the base), in the quantity's format. */
static int units_value(const struct units_number *number,
                       const struct units_ratio *ratio,
                       const struct units_unit *wanted,
                       enum units_quantity quantity, int64_t *result)
{
    const struct units_ratio *own = &wanted->ratio;
    const struct units_ratio *base = &units_format[quantity].base;
    const uint64_t same = units_gcd(ratio->num, own->num);
    const uint64_t under = units_gcd(ratio->den, own->den);
    const struct units_ratio whole = {
        ratio->num / same * base->num * (own->den / under),
        ratio->den / under * base->den * (own->num / same),
        ratio->exp10 + base->exp10
    };

    return units_scale(number, &whole, units_format[quantity].frac, result);
}

/* The axis's unit that holds the value, the smallest; NULL where none does. */
static const char *units_axis_for(const struct units_text *self,
                                  const struct units_number *number,
                                  const struct units_ratio *ratio)
{
    for (unsigned i = 0; i < UNITS_AXIS_WORDS; i++) {
        const struct units_unit larger =
            units_wanted(self->quantity, (enum units_axis)i);
        int64_t value;
        if (larger.family == self->wanted.family &&
            units_value(number, ratio, &larger, self->quantity, &value) == 0)
            return units_axis_words[i];
    }
    return NULL;
}

/* Of an axis with the way out: "at most 2147483647 count/s2; declare the axis
 * in kcount". */
static int units_too_large(const struct units_text *self,
                           const struct units_number *number,
                           const struct units_ratio *ratio)
{
    static const char *const per[] = { "", "/s", "/s2", "/s3" };
    char expected[UNITS_EXPECTED_MAX];
    struct units_text most = *self;
    const bool of_axis = self->quantity <= UNITS_JERK;
    const char *larger = of_axis ? units_axis_for(self, number, ratio) : NULL;

    snprintf(expected, sizeof(expected), "at most %s%s%s%s%s%s",
             units_format[self->quantity].largest, of_axis ? " " : "",
             of_axis ? self->wanted.spelling : "",
             of_axis ? per[self->wanted.per_s] : "",
             larger != NULL ? "; beyond that declare the axis in " : "",
             larger != NULL ? larger : "");
    most.expected = expected;
    return units_refuse(&most, "is too large");
}

/* To the axis's unit (or the base), then to the format's. */
static int units_convert(const struct units_text *self,
                         const struct units_number *number,
                         const struct units_ratio *ratio, int64_t *result)
{
    if (units_value(number, ratio, &self->wanted, self->quantity, result) < 0)
        return units_too_large(self, number, ratio);
    return 0;
}

static struct units_text units_begin(const char *text,
                                     enum units_quantity quantity,
                                     const struct units_context *context,
                                     char *sentence)
{
    return (struct units_text){ .text = text,
                                .at = text,
                                .end = text + strlen(text),
                                .wanted = units_wanted(quantity, context->unit),
                                .quantity = quantity,
                                .context = context,
                                .sentence = sentence };
}

static const struct units_context units_no_context = { 0 };

/* Number to num / den below 1e9, if it is one. */
static int units_fps_part(const struct units_number *number,
                          struct units_fps *part)
{
    int exp10 = number->exp10;

    *part = (struct units_fps){ number->mantissa, 1 };
    for (; exp10 > 0 && part->num <= 1000000000; exp10--)
        part->num *= 10;
    for (; exp10 < 0 && part->den <= 1000000000; exp10++)
        part->den *= 10;
    return number->negative || part->num == 0 || part->num > 1000000000 ||
                   part->den > 1000000000
               ? -1
               : 0;
}

/* number [ / number ] [ fps ], to the end of the text. */
static int units_read_fps(struct units_text *self, struct units_fps *fps)
{
    struct units_number number;
    struct units_fps over = { 1, 1 };
    uint64_t same;

    self->expected = "a frame rate such as 24, 23.976 or 24000/1001";
    if (units_read_number(self, &number) < 0)
        return -1;
    if (units_fps_part(&number, fps) < 0)
        return units_refuse(self, "is not a frame rate");
    if (*self->at == '/') {
        self->at++;
        if (units_read_number(self, &number) < 0)
            return -1;
        if (units_fps_part(&number, &over) < 0)
            return units_refuse(self, "is not a frame rate");
    }
    if (strncmp(self->at, "fps", 3) == 0)
        self->at += 3;
    units_skip_blanks(self);
    if (strcasecmp(self->at, "df") == 0 || strcasecmp(self->at, "ndf") == 0 ||
        strcasecmp(self->at, "drop") == 0) {
        self->expected = "the rate, such as 30000/1001";
        return units_refuse(self, "says how timecode is counted");
    }
    if (self->at != self->end)
        return units_refuse(self, "has something after the frame rate");
    fps->num *= over.den;
    fps->den *= over.num;
    same = units_gcd(fps->num, fps->den);
    fps->num /= same;
    fps->den /= same;
    if (fps->num > 1000000000 || fps->den > 1000000000)
        return units_refuse(self, "is not a frame rate");
    return 0;
}

/* "frame 120", "f120": past the word, or false. */
static bool units_skip_frame_word(struct units_text *self)
{
    const size_t length = strncmp(self->at, "frame", 5) == 0 ? 5 : 1;

    if (self->quantity != UNITS_TIME || *self->at != 'f')
        return false;
    self->at += length;
    return true;
}

/* number [ @ rate ] as a time: number x den / num seconds. */
static int units_read_frame(struct units_text *self, int64_t *result)
{
    struct units_fps fps = self->context->fps;
    struct units_number number;

    self->expected = "a frame such as 'frame 120 @ 24'";
    if (units_read_number(self, &number) < 0)
        return -1;
    if (*self->at == '@') {
        self->at++;
        if (units_read_fps(self, &fps) < 0)
            return -1;
    } else if (self->at != self->end) {
        return units_refuse(self, "has something after the frame");
    }
    if (fps.den == 0)
        return units_refuse(self, "has no frame rate and the file gives none "
                                  "(fps)");
    return units_convert(self, &number,
                         &(struct units_ratio){ fps.den, fps.num, 0 }, result);
}

/* Digits, then a colon. */
static bool units_is_timecode(const struct units_text *self)
{
    const char *at = self->at;

    while (units_is_digit(*at))
        at++;
    return self->quantity == UNITS_TIME && at > self->at && *at == ':';
}

/* timecode [ @ rate ] as a time: that of its frame. */
static int units_read_timecode(struct units_text *self, int64_t *result)
{
    struct units_fps fps = self->context->fps;
    struct units_number number = { 0 };
    char word[UNITS_WORD_MAX];
    size_t length = strcspn(self->at, " \t@");
    const char *wrong;

    self->expected = "HH:MM:SS:FF, or HH:MM:SS;FF for drop-frame timecode";
    if (length >= sizeof word)
        return units_refuse(self, "is no timecode");
    memcpy(word, self->at, length);
    word[length] = 0;
    self->at += length;
    units_skip_blanks(self);
    if (*self->at == '@') {
        self->at++;
        if (units_read_fps(self, &fps) < 0)
            return -1;
        self->expected = "HH:MM:SS:FF, or HH:MM:SS;FF for drop-frame timecode";
    } else if (self->at != self->end) {
        return units_refuse(self, "has something after the timecode");
    }
    if (fps.den == 0)
        return units_refuse(self, "has no frame rate and the file gives none "
                                  "(fps)");
    wrong = timecode_frames(word, fps, &number.mantissa);
    if (wrong != NULL)
        return units_refuse(self, "%s", wrong);
    return units_convert(self, &number,
                         &(struct units_ratio){ fps.den, fps.num, 0 }, result);
}

int units_parse(const char *text, enum units_quantity quantity,
                const struct units_context *context, int64_t *result,
                char sentence[UNITS_SENTENCE_MAX])
{
    struct units_text self = units_begin(text, quantity, context, sentence);
    struct units_number number;
    struct units_unit unit;

    if (units_skip_frame_word(&self))
        return units_read_frame(&self, result);
    units_skip_blanks(&self);
    if (units_is_timecode(&self))
        return units_read_timecode(&self, result);
    if (units_read_number(&self, &number) < 0 ||
        units_read_unit(&self, &unit) < 0)
        return -1;
    return units_convert(&self, &number, &unit.ratio, result);
}

int units_parse_fps(const char *text, struct units_fps *fps,
                    char sentence[UNITS_SENTENCE_MAX])
{
    struct units_text self =
        units_begin(text, UNITS_RATIO, &units_no_context, sentence);
    return units_read_fps(&self, fps);
}

/* ---- counts per unit ---- */

/* *a *= b if the product fits in 63 bits. */
static bool units_fits(uint64_t *a, uint64_t b)
{
    struct motion_u128 product = { 0, *a };

    if (units_mul(&product, b) < 0 || product.hi != 0 || product.lo >> 63 != 0)
        return false;
    *a = product.lo;
    return true;
}

/* number / ratio, reduced. */
static bool units_counts_over(const struct units_number *number,
                              const struct units_ratio *ratio, uint64_t *num,
                              uint64_t *den)
{
    int exp10 = number->exp10 - ratio->exp10;
    uint64_t same;

    *num = number->mantissa;
    *den = ratio->num;
    for (; exp10 > 0; exp10--)
        if (!units_fits(num, 10))
            return false;
    for (; exp10 < 0; exp10++)
        if (!units_fits(den, 10))
            return false;
    same = units_gcd(*num, *den);
    *num /= same;
    *den /= same;
    return units_fits(num, ratio->den);
}

int units_parse_counts(const char *text, enum units_axis unit, int64_t *num,
                       int64_t *den, char sentence[UNITS_SENTENCE_MAX])
{
    const struct units_context context = { .unit = unit };
    struct units_text self =
        units_begin(text, UNITS_POSITION, &context, sentence);
    struct units_number number;
    struct units_unit per;
    uint64_t above, below, same;

    self.expected = "counts per unit of the axis, such as '4096 per mm'";
    if (units_read_number(&self, &number) < 0)
        return -1;
    if (strncmp(self.at, "per ", 4) == 0)
        self.at += 4;
    else if (self.at != self.end)
        return units_refuse(&self, "has no 'per' after the number");
    units_skip_blanks(&self);
    if (units_read_unit(&self, &per) < 0)
        return -1;
    if (number.mantissa == 0)
        return units_refuse(&self, "is zero");
    if (!units_counts_over(&number, &per.ratio, &above, &below) ||
        !units_fits(&above, self.wanted.ratio.num) ||
        !units_fits(&below, self.wanted.ratio.den))
        return units_refuse(&self, "does not fit in 63 bits");
    same = units_gcd(above, below);
    *num = (int64_t)(above / same);
    *den = (int64_t)(below / same);
    if (number.negative)
        *num = -*num;
    return 0;
}
