/* tests/sim/identify/test_sim_servo_fit.c - parameters are found again in what a
 * servo with them did.  Takes long. */
#include <math.h>

#include "sim/identify/servo_fit.h"
#include "tests/sim/bus/sim_bus.h"

#define ROWS 1600

static double target[ROWS], actual[ROWS], work[SIM_FIT_WORK(ROWS)];
static uint64_t seed;
static bool cascade; /* the servo has loops */

/* A quarter turn and back with 65536 counts, accelerations that step. */
static void move(void)
{
    static const double acc[] = { 3e6, -3e6, 0, -6e6, 6e6, 0, 1e6, -1e6, 0 };
    double speed = 0, at = 1000;

    for (unsigned i = 0; i < ROWS; i++) {
        const unsigned part = i / 125 % ARRAY_LEN(acc);
        speed += i < ROWS - 300 ? acc[part] * 1e-3 : -speed / 50;
        at += speed * 1e-3;
        target[i] = round(at);
    }
}

static double noise(void)
{
    double sum = -6;

    for (int i = 0; i < 12; i++)
        sum += ldexp((double)(sim_random(&seed) >> 11), -53);
    return sum;
}

static struct sim_model_run run_of(const double value[], bool loaded,
                                   double deviation)
{
    const struct sim_model_run run = {
        .period_ns = 1000000,
        .loop_ns = 250000,
        .rows = ROWS,
        .target = target,
        .actual = actual,
        .has_loops = cascade,
        .loops = { .current_hz = 1000,
                   .reset_s = 0.02,
                   .position_ns = 1000000,
                   .velocity_ns = 250000,
                   .current_ns = 62500 },
        .plant = { .vel_max_counts_s = 100000000,
                   .acc_max_counts_s2 = 1000000000 },
    };

    move();
    assert_int_equal(sim_model_play(&run, value, loaded, actual, work),
                     MOTION_OK);
    for (unsigned i = 0; i < ROWS; i++)
        actual[i] = round(actual[i] + deviation * noise());
    return run;
}

static const double guess[SIM_MODEL_PARAMETERS] = {
    [SIM_MODEL_BANDWIDTH] = 25,
    [SIM_MODEL_LOOP_DAMPING] = 0.9,
    [SIM_MODEL_DELAY] = 2,
};

static void is_near(const struct sim_fit *fit, enum sim_model_parameter of,
                    double wanted, double by)
{
    const struct sim_fit_value *const got = &fit->parameter[of];

    if (!got->known || fabs(got->value - wanted) > by)
        fail_msg("parameter %d: %.6g +- %.3g, %s; wanted %.6g +- %.3g", of,
                 got->value, got->deviation, got->known ? "known" : "not known",
                 wanted, by);
}

static void a_motor_alone_is_found(void **state)
{
    static const double is[SIM_MODEL_PARAMETERS] = {
        [SIM_MODEL_BANDWIDTH] = 41,
        [SIM_MODEL_LOOP_DAMPING] = 0.7,
        [SIM_MODEL_DELAY] = 2.4,
    };
    struct sim_fit fit;
    (void)state;

    seed = 5;
    const struct sim_model_run run = run_of(is, false, 2);
    assert_int_equal(sim_fit(&run, guess, false, NULL, NULL, work, &fit),
                     MOTION_OK);
    assert_int_equal(fit.model, SIM_FIT_RIGID);
    is_near(&fit, SIM_MODEL_BANDWIDTH, 41, 0.5);
    is_near(&fit, SIM_MODEL_LOOP_DAMPING, 0.7, 0.02);
    is_near(&fit, SIM_MODEL_DELAY, 2.4, 0.02);
    assert_true(fit.rms < 2.2 && fit.rms > 1.8);
    assert_true(fit.rms_before > 5 * fit.rms);
    assert_false(fit.parameter[SIM_MODEL_INERTIA].known);
}

static void a_load_with_backlash_is_found(void **state)
{
    static const double is[SIM_MODEL_PARAMETERS] = {
        [SIM_MODEL_BANDWIDTH] = 18, [SIM_MODEL_LOOP_DAMPING] = 0.8,
        [SIM_MODEL_DELAY] = 3,      [SIM_MODEL_INERTIA] = 2.5,
        [SIM_MODEL_FREQUENCY] = 14, [SIM_MODEL_LOAD_DAMPING] = 0.04,
        [SIM_MODEL_FRICTION] = 4e5, [SIM_MODEL_VISCOUS] = 1.5,
        [SIM_MODEL_BACKLASH] = 300,
    };
    struct sim_fit fit;
    (void)state;

    seed = 77;
    const struct sim_model_run run = run_of(is, true, 3);
    assert_int_equal(sim_fit(&run, guess, false, NULL, NULL, work, &fit),
                     MOTION_OK);
    assert_int_equal(fit.model, SIM_FIT_COMPLIANT);
    is_near(&fit, SIM_MODEL_BANDWIDTH, 18, 0.3);
    is_near(&fit, SIM_MODEL_LOOP_DAMPING, 0.8, 0.03);
    is_near(&fit, SIM_MODEL_INERTIA, 2.5, 0.1);
    is_near(&fit, SIM_MODEL_FREQUENCY, 14, 0.2);
    is_near(&fit, SIM_MODEL_LOAD_DAMPING, 0.04, 0.01);
    is_near(&fit, SIM_MODEL_FRICTION, 4e5, 2e4);
    is_near(&fit, SIM_MODEL_VISCOUS, 1.5, 0.15);
    is_near(&fit, SIM_MODEL_BACKLASH, 300, 15);
    assert_true(fit.rms < 3.3);
}

static void friction_alone_is_found(void **state)
{
    static const double is[SIM_MODEL_PARAMETERS] = {
        [SIM_MODEL_BANDWIDTH] = 30,  [SIM_MODEL_LOOP_DAMPING] = 1,
        [SIM_MODEL_DELAY] = 2,       [SIM_MODEL_INERTIA] = 0.7,
        [SIM_MODEL_FREQUENCY] = 200, [SIM_MODEL_LOAD_DAMPING] = 0.05,
        [SIM_MODEL_FRICTION] = 8e5,
    };
    struct sim_fit fit;
    (void)state;

    seed = 9;
    const struct sim_model_run run = run_of(is, true, 2);
    assert_int_equal(sim_fit(&run, guess, false, NULL, NULL, work, &fit),
                     MOTION_OK);
    assert_int_equal(fit.model, SIM_FIT_STIFF);
    is_near(&fit, SIM_MODEL_FRICTION, 8e5, 4e4);
    is_near(&fit, SIM_MODEL_BANDWIDTH, 30, 0.5);
    is_near(&fit, SIM_MODEL_VISCOUS, 0, 0.1);
    assert_false(fit.parameter[SIM_MODEL_FREQUENCY].known);
}

/* A cascade: its two outer loops, from far off. */
static void the_loops_of_a_cascade_are_found(void **state)
{
    const double truth[SIM_MODEL_PARAMETERS] = {
        [SIM_MODEL_BANDWIDTH] = 7,
        [SIM_MODEL_LOOP_DAMPING] = 45,
        [SIM_MODEL_DELAY] = 2.3,
    };
    const double before[SIM_MODEL_PARAMETERS] = {
        [SIM_MODEL_BANDWIDTH] = 12,
        [SIM_MODEL_LOOP_DAMPING] = 90,
        [SIM_MODEL_DELAY] = 2,
    };
    struct sim_model_run run;
    struct sim_fit fit;
    (void)state;

    cascade = true;
    run = run_of(truth, false, 0.7);
    assert_int_equal(sim_fit(&run, before, false, NULL, NULL, work, &fit),
                     MOTION_OK);
    cascade = false;
    assert_int_equal(fit.model, SIM_FIT_RIGID);
    is_near(&fit, SIM_MODEL_BANDWIDTH, 7, 0.2);
    is_near(&fit, SIM_MODEL_LOOP_DAMPING, 45, 2);
}

static void what_does_not_move_is_refused(void **state)
{
    struct sim_fit fit;
    (void)state;

    struct sim_model_run run = run_of(guess, false, 1);
    run.rows = SIM_FIT_ROWS_MIN - 1;
    assert_int_equal(sim_fit(&run, guess, false, NULL, NULL, work, &fit),
                     MOTION_E_ARG);
    run.rows = SIM_FIT_ROWS_MIN;
    for (unsigned i = 0; i < ROWS; i++)
        target[i] = 1000;
    assert_int_equal(sim_fit(&run, guess, false, NULL, NULL, work, &fit),
                     MOTION_E_RANGE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_motor_alone_is_found),
        cmocka_unit_test(a_load_with_backlash_is_found),
        cmocka_unit_test(friction_alone_is_found),
        cmocka_unit_test(the_loops_of_a_cascade_are_found),
        cmocka_unit_test(what_does_not_move_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
