/* firmware/host/exchange/import_fit.c - see import_fit.h. */
#include "firmware/host/exchange/import_fit.h"

#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "motion/core/err.h"

/* Those that go through every key and need nothing but positions, the most
 * local one first. */
static const enum plan_curve fit_curves[] = { PLAN_CURVE_QUINTIC, PLAN_CURVE_C4,
                                              PLAN_CURVE_C2,
                                              PLAN_CURVE_AKIMA_MONOTONE };

/* How many violations, the first in *worst; or what planning has against it. */
static int fit_judge(const struct rig *rig, const struct plan_axis *axis,
                     struct plan_violation *worst, struct plan_error *error)
{
    struct plan_limit limit = rig->axis[rig_axis_index(rig, axis->name)].limit;
    struct motion_track track;
    uint32_t count;
    const int err = plan_axis_track(axis, &track, error);

    if (err < 0)
        return err;
    limit.period_ns = rig->period_ns;
    count = plan_check_track(&track, &limit, worst, 1);
    plan_track_free(&track);
    return count > 0;
}

static bool fit_is_plain(const struct plan_axis *axis)
{
    const struct plan_bezier *bezier = &axis->bezier;

    return bezier->before.mode == MOTION_FCURVE_ONCE &&
           bezier->after.mode == MOTION_FCURVE_ONCE &&
           bezier->extrapolation == MOTION_FCURVE_HOLD && !bezier->has_end &&
           axis->key[0].key.t_ns_q12 >= 0;
}

/* Only times and positions, under another curve.  False where the axis has
 * cycles, an extrapolation, an end of its own or keys before the start: those
 * are handles' alone, or not the same under another curve. */
static bool fit_bare(struct plan_axis *axis, enum plan_curve curve)
{
    if (!fit_is_plain(axis))
        return false;
    free(axis->bezier.key);
    memset(&axis->bezier, 0, sizeof axis->bezier);
    axis->curve = curve;
    for (uint32_t i = 0; i < axis->key_count; i++) {
        struct plan_key *key = &axis->key[i];
        *key = (struct plan_key){ .key = { .t_ns_q12 = key->key.t_ns_q12,
                                           .pos_q32 = key->key.pos_q32 },
                                  .place = key->place };
    }
    return true;
}

/* The first curve that passes through the same times and positions. */
static bool fit_search(const struct rig *rig, const struct plan_axis *axis,
                       const enum plan_curve curve[], size_t count,
                       enum plan_curve *other)
{
    struct plan_axis bare = *axis;
    struct plan_violation worst;
    struct plan_error error;
    bool found = false;

    bare.bezier.key = NULL;
    bare.key = memory_new(axis->key_count, sizeof *bare.key);
    memcpy(bare.key, axis->key, axis->key_count * sizeof *bare.key);
    if (fit_bare(&bare, PLAN_CURVE_QUINTIC))
        for (size_t i = 0; i < count && !found; i++) {
            bare.curve = *other = curve[i];
            found = fit_judge(rig, &bare, &worst, &error) == 0;
        }
    memory_free(bare.key);
    return found;
}

int import_fit(const struct import_wish *wish, bool sampled,
               struct plan_axis *axis, struct import_fit *fit,
               struct plan_error *error)
{
    int over;

    *fit = (struct import_fit){ .curve = axis->curve };
    over = fit_judge(wish->rig, axis, &fit->worst, error);
    if (over < 0)
        return over;
    fit->passes = over == 0;
    if (fit->passes)
        return MOTION_OK;
    if (sampled != wish->has_curve)
        fit->changed =
            fit_search(wish->rig, axis, sampled ? fit_curves : &wish->curve,
                       sampled ? ARRAY_LEN(fit_curves) : 1, &fit->other);
    if (fit->changed)
        (void)fit_bare(axis, fit->other);
    else
        fit->has_other = fit_search(wish->rig, axis, fit_curves,
                                    ARRAY_LEN(fit_curves), &fit->other);
    return MOTION_OK;
}

/* "jerk, -709.3 mm/s3 at 3.625 s" */
static void fit_worst(const struct import_fit *fit, enum units_axis unit,
                      char text[IMPORT_FIT_MAX / 2])
{
    const enum job_violation_kind kind =
        (enum job_violation_kind)fit->worst.kind;
    const unsigned order = job_violation_order(kind);
    char value[NUMBER_MAX], seconds[NUMBER_MAX], per[NUMBER_UNIT_MAX];

    number_short(value, fit->worst.value, 32);
    number_seconds(seconds, fit->worst.t_ns_q12);
    snprintf(text, IMPORT_FIT_MAX / 2, "%s, %s %s at %s s",
             job_violation_text(kind), value, number_unit(per, unit, order),
             seconds);
}

void import_fit_text(const struct import_fit *fit, const struct rig *rig,
                     const struct plan_axis *axis, char text[IMPORT_FIT_MAX])
{
    const struct rig_axis *on = &rig->axis[rig_axis_index(rig, axis->name)];
    const char *as_read = plan_curve_rules(fit->curve)->name;
    const char *other = plan_curve_rules(fit->other)->name;
    char worst[IMPORT_FIT_MAX / 2];

    text[0] = 0;
    if (fit->passes)
        return;
    fit_worst(fit, on->unit, worst);
    if (fit->changed)
        snprintf(text, IMPORT_FIT_MAX,
                 "%s: %s through the positions, because %s breaks a limit: %s",
                 axis->name, other, as_read, worst);
    else if (fit->has_other)
        snprintf(text, IMPORT_FIT_MAX,
                 "%s: %s breaks a limit: %s; --curve %s would pass", axis->name,
                 as_read, worst, other);
    else
        snprintf(text, IMPORT_FIT_MAX,
                 "%s: %s breaks a limit, and so does every curve through "
                 "these keys: %s",
                 axis->name, as_read, worst);
}
