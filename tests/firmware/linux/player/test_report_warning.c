/* tests/firmware/linux/player/test_report_warning.c - how warnings are counted,
 * and what is said of them. */
#include <string.h>

#include "firmware/host/base/json.h"
#include "firmware/linux/player/report_warning.h"
#include "motion/core/fixed.h"
#include "tests/support/check.h"

#define UNIT MOTION_FIXED_ONE_Q32
#define MS   INT64_C(1000000)

static const struct rig_axis rail = { .name = "rail", .unit = UNITS_AXIS_MM };
static struct report_warnings warnings;

static void take(uint32_t number, int64_t value_q32, int64_t t_ns)
{
    const struct warning newest = { .number = number,
                                    .kind = WARNING_FOLLOWING,
                                    .value_q32 = value_q32,
                                    .limit_q32 = 2 * UNIT };
    report_warning_take(&warnings, &newest, t_ns);
}

static void said(char *text, size_t size)
{
    FILE *file = tmpfile();
    assert_non_null(file);
    report_warning_print(&warnings, &rail, file);
    rewind(file);
    text[fread(text, 1, size - 1, file)] = 0;
    fclose(file);
}

static void the_first_is_kept_and_all_are_counted(void **state)
{
    char text[256];
    struct cJSON *item = cJSON_CreateObject();
    (void)state;
    take(0, UNIT, 0);
    said(text, sizeof text);
    report_warning_json(&warnings, item);
    assert_string_equal(text, "");
    assert_null(item->child);
    take(1, -UNIT - UNIT / 4, 3400 * MS);
    take(1, -UNIT - UNIT / 4, 3401 * MS);
    take(2, UNIT, 5000 * MS);
    said(text, sizeof text);
    report_warning_json(&warnings, item);
    assert_string_equal(text,
                        "events: rail: following error over half of its limit "
                        "2 (first -1.25 of 2 mm after 3.400 s of the run)\n");
    const struct cJSON *json =
        cJSON_GetObjectItem(item, "following_error_warning");
    assert_non_null(json);
    assert_int_equal(cJSON_GetObjectItem(json, "count")->valueint, 2);
    assert_true(cJSON_GetObjectItem(json, "following_error")->valuedouble ==
                -1.25);
    assert_true(cJSON_GetObjectItem(json, "limit")->valuedouble == 2);
    assert_true(cJSON_GetObjectItem(json, "after_s")->valuedouble == 3.4);
    cJSON_Delete(item);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_first_is_kept_and_all_are_counted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
