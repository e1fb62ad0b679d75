/* tests/sim/physics/test_sim_winding.c - a motor's voltage and heat, and the loops
 * of a servo, alone and in the plant. */
#include "sim/physics/winding.h"

#include "motion/core/err.h"
#include "sim/physics/plant.h"
#include "tests/sim/physics/physics_random.h"

#define ONE_Q24 (INT64_C(1) << 24)
#define STEP_NS 125000
#define FAR_Q24 (INT64_C(1) << 54)

static struct sim_plant plant;

static void build(double acc_max)
{
    const struct sim_plant_config servo = { .omega_mrad_s = 157080,
                                            .zeta_permille = 900,
                                            .vel_max_counts_s = 100000000,
                                            .acc_max_counts_s2 =
                                                llround(acc_max) };

    assert_int_equal(sim_plant_init(&plant, &servo, 0), MOTION_OK);
}

static void wind(const struct sim_winding_config *config)
{
    assert_int_equal(sim_plant_set_winding(&plant, config), MOTION_OK);
}

static double speed(void)
{
    return ldexp((double)plant.vel_q24, -24);
}

/* stall / no_load v' = stall (1 - v / no_load): an exponential up to the no-load
 * speed, whatever torque is wanted. */
static void it_runs_up_to_its_no_load_speed(void **state)
{
    (void)state;
    for (int i = 0; i < 20; i++) {
        const double rate = physics_random(5, 60);
        const double top = physics_random(1e4, 1e6);
        const struct sim_winding_config config = { .stall_counts_s2 =
                                                       rate * top,
                                                   .no_load_counts_s = top };
        build(100 * rate * top);
        wind(&config);
        /* of the torque that is held over an inner step */
        const double step = 1e-9 * STEP_NS * rate;
        for (int k = 1; k <= 8000; k++) {
            sim_plant_step(&plant, FAR_Q24, 0, STEP_NS);
            const double want = top * (1 - exp(-1e-9 * STEP_NS * rate * k));
            physics_near("speed", speed(), want, step * top);
        }
        physics_near("no-load speed", speed(), top,
                     top * (2 * exp(-1e-9 * STEP_NS * rate * 8000) + 1e-6));
    }
}

/* What it presses with while something holds it: the stall torque. */
static void held_it_has_its_stall_torque(void **state)
{
    const struct sim_winding_config config = { .stall_counts_s2 = 70000,
                                               .no_load_counts_s = 20000 };

    (void)state;
    build(1e6);
    wind(&config);
    for (int k = 0; k < 10; k++)
        sim_plant_press(&plant, FAR_Q24, 0, STEP_NS);
    physics_near("torque", (double)plant.acc_q8 / 256, 70000, 0.01);
    assert_true(plant.pos_q24 == 0 && plant.vel_q24 == 0 && plant.saturated);
    /* the current limit is the lower one */
    build(50000);
    wind(&config);
    sim_plant_press(&plant, -FAR_Q24, 0, STEP_NS);
    physics_near("torque", (double)plant.acc_q8 / 256, -50000, 0.01);
    /* at a third of the no-load speed two thirds are left, against it 4 / 3 */
    physics_near("ahead", sim_winding_torque(&plant.winding, 1e9, 20000.0 / 3),
                 70000 * 2.0 / 3, 1e-6);
    physics_near("back", sim_winding_torque(&plant.winding, -1e9, 20000.0 / 3),
                 -70000 * 4.0 / 3, 1e-6);
    physics_near("between", sim_winding_torque(&plant.winding, 7, 1000), 7, 0);
}

/* tau ln(x^2 / (x^2 - 1)), x the overload. */
static void it_is_too_hot_after_the_time_of_its_overload(void **state)
{
    (void)state;
    for (int i = 0; i < 20; i++) {
        const double tau = physics_random(0.5, 3);
        const double over = physics_random(1.2, 4);
        const double part = physics_random(0.5, 0.95);
        const struct sim_winding_config config = { .rated_counts_s2 = 10000,
                                                   .time_constant_s = tau,
                                                   .warm_load = part };
        const double square = over * over;
        double warm_s = 0, hot_s = 0;
        build(10000 * over);
        wind(&config);
        for (int k = 1; k <= 60000; k++) {
            sim_plant_press(&plant, FAR_Q24, 0, STEP_NS);
            if (plant.winding.warm && warm_s == 0)
                warm_s = 1e-9 * STEP_NS * k;
            if (plant.winding.hot && hot_s == 0)
                hot_s = 1e-9 * STEP_NS * k;
        }
        physics_near("warning", warm_s, tau * log(square / (square - part)),
                     1e-9 * STEP_NS);
        physics_near("too hot", hot_s, tau * log(square / (square - 1)),
                     1e-9 * STEP_NS);
    }
}

static void it_cools_down_and_is_cool_below_its_warning(void **state)
{
    const struct sim_winding_config config = { .rated_counts_s2 = 10000,
                                               .time_constant_s = 0.5,
                                               .warm_load = 0.8 };
    double cool_s = 0;

    (void)state;
    build(20000);
    wind(&config);
    while (!plant.winding.hot)
        sim_plant_press(&plant, FAR_Q24, 0, STEP_NS);
    const double load = plant.winding.thermal.load;
    while (plant.winding.hot) {
        sim_plant_coast(&plant, STEP_NS);
        cool_s += 1e-9 * STEP_NS;
    }
    physics_near("cool", cool_s, 0.5 * log(load / 0.72), 2e-9 * STEP_NS);
    assert_false(plant.winding.warm);
}

static void what_is_no_winding_is_refused(void **state)
{
    static const struct sim_winding_config bad[] = {
        { 0 },
        { .stall_counts_s2 = 1 },
        { .stall_counts_s2 = -1, .no_load_counts_s = 1 },
        { .stall_counts_s2 = 1001, .no_load_counts_s = 1 },
        { .rated_counts_s2 = 1, .warm_load = 0.9 },
        { .rated_counts_s2 = 1, .time_constant_s = 0.01, .warm_load = 0.9 },
        { .rated_counts_s2 = 1, .time_constant_s = 1, .warm_load = 1.1 },
        { .rated_counts_s2 = -1, .time_constant_s = 1, .warm_load = 0.9 },
    };
    struct sim_winding winding;

    (void)state;
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
        if (sim_winding_init(&winding, &bad[i]) != MOTION_E_ARG)
            fail_msg("%zu is taken", i);
}

/* ---- loops ---- */

static const struct sim_loops_config usual = { .position_hz = 8,
                                               .velocity_hz = 60,
                                               .current_hz = 1000,
                                               .position_ns = 1000000,
                                               .velocity_ns = 250000,
                                               .current_ns = 62500 };

static void loop(const struct sim_loops_config *config)
{
    assert_int_equal(sim_plant_set_loops(&plant, config), MOTION_OK);
}

/* Each loop is seen at its own rate: the torque changes at samples of the current
 * loop, its demand at those of the velocity loop, that of the speed at those of
 * the position loop. */
static void each_loop_has_its_rate(void **state)
{
    unsigned torque = 0, demand = 0, speeds = 0;

    (void)state;
    build(1e9);
    loop(&usual);
    for (int k = 0; k < 4000; k++) { /* 100 ms */
        const struct sim_loops before = plant.loops;
        sim_plant_step(&plant, (int64_t)k * ONE_Q24, 0, 25000);
        torque += plant.loops.torque != before.torque;
        demand += plant.loops.a_ref != before.a_ref;
        speeds += plant.loops.v_ref != before.v_ref;
    }
    assert_in_range(torque, 1580, 1600);
    assert_in_range(demand, 395, 400);
    assert_in_range(speeds, 99, 100);
}

/* Without an integral, and with the current loop fast beside it, the position of
 * a small step is that of s^2 / w_v + s + w_p = 0 (two real poles). */
static void a_small_step_is_that_of_the_cascade(void **state)
{
    const struct sim_loops_config fine = { .position_hz = 4,
                                           .velocity_hz = 40,
                                           .current_hz = 5000,
                                           .position_ns = 50000,
                                           .velocity_ns = 50000,
                                           .current_ns = 25000 };
    const double wp = 8 * acos(-1), wv = 80 * acos(-1);
    const double root = sqrt(wv * wv / 4 - wp * wv);
    const double slow = wv / 2 - root, fast = wv / 2 + root;

    (void)state;
    build(1e12);
    loop(&fine);
    for (int k = 1; k <= 1600; k++) { /* 200 ms */
        sim_plant_step(&plant, 100000 * ONE_Q24, 0, STEP_NS);
        const double t = 1e-9 * STEP_NS * k;
        const double want =
            1 - (fast * exp(-slow * t) - slow * exp(-fast * t)) / (fast - slow);
        physics_near("position", ldexp((double)plant.pos_q24, -24) / 1e5, want,
                     0.01);
    }
}

/* A weight is carried by the integral alone; without it it sags by
 * g / (w_p w_v). */
static void the_integral_carries_a_weight(void **state)
{
    struct sim_loops_config config = usual;
    const double stiffness =
        4 * acos(-1) * acos(-1) * config.position_hz * config.velocity_hz;

    (void)state;
    for (int with = 0; with <= 1; with++) {
        config.reset_s = with ? 0.05 : 0;
        build(1e9);
        loop(&config);
        sim_plant_pull(&plant, -1e6);
        for (int k = 0; k < 16000; k++)
            sim_plant_step(&plant, 0, 0, STEP_NS);
        physics_near("sag", ldexp((double)plant.pos_q24, -24),
                     with ? 0 : -1e6 / stiffness, 0.01);
    }
}

/* While current or voltage are at their limit, the integral stays what it is: for
 * a second a rotor is held a long way from its target. */
static void the_integral_does_not_wind_up_at_a_limit(void **state)
{
    static const struct sim_winding_config weak = { .stall_counts_s2 = 1e5,
                                                    .no_load_counts_s = 2e4 };
    struct sim_loops_config config = usual;

    (void)state;
    config.reset_s = 0.1;
    for (int volts = 0; volts <= 1; volts++) {
        build(volts ? 1e9 : 1e5);
        loop(&config);
        if (volts)
            wind(&weak);
        sim_plant_press(&plant, 1000 * ONE_Q24, 0, STEP_NS);
        const double begin = plant.loops.integral;
        for (int k = 0; k < 8000; k++)
            sim_plant_press(&plant, 1000 * ONE_Q24, 0, STEP_NS);
        assert_true(plant.loops.a_ref > 9e4);
        physics_near("integral", plant.loops.integral, begin, 0);
    }
}

static void what_are_no_loops_is_refused(void **state)
{
    struct sim_loops loops;

    (void)state;
    assert_int_equal(sim_loops_init(&loops, &usual), MOTION_OK);
#define BAD(field, bad)                                                        \
    do {                                                                       \
        struct sim_loops_config config = usual;                                \
        config.field = (bad);                                                  \
        if (sim_loops_init(&loops, &config) != MOTION_E_ARG)                   \
            fail_msg(#field " = " #bad " is taken");                           \
    } while (0)
    BAD(position_hz, 0.05);
    BAD(position_hz, 61);
    BAD(velocity_hz, NAN);
    BAD(velocity_hz, 1001);
    BAD(velocity_hz, 401); /* 250 us are more than a tenth of its period */
    BAD(current_hz, 59);
    BAD(current_hz, 5001);
    BAD(reset_s, 1e-4);
    BAD(reset_s, 11);
    BAD(position_ns, 1100000);
    BAD(velocity_ns, 200000);
    BAD(velocity_ns, 0);
    BAD(current_ns, 10000);
    BAD(current_ns, 62501);
#undef BAD
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_runs_up_to_its_no_load_speed),
        cmocka_unit_test(held_it_has_its_stall_torque),
        cmocka_unit_test(it_is_too_hot_after_the_time_of_its_overload),
        cmocka_unit_test(it_cools_down_and_is_cool_below_its_warning),
        cmocka_unit_test(what_is_no_winding_is_refused),
        cmocka_unit_test(each_loop_has_its_rate),
        cmocka_unit_test(a_small_step_is_that_of_the_cascade),
        cmocka_unit_test(the_integral_carries_a_weight),
        cmocka_unit_test(the_integral_does_not_wind_up_at_a_limit),
        cmocka_unit_test(what_are_no_loops_is_refused),
    };
    physics_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
