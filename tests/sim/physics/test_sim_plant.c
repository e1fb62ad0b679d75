/* tests/sim/physics/test_sim_plant.c - step response, limits, ramps. */
#include <math.h>

#include "tests/sim/bus/sim_bus.h"

#define ONE_Q24 (INT64_C(1) << 24)
#define STEP_NS 250000

static const double pi = 3.14159265358979323846;

static struct sim_plant_config config(uint32_t omega_mrad_s, uint16_t zeta)
{
    return (struct sim_plant_config){ .omega_mrad_s = omega_mrad_s,
                                      .zeta_permille = zeta,
                                      .vel_max_counts_s = INT64_C(1) << 31,
                                      .acc_max_counts_s2 = INT64_C(1) << 40 };
}

static struct sim_plant plant_of(struct sim_plant_config config_)
{
    struct sim_plant plant;

    assert_int_equal(sim_plant_init(&plant, &config_, 0), MOTION_OK);
    return plant;
}

static double counts(int64_t q24)
{
    return ldexp((double)q24, -24);
}

/* Highest position on a step to 1000 counts. */
static double peak_of_step(struct sim_plant *plant, int64_t dt_ns,
                           int64_t for_ns)
{
    double peak = 0;

    for (int64_t t = 0; t < for_ns; t += dt_ns) {
        sim_plant_step(plant, 1000 * ONE_Q24, 0, dt_ns);
        peak = fmax(peak, counts(plant->pos_q24));
    }
    return peak;
}

static const struct {
    uint32_t omega_mrad_s;
    uint16_t zeta;
    int64_t dt_ns;
} loops[] = {
    { 1000, 100, 1000000 },    { 50000, 700, 250000 },
    { 300000, 1000, 250000 },  { 300000, 500, 62500 },
    { 300000, 700, 1000000 },  { 4000000, 100, 1000000 },
    { 4000000, 700, 1000000 }, { 4000000, 2000, 250000 },
    { 1000, 2000, 1000 },      { 500000, 800, 999999 },
};

/* Continuous theory: exp(-pi zeta / sqrt(1 - zeta^2)), none from zeta = 1. */
static void a_step_settles_without_more_overshoot_than_theory(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(loops); i++) {
        double zeta = loops[i].zeta / 1000.0;
        double omega = loops[i].omega_mrad_s / 1000.0;
        double over = zeta < 1 ? exp(-pi * zeta / sqrt(1 - zeta * zeta)) : 0;
        /* slowest pole: |Re| = omega zeta, or omega (zeta - sqrt(zeta^2-1)) */
        double slow = zeta <= 1 ? zeta : zeta - sqrt(zeta * zeta - 1);
        int64_t settle_ns = (int64_t)(35e9 / (omega * slow));
        struct sim_plant plant =
            plant_of(config(loops[i].omega_mrad_s, loops[i].zeta));
        double peak;

        if (loops[i].dt_ns < 100000)
            settle_ns = 200 * MS; /* 1 us steps: only that it is calm */
        peak = peak_of_step(&plant, loops[i].dt_ns, settle_ns);
        if (peak > 1000 * (1 + over) + 1e-3)
            fail_msg("row %zu: peak %f, theory %f", i, peak, 1000 * (1 + over));
        if (loops[i].dt_ns >= 100000 &&
            fabs(counts(plant.pos_q24) - 1000) >
                1e-5 + 1.0 / 512 / (omega * omega)) /* half a step of acc_q8 */
            fail_msg("row %zu: ends at %.9f", i, counts(plant.pos_q24));
    }
}

/* The step of a slow loop, finely cut, is the textbook's curve. */
static void the_step_response_is_that_of_the_differential_equation(void **state)
{
    const double omega = 50, zeta = 0.5, damped = omega * sqrt(0.75);
    struct sim_plant plant = plant_of(config(50000, 500));

    (void)state;
    for (int i = 1; i <= 400000; i++) {
        double t = i * 1e-6;
        double want = 1000 - 1000 * exp(-zeta * omega * t) *
                                 (cos(damped * t) +
                                  zeta * omega / damped * sin(damped * t));

        sim_plant_step(&plant, 1000 * ONE_Q24, 0, 1000);
        if (fabs(counts(plant.pos_q24) - want) > 0.05)
            fail_msg("t = %f s: %f, not %f", t, counts(plant.pos_q24), want);
    }
}

static void velocity_and_current_limits_hold_at_every_step(void **state)
{
    struct sim_plant_config limits = config(300000, 1000);
    struct sim_plant plant;
    bool saturated = false;

    (void)state;
    limits.vel_max_counts_s = 20000;
    limits.acc_max_counts_s2 = 500000;
    plant = plant_of(limits);
    for (int i = 0; i < 40000; i++) {
        int64_t before_q24 = plant.vel_q24;

        sim_plant_step(&plant, 50000 * ONE_Q24, 0, STEP_NS);
        saturated |= plant.saturated;
        assert_true(llabs(plant.vel_q24) <= 20000 * ONE_Q24);
        assert_true(llabs(plant.acc_q8) <= 500000 * 256);
        /* 500000 counts/s2 in 250 us: 125 counts/s, and rounding */
        assert_true(llabs(plant.vel_q24 - before_q24) <= 125 * ONE_Q24 + 8);
    }
    assert_true(saturated);
    assert_true(fabs(counts(plant.pos_q24) - 50000) < 1e-4); /* and settles */
}

static void a_steady_ramp_is_followed_without_lag(void **state)
{
    const int64_t vel_q24 = 12345 * ONE_Q24 / 10;
    struct sim_plant plant = plant_of(config(100000, 700));
    int64_t target_q24 = 0;

    (void)state;
    for (int64_t i = 1; i <= 8000; i++) {
        target_q24 = (int64_t)((sim_i128)vel_q24 * i * STEP_NS / 1000000000);
        sim_plant_step(&plant, target_q24, vel_q24, STEP_NS);
        if (i > 2000) /* 0.5 s: the start's error has died out */
            assert_true(llabs(target_q24 - plant.pos_q24) <= 16);
    }
}

static void a_long_step_is_cut_up_and_ends_where_short_ones_do(void **state)
{
    struct sim_plant one = plant_of(config(1000000, 700));
    struct sim_plant eight = plant_of(config(1000000, 700));

    (void)state;
    for (int i = 0; i < 30; i++) {
        sim_plant_step(&one, 1000 * ONE_Q24, 0, 1000000);
        for (int j = 0; j < 8; j++)
            sim_plant_step(&eight, 1000 * ONE_Q24, 0, 125000);
        assert_true(llabs(one.pos_q24 - eight.pos_q24) < 1000);
    }
}

static void without_torque_the_axis_slows_down_and_stands(void **state)
{
    struct sim_plant_config limits = config(300000, 1000);
    struct sim_plant plant;
    int64_t before_q24;

    (void)state;
    limits.coast_counts_s2 = 100000;
    plant = plant_of(limits);
    plant.vel_q24 = 10000 * ONE_Q24;
    for (int i = 0; i < 500; i++)
        sim_plant_coast(&plant, STEP_NS);
    /* v^2 / 2a = 500 counts, in 0.1 s */
    assert_int_equal(plant.vel_q24, 0);
    assert_true(fabs(counts(plant.pos_q24) - 500) < 2);
    before_q24 = plant.pos_q24;
    sim_plant_coast(&plant, STEP_NS);
    assert_int_equal(plant.pos_q24, before_q24);
}

static void the_end_of_the_world_stops_it(void **state)
{
    struct sim_plant plant = plant_of(config(300000, 1000));

    (void)state;
    plant.pos_q24 = (INT64_C(1) << 62) - ONE_Q24;
    plant.vel_q24 = 1000000 * ONE_Q24;
    sim_plant_step(&plant, plant.pos_q24, plant.vel_q24, STEP_NS);
    assert_int_equal(plant.pos_q24, INT64_C(1) << 62);
    assert_int_equal(plant.vel_q24, 0);
    assert_true(plant.saturated);
}

static void configs_outside_the_ranges_are_refused(void **state)
{
    struct sim_plant plant;
    struct sim_plant_config bad[8];

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(bad); i++)
        bad[i] = config(300000, 700);
    bad[0].omega_mrad_s = 999;
    bad[1].omega_mrad_s = 4000001;
    bad[2].zeta_permille = 99;
    bad[3].zeta_permille = 2001;
    bad[4].vel_max_counts_s = 0;
    bad[5].vel_max_counts_s++;
    bad[6].acc_max_counts_s2++;
    bad[7].coast_counts_s2 = -1;
    for (size_t i = 0; i < ARRAY_LEN(bad); i++)
        if (sim_plant_init(&plant, &bad[i], 0) != MOTION_E_ARG)
            fail_msg("row %zu was taken", i);
}

/* Without integral action the loop stops short where its spring no longer
 * overcomes friction, at friction / omega^2 at most. */
static void friction_holds_the_rotor_within_its_band(void **state)
{
    const double omega = 100, friction = 50000;
    struct sim_plant plant = plant_of(config(100000, 1000));
    double band = friction / (omega * omega);

    (void)state;
    plant.friction_q8 = (int64_t)friction * 256;
    for (int i = 0; i < 4000; i++) {
        const int64_t before_q24 = plant.vel_q24;
        sim_plant_step(&plant, 1000 * ONE_Q24, 0, STEP_NS);
        assert_true(before_q24 >= 0 && plant.vel_q24 >= 0);
    }
    /* to the resolution of its acceleration */
    assert_true(plant.vel_q24 < 1 << 12);
    assert_true(counts(plant.pos_q24) < 1000 &&
                counts(plant.pos_q24) >= 1000 - band - 0.01);
    /* within the band nothing moves, but for rounding */
    for (int i = 0; i < 100; i++) {
        sim_plant_step(&plant, plant.pos_q24 + (int64_t)(0.9 * band) * ONE_Q24,
                       0, STEP_NS);
        assert_true(llabs(plant.vel_q24) < 32);
    }
}

static void with_phases_exchanged_it_runs_away(void **state)
{
    struct sim_plant plant = plant_of(config(100000, 1000));
    double before = 0;

    (void)state;
    plant.reversed = true;
    for (int i = 0; i < 200; i++) {
        sim_plant_step(&plant, ONE_Q24, 0, STEP_NS);
        assert_true(counts(plant.pos_q24) < before);
        before = counts(plant.pos_q24);
    }
    assert_true(before < -10);
}

static void
the_encoder_says_whole_steps_with_noise_of_its_deviation(void **state)
{
    const struct sim_plant_config c = config(100000, 900);
    struct sim_plant plant = plant_of(c);
    double sum = 0, squares = 0;
    enum { STEPS = 20000 };

    (void)state;
    plant.encoder_step_q24 = ONE_Q24 / 4;
    plant.encoder_noise_q24 = 3 * ONE_Q24;
    plant.encoder_seed = 7;
    for (int i = 0; i < STEPS; i++) {
        sim_plant_coast(&plant, STEP_NS);
        const int64_t seen_q24 = sim_plant_measured_q24(&plant);
        assert_int_equal(seen_q24 % (ONE_Q24 / 4), 0);
        const double off = counts(seen_q24 - plant.pos_q24);
        sum += off;
        squares += off * off;
    }
    assert_true(fabs(sum / STEPS) < 0.1);
    assert_true(fabs(sqrt(squares / STEPS) - 3) < 0.1);
    /* and the loop moves its motor by it */
    sim_plant_step(&plant, plant.pos_q24, 0, STEP_NS);
    assert_int_not_equal(plant.vel_q24, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_step_settles_without_more_overshoot_than_theory),
        cmocka_unit_test(
            the_step_response_is_that_of_the_differential_equation),
        cmocka_unit_test(velocity_and_current_limits_hold_at_every_step),
        cmocka_unit_test(a_steady_ramp_is_followed_without_lag),
        cmocka_unit_test(a_long_step_is_cut_up_and_ends_where_short_ones_do),
        cmocka_unit_test(without_torque_the_axis_slows_down_and_stands),
        cmocka_unit_test(the_end_of_the_world_stops_it),
        cmocka_unit_test(friction_holds_the_rotor_within_its_band),
        cmocka_unit_test(with_phases_exchanged_it_runs_away),
        cmocka_unit_test(
            the_encoder_says_whole_steps_with_noise_of_its_deviation),
        cmocka_unit_test(configs_outside_the_ranges_are_refused),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
