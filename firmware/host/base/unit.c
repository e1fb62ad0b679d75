/* firmware/host/base/unit.c - see unit.h. */
#include "firmware/host/base/unit.h"

#include <string.h>

#include "firmware/host/base/array.h"

/* The first of a family is its base. */
static const struct unit unit_table[] = {
    { "mm", UNIT_LENGTH, 0, { 1, 1, 0 } },
    { "m", UNIT_LENGTH, 0, { 1, 1, 3 } },
    { "cm", UNIT_LENGTH, 0, { 1, 1, 1 } },
    { "um", UNIT_LENGTH, 0, { 1, 1, -3 } },
    { "in", UNIT_LENGTH, 0, { 254, 1, -1 } },
    { "ft", UNIT_LENGTH, 0, { 3048, 1, -1 } },
    { "deg", UNIT_ANGLE, 0, { 1, 1, 0 } },
    { "rev", UNIT_ANGLE, 0, { 360, 1, 0 } },
    { "rad", UNIT_ANGLE, 0, { 22539047091, 393380582, 0 } },
    { "mrad", UNIT_ANGLE, 0, { 22539047091, 393380582, -3 } },
    { "arcmin", UNIT_ANGLE, 0, { 1, 60, 0 } },
    { "arcsec", UNIT_ANGLE, 0, { 1, 3600, 0 } },
    { "rpm", UNIT_ANGLE, 1, { 6, 1, 0 } },
    { "count", UNIT_COUNTS, 0, { 1, 1, 0 } },
    { "kcount", UNIT_COUNTS, 0, { 1000, 1, 0 } },
    { "Mcount", UNIT_COUNTS, 0, { 1000000, 1, 0 } },
    { "s", UNIT_DURATION, 0, { 1, 1, 0 } },
    { "ms", UNIT_DURATION, 0, { 1, 1, -3 } },
    { "us", UNIT_DURATION, 0, { 1, 1, -6 } },
    { "ns", UNIT_DURATION, 0, { 1, 1, -9 } },
    { "min", UNIT_DURATION, 0, { 60, 1, 0 } },
    { "h", UNIT_DURATION, 0, { 3600, 1, 0 } },
    { "Hz", UNIT_HERTZ, 0, { 1, 1, 0 } },
    { "kHz", UNIT_HERTZ, 0, { 1, 1, 3 } },
    { "bit/s", UNIT_BITS, 0, { 1, 1, 0 } },
    { "kbit/s", UNIT_BITS, 0, { 1, 1, 3 } },
    { "Mbit/s", UNIT_BITS, 0, { 1, 1, 6 } },
    { "degC", UNIT_CELSIUS, 0, { 1, 1, 0 } },
    { "V", UNIT_VOLTS, 0, { 1, 1, 0 } },
    { "mV", UNIT_VOLTS, 0, { 1, 1, -3 } },
    { "A", UNIT_AMPERES, 0, { 1, 1, 0 } },
    { "mA", UNIT_AMPERES, 0, { 1, 1, -3 } },
    { "%", UNIT_NUMBER, 0, { 1, 1, -2 } },
};

/* What may stand after the '/'. */
static const struct {
    const char *spelling;
    unsigned per_s;
    uint64_t seconds;
} unit_per[] = {
    { "s", 1, 1 },    { "s2", 2, 1 },        { "s^2", 2, 1 },
    { "s3", 3, 1 },   { "s^3", 3, 1 },       { "s\xC2\xB2", 2, 1 },
    { "min", 1, 60 }, { "s\xC2\xB3", 3, 1 },
};

static const char *const unit_meanings[UNIT_FAMILIES][4] = {
    [UNIT_NUMBER] = { "a ratio" },
    [UNIT_LENGTH] = { "a length", "a speed", "an acceleration", "a jerk" },
    [UNIT_ANGLE] = { "an angle", "an angular speed", "an angular acceleration",
                     "an angular jerk" },
    [UNIT_COUNTS] = { "a number of counts", "a speed in counts",
                      "an acceleration in counts", "a jerk in counts" },
    [UNIT_DURATION] = { "a time" },
    [UNIT_HERTZ] = { "a frequency" },
    [UNIT_BITS] = { "a bit rate" },
    [UNIT_CELSIUS] = { "a temperature" },
    [UNIT_VOLTS] = { "a voltage" },
    [UNIT_AMPERES] = { "a current" },
};

static const struct unit *unit_find(const char *word, size_t length)
{
    for (size_t i = 0; i < ARRAY_LEN(unit_table); i++)
        if (strlen(unit_table[i].spelling) == length &&
            memcmp(unit_table[i].spelling, word, length) == 0)
            return &unit_table[i];
    return NULL;
}

/* The part after the '/' made part of the unit. */
static int unit_find_per(struct unit *self, const char *word, size_t length)
{
    for (size_t i = 0; i < ARRAY_LEN(unit_per); i++) {
        if (strlen(unit_per[i].spelling) != length ||
            memcmp(unit_per[i].spelling, word, length) != 0)
            continue;
        self->per_s = unit_per[i].per_s;
        self->ratio.den *= unit_per[i].seconds;
        return 0;
    }
    return -1;
}

/* As a whole, else base / time. */
int unit_read(struct unit *self, const char *word, size_t length)
{
    const struct unit *found = unit_find(word, length);
    const char *slash = memchr(word, '/', length);
    size_t base;

    if (found != NULL) {
        *self = *found;
        return 0;
    }
    if (slash == NULL)
        return -1;
    base = (size_t)(slash - word);
    found = unit_find(word, base);
    if (found == NULL || found->per_s != 0 ||
        unit_meanings[found->family][1] == NULL)
        return -1;
    *self = *found;
    return unit_find_per(self, slash + 1, length - base - 1);
}

const char *unit_meaning(const struct unit *self)
{
    return unit_meanings[self->family][self->per_s];
}

unsigned unit_spellings(enum unit_family family,
                        const char *spelling[UNIT_SPELLINGS_MAX])
{
    unsigned count = 0;

    _Static_assert(ARRAY_LEN(unit_table) <= UNIT_SPELLINGS_MAX,
                   "all may be of one family");
    for (size_t i = 0; i < ARRAY_LEN(unit_table); i++)
        if (unit_table[i].family == family && unit_table[i].per_s == 0)
            spelling[count++] = unit_table[i].spelling;
    return count;
}
