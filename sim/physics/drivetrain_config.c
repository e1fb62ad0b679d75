/* sim/physics/drivetrain_config.c - see drivetrain_config.h. */
#include "sim/physics/drivetrain_config.h"

#include <math.h>

#define TWO_PI 6.283185307179586

static bool sim_positive(double value)
{
    return isfinite(value) && value > 0;
}

static bool sim_not_negative(double value)
{
    return isfinite(value) && value >= 0;
}

static bool sim_inertia_is_legal(const struct sim_inertia *inertia)
{
    return sim_positive(inertia->inertia_kg_m2) &&
           sim_not_negative(inertia->viscous_n_m_s) &&
           sim_not_negative(inertia->coulomb_n_m) &&
           inertia->static_n_m >= inertia->coulomb_n_m &&
           isfinite(inertia->static_n_m) &&
           (inertia->static_n_m == inertia->coulomb_n_m ||
            sim_positive(inertia->stribeck_rad_s)) &&
           isfinite(inertia->load_n_m) && isfinite(inertia->gravity_n_m) &&
           sim_not_negative(inertia->spring_n_m_rad) &&
           sim_not_negative(inertia->spring_n_m_s) &&
           inertia->stop.restitution >= 0 && inertia->stop.restitution <= 1 &&
           (!inertia->stop.high || isfinite(inertia->stop.high_rad)) &&
           (!inertia->stop.low || isfinite(inertia->stop.low_rad));
}

static bool sim_coupling_is_legal(const struct sim_coupling *coupling)
{
    return sim_positive(coupling->stiffness_n_m_rad) &&
           sim_not_negative(coupling->damping_n_m_s) &&
           sim_not_negative(coupling->gap_rad) &&
           sim_positive(coupling->ratio) && coupling->loss >= 0 &&
           coupling->loss <= 19 && sim_not_negative(coupling->error_rad) &&
           isfinite(coupling->error_from_rad) &&
           (coupling->error_rad == 0 ||
            (sim_positive(coupling->error_period_rad) &&
             coupling->error_rad * 2 * TWO_PI * coupling->ratio <=
                 coupling->error_period_rad));
}

bool sim_drivetrain_is_legal(const struct sim_drivetrain_config *config)
{
    const struct sim_motor *const motor = &config->motor;

    if (config->inertias < 1 || config->inertias > SIM_DRIVETRAIN_INERTIAS)
        return false;
    for (int i = 0; i < config->inertias; i++) {
        if (!sim_inertia_is_legal(&config->inertia[i]))
            return false;
        if (i + 1 < config->inertias &&
            !sim_coupling_is_legal(&config->coupling[i]))
            return false;
    }
    return motor->torque_constant_n_m_a == 0 ||
           (sim_positive(motor->torque_constant_n_m_a) &&
            sim_positive(motor->resistance_ohm) &&
            sim_not_negative(motor->inductance_h) &&
            sim_not_negative(motor->current_limit_a) &&
            sim_not_negative(motor->voltage_limit_v));
}

double sim_drivetrain_fastest(const struct sim_drivetrain_config *config)
{
    const struct sim_motor *const motor = &config->motor;
    double fastest = 1;

    for (int i = 0; i < config->inertias; i++) {
        const struct sim_inertia *const inertia = &config->inertia[i];
        double stiffness = inertia->spring_n_m_rad + fabs(inertia->gravity_n_m);
        double damping = inertia->viscous_n_m_s + inertia->spring_n_m_s;

        if (inertia->static_n_m > inertia->coulomb_n_m)
            damping += (inertia->static_n_m - inertia->coulomb_n_m) /
                       inertia->stribeck_rad_s;
        for (int j = i - 1; j <= i; j++) {
            if (j < 0 || j + 1 >= config->inertias)
                continue;
            const struct sim_coupling *const coupling = &config->coupling[j];
            const double error =
                coupling->error_rad == 0
                    ? 0
                    : coupling->error_rad * TWO_PI / coupling->error_period_rad;
            const double turn = j == i ? 1 / coupling->ratio + error : 1;
            const double part = turn * (turn + 1) * (1 + coupling->loss);
            stiffness += coupling->stiffness_n_m_rad * part;
            damping += coupling->damping_n_m_s * part;
        }
        if (i == 0) {
            stiffness += config->loop.kp_n_m_rad;
            damping += config->loop.kd_n_m_s;
        }
        if (i == 0 && motor->inductance_h > 0)
            stiffness += motor->torque_constant_n_m_a *
                         motor->torque_constant_n_m_a / motor->inductance_h;
        else if (i == 0 && motor->torque_constant_n_m_a > 0)
            damping += motor->torque_constant_n_m_a *
                       motor->torque_constant_n_m_a / motor->resistance_ohm;
        fastest = fmax(fastest, sqrt(stiffness / inertia->inertia_kg_m2) +
                                    damping / inertia->inertia_kg_m2);
    }
    if (motor->inductance_h > 0)
        fastest = fmax(fastest, motor->resistance_ohm / motor->inductance_h);
    return fastest;
}
