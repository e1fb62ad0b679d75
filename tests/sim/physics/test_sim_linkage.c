/* tests/sim/physics/test_sim_linkage.c - the exact period, energy, modes. */
#include "sim/physics/linkage.h"

#include "motion/core/err.h"
#include "tests/sim/oracle.h"
#include "tests/sim/physics/physics_random.h"

static const struct sim_signal still;

/* T = 2 pi sqrt(l/g) / agm(1, cos(amplitude/2)): Gauss. */
static double exact_period(double length, double gravity, double amplitude)
{
    double a = 1, b = cos(0.5 * amplitude);

    for (int i = 0; i < 30; i++) {
        const double mean = 0.5 * (a + b);
        b = sqrt(a * b);
        a = mean;
    }
    return 6.283185307179586 * sqrt(length / gravity) / a;
}

static void a_large_swing_has_its_exact_period(void **state)
{
    (void)state;
    for (int i = 0; i < 30; i++) {
        const struct sim_linkage_config config = {
            .links = 1,
            .mass_kg = { physics_random(0.1, 3) },
            .length_m = { physics_random(0.2, 2) },
            .gravity_m_s2 = physics_random(1.6, 9.9),
        };
        const double amplitude = physics_random(0.05, 3);
        const double period =
            exact_period(config.length_m[0], config.gravity_m_s2, amplitude);
        struct sim_linkage linkage;

        assert_int_equal(sim_linkage_init(&linkage, &config), MOTION_OK);
        linkage.angle_rad[0] = amplitude;
        for (int step = 0; step < 5000; step++)
            assert_int_equal(sim_linkage_step(&linkage, period / 1000, &still),
                             MOTION_OK);
        physics_near("angle after five periods", linkage.angle_rad[0],
                     amplitude, 1e-6);
    }
}

static void two_links_gain_no_energy_over_a_million_steps(void **state)
{
    const struct sim_linkage_config config = {
        .links = 2,
        .mass_kg = { physics_random(0.2, 2), physics_random(0.2, 2) },
        .length_m = { physics_random(0.3, 1), physics_random(0.3, 1) },
        .gravity_m_s2 = 9.80665,
    };
    struct sim_linkage linkage;

    (void)state;
    assert_int_equal(sim_linkage_init(&linkage, &config), MOTION_OK);
    linkage.angle_rad[0] = 2;
    linkage.angle_rad[1] = -2.5;
    const double start = oracle_linkage_energy_j(&linkage);
    for (int i = 0; i < 1000000; i++) {
        assert_int_equal(sim_linkage_step(&linkage, 1e-3, &still), MOTION_OK);
        physics_near("energy", oracle_linkage_energy_j(&linkage), start,
                     1e-6 * start);
    }
}

/* In steady acceleration the load hangs back at atan(a/g), and swings about it
 * as under a gravity of sqrt(g^2 + a^2). */
static void an_accelerated_load_swings_about_its_lean(void **state)
{
    (void)state;
    for (int i = 0; i < 30; i++) {
        const double acc = physics_random(-3, 3);
        const struct sim_linkage_config config = {
            .links = 1,
            .mass_kg = { 1 },
            .length_m = { physics_random(0.3, 1.5) },
            .gravity_m_s2 = 9.80665,
        };
        const double lean = -atan(acc / config.gravity_m_s2);
        const double period = exact_period(
            config.length_m[0], hypot(config.gravity_m_s2, acc), fabs(lean));
        const struct sim_signal dolly = { { 0, 0, 0.5 * acc } };
        struct sim_linkage linkage;

        assert_int_equal(sim_linkage_init(&linkage, &config), MOTION_OK);
        for (int step = 0; step < 500; step++)
            assert_int_equal(sim_linkage_step(&linkage, period / 1000, &dolly),
                             MOTION_OK);
        physics_near("half a period on", linkage.angle_rad[0], 2 * lean, 1e-7);
        physics_near("speed there", linkage.speed_rad_s[0], 0, 1e-6);
    }
}

/* Small swings in one mode stay in it, at its frequency. */
static void modes_are_those_of_the_steps(void **state)
{
    struct sim_linkage_config config = { .links = 4, .gravity_m_s2 = 9.80665 };
    double hz[4], shape[16];
    struct sim_linkage linkage;

    (void)state;
    for (int i = 0; i < 4; i++) {
        config.mass_kg[i] = physics_random(0.1, 0.5);
        config.length_m[i] = physics_random(0.1, 0.4);
    }
    assert_true(oracle_linkage_modes(&config, hz, shape));
    for (int mode = 0; mode < 4; mode++) {
        const double *const of = shape + 4 * (size_t)mode;
        assert_int_equal(sim_linkage_init(&linkage, &config), MOTION_OK);
        for (int i = 0; i < 4; i++)
            linkage.angle_rad[i] =
                1e-5 * (of[i] - (i > 0 ? of[i - 1] : 0)) / config.length_m[i];
        for (int step = 0; step < 500; step++)
            assert_int_equal(
                sim_linkage_step(&linkage, 1 / hz[mode] / 1000, &still),
                MOTION_OK);
        for (int i = 0; i < 4; i++) {
            double x, z;
            sim_linkage_place_m(&linkage, i, &x, &z);
            physics_near("place half a period on", x, -1e-5 * of[i], 1e-9);
        }
    }
}

static void what_is_no_linkage_is_refused(void **state)
{
    struct sim_linkage linkage;
    struct sim_linkage_config config = { .links = 1,
                                         .mass_kg = { 1 },
                                         .length_m = { 1 } };

    (void)state;
    assert_int_equal(sim_linkage_init(&linkage, &config), MOTION_OK);
    linkage.speed_rad_s[0] = 1e9;
    assert_int_equal(sim_linkage_step(&linkage, 1e-3, &still), MOTION_E_RANGE);
    linkage.speed_rad_s[0] = NAN;
    assert_int_equal(sim_linkage_step(&linkage, 1e-3, &still), MOTION_E_RANGE);
    config.links = SIM_LINKAGE_LINKS + 1;
    assert_int_equal(sim_linkage_init(&linkage, &config), MOTION_E_ARG);
    config.links = 2; /* the second has no mass */
    assert_int_equal(sim_linkage_init(&linkage, &config), MOTION_E_ARG);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_large_swing_has_its_exact_period),
        cmocka_unit_test(two_links_gain_no_energy_over_a_million_steps),
        cmocka_unit_test(an_accelerated_load_swings_about_its_lean),
        cmocka_unit_test(modes_are_those_of_the_steps),
        cmocka_unit_test(what_is_no_linkage_is_refused),
    };

    physics_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
