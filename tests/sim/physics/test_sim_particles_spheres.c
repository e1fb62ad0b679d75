/* tests/sim/physics/test_sim_particles_spheres.c - nodes that are spheres: an
 * impact's closed forms, a cloth that is folded on itself, its rest.  Takes long. */
#include "motion/core/err.h"
#include "sim/physics/particles.h"
#include "tests/sim/oracle.h"
#include "tests/sim/physics/physics_random.h"

#define PI      3.141592653589793
#define COLUMNS 8
#define ROWS    5
#define NODES   (COLUMNS * ROWS)
#define SPRINGS (6 * NODES + SIM_SPHERES_PAIRS(NODES))

static struct sim_node node[NODES];
static struct sim_spring spring[SPRINGS];
static double work[SIM_PARTICLES_WORK(NODES)];

static void step(struct sim_particles *particles)
{
    assert_int_equal(sim_particles_step(particles, 1e-3, NULL), MOTION_OK);
}

/* Speed with which spheres part that have met with `in`: over an impact of
 * m v v' = -k x (1 + a v), a v - ln(1 + a v) is the same for in and -out. */
static double speed_out(double in, double a)
{
    const double want = a * in - log(1 + a * in);
    double low = 0, high = in;

    for (int i = 0; i < 100; i++) {
        const double out = 0.5 * (low + high);
        *(-a * out - log(1 - a * out) < want ? &low : &high) = out;
    }
    return low;
}

/* Half an oscillation of the spring and the reduced mass. */
static void two_spheres_bounce_as_their_spring_says(void **state)
{
    (void)state;
    for (int i = 0; i < 100; i++) {
        const double m[2] = { physics_random(0.1, 2), physics_random(0.1, 2) };
        const double both = m[0] * m[1] / (m[0] + m[1]);
        const double k = physics_random(2000, 20000), apart = 0.1;
        const double in = physics_random(0.1, 1);
        const double loss = i % 2 == 0 ? 0 : physics_random(0.1, 0.8) / in;
        const double out = loss > 0 ? speed_out(in, loss) : in;
        const double omega = sqrt(k / both);
        const double part = physics_random(0, 1), start = apart + 0.02;
        struct sim_particles particles;
        struct sim_particles_config config = { .nodes = 2,
                                               .springs = 1,
                                               .node = node,
                                               .spring = spring,
                                               .driven = -1 };
        double nearest = 1;

        for (int n = 0; n < 2; n++)
            node[n] = (struct sim_node){ .mass_kg = m[n] };
        spring[0] = (struct sim_spring){ .j = 1,
                                         .stiffness_n_m = k,
                                         .damping_n_s_m = loss * k * apart,
                                         .rest_m = apart,
                                         .pushes = true };
        assert_int_equal(sim_particles_init(&particles, &config, work),
                         MOTION_OK);
        particles.pos_m[3] = start;
        particles.vel_m_s[0] = part * in;
        particles.vel_m_s[3] = (part - 1) * in;
        const double speed =
            (m[0] * particles.vel_m_s[0] + m[1] * particles.vel_m_s[3]) /
            (m[0] + m[1]);
        const int ticks = (int)(1e3 * (0.02 / in + PI / omega)) + 60;
        for (int tick = 0; tick < ticks; tick++) {
            step(&particles);
            nearest = fmin(nearest, particles.pos_m[3] - particles.pos_m[0]);
        }
        physics_near("first", particles.vel_m_s[0],
                     speed - out * m[1] / (m[0] + m[1]), 2e-4 * in);
        physics_near("second", particles.vel_m_s[3],
                     speed + out * m[0] / (m[0] + m[1]), 2e-4 * in);
        if (loss > 0)
            continue;
        assert_true(nearest > apart - 1.001 * in / omega);
        physics_near("place", particles.pos_m[3] - particles.pos_m[0],
                     apart + in * (1e-3 * ticks - 0.02 / in - PI / omega),
                     5e-4 * (in / omega + 0.02));
    }
}

#define SPACING 0.05
#define SPHERE  0.04 /* across */

static int weave(struct sim_particles *particles, bool spheres)
{
    const struct sim_cloth cloth = {
        .columns = COLUMNS,
        .rows = ROWS,
        .spacing_m = SPACING,
        .structural_n_m = 80,
        .shear_n_m = 25,
        .bending_n_m = 1,
        .structural_n_s_m = 0.05,
        .shear_n_s_m = 0.03,
        .bending_n_s_m = 0.01,
    };
    const struct sim_spring like = { .stiffness_n_m = 200,
                                     .damping_n_s_m = 1,
                                     .rest_m = SPHERE,
                                     .pushes = true };
    struct sim_particles_config config = {
        .nodes = NODES,
        .node = node,
        .spring = spring,
        .gravity_m_s2 = { 0, 0, -9.80665 },
        .drag_linear_n_s_m = 0.004,
        .driven = -1,
    };

    config.springs = sim_cloth_springs(&cloth, spring, SPRINGS);
    assert_true(config.springs > 0);
    if (spheres)
        config.springs +=
            sim_spheres_springs(&like, NODES, spring + config.springs);
    return sim_particles_init(particles, &config, work);
}

static double nearest_pair(const struct sim_particles *particles)
{
    double nearest = 1;

    for (int i = 0; i < NODES; i++)
        for (int j = 0; j < i; j++) {
            double square = 0;
            for (int k = 0; k < 3; k++) {
                const double by =
                    particles->pos_m[3 * i + k] - particles->pos_m[3 * j + k];
                square += by * by;
            }
            nearest = fmin(nearest, sqrt(square));
        }
    return nearest;
}

/* Its right half, turned over and held above the left one, which lies on a
 * table, is let go: it comes to lie on it, sphere on sphere. */
static void lay_folded(struct sim_particles *particles)
{
    for (int i = 0; i < NODES; i++) {
        const int column = i / ROWS, row = i % ROWS, over = COLUMNS / 2;
        double *const pos = particles->pos_m + 3 * (ptrdiff_t)i;
        node[i] = (struct sim_node){ .mass_kg = 0.004, .fixed = column < over };
        pos[0] = SPACING * (column < over ? column : 2 * over - 1 - column);
        pos[1] = SPACING * row;
        pos[2] = column < over ? 0 : 2 * SPHERE;
    }
}

static double lowest_over(const struct sim_particles *particles)
{
    double lowest = 1;

    for (int i = 0; i < NODES; i++)
        if (!node[i].fixed)
            lowest = fmin(lowest, particles->pos_m[3 * i + 2]);
    return lowest;
}

static void a_folded_cloth_lies_on_itself(void **state)
{
    struct sim_particles particles;
    (void)state;

    for (int spheres = 1; spheres >= 0; spheres--) {
        for (int i = 0; i < NODES; i++)
            node[i].mass_kg = 0.004;
        assert_int_equal(weave(&particles, spheres == 1), MOTION_OK);
        lay_folded(&particles);
        double nearest = 1;
        for (int tick = 0; tick < 3000; tick++) {
            step(&particles);
            nearest = fmin(nearest, nearest_pair(&particles));
        }
        if (spheres == 0) { /* through it, and hangs below the table */
            assert_true(lowest_over(&particles) < -SPHERE);
            continue;
        }
        /* It falls 40 mm: 0.9 m/s sqrt(m / k) is 4 mm, a tenth of a sphere, and a
         * row presses on the next one.  Then m g / k, 0.2 mm. */
        assert_true(nearest > 0.8 * SPHERE);
        assert_true(nearest_pair(&particles) > 0.97 * SPHERE);
        assert_true(lowest_over(&particles) > 0.5 * SPHERE);
    }
}

/* Held by two corners that are brought near each other, it hangs in folds that
 * touch.  N control ticks; make nightly runs a million. */
static void it_settles_to_an_energy_minimum_and_gains_none(void **state)
{
    const long ticks = getenv("N") != NULL ? atol(getenv("N")) : 8000;
    const int corner = (COLUMNS - 1) * ROWS;
    struct sim_particles particles;
    double lowest = INFINITY, kinetic = 0;
    (void)state;

    for (int i = 0; i < NODES; i++)
        node[i] = (struct sim_node){ .mass_kg = 0.004,
                                     .fixed = i == 0 || i == corner };
    assert_int_equal(weave(&particles, true), MOTION_OK);
    for (int i = 0; i < NODES; i++) {
        const double part = (double)(i / ROWS) / (COLUMNS - 1);
        particles.pos_m[3 * i] = 0.12 * part;
        particles.pos_m[3 * i + 1] = 0.06 * sin(3 * PI * part);
        particles.pos_m[3 * i + 2] = -SPACING * (i % ROWS);
    }
    const double first = oracle_particles_energy_j(&particles);
    for (long tick = 0; tick < ticks; tick++) {
        step(&particles);
        const double energy = oracle_particles_energy_j(&particles);
        if (!(energy <= fmin(lowest, first) + 1e-9))
            fail_msg("tick %ld: energy %.12g above %.12g", tick, energy,
                     fmin(lowest, first));
        lowest = fmin(lowest, energy);
    }
    for (int i = 0; i < 3 * NODES; i++)
        kinetic += 0.5 * 0.004 * particles.vel_m_s[i] * particles.vel_m_s[i];
    const double ends = oracle_particles_energy_j(&particles);
    assert_true(kinetic < 1e-6 * (first - ends));
    assert_true(oracle_particles_settle(&particles, 1000000));
    const double rest = oracle_particles_energy_j(&particles);
    physics_near("energy", ends, rest, 1e-3 * (first - rest));
    assert_true(nearest_pair(&particles) > 0.9 * SPHERE);
}

static void a_sphere_without_size_is_refused(void **state)
{
    struct sim_particles particles;
    struct sim_particles_config config = {
        .nodes = 2, .springs = 1, .node = node, .spring = spring, .driven = -1
    };
    (void)state;

    node[0] = node[1] = (struct sim_node){ .mass_kg = 1 };
    spring[0] =
        (struct sim_spring){ .j = 1, .stiffness_n_m = 1, .pushes = true };
    assert_int_equal(sim_particles_init(&particles, &config, work),
                     MOTION_E_ARG);
    spring[0].rest_m = 0.1;
    assert_int_equal(sim_particles_init(&particles, &config, work), MOTION_OK);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(two_spheres_bounce_as_their_spring_says),
        cmocka_unit_test(a_folded_cloth_lies_on_itself),
        cmocka_unit_test(it_settles_to_an_energy_minimum_and_gains_none),
        cmocka_unit_test(a_sphere_without_size_is_refused),
    };

    physics_begin();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
