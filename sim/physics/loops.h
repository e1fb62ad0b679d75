/* sim/physics/loops.h - the cascade of a servo: position, velocity and current
 * loop, each at a rate of its own.
 *
 *   position   v_ref = v_target + 2 pi f_p (x_target - x)
 *   velocity   a_ref = 2 pi f_v (e + integral of e / T_i) + push, e = v_ref - v
 *   current    a' = 2 pi f_c (a_ref - a), sampled
 *
 * f_p, f_v and f_c are where each open loop has the gain 1, for motor and load
 * as one inertia; a torque is the acceleration of both, as in mechanics.h.  The
 * integral is held while a_ref is at the current limit or beyond what the voltage
 * makes.  The current loop is a
 * PI controller whose zero cancels the winding's R/L, and so of first order;
 * between its samples the torque is held.
 * Source: Leonhard, Control of Electrical Drives, 3rd ed. (2001), 7.1, 15.3;
 * Franklin, Powell, Workman, Digital Control of Dynamic Systems, 3rd ed. (1998),
 * 6.3 (the pole 1 - e^(-2 pi f T) of the sampled loop). */
#ifndef SIM_PHYSICS_LOOPS_H
#define SIM_PHYSICS_LOOPS_H

#include <stdbool.h>
#include <stdint.h>

struct sim_loops_config {
    double position_hz; /* 0.1 .. 200 */
    double velocity_hz; /* 1 .. 1000, at least position_hz */
    double current_hz;  /* 10 .. 5000, at least velocity_hz */
    double reset_s;     /* T_i of the velocity loop, 1 ms .. 10 s; 0: none */
    /* Sampling periods, each a multiple of the next: position 50 us .. 20 ms,
     * velocity, current 20 us or more; none longer than 0.1 / its frequency
     * (position, velocity). */
    int64_t position_ns, velocity_ns, current_ns;
};

struct sim_loops {
    bool given;
    /* Set by the owner: the voltage does not make the torque of the last sample,
     * so that the integral is held. */
    bool held;
    struct sim_loops_config config;
    double v_ref, integral, a_ref, torque;          /* counts/s, counts/s2 */
    double current_gain;                            /* per sample */
    uint32_t velocity_every, position_every, count; /* samples of current */
    int64_t wait_ns;                                /* to the next of them */
};

/* What they see at a sample of the current loop. */
struct sim_loops_input {
    double target, target_vel; /* counts, counts/s */
    double position, speed;
    double push, most; /* feed-forward, current limit: counts/s2 */
};

/* Without torque.  MOTION_E_ARG when a value is outside the ranges above. */
int sim_loops_init(struct sim_loops *loops,
                   const struct sim_loops_config *config);
/* As after a while without torque. */
void sim_loops_reset(struct sim_loops *loops);

/* One sample: the torque up to the next; *limited: at the current limit. */
double sim_loops_sample(struct sim_loops *loops,
                        const struct sim_loops_input *input, bool *limited);

#endif
