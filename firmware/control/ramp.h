/* firmware/control/ramp.h - what the files of the search for a ramp share:
 * ramp.c (the search), ramp_bound.c (how steep a ramp may
 * be and how long it then takes) and ramp_judge.c (does one fit?). */
#ifndef FIRMWARE_CONTROL_RAMP_H
#define FIRMWARE_CONTROL_RAMP_H

#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define RAMP_SECOND_NS INT64_C(1000000000)

/* a * b / c, saturated; c > 0, the others >= 0. */
static inline int64_t ramp_muldiv(int64_t a, int64_t b, int64_t c)
{
    int64_t result;
    return motion_fixed_muldiv(a, b, c, &result) < 0 ? INT64_MAX : result;
}

static inline int64_t ramp_least(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

static inline int64_t ramp_most(int64_t a, int64_t b)
{
    return a > b ? a : b;
}

static inline int64_t ramp_size(int64_t value)
{
    const uint64_t size = motion_fixed_abs(value);
    return size > INT64_MAX ? INT64_MAX : (int64_t)size;
}

static inline const struct motion_clock_limit *
ramp_limit(const struct controller *controller, unsigned axis, bool stop)
{
    const struct controller_axis_config *config =
        &controller->config.axis[axis];
    return stop ? &config->stop : &config->limit;
}

/* ramp_bound.c.  Now: the state of the clock from which a ramp would start.
 * Bound: the A and J that alone would use the whole of the limits at the peaks
 * of the tracks, divided by `divisor`.  Rest: how long the ramp within these to
 * rate 0 takes.  Room: the largest |r''| of this sign that p''' leaves at
 * `now`.  Steepest: no ramp of one A and J from `now` to wanted_q30 can have a
 * larger J, or a use for a larger A. */
struct motion_clock_rate
controller_ramp_now(const struct controller *controller);
struct motion_clock_bound
controller_ramp_bound(const struct controller *controller,
                      const struct motion_clock_rate *now, bool stop,
                      unsigned divisor);
int64_t controller_ramp_rest_ns(const struct controller *controller,
                                const struct motion_clock_rate *now, bool stop,
                                unsigned divisor);
int64_t controller_ramp_margin(const struct controller *controller,
                               const struct motion_clock_rate *now, bool down,
                               bool stop);
struct motion_clock_bound
controller_ramp_steepest(const struct controller *controller,
                         const struct motion_clock_rate *now, bool stop);

/* What a search may still take, and where the last candidate that did not fit
 * was seen to be over a limit: the next one mostly is there, too. */
struct ramp_effort {
    int64_t looks;
    int64_t dt_ns; /* since the ramp began */
    unsigned axis;
    int64_t left; /* looks, of the candidate that is being judged */
};

/* ramp_judge.c: does the ramp keep every axis inside its limits?
 * effort->looks is reduced by what that took. */
bool controller_ramp_judge(const struct controller *controller,
                           const struct motion_clock_warp *warp, bool stop,
                           struct ramp_effort *effort);

#endif
