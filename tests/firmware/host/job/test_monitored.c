/* tests/firmware/host/job/test_monitored.c - what is said of the limits that a rig
 * has for its drives. */
#include <string.h>

#include "firmware/host/base/json.h"
#include "firmware/host/job/monitored.h"
#include "tests/support/check.h"

static struct rig_axis axes[] = {
    { .name = "dolly", .kind = RIG_ODRIVE },
    { .name = "pan", .kind = RIG_MOTEUS },
    { .name = "crank", .kind = RIG_VIRTUAL, .bus = RIG_NO_BUS },
};
static struct rig rig = { .axis = axes, .axis_count = ARRAY_LEN(axes) };

static int begin(void **state)
{
    (void)state;
    memset(&axes[0].monitor, 0, sizeof axes[0].monitor);
    memset(&axes[1].monitor, 0, sizeof axes[1].monitor);
    rig.axis_count = ARRAY_LEN(axes);
    return 0;
}

static void limit(struct rig_axis *axis, enum hal_reading reading,
                  int32_t low_milli, int32_t high_milli)
{
    axis->monitor.wanted |= 1u << (unsigned)reading;
    axis->monitor.limit[reading] =
        (struct drive_monitor_limit){ low_milli, high_milli };
}

static void says(const char *wanted)
{
    char text[400];
    FILE *file = tmpfile();
    assert_non_null(file);
    monitored_print(&rig, file);
    rewind(file);
    text[fread(text, 1, sizeof text - 1, file)] = '\0';
    fclose(file);
    assert_string_equal(text, wanted);
}

static void none_is_one_line(void **state)
{
    (void)state;
    says("monitored: no drive, as no limits of temperature, voltage or current "
         "are given\n");
}

static void some_are_one_line(void **state)
{
    (void)state;
    limit(&axes[0], HAL_READING_TEMPERATURE, INT32_MIN, 80000);
    limit(&axes[0], HAL_READING_VOLTAGE, 20000, 56500);
    says("monitored: dolly (temperature to 80 degC, bus voltage 20 to 56.5 V); "
         "no limits are given for pan\n");
    limit(&axes[1], HAL_READING_CURRENT, INT32_MIN, 12000);
    says("monitored: dolly (temperature to 80 degC, bus voltage 20 to 56.5 V), "
         "pan (current to 12 A)\n");
}

static void without_a_drive_there_is_nothing_to_say(void **state)
{
    struct rig virtual_rig = { .axis = &axes[2], .axis_count = 1 };
    char text[8];
    FILE *file = tmpfile();
    (void)state;
    assert_non_null(file);
    monitored_print(&virtual_rig, file);
    rewind(file);
    assert_int_equal(fread(text, 1, sizeof text, file), 0);
    fclose(file);
}

static void json_has_a_range_per_reading(void **state)
{
    cJSON *report = cJSON_CreateObject();
    (void)state;
    limit(&axes[1], HAL_READING_VOLTAGE, 20000, 56000);
    limit(&axes[1], HAL_READING_CURRENT, INT32_MIN, 12000);
    monitored_json(&rig, report);
    const cJSON *all = cJSON_GetObjectItem(report, "monitored");
    const cJSON *pan = cJSON_GetObjectItem(all, "pan");
    const cJSON *current = cJSON_GetObjectItem(pan, "current");
    assert_null(cJSON_GetObjectItem(all, "dolly"));
    assert_true(cJSON_GetArrayItem(cJSON_GetObjectItem(pan, "voltage"), 0)
                    ->valuedouble == 20);
    assert_true(cJSON_IsNull(cJSON_GetArrayItem(current, 0)));
    assert_true(cJSON_GetArrayItem(current, 1)->valuedouble == 12);
    assert_null(cJSON_GetObjectItem(pan, "temperature"));
    cJSON_Delete(report);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(none_is_one_line, begin),
        cmocka_unit_test_setup(some_are_one_line, begin),
        cmocka_unit_test_setup(without_a_drive_there_is_nothing_to_say, begin),
        cmocka_unit_test_setup(json_has_a_range_per_reading, begin),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
