/* sim/physics/plant.h - motor and position loop: a second-order servo.
 *
 *   acc = omega^2 (target - pos) + 2 zeta omega (target_vel - vel) + push
 *
 * with |acc| <= acc_max (the current limit) and |vel| <= vel_max.  target_vel
 * is the slope of the interpolated set point, so a steady ramp is followed with
 * no lag; push is feed-forward.  Units are counts, and positions do not wrap.
 *
 * Integrated in integers (velocity first, then position with the new velocity),
 * so that two machines see the same, in inner steps h with omega h <= 1/8; a
 * longer step is cut up.  The loop in z is
 *   z^2 - (2 - a - b) z + (1 - b),   a = (omega h)^2, b = 2 zeta omega h,
 * stable for a + 2 b < 4 (Jury); with omega h <= 1/8 and zeta <= 2 that is
 * a + 2 b <= 1.02.  Its poles have |z|^2 = 1 - b < e^-b: it is damped a little
 * more than the continuous loop (by the factor 1 + zeta omega h), never less,
 * so it overshoots no more than exp(-pi zeta / sqrt(1 - zeta^2)).  It comes to
 * rest within half a step of acc_q8, 2^-9 / omega^2 counts, of the target. */
#ifndef SIM_PHYSICS_PLANT_H
#define SIM_PHYSICS_PLANT_H

#include <stdbool.h>
#include <stdint.h>

#include "sim/physics/loops.h"
#include "sim/physics/winding.h"

#define SIM_PLANT_STEP_MAX_NS 1000000

struct sim_plant_config {
    uint32_t omega_mrad_s;     /* bandwidth of the loop, 1/1000 rad/s:
                                  1000 .. 4000000 */
    uint16_t zeta_permille;    /* damping, 100 .. 2000 */
    int64_t vel_max_counts_s;  /* 1 .. 2^31 */
    int64_t acc_max_counts_s2; /* 1 .. 2^40 */
    /* Slowing down by friction and brake without torque; 0: acc_max / 4. */
    int64_t coast_counts_s2;
};

struct sim_mechanics;

struct sim_plant {
    struct sim_plant_config config;
    /* What the motor turns, set by the owner after init at the same place; NULL:
     * it is rigid and the loop is tuned for its inertia.  Else the loop has an integral
     * too, of omega^3 / 8, which carries a weight. */
    struct sim_mechanics *mechanics;
    int64_t pos_q24; /* counts, 24 fraction bits, +-2^38 counts */
    int64_t vel_q24; /* counts/s */
    int64_t acc_q8;  /* counts/s2, as applied */
    bool saturated;  /* the last step met a limit */
    int64_t push_q8; /* counts/s2, set by the owner, |push| < 2^54; 0 */
    int64_t pull_q8; /* of an outside force: sim_plant_pull */
    /* Set by the owner too; none of it after init: friction beside that of the
     * loop's own model, counts/s2, 0 .. 2^48; a motor phase exchanged, so that
     * the loop drives the rotor away from its target; hard stops, at which it
     * stands while the motor presses on. */
    int64_t friction_q8;
    bool reversed;
    bool pressed;   /* something holds the rotor in this step */
    bool has_stops; /* the rotor goes no further than low .. high */
    int64_t low_q24, high_q24;
    int64_t met_q24; /* the highest speed at which it met one, counts/s */
    /* What the encoder makes of it, set by the owner; 0: exact.  The loop knows
     * the place from it; the speed is the motor's own. */
    int64_t encoder_step_q24;  /* its resolution, counts, 0 .. 2^48 */
    int64_t encoder_noise_q24; /* standard deviation, counts, 0 .. 2^48 */
    uint64_t encoder_seed;     /* not 0 */
    int64_t encoder_error_q24; /* at the last step: measured less true */
    /* sim_plant_set_winding, sim_plant_set_loops: neither after init. */
    struct sim_winding winding;
    struct sim_loops loops; /* in the place of omega and zeta */
    /* private: gains, and the length of the last step */
    int64_t spring_q16;  /* omega^2, 1/s2, < 2^40 */
    int64_t damping_q16; /* 2 zeta omega, 1/s, < 2^31 */
    int64_t inner_max_ns;
    int64_t step_ns, step_s_q60;
};

/* MOTION_E_ARG when a value is outside the ranges above. */
int sim_plant_init(struct sim_plant *plant,
                   const struct sim_plant_config *config, int64_t pos_counts);

/* Its motor has that winding, its servo these loops, from now on.  MOTION_E_ARG:
 * see winding.h and loops.h. */
int sim_plant_set_winding(struct sim_plant *plant,
                          const struct sim_winding_config *config);
int sim_plant_set_loops(struct sim_plant *plant,
                        const struct sim_loops_config *config);

/* One step of dt_ns (1 .. SIM_PLANT_STEP_MAX_NS).  target is where the set
 * point is at the end of the step, to which it came with target_vel. */
void sim_plant_step(struct sim_plant *plant, int64_t target_q24,
                    int64_t target_vel_q24, int64_t dt_ns);

/* The same without torque: slows down and stands. */
void sim_plant_coast(struct sim_plant *plant, int64_t dt_ns);

/* A force from outside works on it from now on, as the acceleration that it
 * makes, counts/s2, |pull| <= 2^46; on a load where there is one.  While it has
 * torque: its brake is stronger. */
void sim_plant_pull(struct sim_plant *plant, double counts_s2);

/* Something holds the rotor: it stands at once, whatever the torque.  _press: a
 * step of the loop against it, which is what heats a winding. */
void sim_plant_block(struct sim_plant *plant);
void sim_plant_press(struct sim_plant *plant, int64_t target_q24,
                     int64_t target_vel_q24, int64_t dt_ns);

/* Where the encoder says that it is. */
int64_t sim_plant_measured_q24(const struct sim_plant *plant);

/* How far one gets at vel_q24 (|vel| < 2^60) in dt_ns (as above), to nearest;
 * also a change of velocity from an acceleration. */
int64_t sim_plant_travel_q24(struct sim_plant *plant, int64_t vel_q24,
                             int64_t dt_ns);

#endif
