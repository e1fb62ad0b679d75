/* tests/firmware/host/exchange/test_import_odd.c - bad values in tables: the row is
 * found and what is odd about it, and where nothing is, nothing is found. */
#include "firmware/host/exchange/import_odd.h"
#include "tests/support/check.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/exchange/import.h"
#include "motion/core/fixed.h"

#define SEED UINT64_C(0x2545F4914F6CDD1D)
#define ROWS 200

static const struct rig_axis pan = {
    .name = "pan",
    .unit = UNITS_AXIS_DEG,
    .limit = { .vel_q32 = 30 * MOTION_FIXED_ONE_Q32,
               .acc_q32 = 30 * MOTION_FIXED_ONE_Q32,
               .jerk_q32 = 90 * MOTION_FIXED_ONE_Q32,
               .pos_min_q32 = -400 * MOTION_FIXED_ONE_Q32,
               .pos_max_q32 = 400 * MOTION_FIXED_ONE_Q32 }
};
static struct plan_key key[ROWS];

static double random_in(uint64_t *seed, double low, double high)
{
    return low +
           (high - low) * (double)check_random_in(seed, 0, 1000000) / 1000000;
}

/* A move of a few sines, so many times as fast as the limits allow, with so many
 * decimals as somebody wrote. */
static struct plan_axis smooth(uint64_t *seed, double fps, double times,
                               int decimals)
{
    const double tens = pow(10, decimals);
    double size[3], omega[3], phase[3], jerk = 0;

    for (int i = 0; i < 3; i++) {
        omega[i] = random_in(seed, 0.3, 1.5);
        size[i] = random_in(seed, 1, 10);
        phase[i] = random_in(seed, 0, 6.28);
        jerk += size[i] * omega[i] * omega[i] * omega[i];
    }
    for (int k = 0; k < ROWS; k++) {
        double p = 0;
        for (int i = 0; i < 3; i++)
            p += times * 90 / jerk * size[i] *
                 sin(omega[i] * k / fps + phase[i]);
        p = round(p * tens) / tens;
        key[k] = (struct plan_key){
            .key = { .t_ns_q12 = llround(k / fps * (double)MOTION_FIXED_S_Q12),
                     .pos_q32 = llround(p * (double)MOTION_FIXED_ONE_Q32) },
            .place = { (uint32_t)k + 2, 1 }
        };
    }
    return (struct plan_axis){ .key = key, .key_count = ROWS, .name = "pan" };
}

static void what_is_only_fast_or_rough_is_not_odd(void **state)
{
    static const double rates[] = { 24, 25, 30, 60, 120 };
    uint64_t seed = SEED;
    (void)state;
    printf("seed %#llx\n", (unsigned long long)SEED);
    for (int i = 0; i < 2000; i++) {
        const double fps = rates[i % 5], times = random_in(&seed, 0.2, 6);
        const int decimals = 2 + i % 8;
        struct plan_axis axis = smooth(&seed, fps, times, decimals);
        struct import_odd odd;
        import_odd(&pan, &axis, &odd);
        if (odd.kind != IMPORT_ODD_NONE)
            fail_msg(
                "%d: %g times as fast, %g fps, %d decimals: kind %d in row "
                "%u",
                i, times, fps, decimals, odd.kind, odd.row + 1);
    }
}

static double pos_of(uint32_t row)
{
    return (double)key[row].key.pos_q32 / (double)MOTION_FIXED_ONE_Q32;
}

static void put(uint32_t row, double pos)
{
    key[row].key.pos_q32 = llround(pos * (double)MOTION_FIXED_ONE_Q32);
}

/* Makes one row odd; false: it would hardly be. */
static bool spoil(enum import_odd_kind kind, uint32_t row, uint64_t *seed)
{
    const double step = pos_of(row) - pos_of(row - 1);

    switch (kind) {
    case IMPORT_ODD_OFF:
        put(row, pos_of(row) + random_in(seed, 3, 11));
        return true;
    case IMPORT_ODD_EXPONENT: /* near 0, as programs write it */
        for (uint32_t i = 0; i < ROWS; i++)
            put(i, pos_of(i) - 0);
        put(row, pos_of(row) * 1e5);
        return fabs(pos_of(row)) > 3;
    case IMPORT_ODD_TURN:
        for (uint32_t i = row; i < ROWS; i++)
            put(i, pos_of(i) - 360);
        return true;
    case IMPORT_ODD_TWICE:
        for (uint32_t i = ROWS - 1; i > row; i--)
            put(i, pos_of(i - 1));
        put(row, pos_of(row - 1));
        return fabs(step) > 0.2;
    case IMPORT_ODD_MISSING:
        for (uint32_t i = row; i + 1 < ROWS; i++)
            put(i, pos_of(i + 1));
        put(ROWS - 1, 2 * pos_of(ROWS - 2) - pos_of(ROWS - 3));
        return fabs(step) > 0.2;
    default:
        for (uint32_t i = row; i < ROWS; i++)
            put(i, pos_of(i) + 20);
        return true;
    }
}

static void a_bad_row_is_found_with_what_is_odd_about_it(void **state)
{
    static const enum import_odd_kind kinds[] = {
        IMPORT_ODD_OFF, IMPORT_ODD_TURN, IMPORT_ODD_TWICE, IMPORT_ODD_STEP,
        IMPORT_ODD_MISSING
    };
    uint64_t seed = SEED;
    unsigned tried = 0, other = 0;
    (void)state;
    for (int i = 0; i < 3000; i++) {
        const enum import_odd_kind kind = kinds[i % 5];
        const uint32_t row = (uint32_t)check_random_in(&seed, 6, ROWS - 7);
        struct plan_axis axis =
            smooth(&seed, 24, random_in(&seed, 0.3, 2), 4 + i % 3);
        struct import_odd odd;
        if (!spoil(kind, row, &seed))
            continue;
        tried++;
        import_odd(&pan, &axis, &odd);
        other += odd.kind != kind;
        /* a jump is between two rows */
        if (odd.kind == IMPORT_ODD_NONE || odd.row > row ||
            odd.row + (kind != IMPORT_ODD_OFF) < row)
            fail_msg("%d: kind %d in row %u, expected %d in row %u", i,
                     odd.kind, odd.row, kind, row);
    }
    printf("%u of %u rows have another reason\n", other, tried);
    assert_true(tried > 1800);
    assert_true(other * 50 <=
                tried); /* where a move turns, a row that is not there
                                          is one that is far from both */
}

/* Of the ends there are neighbours on one side only. */
static void the_first_and_the_last_rows_are_found_too(void **state)
{
    static const uint32_t rows[] = { 0,        1,        2,        3,
                                     ROWS - 4, ROWS - 3, ROWS - 2, ROWS - 1 };
    uint64_t seed = SEED;
    (void)state;
    for (int i = 0; i < 800; i++) {
        const uint32_t row = rows[i % 8];
        struct plan_axis axis = smooth(&seed, 24, 0.8, 5);
        struct import_odd odd;
        put(row, pos_of(row) + 7);
        import_odd(&pan, &axis, &odd);
        if (odd.row != row || odd.kind == IMPORT_ODD_NONE)
            fail_msg("%d: kind %d in row %u, expected row %u", i, odd.kind,
                     odd.row, row);
    }
}

/* Numbers below 10^-4 as str() of Python writes them, cut to twelve characters. */
static void exponents_that_were_cut_off_are_named(void **state)
{
    static const struct {
        double at;
        int exponent;
        const char *reason;
    } rows[] = { { 6.8579282407, -5, "an exponent cut off?" },
                 { -3.25, -5, "an exponent cut off?" },
                 { 9.99, -6, "an exponent cut off?" },
                 { 685793, -9, "a decimal point left out?" } };
    uint64_t seed = SEED;
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct plan_axis axis = smooth(&seed, 24, 0.5, 6);
        struct import_odd odd;
        char text[IMPORT_ODD_MAX];
        for (uint32_t k = 0; k < ROWS; k++) /* slowly away from 0 */
            put(k, 5e-4 * k * k * k / 60);
        put(2, rows[i].at);
        import_odd(&pan, &axis, &odd);
        assert_int_equal(odd.row, 2);
        assert_int_equal(odd.kind, IMPORT_ODD_EXPONENT);
        import_odd_text(&odd, &pan, &axis, text);
        if (strstr(text, "row 3 (line 4), ") == NULL ||
            strstr(text, rows[i].reason) == NULL)
            fail_msg("%s", text);
    }
}

static void all_odd_rows_are_counted(void **state)
{
    uint64_t seed = SEED;
    struct plan_axis axis = smooth(&seed, 24, 0.5, 5);
    struct import_odd odd;
    char text[IMPORT_ODD_MAX];
    (void)state;
    put(150, pos_of(150) + 9);
    put(31, pos_of(31) - 5);
    put(32, pos_of(32) + 8);
    put(90, pos_of(90) + 7);
    import_odd(&pan, &axis, &odd);
    assert_in_range(odd.row, 31, 32);
    assert_int_equal(odd.more, 2);
    import_odd_text(&odd, &pan, &axis, text);
    assert_non_null(strstr(text, "; and so in 2 other places"));

    axis = smooth(&seed, 24, 0.5, 5);
    for (uint32_t i = 60; i < 120; i++) /* there and back */
        put(i, pos_of(i) + 360);
    import_odd(&pan, &axis, &odd);
    assert_int_equal(odd.kind, IMPORT_ODD_TURN);
    assert_int_equal(odd.row, 60);
    assert_int_equal(odd.more, 1);
}

static void few_rows_and_rows_that_stand_are_not_odd(void **state)
{
    uint64_t seed = SEED;
    struct plan_axis axis = smooth(&seed, 24, 0.5, 5);
    struct import_odd odd;
    (void)state;
    for (uint32_t count = 1; count < 12; count++) {
        axis.key_count = count;
        import_odd(&pan, &axis, &odd);
        assert_int_equal(odd.kind, IMPORT_ODD_NONE);
    }
    axis.key_count = ROWS;
    for (uint32_t i = 0; i < ROWS; i++)
        put(i, 12.5);
    import_odd(&pan, &axis, &odd);
    assert_int_equal(odd.kind, IMPORT_ODD_NONE);
}

/* Make keys like waypoints of a robot: few, and seconds apart. */
static struct plan_axis few(const double pos[], uint32_t count, double s)
{
    for (uint32_t k = 0; k < count; k++) {
        key[k] = (struct plan_key){
            .key = { .t_ns_q12 = llround(k * s * (double)MOTION_FIXED_S_Q12) },
            .place = { k + 2, 1 }
        };
        put(k, pos[k]);
    }
    return (struct plan_axis){ .key = key, .key_count = count, .name = "pan" };
}

static void of_few_rows_a_wrap_and_a_row_that_is_off_are_named(void **state)
{
    static const struct {
        const char *name;
        double pos[8], s;
        uint32_t count;
        enum import_odd_kind kind;
        uint32_t row, more;
    } rows[] = {
        { "wrap", { 160, 170, -179, -170 }, 0.5, 4, IMPORT_ODD_TURN, 2, 0 },
        { "down", { -160, -170, 179, 170 }, 0.5, 4, IMPORT_ODD_TURN, 2, 0 },
        { "in frames",
          { 178, 179, -180, -179 },
          0.04,
          4,
          IMPORT_ODD_TURN,
          2,
          0 },
        { "and back",
          { 170, 178, -178, -179, 175, 170 },
          0.5,
          6,
          IMPORT_ODD_TURN,
          2,
          1 },
        { "off", { 0, 1, 160, 3, 4 }, 0.25, 5, IMPORT_ODD_OFF, 2, 0 },
        { "off below",
          { 10, 11, -80, 13, 14, 15 },
          0.1,
          6,
          IMPORT_ODD_OFF,
          2,
          0 },
        { "both",
          { 0, 150, 1, 5, 350, 345, 340 },
          0.5,
          7,
          IMPORT_ODD_OFF,
          1,
          1 },
        /* too fast, and nothing else: more time cures it */
        { "to and fro", { 0, 100, 0 }, 0.2, 3, IMPORT_ODD_NONE, 0, 0 },
        { "one way",
          { 0, 5, 10, 300, 305, 310 },
          0.5,
          6,
          IMPORT_ODD_NONE,
          0,
          0 },
        { "whole turns", { 0, 360, 720, 1080 }, 0.5, 4, IMPORT_ODD_NONE, 0, 0 },
        { "a whole turn", { 0, 0, 360, 360 }, 0.5, 4, IMPORT_ODD_NONE, 0, 0 },
        { "two rows", { 179, -179 }, 0.5, 2, IMPORT_ODD_NONE, 0, 0 },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct plan_axis axis = few(rows[i].pos, rows[i].count, rows[i].s);
        struct import_odd odd;
        import_odd(&pan, &axis, &odd);
        if (odd.kind != rows[i].kind || odd.row != rows[i].row ||
            odd.more != rows[i].more)
            fail_msg("%s: kind %d in row %u and %u more", rows[i].name,
                     odd.kind, odd.row, odd.more);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_only_fast_or_rough_is_not_odd),
        cmocka_unit_test(a_bad_row_is_found_with_what_is_odd_about_it),
        cmocka_unit_test(the_first_and_the_last_rows_are_found_too),
        cmocka_unit_test(exponents_that_were_cut_off_are_named),
        cmocka_unit_test(all_odd_rows_are_counted),
        cmocka_unit_test(of_few_rows_a_wrap_and_a_row_that_is_off_are_named),
        cmocka_unit_test(few_rows_and_rows_that_stand_are_not_odd),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
