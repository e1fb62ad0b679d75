/* motion/plan/fit/fit_times.c - see fit_internal.h. */
#include <math.h>
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/check.h"
#include "motion/plan/fit/fit_internal.h"
#include "motion/plan/keys/move_internal.h"
#include "motion/plan/keys/stand.h"
#include "motion/plan/plan_error.h"

#define FIT_GRID_NS_Q12 ((int64_t)1000 * MOTION_FIXED_NS_Q12)
#define FIT_FRAMES_MAX  (INT64_C(1) << 26)

int fit_no_memory(struct fit *self)
{
    return plan_error_set(self->error, MOTION_E_FULL,
                          (struct plan_place){ 0, 0 }, "no memory for the fit");
}

/* --- times ----------------------------------------------------------------- */

uint32_t fit_knot(const struct fit *self, int64_t t_ns_q12)
{
    uint32_t low = 0, high = self->fit->knots - 1;

    while (low < high) {
        const uint32_t middle = low + (high - low) / 2;
        if (self->fit->from_ns_q12[middle] < t_ns_q12)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* The time of a frame, as a file's "frame 12" is read. */
static int64_t fit_frame(const struct plan_move *move, int64_t frame)
{
    return motion_fixed_muldiv_sat(frame * (int64_t)move->fps_den,
                                   MOTION_FIXED_S_Q12, (int64_t)move->fps_num);
}

/* The first frame, or whole microsecond, that is not before t. */
static int64_t fit_up(const struct fit *self, int64_t t_ns_q12)
{
    const struct plan_move *move = self->request->move;
    const int64_t over = t_ns_q12 % FIT_GRID_NS_Q12;

    if (!self->request->on_frames)
        return over > 0 ? t_ns_q12 - over + FIT_GRID_NS_Q12 : t_ns_q12 - over;
    int64_t frame = motion_fixed_muldiv_sat(t_ns_q12, (int64_t)move->fps_num,
                                            MOTION_FIXED_S_Q12) /
                        (int64_t)move->fps_den -
                    1;
    while (frame < FIT_FRAMES_MAX && fit_frame(move, frame) < t_ns_q12)
        frame++;
    return fit_frame(move, frame);
}

/* The end of a span: where it was when all before is, or when it is fixed. */
static int64_t fit_end(const struct fit *self, uint32_t span, double dur)
{
    const int64_t start = self->fit->to_ns_q12[span];

    if (self->is_fixed[span + 1] ||
        (start == self->fit->from_ns_q12[span] && dur == fit_from(self, span)))
        return self->fit->from_ns_q12[span + 1];
    return fit_up(self, start + (int64_t)ceil(dur));
}

/* New times of all knots from durations of the spans. */
static int fit_place(struct fit *self, const double dur_ns_q12[])
{
    struct plan_fit *fit = self->fit;

    fit->to_ns_q12[0] = fit->from_ns_q12[0];
    for (uint32_t k = 0; k + 1 < fit->knots; k++) {
        if (!(dur_ns_q12[k] < (double)MOTION_TRACK_SEGMENT_MAX_NS_Q12) ||
            fit->to_ns_q12[k] > MOTION_TRACK_MAX_NS_Q12 / 2)
            return plan_error_set(self->error, MOTION_E_RANGE,
                                  (struct plan_place){ 0, 0 },
                                  "the move would take too long for a track");
        fit->to_ns_q12[k + 1] = fit_end(self, k, dur_ns_q12[k]);
        if (fit->to_ns_q12[k + 1] <= fit->to_ns_q12[k])
            return plan_error_set(self->error, MOTION_E_LIMIT,
                                  (struct plan_place){ 0, 0 },
                                  "fixed keys leave no time between them at "
                                  "%.6g s",
                                  move_seconds(fit->to_ns_q12[k]));
    }
    return MOTION_OK;
}

/* How much longer the own span of an axis that starts at its key i has become;
 * the one beside it where there is none. */
static double fit_factor(const struct plan_axis *from,
                         const struct plan_axis *to, uint32_t i)
{
    return (double)(to->key[i + 1].key.t_ns_q12 - to->key[i].key.t_ns_q12) /
           (double)(from->key[i + 1].key.t_ns_q12 - from->key[i].key.t_ns_q12);
}

/* A handle, in whole ns. */
static int64_t fit_scaled(int64_t value, double factor)
{
    const double ns = (double)value / (double)MOTION_FIXED_NS_Q12;

    return factor == 1 ? value : llround(ns * factor) * MOTION_FIXED_NS_Q12;
}

/* value / divisor, as the file will have it: in Q32.32. */
static struct motion_real fit_slower(struct motion_real value, double divisor)
{
    const double slower = ldexp((double)value.m, value.e + 32) / divisor;

    return divisor == 1 || !(fabs(slower) < 0x1p62)
               ? value
               : motion_real_from_q(llround(slower), 32);
}

static void fit_retime_key(const struct plan_axis *from, struct plan_axis *to,
                           uint32_t i)
{
    const bool first = i == 0, last = i + 1 == from->key_count;
    const double left = first && last ? 1
                        : first       ? fit_factor(from, to, i)
                                      : fit_factor(from, to, i - 1);
    const double right = last ? left : fit_factor(from, to, i);
    const double slower = fmax(left, right);

    to->key[i].key.has_vel = from->key[i].key.has_vel;
    to->key[i].key.has_acc = from->key[i].key.has_acc;
    to->key[i].key.vel = fit_slower(from->key[i].key.vel, slower);
    to->key[i].key.acc = fit_slower(from->key[i].key.acc, slower * slower);
    if (to->bezier.key == NULL)
        return;
    to->bezier.key[i].left.dt_ns_q12 =
        fit_scaled(from->bezier.key[i].left.dt_ns_q12, fmin(left, right));
    to->bezier.key[i].right.dt_ns_q12 =
        fit_scaled(from->bezier.key[i].right.dt_ns_q12, fmin(left, right));
}

static void fit_retime(struct fit *self)
{
    for (uint32_t a = 0; a < self->fit->axis_count; a++) {
        const struct plan_axis *from = &self->request->move->axis[a];
        struct plan_axis *to = &self->fit->axis[a];
        for (uint32_t i = 0; i < from->key_count; i++)
            to->key[i].key.t_ns_q12 =
                self->fit->to_ns_q12[fit_knot(self, from->key[i].key.t_ns_q12)];
        for (uint32_t i = 0; i < from->key_count; i++)
            fit_retime_key(from, to, i);
    }
}

/* --- plan and judge -------------------------------------------------------- */

/* What an axis needs, to all spans that lie in its own. */
static void fit_spread(struct fit *self, uint32_t a,
                       const struct plan_fit_need own[])
{
    const struct plan_axis *axis = &self->request->move->axis[a];

    for (uint32_t i = 0; i + 1 < axis->key_count; i++) {
        const uint32_t end = fit_knot(self, axis->key[i + 1].key.t_ns_q12);
        for (uint32_t k = fit_knot(self, axis->key[i].key.t_ns_q12); k < end;
             k++) {
            if (own[i].stretch <= self->need[k])
                continue;
            self->need[k] = own[i].stretch;
            self->axis_of[k] = a;
        }
    }
}

/* A violation that no duration cures is a reason to give up. */
static int fit_refuse_violation(const struct fit *self, uint32_t a,
                                const struct plan_violation *found)
{
    static const char *const text[] = {
        [PLAN_POS_LOW] = "goes below its lowest position",
        [PLAN_POS_HIGH] = "goes above its highest position",
        [PLAN_VEL_STEP] = "steps in velocity",
        [PLAN_ACC_STEP] = "steps in acceleration",
    };
    const bool steps =
        found->kind == PLAN_VEL_STEP || found->kind == PLAN_ACC_STEP;
    const struct plan_axis *axis = &self->request->move->axis[a];

    plan_error_set(self->error, MOTION_E_LIMIT, axis->place,
                   "axis %s %s at %.6g s, and a longer duration does not "
                   "help: %s would",
                   axis->name, text[found->kind], move_seconds(found->t_ns_q12),
                   steps ? "another curve, such as quintic or c4,"
                         : "other keys");
    self->error->axis = a;
    return MOTION_E_LIMIT;
}

static bool fit_is_cured_by_time(enum plan_violation_kind kind)
{
    return kind == PLAN_VEL || kind == PLAN_ACC || kind == PLAN_JERK;
}

/* The verdict of the checker on one axis: MOTION_OK with *fits. */
static int fit_judge(struct fit *self, uint32_t a,
                     const struct motion_track *track, bool *fits)
{
    const struct plan_limit *limit = &self->request->limit[a];
    const uint32_t count = plan_check_track(track, limit, NULL, 0);
    struct plan_violation *found;
    int err = MOTION_OK;

    if (count == 0)
        return MOTION_OK;
    *fits = false;
    found = calloc(count, sizeof *found);
    if (found == NULL)
        return fit_no_memory(self);
    plan_check_track(track, limit, found, count);
    for (uint32_t i = 0; i < count && err == MOTION_OK; i++)
        if (!fit_is_cured_by_time(found[i].kind))
            err = fit_refuse_violation(self, a, &found[i]);
    free(found);
    return err;
}

int fit_measure_axis(struct fit *self, uint32_t a, bool *fits)
{
    struct plan_axis *axis = &self->fit->axis[a];
    struct motion_track track;
    int err;

    while ((err = plan_axis_track(axis, &track, self->error)) == MOTION_OK &&
           plan_stand(axis, &track, &self->request->limit[a]) > 0)
        plan_track_free(&track);
    if (err < 0) {
        self->error->axis = a;
        return err;
    }
    plan_fit_span_needs(axis, &track, &self->request->limit[a], self->own);
    fit_spread(self, a, self->own);
    err = fit_judge(self, a, &track, fits);
    plan_track_free(&track);
    return err;
}

int fit_measure(struct fit *self, bool *fits)
{
    int err = MOTION_OK;

    *fits = true;
    self->fit->rounds++;
    fit_retime(self);
    for (uint32_t k = 0; k + 1 < self->fit->knots; k++) {
        self->need[k] = 0;
        self->axis_of[k] = PLAN_AXES_MAX;
    }
    for (uint32_t a = 0; a < self->fit->axis_count && err == MOTION_OK; a++)
        err = fit_measure_axis(self, a, fits);
    return err;
}

int fit_try(struct fit *self, const double dur_ns_q12[], bool *fits)
{
    const int err = fit_place(self, dur_ns_q12);

    return err < 0 ? err : fit_measure(self, fits);
}
