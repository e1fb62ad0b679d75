/* firmware/host/exchange/import_fit.c - see import_fit.h. */
#include "firmware/host/exchange/import_fit.h"

#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/rig/modbus_budget.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/plan_error.h"

#define FIT_REST_Q32  4295 /* 10^-6 unit */
#define FIT_FOUND     256  /* violations that are looked at */
#define FIT_CURABLE   2
#define FIT_WORST_MAX 160

/* Those that go through every key and need nothing but positions, the most
 * local one first. */
static const enum plan_curve fit_curves[] = { PLAN_CURVE_QUINTIC, PLAN_CURVE_C4,
                                              PLAN_CURVE_C2,
                                              PLAN_CURVE_AKIMA_MONOTONE };

/* Is it too fast, and nothing else?  More time cures that (slew fit). */
static bool fit_is_curable(const struct plan_violation found[], uint32_t count)
{
    bool is = count <= FIT_FOUND;

    for (uint32_t i = 0; i < count && is; i++)
        is = found[i].kind == PLAN_VEL || found[i].kind == PLAN_ACC ||
             found[i].kind == PLAN_JERK;
    return is;
}

/* 0: inside all limits; FIT_CURABLE; 1: else outside, the first in *worst; or
 * what planning has against it. */
static int fit_judge(const struct rig *rig, const struct plan_axis *axis,
                     struct plan_violation *worst, struct plan_error *error)
{
    struct plan_limit limit = rig->axis[rig_axis_index(rig, axis->name)].limit;
    struct motion_track track;
    struct plan_violation found[FIT_FOUND];
    uint32_t count;
    const int err = plan_axis_track(axis, &track, error);

    if (err < 0)
        return err;
    limit.period_ns = rig->period_ns;
    count = plan_check_track(&track, &limit, found, FIT_FOUND);
    plan_track_free(&track);
    *worst = found[0];
    return count == 0 ? 0 : fit_is_curable(found, count) ? FIT_CURABLE : 1;
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

/* The first curve through the same times and positions that is judged so. */
static bool fit_search(const struct rig *rig, const struct plan_axis *axis,
                       const enum plan_curve curve[], size_t count, int judged,
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
            found = fit_judge(rig, &bare, &worst, &error) == judged;
        }
    memory_free(bare.key);
    return found;
}

/* --- by the drive's own profile ------------------------------------------------ */

/* -1, 0, 1: from one key to the next; so little is the rounding of a format. */
static int fit_way(const struct plan_axis *axis, uint32_t from)
{
    const int64_t change =
        axis->key[from + 1].key.pos_q32 - axis->key[from].key.pos_q32;

    return change > FIT_REST_Q32 ? 1 : change < -FIT_REST_Q32 ? -1 : 0;
}

/* The drive goes straight to its goal. */
static int fit_turns(const struct plan_axis *axis, struct plan_error *error)
{
    for (uint32_t i = 0; i + 2 < axis->key_count; i++)
        if (fit_way(axis, i) * fit_way(axis, i + 1) < 0)
            return plan_error_set(
                error, MOTION_E_ARG, axis->key[i + 1].place,
                "axis %s turns back here without resting, and its drive goes "
                "from key to key by its own profile, expected a rest or a rig "
                "whose drive takes set points",
                axis->name);
    return MOTION_OK;
}

static int fit_goals(const struct rig *rig, struct plan_axis *axis,
                     struct import_fit *fit, struct plan_error *error)
{
    const unsigned index = (unsigned)rig_axis_index(rig, axis->name);
    const int err = fit_turns(axis, error);

    if (err < 0)
        return err;
    if (!fit_bare(axis, PLAN_CURVE_PARABOLIC))
        return plan_error_set(error, MOTION_E_ARG, axis->place,
                              "axis %s has cycles, an extrapolation or keys "
                              "before its start, and its drive goes from key "
                              "to key by its own profile, expected keys alone",
                              axis->name);
    fit->of = axis->key_count;
    for (uint32_t i = 0; i < fit->of; i++) {
        const bool is_last = i + 1 == fit->of;
        if (i == 0 || is_last ||
            (fit_way(axis, i - 1) == 0 && fit_way(axis, i) != 0))
            axis->key[fit->kept++] = axis->key[i];
    }
    axis->key_count = fit->kept;
    axis->profile = (struct plan_profile){
        .vel_q32 = rig->axis[index].limit.vel_q32,
        .acc_q32 = rig->axis[index].limit.acc_q32,
        .settle_ns_q12 =
            modbus_budget_settle_ns(rig, index) * MOTION_FIXED_NS_Q12,
    };
    return MOTION_OK;
}

/* Of an axis that breaks a limit: the curve that it takes or could take, and what is
 * against all of them. */
static void fit_choose(const struct import_settings *settings, bool sampled,
                       const struct plan_axis *axis, int over,
                       struct import_fit *fit)
{
    const struct rig *rig = settings->rig;
    const bool is_free = sampled && !settings->has_curve;

    if (sampled != settings->has_curve)
        fit->changed =
            fit_search(rig, axis, sampled ? fit_curves : &settings->curve,
                       sampled ? ARRAY_LEN(fit_curves) : 1, 0, &fit->other);
    if (!fit->changed && !is_free)
        fit->has_other = fit_search(rig, axis, fit_curves,
                                    ARRAY_LEN(fit_curves), 0, &fit->other);
    if (fit->changed || fit->has_other)
        return;
    if (sampled)
        import_odd(&rig->axis[rig_axis_index(rig, axis->name)], axis,
                   &fit->odd);
    if (fit->odd.kind != IMPORT_ODD_NONE)
        return;
    if (is_free && over != FIT_CURABLE)
        fit->changed = fit_search(rig, axis, fit_curves, ARRAY_LEN(fit_curves),
                                  FIT_CURABLE, &fit->other);
    fit->needs_time = fit->changed || over == FIT_CURABLE;
}

int import_fit(const struct import_settings *settings, bool sampled,
               struct plan_axis *axis, struct import_fit *fit,
               struct plan_error *error)
{
    const struct rig *rig = settings->rig;
    int over = MOTION_OK;

    *fit = (struct import_fit){ .curve = axis->curve };
    if (rig->axis[rig_axis_index(rig, axis->name)].point_to_point)
        over = fit_goals(rig, axis, fit, error);
    if (over < 0)
        return over;
    over = fit_judge(settings->rig, axis, &fit->worst, error);
    if (over < 0)
        return over;
    fit->passes = over == 0;
    if (fit->passes || fit->kept > 0)
        return MOTION_OK;
    fit_choose(settings, sampled, axis, over, fit);
    if (fit->changed)
        (void)fit_bare(axis, fit->other);
    return MOTION_OK;
}

/* "jerk, -709.3 mm/s3 at 3.625 s" */
static void fit_worst(const struct import_fit *fit, enum units_axis unit,
                      char text[FIT_WORST_MAX])
{
    const enum job_violation_kind kind =
        (enum job_violation_kind)fit->worst.kind;
    const unsigned order = job_violation_order(kind);
    char value[NUMBER_MAX], seconds[NUMBER_MAX], per[NUMBER_UNIT_MAX];

    number_short(value, fit->worst.value, 32);
    number_seconds(seconds, fit->worst.t_ns_q12);
    snprintf(text, FIT_WORST_MAX, "%s, %s %s at %s s", job_violation_text(kind),
             value, number_unit(per, unit, order), seconds);
}

void import_fit_text(const struct import_fit *fit, const struct rig *rig,
                     const struct plan_axis *axis, char text[IMPORT_FIT_MAX])
{
    const struct rig_axis *on = &rig->axis[rig_axis_index(rig, axis->name)];
    const char *as_read = plan_curve_rules(fit->curve)->name;
    const char *other = plan_curve_rules(fit->other)->name;
    const char *cure =
        fit->needs_time ? "; it is too fast, which slew fit cures" : "";
    char worst[FIT_WORST_MAX], odd[IMPORT_ODD_MAX];

    text[0] = 0;
    if (fit->passes && fit->kept > 0)
        snprintf(text, IMPORT_FIT_MAX,
                 "%s: %u keys of %u, where it leaves a rest, because its drive "
                 "goes from key to key by its own profile",
                 axis->name, fit->kept, fit->of);
    if (fit->passes)
        return;
    fit_worst(fit, on->unit, worst);
    import_odd_text(&fit->odd, on, axis, odd);
    if (fit->changed)
        snprintf(text, IMPORT_FIT_MAX,
                 "%s: %s through the positions, because %s breaks a limit: "
                 "%s%s",
                 axis->name, other, as_read, worst, cure);
    else if (fit->has_other)
        snprintf(text, IMPORT_FIT_MAX,
                 "%s: %s breaks a limit: %s; --curve %s would pass", axis->name,
                 as_read, worst, other);
    else
        snprintf(text, IMPORT_FIT_MAX,
                 "%s: %s breaks a limit, and so does every curve through "
                 "these keys: %s%s%s%s",
                 axis->name, as_read, worst, cure, odd[0] != 0 ? "; " : "",
                 odd);
}
