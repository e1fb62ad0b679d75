/* firmware/host/exchange/import_anim_curve.c - see import_anim.h. */
#include <math.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/exchange/import_anim.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

void import_anim_capacity(struct import_anim_curve *curve, uint32_t count)
{
    if (count <= curve->side_capacity)
        return;
    curve->side_capacity = count < 64 ? 64 : 2 * count;
    curve->side =
        memory_resize(curve->side, curve->side_capacity, sizeof *curve->side);
}

/* --- slopes --------------------------------------------------------------- */

static double anim_seconds(int64_t t_ns_q12)
{
    return number_double(t_ns_q12, 12) / 1e9;
}

static double anim_chord(const struct plan_key *a, const struct plan_key *b)
{
    return (number_double(b->key.pos_q32, 32) -
            number_double(a->key.pos_q32, 32)) /
           anim_seconds(b->key.t_ns_q12 - a->key.t_ns_q12);
}

static double anim_auto(double before, double after, double spline)
{
    double most = 3 * fmin(fabs(before), fabs(after));
    if (before * after <= 0)
        return 0;
    return copysign(fmin(fabs(spline), most), before);
}

static bool anim_has_weight(const struct import_anim_curve *curve, uint32_t i,
                            int which)
{
    return curve->weighted &&
           curve->side[i][which].tangent == IMPORT_ANIM_FIXED;
}

/* Slope at key i, of its side 0 (in) or 1 (out). */
static double anim_slope(const struct import_anim_curve *curve, uint32_t i,
                         int which)
{
    const struct plan_key *key = &curve->axis->key[i];
    const struct import_anim_side *side = &curve->side[i][which];
    uint32_t last = curve->axis->key_count - 1;
    if (side->tangent == IMPORT_ANIM_FIXED)
        return number_double(side->vel_q32, 32);
    if (side->tangent == IMPORT_ANIM_FLAT || last == 0)
        return 0;
    double before = anim_chord(i > 0 ? key - 1 : key, i > 0 ? key : key + 1);
    double after =
        anim_chord(i < last ? key : key - 1, i < last ? key + 1 : key);
    if (side->tangent == IMPORT_ANIM_LINEAR)
        return which == 0 ? before : after;
    double spline = anim_chord(i > 0 ? key - 1 : key, i < last ? key + 1 : key);
    if (side->tangent == IMPORT_ANIM_SPLINE)
        return spline;
    return i == 0 || i == last ? 0 : anim_auto(before, after, spline);
}

/* --- which curve ---------------------------------------------------------- */

static bool anim_is_linear(const struct import_anim_curve *curve)
{
    for (uint32_t i = 0; i < curve->axis->key_count; i++)
        for (int which = 0; which < 2; which++)
            if (curve->side[i][which].tangent != IMPORT_ANIM_LINEAR)
                return false;
    return true;
}

static bool anim_is_broken(const struct import_anim_curve *curve)
{
    for (uint32_t i = 1; i + 1 < curve->axis->key_count; i++) {
        double in = anim_slope(curve, i, 0), out = anim_slope(curve, i, 1);
        if (fabs(in - out) > 1e-9 * fmax(fabs(in), fabs(out)) + 1e-9)
            return true;
    }
    return false;
}

static bool anim_has_infinity(const struct import_anim_curve *curve)
{
    return curve->before != IMPORT_ANIM_CONSTANT ||
           curve->after != IMPORT_ANIM_CONSTANT;
}

/* --- hermite -------------------------------------------------------------- */

static int anim_settle_key(struct import_anim_curve *curve, uint32_t i)
{
    struct motion_key *key = &curve->axis->key[i].key;
    const int which = i == 0;
    const double slope = anim_slope(curve, i, which);
    if (!(fabs(slope) < 2147483647.0))
        return MOTION_E_RANGE;
    key->has_vel = true;
    key->vel = motion_real_from_q(llround(ldexp(slope, 32)), 32);
    return MOTION_OK;
}

/* --- bezier --------------------------------------------------------------- */

/* Beyond an end a line goes on along the tangent, all else does not use it. */
static bool anim_is_held(const struct import_anim_curve *curve, uint32_t i,
                         int which)
{
    if (which == 0)
        return i == 0 && curve->before != IMPORT_ANIM_LINE;
    return i + 1 == curve->axis->key_count && curve->after != IMPORT_ANIM_LINE;
}

static int64_t anim_span(const struct plan_axis *axis, uint32_t i, int which)
{
    const uint32_t from = which == 0                ? (i > 0 ? i - 1 : 0)
                          : i + 1 < axis->key_count ? i
                                                    : i - 1;
    return axis->key[from + 1].key.t_ns_q12 - axis->key[from].key.t_ns_q12;
}

static int anim_handle(struct import_anim_curve *curve, uint32_t i, int which,
                       struct plan_handle *handle)
{
    const struct import_anim_side *side = &curve->side[i][which];
    const int64_t span = anim_span(curve->axis, i, which);
    const int64_t sign = which == 0 ? -1 : 1;
    double rise;
    *handle = (struct plan_handle){ .kind = MOTION_FCURVE_FREE,
                                    .dt_ns_q12 = sign * ((span + 1) / 3) };
    if (anim_is_held(curve, i, which))
        return MOTION_OK;
    if (anim_has_weight(curve, i, which)) {
        curve->longer += side->dt_ns_q12 - span > span >> 30;
        handle->dt_ns_q12 = sign * side->dt_ns_q12;
        handle->dp_q32 = sign * side->dp_q32;
        return MOTION_OK;
    }
    rise = anim_slope(curve, i, which) * anim_seconds(span) / 3;
    if (!(fabs(rise) < 2147483647.0))
        return MOTION_E_RANGE;
    handle->dp_q32 = sign * llround(ldexp(rise, 32));
    return MOTION_OK;
}

static uint8_t anim_cycle(enum import_anim_infinity infinity)
{
    static const uint8_t mode[] = {
        [IMPORT_ANIM_CONSTANT] = MOTION_FCURVE_ONCE,
        [IMPORT_ANIM_LINE] = MOTION_FCURVE_ONCE,
        [IMPORT_ANIM_CYCLE] = MOTION_FCURVE_REPEAT,
        [IMPORT_ANIM_CYCLE_RELATIVE] = MOTION_FCURVE_REPEAT_OFFSET,
        [IMPORT_ANIM_OSCILLATE] = MOTION_FCURVE_MIRROR,
    };
    return mode[infinity];
}

static int anim_settle_bezier(struct import_anim_curve *curve, uint32_t *failed)
{
    struct plan_axis *axis = curve->axis;
    struct plan_bezier *bezier = &axis->bezier;
    axis->curve = PLAN_CURVE_BEZIER;
    bezier->key = memory_new(axis->key_count, sizeof *bezier->key);
    bezier->before.mode = anim_cycle(curve->before);
    bezier->after.mode = anim_cycle(curve->after);
    if (curve->before == IMPORT_ANIM_LINE || curve->after == IMPORT_ANIM_LINE)
        bezier->extrapolation = MOTION_FCURVE_LINE;
    for (uint32_t i = 0; i < axis->key_count; i++) {
        struct plan_bezier_key *key = &bezier->key[i];
        *failed = i;
        key->interpolation = MOTION_FCURVE_BEZIER;
        if (anim_handle(curve, i, 0, &key->left) != MOTION_OK ||
            anim_handle(curve, i, 1, &key->right) != MOTION_OK)
            return MOTION_E_RANGE;
    }
    return MOTION_OK;
}

int import_anim_settle(struct import_anim_curve *curve, uint32_t *failed)
{
    struct plan_axis *axis = curve->axis;
    const bool linear = anim_is_linear(curve);
    curve->longer = 0;
    if (axis->key_count > 1 &&
        (anim_has_infinity(curve) ||
         (!linear && (curve->weighted || anim_is_broken(curve)))))
        return anim_settle_bezier(curve, failed);
    axis->curve = linear ? PLAN_CURVE_LINEAR : PLAN_CURVE_HERMITE;
    for (uint32_t i = 0; i < axis->key_count && !linear; i++) {
        *failed = i;
        if (anim_settle_key(curve, i) != MOTION_OK)
            return MOTION_E_RANGE;
    }
    return MOTION_OK;
}

bool import_anim_until(struct plan_axis *axis, int64_t end_ns_q12)
{
    struct plan_bezier *bezier = &axis->bezier;
    const int64_t last_ns_q12 = axis->key[axis->key_count - 1].key.t_ns_q12;
    if (bezier->after.mode == MOTION_FCURVE_ONCE &&
        bezier->extrapolation == MOTION_FCURVE_HOLD)
        return true;
    if (end_ns_q12 <= last_ns_q12) {
        const bool played = bezier->after.mode == MOTION_FCURVE_ONCE;
        bezier->after.mode = MOTION_FCURVE_ONCE;
        return played;
    }
    bezier->has_end = true;
    bezier->end_ns_q12 = end_ns_q12;
    return true;
}
