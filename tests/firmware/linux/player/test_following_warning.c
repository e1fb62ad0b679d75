/* tests/firmware/linux/player/test_following_warning.c - at which following error
 * there is an event, how often, and what is said of it. */
#include <string.h>

#include "firmware/host/base/json.h"
#include "firmware/linux/player/following_warning.h"
#include "motion/core/fixed.h"
#include "tests/support/check.h"

#define UNIT MOTION_FIXED_ONE_Q32
#define MS   INT64_C(1000000)

/* 2 mm, and from 100 mm/s on 20 ms of the speed. */
static const struct rig_axis rail = { .name = "rail",
                                      .unit = UNITS_AXIS_MM,
                                      .following_floor_q32 = 2 * UNIT,
                                      .following_k_ns = 20 * MS };

static struct following_warning warning;

static int begin(void **state)
{
    (void)state;
    memset(&warning, 0, sizeof warning);
    return 0;
}

static uint32_t take(int64_t t_ns, int64_t off_q32, int64_t vel_q32)
{
    const struct telemetry_axis at = { .following_q32 = off_q32,
                                       .demand.vel_q32 = vel_q32 };
    following_warning_take(&warning, &rail, &at, t_ns);
    return warning.count;
}

static void it_comes_over_half_of_the_limit(void **state)
{
    static const struct {
        int64_t off_q32, vel_q32;
        uint32_t count;
    } rows[] = {
        { 0, 0, 0 },
        { UNIT, 0, 0 },
        { UNIT + 1, 0, 1 },
        { -UNIT, 0, 0 },
        { -UNIT - 1, 0, 1 },
        { UNIT + 1, 100 * UNIT, 1 },
        { 2 * UNIT, 200 * UNIT, 0 },
        { 2 * UNIT + 1, -200 * UNIT, 1 },
        { INT64_MIN, 0, 1 },
        { 4 * UNIT, INT64_MIN, 0 }, /* no number for the limit */
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        memset(&warning, 0, sizeof warning);
        if (take(0, rows[i].off_q32, rows[i].vel_q32) != rows[i].count)
            fail_msg("row %zu: %u", i, warning.count);
    }
}

static void it_is_one_until_it_has_been_below_three_eighths(void **state)
{
    (void)state;
    assert_int_equal(take(1 * MS, UNIT + UNIT / 2, 0), 1);
    assert_int_equal(take(2 * MS, UNIT * 9 / 10, 0), 1);
    assert_int_equal(take(3 * MS, UNIT + UNIT / 4, 0), 1);
    assert_int_equal(take(4 * MS, UNIT * 3 / 4, 0), 1);
    assert_int_equal(take(5 * MS, UNIT + 1, 0), 1);
    assert_int_equal(take(6 * MS, UNIT * 3 / 4 - 1, 0), 1);
    assert_int_equal(take(7 * MS, UNIT + 1, 0), 2);
    assert_int_equal(take(8 * MS, UNIT + 2, 0), 2);
    /* what is kept is of the first one */
    assert_int_equal(warning.t_ns, 1 * MS);
    assert_true(warning.following_q32 == UNIT + UNIT / 2);
    assert_true(warning.limit_q32 == 2 * UNIT);
}

static void said(char *text, size_t size)
{
    FILE *file = tmpfile();
    assert_non_null(file);
    following_warning_print(&warning, &rail, file);
    rewind(file);
    text[fread(text, 1, size - 1, file)] = 0;
    fclose(file);
}

static void it_is_said_in_text_and_json(void **state)
{
    char text[256];
    struct cJSON *item = cJSON_CreateObject();
    (void)state;
    said(text, sizeof text);
    following_warning_json(&warning, item);
    assert_string_equal(text, "");
    assert_null(item->child);
    take(3400 * MS, -UNIT - UNIT / 4, 0);
    said(text, sizeof text);
    following_warning_json(&warning, item);
    assert_string_equal(text,
                        "events: rail: following error over half of its limit "
                        "1 (first -1.25 of 2 mm after 3.400 s of the run)\n");
    const struct cJSON *said_json =
        cJSON_GetObjectItem(item, "following_error_warning");
    assert_non_null(said_json);
    assert_int_equal(cJSON_GetObjectItem(said_json, "count")->valueint, 1);
    assert_true(cJSON_GetObjectItem(said_json, "limit")->valuedouble == 2);
    assert_true(cJSON_GetObjectItem(said_json, "after_s")->valuedouble == 3.4);
    cJSON_Delete(item);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(it_comes_over_half_of_the_limit, begin),
        cmocka_unit_test_setup(it_is_one_until_it_has_been_below_three_eighths,
                               begin),
        cmocka_unit_test_setup(it_is_said_in_text_and_json, begin),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
