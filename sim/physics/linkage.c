/* sim/physics/linkage.c - see linkage.h. */
#include "sim/physics/linkage.h"

#include <math.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/double/double_math.h"
#include "sim/physics/matrix.h"

#define SUBSTEP_RATE 0.05 /* substep x fastest rate */
#define SUBSTEPS_MAX 1000

/* l[i] l[j] (mass from the lower one down) */
static double sim_linkage_a(const struct sim_linkage *linkage, int i, int j)
{
    return linkage->config.length_m[i] * linkage->config.length_m[j] *
           linkage->below_kg[i > j ? i : j];
}

/* Of every link's angle. */
struct sim_linkage_turns {
    double sine[SIM_LINKAGE_LINKS], cosine[SIM_LINKAGE_LINKS];
};

static void sim_linkage_turn(const struct sim_linkage *linkage,
                             const double *angle,
                             struct sim_linkage_turns *turns)
{
    for (int i = 0; i < linkage->config.links; i++)
        double_sincos(angle[i], &turns->sine[i], &turns->cosine[i]);
}

/* Of the angle of link i less that of link j. */
static double sim_linkage_cos(const struct sim_linkage_turns *turns, int i,
                              int j)
{
    return i == j ? 1
                  : turns->cosine[i] * turns->cosine[j] +
                        turns->sine[i] * turns->sine[j];
}

static double sim_linkage_sin(const struct sim_linkage_turns *turns, int i,
                              int j)
{
    return turns->sine[i] * turns->cosine[j] -
           turns->cosine[i] * turns->sine[j];
}

/* Momenta from speeds. */
static void sim_linkage_momenta(const struct sim_linkage *linkage,
                                const double *angle, const double *speed,
                                double *momentum)
{
    const int n = linkage->config.links;
    struct sim_linkage_turns turns;

    sim_linkage_turn(linkage, angle, &turns);
    for (int i = 0; i < n; i++) {
        momentum[i] = 0;
        for (int j = 0; j < n; j++)
            momentum[i] += sim_linkage_a(linkage, i, j) *
                           sim_linkage_cos(&turns, i, j) * speed[j];
    }
}

/* Speeds from momenta, in place.  The matrix is that of a kinetic energy:
 * positive definite, whatever the angles. */
static void sim_linkage_speeds(const struct sim_linkage *linkage,
                               const struct sim_linkage_turns *turns,
                               double *momentum)
{
    const int n = linkage->config.links;
    double matrix[SIM_LINKAGE_LINKS * SIM_LINKAGE_LINKS];

    if (n == 1) {
        momentum[0] /= sim_linkage_a(linkage, 0, 0);
        return;
    }
    for (int i = 0; i < n; i++) {
        for (int j = 0; j <= i; j++)
            matrix[i * n + j] =
                sim_linkage_a(linkage, i, j) * sim_linkage_cos(turns, i, j);
    }
    if (sim_cholesky(matrix, n))
        sim_cholesky_solve(matrix, n, momentum);
    else
        momentum[0] = NAN; /* angles that are no numbers */
}

static void sim_linkage_rate(void *plant, double t_s, const double *y,
                             double *rate)
{
    const struct sim_linkage *const linkage = plant;
    const struct sim_linkage_config *const config = &linkage->config;
    const int n = config->links;
    const double pivot = sim_signal_at(&linkage->pivot_acc_m_s2, t_s);
    double *const speed = rate, *const force = rate + n;
    struct sim_linkage_turns turns;

    memcpy(speed, y + n, (size_t)n * sizeof *speed);
    sim_linkage_turn(linkage, y, &turns);
    sim_linkage_speeds(linkage, &turns, speed);
    for (int i = 0; i < n; i++) {
        force[i] =
            -linkage->below_kg[i] * config->length_m[i] *
            (config->gravity_m_s2 * turns.sine[i] + pivot * turns.cosine[i]);
        for (int j = 0; j < n; j++) {
            if (j != i)
                force[i] -= sim_linkage_a(linkage, i, j) * speed[i] * speed[j] *
                            sim_linkage_sin(&turns, i, j);
        }
    }
    force[0] -= config->damping_n_m_s * speed[0];
}

static bool sim_linkage_is_legal(const struct sim_linkage_config *config)
{
    if (config->links < 1 || config->links > SIM_LINKAGE_LINKS)
        return false;
    for (int i = 0; i < config->links; i++) {
        if (!(isfinite(config->mass_kg[i]) && config->mass_kg[i] > 0 &&
              isfinite(config->length_m[i]) && config->length_m[i] > 0))
            return false;
    }
    return isfinite(config->damping_n_m_s) && config->damping_n_m_s >= 0 &&
           isfinite(config->gravity_m_s2) && config->gravity_m_s2 >= 0;
}

int sim_linkage_init(struct sim_linkage *linkage,
                     const struct sim_linkage_config *config)
{
    double below = 0;

    if (!sim_linkage_is_legal(config))
        return MOTION_E_ARG;
    *linkage = (struct sim_linkage){ .config = *config };
    for (int i = config->links - 1; i >= 0; i--) {
        below += config->mass_kg[i];
        linkage->below_kg[i] = below;
    }
    sim_gauss_init(&linkage->gauss, 2 * config->links, sim_linkage_rate,
                   linkage, linkage->work);
    return MOTION_OK;
}

/* No less than the rates at which it swings and turns now. */
static double sim_linkage_fastest(const struct sim_linkage *linkage)
{
    const struct sim_linkage_config *const config = &linkage->config;
    const int n = config->links;
    double fastest = config->damping_n_m_s / sim_linkage_a(linkage, 0, 0);

    for (int i = 0; i < n; i++) {
        /* The lowest link swings fastest of all when the masses above it hold
         * still; n^2 covers the coupling of the others. */
        const double swing = sqrt(config->gravity_m_s2 * linkage->below_kg[i] /
                                  (config->length_m[i] * config->mass_kg[i]));
        fastest = fmax(fastest, n * swing);
        fastest = fmax(fastest, n * fabs(linkage->speed_rad_s[i]));
    }
    return fastest;
}

int sim_linkage_step(struct sim_linkage *linkage, double step_s,
                     const struct sim_signal *pivot_x_m)
{
    const int n = linkage->config.links;
    const struct sim_signal slope = sim_signal_slope(pivot_x_m);
    const double wanted =
        ceil(step_s * sim_linkage_fastest(linkage) / SUBSTEP_RATE);
    double y[2 * SIM_LINKAGE_LINKS];
    struct sim_linkage_turns turns;

    if (!(step_s > 0) || !(wanted <= SUBSTEPS_MAX))
        return MOTION_E_RANGE;
    const int count = wanted > 1 ? (int)wanted : 1;
    linkage->pivot_acc_m_s2 = sim_signal_slope(&slope);
    memcpy(y, linkage->angle_rad, (size_t)n * sizeof y[0]);
    sim_linkage_momenta(linkage, y, linkage->speed_rad_s, y + n);
    for (int i = 0; i < count; i++) {
        if (!sim_gauss_step(&linkage->gauss, i * step_s / count, step_s / count,
                            y))
            return MOTION_E_RANGE;
    }
    sim_linkage_turn(linkage, y, &turns);
    sim_linkage_speeds(linkage, &turns, y + n);
    memcpy(linkage->angle_rad, y, (size_t)n * sizeof y[0]);
    memcpy(linkage->speed_rad_s, y + n, (size_t)n * sizeof y[0]);
    return MOTION_OK;
}

void sim_linkage_place_m(const struct sim_linkage *linkage, int i, double *x_m,
                         double *z_m)
{
    *x_m = *z_m = 0;
    for (int j = 0; j <= i; j++) {
        *x_m += linkage->config.length_m[j] * double_sin(linkage->angle_rad[j]);
        *z_m -= linkage->config.length_m[j] * double_cos(linkage->angle_rad[j]);
    }
}
