/* sim/physics/signal.h - an input over one step of a plant: a polynomial of the
 * time since the step began, like the segments of a track.  A held value is
 * { { value } }. */
#ifndef SIM_PHYSICS_SIGNAL_H
#define SIM_PHYSICS_SIGNAL_H

#define SIM_SIGNAL_COEFFICIENTS 6

struct sim_signal {
    double c[SIM_SIGNAL_COEFFICIENTS]; /* in the unit of the input, 1/s^i */
};

static inline double sim_signal_at(const struct sim_signal *signal, double t_s)
{
    double sum = 0;

    for (int i = SIM_SIGNAL_COEFFICIENTS - 1; i >= 0; i--)
        sum = sum * t_s + signal->c[i];
    return sum;
}

static inline struct sim_signal
sim_signal_slope(const struct sim_signal *signal)
{
    struct sim_signal slope = { { 0 } };

    for (int i = 1; i < SIM_SIGNAL_COEFFICIENTS; i++)
        slope.c[i - 1] = i * signal->c[i];
    return slope;
}

#endif
