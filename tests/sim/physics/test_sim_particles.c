/* tests/sim/physics/test_sim_particles.c - closed forms, momentum, the shape at
 * rest, refusals. */
#include "sim/physics/particles.h"

#include "motion/core/err.h"
#include "tests/sim/oracle.h"
#include "tests/sim/physics/physics_random.h"

#define NODES   64
#define SPRINGS (6 * NODES)

static struct sim_node node[NODES];
static struct sim_spring spring[SPRINGS];
static double work[SIM_PARTICLES_WORK(NODES)];

static void begin(struct sim_particles *particles,
                  const struct sim_particles_config *config)
{
    assert_int_equal(sim_particles_init(particles, config, work), MOTION_OK);
}

static struct sim_particles_config of(int nodes, int springs)
{
    memset(node, 0, sizeof node);
    memset(spring, 0, sizeof spring);
    return (struct sim_particles_config){ .nodes = nodes,
                                          .springs = springs,
                                          .node = node,
                                          .spring = spring,
                                          .driven = -1 };
}

static void run(struct sim_particles *particles, int ticks)
{
    for (int i = 0; i < ticks; i++)
        assert_int_equal(sim_particles_step(particles, 1e-3, NULL), MOTION_OK);
}

/* x = exp(-d t) (x0 cos w t + (v0 + d x0)/w sin w t) */
static void a_damped_mass_follows_its_closed_form(void **state)
{
    (void)state;
    for (int i = 0; i < 50; i++) {
        const double mass = physics_random(0.5, 5);
        const double stiffness = physics_random(10, 5000);
        const double ratio = physics_random(0, 0.9);
        const double omega0 = sqrt(stiffness / mass);
        const double decay = ratio * omega0;
        const double omega = sqrt(omega0 * omega0 - decay * decay);
        const double x0 = physics_random(-0.1, 0.1), v0 = physics_random(-1, 1);
        struct sim_particles_config config = of(2, 1);
        struct sim_particles particles;

        node[0] = (struct sim_node){ 1, true };
        node[1].mass_kg = mass;
        spring[0] =
            (struct sim_spring){ 0, 1, stiffness, 2 * decay * mass, 1, false };
        begin(&particles, &config);
        particles.pos_m[3] = 1 + x0;
        particles.vel_m_s[3] = v0;
        run(&particles, 500);
        const double e = exp(-decay * 0.5);
        physics_near("x", particles.pos_m[3] - 1,
                     e * (x0 * cos(omega * 0.5) +
                          (v0 + decay * x0) / omega * sin(omega * 0.5)),
                     1e-5 * (fabs(x0) + fabs(v0) / omega0));
    }
}

/* v = sqrt(m g / q) tanh(t sqrt(g q / m)) */
static void a_fall_with_drag_reaches_its_speed(void **state)
{
    (void)state;
    for (int i = 0; i < 50; i++) {
        struct sim_particles_config config = of(1, 0);
        struct sim_particles particles;
        const double mass = physics_random(0.1, 2), g = 9.80665;

        config.gravity_m_s2[2] = -g;
        config.drag_quadratic_n_s2_m2 = physics_random(0.01, 0.1);
        node[0].mass_kg = mass;
        begin(&particles, &config);
        run(&particles, 1000);
        const double terminal = sqrt(mass * g / config.drag_quadratic_n_s2_m2);
        physics_near("speed", particles.vel_m_s[2],
                     -terminal * tanh(g / terminal), 1e-9);
    }
}

static void a_cloud_keeps_momentum_and_energy(void **state)
{
    struct sim_particles_config config = of(5, 10);
    struct sim_particles particles;
    double momentum[3], angular[3], now[3], turning[3];
    int s = 0;

    (void)state;
    double place[15];
    for (int i = 0; i < 15; i++)
        place[i] = (i % 4 == 0 ? 1 : 0) + physics_random(-0.2, 0.2);
    for (int i = 0; i < 5; i++) {
        node[i].mass_kg = physics_random(0.1, 1);
        for (int j = 0; j < i; j++) {
            const double *const a = place + 3 * (size_t)i;
            const double *const b = place + 3 * (size_t)j;
            spring[s++] =
                (struct sim_spring){ i,
                                     j,
                                     physics_random(50, 100),
                                     0,
                                     hypot(hypot(a[0] - b[0], a[1] - b[1]),
                                           a[2] - b[2]),
                                     false };
        }
    }
    begin(&particles, &config);
    memcpy(particles.pos_m, place, sizeof place);
    for (int i = 0; i < 15; i++)
        particles.vel_m_s[i] = physics_random(-0.5, 0.5);
    oracle_particles_momentum(&particles, momentum, angular);
    const double energy = oracle_particles_energy_j(&particles);
    for (int i = 0; i < 50000; i++) {
        run(&particles, 1);
        physics_near("energy", oracle_particles_energy_j(&particles), energy,
                     1e-4 * energy);
    }
    oracle_particles_momentum(&particles, now, turning);
    for (int k = 0; k < 3; k++) {
        physics_near("momentum", now[k], momentum[k], 1e-11);
        physics_near("angular momentum", turning[k], angular[k], 1e-8);
    }
}

/* A cloth of random make, pinned at two corners, from a random start. */
static struct sim_particles_config random_cloth(void)
{
    const struct sim_cloth cloth = {
        .columns = 5,
        .rows = 4,
        .spacing_m = 0.1,
        .structural_n_m = physics_random(100, 300),
        .shear_n_m = physics_random(20, 60),
        .bending_n_m = physics_random(5, 15),
    };
    struct sim_particles_config config = of(20, 0);

    config.springs = sim_cloth_springs(&cloth, spring, SPRINGS);
    assert_int_equal(config.springs, 31 + 24 + 22);
    assert_int_equal(sim_cloth_springs(&cloth, spring, 50), MOTION_E_FULL);
    sim_cloth_springs(&cloth, spring, SPRINGS);
    config.gravity_m_s2[2] = -9.80665;
    for (int i = 0; i < 20; i++)
        node[i] = (struct sim_node){ 0.006, i == 0 || i == 16 };
    return config;
}

static void place_cloth(struct sim_particles *particles, double noise)
{
    for (int i = 0; i < 20; i++) {
        particles->pos_m[3 * i] = 0.1 * (i / 4);
        particles->pos_m[3 * i + 1] = 0.1 * (i % 4);
        for (int k = 0; k < 3 && !node[i].fixed; k++)
            particles->pos_m[3 * i + k] += physics_random(-noise, noise);
    }
}

static void a_cloth_rests_where_a_damped_run_ends(void **state)
{
    (void)state;
    for (int round = 0; round < 3; round++) {
        struct sim_particles_config config = random_cloth();
        struct sim_particles particles;
        double shape[60];

        config.drag_linear_n_s_m = 0.02;
        begin(&particles, &config);
        place_cloth(&particles, 0.02);
        assert_true(oracle_particles_settle(&particles, 1000000));
        const double energy = oracle_particles_energy_j(&particles);
        memcpy(shape, particles.pos_m, sizeof shape);
        place_cloth(&particles, 0.02);
        run(&particles, 10000);
        physics_near("energy", energy, oracle_particles_energy_j(&particles),
                     1e-6);
        for (int i = 0; i < 60; i++) /* or its mirror image */
            physics_near("place", i % 3 == 1 ? fabs(shape[i]) : shape[i],
                         i % 3 == 1 ? fabs(particles.pos_m[i])
                                    : particles.pos_m[i],
                         1e-3);
    }
}

/* Straight down: node i stretches its spring by the weight below it. */
static void a_hanging_cable_stretches_by_its_weight(void **state)
{
    struct sim_particles_config config = of(10, 9);
    struct sim_particles particles;
    double z = 0;

    (void)state;
    config.gravity_m_s2[2] = -9.80665;
    for (int i = 0; i < 10; i++) {
        node[i] = (struct sim_node){ 0.05, i == 0 };
        if (i > 0)
            spring[i - 1] = (struct sim_spring){ i - 1, i, 500, 0, 0.1, false };
    }
    begin(&particles, &config);
    for (int i = 1; i < 10; i++) { /* upwards, where it cannot stay */
        particles.pos_m[3 * i] = 1e-3 * i;
        particles.pos_m[3 * i + 2] = 0.1 * i;
    }
    assert_true(oracle_particles_settle(&particles, 1000000));
    for (int i = 1; i < 10; i++) {
        z -= 0.1 + (10 - i) * 0.05 * 9.80665 / 500;
        physics_near("z", particles.pos_m[3 * i + 2], z, 1e-9);
        physics_near("tension", sim_particles_tension_n(&particles, i - 1),
                     (10 - i) * 0.05 * 9.80665, 1e-9);
    }
}

static void the_driven_node_follows_the_input(void **state)
{
    struct sim_particles_config config = of(2, 1);
    struct sim_particles particles;

    (void)state;
    config.driven = 0;
    node[0] = (struct sim_node){ 1, true };
    node[1].mass_kg = 0.1;
    spring[0] = (struct sim_spring){ 0, 1, 100, 0.1, 0.5, false };
    begin(&particles, &config);
    particles.pos_m[5] = -0.5;
    for (int i = 0; i < 1000; i++) {
        const double t = 1e-3 * i;
        const struct sim_particles_input input = {
            .pos_m[0] = { { t * t * t, 3 * t * t, 3 * t, 1 } }
        };
        assert_int_equal(sim_particles_step(&particles, 1e-3, &input),
                         MOTION_OK);
    }
    physics_near("x", particles.pos_m[0], 1, 1e-12);
    physics_near("v", particles.vel_m_s[0], 3, 1e-12);
    assert_int_equal(sim_particles_step(&particles, 1e-3, NULL), MOTION_E_ARG);
}

static void what_is_no_cloud_is_refused(void **state)
{
    struct sim_particles_config config = of(2, 1);
    struct sim_particles particles;

    (void)state;
    node[0].mass_kg = node[1].mass_kg = 1;
    spring[0] = (struct sim_spring){ 0, 1, 100, 0, 1, false };
    begin(&particles, &config);
    assert_int_equal(sim_particles_step(&particles, 0, NULL), MOTION_E_ARG);
#define REFUSED(change, back)                                                  \
    change;                                                                    \
    assert_int_equal(sim_particles_init(&particles, &config, work),            \
                     MOTION_E_ARG);                                            \
    back
    REFUSED(spring[0].j = 2, spring[0].j = 1);
    REFUSED(spring[0].j = 0, spring[0].j = 1);
    REFUSED(spring[0].stiffness_n_m = NAN, spring[0].stiffness_n_m = 1);
    REFUSED(node[1].mass_kg = 0, node[1].mass_kg = 1);
    REFUSED(config.driven = 1, config.driven = -1); /* it is free */
    REFUSED(config.nodes = 0, config.nodes = 2);
    REFUSED(config.gravity_m_s2[0] = INFINITY, config.gravity_m_s2[0] = 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_damped_mass_follows_its_closed_form),
        cmocka_unit_test(a_fall_with_drag_reaches_its_speed),
        cmocka_unit_test(a_cloud_keeps_momentum_and_energy),
        cmocka_unit_test(a_cloth_rests_where_a_damped_run_ends),
        cmocka_unit_test(a_hanging_cable_stretches_by_its_weight),
        cmocka_unit_test(the_driven_node_follows_the_input),
        cmocka_unit_test(what_is_no_cloud_is_refused),
    };

    physics_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
