/* tests/firmware/linux/fmu/test_fmu_model.c - the servos of a rig, stepped. */
#include "firmware/linux/fmu/fmu_model.h"

#include <math.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/linux/base/disk.h"
#include "tests/support/check.h"

#define MS INT64_C(1000000)

static struct fmu_model *model;

static int setup(void **state)
{
    (void)state;
    model = memory_new(1, sizeof *model);
    return fmu_model_init(model, &disk_files, "tests/data/fmu/rig.yaml");
}

static int teardown(void **state)
{
    (void)state;
    fmu_model_free(model);
    memory_free(model);
    return 0;
}

static double get(enum fmu_of_axis of)
{
    double value = NAN;
    assert_int_equal(fmu_model_get(model, fmu_reference(0, of),
                                   fmu_of_axis[of].unit == FMU_UNIT_BOOLEAN,
                                   &value),
                     0);
    return value;
}

static void set(enum fmu_of_axis of, double value)
{
    assert_int_equal(fmu_model_set(model, fmu_reference(0, of), false, value),
                     0);
}

static void it_begins_enabled_and_at_rest(void **state)
{
    (void)state;
    set(FMU_START_POSITION, -3);
    set(FMU_DEMAND_POSITION, -3);
    assert_int_equal(fmu_model_start(model), 0);
    fmu_model_step(model, 100 * MS);
    assert_true(get(FMU_ENABLED) == 1 && get(FMU_FAULT) == 0);
    assert_true(get(FMU_PLANT_POSITION) == -3 && get(FMU_ACTUAL_VELOCITY) == 0);
}

/* 1 deg/s2 for 2 s from rest, given once: 2 deg, followed with no lag but that
 * of the bus. */
static void a_set_point_goes_on_by_its_derivatives(void **state)
{
    (void)state;
    assert_int_equal(fmu_model_start(model), 0);
    set(FMU_DEMAND_ACCELERATION, 1);
    fmu_model_step(model, 2000 * MS);
    assert_true(fabs(get(FMU_PLANT_POSITION) - 2) < 0.01);
    assert_true(fabs(get(FMU_ACTUAL_VELOCITY) - 2) < 0.02);
}

static void steps_of_any_length_give_the_same(void **state)
{
    static const int64_t step_ns[] = { MS / 10, MS / 4, MS, 7 * MS, 100 * MS };
    double first = NAN;
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(step_ns); i++) {
        const double at[] = { 0, 1, 0.5 };
        set(FMU_DEMAND_ACCELERATION, 0);
        assert_int_equal(fmu_model_start(model), 0);
        for (unsigned of = 0; of < 3; of++)
            set((enum fmu_of_axis)(FMU_DEMAND_POSITION + of), at[of]);
        int64_t t_ns = 0;
        while (t_ns < 700 * MS) { /* what the set point says goes on */
            const double t_s = 1e-9 * (double)t_ns;
            set(FMU_DEMAND_POSITION, t_s + 0.25 * t_s * t_s);
            set(FMU_DEMAND_VELOCITY, 1 + 0.5 * t_s);
            t_ns += step_ns[i];
            fmu_model_step(model, t_ns);
        }
        if (i == 0)
            first = get(FMU_PLANT_POSITION);
        if (get(FMU_PLANT_POSITION) != first)
            fail_msg("steps of %lld ns: %.17g, not %.17g",
                     (long long)step_ns[i], get(FMU_PLANT_POSITION), first);
    }
    assert_true(first > 0.8);
}

static void a_first_set_point_far_away_is_a_fault(void **state)
{
    (void)state;
    assert_int_equal(fmu_model_start(model), 0);
    set(FMU_DEMAND_POSITION, 60);
    fmu_model_step(model, 50 * MS);
    assert_true(get(FMU_FAULT) == 1 && get(FMU_ENABLED) == 0);
    assert_int_equal(fmu_model_set(model, FMU_ENABLE, true, 0), 0);
    fmu_model_step(model, 200 * MS);
    set(FMU_DEMAND_POSITION, get(FMU_ACTUAL_POSITION));
    assert_int_equal(fmu_model_set(model, FMU_ENABLE, true, 1), 0);
    fmu_model_step(model, 2200 * MS);
    assert_true(get(FMU_FAULT) == 0 && get(FMU_ENABLED) == 1);
}

static void a_set_point_beyond_the_drive_is_left_out(void **state)
{
    (void)state;
    assert_int_equal(fmu_model_start(model), 0);
    fmu_model_step(model, 20 * MS);
    set(FMU_DEMAND_POSITION, 1e8);
    fmu_model_step(model, 40 * MS);
    assert_true(model->axis[0].out_of_range);
    assert_true(fabs(get(FMU_PLANT_POSITION)) < 1e-3);
}

static void what_may_not_be_set_says_why(void **state)
{
    static const struct {
        uint32_t reference;
        bool is_boolean;
        double value;
        const char *why;
    } rows[] = {
        { 2, false, 0, "no such variable" },
        { FMU_AXIS_FIRST + FMU_AXIS_VARIABLES, false, 0, "no such variable" },
        { FMU_AXIS_FIRST + FMU_AXIS_STRIDE, false, 0, "no such variable" },
        { UINT32_MAX, false, 0, "no such variable" },
        { FMU_ENABLE, false, 0, "no such variable" },
        { FMU_AXIS_FIRST + FMU_ENABLED, false, 0, "another type" },
        { FMU_AXIS_FIRST + FMU_ENABLED, true, 0, "is an output" },
        { FMU_AXIS_FIRST + FMU_DAMPING, false, 1, "is a parameter" },
        { FMU_AXIS_FIRST + FMU_DEMAND_POSITION, false, NAN, "not a finite" },
    };
    (void)state;
    assert_int_equal(fmu_model_start(model), 0);
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        model->message[0] = '\0';
        assert_int_equal(fmu_model_set(model, rows[i].reference,
                                       rows[i].is_boolean, rows[i].value),
                         -1);
        if (strstr(model->message, rows[i].why) == NULL)
            fail_msg("row %zu: %s", i, model->message);
    }
}

static void a_servo_that_cannot_be_is_refused(void **state)
{
    (void)state;
    set(FMU_BANDWIDTH, 5000);
    assert_int_equal(fmu_model_start(model), -1);
    assert_non_null(strstr(model->message, "expected 1 .. 4000 rad/s"));
}

int main(void)
{
#define CLAIM(name) cmocka_unit_test_setup_teardown(name, setup, teardown)
    static const struct CMUnitTest tests[] = {
        CLAIM(it_begins_enabled_and_at_rest),
        CLAIM(a_set_point_goes_on_by_its_derivatives),
        CLAIM(steps_of_any_length_give_the_same),
        CLAIM(a_first_set_point_far_away_is_a_fault),
        CLAIM(a_set_point_beyond_the_drive_is_left_out),
        CLAIM(what_may_not_be_set_says_why),
        CLAIM(a_servo_that_cannot_be_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
