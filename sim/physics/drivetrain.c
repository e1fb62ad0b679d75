/* sim/physics/drivetrain.c - see drivetrain.h. */
#include "sim/physics/drivetrain.h"

#include <math.h>
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/double/double_math.h"
#include "sim/physics/drivetrain_config.h"

/* Guards, each for every inertia or coupling. */
enum { PRESS_HIGH, PRESS_LOW, FRICTION, STOP_HIGH, STOP_LOW, VOLTAGE, GUARDS };
_Static_assert(GUARDS *SIM_DRIVETRAIN_INERTIAS <= SIM_HYBRID_GUARDS, "guards");

#define SUBSTEP_MAX_S 0.25e-3
#define SUBSTEP_RATE  0.25 /* substep x largest rate, see gauss.h */
#define TWO_PI        6.283185307179586

static void sim_drivetrain_log(struct sim_drivetrain *drive, double t_s,
                               const double *y, enum sim_drivetrain_kind kind,
                               int where)
{
    if (drive->events_count < drive->events_max)
        drive->events[drive->events_count] = (struct sim_drivetrain_event){
            .t_s = drive->begin_s + t_s,
            .kind = kind,
            .where = where,
            .angle_rad = y[where],
            .speed_rad_s = y[drive->config.inertias + where],
        };
    drive->events_count++;
}

static double sim_inertia_friction(const struct sim_inertia *inertia,
                                   double speed)
{
    const double part = speed / inertia->stribeck_rad_s;

    if (inertia->static_n_m <= inertia->coulomb_n_m)
        return inertia->coulomb_n_m;
    return inertia->coulomb_n_m + (inertia->static_n_m - inertia->coulomb_n_m) *
                                      double_exp(-part * part);
}

/* Of the angle of inertia i's error, in turns of its period. */
static double sim_drivetrain_phase(const struct sim_coupling *coupling,
                                   double angle)
{
    return TWO_PI / coupling->error_period_rad *
           (angle - coupling->error_from_rad);
}

static double sim_drivetrain_twist(const struct sim_drivetrain *drive,
                                   const double *y, int i)
{
    const struct sim_coupling *const coupling = &drive->config.coupling[i];
    const double twist = y[i] / coupling->ratio - y[i + 1];

    return coupling->error_rad == 0
               ? twist
               : twist + coupling->error_rad *
                             double_sin(sim_drivetrain_phase(coupling, y[i]));
}

/* What coupling i turns speeds down by, there. */
static double sim_drivetrain_turn(const struct sim_drivetrain *drive,
                                  const double *y, int i)
{
    const struct sim_coupling *const coupling = &drive->config.coupling[i];
    const double turn = 1 / coupling->ratio;

    return coupling->error_rad == 0
               ? turn
               : turn + coupling->error_rad * TWO_PI /
                            coupling->error_period_rad *
                            double_cos(sim_drivetrain_phase(coupling, y[i]));
}

static double sim_drivetrain_twist_speed(const struct sim_drivetrain *drive,
                                         const double *y, int i)
{
    const double *const speed = y + drive->config.inertias;

    return sim_drivetrain_turn(drive, y, i) * speed[i] - speed[i + 1];
}

/* What flank `sign` of coupling i would carry: negative when it is apart or
 * would have to pull. */
static double sim_drivetrain_press(const struct sim_drivetrain *drive,
                                   const double *y, int i, int sign,
                                   double *torque)
{
    const struct sim_coupling *const coupling = &drive->config.coupling[i];
    const double depth =
        sign * sim_drivetrain_twist(drive, y, i) - 0.5 * coupling->gap_rad;

    *torque = coupling->stiffness_n_m_rad * depth +
              coupling->damping_n_m_s * sign *
                  sim_drivetrain_twist_speed(drive, y, i);
    return fmin(depth, *torque);
}

static double sim_drivetrain_coupling(const struct sim_drivetrain *drive,
                                      const double *y, int i)
{
    const struct sim_coupling *const coupling = &drive->config.coupling[i];
    double torque = 0;

    if (coupling->gap_rad <= 0)
        return coupling->stiffness_n_m_rad * sim_drivetrain_twist(drive, y, i) +
               coupling->damping_n_m_s *
                   sim_drivetrain_twist_speed(drive, y, i);
    if (drive->pressed[i] == 0)
        return 0;
    sim_drivetrain_press(drive, y, i, drive->pressed[i], &torque);
    return drive->pressed[i] * torque;
}

/* Coulomb friction of inertia i that comes from what its coupling carries. */
static double sim_drivetrain_loss(const struct sim_drivetrain *drive,
                                  const double *y, int i)
{
    const struct sim_coupling *const coupling = &drive->config.coupling[i];

    if (i + 1 >= drive->config.inertias || coupling->loss == 0)
        return 0;
    return coupling->loss * fabs(sim_drivetrain_coupling(drive, y, i) *
                                 sim_drivetrain_turn(drive, y, i));
}

/* The most that holds inertia i at rest. */
static double sim_drivetrain_holds(const struct sim_drivetrain *drive,
                                   const double *y, int i)
{
    return drive->config.inertia[i].static_n_m +
           sim_drivetrain_loss(drive, y, i);
}

static bool sim_drivetrain_rubs(const struct sim_drivetrain *drive, int i)
{
    return drive->config.inertia[i].static_n_m > 0 ||
           (i + 1 < drive->config.inertias &&
            drive->config.coupling[i].loss > 0);
}

static double sim_drivetrain_limited(double value, double limit)
{
    return limit > 0 ? fmax(-limit, fmin(limit, value)) : value;
}

static double sim_drivetrain_current(const struct sim_drivetrain *drive,
                                     const struct sim_drivetrain_input *input,
                                     double t_s, const double *y)
{
    const struct sim_motor *const motor = &drive->config.motor;
    const int n = drive->config.inertias;

    if (motor->inductance_h > 0)
        return y[2 * (ptrdiff_t)n];
    if (drive->limited != 0)
        return (drive->limited * motor->voltage_limit_v -
                motor->torque_constant_n_m_a * y[n]) /
               motor->resistance_ohm;
    return sim_drivetrain_limited(sim_signal_at(&input->current_a, t_s),
                                  motor->current_limit_a);
}

static double sim_drivetrain_loop(const struct sim_drivetrain *drive,
                                  const double *y)
{
    const struct sim_loop *const loop = &drive->config.loop;
    const int n = drive->config.inertias;

    return loop->kp_n_m_rad * (loop->ref_rad - y[n - 1]) +
           loop->ki_n_m_rad_s * y[2 * n + 1] - loop->kd_n_m_s * y[n];
}

/* On every inertia, but for dry friction and stops. */
static void sim_drivetrain_torques(const struct sim_drivetrain *drive,
                                   double t_s, const double *y, double *torque)
{
    const struct sim_drivetrain_config *const config = &drive->config;
    const struct sim_drivetrain_input *const input = drive->input;
    const int n = config->inertias;

    for (int i = 0; i < n; i++) {
        const struct sim_inertia *const inertia = &config->inertia[i];

        torque[i] = -inertia->viscous_n_m_s * y[n + i] - inertia->load_n_m;
        if (inertia->gravity_n_m != 0)
            torque[i] -= inertia->gravity_n_m * double_cos(y[i]);
        if (inertia->spring_n_m_rad != 0 || inertia->spring_n_m_s != 0) {
            const struct sim_signal slope =
                sim_signal_slope(&input->support_rad);
            torque[i] +=
                inertia->spring_n_m_rad *
                    (sim_signal_at(&input->support_rad, t_s) - y[i]) +
                inertia->spring_n_m_s * (sim_signal_at(&slope, t_s) - y[n + i]);
        }
    }
    torque[0] +=
        sim_signal_at(&input->torque_n_m, t_s) + sim_drivetrain_loop(drive, y);
    if (config->motor.torque_constant_n_m_a > 0)
        torque[0] += config->motor.torque_constant_n_m_a *
                     sim_drivetrain_current(drive, input, t_s, y);
    for (int i = 0; i + 1 < n; i++) {
        const double carried = sim_drivetrain_coupling(drive, y, i);
        torque[i] -= carried * sim_drivetrain_turn(drive, y, i);
        torque[i + 1] += carried;
    }
}

static void sim_drivetrain_rate(void *plant, double t_s, const double *y,
                                double *rate)
{
    const struct sim_drivetrain *const drive = plant;
    const struct sim_drivetrain_config *const config = &drive->config;
    const struct sim_motor *const motor = &config->motor;
    const int n = config->inertias;

    sim_drivetrain_torques(drive, t_s, y, rate + n);
    for (int i = 0; i < n; i++) {
        const struct sim_inertia *const inertia = &config->inertia[i];
        const bool dry = sim_drivetrain_rubs(drive, i);

        rate[i] = y[n + i];
        if (drive->held[i] != 0 || (dry && drive->slip[i] == 0))
            rate[n + i] = 0;
        else if (dry)
            rate[n + i] -=
                drive->slip[i] * (sim_inertia_friction(inertia, y[n + i]) +
                                  sim_drivetrain_loss(drive, y, i));
        rate[n + i] /= inertia->inertia_kg_m2;
    }
    rate[2 * (ptrdiff_t)n] = 0;
    if (motor->inductance_h > 0)
        rate[2 * (ptrdiff_t)n] = (sim_signal_at(&drive->input->voltage_v, t_s) -
                                  motor->resistance_ohm * y[2 * (ptrdiff_t)n] -
                                  motor->torque_constant_n_m_a * y[n]) /
                                 motor->inductance_h;
    rate[2 * n + 1] = config->loop.ref_rad - y[n - 1];
}

static double sim_drivetrain_guard_stop(const struct sim_drivetrain *drive,
                                        const double *y, double applied, int i,
                                        int side)
{
    const struct sim_inertia *const inertia = &drive->config.inertia[i];

    if (drive->held[i] != 0)
        return drive->held[i] == side
                   ? side * applied + sim_drivetrain_holds(drive, y, i)
                   : 1;
    if (side > 0)
        return inertia->stop.high ? inertia->stop.high_rad - y[i] : 1;
    return inertia->stop.low ? y[i] - inertia->stop.low_rad : 1;
}

static double sim_drivetrain_guard_friction(const struct sim_drivetrain *drive,
                                            const double *y, double applied,
                                            int i)
{
    if (!sim_drivetrain_rubs(drive, i) || drive->held[i] != 0)
        return 1;
    return drive->slip[i] != 0
               ? drive->slip[i] * y[drive->config.inertias + i]
               : sim_drivetrain_holds(drive, y, i) - fabs(applied);
}

/* The ideal current loop: what is left of the voltage, or, at its limit, how
 * much less than the command flows. */
static double sim_drivetrain_guard_voltage(const struct sim_drivetrain *drive,
                                           double t_s, const double *y)
{
    const struct sim_motor *const motor = &drive->config.motor;
    const double command = sim_drivetrain_limited(
        sim_signal_at(&drive->input->current_a, t_s), motor->current_limit_a);
    const double needed =
        motor->resistance_ohm * command +
        motor->torque_constant_n_m_a * y[drive->config.inertias];

    if (motor->torque_constant_n_m_a <= 0 || motor->inductance_h > 0 ||
        motor->voltage_limit_v <= 0)
        return 1;
    return drive->limited != 0
               ? drive->limited * needed - motor->voltage_limit_v
               : motor->voltage_limit_v - fabs(needed);
}

static int sim_drivetrain_guards(void *plant, double t_s, const double *y,
                                 double *guard)
{
    const struct sim_drivetrain *const drive = plant;
    const int n = drive->config.inertias;
    double applied[SIM_DRIVETRAIN_INERTIAS] = { 0 }, torque;

    sim_drivetrain_torques(drive, t_s, y, applied);
    for (int i = 0; i < n; i++) {
        double *const of = guard + (ptrdiff_t)GUARDS * i;

        of[PRESS_HIGH] = of[PRESS_LOW] = of[VOLTAGE] = 1;
        if (i + 1 < n && drive->config.coupling[i].gap_rad > 0) {
            const double high = sim_drivetrain_press(drive, y, i, 1, &torque);
            const double low = sim_drivetrain_press(drive, y, i, -1, &torque);
            of[PRESS_HIGH] = drive->pressed[i] > 0 ? high : -high;
            of[PRESS_LOW] = drive->pressed[i] < 0 ? low : -low;
        }
        of[FRICTION] = sim_drivetrain_guard_friction(drive, y, applied[i], i);
        of[STOP_HIGH] = sim_drivetrain_guard_stop(drive, y, applied[i], i, 1);
        of[STOP_LOW] = sim_drivetrain_guard_stop(drive, y, applied[i], i, -1);
    }
    guard[VOLTAGE] = sim_drivetrain_guard_voltage(drive, t_s, y);
    return GUARDS * n;
}

static int8_t sim_drivetrain_sign(double value)
{
    return (int8_t)((value > 0) - (value < 0));
}

static void sim_drivetrain_at_stop(struct sim_drivetrain *drive, double t_s,
                                   double *y, double applied, int i, int side)
{
    const struct sim_inertia *const inertia = &drive->config.inertia[i];
    double *const speed = &y[drive->config.inertias + i];
    const double into = side * applied / inertia->inertia_kg_m2;

    if (drive->held[i] != 0) { /* pulled off */
        drive->held[i] = 0;
        drive->slip[i] = (int8_t)-side;
        sim_drivetrain_log(drive, t_s, y, SIM_DRIVETRAIN_SLIP, i);
        return;
    }
    y[i] = side > 0 ? inertia->stop.high_rad : inertia->stop.low_rad;
    /* Reached backwards, by rounding: it is on its way off. */
    if (side * *speed < 0)
        return;
    *speed *= -inertia->stop.restitution;
    sim_drivetrain_log(drive, t_s, y, SIM_DRIVETRAIN_STOP, i);
    if (2 * fabs(*speed) <= into * SIM_DRIVETRAIN_REBOUND_S) {
        *speed = 0;
        drive->held[i] = (int8_t)side;
        sim_drivetrain_log(drive, t_s, y, SIM_DRIVETRAIN_REST, i);
    }
    drive->slip[i] = sim_drivetrain_sign(*speed);
}

static void sim_drivetrain_at_friction(struct sim_drivetrain *drive, double t_s,
                                       double *y, double applied, int i)
{
    double *const speed = &y[drive->config.inertias + i];

    if (drive->slip[i] == 0) {
        drive->slip[i] = sim_drivetrain_sign(applied);
        sim_drivetrain_log(drive, t_s, y, SIM_DRIVETRAIN_SLIP, i);
        return;
    }
    *speed = 0;
    if (fabs(applied) > sim_drivetrain_holds(drive, y, i)) {
        drive->slip[i] = sim_drivetrain_sign(applied);
        return;
    }
    drive->slip[i] = 0;
    sim_drivetrain_log(drive, t_s, y, SIM_DRIVETRAIN_STICK, i);
}

static void sim_drivetrain_at_flank(struct sim_drivetrain *drive, double t_s,
                                    const double *y, int i, int side)
{
    if (drive->pressed[i] == side) {
        drive->pressed[i] = 0;
        return;
    }
    drive->pressed[i] = (int8_t)side;
    sim_drivetrain_log(drive, t_s, y, SIM_DRIVETRAIN_CONTACT, i);
}

static void sim_drivetrain_at_voltage(struct sim_drivetrain *drive, double t_s,
                                      const double *y)
{
    const struct sim_motor *const motor = &drive->config.motor;

    if (drive->limited != 0) {
        drive->limited = 0;
        return;
    }
    drive->limited = sim_drivetrain_sign(
        motor->resistance_ohm *
            sim_drivetrain_current(drive, drive->input, t_s, y) +
        motor->torque_constant_n_m_a * y[drive->config.inertias]);
    sim_drivetrain_log(drive, t_s, y, SIM_DRIVETRAIN_VOLTAGE, 0);
}

static void sim_drivetrain_event(void *plant, double t_s, double *y, int which)
{
    struct sim_drivetrain *const drive = plant;
    const int i = which / GUARDS;
    double applied[SIM_DRIVETRAIN_INERTIAS] = { 0 };

    sim_drivetrain_torques(drive, t_s, y, applied);
    switch (which % GUARDS) {
    case PRESS_HIGH:
        sim_drivetrain_at_flank(drive, t_s, y, i, 1);
        break;
    case PRESS_LOW:
        sim_drivetrain_at_flank(drive, t_s, y, i, -1);
        break;
    case FRICTION:
        sim_drivetrain_at_friction(drive, t_s, y, applied[i], i);
        break;
    case STOP_HIGH:
        sim_drivetrain_at_stop(drive, t_s, y, applied[i], i, 1);
        break;
    case STOP_LOW:
        sim_drivetrain_at_stop(drive, t_s, y, applied[i], i, -1);
        break;
    default:
        sim_drivetrain_at_voltage(drive, t_s, y);
    }
}

static const struct sim_hybrid_ops sim_drivetrain_ops = {
    .rate = sim_drivetrain_rate,
    .guards = sim_drivetrain_guards,
    .event = sim_drivetrain_event,
};

int sim_drivetrain_init(struct sim_drivetrain *drive,
                        const struct sim_drivetrain_config *config)
{
    if (!sim_drivetrain_is_legal(config))
        return MOTION_E_ARG;
    *drive = (struct sim_drivetrain){ .config = *config };
    sim_hybrid_init(
        &drive->hybrid, &sim_drivetrain_ops, drive, 2 * config->inertias + 2,
        drive->work,
        fmin(SUBSTEP_MAX_S, SUBSTEP_RATE / sim_drivetrain_fastest(config)));
    return MOTION_OK;
}

void sim_drivetrain_reset(struct sim_drivetrain *drive)
{
    for (int i = 0; i < drive->config.inertias; i++) {
        drive->slip[i] =
            sim_drivetrain_sign(drive->y[drive->config.inertias + i]);
        drive->held[i] = drive->pressed[i] = 0;
    }
    drive->limited = 0;
}

int sim_drivetrain_step(struct sim_drivetrain *drive, double begin_s,
                        double step_s, const struct sim_drivetrain_input *input)
{
    if (!(isfinite(step_s) && step_s > 0))
        return MOTION_E_ARG;
    drive->begin_s = begin_s;
    drive->input = input;
    sim_gauss_restart(&drive->hybrid.gauss);
    return sim_hybrid_step(&drive->hybrid, step_s, drive->y);
}

double sim_drivetrain_twist_rad(const struct sim_drivetrain *drive, int i)
{
    return sim_drivetrain_twist(drive, drive->y, i);
}
