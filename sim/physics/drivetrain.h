/* sim/physics/drivetrain.h - a motor and what it drives: inertias in a row with
 * compliant couplings between them, gears, backlash, friction, end stops,
 * gravity, and the motor's electrical side.
 *
 * Coupling i turns inertia i down by its ratio N:
 *   twist = angle[i]/N - angle[i+1]
 *   torque = k (|twist| - gap/2) + c twist'   beyond the gap, never pulling
 * +torque acts on the load side, -torque/N on the motor side.  A transmission
 * with the efficiency eta takes |torque|/N (1/eta - 1) as Coulomb friction on
 * its motor side, so that it needs torque / (N eta) to drive the load and is
 * driven by it with the efficiency 2 - 1/eta, as a screw is (Shigley, Mechanical
 * Engineering Design, 8-2); an error of its pitch e(angle[i]) is added to
 * angle[i]/N, and 1/N + e' turns speeds and torques.  Friction is
 * Coulomb, viscous and Stribeck,
 *   F(v) = coulomb + (static - coulomb) exp(-(v/stribeck)^2)    + viscous |v|
 * and at rest an inertia stands while the applied torque is within the static
 * one (Armstrong-Helouvry, Dupont & Canudas de Wit, Automatica 30 (1994), 3.1).
 * A stop reverses the speed with its restitution, and carries the torque once a
 * rebound would be shorter than SIM_DRIVETRAIN_REBOUND_S.
 * The motor: L i' = V - R i - K speed, torque K i, or with inductance 0 an ideal
 * current loop behind a voltage limit.
 *
 * A belt or a screw is a coupling with its transmission as ratio; what
 * moves on a line is the same with kg, N, m in the place of kg m2, N m, rad.
 * Steps are those of hybrid.h: every start, stop and contact at its own time. */
#ifndef SIM_PHYSICS_DRIVETRAIN_H
#define SIM_PHYSICS_DRIVETRAIN_H

#include <stdbool.h>
#include <stdint.h>

#include "sim/physics/hybrid.h"
#include "sim/physics/signal.h"

#define SIM_DRIVETRAIN_INERTIAS 4
/* angles, speeds, motor current, integral of the loop */
#define SIM_DRIVETRAIN_STATE     (2 * SIM_DRIVETRAIN_INERTIAS + 2)
#define SIM_DRIVETRAIN_REBOUND_S 1e-5

struct sim_stop {
    bool high, low; /* which there are */
    double high_rad, low_rad;
    double restitution; /* 0 .. 1 */
};

struct sim_inertia {
    double inertia_kg_m2; /* > 0 */
    double viscous_n_m_s; /* the others >= 0; 0 means none */
    double coulomb_n_m, static_n_m, stribeck_rad_s; /* static >= coulomb */
    double load_n_m;    /* constant, against positive motion; any sign */
    double gravity_n_m; /* m g l of an arm: torque -gravity cos(angle) */
    double spring_n_m_rad, spring_n_m_s; /* to the support of the input */
    struct sim_stop stop;
};

struct sim_coupling {
    double stiffness_n_m_rad, damping_n_m_s; /* > 0, >= 0; at the load side */
    double gap_rad;                          /* backlash, whole; 0: none */
    double ratio;                            /* > 0; 1 without a gear */
    /* Of a screw or a belt, 0: none.  Coulomb friction of the inertia before it
     * by the force that it carries: 1 / efficiency - 1, 0 .. 19. */
    double loss;
    /* Amplitude of the error of its pitch, a sine of angle[i] that is 0 and
     * rises at error_from_rad; of error_period_rad (> 0 then), at most 1 / 2 in
     * slope beside 1 / ratio. */
    double error_rad, error_period_rad, error_from_rad;
};

struct sim_motor {
    double torque_constant_n_m_a; /* also V s/rad; 0: there is no motor */
    double resistance_ohm;        /* > 0 */
    double inductance_h;          /* 0: ideal current loop */
    double current_limit_a;       /* of the ideal loop; 0: none */
    double voltage_limit_v;       /* of the ideal loop; 0: none */
};

/* An analogue position loop of the load, part of the plant:
 * torque = kp (ref - angle) + ki integral - kd speed[0]. */
struct sim_loop {
    double kp_n_m_rad, ki_n_m_rad_s, kd_n_m_s, ref_rad;
};

struct sim_drivetrain_config {
    int inertias; /* 1 .. SIM_DRIVETRAIN_INERTIAS */
    struct sim_inertia inertia[SIM_DRIVETRAIN_INERTIAS];
    struct sim_coupling coupling[SIM_DRIVETRAIN_INERTIAS - 1];
    struct sim_motor motor;
    struct sim_loop loop;
};

struct sim_drivetrain_input {
    struct sim_signal torque_n_m; /* on inertia 0 */
    struct sim_signal support_rad;
    struct sim_signal voltage_v; /* with inductance */
    struct sim_signal current_a; /* of the ideal current loop */
};

enum sim_drivetrain_kind {
    SIM_DRIVETRAIN_SLIP,    /* starts to move */
    SIM_DRIVETRAIN_STICK,   /* speed 0, and it stays */
    SIM_DRIVETRAIN_CONTACT, /* the flanks of coupling `where` meet */
    SIM_DRIVETRAIN_STOP,    /* inertia `where` hits its stop */
    SIM_DRIVETRAIN_REST,    /* and rests there */
    SIM_DRIVETRAIN_VOLTAGE, /* the voltage limit is reached */
};

struct sim_drivetrain_event {
    double t_s;
    enum sim_drivetrain_kind kind;
    int where;
    double angle_rad, speed_rad_s; /* of inertia `where`, after it */
};

struct sim_drivetrain {
    struct sim_drivetrain_config config;
    /* State; may be set between steps, then sim_drivetrain_reset. */
    double y[SIM_DRIVETRAIN_STATE];
    /* Where events are written, if anywhere; count goes on when it is full. */
    struct sim_drivetrain_event *events;
    unsigned events_max, events_count;
    /* private */
    int8_t pressed[SIM_DRIVETRAIN_INERTIAS]; /* +1, -1: which flank; 0 */
    int8_t slip[SIM_DRIVETRAIN_INERTIAS];    /* sign of the speed; 0: stands */
    int8_t held[SIM_DRIVETRAIN_INERTIAS];    /* +1, -1: at which stop; 0 */
    int8_t limited;                          /* sign of the voltage limit */
    double begin_s;
    const struct sim_drivetrain_input *input;
    struct sim_hybrid hybrid;
    double work[SIM_HYBRID_WORK(SIM_DRIVETRAIN_STATE)];
};

/* At rest at angle 0, with pointers into itself: do not copy.  MOTION_E_ARG
 * when a value is outside the ranges above or not finite. */
int sim_drivetrain_init(struct sim_drivetrain *drive,
                        const struct sim_drivetrain_config *config);

/* After y was set: which flanks press and what stands follows from it. */
void sim_drivetrain_reset(struct sim_drivetrain *drive);

/* One step of step_s (> 0) that begins at begin_s, which only the events' times
 * are counted from.  MOTION_E_RANGE: see sim_hybrid_step. */
int sim_drivetrain_step(struct sim_drivetrain *drive, double begin_s,
                        double step_s,
                        const struct sim_drivetrain_input *input);

static inline double
sim_drivetrain_speed_rad_s(const struct sim_drivetrain *drive, int i)
{
    return drive->y[drive->config.inertias + i];
}

/* Of coupling i. */
double sim_drivetrain_twist_rad(const struct sim_drivetrain *drive, int i);

#endif
