/* tests/sim/physics/test_sim_bodies.c - impacts against closed forms, what may
 * never happen in a box of balls, refusals. */
#include "sim/physics/bodies.h"

#include "motion/core/err.h"
#include "tests/sim/oracle.h"
#include "tests/sim/physics/bodies_room.h"

#define BALLS  8
#define PLANES 6

static struct sim_sphere sphere[BALLS];
static struct sim_plane plane[PLANES];
static struct sim_contact contact[SIM_BODIES_CONTACTS(BALLS, PLANES)];
static struct sim_impact impacts[1000];

static struct sim_bodies_config of(int spheres, int planes, double restitution,
                                   double friction, double gravity)
{
    memset(sphere, 0, sizeof sphere);
    memset(plane, 0, sizeof plane);
    plane[0].normal[2] = 1;
    return (struct sim_bodies_config){ .spheres = spheres,
                                       .planes = planes,
                                       .restitution = restitution,
                                       .friction = friction,
                                       .gravity_m_s2 = { 0, 0, -gravity } };
}

static void begin(struct sim_bodies *bodies,
                  const struct sim_bodies_config *config)
{
    assert_int_equal(sim_bodies_init(bodies, config, sphere, plane, contact),
                     MOTION_OK);
    bodies->impacts = impacts;
    bodies->impacts_max = 1000;
}

static void run(struct sim_bodies *bodies, int ticks)
{
    for (int i = 0; i < ticks; i++)
        assert_int_equal(sim_bodies_step(bodies, i * 1e-3, 1e-3, NULL),
                         MOTION_OK);
}

/* The k-th impact of a ball dropped from h: t0 (1 + 2 (e + e^2 + ...)). */
static void a_ball_bounces_at_its_times_and_rests(void **state)
{
    (void)state;
    for (int i = 0; i < 50; i++) {
        const double e = physics_random(0.2, 0.8);
        const double height = physics_random(0.05, 2), g = 9.80665;
        struct sim_bodies_config config = of(1, 1, e, 0, g);
        struct sim_bodies bodies;
        double t = sqrt(2 * height / g), flight = 2 * e * t;

        sphere[0].mass_kg = sphere[0].radius_m = physics_random(0.01, 1);
        sphere[0].pos_m[2] = sphere[0].radius_m + height;
        begin(&bodies, &config);
        run(&bodies, 8000);
        for (int k = 0; k < 4; k++) {
            physics_near("impact", impacts[k].t_s, t, 1e-9);
            t += flight;
            flight *= e;
        }
        physics_near("rest", sphere[0].pos_m[2], sphere[0].radius_m, 1e-8);
        assert_true(fabs(sphere[0].vel_m_s[2]) < 1e-12);
        physics_near("weight", contact[0].force_n, sphere[0].mass_kg * g, 1e-9);
    }
}

static void random_sphere(struct sim_sphere *at)
{
    at->mass_kg = physics_random(0.1, 2);
    at->radius_m = physics_random(0.02, 0.06);
    for (int k = 0; k < 3; k++) {
        at->vel_m_s[k] = physics_random(-0.3, 0.3);
        at->spin_rad_s[k] = physics_random(-60, 60);
    }
}

static void two_spheres_keep_momentum_and_lose_energy(void **state)
{
    (void)state;
    for (int i = 0; i < 500; i++) {
        const double e = physics_random(0, 1);
        struct sim_bodies_config config = of(2, 0, e, physics_random(0, 1), 0);
        struct sim_bodies bodies;
        double before[3], after[3], turned[3], turns[3], apart[3];

        random_sphere(&sphere[0]);
        random_sphere(&sphere[1]);
        sphere[1].pos_m[0] = physics_random(0.2, 0.6);
        sphere[0].vel_m_s[0] = physics_random(1, 100);
        begin(&bodies, &config);
        oracle_bodies_momentum(&bodies, before, turned);
        const double energy = oracle_bodies_energy_j(&bodies);
        const double closing = sphere[0].vel_m_s[0] - sphere[1].vel_m_s[0];
        run(&bodies, 1000);
        oracle_bodies_momentum(&bodies, after, turns);
        for (int k = 0; k < 3; k++) {
            physics_near("momentum", after[k], before[k], 1e-10);
            physics_near("angular momentum", turns[k], turned[k], 1e-8);
            apart[k] = sphere[0].pos_m[k] - sphere[1].pos_m[k];
        }
        assert_true(oracle_bodies_energy_j(&bodies) <= energy * (1 + 1e-12));
        assert_true(closing < 0 ||
                    oracle_bodies_gap_m(&bodies, &contact[0], 0) >= -1e-9);
        /* Head on or past: never through each other. */
        assert_true(bodies.impacts_count == 1 ||
                    fabs(apart[1]) + fabs(apart[2]) > 0);
        if (config.friction == 0 && e > 0.999)
            physics_near("energy", oracle_bodies_energy_j(&bodies), energy,
                         1e-9);
    }
}

/* Frictionless and head on: v1' = v1 - (1 + e) m2/(m1 + m2) (v1 - v2). */
static void a_central_impact_has_its_closed_form(void **state)
{
    (void)state;
    for (int i = 0; i < 200; i++) {
        const double e = physics_random(0, 1);
        struct sim_bodies_config config = of(2, 0, e, 0, 0);
        struct sim_bodies bodies;

        sphere[0] = (struct sim_sphere){ .mass_kg = physics_random(0.1, 2),
                                         .radius_m = 0.03 };
        sphere[1] = (struct sim_sphere){ .mass_kg = physics_random(0.1, 2),
                                         .radius_m = 0.05,
                                         .pos_m = { 0.5 } };
        const double v = physics_random(1, 1000);
        sphere[0].vel_m_s[0] = v;
        begin(&bodies, &config);
        run(&bodies, 600);
        assert_int_equal(bodies.impacts_count, 1);
        physics_near("time", impacts[0].t_s, 0.42 / v, 1e-12);
        physics_near("speed", sphere[0].vel_m_s[0],
                     v * (1 - (1 + e) * sphere[1].mass_kg /
                                  (sphere[0].mass_kg + sphere[1].mass_kg)),
                     1e-10 * v);
    }
}

/* Down a slope a ball rolls with 5/7 g sin, unless friction is less than
 * 2/7 tan. */
static void a_ball_rolls_or_slips_down_a_slope(void **state)
{
    (void)state;
    for (int i = 0; i < 50; i++) {
        const double angle = physics_random(0.1, 1), g = 9.80665;
        const double friction = physics_random(0.02, 0.8);
        struct sim_bodies_config config = of(1, 1, 0, friction, g);
        struct sim_bodies bodies;

        plane[0] =
            (struct sim_plane){ .normal = { sin(angle), 0, cos(angle) } };
        sphere[0].mass_kg = physics_random(0.1, 2);
        sphere[0].radius_m = physics_random(0.01, 0.1);
        for (int k = 0; k < 3; k++)
            sphere[0].pos_m[k] = sphere[0].radius_m * plane[0].normal[k];
        begin(&bodies, &config);
        run(&bodies, 500);
        const double acc = fmax(5.0 / 7 * g * sin(angle),
                                g * (sin(angle) - friction * cos(angle)));
        physics_near("speed", hypot(sphere[0].vel_m_s[0], sphere[0].vel_m_s[2]),
                     0.5 * acc, 1e-9);
    }
}

/* Balls thrown into a closed box: none leaves it, none enters another, energy
 * never rises. */
static void nothing_tunnels_in_a_box_of_balls(void **state)
{
    (void)state;
    for (int round = 0; round < 10; round++) {
        struct sim_bodies_config config = of(BALLS, 6, physics_random(0, 0.95),
                                             physics_random(0, 0.6), 9.80665);
        struct sim_bodies bodies;

        bodies_in_a_room(plane, 0.3);
        for (int i = 0; i < BALLS; i++) {
            random_sphere(&sphere[i]);
            bodies_throw(&sphere[i], i, 0.15);
        }
        begin(&bodies, &config);
        bodies_stay_apart(&bodies, round, 3000);
    }
}

static void a_stack_stands_still_for_a_minute(void **state)
{
    struct sim_bodies_config config = of(3, 5, 0, 0.3, 9.80665);
    struct sim_bodies bodies;
    double z = 0;

    (void)state;
    for (int i = 0; i < 3; i++) {
        sphere[i].mass_kg = physics_random(0.2, 2);
        sphere[i].radius_m = 0.05;
        sphere[i].pos_m[2] = 0.05 + 0.1 * i;
    }
    for (int p = 1; p < 5; p++) {
        plane[p].point_m[p / 3] = p % 2 == 0 ? -0.05 : 0.05;
        plane[p].normal[p / 3] = p % 2 == 0 ? 1 : -1;
    }
    begin(&bodies, &config);
    run(&bodies, 60000);
    for (int i = 0; i < 3; i++, z += 0.1) {
        physics_near("height", sphere[i].pos_m[2], z + 0.05, 1e-9);
        for (int k = 0; k < 3; k++)
            physics_near("speed", sphere[i].vel_m_s[k], 0, 1e-9);
    }
    physics_near(
        "floor", contact[0].force_n,
        9.80665 * (sphere[0].mass_kg + sphere[1].mass_kg + sphere[2].mass_kg),
        1e-6);
}

static void what_are_no_bodies_is_refused(void **state)
{
    struct sim_bodies bodies;
    struct sim_bodies_config config = of(1, 1, 0.5, 0.5, 9.8);

    (void)state;
    sphere[0].mass_kg = sphere[0].radius_m = 1;
    sphere[0].pos_m[2] = 2;
    begin(&bodies, &config);
    assert_int_equal(sim_bodies_step(&bodies, 0, NAN, NULL), MOTION_E_ARG);
    assert_int_equal(sim_bodies_step(&bodies, 0, 0, NULL), MOTION_E_ARG);
#define REFUSED(change, back)                                                  \
    change;                                                                    \
    assert_int_equal(                                                          \
        sim_bodies_init(&bodies, &config, sphere, plane, contact),             \
        MOTION_E_ARG);                                                         \
    back
    REFUSED(sphere[0].mass_kg = 0, sphere[0].mass_kg = 1);
    REFUSED(sphere[0].radius_m = NAN, sphere[0].radius_m = 1);
    REFUSED(plane[0].normal[2] = 2, plane[0].normal[2] = 1);
    REFUSED(plane[0].axis[1] = 0.5, plane[0].axis[1] = 0);
    REFUSED(config.restitution = 1.01, config.restitution = 1);
    REFUSED(config.friction = -1, config.friction = 0);
    REFUSED(config.spheres = 0, config.spheres = 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_ball_bounces_at_its_times_and_rests),
        cmocka_unit_test(two_spheres_keep_momentum_and_lose_energy),
        cmocka_unit_test(a_central_impact_has_its_closed_form),
        cmocka_unit_test(a_ball_rolls_or_slips_down_a_slope),
        cmocka_unit_test(nothing_tunnels_in_a_box_of_balls),
        cmocka_unit_test(a_stack_stands_still_for_a_minute),
        cmocka_unit_test(what_are_no_bodies_is_refused),
    };

    physics_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
