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

#include "firmware/host/base/quote.h"
#include "firmware/host/base/timecode.h"
#include "firmware/host/base/unit.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define UNITS_WORD_MAX     24
#define UNITS_EXPECTED_MAX 160

/* How a format is reached from the family's base unit. */
static const struct {
    unsigned frac;
    struct decimal_ratio base;
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
    [UNITS_TEMPERATURE] = { 32, { 1, 1, 0 }, "2147483647" },
    [UNITS_VOLTAGE] = { 32, { 1, 1, 0 }, "2147483647" },
    [UNITS_CURRENT] = { 32, { 1, 1, 0 }, "2147483647" },
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

/* The unit a quantity is wanted in: `ratio` is that of a number alone. */
static struct unit units_wanted(enum units_quantity quantity,
                                enum units_axis unit)
{
    struct unit wanted = { "", UNIT_NUMBER, 0, { 1, 1, 0 } };

    switch (quantity) {
    case UNITS_POSITION:
    case UNITS_VELOCITY:
    case UNITS_ACCELERATION:
    case UNITS_JERK:
        (void)unit_read(&wanted, units_axis_words[unit],
                        strlen(units_axis_words[unit]));
        wanted.per_s = (unsigned)(quantity - UNITS_POSITION);
        break;
    case UNITS_TIME:
        wanted.family = UNIT_DURATION;
        break;
    case UNITS_FREQUENCY:
        wanted.family = UNIT_HERTZ;
        break;
    case UNITS_BIT_RATE:
        wanted.family = UNIT_BITS;
        break;
    case UNITS_TEMPERATURE:
        wanted.family = UNIT_CELSIUS;
        break;
    case UNITS_VOLTAGE:
        wanted.family = UNIT_VOLTS;
        break;
    case UNITS_CURRENT:
        wanted.family = UNIT_AMPERES;
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
    struct unit wanted;
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
    const struct unit *wanted = &self->wanted;
    const char *spelling[UNIT_SPELLINGS_MAX];
    char list[QUOTE_LIST_MAX];
    unsigned count;

    if (self->expected != NULL)
        return self->expected;
    if (wanted->family == UNIT_NUMBER)
        return "a number such as 0.5 or 50 %";
    count = unit_spellings(wanted->family, spelling);
    snprintf(expected, UNITS_EXPECTED_MAX, "%s in %.80s", unit_meaning(wanted),
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

static int units_read_number(struct units_text *self, struct decimal *number)
{
    const char *wrong;

    units_skip_blanks(self);
    wrong = decimal_read(number, &self->at);
    if (wrong != NULL)
        return units_refuse(self, "%s", wrong);
    units_skip_blanks(self);
    return 0;
}

/* The rest of the text as a unit; nothing left: the wanted one. */
static int units_read_unit(struct units_text *self, struct unit *unit)
{
    char quote[QUOTE_MAX];
    size_t length;

    while (self->end > self->at && self->end[-1] == ' ')
        self->end--;
    length = (size_t)(self->end - self->at);
    *unit = self->wanted;
    if (length == 0)
        return 0;
    if (unit_read(unit, self->at, length) < 0)
        return units_refuse(
            self, "has the unknown unit %s",
            quote_text(quote, self->at,
                       length < UNITS_WORD_MAX ? length : UNITS_WORD_MAX));
    if (unit->family != self->wanted.family ||
        unit->per_s != self->wanted.per_s)
        return units_refuse(self, "is %s", unit_meaning(unit));
    return 0;
}

/* ---- values ---- */

/* number x ratio in `wanted`'s unit (or the base), in the quantity's format. */
static int units_value(const struct decimal *number,
                       const struct decimal_ratio *ratio,
                       const struct unit *wanted, enum units_quantity quantity,
                       int64_t *result)
{
    const struct decimal_ratio *own = &wanted->ratio;
    const struct decimal_ratio *base = &units_format[quantity].base;
    const uint64_t same = decimal_gcd(ratio->num, own->num);
    const uint64_t under = decimal_gcd(ratio->den, own->den);
    const struct decimal_ratio whole = {
        ratio->num / same * base->num * (own->den / under),
        ratio->den / under * base->den * (own->num / same),
        ratio->exp10 + base->exp10
    };

    return decimal_scale(number, &whole, units_format[quantity].frac, result);
}

/* The axis's unit that holds the value, the smallest; NULL where none does. */
static const char *units_axis_for(const struct units_text *self,
                                  const struct decimal *number,
                                  const struct decimal_ratio *ratio)
{
    for (unsigned i = 0; i < UNITS_AXIS_WORDS; i++) {
        const struct unit larger =
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
                           const struct decimal *number,
                           const struct decimal_ratio *ratio)
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
                         const struct decimal *number,
                         const struct decimal_ratio *ratio, int64_t *result)
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
static int units_fps_part(const struct decimal *number, struct units_fps *part)
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
    struct decimal number;
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
    same = decimal_gcd(fps->num, fps->den);
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
    struct decimal number;

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
    return units_convert(
        self, &number, &(struct decimal_ratio){ fps.den, fps.num, 0 }, result);
}

/* Digits, then a colon. */
static bool units_is_timecode(const struct units_text *self)
{
    const char *at = self->at;

    while (decimal_is_digit(*at))
        at++;
    return self->quantity == UNITS_TIME && at > self->at && *at == ':';
}

/* timecode [ @ rate ] as a time: that of its frame. */
static int units_read_timecode(struct units_text *self, int64_t *result)
{
    struct units_fps fps = self->context->fps;
    struct decimal number = { 0 };
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
    return units_convert(
        self, &number, &(struct decimal_ratio){ fps.den, fps.num, 0 }, result);
}

int units_parse(const char *text, enum units_quantity quantity,
                const struct units_context *context, int64_t *result,
                char sentence[UNITS_SENTENCE_MAX])
{
    struct units_text self = units_begin(text, quantity, context, sentence);
    struct decimal number;
    struct unit unit;

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

int64_t units_frame_of(const struct units_fps *fps, int64_t t_ns_q12)
{
    int64_t frame, at_ns_q12;

    if (fps->den == 0 || t_ns_q12 < 0 ||
        motion_fixed_muldiv(t_ns_q12, (int64_t)fps->num, MOTION_FIXED_S_Q12,
                            &frame) < 0)
        return -1;
    frame = (frame + (int64_t)fps->den / 2) / (int64_t)fps->den;
    return frame < INT64_C(1) << 30 &&
                   motion_fixed_muldiv(frame * (int64_t)fps->den,
                                       MOTION_FIXED_S_Q12, (int64_t)fps->num,
                                       &at_ns_q12) == MOTION_OK &&
                   at_ns_q12 == t_ns_q12
               ? frame
               : -1;
}

/* ---- counts per unit ---- */

/* number / ratio, reduced. */
static bool units_counts_over(const struct decimal *number,
                              const struct decimal_ratio *ratio, uint64_t *num,
                              uint64_t *den)
{
    int exp10 = number->exp10 - ratio->exp10;
    uint64_t same;

    *num = number->mantissa;
    *den = ratio->num;
    for (; exp10 > 0; exp10--)
        if (!decimal_mul_whole(num, 10))
            return false;
    for (; exp10 < 0; exp10++)
        if (!decimal_mul_whole(den, 10))
            return false;
    same = decimal_gcd(*num, *den);
    *num /= same;
    *den /= same;
    return decimal_mul_whole(num, ratio->den);
}

int units_parse_counts(const char *text, enum units_axis unit, int64_t *num,
                       int64_t *den, char sentence[UNITS_SENTENCE_MAX])
{
    const struct units_context context = { .unit = unit };
    struct units_text self =
        units_begin(text, UNITS_POSITION, &context, sentence);
    struct decimal number;
    struct unit per;
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
    /* per the axis's own unit they cancel, also pi of a radian */
    const bool is_own = per.ratio.num == self.wanted.ratio.num &&
                        per.ratio.den == self.wanted.ratio.den &&
                        per.ratio.exp10 == self.wanted.ratio.exp10;
    const struct decimal_ratio one = { 1, 1, 0 },
                               from = is_own ? one : per.ratio,
                               to = is_own ? one : self.wanted.ratio;
    if (!units_counts_over(&number, &from, &above, &below) ||
        !decimal_mul_whole(&above, to.num) ||
        !decimal_mul_whole(&below, to.den))
        return units_refuse(&self, "does not fit in 63 bits");
    same = decimal_gcd(above, below);
    *num = (int64_t)(above / same);
    *den = (int64_t)(below / same);
    if (number.negative)
        *num = -*num;
    return 0;
}
