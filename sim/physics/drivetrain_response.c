/* sim/physics/drivetrain_response.c - the linear drive at one frequency; see
 * drivetrain.h.
 *
 * From the load towards the motor: an inertia's impedance is J s + b plus what
 * hangs on it; through a coupling of c + k/s the two conduct in series, through
 * a gear of ratio N the motor side feels 1/N^2. */
#include <math.h>

#include "motion/double/double_math.h"
#include "sim/physics/drivetrain.h"

struct sim_complex {
    double re, im;
};

static struct sim_complex sim_complex_times(struct sim_complex a,
                                            struct sim_complex b)
{
    return (struct sim_complex){ a.re * b.re - a.im * b.im,
                                 a.re * b.im + a.im * b.re };
}

static struct sim_complex sim_complex_over(struct sim_complex a,
                                           struct sim_complex b)
{
    const double square = b.re * b.re + b.im * b.im;

    return (struct sim_complex){ (a.re * b.re + a.im * b.im) / square,
                                 (a.im * b.re - a.re * b.im) / square };
}

struct sim_drivetrain_response
sim_drivetrain_respond(const struct sim_drivetrain_config *config,
                       double freq_hz)
{
    const double omega = 6.283185307179586 * freq_hz;
    const int n = config->inertias;
    /* torque / speed seen at inertia i, and speed[last] / speed[i] */
    struct sim_complex impedance = { 0, 0 }, load = { 1, 0 };

    for (int i = n - 1; i >= 0; i--) {
        const struct sim_inertia *const inertia = &config->inertia[i];

        if (i < n - 1) {
            const struct sim_coupling *const coupling = &config->coupling[i];
            const struct sim_complex spring = {
                coupling->damping_n_m_s, -coupling->stiffness_n_m_rad / omega
            };
            const struct sim_complex sum = { spring.re + impedance.re,
                                             spring.im + impedance.im };
            /* speed[i+1] = speed[i]/N spring / (spring + impedance) */
            const struct sim_complex pass = sim_complex_over(spring, sum);
            const double turn = 1 / coupling->ratio;

            impedance = sim_complex_times(impedance, pass);
            impedance.re *= turn * turn;
            impedance.im *= turn * turn;
            load = sim_complex_times(load, pass);
            load.re *= turn;
            load.im *= turn;
        }
        impedance.re += inertia->viscous_n_m_s;
        impedance.im += omega * inertia->inertia_kg_m2;
    }
    const struct sim_complex motor =
        sim_complex_over((struct sim_complex){ 1, 0 }, impedance);
    const struct sim_complex last = sim_complex_times(load, motor);

    return (struct sim_drivetrain_response){ motor.re, motor.im,
                                             double_hypot(last.re, last.im) };
}
