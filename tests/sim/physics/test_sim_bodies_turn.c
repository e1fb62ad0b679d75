/* tests/sim/physics/test_sim_bodies_turn.c - spheres on and against boxes that
 * turn: a plate that an axis tilts, a rod that strikes, a tray. */
#include "motion/core/err.h"
#include "sim/physics/bodies.h"
#include "sim/util.h"
#include "tests/sim/oracle.h"
#include "tests/sim/physics/bodies_room.h"

#define G      9.80665
#define BALLS  3
#define BOXES  5
#define TICK_S 1e-3

static struct sim_sphere sphere[BALLS];
static struct sim_box box[BOXES];
static struct sim_contact contact[SIM_BODIES_CONTACTS(BALLS, BOXES)];
static struct sim_impact impacts[1000];

static struct sim_bodies bodies;

static void begin(int spheres, int boxes, double restitution, double friction,
                  double gravity)
{
    const struct sim_bodies_config config = {
        .spheres = spheres,
        .boxes = boxes,
        .box = box,
        .restitution = restitution,
        .friction = friction,
        .gravity_m_s2 = { 0, 0, -gravity },
    };

    assert_int_equal(sim_bodies_init(&bodies, &config, sphere, NULL, contact),
                     MOTION_OK);
    bodies.impacts = impacts;
    bodies.impacts_max = ARRAY_LEN(impacts);
}

/* Along the axes of space while it has not turned, about y through the
 * origin. */
static struct sim_box straight(double x, double y, double z, double half_x,
                               double half_y, double half_z)
{
    return (struct sim_box){
        .center_m = { x, y, z },
        .half_m = { half_x, half_y, half_z },
        .axis = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } },
        .turns = { 0, 1, 0 },
    };
}

/* Its upper face goes through the origin. */
static void plate(void)
{
    box[0] = straight(0, 0, -0.01, 50, 0.2, 0.01);
}

static void lay(struct sim_sphere *ball, double s, double r, double tilt)
{
    *ball = (struct sim_sphere){ .mass_kg = physics_random(0.05, 2),
                                 .radius_m = r,
                                 .pos_m = { s * cos(tilt) + r * sin(tilt), 0,
                                            r * cos(tilt) - s * sin(tilt) } };
}

/* Along the plate at that tilt. */
static double along(const double *of, double tilt)
{
    return of[0] * cos(tilt) - of[2] * sin(tilt);
}

static void play(double end_s, const struct sim_signal turn[])
{
    for (int i = 0; i < lround(end_s / TICK_S); i++)
        assert_int_equal(sim_bodies_step(&bodies, i * TICK_S, TICK_S, turn),
                         MOTION_OK);
}

/* It rolls with 5/7 g sin a; where friction is less than 2/7 tan a it slides with
 * g (sin a - f cos a), and turns with 5/2 f g cos a / r. */
static void a_sphere_rolls_or_slides_down_a_tilted_box(void **state)
{
    (void)state;
    for (int i = 0; i < 40; i++) {
        const double tilt = physics_random(0.02, 0.6), t = 1.5;
        const double r = physics_random(0.005, 0.1);
        const double grip = 2.0 / 7 * tan(tilt);
        const bool rolls = i % 2 == 0;
        const double f =
            grip * (rolls ? physics_random(1.05, 3) : physics_random(0, 0.95));
        const double acc =
            rolls ? 5.0 / 7 * G * sin(tilt) : G * (sin(tilt) - f * cos(tilt));
        const double spin = rolls ? acc / r : 2.5 * f * G * cos(tilt) / r;
        const struct sim_signal turn = { { tilt } };

        plate();
        lay(&sphere[0], 0, r, tilt);
        begin(1, 1, 0.5, f, G);
        play(t, &turn);
        physics_near("place", along(sphere[0].pos_m, tilt), acc * t * t / 2,
                     1e-6);
        physics_near("speed", along(sphere[0].vel_m_s, tilt), acc * t, 1e-6);
        physics_near("spin", sphere[0].spin_rad_s[1], spin * t, 1e-6 / r);
        physics_near("force", contact[0].force_n,
                     sphere[0].mass_kg * G * cos(tilt),
                     1e-6 * sphere[0].mass_kg * G);
        assert_int_equal(contact[0].slips, !rolls);
    }
}

/* a(t) = amplitude sin(omega t), as a cubic in each tick. */
static double swing(double amplitude, double omega, double t_s, double *speed,
                    double *acc)
{
    *speed = amplitude * omega * cos(omega * t_s);
    *acc = -amplitude * omega * omega * sin(omega * t_s);
    return amplitude * sin(omega * t_s);
}

static struct sim_signal swing_signal(double amplitude, double omega,
                                      double t_s)
{
    double v0, v1, acc;
    const double p0 = swing(amplitude, omega, t_s, &v0, &acc);
    const double p1 = swing(amplitude, omega, t_s + TICK_S, &v1, &acc);
    const double rise = (p1 - p0) / TICK_S;

    return (struct sim_signal){ { p0, v0, (3 * rise - 2 * v0 - v1) / TICK_S,
                                  (v0 + v1 - 2 * rise) / (TICK_S * TICK_S) } };
}

/* s'' = 5/7 (g sin a + s a'^2) - r a'': the sphere does not slip on what moves. */
static double rolling(double s, double r, double amplitude, double omega,
                      double t_s)
{
    double speed, acc;
    const double tilt = swing(amplitude, omega, t_s, &speed, &acc);

    return 5.0 / 7 * (G * sin(tilt) + s * speed * speed) - r * acc;
}

/* One step of Runge and Kutta. */
static void rolling_step(double *s, double *v, double r, double amplitude,
                         double omega, double t, double h)
{
    const double a1 = rolling(*s, r, amplitude, omega, t);
    const double v2 = *v + h / 2 * a1;
    const double a2 = rolling(*s + h / 2 * *v, r, amplitude, omega, t + h / 2);
    const double v3 = *v + h / 2 * a2;
    const double a3 = rolling(*s + h / 2 * v2, r, amplitude, omega, t + h / 2);
    const double v4 = *v + h * a3;
    const double a4 = rolling(*s + h * v3, r, amplitude, omega, t + h);

    *s += h / 6 * (*v + 2 * v2 + 2 * v3 + v4);
    *v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
}

static void a_sphere_rolls_on_a_box_that_an_axis_tilts(void **state)
{
    (void)state;
    for (int i = 0; i < 20; i++) {
        const double amplitude = physics_random(0.02, 0.15);
        const double omega = physics_random(1, 6);
        const double r = physics_random(0.01, 0.05);
        double s = physics_random(-0.2, 0.2), v = -r * amplitude * omega;
        double tilt, speed, acc;

        plate();
        lay(&sphere[0], s, r, 0);
        begin(1, 1, 0, 2, G);
        /* the plate goes under it from the first moment, and takes it along its
         * normal alone: s' = -r a', so that neither does it turn */
        sphere[0].vel_m_s[2] = -s * amplitude * omega;
        for (int tick = 0; tick < 1500; tick++) {
            const double t = tick * TICK_S;
            const struct sim_signal turn = swing_signal(amplitude, omega, t);
            assert_int_equal(sim_bodies_step(&bodies, t, TICK_S, &turn),
                             MOTION_OK);
            for (int k = 0; k < 4; k++)
                rolling_step(&s, &v, r, amplitude, omega, t + k * TICK_S / 4,
                             TICK_S / 4);
            tilt = swing(amplitude, omega, t + TICK_S, &speed, &acc);
            physics_near("place", along(sphere[0].pos_m, tilt), s, 2e-5);
        }
    }
}

/* A rod that is thinner than what it goes in a substep.  The sphere is at rest:
 * after the impact it has (1 + e) times the speed of the face there. */
static void a_rod_that_turns_strikes_a_sphere(void **state)
{
    (void)state;
    for (int i = 0; i < 200; i++) {
        const double e = physics_random(0.3, 1),
                     r = physics_random(0.002, 0.05);
        const double half = physics_random(0.0005, 0.01);
        const double omega =
            i % 2 == 0 ? physics_random(1, 20) : physics_random(100, 300);
        const double at = physics_random(0.2, 0.8);
        const double hit_s = fmin(0.0137, 2 / omega), angle = omega * hit_s;
        const double x = at * cos(angle) - (half + r) * sin(angle);
        const double z = at * sin(angle) + (half + r) * cos(angle);
        const double speed = (1 + e) * omega * at;

        /* turned about -y: from x up to z */
        box[0] = straight(0, 0, 0, 1, 0.1, half);
        box[0].turns[1] = -1;
        sphere[0] = (struct sim_sphere){ .mass_kg = 1,
                                         .radius_m = r,
                                         .pos_m = { x, 0, z } };
        begin(1, 1, e, 0, 0);
        for (int tick = 0; bodies.impacts_count == 0 && tick < 1000; tick++) {
            const struct sim_signal turn = { { omega * tick * TICK_S, omega } };
            assert_int_equal(
                sim_bodies_step(&bodies, tick * TICK_S, TICK_S, &turn),
                MOTION_OK);
        }
        assert_int_equal(bodies.impacts_count, 1);
        physics_near("time", impacts[0].t_s, hit_s, 1e-7);
        physics_near("into", impacts[0].speed_m_s, omega * at, 1e-6 * omega);
        physics_near("x", sphere[0].vel_m_s[0], -speed * sin(angle),
                     1e-6 * omega);
        physics_near("z", sphere[0].vel_m_s[2], speed * cos(angle),
                     1e-6 * omega);
    }
}

/* A floor and four walls that are shaken as one. */
static void tray(void)
{
    box[0] = straight(0, 0, -0.02, 0.4, 0.4, 0.02);
    box[1] = straight(-0.32, 0, 0.2, 0.02, 0.4, 0.2);
    box[2] = straight(0.32, 0, 0.2, 0.02, 0.4, 0.2);
    box[3] = straight(0, -0.32, 0.2, 0.4, 0.02, 0.2);
    box[4] = straight(0, 0.32, 0.2, 0.4, 0.02, 0.2);
}

static double deepest(void)
{
    double gap = INFINITY;

    for (int c = 0; c < bodies.contacts; c++)
        gap = fmin(gap, oracle_bodies_gap_m(&bodies, &contact[c], TICK_S));
    return gap;
}

static void nothing_gets_through_a_tray_that_is_shaken(void **state)
{
    (void)state;
    for (int round = 0; round < 8; round++) {
        const double amplitude = physics_random(0.05, 0.5);
        const double omega = physics_random(2, 20);

        tray();
        for (int i = 0; i < BALLS; i++)
            sphere[i] = (struct sim_sphere){
                .mass_kg = physics_random(0.05, 1),
                .radius_m = physics_random(0.01, 0.05),
                .pos_m = { 0.15 * (i - 1), physics_random(-0.2, 0.2), 0.1 },
            };
        begin(BALLS, BOXES, physics_random(0, 0.6), physics_random(0, 1), G);
        for (int tick = 0; tick < 1500; tick++) {
            struct sim_signal turn[BOXES];
            for (int b = 0; b < BOXES; b++)
                turn[b] = swing_signal(amplitude, omega, tick * TICK_S);
            assert_int_equal(
                sim_bodies_step(&bodies, tick * TICK_S, TICK_S, turn),
                MOTION_OK);
            if (!(deepest() > -2e-6))
                fail_msg("round %d tick %d: gap %g", round, tick, deepest());
        }
    }
}

/* In the corner of floor and wall, which turn slowly, it stays where it is. */
static void what_rests_in_a_corner_is_carried(void **state)
{
    const double r = 0.03;
    (void)state;

    tray();
    lay(&sphere[0], 0.3 - r, r, 0.2);
    sphere[0].vel_m_s[0] = 0.1 * sphere[0].pos_m[2]; /* as the tray there */
    sphere[0].vel_m_s[2] = -0.1 * sphere[0].pos_m[0];
    begin(1, BOXES, 0, 0, G);
    for (int tick = 0; tick < 4000; tick++) {
        struct sim_signal turn[BOXES];
        for (int b = 0; b < BOXES; b++) {
            turn[b] = swing_signal(0.1, 1, tick * TICK_S);
            turn[b].c[0] += 0.2;
        }
        assert_int_equal(sim_bodies_step(&bodies, tick * TICK_S, TICK_S, turn),
                         MOTION_OK);
        const double tilt = 0.2 + 0.1 * sin((tick + 1) * TICK_S);
        physics_near("along", along(sphere[0].pos_m, tilt), 0.3 - r, 1e-5);
        physics_near("above",
                     sphere[0].pos_m[0] * sin(tilt) +
                         sphere[0].pos_m[2] * cos(tilt),
                     r, 1e-5);
    }
}

static void an_axis_that_is_no_direction_is_refused(void **state)
{
    const struct sim_bodies_config config = { .spheres = 1,
                                              .boxes = 1,
                                              .box = box };
    (void)state;

    plate();
    lay(&sphere[0], 0, 0.1, 0);
    box[0].turns[0] = 1;
    assert_int_equal(sim_bodies_init(&bodies, &config, sphere, NULL, contact),
                     MOTION_E_ARG);
    plate();
    box[0].pivot_m[2] = NAN;
    assert_int_equal(sim_bodies_init(&bodies, &config, sphere, NULL, contact),
                     MOTION_E_ARG);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_sphere_rolls_or_slides_down_a_tilted_box),
        cmocka_unit_test(a_sphere_rolls_on_a_box_that_an_axis_tilts),
        cmocka_unit_test(a_rod_that_turns_strikes_a_sphere),
        cmocka_unit_test(nothing_gets_through_a_tray_that_is_shaken),
        cmocka_unit_test(what_rests_in_a_corner_is_carried),
        cmocka_unit_test(an_axis_that_is_no_direction_is_refused),
    };

    physics_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
