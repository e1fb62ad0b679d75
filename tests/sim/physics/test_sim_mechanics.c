/* tests/sim/physics/test_sim_mechanics.c - a load on a motor, and the loop of the
 * simulated servos with one. */
#include <math.h>

#include "sim/physics/mechanics.h"
#include "tests/sim/bus/sim_bus.h"
#include "tests/sim/oracle.h"
#include "tests/sim/physics/physics_random.h"

#define ONE_Q24 (INT64_C(1) << 24)
#define STEP_S  250e-6
#define STEP_NS 250000

static const double pi = 3.14159265358979323846;

static const struct sim_mechanics_config swinging = { .inertia_ratio = 4,
                                                      .frequency_hz = 7 };

static struct sim_mechanics mechanics;
static int64_t pos_q24, vel_q24;

static void build(const struct sim_mechanics_config *config)
{
    pos_q24 = 1000 * ONE_Q24;
    vel_q24 = 0;
    assert_int_equal(sim_mechanics_init(&mechanics, config, pos_q24),
                     MOTION_OK);
}

static double load(void)
{
    return ldexp((double)sim_mechanics_load_q24(&mechanics), -24);
}

static double motor(void)
{
    return ldexp((double)pos_q24, -24);
}

static void pull_load(double counts)
{
    mechanics.drive.y[1] += counts;
    sim_drivetrain_reset(&mechanics.drive);
}

/* The mean time between rising zeros of what `of` says. */
static double period_s(double (*of)(void), void (*step)(void))
{
    double before = of(), first = -1, last = -1;
    unsigned count = 0;

    for (unsigned i = 1; i < 80000; i++) {
        step();
        const double now = of();
        if (before < 0 && now >= 0) {
            last = STEP_S * (i - now / (now - before));
            if (first < 0)
                first = last;
            else
                count++;
        }
        before = now;
    }
    assert_true(count > 10);
    return (last - first) / count;
}

static double off_motor(void)
{
    return load() - motor();
}

static void step_held(void)
{
    sim_mechanics_drag(&mechanics, STEP_S, pos_q24, pos_q24, 0);
}

static void step_with(double torque)
{
    sim_mechanics_step(&mechanics, torque, STEP_S, &pos_q24, &vel_q24);
    if (vel_q24 == 0)
        vel_q24 = 1; /* nobody holds it */
}

static void step_free(void)
{
    step_with(0);
}

static void with_the_motor_held_it_swings_at_its_frequency(void **state)
{
    (void)state;
    build(&swinging);
    pull_load(50);
    const double got = 1 / period_s(off_motor, step_held);
    if (fabs(got / 7 - 1) > 0.001)
        fail_msg("%.5f Hz, expected 7", got);
}

/* f sqrt(1 + ratio): the resonance of the motor's response. */
static void free_it_swings_at_the_resonance(void **state)
{
    (void)state;
    build(&swinging);
    vel_q24 = 1;
    pull_load(50);
    const double got = 1 / period_s(off_motor, step_free);
    if (fabs(got / (7 * sqrt(5)) - 1) > 0.005)
        fail_msg("%.5f Hz, expected %.5f", got, 7 * sqrt(5));
}

static void no_energy_comes_from_anywhere(void **state)
{
    const struct sim_mechanics_config rough = { .inertia_ratio = 4,
                                                .frequency_hz = 7,
                                                .damping = 0.01,
                                                .backlash_counts = 30,
                                                .coulomb_counts_s2 = 100,
                                                .static_counts_s2 = 100 };
    (void)state;
    build(&rough);
    vel_q24 = 1;
    pull_load(200);
    double before = oracle_drivetrain_energy_j(&mechanics.drive);
    const double begin = before;
    for (unsigned i = 0; i < 200000; i++) {
        step_free();
        const double now = oracle_drivetrain_energy_j(&mechanics.drive);
        if (now > before + 1e-9 * begin)
            fail_msg("step %u: %.12g, %.12g before", i, now, before);
        before = now;
    }
    assert_int_equal(mechanics.failed, 0);
}

/* g / omega^2 of the whole mass on the load's spring, and there it stays. */
static void a_weight_hangs_where_it_hangs(void **state)
{
    const struct sim_mechanics_config heavy = { .inertia_ratio = 4,
                                                .frequency_hz = 7,
                                                .weight_counts_s2 = 5000 };
    const double omega = 2 * pi * 7, sag = 5000 / (omega * omega * 0.8);

    (void)state;
    build(&heavy);
    for (unsigned i = 0; i < 40000; i++)
        step_held();
    assert_true(fabs(off_motor() + sag) < 1e-6 * sag);
    /* the brake holds the motor from step to step, not in between */
    assert_true(sim_mechanics_swing_counts(&mechanics) < 1e-5 * sag);
}

static void the_swing_is_the_amplitude_in_every_phase(void **state)
{
    (void)state;
    build(&swinging);
    pull_load(50);
    for (unsigned i = 0; i < 4000; i++) {
        step_held();
        if (fabs(sim_mechanics_swing_counts(&mechanics) - 50) > 0.01)
            fail_msg("%u: %.4f", i, sim_mechanics_swing_counts(&mechanics));
    }
}

static void a_drive_that_counts_anew_takes_its_load_along(void **state)
{
    const struct sim_mechanics_config between = { .inertia_ratio = 4,
                                                  .frequency_hz = 7,
                                                  .has_stops = true,
                                                  .stop_low_counts = 900,
                                                  .stop_high_counts = 1200 };
    (void)state;
    build(&between);
    pos_q24 = 0;
    sim_mechanics_step(&mechanics, 0, STEP_S, &pos_q24, &vel_q24);
    assert_true(fabs(off_motor()) < 1e-6);
    /* and the stops: 200 above where it stood */
    for (unsigned i = 0; i < 20000; i++) {
        sim_mechanics_step(&mechanics, 2000, STEP_S, &pos_q24, &vel_q24);
        assert_true(load() <= 200 + 1e-6);
    }
    assert_true(load() > 199);
}

/* ---- transmission, second mass ---- */

static const struct sim_mechanics_config three = {
    .inertia_ratio = 1.5,
    .frequency_hz = 9,
    .second = { .inertia_ratio = 0.7, .frequency_hz = 14 },
};

/* twist'' = -[a, -b; -c, d] twist of the two couplings, from the three equations
 * of motion; let go in a mode's shape it swings at the root of its eigenvalue. */
static void three_masses_swing_at_their_eigenfrequencies(void **state)
{
    const double motor = 1 / 3.2, first = 1.5 / 3.2, second = 0.7 / 3.2;
    const double k1 = 324 * pi * pi * first, k2 = 784 * pi * pi * second;
    const double a = k1 / motor + k1 / first, b = k2 / first;
    const double c = k1 / first, d = k2 / first + k2 / second;
    const double root = sqrt((a - d) * (a - d) / 4 + b * c);

    (void)state;
    for (int sign = -1; sign <= 1; sign += 2) {
        const double square = (a + d) / 2 + sign * root;
        const double want = sqrt(square) / (2 * pi);
        build(&three);
        vel_q24 = 1;
        mechanics.drive.y[1] -= 50;
        mechanics.drive.y[2] -= 50 + 50 * (a - square) / b;
        sim_drivetrain_reset(&mechanics.drive);
        const double got = 1 / period_s(off_motor, step_free);
        if (fabs(got / want - 1) > 0.001)
            fail_msg("%.5f Hz, expected %.5f", got, want);
    }
}

/* Of two masses no phase shows all: it is an upper bound, and reached where one
 * is let go along the give of both couplings. */
static void the_swing_of_two_masses_is_the_most_that_it_can_be(void **state)
{
    double most = 0;

    (void)state;
    build(&three);
    mechanics.drive.y[1] += 30;
    mechanics.drive.y[2] += 70;
    sim_drivetrain_reset(&mechanics.drive);
    const double begin = sim_mechanics_swing_counts(&mechanics);
    for (unsigned i = 0; i < 40000; i++) {
        step_held();
        const double swing = sim_mechanics_swing_counts(&mechanics);
        most = fmax(most, fabs(off_motor()));
        if (fabs(swing - begin) > 1e-3 * begin)
            fail_msg("%u: %.4f, at first %.4f", i, swing, begin);
    }
    if (most > begin || most < 0.8 * begin)
        fail_msg("%.3f at most, %.3f possible", most, begin);
}

static bool drives(double weight, double efficiency, double torque)
{
    const struct sim_mechanics_config screw = {
        .inertia_ratio = 4,
        .frequency_hz = 60,
        .damping = 0.3,
        .weight_counts_s2 = weight,
        .transmission = { .efficiency = efficiency },
    };

    build(&screw);
    for (unsigned i = 0; i < 8000; i++)
        step_with(torque);
    return fabs(motor() - 1000) > 100;
}

/* To lift takes weight / eta, and it sinks only where less than weight (2 - 1 /
 * eta) holds it: below a half never. */
static void a_screw_takes_what_its_efficiency_says(void **state)
{
    static const double efficiency[] = { 0.9, 0.6, 0.4 };

    (void)state;
    for (size_t i = 0; i < 3; i++) {
        const double up = 5000 / efficiency[i], down = 10000 - up;
        assert_false(drives(5000, efficiency[i], 0.98 * up));
        assert_true(drives(5000, efficiency[i], 1.02 * up));
        assert_false(drives(5000, efficiency[i], down + 0.02 * up));
        assert_true(drives(5000, efficiency[i], down - 0.02 * up));
    }
    assert_false(drives(5000, 0.4, 0));
    assert_true(drives(5000, 0, 5200));
}

/* With the motor held anywhere, the load stands off by the error of the pitch
 * there; what swings on it keeps its energy. */
static void the_error_of_a_pitch_is_a_sine_of_its_own(void **state)
{
    struct sim_mechanics_config screw = {
        .inertia_ratio = 4,
        .frequency_hz = 30,
        .damping = 0.5,
        .transmission = { .pitch_counts = 400, .pitch_error_counts = 12 },
    };

    (void)state;
    build(&screw);
    for (unsigned i = 0; i < 40; i++) {
        for (unsigned k = 0; k < 1000; k++)
            step_held();
        const double want = 12 * sin(2 * pi * motor() / 400);
        if (fabs(off_motor() - want) > 1e-3)
            fail_msg("at %.0f: %.5f, expected %.5f", motor(), off_motor(),
                     want);
        pos_q24 += 37 * ONE_Q24;
        sim_mechanics_drag(&mechanics, STEP_S, pos_q24 - 37 * ONE_Q24, pos_q24,
                           0);
    }
    screw.damping = 0;
    build(&screw);
    vel_q24 = 1;
    pull_load(300);
    const double begin = oracle_drivetrain_energy_j(&mechanics.drive);
    for (unsigned i = 0; i < 40000; i++) {
        step_free();
        const double now = oracle_drivetrain_energy_j(&mechanics.drive);
        if (fabs(now / begin - 1) > 1e-5)
            fail_msg("step %u: %.12g, at first %.12g", i, now, begin);
    }
}

static void what_cannot_be_is_refused(void **state)
{
    struct sim_mechanics_config config = swinging;

    (void)state;
    config.inertia_ratio = 0;
    assert_int_equal(sim_mechanics_init(&mechanics, &config, 0), MOTION_E_ARG);
    config = swinging;
    config.frequency_hz = NAN;
    assert_int_equal(sim_mechanics_init(&mechanics, &config, 0), MOTION_E_ARG);
    config = swinging;
    config.static_counts_s2 = 5; /* without a Stribeck speed */
    assert_int_equal(sim_mechanics_init(&mechanics, &config, 0), MOTION_E_ARG);
    config = swinging;
    config.has_stops = true;
    config.stop_low_counts = 1;
    config.stop_high_counts = 2;
    assert_int_equal(sim_mechanics_init(&mechanics, &config, 0), MOTION_E_ARG);
    config = three;
    config.second.frequency_hz = 501;
    assert_int_equal(sim_mechanics_init(&mechanics, &config, 0), MOTION_E_ARG);
    config = swinging;
    config.transmission.efficiency = 0.04;
    assert_int_equal(sim_mechanics_init(&mechanics, &config, 0), MOTION_E_ARG);
    config.transmission =
        (struct sim_mechanics_transmission){ .pitch_counts = 12,
                                             .pitch_error_counts = 1 };
    assert_int_equal(sim_mechanics_init(&mechanics, &config, 0), MOTION_E_ARG);
}

/* ---- the servo with it ---- */

static struct sim_plant plant;

static void build_servo(const struct sim_mechanics_config *config)
{
    const struct sim_plant_config servo = { .omega_mrad_s = 157080,
                                            .zeta_permille = 900,
                                            .vel_max_counts_s = 1000000,
                                            .acc_max_counts_s2 = 10000000 };

    assert_int_equal(sim_plant_init(&plant, &servo, 1000), MOTION_OK);
    assert_int_equal(sim_mechanics_init(&mechanics, config, plant.pos_q24),
                     MOTION_OK);
    plant.mechanics = &mechanics;
}

static double servo_off(double target)
{
    return ldexp((double)plant.pos_q24, -24) - target;
}

static void its_loop_carries_a_weight_and_holds_it(void **state)
{
    const struct sim_mechanics_config heavy = { .inertia_ratio = 4,
                                                .frequency_hz = 12,
                                                .damping = 0.05,
                                                .weight_counts_s2 = 5000 };
    (void)state;
    build_servo(&heavy);
    for (unsigned i = 0; i < 8000; i++)
        sim_plant_step(&plant, 1000 * ONE_Q24, 0, STEP_NS);
    assert_true(fabs(servo_off(1000)) < 0.01);
}

/* The motor is where it is told, the load half the gap behind, on the side from
 * which it came. */
static void backlash_is_seen_at_the_load_alone(void **state)
{
    const struct sim_mechanics_config loose = { .inertia_ratio = 4,
                                                .frequency_hz = 40,
                                                .damping = 0.1,
                                                .backlash_counts = 60,
                                                .coulomb_counts_s2 = 2000,
                                                .static_counts_s2 = 2000 };
    (void)state;
    build_servo(&loose);
    double at = 1000;
    for (int direction = 1; direction >= -1; direction -= 2) {
        for (unsigned i = 0; i < 20000; i++) {
            if (i < 16000)
                at += direction * 0.0125; /* 50 counts/s: it does not roll on */
            sim_plant_step(&plant, llround(at * 0x1p24),
                           i < 16000 ? direction * 50 * ONE_Q24 : 0, STEP_NS);
        }
        const double behind =
            direction * (ldexp((double)plant.pos_q24, -24) - load());
        assert_true(fabs(servo_off(at)) < 1);
        /* and what friction winds up of 1/k */
        if (behind < 25 || behind > 35)
            fail_msg("%+d: %.3f behind, expected 30", direction, behind);
    }
}

static void it_comes_no_further_than_its_stop(void **state)
{
    const struct sim_mechanics_config between = { .inertia_ratio = 4,
                                                  .frequency_hz = 12,
                                                  .damping = 0.05,
                                                  .has_stops = true,
                                                  .stop_low_counts = 0,
                                                  .stop_high_counts = 2000 };
    (void)state;
    build_servo(&between);
    double at = 1000;
    for (unsigned i = 0; i < 8000; i++) {
        at += 0.5;
        sim_plant_step(&plant, llround(at * 0x1p24), 2000 * ONE_Q24, STEP_NS);
        assert_true(load() <= 2000 + 1e-6);
    }
    assert_true(load() > 1999 && servo_off(at) < -500);
}

/* A servo that is held for a while when its target goes on, then let go. */
struct held_case {
    struct sim_plant_config servo;
    struct sim_mechanics_config load;
    struct sim_loops_config loops; /* position_hz 0: of second order */
    double speed, far;             /* of the target: counts/s, counts */
    int64_t from_ns, until_ns, end_ns;
};

/* With a current limit far below what the error asks for, any loop swings for long:
 * it has a fifth of it or more. */
static struct held_case held_draw(bool cascade)
{
    const double hz = cascade ? physics_random(2, 8) : physics_random(3, 20);
    const double omega = 2 * pi * hz, speed = physics_random(500, 20000);
    const double far = speed * physics_random(0.3, 3);
    const double acc = omega * omega * far * physics_random(0.2, 2);
    struct held_case held = {
        .servo = { .omega_mrad_s = (uint32_t)(omega * 1000),
                   .zeta_permille = (uint16_t)physics_random(800, 1200),
                   .vel_max_counts_s = 10000000,
                   .acc_max_counts_s2 = (int64_t)acc },
        .load = { .inertia_ratio = physics_random(0.2, 4),
                  .frequency_hz = hz * physics_random(6, 12),
                  .damping = physics_random(0.1, 0.4),
                  .weight_counts_s2 = acc * physics_random(-0.4, 0.4) },
        .speed = speed,
        .far = far,
        .from_ns = llround(physics_random(0, 0.25) * 1e9),
        .until_ns = llround(physics_random(1, 5) * 1e9),
    };
    /* the slowest pole is at omega / 6 or so: e^-25 of it is left */
    held.end_ns =
        llround(fmax(1e-9 * (double)held.until_ns, far / speed) * 1e9) +
        llround(150e9 / omega);
    if (cascade)
        held.loops = (struct sim_loops_config){
            .position_hz = hz,
            .velocity_hz = hz * physics_random(4, 8),
            .current_hz = 500,
            .reset_s = physics_random(0.05, 0.3),
            .position_ns = 1000000,
            .velocity_ns = 500000,
            .current_ns = 100000,
        };
    return held;
}

/* How far beside its target it rests. */
static double held_rest(const struct held_case *held, bool is_held)
{
    double at = 0;
    assert_int_equal(sim_plant_init(&plant, &held->servo, 0), MOTION_OK);
    assert_int_equal(sim_mechanics_init(&mechanics, &held->load, plant.pos_q24),
                     MOTION_OK);
    plant.mechanics = &mechanics;
    if (held->loops.position_hz > 0)
        assert_int_equal(sim_plant_set_loops(&plant, &held->loops), MOTION_OK);
    for (int64_t now_ns = 0; now_ns < held->end_ns; now_ns += STEP_NS) {
        const double before = at;
        at = fmin(held->far, held->speed * 1e-9 * (double)now_ns);
        const int64_t slope_q24 = llround((at - before) / STEP_S * 0x1p24);
        if (is_held && now_ns >= held->from_ns && now_ns < held->until_ns)
            sim_plant_press(&plant, llround(at * 0x1p24), slope_q24, STEP_NS);
        else
            sim_plant_step(&plant, llround(at * 0x1p24), slope_q24, STEP_NS);
    }
    return servo_off(at);
}

static void it_rests_where_it_is_told_whatever_held_it(void **state)
{
    (void)state;
    physics_begin();
    for (unsigned i = 0; i < 24; i++) {
        const uint64_t seed = physics_seed;
        const struct held_case held = held_draw(i % 2 != 0);
        const double was = held_rest(&held, true);
        const double free_off = held_rest(&held, false);
        if (!(fabs(was) < 0.1) || !(fabs(free_off) < 0.1))
            fail_msg("SEED=%llu: %.4f counts beside its target, %.4f where "
                     "nothing held it",
                     (unsigned long long)seed, was, free_off);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(with_the_motor_held_it_swings_at_its_frequency),
        cmocka_unit_test(free_it_swings_at_the_resonance),
        cmocka_unit_test(no_energy_comes_from_anywhere),
        cmocka_unit_test(a_weight_hangs_where_it_hangs),
        cmocka_unit_test(the_swing_is_the_amplitude_in_every_phase),
        cmocka_unit_test(a_drive_that_counts_anew_takes_its_load_along),
        cmocka_unit_test(three_masses_swing_at_their_eigenfrequencies),
        cmocka_unit_test(the_swing_of_two_masses_is_the_most_that_it_can_be),
        cmocka_unit_test(a_screw_takes_what_its_efficiency_says),
        cmocka_unit_test(the_error_of_a_pitch_is_a_sine_of_its_own),
        cmocka_unit_test(what_cannot_be_is_refused),
        cmocka_unit_test(its_loop_carries_a_weight_and_holds_it),
        cmocka_unit_test(backlash_is_seen_at_the_load_alone),
        cmocka_unit_test(it_comes_no_further_than_its_stop),
        cmocka_unit_test(it_rests_where_it_is_told_whatever_held_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
