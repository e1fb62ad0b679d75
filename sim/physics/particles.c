/* sim/physics/particles.c - see particles.h. */
#include "sim/physics/particles.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "motion/core/err.h"

#define SUBSTEP_RATE 0.3 /* substep x fastest rate */
#define TOUCHING_MAX 12  /* spheres of one size touch no more at once */

static double sim_dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Spheres that do not touch, as most pairs of a cloth's do not. */
static inline bool sim_spring_is_apart(const struct sim_spring *spring,
                                       const double *pos)
{
    const double *const a = pos + 3 * (ptrdiff_t)spring->i,
                        *const b = pos + 3 * (ptrdiff_t)spring->j;
    double square = 0;

    if (!spring->pushes)
        return false;
    for (int k = 0; k < 3; k++)
        square += (b[k] - a[k]) * (b[k] - a[k]);
    return square >= spring->rest_m * spring->rest_m;
}

/* The unit vector from i to j and the distance. */
static inline double sim_spring_axis(const struct sim_spring *spring,
                                     const double *pos, double *axis)
{
    const double *const a = pos + 3 * (ptrdiff_t)spring->i,
                        *const b = pos + 3 * (ptrdiff_t)spring->j;

    for (int k = 0; k < 3; k++)
        axis[k] = b[k] - a[k];
    const double length = sqrt(sim_dot(axis, axis));
    /* In one place there is no direction: no force. */
    for (int k = 0; k < 3; k++)
        axis[k] = length > 0 ? axis[k] / length : 0;
    return length;
}

/* With a length that changes by apart. */
static double sim_spring_tension(const struct sim_spring *spring, double length,
                                 double apart)
{
    const double stretch = length - spring->rest_m;
    const double elastic = spring->stiffness_n_m * stretch;

    if (!spring->pushes)
        return elastic + spring->damping_n_s_m * apart;
    return fmin(0, elastic - spring->damping_n_s_m * apart * stretch /
                                 spring->rest_m);
}

static void sim_particles_springs(const struct sim_particles_config *config,
                                  const double *pos, const double *vel,
                                  double *force)
{
    for (int s = 0; s < config->springs; s++) {
        const struct sim_spring *const spring = &config->spring[s];
        if (sim_spring_is_apart(spring, pos))
            continue;
        double *const on_i = force + 3 * (ptrdiff_t)spring->i,
                      *const on_j = force + 3 * (ptrdiff_t)spring->j;
        const double *const vi = vel + 3 * (ptrdiff_t)spring->i,
                            *const vj = vel + 3 * (ptrdiff_t)spring->j;
        double axis[3];
        const double length = sim_spring_axis(spring, pos, axis);
        const double apart = (vj[0] - vi[0]) * axis[0] +
                             (vj[1] - vi[1]) * axis[1] +
                             (vj[2] - vi[2]) * axis[2];
        const double tension = sim_spring_tension(spring, length, apart);

        for (int k = 0; k < 3; k++) {
            on_i[k] += tension * axis[k];
            on_j[k] -= tension * axis[k];
        }
    }
}

/* Places then speeds, both 3 x nodes.  A fixed node's speed is not changed; its
 * place changes with it. */
static void sim_particles_rate(void *plant, double t_s, const double *y,
                               double *rate)
{
    const struct sim_particles *const particles = plant;
    const struct sim_particles_config *const config = &particles->config;
    const int n = 3 * config->nodes;
    const double *const pos = y, *const vel = y + n;
    double *const force = rate + n;

    memcpy(rate, vel, (size_t)n * sizeof *rate);
    memset(force, 0, (size_t)n * sizeof *force);
    sim_particles_springs(config, pos, vel, force);
    for (int i = 0; i < config->nodes; i++) {
        const double *const v = vel + 3 * (ptrdiff_t)i;
        double *const f = force + 3 * (ptrdiff_t)i;
        const double mass = config->node[i].mass_kg;
        double drag = config->drag_linear_n_s_m;

        if (config->drag_quadratic_n_s2_m2 > 0)
            drag += config->drag_quadratic_n_s2_m2 * sqrt(sim_dot(v, v));
        for (int k = 0; k < 3; k++)
            f[k] = config->node[i].fixed
                       ? 0
                       : (f[k] - drag * v[k]) / mass + config->gravity_m_s2[k];
    }
    if (config->driven >= 0) {
        for (int k = 0; k < 3; k++) {
            const struct sim_signal slope =
                sim_signal_slope(&particles->input->pos_m[k]);
            const struct sim_signal curve = sim_signal_slope(&slope);
            force[3 * config->driven + k] = sim_signal_at(&curve, t_s);
        }
    }
}

static bool sim_amount(double value)
{
    return isfinite(value) && value >= 0;
}

static bool sim_particles_is_legal(const struct sim_particles_config *config)
{
    if (config->nodes < 1 || config->nodes > SIM_PARTICLES_NODES ||
        config->springs < 0 || !sim_amount(config->drag_linear_n_s_m) ||
        !sim_amount(config->drag_quadratic_n_s2_m2) || config->driven < -1 ||
        config->driven >= config->nodes)
        return false;
    for (int k = 0; k < 3; k++) {
        if (!isfinite(config->gravity_m_s2[k]))
            return false;
    }
    for (int i = 0; i < config->nodes; i++) {
        if (!(sim_amount(config->node[i].mass_kg) &&
              config->node[i].mass_kg > 0))
            return false;
    }
    for (int s = 0; s < config->springs; s++) {
        const struct sim_spring *const spring = &config->spring[s];
        if (spring->i < 0 || spring->i >= config->nodes || spring->j < 0 ||
            spring->j >= config->nodes || spring->i == spring->j ||
            !sim_amount(spring->stiffness_n_m) ||
            !sim_amount(spring->damping_n_s_m) || !sim_amount(spring->rest_m) ||
            (spring->pushes && !(spring->rest_m > 0)))
            return false;
    }
    return config->driven < 0 || config->node[config->driven].fixed;
}

/* No less than any rate of the springs: twice the stiffness (damping) at a
 * node over its mass, Gershgorin.  Of those that only push, no more act at once than
 * spheres can touch. */
static double sim_particles_fastest(const struct sim_particles_config *config,
                                    double *sums)
{
    double *const stiffness = sums, *const damping = sums + config->nodes;
    double fastest = 1, push = 0, push_damping = 0;

    for (int i = 0; i < 2 * config->nodes; i++)
        sums[i] = 0;
    for (int s = 0; s < config->springs; s++) {
        const struct sim_spring *const spring = &config->spring[s];
        if (spring->pushes) {
            push = fmax(push, 2 * TOUCHING_MAX * spring->stiffness_n_m);
            push_damping =
                fmax(push_damping, 2 * TOUCHING_MAX * spring->damping_n_s_m);
            continue;
        }
        stiffness[spring->i] += 2 * spring->stiffness_n_m;
        stiffness[spring->j] += 2 * spring->stiffness_n_m;
        damping[spring->i] += 2 * spring->damping_n_s_m;
        damping[spring->j] += 2 * spring->damping_n_s_m;
    }
    for (int i = 0; i < config->nodes; i++) {
        const double mass = config->node[i].mass_kg;
        const double lost =
            damping[i] + push_damping + config->drag_linear_n_s_m;
        if (!config->node[i].fixed)
            fastest = fmax(
                fastest, fmax(sqrt((stiffness[i] + push) / mass), lost / mass));
    }
    return fastest;
}

int sim_particles_init(struct sim_particles *particles,
                       const struct sim_particles_config *config, double *work)
{
    const int n = 3 * config->nodes;

    if (!sim_particles_is_legal(config))
        return MOTION_E_ARG;
    *particles = (struct sim_particles){
        .config = *config,
        .pos_m = work,
        .vel_m_s = work + n,
        .substep_max_s = SUBSTEP_RATE / sim_particles_fastest(config, work),
    };
    memset(work, 0, 2 * (size_t)n * sizeof *work);
    sim_gauss_init(&particles->gauss, 2 * n, sim_particles_rate, particles,
                   work + 2 * (size_t)n);
    return MOTION_OK;
}

/* The driven node where the input is; what the steps add to it is the same
 * but for their rounding. */
static void sim_particles_drive(struct sim_particles *particles, double t_s)
{
    const int driven = particles->config.driven;

    for (int k = 0; k < 3 && driven >= 0; k++) {
        const struct sim_signal *const signal = &particles->input->pos_m[k];
        const struct sim_signal slope = sim_signal_slope(signal);
        particles->pos_m[3 * driven + k] = sim_signal_at(signal, t_s);
        particles->vel_m_s[3 * driven + k] = sim_signal_at(&slope, t_s);
    }
}

int sim_particles_step(struct sim_particles *particles, double step_s,
                       const struct sim_particles_input *input)
{
    const double count = ceil(step_s / particles->substep_max_s);
    const double substep_s = step_s / count;

    if (!(step_s > 0) || !(count < 1e6) ||
        (particles->config.driven >= 0 && input == NULL))
        return MOTION_E_ARG;
    particles->input = input;
    sim_particles_drive(particles, 0);
    for (int i = 0; i < (int)count; i++) {
        if (!sim_gauss_step(&particles->gauss, i * substep_s, substep_s,
                            particles->pos_m))
            return MOTION_E_RANGE;
    }
    sim_particles_drive(particles, step_s);
    return MOTION_OK;
}

double sim_particles_tension_n(const struct sim_particles *particles,
                               int spring)
{
    const struct sim_spring *const of = &particles->config.spring[spring];
    double axis[3];

    return sim_spring_tension(of, sim_spring_axis(of, particles->pos_m, axis),
                              0);
}
