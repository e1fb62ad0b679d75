/* firmware/host/base/unit.h - the units a value may be written in, by name. */
#ifndef FIRMWARE_HOST_BASE_UNIT_H
#define FIRMWARE_HOST_BASE_UNIT_H

#include <stddef.h>

#include "firmware/host/base/decimal.h"

enum unit_family {
    UNIT_NUMBER,
    UNIT_LENGTH,
    UNIT_ANGLE,
    UNIT_COUNTS,
    UNIT_DURATION,
    UNIT_HERTZ,
    UNIT_BITS,
    UNIT_CELSIUS,
    UNIT_VOLTS,
    UNIT_AMPERES,
    UNIT_FAMILIES,
};

/* What a unit measures: a family, per second to a power, 0 .. 3. */
struct unit {
    const char *spelling;
    enum unit_family family;
    unsigned per_s;
    struct decimal_ratio ratio; /* to mm, deg, count, s, Hz, bit/s,
                                   degC, V, A, 1 */
};

#define UNIT_SPELLINGS_MAX 40 /* of one family */

/* "mm", "mm/s2", "rpm" of `length` bytes; -1 where it is no unit. */
int unit_read(struct unit *self, const char *word, size_t length);

/* "a length", "a speed" ... */
const char *unit_meaning(const struct unit *self);

/* The spellings of a family, its base first; how many there are. */
unsigned unit_spellings(enum unit_family family,
                        const char *spelling[UNIT_SPELLINGS_MAX]);

#endif
