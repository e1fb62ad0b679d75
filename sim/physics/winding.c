/* sim/physics/winding.c - see winding.h. */
#include "sim/physics/winding.h"

#include <math.h>

#include "motion/core/err.h"

#define WINDING_COOL 0.9 /* of warm_load */

static bool winding_is_legal(const struct sim_winding_config *config)
{
    const bool volts = config->stall_counts_s2 != 0;
    const bool heats = config->rated_counts_s2 != 0;

    if (volts &&
        !(isfinite(config->stall_counts_s2) &&
          isfinite(config->no_load_counts_s) && config->stall_counts_s2 > 0 &&
          config->no_load_counts_s > 0 &&
          config->stall_counts_s2 <=
              SIM_WINDING_RATE_MAX * config->no_load_counts_s))
        return false;
    if (heats &&
        !(config->time_constant_s >= 0.1 && config->time_constant_s <= 1e5 &&
          config->warm_load >= 0.1 && config->warm_load <= 1))
        return false;
    return volts || heats;
}

int sim_winding_init(struct sim_winding *winding,
                     const struct sim_winding_config *config)
{
    const struct sim_thermal_config thermal = {
        .rated_current_a = config->rated_counts_s2,
        .time_constant_s = config->time_constant_s,
        .trip_load = 1,
    };

    if (!winding_is_legal(config))
        return MOTION_E_ARG;
    *winding = (struct sim_winding){ .given = true, .config = *config };
    return config->rated_counts_s2 == 0
               ? MOTION_OK
               : sim_thermal_init(&winding->thermal, &thermal, 0);
}

double sim_winding_torque(const struct sim_winding *winding,
                          double torque_counts_s2, double speed_counts_s)
{
    const double stall = winding->config.stall_counts_s2;

    if (stall == 0)
        return torque_counts_s2;
    const double back =
        stall * speed_counts_s / winding->config.no_load_counts_s;
    return fmax(-stall - back, fmin(stall - back, torque_counts_s2));
}

void sim_winding_heat(struct sim_winding *winding, double torque_counts_s2,
                      double step_s)
{
    const struct sim_signal torque = { { torque_counts_s2 } };
    const double warm = winding->config.warm_load;

    if (winding->config.rated_counts_s2 == 0)
        return;
    sim_thermal_step(&winding->thermal, 0, step_s, &torque);
    if (winding->thermal.load < WINDING_COOL * warm)
        winding->warm = winding->hot = false;
    winding->warm |= winding->thermal.load >= warm;
    winding->hot |= winding->thermal.load >= 1;
}
