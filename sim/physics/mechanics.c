/* sim/physics/mechanics.c - see mechanics.h. */
#include "sim/physics/mechanics.h"

#include <math.h>

#include "motion/core/err.h"

#define MOTOR       0
#define LOAD        1
#define LAST(drive) ((drive)->config.inertias - 1)
#define Q24         16777216.0
#define PI          3.14159265358979323846

static bool mechanics_is_legal(const struct sim_mechanics_config *config)
{
    const struct sim_mechanics_second *const second = &config->second;
    const double efficiency = config->transmission.efficiency;

    return config->inertia_ratio >= 0.01 && config->inertia_ratio <= 1000 &&
           config->frequency_hz >= 0.1 && config->frequency_hz <= 500 &&
           config->damping >= 0 && config->damping <= 1 &&
           (second->inertia_ratio == 0 ||
            (second->inertia_ratio >= 0.01 && second->inertia_ratio <= 1000 &&
             second->frequency_hz >= 0.1 && second->frequency_hz <= 500 &&
             second->damping >= 0 && second->damping <= 1)) &&
           (efficiency == 0 || (efficiency >= 0.05 && efficiency <= 1));
}

/* Of that inertia, which swings at that frequency behind it. */
static struct sim_coupling mechanics_coupling(double inertia,
                                              double frequency_hz,
                                              double damping, double backlash)
{
    const double omega = 2 * PI * frequency_hz;

    return (struct sim_coupling){ .stiffness_n_m_rad = omega * omega * inertia,
                                  .damping_n_m_s =
                                      2 * damping * omega * inertia,
                                  .gap_rad = backlash,
                                  .ratio = 1 };
}

static void mechanics_transmit(const struct sim_mechanics_transmission *from,
                               struct sim_coupling *coupling)
{
    if (from->efficiency > 0)
        coupling->loss = 1 / from->efficiency - 1;
    coupling->error_rad = from->pitch_error_counts;
    coupling->error_period_rad = from->pitch_counts;
}

static void mechanics_second(const struct sim_mechanics_second *from,
                             double motor, struct sim_drivetrain_config *drive)
{
    const double inertia = from->inertia_ratio * motor;

    if (inertia == 0)
        return;
    drive->inertias = LOAD + 2;
    drive->inertia[LOAD + 1].inertia_kg_m2 = inertia;
    drive->coupling[LOAD] = mechanics_coupling(
        inertia, from->frequency_hz, from->damping, from->backlash_counts);
}

int sim_mechanics_init(struct sim_mechanics *self,
                       const struct sim_mechanics_config *config,
                       int64_t motor_q24)
{
    const double ratio = config->inertia_ratio;
    const double motor = 1 / (1 + ratio + config->second.inertia_ratio);
    const double load = ratio * motor;
    const struct sim_coupling coupling = mechanics_coupling(
        load, config->frequency_hz, config->damping, config->backlash_counts);
    const double at = (double)motor_q24 / Q24;
    /* its weight presses the lower flank */
    const double sag =
        config->weight_counts_s2 / coupling.stiffness_n_m_rad +
        (config->weight_counts_s2 != 0
             ? copysign(0.5 * config->backlash_counts, config->weight_counts_s2)
             : 0);
    struct sim_drivetrain_config drive = {
        .inertias = LOAD + 1,
        .inertia = {
            [MOTOR] = { .inertia_kg_m2 = motor },
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
        .coupling = { coupling },
    };
    int err;

    if (!mechanics_is_legal(config) ||
        (config->has_stops && (at - sag < config->stop_low_counts ||
                               at - sag > config->stop_high_counts)))
        return MOTION_E_ARG;
    mechanics_transmit(&config->transmission, &drive.coupling[MOTOR]);
    mechanics_second(&config->second, motor, &drive);
    *self = (struct sim_mechanics){ .weight = config->weight_counts_s2,
                                    .pos_q24 = motor_q24 };
    err = sim_drivetrain_init(&self->drive, &drive);
    if (err < 0)
        return err;
    self->drive.y[MOTOR] = at;
    /* an error of the pitch there is, too */
    const double off = sim_drivetrain_twist_rad(&self->drive, MOTOR) - at;
    for (int i = LOAD; i <= LAST(&self->drive); i++)
        self->drive.y[i] = at + off - sag;
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
    for (int i = MOTOR; i <= LAST(&self->drive); i++)
        self->drive.y[i] += shift;
    self->drive.config.coupling[MOTOR].error_from_rad += shift;
    stop->low_rad += shift;
    stop->high_rad += shift;
}

static double *mechanics_speed(struct sim_mechanics *self, int i)
{
    return &self->drive.y[self->drive.config.inertias + i];
}

static void mechanics_stand(struct sim_mechanics *self)
{
    self->failed++;
    for (int i = MOTOR; i <= LAST(&self->drive); i++)
        *mechanics_speed(self, i) = 0;
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
        *mechanics_speed(self, MOTOR) = 0;
    mechanics_advance(self, torque_counts_s2, dt_s);
    *pos_q24 = self->pos_q24 = llround(self->drive.y[MOTOR] * Q24);
    *vel_q24 = llround(*mechanics_speed(self, MOTOR) * Q24);
}

void sim_mechanics_drag(struct sim_mechanics *self, double dt_s,
                        int64_t from_q24, int64_t pos_q24, int64_t vel_q24)
{
    mechanics_follow(self, from_q24);
    mechanics_advance(self, 0, dt_s);
    self->drive.y[MOTOR] = (double)pos_q24 / Q24;
    *mechanics_speed(self, MOTOR) = (double)vel_q24 / Q24;
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
    const struct sim_drivetrain *const drive = &self->drive;
    double energy = 0, give = 0; /* twice the one; of all couplings in a row */

    for (int i = LOAD; i <= LAST(drive); i++) {
        const struct sim_inertia *const inertia = &drive->config.inertia[i];
        const struct sim_coupling *const coupling =
            &drive->config.coupling[i - 1];
        const double stiffness = coupling->stiffness_n_m_rad;
        const double twist = -sim_drivetrain_twist_rad(drive, i - 1);
        const double wound =
            copysign(fmax(0, fabs(twist) - 0.5 * coupling->gap_rad), twist);
        const double off = wound + inertia->load_n_m / stiffness;
        const double speed = sim_drivetrain_speed_rad_s(drive, i) -
                             sim_drivetrain_speed_rad_s(drive, MOTOR);
        energy +=
            stiffness * off * off + inertia->inertia_kg_m2 * speed * speed;
        give += 1 / stiffness;
    }
    return sqrt(energy * give);
}

int64_t sim_mechanics_load_q24(const struct sim_mechanics *self)
{
    return llround(self->drive.y[LAST(&self->drive)] * Q24);
}
