/* tests/motion/plan/shaper/test_shaper_fit.c - step responses by their closed form, with
 * what a recording adds: a wait, noise, uneven times.  Takes long. */
#include "motion/plan/shaper/shaper_fit.h"

#include <math.h>
#include <string.h>

#include "motion/core/err.h"
#include "tests/support/check.h"

#define PI   3.14159265358979323846
#define ROWS 3000

static double t_s[ROWS], x[ROWS];

static double between(double low, double high)
{
    return low + (high - low) * (double)draw_unit();
}

/* Of x'' + 2 z w x' + w^2 x = w^2 u, u from 0 to 1 at step_s: Ogata, Modern
 * Control Engineering, 5-3. */
static double step_response(double t, double step_s, double hz, double z)
{
    const double w = 2 * PI * hz, wd = w * sqrt(1 - z * z), at = t - step_s;

    if (at < 0)
        return 0;
    return 1 - exp(-z * w * at) *
                   (cos(wd * at) + z / sqrt(1 - z * z) * sin(wd * at));
}

struct recording {
    double hz, z, step_s, noise, scale, offset, uneven, periods;
    uint32_t rows;
};

static void record(const struct recording *it)
{
    const double period = (it->step_s + it->periods / it->hz) / it->rows;

    for (uint32_t i = 0; i < it->rows; i++) {
        t_s[i] = period * (i + it->uneven * between(-0.4, 0.4));
        /* uniform, of that standard deviation */
        const double noise = it->noise * sqrt(12) * between(-0.5, 0.5);
        x[i] = it->offset +
               it->scale *
                   (step_response(t_s[i], it->step_s, it->hz, it->z) + noise);
    }
}

static void fit_near(const struct recording *it, double hz_most, double z_most)
{
    struct plan_shaper_fit fit;
    struct plan_error error;

    record(it);
    if (plan_shaper_fit(t_s, x, it->rows, &fit, &error) < 0)
        fail_msg("%g Hz, %g: %s", it->hz, it->z, error.text);
    if (fabs(fit.frequency_hz / it->hz - 1) > hz_most ||
        fabs(fit.damping - it->z) > z_most)
        fail_msg("%g Hz, damping %g, %u rows, %g periods: %.9g Hz, %.9g, "
                 "explained %g",
                 it->hz, it->z, it->rows, it->periods, fit.frequency_hz,
                 fit.damping, fit.explained);
    assert_true(fabs(fit.settled - it->offset - it->scale) <
                0.05 * fabs(it->scale));
}

static struct recording random_one(void)
{
    const double hz = pow(10, between(-1, 2)), z = between(0, 0.4);

    return (struct recording){
        .hz = hz,
        .z = z,
        .step_s = between(0, 2) / hz,
        .scale = between(0, 1) < 0.5 ? -3 : 200,
        .offset = between(-100, 100),
        .uneven = 1,
        .periods = between(3, 12),
        .rows = (uint32_t)between(400, ROWS),
    };
}

static void a_clean_step_gives_its_frequency_and_damping(void **state)
{
    (void)state;
    seed_from("clean");
    for (int n = 0; n < check_cases(40); n++) {
        const struct recording it = random_one();
        fit_near(&it, 1e-7, 1e-7);
    }
}

/* The bound of Cramer and Rao for a sinusoid in white noise of the relative size
 * s, N rows over T: sqrt(6 / N) s / (pi T); ten times that, and the part of it
 * that lasts where it is damped. */
static void noise_costs_what_it_must(void **state)
{
    (void)state;
    seed_from("noise");
    for (int n = 0; n < check_cases(30); n++) {
        struct recording it = random_one();
        it.noise = 0.05;
        it.z = between(0, 0.1);
        const double lasts = fmin(it.periods, 1 / (2 * PI * fmax(it.z, 1e-3)));
        const double rows = it.rows * lasts / (it.periods + it.step_s * it.hz);
        const double bound =
            10 * sqrt(6 / rows) * it.noise / (PI * fmax(lasts, 0.3));
        fit_near(&it, bound, bound);
    }
}

/* 4 Hz with 0.7 of the swing, 11 Hz with 0.3 of it. */
static void a_second_vibration_is_found(void **state)
{
    struct plan_shaper_fit fit;
    struct plan_error error;

    (void)state;
    seed_from("second");
    for (int i = 0; i < 1500; i++) {
        t_s[i] = i / 500.0;
        x[i] = 7 * step_response(t_s[i], 0, 4, 0.03) +
               3 * step_response(t_s[i], 0, 11, 0.02) + between(-0.1, 0.1);
    }
    assert_int_equal(plan_shaper_fit(t_s, x, 1500, &fit, &error), MOTION_OK);
    assert_true(fabs(fit.frequency_hz / 4 - 1) < 1e-3);
    assert_true(fabs(fit.second_hz / 11 - 1) < 1e-3);
    assert_true(fabs(fit.second_damping - 0.02) < 1e-3);
    assert_true(fabs(fit.second_amplitude / fit.amplitude - 3.0 / 7) < 0.02);
}

static void noise_is_no_second_vibration(void **state)
{
    const struct recording it = { .hz = 4,
                                  .z = 0.03,
                                  .scale = 10,
                                  .noise = 0.1,
                                  .periods = 12,
                                  .rows = 1500 };
    struct plan_shaper_fit fit;
    struct plan_error error;

    (void)state;
    seed_from("no second");
    record(&it);
    assert_int_equal(plan_shaper_fit(t_s, x, 1500, &fit, &error), MOTION_OK);
    assert_true(fit.second_hz == 0);
}

static void refused(uint32_t rows, const char *want)
{
    struct plan_shaper_fit fit;
    struct plan_error error;

    assert_int_equal(plan_shaper_fit(t_s, x, rows, &fit, &error), MOTION_E_ARG);
    if (strstr(error.text, want) == NULL)
        fail_msg("got %s, want %s", error.text, want);
}

static void what_says_nothing_is_refused(void **state)
{
    struct recording it = {
        .hz = 2, .z = 0.05, .scale = 1, .periods = 6, .rows = 15
    };

    (void)state;
    seed_from("refused");
    record(&it);
    refused(15, "there are 15 rows, expected 16 .. 200000");
    it.rows = 500;
    record(&it);
    t_s[77] = t_s[76];
    refused(500, "do not rise");
    record(&it);
    x[77] = NAN;
    refused(500, "not finite");
    it.periods = 0.8;
    record(&it);
    refused(500, "less than one and a half periods");
    it.periods = 6;
    it.z = 0.97;
    record(&it);
    refused(500, "comes to rest without swinging");
    for (int i = 0; i < 500; i++) {
        t_s[i] = i * 1e-3;
        x[i] = between(-1, 1);
    }
    refused(500, "no vibration stands out");
    for (int i = 0; i < 500; i++)
        x[i] = 5;
    refused(500, "");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_clean_step_gives_its_frequency_and_damping),
        cmocka_unit_test(noise_costs_what_it_must),
        cmocka_unit_test(a_second_vibration_is_found),
        cmocka_unit_test(noise_is_no_second_vibration),
        cmocka_unit_test(what_says_nothing_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
