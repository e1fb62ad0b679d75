/* tests/firmware/host/base/test_units.c - numbers with units become the
 * formats, exactly. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/units.h"
#include "tests/support/check.h"

#define Q32(a) ((int64_t)((a)*4294967296.0))
#define NS(a)  ((int64_t)(a)*4096)
#define S(a)   NS((a)*INT64_C(1000000000))

#define MM     UNITS_AXIS_MM
#define DEG    UNITS_AXIS_DEG
#define REV    UNITS_AXIS_REV
#define COUNT  UNITS_AXIS_COUNT
#define RAD    UNITS_AXIS_RAD
#define KCOUNT UNITS_AXIS_KCOUNT
#define MCOUNT UNITS_AXIS_MCOUNT

/* ---- values by hand ---- */

static const struct {
    const char *text;
    enum units_quantity quantity;
    enum units_axis unit;
    int64_t want;
} good[] = {
    { "800 mm", UNITS_POSITION, MM, Q32(800) },
    { "800", UNITS_POSITION, MM, Q32(800) },
    { "800mm", UNITS_POSITION, MM, Q32(800) },
    { "  +800  mm ", UNITS_POSITION, MM, Q32(800) },
    { "1.5 m", UNITS_POSITION, MM, Q32(1500) },
    { "-1.5e3", UNITS_POSITION, MM, Q32(-1500) },
    { "1.5E+3 mm", UNITS_POSITION, MM, Q32(1500) },
    { "0.0015e6 mm", UNITS_POSITION, MM, Q32(1500) },
    { ".5 mm", UNITS_POSITION, MM, Q32(0.5) },
    { "5. mm", UNITS_POSITION, MM, Q32(5) },
    { "25 cm", UNITS_POSITION, MM, Q32(250) },
    { "250 um", UNITS_POSITION, MM, Q32(0.25) },
    { "10 in", UNITS_POSITION, MM, Q32(254) },
    { "1 ft", UNITS_POSITION, MM, 1309106031821 }, /* 304.8 */
    { "0", UNITS_POSITION, MM, 0 },
    { "-0.0 mm", UNITS_POSITION, MM, 0 },
    { "45 deg", UNITS_POSITION, DEG, Q32(45) },
    { "0.5 rev", UNITS_POSITION, DEG, Q32(180) },
    { "3 rev", UNITS_POSITION, REV, Q32(3) },
    { "90 deg", UNITS_POSITION, REV, Q32(0.25) },
    { "30 arcmin", UNITS_POSITION, DEG, Q32(0.5) },
    { "900 arcsec", UNITS_POSITION, DEG, Q32(0.25) },
    { "1 rad", UNITS_POSITION, DEG, 246083499208 }, /* 57.29577951308.. */
    { "1000 mrad", UNITS_POSITION, DEG, 246083499208 },
    { "1 rad", UNITS_POSITION, REV, 683565276 }, /* 0.159154943091.. */
    { "12 count", UNITS_POSITION, COUNT, Q32(12) },
    { "1.5 kcount", UNITS_POSITION, COUNT, Q32(1500) },
    { "1.5 Mcount", UNITS_POSITION, COUNT, Q32(1500000) },
    { "1500 count", UNITS_POSITION, KCOUNT, Q32(1.5) },
    { "1.5", UNITS_POSITION, KCOUNT, Q32(1.5) },
    { "2 Mcount", UNITS_POSITION, KCOUNT, Q32(2000) },
    { "1 count", UNITS_POSITION, MCOUNT, 4295 }, /* 4294.97 */
    { "30 kcount/min", UNITS_VELOCITY, KCOUNT, Q32(0.5) },
    { "8388608000 count/s2", UNITS_ACCELERATION, KCOUNT, Q32(8388608) },
    { "8388608000 count/s2", UNITS_ACCELERATION, MCOUNT,
      36028797018964 }, /* 8388.608 */
    { "838860.8 Mcount/s3", UNITS_JERK, KCOUNT, Q32(838860800) },
    { "300 mm/s", UNITS_VELOCITY, MM, Q32(300) },
    { "0.3 m/s", UNITS_VELOCITY, MM, Q32(300) },
    { "6 m/min", UNITS_VELOCITY, MM, Q32(100) },
    { "300", UNITS_VELOCITY, MM, Q32(300) },
    { "30 rpm", UNITS_VELOCITY, DEG, Q32(180) },
    { "30 rpm", UNITS_VELOCITY, REV, Q32(0.5) },
    { "1.5", UNITS_POSITION, RAD, Q32(1.5) },
    { "1500 mrad", UNITS_POSITION, RAD, Q32(1.5) },
    { "180 deg", UNITS_POSITION, RAD, 13493037705 }, /* pi 2^32 */
    { "-1 rev", UNITS_POSITION, RAD, -26986075409 }, /* 2 pi 2^32 */
    { "1 arcsec", UNITS_POSITION, RAD, 20823 },
    { "3600 arcsec/min", UNITS_VELOCITY, RAD, 1249355 }, /* pi/10800 2^32 */
    { "60 rpm", UNITS_VELOCITY, RAD, 26986075409 },
    { "300 mm/s^2", UNITS_ACCELERATION, MM, Q32(300) },
    { "300 mm/s2", UNITS_ACCELERATION, MM, Q32(300) },
    { "0.3 m/s\xC2\xB2", UNITS_ACCELERATION, MM, Q32(300) },
    { "2000 deg/s3", UNITS_JERK, DEG, Q32(2000) },
    { "2000 deg/s^3", UNITS_JERK, DEG, Q32(2000) },
    { "2.5 s", UNITS_TIME, MM, NS(2500000000) },
    { "2.5", UNITS_TIME, MM, NS(2500000000) },
    { "10 ms", UNITS_TIME, MM, NS(10000000) },
    { "125 us", UNITS_TIME, MM, NS(125000) },
    { "1 ns", UNITS_TIME, MM, NS(1) },
    { "2 min", UNITS_TIME, MM, S(120) },
    { "6 h", UNITS_TIME, MM, S(21600) },
    { "-1 s", UNITS_TIME, MM, -S(1) },
    { "frame 120 @ 24", UNITS_TIME, MM, S(5) },
    { "f120 @ 24", UNITS_TIME, MM, S(5) },
    { "f120@24fps", UNITS_TIME, MM, S(5) },
    { "frame 120.5 @ 24.1", UNITS_TIME, MM, S(5) },
    { "frame 24000 @ 24000/1001", UNITS_TIME, MM, S(1001) },
    { "frame 23976 @ 23.976", UNITS_TIME, MM, S(1000) },
    { "frame 1 @ 24", UNITS_TIME, MM, 170666666667 }, /* 1/24 s, rounded */
    { "frame 75", UNITS_TIME, MM, S(3) },             /* the context's 25 */
    { "00:00:05:00 @ 24", UNITS_TIME, MM, S(5) },
    { "00:00:03:00", UNITS_TIME, MM, S(3) }, /* the context's 25 */
    { " 1:00:00:00@24000/1001 ", UNITS_TIME, MM, NS(3603600000000) },
    { "00:10:00;00 @ 30000/1001", UNITS_TIME, MM, NS(599999400000) },
    { "25 Hz", UNITS_FREQUENCY, MM, 157080 }, /* 50 pi 1000 */
    { "1 kHz", UNITS_FREQUENCY, MM, 6283185 },
    { "1 Mbit/s", UNITS_BIT_RATE, MM, 1000000 },
    { "500 kbit/s", UNITS_BIT_RATE, MM, 500000 },
    { "125000", UNITS_BIT_RATE, MM, 125000 },
    { "0.5", UNITS_RATIO, MM, Q32(0.5) },
    { "50 %", UNITS_RATIO, MM, Q32(0.5) },
    { "12.5%", UNITS_RATIO, MM, Q32(0.125) },
    { "80 degC", UNITS_TEMPERATURE, MM, Q32(80) },
    { "-0.5", UNITS_TEMPERATURE, MM, Q32(-0.5) },
    { "56 V", UNITS_VOLTAGE, MM, Q32(56) },
    { "250 mV", UNITS_VOLTAGE, MM, Q32(0.25) },
    { "1.5 A", UNITS_CURRENT, MM, Q32(1.5) },
    { "1500 mA", UNITS_CURRENT, DEG, Q32(1.5) },
    /* half a step goes away from zero, less than half to zero */
    { "0.00000762939453125", UNITS_JERK, MM, 32768 },
    { "-0.00000762939453125", UNITS_JERK, MM, -32768 },
    { "1.1641532182693481e-10", UNITS_JERK, MM, 0 },
    { "0.0001220703125 ns", UNITS_TIME, MM, 1 },
    { "1e-400", UNITS_POSITION, MM, 0 },
    { "0e999999", UNITS_POSITION, MM, 0 },
    { "1.2246467991473532e-16", UNITS_POSITION, MM, 0 }, /* sin(pi) */
    /* the ends of the formats */
    { "2147483647.99999999", UNITS_POSITION, MM, INT64_MAX - 42 },
    { "-2147483647.99999999", UNITS_POSITION, MM, 42 - INT64_MAX },
    { "2147483647.999", UNITS_JERK, MM, INT64_MAX - 4294966 },
    { "2147483.64799999999 m", UNITS_POSITION, MM, INT64_MAX - 42 },
    { "2251799813.685247 ms", UNITS_TIME, MM, NS(2251799813685247) },
    /* eighteen digits, and zeros that do not count as digits */
    { "0.123456789012345678", UNITS_POSITION, MM, 530242871 },
    { "000000000000000000001.50000000000000000000", UNITS_POSITION, MM,
      Q32(1.5) },
    { "0.000000000000000000000000001e27", UNITS_POSITION, MM, Q32(1) },
};

static const struct units_context context_of[] = {
    [MM] = { MM, { 25, 1 } },         [DEG] = { DEG, { 25, 1 } },
    [REV] = { REV, { 25, 1 } },       [COUNT] = { COUNT, { 25, 1 } },
    [RAD] = { RAD, { 25, 1 } },       [KCOUNT] = { KCOUNT, { 25, 1 } },
    [MCOUNT] = { MCOUNT, { 25, 1 } },
};

static void values_are_converted_exactly(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(good); i++) {
        char sentence[UNITS_SENTENCE_MAX] = "";
        int64_t got = 42;
        const int err = units_parse(good[i].text, good[i].quantity,
                                    &context_of[good[i].unit], &got, sentence);
        if (err != 0 || got != good[i].want)
            fail_msg("'%s': %d, got %" PRId64 " want %" PRId64 " %s",
                     good[i].text, err, got, good[i].want, sentence);
    }
}

/* ---- refusals ---- */

static const struct {
    const char *text;
    enum units_quantity quantity;
    enum units_axis unit;
    const char *sentence; /* its beginning */
} bad[] = {
    { "800 kg", UNITS_POSITION, MM,
      "'800 kg' has the unknown unit 'kg', expected a length in mm, m, cm, um, "
      "in or ft" },
    { "45 deg", UNITS_POSITION, MM, "'45 deg' is an angle, expected a length" },
    { "45 mm", UNITS_POSITION, DEG,
      "'45 mm' is a length, expected an angle in deg, rev, rad, mrad, arcmin "
      "or "
      "arcsec" },
    { "45 deg", UNITS_POSITION, COUNT,
      "'45 deg' is an angle, expected a number of counts in count, kcount or "
      "Mcount" },
    { "2 s", UNITS_POSITION, MM, "'2 s' is a time, expected a length" },
    { "300 mm", UNITS_VELOCITY, MM,
      "'300 mm' is a length, expected a speed in mm, m, cm, um, in or ft per s "
      "(mm/s)" },
    { "300 mm/s", UNITS_POSITION, MM, "'300 mm/s' is a speed, expected a" },
    { "300 mm/s3", UNITS_ACCELERATION, MM, "'300 mm/s3' is a jerk, expected" },
    { "3 rpm", UNITS_ACCELERATION, DEG, "'3 rpm' is an angular speed, exp" },
    { "300 mm/h", UNITS_VELOCITY, MM,
      "'300 mm/h' has the unknown unit 'mm/h', expected" },
    { "3 s/s", UNITS_VELOCITY, MM, "'3 s/s' has the unknown unit 's/s', exp" },
    { "3 rpm/s", UNITS_ACCELERATION, DEG, "'3 rpm/s' has the unknown unit" },
    { "3 /s", UNITS_VELOCITY, MM, "'3 /s' has the unknown unit '/s', exp" },
    { "2 mm", UNITS_TIME, MM, "'2 mm' is a length, expected a time in s, ms" },
    { "50 %", UNITS_TIME, MM, "'50 %' is a ratio, expected a time" },
    { "25 mm", UNITS_RATIO, MM, "'25 mm' is a length, expected a number such" },
    { "80 V", UNITS_TEMPERATURE, MM,
      "'80 V' is a voltage, expected a temperature in degC" },
    { "3 degC", UNITS_CURRENT, MM,
      "'3 degC' is a temperature, expected a current in A or mA" },
    { "3 A/s", UNITS_CURRENT, MM, "'3 A/s' has the unknown unit 'A/s'" },
    { "5 mm", UNITS_FREQUENCY, MM, "'5 mm' is a length, expected a frequency" },
    { "5 Hz", UNITS_BIT_RATE, MM, "'5 Hz' is a frequency, expected a bit ra" },
    { "", UNITS_POSITION, MM, "'' is not a number, expected a length" },
    { "mm", UNITS_POSITION, MM, "'mm' is not a number, expected" },
    { ".", UNITS_POSITION, MM, "'.' is not a number, expected" },
    { "-", UNITS_POSITION, MM, "'-' is not a number, expected" },
    { "--1", UNITS_POSITION, MM, "'--1' is not a number, expected" },
    { "e5", UNITS_POSITION, MM, "'e5' is not a number, expected" },
    { "1e", UNITS_POSITION, MM, "'1e' has the unknown unit 'e', expected" },
    { "1.2.3", UNITS_POSITION, MM, "'1.2.3' has the unknown unit '.3', exp" },
    { "1 000", UNITS_POSITION, MM, "'1 000' has the unknown unit '000', exp" },
    { "0x10", UNITS_POSITION, MM, "'0x10' has the unknown unit 'x10', exp" },
    { "0,5 mm", UNITS_POSITION, MM, "'0,5 mm' has a comma in the number" },
    { "nan", UNITS_POSITION, MM, "'nan' is not a number, expected a length" },
    { ".NaN", UNITS_VELOCITY, MM, "'.NaN' is not a number, expected a speed" },
    { "inf mm", UNITS_POSITION, MM, "'inf mm' is infinite, expected a len" },
    { "-.inf", UNITS_POSITION, MM, "'-.inf' is infinite, expected a length" },
    { "1e400", UNITS_POSITION, MM,
      "'1e400' is too large, expected at most 2147483647 mm" },
    { "8388608000 count/s2", UNITS_ACCELERATION, COUNT,
      "'8388608000 count/s2' is too large, expected at most 2147483647 "
      "count/s2; beyond that declare the axis in kcount" },
    { "-3e12", UNITS_POSITION, COUNT,
      "'-3e12' is too large, expected at most 2147483647 count; beyond that "
      "declare the axis in Mcount" },
    { "3e9", UNITS_JERK, KCOUNT,
      "'3e9' is too large, expected at most 2147483647 kcount/s3; beyond that "
      "declare the axis in Mcount" },
    { "6e6 rev/s2", UNITS_ACCELERATION, DEG,
      "'6e6 rev/s2' is too large, expected at most 2147483647 deg/s2; beyond "
      "that declare the axis in rev" },
    { "1e99999999999999999999", UNITS_POSITION, MM,
      "'1e99999999999999999999' is too large" },
    { "2147483648", UNITS_POSITION, MM, "'2147483648' is too large" },
    { "-2147483648", UNITS_POSITION, MM, "'-2147483648' is too large" },
    { "2147483.648 m", UNITS_POSITION, MM, "'2147483.648 m' is too large" },
    { "2147483647.9999999999", UNITS_POSITION, MM,
      "'2147483647.9999999999' has more than 18 digits" },
    { "2147483648", UNITS_ACCELERATION, MM, "'2147483648' is too l" },
    { "1000 h", UNITS_TIME, MM,
      "'1000 h' is too large, expected at most 26 d" },
    { "1234567890123456789", UNITS_POSITION, MM,
      "'1234567890123456789' has more than 18 digits, expected a length" },
    { "frame", UNITS_TIME, MM, "'frame' is not a number, expected a frame" },
    { "frame 5 s", UNITS_TIME, MM, "'frame 5 s' has something after the fra" },
    { "frame 5 @", UNITS_TIME, MM,
      "'frame 5 @' is not a number, expected a "
      "frame rate such as 24" },
    { "frame 5 @ 0", UNITS_TIME, MM, "'frame 5 @ 0' is not a frame rate" },
    { "frame 5 @ -24", UNITS_TIME, MM, "'frame 5 @ -24' is not a frame rate" },
    { "frame 5 @ 1/0", UNITS_TIME, MM, "'frame 5 @ 1/0' is not a frame rate" },
    { "frame 5 @ 1e30", UNITS_TIME, MM,
      "'frame 5 @ 1e30' is not a frame rate" },
    { "frame 5 @ 1e-30", UNITS_TIME, MM,
      "'frame 5 @ 1e-30' is not a frame rate" },
    { "frame 5 @ 24 x", UNITS_TIME, MM,
      "'frame 5 @ 24 x' has something after" },
    { "00:00:05", UNITS_TIME, MM, "'00:00:05' is no timecode, expected HH:" },
    { "00:00:05:00:00", UNITS_TIME, MM, "'00:00:05:00:00' is no timecode" },
    { "-00:00:05:00", UNITS_TIME, MM, "'-00:00:05:00' has the unknown unit" },
    { "00:00:75:00", UNITS_TIME, MM,
      "'00:00:75:00' has more than 59 seconds in a minute" },
    { "00:00:05:25", UNITS_TIME, MM,
      "'00:00:05:25' has more frames in a second than the frame rate" },
    { "00:01:00;00", UNITS_TIME, MM,
      "'00:01:00;00' is drop-frame, which 30000/1001" },
    { "00:01:00;01 @ 30000/1001", UNITS_TIME, MM,
      "'00:01:00;01 @ 30000/1001' is a number that drop-frame" },
    { "00:00:05:00 x", UNITS_TIME, MM,
      "'00:00:05:00 x' has something after the timecode" },
    { "00:00:05:00 @ 0", UNITS_TIME, MM,
      "'00:00:05:00 @ 0' is not a frame rate" },
    { "00:00:05:00", UNITS_POSITION, MM, "'00:00:05:00' has the unknown unit" },
    { "frame 1e300 @ 24", UNITS_TIME, MM, "'frame 1e300 @ 24' is too large" },
    { "frame 5", UNITS_POSITION, MM,
      "'frame 5' is not a number, expected a l" },
    { "1 \x07\x1b[31m", UNITS_POSITION, MM,
      "'1 \\x07\\x1b[31m' has the unknown unit '\\x07\\x1b[31m', expected" },
    { "1 "
      "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa",
      UNITS_POSITION, MM,
      "'1 aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa...' has the unknown unit" },
};

static void refusals_say_what_is_wrong_and_what_was_expected(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(bad); i++) {
        char sentence[UNITS_SENTENCE_MAX] = "";
        int64_t got = 42;
        const int err = units_parse(bad[i].text, bad[i].quantity,
                                    &context_of[bad[i].unit], &got, sentence);
        if (err != -1 || strstr(sentence, ", expected ") == NULL ||
            strncmp(sentence, bad[i].sentence, strlen(bad[i].sentence)) != 0)
            fail_msg("'%s': %d %s", bad[i].text, err, sentence);
    }
}

static void a_frame_needs_a_rate_from_somewhere(void **state)
{
    const struct units_context none = { MM, { 0, 0 } };
    char sentence[UNITS_SENTENCE_MAX];
    int64_t got;

    (void)state;
    assert_int_equal(units_parse("f5", UNITS_TIME, &none, &got, sentence), -1);
    assert_non_null(strstr(sentence, "has no frame rate"));
    assert_int_equal(units_parse("f5 @ 5", UNITS_TIME, &none, &got, sentence),
                     0);
    assert_int_equal(got, S(1));
}

/* ---- frame rates and counts ---- */

static void frame_rates_are_rational(void **state)
{
    static const struct {
        const char *text;
        uint64_t num, den; /* 0: refused */
    } rows[] = {
        { "24", 24, 1 },
        { "25 fps", 25, 1 },
        { "23.976", 2997, 125 },
        { "24000/1001", 24000, 1001 },
        { "30000 / 1001 fps", 30000, 1001 },
        { "59.94", 2997, 50 },
        { "50/2", 25, 1 },
        { "0.1", 1, 10 },
        { "1e9", 1000000000, 1 },
        { "1e-9", 1, 1000000000 },
        { "1e10", 0, 0 },
        { "0", 0, 0 },
        { "-24", 0, 0 },
        { "film", 0, 0 },
        { "24/x", 0, 0 },
        { "1e5/1e-5", 0, 0 },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct units_fps fps = { 0, 0 };
        char sentence[UNITS_SENTENCE_MAX] = "";
        const int err = units_parse_fps(rows[i].text, &fps, sentence);
        if ((err == 0) != (rows[i].num != 0) ||
            (err == 0 && (fps.num != rows[i].num || fps.den != rows[i].den)))
            fail_msg("'%s': %d %" PRIu64 "/%" PRIu64 " %s", rows[i].text, err,
                     fps.num, fps.den, sentence);
    }
}

static void counts_are_rational(void **state)
{
    static const struct {
        const char *text;
        enum units_axis unit;
        int64_t num, den; /* 0: refused */
        const char *sentence;
    } rows[] = {
        { "4096 per mm", MM, 4096, 1, "" },
        { "1000 per rad", UNITS_AXIS_RAD, 1000, 1, "" },
        { "4096", MM, 4096, 1, "" },
        { "-4096 per mm", MM, -4096, 1, "" },
        { "1e6 per m", MM, 1000, 1, "" },
        { "8192 per cm", MM, 4096, 5, "" },
        { "1048576 per rev", DEG, 131072, 45, "" },
        { "1048576 per rev", REV, 1048576, 1, "" },
        { "100 per deg", REV, 36000, 1, "" },
        { "10922.6667 per deg", DEG, 109226667, 10000, "" },
        { "0.25 per count", COUNT, 1, 4, "" },
        { "1 per count", KCOUNT, 1000, 1, "" },
        { "1 per count", MCOUNT, 1000000, 1, "" },
        { "1000 per kcount", COUNT, 1, 1, "" },
        { "4", KCOUNT, 4, 1, "" },
        { "1000 per rad", DEG, 393380582000, 22539047091, "" },
        { "1 per arcmin", DEG, 60, 1, "" },
        { "0 per mm", MM, 0, 0, "'0 per mm' is zero" },
        { "4096 per deg", MM, 0, 0, "'4096 per deg' is an angle" },
        { "4096 per mm/s", MM, 0, 0, "'4096 per mm/s' is a speed" },
        { "4096 mm", MM, 0, 0, "'4096 mm' has no 'per' after" },
        { "per mm", MM, 0, 0, "'per mm' is not a number" },
        { "1e19", MM, 0, 0, "'1e19' does not fit in 63 bits" },
        { "1e-19", MM, 0, 0, "'1e-19' does not fit in 63 bits" },
        { "1e400000", MM, 0, 0, "'1e400000' does not fit in 63 bits" },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        char sentence[UNITS_SENTENCE_MAX] = "";
        int64_t num = 0, den = 0;
        units_parse_counts(rows[i].text, rows[i].unit, &num, &den, sentence);
        if (num != rows[i].num || den != rows[i].den ||
            strncmp(sentence, rows[i].sentence, strlen(rows[i].sentence)) != 0)
            fail_msg("'%s': %" PRId64 "/%" PRId64 " %s", rows[i].text, num, den,
                     sentence);
    }
}

/* ---- properties ---- */

/* mantissa x 10^exp x num / den x 2^frac by school division of __int128,
 * rounded half away from zero; exp < 0, so the divisor is even. */
static int64_t oracle(int64_t mantissa, int exp, int64_t num, int64_t den,
                      unsigned frac)
{
    unsigned __int128 n = (uint64_t)(mantissa < 0 ? -mantissa : mantissa);
    unsigned __int128 d = (unsigned __int128)den;
    int64_t quotient;

    n *= (unsigned __int128)num;
    n <<= frac;
    for (; exp < 0; exp++)
        d *= 10;
    quotient = (int64_t)((n + d / 2) / d);
    return mantissa < 0 ? -quotient : quotient;
}

/* Of 1 .. 18 digits, the first and the last of which may be zeros. */
static int64_t random_mantissa(int digits)
{
    uint64_t limit = 1;
    for (int i = 0; i < digits; i++)
        limit *= 10;
    return (int64_t)(draw() % limit);
}

static void random_decimals_match_a_128_bit_oracle(void **state)
{
    static const struct {
        const char *unit;
        enum units_quantity quantity;
        enum units_axis axis;
        int64_t num, den;
        unsigned frac;
    } rows[] = {
        { "mm", UNITS_POSITION, MM, 1, 1, 32 },
        { "m", UNITS_POSITION, MM, 1000, 1, 32 },
        { "in", UNITS_POSITION, MM, 254, 10, 32 },
        { "arcsec", UNITS_POSITION, DEG, 1, 3600, 32 },
        { "deg", UNITS_POSITION, REV, 1, 360, 32 },
        { "m/min", UNITS_VELOCITY, MM, 1000, 60, 32 },
        { "rev/s2", UNITS_ACCELERATION, DEG, 360, 1, 32 },
        { "count/s2", UNITS_ACCELERATION, KCOUNT, 1, 1000, 32 },
        { "kcount/min", UNITS_VELOCITY, MCOUNT, 1, 60000, 32 },
        { "ms", UNITS_TIME, MM, 1000000, 1, 12 },
        { "%", UNITS_RATIO, MM, 1, 100, 32 },
    };
    const uint64_t first = *check_stream();

    (void)state;
    for (int i = 0; i < 20000; i++) {
        const size_t row = draw() % ARRAY_LEN(rows);
        const int digits = (int)(draw() % 18) + 1;
        const int64_t sign = draw() % 2 == 0 ? 1 : -1;
        const int64_t mantissa = sign * random_mantissa(digits);
        const int exp = -digits - (int)(draw() % 6);
        char text[64], sentence[UNITS_SENTENCE_MAX] = "";
        int64_t got = 0, want;

        snprintf(text, sizeof(text), "%" PRId64 "e%d %s", mantissa, exp,
                 rows[row].unit);
        want =
            oracle(mantissa, exp, rows[row].num, rows[row].den, rows[row].frac);
        if (units_parse(text, rows[row].quantity, &context_of[rows[row].axis],
                        &got, sentence) < 0 ||
            got != want)
            fail_msg("seed %" PRIu64 " run %d '%s': got %" PRId64
                     " want %" PRId64 " %s",
                     first, i, text, got, want, sentence);
    }
}

static void radians_are_good_to_the_last_bit(void **state)
{
    const long double per_rad = 180 / 3.14159265358979323846264338L;
    const uint64_t first = *check_stream();

    (void)state;
    for (int i = 0; i < 5000; i++) {
        const int digits = (int)(draw() % 17) + 1;
        const int64_t mantissa = random_mantissa(digits);
        char text[64], sentence[UNITS_SENTENCE_MAX];
        int64_t got = 0;
        long double want;

        snprintf(text, sizeof(text), "%" PRId64 "e%d rad", mantissa,
                 2 - digits);
        want =
            (long double)mantissa * powl(10, 2 - digits) * per_rad * 4294967296;
        units_parse(text, UNITS_POSITION, &context_of[DEG], &got, sentence);
        if (fabsl((long double)got - want) > 0.501L)
            fail_msg("seed %" PRIu64 " '%s': got %" PRId64 " want %Lf", first,
                     text, got, want);
    }
}

static void any_text_is_a_value_or_one_sentence(void **state)
{
    static const char letters[] = "0123456789.+-e /@%fmsrd^nai\x01\xC2\xB2";
    const uint64_t first = *check_stream();

    (void)state;
    for (int i = 0; i < 20000; i++) {
        char text[24] = "", sentence[UNITS_SENTENCE_MAX] = "";
        const size_t length = draw() % (sizeof(text) - 1);
        int64_t num, den;
        struct units_fps fps;
        int err;

        for (size_t k = 0; k < length; k++)
            text[k] = letters[draw() % (sizeof(letters) - 1)];
        err = units_parse(text, (enum units_quantity)(draw() % 8),
                          &context_of[draw() % 4], &num, sentence);
        if ((err < 0) != (strstr(sentence, ", expected ") != NULL))
            fail_msg("seed %" PRIu64 " '%s': %d %s", first, text, err,
                     sentence);
        units_parse_fps(text, &fps, sentence);
        units_parse_counts(text, DEG, &num, &den, sentence);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_are_converted_exactly),
        cmocka_unit_test(refusals_say_what_is_wrong_and_what_was_expected),
        cmocka_unit_test(a_frame_needs_a_rate_from_somewhere),
        cmocka_unit_test(frame_rates_are_rational),
        cmocka_unit_test(counts_are_rational),
        cmocka_unit_test(random_decimals_match_a_128_bit_oracle),
        cmocka_unit_test(radians_are_good_to_the_last_bit),
        cmocka_unit_test(any_text_is_a_value_or_one_sentence),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
