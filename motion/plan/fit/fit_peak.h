/* motion/plan/fit/fit_peak.h - how far values are over their limits, and how much
 * slower that says to go.
 *
 * Time stretched by s divides velocity by s, acceleration by s^2 and jerk by
 * s^3, so the smallest stretch that fits is
 *     max(1, ratio_v, sqrt(ratio_a), cbrt(ratio_j)),  ratio = peak / limit. */
#ifndef MOTION_PLAN_FIT_FIT_PEAK_H
#define MOTION_PLAN_FIT_FIT_PEAK_H

/* Velocity, acceleration, jerk: order - 1. */
#define PLAN_FIT_ORDERS 3

/* Smallest stretch, at least 1, and the order, 1 .. 3, that decides it; 0 when
 * all fit.  A ratio is peak / limit, 0 where there is no limit. */
double plan_fit_stretch(const double ratio[PLAN_FIT_ORDERS],
                        unsigned *decided_by);

/* The quintic with these values at its ends; any unit, seconds. */
struct plan_fit_quintic {
    double dur_s; /* > 0 */
    double displacement;
    double vel[2], acc[2]; /* at the start, at the end */
};

/* Largest |v|, |a|, |jerk|, from the roots of the derivatives: those of the
 * core's segments (motion_segment_extremes), in a unit of length and one of
 * time, powers of two, in which the formats of the core keep the figures to
 * better than 1e-11.  MOTION_E_RANGE where a value is no finite number or the
 * duration is not above 0. */
int plan_fit_quintic_peaks(const struct plan_fit_quintic *quintic,
                           double peak[PLAN_FIT_ORDERS]);

#endif
