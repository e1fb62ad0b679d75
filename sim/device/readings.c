/* sim/device/readings.c - see readings.h. */
#include "sim/device/readings.h"

#define RATED_DEGC 70.0

double sim_readings_warmth_degc(const struct sim_readings *readings,
                                const struct sim_plant *plant)
{
    const bool gets_warm =
        plant->winding.given && plant->winding.config.rated_counts_s2 > 0;

    return readings->more_degc +
           (gets_warm ? RATED_DEGC * plant->winding.thermal.load : 0);
}
