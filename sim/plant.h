/* sim/plant.h - motor and position loop: a second-order servo.
 *
 *   acc = omega^2 (target - pos) + 2 zeta omega (target_vel - vel), limited
 *
 * with |acc| <= acc_max (the current limit) and |vel| <= vel_max.  Integrated
 * with a fixed step in integers so that two machines see the same.  target_vel
 * is the slope of the interpolated set point, so a steady ramp is followed with
 * no lag.  Units are counts. */
#ifndef SIM_PLANT_H
#define SIM_PLANT_H

#include <stdint.h>

struct sim_plant_config {
    uint32_t omega_mrad_s;  /* bandwidth of the loop, 1/1000 rad/s */
    uint16_t zeta_permille; /* damping */
    int64_t vel_max_counts_s;
    int64_t acc_max_counts_s2;
};

struct sim_plant {
    struct sim_plant_config config;
    int64_t pos_q24; /* counts, 24 fraction bits */
    int64_t vel_q24; /* counts/s */
    int64_t acc_q8;  /* counts/s2, as applied */
    int saturated;   /* 1 when the last step met a limit */
};

void sim_plant_init(struct sim_plant *plant,
                    const struct sim_plant_config *config, int32_t pos_counts);
/* One step of dt_ns (1 us .. 1 ms) towards target. */
void sim_plant_step(struct sim_plant *plant, int64_t target_q24,
                    int64_t target_vel_q24, int64_t dt_ns);

#endif
