/* tests/firmware/host/recording/test_row_notes.c - what rows say in words: the first
 * at once, what follows within a second together, and nothing that was there before. */
#include "firmware/host/recording/row_notes.h"

#include <string.h>

#include "tests/support/check.h"

#define MS INT64_C(1000000)

static struct rig_axis rig_axes[] = {
    { .name = "dolly", .unit = UNITS_AXIS_MM },
    { .name = "pan", .unit = UNITS_AXIS_DEG },
};
static struct rig_bus rig_buses[] = { { .name = "can0" }, { .name = "can1" } };
static const struct rig rig = {
    .axis = rig_axes,
    .axis_count = ARRAY_LEN(rig_axes),
    .bus = rig_buses,
    .bus_count = ARRAY_LEN(rig_buses),
};

static struct telemetry_axis axis[2];
static uint32_t bus_warnings[2];
static struct row_notes notes;
static char said[1024];

static void say(void *context, const struct telemetry_row *row,
                const char *text)
{
    assert_ptr_equal(context, &rig);
    assert_ptr_equal(row->axis, axis);
    strcat(strcat(said, text), "\n");
}

/* What a row at this time says. */
static const char *at(int64_t t_ns)
{
    const struct telemetry_row row = { .t_ns = t_ns,
                                       .axis = axis,
                                       .bus_warnings = bus_warnings };
    said[0] = '\0';
    row_notes_take(&notes, &row, say, (void *)(uintptr_t)&rig);
    return said;
}

static int begin(int64_t every_ns)
{
    memset(axis, 0, sizeof axis);
    memset(bus_warnings, 0, sizeof bus_warnings);
    row_notes_init(&notes, &rig, every_ns);
    return 0;
}

static int once_in_a_second(void **state)
{
    (void)state;
    return begin(1000 * MS);
}

static int each(void **state)
{
    (void)state;
    return begin(0);
}

static int end(void **state)
{
    (void)state;
    row_notes_free(&notes);
    return 0;
}

static void what_was_there_is_no_news(void **state)
{
    (void)state;
    axis[1].events.count[HAL_DRIVE_EVENT_WARNING] = 5;
    axis[0].warning = (struct warning){ .number = 3 };
    bus_warnings[0] = 9;
    assert_string_equal(at(77 * MS), "");
    assert_string_equal(at(5000 * MS), "");
}

static void the_first_at_once_and_others_together(void **state)
{
    (void)state;
    assert_string_equal(at(0), "");
    axis[1].events.count[HAL_DRIVE_EVENT_WARNING] = 1;
    assert_string_equal(at(10 * MS), "pan: warning 1\n");
    axis[1].events.count[HAL_DRIVE_EVENT_WARNING] = 4;
    axis[1].events.count[HAL_DRIVE_EVENT_EMERGENCY] = 1;
    axis[1].events.emergency_code = 0x8130;
    axis[0].events.count[HAL_DRIVE_EVENT_LIMIT] = 1; /* is another drive */
    assert_string_equal(at(500 * MS), "dolly: internal limit 1\n");
    assert_string_equal(at(1009 * MS), "");
    assert_string_equal(at(1010 * MS),
                        "pan: warning 3, emergency message 1 (0x8130)\n");
    bus_warnings[1] = 1;
    assert_string_equal(at(1011 * MS), "bus can1: error-warning\n");
    bus_warnings[1] = 3;
    assert_string_equal(at(2010 * MS), "");
    assert_string_equal(at(2011 * MS), "bus can1: error-warning\n");
    assert_string_equal(at(9000 * MS), "");
}

/* Each has begun once, and lasts. */
static void warnings_of_axes_do_not_wait(void **state)
{
    (void)state;
    assert_string_equal(at(0), "");
    for (uint32_t i = 1; i < 4; i++) {
        axis[0].warning = (struct warning){ .number = i,
                                            .kind = WARNING_FOLLOWING,
                                            .value_q32 = (int64_t)3 << 30,
                                            .limit_q32 = (int64_t)1 << 32 };
        assert_string_equal(at(i * MS),
                            "dolly: following error over half of its limit, "
                            "0.75 of 1 mm\n");
    }
}

static void without_a_time_each_is_said(void **state)
{
    (void)state;
    assert_string_equal(at(0), "");
    for (uint32_t i = 1; i < 4; i++) {
        axis[0].events.count[HAL_DRIVE_EVENT_WARNING] = i;
        bus_warnings[0] = i;
        assert_string_equal(at(i * MS),
                            "dolly: warning 1\nbus can0: error-warning\n");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(what_was_there_is_no_news,
                                        once_in_a_second, end),
        cmocka_unit_test_setup_teardown(the_first_at_once_and_others_together,
                                        once_in_a_second, end),
        cmocka_unit_test_setup_teardown(warnings_of_axes_do_not_wait,
                                        once_in_a_second, end),
        cmocka_unit_test_setup_teardown(without_a_time_each_is_said, each, end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
