/* tests/motion/plan/shaper/test_plan_shaper.c - input shapers by what defines them, and
 * on a simulated flexible axis. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/shaper/shaper.h"
#include "tests/support/check.h"

#define UNIT MOTION_FIXED_ONE_Q32
#define SEC  MOTION_FIXED_S_Q12
#define PI   3.14159265358979323846

/* Up to what damping the property is asked for; shaper.h says where each ends
 * with the usual residual. */
static const double damping_max[PLAN_SHAPER_KINDS] = { 0.95, 0.95, 0.53, 0.34 };

static double between(double low, double high)
{
    return low + (high - low) * (double)draw_unit();
}

static struct plan_shaper design(enum plan_shaper_kind kind, double frequency,
                                 double damping)
{
    const struct plan_shaper_request request = {
        .kind = kind,
        .frequency_hz = frequency,
        .damping = damping,
        .residual = PLAN_SHAPER_RESIDUAL,
    };
    struct plan_shaper shaper;
    struct plan_error error;

    if (plan_shaper_design(&request, &shaper, &error) < 0)
        fail_msg("%s at %g Hz, %g: %s", plan_shaper_word(kind), frequency,
                 damping, error.text);
    return shaper;
}

/* By the definition of V, in long double. */
static double residual_of(const struct plan_shaper *shaper, double frequency)
{
    const long double w = 2 * 3.14159265358979323846L * frequency;
    const long double z = shaper->damping, root = sqrtl(1 - z * z);
    const long double end = shaper->time_s[shaper->count - 1];
    long double re = 0, im = 0;

    for (uint32_t i = 0; i < shaper->count; i++) {
        const long double t = shaper->time_s[i];
        const long double size = shaper->amplitude[i] * expl(z * w * (t - end));
        re += size * cosl(w * root * t);
        im += size * sinl(w * root * t);
    }
    return (double)hypotl(re, im);
}

static void check_impulses(const struct plan_shaper *shaper)
{
    double sum = 0;

    assert_true(shaper->time_s[0] == 0);
    for (uint32_t i = 0; i < shaper->count; i++) {
        assert_true(shaper->amplitude[i] > 0);
        assert_true(i == 0 || shaper->time_s[i] > shaper->time_s[i - 1]);
        sum += shaper->amplitude[i];
    }
    assert_true(fabs(sum - 1) < 1e-12);
}

static void every_shaper_is_what_defines_it(void **state)
{
    (void)state;
    seed_from("definition");
    for (int n = 0; n < 2000; n++) {
        const enum plan_shaper_kind kind =
            (enum plan_shaper_kind)(n % PLAN_SHAPER_KINDS);
        const double f = pow(10, between(-2, 4));
        const struct plan_shaper shaper =
            design(kind, f, between(0, damping_max[kind]));
        check_impulses(&shaper);
        for (unsigned i = 0; i < shaper.zeros; i++)
            if (residual_of(&shaper, shaper.zero_hz[i]) > 1e-10)
                fail_msg("%s z %g: zero %u", plan_shaper_word(kind),
                         shaper.damping, i);
        for (unsigned i = 0; i < shaper.humps; i++) {
            const double at = shaper.hump_hz[i], top = residual_of(&shaper, at);
            if (fabs(top - PLAN_SHAPER_RESIDUAL) > 1e-10 ||
                residual_of(&shaper, at * 0.999) > top ||
                residual_of(&shaper, at * 1.001) > top)
                fail_msg("%s z %g: hump %u", plan_shaper_word(kind),
                         shaper.damping, i);
        }
        if (kind == PLAN_SHAPER_ZVD) /* flat: quadratic in the error */
            assert_true(residual_of(&shaper, f * 1.0001) < 1e-6);
        if (kind == PLAN_SHAPER_EI)
            assert_true(fabs(residual_of(&shaper, f) - PLAN_SHAPER_RESIDUAL) <
                        1e-10);
        const double other = f * between(0.5, 1.5);
        assert_true(fabs(plan_shaper_residual(&shaper, other) -
                         residual_of(&shaper, other)) < 1e-12);
    }
}

/* It is one solution all along: no jump to another where the equations have
 * several. */
static void shapers_change_smoothly_with_damping(void **state)
{
    (void)state;
    for (int kind = 0; kind < PLAN_SHAPER_KINDS; kind++) {
        struct plan_shaper before = design((enum plan_shaper_kind)kind, 1, 0);
        for (double z = 1e-3; z < fmin(damping_max[kind], 0.8); z += 1e-3) {
            const struct plan_shaper shaper =
                design((enum plan_shaper_kind)kind, 1, z);
            for (uint32_t i = 0; i < shaper.count; i++)
                if (fabs(shaper.amplitude[i] - before.amplitude[i]) > 0.01 ||
                    fabs(shaper.time_s[i] - before.time_s[i]) > 0.02)
                    fail_msg("%s at %g",
                             plan_shaper_word((enum plan_shaper_kind)kind), z);
            before = shaper;
        }
    }
}

static void other_residuals_are_met_too(void **state)
{
    (void)state;
    for (double v = 0.001; v < 0.3; v *= 1.3) {
        for (int kind = PLAN_SHAPER_EI; kind <= PLAN_SHAPER_EI2; kind++) {
            const struct plan_shaper_request request = {
                (enum plan_shaper_kind)kind, 3, 0.1, v
            };
            struct plan_shaper shaper;
            struct plan_error error;
            assert_int_equal(plan_shaper_design(&request, &shaper, &error), 0);
            check_impulses(&shaper);
            const double at = kind == PLAN_SHAPER_EI ? 3 : shaper.hump_hz[0];
            assert_true(fabs(residual_of(&shaper, at) - v) < 1e-10);
        }
    }
}

static void group_delay_is_the_slope_of_the_phase(void **state)
{
    (void)state;
    seed_from("group delay");
    for (int n = 0; n < 400; n++) {
        const enum plan_shaper_kind kind =
            (enum plan_shaper_kind)(n % PLAN_SHAPER_KINDS);
        const struct plan_shaper shaper =
            design(kind, 1, between(0, damping_max[kind]));
        const double at = between(0, 0.6), h = 1e-5;
        double phase[2];
        for (int side = 0; side < 2; side++) {
            const double w = 2 * PI * (at + (side ? h : -h));
            double re = 0, im = 0;
            for (uint32_t i = 0; i < shaper.count; i++) {
                re += shaper.amplitude[i] * cos(w * shaper.time_s[i]);
                im -= shaper.amplitude[i] * sin(w * shaper.time_s[i]);
            }
            phase[side] = atan2(im, re);
        }
        const double want =
            -remainder(phase[1] - phase[0], 2 * PI) / (4 * PI * h);
        assert_true(fabs(plan_shaper_group_delay(&shaper, at) - want) < 1e-6);
        assert_true(fabs(plan_shaper_group_delay(&shaper, 0) -
                         plan_shaper_delay(&shaper)) < 1e-12);
    }
}

static void what_cannot_be_is_refused_with_a_reason(void **state)
{
    static const struct {
        struct plan_shaper_request request;
        const char *says;
    } rows[] = {
        { { PLAN_SHAPER_ZV, 0, 0, 0 }, "frequency" },
        { { PLAN_SHAPER_ZV, -1, 0, 0 }, "frequency" },
        { { PLAN_SHAPER_ZV, (double)NAN, 0, 0 }, "frequency" },
        { { PLAN_SHAPER_ZVD, (double)INFINITY, 0, 0 }, "frequency" },
        { { PLAN_SHAPER_ZVD, 1, -0.1, 0 }, "damping" },
        { { PLAN_SHAPER_ZVD, 1, 1, 0 }, "damping" },
        { { PLAN_SHAPER_EI, 1, (double)NAN, 0.05 }, "damping" },
        { { PLAN_SHAPER_EI, 1, 0.1, 0 }, "residual" },
        { { PLAN_SHAPER_EI2, 1, 0.1, (double)NAN }, "residual" },
        { { PLAN_SHAPER_EI, 1, 0.7, 0.05 }, "up to 0.5" },
        { { PLAN_SHAPER_EI2, 1, 0.45, 0.05 }, "up to 0.3" },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct plan_shaper shaper;
        struct plan_error error = { .code = MOTION_OK };
        const int err = plan_shaper_design(&rows[i].request, &shaper, &error);
        if (err != MOTION_E_ARG || strstr(error.text, rows[i].says) == NULL)
            fail_msg("row %zu: %d, %s", i, err, error.text);
    }
}

/* --- a flexible axis ------------------------------------------------------ */

struct mode {
    double w, z, x, v;
};

static void mode_slope(const struct mode *mode, double x, double v, double u,
                       double slope[2])
{
    slope[0] = v;
    slope[1] = mode->w * mode->w * (u - x) - 2 * mode->z * mode->w * v;
}

static double set_point(const struct motion_shaper *shaper,
                        const struct motion_track *track, double t)
{
    struct motion_shaper_cursor cursor = { 0 };
    struct motion_sample sample;

    motion_shaper_sample(shaper, track, &cursor, llrint(t * (double)SEC),
                         &sample);
    return (double)sample.pos_q32 / (double)UNIT;
}

/* Runge and Kutta's fourth order; the amplitude that is left at `end`. */
static double vibration(struct mode mode, const struct motion_shaper *shaper,
                        const struct motion_track *track, double end, double to)
{
    const int steps = 4000;
    const double h = end / steps, wd = mode.w * sqrt(1 - mode.z * mode.z);

    for (int i = 0; i < steps; i++) {
        const double u0 = set_point(shaper, track, i * h),
                     u1 = set_point(shaper, track, (i + 0.5) * h),
                     u2 = set_point(shaper, track, (i + 1) * h);
        double a[2], b[2], c[2], d[2];
        mode_slope(&mode, mode.x, mode.v, u0, a);
        mode_slope(&mode, mode.x + h / 2 * a[0], mode.v + h / 2 * a[1], u1, b);
        mode_slope(&mode, mode.x + h / 2 * b[0], mode.v + h / 2 * b[1], u1, c);
        mode_slope(&mode, mode.x + h * c[0], mode.v + h * c[1], u2, d);
        mode.x += h / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0]);
        mode.v += h / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1]);
    }
    const double e = mode.x - to;
    return hypot(e, (mode.v + mode.z * mode.w * e) / wd);
}

/* What the tick sends to an axis that swings at `error` of the design
 * frequency: V of what the plain move leaves. */
static void the_tick_leaves_the_residual_that_was_designed(void **state)
{
    static const double error[] = { 0.9, 1, 1.12 };
    const struct motion_state rest = { .pos_q32 = 0 },
                              end = { .pos_q32 = 50 * UNIT };
    const uint64_t all = MOTION_SHAPER_ONE_Q62;
    const int64_t none = 0;
    struct motion_shaper plain;
    struct motion_segment segment;
    struct motion_track track;

    (void)state;
    motion_track_init(&track, &segment, 1, 0);
    assert_int_equal(
        motion_track_append_quintic(&track, 3 * SEC / 10, &rest, &end), 0);
    assert_int_equal(motion_shaper_init(&plain, 1, &all, &none), 0);
    for (int n = 0; n < 3 * PLAN_SHAPER_KINDS; n++) {
        const struct plan_shaper shaper =
            design((enum plan_shaper_kind)(n / 3), 4.2, 0.05);
        const double real = 4.2 * error[n % 3];
        const struct mode mode = { 2 * PI * real, 0.05, 0, 0 };
        const double last = shaper.time_s[shaper.count - 1];
        struct motion_shaper tick;
        assert_int_equal(plan_shaper_to_tick(&shaper, 0, &tick), 0);
        const double before = vibration(mode, &plain, &track, 0.3, 50),
                     after = vibration(mode, &tick, &track, 0.3 + last, 50);
        assert_true(before > 1);
        if (fabs(after / before - plan_shaper_residual(&shaper, real)) > 1e-6)
            fail_msg("%s at %g Hz: %g of %g",
                     plan_shaper_word((enum plan_shaper_kind)(n / 3)), real,
                     after, before);
        if (n / 3 == PLAN_SHAPER_ZVD)
            assert_true(after < 0.05 * before);
    }
}

static void a_later_shaper_only_delays(void **state)
{
    const struct plan_shaper shaper = design(PLAN_SHAPER_EI2, 7, 0.02);
    struct motion_shaper tick, later;

    (void)state;
    assert_int_equal(plan_shaper_to_tick(&shaper, 0, &tick), 0);
    assert_int_equal(plan_shaper_to_tick(&shaper, 1000, &later), 0);
    for (uint32_t i = 0; i < tick.count; i++) {
        assert_int_equal(later.delay_ns_q12[i], tick.delay_ns_q12[i] + 1000);
        assert_true(later.amplitude_q62[i] == tick.amplitude_q62[i]);
        assert_true(fabs((double)tick.amplitude_q62[i] / 0x1p62 -
                         shaper.amplitude[i]) < 1e-15);
    }
    assert_int_equal(plan_shaper_to_tick(&shaper, -1, &tick), MOTION_E_ARG);
    assert_int_equal(plan_shaper_to_tick(&shaper, INT64_MAX, &tick),
                     MOTION_E_ARG);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_shaper_is_what_defines_it),
        cmocka_unit_test(shapers_change_smoothly_with_damping),
        cmocka_unit_test(other_residuals_are_met_too),
        cmocka_unit_test(group_delay_is_the_slope_of_the_phase),
        cmocka_unit_test(what_cannot_be_is_refused_with_a_reason),
        cmocka_unit_test(the_tick_leaves_the_residual_that_was_designed),
        cmocka_unit_test(a_later_shaper_only_delays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
