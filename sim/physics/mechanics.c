/* sim/physics/mechanics.c - see mechanics.h. */
#include "sim/physics/mechanics.h"

#include <math.h>

#include "motion/core/err.h"

#define MOTOR 0
#define LOAD  1
#define ROWS  2
#define Q24   16777216.0
#define PI    3.14159265358979323846

static bool mechanics_is_legal(const struct sim_mechanics_config *config)
{
    return config->inertia_ratio >= 0.01 && config->inertia_ratio <= 1000 &&
           config->frequency_hz >= 0.1 && config->frequency_hz <= 500 &&
           config->damping >= 0 && config->damping <= 1;
}

int sim_mechanics_init(struct sim_mechanics *self,
                       const struct sim_mechanics_config *config,
                       int64_t motor_q24)
{
    const double ratio = config->inertia_ratio;
    const double load = ratio / (1 + ratio);
    const double omega = 2 * PI * config->frequency_hz;
    const double stiffness = omega * omega * load;
    const double at = (double)motor_q24 / Q24;
    /* its weight presses the lower flank */
    const double sag =
        config->weight_counts_s2 / stiffness +
        (config->weight_counts_s2 != 0
             ? copysign(0.5 * config->backlash_counts, config->weight_counts_s2)
             : 0);
    const struct sim_drivetrain_config drive = {
        .inertias = ROWS,
        .inertia = {
            [MOTOR] = { .inertia_kg_m2 = 1 - load },
            [LOAD] = { .inertia_kg_m2 = load,
                       .viscous_n_m_s = config->viscous_1_s,
                       .coulomb_n_m = config->coulomb_counts_s2,
                       .static_n_m = config->static_counts_s2,
                       .stribeck_rad_s = config->stribeck_counts_s,
                       .load_n_m = config->weight_counts_s2,
                       .stop = { .high = config->has_stops,
                                 .low = config->has_stops,
                                 .high_rad = config->stop_high_counts,
                                 .low_rad = config->stop_low_counts } },
        },
        .coupling = { { .stiffness_n_m_rad = stiffness,
                        .damping_n_m_s = 2 * config->damping * omega * load,
                        .gap_rad = config->backlash_counts,
                        .ratio = 1 } },
    };
    int err;

    if (!mechanics_is_legal(config) ||
        (config->has_stops && (at - sag < config->stop_low_counts ||
                               at - sag > config->stop_high_counts)))
        return MOTION_E_ARG;
    *self = (struct sim_mechanics){ .load_inertia = load,
                                    .weight = config->weight_counts_s2,
                                    .pos_q24 = motor_q24 };
    err = sim_drivetrain_init(&self->drive, &drive);
    if (err < 0)
        return err;
    self->drive.y[MOTOR] = at;
    self->drive.y[LOAD] = at - sag;
    sim_drivetrain_reset(&self->drive);
    return MOTION_OK;
}

/* What its drive counts from has changed. */
static void mechanics_follow(struct sim_mechanics *self, int64_t pos_q24)
{
    const double shift = (double)(pos_q24 - self->pos_q24) / Q24;
    struct sim_stop *stop = &self->drive.config.inertia[LOAD].stop;

    if (shift == 0)
        return;
    self->drive.y[MOTOR] += shift;
    self->drive.y[LOAD] += shift;
    stop->low_rad += shift;
    stop->high_rad += shift;
}

static void mechanics_stand(struct sim_mechanics *self)
{
    self->failed++;
    self->drive.y[ROWS + MOTOR] = self->drive.y[ROWS + LOAD] = 0;
    sim_drivetrain_reset(&self->drive);
}

static void mechanics_advance(struct sim_mechanics *self, double torque,
                              double dt_s)
{
    const struct sim_drivetrain_input input = { .torque_n_m = { { torque } } };

    if (sim_drivetrain_step(&self->drive, 0, dt_s, &input) < 0)
        mechanics_stand(self);
}

void sim_mechanics_step(struct sim_mechanics *self, double torque_counts_s2,
                        double dt_s, int64_t *pos_q24, int64_t *vel_q24)
{
    mechanics_follow(self, *pos_q24);
    /* somebody holds the rotor */
    if (*vel_q24 == 0)
        self->drive.y[ROWS + MOTOR] = 0;
    mechanics_advance(self, torque_counts_s2, dt_s);
    *pos_q24 = self->pos_q24 = llround(self->drive.y[MOTOR] * Q24);
    *vel_q24 = llround(self->drive.y[ROWS + MOTOR] * Q24);
}

void sim_mechanics_drag(struct sim_mechanics *self, double dt_s,
                        int64_t from_q24, int64_t pos_q24, int64_t vel_q24)
{
    mechanics_follow(self, from_q24);
    mechanics_advance(self, 0, dt_s);
    self->drive.y[MOTOR] = (double)pos_q24 / Q24;
    self->drive.y[ROWS + MOTOR] = (double)vel_q24 / Q24;
    self->pos_q24 = pos_q24;
    self->integral = 0;
    sim_drivetrain_reset(&self->drive);
}

void sim_mechanics_pull(struct sim_mechanics *self, double counts_s2)
{
    self->drive.config.inertia[LOAD].load_n_m = self->weight - counts_s2;
}

double sim_mechanics_swing_counts(const struct sim_mechanics *self)
{
    const struct sim_coupling *coupling = &self->drive.config.coupling[0];
    const double twist = -sim_drivetrain_twist_rad(&self->drive, 0);
    const double wound =
        copysign(fmax(0, fabs(twist) - 0.5 * coupling->gap_rad), twist);
    const double rest = -self->drive.config.inertia[LOAD].load_n_m /
                        coupling->stiffness_n_m_rad;
    const double speed =
        self->drive.y[ROWS + LOAD] - self->drive.y[ROWS + MOTOR];

    return sqrt((wound - rest) * (wound - rest) +
                speed * speed * self->load_inertia /
                    coupling->stiffness_n_m_rad);
}

int64_t sim_mechanics_load_q24(const struct sim_mechanics *self)
{
    return llround(self->drive.y[LOAD] * Q24);
}
