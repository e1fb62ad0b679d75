/* motion/curve/fcurve.h - keys with handles, as Blender's F-curves are.
 *
 * A key has a point, a handle on either side, and says how the span that starts
 * at it is interpolated.  Handles of the kinds ALIGNED, VECTOR, AUTO and
 * AUTO_CLAMPED follow from their neighbours: motion_fcurve_handles computes
 * them.  Then the curve can be evaluated at any time, and appended to a track.
 *
 * Semantics are those of Blender 3.4, except that a time within 1e-4 frames of
 * a key is not taken for the key, and what Blender computes in single precision
 * is computed with 58 bits here.
 *
 *   BEZIER    the cubic through key, right handle, next left handle, next key,
 *             y(u) where x(u) = t; a handle longer in time than the span is
 *             shortened to it, both coordinates, so that x(u) is monotone
 *   SINE ..   Penner's easing equations in the span's own time
 *
 * Outside the keys the curve is extrapolated or, with cycles, repeated.  Times
 * of keys, handles and evaluation share one zero, which the caller chooses.
 * Plan-time. */
#ifndef MOTION_CURVE_FCURVE_H
#define MOTION_CURVE_FCURVE_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/track.h"
#include "motion/curve/bake.h"
#include "motion/number/real.h"

MOTION_C_BEGIN

enum motion_fcurve_handle {
    MOTION_FCURVE_FREE,    /* as given */
    MOTION_FCURVE_ALIGNED, /* length as given, in line with the other; beside
                              FREE as given */
    MOTION_FCURVE_VECTOR,  /* a third of the way to the neighbour */
    MOTION_FCURVE_AUTO,    /* mean of the neighbouring slopes */
    MOTION_FCURVE_CLAMPED, /* the same, but never beyond a neighbour's value,
                              and flat at extremes */
};

/* In the order of powers; CONSTANT keeps the value until the next key. */
enum motion_fcurve_interpolation {
    MOTION_FCURVE_CONSTANT,
    MOTION_FCURVE_LINEAR,
    MOTION_FCURVE_BEZIER,
    MOTION_FCURVE_SINE,
    MOTION_FCURVE_QUAD,
    MOTION_FCURVE_CUBIC,
    MOTION_FCURVE_QUART,
    MOTION_FCURVE_QUINT,
    MOTION_FCURVE_EXPO,
    MOTION_FCURVE_CIRC,
    MOTION_FCURVE_BACK,
    MOTION_FCURVE_BOUNCE,
    MOTION_FCURVE_ELASTIC,
};

/* BY_KIND is out for BACK, BOUNCE and ELASTIC, in for the others. */
enum motion_fcurve_easing {
    MOTION_FCURVE_BY_KIND,
    MOTION_FCURVE_IN,
    MOTION_FCURVE_OUT,
    MOTION_FCURVE_IN_OUT,
};

enum motion_fcurve_smoothing {
    MOTION_FCURVE_SMOOTH_NONE,
    MOTION_FCURVE_SMOOTH_ACCELERATION, /* continuous, Blender's CONT_ACCEL */
};

enum motion_fcurve_extrapolation {
    MOTION_FCURVE_HOLD, /* the end key's value */
    MOTION_FCURVE_LINE, /* along the end key's outer handle; along the chord
                           when the end key is LINEAR; held when CONSTANT */
};

enum motion_fcurve_cycle {
    MOTION_FCURVE_ONCE,
    MOTION_FCURVE_REPEAT,
    MOTION_FCURVE_REPEAT_OFFSET, /* each starts where the one before ended */
    MOTION_FCURVE_MIRROR,        /* forth and back */
};

struct motion_fcurve_point {
    int64_t t_ns_q12, pos_q32;
};

/* Values of the enums above; 0 means the first. */
struct motion_fcurve_key {
    struct motion_fcurve_point at;
    struct motion_fcurve_point left, right; /* handles, absolute; in for FREE
                                               and ALIGNED, else out */
    uint8_t left_kind, right_kind;
    uint8_t interpolation, easing; /* of the span that starts here */
    bool settled;          /* out: smoothing leaves these handles alone */
    int64_t back_q32;      /* BACK: overshoot; 1.70158 is 10 percent */
    int64_t amplitude_q32; /* ELASTIC; below the change it shrinks the swing */
    int64_t period_ns_q12; /* ELASTIC; 0: 0.3 of the span, in-out 0.45 */
};

/* What happens before the first or after the last key; so many times, 0 for
 * ever; then extrapolation. */
struct motion_fcurve_cycles {
    uint8_t mode; /* enum motion_fcurve_cycle */
    uint32_t count;
};

struct motion_fcurve {
    struct motion_fcurve_key *key; /* times increase, +-2^60 */
    uint32_t count;
    uint8_t smoothing, extrapolation;
    struct motion_fcurve_cycles before, after;
    /* What the editor that drew ALIGNED handles counts as 1: their length
     * mixes time and value.  0: 1/24 s, and 1 unit. */
    int64_t frame_ns_q12, value_q32;
};

/* Room per key for smoothing. */
struct motion_fcurve_work {
    struct motion_real span, chord; /* from the key before */
    struct motion_real left, middle, right, want;
    struct motion_real slope, low, high, swap;
    bool locked;
    uint8_t releases;
};

/* Recompute all handles that follow from their kinds (one key has none).  With
 * SMOOTH_ACCELERATION `work` holds `count` elements, else it may be NULL.
 * MOTION_E_EMPTY without keys, MOTION_E_ORDER when times do not increase,
 * MOTION_E_ARG for kinds that do not exist or missing room, MOTION_E_RANGE for
 * times beyond +-2^60 or a handle that leaves its format; *failed, when not
 * NULL, is the key and handles are of no use then. */
int motion_fcurve_handles(struct motion_fcurve *curve,
                          struct motion_fcurve_work *work, uint32_t *failed);

/* Which limit is meant where something steps; AT is the position Blender shows
 * there and the derivatives that follow. */
enum motion_fcurve_side {
    MOTION_FCURVE_LEFT = -1,
    MOTION_FCURVE_AT,
    MOTION_FCURVE_RIGHT,
};

/* unit, unit/s, unit/s2. */
struct motion_fcurve_value {
    struct motion_real pos, vel, acc;
    bool steep; /* vel or acc is infinite, and given as +-2^200 or 0 */
};

/* The curve at t, +-2^61, with its handles computed.  Position within 2^-56 of
 * the largest value of the span and its handles, at a time within 2^-56 of the
 * span's duration.  MOTION_E_EMPTY without keys, MOTION_E_ARG for kinds that do
 * not exist, MOTION_E_RANGE for t. */
int motion_fcurve_at(const struct motion_fcurve *curve, int64_t t_ns_q12,
                     enum motion_fcurve_side side,
                     struct motion_fcurve_value *value);

/* What to append, from its time to its time, and how well.  Spans that are
 * polynomials of time (handles at a third of the span, LINEAR, CONSTANT, QUAD
 * .. QUINT, BACK, BOUNCE) are, but for what the track rounds; the others are
 * baked. */
struct motion_fcurve_range {
    int64_t from_ns_q12, to_ns_q12;
    struct motion_bake_bound within; /* as motion_bake's pos, vel, acc */
    struct motion_real step; /* ELASTIC spans miss their start or end by 1/1024
                                of the swing.  Steps up to this are spread over
                                their span (and are part of the bound); 0:
                                refused */
};

struct motion_fcurve_report {
    struct motion_bake_bound bound; /* of what was baked */
    uint32_t segments;
    uint32_t failed; /* key, on an error */
};

/* Append the curve to a track that ends where the curve is at the start of the
 * range (2^-30 unit).  `report` may be NULL.
 *   MOTION_E_DISCONTINUITY  the curve steps at the key
 *   MOTION_E_SINGULAR       its velocity or acceleration is not finite there
 *   MOTION_E_TOLERANCE      the span that starts there is too steep to be baked
 *   MOTION_E_ARG            an empty range, kinds that do not exist, or another
 *                           start
 * and the errors of motion_fcurve_at, motion_bake and motion_track_append_*.
 * On an error the track is as before. */
int motion_fcurve_append(struct motion_track *track,
                         const struct motion_fcurve *curve,
                         const struct motion_fcurve_range *range,
                         struct motion_fcurve_report *report);

MOTION_C_END

#endif
