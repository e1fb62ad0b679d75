/* firmware/host/exchange/import_anim.h - a curve of a Maya .anim file, from
 * its tangents to what an axis of a move has.
 *
 * Tangents on either side that agree, without weights, are one velocity: curve
 * hermite (or linear, when all are).  Weighted or broken ones, and infinities
 * that are not constant, are the handles of curve bezier: a weighted tangent's
 * control point is a third of it from the key, any other's at a third of the
 * span beside it. */
#ifndef FIRMWARE_HOST_EXCHANGE_IMPORT_ANIM_H
#define FIRMWARE_HOST_EXCHANGE_IMPORT_ANIM_H

#include "motion/plan/move.h"

/* How a tangent is found. */
enum import_anim_tangent {
    IMPORT_ANIM_FIXED,
    IMPORT_ANIM_LINEAR,
    IMPORT_ANIM_FLAT,
    IMPORT_ANIM_SPLINE,
    IMPORT_ANIM_AUTO, /* Maya's own rules, not published for all of them: flat
                         at extremes, else the spline's, at most three times
                         the lesser chord */
    IMPORT_ANIM_STEP, /* a jump */
};

/* What goes on before the first and after the last key. */
enum import_anim_infinity {
    IMPORT_ANIM_CONSTANT,
    IMPORT_ANIM_LINE,
    IMPORT_ANIM_CYCLE,
    IMPORT_ANIM_CYCLE_RELATIVE,
    IMPORT_ANIM_OSCILLATE,
};

/* One side of a key. */
struct import_anim_side {
    enum import_anim_tangent tangent;
    int64_t vel_q32;           /* FIXED, of a curve without weights */
    int64_t dt_ns_q12, dp_q32; /* FIXED and weighted: control point from key */
};

struct import_anim_curve {
    struct plan_axis *axis;             /* its keys have time and position */
    struct import_anim_side (*side)[2]; /* in, out; one per key, on the heap */
    uint32_t side_capacity;
    bool weighted;
    enum import_anim_infinity before, after;
    uint32_t longer; /* out: tangents that reach beyond the next key; slew's
                        handles end there */
};

/* Room for the sides of so many keys. */
void import_anim_capacity(struct import_anim_curve *curve, uint32_t count);

/* Give the axis its curve, velocities or handles.  0, or MOTION_E_RANGE and the
 * key whose tangent is steeper than velocities can be. */
int import_anim_settle(struct import_anim_curve *curve, uint32_t *failed);

/* Where the axis ends, once its times are the move's: infinities play until
 * `end_ns_q12`.  False when there is one that has no time to play. */
bool import_anim_until(struct plan_axis *axis, int64_t end_ns_q12);

#endif
