/* tests/firmware/linux/batch/test_batch_vary.c - what is varied, and by how
 * much. */
#include "firmware/linux/batch/batch_vary.h"

#include <math.h>
#include <string.h>

#include "firmware/linux/base/disk.h"
#include "tests/support/check.h"

static struct rig rig;
static struct batch_vary vary;
static char message[BATCH_MESSAGE_MAX];

static int setup(void **state)
{
    char text[YAML_MESSAGE_MAX];
    (void)state;
    return rig_load(&disk_files, "examples/dolly/rig.yaml", &rig, text);
}

static int teardown(void **state)
{
    (void)state;
    rig_free(&rig);
    return 0;
}

static int read(const char *text, const struct fault_script *script,
                uint64_t seed)
{
    batch_vary_free(&vary);
    return batch_vary_init(&vary, &rig, text, script, seed, message);
}

static void a_star_is_every_axis(void **state)
{
    char name[BATCH_NAME_MAX];
    (void)state;
    assert_int_equal(read("*.mass=0.5..2, pan.friction=1..20 deg/s2", NULL, 1),
                     0);
    assert_int_equal(vary.count, rig.axis_count + 1);
    batch_item_name(&vary, rig.axis_count, name);
    assert_string_equal(name, "pan.friction_deg_s2");
    batch_item_name(&vary, 0, name);
    assert_string_equal(name, "dolly.mass");
}

static void a_unit_holds_for_both_ends(void **state)
{
    (void)state;
    assert_int_equal(read("pan.delay=1..3 ms", NULL, 1), 0);
    assert_true(fabs(vary.item[0].low - 0.001) < 1e-12);
    assert_true(fabs(vary.item[0].high - 0.003) < 1e-12);
    assert_int_equal(read("pan.delay=500 us..3 ms", NULL, 1), 0);
    assert_true(fabs(vary.item[0].low - 0.0005) < 1e-12);
}

/* Mean and extremes of what is drawn; 40,000 values, so that the mean of an even
 * distribution is within 5 sigma = 0.0072 of the middle. */
static void values_fill_their_range_evenly(void **state)
{
    double sum = 0, least = 9, most = 0;
    (void)state;
    assert_int_equal(read("pan.mass=1..2", NULL, 3), 0);
    for (uint64_t run = 0; run < 40000; run++) {
        const double value = batch_item_value(&vary, 0, run);
        assert_true(value >= 1 && value < 2);
        sum += value;
        least = fmin(least, value);
        most = fmax(most, value);
    }
    assert_true(fabs(sum / 40000 - 1.5) < 0.0072);
    assert_true(least < 1.001 && most > 1.999);
}

static void values_are_normal_about_their_mean(void **state)
{
    enum { RUNS = 20000 };
    double sum = 0, squares = 0;
    unsigned beyond = 0;
    (void)state;

    assert_int_equal(read("pan.mass=1+-0.1", NULL, 1), 0);
    for (unsigned run = 0; run < RUNS; run++) {
        const double off = batch_item_value(&vary, 0, run) - 1;
        sum += off;
        squares += off * off;
        beyond += fabs(off) > 0.2;
    }
    assert_true(fabs(sum / RUNS) < 0.003);
    assert_true(fabs(sqrt(squares / RUNS) - 0.1) < 0.003);
    /* 4.55 % beyond two deviations */
    assert_true(fabs((double)beyond / RUNS - 0.0455) < 0.006);
}

static void a_value_depends_on_seed_run_and_what_it_is_of_alone(void **state)
{
    (void)state;
    assert_int_equal(read("pan.mass=1..2", NULL, 3), 0);
    const double alone = batch_item_value(&vary, 0, 17);
    assert_true(alone != batch_item_value(&vary, 0, 18));
    assert_int_equal(
        read("tilt.mass=1..2,pan.delay=0..1ms,pan.mass=1..2", NULL, 3), 0);
    assert_true(batch_item_value(&vary, 2, 17) == alone);
    assert_true(batch_item_value(&vary, 0, 17) != alone);
    assert_int_equal(read("pan.mass=1..2", NULL, 4), 0);
    assert_true(batch_item_value(&vary, 0, 17) != alone);
}

/* Four times the inertia behind the same gains: a quarter of the acceleration,
 * half the bandwidth and the damping. */
static void a_mass_makes_a_servo_slower(void **state)
{
    struct fault_script script;
    (void)state;
    assert_int_equal(read("pan.mass=4..4", NULL, 1), 0);
    batch_vary_apply(&vary, 0, &rig, &script);
    batch_vary_apply(&vary, 1, &rig, &script); /* never on top of a run */
    for (uint32_t i = 0; i < rig.axis_count; i++) {
        const struct rig_sim *const before = &vary.sim[i];
        const struct rig_sim *const after = &rig.axis[i].sim;
        const int part = strcmp(rig.axis[i].name, "pan") == 0 ? 2 : 1;
        assert_true(after->acc_max_q32 == before->acc_max_q32 / (part * part));
        assert_true(abs((int)(after->omega_mrad_s * (uint32_t)part) -
                        (int)before->omega_mrad_s) < part);
        assert_true(abs(after->zeta_permille * part - before->zeta_permille) <
                    part);
    }
    assert_int_equal(script.count, 0);
}

static void friction_and_delay_begin_with_the_run(void **state)
{
    struct fault_script script;
    (void)state;
    assert_int_equal(read("pan.friction=3..3,tilt.delay=2ms..2ms", NULL, 1), 0);
    batch_vary_apply(&vary, 5, &rig, &script);
    assert_int_equal(script.count, 2);
    assert_int_equal(script.entry[0].kind, FAULT_FRICTION_STEP);
    assert_int_equal(script.entry[0].value, INT64_C(3) << 32);
    assert_int_equal(script.entry[1].kind, FAULT_SLOW_DRIVE);
    assert_int_equal(script.entry[1].value, 2000000);
    assert_int_equal(script.entry[1].event, FAULT_ON_ENABLE);
}

/* Each by itself: of 4,000 runs a quarter, within 5 sigma = 137. */
static void faults_happen_by_chance(void **state)
{
    const struct fault_script all = { .count = 2,
                                      .entry = { { .kind = FAULT_REBOOT },
                                                 { .kind = FAULT_RUNAWAY } } };
    struct fault_script script;
    int seen[FAULT_KINDS] = { 0 }, both = 0;
    (void)state;
    assert_int_equal(read("faults=25 %", &all, 9), 0);
    for (uint64_t run = 0; run < 4000; run++) {
        batch_vary_apply(&vary, run, &rig, &script);
        for (uint32_t i = 0; i < script.count; i++)
            seen[script.entry[i].kind]++;
        both += script.count == 2;
    }
    assert_true(abs(seen[FAULT_REBOOT] - 1000) < 137);
    assert_true(abs(seen[FAULT_RUNAWAY] - 1000) < 137);
    assert_true(abs(both - 250) < 77);
}

static void what_cannot_be_varied_is_refused(void **state)
{
    static const struct {
        const char *text, *why;
    } rows[] = {
        { "pan.mass", "expected AXIS.WHAT=LOW..HIGH" },
        { "mass=1..2", "expected AXIS.mass" },
        { "pan.weight=1..2", "expected AXIS.mass" },
        { "nobody.mass=1..2", "no such axis" },
        { "pan.mass=2..1", "goes down" },
        { "pan.mass=0..1", "out of range, expected 0.05 .. 20" },
        { "pan.mass=1..21", "out of range" },
        { "pan.mass=1..2,*.mass=1..2", "is varied twice" },
        { "pan.mass=..2", "" },
        { "pan.mass=1..", "" },
        { "pan.friction=1..2 mm/s2", "mm" },
        { "pan.delay=0..2 deg", "deg" },
        { "faults=20%", "no script, expected --faults" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        message[0] = '\0';
        if (read(rows[i].text, NULL, 1) == 0)
            fail_msg("%s is taken", rows[i].text);
        if (strstr(message, rows[i].why) == NULL || message[0] == '\0')
            fail_msg("%s: %s", rows[i].text, message);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_star_is_every_axis),
        cmocka_unit_test(a_unit_holds_for_both_ends),
        cmocka_unit_test(values_fill_their_range_evenly),
        cmocka_unit_test(values_are_normal_about_their_mean),
        cmocka_unit_test(a_value_depends_on_seed_run_and_what_it_is_of_alone),
        cmocka_unit_test(a_mass_makes_a_servo_slower),
        cmocka_unit_test(friction_and_delay_begin_with_the_run),
        cmocka_unit_test(faults_happen_by_chance),
        cmocka_unit_test(what_cannot_be_varied_is_refused),
    };
    const int failed = cmocka_run_group_tests(tests, setup, teardown);
    batch_vary_free(&vary);
    return failed;
}
