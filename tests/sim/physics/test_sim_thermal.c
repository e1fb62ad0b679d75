/* tests/sim/physics/test_sim_thermal.c - closed forms with random parameters. */
#include "sim/physics/thermal.h"

#include "motion/core/err.h"
#include "tests/sim/physics/physics_random.h"

static void it_trips_at_the_time_of_the_exponential(void **state)
{
    (void)state;
    for (int i = 0; i < 50; i++) {
        const struct sim_thermal_config config = {
            .rated_current_a = physics_random(1, 10),
            .time_constant_s = physics_random(10, 100),
            .trip_load = physics_random(0.8, 1.2),
        };
        const double heat = physics_random(1.5, 8);
        const double warm = physics_random(0, 0.7);
        const struct sim_signal current = { { config.rated_current_a *
                                              sqrt(heat) } };
        struct sim_thermal thermal;

        assert_int_equal(sim_thermal_init(&thermal, &config, warm), MOTION_OK);
        for (int tick = 0; tick < 200000; tick++)
            sim_thermal_step(&thermal, tick * 1e-3, 1e-3, &current);
        assert_true(thermal.tripped);
        physics_near("trip", thermal.trip_s,
                     config.time_constant_s *
                         log((heat - warm) / (heat - config.trip_load)),
                     1e-6);
        physics_near("load", thermal.load,
                     heat + (warm - heat) * exp(-200 / config.time_constant_s),
                     1e-9);
    }
}

/* tau load' = (c t)^2 - load from 0: c^2 (t^2 - 2 tau t + 2 tau^2 (1 - e)) */
static void a_ramp_of_current_heats_as_its_square(void **state)
{
    const struct sim_thermal_config config = { 1, 30, 1e9 };
    struct sim_thermal thermal;

    (void)state;
    assert_int_equal(sim_thermal_init(&thermal, &config, 0), MOTION_OK);
    for (int tick = 0; tick < 60; tick++) {
        const struct sim_signal current = { { 0.2 * tick, 0.2 } };
        sim_thermal_step(&thermal, tick, 1, &current);
    }
    assert_false(thermal.tripped);
    physics_near("load", thermal.load,
                 0.04 * (3600 - 3600 + 1800 * (1 - exp(-2))), 1e-6);
}

static void what_cannot_be_is_refused(void **state)
{
    struct sim_thermal thermal;
    const struct sim_thermal_config bad[] = {
        { 0, 1, 1 }, { 1, 0, 1 }, { 1, 1, 0 }, { NAN, 1, 1 }, { 1, INFINITY, 1 }
    };
    const struct sim_thermal_config good = { 1, 1, 1 };

    (void)state;
    for (unsigned i = 0; i < sizeof bad / sizeof bad[0]; i++)
        assert_int_equal(sim_thermal_init(&thermal, &bad[i], 0), MOTION_E_ARG);
    assert_int_equal(sim_thermal_init(&thermal, &good, -1), MOTION_E_ARG);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_trips_at_the_time_of_the_exponential),
        cmocka_unit_test(a_ramp_of_current_heats_as_its_square),
        cmocka_unit_test(what_cannot_be_is_refused),
    };

    physics_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
