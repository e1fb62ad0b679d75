/* tests/sim/physics/test_sim_drivetrain.c - closed forms with random
 * parameters, energy, refusals.  Takes long. */
#include "sim/physics/drivetrain.h"

#include <complex.h>

#include "motion/core/err.h"
#include "tests/sim/oracle.h"
#include "tests/sim/physics/physics_random.h"
#include "tests/support/check.h"

#define ROUNDS 50
#define TICK_S 1e-3

static const struct sim_drivetrain_input none;
static struct sim_drivetrain_event events[1000];

static void begin(struct sim_drivetrain *drive,
                  const struct sim_drivetrain_config *config, double angle,
                  double speed)
{
    assert_int_equal(sim_drivetrain_init(drive, config), MOTION_OK);
    drive->events = events;
    drive->events_max = 1000;
    for (int i = 0; i < config->inertias; i++) {
        drive->y[i] = angle;
        drive->y[config->inertias + i] = speed;
    }
    sim_drivetrain_reset(drive);
}

static void run(struct sim_drivetrain *drive,
                const struct sim_drivetrain_input *input, int ticks)
{
    for (int i = 0; i < ticks; i++)
        assert_int_equal(sim_drivetrain_step(drive, i * TICK_S, TICK_S, input),
                         MOTION_OK);
}

static double last_of(const struct sim_drivetrain *drive,
                      enum sim_drivetrain_kind kind)
{
    for (unsigned i = drive->events_count; i > 0; i--) {
        if (events[i - 1].kind == kind)
            return events[i - 1].t_s;
    }
    return NAN;
}

static void coulomb_friction_stops_at_its_time(void **state)
{
    (void)state;
    for (int i = 0; i < ROUNDS; i++) {
        const double inertia = physics_random(1e-4, 1e-2);
        const double torque = physics_random(0.01, 0.1);
        const double speed = physics_random(1, 1.9 * torque / inertia);
        struct sim_drivetrain_config config = { .inertias = 1 };
        struct sim_drivetrain drive;

        config.inertia[0] = (struct sim_inertia){ .inertia_kg_m2 = inertia,
                                                  .coulomb_n_m = torque,
                                                  .static_n_m = torque };
        begin(&drive, &config, 0, -speed);
        run(&drive, &none, 2000);
        physics_near("stop time", last_of(&drive, SIM_DRIVETRAIN_STICK),
                     inertia * speed / torque, 1e-9);
        physics_near("stop angle", drive.y[0],
                     -0.5 * inertia * speed * speed / torque, 1e-9 * speed);
        assert_true(drive.y[1] == 0);
    }
}

static void friction_holds_up_to_the_static_torque(void **state)
{
    (void)state;
    for (int i = 0; i < ROUNDS; i++) {
        const double hold = physics_random(0.02, 0.2);
        struct sim_drivetrain_config config = { .inertias = 1 };
        struct sim_drivetrain_input input = { .torque_n_m.c[0] = 0.999 * hold };
        struct sim_drivetrain drive;

        config.inertia[0] =
            (struct sim_inertia){ .inertia_kg_m2 = 1e-3,
                                  .coulomb_n_m = 0.5 * hold,
                                  .static_n_m = hold,
                                  .stribeck_rad_s = physics_random(0.1, 3) };
        begin(&drive, &config, 1, 0);
        run(&drive, &input, 100);
        assert_true(drive.y[0] == 1 && drive.y[1] == 0);
        input.torque_n_m.c[0] = 1.001 * hold;
        run(&drive, &input, 100);
        assert_true(drive.y[1] > 0);
    }
}

/* Two free inertias: the twist swings at sqrt(k (1/(J1 N^2) + 1/J2)). */
static void two_masses_swing_at_their_frequency(void **state)
{
    (void)state;
    for (int i = 0; i < ROUNDS; i++) {
        const double ratio = physics_random(1, 12);
        struct sim_drivetrain_config config = { .inertias = 2 };
        struct sim_drivetrain drive;

        config.inertia[0].inertia_kg_m2 = physics_random(1e-4, 1e-3);
        config.inertia[1].inertia_kg_m2 = physics_random(1e-3, 1e-1);
        config.coupling[0] =
            (struct sim_coupling){ .stiffness_n_m_rad = physics_random(5, 300),
                                   .ratio = ratio };
        const double omega =
            sqrt(config.coupling[0].stiffness_n_m_rad *
                 (1 / (config.inertia[0].inertia_kg_m2 * ratio * ratio) +
                  1 / config.inertia[1].inertia_kg_m2));
        begin(&drive, &config, 0, 0);
        drive.y[0] = 0.01 * ratio;
        run(&drive, &none, 200);
        /* Gauss swings slower by (omega h)^4/720, and omega h < 1/4. */
        physics_near("twist", sim_drivetrain_twist_rad(&drive, 0),
                     0.01 * cos(omega * 0.2), 0.01 * 6e-6 * omega * 0.2);
    }
}

/* speed[0] / torque of three inertias.  From the load towards the motor: an
 * inertia's impedance is J s + b plus what hangs on it; through a coupling of
 * c + k/s the two conduct in series, through a gear of ratio N the motor side
 * feels 1/N^2. */
static double complex respond(const struct sim_drivetrain_config *config,
                              double omega)
{
    double complex impedance = 0;

    for (int i = 2; i >= 0; i--) {
        if (i < 2) {
            const struct sim_coupling *const coupling = &config->coupling[i];
            const double complex spring =
                coupling->damping_n_m_s +
                coupling->stiffness_n_m_rad / (I * omega);
            impedance *= spring / (spring + impedance) /
                         (coupling->ratio * coupling->ratio);
        }
        impedance += config->inertia[i].viscous_n_m_s +
                     I * omega * config->inertia[i].inertia_kg_m2;
    }
    return 1 / impedance;
}

/* The steps against the impedances: amplitude and phase of a driven row. */
static void the_response_is_that_of_the_steps(void **state)
{
    struct sim_drivetrain_config config = { .inertias = 3 };
    struct sim_drivetrain drive;
    const double freq = physics_random(5, 20), omega = 6.283185307179586 * freq;
    double re = 0, im = 0;
    int count = 0;

    (void)state;
    for (int i = 0; i < 3; i++) {
        config.inertia[i].inertia_kg_m2 = physics_random(5e-4, 1e-3);
        config.inertia[i].viscous_n_m_s = physics_random(5e-3, 1e-2);
        config.coupling[i % 2] =
            (struct sim_coupling){ .stiffness_n_m_rad = physics_random(5, 50),
                                   .damping_n_m_s = physics_random(1e-3, 1e-2),
                                   .ratio = i == 0 ? 3 : 1 };
    }
    begin(&drive, &config, 0, 0);
    for (int tick = 0; tick < 20000; tick++) {
        const double t = tick * TICK_S;
        struct sim_drivetrain_input input = { 0 };
        /* Taylor's polynomial over a tick: the rest is below 1e-7. */
        input.torque_n_m.c[0] = sin(omega * t);
        input.torque_n_m.c[1] = omega * cos(omega * t);
        for (int k = 2; k < SIM_SIGNAL_COEFFICIENTS; k++)
            input.torque_n_m.c[k] =
                -omega * omega * input.torque_n_m.c[k - 2] / (k * (k - 1));
        assert_int_equal(sim_drivetrain_step(&drive, t, TICK_S, &input),
                         MOTION_OK);
        if (t < 10)
            continue;
        const double speed = sim_drivetrain_speed_rad_s(&drive, 0);
        re += 2 * speed * sin(omega * (t + TICK_S));
        im += 2 * speed * cos(omega * (t + TICK_S));
        count++;
    }
    const double complex want = respond(&config, omega);
    physics_near("real", re / count, creal(want), 5e-3 * cabs(want));
    physics_near("imaginary", im / count, cimag(want), 5e-3 * cabs(want));
}

static void backlash_gains_no_energy_over_a_million_steps(void **state)
{
    struct sim_drivetrain_config config = { .inertias = 2 };
    struct sim_drivetrain drive;
    const int steps = check_cases(1000000);

    (void)state;
    for (int i = 0; i < 2; i++)
        config.inertia[i].inertia_kg_m2 = physics_random(1e-3, 3e-3);
    config.coupling[0] =
        (struct sim_coupling){ .stiffness_n_m_rad = physics_random(3, 20),
                               .gap_rad = physics_random(0.01, 0.05),
                               .ratio = 1 };
    begin(&drive, &config, 0, 0);
    drive.y[2] = 5;
    const double start = oracle_drivetrain_energy_j(&drive);
    for (int i = 0; i < steps; i++) {
        assert_int_equal(sim_drivetrain_step(&drive, 0, TICK_S, &none),
                         MOTION_OK);
        physics_near("energy", oracle_drivetrain_energy_j(&drive), start,
                     1e-5 * start);
    }
    assert_true(drive.events_count > (unsigned)steps / 1000);
}

static void a_stop_bounces_and_then_holds(void **state)
{
    (void)state;
    for (int i = 0; i < ROUNDS; i++) {
        const double e = physics_random(0.1, 0.8);
        const double push = physics_random(1, 20);
        const double away = physics_random(0.001, 0.05);
        struct sim_drivetrain_config config = { .inertias = 1 };
        struct sim_drivetrain_input input = { .torque_n_m.c[0] = push };
        struct sim_drivetrain drive;

        config.inertia[0] = (struct sim_inertia){
            .inertia_kg_m2 = 1,
            .stop = { .high = true, .high_rad = away, .restitution = e }
        };
        begin(&drive, &config, 0, 0);
        run(&drive, &input, 3000);
        const double first = sqrt(2 * away / push);
        physics_near("contact", events[0].t_s, first, 1e-9);
        physics_near("rebound", events[0].speed_rad_s, -e * push * first, 1e-9);
        physics_near("rest", last_of(&drive, SIM_DRIVETRAIN_REST),
                     first * (1 + e) / (1 - e), 1e-4);
        assert_true(drive.y[0] == away && drive.y[1] == 0);
        input.torque_n_m.c[0] = -push;
        run(&drive, &input, 10);
        physics_near("off", drive.y[0], away - 0.5 * push * 1e-4, 1e-12);
    }
}

static void a_motor_reaches_its_final_speed(void **state)
{
    (void)state;
    for (int i = 0; i < ROUNDS; i++) {
        struct sim_drivetrain_config config = { .inertias = 1 };
        const double volt = physics_random(-40, 40);
        const double k = physics_random(0.05, 0.1);
        const double b = physics_random(1e-5, 1e-4);
        const double r = physics_random(0.5, 2);
        const struct sim_drivetrain_input input = { .voltage_v.c[0] = volt };
        struct sim_drivetrain drive;

        config.inertia[0] =
            (struct sim_inertia){ .inertia_kg_m2 = 1e-4, .viscous_n_m_s = b };
        config.motor =
            (struct sim_motor){ .torque_constant_n_m_a = k,
                                .resistance_ohm = r,
                                .inductance_h = physics_random(1e-3, 1e-1) };
        begin(&drive, &config, 0, 0);
        run(&drive, &input, 5000);
        physics_near("speed", drive.y[1], volt * k / (r * b + k * k), 1e-6);
        physics_near("current", drive.y[2], volt * b / (r * b + k * k), 1e-6);
    }
}

static void what_is_no_drive_is_refused(void **state)
{
    struct sim_drivetrain drive;
    struct sim_drivetrain_config good = { .inertias = 2 }, bad;

    (void)state;
    good.inertia[0].inertia_kg_m2 = good.inertia[1].inertia_kg_m2 = 1;
    good.coupling[0] =
        (struct sim_coupling){ .stiffness_n_m_rad = 1, .ratio = 1 };
    assert_int_equal(sim_drivetrain_init(&drive, &good), MOTION_OK);
    assert_int_equal(sim_drivetrain_step(&drive, 0, 0, &none), MOTION_E_ARG);
    assert_int_equal(sim_drivetrain_step(&drive, 0, NAN, &none), MOTION_E_ARG);
#define REFUSED(change)                                                        \
    bad = good;                                                                \
    bad.change;                                                                \
    assert_int_equal(sim_drivetrain_init(&drive, &bad), MOTION_E_ARG)
    REFUSED(inertias = 0);
    REFUSED(inertias = SIM_DRIVETRAIN_INERTIAS + 1);
    REFUSED(inertia[1].inertia_kg_m2 = 0);
    REFUSED(inertia[0].viscous_n_m_s = NAN);
    REFUSED(inertia[0].coulomb_n_m = 1); /* more than static */
    REFUSED(inertia[0].static_n_m = 1);  /* without a Stribeck speed */
    REFUSED(inertia[0].stop.restitution = 1.1);
    REFUSED(coupling[0].ratio = 0);
    REFUSED(coupling[0].gap_rad = -1);
    REFUSED(motor.torque_constant_n_m_a = 1); /* without a resistance */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(coulomb_friction_stops_at_its_time),
        cmocka_unit_test(friction_holds_up_to_the_static_torque),
        cmocka_unit_test(two_masses_swing_at_their_frequency),
        cmocka_unit_test(the_response_is_that_of_the_steps),
        cmocka_unit_test(backlash_gains_no_energy_over_a_million_steps),
        cmocka_unit_test(a_stop_bounces_and_then_holds),
        cmocka_unit_test(a_motor_reaches_its_final_speed),
        cmocka_unit_test(what_is_no_drive_is_refused),
    };

    physics_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
