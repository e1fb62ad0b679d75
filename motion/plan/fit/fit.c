/* motion/plan/fit/fit.c - see fit.h.
 *
 * Knots are the times of all keys; spans lie between them.  A span has its
 * duration before, `from`, and after, `to`; the factor of an axis's own span is
 * the ratio of the two.  A key that gives a velocity goes slower by the larger
 * factor beside it, so that a uniform stretch is one to the last bit.
 *
 *   stretch  s = 1; plan; s *= what the worst span needs; again.  One round is
 *            enough where time scales all there is; corners of a given length
 *            and rounding take more.
 *   local    plan; multiply every span by what it needs, up to the duration
 *            that stretch gives it; again.  Spans only grow, so it ends.  Between
 *            two fixed keys: what spans need is taken from those with time left.
 *
 * A round that is not enough is followed by one with a larger margin. */
#include "motion/plan/fit/fit.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/fit/fit_internal.h"
#include "motion/plan/keys/move_internal.h"
#include "motion/plan/plan_error.h"

#define FIT_LEFT   0.9 /* of the time that spans have left may be taken */
#define FIT_BESIDE 16  /* spans on either side of one that needs more */

/* Above 1 by more with every round. */
static double fit_margin(unsigned round)
{
    return 1 + fmin(ldexp(1e-12, 3 * (int)round), 5e-2);
}

static int fit_give_up(const struct fit *self)
{
    return plan_error_set(self->error, MOTION_E_LIMIT,
                          (struct plan_place){ 0, 0 },
                          "no times were found within %u rounds that are "
                          "inside all limits",
                          self->fit->rounds);
}

/* --- fixed keys ------------------------------------------------------------ */

/* The first span from which on time is free: after the last fixed knot. */
static uint32_t fit_open_from(const struct fit *self)
{
    for (uint32_t k = self->fit->knots; k-- > 1;)
        if (self->is_fixed[k])
            return k;
    return 0;
}

/* Spans `from` .. `to` - 1 end at a fixed knot and cannot fit. */
static int fit_refuse_fixed(struct fit *self, uint32_t from, uint32_t to,
                            double needed_ns_q12)
{
    const int64_t at = self->fit->from_ns_q12[to];

    for (uint32_t a = 0; a < self->fit->axis_count; a++) {
        const struct plan_axis *axis = &self->request->move->axis[a];
        for (uint32_t i = 0; i < axis->key_count; i++)
            if (axis->key[i].key.t_ns_q12 == at &&
                (axis->key[i].fixed & PLAN_FIXED_TIME) != 0)
                return plan_error_set(
                    self->error, MOTION_E_LIMIT, axis->key[i].place,
                    "key %u of axis %s is fixed at %.6g s: from %.6g s up to "
                    "it %.6g s are needed, and there are %.6g s",
                    i + 1, axis->name, move_seconds(at),
                    move_seconds(self->fit->from_ns_q12[from]),
                    needed_ns_q12 / (double)MOTION_FIXED_S_Q12,
                    move_seconds(at - self->fit->from_ns_q12[from]));
    }
    return fit_give_up(self);
}

/* Spans of one section give time to those that need it.  Returns false when
 * they have too little; *needed is what they need together then. */
static bool fit_share(struct fit *self, uint32_t from, uint32_t to,
                      double margin, double *needed)
{
    double lacking = 0, left = 0;

    *needed = 0;
    for (uint32_t k = from; k < to; k++) {
        self->dur[k] = fit_to(self, k);
        const double least = self->dur[k] * self->need[k] * margin;
        *needed += least;
        if (self->need[k] > 1)
            lacking += least - self->dur[k];
        else
            left += fmax(self->dur[k] - least, 0);
    }
    if (lacking > FIT_LEFT * left)
        return false;
    for (uint32_t k = from; k < to && lacking > 0; k++) {
        const double least = self->dur[k] * self->need[k] * margin;
        if (self->need[k] > 1)
            self->dur[k] = least;
        else
            self->dur[k] -= fmax(self->dur[k] - least, 0) * lacking / left;
    }
    return true;
}

/* Every section that ends at a fixed knot. */
static int fit_share_all(struct fit *self, double margin)
{
    uint32_t from = 0;

    for (uint32_t k = 1; k <= self->open_from; k++) {
        double needed;
        if (!self->is_fixed[k])
            continue;
        if (!fit_share(self, from, k, margin, &needed))
            return fit_refuse_fixed(self, from, k, needed);
        from = k;
    }
    return MOTION_OK;
}

/* --- methods --------------------------------------------------------------- */

static double fit_worst(const struct fit *self, uint32_t from, uint32_t to)
{
    double worst = 0;

    for (uint32_t k = from; k < to; k++)
        worst = fmax(worst, self->need[k]);
    return worst;
}

/* What is before the last fixed knot keeps its times: the first section of it
 * that does not fit. */
static int fit_refuse_closed(struct fit *self)
{
    uint32_t from = 0;

    for (uint32_t k = 1; k <= self->open_from; k++) {
        const double need = fit_worst(self, from, k);
        if (!self->is_fixed[k])
            continue;
        if (need > 1)
            return fit_refuse_fixed(self, from, k,
                                    need *
                                        (double)(self->fit->from_ns_q12[k] -
                                                 self->fit->from_ns_q12[from]));
        from = k;
    }
    return fit_give_up(self);
}

/* Beside spans that keep their times longer ones make a curve swing: that is
 * not the reason where the former do not fit as they are. */
static int fit_refuse_as_written(struct fit *self)
{
    bool fits;

    for (uint32_t k = 0; k + 1 < self->fit->knots; k++)
        self->dur[k] = fit_from(self, k);
    const int err = fit_try(self, self->dur, &fits);
    return err < 0 ? err : fit_refuse_closed(self);
}

/* The durations of `stretch` are left in self->most. */
static int fit_stretch(struct fit *self)
{
    const uint32_t spans = self->fit->knots - 1;
    double stretch = 1;
    bool fits;
    int err = fit_measure(self, &fits);

    for (unsigned round = 0; err == MOTION_OK && !fits; round++) {
        const double need = fit_worst(self, self->open_from, spans);
        const bool is_closed = fit_worst(self, 0, self->open_from) > 1;
        if (is_closed && need <= 1)
            return fit_refuse_as_written(self);
        stretch *= fmax(need, 1) * fit_margin(round);
        if (round == PLAN_FIT_ROUNDS || stretch > PLAN_FIT_STRETCH_MAX)
            return fit_give_up(self);
        for (uint32_t k = 0; k < spans; k++)
            self->most[k] =
                fit_from(self, k) * (k < self->open_from ? 1 : stretch);
        err = fit_try(self, self->most, &fits);
        if (err == MOTION_E_LIMIT && is_closed)
            return fit_refuse_as_written(self);
    }
    return err;
}

/* Lengthen a span, up to what stretch gives it; false when it has that. */
static bool fit_lengthen_span(struct fit *self, uint32_t span, double by)
{
    const double dur = fmin(fit_to(self, span) * by, self->most[span]);

    if (!(dur > self->dur[span]))
        return false;
    self->dur[span] = dur;
    return true;
}

/* A span that is as long as it may be, and still needs more, is driven by what
 * is beside it: the next one on either side that may be longer. */
static bool fit_lengthen_beside(struct fit *self, uint32_t span, double by)
{
    const uint32_t spans = self->fit->knots - 1;
    bool left = false, right = false;

    for (uint32_t k = 1; k <= FIT_BESIDE; k++) {
        left = left || (span >= self->open_from + k &&
                        fit_lengthen_span(self, span - k, by));
        right = right ||
                (k < spans - span && fit_lengthen_span(self, span + k, by));
    }
    return left || right;
}

/* What open spans need; false when there was nothing to lengthen. */
static bool fit_lengthen(struct fit *self, double margin)
{
    bool longer = false;

    for (uint32_t k = self->open_from; k + 1 < self->fit->knots; k++) {
        const double by = self->need[k] * margin;
        if (self->need[k] > 1)
            longer = fit_lengthen_span(self, k, by) ||
                     fit_lengthen_beside(self, k, by) || longer;
    }
    return longer;
}

/* As stretch does it, which fits. */
static int fit_as_stretched(struct fit *self)
{
    bool fits;
    const int err = fit_try(self, self->most, &fits);

    return err < 0 || fits ? err : fit_give_up(self);
}

static int fit_rounds(struct fit *self)
{
    bool fits;
    int err = fit_try(self, self->dur, &fits);

    for (unsigned round = 0; err == MOTION_OK && !fits; round++) {
        const double margin = fit_margin(round);
        if (round == PLAN_FIT_ROUNDS)
            return fit_give_up(self);
        err = fit_share_all(self, margin);
        if (err == MOTION_OK && !fit_lengthen(self, margin) &&
            self->open_from == 0)
            return fit_give_up(self);
        if (err == MOTION_OK)
            err = fit_try(self, self->dur, &fits);
    }
    return err;
}

static int fit_local(struct fit *self)
{
    const uint32_t spans = self->fit->knots - 1;
    const int stretched = fit_stretch(self);
    struct plan_error before = *self->error;
    int err;

    if (stretched < 0 && self->open_from == 0)
        return stretched;
    for (uint32_t k = 0; k < spans; k++) {
        self->dur[k] = fit_from(self, k);
        if (stretched < 0) /* where fixed keys keep stretch from fitting */
            self->most[k] = PLAN_FIT_STRETCH_MAX * self->dur[k];
    }
    err = fit_rounds(self);
    if (err == MOTION_OK || stretched < 0)
        return err;
    *self->error = before;
    return fit_as_stretched(self);
}

/* --- memory and order ------------------------------------------------------ */

const char *plan_fit_more(const struct plan_move *move)
{
    const struct {
        bool is;
        const char *what;
    } more[] = {
        { move->path != NULL, "a path" },
        { move->camera != NULL, "a camera" },
        { move->blend != NULL, "a blend" },
        { move->layers > 0, "layers" },
        { move->fade != NULL, "a fade" },
        { move->warp != NULL, "a warp" },
        { move->shoot != NULL, "a shoot" },
        { move->duration_ns_q12 != 0, "a duration" },
        { move->pre_roll_ns_q12 != 0, "a pre_roll" },
        { move->post_roll_ns_q12 != 0, "a post_roll" },
    };

    for (size_t i = 0; i < sizeof more / sizeof *more; i++)
        if (more[i].is)
            return more[i].what;
    for (uint32_t a = 0; a < move->axis_count; a++) {
        const struct plan_axis *axis = &move->axis[a];
        if (axis->driver != PLAN_BY_KEYS || axis->key_count == 0)
            return "an axis without keys";
        if (move_has_cycles(axis))
            return "an axis with cycles or an end of its own";
        if (axis->key[0].key.t_ns_q12 < 0)
            return "keys before time 0";
    }
    return move->axis_count > 0 ? NULL : "no axes";
}

static int fit_check(const struct fit *self)
{
    const struct plan_move *move = self->request->move;
    const char *const more = plan_fit_more(move);

    if (more != NULL)
        return plan_error_set(
            self->error, MOTION_E_ARG, (struct plan_place){ 0, 0 },
            "the move has %s, expected one of keys alone", more);
    for (uint32_t a = 0; a < move->axis_count; a++)
        for (uint32_t i = 1; i < move->axis[a].key_count; i++)
            if (move->axis[a].key[i].key.t_ns_q12 <=
                move->axis[a].key[i - 1].key.t_ns_q12)
                return plan_error_set(self->error, MOTION_E_ORDER,
                                      move->axis[a].key[i].place,
                                      "key %u of axis %s is not later than "
                                      "the one before",
                                      i + 1, move->axis[a].name);
    return MOTION_OK;
}

static int fit_by_time(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;

    return (x > y) - (x < y);
}

static uint32_t fit_most_keys(const struct plan_move *move, size_t *all)
{
    uint32_t most = 0;

    *all = 0;
    for (uint32_t a = 0; a < move->axis_count; a++) {
        const uint32_t keys = move->axis[a].key_count;
        most = keys > most ? keys : most;
        *all += keys;
    }
    return most;
}

static void *fit_copy(const void *from, size_t count, size_t size)
{
    void *to = malloc(count * size);

    if (to != NULL)
        memcpy(to, from, count * size);
    return to;
}

static bool fit_copy_axes(struct fit *self)
{
    const struct plan_move *move = self->request->move;

    for (uint32_t a = 0; a < move->axis_count; a++) {
        const struct plan_axis *from = &move->axis[a];
        struct plan_axis *to = &self->fit->axis[a];
        *to = *from;
        self->fit->axis_count = a + 1;
        to->bezier.key = NULL;
        to->key = fit_copy(from->key, from->key_count, sizeof *to->key);
        if (to->key == NULL)
            return false;
        if (from->bezier.key == NULL)
            continue;
        to->bezier.key =
            fit_copy(from->bezier.key, from->key_count, sizeof *to->bezier.key);
        if (to->bezier.key == NULL)
            return false;
    }
    return true;
}

/* All times of keys, each once. */
static void fit_gather(struct fit *self)
{
    const struct plan_move *move = self->request->move;
    int64_t *const t = self->fit->from_ns_q12;
    size_t all = 0, kept = 0;

    for (uint32_t a = 0; a < move->axis_count; a++)
        for (uint32_t i = 0; i < move->axis[a].key_count; i++)
            t[all++] = move->axis[a].key[i].key.t_ns_q12;
    qsort(t, all, sizeof *t, fit_by_time);
    for (size_t i = 0; i < all; i++)
        if (kept == 0 || t[i] != t[kept - 1])
            t[kept++] = t[i];
    self->fit->knots = (uint32_t)kept;
    memcpy(self->fit->to_ns_q12, t, kept * sizeof *t);
    for (uint32_t a = 0; a < move->axis_count; a++)
        for (uint32_t i = 0; i < move->axis[a].key_count; i++)
            if ((move->axis[a].key[i].fixed & PLAN_FIXED_TIME) != 0)
                self->is_fixed[fit_knot(
                    self, move->axis[a].key[i].key.t_ns_q12)] = true;
    self->open_from = fit_open_from(self);
    for (uint32_t k = 0; k + 1 < self->fit->knots; k++)
        self->dur[k] = self->most[k] = fit_from(self, k);
}

static int fit_open(struct fit *self)
{
    const struct plan_move *move = self->request->move;
    struct plan_fit *fit = self->fit;
    size_t all;
    const uint32_t keys = fit_most_keys(move, &all);

    fit->axis = calloc(move->axis_count, sizeof *fit->axis);
    fit->from_ns_q12 = calloc(all, sizeof *fit->from_ns_q12);
    fit->to_ns_q12 = calloc(all, sizeof *fit->to_ns_q12);
    fit->by_axis = calloc(all, sizeof *fit->by_axis);
    self->axis_of = calloc(all, sizeof *self->axis_of);
    self->is_fixed = calloc(all, sizeof *self->is_fixed);
    self->need = calloc(all, sizeof *self->need);
    self->dur = calloc(all, sizeof *self->dur);
    self->most = calloc(all, sizeof *self->most);
    self->own = calloc(keys, sizeof *self->own);
    if (fit->axis == NULL || fit->from_ns_q12 == NULL ||
        fit->to_ns_q12 == NULL || fit->by_axis == NULL ||
        self->axis_of == NULL || self->is_fixed == NULL || self->need == NULL ||
        self->dur == NULL || self->most == NULL || self->own == NULL ||
        !fit_copy_axes(self))
        return fit_no_memory(self);
    fit_gather(self);
    return MOTION_OK;
}

static void fit_close(struct fit *self)
{
    free(self->axis_of);
    free(self->is_fixed);
    free(self->need);
    free(self->dur);
    free(self->most);
    free(self->own);
}

/* Which axis needed most of each span as it was. */
static int fit_first(struct fit *self, bool *fits)
{
    const int err = fit_measure(self, fits);

    for (uint32_t k = 0; k + 1 < self->fit->knots; k++)
        self->fit->by_axis[k] =
            self->need[k] > 1 ? self->axis_of[k] : PLAN_AXES_MAX;
    return err;
}

int plan_fit_solve(const struct plan_fit_request *request, struct plan_fit *fit,
                   struct plan_error *error)
{
    struct fit self = { .request = request, .fit = fit, .error = error };
    bool fits = false;
    int err;

    *fit = (struct plan_fit){ .axis_count = 0 };
    *error = (struct plan_error){ .axis = PLAN_AXES_MAX };
    err = fit_check(&self);
    if (err == MOTION_OK)
        err = fit_open(&self);
    if (err == MOTION_OK)
        err = fit_first(&self, &fits);
    if (err == MOTION_OK && !fits)
        err = request->method == PLAN_FIT_SMOOTH  ? fit_smooth(&self)
              : request->method == PLAN_FIT_LOCAL ? fit_local(&self)
                                                  : fit_stretch(&self);
    fit_close(&self);
    if (err < 0)
        plan_fit_free(fit);
    return err;
}

void plan_fit_free(struct plan_fit *fit)
{
    for (uint32_t a = 0; a < fit->axis_count; a++)
        plan_axis_free(&fit->axis[a]);
    free(fit->axis);
    free(fit->from_ns_q12);
    free(fit->to_ns_q12);
    free(fit->by_axis);
    *fit = (struct plan_fit){ .axis_count = 0 };
}
