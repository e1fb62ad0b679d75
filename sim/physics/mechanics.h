/* sim/physics/mechanics.h - what the motor of a simulated axis turns: a load on
 * a coupling that gives, with backlash, friction, weight and end stops, and a
 * second behind it.
 *
 * Described as a servo's commissioning describes it, in the counts of its
 * encoder: inertias by their ratio, the coupling by the frequency and damping at
 * which the load swings while the motor is held (where the motor's frequency
 * response has its notch), forces as the acceleration that they give to motor
 * and loads together.  Computed by drivetrain.h, with 1 for all inertias in one,
 * so that a torque is an acceleration in counts/s2. */
#ifndef SIM_PHYSICS_MECHANICS_H
#define SIM_PHYSICS_MECHANICS_H

#include "sim/physics/drivetrain.h"

/* Another mass behind the load, on a coupling of its own: the same of it, its
 * frequency while the load is held.  inertia_ratio 0: there is none. */
struct sim_mechanics_second {
    double inertia_ratio, frequency_hz, damping, backlash_counts;
};

/* A screw or belt between motor and load: see drivetrain.h. */
struct sim_mechanics_transmission {
    double efficiency; /* 0.05 .. 1; 0: 1 */
    /* Amplitude of its error, a sine over the pitch that is 0 at the count 0 of
     * power-on; at most pitch / (4 pi). */
    double pitch_error_counts, pitch_counts;
};

struct sim_mechanics_config {
    double inertia_ratio;   /* load over motor, 0.01 .. 1000 */
    double frequency_hz;    /* 0.1 .. 500 */
    double damping;         /* of critical, 0 .. 1 */
    double backlash_counts; /* whole; the rest >= 0, or any sign for weight */
    double coulomb_counts_s2, static_counts_s2; /* of the load; static >= */
    double stribeck_counts_s;                   /* > 0 where static > coulomb */
    double viscous_1_s;
    double weight_counts_s2; /* against positive motion */
    bool has_stops;          /* of the load, no rebound */
    double stop_low_counts, stop_high_counts;
    struct sim_mechanics_second second;
    struct sim_mechanics_transmission transmission;
};

struct sim_mechanics {
    struct sim_drivetrain drive;
    double integral; /* of the loop: counts s */
    double weight;   /* without a pull */
    int64_t pos_q24; /* of the motor, after the last step */
    uint64_t failed; /* steps that could not be computed: it stood */
};

/* Where a load hangs that is at rest; it points into itself: do not copy.
 * MOTION_E_ARG when a value is outside the ranges above, or the load is beyond
 * its stops. */
int sim_mechanics_init(struct sim_mechanics *self,
                       const struct sim_mechanics_config *config,
                       int64_t motor_q24);

/* dt_s (> 0) with that torque on the motor, counts/s2; pos and vel are the
 * motor's, and those of before where nobody else has set them: a drive that
 * counts from 0 anew takes its load along. */
void sim_mechanics_step(struct sim_mechanics *self, double torque_counts_s2,
                        double dt_s, int64_t *pos_q24, int64_t *vel_q24);
/* The same where something else moves the motor, its brake: from there to there,
 * where it has that speed. */
void sim_mechanics_drag(struct sim_mechanics *self, double dt_s,
                        int64_t from_q24, int64_t pos_q24, int64_t vel_q24);

/* A force from outside works on the load from now on, along positive motion. */
void sim_mechanics_pull(struct sim_mechanics *self, double counts_s2);

/* How far the load, the second where there is one, swings beside where it would
 * hang at rest, were the motor held from now on: its amplitude, whatever the
 * phase; of two masses the most that it can be, of the energy in both. */
double sim_mechanics_swing_counts(const struct sim_mechanics *self);

/* Where the load is, the second where there is one. */
int64_t sim_mechanics_load_q24(const struct sim_mechanics *self);

#endif
