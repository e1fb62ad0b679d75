/* motion/plan/shaper/shaper.h - input shapers from the frequency and damping of a
 * vibration.
 *
 * The mode is x'' + 2 z w x' + w^2 x = w^2 u with the damping ratio z and the
 * undamped natural frequency w / 2 pi.  A shaper turns the input u(t) into
 * sum A[i] u(t - t[i]), t[0] = 0, all A positive with the sum 1.  What vibration
 * is left at a frequency w, by that of the plain input at its own end, is
 *
 *     V(w) = exp(-z w t[n-1]) |sum A[i] exp((z w + j w sqrt(1 - z^2)) t[i])|
 *
 *   ZV   2 impulses   V = 0 at the design frequency
 *   ZVD  3            V = dV/dw = 0 there
 *   EI   3            V = `residual` there, 0 at a frequency on either side
 *   EI2  4            two-hump EI: V = 0 there and on either side, and
 *                     `residual` at the two maxima between these
 *
 * More impulses take longer and forgive a larger error of the frequency.  EI and
 * EI2 have closed forms without damping; with damping their equations are solved
 * by Newton's method, continued in z from z = 0.
 * Sources: Singer & Seering, J. Dyn. Sys. Meas. Control 112 (1990); W. Singhose,
 * W. Seering, N. Singer, Residual Vibration Reduction Using Vector Diagrams to
 * Generate Shaped Inputs, J. Mech. Design 116 (1994); W. Singhose, E. Crain,
 * W. Seering, Convolved and Simultaneous Two-Mode Input Shapers, IEE Proc. 144
 * (1997), with the closed form of the two-hump EI shaper. */
#ifndef MOTION_PLAN_SHAPER_SHAPER_H
#define MOTION_PLAN_SHAPER_SHAPER_H

#include "motion/core/shaper.h"
#include "motion/plan/move.h"

MOTION_C_BEGIN

/* X(name, word, impulses). */
#define PLAN_SHAPER_LIST(X)                                                    \
    X(PLAN_SHAPER_ZV, "zv", 2)                                                 \
    X(PLAN_SHAPER_ZVD, "zvd", 3)                                               \
    X(PLAN_SHAPER_EI, "ei", 3)                                                 \
    X(PLAN_SHAPER_EI2, "ei2", 4)

enum plan_shaper_kind {
#define PLAN_SHAPER_ENUM(name, word, impulses) name,
    PLAN_SHAPER_LIST(PLAN_SHAPER_ENUM)
#undef PLAN_SHAPER_ENUM
        PLAN_SHAPER_KINDS
};
const char *plan_shaper_word(enum plan_shaper_kind kind);

#define PLAN_SHAPER_FREQUENCY_MIN_HZ 1e-3
#define PLAN_SHAPER_FREQUENCY_MAX_HZ 1e5
/* ZV and ZVD; EI and EI2 end where the upper zero comes to twice the design
 * frequency: at 0.54 and 0.34 with a residual of 0.05. */
#define PLAN_SHAPER_DAMPING_MAX 0.99
#define PLAN_SHAPER_RESIDUAL    0.05 /* usual */

struct plan_shaper_request {
    enum plan_shaper_kind kind;
    double frequency_hz; /* undamped; MIN .. MAX above */
    double damping;      /* ratio, 0 .. MAX above */
    double residual;     /* 0.001 .. 0.3; EI and EI2, ignored by the others */
};

struct plan_shaper {
    double frequency_hz, damping;
    uint32_t count; /* impulses */
    double amplitude[MOTION_SHAPER_IMPULSES_MAX];
    double time_s[MOTION_SHAPER_IMPULSES_MAX];
    uint32_t zeros, humps; /* of EI and EI2; ZV and ZVD: the design frequency */
    double zero_hz[3];     /* where V = 0, ascending */
    double hump_hz[2];     /* EI2: where V has its maxima */
};

/* MOTION_OK, or MOTION_E_ARG with *error saying which value is out of range or
 * up to what damping there is such a shaper; its place is 0. */
int plan_shaper_design(const struct plan_shaper_request *request,
                       struct plan_shaper *shaper, struct plan_error *error);

/* V at a frequency of the mode, > 0; the damping ratio is that of the design. */
double plan_shaper_residual(const struct plan_shaper *shaper,
                            double frequency_hz);
/* sum A[i] t[i]: by so much a ramp lags behind, in s. */
double plan_shaper_delay(const struct plan_shaper *shaper);
/* Minus the derivative of the phase of sum A[i] exp(-j W t[i]) by W = 2 pi
 * frequency_hz, in s. */
double plan_shaper_group_delay(const struct plan_shaper *shaper,
                               double frequency_hz);

/* As the tick has it, `later_ns_q12` after its own times: amplitudes to 2^-53
 * and adding up to exactly 1, times to the nearest 2^-12 ns.  MOTION_E_ARG for
 * a delay that the tick does not take. */
int plan_shaper_to_tick(const struct plan_shaper *shaper, int64_t later_ns_q12,
                        struct motion_shaper *tick);

MOTION_C_END

#endif
