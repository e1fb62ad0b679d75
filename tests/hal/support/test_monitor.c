/* tests/hal/support/test_monitor.c - a drive that does nothing, and what is said of
 * its readings. */
#include <stdio.h>
#include <string.h>

#include "hal/support/monitor.h"
#include "tests/support/check.h"

#define MS      INT64_C(1000000)
#define TICK_NS MS

static struct hal_drive_feedback said; /* by the drive itself */
static enum hal_drive_request asked;
static unsigned requests, targets;
static struct hal_readings readings;
static struct drive_monitor monitor;
static int64_t now_ns;

static void inner_request(struct hal_drive *drive,
                          enum hal_drive_request request)
{
    (void)drive;
    asked = request;
    requests++;
}

static int inner_set_target(struct hal_drive *drive,
                            const struct hal_drive_target *target)
{
    (void)drive;
    (void)target;
    targets++;
    return MOTION_OK;
}

static void inner_feedback(struct hal_drive *drive,
                           struct hal_drive_feedback *feedback)
{
    (void)drive;
    *feedback = said;
}

static const struct hal_drive_ops inner_ops = {
    .request = inner_request,
    .set_target = inner_set_target,
    .feedback = inner_feedback,
};
static struct hal_drive inner = { &inner_ops };

static const struct drive_monitor_limit limits[HAL_READINGS] = {
    [HAL_READING_TEMPERATURE] = { INT32_MIN, 80000 },
    [HAL_READING_VOLTAGE] = { 20000, 56000 },
    [HAL_READING_CURRENT] = { INT32_MIN, 12000 },
};

static void tick(void)
{
    now_ns += TICK_NS;
    drive_monitor_step(&monitor, now_ns);
}

static void ticks(int64_t ns)
{
    for (int64_t i = 0; i < ns / TICK_NS; i++)
        tick();
}

/* An answer, and the tick that has it. */
static void answer(enum hal_reading reading, int32_t milli)
{
    assert_true(hal_readings_put(&readings, reading, milli, now_ns + TICK_NS));
    tick();
}

static struct hal_drive_feedback seen(void)
{
    struct hal_drive_feedback feedback;
    hal_drive_feedback(&monitor.drive, &feedback);
    return feedback;
}

static int begin_with(unsigned wanted)
{
    now_ns = 1000 * MS;
    requests = targets = 0;
    memset(&said, 0, sizeof said);
    said.state = HAL_DRIVE_ENABLED;
    memset(&readings, 0, sizeof readings);
    readings.wanted = wanted;
    return drive_monitor_init(&monitor, &inner, &readings, limits);
}

static int begin(void **state)
{
    (void)state;
    return begin_with(1u << HAL_READING_TEMPERATURE);
}

static void near_its_limit_is_a_level(void **state)
{
    static const struct {
        enum hal_reading reading;
        int32_t milli, limit_milli;
        bool is_over, is_below;
    } rows[] = {
        { HAL_READING_TEMPERATURE, 71999, 80000, false, false },
        { HAL_READING_TEMPERATURE, 72000, 80000, true, false },
        { HAL_READING_TEMPERATURE, 68000, 80000, false, false },
        { HAL_READING_TEMPERATURE, 67999, 80000, false, true },
        { HAL_READING_TEMPERATURE, -20000, 80000, false, true },
        { HAL_READING_VOLTAGE, 38000, 56000, false, true },
        { HAL_READING_VOLTAGE, 54200, 56000, true, false },
        { HAL_READING_VOLTAGE, 54199, 56000, false, false },
        { HAL_READING_VOLTAGE, 53299, 56000, false, true },
        { HAL_READING_VOLTAGE, 21800, 20000, true, false },
        { HAL_READING_VOLTAGE, 21801, 20000, false, false },
        { HAL_READING_VOLTAGE, 22701, 20000, false, true },
        { HAL_READING_CURRENT, -10800, 12000, true, false },
        { HAL_READING_CURRENT, 10799, 12000, false, false },
        { HAL_READING_CURRENT, -10199, 12000, false, true },
    };
    struct drive_monitor_level level;
    (void)state;
    assert_int_equal(begin_with((1u << HAL_READINGS) - 1), MOTION_OK);
    for (unsigned i = 0; i < HAL_READINGS; i++)
        assert_false(
            drive_monitor_level(&monitor, (enum hal_reading)i, &level));
    tick();
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        assert_true(hal_readings_put(&readings, rows[i].reading, rows[i].milli,
                                     now_ns + 1));
        assert_true(drive_monitor_level(&monitor, rows[i].reading, &level));
        if (level.limit_milli != rows[i].limit_milli ||
            level.is_over != rows[i].is_over ||
            level.is_below != rows[i].is_below)
            fail_msg("row %zu", i);
    }
}

static void two_answers_at_the_limit_are_a_fault(void **state)
{
    (void)state;
    tick();
    answer(HAL_READING_TEMPERATURE, 79999);
    answer(HAL_READING_TEMPERATURE, 80000);
    ticks(20 * MS); /* that one again and again */
    assert_int_equal(seen().state, HAL_DRIVE_ENABLED);
    answer(HAL_READING_TEMPERATURE, 79999);
    answer(HAL_READING_TEMPERATURE, 95000);
    assert_int_equal(seen().state, HAL_DRIVE_ENABLED);
    answer(HAL_READING_TEMPERATURE, 81250);
    assert_int_equal(seen().state, HAL_DRIVE_FAULT);
    assert_int_equal(seen().fault_code, 0x4310);
    assert_string_equal(seen().fault_text,
                        "temperature 81.2 degC, limit 80.0 degC");
    assert_int_equal(requests, 0);
}

static void each_reading_has_its_code_and_words(void **state)
{
    static const struct {
        enum hal_reading reading;
        int32_t milli;
        uint16_t code;
        const char *text;
    } rows[] = {
        { HAL_READING_VOLTAGE, 56000, 0x3210,
          "bus voltage 56.0 V, limit 56.0 V" },
        { HAL_READING_VOLTAGE, 19999, 0x3220,
          "bus voltage 19.9 V, limit 20.0 V" },
        { HAL_READING_CURRENT, -13000, 0x2310, "current 13.0 A, limit 12.0 A" },
        { HAL_READING_CURRENT, 1999999, 0x2310,
          "current 1999.9 A, limit 12.0 A" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        assert_int_equal(begin_with(1u << rows[i].reading), MOTION_OK);
        tick();
        answer(rows[i].reading, rows[i].milli);
        answer(rows[i].reading, rows[i].milli);
        assert_int_equal(seen().fault_code, rows[i].code);
        assert_string_equal(seen().fault_text, rows[i].text);
    }
}

/* The DC link of a drive that charges it when it is switched on. */
static void a_low_voltage_counts_with_the_power_stage_on(void **state)
{
    struct drive_monitor_level level;
    (void)state;
    assert_int_equal(begin_with(1u << HAL_READING_VOLTAGE), MOTION_OK);
    said.state = HAL_DRIVE_OFF;
    tick();
    answer(HAL_READING_VOLTAGE, 3000);
    answer(HAL_READING_VOLTAGE, 3000);
    said.state = HAL_DRIVE_ENABLING;
    answer(HAL_READING_VOLTAGE, 12000);
    assert_true(drive_monitor_level(&monitor, HAL_READING_VOLTAGE, &level));
    assert_false(level.is_over);
    said.state = HAL_DRIVE_ENABLED;
    tick(); /* the answer is from before */
    answer(HAL_READING_VOLTAGE, 19000);
    assert_int_equal(seen().state, HAL_DRIVE_ENABLED);
    answer(HAL_READING_VOLTAGE, 19000);
    assert_int_equal(seen().fault_code, 0x3220);
    said.state = HAL_DRIVE_OFF;
    answer(HAL_READING_VOLTAGE, 3000);
    hal_drive_request(&monitor.drive, HAL_DRIVE_REQUEST_RESET);
    assert_int_equal(seen().state, HAL_DRIVE_OFF);
    answer(HAL_READING_VOLTAGE, 57000);
    answer(HAL_READING_VOLTAGE, 57000); /* too high is always */
    assert_int_equal(seen().fault_code, 0x3210);
}

static void no_answer_for_three_periods_is_a_fault(void **state)
{
    (void)state;
    tick();
    ticks(50 * MS);
    answer(HAL_READING_TEMPERATURE, 30000);
    ticks(3 * HAL_READING_NS);
    assert_int_equal(seen().state, HAL_DRIVE_ENABLED);
    tick();
    assert_int_equal(seen().state, HAL_DRIVE_FAULT);
    assert_int_equal(seen().fault_code, 0x7300);
    assert_string_equal(seen().fault_text,
                        "temperature: no value for three periods");
}

static void one_that_never_answers_is_found_after_it_is_there(void **state)
{
    (void)state;
    said.state = HAL_DRIVE_OFFLINE;
    ticks(1000 * MS);
    assert_int_equal(seen().state, HAL_DRIVE_OFFLINE);
    said.state = HAL_DRIVE_OFF;
    ticks(3 * HAL_READING_NS);
    assert_int_equal(seen().state, HAL_DRIVE_OFF);
    ticks(2 * TICK_NS);
    assert_int_equal(seen().state, HAL_DRIVE_FAULT);
}

static void what_its_driver_cannot_ask_for_is_not_missing(void **state)
{
    (void)state;
    tick();
    answer(HAL_READING_TEMPERATURE, 30000);
    for (int i = 0; i < 500; i++) {
        readings.from_ns = now_ns;
        tick();
    }
    assert_int_equal(seen().state, HAL_DRIVE_ENABLED);
    ticks(3 * HAL_READING_NS);
    assert_int_equal(seen().state, HAL_DRIVE_FAULT);
}

/* A steady value is one; see hal/readings.h. */
static void a_value_that_stays_the_same_is_no_fault(void **state)
{
    (void)state;
    tick();
    for (int i = 0; i < 2000; i++) {
        answer(HAL_READING_TEMPERATURE, 30000);
        ticks(29 * MS);
    }
    assert_int_equal(seen().state, HAL_DRIVE_ENABLED);
}

static void what_no_drive_has_is_no_answer(void **state)
{
    (void)state;
    assert_false(
        hal_readings_put(&readings, HAL_READING_TEMPERATURE, 400001, now_ns));
    assert_false(
        hal_readings_put(&readings, HAL_READING_VOLTAGE, -1001, now_ns));
    assert_false(hal_readings_put_q16(&readings, HAL_READING_CURRENT, INT64_MAX,
                                      now_ns));
    assert_true(hal_readings_put_q16(&readings, HAL_READING_CURRENT,
                                     -(INT64_C(3) << 15), now_ns));
    assert_int_equal(readings.value[HAL_READING_CURRENT].milli, -1500);
    assert_int_equal(readings.value[HAL_READING_TEMPERATURE].t_ns, 0);
}

static void a_fault_latches_until_a_reset_that_finds_it_well(void **state)
{
    (void)state;
    tick();
    answer(HAL_READING_TEMPERATURE, 90000);
    answer(HAL_READING_TEMPERATURE, 90000);
    hal_drive_request(&monitor.drive, HAL_DRIVE_REQUEST_ENABLE);
    assert_int_equal(requests, 0);
    hal_drive_request(&monitor.drive, HAL_DRIVE_REQUEST_OFF);
    assert_int_equal(asked, HAL_DRIVE_REQUEST_OFF);
    hal_drive_request(&monitor.drive, HAL_DRIVE_REQUEST_RESET);
    assert_int_equal(seen().state, HAL_DRIVE_FAULT);
    answer(HAL_READING_TEMPERATURE, 60000);
    assert_int_equal(seen().state, HAL_DRIVE_FAULT);
    requests = 0;
    hal_drive_request(&monitor.drive, HAL_DRIVE_REQUEST_RESET);
    assert_int_equal(requests, 2); /* off, and reset */
    assert_int_equal(asked, HAL_DRIVE_REQUEST_RESET);
    assert_int_equal(seen().state, HAL_DRIVE_ENABLED);
    answer(HAL_READING_TEMPERATURE, 90000);
    assert_int_equal(seen().state, HAL_DRIVE_ENABLED);
    answer(HAL_READING_TEMPERATURE, 90000);
    assert_int_equal(seen().state, HAL_DRIVE_FAULT);
}

/* Set points go through, so that it stops along its path; what it does by itself
 * is told to stop. */
static void in_fault_it_follows_its_path_and_ends_its_profile(void **state)
{
    const struct hal_drive_target target = { 0 };
    (void)state;
    tick();
    answer(HAL_READING_TEMPERATURE, 90000);
    answer(HAL_READING_TEMPERATURE, 90000);
    assert_int_equal(hal_drive_set_target(&monitor.drive, &target), MOTION_OK);
    assert_int_equal(targets, 1);
    assert_int_equal(requests, 0);
    assert_int_equal(begin(NULL), 0);
    said.mode = HAL_DRIVE_PROFILE_POSITION;
    tick();
    answer(HAL_READING_TEMPERATURE, 90000);
    answer(HAL_READING_TEMPERATURE, 90000);
    assert_int_equal(requests, 1);
    assert_int_equal(asked, HAL_DRIVE_REQUEST_QUICK_STOP);
}

static void its_own_fault_is_said_in_its_own_words(void **state)
{
    (void)state;
    tick();
    answer(HAL_READING_TEMPERATURE, 90000);
    answer(HAL_READING_TEMPERATURE, 90000);
    said.state = HAL_DRIVE_FAULT;
    said.fault_code = 7;
    snprintf(said.fault_text, sizeof said.fault_text, "its own");
    assert_int_equal(seen().fault_code, 7);
    assert_string_equal(seen().fault_text, "its own");
}

static void it_has_the_calls_that_its_drive_has(void **state)
{
    (void)state;
    assert_null(monitor.drive.ops->go);
    assert_null(monitor.drive.ops->home);
    assert_null(monitor.drive.ops->probe);
    assert_null(monitor.drive.ops->modes);
    assert_null(monitor.drive.ops->tracks);
}

static void limits_that_are_none_are_refused(void **state)
{
    const struct drive_monitor_limit wrong[HAL_READINGS] = { { INT32_MIN, 0 },
                                                             { 30000, 30000 },
                                                             { 0, 12000 } };
    (void)state;
    for (unsigned i = 0; i < HAL_READINGS; i++) {
        readings.wanted = 1u << i;
        assert_int_equal(drive_monitor_init(&monitor, &inner, &readings, wrong),
                         MOTION_E_ARG);
    }
}

/* Each is asked for every 30 ms, whatever the tick, and the questions spread. */
static void readings_take_turns(void **state)
{
    static const int64_t tick_ns[] = { 125000, MS, 5 * MS, 20 * MS };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(tick_ns); i++) {
        unsigned count[HAL_READINGS] = { 0 }, most = 0;
        memset(&readings, 0, sizeof readings);
        readings.wanted =
            1u << HAL_READING_TEMPERATURE | 1u << HAL_READING_CURRENT;
        for (int64_t at_ns = MS; at_ns < 3000 * MS; at_ns += tick_ns[i]) {
            unsigned together = 0;
            enum hal_reading reading;
            while ((reading = hal_readings_next(&readings, at_ns)) !=
                   HAL_READINGS) {
                count[reading]++;
                together++;
            }
            most = together > most ? together : most;
        }
        assert_in_range(count[HAL_READING_TEMPERATURE], 99, 101);
        assert_in_range(count[HAL_READING_CURRENT], 99, 101);
        assert_int_equal(count[HAL_READING_VOLTAGE], 0);
        assert_int_equal(most, tick_ns[i] == 20 * MS ? 2 : 1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(near_its_limit_is_a_level, begin),
        cmocka_unit_test_setup(two_answers_at_the_limit_are_a_fault, begin),
        cmocka_unit_test_setup(each_reading_has_its_code_and_words, begin),
        cmocka_unit_test_setup(a_low_voltage_counts_with_the_power_stage_on,
                               begin),
        cmocka_unit_test_setup(no_answer_for_three_periods_is_a_fault, begin),
        cmocka_unit_test_setup(
            one_that_never_answers_is_found_after_it_is_there, begin),
        cmocka_unit_test_setup(what_its_driver_cannot_ask_for_is_not_missing,
                               begin),
        cmocka_unit_test_setup(a_value_that_stays_the_same_is_no_fault, begin),
        cmocka_unit_test_setup(what_no_drive_has_is_no_answer, begin),
        cmocka_unit_test_setup(a_fault_latches_until_a_reset_that_finds_it_well,
                               begin),
        cmocka_unit_test_setup(
            in_fault_it_follows_its_path_and_ends_its_profile, begin),
        cmocka_unit_test_setup(its_own_fault_is_said_in_its_own_words, begin),
        cmocka_unit_test_setup(it_has_the_calls_that_its_drive_has, begin),
        cmocka_unit_test_setup(limits_that_are_none_are_refused, begin),
        cmocka_unit_test_setup(readings_take_turns, begin),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
