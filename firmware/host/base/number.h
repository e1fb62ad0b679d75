/* firmware/host/base/number.h - fixed-point values as text, without a float.
 *
 * `bits` is the number of fraction bits, 0..32 (32 for *_q32).
 * Every function writes a 0 at the end and returns the length.  The same value
 * gives the same bytes on every machine and in every locale. */
#ifndef FIRMWARE_HOST_BASE_NUMBER_H
#define FIRMWARE_HOST_BASE_NUMBER_H

#include <stddef.h>
#include <stdint.h>

#include "firmware/host/base/units.h"

/* "-" 19 digits "." 32 digits and the 0, rounded up. */
#define NUMBER_MAX 56

/* Every digit there is: a fraction of 2^bits ends after `bits` decimals, so
 * nothing is rounded.  Zeros at the end are left out. */
unsigned number_exact(char text[NUMBER_MAX], int64_t value, unsigned bits);

/* `digits` decimals (0..18), to nearest, ties away from zero; never "-0". */
unsigned number_fixed(char text[NUMBER_MAX], int64_t value, unsigned bits,
                      unsigned digits);

/* For people: four significant digits, no exponent, at most six decimals. */
unsigned number_short(char text[NUMBER_MAX], int64_t value, unsigned bits);

/* Seconds with three decimals from nanoseconds in Q12. */
unsigned number_seconds(char text[NUMBER_MAX], int64_t t_ns_q12);

/* Whole integer; faster than printf. */
unsigned number_integer(char text[NUMBER_MAX], int64_t value);

/* A decimal number, optional sign, no exponent, as an integer of 2^-bits, to
 * nearest.  *end, when not NULL, is where it stopped.  MOTION_E_ARG when there
 * is no number, MOTION_E_RANGE when it does not fit. */
int number_parse(const char *text, unsigned bits, int64_t *value,
                 const char **end);
/* The same as an integer of 10^-digits (0..18); decimals below that must be
 * zero, else MOTION_E_RANGE: nothing is lost. */
int number_parse_decimal(const char *text, unsigned digits, int64_t *value,
                         const char **end);

/* The word for so many: "axis" of 1, "axes" of 0 and of 2. */
const char *number_word(uint64_t count, const char *one, const char *more);

/* value / 2^bits, bits below 64; rounded once, to a double. */
double number_double(int64_t value, unsigned bits);

/* "mm", "mm/s", "mm/s2", "mm/s3" for order 0..3. */
#define NUMBER_UNIT_MAX 16
const char *number_unit(char text[NUMBER_UNIT_MAX], enum units_axis unit,
                        unsigned order);

/* value / limit in percent, rounded up (so that 100 means "at the limit or
 * beyond"); 0 when the limit is 0. */
int64_t number_percent(int64_t value, int64_t limit);

#endif
