/* tests/bench/ruckig_side.h - Ruckig as otg_beside.c sees it, in C. */
#ifndef TESTS_BENCH_RUCKIG_SIDE_H
#define TESTS_BENCH_RUCKIG_SIDE_H

#define RUCKIG_AXES_MOST 7

#ifdef __cplusplus
extern "C" {
#endif

/* One axis, in any consistent unit. */
struct ruckig_axis {
    double p0, v0, a0, pf, vf, af, vmax, vmin, amax, amin, jmax;
};

/* For 1, 3 or 7 axes: takes the problem, and keeps what it plans. */
void ruckig_set(int axes, const struct ruckig_axis axis[]);

/* Plans what was set, all axes to arrive together; nothing else, so that it
 * can be timed.  Below zero: no answer. */
int ruckig_plan(int axes);

/* Duration in seconds of the last plan; NAN without an answer. */
double ruckig_duration(int axes);

/* Evaluates the last plan at `t`; returns the sum of the positions, so that
 * nobody leaves it out. */
double ruckig_sample(int axes, double t);

#ifdef __cplusplus
}
#endif

#endif
