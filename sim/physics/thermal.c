/* sim/physics/thermal.c - see thermal.h. */
#include "sim/physics/thermal.h"

#include <math.h>

#include "motion/core/err.h"
#include "motion/double/double_math.h"

int sim_thermal_init(struct sim_thermal *thermal,
                     const struct sim_thermal_config *config, double load)
{
    if (!(isfinite(config->rated_current_a) && config->rated_current_a > 0 &&
          isfinite(config->time_constant_s) && config->time_constant_s > 0 &&
          isfinite(config->trip_load) && config->trip_load > 0 &&
          isfinite(load) && load >= 0))
        return MOTION_E_ARG;
    *thermal = (struct sim_thermal){ .config = *config, .load = load };
    return MOTION_OK;
}

static double sim_thermal_heat(const struct sim_thermal *thermal,
                               const struct sim_signal *current_a, double t_s)
{
    const double part =
        sim_signal_at(current_a, t_s) / thermal->config.rated_current_a;

    return part * part;
}

void sim_thermal_step(struct sim_thermal *thermal, double begin_s,
                      double step_s, const struct sim_signal *current_a)
{
    if (step_s != thermal->step_s) {
        thermal->step_s = step_s;
        thermal->half =
            double_exp(-0.5 * step_s / thermal->config.time_constant_s);
    }
    const double half = thermal->half;
    const double before = thermal->load;
    const double start = sim_thermal_heat(thermal, current_a, 0);
    const double middle = sim_thermal_heat(thermal, current_a, 0.5 * step_s);
    const double end = sim_thermal_heat(thermal, current_a, step_s);

    /* The heat as its middle value, which is integrated exactly, and what it
     * is more or less than that, by Simpson's rule. */
    thermal->load = before * half * half + middle * (1 - half * half) +
                    step_s / (6 * thermal->config.time_constant_s) *
                        ((start - middle) * half * half + (end - middle));
    if (!thermal->tripped && thermal->load >= thermal->config.trip_load) {
        const double rise = thermal->load - before;
        thermal->tripped = true;
        thermal->trip_s =
            begin_s +
            (rise > 0 && before < thermal->config.trip_load
                 ? step_s * (thermal->config.trip_load - before) / rise
                 : 0);
    }
}
