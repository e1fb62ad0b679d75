/* sim/physics/particles_settle.c - the shape at rest and the stiffness there;
 * see particles.h. */
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "motion/core/err.h"
#include "sim/physics/matrix.h"
#include "sim/physics/particles.h"

#define SLOPE_PART  1e-12 /* of the largest force, where the slope is 0 */
#define SHIFT_LEAST 1e-9  /* of the stiffness, when one is needed */
#define NUDGE_PART  1e-3  /* of the mean length of a spring */
#define STRIDE_PART 0.5   /* the same, the longest step of a node */

int sim_particles_free(const struct sim_particles *particles)
{
    int count = 0;

    for (int i = 0; i < particles->config.nodes; i++)
        count += particles->config.node[i].fixed ? 0 : 1;
    return count;
}

/* The first coordinate of a node among the free ones, or -1. */
static int sim_settle_index(const struct sim_particles *particles, int node)
{
    int index = 0;

    if (particles->config.node[node].fixed)
        return -1;
    for (int i = 0; i < node; i++)
        index += particles->config.node[i].fixed ? 0 : 3;
    return index;
}

/* The block of a spring: k (u u' + (1 - l0/l) (1 - u u')) with its axis u. */
static void sim_settle_block(const struct sim_particles *particles,
                             const struct sim_spring *spring, double *block)
{
    const double *const a = particles->pos_m + 3 * (ptrdiff_t)spring->i;
    const double *const b = particles->pos_m + 3 * (ptrdiff_t)spring->j;
    double axis[3], length = 0;

    for (int k = 0; k < 3; k++) {
        axis[k] = b[k] - a[k];
        length += axis[k] * axis[k];
    }
    length = sqrt(length);
    if (spring->pushes && length >= spring->rest_m) {
        memset(block, 0, 9 * sizeof *block);
        return;
    }
    const double across = length > 0 ? 1 - spring->rest_m / length : 0;
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
            const double along =
                length > 0 ? axis[r] * axis[c] / (length * length) : 0;
            block[3 * r + c] = spring->stiffness_n_m *
                               (along * (1 - across) + (r == c ? across : 0));
        }
    }
}

static void sim_settle_add(double *matrix, int n, int row, int column,
                           const double *block, double sign)
{
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++)
            matrix[(row + r) * n + column + c] += sign * block[3 * r + c];
    }
}

void sim_particles_stiffness(const struct sim_particles *particles,
                             double *matrix_n_m)
{
    const int n = 3 * sim_particles_free(particles);
    double block[9];

    memset(matrix_n_m, 0, (size_t)n * (size_t)n * sizeof *matrix_n_m);
    for (int s = 0; s < particles->config.springs; s++) {
        const struct sim_spring *const spring = &particles->config.spring[s];
        const int i = sim_settle_index(particles, spring->i);
        const int j = sim_settle_index(particles, spring->j);

        sim_settle_block(particles, spring, block);
        if (i >= 0)
            sim_settle_add(matrix_n_m, n, i, i, block, 1);
        if (j >= 0)
            sim_settle_add(matrix_n_m, n, j, j, block, 1);
        if (i >= 0 && j >= 0) {
            sim_settle_add(matrix_n_m, n, i, j, block, -1);
            sim_settle_add(matrix_n_m, n, j, i, block, -1);
        }
    }
}

/* The force on every free coordinate; the largest term of any. */
static double sim_settle_force(const struct sim_particles *particles,
                               double *force)
{
    const struct sim_particles_config *const config = &particles->config;
    double largest = 0;

    for (int i = 0, to = 0; i < config->nodes; i++) {
        for (int k = 0; k < 3 && !config->node[i].fixed; k++) {
            force[to] = config->node[i].mass_kg * config->gravity_m_s2[k];
            largest = fmax(largest, fabs(force[to++]));
        }
    }
    for (int s = 0; s < config->springs; s++) {
        const struct sim_spring *const spring = &config->spring[s];
        const double *const a = particles->pos_m + 3 * (ptrdiff_t)spring->i;
        const double *const b = particles->pos_m + 3 * (ptrdiff_t)spring->j;
        const double tension = sim_particles_tension_n(particles, s);
        const int i = sim_settle_index(particles, spring->i);
        const int j = sim_settle_index(particles, spring->j);
        double length = 0;

        for (int k = 0; k < 3; k++)
            length += (b[k] - a[k]) * (b[k] - a[k]);
        length = sqrt(length);
        largest = fmax(largest, fabs(tension));
        for (int k = 0; k < 3 && length > 0; k++) {
            const double pull = tension * (b[k] - a[k]) / length;
            if (i >= 0)
                force[i + k] += pull;
            if (j >= 0)
                force[j + k] -= pull;
        }
    }
    return largest;
}

static void sim_settle_move(struct sim_particles *particles, const double *by,
                            double times)
{
    for (int i = 0, from = 0; i < particles->config.nodes; i++) {
        for (int k = 0; k < 3 && !particles->config.node[i].fixed; k++)
            particles->pos_m[3 * i + k] += times * by[from++];
    }
}

static double sim_settle_length(const struct sim_particles *particles)
{
    double sum = 0;

    for (int s = 0; s < particles->config.springs; s++)
        sum += particles->config.spring[s].rest_m;
    return particles->config.springs > 0 && sum > 0
               ? sum / particles->config.springs
               : 1;
}

/* A small step in no special direction, the same on every machine. */
static void sim_settle_nudge(struct sim_particles *particles, double *by, int n,
                             double length)
{
    unsigned state = 12345;

    for (int i = 0; i < n; i++) {
        state = state * 1664525u + 1013904223u;
        by[i] = length * ((double)(state >> 8) / 8388608.0 - 1);
    }
    sim_settle_move(particles, by, 1);
}

static double sim_settle_largest(const double *values, int n)
{
    double largest = 0;

    for (int i = 0; i < n; i++)
        largest = fmax(largest, fabs(values[i]));
    return largest;
}

/* The step of (stiffness + shift) step = force; false when that is not
 * positive definite. */
static bool sim_settle_newton(const double *stiffness, double *factor,
                              const double *force, double shift, int n,
                              double *step)
{
    memcpy(factor, stiffness, (size_t)n * (size_t)n * sizeof *factor);
    memcpy(step, force, (size_t)n * sizeof *step);
    for (int i = 0; i < n; i++)
        factor[i * n + i] += shift;
    if (!sim_cholesky(factor, n))
        return false;
    sim_cholesky_solve(factor, n, step);
    return true;
}

struct sim_settle {
    int n;
    double *stiffness, *factor, *force, *step;
    double scale, shift, length;
};

/* Take the step if it is short enough and goes down. */
static bool sim_settle_try(struct sim_particles *particles,
                           struct sim_settle *settle, double before)
{
    if (!sim_settle_newton(settle->stiffness, settle->factor, settle->force,
                           settle->shift, settle->n, settle->step) ||
        sim_settle_largest(settle->step, settle->n) >
            STRIDE_PART * settle->length)
        return false;
    sim_settle_move(particles, settle->step, 1);
    if (sim_particles_energy_j(particles) < before)
        return true;
    sim_settle_move(particles, settle->step, -1);
    return false;
}

/* One step downhill with a shift as large as it needs.  False: no step of any
 * length goes down. */
static bool sim_settle_step(struct sim_particles *particles,
                            struct sim_settle *settle)
{
    const double before = sim_particles_energy_j(particles);
    const double least = SHIFT_LEAST * settle->scale;

    for (int tries = 0; tries < 60; tries++) {
        if (sim_settle_try(particles, settle, before)) {
            settle->shift = settle->shift / 8 < least ? 0 : settle->shift / 8;
            return true;
        }
        settle->shift = fmax(4 * settle->shift, least);
    }
    return false;
}

int sim_particles_settle(struct sim_particles *particles, int steps_max,
                         double *work)
{
    const int n = 3 * sim_particles_free(particles);
    const size_t square = (size_t)n * (size_t)n;
    struct sim_settle settle = {
        .n = n,
        .stiffness = work,
        .factor = work + square,
        .force = work + 2 * square,
        .step = work + 2 * square + n,
        .length = sim_settle_length(particles),
    };

    memset(particles->vel_m_s, 0,
           3 * (size_t)particles->config.nodes * sizeof(double));
    for (int i = 0; i < steps_max; i++) {
        const double scale = sim_settle_force(particles, settle.force);

        sim_particles_stiffness(particles, settle.stiffness);
        settle.scale = sim_settle_largest(settle.stiffness, (int)square);
        const bool flat =
            sim_settle_largest(settle.force, n) <= SLOPE_PART * scale;
        if (flat || !sim_settle_step(particles, &settle)) {
            /* At a minimum nothing is indefinite; a last step of Newton takes
             * what the energy cannot resolve. */
            if (sim_settle_newton(settle.stiffness, settle.factor, settle.force,
                                  0, n, settle.step)) {
                sim_settle_move(particles, settle.step, 1);
                return i;
            }
            sim_settle_nudge(particles, settle.step, n,
                             NUDGE_PART * settle.length);
            settle.shift = SHIFT_LEAST * settle.scale;
        }
    }
    return MOTION_E_WORK;
}
