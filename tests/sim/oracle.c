/* tests/sim/oracle.c - see oracle.h. */
#include "tests/sim/oracle.h"

#include <float.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "sim/physics/bodies_contact.h"

#define TWO_PI 6.283185307179586

/* --- bodies ---------------------------------------------------------------- */

double oracle_bodies_energy_j(const struct sim_bodies *bodies)
{
    double energy = 0;

    for (int i = 0; i < bodies->config.spheres; i++) {
        const struct sim_sphere *const of = &bodies->sphere[i];
        energy +=
            of->mass_kg * (0.5 * sim_dot3(of->vel_m_s, of->vel_m_s) +
                           0.2 * of->radius_m * of->radius_m *
                               sim_dot3(of->spin_rad_s, of->spin_rad_s) -
                           sim_dot3(bodies->config.gravity_m_s2, of->pos_m));
    }
    return energy;
}

void oracle_bodies_momentum(const struct sim_bodies *bodies, double linear[3],
                            double angular[3])
{
    double moment[3];

    for (int k = 0; k < 3; k++)
        linear[k] = angular[k] = 0;
    for (int i = 0; i < bodies->config.spheres; i++) {
        const struct sim_sphere *const of = &bodies->sphere[i];
        sim_cross3(of->pos_m, of->vel_m_s, moment);
        for (int k = 0; k < 3; k++) {
            linear[k] += of->mass_kg * of->vel_m_s[k];
            angular[k] +=
                of->mass_kg * (moment[k] + 0.4 * of->radius_m * of->radius_m *
                                               of->spin_rad_s[k]);
        }
    }
}

double oracle_bodies_gap_m(const struct sim_bodies *bodies,
                           const struct sim_contact *contact, double t_s)
{
    struct sim_touch touch;

    sim_contact_gap(bodies, contact, t_s, &touch);
    return touch.gap_m;
}

/* --- particles --------------------------------------------------------------- */

double oracle_particles_energy_j(const struct sim_particles *particles)
{
    const struct sim_particles_config *const config = &particles->config;
    double energy = 0;

    for (int i = 0; i < config->nodes; i++) {
        const double *const p = particles->pos_m + 3 * (ptrdiff_t)i;
        const double *const v = particles->vel_m_s + 3 * (ptrdiff_t)i;
        energy += config->node[i].mass_kg *
                  (0.5 * sim_dot3(v, v) - sim_dot3(config->gravity_m_s2, p));
    }
    for (int s = 0; s < config->springs; s++) {
        const struct sim_spring *const spring = &config->spring[s];
        double square = 0;
        for (int k = 0; k < 3; k++) {
            const double apart = particles->pos_m[3 * spring->j + k] -
                                 particles->pos_m[3 * spring->i + k];
            square += apart * apart;
        }
        const double stretch = sqrt(square) - spring->rest_m;
        if (!spring->pushes || stretch < 0)
            energy += 0.5 * spring->stiffness_n_m * stretch * stretch;
    }
    return energy;
}

void oracle_particles_momentum(const struct sim_particles *particles,
                               double linear[3], double angular[3])
{
    double moment[3];

    for (int k = 0; k < 3; k++)
        linear[k] = angular[k] = 0;
    for (int i = 0; i < particles->config.nodes; i++) {
        const double mass = particles->config.node[i].mass_kg;
        const double *const v = particles->vel_m_s + 3 * (ptrdiff_t)i;
        sim_cross3(particles->pos_m + 3 * (ptrdiff_t)i, v, moment);
        for (int k = 0; k < 3; k++) {
            linear[k] += mass * v[k];
            angular[k] += mass * moment[k];
        }
    }
}

/* Below this part of gravity's, nothing accelerates any more. */
#define SETTLED 1e-10

bool oracle_particles_settle(struct sim_particles *particles, long steps)
{
    const struct sim_particles_config *const config = &particles->config;
    const size_t size = 3 * (size_t)config->nodes * sizeof(double);
    const double step_s = particles->substep_max_s;
    const double gravity =
        sqrt(sim_dot3(config->gravity_m_s2, config->gravity_m_s2));
    double before = 0;
    bool stopped = true;

    memset(particles->vel_m_s, 0, size);
    for (long i = 0; i < steps; i++) {
        double kinetic = 0, fastest = 0;
        if (sim_particles_step(particles, step_s, NULL) < 0)
            return false;
        for (int n = 0; n < config->nodes; n++) {
            const double *const v = particles->vel_m_s + 3 * (ptrdiff_t)n;
            kinetic += config->node[n].mass_kg * sim_dot3(v, v);
            fastest = fmax(fastest, sqrt(sim_dot3(v, v)));
        }
        if (stopped && fastest <= SETTLED * gravity * step_s)
            return true;
        stopped = kinetic < before;
        before = stopped ? 0 : kinetic;
        if (stopped)
            memset(particles->vel_m_s, 0, size);
    }
    return false;
}

/* --- linkages ------------------------------------------------------------------ */

double oracle_linkage_energy_j(const struct sim_linkage *linkage)
{
    const struct sim_linkage_config *const config = &linkage->config;
    double energy = 0, vel_x = 0, vel_z = 0, height = 0;

    for (int i = 0; i < config->links; i++) {
        const double length = config->length_m[i];
        const double angle = linkage->angle_rad[i];
        /* 1 - cos(angle), without what cancels */
        height += 2 * length * sin(0.5 * angle) * sin(0.5 * angle);
        vel_x += length * cos(angle) * linkage->speed_rad_s[i];
        vel_z += length * sin(angle) * linkage->speed_rad_s[i];
        energy += config->mass_kg[i] * (0.5 * (vel_x * vel_x + vel_z * vel_z) +
                                        config->gravity_m_s2 * height);
    }
    return energy;
}

bool oracle_linkage_modes(const struct sim_linkage_config *config, double *hz,
                          double *shape)
{
    const struct sim_signal still = { { 0 } };
    const double aside_m = 1e-6, step_s = 1e-6;
    double acc[SIM_LINKAGE_LINKS * SIM_LINKAGE_LINKS];
    struct sim_linkage linkage;
    const int n = config->links;

    for (int j = 0; j < n; j++) {
        double speed = 0;
        if (sim_linkage_init(&linkage, config) < 0)
            return false;
        linkage.angle_rad[j] = aside_m / config->length_m[j];
        if (j + 1 < n)
            linkage.angle_rad[j + 1] = -aside_m / config->length_m[j + 1];
        if (sim_linkage_step(&linkage, step_s, &still) < 0)
            return false;
        for (int i = 0; i < n; i++) {
            speed += config->length_m[i] * linkage.speed_rad_s[i];
            acc[i * n + j] = speed / (aside_m * step_s);
        }
    }
    return oracle_modes(config->mass_kg, acc, n, hz, shape);
}

/* --- drives ---------------------------------------------------------------------- */

double oracle_drivetrain_energy_j(const struct sim_drivetrain *drive)
{
    const struct sim_drivetrain_config *const config = &drive->config;
    const int n = config->inertias;
    double energy = 0;

    for (int i = 0; i < n; i++) {
        const struct sim_inertia *const inertia = &config->inertia[i];
        const double angle = drive->y[i], speed = drive->y[n + i];

        energy += 0.5 * inertia->inertia_kg_m2 * speed * speed +
                  0.5 * inertia->spring_n_m_rad * angle * angle +
                  inertia->gravity_n_m * sin(angle);
    }
    for (int i = 0; i + 1 < n; i++) {
        const double depth = fmax(0, fabs(sim_drivetrain_twist_rad(drive, i)) -
                                         0.5 * config->coupling[i].gap_rad);
        energy += 0.5 * config->coupling[i].stiffness_n_m_rad * depth * depth;
    }
    return energy;
}

/* --- modes ------------------------------------------------------------------------- */

/* Turn rows and columns p and q so that [p][q] becomes 0; the same turn on the
 * rows of vectors. */
static void turn(double *matrix, int n, int p, int q, double *vectors)
{
    const double theta =
        (matrix[q * n + q] - matrix[p * n + p]) / (2 * matrix[p * n + q]);
    const double tangent =
        (theta >= 0 ? 1 : -1) / (fabs(theta) + sqrt(theta * theta + 1));
    const double c = 1 / sqrt(tangent * tangent + 1), s = tangent * c;

    for (int k = 0; k < n; k++) {
        const double a = matrix[k * n + p], b = matrix[k * n + q];
        matrix[k * n + p] = c * a - s * b;
        matrix[k * n + q] = s * a + c * b;
    }
    for (int k = 0; k < n; k++) {
        const double a = matrix[p * n + k], b = matrix[q * n + k];
        const double u = vectors[p * n + k], v = vectors[q * n + k];
        matrix[p * n + k] = c * a - s * b;
        matrix[q * n + k] = s * a + c * b;
        vectors[p * n + k] = c * u - s * v;
        vectors[q * n + k] = s * u + c * v;
    }
}

static bool diagonalise(double *matrix, int n, double *vectors)
{
    double scale = 0;

    for (int i = 0; i < n * n; i++) {
        vectors[i] = i % (n + 1) == 0 ? 1 : 0;
        scale = fmax(scale, fabs(matrix[i]));
    }
    for (int sweep = 0; sweep < 60; sweep++) {
        bool turned = false;
        for (int p = 0; p < n; p++) {
            for (int q = p + 1; q < n; q++) {
                if (fabs(matrix[p * n + q]) <= scale * DBL_EPSILON / 16)
                    continue;
                turn(matrix, n, p, q, vectors);
                turned = true;
            }
        }
        if (!turned)
            return true;
    }
    return false;
}

static void swap(double *a, double *b, int count)
{
    for (int i = 0; i < count; i++) {
        const double kept = a[i];
        a[i] = b[i];
        b[i] = kept;
    }
}

bool oracle_modes(const double *mass, double *acc, int n, double *hz,
                  double *shape)
{
    double stiffest = 0;

    /* M^1/2 A M^-1/2 is symmetric but for what the steps leave */
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
            acc[i * n + j] *= -sqrt(mass[i] / mass[j]);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < i; j++)
            acc[i * n + j] = acc[j * n + i] =
                0.5 * (acc[i * n + j] + acc[j * n + i]);
    if (!diagonalise(acc, n, shape))
        return false;
    for (int i = 0; i < n; i++)
        stiffest = fmax(stiffest, acc[i * n + i]);
    for (int i = 0; i < n; i++) {
        const double square = acc[i * n + i];
        double *const row = shape + (ptrdiff_t)i * n;
        double largest = 0;

        hz[i] = square > stiffest * 1e-10 ? sqrt(square) / TWO_PI : 0;
        for (int k = 0; k < n; k++) {
            row[k] /= sqrt(mass[k]);
            largest = fmax(largest, fabs(row[k]));
        }
        for (int k = 0; k < n; k++)
            row[k] /= largest;
        for (int j = i; j > 0 && hz[j - 1] > hz[j]; j--) {
            swap(&hz[j - 1], &hz[j], 1);
            swap(shape + (ptrdiff_t)(j - 1) * n, shape + (ptrdiff_t)j * n, n);
        }
    }
    return true;
}
