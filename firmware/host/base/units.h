/* firmware/host/base/units.h - "800 mm", "2.5 s", "f120 @ 24" to integers.
 *
 *   value    = number [ blank ] [ unit ]       a number alone is in the axis's
 *                                              own unit, s, Hz, bit/s, degC, V,
 *                                              A or 1
 *   number   = [ + | - ] digits [ . digits ] [ e [ + | - ] digits ]
 *   frame    = ( "frame" | "f" ) number [ @ rate [ fps ] ]
 *   timecode = HH:MM:SS:FF [ @ rate [ fps ] ]  HH:MM:SS;FF: drop-frame
 *   rate     = number [ / number ]             24, 23.976, 24000/1001
 *   counts   = number [ "per" unit ]           4096 per mm
 *
 * Decimal to binary without a double in between: number, unit and format are
 * one quotient of 128-bit integers, rounded once, to nearest (ties away from
 * zero).  Numbers have at most 18 significant digits; what is smaller than half
 * a step of the format is 0.  Radians use 180/pi = 22539047091/393380582 (2^-65
 * off), circular frequency 2 pi = 14885392687/2369083826 (2^-66 off). */
#ifndef FIRMWARE_HOST_BASE_UNITS_H
#define FIRMWARE_HOST_BASE_UNITS_H

#include <stdint.h>

/* An axis's own unit. */
enum units_axis {
    UNITS_AXIS_MM,
    UNITS_AXIS_DEG,
    UNITS_AXIS_REV,
    UNITS_AXIS_RAD,
    UNITS_AXIS_COUNT,
    UNITS_AXIS_KCOUNT, /* 1000 and */
    UNITS_AXIS_MCOUNT  /* 1,000,000 counts: of a fine encoder */
};
#define UNITS_AXIS_WORDS (UNITS_AXIS_MCOUNT + 1)
extern const char *const units_axis_words[UNITS_AXIS_WORDS]; /* "mm" ... */
const char *units_axis_text(enum units_axis unit);

/* What a value is, which units it may have, and the format it is read into. */
enum units_quantity {
    UNITS_POSITION,     /* Q32.32 of the axis's unit */
    UNITS_VELOCITY,     /* Q32.32, per s */
    UNITS_ACCELERATION, /* Q32.32, per s2 */
    UNITS_JERK,         /* Q32.32, per s3 */
    UNITS_TIME,         /* ns, 12 fraction bits */
    UNITS_FREQUENCY,    /* 1/1000 rad/s, whole */
    UNITS_BIT_RATE,     /* bit/s, whole */
    UNITS_RATIO,        /* Q32.32; a number or % */
    UNITS_TEMPERATURE,  /* Q32.32 of degC */
    UNITS_VOLTAGE,      /* Q32.32 of V */
    UNITS_CURRENT,      /* Q32.32 of A */
};

/* Frames per second num / den, reduced, both 1 .. 1e9; den 0: not known. */
struct units_fps {
    uint64_t num, den;
};

struct units_context {
    enum units_axis unit;
    struct units_fps fps; /* for frames without a rate of their own */
};

/* Room for "'800 kg' has the unknown unit 'kg', expected ...". */
#define UNITS_SENTENCE_MAX 320

/* 0, or -1 with the sentence written and nothing else. */
int units_parse(const char *text, enum units_quantity quantity,
                const struct units_context *context, int64_t *result,
                char sentence[UNITS_SENTENCE_MAX]);
int units_parse_fps(const char *text, struct units_fps *fps,
                    char sentence[UNITS_SENTENCE_MAX]);

/* The whole frame of this time, as "frame 12" is read; -1: it is none. */
int64_t units_frame_of(const struct units_fps *fps, int64_t t_ns_q12);

/* Counts per unit of the axis as num / den, reduced; num is not 0, negative for
 * a reversed axis; den > 0. */
int units_parse_counts(const char *text, enum units_axis unit, int64_t *num,
                       int64_t *den, char sentence[UNITS_SENTENCE_MAX]);

#endif
